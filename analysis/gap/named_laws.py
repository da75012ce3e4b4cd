"""Laws that are effects of the library: reported by their names, held like any other effect."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, replace

import numpy as np

from analysis.contact.restitution import RESTITUTION_EFFECTS
from analysis.flights.cutting.run_data import RunData
from analysis.gap.cause import Cause
from analysis.gap.ladder import Ladder, with_contacts_of, with_held_law
from analysis.gap.laws.dictionary.candidate import named_numbers
from analysis.gap.laws.flight_sizes import holding
from analysis.gap.laws.found_law import LawFound
from analysis.gap.selection.flights.fit import FlightFit
from ovines.core.effects import EFFECTS, Effect
from ovines.core.effects.law_form import LawForm
from ovines.core.laws.terms import Term, WrittenLaw, rows_of

Sized = dict[str, tuple[float, float]]


@dataclass(frozen=True, eq=False)
class NamedPart:
    """Terms of a law that are an ``effect`` of the library, with its parameters (value, sd) in the rig's frame."""

    effect: Effect
    parameters: Sized
    terms: tuple[Term, ...]


def laws_by_name(stage: str) -> frozenset[str]:
    """Effects of a stage that are found by the search of laws."""
    return frozenset(name for name, effect in EFFECTS.items() if effect.by_law and effect.stage == stage)


def named_part(law: LawFound, withheld: frozenset[str] = frozenset()) -> NamedPart | None:
    """The effect of the library that a law is, or holds among its terms; None where it is none, or its name is
    ``withheld``."""
    names = laws_by_name(law.law.stage) - withheld
    parts = (_part(law, effect) for name, effect in EFFECTS.items() if name in names)
    return next((one for one in parts if one is not None), None)


def _part(law: LawFound, effect: Effect) -> NamedPart | None:
    terms = law.rig_law.terms
    if effect.stage == "geometry" and not all(form.stands_still for form in effect.forms):
        return None  # a wall that moves is held by nothing: reported by its formula
    at = [[i for i, term in enumerate(terms) if form.is_named(term)] for form in effect.forms]
    if any(len(found) != 1 for found in at):
        return None
    parameters = Sized()
    for (i,), form in zip(at, effect.forms, strict=True):
        tail = f"_{i + 1}" if len(terms) > 1 else ""
        for parameter, value in form.parameters(terms[i]).items():
            number = law.numbers.get(_number_of(form, parameter) + tail)
            # What a term counts from is not among the law's numbers where it is nothing.
            parameters[parameter] = (value, number[1] if number is not None else 0.0)
    return NamedPart(effect, parameters, tuple(terms[i] for (i,) in at))


def _number_of(form: LawForm, parameter: str) -> str:
    """Name of the number of a law that a parameter of the effect is: the one that changes with it."""
    every = {name: 0.5 for name in form.parameters(form.term(defaultdict(lambda: 0.5)))}
    here, there = (named_numbers(WrittenLaw((form.term(values),))) for values in (every, {**every, parameter: 0.25}))
    (name,) = (one for one, (value, _) in here.items() if there[one][0] != value)
    return name


def effect_of_restitution(law: WrittenLaw) -> str | None:
    """The effect of the restitution that a law of the impacts is, by the form of its terms: a drift with time or run, a
    cosine once around the wall, a fall with the approach speed that dies out; None where it is none."""
    for name in RESTITUTION_EFFECTS:
        if all(any(form.is_form_of(term) for form in EFFECTS[name].forms) for term in law.terms):
            return name
    return None


def with_named_law(
    ladder: Ladder, law: LawFound, named: NamedPart, rng: np.random.Generator, withheld: frozenset[str] = frozenset()
) -> Ladder:
    """The ladder in whose flights the ``named`` part of a law acts, and in which all that they tell is asked beside it,
    the law's other parts, too."""
    runs = holding(ladder.series.runs, named.terms)
    return with_held_law(ladder, runs, _cause(ladder, law, named), rng, withheld)


def with_named_contact_law(
    ladder: Ladder,
    law: LawFound,
    named: NamedPart,
    flights: FlightFit,
    rng: np.random.Generator,
    withheld: frozenset[str] = frozenset(),
) -> tuple[Ladder, FlightFit]:
    """The ladder from whose impacts, between ``flights``, the ``named`` part of a law is taken out, or whose wall has
    it, what they tell beside it asked anew, and these flights with it."""
    flights, cause, nominal = _holding(flights, named), _cause(ladder, law, named), ladder.impacts.nominal
    ladder = with_contacts_of(ladder, flights, rng, withheld)
    ladder = replace(
        ladder,
        impacts=replace(ladder.impacts, nominal=nominal),
        causes=tuple(sorted((*ladder.causes, cause), key=lambda one: -one.weight)),
    )
    return ladder, flights


def _holding(flights: FlightFit, named: NamedPart) -> FlightFit:
    """The fit whose runs hold terms of impacts or of the wall, which no flight feels."""
    rows = rows_of(named.terms)

    def held(run: RunData) -> RunData:
        if named.effect.stage == "geometry":
            return replace(run, stated=run.wall.holding(rows))
        return replace(run, law=np.vstack([run.law, rows]))

    return replace(flights, fits=tuple(replace(one, run=held(one.run)) for one in flights.fits))


def _cause(ladder: Ladder, law: LawFound, named: NamedPart) -> Cause:
    """The effect as a cause, as large as what was left where the law was found."""
    stage = law.law.stage
    strongest = max((one for one in ladder.structure if one.stage == stage), key=lambda one: one.weight)
    return Cause(
        named.effect.name,
        stage,
        named.parameters,
        strongest.strength,
        strongest.gain,
        strongest.coordinate,
        strongest.phase,
        matters=strongest.matters,
    )
