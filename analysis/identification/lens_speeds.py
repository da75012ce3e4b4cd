"""How far a lens residual makes the restitution uncertain: speeds are measured with its gradient where the impact is.

An impact's two speeds are seen at one place, so that a scale that is off there cancels - but for the Host, which moves
under other regions of the lenses: with a scale off by g the restitution is off by g (1 + e) times the Host's speed over
the approach.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.contact.impacts import Impacts
from analysis.contact.law import Law, LawData
from analysis.flights.fit import LENS_POWERS
from analysis.identification.lens_residual import LensResidual

Array = NDArray[np.float64]


def lens_gradient(xy_m: Array, contact_radius_m: float) -> Array:
    """(K, len(LENS_POWERS), 2) derivative of ``flights.lens_basis`` with respect to x and y, 1/m."""
    x, y = xy_m[:, 0] / contact_radius_m, xy_m[:, 1] / contact_radius_m
    along = [np.stack([i * x ** max(i - 1, 0) * y**j, j * x**i * y ** max(j - 1, 0)], -1) for i, j in LENS_POWERS]
    return np.stack(along, 1) / contact_radius_m


def restitution_sd(lens: LensResidual, impacts: Impacts, data: LawData, law: Law, contact_radius_m: float) -> float:
    """sd of the restitution from the residual's terms, as far as the flights leave them open."""
    if lens.amplitude_m == 0.0 or len(data) == 0:
        return 0.0
    state, normal = impacts.junctions.state[data.index], impacts.normal_rad[data.index]
    gradient = lens_gradient(0.5 * (state[:, :2] + state[:, 6:8]), contact_radius_m)
    speeds = [np.einsum("kpi,ki->kp", gradient, state[:, at : at + 2]) for at in (3, 9)]
    off = -speeds[1] - law.restitution * speeds[0]
    weight = data.before / (data.normal_sd**2 + (law.scatter * data.before) ** 2)
    per_term = np.concatenate([(n * weight) @ off for n in (np.cos(normal), np.sin(normal))]) / np.sum(
        weight * data.before
    )
    return float(np.sqrt(per_term @ lens.whole @ per_term))
