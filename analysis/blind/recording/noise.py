"""Noise of the markers: white, correlated from frame to frame, or with a lens residual; outliers and gaps."""

from dataclasses import dataclass

import numpy as np

from analysis.blind.recording.views import WINDOW_PX


@dataclass(frozen=True)
class Noise:
    """Marker noise. `kind`: "white", "ar1" (correlated from frame to frame) or "warp" (a lens residual
    besides white noise)."""

    kind: str
    sd_px: float
    correlation: float
    warp_px: float
    warp_length_px: np.ndarray  # (2,)
    warp_phase_rad: np.ndarray  # camera, coordinate, axis
    missing: float = 0.008
    gaps_per_run: float = 5.0
    outliers: float = 0.001
    outlier_px: float = 3.0


def draw_noise(kind: str, rng: np.random.Generator) -> Noise:
    """Noise of the practice series: 0.05 to 0.36 px, most near 0.11."""
    sd = float(np.clip(0.11 * np.exp(rng.normal(0.0, 0.5)), 0.05, 0.36))
    return Noise(
        kind,
        sd,
        rng.uniform(0.5, 0.7) if kind == "ar1" else 0.0,
        rng.uniform(0.2, 0.3) if kind == "warp" else 0.0,
        rng.uniform([170.0, 135.0], [230.0, 185.0]),
        rng.uniform(0.0, 2.0 * np.pi, (2, 2, 2)),
    )


def draw_errors(shape: tuple[int, ...], noise: Noise, rng: np.random.Generator) -> np.ndarray:
    """Errors (frames, ...) [px] of markers: white, or correlated from frame to frame (`ar1`), of sd ``noise.sd_px``."""
    fresh = rng.normal(0.0, noise.sd_px, shape)
    if noise.kind == "ar1":
        for i in range(1, shape[0]):
            fresh[i] = noise.correlation * fresh[i - 1] + np.sqrt(1.0 - noise.correlation**2) * fresh[i]
    return fresh


def lens_residual(pixels: np.ndarray, index: int, noise: Noise) -> np.ndarray:
    """Pixels (frames, markers, 2) of camera `index` with what its calibration leaves of the lens (`warp`)."""
    if noise.kind != "warp":
        return pixels
    u, v = pixels[..., 0] / noise.warp_length_px[0], pixels[..., 1] / noise.warp_length_px[1]
    phase = noise.warp_phase_rad[index]
    return pixels + noise.warp_px * np.stack([np.sin(u + q[0]) * np.sin(v + q[1]) for q in phase], axis=-1)


def draw_outliers(shape: tuple[int, ...], noise: Noise, rng: np.random.Generator) -> np.ndarray:
    """How far each marker in each frame (frames, markers) is a stray, px; most by nothing."""
    stray = rng.random(shape) < noise.outliers
    return stray * rng.normal(0.0, noise.outlier_px, stray.shape)


def draw_missing(pixels: np.ndarray, noise: Noise, rng: np.random.Generator) -> np.ndarray:
    """Which markers are seen in which frames (frames, markers): those in the window (`pixels` from its corner), but for
    single ones and for gaps of 5 to 40 frames."""
    seen = rng.random(pixels.shape[:2]) > noise.missing
    seen &= np.all((pixels > 0) & (pixels < np.array(WINDOW_PX) - 1), axis=-1)
    for _ in range(rng.poisson(0.5 * noise.gaps_per_run)):
        start = rng.integers(len(pixels))
        seen[start : start + rng.integers(5, 41), rng.integers(pixels.shape[1])] = False
    return seen
