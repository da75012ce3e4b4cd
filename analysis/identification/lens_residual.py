"""What the cameras' calibration leaves over, as the flights show it, and how far it makes lengths uncertain.

A smooth residual of the lenses bends straight paths: its terms of degree two and more in the place are fitted with the
flights.  Its linear terms - a length scale, a shear, a turn that differ from region to region - bend nothing, so
nothing here shows them, yet every speed and length is measured with them.  What the degree-two terms have in size tells
what the linear ones may have.

An impact's two speeds are seen at one place, so that a scale that is off there cancels - but for the Host, which moves
under other regions of the lenses: with a scale off by g the restitution is off by g (1 + e) times the Host's speed over
the approach (:func:`restitution_sd`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.contact.impacts import Impacts
from analysis.contact.law import Law, LawData
from analysis.contact.wall_fit import DISTANCE_FLOOR_M, WallFit
from analysis.flights.cutting.run_data import LENS_POWERS, LENS_TERMS, lens_basis
from analysis.flights.evidence import Evidence, columns_of
from analysis.flights.fit import ORIGIN, SHARED

Array = NDArray[np.float64]

# Linear terms over those of degree two, of which alone the flights tell much: 2 L / R_c of a residual like sin(u/L).  L
# = 135 to 230 pixels of 0.29 mm (what calibrations of the practice series leave), R_c = 40 mm.
LINEAR_SHARE = 2.6


@dataclass(frozen=True, eq=False)
class LensResidual:
    """``amplitude_m``: sd of the degree-two terms at a contact radius from the origin, 0 where the flights show none;
    ``relative``: the same over the contact radius, the size of the length errors that go with it; ``covariance`` (W, W)
    of all terms of :data:`LENS_TERMS` as fitted, the linear ones held; ``whole`` the same with linear ones as large as
    :data:`LINEAR_SHARE` says."""

    amplitude_m: float
    relative: float
    covariance: Array
    whole: Array

    def wall_sd(self, fit: WallFit) -> Array:
        """What the terms' uncertainty adds to each term of a fitted wall (P,): it moves all impacts at a place alike,
        in every run.
        """
        used = fit.used
        if not used.any():
            return np.zeros(len(fit.terms))
        state, normal = fit.impacts.junctions.state[used], fit.impacts.normal_rad[used]
        basis = lens_basis(0.5 * (state[:, :2] + state[:, 6:8]), fit.wall.size_m)
        moved_m = np.column_stack([np.cos(normal)[:, None] * basis, np.sin(normal)[:, None] * basis])
        design = fit.impacts.design(fit.terms)[used]
        weight = 1 / np.hypot(fit.impacts.sd("gap")[used], max(fit.scatter_m, DISTANCE_FLOOR_M))
        slope = np.linalg.lstsq(design * weight[:, None], moved_m * weight[:, None], rcond=None)[0]
        return np.sqrt(np.einsum("ij,jk,ik->i", slope, self.covariance, slope))


def lens_residual(
    amplitude_m: float,
    evidence: Sequence[Evidence],
    names: Sequence[str],
    prior_sd: dict[str, float],
    weak_sd: float,
    contact_radius_m: float,
) -> LensResidual:
    """What the flights leave open of a residual whose terms of degree two and more have the sd ``amplitude_m``.

    ``names`` are the other shared unknowns that were fitted along; ``prior_sd`` and ``weak_sd`` the priors of the fit.
    """
    if amplitude_m == 0.0:
        return LensResidual(
            0.0, 0.0, np.zeros((len(LENS_TERMS), len(LENS_TERMS))), np.zeros((len(LENS_TERMS), len(LENS_TERMS)))
        )
    columns = columns_of([*names, *ORIGIN, *LENS_TERMS])
    prior = np.array([prior_sd.get(SHARED[c], weak_sd) for c in columns]) ** -2.0
    information = np.sum([e.take(columns)[0] for e in evidence], 0)
    at = [columns.index(SHARED.index(name)) for name in LENS_TERMS]
    freer = prior.copy()
    freer[at] = [
        (amplitude_m * (LINEAR_SHARE if sum(LENS_POWERS[k % len(LENS_POWERS)]) == 1 else 1.0)) ** -2.0
        for k in range(len(LENS_TERMS))
    ]
    covariance, whole = (_inverse(information + np.diag(one))[np.ix_(at, at)] for one in (prior, freer))
    return LensResidual(amplitude_m, amplitude_m / contact_radius_m, covariance, whole)


def _inverse(information: Array) -> Array:
    """Inverse, of unit diagonal first: friction, metres and rates differ by ten orders of magnitude."""
    size = np.sqrt(np.diag(information))
    return np.asarray(np.linalg.inv(information / np.outer(size, size)) / np.outer(size, size), float)


def lens_gradient(xy_m: Array, contact_radius_m: float) -> Array:
    """(K, len(LENS_POWERS), 2) derivative of ``flights.lens_basis`` with respect to x and y, 1/m."""
    x, y = xy_m[:, 0] / contact_radius_m, xy_m[:, 1] / contact_radius_m
    along = [np.stack([i * x ** max(i - 1, 0) * y**j, j * x**i * y ** max(j - 1, 0)], -1) for i, j in LENS_POWERS]
    return np.stack(along, 1) / contact_radius_m


def restitution_sd(lens: LensResidual, impacts: Impacts, data: LawData, law: Law, contact_radius_m: float) -> float:
    """sd of the restitution from the residual's terms, as far as the flights leave them open."""
    if lens.amplitude_m == 0.0 or len(data) == 0:
        return 0.0
    state, normal = impacts.junctions.state[data.at.index], impacts.normal_rad[data.at.index]
    gradient = lens_gradient(0.5 * (state[:, :2] + state[:, 6:8]), contact_radius_m)
    speeds = [np.einsum("kpi,ki->kp", gradient, state[:, at : at + 2]) for at in (3, 9)]
    off = -speeds[1] - law.restitution * speeds[0]
    weight = data.before / (data.normal_sd**2 + (law.scatter * data.before) ** 2)
    per_term = np.concatenate([(n * weight) @ off for n in (np.cos(normal), np.sin(normal))]) / np.sum(
        weight * data.before
    )
    return float(np.sqrt(per_term @ lens.whole @ per_term))
