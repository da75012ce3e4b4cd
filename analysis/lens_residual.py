"""What the cameras' calibration leaves over, as the flights show it, and how far it makes lengths uncertain.

A smooth residual of the lenses bends straight paths: its terms of degree two and more in the place are fitted with the flights.  Its
linear terms - a length scale, a shear, a turn that differ from region to region - bend nothing, so nothing here shows them, yet every
speed and length is measured with them.  What the degree-two terms have in size tells what the linear ones may have.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.evidence import Evidence, columns_of
from analysis.flights import ORIGIN, SHARED, WARP, WARP_POWERS, FlightFits, warp_basis
from analysis.wall import WALL_TERMS, wall_design
from analysis.wall_fit import DISTANCE_FLOOR_M, WallFit

Array = NDArray[np.float64]

# Fall of -2 log L from which a lens residual is taken to be there: its size is bounded below, so 2.7 is 5 % of series without one.
THERE = 2.71
# Linear terms over those of degree two, of which alone the flights tell much: 2 L / R_c of a residual like sin(u/L).  L = 135 to 230 pixels of
# 0.29 mm (what calibrations of the practice series leave), R_c = 40 mm.
LINEAR_SHARE = 2.6
SECOND = [k for k, name in enumerate(WARP) if sum(WARP_POWERS[k % len(WARP_POWERS)]) == 2]


@dataclass(frozen=True, eq=False)
class LensResidual:
    """``amplitude_m``: sd of the degree-two terms at a contact radius from the origin, 0 where the flights show none; ``relative``: the
    same over the contact radius, the size of the length errors that go with it; ``covariance`` (W, W) of all terms of :data:`WARP` as fitted, the
    linear ones held; ``whole`` the same with linear ones as large as :data:`LINEAR_SHARE` says."""

    amplitude_m: float
    relative: float
    covariance: Array
    whole: Array

    def wall_sd(self, fit: WallFit) -> Array:
        """What the terms' uncertainty adds to each term of a fitted wall (P,): it moves all impacts at a place alike, in every run."""
        used, radius = fit.used, fit.wall.contact_radius_m
        if not used.any():
            return np.zeros(len(fit.terms))
        state, azimuth = fit.impacts.meetings.state[used], fit.impacts.azimuth_rad[used]
        basis = warp_basis(0.5 * (state[:, :2] + state[:, 6:8]), radius)
        moved_m = np.column_stack([np.cos(azimuth)[:, None] * basis, np.sin(azimuth)[:, None] * basis])
        design = wall_design(azimuth, fit.impacts.meetings.host[used, 3], fit.impacts.body_rad[used], radius)
        design = design[:, [WALL_TERMS.index(term) for term in fit.terms]]
        weight = 1 / np.hypot(fit.impacts.sd("radius")[used], max(fit.scatter_m, DISTANCE_FLOOR_M))
        slope = np.linalg.lstsq(design * weight[:, None], moved_m * weight[:, None], rcond=None)[0]
        return np.sqrt(np.einsum("ij,jk,ik->i", slope, self.covariance, slope))


def lens_residual(fits: Sequence[FlightFits], evidence: Sequence[Evidence], names: Sequence[str], prior_sd: dict[str, float],
                  weak_sd: float, scale: float) -> LensResidual:
    """Size of the lens residual by maximum likelihood from the fitted degree-two terms (variance component, Patterson and Thompson 1971).

    ``names`` are the other shared unknowns that were fitted along; ``prior_sd`` and ``weak_sd`` the priors of the fit."""
    columns = columns_of([*names, *ORIGIN, *WARP])
    prior = np.array([prior_sd.get(SHARED[c], weak_sd) for c in columns]) ** -2.0
    told = np.zeros((len(columns), len(columns)))
    for e in evidence:
        told = told + e.take(columns)[0] / max(scale, 1.0) ** 2
    at = [columns.index(SHARED.index(name)) for name in WARP]
    covariance = _inverse(told + np.diag(prior))[np.ix_(at, at)]
    if not fits:
        return LensResidual(0.0, 0.0, covariance, covariance)
    amplitude = _amplitude(fits[0].shared[2:][SECOND], covariance[np.ix_(SECOND, SECOND)], prior[at][SECOND])
    if amplitude == 0.0:
        return LensResidual(0.0, 0.0, covariance, covariance)
    freer = prior.copy()
    freer[at] = [(amplitude * (LINEAR_SHARE if sum(WARP_POWERS[k % len(WARP_POWERS)]) == 1 else 1.0)) ** -2.0 for k in range(len(WARP))]
    return LensResidual(amplitude, amplitude / fits[0].run.contact_radius_m, covariance, _inverse(told + np.diag(freer))[np.ix_(at, at)])


def _inverse(information: Array) -> Array:
    """Inverse, of unit diagonal first: friction, metres and rates differ by ten orders of magnitude."""
    size = np.sqrt(np.diag(information))
    return np.asarray(np.linalg.inv(information / np.outer(size, size)) / np.outer(size, size), float)


def _amplitude(estimate: Array, covariance: Array, prior: Array) -> float:
    """sd of terms whose estimates, drawn to zero by ``prior``, have ``covariance``; 0 where that is as likely."""
    # The estimate without the prior's pull, and its covariance: where the data say less than the prior, close to nothing.
    told = np.linalg.inv(covariance) - np.diag(prior)
    values, vectors = np.linalg.eigh(told)
    good = values > 1e-3 * prior.min()
    if not good.any():
        return 0.0
    free = (vectors.T @ (np.linalg.inv(covariance) @ estimate))[good] / values[good]
    variance = 1 / values[good]

    def cost(amplitude: float) -> float:
        total = amplitude**2 + variance
        return float(np.sum(free**2 / total + np.log(total)))

    grid = np.concatenate([[0.0], np.geomspace(1e-7, 3e-4, 60)])
    costs = np.array([cost(a) for a in grid])
    best = int(np.argmin(costs))
    return float(grid[best]) if costs[0] - costs[best] > THERE else 0.0
