"""Section of gap.html on the candidates: what each effect and each probe gains on runs held out."""

from __future__ import annotations

from functools import partial

import numpy as np

from analysis.gap.diagnose import Diagnosis
from analysis.gap.page.figures.impact_ranking import impact_candidates
from analysis.gap.page.figures.panels import Candidate, ranking_figure
from analysis.gap.page.words import plain
from analysis.gap.selection.flight_candidates import Gain
from analysis.gap.selection.null_distribution import threshold
from analysis.gap.thresholds import GAIN, IMPACT_GAIN
from analysis.report.page import Page


def ranking_section(page: Page, diagnosis: Diagnosis) -> None:
    """Rankings of flights and impacts."""
    ladder = diagnosis.ladder
    section = page.add_section("Candidates", "candidates")
    single = len(ladder.series.runs) == 1
    by_law = any(law.law.stage == "flight" for law in diagnosis.laws)
    section.add_text(
        "What each candidate gains on runs that its estimate never saw. A real effect gains on most runs; a chance "
        "one on few. "
        "Each is judged beside everything else that was accepted, effects with a name and probes (structure without "
        "one) alike: an accepted one by what is lost without it, any other by what it would add."
        + (
            " Beside a law of the flights, what has no part in the model is judged with the law in it."
            if by_law
            else ""
        )
        + (" With a single run nothing is held out: these gains are of the same data." if single else "")
    )
    found = {c.effect for c in ladder.causes}
    structure = {s.goes_with for s in ladder.structure}
    kept = {g.term.name: g for g in ladder.flights.kept}
    beside = [*kept.values(), *(g for g in ladder.flights.left if g.term.name not in kept)]
    flights = [
        Candidate(plain(g.term.name), True, g.per_run, g.term.name in found)
        for g in beside
        if g.term.named and _tried(g)
    ]
    probes = [
        Candidate(g.term.name, False, g.per_run, g.term.name in structure)
        for g in (
            *(g for g in beside if not g.term.named),
            *(g for g in ladder.flights.probes if g.term.name not in kept),
        )
        if _tried(g)
    ]
    runs = max(len(ladder.series.runs), 1)
    if flights or probes:
        section.add_figure(
            "gap-ranking-flights",
            partial(
                ranking_figure,
                [*flights, *probes],
                threshold(ladder.flights.null_distribution, GAIN / 2) / runs,
                "flights",
            ),
            "Flights: gain per held-out run, mean (bar) and each run (dots). The dashed line is the least mean gain "
            "that is accepted (a fixed one, or what chance "
            "reaches once in four hundred series without effect, if that is more); significance and size must also be "
            "enough.",
            "Ranking of flight candidates",
        )
    else:
        section.add_missing("candidates in the flights", "no candidate could be tried on these flights.")
    impacts = [Candidate(plain(c.name), True, c.per_run, c.accepted) for c in impact_candidates(ladder, probes=False)]
    leftover = sorted(impact_candidates(ladder, probes=True), key=lambda c: -c.per_run.sum())
    if impacts:
        keep = [c for c in leftover if c.accepted] + [c for c in leftover if not c.accepted][:14]
        section.add_figure(
            "gap-ranking-impacts",
            partial(
                ranking_figure,
                [*impacts, *keep],
                threshold(ladder.impacts.null_distribution, IMPACT_GAIN) / runs,
                "impacts",
            ),
            f"Impacts, as above; of {len(leftover)} probes the accepted ones and the best fourteen others are shown.",
            "Ranking of impact candidates",
        )
    else:
        section.add_missing("candidates at the impacts", "fewer than eight impacts could be used.")


def _tried(gain: Gain) -> bool:
    return len(gain.per_run) > 0 and bool(np.isfinite(gain.per_run).all())
