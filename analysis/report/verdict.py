"""The first screen: did it work, how good is it, what should I do."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from analysis.figures.markers import distance_scatter
from analysis.figures.trajectory import column
from analysis.report.numbers import MISSING, length, percent, with_unit
from analysis.report.page import Page, Status
from analysis.report.parameters import PRINCIPAL, state, statement
from analysis.report.results import Results

# Half a pixel is five times what a circular marker's centre scatters by on a good image; more points to the
# calibration.
POOR_REPROJECTION_PX = 0.5
# The thesis calls 0.1 mm camera noise (Fig. 55) and 0.35 mm its largest circle error (Fig. 56).
POOR_DISTANCE_SCATTER_M = 1e-4
POOR_RADIUS_M = 3.5e-4
# What a segment is called; "flight" and "rest" are used, the others are left out.
LEFT_OUT = {"contact": "sustained wall contact", "unseen": "NES hidden", "unresolved": "unresolved"}


def add_verdict(page: Page, results: Results) -> None:
    """Two cards and the list of actions, from whatever the results hold."""
    worked_status, worked, worked_details, actions = _did_it_work(results)
    good_status, good, good_details, more = _how_good(results)
    page.add_card("Did it work?", worked, worked_status, worked_details)
    page.add_card("How good is it?", good, good_status, good_details)
    page.actions.extend(
        [*actions, *more] or ["Nothing has to be done. Use the parameters below with their intervals."]
    )


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
    if motion is None:
        return (
            "bad",
            "No motion",
            ["There is no table of motion in this folder."],
            [*actions, "Run `ovines run` on the recording; it says what stops it."],
        )
    share = seen_share(results)
    details = [f"NES located in {percent(share)} of the frames."]
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
        f"{with_unit(float(np.nanmedian(impacts['normal_speed_before_m_per_s'])), 'm/s', 2)}."
    )
    if identification is None:
        return "caution", "Motion and impacts, no parameters", details, [*actions, "Run `ovines identify`."]
    rows = {row["parameter"]: row for _, row in identification.iterrows()}
    known = [name for name in PRINCIPAL if name in rows and state(rows[name]) == "value"]
    unknown = [name for name in PRINCIPAL if name in rows and state(rows[name]) != "value"]
    details += [statement(rows[name]) for name in (*known, *unknown)]
    if unknown:
        status = "caution"
        if {"wall_friction", "tangential_restitution"} & set(unknown):
            actions.append(
                "Wall friction and tangential restitution need impacts on both sides of the critical angle: "
                "launch the NES so that it "
                "meets the wall steeply and obliquely, or analyse several recordings as a series."
            )
    actions += actions_of_notes(results.notes)
    answer = "Yes" if not unknown and status == "good" else "Yes, with gaps" if known else "Motion only"
    return status, answer, details, actions


def actions_of_notes(notes: Sequence[str]) -> list[str]:
    """What the identification noted beyond parameters that are not determined, which are said already."""
    actions = []
    for note in notes:
        if "[model] effects does not name" in note:
            actions.append(f"{note} Run `ovines diagnose` on the series: is it the cause of a gap?")
        elif "determine" not in note:
            actions.append(f"Before the parameters are used: {note}")
    return actions


def _how_good(results: Results) -> tuple[Status, str, list[str], list[str]]:
    details, actions, faults = [], [], 0
    points, motion = results.get("points"), results.get("motion")
    if points is not None:
        reprojection = (
            float(np.nanmedian(points["reprojection_px"]))
            if points["reprojection_px"].notna().any()
            else np.nan
        )
        details.append(f"Reprojection {with_unit(reprojection, 'px', 2)} (median).")
        if reprojection > POOR_REPROJECTION_PX:
            faults += 1
            actions.append(
                "The two cameras disagree: check window_offset_px and the extrinsic view, or calibrate again."
            )
        faults += _host_is_rigid(results, details, actions)
    if motion is not None:
        sd = (
            float(np.nanmedian(column(motion, "nes_x_sd_m")))
            if np.isfinite(column(motion, "nes_x_sd_m")).any()
            else np.nan
        )
        if np.isfinite(sd):
            details.append(f"NES centre known to {length(sd)} in x (median sd).")
    faults += _wall_fits(results, details, actions)
    left_out = {kind: share for kind, share in results.time_shares.items() if kind in LEFT_OUT and share > 0}
    if left_out:
        parts = ", ".join(f"{LEFT_OUT[kind]} {percent(share)}" for kind, share in left_out.items())
        details.append(f"Time left out of the flights: {parts}.")
    if not details:
        return "neutral", "Cannot be told", ["Neither points nor standard deviations are here."], actions
    status: Status = "good" if not faults else "caution" if faults == 1 else "bad"
    return status, ("Good", "Fair: one thing to look at", "Doubtful")[min(faults, 2)], details, actions


def _host_is_rigid(results: Results, details: list[str], actions: list[str]) -> int:
    points = results.get("points")
    if points is None or len(results.markers("host")) < 2:
        return 0
    scatter = distance_scatter(points, results.markers("host"))
    worst = float(scatter["sd_m"].max()) if len(scatter) else np.nan
    details.append(f"Host marker distances constant to {length(worst)} (worst pair, sd).")
    if worst > POOR_DISTANCE_SCATTER_M:
        actions.append(
            "Distances between Host markers vary by more than camera noise: look for a loose marker or a "
            "mistaken name."
        )
        return 1
    return 0


def _wall_fits(results: Results, details: list[str], actions: list[str]) -> int:
    host = results.recording.settings.bodies.host
    if host is None or host.inner_radius_m is None or results.circles is None or host.layout_m is not None:
        return 0  # with a layout the markers need not lie on the wall's circle
    radius = (
        float(np.nanmedian(results.circles["mean_radius_m"]))
        if results.circles["mean_radius_m"].notna().any()
        else np.nan
    )
    if not np.isfinite(radius):
        return 0
    details.append(
        f"Circle through the Host markers: radius {with_unit(1e3 * radius, 'mm', 4)}, wall "
        f"{with_unit(1e3 * host.inner_radius_m, 'mm', 4)}."
    )
    if abs(radius - host.inner_radius_m) > POOR_RADIUS_M:
        actions.append(
            "The Host markers' circle is not the wall's: give layout_m, or check inner_radius_m and the "
            "board's square size."
        )
        return 1
    return 0


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
