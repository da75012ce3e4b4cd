"""gap.html: the diagnosis with all its evidence, so that a person can disagree from the figures alone."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

import ovines
from analysis.gap.diagnose import Diagnosis
from analysis.gap.page.candidates import ranking_section
from analysis.gap.page.evidence import drive, evidence_section, flight_evidence, impact_overview, layout, measured
from analysis.gap.page.figures import paths as path_figures
from analysis.gap.page.figures.panels import ladder_figure
from analysis.gap.page.first_screen import facts, gap_card, lead, verdict_card
from analysis.gap.page.laws import laws_section
from analysis.gap.page.next_test import next_section
from analysis.gap.page.tables import (
    detectable_rows,
    drive_rows,
    gap_rows,
    measurement_rows,
    nominal_rows,
    parameter_rows,
    stage_rows,
    time_rows,
    where_rows,
)
from analysis.gap.page.words import plain
from analysis.report.page import Page


def gap_page(diagnosis: Diagnosis, name: str) -> Page:
    """The page of a diagnosis; ``name`` is the series'.  Parts that the data do not allow stand there as named gaps."""
    summary, ladder = diagnosis.summary, diagnosis.ladder
    page = Page(
        name,
        "Sim-to-real gap",
        lead(summary),
        facts(diagnosis),
        footer=f"ovines {ovines.__version__}. diagnosis.json and predictions.parquet beside this page hold its "
        f"numbers, in SI units.",
    )
    verdict_card(page, diagnosis)
    gap_card(page, diagnosis)
    if any(cause.stage != "measurement" for cause in ladder.causes):
        page.actions.append(
            "Take it into the nominal model: ovines diagnose … --write-model model.toml, and diagnose again with it."
        )
    page.actions += diagnosis.actions
    if len(ladder.series.runs) == 1:
        page.actions.append(
            "Record more runs: from a single one nothing can be held out, so every gain here is one of the same data."
        )
    laws_section(page, diagnosis)
    _ladder_section(page, diagnosis)
    evidence_section(page, diagnosis)
    ranking_section(page, diagnosis)
    _where_section(page, diagnosis)
    _parameters_section(page, summary)
    _measurement_section(page, diagnosis)
    _drive_section(page, diagnosis)
    _rest_section(page, diagnosis)
    next_section(page, diagnosis)
    _limits_section(page, diagnosis)
    return page


def _ladder_section(page: Page, diagnosis: Diagnosis) -> None:
    section = page.add_section("How far", "ladder")
    section.add_text(
        "Each step predicts runs that were held out of its fit: along a flight from its fitted start, and through an "
        "impact from the flight before."
    )
    leave_out = () if diagnosis.summary["effects"] else ("with_effect",)
    section.add_figure(
        "gap-ladder",
        partial(ladder_figure, {k: e for k, e in diagnosis.errors.items() if k not in leave_out}),
        "RMS error of the held-out predictions over all runs (bars) and for each run (dots). "
        "As given: parameters of [model]; recalibrated: the same model refitted; noise floor: free cubics through "
        "each flight, and the "
        "noise and scatter that no law can predict at an impact.",
        "Bars of prediction error at each step of the ladder",
    )
    section.add_table(("step", "flight", "impact", "spin"), gap_rows(diagnosis.summary["gap"], leave_out))
    if diagnosis.summary["effects"]:
        section.add_text(
            "What the share on the first screen is made of: squared errors in units of the noise, added up over all "
            "runs, and the part of all that lies above the floor which each stage closes. Beside flights and impacts "
            "it counts where the disk met the wall, the Host's path, and what tells a fault of the measurement."
        )
        section.add_table(
            ("where", "recalibrated", "with all named", "floor", "closed"),
            stage_rows(diagnosis.far, diagnosis.summary["gap"]["shrinkage"]),
        )
    gap = diagnosis.summary["gap"]
    if gap.get("as_given") is None:
        section.add_missing(
            "the step as given",
            "[model] in recording.toml gives the nominal model no floor friction, so nothing can be predicted without "
            "a fit.",
        )
    elif diagnosis.ladder.impacts.fitted is not None and gap["as_given"]["impact_m_per_s"] is None:
        section.add_missing(
            "impacts as given", "[model] gives restitution, wall friction and tangential restitution not all three."
        )
    if diagnosis.ladder.impacts.fitted is None:
        section.add_missing(
            "one impact ahead", "fewer than eight impacts could be used, and a contact law is not fitted to so few."
        )


def _where_section(page: Page, diagnosis: Diagnosis) -> None:
    section = page.add_section("Where, and the motion", "where")
    if diagnosis.summary["where"]:
        section.add_table(
            ("stage", "phase", "coordinate", "share of the excess"),
            where_rows(diagnosis.summary["where"]),
            text_columns=(0, 1, 2),
        )
    paths = path_figures.paths_of(diagnosis.ladder, diagnosis.predictions)
    errors = path_figures.flight_errors(paths)
    chosen = path_figures.chosen_flight(errors)
    if chosen is None:
        section.add_missing("map and trajectory", "no flight could be predicted from runs held out.")
        return
    ahead = (
        diagnosis.summary["stage"] in ("impact", "geometry")
        and "centre_marker_offset" not in diagnosis.summary["effects"][:1]
    )
    how = (
        "Each flight is predicted from the flight before it, through the impact, with wall and law of the other runs."
        if ahead and diagnosis.summary["effects"]
        else "Each flight is predicted from its own start values, with everything shared taken from the other runs."
    )
    section.add_figure(
        "gap-where",
        partial(path_figures.where_map, paths),
        f"Where on the Host's plane the held-out residual lies. {how}",
        "Map of the residual",
        image="png",
    )
    same = path_figures.same_models(paths)
    if same:
        section.add_text("No effect changes the predicted paths, so one model is shown: the recalibrated one.")
    else:
        section.add_figure(
            "gap-flights",
            partial(path_figures.flights_figure, errors, chosen),
            "Error of every predicted flight: the one shown below was chosen, this figure was not.",
            "Error of every flight with and without the effect",
        )
    path = paths[chosen.path]
    choice = (
        "the flight that the model predicts worst" if same else "the flight in which the two models are furthest apart"
    )
    section.add_figure(
        "gap-trajectory",
        partial(path_figures.trajectory, path, chosen),
        f"Run {path.run.data.name}, {choice} (grey band), with its neighbours; held out of every fit. Below: model "
        f"minus measured.",
        "Measured and re-simulated trajectory",
    )


def _parameters_section(page: Page, summary: dict[str, Any]) -> None:
    section = page.add_section("Parameters", "parameters")
    if summary["parameters"]:
        section.add_table(
            ("effect", "parameter", "value", "90 % interval"),
            parameter_rows(summary["parameters"]),
            "Parameters of the effect.",
            text_columns=(0, 1),
        )
    effect = bool(summary["effects"])
    section.add_table(
        ("parameter", "as given", "recalibrated", *(("with effect", "change by the effect") if effect else ())),
        nominal_rows(summary["nominal"], effect),
        "Nominal parameters: a refit can hide a gap by bending them, so their movement is evidence too.",
    )


def _measurement_section(page: Page, diagnosis: Diagnosis) -> None:
    ladder = diagnosis.ladder
    section = page.add_section("Measurement tests", "measurement")
    section.add_text(
        "Done before any physics; what is found is taken out of the data, and everything else on this page stands on "
        "the corrected data."
    )
    rows = measurement_rows(ladder)
    if rows:
        section.add_table(
            ("test", "measured ± sd", "sd from nothing", "negligible below", "verdict"), rows, text_columns=(0, 1, 4)
        )
    for note in ladder.measurement.notes:
        section.add_missing("a measurement test", note[0].upper() + note[1:] + ".")
    drawn = {name for s in page.sections for name in s.figures}
    for figure, draw in (("gap-measured", measured), ("gap-layout", layout)):
        if figure in drawn:
            section.add_text("Its figure stands under The evidence.")
        else:
            draw(section, diagnosis)


def _drive_section(page: Page, diagnosis: Diagnosis) -> None:
    """The drive asked and measured."""
    section = page.add_section("The drive", "drive")
    section.add_text(
        "What the shaker was asked for against the Host's measured path, run by run. A drive that was not the one "
        "asked for is no fault of the model, which follows the measured path; it is reported for whoever set it."
    )
    rows = drive_rows(diagnosis.ladder)
    if rows:
        section.add_table(("run", "what differs", "by chance"), rows, text_columns=(0, 1, 2))
    else:
        section.add_text("Nothing differs from what was asked for by more than a shaker's tolerance.")
    if any("gap-drive" in s.figures for s in page.sections):
        section.add_text("Its figure stands under The evidence.")
    else:
        drive(section, diagnosis)


def _rest_section(page: Page, diagnosis: Diagnosis) -> None:
    if diagnosis.summary["verdict"] == "none":
        return
    section = page.add_section("Everything else", "rest")
    section.add_text("Residuals that the verdict does not rest on, for whoever doubts it.")
    if diagnosis.summary["stage"] != "flight":
        flight_evidence(section, diagnosis, "")
    impact_overview(section, diagnosis)


def _limits_section(page: Page, diagnosis: Diagnosis) -> None:
    summary = diagnosis.summary
    section = page.add_section("What would have been seen", "limits")
    section.add_table(
        ("effect", "parameter", "smallest size named", "limit of the noise", "measured ± sd of the noise"),
        detectable_rows(summary["detectable"], summary["parameters"]),
        "What is smaller than the size named may surely be there (measured beside its sd) and still not be worth a "
        "name: placement of markers, "
        "calibration and lens leave as much on a good rig.",
        text_columns=(0, 1),
    )
    section.add_table(
        ("phase", "time", "share", "use"), time_rows(summary["time"]), "Time of the series.", text_columns=(0, 3)
    )
    ladder = diagnosis.ladder
    if ladder.impacts.fitted is not None:
        met, used = len(ladder.impacts.fitted.junctions), len(ladder.impacts.fitted.data)
        section.add_text(
            f"{met} impacts between two flights were found, {used} of them fast and clear enough for wall and law."
        )
    names = {k: v for k, v in summary["probabilities"].items() if v >= 0.005}
    section.add_text(
        "Probabilities, each by itself, that an effect is there at more than its negligible size, and that something "
        "is left (unknown): "
        + ", ".join(
            f"{plain(k) if k not in ('none', 'unknown') else k} {v:.2f}"
            for k, v in sorted(names.items(), key=lambda i: -i[1])
        )
        + "."
    )
    bad = [r.data.name for r in ladder.series.runs if not r.flights]
    if bad:
        section.add_note(f"Runs without a usable flight: {', '.join(bad)}.", "caution")
    if np.isnan(ladder.flights.fitted.misfit):
        section.add_note("The flights' fit did not converge.", "bad")
