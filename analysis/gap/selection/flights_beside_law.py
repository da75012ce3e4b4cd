"""The named effects of the flights beside a law: which of them are still asked for, and how large they are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from analysis.flights.cutting.runs import Run
from analysis.gap.selection.flight_candidates import accepted, gain_of
from analysis.gap.selection.flight_causes import friction_cause, term_cause
from analysis.gap.selection.flight_steps import FRICTION, FlightSteps, refitted
from analysis.gap.selection.flights.fit import FlightFit
from analysis.gap.selection.flights.terms import EFFECT_TERMS, FlightTerm
from analysis.gap.selection.null_distribution import threshold
from analysis.gap.series import Series
from analysis.gap.thresholds import GAIN


def without_needless(runs: Sequence[Run], with_law: FlightFit, steps: FlightSteps) -> FlightSteps:
    """``steps`` without the named effects that are no longer accepted beside a law (``with_law``: a fit that holds it):
    they had imitated a part of it."""
    lost = [term for term in named_terms_of(steps) if not still_accepted(with_law, steps, term)]
    return beside_law(without_names(runs, steps, [t.name for t in lost]), with_law, lost) if lost else steps


def beside_law(steps: FlightSteps, with_law: FlightFit, gone: Sequence[FlightTerm]) -> FlightSteps:
    """``steps`` that know what the named terms which are ``gone`` gain beside a law."""
    return replace(steps, left=(*steps.left, *(gain_of(with_law, term, steps.units) for term in gone)))


def named_terms_of(steps: FlightSteps) -> list[FlightTerm]:
    """The named terms, friction apart, that flights hold by ``steps``."""
    return [t for t in EFFECT_TERMS if t.name in {c.effect for c in steps.causes}]


def without_names(runs: Sequence[Run], steps: FlightSteps, names: Sequence[str]) -> FlightSteps:
    """``steps`` without some of the named effects that they hold."""
    chosen = named_terms_of(steps)
    return replace(
        steps,
        causes=tuple(c for c in steps.causes if c.effect not in names),
        named=refitted(runs, steps.named, chosen, [t for t in chosen if t.name not in names]),
        kept=tuple(g for g in steps.kept if g.term.name not in names),
    )


def still_accepted(with_law: FlightFit, steps: FlightSteps, term: FlightTerm) -> bool:
    """Whether a named term is still accepted beside a law (``with_law``: a fit that holds it)."""
    least = threshold(steps.null_distribution, GAIN / 2)
    return accepted(gain_of(with_law, term, steps.units), least, steps.units)


def sized_beside(with_law: FlightFit, steps: FlightSteps, series: Series) -> FlightSteps:
    """``steps`` whose causes have the sizes that they have beside a law (``with_law``: a fit that holds it), and whose
    other effects are what is left of them there: what imitates the law is none of them."""
    causes = []
    for cause in steps.causes:
        term = next((t for t in EFFECT_TERMS if t.name == cause.effect), None)
        own = cause  # an effect that is held as a law has the size of that
        if term is not None:
            own = term_cause(gain_of(with_law, term, steps.units), with_law, series, steps.units)
        elif cause.effect in FRICTION:
            own = friction_cause(cause.effect, with_law, cause.gain, steps.units)
        causes.append(replace(cause, parameters=own.parameters))
    left = tuple(gain_of(with_law, gain.term, steps.units) for gain in steps.left)
    return replace(steps, causes=tuple(causes), left=left)
