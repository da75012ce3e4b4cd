"""Rims from images against the truth: radius, centre and height of Host and NES in rendered scenes of other light,
blur, tilt, wall and lens.

    python benchmarks/tracking/walls.py [--places 4] [--only half]

Per scene and body: errors of the radius at each place of the bodies [um], the sd that ``vision.walls.rims`` gives, RMS
error of the centre and its sd.  Last: share of errors within 1.645 sd (honest: 90 %) of x, y, z and the radius.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from film_kinds import BANDS, FAINT, GLARES, WINDOW_PX, high_wall, light_on_dark, seen_from

from vision.rendering.images import Look, View, render_frame
from vision.rendering.recording import Setup, half_setup, thesis_setup
from vision.rendering.scene import Pose
from vision.walls.rims import fit_rim

Change = Callable[[Setup], Setup]


def same(setup: Setup) -> Setup:
    return setup


def low_nes(setup: Setup) -> Setup:
    return replace(setup, rig=replace(setup.rig, nes_height_m=0.006))


SCENES: dict[str, tuple[Change | None, Look]] = {  # no change: half the resolution
    "plain": (same, Look()),
    "blur of 1.5 px": (same, Look(blur_px=1.5)),
    "noise of 6 greys": (same, Look(noise_grey=6.0)),
    "blur of 0.5 px": (same, Look(blur_px=0.5)),
    "half the resolution": (None, Look()),
    "light from one side": (same, Look(gradient=(0.8, -0.5))),
    "shadow bands": (same, Look(bands=BANDS)),
    "glare": (same, Look(glares=GLARES)),
    "light on dark": (light_on_dark, Look()),
    "a quarter of the light": (same, FAINT),
    "60 degrees apart": (seen_from(0.52, 1.2, 6300.0), Look()),
    "leaning 50 degrees": (seen_from(0.87, 1.2, 6300.0), Look()),
    "wall of 20 mm": (high_wall, Look()),
    "longer lens": (seen_from(0.36, 1.0, 7600.0), Look()),
    "low NES": (low_nes, Look()),
    "nearly upright": (seen_from(0.1, 1.2, 6300.0), Look()),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--places", type=int, default=4)
    parser.add_argument("--only", default="", help="scenes whose name holds this")
    args = parser.parse_args()
    every: dict[str, list[np.ndarray]] = {"host": [], "nes": []}
    for k, (name, (change, look)) in enumerate(SCENES.items()):
        if args.only in name:
            for body, found in errors(change, look, args.places, 100 + k).items():
                every[body].append(found)
                radii = " ".join(f"{value:7.2f}" for value in found[:, 3])
                print(
                    f"{name:24s} {body:4s} radius {radii}  sd {found[:, 7].mean():5.2f}   centre "
                    f"{np.sqrt(np.mean(found[:, :2] ** 2)):5.2f}"
                    f"  sd {found[:, 4:6].mean():5.2f}",
                    flush=True,
                )
    for body, parts in every.items():
        both = np.concatenate(parts)
        inside = np.mean(np.abs(both[:, :4]) < 1.645 * both[:, 4:], axis=0)
        print(
            f"{body}: radius RMS {np.sqrt(np.mean(both[:, 3] ** 2)):.2f} um; inside 1.645 sd: "
            + ", ".join(f"{share:.0%}" for share in inside)
        )


def errors(change: Change | None, look: Look, places: int, seed: int) -> dict[str, np.ndarray]:
    """Per body (places found, 8): errors of x, y, z, radius and their sds [um]."""
    rng = np.random.default_rng(seed)
    setup = half_setup(rng) if change is None else change(replace(thesis_setup(rng, WINDOW_PX)))
    views = [
        View(camera, offset, setup.window_size_px)
        for camera, offset in zip(setup.cameras, setup.window_offset_px, strict=True)
    ]
    found: dict[str, list[np.ndarray]] = {"host": [], "nes": []}
    for _ in range(places):
        host = np.array([0.02, -0.028]) + rng.uniform(-0.008, 0.008, 2)
        reach, azimuth = rng.uniform(0, 0.034), rng.uniform(0, 6.28)
        nes = host + reach * np.array([np.cos(azimuth), np.sin(azimuth)])
        turn = rng.uniform(0, 6)
        images = [
            render_frame(view, setup.rig, [{"host": Pose(*host), "nes": Pose(*nes, 0.0, turn)}], look, rng)[0]
            for view in views
        ]
        for body, centre, height_m, radius_m in (
            ("host", host, setup.rig.wall_height_m, 0.05),
            ("nes", nes, setup.rig.nes_height_m, 0.01),
        ):
            rim = fit_rim(
                images,
                setup.cameras,
                setup.window_offset_px,
                np.array([*centre + 1e-4, height_m + 2e-4]),
                radius_m,
                0.06,
            )
            if rim is not None:
                off = [*(rim.centre_m - [*centre, height_m]), rim.radius_m - radius_m]
                found[body].append(1e6 * np.array([*off, *rim.sd_m]))
    return {body: np.array(rows).reshape(-1, 8) for body, rows in found.items()}


if __name__ == "__main__":
    main()
