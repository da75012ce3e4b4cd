"""A series without what its places hold of the frames beside them.

About a blow the two ways that meet there say what each frame holds.  Elsewhere the places that are seen do, as they
are: beside a flight too short to tell its way, a corner that a filter has cut is sharp again in part only."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from analysis.flights.cutting.run_data import RunData
from analysis.flights.cutting.runs import Run
from analysis.gap.laws.frames.bodies.corners import corners_of, seen_poses
from analysis.gap.laws.frames.bodies.moved_back import Way, all_moved_back, at_frames
from analysis.gap.laws.frames.evidence.known import known_frames
from analysis.gap.laws.frames.evidence.rows import size_of
from analysis.gap.series import Series
from ovines.core.laws.terms import Term

Array = NDArray[np.float64]
#: frames to either side of one that a place may hold something of: few, which short flights tell, too, and many
REACHES = 3, 6


def reach_of(terms: Sequence[Term], period_s: float) -> int:
    """Frames to the farthest of which places hold something."""
    return max(round(abs(term.x) / period_s) for term in terms)


def frames_about(terms: Sequence[Term], period_s: float) -> int:
    """Frames about a blow that the ways must leave out for what ``terms`` hold."""
    return max(REACHES[0], reach_of(terms, period_s))


def without_neighbours(series: Series, terms: Sequence[Term]) -> Series:
    """``series`` with the points of Host and NES back from what ``terms`` say that they hold of the frames beside them,
    and their pixels alike; `InputError` where there are no markers."""
    ahead_s = np.array([term.x for term in terms])
    reach = frames_about(terms, series.period_s)

    def ways(run: Run) -> Iterator[tuple[str, Way]]:
        data = run.data
        size = size_of(terms, known_frames(data.time_s, data, run.flights))
        pose = seen_poses(run, series.motions[data.number])
        yield from moved("nes", size, partial(_sharp, run, pose, reach), data)
        # What goes with the disk's gap is nothing of the Host.
        yield from moved("host", size * [not term.factors for term in terms], partial(_of_host, data), data)

    def moved(body: str, shares: Array, path: Way, data: RunData) -> Iterator[tuple[str, Way]]:
        assert series.layouts is not None
        # Of each frame and those beside it, as late as what places hold makes what is seen.
        true_s = data.time_s - shares @ ahead_s
        poses = [path(true_s + later_s) for later_s in (0.0, *ahead_s)]
        for marker, place in zip(series.recordings[0].bodies[body].markers, series.layouts[body], strict=True):
            here, *beside = (_of_marker(pose, place) for pose in poses)
            steps_m = np.stack([there - here for there in beside], 1)
            yield marker, partial(at_frames, np.nan_to_num(np.sum(shares[:, :, None] * steps_m, 1)), data)

    return all_moved_back(series, "a law of every marker", ways)


def _of_marker(pose: Array, place: Array) -> Array:
    """Places (N, 2; m) of a marker that stands at ``place`` on a body whose ``pose`` (N, 3) is given."""
    c, s = np.cos(pose[:, 2]), np.sin(pose[:, 2])
    return np.asarray(pose[:, :2] + np.column_stack([c * place[0] - s * place[1], s * place[0] + c * place[1]]), float)


def _of_host(data: RunData, time_s: Array) -> Array:
    """Pose (N, 3) of the Host at times."""
    return np.asarray(data.host.at(time_s)[:, [0, 1, 3]], float)


def _sharp(run: Run, pose: Array, reach: int, time_s: Array) -> Array:
    """Pose (N, 3) of the disk at times (N,; s), ``pose`` in the frames: up to ``reach`` frames about blows as the two
    ways have it, which no frame beside blurs; NaN before and after all that was seen."""
    data = run.data
    seen = np.isfinite(pose).all(1)
    if not seen.any():
        return np.full((len(time_s), 3), np.nan)
    at = data.time_s[seen]
    out = np.column_stack([np.interp(time_s, at, column[seen]) for column in pose.T])
    out[(time_s < at[0]) | (time_s > at[-1])] = np.nan
    frames = np.interp(time_s, data.time_s, np.arange(len(data.time_s)))
    for corner in corners_of(run, pose, reach):
        own = (frames >= corner.frames[0]) & (frames <= corner.frames[-1])
        out[own] = corner.way(frames[own])
    return out
