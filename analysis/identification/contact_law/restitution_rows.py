"""The restitution with the effects on it that ``[model]`` names, as rows of table ``identification``.

Of impacts between flights and of impacts by themselves alike."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from analysis.contact.law import LawData
from analysis.contact.restitution import (
    DIRECTION,
    RESTITUTION_EFFECTS,
    SPEED,
    EffectsFit,
    Sizes,
    conditions,
    fit_effects,
)
from analysis.identification.contact_law.interval import Interval, normal_interval
from analysis.statistics.student import student_over_normal
from ovines.core.effects import EFFECTS

# Effects on the restitution are fitted to so many impacts, as the diagnosis asks for them.
FEWEST_FOR_EFFECTS = 8


def restitution_fit(data: LawData, named: Sequence[str], held: Sizes) -> EffectsFit | None:
    """The restitution of ``data`` (times from the runs' starts) with the effects on it that are ``named``; None where
    there are none, or too few impacts to fit them."""
    names = [name for name in RESTITUTION_EFFECTS if name in named]
    fewest = FEWEST_FOR_EFFECTS if set(names) - set(held) else 1
    return fit_effects(data, names, held) if names and len(data) >= fewest else None


def without_effects(data: LawData, from_start: LawData, fit: EffectsFit) -> LawData:
    """``data`` as it would be without the effects on the restitution; ``from_start``: the same with times from the
    runs' starts."""
    more = fit.at(conditions(from_start)) - fit.value
    return replace(data, after=data.after - more * data.before)


def few(impacts: int, unknowns: int) -> float:
    """What a normal sd is to be multiplied with where the errors' size is read off so few ``impacts``."""
    free = max(impacts - unknowns, 1)
    return float(np.sqrt(impacts / free)) * student_over_normal(free)


def reported_restitution(fit: EffectsFit, impacts: int) -> Interval:
    """The restitution to which a scenario adds the effects."""
    return normal_interval(fit.value, few(impacts, fit.unknowns) * fit.sd)


def effect_sizes(
    fit: EffectsFit, impacts: int, shared: float, turn_rad: float
) -> dict[str, dict[str, tuple[float, float]]]:
    """Sizes of the effects that were fitted to so many ``impacts``, directions turned into the room's by ``turn_rad``;
    ``shared``: error of the restitution that all impacts share, which moves a limit and an amplitude of it as much."""
    wider = few(impacts, fit.unknowns)
    reported = {
        effect: {p: (value, wider * sd) for p, (value, sd) in sizes.items()} for effect, sizes in fit.sizes.items()
    }
    if SPEED in reported:
        value, sd = reported[SPEED]["restitution_fast"]
        reported[SPEED]["restitution_fast"] = (value, float(np.hypot(sd, shared)))
    if DIRECTION in reported:
        (size, sd), (direction, turned) = reported[DIRECTION].values()
        direction = float(np.angle(np.exp(1j * (direction + turn_rad))))
        reported[DIRECTION] = {
            "amplitude": (size, float(np.hypot(sd, shared))),
            "direction_rad": (direction, float(np.hypot(turned, shared / max(size, 1e-9)))),
        }
    return reported


def rows_of(reported: Mapping[str, Mapping[str, tuple[float, float]]]) -> list[tuple[str, Interval]]:
    """Rows of effects with sizes (value, sd)."""
    return [
        (EFFECTS[effect].parameter(parameter).row, normal_interval(value, sd))
        for effect, sizes in reported.items()
        for parameter, (value, sd) in sizes.items()
    ]
