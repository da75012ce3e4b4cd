"""gap.html: the diagnosis with all its evidence, so that a person can disagree from the figures alone."""

from __future__ import annotations

from typing import Any

import numpy as np

import ovines
from analysis.gap import figures_paths as paths_figures
from analysis.gap.cause import GAIN, IMPACT_GAIN
from analysis.gap.diagnose import Diagnosis
from analysis.gap.figures import Candidate, ladder_figure, ranking_figure, residual_panels
from analysis.gap.figures_flights import flight_panels
from analysis.gap.figures_impacts import (
    impact_candidates,
    impact_panels,
    law_figure,
    overview_panels,
)
from analysis.gap.figures_measured import ground_figure, layout_figure, measured_figure, own_residual
from analysis.gap.flight_stage import Gain
from analysis.gap.page_tables import (
    detectable_rows,
    gap_rows,
    measurement_rows,
    nominal_rows,
    parameter_rows,
    time_rows,
    where_rows,
)
from analysis.gap.page_words import STAGES, meaning, parameter_words, plain, shown_interval
from analysis.report.numbers import MISSING, percent, with_unit
from analysis.report.page import Page, Section

#: effects that the layout's figure shows
CENTRES = ("centre_marker_offset", "length_scale_error")
#: effects whose size the recalibrated model fits anyway, as placement of the markers
REFITTED = ("wall_centre_offset", "mass_centre_offset", "centre_marker_offset")


def gap_page(diagnosis: Diagnosis, name: str) -> Page:
    """The page of a diagnosis; ``name`` is the series'.  Parts that the data do not allow stand there as named gaps."""
    summary, ladder = diagnosis.summary, diagnosis.ladder
    page = Page(name, "Sim-to-real gap", _lead(summary), _facts(diagnosis),
                footer=f"ovines {ovines.__version__}. diagnosis.json and predictions.parquet beside this page hold its numbers, in SI units.")
    _verdict_card(page, diagnosis)
    _gap_card(page, diagnosis)
    page.actions.append(summary["next_test"])
    if len(ladder.series.runs) == 1:
        page.actions.append("Record more runs: from a single one nothing can be held out, so every gain here is one of the same data.")
    _ladder_section(page, diagnosis)
    _evidence_section(page, diagnosis)
    _ranking_section(page, diagnosis)
    _where_section(page, diagnosis)
    _parameters_section(page, summary)
    _measurement_section(page, diagnosis)
    _rest_section(page, diagnosis)
    _limits_section(page, diagnosis)
    return page


# --- first screen --------------------------------------------------------------------------------------------------------

def _lead(summary: dict[str, Any]) -> str:
    if summary["verdict"] == "effect":
        said = "; ".join(f"{plain(e)}: {meaning(e)}" if meaning(e) else plain(e) for e in summary["effects"])
        return f"{said}."
    if summary["verdict"] == "unknown":
        g = summary["goes_with"][0]
        return f"There is structure {STAGES.get(g['stage'], g['stage'])} that no effect of the library explains: it goes with {_bare(g['goes_with'])}."
    return "The nominal model, with its parameters refitted, explains these data; no effect of the library is needed."


def _bare(text: str) -> str:
    return text[0].lower() + text[1:] if text[:2].istitle() else text


def _facts(diagnosis: Diagnosis) -> list[tuple[str, str]]:
    runs = diagnosis.ladder.series.runs
    time = diagnosis.summary["time"]
    facts = [("Runs", str(len(runs))), ("Flights", str(sum(len(r.flights) for r in runs))), ("Free flight", with_unit(time["free_flight_s"], "s"))]
    if diagnosis.ladder.impacts is not None:
        facts.append(("Impacts used", str(len(diagnosis.ladder.impacts.data))))
    model = diagnosis.ladder.series.recordings[0].model
    if model is not None:
        facts.append(("Nominal model", ", ".join(plain(e).lower() for e in model.effects) or "no effects"))
    return facts


def _verdict_card(page: Page, diagnosis: Diagnosis) -> None:
    summary, ladder = diagnosis.summary, diagnosis.ladder
    verdict = summary["verdict"]
    if verdict == "effect":
        details = [f"It lies {STAGES.get(summary['stage'], summary['stage'])}."]
        for effect, values in summary["parameters"].items():
            details += [f"{_sentence(parameter_words(k))} {shown_interval(k, v['low'], v['high'])} (90 %)." if len(summary["effects"]) == 1 else
                        f"{plain(effect)}, {parameter_words(k)}: {shown_interval(k, v['low'], v['high'])} (90 %)." for k, v in values.items()]
        others = [plain(e) for e in summary["equivalent"] if e not in summary["effects"]]
        details.append(f"These data cannot tell it from: {', '.join(others)}." if others else "No other effect of the library fits these data as well.")
        page.add_card("What causes the gap?", " and ".join(plain(e) for e in summary["effects"]), "caution", details)
    elif verdict == "unknown":
        details = [f"{g['stage'].capitalize()}, {g['coordinate']}: goes with {_bare(g['goes_with'])}; {g['times_negligible']:.1f} times what is negligible."
                   for g in summary["goes_with"][:4]]
        page.add_card("What causes the gap?", "Unknown", "bad", ["Something is there that the library has no name for.", *details])
    else:
        blind = [*ladder.measurement.notes]
        if ladder.impacts is None:
            blind.append("fewer than eight impacts could be used: wall and contact law were not judged")
        if len(ladder.series.runs) == 1:
            blind.append("one run: nothing could be held out")
        page.add_card("What causes the gap?", "No effect found", "caution" if blind else "good",
                      ["Every test and every probe stays below what is negligible or what noise makes.",
                       *(f"{b[0].upper()}{b[1:]}." for b in blind), "The smallest sizes that would have been seen stand at the end."])


def _sentence(words: str) -> str:
    """First letter large, but the name of a coordinate stays as it is."""
    return words if len(words) == 1 else words[0].upper() + words[1:]


def _gap_card(page: Page, diagnosis: Diagnosis) -> None:
    summary = diagnosis.summary
    gap = summary["gap"]
    quantity, scale, unit, words = (("impact_m_per_s", 1e3, "mm/s", "velocity after an impact") if gap.get("shrinkage_of") == "impact_m_per_s"
                                    else ("flight_m", 1e3, "mm", "position along a flight"))
    value = {k: with_unit(scale * gap[k][quantity], unit) if gap.get(k) and gap[k].get(quantity) is not None else MISSING
             for k in ("as_given", "recalibrated", "with_effect", "noise_floor")}
    details = [f"Held-out {words}: {value['recalibrated']} RMS recalibrated, {value['with_effect']} with the effect, noise floor {value['noise_floor']}."]
    if value["as_given"] != MISSING:
        details.append(f"As given it was {value['as_given']}.")
    if summary["verdict"] == "effect":
        shrinkage = gap["shrinkage"]
        if gap["recalibrated"] == gap["with_effect"] and (summary["stage"] == "measurement" or summary["effects"][0] in REFITTED):
            _corrected_card(page, diagnosis, details)
            return
        status = "good" if shrinkage > 0.8 else ("caution" if shrinkage > 0.4 else "bad")
        answer = f"By {percent(shrinkage)} ({percent(gap['shrinkage_low']).removesuffix(' %')} to {percent(gap['shrinkage_high'])})".replace(" %", " %")
        page.add_card("How far does the gap shrink with it?", answer, status, [*details, "Share of the squared gap above the floor; 90 % interval over runs."])
        return
    details[0] = f"Held-out {words}: {value['recalibrated']} RMS recalibrated, noise floor {value['noise_floor']}."
    if summary["verdict"] == "unknown":
        page.add_card("How far does the gap shrink?", "Not yet: nothing with a name closes it", "bad", details)
    elif _above_floor(gap, quantity):
        page.add_card("How far does the gap shrink?", "Above the floor, but nothing accepted", "caution", [
            *details, "What is left has neither a name nor a shape that holds in most runs: look at the figures, and record more."])
    else:
        page.add_card("How far does the gap shrink?", "Nothing left to shrink", "good", details)


def _above_floor(gap: dict[str, Any], quantity: str) -> bool:
    """More than a third above what no model can predict."""
    values = [(gap.get(k) or {}).get(quantity) for k in ("recalibrated", "noise_floor")]
    return None not in values and values[0] > 4 / 3 * values[1]


def _corrected_card(page: Page, diagnosis: Diagnosis, details: list[str]) -> None:
    """An effect that leaves the predictions alone (measurement, a centre that is refitted anyway): what its own residual was and is."""
    own = own_residual(diagnosis.ladder, diagnosis.summary["effects"][0])
    said = []
    if own is not None:
        name, before, after, unit = own
        said.append(f"{name.capitalize()}: {with_unit(before, unit)} RMS as measured, {with_unit(after, unit)} corrected.")
    measured = diagnosis.summary["stage"] == "measurement"
    page.add_card("How far does the gap shrink with it?", "Taken out of the data" if measured else "Already in the refitted model", "good", [
        *said, "The predictions below already stand on the corrected data, so they are the same with and without it." if measured else
        "The recalibrated model fits this centre already, so the predictions are the same with and without it.", *details])


# --- sections ------------------------------------------------------------------------------------------------------------

def _ladder_section(page: Page, diagnosis: Diagnosis) -> None:
    section = page.add_section("How far", "ladder")
    section.add_text("Each rung predicts runs that were held out of its fit: along a flight from its fitted start, and through an impact from the flight before.")
    leave_out = () if diagnosis.summary["verdict"] == "effect" else ("with_effect",)
    section.add_figure("gap-ladder", ladder_figure({k: e for k, e in diagnosis.errors.items() if k not in leave_out}), "RMS error of the held-out predictions over all runs (bars) and for each run (dots). "
                       "As given: parameters of [model]; recalibrated: the same model refitted; noise floor: free cubics through each flight, and the "
                       "noise and scatter that no law can predict at an impact.", "Bars of prediction error at each rung of the ladder")
    section.add_table(("rung", "flight", "impact", "spin"), gap_rows(diagnosis.summary["gap"], leave_out))
    gap = diagnosis.summary["gap"]
    if gap.get("as_given") is None:
        section.add_missing("the rung as given", "[model] in recording.toml gives the nominal model no floor friction, so nothing can be predicted without a fit.")
    elif diagnosis.ladder.impacts is not None and gap["as_given"]["impact_m_per_s"] is None:
        section.add_missing("impacts as given", "[model] gives restitution, wall friction and tangential restitution not all three.")
    if diagnosis.ladder.impacts is None:
        section.add_missing("one impact ahead", "fewer than eight impacts could be used, and a contact law is not fitted to so few.")


def _evidence_section(page: Page, diagnosis: Diagnosis) -> None:
    summary, ladder = diagnosis.summary, diagnosis.ladder
    section = page.add_section("The evidence", "evidence")
    if summary["verdict"] == "unknown":
        section.add_text("Structure that nothing in the library explains, strongest first. The figures show each residual against what it goes with.")
        section.add_table(("stage", "phase", "coordinate", "goes with", "times negligible"),
                          [(g["stage"], g["phase"], g["coordinate"], _bare(g["goes_with"]), f"{g['times_negligible']:.1f}") for g in summary["goes_with"]],
                          text_columns=(0, 1, 2, 3))
        shown: set[tuple[str, str]] = set()
        for g in summary["goes_with"]:
            if (g["stage"], g["coordinate"]) not in shown and len(shown) < 3:
                shown.add((g["stage"], g["coordinate"]))
                _evidence(section, diagnosis, g["goes_with"], g["stage"], g["coordinate"])
        return
    if summary["verdict"] == "none":
        section.add_text("Nothing was found, so here is what was looked at: the flights' and the impacts' residuals of the recalibrated nominal model. "
                         "A curve that leaves zero by more than its bars would contradict the verdict.")
        _flight_evidence(section, diagnosis, "")
        _impact_overview(section, diagnosis)
        return
    for cause in [c for c in ladder.causes if c.effect in summary["effects"]]:
        if len(summary["effects"]) > 1:
            section.add_heading(plain(cause.effect))
        _evidence(section, diagnosis, cause.effect, cause.stage, cause.coordinate)


def _evidence(section: Section, diagnosis: Diagnosis, finding: str, stage: str, coordinate: str) -> None:
    """The residual that a finding is about, before and after."""
    if finding in CENTRES:
        _layout(section, diagnosis)
    elif stage == "measurement":
        if "ground" in finding:
            _ground(section, diagnosis)
        _measured(section, diagnosis)
    elif stage == "flight":
        _flight_evidence(section, diagnosis, finding)
    else:
        panels = impact_panels(diagnosis.ladder, finding, coordinate)
        if not panels:
            section.add_missing("the impacts' residuals", "there are too few impacts.")
            return
        section.add_figure(f"gap-impacts-{_slug(finding)}", residual_panels(panels, one_model=_nothing_added(diagnosis),
                                                                                    before="as the layout says" if finding in REFITTED else "recalibrated"),
                           "Residual of each impact (dots) and medians over bins with their standard errors. The first panel is the one the finding rests on.",
                           f"Residuals of the impacts for {finding}")


def _flight_evidence(section: Section, diagnosis: Diagnosis, finding: str) -> None:
    panels = flight_panels(diagnosis.ladder, finding)
    if not panels:
        section.add_missing("the flights' residuals", "no flight is long enough to measure an acceleration from.")
        return
    section.add_figure(f"gap-flights-{_slug(finding)}", residual_panels(panels, one_model=diagnosis.ladder.flight is diagnosis.ladder.nominal),
                       "Acceleration that the measured positions ask for beyond the model, in pieces of flights (dots) and as medians over bins with their "
                       "standard errors. Zero everywhere means that the model holds.", "Missing acceleration of the flights against their covariates")


def _impact_overview(section: Section, diagnosis: Diagnosis) -> None:
    panels = overview_panels(diagnosis.ladder)
    if not panels:
        section.add_missing("the impacts' residuals", "fewer than eight impacts could be used.")
        return
    section.add_figure("gap-impacts", residual_panels(panels, one_model=_nothing_added(diagnosis)),
                       "Residuals of the impacts: restitution, contact distance, tangential law (relative to its impulse), angular law.", "Residuals of the impacts")
    section.add_figure("gap-law", law_figure(diagnosis.ladder), "The contact law itself: restitution against approach speed; tangential impulse, which first sticks and "
                       "then slides; and the angular law, which holds for any friction. Grey: measured; red: recalibrated; blue: with the effect.",
                       "Measured impacts and the contact law")


def _nothing_added(diagnosis: Diagnosis) -> bool:
    ladder = diagnosis.ladder
    centres = any(c.effect in ("wall_centre_offset", "mass_centre_offset") for c in ladder.causes)
    return ladder.impacts is ladder.impacts_nominal and not ladder.restitution_terms and not centres


def _slug(text: str) -> str:
    return "".join(c if c.isalnum() else "-" for c in text.lower()).strip("-") or "all"


def _ranking_section(page: Page, diagnosis: Diagnosis) -> None:
    ladder = diagnosis.ladder
    section = page.add_section("Candidates", "candidates")
    single = len(ladder.series.runs) == 1
    section.add_text("What each candidate gains on runs that its estimate never saw. A real effect gains on most runs; a chance one on few. "
                     "Named effects are judged on the recalibrated model, probes (structure without a name) on what is left after the accepted effects."
                     + (" With a single run nothing is held out: these gains are of the same data." if single else ""))
    found = {c.effect for c in ladder.causes}
    structure = {s.goes_with for s in ladder.structure}
    flights = [Candidate(plain(g.term.name), True, g.per_run, g.term.name in found) for g in ladder.flight_gains if _tried(g)]
    probes = [Candidate(g.term.name, False, g.per_run, g.term.name in structure) for g in ladder.flight_probes if _tried(g)]
    runs = max(len(ladder.series.runs), 1)
    if flights or probes:
        section.add_figure("gap-ranking-flights", ranking_figure([*flights, *probes], GAIN / 2 / runs, "flights"),
                           "Flights: gain per held-out run, mean (bar) and each run (dots). The dashed line is the least mean gain that is accepted; "
                           "significance and size must also be enough.", "Ranking of flight candidates")
    else:
        section.add_missing("candidates in the flights", "no candidate could be tried on these flights.")
    impacts = [Candidate(plain(c.name), True, c.per_run, c.accepted) for c in impact_candidates(ladder, probes=False)]
    leftover = sorted(impact_candidates(ladder, probes=True), key=lambda c: -c.per_run.sum())
    if impacts:
        keep = [c for c in leftover if c.accepted] + [c for c in leftover if not c.accepted][:14]
        section.add_figure("gap-ranking-impacts", ranking_figure([*impacts, *keep], IMPACT_GAIN / runs, "impacts"),
                           f"Impacts, as above; of {len(leftover)} probes the accepted ones and the best fourteen others are shown.", "Ranking of impact candidates")
    else:
        section.add_missing("candidates at the impacts", "fewer than eight impacts could be used.")


def _tried(gain: Gain) -> bool:
    return len(gain.per_run) > 0 and bool(np.isfinite(gain.per_run).all())


def _where_section(page: Page, diagnosis: Diagnosis) -> None:
    section = page.add_section("Where, and the motion", "where")
    if diagnosis.summary["where"]:
        section.add_table(("stage", "phase", "coordinate", "share of the excess"), where_rows(diagnosis.summary["where"]), text_columns=(0, 1, 2))
    paths = paths_figures.paths_of(diagnosis.ladder, diagnosis.predictions)
    errors = paths_figures.flight_errors(paths)
    chosen = paths_figures.chosen_flight(errors)
    if chosen is None:
        section.add_missing("map and trajectory", "no flight could be predicted from runs held out.")
        return
    ahead = diagnosis.summary["stage"] in ("impact", "geometry") and "centre_marker_offset" not in diagnosis.summary["effects"][:1]
    how = ("Each flight is predicted from the flight before it, through the impact, with wall and law of the other runs." if ahead and diagnosis.summary["verdict"] == "effect"
           else "Each flight is predicted from its own start values, with everything shared taken from the other runs.")
    section.add_figure("gap-where", paths_figures.where_map(paths), f"Where on the Host's plane the held-out residual lies. {how}", "Map of the residual", image="png")
    same = paths_figures.same_models(paths)
    if same:
        section.add_text("No effect changes the predicted paths, so one model is shown: the recalibrated one.")
    else:
        section.add_figure("gap-flights", paths_figures.flights_figure(errors, chosen), "Error of every predicted flight: the one shown below was chosen, this figure was not.",
                           "Error of every flight with and without the effect")
    path = paths[chosen.path]
    choice = "the flight that the model predicts worst" if same else "the flight in which the two models are furthest apart"
    section.add_figure("gap-trajectory", paths_figures.trajectory(path, chosen),
                       f"Run {path.run.data.name}, {choice} (grey band), with its neighbours; held out of every fit. Below: model minus measured.",
                       "Measured and re-simulated trajectory")


def _parameters_section(page: Page, summary: dict[str, Any]) -> None:
    section = page.add_section("Parameters", "parameters")
    if summary["parameters"]:
        section.add_table(("effect", "parameter", "value", "90 % interval"), parameter_rows(summary["parameters"]), "Parameters of the effect.", text_columns=(0, 1))
    effect = summary["verdict"] == "effect"
    section.add_table(("parameter", "as given", "recalibrated", *(("with effect", "change by the effect") if effect else ())),
                      nominal_rows(summary["nominal"], effect),
                      "Nominal parameters: a refit can hide a gap by bending them, so their movement is evidence too.")


def _measurement_section(page: Page, diagnosis: Diagnosis) -> None:
    ladder = diagnosis.ladder
    section = page.add_section("Measurement tests", "measurement")
    section.add_text("Done before any physics; what is found is taken out of the data, and everything else on this page stands on the corrected data.")
    rows = measurement_rows(ladder)
    if rows:
        section.add_table(("test", "measured ± sd", "sd from nothing", "negligible below", "verdict"), rows, text_columns=(0, 1, 4))
    for note in ladder.measurement.notes:
        section.add_missing("a measurement test", note[0].upper() + note[1:] + ".")
    drawn = {name for s in page.sections for name in s.figures}
    for figure, draw in (("gap-measured", _measured), ("gap-layout", _layout)):
        if figure in drawn:
            section.add_text("Its figure stands under The evidence.")
        else:
            draw(section, diagnosis)


def _ground(section: Section, diagnosis: Diagnosis) -> None:
    figure = ground_figure(diagnosis.ladder)
    if figure is None:
        section.add_missing("ground markers", "the recording has none, or this entry has no points.")
        return
    section.add_figure("gap-ground", figure, "What the ground markers do together; they stand still in the room, so a camera (or its mount) does this.",
                       "Common motion of the ground markers over time")


def _measured(section: Section, diagnosis: Diagnosis) -> None:
    if "gap-measured" in section.figures:
        return
    figure = measured_figure(diagnosis.ladder)
    if figure is None:
        section.add_missing("residuals of the measurement", "they need two views, or a driven Host.")
        return
    section.add_figure("gap-measured", figure, "Residual between the two views against the speed across the epipolar line (a slope is a late clock), heights (a slope is a tilted "
                       "plane), variance of the Host's residual against its speed squared (a slope is jitter), drive frequency asked over seen by run.",
                       "Residuals of the measurement")


def _layout(section: Section, diagnosis: Diagnosis) -> None:
    figure = layout_figure(diagnosis.ladder)
    if figure is None:
        section.add_missing("markers against their layout", "this entry has no points, or recording.toml gives no layout_m.")
        return
    section.add_figure("gap-layout", figure, "Markers against their layout, errors magnified; markers glued within the grey circles are placement, not an effect. "
                       "The NES is seen from the centre of mass that its flights show.", "Markers against their layout")


def _rest_section(page: Page, diagnosis: Diagnosis) -> None:
    if diagnosis.summary["verdict"] == "none":
        return
    section = page.add_section("Everything else", "rest")
    section.add_text("Residuals that the verdict does not rest on, for whoever doubts it.")
    if diagnosis.summary["stage"] != "flight":
        _flight_evidence(section, diagnosis, "")
    _impact_overview(section, diagnosis)


def _limits_section(page: Page, diagnosis: Diagnosis) -> None:
    summary = diagnosis.summary
    section = page.add_section("What would have been seen", "limits")
    section.add_table(("effect", "parameter", "smallest size named", "limit of the noise", "found"), detectable_rows(summary["detectable"], summary["parameters"]), text_columns=(0, 1))
    section.add_table(("phase", "time", "share", "use"), time_rows(summary["time"]), "Time of the series.", text_columns=(0, 3))
    ladder = diagnosis.ladder
    if ladder.impacts is not None:
        met, used = len(ladder.impacts.meetings), len(ladder.impacts.data)
        section.add_text(f"{met} impacts between two flights were found, {used} of them fast and clear enough for wall and law.")
    names = {k: v for k, v in summary["probabilities"].items() if v >= 0.005}
    section.add_text("Probabilities, a ranking calibrated only as far as the blind trial says: "
                     + ", ".join(f"{plain(k) if k not in ('none', 'unknown') else k} {v:.2f}" for k, v in sorted(names.items(), key=lambda i: -i[1])) + ".")
    bad = [r.data.name for r in ladder.series.runs if not r.flights]
    if bad:
        section.add_note(f"Runs without a usable flight: {', '.join(bad)}.", "caution")
    if np.isnan(ladder.flight.misfit):
        section.add_note("The flights' fit did not converge.", "bad")
