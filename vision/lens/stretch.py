"""How much a lens field stretches the picture along a marker's way: more than any lens does means that the marker moves
on its body.

Under a sine drive what bends with the Host's acceleration moves like the Host itself, and a field takes it for a
picture that is stretched where this marker goes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vision.lens.lattice import Lattice
from vision.lens.residuals import StereoObservations

Array = NDArray[np.float64]

# Pixels per pixel.  The largest and shortest field that is believed of a lens beforehand (0.7 px over 150 px,
# `AMPLITUDES_PX` and `LENGTHS_PX`) has slopes of sd 0.005; this is twice that.  Fields of smooth residuals of 0.14 to
# 0.45 px reached 0.0018 (eight series of the blind plant), a marker that gives way by 0.35 mm RMS 0.016 to 0.020
# (three).
MOST_STRETCH = 0.01
# What the calibration leaves open may stretch it by so many of its sds beside.
CALIBRATION_SD = 3.0
# From this share of the bound on, more than those lenses reached, the fields that all other markers ask for are held
# against it: beyond so many of their sds they are not the same lens.  Lenses were within 1.8 sds (eight series),
# markers that give way by 0.1 mm RMS beside one beyond 17 (three).
SUSPECT, ODDS_SD = 0.3, 5.0


@dataclass(frozen=True, eq=False)
class Stretched:
    """The number of a marker whose way a field stretches ``over`` what a lens may do: by ``stretch`` (2,) along u and v
    of the camera that shows more of it, which is ``along`` (2, P) times the fields."""

    marker: int
    over: float
    stretch: Array
    along: Array


NOT_STRETCHED = Stretched(-1, 0.0, np.zeros(2), np.zeros((2, 0)))


def most_stretched(
    runs: Sequence[StereoObservations], lattices: Sequence[Lattice], mean: Array, calibration: Array
) -> Stretched:
    """The marker of a moving body along whose way fields ``mean`` (P,) [px] stretch most, against what a lens, and
    what the ``calibration`` (P, P) leaves open, may do."""
    worst = NOT_STRETCHED
    for m in np.flatnonzero(runs[0].body >= 0):
        at = 0
        for c, lattice in enumerate(lattices):
            pixels = np.concatenate([one.uv_px[:, m, c] for one in runs])
            slope = _slope(pixels[np.isfinite(pixels[:, 0])], lattice)
            along = np.zeros((2, len(mean)))
            for axis in range(2):
                along[axis, at : at + lattice.size] = slope
                at += lattice.size
            stretch = along @ mean
            open_sd = float(np.sqrt(np.trace(along @ calibration @ along.T)))
            over = float(np.linalg.norm(stretch)) / (MOST_STRETCH + CALIBRATION_SD * open_sd)
            if over > worst.over:
                worst = Stretched(int(m), over, stretch, along)
    return worst


def _slope(pixels: Array, lattice: Lattice) -> Array:
    """What the splines (size,) add to the slope of a field over the way of ``pixels`` (n, 2), along its longest axis;
    zero of fewer than two."""
    if len(pixels) < 2:
        return np.zeros(lattice.size)
    off = pixels - pixels.mean(0)
    along = off @ np.linalg.eigh(off.T @ off)[1][:, 1]
    return np.asarray(lattice.basis(pixels).T @ (along / max(float(along @ along), 1e-12)), float)
