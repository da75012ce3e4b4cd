"""What simulated recordings say of a law that was found and of its nearest other formula."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.contact.held_laws import known_at_impacts
from analysis.flights.cutting.run_data import LENS_TERMS
from analysis.flights.equation.parameters import INDEX, LAW_TERMS
from analysis.flights.evidence import columns_of
from analysis.flights.fit import ORIGIN, SHARED, FlightFits
from analysis.gap.cause import Structure
from analysis.gap.laws.flight_rows import regression_of
from analysis.gap.laws.found_law import LawFound, Other
from analysis.gap.laws.impact_rows import (
    distance_regression,
    law_regression,
    of_target,
    usual_distance_scatter,
    usual_scatter,
)
from analysis.gap.laws.instead.wall import is_lasting
from analysis.gap.laws.linear_law import Rows, number_columns
from analysis.gap.next_test.recording import Recorded, Rig, fitted, quantities_of
from analysis.gap.next_test.separation import Information
from analysis.gap.selection.flights.fit import prior_of
from analysis.gap.selection.impact_steps import LEAST_IMPACTS
from analysis.gap.selection.impacts.fit import ImpactFit, fit_impacts
from ovines.core.effects.written_laws import DRIVE_QUANTITIES
from ovines.core.laws.terms import Factor, Term
from ovines.core.refusal import require

Array = NDArray[np.float64]
#: stages whose laws another excitation can tell apart
STAGES = ("flight", "impact", "geometry")
#: what a single recording has one value of
OF_A_WHOLE_RUN = "run"


@dataclass(frozen=True, eq=False)
class OpenForm:
    """A law found, its ``number`` in its series from 1, and its ``others``, the nearest first."""

    law: LawFound
    number: int
    others: tuple[Other, ...]


def open_form(laws: Sequence[LawFound]) -> OpenForm | None:
    """The first law of flights, impacts or the wall that has another formula near it, one that the data leave open
    before others; and of its formulas those first that are."""
    known = [
        OpenForm(law, number, tuple(sorted(law.others, key=lambda one: (one.told_apart, -one.share))))
        for number, law in enumerate(laws, 1)
        if law.law.stage in STAGES and law.others and not _of_whole_runs(law)
    ]
    return min(known, key=lambda one: one.others[0].told_apart, default=None)


def _of_whole_runs(law: LawFound) -> bool:
    return OF_A_WHOLE_RUN in quantities_of(law.rig_law)


def why_no_setting(left: Structure, laws: Sequence[LawFound], named: str | None) -> str:
    """Why no setting of the drive is simulated for what is ``left``, a sentence; empty where the test by hand says all
    there is to do.  ``named``: the effect that settings were simulated for."""
    if left.stage == "measurement" and any(law.law.stage == "measurement" and law.others for law in laws):
        return (
            "Another setting of the drive does not tell which of its formulas is right: cameras, markers and clocks "
            "are tested on the bench."
        )
    if left.stage not in STAGES or left.is_no_formula:
        return ""
    own = [law for law in laws if law.law.stage in STAGES]
    if not own:
        return "No formula was found for it, so no other setting of the drive could be simulated."
    if all(_of_whole_runs(law) for law in own):
        return "Its formula differs from run to run, which no setting of a single recording shows."
    if not any(law.others for law in own):
        return "No other formula comes near the one found, so there are no two for another setting to separate."
    if named is not None:
        return "Settings of the drive were simulated for what has a name: settle that first."
    return "The simulator does not take its formula, so no other setting of the drive was simulated."


def law_information(rig: Rig, recorded: Sequence[Recorded], form: OpenForm) -> list[Information | None]:
    """What recordings say of a law where another formula may stand in its place, in any size and with any numbers
    inside, by formula; None where that is nothing.  `ScenarioError` of a law in step with the drive, and a Host at
    rest."""
    driven = all(one.host.omega_rad_per_s for one in recorded)
    in_step = not quantities_of(form.law.rig_law).isdisjoint(DRIVE_QUANTITIES)
    found = "a law in step with the drive, and a Host at rest"
    require(driven or not in_step, found, "a Host that is driven", "take a setting with the drive")
    fits = [fitted(rig, one) for one in recorded]
    fits = [one for one in fits if len(one.flights)]
    rows = _ROWS[form.law.law.stage](rig, fits, form.law) if fits else None
    return [None if rows is None else _information(rows, form.law, other) for other in form.others]


def _information(rows: Rows, law: LawFound, other: Other) -> Information:
    problem = rows.problem
    moved = np.nan_to_num(rows.columns(law.rig_law.terms)).sum(1)
    instead = [
        rows.columns([*other.beside, *other.candidate.terms]),
        number_columns(rows, [other.candidate], other.coefficients),
    ]
    unknown = np.nan_to_num(np.column_stack([problem.nuisances, *instead]))
    prior = np.concatenate([problem.prior, np.zeros(unknown.shape[1] - len(problem.prior))])
    return Information.of_rows(moved, unknown, prior, problem.run)


def _flight_rows(rig: Rig, fits: Sequence[FlightFits], law: LawFound) -> Rows:
    """Flights as rows; nominal parameters, markers' origin and lens are unknown."""
    free = dict.fromkeys(("friction", *rig.flights.model.free))
    columns = columns_of([*(n for n in free if n in INDEX and n not in LAW_TERMS), *ORIGIN, *LENS_TERMS])
    prior = prior_of([SHARED[c] for c in columns], rig.like.contact_radius_m)
    return regression_of(fits, rig.flights.noise, columns, prior)


def _impact_rows(rig: Rig, fits: Sequence[FlightFits], law: LawFound) -> Rows | None:
    """Impacts as rows, with the nominal contact law and the scatter that measured ones have; None of too few."""
    measured, impacts = _impacts(rig, fits)
    if impacts is None:
        return None
    terms = rig.ladder.impacts.restitution_terms
    known = known_at_impacts(measured.data, measured.junctions, rig.flights.fits)
    scatter = usual_scatter(measured.data, terms, of_target("restitution", law.rig_law, known))
    return law_regression(replace(impacts, law=measured.law), fits, terms, law.rig_law, scatter, sides_of_law=True)


def _wall_rows(rig: Rig, fits: Sequence[FlightFits], law: LawFound) -> Rows | None:
    """Contact distances as rows, with the scatter that measured ones have about the wall of the law; radius, centre and
    what else the wall is free in are unknown, and so is how long contacts last where they do.  None of too few."""
    measured, impacts = _impacts(rig, fits)
    if impacts is None:
        return None
    rows = distance_regression(impacts, fits, law.rig_law, usual_distance_scatter(measured))
    if not rig.ladder.impacts.shape.finite or is_lasting(law):
        return rows
    lasting = rows.columns([Term("contact_radius", 1.0, (Factor("approach"),))])
    nuisances = np.column_stack([rows.problem.nuisances, lasting])
    prior = np.concatenate([rows.problem.prior, [0.0]])
    return replace(rows, problem=replace(rows.problem, nuisances=nuisances, prior=prior))


def _impacts(rig: Rig, fits: Sequence[FlightFits]) -> tuple[ImpactFit, ImpactFit | None]:
    """Measured impacts, and those between simulated flights; None where these are too few."""
    steps = rig.ladder.impacts
    assert steps.fitted is not None, "a law of the impacts or the wall, and no impacts"
    impacts = fit_impacts(fits, steps.shape)
    return steps.fitted, impacts if len(impacts.data) >= LEAST_IMPACTS else None


_ROWS: dict[str, Callable[[Rig, Sequence[FlightFits], LawFound], Rows | None]] = {
    "flight": _flight_rows,
    "impact": _impact_rows,
    "geometry": _wall_rows,
}
