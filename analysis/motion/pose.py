"""Pose of a rigid body in the plane from its markers, robust to a wrong one.

A body stands on the sliding plane: its pose is x, y, an angle about z, and a height.  The design
position of each marker is known to ``layout_sd_m`` only; left alone, that error jumps into the pose whenever a
marker disappears.  :func:`refine_layout` therefore learns the markers' real places from the recording itself.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.statistics.robust import MEDIAN_SD
from ovines.robust import MEDIAN_TO_SD, TUKEY_SD, tukey_weight

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

# A frame is looked at again where a marker is this far (sd) from the pose of all; one of four markers or more is left
# out where that takes most of the misfit away.  Among markers that all are off (a layout not yet learnt) no single one
# does.
DOUBTFUL_SD = 3.5
FEWEST_TO_DOUBT = 4
AGREE_SHARE = 0.3
# Tukey's scale over the median distance: that of a plane's errors is 0.85 (Rayleigh: 1.18 sd); wider at first, so that
# no good marker is lost to a gross one.
SCALE, FIRST_SCALE = 1.2, 2.0
# While a layout is learnt its error falls from the placement's; markers are weighed with this share of it.
LEARNING_SHARE = 0.3
# Frames farther apart than this many frame times have a gap between them.
GAP_FRAMES = 1.5


@dataclass(frozen=True, eq=False)
class MarkerCloud:
    """The points of one body: F frames, M markers, NaN where unseen.

    ``position_m`` (F, M, 3), ``sd_m`` (F, M, 3), ``frame`` (F,), ``time_s`` (F,)."""

    frame: NDArray[np.int64]
    time_s: Array
    position_m: Array
    sd_m: Array


@dataclass(frozen=True, eq=False)
class Pose:
    """Pose per frame: ``xy_m`` (F, 2), ``z_m``, ``angle_rad`` (F,), wrapped to +-pi), their sd, markers used; NaN where
    < 2 markers.
    """

    xy_m: Array
    z_m: Array
    angle_rad: Array
    xy_sd_m: Array
    z_sd_m: Array
    angle_sd_rad: Array
    markers: NDArray[np.int64]
    weight: Array


def fit_pose(cloud: MarkerCloud, layout_m: Array, layout_sd_m: float, rounds: int = 8) -> Pose:
    """Weighted least squares over the markers seen, Tukey-weighted against single wrong points.

    The plane part is the closed-form rotation between two weighted point sets written as complex numbers; the weight
    of a marker is 1 / (its plane variance + ``layout_sd_m``^2).  Two markers suffice; their pose has a larger sd.
    """
    place = cloud.position_m[..., 0] + 1j * cloud.position_m[..., 1]
    design = np.broadcast_to(layout_m[:, 0] + 1j * layout_m[:, 1], place.shape)
    variance = 0.5 * (cloud.sd_m[..., 0] ** 2 + cloud.sd_m[..., 1] ** 2) + layout_sd_m**2
    seen = np.isfinite(place.real) & np.isfinite(variance)
    place, base = np.where(seen, place, 0), np.where(seen, 1 / np.where(seen, variance, 1), 0.0)
    robust = _without_worst(place, design, base)
    for step in range(rounds):
        weight = base * robust
        origin, turn, mean_design = _placed(place, design, weight)
        distance = np.abs(place - origin - turn * design) * np.sqrt(base)
        if step == rounds - 1:
            break
        # The scale falls from the misfit at hand to the known sd, so that one gross error cannot hide in its own fit.
        scale = np.maximum(1.0, _median_seen(distance, seen) * (SCALE if step else FIRST_SCALE))
        robust = np.where(seen, tukey_weight(distance / (TUKEY_SD * scale)), 0.0)
        few = (robust > 0).sum(1) < 2
        robust[few] = seen[few]
    used, total = (weight > 0).sum(1), weight.sum(1, keepdims=True)
    spread = (weight * np.abs(design - mean_design) ** 2).sum(1)
    lever = np.abs(mean_design[:, 0]) ** 2
    with np.errstate(invalid="ignore", divide="ignore"):
        height_weight = np.where(weight > 0, robust / np.where(seen, cloud.sd_m[..., 2] ** 2 + layout_sd_m**2, 1), 0)
        height = np.where(seen, cloud.position_m[..., 2] - layout_m[:, 2], 0)
        z = (height_weight * height).sum(1) / height_weight.sum(1)
        z_sd = 1 / np.sqrt(height_weight.sum(1))
        angle_sd = 1 / np.sqrt(spread)
        # A pivot away from the markers' mean adds the angle's uncertainty times its lever.
        xy_sd = np.sqrt(1 / total[:, 0] + 0.5 * lever * angle_sd**2)
    bad = (used < 2) | ~np.isfinite(angle_sd)
    angle = np.angle(turn[:, 0])
    columns = [
        np.where(bad, np.nan, v) for v in (origin[:, 0].real, origin[:, 0].imag, z, angle, xy_sd, z_sd, angle_sd)
    ]
    return Pose(
        np.stack(columns[:2], -1),
        columns[2],
        columns[3],
        columns[4],
        columns[5],
        columns[6],
        np.where(bad, 0, used),
        weight,
    )


def _placed(place: Complex, design: Complex, weight: Array) -> tuple[Complex, Complex, Complex]:
    """Origin, turn (unit complex) and weighted mean of the design, (F, 1) each, of the least-squares pose."""
    total = weight.sum(1, keepdims=True)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean_place, mean_design = ((weight * v).sum(1, keepdims=True) / total for v in (place, design))
        turn = (weight * np.conj(design - mean_design) * (place - mean_place)).sum(1, keepdims=True)
        turn = turn / np.abs(turn)
        return mean_place - turn * mean_design, turn, mean_design


def _without_worst(place: Complex, design: Complex, base: Array) -> Array:
    """1 per marker, 0 for the one without which the others of its frame (three or more) agree, where together they do
    not.

    Reweighting alone does not get there: of five markers, one 20 sd off drags the pose so far that all look 5 sd wrong.
    """
    start = np.ones_like(base)
    origin, turn, _ = _placed(place, design, base)
    distance = np.where(base > 0, np.abs(place - origin - turn * design) * np.sqrt(base), 0.0)
    doubtful = np.flatnonzero((distance.max(1, initial=0.0) > DOUBTFUL_SD) & ((base > 0).sum(1) >= FEWEST_TO_DOUBT))
    if not len(doubtful):
        return start
    at, goal, known = place[doubtful], design[doubtful], base[doubtful]
    misfits = np.full(at.shape, np.inf)
    for marker in range(at.shape[1]):
        without = known.copy()
        without[:, marker] = 0.0
        origin, turn, _ = _placed(at, goal, without)
        misfit = np.sum(without * np.abs(at - origin - turn * goal) ** 2, 1)
        misfits[:, marker] = np.where(known[:, marker] > 0, misfit, np.inf)
    worst = np.argmin(misfits, 1)
    agree = misfits[np.arange(len(doubtful)), worst] < AGREE_SHARE * np.sum(distance[doubtful] ** 2, 1)
    start[doubtful[agree], worst[agree]] = 0.0
    return start


def _median_seen(values: Array, seen: NDArray[np.bool_]) -> Array:
    """Median over the markers seen, (F, 1); 0 where none was."""
    ordered, count = np.sort(np.where(seen, values, np.inf), 1), seen.sum(1)
    rows = np.arange(len(values))
    last = max(values.shape[1] - 1, 0)
    middle = [ordered[rows, np.clip(k, 0, last)] for k in ((count - 1) // 2, count // 2)]
    return np.where(count > 0, 0.5 * (middle[0] + middle[1]), 0.0)[:, None]


def refine_layout(cloud: MarkerCloud, layout_m: Array, layout_sd_m: float, rounds: int = 3) -> tuple[Array, Array]:
    """The markers' real places in the body's frame, and their sd (both (M, 3)).

    Mean of what the frames say, drawn towards the design by its sd; the frame itself stays where the design puts it (no
    mean shift, no mean turn), by a robust fit, so that one marker glued far off does not drag the others' origin along.
    """
    layout = np.array(layout_m, float)
    prior = layout_sd_m**2
    sd = np.full_like(layout, layout_sd_m)
    for _ in range(rounds):
        pose = fit_pose(cloud, layout, LEARNING_SHARE * layout_sd_m)
        turn = np.exp(-1j * pose.angle_rad)[:, None]
        local = (
            cloud.position_m[..., 0] + 1j * cloud.position_m[..., 1] - (pose.xy_m[:, :1] + 1j * pose.xy_m[:, 1:])
        ) * turn
        place = np.stack([local.real, local.imag, cloud.position_m[..., 2] - pose.z_m[:, None]], -1)
        count = np.isfinite(place).sum(0)
        with np.errstate(invalid="ignore", divide="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)  # a marker never seen has no median; its design place stays
            measured = np.nanmedian(place, 0) if place.size else layout
            spread = MEDIAN_SD * MEDIAN_TO_SD * np.nanmedian(np.abs(place - measured), 0)
            variance = spread**2 / np.maximum(count, 1)
        measured = np.where(count > 0, measured, layout)
        variance = np.where(count > 0, variance, np.inf)
        layout = _keep_frame(measured, layout_m, layout_sd_m)
        sd = np.sqrt(np.where(np.isfinite(variance), 1 / (1 / np.maximum(variance, 1e-16) + 1 / prior), prior))
    return layout, sd


def _keep_frame(measured: Array, design: Array, layout_sd_m: float) -> Array:
    """``measured`` moved and turned onto ``design`` (robust), so that the body's frame stays the designer's."""
    one = MarkerCloud(np.zeros(1, np.int64), np.zeros(1), measured[None], np.full((1, *measured.shape), layout_sd_m))
    pose = fit_pose(one, design, 0.0)
    if not np.isfinite(pose.angle_rad[0]):
        return measured
    local = (measured[:, 0] + 1j * measured[:, 1] - complex(*pose.xy_m[0])) * np.exp(-1j * pose.angle_rad[0])
    height = measured[:, 2] - pose.z_m[0] if np.isfinite(pose.z_m[0]) else design[:, 2]  # one camera measures none
    return np.stack([local.real, local.imag, height], -1)


def unwrap_angle(time_s: Array, angle_rad: Array) -> Array:
    """Angle without jumps of 2 pi (NaN kept), carried over gaps by the spin on both sides of them.

    Between neighbouring frames less than half a turn is assumed; over a gap the number of turns is the one nearest to
    the mean of what the spin before and the spin after predict.
    """
    angle = np.full_like(angle_rad, np.nan)
    seen = np.flatnonzero(np.isfinite(angle_rad))
    if seen.size == 0:
        return angle
    times, values = time_s[seen], angle_rad[seen]
    period = np.median(np.diff(time_s)) if len(time_s) > 1 else 1.0
    breaks = np.flatnonzero(np.diff(times) > GAP_FRAMES * period) + 1
    pieces = np.split(np.arange(seen.size), breaks)
    unwrapped = np.concatenate([np.unwrap(values[piece]) for piece in pieces])
    spins = [_end_spins(times[piece], unwrapped[piece]) for piece in pieces]
    for k in range(1, len(pieces)):
        before, after = pieces[k - 1], pieces[k]
        gap = times[after[0]] - times[before[-1]]
        rates = [s for s in (spins[k - 1][1], spins[k][0]) if np.isfinite(s)]
        predicted = unwrapped[before[-1]] + gap * (np.mean(rates) if rates else 0.0)
        turns = np.round((predicted - unwrapped[after[0]]) / (2 * np.pi))
        unwrapped[after] += 2 * np.pi * turns
    angle[seen] = unwrapped
    return angle


def _end_spins(times: Array, angles: Array, frames: int = 8) -> tuple[float, float]:
    if len(times) < 2:
        return (np.nan, np.nan)
    first, last = (
        float(np.polyfit(times[s] - times[s][0], angles[s], 1)[0]) for s in (slice(0, frames), slice(-frames, None))
    )
    return first, last
