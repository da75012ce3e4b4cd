"""A restitution that follows speed, direction or time: the effects of the library on it, held as stated or fitted.

The one place that says what they are to measured impacts: ``ovines identify``, ``compare`` and ``diagnose`` ask here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from analysis.contact.law import Law, LawData, fit_restitution
from analysis.motion.rig_frame import RigFrame

Array = NDArray[np.float64]
Sizes = Mapping[str, Mapping[str, float]]
SPEED, DIRECTION, DRIFT = "speed_dependent_restitution", "direction_dependent_restitution", "restitution_drift"
#: effects of the library that act on the restitution, in the order of their columns
RESTITUTION_EFFECTS = (SPEED, DIRECTION, DRIFT)
# Speeds over the RMS approach speed from which the search for an exponential fall begins, the last where it ends: what
# falls off beyond the measured speeds is a straight line to them, and no end of it is seen.
SPEED_SCALES = (0.2, 0.3, 0.5, 0.75, 1.25, 2.5)
# Where a scale's interval would end below this share of the RMS approach speed, no impact tells a slower one apart.
SLOWEST_SCALE = 0.03
# A restitution that goes with the speed: fall of -2 log L (two more parameters) from which it is taken, of how many
# impacts, and the speeds within which it may fall off.
SPEED_LAW_GAIN, FEWEST_FOR_SPEED_LAW, DECAY_SPEEDS_M_PER_S = 15.0, 20, (0.3, 0.55, 1.0, 1.8, 3.3)
# Restitution of slow impacts against that of all: sd of the difference that falls off within this speed, before any
# impact says more.
SLOW_SD, LEAST_SLOW_SD, SLOW_M_PER_S = 0.05, 0.003, 0.3
# A drift's columns: with time and from run to run; rounds in which what drifts and by how much settle.
DRIFTS, DRIFT_ROUNDS = 2, 4
# Step of the logarithm of the scale by which the likelihood's curvature is taken, and the least curvature that is one.
SCALE_STEP, LEAST_CURVATURE = 0.05, 1e-9


class Conditions(NamedTuple):
    """What a restitution of the library depends on: approach speeds, azimuths, seconds since the runs' starts, numbers
    of the runs from 0 (K, each)."""

    before: Array
    azimuth_rad: Array
    since_start_s: Array
    run: Array


def conditions(data: LawData) -> Conditions:
    """Those of measured impacts whose times count from the starts of their runs; times that are not known count as
    none."""
    since_start_s = data.at.time_s if np.isfinite(data.at.time_s).all() else np.zeros(len(data))
    return Conditions(data.before, data.at.azimuth_rad, since_start_s, data.at.run.astype(float))


def restitution_columns(at: Conditions, names: Sequence[str], scale: float) -> Array:
    """Columns (K, P) of restitution for a model with the effects ``names`` and a speed ``scale`` (m/s): constant,
    falling with speed, with direction, with time and run."""
    columns = [np.ones(len(at.before))]
    if SPEED in names:
        columns.append(np.exp(-at.before / scale))
    if DIRECTION in names:
        columns += [np.cos(at.azimuth_rad), np.sin(at.azimuth_rad)]
    if DRIFT in names:
        columns += [at.since_start_s, at.run]
    return np.column_stack(columns)


def restitution_design(data: LawData, names: Sequence[str]) -> Array:
    """:func:`restitution_columns` of measured impacts, with the speed scale that they show beside the others; what
    drifts is the whole restitution, whatever else it follows."""
    at, others = conditions(data), [name for name in names if name != SPEED]
    scale = best_speed_scale(data, restitution_columns(at, others, 1.0)[:, 1:]) if SPEED in names else 1.0
    columns = restitution_columns(at, names, scale)
    if DRIFT in names and columns.shape[1] > 1 + DRIFTS:
        still = columns[:, :-DRIFTS] @ fit_restitution(data, columns)[0][:-DRIFTS]
        columns[:, -DRIFTS:] *= (still / np.mean(still))[:, None]
    return columns


def usual_approach_m_per_s(data: LawData) -> float:
    """RMS approach speed of the impacts: the unit of their speeds."""
    return float(np.sqrt(np.mean(data.before**2)))


def speed_scales_m_per_s(data: LawData) -> Array:
    """Speeds (m/s) from which the search for an exponential fall begins, ascending."""
    return usual_approach_m_per_s(data) * np.array(SPEED_SCALES)


def best_speed_scale(data: LawData, beside: Array | None = None) -> float:
    """Speed scale (m/s) of an exponential fall of restitution beside the columns ``beside`` (K, .), by likelihood: a
    grid, then a bounded search about its best.
    """
    scales = speed_scales_m_per_s(data)
    grid = [_scale_misfit(data, float(s), beside) for s in scales]
    at = int(np.argmin(grid))
    low, high = scales[max(at - 1, 0)], scales[min(at + 1, len(grid) - 1)]
    found = minimize_scalar(
        lambda u: _scale_misfit(data, np.exp(u), beside),
        bounds=(np.log(low), np.log(high)),
        method="bounded",
        options={"xatol": 1e-3},
    )
    return float(np.exp(found.x)) if found.fun <= grid[at] else float(scales[at])


def _scale_misfit(data: LawData, scale: float, beside: Array | None) -> float:
    columns = [np.ones(len(data)), np.exp(-data.before / scale), *(() if beside is None else beside.T)]
    return fit_restitution(data, np.column_stack(columns))[3]


def speed_scale_sd(data: LawData, scale: float, beside: Array | None = None) -> float:
    """Standard deviation (m/s) of the speed scale from the curvature of its profile likelihood."""
    h = SCALE_STEP
    curvature = (
        _scale_misfit(data, scale * np.exp(h), beside)
        + _scale_misfit(data, scale * np.exp(-h), beside)
        - 2 * _scale_misfit(data, scale, beside)
    ) / h**2
    return float(scale * np.sqrt(2 / curvature)) if curvature > LEAST_CURVATURE else scale


def rig_sizes(stated: Sizes, frame: RigFrame) -> dict[str, dict[str, float]]:
    """Those of the ``stated`` sizes of effects that act on the restitution, from the world into the rig's frame."""
    own = {name: dict(stated[name]) for name in RESTITUTION_EFFECTS if name in stated}
    if SPEED in own:
        own[SPEED]["speed_scale_m_per_s"] /= frame.factor("speed_scale_m_per_s")
    if DIRECTION in own:
        own[DIRECTION]["direction_rad"] -= frame.turn_rad
    if DRIFT in own:
        own[DRIFT]["relative_per_s"] /= frame.factor("relative_per_s")
    return own


def held_restitution(at: Conditions, held: Sizes) -> tuple[Array, Array, Array]:
    """``slope``, ``offset`` and ``share`` (K, each) of effects whose sizes are ``held`` (in the units of ``at``): a
    restitution e is offset + slope e, and what else it follows is multiplied by the share."""
    slope, offset, share = np.ones(len(at.before)), np.zeros(len(at.before)), np.ones(len(at.before))
    if SPEED in held:
        slope = np.exp(-at.before / held[SPEED]["speed_scale_m_per_s"])
        offset = held[SPEED]["restitution_fast"] * (1 - slope)
    if DIRECTION in held:
        offset = offset + held[DIRECTION]["amplitude"] * np.cos(at.azimuth_rad - held[DIRECTION]["direction_rad"])
    if DRIFT in held:
        share = (1 + held[DRIFT]["relative_per_s"] * at.since_start_s) * (1 + held[DRIFT]["relative_per_run"] * at.run)
    return share * slope, share * offset, share


@dataclass(frozen=True, eq=False)
class EffectsFit:
    """The restitution with its effects: ``value`` and ``sd`` of the one to which a scenario adds them (of the slowest
    impacts where it falls with the speed, the mean over directions, at the start of the first run where it drifts),
    ``scatter`` from impact to impact, ``sizes`` (value, sd) of the effects that were fitted; ``coefficients`` fitted,
    of a restitution that has the share ``drift`` more (per second and run) later, ``scale`` of the speed (m/s),
    ``held`` sizes."""

    value: float
    sd: float
    scatter: float
    sizes: Mapping[str, dict[str, tuple[float, float]]]
    names: tuple[str, ...]
    coefficients: Array
    drift: Array
    scale: float
    held: Sizes

    @property
    def unknowns(self) -> int:
        """How many numbers were fitted."""
        return len(self.coefficients) + DRIFTS * (DRIFT in self.names)

    def at(self, here: Conditions) -> Array:
        """Restitution (K,) of impacts under given conditions."""
        design, offset = _design(here, self.names, self.scale, self.held)
        return np.asarray(_drifted(here, self.drift) * (offset + design @ self.coefficients), float)


def _design(at: Conditions, names: Sequence[str], scale: float, held: Sizes) -> tuple[Array, Array]:
    """Columns (K, P) and offset (K,) of a restitution before it drifts with a share that is fitted."""
    slope, offset, share = held_restitution(at, held)
    columns = share[:, None] * restitution_columns(at, [name for name in names if name != DRIFT], scale)
    columns[:, 0] = slope
    return columns, offset


def _drifted(at: Conditions, drift: Array) -> Array:
    """What is left (K,) of a restitution with the ``drift`` (2,) per second and run."""
    return np.asarray((1 + drift[0] * at.since_start_s) * (1 + drift[1] * at.run), float)


class _Fitted(NamedTuple):
    coefficients: Array
    covariance: Array
    drift: Array
    scatter: float


def _fit(data: LawData, free: Sequence[str], scale: float, held: Sizes, beside: Array | None) -> _Fitted:
    """The ``free`` effects with a given speed ``scale``: coefficients, what a drift makes of them all, and the
    covariance of both."""
    at, drifts = conditions(data), DRIFT in free
    design, offset = _design(at, free, scale, held)
    coefficients, drift = np.zeros(design.shape[1]), np.zeros(DRIFTS)
    coefficients[0] = np.mean(data.after / data.before)
    more = [] if beside is None else [beside]
    for _ in range(DRIFT_ROUNDS if drifts else 1):
        share, still = _drifted(at, drift), offset + design @ coefficients
        columns = [share[:, None] * design]
        if drifts:  # by how much the restitution so far changes with either
            later = [at.since_start_s * (1 + drift[1] * at.run), at.run * (1 + drift[0] * at.since_start_s)]
            columns.append(still[:, None] * np.column_stack(later))
        plain = replace(data, after=data.after - share * offset * data.before)
        found, covariance, scatter, _ = fit_restitution(plain, np.column_stack([*columns, *more]))
        k = design.shape[1]
        coefficients, drift = found[:k], drift + (found[k : k + DRIFTS] if drifts else 0.0)
    count = k + DRIFTS * drifts
    return _Fitted(coefficients, covariance[:count, :count], drift, scatter)


def fit_effects(data: LawData, names: Sequence[str], held: Sizes, beside: Array | None = None) -> EffectsFit:
    """The restitution of impacts (times from the runs' starts) with the effects ``names``, of which ``held`` ones keep
    their sizes and the others are fitted; ``beside`` (K, .): further columns whose coefficients nobody asks for."""
    free = tuple(name for name in RESTITUTION_EFFECTS if name in names and name not in held)
    at = conditions(data)
    _, offset, _ = held_restitution(at, held)
    plain = replace(data, after=data.after - offset * data.before) if held else data
    others = restitution_columns(at, [name for name in free if name != SPEED], 1.0)[:, 1:]
    scale = best_speed_scale(plain, others) if SPEED in free else 1.0
    fitted = _fit(data, free, scale, held, beside)
    c, covariance = fitted.coefficients, fitted.covariance
    k = len(c)
    slow = np.array([1.0, float(SPEED in free), *np.zeros(max(k - 2, 0))])[:k]
    sd = float(np.sqrt(slow @ covariance[:k, :k] @ slow))
    sizes: dict[str, dict[str, tuple[float, float]]] = {}
    if SPEED in free:
        scale_sd = speed_scale_sd(plain, scale, others)
        slowest = SLOWEST_SCALE * usual_approach_m_per_s(plain)
        # Both limits move with the scale: both ends of the scale's interval are tried.
        low, high = (
            _fit(data, free, s, held, beside).coefficients for s in (max(scale - scale_sd, slowest), scale + scale_sd)
        )
        fast, sd = (
            float(np.hypot(own, 0.5 * abs((high - low) @ row)))
            for own, row in ((np.sqrt(covariance[0, 0]), np.eye(k)[0]), (sd, slow))
        )
        sizes[SPEED] = {"restitution_fast": (float(c[0]), fast), "speed_scale_m_per_s": (scale, scale_sd)}
    if DIRECTION in free:
        first = 1 + (SPEED in free)
        sizes[DIRECTION] = _turning(c[first : first + 2], covariance[first : first + 2, first : first + 2])
    if DRIFT in free:
        ways = (("relative_per_s", at.since_start_s), ("relative_per_run", at.run))
        sizes[DRIFT] = {
            name: (float(fitted.drift[i]), float(np.sqrt(covariance[k + i, k + i])))
            for i, (name, along) in enumerate(ways)
            if np.ptp(along)
        }
    return EffectsFit(float(slow @ c), sd, fitted.scatter, sizes, free, c, fitted.drift, scale, held)


def _turning(vector: Array, covariance: Array) -> dict[str, tuple[float, float]]:
    """Amplitude and direction of a cosine with coefficients (2,), each with its sd."""
    size = max(float(np.hypot(*vector)), 1e-9)
    along = vector / size
    across = np.array([-along[1], along[0]])
    sd, turned = (float(np.sqrt(u @ covariance @ u)) for u in (along, across))
    return {"amplitude": (size, sd), "direction_rad": (float(np.arctan2(vector[1], vector[0])), turned / size)}


@dataclass(frozen=True)
class SpeedLaw:
    """Restitution ``at_high`` + ``rise`` exp(-v / ``speed_m_per_s``) at approach speed v, and its ``scatter``;
    ``slow_sd``: how far that of slow impacts may lie off it."""

    at_high: float
    rise: float
    speed_m_per_s: float
    scatter: float
    slow_sd: float


def speed_law(data: LawData, law: Law) -> SpeedLaw:
    """The restitution as it follows the approach speed where the impacts leave no doubt that it does, else the one of
    all impacts.

    Slow impacts (chatter) are not among ``data`` or tell little: a mean over fast ones is not theirs."""
    best, least = SpeedLaw(law.restitution, 0.0, 1.0, law.scatter, SLOW_SD), np.inf
    if len(data) >= FEWEST_FOR_SPEED_LAW:
        least = fit_restitution(data)[3] - SPEED_LAW_GAIN
        for speed in DECAY_SPEEDS_M_PER_S:
            (at_high, rise), _, scatter, value = fit_restitution(
                data, np.column_stack([np.ones(len(data)), np.exp(-data.before / speed)])
            )
            if value < least:
                best, least = SpeedLaw(float(at_high), float(rise), speed, scatter, SLOW_SD), value
    return replace(best, slow_sd=_slow_sd(data, best))


def _slow_sd(data: LawData, law: SpeedLaw) -> float:
    """How far the restitution of the slowest impacts may lie off ``law``, as the others show it: :data:`SLOW_SD` where
    they say nothing.
    """
    if not len(data):
        return SLOW_SD
    expected = law.at_high + law.rise * np.exp(-data.before / law.speed_m_per_s)
    residual = replace(data, after=data.after - expected * data.before)
    (_, off), covariance, _, _ = fit_restitution(
        residual, np.column_stack([np.ones(len(data)), np.exp(-data.before / SLOW_M_PER_S)]), SLOW_SD**-2.0
    )
    return float(np.clip(np.hypot(off, np.sqrt(covariance[1, 1])), LEAST_SLOW_SD, SLOW_SD))
