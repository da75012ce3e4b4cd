"""``compare.html``: measured against simulated, one recording."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np

from analysis.compare import Comparison
from analysis.comparison.run_statistics import COUNTED_SPEED_M_PER_S
from analysis.figures.compare import QUANTITIES, flights_ahead, impacts_ahead, run_distributions
from analysis.report.numbers import MISSING, with_unit
from analysis.report.page import Page, pages_beside, source_of

# A run statistic this rare among simulated runs is worth a second look; four are looked at.
RARE_P = 0.02


def comparison_page(comparison: Comparison) -> Page:
    """The page: how far off one flight, one impact and the whole run are."""
    law, friction = comparison.scenario.impact, comparison.scenario.friction
    facts = [
        ("Restitution", with_unit(law.restitution)),
        ("Wall friction", with_unit(law.wall_friction)),
        ("Tangential restitution", with_unit(law.tangential_restitution)),
        (
            "Floor friction",
            MISSING if friction is None else f"{with_unit(friction.coefficient)} ({friction.law})",
        ),
    ]
    page = Page(
        comparison.scenario.name,
        "Measured against simulated",
        "The simulator with these parameters, started from measured states: long runs are chaotic and are "
        "compared as distributions only.",
        facts,
    )
    _add_cards(page, comparison)
    _add_flights(page, comparison)
    _add_impacts(page, comparison)
    _add_run(page, comparison)
    return page


def _add_flights(page: Page, comparison: Comparison) -> None:
    section = page.add_section("One flight ahead", "flights")
    if len(comparison.flights):
        section.add_figure(
            "flights_ahead",
            partial(flights_ahead, comparison.flights),
            "Each flight from the velocity and spin measured after its impact. An error that grows with the "
            "length of the flight is a force that the "
            "model lacks; one that does not is measurement noise.",
            "Error of each flight over time and against its length.",
        )
    else:
        section.add_missing("flights", "No flight between two impacts has a measured start and five frames.")


def _add_impacts(page: Page, comparison: Comparison) -> None:
    section = page.add_section("One impact ahead", "impacts")
    section.add_figure(
        "impacts_ahead",
        partial(impacts_ahead, comparison.impacts),
        "Speeds of the contact point and spin after each impact, from what was measured before it.",
        "Simulated against measured values after each impact.",
    )
    rows = [
        (name, with_unit(rms, unit, 2), with_unit(bias, unit, 2), str(n))
        for name, unit, rms, bias, n in impact_errors(comparison)
    ]
    section.add_table(
        ("quantity after the impact", "RMS error", "mean error", "impacts"),
        rows,
        f"Impacts above {COUNTED_SPEED_M_PER_S} m/s.",
    )


def _add_run(page: Page, comparison: Comparison) -> None:
    section = page.add_section("Whole run", "run")
    if not comparison.samples:
        section.add_missing("whole-run statistics", "They take a measured flight to start from.")
        return
    section.add_figure(
        "run_distributions",
        partial(run_distributions, comparison.samples),
        f"Cumulative distributions; impacts above {COUNTED_SPEED_M_PER_S} m/s and five frames from the next.",
        "Distributions of impact rate, speed, energy and azimuth.",
    )
    section.add_table(
        (
            "quantity",
            "measured (median)",
            "simulated (median)",
            "5 to 95 % of simulated runs",
            "share of runs as far off",
        ),
        [
            (
                QUANTITIES[row["quantity"]][0],
                *(with_unit(QUANTITIES[row["quantity"]][1] * row[c]) for c in ("measured", "simulated")),
                " to ".join(with_unit(QUANTITIES[row["quantity"]][1] * row[c]) for c in ("low", "high")),
                with_unit(row["p"], digits=2),
            )
            for _, row in comparison.statistics.iterrows()
        ],
    )


def write_comparison(comparison: Comparison, folder: Path, recording: Path, save_figures: bool = False) -> Path:
    """Write ``compare.html`` into ``folder`` for the recording in the folder ``recording``; with ``save_figures`` each
    figure too.
    """
    page = comparison_page(comparison)
    page.source = source_of(recording, folder)
    page.links = pages_beside(folder, ("report.html",))
    if save_figures:
        page.save_figures(folder / "figures")
    return page.write(folder / "compare.html")


def impact_errors(comparison: Comparison) -> list[tuple[str, str, float, float, int]]:
    """(quantity, unit, RMS, mean, number) of simulated minus measured after the impacts that count."""
    table = comparison.impacts[
        comparison.impacts["normal_speed_after_m_per_s"]
        > COUNTED_SPEED_M_PER_S * comparison.scenario.impact.restitution
    ]
    found = []
    for name, title, unit in (
        ("normal_speed_after_m_per_s", "normal speed", "m/s"),
        ("tangential_speed_after_m_per_s", "tangential speed", "m/s"),
        ("spin_after_rad_per_s", "spin", "rad/s"),
    ):
        error = (table[f"simulated_{name}"] - table[name]).dropna().to_numpy(float)
        rms, bias = (float(np.sqrt(np.mean(error**2))), float(error.mean())) if len(error) else (np.nan, np.nan)
        found.append((title, unit, rms, bias, len(error)))
    return found


def _add_cards(page: Page, comparison: Comparison) -> None:
    flights, statistics = comparison.flights, comparison.statistics
    details = [
        f"{title.capitalize()} after an impact off by {with_unit(rms, unit, 2)} RMS."
        for title, unit, rms, _, n in impact_errors(comparison)
        if n
    ]
    if len(flights):
        details.insert(
            0,
            f"One flight off by {with_unit(1e3 * float(flights['rms_m'].median()), 'mm', 2)} (median of "
            f"{len(flights)}), worst {with_unit(1e3 * float(flights['rms_m'].max()), 'mm', 2)}.",
        )
    page.add_card("How far off?", "One flight, one impact", "neutral", details or ["Nothing could be predicted."])
    if not len(statistics):
        return
    rare = statistics[statistics["p"] < RARE_P]
    names = ", ".join(QUANTITIES[name][0] for name in rare["quantity"])
    page.add_card(
        "Does the run look like a simulated one?",
        "No" if len(rare) else "Yes",
        "caution" if len(rare) else "good",
        [
            f"Unusual: {names}."
            if len(rare)
            else "Impact rate, speeds, energy and azimuths are within what simulated runs show."
        ],
    )
    if len(rare):
        page.actions.append(
            "The simulator misses something, or a parameter is off: `ovines diagnose` on the series names the cause."
        )
