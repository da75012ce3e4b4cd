"""One camera from its board views: first guesses, whether the data need k3, which views are outliers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from ovines.camera import Camera
from vision.calibration.bundle.adjustment import adjust
from vision.calibration.bundle.unknowns import Adjusted, Observation, Setting, SplinePrior, State, spline_places
from vision.calibration.targets.boards import Board
from vision.calibration.targets.detection import MINIMUM_POINTS, View
from vision.markers.perspective import circle_centres
from vision.pinhole import CX, CY, FX, FY, K1, K2, K3, K4, K5, K6, N_INTRINSICS, P1, P2, S1, S2, S3, S4

Array = NDArray[np.float64]
# k3 is freed when it lowers chi^2 by more than this (3 sigma).
K3_GAIN = 10.0
# Industrial lenses and webcams alike have their principal point within a few percent of the middle.
CENTRE_SD_SHARE = 0.03
ASPECT_SD = 0.003  # of fy / fx - 1: pixels are square
# What a real lens does at the image's corner, as a share of the radius: k1, k2 and k3; and the least sd of each.
CORNER_DISTORTION, LEAST_DISTORTION_SD = (0.3, 0.05, 0.05), 0.5
# k2, p1 and p2 are always free, with what real lenses show as prior: held at zero they move k1 (by 5 sd on a rendered
# rig) and the principal point (by 3.4 sd) by more than their sd say
DECENTRING_SD = 5e-4  # of the thin prism's terms too
OUTLIER_SIGMAS, VIEW_FACTOR = 6.0, 4.0  # of a point, in sds; of a view, in parts of the median view's rms
FEWEST_VIEWS = 3
_ROUNDS = 4  # in which outliers are left out
_LEAST_VIEW_RMS_PX = 0.02  # of the median view: rendered views have less, and none of them is an outlier
# Focal lengths in image widths: a first guess is believed between these, and else begins with the last.
_FOCAL_RANGE, _FOCAL_GUESS = (0.2, 50.0), 1.5


@dataclass
class Single:
    """One camera solved by itself: the adjustment, its views in order, and why some were left out."""

    adjusted: Adjusted
    setting: Setting
    views: list[View]
    dropped: dict[str, str]


def solve_camera(
    views: Sequence[View], board: Board, sensor_size_px: tuple[int, int], held: int | None = None
) -> Single | None:
    """Intrinsics and one pose per view; None when fewer than three views can be used.

    ``held``: place of the first intrinsic that stays held; None: k3 if the data need it, and no richer lens.
    """
    kept, dropped = _usable(views, board)
    if len(kept) < FEWEST_VIEWS:
        return None
    state = _first_guess(kept, board, sensor_size_px)
    setting = make_setting([sensor_size_px], state)
    result = adjust(observations_of(kept, board), state, setting)
    for _ in range(_ROUNDS):
        observations = observations_of(kept, board, result.state)
        posed = repose(observations, result.state)
        if held is None:
            result = _with_k3_if_significant(observations, posed, setting)
        else:
            setting.free[0, :held] = True
            result = adjust(observations, posed, setting)
        bad = _outlying_views(result, kept)
        cleaned = without_outliers(kept, result.residuals_px, result.sigma_px[0])
        stay = [k for k, view in enumerate(kept) if view.name not in bad]
        if len(stay) == len(kept) and all(len(a.points) == len(b.points) for a, b in zip(kept, cleaned, strict=True)):
            break
        dropped.update(bad)
        if len(stay) < FEWEST_VIEWS:
            return None
        kept, result.state = [cleaned[k] for k in stay], only_poses(result.state, stay)
    return Single(result, setting, kept, dropped)


def observations_of(
    views: Sequence[View], board: Board, state: State | None = None, camera: int = 0
) -> list[Observation]:
    """One observation per view, each with its own pose; with a state, dots' centres without their perspective bias."""
    observations = [Observation(camera, k, False, board.points_m()[v.points], v.uv_px) for k, v in enumerate(views)]
    if state is not None:
        for observation, view in zip(observations, views, strict=True):
            if view.discs is not None:
                observation.uv_px = unbiased(
                    view.discs,
                    state.lens(camera),
                    state.rotation[observation.pose],
                    state.translation[observation.pose],
                )
    return observations


def unbiased(discs: Array, lens: Camera, rotation: Array, translation_m: Array) -> Array:
    """Images of the dots' centres: an image ellipse's own centre lies beside them, by what the pose says."""
    return circle_centres(discs, replace(lens, rotation=rotation, translation_m=translation_m), 0.0)[0]


def spline_prior(single: Single, found: bool) -> SplinePrior | None:
    """What is believed of the camera's spline beforehand or, once it is ``found``, afterwards; None without one."""
    spline = single.adjusted.state.splines[0]
    if spline is None or not found:
        return single.setting.spline_priors[0] if single.setting.spline_priors else None
    own = spline_places(single.adjusted.state.splines, 0)
    precision = np.linalg.inv(single.adjusted.covariance[np.ix_(own, own)])
    return SplinePrior(spline.values_px, np.asarray(0.5 * (precision + precision.T), float))


def only_poses(state: State, stay: Sequence[int]) -> State:
    """The state with the board poses of the views that stay."""
    return State(
        state.intrinsics,
        state.camera_rotation,
        state.camera_translation,
        state.rotation[stay],
        state.translation[stay],
        state.splines,
    )


def make_setting(sizes_px: Sequence[tuple[int, int]], state: State, world_from_board: Array | None = None) -> Setting:
    """Free the first four distortion terms, with priors that only bite where the views say nothing."""
    cameras = len(sizes_px)
    free = np.zeros((cameras, N_INTRINSICS), bool)
    free[:, :K3] = True
    prior, sd = np.zeros((cameras, N_INTRINSICS)), np.full((cameras, N_INTRINSICS), np.nan)
    for c, (width, height) in enumerate(sizes_px):
        prior[c, [CX, CY]] = 0.5 * (width - 1), 0.5 * (height - 1)
        sd[c, [CX, CY]] = CENTRE_SD_SHARE * max(width, height)
        corner = np.hypot(width, height) / 2 / state.intrinsics[c, FX]
        sd[c, [K1, K2, K3]] = sd[c, [K4, K5, K6]] = np.maximum(
            LEAST_DISTORTION_SD, np.array(CORNER_DISTORTION) / corner ** np.array([2, 4, 6])
        )
        sd[c, [P1, P2, S1, S3]] = DECENTRING_SD
        sd[c, [S2, S4]] = DECENTRING_SD / corner**2
    return Setting(
        free,
        prior,
        sd,
        ASPECT_SD,
        np.eye(3) if world_from_board is None else world_from_board,
        camera_poses_free=world_from_board is not None,
    )


def _with_k3_if_significant(observations: list[Observation], state: State, setting: Setting) -> Adjusted:
    """Free k3 only if the data need it.

    A board that fills a corner of the sensor leaves it open; freed without need it takes the focal length and
    the principal point with it.
    """
    setting.free[0, K3] = False
    state.intrinsics[0, K3] = 0.0
    best = adjust(observations, state, setting)
    setting.free[0, K3] = True
    trial = adjust(observations, best.state, setting)
    # same yardstick for both: sd of the larger model
    if (best.sigma_px[0] / trial.sigma_px[0]) ** 2 * best.chi2 - trial.chi2 > K3_GAIN:
        return trial
    setting.free[0, K3] = False
    return best


def _usable(views: Sequence[View], board: Board) -> tuple[list[View], dict[str, str]]:
    kept, dropped = [], {}
    for view in views:
        if len(view.points) == 0:
            dropped[view.name] = "board not found"
        elif len(view.points) < MINIMUM_POINTS:
            dropped[view.name] = f"only {len(view.points)} points"
        elif (
            np.linalg.matrix_rank(np.c_[board.points_m()[view.points][:, :2], np.ones(len(view.points))], tol=1e-9) < 3
        ):
            dropped[view.name] = "points in one line"
        else:
            kept.append(view)
    return kept, dropped


def _first_guess(views: Sequence[View], board: Board, size_px: tuple[int, int]) -> State:
    objects = [board.points_m()[v.points].astype(np.float32) for v in views]
    pixels = [v.uv_px.astype(np.float32).reshape(-1, 1, 2) for v in views]
    width, height = size_px
    try:
        matrix = cv2.initCameraMatrix2D(objects, pixels, size_px, 1.0)
        focal = float(matrix[0, 0])
    except cv2.error:
        focal = np.nan
    if not (
        _FOCAL_RANGE[0] * width < focal < _FOCAL_RANGE[1] * width
    ):  # views too alike: Zhang's equations say nothing
        focal = _FOCAL_GUESS * width
    intrinsics = np.zeros((1, N_INTRINSICS))
    intrinsics[0, [FX, FY, CX, CY]] = focal, focal, 0.5 * (width - 1), 0.5 * (height - 1)
    count = len(views)
    state = State(
        intrinsics, np.eye(3)[None], np.zeros((1, 3)), np.tile(np.eye(3), (count, 1, 1)), np.zeros((count, 3))
    )
    return repose(observations_of(views, board), state)


def repose(observations: Sequence[Observation], state: State) -> State:
    """Each board pose anew from its own points: a flat board has two poses that fit, the better one is kept."""
    state = state.copy()
    for observation in observations:
        found = board_pose(observation.points_m, observation.uv_px, state.lens(observation.camera))
        if found is not None:
            state.rotation[observation.pose], state.translation[observation.pose] = found
    return state


def board_pose(points_m: Array, uv_px: Array, lens: Camera) -> tuple[Array, Array] | None:
    """``X_camera = R X_board + t`` of a flat board by a known lens (the camera's own pose is not used); None when
    OpenCV finds none in front of the camera.
    """
    matrix, distortion, uv_px = lens.matrix, lens.distortion, lens.by_terms(uv_px)
    try:
        _, turns, shifts, _errors = cv2.solvePnPGeneric(points_m, uv_px, matrix, distortion, flags=cv2.SOLVEPNP_IPPE)
    except cv2.error:
        return None
    best: tuple[float, Array, Array] | None = None
    for turn, shift in zip(turns, shifts, strict=True):
        turn, shift = cv2.solvePnPRefineLM(points_m, uv_px, matrix, distortion, turn, shift)
        seen = cv2.projectPoints(points_m, turn, shift, matrix, distortion)[0].reshape(-1, 2)
        error = float(np.sum((seen - uv_px) ** 2))
        if shift[2, 0] > 0 and (best is None or error < best[0]):
            best = error, np.asarray(cv2.Rodrigues(turn)[0], float), np.asarray(shift, float).ravel()
    return None if best is None else best[1:]


def _outlying_views(result: Adjusted, views: Sequence[View]) -> dict[str, str]:
    rms = np.array([np.sqrt(np.mean(r**2)) for r in result.residuals_px])
    limit = VIEW_FACTOR * max(float(np.median(rms)), _LEAST_VIEW_RMS_PX)
    return {
        view.name: f"reprojection {value:.2f} px, {value / np.median(rms):.1f} times the median view"
        for view, value in zip(views, rms, strict=True)
        if value > limit
    }


def without_outliers(views: Sequence[View], residuals_px: Sequence[Array], sigma_px: float) -> list[View]:
    """Views without points beyond OUTLIER_SIGMAS; a view keeps at least MINIMUM_POINTS."""
    cleaned = []
    for view, residual in zip(views, residuals_px, strict=True):
        good = np.linalg.norm(residual, axis=-1) < OUTLIER_SIGMAS * sigma_px
        cleaned.append(view if good.all() or good.sum() < MINIMUM_POINTS else view.only(good))
    return cleaned
