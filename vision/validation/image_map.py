"""How far a lens' uncertainty, or a change of it, moves what is seen where, over the image.

A turn of the camera is taken away first: it moves the whole image, and every calibration finds it anew with the poses
of its boards.  What is left is the lens' own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ovines.camera import Camera
from ovines.lens_field import LensField
from vision.calibration.advice import CELLS
from vision.calibration.targets.detection import View
from vision.pinhole import lens_of, pinhole

Array = NDArray[np.float64]
ACROSS = 16  # places of the map along the image's longer side


@dataclass(frozen=True)
class ImageMap:
    """Places ``uv_px`` (n, 2), the derivatives (n, 2, N_INTRINSICS + F) by intrinsics and spline of what is seen
    there without the camera's turn, and which places lie where boards were seen, ``visited`` (n,).
    """

    uv_px: Array
    slopes: Array
    visited: NDArray[np.bool_]

    def moved(self, change: Array) -> Array:
        """Pixels (n, 2) by which a change of intrinsics and spline moves what is seen there."""
        return np.asarray(self.slopes @ change)

    def sd_px(self, covariance: Array) -> Array:
        """Sd (n,) of a coordinate there, RMS of the two, by a covariance of intrinsics and spline."""
        variance = np.sum((self.slopes @ covariance) * self.slopes, -1)
        return np.asarray(np.sqrt(np.maximum(variance, 0).mean(1)))


def image_map(
    intrinsics: Array, size_px: tuple[int, int], views: Sequence[View], spline: LensField | None = None
) -> ImageMap:
    """The map of a camera; places whose rays the lens cannot tell are left out."""
    step = max(size_px) / ACROSS
    across, down = (max(2, round(side / step)) for side in size_px)
    u, v = (np.arange(n) + 0.5 for n in (across, down))
    uv = np.stack(np.meshgrid(u / across * size_px[0], v / down * size_px[1]), -1).reshape(-1, 2) - 0.5
    xy = Camera("", size_px, *lens_of(intrinsics), np.eye(3), np.zeros(3), spline=spline).normalise(uv)
    finite = np.isfinite(xy).all(1)
    uv, rays = uv[finite], np.column_stack([xy[finite], np.ones(finite.sum())])
    _, by_lens, by_ray = pinhole(rays, intrinsics)
    if spline is not None:
        by_lens = np.concatenate([by_lens, spline.slopes(uv)], -1)
    zero = 0 * rays[:, 0]
    x, y, z = rays.T
    turned = -np.stack([np.stack([zero, -z, y], -1), np.stack([z, zero, -x], -1), np.stack([-y, x, zero], -1)], -2)
    by_turn = (by_ray @ turned).reshape(-1, 3)
    visited = _visited(uv, size_px, views)
    weight = np.repeat(np.where(visited, 1.0, 1e-3), 2)
    flat = by_lens.reshape(len(weight), -1)
    turn = np.linalg.solve(by_turn.T @ (weight[:, None] * by_turn), by_turn.T @ (weight[:, None] * flat))
    return ImageMap(uv, (flat - by_turn @ turn).reshape(len(uv), 2, -1), visited)


def _visited(uv_px: Array, size_px: tuple[int, int], views: Sequence[View]) -> NDArray[np.bool_]:
    cells = np.zeros(CELLS, bool)
    for view in views:
        cells[_cell(view.uv_px, size_px)] = True
    return np.asarray(cells[_cell(uv_px, size_px)])


def _cell(uv_px: Array, size_px: tuple[int, int]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    cell = np.clip((uv_px / size_px * CELLS).astype(int), 0, np.array(CELLS) - 1)
    return cell[:, 0], cell[:, 1]
