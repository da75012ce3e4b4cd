"""The flights' model of the diagnosis: parameters, what is free, and what [model] states."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from analysis.flights.cutting.run_data import LENS_TERMS, RunData
from analysis.flights.equation.parameters import INDEX, PARAMETERS
from analysis.flights.fit import ORIGIN
from analysis.flights.stated_terms import DRIFT_OF_RUN
from analysis.gap.selection.flights.terms import EFFECT_TERMS

Array = NDArray[np.float64]

START_FRICTION = 0.25
#: the longest step of a column that its linearisation bears (1; the origin's in m)
LONGEST = {**dict.fromkeys(("friction", "load", "coupling"), 0.3), **dict.fromkeys(ORIGIN, 2e-3), DRIFT_OF_RUN: 0.1}


@dataclass(frozen=True, eq=False)
class FlightModel:
    """Parameter vector, the markers' origin against the centre of mass, relative change of friction per run, and what
    is free; ``stated``: what ``[model]`` holds (:func:`analysis.flights.stated_terms.stated_terms`).
    """

    parameters: Array
    origin_m: Array
    drift_per_run: float
    free: tuple[str, ...]
    stated: Mapping[str, float] = field(default_factory=dict)

    def shared(self) -> Array:
        """Parameters that all flights share: the markers' origin (m) and the lens residual's terms."""
        return np.concatenate([self.origin_m, np.zeros(len(LENS_TERMS))])

    def of_run(self, place: RunPlace) -> Array:
        """Parameters of one run.  Friction drifts from each run's start on, as the floor does: long runs pass their
        middle, where time counts from, later than short ones.
        """
        p = self.parameters.copy()
        later = 1 + p[INDEX["drift"]] * place.later_s
        p[INDEX["friction"]] *= later * (1 + self.drift_per_run * place.number)
        p[INDEX["drift"]] /= later
        return p

    def friction_per_drift(self, place: RunPlace) -> float:
        """How much more friction a run has for a unit of drift (s), which counts from its start, in its middle."""
        return float(self.parameters[INDEX["friction"]] * place.later_s)


@dataclass(frozen=True)
class RunPlace:
    """A run among its series: ``number`` counted from the middle one, ``later_s`` from its start to its middle, less
    the runs' mean of that."""

    number: float
    later_s: float


def run_places(runs: Sequence[RunData]) -> list[RunPlace]:
    """Places of the runs of a series."""
    start = np.array([-run.time_s[0] for run in runs])
    number = np.arange(len(runs)) - 0.5 * (len(runs) - 1)
    return [RunPlace(float(n), float(s)) for n, s in zip(number, start - start.mean(), strict=True)]


def nominal_model(
    effects: Sequence[str], stated: Mapping[str, float] | None = None, friction: float | None = None
) -> FlightModel:
    """The flight model of ``[model] effects`` before it is fitted; ``stated`` terms are held."""
    stated = stated or {}
    p = np.zeros(len(PARAMETERS))
    free: list[str] = []
    if "floor_friction" in effects or "spin_coupling" in effects or "friction_drift" in effects:
        p[INDEX["friction"]] = friction if friction else START_FRICTION
        free.append("friction")
    if "spin_coupling" in effects:
        p[INDEX["coupling"]] = 1.0
    for term in EFFECT_TERMS:
        if term.name in effects:
            free += term.columns
            if term.named_at:
                p[INDEX[term.columns[0]]] = term.named_at
    for name in set(stated) & set(INDEX):
        p[INDEX[name]] = stated[name]
    return FlightModel(p, np.zeros(2), stated.get(DRIFT_OF_RUN, 0.0), tuple(n for n in free if n not in stated), stated)


def moved(model: FlightModel, names: Sequence[str], step: Array) -> FlightModel:
    """``model`` after a ``step`` (P,) in the columns ``names``; steps too long for a linearisation are shortened."""
    p, origin, drift = model.parameters.copy(), model.origin_m.copy(), model.drift_per_run
    for name, whole in zip(names, step, strict=True):
        value = float(np.clip(whole, -LONGEST.get(name, np.inf), LONGEST.get(name, np.inf)))
        if name in INDEX:
            p[INDEX[name]] += value
        elif name in ORIGIN:
            origin[ORIGIN.index(name)] += value
        elif name == DRIFT_OF_RUN:
            drift += value
        # The lens residual is a nuisance: it is known too badly to correct positions with.
    p[INDEX["friction"]] = max(p[INDEX["friction"]], 0.0)
    return replace(model, parameters=p, origin_m=origin, drift_per_run=drift)


def too_long(names: Sequence[str], step: Array) -> bool:
    """Whether :func:`moved` shortens a ``step`` (P,) in the columns ``names``."""
    return any(abs(value) > LONGEST.get(name, np.inf) for name, value in zip(names, step, strict=True))


def value_of(model: FlightModel, column: str) -> float:
    """Where a shared column stands in a model; 0 for the lens residual, which is never moved."""
    if column == DRIFT_OF_RUN:
        return model.drift_per_run
    if column in ORIGIN:
        return float(model.origin_m[ORIGIN.index(column)])
    return float(model.parameters[INDEX[column]]) if column in INDEX else 0.0


def without_columns(model: FlightModel, columns: set[str]) -> FlightModel:
    """``model`` without these columns: they are what `[model]` states, or nil."""
    parameters = model.parameters.copy()
    for column in columns & set(INDEX):
        parameters[INDEX[column]] = model.stated.get(column, 0.0)
    return replace(
        model,
        parameters=parameters,
        drift_per_run=model.stated.get(DRIFT_OF_RUN, 0.0) if DRIFT_OF_RUN in columns else model.drift_per_run,
        free=tuple(n for n in model.free if n not in columns),
    )


def with_free(model: FlightModel, names: Sequence[str]) -> FlightModel:
    """``model`` with these columns free too."""
    return replace(model, free=tuple(dict.fromkeys((*model.free, *names))))
