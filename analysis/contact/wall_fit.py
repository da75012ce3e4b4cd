"""Fit of the wall to the contact distances: which terms, how far, and the residual."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.contact.impacts import Impacts, Junctions, measure
from analysis.flights.cutting import runs as cutting
from analysis.flights.cutting.runs import Run
from analysis.statistics.robust import at_least_noise, root_weights
from analysis.walls.lobes import best_order
from analysis.walls.wall import Wall
from ovines.robust import residual_sd

Array = NDArray[np.float64]

# Model error of a contact distance beyond the cameras' noise (flight model, lens residual), m.
DISTANCE_FLOOR_M = 2e-6
# Fewer runs do not show how much they scatter.
FEWEST_RUNS = 5
#: impacts slower than this say little of the wall and less of the law
SLOWEST_M_PER_S = 0.05
# ... and those whose approach is less certain than this share of it, or whose distance than this share of the wall's
# size (0.5 mm of 40 mm).
UNCERTAIN_SHARE, UNCERTAIN_GAP_SHARE = 0.2, 0.0125
# A contact distance beyond this counts in the sum of squares as if it were this far off.
CUT_SD = 5.0
# ... and chooses an order of lobes with no more than this many robust sds.
CUT_DISTANCE_SD = 4.0
# What a linear spring with a dashpot leaves of a contact's duration (share of it).
CONTACT_MODEL_SHARE = 0.03
# A contact's restitution is at least this where its duration is estimated from how far paths meet past the wall.
LEAST_RESTITUTION = 0.05
# Two flights that miss each other by more than this (chi-square of two degrees: by chance never; 36 at most in series
# whose flights hold all that acts) and are farther off the wall than this share of its size and so many robust sds do
# not meet in one impact: a flight hides one, or several fell among frames that nobody saw.
MISSED, MISSED_SHARE, MISSED_SD = 50.0, 2.5e-3, 8.0


@dataclass(frozen=True, eq=False)
class WallFit:
    """``wall``, the ``impacts`` seen with it, ``residual_m`` of the contact distance, ``scatter_m`` (robust), ``used``
    mask,
    ``extra`` coefficients of further regressors, ``covariance`` of (terms, extra); ``delay_s`` by which flights meet
    past the wall, with its sd."""

    wall: Wall
    impacts: Impacts
    residual_m: Array
    scatter_m: float
    used: NDArray[np.bool_]
    terms: tuple[str, ...]
    estimate: Array
    covariance: Array
    chi_square: float
    delay_s: float = 0.0
    delay_sd_s: float = 0.0


def contact_time_s(delay_s: float, restitution: float) -> float:
    """Duration of a contact from the ``delay_s`` by which flights meet past the wall: paths meet eps T/(1 + eps) v
    further out."""
    return delay_s * (1 + restitution) / max(restitution, LEAST_RESTITUTION)


def outside_the_wall(runs: Sequence[Run], junctions: Junctions, delay_s: float, restitution: float) -> list[Run]:
    """``runs`` without the frames in which the disk is in the wall; all their frames where ``delay_s`` is none.

    Paths that meet the wall with v and leave it T later with eps v intersect ``delay_s`` = eps T / (1 + eps) after the
    one and T / (1 + eps) before the other."""
    early_s = max(delay_s, 0.0)
    late_s = early_s / max(restitution, LEAST_RESTITUTION)
    return [
        cutting.outside_the_wall(run, junctions.time_s[junctions.run == number], early_s, late_s)
        for number, run in enumerate(runs)
    ]


def usable(impacts: Impacts, size_m: float) -> NDArray[np.bool_]:
    """Impacts in a wall of ``size_m`` that approach faster than :data:`SLOWEST_M_PER_S`, leave, and are known better
    than their own size."""
    before, after = impacts.of("normal_before"), impacts.of("normal_after")
    return (
        (before > SLOWEST_M_PER_S)
        & (after > 0)
        & (impacts.sd("normal_before") < UNCERTAIN_SHARE * before)
        & (impacts.sd("gap") < UNCERTAIN_GAP_SHARE * size_m)
    )


def missed(impacts: Impacts, residual_m: Array, size_m: float) -> NDArray[np.bool_]:
    """Junctions whose two flights neither meet nor end at a wall of ``size_m``, by the ``residual_m`` (K,) of the
    contact distance: no single impact."""
    usual_m = residual_sd(residual_m[usable(impacts, size_m)])
    far = np.abs(residual_m) > max(MISSED_SHARE * size_m, MISSED_SD * usual_m)
    return np.asarray(far & (impacts.junctions.mismatch > MISSED), bool)


def fit_wall(
    junctions: Junctions,
    start: Wall,
    terms: Sequence[str],
    prior_sd: Mapping[str, float] | None = None,
    extra: Array | None = None,
    rounds: int = 5,
) -> WallFit:
    """Robust least squares of the gaps at contact in the given terms of the wall (:attr:`Wall.terms`).

    ``prior_sd`` (m, or 1 for the ellipse) draws a term to ``start``; ``extra`` (K, E) are further regressors whose
    coefficients are fitted along (for instance the approach speed, which a contact of finite duration adds).  The
    scatter found becomes the weight, never below the cameras' noise.
    """
    n_extra = 0 if extra is None else extra.shape[1]
    wall, coefficients = start, np.zeros(n_extra)
    start_vector = _vector(start, terms)
    prior = np.array([1 / (prior_sd or {}).get(t, np.inf) ** 2 for t in terms] + [0.0] * n_extra)
    for _ in range(rounds):
        impacts = measure(junctions, wall)
        used = usable(impacts, wall.size_m)
        residual = impacts.of("gap")
        if extra is not None:
            residual = residual - extra @ coefficients
        design = impacts.design(terms)
        if extra is not None:
            design = np.column_stack([design, extra])
        sd = np.sqrt(impacts.sd("gap") ** 2 + DISTANCE_FLOOR_M**2)
        standard = residual / sd
        weight = np.where(used, root_weights(standard, at_least_noise(standard[used])) / sd, 0.0)
        normal = (design * weight[:, None]).T @ (design * weight[:, None]) + np.diag(prior)
        pull = prior * np.concatenate([start_vector - _vector(wall, terms), np.zeros(n_extra)])
        covariance = np.asarray(np.linalg.pinv(normal, hermitian=True), float)
        step = covariance @ ((design * weight[:, None]).T @ (residual * weight) + pull)
        wall = wall.moved(dict(zip(terms, map(float, step), strict=False)))
        coefficients = coefficients + step[len(terms) :]
    impacts = measure(junctions, wall)
    residual = impacts.of("gap")
    if extra is not None:
        residual = residual - extra @ coefficients
    used = usable(impacts, wall.size_m) & ~missed(impacts, residual, wall.size_m)
    scatter = residual_sd(residual[used])
    sd = np.sqrt(impacts.sd("gap") ** 2 + DISTANCE_FLOOR_M**2)
    chi = float(np.sum(np.minimum((residual[used] / sd[used]) ** 2, CUT_SD**2))) if used.any() else 0.0
    wider = _between_runs(design * weight[:, None] ** 2 * residual[:, None], junctions.run, covariance)
    return WallFit(
        wall,
        impacts,
        residual,
        scatter,
        used,
        tuple(terms),
        np.concatenate([_vector(wall, terms), coefficients]),
        covariance * np.outer(wider, wider),
        chi,
    )


def lobe_order(fit: WallFit, without: int = 0) -> int:
    """The order of lobes that the contact distances of a ``fit`` ask for most beside its terms, not ``without``; 0
    where there is no ring, or too few impacts."""
    if not fit.wall.ellipse_terms:
        return 0
    used = np.flatnonzero(fit.used)
    residual = fit.residual_m[used]
    limit = CUT_DISTANCE_SD * max(residual_sd(residual), 1e-12)
    design = fit.impacts.design(fit.terms)[used]
    if len(fit.estimate) > len(fit.terms):
        design = np.column_stack([design, fit.impacts.of("normal_before")[used]])
    seen = fit.impacts.azimuth_rad[used] - fit.impacts.junctions.host[used, 3]
    return best_order(seen, design, np.clip(residual, -limit, limit), without)


def _between_runs(scores: Array, run: NDArray[np.int64], covariance: Array) -> Array:
    """Factor (P,) >= 1 by which the runs disagree more than their impacts' noise lets them, from each impact's
    ``scores`` (K, P).

    The impacts of a run share the Host's fitted motion and, in pairs, a flight: the sandwich estimator clustered by
    runs holds both (Liang and Zeger 1986).  1 with fewer than :data:`FEWEST_RUNS`."""
    runs = np.unique(run)
    if len(runs) < FEWEST_RUNS:
        return np.ones(len(covariance))
    summed = np.array([scores[run == r].sum(0) for r in runs])
    spread = covariance @ (summed.T @ summed) @ covariance * len(runs) / (len(runs) - 1)
    return np.sqrt(np.maximum(np.diag(spread) / np.maximum(np.diag(covariance), 1e-300), 1.0))


def _vector(wall: Wall, terms: Sequence[str]) -> Array:
    values = wall.values()
    return np.array([values[t] for t in terms])
