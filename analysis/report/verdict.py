"""The first screen: did it work, how good is it, what should I do."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from analysis.checks.recording import verdict
from analysis.figures.markers import distance_scatter
from analysis.figures.trajectory import column
from analysis.report.numbers import MISSING, length, percent, with_unit
from analysis.report.page import Page, Section, Status
from analysis.report.parameters import PRINCIPAL, quantity, state, statement
from analysis.report.results import Results

# Notes of the identification whose check fails and says the same.
SAID_BY_CHECKS = (
    "Something acts on the disk",
    "The frames scatter by",
    "Spins and tangential impulses",
    "The law was fitted with",
    "The disk's angle is not known",
)
# What a segment is called; "flight" and "rest" are used, the others are left out.
LEFT_OUT = {"contact": "sustained wall contact", "unseen": "NES hidden", "unresolved": "unresolved"}


def add_verdict(page: Page, results: Results) -> None:
    """Two cards and the list of actions, from whatever the results hold."""
    worked_status, worked, worked_details, actions = _did_it_work(results)
    good_status, good, good_details, more = _how_good(results)
    page.add_card("Did it work?", worked, worked_status, worked_details)
    page.add_card("How good is it?", good, good_status, good_details)
    page.actions.extend([*more, *actions] or ["Nothing has to be done. Use the parameters below with their intervals."])


def seen_share(results: Results) -> float:
    """Share of the frames from first to last in which the NES was located."""
    motion = results.get("motion")
    if motion is None:
        return float("nan")
    span = motion["frame"].max() - motion["frame"].min() + 1
    return float(np.isfinite(column(motion, "nes_x_m")).sum() / span)


def _did_it_work(results: Results) -> tuple[Status, str, list[str], list[str]]:
    actions: list[str] = [f"Write {name}.parquet again: {why}." for name, why in results.unreadable.items()]
    motion, impacts, identification = (results.get(name) for name in ("motion", "impacts", "identification"))
    if motion is None and impacts is None:
        return (
            "bad",
            "No motion",
            ["There is no table of motion in this folder."],
            [*actions, "Run `ovines run` on the recording; it says what stops it."],
        )
    share = seen_share(results)
    details = [f"NES located in {percent(share)} of the frames."] if motion is not None else []
    status: Status = "good"
    if share < 0.8:
        status = "caution"
        actions.append(
            "The NES is lost in many frames: check lighting, exposure and shadows of the wall on the markers."
        )
    if "impacts" not in results.tables:
        return (
            "caution",
            "Motion only",
            [*details, "Impacts and parameters were not looked for."],
            [*actions, "Run `ovines identify`."],
        )
    if impacts is None:
        details.append("No impact was found.")
        return (
            "caution",
            "Motion, no impacts",
            details,
            [*actions, "Parameters of the wall need impacts: record longer or drive harder."],
        )
    details.append(
        f"{len(impacts)} impact{'s' if len(impacts) != 1 else ''}, median normal speed "
        f"{with_unit(float(impacts['normal_speed_before_m_per_s'].median()), 'm/s', 2)}."
    )
    if identification is None:
        return "caution", "Motion and impacts, no parameters", details, [*actions, "Run `ovines identify`."]
    rows = {row["parameter"]: row for _, row in identification.iterrows()}
    known = [name for name in PRINCIPAL if name in rows and state(rows[name]) == "value"]
    unknown = [name for name in PRINCIPAL if name in rows and state(rows[name]) != "value"]
    spoiled = [] if results.get("checks") is None else verdict(results.tables["checks"])[1]
    details += [
        statement(rows[name]) + (", not to be used" if name in spoiled and name in known else "")
        for name in (*known, *unknown)
    ]
    if unknown or set(known) & set(spoiled):
        status = "caution"
    if {"wall_friction", "tangential_restitution"} & set(unknown):
        actions.append(
            "Wall friction and tangential restitution need impacts on both sides of the critical angle: "
            "launch the NES so that it meets the wall steeply and obliquely, or analyse several recordings as a series."
        )
    actions += actions_of_notes(results.notes)
    usable = [name for name in known if name not in spoiled]
    answer = (
        "Yes"
        if len(usable) == len(PRINCIPAL) and status == "good"
        else "Yes, with gaps"
        if usable
        else "Motion, no usable parameters"
    )
    return status, answer, details, actions


def actions_of_notes(notes: Sequence[str]) -> list[str]:
    """What the identification noted beyond parameters that are not determined, which are said already."""
    actions = []
    for note in notes:
        if note.startswith(SAID_BY_CHECKS):
            continue
        if "[model] effects does not name" in note:
            actions.append(f"{note} Run `ovines diagnose` on the series: is it the cause of a gap?")
        elif "determine" not in note:
            actions.append(f"Before the parameters are used: {note}")
    return actions


def _how_good(results: Results) -> tuple[Status, str, list[str], list[str]]:
    """Status, word, details, actions: what fails first, then what the numbers rest on."""
    details: list[str] = []
    actions: list[str] = []
    points, motion, checks = results.get("points"), results.get("motion"), results.get("checks")
    word = "Not checked"
    if checks is not None:
        word, spoiled, actions = verdict(checks)
        if spoiled:
            details.append(f"Do not use: {', '.join(quantity(name).title.lower() for name in spoiled)}.")
        details += checks.loc[checks["state"] == "fails", "found"].tolist()
    if points is not None:
        details += _markers(results, points)
    if motion is not None and np.isfinite(column(motion, "nes_x_sd_m")).any():
        details.append(
            f"NES centre known to {length(float(np.nanmedian(column(motion, 'nes_x_sd_m'))))} in x (median sd)."
        )
    left_out = {kind: share for kind, share in results.time_shares.items() if kind in LEFT_OUT and share > 0}
    if left_out:
        parts = ", ".join(f"{LEFT_OUT[kind]} {percent(share)}" for kind, share in left_out.items())
        details.append(f"Time left out of the flights: {parts}.")
    if not details and checks is None:
        return "neutral", "Cannot be decided", ["Neither points nor standard deviations are here."], actions
    return STATUS[word], word, details, actions


STATUS: dict[str, Status] = {"Good": "good", "Doubtful": "caution", "Do not use": "bad", "Not checked": "neutral"}


def _markers(results: Results, points: pd.DataFrame) -> list[str]:
    """What two views of a marker, the Host's shape and its markers' circle say."""
    details = []
    if points["reprojection_px"].notna().any():
        details.append(f"Reprojection {with_unit(float(np.nanmedian(points['reprojection_px'])), 'px', 2)} (median).")
    scatter = distance_scatter(points, results.markers("host"))
    if len(scatter):
        details.append(f"Host marker distances constant to {length(float(scatter['sd_m'].max()))} (worst pair, sd).")
    host = results.recording.settings.bodies.host
    circles = results.circles
    if (
        host is not None
        and host.inner_radius_m is not None
        and circles is not None
        and host.layout_m is None
        and circles["mean_radius_m"].notna().any()
    ):
        radius_mm = 1e3 * float(np.nanmedian(circles["mean_radius_m"]))
        details.append(
            f"Circle through the Host markers: radius {with_unit(radius_mm, 'mm', 4)}, wall "
            f"{with_unit(1e3 * host.inner_radius_m, 'mm', 4)}."
        )
    return details


STATES = {"holds": "holds", "fails": "fails", "open": "cannot be decided"}


def add_checks(page: Page, results: Results) -> None:
    """The checks behind the verdict, one by one."""
    section = page.add_section("Checks", "checks")
    checks = results.get("checks")
    if checks is None:
        section.add_missing("checks", "Impacts and parameters were not looked for.")
    else:
        checks_table(section, checks)


def checks_table(section: Section, checks: pd.DataFrame) -> None:
    """Rows of the table ``checks``: what fails first."""
    order = checks.assign(rank=checks["state"].map({"fails": 0, "open": 1, "holds": 2})).sort_values(
        "rank", kind="stable"
    )
    section.add_table(
        ("check", "found", ""),
        [(row["check"], row["found"], STATES[row["state"]]) for _, row in order.iterrows()],
        'Each check can fail, and none believes the laws that the parameters rest on. "Good" is said only where all '
        "that can be decided hold.",
        (0, 1, 2),
    )


def headline(results: Results) -> str:
    """One sentence under the title."""
    motion = results.get("motion")
    if motion is None:
        return "No motion was reconstructed."
    span = float(motion["time_s"].max() - motion["time_s"].min())
    impacts = results.get("impacts")
    count = MISSING if impacts is None else str(len(impacts))
    return (
        f"{with_unit(span, 's', 3)} of motion, {len(motion)} frames, {count} impacts."
        if impacts is not None
        else f"{with_unit(span, 's', 3)} of motion, {len(motion)} frames."
    )
