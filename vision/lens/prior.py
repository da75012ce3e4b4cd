"""What is believed of a lens field before any recording: smooth, of unknown size, and as sure as the calibration."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.linalg import block_diag

from ovines.camera import Camera
from vision.calibration.bundle_adjustment import N_CAMERA, intrinsics_of, pinhole
from vision.calibration.uncertainty import covariance_of
from vision.lens.lattice import Lattice

Array = NDArray[np.float64]

# A field's sd [px] and correlation length [px]: what recordings choose from.
AMPLITUDES_PX = (0.01, 0.02, 0.04, 0.07, 0.1, 0.14, 0.2, 0.3, 0.45, 0.7)
LENGTHS_PX = (150.0, 200.0, 270.0, 360.0, 480.0, 700.0)
FIRST_GUESS = 4, 2  # of them, by number
ROUGH_SHARE = 0.01  # of the amplitude, free from site to site: no lens is as smooth as the kernel


def smooth_covariance(lattices: Sequence[Lattice], length_px: float) -> Array:
    """Covariance (P, P) of the splines of u and v of each camera, of amplitude 1 px: a Gaussian process, each
    coordinate by itself.
    """
    blocks = []
    for lattice in lattices:
        sites = lattice.sites_px
        apart = np.linalg.norm(sites[:, None] - sites[None], axis=-1) / length_px
        blocks += 2 * [np.exp(-0.5 * apart**2) + ROUGH_SHARE**2 * np.eye(len(sites))]
    return np.asarray(block_diag(*blocks), float)


def calibration_part(
    lattices: Sequence[Lattice], cameras: Sequence[Camera], covariance: pd.DataFrame | None, height_m: float
) -> Array:
    """Covariance (P, P) of the splines from the calibration's own uncertainty; 0 where none is known.

    A changed parameter moves the picture of the plane ``height_m`` above the world's: that is its field.
    """
    sizes = [2 * lattice.size for lattice in lattices]
    if covariance is None:
        return np.zeros((sum(sizes), sum(sizes)))
    moved = []
    for lattice, camera in zip(lattices, cameras, strict=True):
        sites = lattice.sites_px
        ray = camera.rays(sites)
        centre = camera.centre_m
        points = centre + ((height_m - centre[2]) / ray[:, 2])[:, None] * ray
        rotated = points @ camera.rotation.T
        _, by_intrinsics, by_place = pinhole(rotated + camera.translation_m, intrinsics_of(camera))
        x, y, z = rotated.T
        zero = 0 * x
        turned = -np.stack([np.stack([zero, -z, y], -1), np.stack([z, zero, -x], -1), np.stack([-y, x, zero], -1)], -2)
        own = np.concatenate([by_intrinsics, by_place @ turned, by_place], -1)  # (sites, 2, N_CAMERA)
        moved.append(np.nan_to_num(np.concatenate([own[:, 0], own[:, 1]])))
    whole = np.zeros((sum(sizes), N_CAMERA * len(cameras)))
    at = 0
    for c, block in enumerate(moved):
        whole[at : at + len(block), N_CAMERA * c : N_CAMERA * (c + 1)] = block
        at += len(block)
    return np.asarray(whole @ covariance_of(covariance, cameras) @ whole.T, float)
