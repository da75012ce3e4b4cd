"""The next test on the page: how well one recording in each setting separates what was found from its nearest rival."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from analysis.figures.style import BLUE, GREY, RED, label, new_figure
from analysis.gap.diagnose import Diagnosis
from analysis.gap.laws.found_law import LawFound
from analysis.gap.next_test.choice import LEAST_SEPARATION, SETTLES, law_in
from analysis.gap.next_test.recording import acts
from analysis.gap.page.words import plain
from analysis.report.numbers import value_with_sd
from analysis.report.page import Page

# Recordings above which a setting is no way to an answer.
MOST_RECORDINGS = 20
ROW_IN, LEFT_IN = 0.26, 3.95
# Smaller separations are shown without digits: none of them is of use.
LEAST_SHOWN = 0.5


def next_section(page: Page, diagnosis: Diagnosis) -> None:
    """Settings of the drive, ranked by how well one recording separates the two; nothing where none was simulated."""
    tests = diagnosis.summary["next_tests"]
    if tests is None:
        return
    section = page.add_section("The next test", "next")
    if tests["law"] is None:
        what = f"{plain(tests['effect'])} (found) and {plain(tests['rival'])} (its nearest rival)"
        section.add_text(
            f"Which recording should come next? {what[0].upper()}{what[1:]} are the nearest explanations of these data."
        )
    else:
        section.add_text(
            "Which recording should come next? Two formulas are the nearest explanations of these data: the law that "
            "was found, and the nearest other one."
        )
        section.add_table(
            ("", "formula"), [(tests["law"], tests["effect"]), ("the other", tests["rival"])], text_columns=(0, 1)
        )
    section.add_text(
        f"The rig was simulated with what was found, in each setting, from {tests['starts']} measured beginnings of "
        f"{tests['duration_s']:.1f} s. {_beside(law_in(tests['law'], diagnosis.laws))}The bar says how far apart the "
        "two are then, as a multiple of what noise alone moves the answer. "
        f"Below {LEAST_SEPARATION:g} they look alike. From {SETTLES:g} on one recording settles which it is: chance is "
        "as far off once in 370. Beside the rival everything else that is not known may take any size. The ± is how "
        "far other beginnings would lead."
    )
    best = max(one["separation_sd"] for one in tests["settings"])
    section.add_figure(
        "next-settings",
        partial(settings_figure, tests),
        f"How far apart one recording of {tests['duration_s']:.1f} s sets the two, by setting; red: the setting to "
        "record. Right of the dashed line one recording settles it.",
        "Bars of the separation by setting of the drive",
    )
    section.add_table(
        ("setting", "how far apart, in sds of the noise", f"recordings of {tests['duration_s']:.1f} s that settle it"),
        [
            (
                one["setting"],
                _shown(one["separation_sd"], one["standard_error"]),
                recordings_needed(one["separation_sd"]),
            )
            for one in tests["settings"]
        ],
        text_columns=(0,),
    )
    if any(one["standard_error"] is None and one["separation_sd"] >= LEAST_SHOWN for one in tests["settings"]):
        section.add_text(
            "Without a ±: from some of the beginnings the disk met the wall too seldom to say anything, so how far "
            "others would lead is not known."
        )
    if best < LEAST_SEPARATION:
        section.add_note("No setting that was simulated separates the two: they do the same to the disk.", "caution")


def _beside(law: LawFound | None) -> str:
    """What is said of a law that the simulated rig did not have in it."""
    if law is None or acts(law.rig_law):
        return ""
    return (
        "The simulated wall stands still in the Host and the simulated disk is round, so this formula was not in it: "
        "it moves the contacts that were found without it. "
    )


def _shown(separation_sd: float, standard_error: float | None) -> str:
    if separation_sd < LEAST_SHOWN:
        return f"less than {LEAST_SHOWN:g}"
    # With no error nobody knows how many digits are right: two, as those beside it have.
    if standard_error is None:
        return f"{separation_sd:.2g}" if separation_sd < 100 else f"{separation_sd:.0f}"
    return value_with_sd(separation_sd, standard_error)


def recordings_needed(separation_sd: float) -> str:
    """How many recordings settle a question that one separates by so many standard deviations: their squares add."""
    if not separation_sd > SETTLES / np.sqrt(MOST_RECORDINGS):
        return f"more than {MOST_RECORDINGS}"
    return f"{max(1, int(np.ceil((SETTLES / separation_sd) ** 2)))}"


def settings_figure(tests: dict[str, Any]) -> Figure:
    """Bars of the settings, best first, with their standard errors."""
    settings = tests["settings"]
    size = np.array([one["separation_sd"] for one in settings])
    error = np.array([one["standard_error"] or 0.0 for one in settings])
    at = np.arange(len(settings))[::-1]
    colours = [RED if one["setting"] == tests["recommended"] else BLUE for one in settings]
    figure, axes = new_figure(height_in=0.85 + ROW_IN * len(settings), margins_in=(LEFT_IN, 0.15, 0.5, 0.3))
    ax = axes[0, 0]
    ax.barh(at, size, 0.62, xerr=np.vstack([np.minimum(error, size), error]), color=colours, ecolor="#222222")
    ax.axvline(SETTLES, color=GREY, linestyle="--", linewidth=1.0)
    ax.set_yticks(at, [one["setting"] for one in settings])
    ax.set_ylim(-0.6, len(settings) - 0.4)
    ax.set_xlim(0.0, max(1.05 * float((size + error).max(initial=0.0)), 1.3 * SETTLES))
    ax.text(SETTLES, len(settings) - 0.35, "one settles it", color=GREY, fontsize=7.5, ha="center", va="bottom")
    label(ax, "how far apart, over what noise moves the answer", "")
    return figure
