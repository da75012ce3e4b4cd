"""Sizes of effects that ``[model]`` states, as terms of the flight model in the rig's frame."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from analysis.flights.cutting.run_data import RunData
from analysis.flights.cutting.runs import Run
from analysis.flights.equation.model import GRAVITY_M_PER_S2
from analysis.motion.rig_frame import RigFrame
from ovines.core.effects import EFFECTS
from ovines.core.laws.terms import MOST_TERMS, Term, WrittenLaw, rows_of
from ovines.core.refusal import ScenarioError
from ovines.errors import InputError
from ovines.law_file import read_law
from ovines.recording import Recording
from ovines.recording_schema import Nominal

#: relative change of friction from run to run: a term of the series, no parameter of a flight
DRIFT_OF_RUN = "drift_run"
#: effects of the flights whose sizes become such terms
STATED_IN_FLIGHT = ("spin_coupling", *(name for name, effect in EFFECTS.items() if effect.in_flights is not None))


def stated_sizes(model: Nominal | None) -> dict[str, dict[str, float]]:
    """Sizes of effects in ``[model.effect_parameters]``, with defaults; `InputError` for what the library does not
    know."""
    sizes = {}
    for name, given in (model.effect_parameters if model is not None else {}).items():
        where = f"[model.effect_parameters.{name}]"
        if name not in EFFECTS:
            raise InputError(where, "one of " + ", ".join(EFFECTS), "correct recording.toml")
        try:
            sizes[name] = EFFECTS[name].complete(given)
        except ScenarioError as error:
            raise InputError(f"{where}: {error.found}", error.expected, "correct recording.toml") from None
    return sizes


def stated_terms(model: Nominal | None, frame: RigFrame, starts_s: Sequence[float]) -> dict[str, float]:
    """Terms of the flight model, by their names in :data:`analysis.flights.equation.parameters.PARAMETERS` (and
    :data:`DRIFT_OF_RUN`), of the effects to which ``[model.effect_parameters]`` gives sizes.

    ``starts_s``: times of the runs' first frames in the rig's frame, which counts from their middles."""
    sizes = stated_sizes(model)
    terms: dict[str, float] = {}
    if "spin_coupling" in sizes:
        terms["coupling"] = sizes["spin_coupling"]["coupling"]
    for name, given in sizes.items():
        own = EFFECTS[name].in_flights
        if own is None:
            continue
        if own.named_at:
            terms[own.names[0]] = own.named_at  # a share of what was measured, whose size is that of the motion itself
        elif own.parameter:
            terms[own.names[0]] = given[own.parameter] / frame.factor(own.parameter)
    if "table_tilt" in sizes:
        pull = GRAVITY_M_PER_S2 * sizes["table_tilt"]["tilt_rad"] / frame.factor("x_m_per_s2")
        direction = sizes["table_tilt"]["direction_rad"] - frame.turn_rad
        terms |= {"tilt_x": pull * float(np.cos(direction)), "tilt_y": pull * float(np.sin(direction))}
    if "friction_drift" in sizes:
        # Stated about the run's start and the first run, fitted about their middles.
        a = terms["drift"]
        b = sizes["friction_drift"]["relative_per_run"]
        middle_s, later = _middle(starts_s)
        terms |= {"drift": a / (1 + a * middle_s), DRIFT_OF_RUN: b / (1 + b * later)}
    return terms


def held_laws(recordings: Sequence[Recording], more: Sequence[Path] = ()) -> list[WrittenLaw]:
    """The laws of flights, impacts and the wall that the nominal model of all ``recordings`` holds, in the world: of
    effects that act as one, of ``[model] laws``, and of the files ``more``; `InputError` for one of a wall that is not
    round or that follows more than the azimuth, and for more terms than the flights' model has parameters for."""
    laws = [law for law in _written(recordings, more) if law.stage != "measurement"]
    laws = [*effects_as_laws(recordings[0].model), *laws]
    if count_of(laws) > MOST_TERMS:
        raise InputError(f"laws of more than {MOST_TERMS} terms together", f"{MOST_TERMS} terms", "leave some out")
    host = recordings[0].settings.bodies.host
    if of_wall(laws) and host is not None and host.polygon_m is not None:
        raise InputError("a law of the contact radius, and flat walls", "a round wall", "leave the law out")
    return laws


def of_wall(laws: Sequence[WrittenLaw]) -> list[Term]:
    """The terms that are the wall's."""
    return [term for law in laws if law.stage == "geometry" for term in law.terms]


def count_of(laws: Sequence[WrittenLaw]) -> int:
    """How many terms of them flights and impacts hold; the wall's are part of the wall."""
    return sum(len(law.terms) for law in laws if law.stage != "geometry")


def holding_laws(runs: Sequence[Run], laws: Sequence[WrittenLaw], frame: RigFrame) -> list[Run]:
    """``runs``, in the rig's own units, that hold the ``laws`` of the world, to which ``frame`` leads: flights and
    impacts their terms, in the place of those that they had, and the wall its own, beside what it has."""
    rows = rows_of([term for law in laws if law.stage != "geometry" for term in frame.law(law).terms])
    wall = rows_of([term for law in laws if law.stage == "geometry" for term in frame.law(law).terms])

    def held(run: RunData) -> RunData:
        return replace(
            run, law=rows if len(rows) else run.law, stated=run.wall.holding(wall) if len(wall) else run.stated
        )

    return [replace(run, data=held(run.data)) for run in runs]


def measurement_laws(recordings: Sequence[Recording], more: Sequence[Path] = ()) -> list[WrittenLaw]:
    """The laws of cameras and clocks among ``[model] laws`` of all ``recordings`` and the files ``more``."""
    return [law for law in _written(recordings, more) if law.stage == "measurement"]


def _written(recordings: Sequence[Recording], more: Sequence[Path]) -> list[WrittenLaw]:
    stated = [recording.model.laws if recording.model else () for recording in recordings]
    for recording, names in zip(recordings, stated, strict=True):
        if names != stated[0]:
            raise InputError(
                f"{recording.folder}: [model] laws = {list(names)}, and {list(stated[0])} in {recordings[0].folder}",
                "one nominal model in a series",
                "give all recordings the same laws",
            )
    paths = [*(recordings[0].folder / name for name in stated[0]), *more]
    laws = [read_law(path) for path in paths]
    for path, law in zip(paths, laws, strict=True):
        if any({factor.quantity for factor in term.factors} != {"azimuth"} for term in of_wall([law])):
            raise InputError(
                f"{path}: a law of the wall that follows more than the azimuth",
                "a wall that stands still in the Host",
                "leave it out",
            )
    return laws


def effects_as_laws(model: Nominal | None) -> list[WrittenLaw]:
    """Effects that are laws to which ``[model.effect_parameters]`` gives sizes, as these."""
    return [EFFECTS[name].law(sizes) for name, sizes in stated_sizes(model).items() if EFFECTS[name].by_law]


def drift_from_the_start(
    per_s: tuple[float, float], per_run: tuple[float, float], starts_s: Sequence[float]
) -> dict[str, tuple[float, float]]:
    """Sizes (value, sd) of ``friction_drift`` as :func:`stated_terms` takes them, of the changes about the middles of
    runs that began at ``starts_s``."""
    middle_s, later = _middle(starts_s)
    changes = {"relative_per_s": (*per_s, middle_s), "relative_per_run": (*per_run, later)}
    return {
        name: (value / (1 - value * way), sd / (1 - value * way) ** 2) for name, (value, sd, way) in changes.items()
    }


def share_at_start(terms: Mapping[str, float], starts_s: Sequence[float]) -> float:
    """Floor friction at the start of the first run over that in the middle of all."""
    middle_s, later = _middle(starts_s)
    return float((1 - terms.get("drift", 0.0) * middle_s) * (1 - terms.get(DRIFT_OF_RUN, 0.0) * later))


def _middle(starts_s: Sequence[float]) -> tuple[float, float]:
    """From the runs' starts to their middles (s), from the first run to the middle one."""
    return -float(np.mean(starts_s)), 0.5 * (len(starts_s) - 1)
