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
from vision.lens.residuals import Sightings

Array = NDArray[np.float64]

# Pixels per pixel.  The largest and shortest field that is believed of a lens beforehand (0.7 px over 150 px,
# `AMPLITUDES_PX` and `LENGTHS_PX`) has slopes of sd 0.005; this is twice that.  Fields of smooth residuals of 0.2 to
# 0.35 px reached 0.0015 (four series), a marker that gives way by 0.3 mm over 16 mm 0.016 to 0.020 (three).
MOST_STRETCH = 0.01
# What the calibration leaves open may stretch it by so many of its sds beside.
CALIBRATION_SD = 3.0
# From this share of the bound on, twice what those lenses reached, a field that no other marker asks for is none of a
# lens.
SUSPECT = 0.3


@dataclass(frozen=True)
class Stretched:
    """The number of a marker, and how much a field stretches its way ``over`` what a lens may do."""

    marker: int
    over: float


NOT_STRETCHED = Stretched(-1, 0.0)


def most_stretched(
    runs: Sequence[Sightings], lattices: Sequence[Lattice], mean: Array, calibration: Array
) -> Stretched:
    """The marker of a moving body along whose way fields ``mean`` (P,) [px] stretch most, against what a lens, and
    what the ``calibration`` (P, P) leaves open, may do."""
    worst = NOT_STRETCHED
    for m in np.flatnonzero(runs[0].body >= 0):
        at = 0
        for c, lattice in enumerate(lattices):
            pixels = np.concatenate([one.uv_px[:, m, c] for one in runs])
            slope = _slope(pixels[np.isfinite(pixels[:, 0])], lattice)
            own = [slice(at + k * lattice.size, at + (k + 1) * lattice.size) for k in range(2)]
            at += 2 * lattice.size
            stretch = float(np.hypot(*(slope @ mean[part] for part in own)))
            open_sd = float(np.sqrt(sum(slope @ calibration[part, part] @ slope for part in own)))
            over = stretch / (MOST_STRETCH + CALIBRATION_SD * open_sd)
            worst = max(worst, Stretched(int(m), over), key=lambda one: one.over)
    return worst


def _slope(pixels: Array, lattice: Lattice) -> Array:
    """What the splines (size,) add to the slope of a field over the way of ``pixels`` (n, 2), along its longest axis;
    zero of fewer than two."""
    if len(pixels) < 2:
        return np.zeros(lattice.size)
    off = pixels - pixels.mean(0)
    along = off @ np.linalg.eigh(off.T @ off)[1][:, 1]
    return np.asarray(lattice.basis(pixels).T @ (along / max(float(along @ along), 1e-12)), float)
