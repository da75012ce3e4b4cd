"""What is believed of a lens field before any recording: smooth, of unknown size, and as sure as the calibration."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ovines.camera import Camera
from vision.calibration.uncertainty import by_parameters, covariance_of
from vision.lens.lattice import Lattice
from vision.smooth_field import of_all, smooth_covariance

Array = NDArray[np.float64]

LENGTHS_PX = (150.0, 200.0, 270.0, 360.0, 480.0, 700.0)  # correlation lengths that recordings choose from
FIRST_GUESS = 4, 2  # of the amplitudes and lengths, by number


def smooth_prior(lattices: Sequence[Lattice], length_px: float) -> Array:
    """Covariance (P, P) of the splines of u and v of each camera, of amplitude 1 px: each coordinate by itself."""
    return of_all([smooth_covariance(lattice.sites_px, length_px) for lattice in lattices])


def calibration_part(
    lattices: Sequence[Lattice], cameras: Sequence[Camera], covariance: pd.DataFrame | None, height_m: float
) -> Array:
    """Covariance (P, P) of the splines from the calibration's own uncertainty; 0 where none is known.

    A changed parameter moves the picture of the plane ``height_m`` above the world's: that is its field.
    """
    sizes = [2 * lattice.size for lattice in lattices]
    if covariance is None:
        return np.zeros((sum(sizes), sum(sizes)))
    whole = []
    for c, lattice in enumerate(lattices):
        sites = lattice.sites_px
        ray = cameras[c].rays(sites)
        centre = cameras[c].centre_m
        points = centre + ((height_m - centre[2]) / ray[:, 2])[:, None] * ray
        own = np.nan_to_num(by_parameters(points, cameras, c)[0])
        whole += [own[:, 0], own[:, 1]]
    moved = np.concatenate(whole)
    return np.asarray(moved @ covariance_of(covariance, cameras) @ moved.T, float)
