"""What the Host's path says in each frame of a clock that all cameras share: beside its drive's lines, or beside a path
as smooth as its drive."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from analysis.gap.laws.frames.evidence.known import every_frame
from analysis.gap.laws.frames.evidence.rows import CLIP_SD, FEWEST_FRAMES, FREE_PARTS, FrameRows, problem_of
from analysis.gap.series import Series
from analysis.motion.host_path import HostMotion
from ovines.core.laws import words as W
from ovines.robust import residual_sd

Array = NDArray[np.float64]
# Overtones of the drive, which say nothing of a clock.
OVERTONES = 6
# A line of the Host beside its drive is one of the drive from this share of its amplitude on: a delay that swings makes
# small ones.
LEAST_LINE = 0.1
# What no line explains is less than this share of the drive: else it starts, stops or sweeps.
MOST_BESIDE = 0.2
# A drive without lines is followed by splines of this degree, with knots at so many frames, the first of these that
# leave hardly more than any: what they follow says nothing of a clock.
DEGREE, KNOT_FRAMES, FOLLOWS = 5, (64, 48, 32, 24, 16, 12, 8, 6), 1.05


class BesideDrive(NamedTuple):
    """The Host's path of a run beside its drive: of the ``frames`` (N,) that saw it, what the path is ``off_m`` (N, 2)
    the drive, its ``velocity_m_per_s`` (N, 2), and an orthonormal ``basis`` (N, Q) of what the drive may take."""

    frames: NDArray[np.int64]
    off_m: Array
    velocity_m_per_s: Array
    basis: Array


class Followed(NamedTuple):
    """A path that splines follow: the ``noise_m`` that they leave beside them, over what is left free, what the path is
    ``off_m`` (N, 2) them, and their orthonormal ``basis`` (N, Q)."""

    noise_m: float
    off_m: Array
    basis: Array


def clock_rows(series: Series, by_lines: bool = True) -> FrameRows | None:
    """What the Host's path beside its drive says of a delay of all cameras; None where it says nothing.

    Of each run the drive's lines are projected out, their frequency and the level's drift among them; or, not
    ``by_lines``, all that is as smooth as the path is: what a clock does at once, or faster, stays."""
    known, begins = every_frame(series)
    values: list[Array] = []
    units: list[Array] = []
    ats: list[NDArray[np.int64]] = []
    bases: list[tuple[slice, Array]] = []
    row = 0
    for number, run in enumerate(series.runs):
        path = (_beside_drive if by_lines else _beside_path)(run.data.time_s, run.data.host)
        if path is None:
            continue
        at_run = begins[number] + path.frames
        for off_m, velocity in zip(path.off_m.T, path.velocity_m_per_s.T, strict=True):
            sd = residual_sd(_on_time(off_m, velocity, known[at_run, W.SHARE]))
            own = np.clip(off_m / max(sd, 1e-12), -1e3, 1e3)
            values.append(own - path.basis @ (path.basis.T @ own))
            units.append(velocity / max(sd, 1e-12))
            ats.append(at_run)
            bases.append((slice(row, row + len(at_run)), path.basis))
            row += len(at_run)
    if not values:
        return None
    at = np.concatenate(ats).astype(np.int64)
    problem = problem_of(np.concatenate(values), np.zeros((row, 0)), known, at)
    return FrameRows(problem, known, at, {("clock_delay", 0): np.concatenate(units)}, tuple(bases))


def _beside_drive(time_s: Array, host: HostMotion) -> BesideDrive | None:
    """The path beside the drive's lines, their overtones and what a drift of each makes of it; None where it has none,
    or is further from them than a clock moves it."""
    use = _seen(time_s, host)
    if not host.omega_rad_per_s or use is None:
        return None
    t = time_s[use] - float(np.mean(time_s))
    turn = host.omega_rad_per_s * t
    lines = [np.ones_like(t)]
    for k in range(1, OVERTONES + 1):
        lines += [np.cos(k * turn), np.sin(k * turn)]
    lines += [t * np.cos(turn), t * np.sin(turn)]
    for rate, size in zip(host.lines_rad_per_s, _line_sizes(host), strict=True):
        if size > LEAST_LINE * host.amplitude_m:
            wave = [np.cos(rate * t), np.sin(rate * t)]
            lines += [*wave, *(t * one for one in wave)]
    basis = np.linalg.qr(np.column_stack(lines))[0]
    # What no line explains may be the delay itself: it is asked again, whatever has described the path.
    velocity, place = host.at(time_s, 1)[use, :2], host.at(time_s)[use, :2] + host.residual[use, :2]
    place = place - basis @ (basis.T @ place)
    if np.std(place, 0).max() > MOST_BESIDE * host.amplitude_m:
        return None
    return BesideDrive(use, _clipped(place), velocity, basis)


def _beside_path(time_s: Array, host: HostMotion) -> BesideDrive | None:
    """As :func:`_beside_drive`, of a path that no lines describe: splines as coarse as follow it."""
    use = _seen(time_s, host)
    if not host.moves or use is None:
        return None
    place, velocity = host.at(time_s)[use, :2] + host.residual[use, :2], host.at(time_s, 1)[use, :2]
    followed = [_followed(place, _splines(time_s[use], frames)) for frames in KNOT_FRAMES]
    least_m = min(one.noise_m for one in followed)
    coarsest = next(one for one in followed if one.noise_m <= FOLLOWS * least_m)
    return BesideDrive(use, _clipped(coarsest.off_m), velocity, coarsest.basis)


def _followed(place: Array, splines: Array) -> Followed:
    """What ``splines`` (N, Q) follow of the places (N, 2; m) of a path."""
    basis = np.linalg.qr(splines)[0]
    off_m = place - basis @ (basis.T @ place)
    # Over what is left free: more knots explain more of the noise alone.
    spread = [residual_sd(column) for column in off_m.T]
    return Followed(math.hypot(*spread) / math.sqrt(1 - basis.shape[1] / len(place)), off_m, basis)


def _seen(time_s: Array, host: HostMotion) -> NDArray[np.int64] | None:
    """Frames that saw the Host; None of too few."""
    if len(host.residual) != len(time_s):
        return None
    use = np.flatnonzero(np.isfinite(host.residual[:, :2]).all(1))
    return use if len(use) >= FEWEST_FRAMES else None


def _splines(time_s: Array, frames: int) -> Array:
    """Splines (N, Q) with a knot at every so many frames of a path."""
    count = max(len(time_s) // frames, 1)
    knots = np.concatenate(
        [[time_s[0]] * DEGREE, np.quantile(time_s, np.linspace(0, 1, count + 1)), [time_s[-1]] * DEGREE]
    )
    return np.asarray(BSpline.design_matrix(time_s, knots, DEGREE).toarray(), float)


def _clipped(place: Array) -> Array:
    limit = CLIP_SD * np.array([residual_sd(column) for column in place.T])
    return np.asarray(np.clip(place, -limit, limit), float)


def _line_sizes(host: HostMotion) -> Array:
    """Amplitude (m) of each further line, along the axis that it moves most."""
    pairs = host.line_coefficients[:2].reshape(2, -1, 2)
    return np.asarray(np.hypot(pairs[..., 0], pairs[..., 1]).max(0), float)


def _on_time(residual: Array, velocity: Array, share: Array) -> Array:
    """What is left of a path when each part of the run may be late by a time of its own."""
    part = np.floor(share * FREE_PARTS).astype(np.int64)
    slope = np.bincount(part, velocity * residual) / np.maximum(np.bincount(part, velocity**2), 1e-300)
    return np.asarray(residual - slope[part] * velocity, float)
