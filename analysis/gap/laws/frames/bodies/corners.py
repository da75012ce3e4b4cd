"""Corners of a disk's path: blows between two flights, and the ways before and behind each, which say where the frames
about it should lie."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.flights.cutting.runs import Run
from analysis.gap.measurement.loose_markers import angle_at

Array = NDArray[np.float64]
# Each way is a parabola (a flight's friction bends it) through so many frames, no nearer to the blow than what places
# may hold; fewer do not tell its slope there.
OF_WAY, FEWEST, DEGREE = 9, 6, 2
# Two ways meet within so many frames of those that part the flights.
MEET = 1.5
# Rounds in which it is found when.
MEETINGS = 3


class Straight(NamedTuple):
    """A way as polynomials of x, y and angle (DEGREE + 1, 3) over frames, and what they make of a power more (DEGREE +
    1, 1)."""

    pose: Array
    power: Array


class Corner(NamedTuple):
    """A blow: the ``frames`` (K,) about it, how many frames ``after`` it (K,) each of them is, the ways ``before`` and
    ``behind`` it over the frames from frame ``origin`` on, and what the velocity changes by (2,; m per frame)."""

    frames: NDArray[np.int64]
    after: Array
    before: Straight
    behind: Straight
    origin: int
    jump_m: Array

    def way(self, frames: Array) -> Array:
        """Pose (K, 3; m, rad) at ``frames`` (K,), whole or not, by the way that each is on."""
        time = frames - self.origin
        before, behind = _at(self.before.pose, time), _at(self.behind.pose, time)
        blow = self.frames[0] - self.origin - self.after[0]
        return np.where(time[:, None] < blow, before, behind)

    def bends(self) -> Array:
        """How far (K, 2) a power more takes the way before the blow, and that behind it, away from what is fitted to
        it."""
        time = (self.frames - self.origin).astype(float)
        away = [time ** (DEGREE + 1) - _at(way.power, time)[:, 0] for way in (self.before, self.behind)]
        return np.column_stack([away[0] * (self.after < 0), away[1] * (self.after >= 0)])


def seen_poses(run: Run, motion: pd.DataFrame) -> Array:
    """Pose (N, 3; m, rad) of the disk in the frames of a run, by its ``motion``: those about blows, too, that flights
    leave out; NaN where it was not seen."""
    return np.column_stack([motion[["nes_x_m", "nes_y_m"]].to_numpy(float), angle_at(run.data)])


def corners_of(run: Run, pose: Array, reach: int) -> list[Corner]:
    """Blows of a run between two flights that are long enough to tell where they would meet, by frames that hold
    nothing of what is more than ``reach`` frames away."""
    seen = np.asarray(np.isfinite(pose).all(1), bool)
    found = []
    for one, other in zip(run.flights[:-1], run.flights[1:], strict=True):
        # What cuts a corner may pass for a contact that lasts: flights are not always joined.
        if one.goes_on or other.first - one.last > 2 * reach:
            continue
        first = max(one.first + reach, one.last - reach - OF_WAY)
        last = min(other.last - reach, other.first + reach + OF_WAY)
        before = _fitted(pose, seen, np.arange(first + 1, one.last - reach), one.last)
        behind = _fitted(pose, seen, np.arange(other.first + reach + 1, last), one.last)
        near = np.arange(max(one.last - reach, 0), min(other.first + reach + 1, len(pose)))
        if before is None or behind is None:
            continue
        corner = _met(before, behind, one.last, other.first, near)
        if corner is not None:
            found.append(corner)
    return found


def _fitted(pose: Array, seen: NDArray[np.bool_], frames: NDArray[np.int64], origin: int) -> Straight | None:
    """The way in ``frames`` as far as they were ``seen``; None where too few were."""
    frames = frames[seen[frames]]
    if len(frames) < FEWEST:
        return None
    time = (frames - origin).astype(float)
    seen_there = np.column_stack([pose[frames], time ** (DEGREE + 1)])
    fitted = np.asarray(np.linalg.lstsq(np.vander(time, DEGREE + 1), seen_there, rcond=None)[0], float)
    return Straight(fitted[:, :3], fitted[:, 3:])


def _met(before: Straight, behind: Straight, last: int, first: int, near: NDArray[np.int64]) -> Corner | None:
    """The blow where two ways come nearest along what the velocity changes by, from frame ``last`` of one to ``first``
    of the other; None where they do not."""
    apart, middle = np.asarray(behind.pose - before.pose, float)[:, :2], 0.5 * (first - last)
    time, slope = middle, apart[1]
    for _ in range(MEETINGS):
        slope = np.asarray(2 * time * apart[0] + apart[1], float)
        square = float(slope @ slope)
        if square == 0:
            return None
        time -= float(_at(apart, np.array([time]))[0] @ slope) / square
    if abs(time - middle) > middle + MEET:
        return None
    return Corner(near, np.asarray(near - last - time, float), before, behind, last, slope)


def _at(polynomial: Array, time: Array) -> Array:
    return np.asarray(np.vander(time, DEGREE + 1) @ polynomial, float)
