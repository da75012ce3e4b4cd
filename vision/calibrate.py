"""Board images to calibrated cameras, with what can be trusted of them.

Each camera is solved from its own views; then all cameras and all views are adjusted together, the one
view of the board in the world position tying them.  Views of the same name in both cameras are taken as
simultaneous if the data agree: then they tie the cameras too.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ovines.camera import Camera
from ovines.errors import InputError
from ovines.recording import Recording
from vision.calibration.advice import EXTRINSIC, advise, coverage, length_advice
from vision.calibration.all_cameras import raise_world, solved_together
from vision.calibration.bundle.equations import project
from vision.calibration.bundle.unknowns import N_CAMERA, Adjusted, Observation, State
from vision.calibration.images import read_views
from vision.calibration.shared_views import taken_at_once
from vision.calibration.single_camera import (
    Single,
    board_pose,
    solve_camera,
)
from vision.calibration.targets.boards import Board
from vision.calibration.targets.detection import MINIMUM_POINTS, View
from vision.pinhole import INTRINSICS, K1, lens_of
from vision.validation.lens_choice import choose_lens, refuse_fisheye
from vision.validation.result_tables import validation_tables

Array = NDArray[np.float64]
# Views of one name taken as simultaneous may raise the residuals by this factor, and pixels, no more: they have fewer
# unknowns.
SIMULTANEOUS, SIMULTANEOUS_PX = 1.15, 0.002
# Extrinsic views are another camera's where they misfit their own lens so many times worse (squares), and by so much of
# the noise (squares).
SWAPPED, SWAPPED_NOISE = 4.0, 8.0


@dataclass(frozen=True, eq=False)
class Calibration:
    """The cameras and how well they are known.

    ``tables``: by name, what its worth is judged from (lenses tried, corners, boards, maps of image and plane).

    ``views``, ``parameters``: tables ``calibration_views``, ``calibration_parameters``; ``rms_px`` everywhere is
    OpenCV's, over points, not coordinates.  ``advice``: what to do better, one sentence each.  ``covariance`` (p, p)
    over ``labels`` (camera, parameter): the intrinsics (:data:`vision.pinhole.INTRINSICS`), then
    rotation (a left-multiplied rotation vector) and translation; NaN for what was held.  ``simultaneous``: whether the
    cameras' views were tied.
    """

    cameras: list[Camera]
    views: pd.DataFrame
    parameters: pd.DataFrame
    advice: list[str]
    covariance: Array
    labels: list[tuple[str, str]]
    board: Board
    simultaneous: bool
    tables: dict[str, pd.DataFrame]


def calibrate(
    board: Board,
    views: Mapping[str, Sequence[View]],
    sensor_size_px: Mapping[str, tuple[int, int]],
    extrinsic: Mapping[str, View],
    simultaneous: bool | None = None,
    known_baseline_m: float | None = None,
    board_height_m: float = 0.0,
) -> Calibration:
    """Cameras from detected board views.

    Parameters
    ----------
    board : the board as printed
    views : per camera, its views (full-sensor pixels), see :func:`vision.calibration.targets.detection.detect`
    sensor_size_px : per camera
    extrinsic : per camera, the view of the board in the world position
    simultaneous : whether views of one name show one board pose; None: as the data say
    known_baseline_m : distance of the cameras' centres, to check the board's square size against
    board_height_m : of the printed surface in the world position above the sliding plane, which is z = 0

    Raises `InputError` for too few views, a board not seen in the world position, swapped extrinsic views.
    """
    names = list(views)
    if len(names) > 1 and board.ends_alike:
        raise _ambiguous(board)
    singles, tried = {}, {}
    for name in names:
        usual = _solved(name, views[name], board, sensor_size_px[name])
        singles[name], tried[name] = choose_lens(usual, views[name], board, sensor_size_px[name])
        refuse_fisheye(name, singles[name], board)
    for name in names:
        if len(extrinsic[name].points) < MINIMUM_POINTS:
            raise InputError(
                f"{name}: {len(extrinsic[name].points)} points of the board in its extrinsic view",
                f"at least {MINIMUM_POINTS}",
                "take the view of the board in the world position again",
            )
    _refuse_swapped(names, singles, extrinsic, board)
    sizes = [sensor_size_px[name] for name in names]
    best, tied = solved_together(names, singles, extrinsic, board, sizes, set()), False
    if simultaneous:
        shared = set.intersection(*({v.when for v in s.views} for s in singles.values()))
    else:
        shared = taken_at_once(names, singles, extrinsic, board) if simultaneous is None else set()
    if shared:
        trial = solved_together(names, singles, extrinsic, board, sizes, shared)
        agrees = bool((trial.sigma_px < SIMULTANEOUS * best.sigma_px + SIMULTANEOUS_PX).all())
        if simultaneous and not agrees:  # the board moved between the exposures: that says nothing about lenses
            trial = solved_together(names, singles, extrinsic, board, sizes, shared, lenses_known=True)
        if simultaneous or agrees:
            best, tied = trial, True
    raise_world(best, board_height_m)
    cameras = [_camera(name, size, best, c) for c, (name, size) in enumerate(zip(names, sizes, strict=True))]
    tables, more, contradicted = validation_tables(cameras, singles, tried, best.covariance, board)
    parameters = pd.concat([_parameter_table(names, best, singles, sensor_size_px, cameras), more], ignore_index=True)
    table = _view_table(names, singles, best, views, extrinsic)
    extrinsic_names = {name: extrinsic[name].name for name in names}
    advice = advise(singles, sensor_size_px, board, parameters, table, extrinsic_names) + contradicted
    if known_baseline_m is not None and len(cameras) == 2:
        baseline_m = float(np.linalg.norm(cameras[0].centre_m - cameras[1].centre_m))
        advice += length_advice(baseline_m, known_baseline_m, board, "the cameras' distance")
    return Calibration(
        cameras,
        table,
        parameters,
        advice,
        best.covariance,
        [(names[c], label) for c, label in best.labels],
        board,
        tied,
        tables,
    )


def calibrate_recording(recording: Recording, progress: Callable[[int, int], None] | None = None) -> Calibration:
    """The calibration that ``[calibration]`` of recording.toml asks for: board, intrinsic and extrinsic images."""
    board, views, extrinsic, notes = read_views(recording, progress)
    sizes = {camera.name: (camera.sensor_size_px[0], camera.sensor_size_px[1]) for camera in recording.cameras}
    settings = recording.settings.calibration
    height_m = settings.board_height_m if settings is not None else None
    at_once = settings.simultaneous if settings is not None else None
    result = calibrate(board, views, sizes, extrinsic, simultaneous=at_once, board_height_m=height_m or 0.0)
    if at_once and not result.simultaneous:
        notes = [
            *notes,
            "simultaneous = true, but no view that all cameras can use has one name in all of them: not used.",
        ]
    result.advice[:0] = notes
    return result


def _ambiguous(board: Board) -> InputError:
    columns, rows = board.squares
    if board.of_dots:
        return InputError(
            f"{board.kind} {columns} x {rows} look the same turned by half: nothing shows the cameras which one is the "
            f"first",
            "asymmetric circles of an odd number of rows, or a grid with three rings",
            "calibrate with another board, or each camera by itself",
        )
    return InputError(
        f"a chessboard of {columns} x {rows} squares looks the same turned by half: nothing shows the cameras which "
        f"corner is the first",
        "one even and one odd number of squares, or a ChArUco board",
        f"cover one row of squares and set squares = [{columns}, {rows - 1}], or calibrate with another board",
    )


def _solved(name: str, views: Sequence[View], board: Board, size_px: tuple[int, int]) -> Single:
    single = solve_camera(views, board, size_px)  # the extrinsic view joins later: it may be another camera's
    if single is None:
        found = sum(len(v.points) >= MINIMUM_POINTS for v in views)
        raise InputError(
            f"{name}: board {board.name} usable in {found} of {len(views)} images",
            "at least three usable views",
            "take 10 to 20 views with the board tilted, near every corner of the image, sharp and well lit",
        )
    return single


def _refuse_swapped(
    names: Sequence[str], singles: Mapping[str, Single], extrinsic: Mapping[str, View], board: Board
) -> None:
    """Extrinsic images in the wrong cameras' folders: each fits the other camera's lens clearly better than its own."""
    if len(names) != 2:
        return

    def error(camera: str, seen: str) -> float:
        view, solved = extrinsic[seen], singles[camera].adjusted.state
        pose = board_pose(board.points_m()[view.points], view.uv_px, solved.lens(0))
        if pose is None:
            return np.inf
        observation = Observation(0, 0, False, board.points_m()[view.points], view.uv_px)
        state = State(
            solved.intrinsics, np.eye(3)[None], np.zeros((1, 3)), pose[0][None], pose[1][None], solved.splines
        )
        return float(np.mean((view.uv_px - project(observation, state, singles[camera].setting)[0]) ** 2))

    a, b = names
    noise = max(s.adjusted.sigma_px[0] for s in singles.values())
    straight, crossed = error(a, a) + error(b, b), error(a, b) + error(b, a)
    if straight > SWAPPED * crossed and straight > SWAPPED_NOISE * noise**2:
        raise InputError(
            f"the extrinsic view of {a} fits the lens of {b} and the other way round "
            f"({np.sqrt(straight):.2f} px as given, {np.sqrt(crossed):.2f} px swapped)",
            "each camera's own images",
            "swap the cameras' calibration folders",
        )


def _camera(name: str, size_px: tuple[int, int], found: Adjusted, c: int) -> Camera:
    return Camera(
        name,
        size_px,
        *lens_of(found.state.intrinsics[c]),
        found.state.camera_rotation[c],
        found.state.camera_translation[c],
        _rms(found, c),
        spline=found.state.splines[c],
    )


def _rms(found: Adjusted, c: int) -> float:
    own = [r for r, count in zip(found.residuals_px, found.camera_of, strict=True) if count == c]
    return float(np.sqrt(2 * np.mean(np.concatenate(own) ** 2)))


def _parameter_table(
    names: Sequence[str],
    found: Adjusted,
    singles: Mapping[str, Single],
    sensor_size_px: Mapping[str, tuple[int, int]],
    cameras: Sequence[Camera],
) -> pd.DataFrame:
    sd = np.sqrt(np.diag(found.covariance))
    rows = []
    for c, (name, camera) in enumerate(zip(names, cameras, strict=True)):
        first = N_CAMERA * c
        rows += [
            (name, label, value, s if np.isfinite(s) else None)
            for label, value, s in zip(
                INTRINSICS[: K1 + len(camera.distortion)], found.state.intrinsics[c], sd[first:], strict=False
            )
        ]
        rows += [
            (name, label, value, s)
            for label, value, s in zip(
                ("tx_m", "ty_m", "tz_m"), camera.translation_m, sd[first + N_CAMERA - 3 : first + N_CAMERA], strict=True
            )
        ]
        rows.append((name, "rms_px", camera.rms_px, None))
        rows.append((name, "coverage", coverage(singles[name].views, sensor_size_px[name]), None))
    return pd.DataFrame(rows, columns=["camera", "parameter", "value", "sd"]).astype({"sd": float})


def _view_table(
    names: Sequence[str],
    singles: Mapping[str, Single],
    found: Adjusted,
    views: Mapping[str, Sequence[View]],
    extrinsic: Mapping[str, View],
) -> pd.DataFrame:
    rows: list[tuple[object, ...]] = []
    for c, name in enumerate(names):
        residuals = [r for r, camera in zip(found.residuals_px, found.camera_of, strict=True) if camera == c]
        rms = [float(np.sqrt(2 * np.mean(r**2))) for r in residuals]
        fitted = dict(
            zip([EXTRINSIC] + [v.name for v in singles[name].views if v.name != extrinsic[name].name], rms, strict=True)
        )
        rows.append((name, EXTRINSIC, len(extrinsic[name].points), True, fitted[EXTRINSIC], None))
        for view in views[name]:
            if view.name == extrinsic[name].name:
                continue
            rows.append(
                (
                    name,
                    view.name,
                    len(view.points),
                    view.name in fitted,
                    fitted.get(view.name),
                    singles[name].dropped.get(view.name),
                )
            )
    return pd.DataFrame(rows, columns=["camera", "view", "points", "used", "rms_px", "reason"]).astype(
        {"rms_px": float}
    )
