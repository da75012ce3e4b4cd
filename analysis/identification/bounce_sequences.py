"""Bounce sequences as results: what each holds, and which of its impacts are those of flight junctions."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.bounces.contact import RECORD
from analysis.identification.fit import RigFit

Array = NDArray[np.float64]

# Impacts of a sequence are reported from this approach speed, and where their time is known to a fraction of a frame.
REPORTED_M_PER_S = 0.05
REPORTED_FRAMES = 0.3
# A junction and a sequence's impact are one where they are as near as this (frames); farther apart than AGREE the
# sequence is right.
SAME_FRAMES = 0.7
AGREE_SD, AGREE_FRAMES = 4.0, 0.04
# A junction this far inside or outside the wall (beyond four of its sd) is no impact on it.
WALL_TOLERANCE_M = 3e-4


@dataclass(frozen=True, eq=False)
class BounceSequence:
    """One fitted sequence of a run: ``records`` (K, 9) of :data:`RECORD`, their ``covariance`` (K, 9, 9), prior and
    posterior sd of the restitutions, ``misfit`` per residual, ``settled_s`` (inf: never), first and last frame that it
    explains."""

    run: int
    records: Array
    covariance: Array
    restitution_sd: Array
    misfit: float
    settled_s: float
    first: int
    last: int

    def of(self, name: str) -> Array:
        """One quantity of :data:`RECORD`, (K,)."""
        return self.records[:, RECORD.index(name)]

    def sd(self, name: str) -> Array:
        """Its standard deviation, (K,)."""
        i = RECORD.index(name)
        return np.sqrt(self.covariance[:, i, i])


@dataclass(frozen=True, eq=False)
class Merged:
    """Every impact once: ``junctions`` (K,) mask of those that two flights show, ``sequences`` with the impacts that
    only they show; ``whole`` sequences as fitted.
    """

    junctions: NDArray[np.bool_]
    sequences: tuple[BounceSequence, ...]
    whole: tuple[BounceSequence, ...]

    def chatter(self, run: int) -> list[tuple[float, float]]:
        """From the first to the last impact that only sequences show, per sequence of more than one (s); to where the
        disk settled.
        """
        spans = []
        for sequence, full in zip(self.sequences, self.whole, strict=True):
            if (
                sequence.run == run
                and len(sequence.records)
                and (len(sequence.records) > 1 or np.isfinite(full.settled_s))
            ):
                end = full.settled_s if np.isfinite(full.settled_s) else float(full.of("time")[-1])
                spans.append((float(sequence.of("time")[0]), end))
        return spans


def accepted(rig: RigFit) -> NDArray[np.bool_]:
    """Which junctions of two flights are impacts on the wall: at one of its surfaces, coming in, not going further
    in.
    """
    impacts = rig.wall.impacts
    past = rig.wall.delay_s * np.maximum(impacts.of("normal_before"), 0.0)
    off = np.abs(impacts.of("gap") - past)
    before, after = impacts.of("normal_before"), impacts.of("normal_after")
    change = before + after
    return (off < WALL_TOLERANCE_M + 4 * impacts.sd("gap")) & (before > 0) & (change > 2 * impacts.sd("normal_before"))


def merge(rig: RigFit, sequences: list[BounceSequence], junctions: NDArray[np.bool_]) -> Merged:
    """Every impact once, from bounce sequences and flight junctions.

    Where both show an impact and agree, the junction stays (it needs no law); where a sequence denies a junction in its
    midst, the sequence is right: it explains all frames, the junction was fitted to a hop with an impact inside.  A
    junction at a sequence's first frame is where its first flight begins: no sequence from there on can show it.
    """
    kept = junctions.copy()
    found, others = [], rig.wall.impacts
    taken: list[tuple[int, float]] = []
    for sequence in sequences:
        data = rig.runs[sequence.run].data
        period = float(np.median(np.diff(data.time_s)))
        time, sd = sequence.of("time"), sequence.sd("time")
        show = (sequence.of("normal_before") > REPORTED_M_PER_S) & (sd < REPORTED_FRAMES * period)
        show &= np.array(
            [all(run != sequence.run or abs(t - other) > SAME_FRAMES * period for run, other in taken) for t in time],
            bool,
        )
        first_s, last_s = data.time_s[sequence.first], data.time_s[sequence.last]
        # An impact within a sequence's last frame may come out just after it as a junction: the same one, all the same.
        beside = np.flatnonzero(
            kept
            & (others.junctions.run == sequence.run)
            & (others.of("time") > first_s)
            & (others.of("time") < last_s + SAME_FRAMES * period)
        )
        for i in beside:
            near = np.abs(time - others.of("time")[i])
            j = int(np.argmin(near)) if len(near) else -1
            if (
                j >= 0
                and near[j] < max(AGREE_SD * np.hypot(sd[j], others.sd("time")[i]), AGREE_FRAMES * period)
                and near[j] < SAME_FRAMES * period
            ):
                show[j] = False
            elif first_s + 0.5 * period < others.of("time")[i] < last_s:
                kept[i] = False
        taken += [(sequence.run, float(t)) for t in time[show]]
        found.append(
            replace(
                sequence,
                records=sequence.records[show],
                covariance=sequence.covariance[show],
                restitution_sd=sequence.restitution_sd[show],
            )
        )
    return Merged(kept, tuple(found), tuple(sequences))
