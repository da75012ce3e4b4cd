"""90 % intervals of the tangential law of contacts that last, by profile likelihood: friction, stiffness, and the
tangential restitution that stands for the stiffness in a scenario.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from analysis.contact.law import LawData, outlier_share, stick_impulse
from analysis.contact.tangential.lasting import STIFFNESS, LastingContact, stiffness_of
from analysis.identification.contact_law.deviance import FRICTION_RANGE, TANGENTIAL_RANGE, best_scatter
from analysis.identification.contact_law.interval import Interval
from analysis.identification.contact_law.intervals import crossing, minimum, threshold
from analysis.statistics.student import NORMAL_90

# The profiles' first steps: in friction, in the logarithm of the stiffness and in the tangential restitution.
FRICTION_STEP, STIFFNESS_STEP, TANGENTIAL_STEP = 5e-4, 0.02, 0.01
# Where the other unknown is looked for beside its best: a share of the friction, and the stiffness' logarithm.
NEAR_FRICTION, NEAR_STIFFNESS = 0.3, 1.0


@dataclass(frozen=True)
class LastingIntervals:
    """``wall_friction``; ``stiffness`` of the tangential spring over the normal one's; the ``tangential_restitution``
    of a scenario, and whether its spring is as stiff (``written``)."""

    wall_friction: Interval
    stiffness: Interval
    tangential_restitution: Interval
    written: bool


def lasting_intervals(data: LawData, law: LastingContact) -> LastingIntervals:
    """What the impacts ``data`` leave open of the ``law`` that was fitted to them.

    A scenario's spring is as stiff as its tangential restitution says
    (:func:`analysis.contact.tangential.lasting.stiffness_of`).  Where the impacts show a stiffer one than any scenario
    has, the tangential restitution is that of the scenario which describes them best with the friction found."""
    cost, best = _deviance(data, law), float(np.log(law.stiffness))
    rise, ends = threshold(len(data), 2), (float(np.log(STIFFNESS[0])), float(np.log(STIFFNESS[-1])))

    def over_stiffness(friction: float) -> float:
        near = max(best - NEAR_STIFFNESS, ends[0]), min(best + NEAR_STIFFNESS, ends[1])
        return minimum(lambda log: cost(friction, log), *near, 11, 2)[1]

    def over_friction(log: float) -> float:
        near = (1 - NEAR_FRICTION) * law.wall_friction, (1 + NEAR_FRICTION) * law.wall_friction
        return minimum(lambda friction: cost(friction, log), *near, 13, 2)[1]

    def of_scenario(beta: float) -> float:
        return float(np.log(stiffness_of(beta, law.restitution)))

    level = cost(law.wall_friction, best) + rise
    friction = _interval(over_stiffness, law.wall_friction, FRICTION_RANGE, level, FRICTION_STEP)
    logs = _interval(over_friction, best, ends, level, STIFFNESS_STEP)
    mobility = float(np.mean(data.mobility))
    low, value, high = (float(np.exp(log)) for log in (logs.low, logs.value, logs.high))
    stiffness = Interval(value / mobility, (high - low) / (2 * NORMAL_90 * mobility), low / mobility, high / mobility)
    beta = law.tangential_restitution
    written = bool(np.isfinite(beta))
    if not written:
        beta = minimum(lambda one: cost(law.wall_friction, of_scenario(one)), *TANGENTIAL_RANGE, 21)[0]
        level = over_friction(of_scenario(beta)) + rise
    tangential = _interval(lambda one: over_friction(of_scenario(one)), beta, TANGENTIAL_RANGE, level, TANGENTIAL_STEP)
    # An end that the impacts leave open is that of what a scenario may be given.
    low = tangential.low if np.isfinite(tangential.low) else TANGENTIAL_RANGE[0]
    high = tangential.high if np.isfinite(tangential.high) else TANGENTIAL_RANGE[1]
    return LastingIntervals(friction, stiffness, Interval(beta, (high - low) / (2 * NORMAL_90), low, high), written)


def _deviance(data: LawData, law: LastingContact) -> Callable[[float, float], float]:
    """-2 log L of (friction, logarithm of the stiffness), the scatter chosen best."""
    stopping, share = stick_impulse(data, 0.0), outlier_share(len(data))

    def cost(friction: float, log_stiffness: float) -> float:
        tried = replace(law, wall_friction=friction, stiffness=float(np.exp(log_stiffness)))
        residual = data.tangential_impulse - tried.impulse(stopping, data.normal_impulse)
        return float(best_scatter(residual, data.tangential_sd**2, data.normal_impulse, share))

    return cost


def _interval(
    profile: Callable[[float], float], value: float, limits: tuple[float, float], level: float, step: float
) -> Interval:
    low, high = (crossing(profile, value, limit, level, step) for limit in limits)
    closed = np.isfinite(low) and np.isfinite(high)
    return Interval(value if closed else np.nan, (high - low) / (2 * NORMAL_90), low, high)
