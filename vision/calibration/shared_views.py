"""Views that the cameras took at one instant: which they are, by the data, and what they say of the extrinsic views.

Two cameras that saw the board at once give their relative pose, and every such pair gives the same.  The views of the
board in the world position are one more pair: where the others agree with each other and not with it, the world is
wrong.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ovines.camera import Camera
from ovines.errors import InputError
from vision.calibration.single_camera import Single, board_pose
from vision.calibration.targets.boards import Board
from vision.calibration.targets.detection import View
from vision.pinhole import FX

Array = NDArray[np.float64]
Pose = tuple[Array, Array]  # X_camera = R X_board + t
# Views of one instant lie no farther apart, in pixels of the second camera: depth of a small board is known to a
# percent.
NEAR_PX = 200.0
# Nor by more than this share of the board's own extent: numbered from the other end it is off by all of it.
NEAR_SHARE = 0.35
AGREE_SHARE = 0.6  # of the views of one name that were taken at once, if any were: the others were moved or mistaken
FEWEST = 3  # views that agree with each other, from which on the extrinsic view is what is wrong


def taken_at_once(
    names: Sequence[str], singles: Mapping[str, Single], extrinsic: Mapping[str, View], board: Board
) -> set[str]:
    """Instants of which all cameras have a view of the same board pose; none where the cameras were not released
    together.

    `InputError` where many views agree on the cameras' relative pose and the extrinsic views contradict them.
    """
    views = {name: {view.when: k for k, view in enumerate(singles[name].views)} for name in names}
    shared = sorted(
        set.intersection(*(set(own) for own in views.values())) - {view.when for view in extrinsic.values()}
    )
    if len(names) < 2 or not shared:
        return set()
    agreeing = set(shared)
    for name in names[1:]:
        pairs = [
            (_pose(singles[names[0]], views[names[0]][when]), _pose(singles[name], views[name][when]))
            for when in shared
        ]
        own, other = (
            board_pose(board.points_m()[extrinsic[one].points], extrinsic[one].uv_px, _lens(singles[one]))
            for one in (names[0], name)
        )
        world = None if own is None or other is None else (own, other)
        focal_px = float(singles[name].adjusted.state.intrinsics[0, FX])
        agree = _agreeing(pairs if world is None else [*pairs, world], focal_px, board)
        near = agree[: len(pairs)]
        if agree.sum() < 2 or near.sum() < AGREE_SHARE * len(pairs):
            return set()
        if world is not None and not agree[-1] and near.sum() >= FEWEST:
            apart = [float(np.linalg.norm(_relative(pair)[1])) for pair, good in zip(pairs, near, strict=True) if good]
            raise _other_world((names[0], name), extrinsic, float(np.linalg.norm(_relative(world)[1])), apart)
        agreeing &= {when for when, good in zip(shared, near, strict=True) if good}
    return agreeing


def _other_world(
    pair: tuple[str, str], extrinsic: Mapping[str, View], world_m: float, others_m: Sequence[float]
) -> InputError:
    first, second = pair
    return InputError(
        f"the extrinsic views {extrinsic[first].name} of {first} and {extrinsic[second].name} of {second} put the "
        f"cameras "
        f"{world_m:.4g} m apart and turned otherwise than the {len(others_m)} views that both took at once: "
        f"{np.median(others_m):.4g} m",
        "the board in one and the same place in both extrinsic views",
        "take the extrinsic views again without moving board or cameras, or name a view that both took at once",
    )


def _lens(single: Single) -> Camera:
    return single.adjusted.state.lens(0)


def _pose(single: Single, k: int) -> Pose:
    return single.adjusted.state.rotation[k], single.adjusted.state.translation[k]


def _relative(pair: tuple[Pose, Pose]) -> Pose:
    """From the first camera to the second."""
    (first_turn, first_shift), (turn, shift) = pair
    relative = turn @ first_turn.T
    return relative, shift - relative @ first_shift


def _misses_px(pairs: Sequence[tuple[Pose, Pose]], focal_px: float, board: Board) -> Array:
    """(n, n) by how much the board of pair k, as the first camera has it, misses what the second one has by pair j's
    relative pose.

    In the second camera's pixels, mean over the board's four corners, and counted in what may be: NEAR_PX and
    NEAR_SHARE.
    """
    width, height = board.size_m
    corners = np.array([[0, 0, 0], [width, 0, 0], [0, height, 0], [width, height, 0]], float)
    first = np.array([corners @ turn.T + shift for (turn, shift), _ in pairs])
    second = np.array([corners @ turn.T + shift for _, (turn, shift) in pairs])
    out = np.empty((len(pairs), len(pairs)))
    px_per_m = focal_px / second[..., 2].mean(1)
    allowed = np.minimum(NEAR_PX, NEAR_SHARE * np.hypot(width, height) * px_per_m)
    for j, pair in enumerate(pairs):
        turn, shift = _relative(pair)
        out[j] = np.linalg.norm(first @ turn.T + shift - second, axis=-1).mean(1) * px_per_m / allowed
    return out


def _agreeing(pairs: Sequence[tuple[Pose, Pose]], focal_px: float, board: Board) -> NDArray[np.bool_]:
    """Which pairs agree with the one that agrees with most."""
    misses = _misses_px(pairs, focal_px, board)
    centre = int(np.argmax((misses < 1.0).sum(1) - 1e-3 * np.minimum(np.median(misses, axis=1), 1.0)))
    return np.asarray(misses[centre] < 1.0)
