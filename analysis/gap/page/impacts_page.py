"""``gap.html`` of impacts by themselves: the answer, its parameters, and what would have been seen."""

from __future__ import annotations

from typing import Any

from analysis.gap.answer import answer_in_words
from analysis.gap.page.tables import detectable_rows, parameter_rows
from analysis.report.page import Page, Status


def impacts_page(summary: dict[str, Any], title: str, count: int) -> Page:
    """The page of :func:`analysis.gap.impacts_alone.diagnose_impacts`, of ``count`` recordings."""
    page = Page(title, "Gap between simulator and experiment", "Impacts by themselves: nothing else was measured.")
    status: dict[str, Status] = {"none": "good", "effect": "caution", "unknown": "bad"}
    page.add_card("What is it?", summary["verdict"], status[summary["verdict"]], answer_in_words(summary).splitlines())
    page.actions.append(summary["next_test"])
    if count == 1:
        page.actions.append("Bring more recordings: of a single one, its own impacts are held out in five parts.")
    if summary["parameters"]:
        section = page.add_section("Parameters", "parameters")
        section.add_table(
            ("effect", "parameter", "value", "90 % interval"),
            parameter_rows(summary["parameters"]),
            text_columns=(0, 1),
        )
    section = page.add_section("What would have been seen", "limits")
    section.add_table(
        ("effect", "parameter", "smallest size named", "limit of the noise", "measured ± sd of the noise"),
        detectable_rows(summary["detectable"], summary["parameters"]),
        text_columns=(0, 1),
    )
    section.add_missing("flights, drive, geometry and measurement", "the recordings bring impacts alone.")
    return page
