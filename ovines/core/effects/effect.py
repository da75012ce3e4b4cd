"""What an effect is: a name, a stage, parameters with sizes, and what it does to the simulator."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ovines.core.compiled import Floats
from ovines.core.effects.law_form import LawForm
from ovines.core.laws.terms import WrittenLaw
from ovines.core.refusal import ScenarioError, require, require_range
from ovines.core.system import parameters as P
from ovines.core.system.model import Scenario
from ovines.core.system.packed import Packed

Values = Mapping[str, float]  # an effect's parameters
Apply = Callable[[Packed, Values, Scenario], Packed]


@dataclass(frozen=True)
class Measurement:
    """What a run shows: ``times`` (n,), ``samples`` (n, 12, columns of :mod:`ovines.core.integration.sampling`), the
    engine's ``impacts`` (k, columns of :mod:`ovines.core.system.parameters`) and the disk's mass (kg)."""

    times: Floats
    samples: Floats
    impacts: Floats
    mass_kg: float


Observe = Callable[[Measurement, Values, np.random.Generator], Measurement]


@dataclass(frozen=True)
class EffectParameter:
    """One number of an effect: unit and bounds; ``default`` None: it must be given.  ``row`` of table
    ``identification`` that tells it, ``times`` over."""

    name: str
    unit: str
    low: float
    high: float
    default: float | None = None
    row: str = ""
    times: float = 1.0


class Words(NamedTuple):
    """How pages speak of an effect: its ``title``, a ``phrase`` that says what it is, and the test ``by_hand`` that
    shows it apart from everything else."""

    title: str
    phrase: str
    by_hand: str


class VectorRows(NamedTuple):
    """The ``rows`` of table ``identification`` that tell an effect of a size and a direction, its first two parameters:
    components, ``unit`` times the size, which turn ``turns`` times when the direction turns once."""

    rows: tuple[str, str]
    unit: float = 1.0
    turns: int = 1


@dataclass(frozen=True)
class InFlights:
    """How a fit of flights holds an effect: ``names`` of its unknowns in the equation of motion, and the effect's
    ``parameter`` that the first of them is (empty: they tell its parameters together).

    ``named_at``: what they are where the nominal model names the effect; ``drags``: it only takes energy; ``withheld``:
    what its unknowns are called when its name is not known."""

    names: tuple[str, ...]
    withheld: str
    parameter: str = ""
    named_at: float = 0.0
    drags: bool = False


def unchanged(packed: Packed, values: Values, scenario: Scenario) -> Packed:
    """An effect that leaves the motion alone (measurement)."""
    return packed


@dataclass(frozen=True)
class Effect:
    """One effect, used by all: ``apply`` changes the packed scenario, ``observe`` the sampled motion.

    ``observe(seen, values, rng)`` takes what a run shows (:class:`Measurement`) and gives what is reported of it.
    ``meaning`` says what it is, how large and after whom; ``words`` are those of pages.  ``in_flights``: unknowns of
    its own in the fit of flights; ``forms``: it as a law; ``rows``: those that tell it, where its parameters have none
    of their own; ``views``: (residual, covariate) of the figures that show it.

    An effect whose forms have coefficients is a law by name (:attr:`by_law`): ``identify`` and ``compare`` hold it as
    one, so does the simulator, unless it has an ``apply``, and ``diagnose`` names it where it finds that law."""

    name: str
    stage: str
    parameters: tuple[EffectParameter, ...]
    meaning: str
    words: Words
    apply: Apply = unchanged
    observe: Observe | None = None
    in_flights: InFlights | None = None
    forms: tuple[LawForm, ...] = ()
    rows: VectorRows | None = None
    views: tuple[tuple[str, str], ...] = ()

    @property
    def by_law(self) -> bool:
        """Whether it is held, and found, as a law."""
        return bool(self.forms) and all(form.coefficient for form in self.forms)

    def parameter(self, name: str) -> EffectParameter:
        """Its parameter of this name."""
        return next(one for one in self.parameters if one.name == name)

    def law(self, values: Values) -> WrittenLaw:
        """It as a law, of these sizes; of an effect that is one (:attr:`by_law`)."""
        full = self.complete(values)
        return WrittenLaw(tuple(form.term(full) for form in self.forms))

    def complete(self, values: Values) -> dict[str, float]:
        """Parameters with defaults, each inside its bounds; unknown or missing ones are refused."""
        known = {parameter.name: parameter for parameter in self.parameters}
        for name in values:
            expected = ", ".join(known)
            require(name in known, f"effects.{self.name}.{name}", f"one of {expected}", "correct the parameter's name")
        full = {}
        for name, parameter in known.items():
            value = values.get(name, parameter.default)
            if value is None:
                raise ScenarioError(f"effects.{self.name} without {name}", f"{name} in {parameter.unit}", "give it")
            low = parameter.low if math.isfinite(parameter.low) else -math.inf
            require_range(f"effects.{self.name}.{name}", float(value), low, parameter.high)
            full[name] = float(value)
        return full

    def nearest(self, measured: Values) -> dict[str, float]:
        """The ``measured`` parameters that it has, each at the nearest value inside its bounds: an estimate may lie
        beyond one by its error (a coupling of 1.006)."""
        return {
            one.name: min(max(float(measured[one.name]), one.low), one.high)
            for one in self.parameters
            if one.name in measured and math.isfinite(measured[one.name])
        }


def with_lobe(packed: Packed, size: float, order: float, direction_rad: float) -> Packed:
    """A copy of ``packed`` with one more lobe of its round wall: contact radius times 1 + size cos(order (azimuth -
    direction)).
    """
    count = int(packed.p[P.LOBES])
    require(
        count < P.MOST_LOBES, f"more than {P.MOST_LOBES} lobes of a wall", f"{P.MOST_LOBES} at the most", "merge them"
    )
    at = P.LOBE_TABLE + 3 * count
    return with_floats(packed, {P.LOBES: count + 1.0, at: size, at + 1: order, at + 2: direction_rad})


def with_floats(packed: Packed, changes: Mapping[int, float]) -> Packed:
    """A copy of ``packed`` with some of its numbers changed."""
    changed = packed.copy()
    for place, value in changes.items():
        changed.p[place] = value
    return changed
