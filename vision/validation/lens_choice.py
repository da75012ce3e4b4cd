"""Which lens the views support, OpenCV's or one with a spline, chosen by views that no fit has seen.

The usual lens (four or five terms) stays unless a richer one foresees the points of held-out views better, beyond
chance and by more than a trifle.  A richer lens fits its own views better in any case; that proves nothing.  A spline
over the image is tried last, beside the terms of the best lens before it.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ovines.errors import InputError
from ovines.lens_field import LensField
from vision.calibration.bundle.adjustment import adjust
from vision.calibration.bundle.unknowns import Adjusted, Observation, Setting, State
from vision.calibration.single_camera import Single, board_pose, observations_of, only_poses, solve_camera, unbiased
from vision.calibration.targets.boards import Board
from vision.calibration.targets.detection import View
from vision.pinhole import K1, K3, N_INTRINSICS, S1, lens_of
from vision.validation.spline import adjust_with_spline, flat_spline

Array = NDArray[np.float64]
USUAL = ("four terms", "five terms")
RICHER = {"rational": S1, "thin prism": N_INTRINSICS}  # and the place of the first intrinsic that stays held
SPLINE = "spline"
FOLDS = 5  # parts of the views, each held out once
FEWEST_VIEWS = 8  # fewer give nothing to choose by
CHANCE = 0.005  # probability that so many views are foreseen so much better by chance (Wilcoxon's signed ranks)
WORTH = 0.01  # least share by which a richer lens lowers the held-out RMS
ITERATIONS = 10  # from the solution of all views it is not far
# A lens is like a fisheye where its image grows by less than this share of what a pinhole's would, or not at all.
LEAST_SLOPE = 0.02
FISHEYE_RATIO, FISHEYE_NOISE = 0.75, 10.0  # image radius over a pinhole's, beside residuals so many times the noise


@dataclass(frozen=True)
class Tried:
    """A lens: how many distortion terms and numbers of its spline it has, RMS [px] over points of all views in the fit
    and of held-out views, the probability ``p`` that chance makes it foresee them so much better than the lens before
    (NaN: not asked).
    """

    lens: str
    terms: int
    fitted_px: float
    held_out_px: float
    p: float
    chosen: bool
    reason: str


def choose_lens(
    single: Single, views: Sequence[View], board: Board, size_px: tuple[int, int]
) -> tuple[Single, list[Tried]]:
    """The camera with the lens that its views support, and every lens that was tried.

    ``views``: all of them; those that only the usual lens could not explain come back with a richer one.
    """
    k3 = int(single.setting.free[0, K3])
    usual = single
    if len(single.views) < FEWEST_VIEWS:
        why = f"{len(single.views)} views; to choose a richer one by, {FEWEST_VIEWS} are needed"
        return single, [Tried(USUAL[k3], 4 + k3, _rms(single.adjusted.residuals_px), np.nan, np.nan, True, why)]
    errors = _held_out(single, board)
    tried = [Tried(USUAL[k3], 4 + k3, _rms(single.adjusted.residuals_px), _rms(errors), np.nan, True, "the usual one")]
    for lens, held in RICHER.items():
        trial = _with_terms(usual, board, held)
        one, own = _compared(lens, held - K1, trial, single, errors, board)
        if one.chosen:
            errors, tried = own, [replace(other, chosen=False) for other in tried]
            single = solve_camera(views, board, size_px, held) or trial
        tried.append(one)
    flat = flat_spline(size_px)
    terms = int(np.flatnonzero(single.setting.free[0]).max()) + 1 - K1 + flat.size
    bent = _with_spline(single, board, flat)
    if bent is None:
        fitted = _rms(single.adjusted.residuals_px)
        return single, [*tried, Tried(SPLINE, terms, fitted, np.nan, np.nan, False, "residuals show no smooth field")]
    if single is not usual:  # views may have come back
        errors = _held_out(single, board)
    one, _ = _compared(SPLINE, terms, bent, single, errors, board)
    if one.chosen:
        single, tried = bent, [replace(other, chosen=False) for other in tried]
    return single, [*tried, one]


def _compared(
    lens: str, terms: int, trial: Single, before: Single, errors: Sequence[Array], board: Board
) -> tuple[Tried, list[Array]]:
    """A lens against the best one before it, whose held-out residuals of the same views are ``errors``; and its own."""
    fitted = _rms(trial.adjusted.residuals_px)
    closer = 1 - fitted / _rms(before.adjusted.residuals_px)
    if closer < WORTH:  # nothing that held-out views could show
        reason = f"even its own views lie only {max(closer, 0):.1%} closer"
        return Tried(lens, terms, fitted, np.nan, np.nan, False, reason), []
    from scipy.stats import wilcoxon  # takes long to load, and most lenses are no closer

    own = _held_out(trial, board)
    p = float(wilcoxon(_squares(errors), _squares(own), alternative="greater").pvalue)
    share = 1 - _rms(own) / _rms(errors)
    chosen = p < CHANCE and share > WORTH
    fall = f"held-out residuals fall by {share:.1%}"
    reason = fall if chosen else "held-out residuals do not fall" if share <= 0 else f"{fall} only"
    if not chosen and share > WORTH:
        reason = f"{fall}, which may be chance (p = {p:.2g})"
    return Tried(lens, terms, fitted, _rms(own), p, chosen, reason), own


def refuse_fisheye(name: str, single: Single, board: Board) -> None:
    """`InputError` for a lens that none of OpenCV's pinhole lenses can be: one that folds, or that bends much and
    leaves residuals far above the points' noise.
    """
    intrinsics, state = single.adjusted.state.intrinsics[0], single.adjusted.state
    _, distortion = lens_of(intrinsics)
    seen = [
        board.points_m()[view.points] @ turn.T + shift
        for view, turn, shift in zip(single.views, state.rotation, state.translation, strict=True)
    ]
    directions = np.concatenate(seen)
    reach = float(np.max(np.hypot(directions[:, 0], directions[:, 1]) / directions[:, 2]))
    radius = np.linspace(0, reach, 200)
    k1, k2, _, _, k3, k4, k5, k6 = np.concatenate([distortion, np.zeros(3)])[:8]
    r2 = radius**2
    image = radius * (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)))
    slope = float(np.min(np.gradient(image, radius)))
    residual = _rms(single.adjusted.residuals_px)
    noise = np.sqrt(2) * float(np.nanmedian(np.concatenate([view.sd_px for view in single.views])))
    shrunk = image[-1] / reach
    if slope < LEAST_SLOPE or (shrunk < FISHEYE_RATIO and residual > FISHEYE_NOISE * noise):
        raise InputError(
            f"{name}: a lens like a fisheye: {np.degrees(np.arctan(reach)):.0f} degrees off its axis the image is at "
            f"{shrunk:.0%} of a pinhole's radius, with residuals of {residual:.2f} px RMS",
            "a lens that OpenCV's pinhole camera describes (up to about 60 degrees off the axis)",
            "use a longer lens, or views of the image's middle only",
        )


def _with_terms(single: Single, board: Board, held: int) -> Single:
    """The camera solved again with every intrinsic before ``held`` free."""
    setting = copy(single.setting)
    setting.free = single.setting.free.copy()
    setting.free[0, K3:held] = True
    state = single.adjusted.state
    adjusted = adjust(observations_of(single.views, board, state), state, setting, ITERATIONS)
    return Single(adjusted, setting, single.views, dict(single.dropped))


def _with_spline(single: Single, board: Board, spline: LensField) -> Single | None:
    """The camera solved again with a spline beside its terms; None where its residuals show no smooth field."""
    setting, state = copy(single.setting), replace(single.adjusted.state, splines=(spline,))
    adjusted = adjust_with_spline(observations_of(single.views, board, state), state, setting, ITERATIONS)
    return None if adjusted is None else Single(adjusted, setting, single.views, dict(single.dropped))


def _held_out(single: Single, board: Board) -> list[Array]:
    """Residuals (n, 2) of each view by the lens of the views outside its part; the view's own pose is fitted."""
    residuals: list[Array] = [np.empty((0, 2))] * len(single.views)
    parts = np.arange(len(single.views)) % FOLDS
    for part in range(FOLDS):
        stay = np.flatnonzero(parts != part)
        start = only_poses(single.adjusted.state, [int(k) for k in stay])
        views = [single.views[k] for k in stay]
        found = _again(observations_of(views, board, start), start, copy(single.setting))
        for k in np.flatnonzero(parts == part):
            residuals[k] = _by_lens(single.views[k], board, found, single.adjusted.state, int(k))
    return residuals


def _again(observations: list[Observation], start: State, setting: Setting) -> Adjusted:
    """The lens from some of the views, a spline as large and as smooth as they alone say."""
    spline = start.splines[0]
    if spline is None:
        return adjust(observations, start, setting, ITERATIONS)
    flat = replace(start, splines=(spline.with_values(np.zeros(spline.size)),))
    return adjust_with_spline(observations, flat, setting, ITERATIONS) or adjust(
        observations, replace(start, splines=()), replace(setting, spline_priors=()), ITERATIONS
    )


def _by_lens(view: View, board: Board, found: Adjusted, state: State, k: int) -> Array:
    lens, points = found.state.lens(0), board.points_m()[view.points]
    turn, shift = state.rotation[k], state.translation[k]
    uv = view.uv_px if view.discs is None else unbiased(view.discs, lens, turn, shift)
    pose = board_pose(points, uv, lens)
    if pose is None:
        pose = turn, shift
    return np.asarray(uv - lens.project(points @ pose[0].T + pose[1]), float)


def _squares(residuals: Sequence[Array]) -> Array:
    return np.array([np.sum(one**2) for one in residuals])


def _rms(residuals: Sequence[Array]) -> float:
    """Over points, not coordinates, as OpenCV's."""
    return float(np.sqrt(2 * np.mean(np.concatenate(residuals) ** 2)))
