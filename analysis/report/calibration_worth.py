"""Sections of ``calibration.html`` on what the calibration knows and does not know."""

from __future__ import annotations

from functools import partial
from itertools import combinations
from pathlib import Path

import numpy as np
import pandas as pd

from analysis.figures.calibration import lens_field
from analysis.figures.calibration_maps import (
    Window,
    coverage_and_residuals,
    image_uncertainty,
    pictures,
    plane_uncertainty,
    scene,
)
from analysis.motion.sliding_plane import sliding_plane
from analysis.report.measurement import CROSS_VALIDATION
from analysis.report.numbers import MISSING, length, value_with_sd, with_unit
from analysis.report.page import Page
from analysis.report.results import Results
from ovines.camera import Camera, read_calibration

SURE = 3.0  # standard deviations beyond which two planes disagree
CHANCE, TRIFLE_PX = 0.01, 0.005  # as vision.validation.halves has them: what noise may show, and what matters
PICTURES, PICTURE_PX = 12, 360  # of each camera at most; width
LAST_FRAME = 3000  # of a film that is read for them: a few seconds


def add_worth(page: Page, results: Results) -> None:
    """Lens, cross-validation, uncertainty, what to photograph next; nothing where no calibration was solved here."""
    lens, image = results.get("calibration_lens"), results.get("calibration_image")
    if results.calibration is None or lens is None or image is None:
        return
    cameras = read_calibration(results.folder / "calibration.json")
    sizes = {camera.name: camera.sensor_size_px for camera in cameras}
    windows: dict[str, Window] = {
        camera.name: (*camera.window_offset_px, *camera.window_px) for camera in results.recording.cameras
    }
    _add_next(page, results.get("calibration_next"))
    _add_uncertainty(page, results, cameras, sizes, windows)
    _add_plane(page, results)
    _add_cross_validation(page, results.get("calibration_parameters"))
    _add_lens(page, lens, results.get("calibration_spline"))
    _add_views(page, results, cameras, sizes, windows)


def _add_next(page: Page, following: pd.DataFrame | None) -> None:
    if following is None:
        return
    section = page.add_section("What to photograph next", "next")
    rows = [
        (f"{row.camera}: {row.pose}", with_unit(row.now_px, "px", 2), with_unit(row.then_px, "px", 2))
        for row in following.itertuples()
    ]
    section.add_table(
        ("one more view", "sd of the lens now", "with it"),
        rows,
        "RMS over the whole image, foreseen by the covariance; each row counts on those above it.",
    )


def _add_uncertainty(
    page: Page,
    results: Results,
    cameras: list[Camera],
    sizes: dict[str, tuple[int, int]],
    windows: dict[str, Window],
) -> None:
    section = page.add_section("What is known, and where", "uncertainty")
    plane = results.get("calibration_plane")
    if plane is not None:
        ring = _ring(results)
        inside = _in_windows(plane, cameras, windows)
        here = plane[inside] if inside.any() else plane
        section.add_text(
            "A point of the sliding plane "
            + ("inside both windows " if inside.any() else "")
            + "is known, by the calibration alone, to "
            + ", ".join(f"{length(float(here[f'{axis}_sd_m'].median()))} in {axis}" for axis in "xyz")
            + " (sd, median). All frames share this error: it moves and stretches the world, and does not average out."
        )
        section.add_figure(
            "calibration_plane",
            partial(plane_uncertainty, plane, cameras, windows, ring),
            "Standard deviation of a point of the plane z = 0 by the calibration alone. Red: the cameras' windows"
            + (", black: the ring." if ring else "."),
            "Three maps of the sliding plane: standard deviation of x, y and z.",
        )
    world = results.get("calibration_world")
    for text in [] if world is None else _distances(world, cameras):
        section.add_text(text)
    image = results.tables["calibration_image"]
    section.add_figure(
        "calibration_image",
        partial(image_uncertainty, image, sizes, windows),
        "Left: how far the lens' uncertainty moves what is seen at each place (a turn of the camera left out). Middle: "
        "the lens from one half of the views against that from the other; right: what noise lets them differ by. "
        "Middle far above right: the standard deviations are too small. Red: the window.",
        "Maps of each image: uncertainty of the lens, difference of two halves, expected difference.",
    )


def _distances(world: pd.DataFrame, cameras: list[Camera]) -> list[str]:
    """How far the cameras' centres are apart, one sentence for each two: a length that a ruler can check."""
    sd = dict(zip(world["quantity"], world["sd"].astype(float), strict=True))
    sentences = []
    for a, b in combinations(cameras, 2):
        name = f"distance_m of {a.name} and {b.name}"
        if name in sd:
            apart_m = float(np.linalg.norm(a.centre_m - b.centre_m))
            sentences.append(f"{a.name} and {b.name} stand {value_with_sd(1e3 * apart_m, 1e3 * sd[name], 'mm')} apart.")
    return sentences


def _ring(results: Results) -> tuple[float, float, float] | None:
    """The Host's mean place and inner radius, where the motion is there already."""
    motion, host = results.get("motion"), results.recording.bodies.get("host")
    radius = getattr(host, "inner_radius_m", None)
    if motion is None or radius is None or not motion["host_x_m"].notna().any():
        return None
    return float(motion["host_x_m"].mean()), float(motion["host_y_m"].mean()), float(radius)


def _in_windows(plane: pd.DataFrame, cameras: list[Camera], windows: dict[str, Window]) -> np.ndarray:
    places = np.column_stack([plane["x_m"], plane["y_m"], np.zeros(len(plane))])
    inside = np.ones(len(plane), bool)
    for camera in cameras:
        left, top, width, height = windows[camera.name]
        uv = camera.project(places) - [left, top]
        inside &= ((uv >= 0) & (uv < [width, height])).all(1)
    return inside


def _add_plane(page: Page, results: Results) -> None:
    """The plane z = 0 as the board defined it, and the plane in which the bodies move."""
    world, points = results.get("calibration_world"), results.get("points")
    if world is None:
        return
    section = page.add_section("Where the sliding plane is", "plane")
    sd = dict(zip(world["quantity"], world["sd"].astype(float), strict=True))
    if "height_m" not in sd:  # no place of the plane that all cameras see
        return
    settings = results.recording.settings.calibration
    height = None if settings is None else settings.board_height_m
    source = "the board" if height is None else f"the board, {length(height)} under its print"
    names = ("height_m", "slope_x", "slope_y")
    rows = [(source, *(_of_plane(name, 0.0, sd[name]) for name in names))]
    found = None if points is None else sliding_plane(points, results.recording)
    if found is not None:
        values = dict(zip(names, (found.height_m, found.slope_x, found.slope_y), strict=True))
        bodies = " and ".join({"host": "Host", "nes": "NES"}[body] for body in found.bodies)
        rows.append((bodies, *(_of_plane(n, values[n], s) for n, s in zip(names, found.sd, strict=True))))
        worst = max(abs(values[n]) / np.hypot(s, sd[n]) for n, s in zip(names, found.sd, strict=True))
        off = abs(found.height_m) / np.hypot(found.sd[0], sd["height_m"])
        if worst > SURE:
            text = f"Board and bodies disagree by {worst:.0f} standard deviations. "
            text += (
                f"If the board's print lay above the plane, board_height_m = {(height or 0.0) - found.height_m:.4f} "
                "would mend the height."
                if off > SURE
                else "The height agrees: one of the two planes is tilted."
            )
            section.add_note(text, "caution", "Two planes")
    section.add_table(
        ("by", "height at the origin", "slope along x", "slope along y"),
        rows,
        "The world's z = 0 is the board's. Host and NES slide in a plane of their own, given by their markers' heights "
        "in layout_m, each of which may be off by layout_sd_m."
        + ("" if found is not None else " No body with layout_m was followed yet."),
    )


def _of_plane(name: str, value: float, sd: float) -> str:
    if name == "height_m":
        return value_with_sd(1e3 * value, 1e3 * sd, "mm")
    return value_with_sd(1e3 * value, 1e3 * sd, "mrad")


def _add_cross_validation(page: Page, parameters: pd.DataFrame | None) -> None:
    own = None if parameters is None else parameters[parameters["parameter"].isin(CROSS_VALIDATION)]
    if own is None or not len(own):
        return
    section = page.add_section("Does it contradict itself?", "cross-validation")
    value = {(row.camera, row.parameter): float(row.value) for row in own.itertuples()}
    rows = []
    for camera in dict.fromkeys(own["camera"]):
        field, halves = value.get((camera, "field_p")), value.get((camera, "halves_p"))
        size_px = value.get((camera, "field_px"), 0.0)
        doubtful = (halves is not None and halves < CHANCE) or (field is not None and field < CHANCE)
        rows.append(
            (
                str(camera),
                _chance(field),
                with_unit(size_px, "px", 2),
                _chance(halves),
                "no" if not doubtful else "yes" if size_px > TRIFLE_PX else "by a trifle",
            )
        )
    section.add_table(
        ("camera", "residuals alike by place: chance", "their size", "halves differ: chance", "contradicts itself"),
        rows,
        "Chance: how often noise alone would show as much. Below 1 % the calibration contradicts itself. A board that "
        "covers little of the image hides what bends slowly over the image: its own pose takes that up.",
    )


def _chance(p: float | None) -> str:
    return MISSING if p is None else "below 0.001" if p < 1e-3 else f"{p:.3f}"


def _add_lens(page: Page, lens: pd.DataFrame, spline: pd.DataFrame | None) -> None:
    section = page.add_section("Which lens", "lens")
    rows = [
        (
            str(row.camera),
            str(row.lens),
            str(row.terms),
            with_unit(row.fitted_px, "px", 3),
            with_unit(row.held_out_px, "px", 3),
            ("taken: " if row.chosen else "not taken: ") + str(row.reason),
        )
        for row in lens.sort_values(["camera", "terms"], kind="stable").itertuples()
    ]
    section.add_table(
        ("camera", "lens", "terms", "RMS of the fit", "RMS of held-out views", ""),
        rows,
        "A richer lens always fits its own views better; it is taken only where it foresees views not seen by the fit. "
        "Terms: of distortion, and numbers of the spline, which its own smoothness holds.",
    )
    if spline is not None:
        section.add_figure(
            "calibration_spline",
            partial(lens_field, spline, None, {}),
            "The spline beside the distortion terms (arrows: where a point is seen, less where the terms put it; RMS "
            f"over the nodes {with_unit(float(np.sqrt((spline[['du_px', 'dv_px']] ** 2).sum(axis=1).mean())), 'px', 2)}"
            "). Colour: its sd (px), large where no board was seen.",
            "Arrows of the spline of each camera over its standard deviation.",
        )


def _add_views(
    page: Page,
    results: Results,
    cameras: list[Camera],
    sizes: dict[str, tuple[int, int]],
    windows: dict[str, Window],
) -> None:
    corners, boards = results.get("calibration_corners"), results.get("calibration_boards")
    if corners is None or boards is None:
        return
    section = page.add_section("The views", "views")
    section.add_figure(
        "calibration_coverage",
        partial(coverage_and_residuals, corners, sizes, windows),
        "Where the board's points were seen (pale), and what each was off by (arrows, much lengthened). Arrows that "
        "point alike in one place mean a lens that does not fit; white places are known by the rest of the image only.",
        "Points of all views over each image with their residual vectors.",
    )
    section.add_figure(
        "calibration_scene",
        partial(scene, boards, cameras),
        "The cameras, the world's axes, and the board of every view as its camera saw it.",
        "Cameras and boards in space.",
        image="png",
    )
    for camera in cameras:
        shown = _pictures(results, camera, corners)
        if shown:
            section.add_figure(
                f"calibration_pictures_{camera.name}",
                partial(pictures, shown),
                f"{camera.name}: views with the points found, those with the largest residuals first.",
                "Small pictures of the views of one camera.",
                image="png",
            )


def _pictures(
    results: Results, camera: Camera, corners: pd.DataFrame
) -> list[tuple[str, np.ndarray, np.ndarray, float]]:
    """Views with the largest residuals: title, small picture, corners and its reduction."""
    import cv2

    settings = results.recording.settings.calibration
    if settings is None or settings.intrinsic is None:
        return []
    own = corners[corners["camera"] == camera.name]
    size = np.hypot(own["residual_u_px"], own["residual_v_px"]) ** 2
    rms = np.sqrt(size.groupby(own["view"]).mean()).sort_values(ascending=False)
    wanted = [str(name) for name in rms.index[:PICTURES]]
    images = _view_images(results.recording.calibration_images(camera.name, "intrinsic"), wanted)
    window = results.recording.camera(camera.name)
    shown: list[tuple[str, np.ndarray, np.ndarray, float]] = []
    for name in wanted:
        if name not in images:
            continue
        image = images[name]
        whole = image.shape[::-1] == camera.sensor_size_px
        uv = own.loc[own["view"] == name, ["u_px", "v_px"]].to_numpy(float)
        uv = uv if whole else uv - window.window_offset_px
        reduction = min(1.0, PICTURE_PX / image.shape[1])
        small = cv2.resize(image, None, fx=reduction, fy=reduction, interpolation=cv2.INTER_AREA)
        shown.append((f"{name}: {with_unit(rms[name], 'px', 2)}", small, uv, reduction))
    return shown


def _view_images(paths: list[Path], names: list[str]) -> dict[str, np.ndarray]:
    """Grey images of views, by name: that of a file, or of a film and its frame ("film.mp4 frame_00012")."""
    import cv2

    files = {path.name: path for path in paths}
    images = {}
    for name in names:
        if name in files:
            data = np.fromfile(files[name], np.uint8)
            image = cv2.imdecode(data, cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION) if len(data) else None
            if image is not None:
                images[name] = np.asarray(image)
    for film, path in files.items():
        numbers = {int(n.removeprefix(f"{film} frame_")): n for n in names if n.startswith(f"{film} frame_")}
        numbers = {number: name for number, name in numbers.items() if number < LAST_FRAME}
        if not numbers:
            continue
        video = cv2.VideoCapture(str(path.absolute()))
        video.set(cv2.CAP_PROP_ORIENTATION_AUTO, 0)
        for number in range(max(numbers) + 1):
            if not video.grab():
                break
            good, frame = video.retrieve() if number in numbers else (False, None)
            if good and frame is not None:
                images[numbers[number]] = np.asarray(cv2.cvtColor(frame, cv2.COLOR_BGR2GRAY))
        video.release()
    return images
