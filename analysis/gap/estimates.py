"""What the parameters and effects amount to, by the one estimator that ``ovines identify`` uses too.

The ladder chooses which effects are there; :func:`analysis.identify.identify_runs` then says how large everything is on
the corrected series with the effects that were named.  Sizes that it does not fit (clocks and cameras, what the Host
does beside its drive, the centre marker, :data:`HELD`) stay those of the steps that found them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.contact.effect_rows import Sized, reported_effects
from analysis.flights.cutting.runs import prepare
from analysis.flights.equation.parameters import INDEX
from analysis.flights.stated_terms import count_of
from analysis.gap.cause import Cause
from analysis.gap.ladder import Ladder
from analysis.gap.series import Series
from analysis.identify import Joint, identify_runs
from analysis.motion.rig_frame import rig_frame
from analysis.walls.outlines import wall_parameter
from ovines.core.effects import EFFECTS, is_law
from ovines.core.laws.terms import MOST_TERMS, WrittenLaw
from ovines.recording_schema import Nominal

Array = NDArray[np.float64]
#: effects whose sizes the steps that found them tell, and the estimator holds; laws by name are others
HELD = ("spin_coupling", "friction_drift", "inertia_error")
#: what both models have, by its name in diagnosis.json
LAW = ("restitution", "wall_friction", "tangential_restitution")
NOMINAL = ("floor_friction", *LAW, "restitution_scatter")


@dataclass(frozen=True, eq=False)
class Estimates:
    """``with_effect``: of the corrected series with everything that was named; ``recalibrated``: value by parameter of
    the nominal model refitted to the series, from which the gap is taken."""

    recalibrated: dict[str, float | None]
    with_effect: Joint

    def nominal(self, model: Nominal | None) -> dict[str, Any]:
        """The nominal parameters as given, recalibrated, and with the effect: recalibration can hide a gap by bending
        them."""
        return {
            name: {
                "as_given": getattr(model, name, None) if model else None,
                "recalibrated": self.recalibrated.get(name),
                "with_effect": value_of(self.with_effect.table, name)[0],
            }
            for name in NOMINAL
        }


def value_of(table: pd.DataFrame, name: str) -> tuple[float | None, float]:
    """Value and sd of a parameter in table ``identification``; None where the data give none."""
    row = table[table["parameter"] == name]
    if not len(row) or not np.isfinite(row["value"].iloc[0]):
        return None, float("inf")
    return float(row["value"].iloc[0]), float(row["sd"].iloc[0])


def estimated(ladder: Ladder, laws: Sequence[WrittenLaw]) -> tuple[Estimates, Ladder]:
    """The parameters of both models, and the ladder with its causes' sizes as the estimator gives them; ``laws`` of the
    flights that were found, in the world."""
    given, model = ladder.measured.laws, ladder.measured.recordings[0].model
    if not (ladder.causes or laws) and ladder.series.motions is ladder.measured.motions:
        # Nothing named, nothing corrected: both models are one.
        joint = _joint(ladder.measured, model, given)
        return Estimates({name: value_of(joint.table, name)[0] for name in NOMINAL}, joint), ladder
    better = improved(ladder, model)
    named = [EFFECTS[c.effect].law(better.effect_parameters[c.effect]) for c in ladder.causes if is_law(c.effect)]
    held = [*given, *named, *(law for law in laws if law.stage == "flight")]
    if count_of(held) > MOST_TERMS:
        held = list(given)
    joint = _joint(ladder.series, better, held)
    causes = tuple(_sized(cause, joint, ladder.series) for cause in ladder.causes)
    return Estimates(_recalibrated(ladder), joint), replace(ladder, causes=causes)


def _recalibrated(ladder: Ladder) -> dict[str, float | None]:
    """The nominal model as the ladder refitted it: what the gap of the recalibrated model is measured from."""
    values = {"floor_friction": float(ladder.flights.nominal.model.parameters[INDEX["friction"]])}
    if ladder.impacts.nominal is not None:
        law = ladder.impacts.nominal.law
        values |= {name: float(getattr(law, name)) for name in LAW} | {"restitution_scatter": law.scatter}
    return {name: value if np.isfinite(value) else None for name, value in values.items()}


def _joint(series: Series, model: Nominal | None, laws: Sequence[WrittenLaw]) -> Joint:
    """The estimator on a series, in the rig's own units; what it tells is the world's.  The ladder has looked for what
    else is there: it does not look again."""
    # Directions are those of the series' own frame, however little a correction has turned its drive.
    inner = replace(rig_frame(series.motions, series.contact_radius_m), turn_rad=0.0)
    motions = [inner.motion(motion, k) for k, motion in enumerate(series.motions)]
    runs = prepare(motions, series.recordings, inner)
    return identify_runs(runs, model, series.frame.within(inner), laws, search=False)


def improved(ladder: Ladder, model: Nominal | None) -> Nominal:
    """The nominal model with the named effects: those :data:`HELD` with their sizes, the others to be fitted."""
    known = model or Nominal(effects=("floor_friction", "spin_coupling"))
    frame, names = ladder.series.frame, [cause.effect for cause in ladder.causes]
    sizes = {name: given for name, given in known.effect_parameters.items() if name not in names}
    for cause in ladder.causes:
        if _is_held(cause):
            stated = frame.world_parameters(cause.effect, cause.parameters)
            sizes[cause.effect] = EFFECTS[cause.effect].nearest({name: value for name, (value, _) in stated.items()})
    effects = [*known.effects, *(name for name in names if name not in known.effects)]
    if "floor_friction" in names and "spin_coupling" not in effects:
        effects.append("spin_coupling")
        coupling = float(ladder.flights.fitted.model.parameters[INDEX["coupling"]])
        sizes["spin_coupling"] = EFFECTS["spin_coupling"].nearest({"coupling": coupling})
    return known.model_copy(update={"effects": tuple(effects), "effect_parameters": sizes})


def _is_held(cause: Cause) -> bool:
    return cause.effect in HELD or is_law(cause.effect)


def _sized(cause: Cause, joint: Joint, series: Series) -> Cause:
    """``cause`` with the size that the estimator gives it, where it does."""
    if _is_held(cause):
        return cause
    sizes = reported_effects(joint.table, [cause.effect]).get(cause.effect, {})
    if cause.effect == "stated_radius":
        sizes = _length_off(cause, joint, series)
    if not sizes:
        return cause
    sizes = series.frame.rig_parameters(cause.effect, sizes)
    if cause.stage == "geometry":
        # The steps know more of what makes them unsure: markers' places, what two views show of the lenses.
        step = cause.parameters
        sizes = {name: (value, max(sd, step[name][1] if name in step else 0.0)) for name, (value, sd) in sizes.items()}
    return replace(cause, parameters=sizes)


def _length_off(cause: Cause, joint: Joint, series: Series) -> Sized:
    """How far that stated length of the wall is off which is off by most of its sds."""
    design = series.runs[0].data.wall
    off = [
        (value - stated, sd)
        for term, stated in design.values().items()
        if design.is_length(term)
        for value, sd in [value_of(joint.table, wall_parameter(term))]
        if value is not None and sd > 0
    ]
    return {"radius_m": max(off, key=lambda one: abs(one[0]) / one[1])} if off else {}
