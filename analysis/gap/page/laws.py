"""The laws written for what is left: formula, numbers, residual before and after, path, what else it may be."""

from __future__ import annotations

import re
from functools import partial
from textwrap import fill

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from analysis.figures.style import BLACK, BLUE, GREY, RED, label, legend, new_figure
from analysis.flights.cutting.runs import Run
from analysis.gap.diagnose import Diagnosis
from analysis.gap.laws.evidence import Evidence
from analysis.gap.laws.found_law import LawFound
from analysis.gap.laws.frames.corrected import lasts
from analysis.gap.laws.regression.halves import Halves
from analysis.gap.next_test.recording import acts
from analysis.gap.page.figures.at_blows import blow_figure
from analysis.gap.page.figures.changed_picture import boards_figure, changed_picture_figure
from analysis.gap.page.tables import chance
from analysis.gap.prediction.predict import measured_paths
from analysis.report.numbers import interval, percent, with_unit
from analysis.report.page import Page, Section
from analysis.statistics.student import NORMAL_90
from ovines.core.laws.formula import as_text, latex_lines
from ovines.core.laws.formula import legend as symbols
from ovines.core.laws.targets import BOARDS, MARKER_NEIGHBOUR, TARGETS
from ovines.core.laws.words import QUANTITIES

Array = NDArray[np.float64]
# Of the flight that is drawn: as many frames at the least.
FEWEST_FRAMES = 20
# LaTeX of the symbols as plain characters.
PLAIN = {
    r"\times": " × ", r"\cdot": " · ", r"\varphi": "φ", r"\varepsilon": "ε", r"\beta": "β", r"\omega": "ω",
    r"\delta": "δ", r"\rho": "ρ", r"\chi": "χ", r"\ell": "ℓ", r"\sigma": "σ", r"\tau": "τ",
    r"\Delta": "Δ", r"\theta": "θ", r"\psi": "ψ", r"\phi": "φ", r"\mu": "μ", r"\alpha": "α",
    r"\,": " ", r"\Theta": "Θ", r"\Psi": "Ψ", r"\perp": "⊥", r"\parallel": "∥", "{": "", "}": "",
}  # fmt: skip
# Letters that can stand below the line as characters; others keep their underscore.
BELOW = {"i": "ᵢ", "n": "ₙ", "t": "ₜ", "p": "ₚ", "0": "₀", "φ": "ᵩ"}
ACCENTS = {"hat": "\u0302", "vec": "\u20d7", "dot": "\u0307", "bar": "\u0304"}
FORMULA_PT, FORMULA_HEIGHT_IN, FORMULA_LINE_IN = 13.0, 0.75, 0.35
# Letters of LaTeX in a line of a formula.
FORMULA_LETTERS = 160
# Letters of a line beside an axis, and the room that one takes (in).
MEANING_LETTERS, LINE_IN = 34, 0.27
# Shown in mm where a quantity is a length.
SHOWN = {"m": (1e3, "mm"), "s": (1e3, "ms")}


def laws_section(page: Page, diagnosis: Diagnosis) -> None:
    """A section where something is left: each law with its evidence, or why there is none."""
    summary = diagnosis.summary
    if not summary["left"]:
        return
    section = page.add_section("The missing law", "law")
    if not diagnosis.laws:
        section.add_missing(
            "a formula for what is left",
            "each run has a place of its own, which no formula tells beforehand."
            if all("runs" in left for left in summary["left"])
            else "no candidate beats chance on runs held out.",
        )
        return
    section.add_text(
        "For what no effect of the library explains, a formula was looked for among functions of the disk's own "
        "quantities, or of what cameras, markers and clocks may do, chosen by how well it predicts runs that its "
        "coefficients have not seen. It is a description that the data support, not a proof of its cause: look at the "
        "other formulas, where there are any."
    )
    for number, (law, entry) in enumerate(zip(diagnosis.laws, summary["laws"], strict=True), 1):
        _one(section, number, law, entry, diagnosis)


def read_by(law: LawFound, file: str) -> str:
    """Which commands take a law."""
    if law.law.stage == "measurement":
        return f"ovines diagnose --law {file} holds it."
    if not acts(law.rig_law):
        return "no command holds it yet, for the model's wall stands still in the Host and its disk is round."
    return f"ovines simulate reads it (laws in a scenario), ovines diagnose --law {file} holds it."


def _one(section: Section, number: int, law: LawFound, entry: dict[str, object], diagnosis: Diagnosis) -> None:
    section.add_heading(f"Law {number}, of the {law.law.stage}")
    section.add_figure(f"law-{number}-formula", partial(formula_figure, law), as_text(law.law), as_text(law.law))
    closes = percent(float(str(entry["shrinkage"])))
    low, high = (percent(float(str(entry[f"shrinkage_{end}"]))) for end in ("low", "high"))
    section.add_text(
        f"It closes {closes} ({low.removesuffix(' %')} to {high}, 90 %) of the squared error above the floor on runs "
        f"held out. By chance a formula of the dictionary does so well {chance(law.p)}. It stands in {entry['file']}: "
        + read_by(law, str(entry["file"]))
    )
    if law.halves is not None:
        section.add_text(by_halves(law.halves))
    _numbers(section, law)
    _on_the_rig(section, number, law, diagnosis)
    _with_and_without(section, number, law, diagnosis)
    if law.others:
        section.add_table(
            ("other formula", "its gain over this one's", "distinguished"),
            [(as_text(one.law), percent(one.share), "yes" if one.told_apart else "no") for one in law.others],
            "The nearest other formulas. Those that the data do not distinguish are as good an answer.",
            text_columns=(0, 2),
        )


def _numbers(section: Section, law: LawFound) -> None:
    """What is in the formula: its numbers, and what its symbols mean."""
    rows = [
        (
            name,
            f"{with_unit(value, '' if unit == '1' else unit, digits=4)}",
            interval(value - NORMAL_90 * sd, value + NORMAL_90 * sd),
        )
        for name, (value, sd, unit) in law.numbers.items()
    ]
    section.add_table(
        ("number", "value", "90 % interval"), rows, "The law's numbers, in the world's frame and SI units."
    )
    if symbols(law.law):
        section.add_table(
            ("symbol", "meaning"),
            [(_plain_symbol(symbol), meaning) for symbol, meaning in symbols(law.law)],
            text_columns=(0, 1),
        )


def _on_the_rig(section: Section, number: int, law: LawFound, diagnosis: Diagnosis) -> None:
    """Figures of what a law of the measurement does: to the boards' places, to a camera's picture, at blows."""
    first, cameras = law.law.terms[0], diagnosis.ladder.measured.cameras
    if first.target in BOARDS:
        frame, radius_m = diagnosis.ladder.measured.frame, diagnosis.ladder.series.contact_radius_m
        section.add_figure(
            f"law-{number}-boards",
            partial(boards_figure, first, frame.origin_m, frame.length * radius_m),
            "How far from their places the boards have put points about the Host, by the law; cameras that are "
            "calibrated on them see everything so. A shift of all points is left out: the world is where they say.",
            "Arrows over the world about the Host: what the boards add to places",
        )
    elif lasts(first) and cameras is not None and cameras[int(first.x)].field is not None:
        section.add_figure(
            f"law-{number}-picture",
            partial(changed_picture_figure, first, cameras[int(first.x)]),
            "Where the camera sees points, less where its calibration puts them: as the recordings have taught it, of "
            "whatever form (grey), and what the law says (blue).",
            "Arrows over the picture of a camera: the learnt field and the law",
        )
    if first.target == MARKER_NEIGHBOUR:
        figure = blow_figure(diagnosis.ladder.measured, law)
        if figure is not None:
            section.add_figure(
                f"law-{number}-blows",
                figure,
                "How far the disk is seen beside the two ways that meet at a blow, along the change of its velocity "
                "and over that, of all blows whose ways tell (sd as bars); black: the formula.",
                "Places at blows over the time from the blow, and the law",
            )


def _with_and_without(section: Section, number: int, law: LawFound, diagnosis: Diagnosis) -> None:
    """Figures of what the model lacks without the law and with it."""
    if law.evidence is not None:
        section.add_figure(
            f"law-{number}-evidence",
            partial(evidence_figure, law.evidence),
            "What the model lacks along the law's direction, fitted freely in bins of the quantity that the law "
            "follows: without the law (red) and with it (blue), sd as bars; black: the formula.",
            "Missing quantity over its covariate before and after the law",
        )
    if law.paths is not None:
        figure = path_figure(diagnosis.ladder.series.runs, law)
        if figure is not None:
            section.add_figure(
                f"law-{number}-path",
                figure,
                "The flight in which the law changes most, predicted from its own start with coefficients of the other "
                "runs: what the model misses without and with the law.",
                "Residual of one flight over time without and with the law",
            )


def by_halves(halves: Halves) -> str:
    """Whether every second run asks for the size that the others ask for."""
    first, second = (
        f"{size:.3g} ({interval(size - NORMAL_90 * sd, size + NORMAL_90 * sd)})"
        for size, sd in zip(halves.sizes, halves.sds, strict=True)
    )
    said = f"Fitted to every second run alone its size is {first} of the one stated, to the other runs {second}"
    return said + (
        ": the halves agree." if halves.agree else ": the halves disagree. Do not use this law; record more runs."
    )


def _plain_symbol(latex: str) -> str:
    for accent, mark in ACCENTS.items():
        latex = re.sub(rf"\\{accent} ?\{{?(\\[a-z]+|[A-Za-z])\}}?", rf"\1{mark}", latex)
    for old, new in PLAIN.items():
        latex = latex.replace(old, new)
    return re.sub("_(.)", lambda one: BELOW.get(one[1], one[0]), latex)


def formula_figure(law: LawFound) -> Figure:
    """The formula, set as one."""
    lines = latex_lines(law.law, FORMULA_LETTERS)
    height_in = FORMULA_HEIGHT_IN + FORMULA_LINE_IN * (len(lines) - 1)
    figure, axes = new_figure(height_in=height_in, margins_in=(0.0, 0.0, 0.0, 0.0))
    axes[0, 0].set_axis_off()
    size = min(FORMULA_PT, FORMULA_PT * 90 / max(map(len, lines)) + 3)
    said = "\n".join(f"${line}$" for line in lines)
    figure.text(0.5, 0.5, said, ha="center", va="center", fontsize=size, color=BLACK, linespacing=1.6)
    return figure


def evidence_figure(found: Evidence) -> Figure:
    """Missing quantity in bins, before and after, and the law."""
    missing = _missing(found)
    left_in = LINE_IN * (2 + missing.count("\n"))
    figure, axes = new_figure(margins_in=(left_in, 0.12, 0.46, 0.36))
    ax = axes[0, 0]
    factor, unit = SHOWN.get(found.unit, (1.0, found.unit))
    shown, _ = SHOWN.get(found.target_unit, (1.0, ""))
    order = np.argsort(found.covariate)
    x = found.covariate[order] * factor
    ax.axhline(0.0, color=GREY, lw=0.8)
    for values, sd, colour, name in (
        (found.before, found.before_sd, RED, "without the law"),
        (found.after, found.after_sd, BLUE, "with it"),
    ):
        ax.errorbar(x, shown * values[order], shown * sd[order], fmt="o", ms=3.5, lw=1, color=colour, label=name)
    ax.plot(x, shown * found.law[order], color=BLACK, lw=1.2, label="the law")
    meaning = QUANTITIES[found.name].in_words
    label(ax, f"{meaning} [{unit}]" if unit != "1" else meaning, missing, math=False)
    legend(ax)
    return figure


def _missing(found: Evidence) -> str:
    target = TARGETS[found.target]
    shown_unit = SHOWN.get(found.target_unit, (1.0, found.target_unit))[1]
    shown_unit = target.unit if shown_unit == "1" else shown_unit  # an angle's is its target's
    unit = "" if shown_unit == "1" else f" [{shown_unit}]"
    what = "missing acceleration" if target.stage == "flight" else "missing"
    if target.unit == "1":
        what = "missing"
    return f"{what}{unit}\n{fill(target.meaning, MEANING_LETTERS)}"


def path_figure(runs: tuple[Run, ...], law: LawFound) -> Figure | None:
    """Residual of the flight that the law changes most, over its time."""
    assert law.paths is not None
    best: tuple[float, int, int] | None = None
    for number, run in enumerate(runs):
        before, after = (paths[number] for paths in law.paths)
        for k, flight in enumerate(run.flights):
            at = slice(flight.first, flight.last + 1)
            moved = np.hypot(*(before[at, :2] - after[at, :2]).T)
            if np.count_nonzero(np.isfinite(moved)) >= FEWEST_FRAMES:
                size = float(np.nanmedian(moved))
                if best is None or size > best[0]:
                    best = (size, number, k)
    if best is None:
        return None
    _, number, k = best
    run = runs[number]
    at = slice(run.flights[k].first, run.flights[k].last + 1)
    time = 1e3 * (run.data.time_s[at] - run.data.time_s[at][0])
    figure, axes = new_figure(1, 2, gap_in=(0.75, 0.36))
    measured = measured_paths(run)[at, :2]
    for column, axis in enumerate("xy"):
        ax = axes[0, column]
        for paths, colour, name in zip(law.paths, (RED, BLUE), ("without the law", "with it"), strict=True):
            ax.plot(
                time, 1e3 * (measured - paths[number][at, :2])[:, column], ".-", ms=3, lw=0.8, color=colour, label=name
            )
        ax.axhline(0.0, color=GREY, lw=0.8)
        label(ax, f"time in the flight [ms], {run.data.name}", f"measured - predicted, {axis} [mm]", math=False)
        if column == 0:
            legend(ax)
    return figure
