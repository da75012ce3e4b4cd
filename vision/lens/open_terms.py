"""What rigid bodies on a plane cannot tell of a lens field, because poses and calibration absorb it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ovines.camera import Camera, baseline
from vision.lens.lattice import Lattice
from vision.lens.residuals import StereoObservations

Array = NDArray[np.float64]

# What a field does to points: a shift and a turn of all of them, a scale, a tilt of the plane (height per length), all
# along the line between the cameras and across it, whatever the world's axes; and what it does to the second camera
# alone, like a window that lies elsewhere.
OPEN_TERMS = (
    "shift_along_m",
    "shift_across_m",
    "shift_up_m",
    "turn_rad",
    "scale",
    "plane_along",
    "plane_across",
    "window_u_px",
    "window_v_px",
)
MOST_PLACES = 3000


def open_terms(lattices: Sequence[Lattice], cameras: Sequence[Camera], runs: Sequence[StereoObservations]) -> Array:
    """How much of each of ``OPEN_TERMS`` a field holds where the bodies went, per spline: (9, P).

    By least squares over the places of all markers, the terms together; about the middle of those places.
    """
    pixels = np.concatenate([one.uv_px[:, one.body >= 0].reshape(-1, 2, 2) for one in runs])
    points = np.concatenate([one.points_m[:, one.body >= 0].reshape(-1, 3) for one in runs])
    seen = np.flatnonzero(np.isfinite(pixels).all((-1, -2)))
    seen = seen[:: max(1, len(seen) // MOST_PLACES)]
    pixels, points = pixels[seen], points[seen]
    moves = term_pixels(points, cameras)
    rows = moves.reshape(-1, len(OPEN_TERMS))
    # A solver of least squares takes each spline for a right side of its own, most of it nothing: by the nine terms'
    # inverse it is one product.  The smallest number that counts is such a solver's.
    fitted = np.linalg.pinv(rows, rcond=np.finfo(float).eps * len(rows)).reshape(len(OPEN_TERMS), -1, 4)
    held = []
    for c, lattice in enumerate(lattices):
        basis = lattice.basis(pixels[:, c])
        held += [fitted[:, :, 2 * c + axis] @ basis for axis in range(2)]
    return np.concatenate(held, 1)


def term_pixels(points_m: Array, cameras: Sequence[Camera]) -> Array:
    """Pixels (n, 4, 9) of both cameras, u and v, that a unit of each term moves points (n, 3) by."""
    jacobian = np.concatenate([camera.project_with_jacobian(points_m)[1] for camera in cameras], 1)
    x, y = (points_m[:, :2] - points_m[:, :2].mean(0)).T
    c, s = baseline(cameras)
    zero, one = 0 * x, 1 + 0 * x
    moved = [(c * one, s * one, zero), (-s * one, c * one, zero), (zero, zero, one), (-y, x, zero), (x, y, zero)]
    moved += [(zero, zero, c * x + s * y), (zero, zero, c * y - s * x)]
    by_world = jacobian @ np.stack([np.stack(each, -1) for each in moved], -1)
    window = np.zeros((len(x), 4, 2))
    window[:, 2, 0] = window[:, 3, 1] = 1.0
    return np.concatenate([by_world, window], -1)
