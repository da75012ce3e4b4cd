"""Impacts that no two separate flights show: chatter before sustained contact, impacts in gaps and at the ends of a run.

Hops of one to four frames leave too few positions for a flight of their own.  The laws found from the well-resolved impacts predict
the whole chain from the last good flight; its start state, the restitution of every impact and the wall's place there are then fitted to all
frames of the chain (maximum a posteriori; the restitutions' prior is the scatter found).  A chain that does not fit is not reported.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.chain_model import COMMON, RECORD, chain_residual
from analysis.flights import WARP_POWERS, FlightFits, start_state, warp_basis
from analysis.identification_fit import RigFit

Array = NDArray[np.float64]

# A hop is followed down to this approach speed; below it the disk counts as settled at the wall.
STOP_M_PER_S = 0.02
# Flights of at least this many frames and this misfit against the usual one stand by themselves.
ANCHOR_FRAMES = 5
ANCHOR_MISFIT = 4.0
# Frames of a flight that a chain takes along at its start and at its end.
FRAMES_BEFORE, FRAMES_AFTER = 24, 16
# Impacts with a restitution of their own; later ones, below 0.05 m/s, share the mean.
MOST_IMPACTS = 16
# Restitution of slow impacts may differ from the mean of all (speed dependence): sd of a common shift.
COMMON_SD = 0.05
LEAST_SCATTER = 0.005
# Misfit per residual, its worst frames left out (wrong points), up to which a chain is believed; below WELL no other path to it is tried.
BELIEVED, WELL = 2.0, 1.25
WORST_SHARE = 0.06
CLIP = 5.0
MOST_RECORDS = 60
# Frames added at a time, by the paths tried one after another.
FRAMES_AT_ONCE = (3, 2, 5)
STEPS = np.concatenate([[1e-7, 1e-7, 1e-5, 1e-5, 1e-5, 1e-3, 1e-7, 1e-4], np.full(MOST_IMPACTS, 1e-4)])


# Impacts of a chain are reported from this approach speed, and where their time is known to a fraction of a frame.
REPORTED_M_PER_S = 0.05
REPORTED_FRAMES = 0.3
# A meeting and a chain's impact are one where they are as near as this (frames); farther apart than AGREE the chain is right.
SAME_FRAMES = 0.7
AGREE_SD, AGREE_FRAMES = 4.0, 0.04
# A meeting this far inside or outside the wall (beyond four of its sd) is no impact on it.
WALL_TOLERANCE_M = 3e-4


@dataclass(frozen=True, eq=False)
class _Evaluated:
    """A chain at unknowns ``theta``: weighted ``residual`` and ``jacobian``, ``cost`` with the prior, its ``records``."""

    theta: Array
    cost: float
    residual: Array
    jacobian: Array
    records: Array
    settled: float


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
    off = np.abs(impacts.of("radius") - rig.wall.wall.distance(impacts.azimuth_rad))
    before, after = impacts.of("normal_before"), impacts.of("normal_after")
    change = before + after
    return (off < WALL_TOLERANCE_M + 4 * impacts.sd("radius")) & (before > 0) & (change > 2 * impacts.sd("normal_before"))



def merge(rig: RigFit, chains: list[Chain], meetings: NDArray[np.bool_]) -> Merged:
    """Chains and meetings told from each other.

    Where both show an impact and agree, the meeting stays (it needs no law); where a chain denies a meeting in its midst, the chain is
    right: it explains all frames, the meeting was fitted to a hop with an impact inside.
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
            else:
                kept[i] = False
        taken += [(chain.run, float(t)) for t in time[show]]
        found.append(replace(chain, records=chain.records[show], covariance=chain.covariance[show], restitution_sd=chain.restitution_sd[show]))
    return Merged(kept, tuple(found), tuple(chains))


def find_chains(rig: RigFit, resolved: NDArray[np.bool_]) -> list[Chain]:
    """Chains of all runs; ``resolved`` (K,) marks the meetings that are impacts beyond doubt."""
    if rig.law is None or not rig.angle or not np.isfinite(rig.law.wall_friction):
        return []
    chains = []
    for number, fits in enumerate(rig.floor.fits):
        for start, first, stop, following in _windows(rig, number, resolved):
            chain = _follow(rig, fits, number, start, first, stop, following)
            if chain is not None:
                chains.append(chain)
    return chains


def _windows(rig: RigFit, number: int, resolved: NDArray[np.bool_]) -> Iterator[tuple[int | None, int, int, int | None]]:
    """(flight to start from, first frame, last frame, next good flight) of every stretch that needs a chain."""
    fits = rig.floor.fits[number]
    data, flights = fits.run, fits.flights
    ratio = fits.misfit / np.maximum(fits.freedom, 1)
    usual = max(rig.floor.scale**2, 0.3)
    seen = np.isfinite(data.xy_m[:, 0])
    anchors = [k for k, f in enumerate(flights) if np.count_nonzero(seen[f.first:f.last + 1]) >= ANCHOR_FRAMES and ratio[k] < ANCHOR_MISFIT * usual]
    if not anchors:
        return
    meetings = rig.wall.impacts.meetings
    met = {int(k) for k in meetings.flight[(meetings.run == number) & resolved]}
    ahead = np.flatnonzero(seen[:flights[anchors[0]].first])
    contact = rig.runs[number].segments.contact
    if len(ahead) >= 2 and not any(a <= ahead[0] <= b for a, b in contact):
        yield None, int(ahead[0]), flights[anchors[0]].first, anchors[0]
    for k, following in zip(anchors, [*anchors[1:], None], strict=True):
        if following == k + 1 and k in met:
            continue
        stop = flights[following].first if following is not None else int(np.flatnonzero(seen)[-1])
        if stop > flights[k].last:
            yield k, max(flights[k].first, flights[k].last - FRAMES_BEFORE), stop, following


def _follow(rig: RigFit, fits: FlightFits, number: int, start: int | None, first: int, stop: int, following: int | None) -> Chain | None:
    data = fits.run
    last = stop if following is None else min(fits.flights[following].last, stop + FRAMES_AFTER)
    t0 = float(data.time_s[first])
    if start is None:
        state = np.empty(6)
        few = np.flatnonzero(np.isfinite(data.xy_m[:stop, 0]))
        end = int(few[few >= first][:3][-1])
        start_state(data.time_s, data.xy_m[:, 0], data.xy_m[:, 1], data.angle_rad, first, end, t0, state)
    else:
        state = fits.propagate(start, np.array([t0]))[0][0]
    fit = _ChainFit(rig, fits, number, first, last, state)
    for end, open_end in ((last, False), (stop - 1, True)):
        best = None
        for frames in FRAMES_AT_ONCE:
            chain = fit.solve(end, open_end, frames)
            if chain is not None and (best is None or chain.misfit < best.misfit):
                best = chain
            if best is not None and best.misfit < WELL:
                break
        if best is not None and best.misfit < BELIEVED:
            return best
    return None


class _ChainFit:
    """The least-squares problem of one chain: constants once, then :meth:`solve`."""

    def __init__(self, rig: RigFit, fits: FlightFits, number: int, first: int, last: int, state: Array) -> None:
        data, wall, law = fits.run, rig.wall.wall, rig.law
        self.fits, self.number, self.state = fits, number, state
        index = np.arange(first, last + 1)
        self.index = index[np.isfinite(data.xy_m[index, 0])]
        self.times = np.ascontiguousarray(data.time_s[self.index])
        self.period = float(np.median(np.diff(data.time_s)))
        self.start_s = float(data.time_s[first])
        lens, n = warp_basis(data.xy_m[self.index], data.contact_radius_m), len(WARP_POWERS)
        off = np.column_stack([lens @ fits.shared[2:2 + n], lens @ fits.shared[2 + n:]])
        self.observed = np.column_stack([data.xy_m[self.index] - off, data.angle_rad[self.index]])
        self.scale = max(rig.floor.scale, 1.0)
        self.sd = np.column_stack([data.xy_sd_m[self.index], data.angle_sd_rad[self.index]]) * self.scale
        self.rig = np.array([wall.contact_radius_m, *wall.centre_m, *wall.disk_m, *wall.ellipse, law.wall_friction, law.tangential_restitution,
                             data.radius_m, data.inertia_factor, data.host.omega_rad_per_s, data.host.phase_rad, STOP_M_PER_S])
        self.mean = law.restitution
        rho = rig.floor.correlation
        self.inflation = (1 + rho) / (1 - rho)
        shift = max(2 * rig.wall.scatter_m, 1e-5)
        self.prior = np.concatenate([np.zeros(6), [1 / shift, 1 / COMMON_SD], np.full(MOST_IMPACTS, 1 / max(law.scatter, LEAST_SCATTER))])

    def evaluate(self, theta: Array, count: int, times: Array | None = None, slopes: bool = True) -> _Evaluated:
        """Residuals of the first ``count`` frames (or records at other ``times``) for unknowns ``theta``."""
        times = self.times[:count] if times is None else times
        n = len(times)
        r, records = np.zeros((n, 3)), np.zeros((MOST_RECORDS, len(RECORD)))
        jacobian = np.zeros((n if slopes else 0, 3, len(theta)))
        padded = np.zeros((max(n, len(self.observed)), 3))
        padded[:len(self.observed)] = self.observed
        sd = np.ones((len(padded), 2))
        sd[:len(self.sd)] = self.sd
        impacts, settled = chain_residual(theta, STEPS, self.mean, self.start_s, times, padded, sd, self.fits.shared[:2], self.fits.parameters,
                                          self.fits.run.host.harmonics, self.rig, jacobian, records, r)
        weight = np.sqrt(np.minimum(1.0, CLIP / np.maximum(np.abs(r), 1e-12)))
        cost = float(np.sum((r * weight) ** 2) + np.sum((self.prior * theta) ** 2))
        flat, w = jacobian.reshape(-1, len(theta)), weight.ravel()
        return _Evaluated(theta, cost, r.ravel() * w, flat * w[:, None] if slopes else flat, records[:impacts], settled)

    def solve(self, last: int, open_end: bool, at_once: int) -> Chain | None:
        """The best chain up to frame ``last``, ``at_once`` frames at a time; None where it has no impact or does not fit.

        Frames are added a few at a time: each impact's restitution is known before the frames that depend on it come in, and the fit does
        not lock onto a chain that is one hop off.
        """
        whole = int(np.searchsorted(self.index, last, side="right"))
        theta = np.concatenate([self.state, np.zeros(2 + MOST_IMPACTS)])
        count = min(whole, 4)
        if whole < 4:
            return None
        here = self.evaluate(theta, count)
        while True:
            here = self._improve(here, count, 12 if count == whole else 2)
            # The frames in sustained contact are no part of the chain.
            limit = int(np.searchsorted(self.times, here.settled + 0.5 * self.period))
            if count >= min(whole, limit):
                whole = min(whole, limit)
                break
            count = min(count + at_once, whole)
            here = self.evaluate(here.theta, count)
        if whole < 4:
            return None
        here = self._improve(self.evaluate(here.theta, whole), whole, 12)
        return self._chain(here, whole, open_end)

    def _improve(self, here: _Evaluated, count: int, rounds: int) -> _Evaluated:
        """Levenberg-Marquardt steps."""
        damping = 1e-4
        for _ in range(rounds):
            normal = here.jacobian.T @ here.jacobian
            right = -here.jacobian.T @ here.residual - self.prior**2 * here.theta
            step = np.linalg.solve(normal + np.diag(damping * np.diag(normal) + self.prior**2 + 1e-12), right)
            there = self.evaluate(here.theta + step, count)
            gained = here.cost - there.cost
            if gained > 0:
                here, damping = there, damping * 0.2
                if gained < 0.02:
                    break
            else:
                damping = max(damping * 10, 1e-3)
                if damping > 1e5 or float(np.sum(step * right)) < 0.02:
                    break
        return here

    def _chain(self, here: _Evaluated, count: int, open_end: bool) -> Chain | None:
        per_frame = np.sort(np.sum(here.residual.reshape(-1, 3) ** 2, 1))[:max(count - int(np.ceil(WORST_SHARE * count)), 1)]
        misfit = float(per_frame.sum() / max(3 * len(per_frame) - 6, 1))
        if len(here.records) == 0 or misfit > BELIEVED or (open_end and not np.isfinite(here.settled)):
            return None
        covariance = np.linalg.pinv(here.jacobian.T @ here.jacobian / self.inflation + np.diag(self.prior**2), hermitian=True)
        n, free = len(here.records), len(here.theta)
        derivative = np.zeros((n, len(RECORD), free))
        times = np.append(self.times[:count], self.times[count - 1] + 4 * self.period)
        for j in range(free):
            h = 0.05 * np.sqrt(covariance[j, j])
            moved = [here.theta.copy(), here.theta.copy()]
            moved[0][j] += h
            moved[1][j] -= h
            up, down = (self.evaluate(theta, 0, times, slopes=False).records for theta in moved)
            m = min(n, len(up), len(down))
            derivative[:m, :, j] = (up[:m] - down[:m]) / (2 * h)
        spread = derivative @ covariance @ derivative.transpose(0, 2, 1)
        deviations = np.sqrt(np.diag(covariance)[COMMON:])
        eps_sd = np.concatenate([deviations, np.full(max(n - len(deviations), 0), 1 / self.prior[-1])])[:n]
        inside = here.records[:, 0] <= self.times[count - 1]
        return Chain(self.number, here.records[inside], spread[inside], eps_sd[inside], misfit, here.settled, int(self.index[0]),
                     int(self.index[count - 1]))
