"""What boards that were not true make of every camera that was calibrated on them: a print that is longer along one
direction, a plate that was bowed.  All cameras are wrong together, and the world with them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ovines.camera.model import Camera

Array = NDArray[np.float64]
#: as targets of a written law name them
BOARD_STRETCH, BOARD_BOW = BOARDS = ("board_stretch", "board_bow")


def board_move_m(target: str, x: float, y: float, place_m: Array) -> Array:
    """How far from their true places a unit of what a target names has points measured.

    Parameters
    ----------
    target
        ``board_stretch``: the share by which lengths come out too long along the direction ``x`` (rad), along it only;
        ``board_bow``: the share by which places come out too far from the place (``x``, ``y``) (m), by the square of
        their distance from it (1/m^2): what a plate that is bowed makes of lengths to first order.
    place_m
        True places (N, 2) on the world's plane.

    Returns
    -------
    Moves (N, 2) in metres, for a unit of the target.

    Examples
    --------
    >>> board_move_m("board_stretch", 0.0, 0.0, np.array([[0.05, 0.02]])).tolist()
    [[0.05, 0.0]]
    """
    if target == BOARD_STRETCH:
        along = np.array([np.cos(x), np.sin(x)])
        return np.asarray((place_m @ along)[:, None] * along, float)
    if target == BOARD_BOW:
        off = place_m - np.array([x, y])
        return np.asarray(np.sum(off**2, 1, keepdims=True) * off, float)
    raise ValueError(target)


def board_bend_px(target: str, x: float, y: float, camera: Camera, height_m: float, uv_px: Array) -> Array:
    """The same in a camera's picture: moves (N, 2) of full-sensor pixels ``uv_px`` (N, 2), as points that lie
    ``height_m`` above the world's plane move them."""
    points_m = on_plane_m(camera, height_m, uv_px)
    moved_m = board_move_m(target, x, y, points_m[:, :2])
    by_point = camera.project_with_jacobian(points_m)[1]
    return np.asarray(np.einsum("nij,nj->ni", by_point[..., :2], moved_m), float)


def on_plane_m(camera: Camera, height_m: float, uv_px: Array) -> Array:
    """Points (N, 3) seen at full-sensor pixels (N, 2) on the plane ``height_m`` above the world's."""
    rays, eye = camera.rays(uv_px), camera.centre_m
    return np.asarray(eye + (height_m - eye[2]) / rays[:, 2:] * rays, float)
