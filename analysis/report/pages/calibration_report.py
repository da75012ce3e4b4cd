"""``calibration.html``: what the calibration is worth, before any marker is measured with it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from analysis.report.calibration_worth import add_worth
from analysis.report.measurement import add_calibration
from analysis.report.numbers import percent, value_with_sd, with_unit
from analysis.report.page import Page, pages_beside, source_of
from analysis.report.results import Results, read_results
from ovines.recording import Recording

# MEASURED: with too few or one-sided views the RMS stays at 0.2 px while fx is known to 3 % only.
POOR_RMS_PX = 0.5
POOR_FOCAL_SHARE = 0.01
FEWEST_VIEWS = 10


def write_calibration_report(results_folder: Path, recording: Recording, save_figures: bool = False) -> Path:
    """Write ``calibration.html`` into ``results_folder`` from the calibration and its tables there."""
    results = read_results(Path(results_folder), recording)
    page = whole_calibration_page(results, Path(results_folder), pages_beside(Path(results_folder), ("report.html",)))
    if save_figures:
        page.save_figures(Path(results_folder) / "figures")
    return page.write(Path(results_folder) / "calibration.html")


def whole_calibration_page(results: Results, results_folder: Path, links: list[tuple[str, str]]) -> Page:
    """The page with its source and its ``links``, titles and addresses, as it stands in ``results_folder``."""
    page = calibration_page(results)
    page.source, page.links = source_of(results.recording.folder, results_folder), links
    return page


def calibration_page(results: Results) -> Page:
    """The page: RMS, standard deviations, views used and dropped, and whether it is good enough."""
    cameras = [] if results.calibration is None else results.calibration["cameras"]
    page = Page(
        results.recording.name,
        "Calibration report",
        f"{len(cameras)} cameras." if cameras else "No calibration.",
    )
    details, actions, faults = [], [], 0
    for camera in cameras:
        name, rms = str(camera["name"]), camera.get("rms_px")
        details.append(f"{name}: RMS {with_unit(rms, 'px', 2)}{_focal(results.get('calibration_parameters'), name)}")
        if rms is not None and rms > POOR_RMS_PX:
            faults += 1
            actions.append(
                f"{name}: RMS above {POOR_RMS_PX} px. Look for blurred views, a wrong square size or a board "
                "that is not flat."
            )
        share = _focal_share(results.get("calibration_parameters"), name)
        if share > POOR_FOCAL_SHARE:
            faults += 1
            actions.append(
                f"{name}: the focal length is known to {percent(share)} only, whatever the RMS. Add views "
                "that tilt the board by 30 degrees or more "
                "and fill the corners of the image."
            )
    advice = list((results.calibration or {}).get("provenance", {}).get("notes", ()))
    faults += max(_views(results.get("calibration_views"), details, [] if advice else actions), min(len(advice), 1))
    actions.extend(advice)
    page.add_card(
        "Did it work?",
        "Yes" if cameras else "No calibration",
        "good" if cameras else "bad",
        details[: len(cameras)],
    )
    if cameras:
        page.add_card(
            "How good is it?",
            ("Good", "Fair: one thing to look at", "Weak")[min(faults, 2)],
            ("good", "caution", "bad")[min(faults, 2)],
            details[len(cameras) :] or ["No table of views: a calibration solved elsewhere."],
        )
    else:
        actions.append("Run `ovines calibrate`; it says what stops it.")
    page.actions.extend(actions or ["Nothing has to be done."])
    add_worth(page, results)
    add_calibration(page, results)
    return page


def _focal(parameters: pd.DataFrame | None, camera: str) -> str:
    row = _row(parameters, camera, "fx")
    return "." if row is None else f", fx {value_with_sd(row['value'], row['sd'], 'px')}."


def _focal_share(parameters: pd.DataFrame | None, camera: str) -> float:
    """Largest relative sd of fx and fy; 0 where unknown."""
    rows = [
        row for name in ("fx", "fy") if (row := _row(parameters, camera, name)) is not None and np.isfinite(row["sd"])
    ]
    return max((float(row["sd"] / abs(row["value"])) for row in rows), default=0.0)


def _row(parameters: pd.DataFrame | None, camera: str, name: str) -> pd.Series | None:
    if parameters is None:
        return None
    found = parameters[(parameters["camera"] == camera) & (parameters["parameter"] == name)]
    return found.iloc[0] if len(found) else None


def _views(views: pd.DataFrame | None, details: list[str], actions: list[str]) -> int:
    """Number of cameras with too few views; details and actions are added to."""
    few = 0
    for camera, table in views.groupby("camera") if views is not None else []:
        used = int(table["used"].sum())
        details.append(
            f"{camera}: {used} of {len(table)} views used, "
            f"{int(table.loc[table['used'].astype(bool), 'points'].sum())} corners."
        )
        if used < FEWEST_VIEWS:
            few += 1
            actions.append(
                f"{camera}: {used} views; take {FEWEST_VIEWS} or more, tilted and turned, all over the image."
            )
    return few
