"""Noise of the markers: white, correlated from frame to frame, or with a lens residual."""

from dataclasses import dataclass

import numpy as np


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
