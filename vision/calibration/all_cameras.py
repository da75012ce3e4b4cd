"""All cameras solved together, with the board of the extrinsic view as the world."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ovines.errors import InputError
from vision.calibration.bundle.adjustment import adjust
from vision.calibration.bundle.unknowns import FIXED, N_CAMERA, Adjusted, Observation, State
from vision.calibration.single_camera import Single, board_pose, make_setting, observations_of, spline_prior, unbiased
from vision.calibration.targets.boards import WORLD_FROM_BOARD, Board
from vision.calibration.targets.detection import View
from vision.pinhole import N_INTRINSICS

Array = NDArray[np.float64]


def solved_together(
    names: Sequence[str],
    singles: Mapping[str, Single],
    extrinsic: Mapping[str, View],
    board: Board,
    sizes: Sequence[tuple[int, int]],
    tied: set[str],
    lenses_known: bool = False,
) -> Adjusted:
    """All cameras together.  The board of the extrinsic view is the world; views of the instants `tied` have their pose
    in it.

    ``lenses_known``: what each camera found by itself, with its sd, stands as prior for its intrinsics.
    """
    observations, state = _placed(names, singles, extrinsic, board, tied)
    setting = make_setting(sizes, state, WORLD_FROM_BOARD)
    setting.free = np.concatenate([singles[name].setting.free for name in names])
    setting.one_sigma = lenses_known
    setting.spline_priors = tuple(spline_prior(singles[name], lenses_known) for name in names)
    if lenses_known:
        setting.prior = state.intrinsics.copy()
        setting.prior_sd = np.stack(
            [np.sqrt(np.diag(singles[name].adjusted.covariance))[:N_INTRINSICS] for name in names]
        )
    setting.sigma_px = np.concatenate([singles[name].adjusted.sigma_px for name in names])
    return adjust(observations, state, setting)


def _placed(
    names: Sequence[str],
    singles: Mapping[str, Single],
    extrinsic: Mapping[str, View],
    board: Board,
    tied: set[str],
) -> tuple[list[Observation], State]:
    """All observations, and cameras and boards where the cameras by themselves place them: views of one of the instants
    `tied` share a pose, the first camera's."""
    observations: list[Observation] = []
    turns: list[Array] = []
    shifts: list[Array] = []
    camera_turns: list[Array] = []
    camera_shifts: list[Array] = []
    pose_of: dict[str, int] = {}
    for c, name in enumerate(names):
        single, world = singles[name], extrinsic[name]
        lens = single.adjusted.state.lens(0)
        placed = board_pose(board.points_m()[world.points], world.uv_px, lens)
        if placed is None:
            raise InputError(
                f"{name}: no pose fits its extrinsic view",
                "the whole flat board, in focus, in the world position",
                "take that view again",
            )
        turn, shift = placed
        uv = world.uv_px if world.discs is None else unbiased(world.discs, lens, turn, shift)
        observations.append(Observation(c, FIXED, True, board.points_m()[world.points], uv))
        camera_turns.append(turn @ WORLD_FROM_BOARD)
        camera_shifts.append(shift)
        own = observations_of(single.views, board, single.adjusted.state)
        for view, observation in zip(single.views, own, strict=True):
            if view.name == world.name:
                continue  # already there, as the world
            turn, shift = (
                single.adjusted.state.rotation[observation.pose],
                single.adjusted.state.translation[observation.pose],
            )
            at_once = view.when in tied
            if at_once and view.when in pose_of:
                pose = pose_of[view.when]
            else:
                pose = len(turns)
                turns.append(camera_turns[c].T @ turn if at_once else turn)
                shifts.append(camera_turns[c].T @ (shift - camera_shifts[c]) if at_once else shift)
                pose_of[view.when] = pose
            observations.append(Observation(c, pose, at_once, observation.points_m, observation.uv_px))
    intrinsics = np.concatenate([singles[name].adjusted.state.intrinsics for name in names])
    state = State(
        intrinsics,
        np.array(camera_turns),
        np.array(camera_shifts),
        np.array(turns).reshape(-1, 3, 3),
        np.array(shifts).reshape(-1, 3),
        tuple(singles[name].adjusted.state.splines[0] for name in names),
    )
    return observations, state


def raise_world(found: Adjusted, board_height_m: float) -> None:
    """Put the world's origin, which the adjustment has on the board, by that much under it; covariance included."""
    for c, rotation in enumerate(found.state.camera_rotation):
        up = board_height_m * rotation[:, 2]
        found.state.camera_translation[c] -= up
        turn, shift = N_CAMERA * c + N_INTRINSICS, N_CAMERA * (c + 1) - 3
        change = np.eye(len(found.covariance))
        change[shift : shift + 3, turn : turn + 3] = np.array(
            [[0, -up[2], up[1]], [up[2], 0, -up[0]], [-up[1], up[0], 0]]
        )
        held = np.isnan(found.covariance)
        found.covariance = change @ np.nan_to_num(found.covariance) @ change.T
        found.covariance[held] = np.nan
