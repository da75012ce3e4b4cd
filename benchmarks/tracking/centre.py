"""How exact a marker's centre is, against the Cramer-Rao bound: RMS error, bias, and whether the sd tells the truth.

    python benchmarks/tracking/centre.py [--pictures 150] [--seed 1] [--only photon]

Discs drawn on an eight times finer grid, blurred there, averaged over pixels (not the estimator's own model), with
noise and rounding to whole greys.  ``bound``: 1.062 (noise / contrast) sqrt(blur / radius), rounding's 1/12 in the
noise and the pixel's own 1/12 in the blur.  ``inside``: share of errors within 1.645 sd, 90 % if the sd is honest.  The
bias is known to RMS / sqrt(pictures) only.
"""

from __future__ import annotations

import argparse

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from vision.markers.fit import fit_discs
from vision.markers.row import OK, SD, U, disc_start

FINE = 8
# name: radius, blur, contrast, noise, background, slope of the light per px, what a pixel's noise gains per grey
# (photons), full scale
CASES: dict[str, tuple[float, float, float, float, float, tuple[float, float], float, int]] = {
    "R 4": (4, 0.85, 180, 2, 60, (0, 0), 0, 255),
    "R 4, blur 1.5": (4, 1.5, 180, 2, 60, (0, 0), 0, 255),
    "R 6": (6, 0.85, 180, 2, 60, (0, 0), 0, 255),
    "R 9, sharp": (9, 0.6, 180, 2, 60, (0, 0), 0, 255),
    "R 13": (13, 0.85, 180, 2, 60, (0, 0), 0, 255),
    "R 13, dark": (13, 0.85, -100, 4, 200, (0, 0), 0, 255),
    "R 20, blur 1.5": (20, 1.5, 180, 2, 60, (0, 0), 0, 255),
    "R 9, contrast 40": (9, 0.85, 40, 4, 60, (0, 0), 0, 255),
    "R 9, slope 1.5 %/px": (9, 0.85, 120, 2, 60, (0.015, 0.01), 0, 255),
    "R 6 dark, slope 1.5 %/px": (6, 0.85, -90, 2, 130, (0.015, 0.01), 0, 255),
    "R 9, white cut off": (9, 0.85, 250, 2, 60, (0, 0), 0, 255),
    "R 9 dark, background cut off": (9, 0.85, -200, 2, 265, (0, 0), 0, 255),
    "R 9, black cut off": (9, 0.85, 180, 2, -5, (0, 0), 0, 255),
    "R 9, 12 bit": (9, 0.85, 2400, 30, 800, (0, 0), 0, 4095),
    "R 9, photon noise": (9, 0.85, 180, 2, 40, (0, 0), 0.15, 255),
    "R 9 dark, photon noise": (9, 0.85, -180, 2, 220, (0, 0), 0.15, 255),
}


def picture(
    case: tuple[float, float, float, float, float, tuple[float, float], float, int], rng: np.random.Generator
) -> tuple[NDArray[np.integer], NDArray[np.float64]]:
    """A picture and the disc's centre in it."""
    radius, blur, contrast, noise, level, slope, photons, full = case
    size = 2 * int(np.ceil(radius + 8)) + 1
    centre = (size - 1) / 2 + rng.uniform(-0.5, 0.5, 2)
    fine = (np.arange(size * FINE) + 0.5) / FINE - 0.5
    x, y = np.meshgrid(fine - centre[0], fine - centre[1])
    disc = gaussian_filter(np.clip((radius - np.hypot(x, y)) * FINE + 0.5, 0, 1), blur * FINE, truncate=5)
    light = (level + contrast * disc) * (1 + slope[0] * x + slope[1] * y)
    grey = light.reshape(size, FINE, size, FINE).mean((1, 3))
    grey = grey + rng.normal(0, 1, grey.shape) * np.sqrt(noise**2 + photons * np.maximum(grey, 0))
    return np.clip(np.rint(grey), 0, full).astype(np.uint8 if full == 255 else np.uint16), centre


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--pictures", type=int, default=150)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="cases whose name holds this")
    args = parser.parse_args()
    rng = np.random.default_rng(args.seed)
    print(f"{'case':30s} rms px   of the bound  bias px  +-      inside")
    for name, case in ((name, case) for name, case in CASES.items() if args.only in name):
        radius, blur, contrast, noise, level, _, photons, full = case
        error, sd = [], []
        for _ in range(args.pictures):
            image, centre = picture(case, rng)
            start = disc_start(
                *(centre + rng.uniform(-0.8, 0.8, 2)), radius * rng.uniform(0.9, 1.1), np.clip(level, 0, full), contrast
            )
            fit = fit_discs(image, start[None])[0]
            if fit[OK]:
                error.append(fit[U : U + 2] - centre)
                sd.append(fit[SD])
        errors, sds = np.array(error), np.array(sd)
        rms = float(np.sqrt((errors**2).mean()))
        middle = np.sqrt(noise**2 + photons * max(level + contrast / 2, 0) + 1 / 12)  # noise at the edge
        bound = 1.062 * middle / abs(contrast) * np.sqrt(np.sqrt(blur**2 + 1 / 12) / radius)
        print(
            f"{name:30s} {rms:.4f} {rms / bound:8.2f}       {np.abs(errors.mean(0)).max():.4f}  "
            f"{rms / np.sqrt(len(errors)):.4f}"
            f"  {np.mean(np.abs(errors) < 1.645 * sds[:, None]):6.1%}"
            + (f"  {args.pictures - len(errors)} refused" if len(errors) < args.pictures else ""),
            flush=True,
        )


if __name__ == "__main__":
    main()
