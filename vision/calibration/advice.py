"""What the experimenter could do better: an RMS alone hides a weak calibration."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from vision.calibration.images import FRAME
from vision.calibration.single_camera import VIEW_FACTOR, Single
from vision.calibration.targets.boards import Board
from vision.calibration.targets.detection import View
from vision.pinhole import pinhole

Array = NDArray[np.float64]
CELLS = 8, 6  # of the sensor, for the share that board points have visited
FEW_VIEWS, SMALL_MARKER_PX, LITTLE_COVERAGE = 10, 20.0, 0.35  # views; pixels; share of the sensor
FLAT_DEG, TILTED_PERCENTILE = 15.0, 80  # tilt that so many percent of the views stay below where all are too flat
SAME_DEPTH = 0.1  # range of the views' distances over their median, below which they are alike
NAMED_SMALL, NAMED_RETAKES = 3, 5  # views named in a sentence
FILM_SHARE = 0.5  # of a film's frames that are of no use, from which on that is worth a remark
EXTRINSIC = "extrinsic view"  # its name in `calibration_views`
LEAST_RMS_PX = 0.1  # below, nothing is worth a remark
ABOVE_NOISE = 4.0  # residual over the points' own sd: real corners' sd is known to a factor of two
PRINT_SHARE = 0.8  # of the residual that is left without the board's own errors, where these are what is wrong
LOOSE_FOCAL, LOOSE_CENTRE = 0.005, 0.01  # relative sd of a focal length; sd of the principal point over the sensor
WRONG_LENGTH = 0.02  # relative error of a known length that is a wrong square size, not the calibration's own sd
FEWEST_SIGHTINGS = 3  # views of a board's point from which its own place can be estimated


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
    return np.asarray(
        np.degrees(np.arccos(np.clip(np.abs(np.einsum("ni,ni->n", state.rotation[:, :, 2], toward)), 0, 1)))
    )


def advise(
    singles: Mapping[str, Single],
    sensor_size_px: Mapping[str, tuple[int, int]],
    board: Board,
    parameters: pd.DataFrame,
    table: pd.DataFrame,
    extrinsic_names: Mapping[str, str],
) -> list[str]:
    """One sentence for each thing to do better, with the figure behind it; an empty list when nothing is.

    ``parameters``, ``table``: tables `calibration_parameters` and `calibration_views`; ``extrinsic_names``: per camera
    the name of its extrinsic view.
    """
    said = [
        sentence
        for name, single in singles.items()
        for sentence in _extrinsic_advice(name, table, single.dropped.get(extrinsic_names.get(name, "")))
    ]
    sd = parameters.set_index(["camera", "parameter"])["sd"]
    value = parameters.set_index(["camera", "parameter"])["value"]
    for name, single in singles.items():
        size = sensor_size_px[name]
        count, share, tilt = len(single.views), coverage(single.views, size), tilts_deg(single)
        if count < FEW_VIEWS:
            said.append(f"{name}: {count} usable intrinsic views; take at least {FEW_VIEWS}, better 15 to 20.")
        if share < LITTLE_COVERAGE:
            said.append(
                f"{name}: the board visited {share:.0%} of the sensor; move it to the corners, or use a larger board."
            )
        if (most := np.percentile(tilt, TILTED_PERCENTILE)) < FLAT_DEG:
            said.append(f"{name}: the board is tilted by less than {most:.0f} degrees; tilt some views by 30 to 45.")
        depth = single.adjusted.state.translation[:, 2]
        if np.ptp(depth) < SAME_DEPTH * np.median(depth):
            said.append(f"{name}: all views at {np.median(depth):.2f} m; take some nearer and some farther.")
        small = [v.name for v in single.views if v.marker_px < SMALL_MARKER_PX]
        if small:
            named = ", ".join(small[:NAMED_SMALL])
            said.append(f"{name}: markers below {SMALL_MARKER_PX:.0f} px in {len(small)} views ({named}); come nearer.")
        for focal in ("fx", "fy"):
            if sd[name, focal] > LOOSE_FOCAL * value[name, focal]:
                said.append(
                    f"{name}: {focal} is known to {sd[name, focal] / value[name, focal]:.1%} only; more tilted views "
                    f"help."
                )
        for centre, extent in (("cx", size[0]), ("cy", size[1])):
            if sd[name, centre] > LOOSE_CENTRE * extent:
                said.append(
                    f"{name}: {centre} is known to {sd[name, centre]:.0f} px only; more tilted views in both "
                    f"directions help."
                )
        said += _residual_advice(name, single, board)
        retake = {view: why for view, why in single.dropped.items() if view != extrinsic_names.get(name)}
        frames = {view for view in retake if FRAME in view}  # of a film: nobody takes one again
        if len(frames) > FILM_SHARE * (count + len(frames)):
            said.append(
                f"{name}: {len(frames)} of {count + len(frames)} frames looked at in its film cannot be used; "
                f"hold the board still, whole and large in the picture."
            )
        retake = {view: why for view, why in retake.items() if view not in frames}
        if retake:
            said.append(
                f"{name}: retake {', '.join(f'{view} ({why})' for view, why in list(retake.items())[:NAMED_RETAKES])}."
            )
    return said


def _extrinsic_advice(name: str, table: pd.DataFrame, dropped: str | None) -> list[str]:
    """What is wrong with the extrinsic view: it has no other to outvote it."""
    own = table[(table["camera"] == name) & table["used"]]
    world, others = own[own["view"] == EXTRINSIC]["rms_px"], own[own["view"] != EXTRINSIC]["rms_px"]
    if dropped is not None:
        why = dropped
    elif len(world) and len(others) and world.iloc[0] > max(VIEW_FACTOR * others.median(), LEAST_RMS_PX):
        why = f"reprojection {world.iloc[0]:.2f} px, {world.iloc[0] / others.median():.1f} times the median view"
    else:
        return []
    return [
        f"{name}: its extrinsic view is bad ({why}), and with it the world: every position and tilt is off; take that "
        f"view again first."
    ]


def _residual_advice(name: str, single: Single, board: Board) -> list[str]:
    """Residuals far above the noise of the points found, and whether the board's print makes them."""
    residual = float(np.sqrt(np.mean(np.concatenate(single.adjusted.residuals_px) ** 2)))
    noise = float(np.nanmedian(np.concatenate([view.sd_px for view in single.views])))
    if not residual > ABOVE_NOISE * noise or np.sqrt(2.0) * residual < LEAST_RMS_PX:
        return []
    print_m, left = board_errors(single, board)
    text = (
        f"{name}: residuals of {np.sqrt(2.0) * residual:.2f} px RMS are {residual / noise:.0f} times what the noise "
        f"of the points found makes; "
        f"they are no noise. "
    )
    if left < PRINT_SHARE * residual:
        return [
            text
            + f"The board's points lie {1e3 * print_m:.2g} mm off where they should be, alike in all views: print it "
            f"flat and true to scale, on a stiff plate."
        ]
    return [text + "They differ from view to view: the board bends or moves, or the lens is none of OpenCV's."]


def board_errors(single: Single, board: Board) -> tuple[float, float]:
    """RMS offset [m] per coordinate of the board's points from their places, as all views together show it; RMS
    residual [px] without it.
    """
    points, state = board.points_m(), single.adjusted.state
    normal, right = np.zeros((len(points), 2, 2)), np.zeros((len(points), 2))
    slopes = []
    for view, residual, turn, shift in zip(
        single.views, single.adjusted.residuals_px, state.rotation, state.translation, strict=True
    ):
        slope = pinhole(points[view.points] @ turn.T + shift, state.intrinsics[0])[2] @ turn[:, :2]
        np.add.at(normal, view.points, slope.transpose(0, 2, 1) @ slope)
        np.add.at(right, view.points, np.einsum("nij,ni->nj", slope, residual))
        slopes.append(slope)
    seen = np.bincount(np.concatenate([view.points for view in single.views]), minlength=len(points))
    off = np.zeros((len(points), 2))
    often = seen >= FEWEST_SIGHTINGS
    off[often] = np.linalg.solve(normal[often], right[often][..., None])[..., 0]
    left = [
        residual - np.einsum("nij,nj->ni", slope, off[view.points])
        for view, residual, slope in zip(single.views, single.adjusted.residuals_px, slopes, strict=True)
    ]
    count = max(float(seen[often].mean()), 2.0) if often.any() else 2.0
    return float(np.sqrt(np.mean(off[often] ** 2))) if often.any() else 0.0, float(
        np.sqrt(np.mean(np.concatenate(left) ** 2) * count / (count - 1))
    )


def length_advice(measured_m: float, known_m: float, board: Board, what: str) -> list[str]:
    """Tell a wrong square size by a known length: everything scales with it.  Empty within WRONG_LENGTH."""
    ratio = known_m / measured_m
    if abs(ratio - 1) < WRONG_LENGTH:
        return []
    return [
        (
            f"{what} comes out as {measured_m:.4g} m, not {known_m:.4g} m: square_size_m = "
            f"{board.square_size_m * ratio:.4g} "
            f"would fit, board {board.name} says {board.square_size_m:.4g}; measure the print."
        )
    ]
