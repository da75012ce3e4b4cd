"""Chains of impacts as results: what each holds, and how they and the meetings of two flights are told from each other."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.chain_contact import RECORD
from analysis.identification_fit import RigFit

Array = NDArray[np.float64]

# Impacts of a chain are reported from this approach speed, and where their time is known to a fraction of a frame.
REPORTED_M_PER_S = 0.05
REPORTED_FRAMES = 0.3
# A meeting and a chain's impact are one where they are as near as this (frames); farther apart than AGREE the chain is right.
SAME_FRAMES = 0.7
AGREE_SD, AGREE_FRAMES = 4.0, 0.04
# A meeting this far inside or outside the wall (beyond four of its sd) is no impact on it.
WALL_TOLERANCE_M = 3e-4


@dataclass(frozen=True, eq=False)
class Chain:
    """One fitted chain of a run: ``records`` (K, 8) of :data:`RECORD`, their ``covariance`` (K, 8, 8), prior and posterior sd of the
    restitutions, ``misfit`` per residual, ``settled_s`` (inf: never), first and last frame that it explains."""

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
    """Every impact once: ``meetings`` (K,) mask of those that two flights show, ``chains`` with the impacts that only they show;
    ``whole`` chains as fitted."""

    meetings: NDArray[np.bool_]
    chains: tuple[Chain, ...]
    whole: tuple[Chain, ...]

    def chatter(self, run: int) -> list[tuple[float, float]]:
        """From the first to the last impact that only chains show, per chain of more than one (s); to where the disk settled."""
        spans = []
        for chain, full in zip(self.chains, self.whole, strict=True):
            if chain.run == run and len(chain.records) and (len(chain.records) > 1 or np.isfinite(full.settled_s)):
                end = full.settled_s if np.isfinite(full.settled_s) else float(full.of("time")[-1])
                spans.append((float(chain.of("time")[0]), end))
        return spans


def accepted(rig: RigFit) -> NDArray[np.bool_]:
    """Which meetings of two flights are impacts on the wall: on its circle, coming in, not going further in."""
    impacts = rig.wall.impacts
    past = rig.wall.delay_s * np.maximum(impacts.of("normal_before"), 0.0)
    off = np.abs(impacts.of("radius") - past - rig.wall.wall.distance(impacts.azimuth_rad))
    before, after = impacts.of("normal_before"), impacts.of("normal_after")
    change = before + after
    return (off < WALL_TOLERANCE_M + 4 * impacts.sd("radius")) & (before > 0) & (change > 2 * impacts.sd("normal_before"))


def merge(rig: RigFit, chains: list[Chain], meetings: NDArray[np.bool_]) -> Merged:
    """Chains and meetings told from each other.

    Where both show an impact and agree, the meeting stays (it needs no law); where a chain denies a meeting in its midst, the chain is
    right: it explains all frames, the meeting was fitted to a hop with an impact inside.  A meeting at a chain's first frame is where its
    first flight begins: no chain from there on can show it.
    """
    kept = meetings.copy()
    found, others = [], rig.wall.impacts
    taken: list[tuple[int, float]] = []
    for chain in chains:
        data = rig.runs[chain.run].data
        period = float(np.median(np.diff(data.time_s)))
        time, sd = chain.of("time"), chain.sd("time")
        show = (chain.of("normal_before") > REPORTED_M_PER_S) & (sd < REPORTED_FRAMES * period)
        show &= np.array([all(run != chain.run or abs(t - other) > SAME_FRAMES * period for run, other in taken) for t in time], bool)
        inside = np.flatnonzero(kept & (others.meetings.run == chain.run) & (others.of("time") > data.time_s[chain.first])
                                & (others.of("time") < data.time_s[chain.last]))
        for i in inside:
            near = np.abs(time - others.of("time")[i])
            j = int(np.argmin(near)) if len(near) else -1
            if j >= 0 and near[j] < max(AGREE_SD * np.hypot(sd[j], others.sd("time")[i]), AGREE_FRAMES * period) and near[j] < SAME_FRAMES * period:
                show[j] = False
            elif others.of("time")[i] > data.time_s[chain.first] + 0.5 * period:
                kept[i] = False
        taken += [(chain.run, float(t)) for t in time[show]]
        found.append(replace(chain, records=chain.records[show], covariance=chain.covariance[show], restitution_sd=chain.restitution_sd[show]))
    return Merged(kept, tuple(found), tuple(chains))
