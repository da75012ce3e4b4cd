"""What the experimenter could do better: an RMS alone hides a weak calibration."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ovines.camera import Camera
from vision.boards import Board
from vision.calibration_detect import View
from vision.calibration_single import Single

Array = NDArray[np.float64]
CELLS = 8, 6  # of the sensor, for the share that board points have visited
FEW_VIEWS, SMALL_MARKER_PX, LITTLE_COVERAGE, FLAT_DEG = 10, 20.0, 0.35, 15.0
LOOSE_FOCAL, LOOSE_CENTRE, WRONG_LENGTH = 0.005, 0.01, 0.02


def coverage(views: Sequence[View], size_px: tuple[int, int]) -> float:
    """Share of the sensor's CELLS in which some view had a board point, 0 to 1."""
    seen = np.zeros(CELLS, bool)
    for view in views:
        cell = np.clip((view.uv_px / size_px * CELLS).astype(int), 0, np.array(CELLS) - 1)
        seen[cell[:, 0], cell[:, 1]] = True
    return float(seen.mean())


def tilts_deg(single: Single) -> Array:
    """Angle between each view's board normal and its line of sight, degrees."""
    state = single.adjusted.state
    toward = state.translation / np.linalg.norm(state.translation, axis=-1, keepdims=True)
    return np.asarray(np.degrees(np.arccos(np.clip(np.abs(np.einsum("ni,ni->n", state.rotation[:, :, 2], toward)), 0, 1))))


def advise(names: Sequence[str], singles: Mapping[str, Single], sensor_size_px: Mapping[str, tuple[int, int]],
           parameters: pd.DataFrame, cameras: Sequence[Camera], known_baseline_m: float | None, board: Board) -> list[str]:
    """One sentence for each thing to do better, with the figure behind it; an empty list when nothing is."""
    said = []
    sd = parameters.set_index(["camera", "parameter"])["sd"]
    value = parameters.set_index(["camera", "parameter"])["value"]
    for name in names:
        single, size = singles[name], sensor_size_px[name]
        count, share, tilt = len(single.views), coverage(single.views, size), tilts_deg(single)
        if count < FEW_VIEWS:
            said.append(f"{name}: {count} usable intrinsic views; take at least {FEW_VIEWS}, better 15 to 20.")
        if share < LITTLE_COVERAGE:
            said.append(f"{name}: the board visited {share:.0%} of the sensor; move it to the corners, or use a larger board.")
        if np.percentile(tilt, 80) < FLAT_DEG:
            said.append(f"{name}: the board is tilted by less than {np.percentile(tilt, 80):.0f} degrees; tilt some views by 30 to 45.")
        depth = single.adjusted.state.translation[:, 2]
        if np.ptp(depth) < 0.1 * np.median(depth):
            said.append(f"{name}: all views at {np.median(depth):.2f} m; take some nearer and some farther.")
        small = [v.name for v in single.views if v.marker_px < SMALL_MARKER_PX]
        if small:
            said.append(f"{name}: markers below {SMALL_MARKER_PX:.0f} px in {len(small)} views ({', '.join(small[:3])}); come nearer.")
        for focal in ("fx", "fy"):
            if sd[name, focal] > LOOSE_FOCAL * value[name, focal]:
                said.append(f"{name}: {focal} is known to {sd[name, focal] / value[name, focal]:.1%} only; more tilted views help.")
        for centre, extent in (("cx", size[0]), ("cy", size[1])):
            if sd[name, centre] > LOOSE_CENTRE * extent:
                said.append(f"{name}: {centre} is known to {sd[name, centre]:.0f} px only; more tilted views in both directions help.")
        if single.dropped:
            said.append(f"{name}: retake {', '.join(f'{view} ({why})' for view, why in list(single.dropped.items())[:5])}.")
    if known_baseline_m is not None and len(cameras) == 2:
        said += length_advice(float(np.linalg.norm(cameras[0].centre_m - cameras[1].centre_m)), known_baseline_m, board,
                              "the cameras' distance")
    return said


def length_advice(measured_m: float, known_m: float, board: Board, what: str) -> list[str]:
    """Tell a wrong square size by a known length: everything scales with it.  Empty within WRONG_LENGTH."""
    ratio = known_m / measured_m
    if abs(ratio - 1) < WRONG_LENGTH:
        return []
    return [(f"{what} comes out as {measured_m:.4g} m, not {known_m:.4g} m: square_size_m = {board.square_size_m * ratio:.4g} "
            f"would fit, board {board.name} says {board.square_size_m:.4g}; measure the print.")]
