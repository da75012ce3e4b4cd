"""Sections on the measurement: calibration, tracks, coordinates, Host geometry."""

from __future__ import annotations

from functools import partial

import numpy as np
import pandas as pd

from analysis.figures.calibration import lens_field, reprojection, view_errors
from analysis.figures.markers import (
    circle_centres,
    coordinates,
    distance_scatter,
    host_distances,
    tracks_over_frame,
)
from analysis.report.geometry import add_wall_sources
from analysis.report.numbers import MISSING, length, percent, value_with_sd, with_unit
from analysis.report.page import Page, Section
from analysis.report.results import Results

# The order in which people read them, and their units; what a calibration adds to these follows by name.
UNITS = {
    "fx": "px", "fy": "px", "cx": "px", "cy": "px", "k1": "", "k2": "", "k3": "", "p1": "", "p2": "",
    "tx_m": "m", "ty_m": "m", "tz_m": "m", "rms_px": "px",
}  # fmt: skip
# Of table lens_terms: name, title, factor, unit shown.
OPEN_TERMS = (
    ("scale", "length scale", 1e3, "1e-3"),
    ("plane_along", "tilt of the plane along the cameras' line", 1e3, "mrad"),
    ("plane_across", "tilt of the plane across it", 1e3, "mrad"),
    ("turn_rad", "turn about z", 1e3, "mrad"),
    ("window_v_px", "window of the second camera, v", 1.0, "px"),
)
CROSS_VALIDATION = ("field_p", "field_px", "halves_p")  # have a section of their own


def _add_parameters(section: Section, parameters: pd.DataFrame) -> None:
    """One row per parameter, one column per camera."""
    found = {(row.camera, row.parameter): (row.value, row.sd) for row in parameters.itertuples()}
    cameras = list(dict.fromkeys(parameters["camera"]))
    names = [name for name in UNITS if name in set(parameters["parameter"])]
    names += sorted(set(parameters["parameter"]) - set(names) - set(CROSS_VALIDATION))
    rows = [
        (
            name.removesuffix("_m").removesuffix("_px") if name in UNITS else name,
            *(value_with_sd(*found.get((camera, name), (None, None)), UNITS.get(name, "")) for camera in cameras),
        )
        for name in names
    ]
    caption = (
        "Parameters ± sd from the full covariance; 0 without sd was held. t is the world's origin seen from the camera."
    )
    section.add_table(("parameter", *map(str, cameras)), rows, caption)


def add_calibration(page: Page, results: Results) -> None:
    """The calibration's views and parameters, and how well two views agree."""
    section = page.add_section("Calibration", "calibration")
    content, points = results.calibration, results.get("points")
    views, parameters = results.get("calibration_views"), results.get("calibration_parameters")
    if content is None and points is None:
        section.add_missing(
            "calibration",
            "This recording came in without cameras, or calibration.json is not where recording.toml says.",
        )
        return
    if content is not None:
        rows = []
        for camera in content["cameras"]:
            matrix, translation = (
                np.asarray(camera["matrix"], float),
                np.asarray(camera["translation_m"], float),
            )
            width, height = camera["sensor_size_px"]
            rows.append(
                (
                    str(camera["name"]),
                    f"{width} × {height}",
                    with_unit(matrix[0, 0], digits=6),
                    with_unit(matrix[1, 1], digits=6),
                    f"{matrix[0, 2]:.1f}, {matrix[1, 2]:.1f}",
                    with_unit(float(np.linalg.norm(translation)), "m", 4),
                    with_unit(camera.get("rms_px"), "px", 2),
                )
            )
        section.add_table(
            ("camera", "sensor (px)", "fx (px)", "fy (px)", "centre (px)", "distance", "RMS"),
            rows,
            "RMS alone hides a weak calibration: look at the standard deviations too.",
        )
    if parameters is not None:
        _add_parameters(section, parameters)
    if views is not None:
        used = int(views["used"].sum())
        section.add_figure(
            "calibration_views",
            partial(view_errors, views),
            f"RMS reprojection error of each view of the board; {used} of {len(views)} views used.",
            "Bar chart of the reprojection error of every calibration view, per camera.",
        )
        dropped = views[~views["used"].astype(bool)]
        if len(dropped):
            section.add_list(
                [f"{row['camera']}, {row['view']}: dropped, {row['reason']}" for _, row in dropped.iterrows()]
            )
    _add_lens_field(section, results)
    if points is not None and points["reprojection_px"].notna().any():
        section.add_figure(
            "reprojection",
            partial(reprojection, points),
            "Reprojection error of the recording's own markers (RMS of four coordinates). It should neither "
            "drift nor grow with speed; "
            "one marker standing out was tracked badly.",
            "Reprojection error over time and by marker.",
        )


def _add_lens_field(section: Section, results: Results) -> None:
    """What the lens models leave over, where recordings have taught it, and what stays open of it."""
    field, table = results.get("lens_field"), results.get("lens_terms")
    if field is None or table is None:
        return
    terms = table.set_index("term")
    section.add_figure(
        "lens_field",
        partial(lens_field, field, results.get("tracks"), results.recording.window_offset_px),
        "What the lens models leave over (arrows: where a point is seen, less where the model puts it; RMS "
        f"{with_unit(float(np.sqrt((field[['du_px', 'dv_px']] ** 2).to_numpy().mean())), 'px', 2)}), learnt from "
        "rigid bodies in both views and taken off every pixel. Colour: its sd (px); dots: markers. It predicts halves "
        f"of the runs that it was not learnt from by {with_unit(float(terms.loc['held_out_sds', 'value']), digits=3)} "
        "sd.",
        "Arrows of the lens field of each camera over its standard deviation.",
    )
    rows = [
        (title, value_with_sd(unit * terms.loc[name, "value"], unit * terms.loc[name, "sd"], shown))
        for name, title, unit, shown in OPEN_TERMS
    ]
    section.add_table(
        ("open term", "in the field"),
        rows,
        "What poses and calibration absorb: bodies cannot tell it, the field's smoothness alone does.",
    )


def add_tracks(page: Page, results: Results) -> None:
    """What was tracked of each marker in each camera."""
    section = page.add_section("Marker tracks", "tracks")
    tracks = results.get("tracks")
    if tracks is None:
        section.add_missing("marker tracks", "The recording enters the pipeline after tracking.")
        return
    bodies = {name: tuple(body.markers or ()) for name, body in results.recording.bodies.items()}
    windows = {camera.name: camera.window_px for camera in results.recording.cameras}
    over = "over its first frame" if results.frames else "in its window (the recording brought no images)"
    section.add_figure(
        "tracks",
        partial(tracks_over_frame, tracks, bodies, windows, results.frames),
        f"Path of every marker in each camera, {over}: NES blue, Host orange, ground green; circles mark the first "
        "frame.",
        "Marker paths in the image of each camera.",
        "png",
    )
    span = tracks.groupby("camera")["frame"].agg(lambda f: f.max() - f.min() + 1)
    counts = tracks.groupby(["marker", "camera"]).size().unstack()
    rows = [
        (
            str(marker),
            *(
                percent(min(counts.loc[marker, camera] / span[camera], 1.0))
                if np.isfinite(counts.loc[marker, camera])
                else MISSING
                for camera in counts.columns
            ),
        )
        for marker in counts.index
    ]
    section.add_table(
        ("marker", *(str(camera) for camera in counts.columns)),
        rows,
        "Share of the frames in which each marker was seen.",
    )


def add_coordinates(page: Page, results: Results) -> None:
    """Triangulated markers: their coordinates, noise and distances."""
    section = page.add_section("Coordinates of the markers", "coordinates")
    points = results.get("points")
    if points is None:
        section.add_missing(
            "marker coordinates", "The recording enters the pipeline as motion, or was not triangulated."
        )
        return
    named = [marker for body in ("ground", "host", "nes") for marker in results.markers(body)]
    present = set(points["marker"].unique())
    shown = [marker for marker in named if marker in present] or sorted(present)
    section.add_figure(
        "coordinates",
        partial(coordinates, points, shown[:15]),
        "Coordinates of each marker, each from its own median (counterpart of the thesis' Figs 54 and 60). "
        "Ground markers show the noise; "
        "Host markers should move along the drive only.",
        "x, y and z of every marker over time.",
    )
    unseen = [marker for marker in named if marker not in present]
    if unseen:
        section.add_missing(", ".join(unseen), "Never seen by both cameras at once.")


def add_host_geometry(page: Page, results: Results) -> None:
    """The Host's wall from its sources, and the circles through its markers."""
    section = page.add_section("Host geometry", "host")
    add_wall_sources(section, results)
    _add_marker_circles(section, results)


def _add_marker_circles(section: Section, results: Results) -> None:
    points, markers = results.get("points"), results.markers("host")
    if points is not None and len(markers) >= 2:
        scatter = distance_scatter(points, markers)
        section.add_figure(
            "host_distances",
            partial(host_distances, points, markers),
            "Distances between the Host markers minus their medians (thesis, Fig. 55); the band is ± one robust sd. "
            "A rigid Host keeps them constant: "
            f"here to {length(float(scatter['sd_m'].max()))} for the worst pair.",
            "Distances between pairs of Host markers over time.",
        )
    else:
        section.add_missing("distances between Host markers", "They take two or more Host markers with coordinates.")
    circles = results.circles
    if circles is None or not np.isfinite(circles["fit_radius_m"]).any():
        section.add_missing(
            "circles through the Host markers", "They take three or more Host markers with coordinates."
        )
        return
    section.add_figure(
        "circle_centres",
        partial(circle_centres, circles),
        "Left: distances between the centres of the four three-marker circles, and of their mean from the "
        "least-squares circle (thesis, Fig. 56). "
        "Right: their radii.",
        "Distances between circle centres over time and circle radii.",
    )
    rows = []
    for name, title in (
        *((f"circle{k}", f"circle {k}") for k in range(1, 5)),
        ("mean", "mean of the four"),
        ("fit", "least squares"),
    ):
        radius = 1e3 * circles[f"{name}_radius_m"].to_numpy(float)
        radius = radius[np.isfinite(radius)]
        if len(radius):
            rows.append(
                (
                    title,
                    value_with_sd(float(np.median(radius)), float(np.std(radius)) if len(radius) > 1 else None, "mm"),
                    str(len(radius)),
                )
            )
    section.add_table(("circle", "radius, median ± sd of one frame", "frames"), rows)
    host = results.recording.settings.bodies.host
    if host is not None and host.layout_m is not None:
        section.add_note(
            "The Host's motion uses the design layout of its markers, not these circles: the markers need "
            "not lie on the wall."
        )
