"""One camera over the plane: markers whose heights are known, where their rays meet those heights.

What one view cannot tell stays open and is said: z is null, and with it whether the plane lies where the calibration
has it, or the bodies leave it.  How far a body does is bounded by its own size: a layout that comes nearer to the
camera looks larger (`vertical_motion`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ovines.camera import Camera
from ovines.recording import Recording
from ovines.robust import residual_sd
from vision.markers.perspective import on_plane

Array = NDArray[np.float64]

PLACED_SD_M = 5e-5  # of a marker's height where layout_sd_m does not say
FIRST_GUESS_SD_PX = 0.1  # of a track that carries none, until the bodies' own rigidity gives the real one
FEWEST_FRAMES = 20  # that say how far a body leaves the plane
MOST_FRAMES = 1000  # that are taken to learn heights
WRONG_FRAME = 3.0  # times the median misfit from which on a frame teaches nothing
FEWEST_MARKERS = 3  # of a body that is to tell its size, or its noise
WIDEST_SD = 4.0
SURE_SD = 4.0  # from which on vertical motion is said to be there
_EDGE = 1e-4  # sine of the angle at which a ray meets the plane: flatter ones give no place


class Height(NamedTuple):
    """Where a marker lies: x, y in its body, height over the sliding plane, and how well it was placed [m]."""

    body: str
    place_m: tuple[float, float, float]
    sd_m: float


@dataclass(frozen=True)
class VerticalMotion:
    """How far a body leaves the plane, by its size in the picture.

    ``z_m``: RMS of its height about the mean, 0 where it is not above its noise; ``least_m``: the smallest that would
    have been noticed; ``in_plane_m``: how far it moves x and y, RMS.
    """

    body: str
    z_m: float
    least_m: float
    in_plane_m: float


def marker_heights(recording: Recording) -> dict[str, Height]:
    """Per marker of a body with ``layout_m`` where it lies on it."""
    return {
        marker: Height(name, place, body.layout_sd_m or PLACED_SD_M)
        for name, body in recording.bodies.items()
        if body.layout_m is not None
        for marker, place in zip(body.markers, body.layout_m, strict=True)
    }


def one_view_heights(recording: Recording) -> dict[str, Height] | None:
    """:func:`marker_heights` of a recording of one camera; None of more."""
    return marker_heights(recording) if len(recording.cameras) == 1 else None


def points_in_plane(
    tracks: pd.DataFrame, camera: Camera, window_offset_px: Sequence[float], heights: Mapping[str, Height]
) -> pd.DataFrame:
    """Table ``points`` of one camera's tracks: where each ray meets its marker's height.

    ``x_sd_m``, ``y_sd_m`` come from the pixels.  Where a body visibly leaves the plane, ``x_common_sd_m``,
    ``y_common_sd_m`` say what that does to all of its markers together.  ``x_calibration_sd_m``,
    ``y_calibration_sd_m`` hold what is the same in all frames: the height's own sd (that of the calibration joins it);
    heights are first corrected as far as the bodies' rigidity tells them (:func:`learnt_heights`).  ``z_m``,
    ``z_sd_m`` and ``reprojection_px`` are null: one view has nothing to
    say of them.  A marker without a height has no row.
    """
    points = _placed(tracks, camera, window_offset_px, heights)
    learnt = learnt_heights(points, camera, heights)
    return _placed(tracks, camera, window_offset_px, learnt)


def _placed(
    tracks: pd.DataFrame, camera: Camera, window_offset_px: Sequence[float], heights: Mapping[str, Height]
) -> pd.DataFrame:
    """:func:`points_in_plane` with these heights as they are."""
    rows = tracks[tracks["marker"].isin(list(heights))].sort_values(["frame", "marker"], kind="stable")
    marker = rows["marker"].to_numpy(str)
    height = np.array([heights[name].place_m[2] for name in marker])
    height_sd = np.array([heights[name].sd_m for name in marker])
    uv = rows[["u_px", "v_px"]].to_numpy(float) + np.asarray(window_offset_px, float)
    place = on_plane(camera, uv, height) if len(rows) else np.empty((0, 3))
    away = place - camera.centre_m
    seen = np.isfinite(place).all(1) & (np.abs(away[:, 2]) > _EDGE * np.linalg.norm(away, axis=1))
    rows, marker, place, away = rows[seen], marker[seen], place[seen], away[seen]
    lever = away[:, :2] / away[:, 2:]  # metres in the plane per metre of height
    inverse = np.linalg.inv(camera.project_with_jacobian(place)[1][..., :2])
    per_px = np.sqrt(np.sum(inverse**2, -1))  # metres along x and y per pixel's sd
    sd_px = rows["sd_px"].to_numpy(float)
    points = pd.DataFrame(
        {
            "frame": rows["frame"].to_numpy(),
            "time_s": rows["time_s"].to_numpy(float),
            "marker": rows["marker"].to_numpy(),
            "x_m": place[:, 0],
            "y_m": place[:, 1],
            "z_m": np.nan,
        }
    )
    unknown = np.isnan(sd_px)
    if unknown.any():
        sd_px = np.where(unknown, FIRST_GUESS_SD_PX, sd_px)
        measured = _misfit(points, per_px.mean(1) * sd_px, heights)
        sd_px = np.where(unknown, FIRST_GUESS_SD_PX * (measured if measured > 0 else 1.0), sd_px)
    points["x_sd_m"], points["y_sd_m"] = (per_px * sd_px[:, None]).T
    points["z_sd_m"] = np.nan
    vertical = vertical_motion(points, camera, heights)
    lifted_m = vertical.z_m if vertical is not None else 0.0
    up = np.array([0.0 if heights[name].body == "ground" else lifted_m for name in marker])
    for i, axis in enumerate("xy"):
        points[f"{axis}_calibration_sd_m"] = np.abs(lever[:, i]) * height_sd[seen]
        if lifted_m:
            points[f"{axis}_common_sd_m"] = np.abs(lever[:, i]) * up
    points["z_calibration_sd_m"] = np.nan
    points["reprojection_px"] = points["epipolar_px"] = np.nan
    return points.reset_index(drop=True)


def learnt_heights(points: pd.DataFrame, camera: Camera, heights: Mapping[str, Height]) -> dict[str, Height]:
    """The heights as the bodies' rigidity corrects them, with the sd that is left.

    A marker higher than stated lies shifted away from the camera, whichever way its body is turned; one placed wrong on
    the body turns with it.  So a body that spins tells its markers' heights against each other (least squares over
    both, every frame's pose taken out, ``layout_sd_m`` as prior); one that does not keeps what was stated, and so does
    their mean.
    """
    out = dict(heights)
    for body in dict.fromkeys(height.body for height in heights.values()):
        names = [name for name, height in heights.items() if height.body == body]
        wide = _wide(points, body, heights, ("x_m", "y_m", "x_sd_m", "y_sd_m"))
        if wide is None or body == "ground":
            continue
        ever = np.asarray(np.isfinite(wide[..., 0]).any(0), bool)
        names = [name for name, seen in zip(names, ever.tolist(), strict=True) if seen]
        wide = wide[np.isfinite(wide[:, ever, 0]).all(1)][:, ever]
        if len(wide) < FEWEST_FRAMES:
            continue
        wide = wide[:: -(-len(wide) // MOST_FRAMES)]
        layout = np.array([heights[name].place_m for name in names])
        found = _height_errors(wide, layout, camera, heights[names[0]].sd_m)
        for name, more, sd in zip(names, *found, strict=True):
            x, y, z = heights[name].place_m
            out[name] = Height(body, (x, y, z + float(more)), float(sd))
    return out


def _height_errors(wide: Array, layout: Array, camera: Camera, prior_m: float) -> tuple[Array, Array]:
    """By how much each marker is higher than its layout (M, 3) says, and the sd that is left, from places (F, M, 4)."""
    count, frames = len(layout), len(wide)
    z, w = wide[..., 0] + 1j * wide[..., 1], layout[:, 0] + 1j * layout[:, 1]
    about = w - w.mean()
    turn = np.sum(np.conj(about) * (z - z.mean(1, keepdims=True)), 1)
    turn = turn / np.abs(turn)
    placed = z.mean(1)[:, None] + turn[:, None] * about
    residual = z - placed
    lever = (wide[..., :2] - camera.centre_m[:2]) / (layout[:, 2] - camera.centre_m[2])[:, None]
    c, s = turn.real, turn.imag
    design = np.zeros((frames, 2, count, 3 * count))
    nuisance = np.zeros((frames, 2, count, 3))
    arm = turn[:, None] * about
    for i in range(count):
        design[:, 0, i, i], design[:, 0, i, count + i], design[:, 0, i, 2 * count + i] = c, -s, -lever[:, i, 0]
        design[:, 1, i, i], design[:, 1, i, count + i], design[:, 1, i, 2 * count + i] = s, c, -lever[:, i, 1]
        nuisance[:, 0, i, 0] = nuisance[:, 1, i, 1] = 1.0
        nuisance[:, 0, i, 2], nuisance[:, 1, i, 2] = -arm[:, i].imag, arm[:, i].real
    pose = nuisance.reshape(frames, 2 * count, 3)
    pose = pose / np.linalg.norm(pose, axis=1, keepdims=True)  # a turn's column is in metres
    free = np.eye(2 * count) - pose @ np.linalg.solve(pose.transpose(0, 2, 1) @ pose, pose.transpose(0, 2, 1))
    rows = free @ design.reshape(frames, 2 * count, -1)
    right = np.stack([residual.real, residual.imag], 1).reshape(frames, 2 * count)
    right = np.einsum("fij,fj->fi", free, right)
    sd = np.sqrt(np.mean(wide[..., 2:] ** 2, axis=(1, 2)))
    found, covariance = np.zeros(3 * count), np.eye(3 * count)
    weight = np.ones(frames)
    for _ in range(3):  # frames that fit badly (a wrong marker) lose their weight
        scaled = (weight / sd**2)[:, None, None]
        normal = np.sum(rows.transpose(0, 2, 1) @ (scaled * rows), 0) + np.eye(3 * count) / prior_m**2
        covariance = np.linalg.inv(normal)
        found = covariance @ np.einsum("fij,fi->j", scaled * rows, right)
        misfit = np.sqrt(np.mean((right - rows @ found) ** 2, 1)) / sd
        weight = (misfit < WRONG_FRAME * np.median(misfit)).astype(float)
    return found[2 * count :], np.sqrt(np.diag(covariance))[2 * count :]


def vertical_motion(points: pd.DataFrame, camera: Camera, heights: Mapping[str, Height]) -> VerticalMotion | None:
    """How far the Host leaves the plane (without one the NES, which lies on it), by its size in the picture.

    A body that is z nearer to a camera D above looks z / D larger.  Its mean size is the calibration's affair; what it
    does about that mean beyond the pixels' noise is vertical motion (or a lens that is not as calibrated: it is an
    upper bound).  None where no body shows enough markers in enough frames.
    """
    for body in ("host", "nes"):
        size = _sizes(points, body, heights)
        if size is None:
            continue
        ratio, ratio_sd, place = size
        above_m = abs(float(camera.centre_m[2]) - np.mean([h.place_m[2] for h in heights.values() if h.body == body]))
        off = ratio / np.median(ratio) - 1.0
        # The pixels' sd may be too small; what differs from frame to frame is noise in any case.
        fast = float(residual_sd(np.diff(off, n=2)) ** 2 / 6.0)
        noise = max(float(np.median(ratio_sd)) ** 2, fast)
        unsure = SURE_SD * noise * float(np.sqrt(2.0 / len(off)))
        reach = WIDEST_SD * float(residual_sd(off))  # a swing has no tails: what lies farther off is a wrong marker
        excess = float(np.mean(np.clip(off, -reach, reach) ** 2)) - noise
        z_m = above_m * float(np.sqrt(excess)) if excess > unsure else 0.0
        away = np.hypot(*(place - camera.centre_m[:2]).T) / above_m
        return VerticalMotion(body, float(z_m), float(above_m * np.sqrt(unsure)), float(z_m * np.median(away)))
    return None


def one_view_notes(
    recording: Recording, tracks: pd.DataFrame, points: pd.DataFrame, cameras: Sequence[Camera]
) -> list[str]:
    """What a reader of a recording of one camera must know; [] of more."""
    if len(recording.cameras) != 1 or not len(points):
        return []
    heights = marker_heights(recording)
    camera = next(one for one in cameras if one.name == recording.cameras[0].name)
    notes = [
        "one camera: x, y and angle come from the markers' heights in layout_m; height (z), a tilted plane, a late "
        "clock and a wrong window_offset_px cannot be seen from one view"
    ]
    without = sorted(set(tracks["marker"].unique()) - set(heights))
    if without:
        notes.append(f"{', '.join(without)} have no height (layout_m) and so no points with one camera")
    found = vertical_motion(points, camera, heights)
    if found is not None and found.z_m:
        notes.append(
            f"the {found.body} leaves the plane by about {1e3 * found.z_m:.2g} mm rms, by its size in the picture: "
            f"one view puts {1e3 * found.in_plane_m:.2g} mm of that into x and y, and into their sd"
        )
    elif found is not None:
        notes.append(
            f"the {found.body} keeps its size in the picture: vertical motion of more than {1e3 * found.least_m:.2g} "
            f"mm rms would have been seen"
        )
    return notes


def _wide(points: pd.DataFrame, body: str, heights: Mapping[str, Height], value: Sequence[str]) -> Array | None:
    """Values (frames, markers, n) of a body's markers, NaN where unseen; None with too few markers."""
    own = [name for name, height in heights.items() if height.body == body]
    rows = points[points["marker"].isin(own)]
    there = set(rows["marker"].unique())
    present = [name for name in own if name in there]
    if len(present) < FEWEST_MARKERS:
        return None
    frames, at = np.unique(rows["frame"], return_inverse=True)
    column = rows["marker"].map({name: k for k, name in enumerate(own)}).to_numpy(int)
    wide = np.full((len(frames), len(own), len(value)), np.nan)
    wide[at, column] = rows[list(value)].to_numpy(float)
    return wide


def _similar(place: Array, layout: Array) -> tuple[Array, Array, Array]:
    """Size against the layout (F,), its lever (F,) and the residuals (F, M) complex of the similarity over all markers
    seen."""
    seen = np.isfinite(place[..., 0])
    z = np.where(seen, place[..., 0] + 1j * place[..., 1], 0.0)
    w = np.where(seen, layout[:, 0] + 1j * layout[:, 1], 0.0)
    count = np.maximum(seen.sum(1, keepdims=True), 1)
    z, w = (np.where(seen, v - v.sum(1, keepdims=True) / count, 0.0) for v in (z, w))
    square = np.sum(np.abs(w) ** 2, 1)
    with np.errstate(invalid="ignore", divide="ignore"):
        turn = np.sum(np.conj(w) * z, 1) / square
    return np.abs(turn), np.sqrt(square), np.where(seen, z - turn[:, None] * w, np.nan)


def _sizes(points: pd.DataFrame, body: str, heights: Mapping[str, Height]) -> tuple[Array, Array, Array] | None:
    """Per frame that shows the whole body: size against the layout, its sd, and the middle of its markers (F, 2)."""
    wide = _wide(points, body, heights, ("x_m", "y_m", "x_sd_m", "y_sd_m"))
    if wide is None:
        return None
    ever = np.isfinite(wide[..., 0]).any(0)
    layout = np.array([height.place_m[:2] for height in heights.values() if height.body == body])[ever]
    whole = np.isfinite(wide[:, ever, 0]).all(1)
    if whole.sum() < FEWEST_FRAMES or np.ptp(layout, axis=0).max() <= 0:
        return None
    wide = wide[whole][:, ever]
    size, lever, _ = _similar(wide[..., :2], layout)
    sd_m = np.sqrt(np.mean(wide[..., 2:] ** 2, axis=(1, 2)))
    return size, sd_m / lever, wide[..., :2].mean(1)


def _misfit(points: pd.DataFrame, sd_m: Array, heights: Mapping[str, Height]) -> float:
    """What rigid bodies scatter by over what these sds say; NaN where no body shows enough markers.

    What is the same in every frame (a marker off its layout) is no noise: it is taken out marker by marker, in the
    body's own directions.
    """
    ratios = []
    table = points.assign(sd=sd_m)
    for body in dict.fromkeys(height.body for height in heights.values()):
        wide = _wide(table, body, heights, ("x_m", "y_m", "sd"))
        if wide is None:
            continue
        layout = np.array([height.place_m[:2] for height in heights.values() if height.body == body])
        whole = np.isfinite(wide[..., 0]).all(1)
        if whole.sum() < FEWEST_FRAMES:
            continue
        wide = wide[whole]
        _, _, left = _similar(wide[..., :2], layout)
        z = wide[..., 0] + 1j * wide[..., 1]
        w = layout[:, 0] + 1j * layout[:, 1]
        turn = np.sum(np.conj(w - w.mean()) * z, 1)
        own = left * np.conj(turn / np.abs(turn))[:, None]
        own = own - np.median(own.real, 0) - 1j * np.median(own.imag, 0)
        expected = np.sqrt(np.mean(wide[..., 2] ** 2))
        free = (2 * len(layout) - 4) / (2 * len(layout))
        if free > 0:
            ratios.append(residual_sd(np.concatenate([own.real.ravel(), own.imag.ravel()])) / expected / np.sqrt(free))
    return float(np.mean(ratios)) if ratios else float("nan")
