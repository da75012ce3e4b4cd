"""Sections on impacts and parameters, the thesis' method beside the flight model."""

from __future__ import annotations

from functools import partial

import numpy as np
import pandas as pd

from analysis.figures.impacts import impact_detection, restitution_by_both
from analysis.figures.law_map import error_maps, regimes
from analysis.figures.trajectory import column
from analysis.report.differences import compare_methods, in_words
from analysis.report.numbers import MISSING, value_with_digits, value_with_sd, with_unit
from analysis.report.page import Page, Section
from analysis.report.parameters import PRINCIPAL, paragraph, parameter_rows
from analysis.report.results import Results
from analysis.thesis.impacts import method_of
from analysis.thesis.parameters import SLOWEST_M_PER_S, usable

FEW_IMPACTS = 6  # below, none of them outweighs what a stray one may do
# Columns of the table of impacts with their sd and factor: what is measured of every impact, whatever its regime.
OF_EVERY_IMPACT = (
    ("effective_tangential_restitution", "effective_tangential_restitution_sd", 1.0),
    ("impulse_ratio", "impulse_ratio_sd", 1.0),
    ("spin_imbalance_m_per_s", "spin_imbalance_sd_m_per_s", 1e3),
)


def add_parameters(page: Page, results: Results) -> None:
    """The identified parameters beside those of the thesis' method, and the error maps."""
    section = page.add_section("Parameters", "parameters")
    identification = results.get("identification")
    if identification is None:
        section.add_missing(
            "identified parameters",
            "They take impacts, and none was found."
            if "impacts" in results.tables
            else "There is no identification.parquet among the results.",
        )
        return
    section.add_text(paragraph(identification))
    for note in results.notes:
        section.add_note(note, "caution")
    principal = identification["parameter"].isin(PRINCIPAL)
    thesis = results.thesis_parameters
    section.add_table(
        ("parameter", "symbol", "value ± sd", "90 % interval", "impacts", "thesis' method"),
        parameter_rows(identification[principal], thesis),
        "By maximum likelihood over flights and impacts; the last column is the thesis' recipe on the same "
        "motion (± is its scatter over the impacts, as in its Table 16).",
        (0, 1),
    )
    if not principal.all():
        section.add_table(
            ("also fitted", "symbol", "value ± sd", "90 % interval", "impacts"),
            [row[:5] for row in parameter_rows(identification[~principal], None)],
            "What the fit had to know besides: geometry, drive, scatter.",
            (0, 1),
        )
    impacts = results.get("impacts")
    if impacts is None or not np.isfinite(column(impacts, "tangential_speed_after_m_per_s")).any():
        section.add_missing("error map", "It takes impacts with tangential speeds, and they take an angle of the NES.")
        return
    _add_maps(section, results, impacts)


def _add_maps(section: Section, results: Results, impacts: pd.DataFrame) -> None:
    joint = results.joint_map
    if joint is None:
        section.add_missing("error map", "The restitution was not determined.")
        return
    eps = results.parameter("restitution")[0]
    pair = (results.parameter("wall_friction")[0], results.parameter("tangential_restitution")[0])
    regime = impacts["regime"]
    stick, slide = int((regime == "stick").sum()), int((regime == "slide").sum())
    counts = f"{stick} stick and inform β₀, {slide} slide and inform μ_c"
    open_ends = joint.open_ends()
    closing = (
        f"The 90 % region runs out of the map: these impacts do not bound {_join(open_ends)}."
        if open_ends
        else "The 90 % region is closed: impacts of both kinds together determine both parameters."
    )
    few = joint.n_impacts < FEW_IMPACTS
    flat = " With so few impacts the ground is flat: away from the line, each of them could be a stray." if few else ""
    section.add_figure(
        "error_map",
        partial(error_maps, joint, results.close_map, results.thesis_grid, impacts, pair, results.inertia_factor, eps),
        f"Counterpart of the thesis' Fig. 64. Left: joint likelihood of {joint.n_impacts} impacts ({counts}). One "
        "impact alone fixes only min(β₀, β₁), an L in this plane (thin lines): its legs are lower bounds. "
        f"{closing}{flat} Right: the thesis' mean relative error of "
        f"straight-line velocities{_of_the_picked(results)}.",
        "Maps of the joint likelihood and of the thesis' relative error over wall friction and tangential restitution.",
        "png",
    )
    section.add_figure(
        "regimes",
        partial(regimes, impacts, eps, *pair, results.inertia_factor),
        "Effective tangential restitution of each impact against its incidence. Steep impacts (left) stick "
        "and show β₀; "
        "oblique ones slide along the curve that μ_c sets.",
        "Effective tangential restitution against incidence.",
    )


def _of_the_picked(results: Results) -> str:
    """Which impacts of the thesis' method were picked by hand, in words."""
    picked = [str(number) for number in method_of(results.recording).impacts]
    return f", of impact{'' if len(picked) == 1 else 's'} {', '.join(picked)} alone" if picked else ""


def add_impacts(page: Page, results: Results) -> None:
    """Impacts by both methods, why they differ here, and every impact in a table."""
    section = page.add_section("Impacts", "impacts")
    motion, impacts = results.get("motion"), results.get("impacts")
    if motion is None:
        section.add_missing("impacts", "They take motion.")
        return
    thesis = results.thesis
    if thesis is None:
        section.add_missing("impacts", "There is no thesis_impacts.parquet among the results: run ovines analyse.")
        return
    section.add_figure(
        "impact_detection",
        partial(impact_detection, motion, results.smooth, thesis, impacts, results.spans_s("contact")),
        "Counterpart of the thesis' Fig. 63: maxima of the smoothed acceleration norm (thesis) and the junctions "
        "of two flights (flight model).",
        "Acceleration norm and NES coordinates with detected impacts.",
    )
    if impacts is None and not len(thesis):
        section.add_missing("restitution", "No impact was found by either method.")
        return
    eps, sd = results.parameter("restitution")[:2]
    section.add_figure(
        "restitution",
        partial(restitution_by_both, impacts, thesis, eps, sd),
        "Restitution of each impact by both methods, over time and against the normal speed.",
        "Restitution of each impact by both methods.",
    )
    pairs = None
    if impacts is not None:
        difference = compare_methods(motion, impacts, thesis, method_of(results.recording))
        no_flight = results.spans_s("contact", "unseen", "unresolved")
        pairs = difference.pairs
        section.add_heading("Why the two methods differ here")
        for text in in_words(difference, impacts, thesis, no_flight):
            section.add_text(text)
    picked = method_of(results.recording).impacts
    columns, rows = _table_16(impacts, usable(thesis, picked), thesis, pairs)
    section.add_table(
        columns,
        rows,
        "Counterpart of the thesis' Table 16: every impact by both methods. Mean and sd (n − 1) of the straight lines "
        f"are over impacts {'picked by hand' if picked else f'above {SLOWEST_M_PER_S} m/s'}, "
        "those of the flight model over the same impacts as far as both found them; * marks what is left "
        "out. Effective β is −v_t⁺/v_t⁻, the impulse ratio that of the tangential to the normal impulse, and "
        "spin off what the change of spin tells more than the tangential impulse (per mass): 0 for every "
        "contact law; the sd of the last digits in parentheses.",
        (),
    )


def _table_16(
    impacts: pd.DataFrame | None, chosen: pd.DataFrame, thesis: pd.DataFrame, pairs: pd.DataFrame | None
) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    columns = (
        "time (ms)",
        "normal speed (m/s)",
        "regime",
        "ε, flight model",
        "ε, straight lines",
        "effective β",
        "impulse ratio",
        "spin off (mm/s)",
    )
    rows: list[tuple[str, ...]] = []
    chosen_numbers = set(chosen["impact"].astype(int))
    partner = {} if pairs is None else dict(zip(pairs["thesis"], pairs["flight"], strict=True))
    careful = impacts if impacts is not None else thesis.iloc[:0]
    events = [(row["time_s"], n, None) for n, row in careful.iterrows()] if impacts is not None else []
    reverse = {flight: line for line, flight in partner.items()}
    events = [(time, n, reverse.get(n)) for time, n, _ in events]
    events += [(row["time_s"], None, n) for n, row in thesis.iterrows() if n not in partner]
    for time, ours, line in sorted(events, key=lambda event: event[0]):
        mine = careful.loc[ours] if ours is not None else None
        other = thesis.loc[line] if line is not None else None
        event = mine if mine is not None else other
        speed = MISSING if event is None else with_unit(event["normal_speed_before_m_per_s"], digits=3)
        rows.append(
            (
                f"{1e3 * time:.1f}",
                speed,
                MISSING if mine is None or pd.isna(mine["regime"]) else str(mine["regime"]),
                MISSING if mine is None else value_with_sd(mine["restitution"], mine["restitution_sd"]),
                MISSING
                if other is None
                else with_unit(other["restitution"], digits=2) + ("" if line in chosen_numbers else " *"),
                *(_with_sd(mine, *names) for names in OF_EVERY_IMPACT),
            )
        )
    same = [partner[n] for n in sorted(chosen_numbers) if n in partner]
    ours_eps = careful.loc[same, "restitution"].dropna().to_numpy(float) if same else np.empty(0)
    theirs_eps = chosen["restitution"].to_numpy(float)
    for title, statistic in (("mean", np.mean), ("sd", lambda values: np.std(values, ddof=1))):
        rows.append(
            (
                title,
                "",
                "",
                *(
                    with_unit(float(statistic(v)), digits=3 if title == "mean" else 2) if len(v) > 1 else MISSING
                    for v in (ours_eps, theirs_eps)
                ),
                *("" for _ in OF_EVERY_IMPACT),
            )
        )
    return columns, rows


def _with_sd(impact: pd.Series | None, name: str, sd_name: str, scale: float) -> str:
    """A column of an impact with its sd; missing where the impact or the column is."""
    if impact is None or not np.isfinite(impact.get(name, np.nan)):
        return MISSING
    return value_with_digits(scale * impact[name], scale * impact[sd_name])


def _join(items: list[str]) -> str:
    return items[0] if len(items) == 1 else ", ".join(items[:-1]) + " or " + items[-1]
