"""What a camera's whole picture may be off by from its calibration on: its zoom, its turn, a stretch, and how its lens
bends it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
#: as targets of a written law name them
SHIFT_U, SHIFT_V, ZOOM, TURN, STRETCH, RADIAL, DECENTRING, SKEW = BENDS = (
    "picture_u", "picture_v", "picture_zoom", "picture_turn", "picture_stretch", "picture_radial", "picture_decentring",
    "picture_skew",
)  # fmt: skip
#: those that somebody who touches a camera makes, and that no window or pose takes
CHANGES = (ZOOM, TURN, STRETCH, RADIAL, DECENTRING, SKEW)
#: those with a direction in the picture, from u to v, and which turn of it (rad) leaves them as they were
PERIODS_RAD = {STRETCH: np.pi, DECENTRING: 2 * np.pi}


def bend_px(target: str, direction_rad: float, place_px: Array) -> Array:
    """How places in a picture move with a unit of what a target names.

    Parameters
    ----------
    target
        One of ``BENDS``: a shift (px) along u or v; the share of a zoom; the angle of a turn (rad, from u to v); the
        share by which the picture is longer along a direction and shorter across it; what the square of the distance
        makes of the zoom (1/px^2; Brown's first radial term); how far a lens sits off its axis along a direction (1/px;
        Brown's decentring); the share of its place along v by which a skewed picture lies further along u.
    direction_rad
        Of a stretch or a decentring, in the picture, from u to v.
    place_px
        Places (N, 2) from the principal point.

    Returns
    -------
    Moves (N, 2) in pixels, for a unit of the target.

    Examples
    --------
    >>> bend_px("picture_turn", 0.0, np.array([[100.0, 0.0]])).tolist()
    [[-0.0, 100.0]]
    """
    u, v = place_px.T
    c, s = np.cos(direction_rad), np.sin(direction_rad)
    if target in (SHIFT_U, SHIFT_V):
        return np.repeat([[float(target == SHIFT_U), float(target == SHIFT_V)]], len(place_px), 0)
    if target == ZOOM:
        return place_px.copy()
    if target == TURN:
        return np.column_stack([-v, u])
    if target == STRETCH:
        c, s = c * c - s * s, 2 * c * s
        return np.column_stack([c * u + s * v, s * u - c * v])
    square = u * u + v * v
    if target == RADIAL:
        return np.asarray(square[:, None] * place_px)
    if target == DECENTRING:
        along = c * u + s * v
        return np.column_stack([square * c + 2 * along * u, square * s + 2 * along * v])
    if target == SKEW:
        return np.column_stack([v, 0.0 * v])
    raise ValueError(target)
