"""One bounce sequence fitted to its frames: start state, a shift of the wall, and the restitution of every impact
(maximum a posteriori).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.bounces.contact import RECORD, TIME, BounceRig, wall_frequency
from analysis.bounces.model import COMMON, COMMON_RESTITUTION, BounceFrames, bounce_residual
from analysis.bounces.noise import sequence_noise
from analysis.contact.law import tangential_sd
from analysis.contact.restitution import SpeedLaw
from analysis.flights.fit import FlightFits
from analysis.identification.bounce_sequences import BounceSequence
from analysis.identification.fit import RigFit
from analysis.identification.parameters import length_residual

Array = NDArray[np.float64]

# A hop is followed down to this approach speed; below it the disk counts as settled at the wall.
STOP_M_PER_S = 0.02
# Impacts with a restitution of their own; later ones, below 0.05 m/s, share the mean.
MOST_IMPACTS = 16
LEAST_SCATTER = 0.005
# Of a contact that lasts: the law's restitution holds the Host's acceleration meanwhile, and the contact need be no
# spring with a dashpot.
LASTING_SCATTER, LASTING_COMMON_SD = 0.02, 0.05
# Misfit per residual, its worst frames left out (wrong points), up to which a sequence is believed.  Right ones were
# seen at up to 2.1, under a lens residual; with this limit none was wrong on the practice series.
BELIEVED = 2.5
WORST_SHARE = 0.06
CLIP = 5.0
FEWEST_FRAMES = 4
# Hops shorter than this have one or two frames, and minima of their own: other restitutions (this many of the prior's
# sds away) are tried from the one found where the impact is faster than chatter's last hops.
SHORT_HOP_FRAMES, MOVED_SD, SEARCH_ROUNDS, SEARCHED_M_PER_S = 2.5, 2.0, 3, 0.09
# Rounds towards the sequence of the law's own restitutions, and from it.
LAW_ROUNDS = 12
# Minima up to this much worse count too, by their likelihood; two whose restitutions differ by less than this (prior's
# sd) are one.
NEARLY, SAME_SD = 12.0, 0.3
# Frames added at a time, by the paths that are tried.
FRAMES_AT_ONCE = (3, 2)
# Frames at the wall that a sequence takes along: they show where the wall is, against which the last hops are measured.
SETTLED_FRAMES = 2.0
MOST_RECORDS = 60
# Prior sd of the wall's shift at one place: twice what the contact distances scatter, and never below the flight
# model's and the lenses' own errors.
SHIFT_SD, LEAST_SHIFT_M = 2.0, 1e-5
# Levenberg-Marquardt: damping, and the fall of the cost that ends it (a seventh of an sd).
FIRST_DAMPING, LESS_DAMPING, MORE_DAMPING, RAISED_DAMPING, MOST_DAMPING, CONVERGED = 1e-4, 0.2, 10.0, 1e-3, 1e5, 0.02
# Steps of the records' derivatives, in sds of the unknowns: hops end in the same impacts.
STEP_SD = 0.05
STEPS = np.concatenate([[1e-7, 1e-7, 1e-5, 1e-5, 1e-5, 1e-3, 1e-7, 1e-4, 1e-4, 1e-4], np.full(MOST_IMPACTS, 1e-4)])


@dataclass(frozen=True, eq=False)
class _Evaluated:
    """A sequence at unknowns ``theta``, over the first ``count`` frames: weighted ``residual``, its ``weight``,
    ``cost`` with the prior, its ``records``, and when the disk ``settled``.
    """

    theta: Array
    count: int
    cost: float
    residual: Array
    weight: Array
    records: Array
    settled: float


class SequenceFit:
    """The least-squares problem of one sequence: constants once, then :meth:`solve`."""

    def __init__(
        self, rig: RigFit, fits: FlightFits, number: int, first: int, last: int, state: Array, restitution: SpeedLaw
    ) -> None:
        data, wall, law = fits.run, rig.wall.wall, rig.law
        assert law is not None  # find_sequences follows none without a law
        self.fits, self.number, self.state, self.delay_s = fits, number, state, rig.wall.delay_s
        index = np.arange(first, last + 1)
        self.index = index[np.isfinite(data.xy_m[index, 0])]
        self.times = np.ascontiguousarray(data.time_s[self.index])
        self.period = float(np.median(np.diff(data.time_s)))
        self.start_s = float(data.time_s[first])
        self.observed = fits.measured(self.index)
        noise = rig.floor.noise
        self.sd = np.column_stack(
            [noise.scale * data.xy_sd_m[self.index], noise.angle_scale * data.angle_sd_rad[self.index]]
        )
        # What the contact distances scatter from place to place beyond the noise is an error of places along the wall.
        self.noise = sequence_noise(
            self.index,
            self.times,
            data.xy_m[self.index],
            self.sd,
            noise,
            length_residual(rig) * wall.size_m,
            wall.size_m,
        )
        self.rig = BounceRig(
            data.flight_rig,
            fits.parameters,
            surfaces=wall.surfaces,
            disk_x_m=float(wall.disk_m[0]),
            disk_y_m=float(wall.disk_m[1]),
            wall_friction=float(law.wall_friction),
            tangential_restitution=float(law.tangential_restitution),
            stop_speed_m_per_s=STOP_M_PER_S,
            wall_frequency_per_s=wall_frequency(law.restitution, rig.wall.delay_s),
            restitution=float(restitution.at_high),
            restitution_rise=float(restitution.rise),
            restitution_speed_m_per_s=float(restitution.speed_m_per_s),
        )
        shift = max(SHIFT_SD * rig.wall.scatter_m, LEAST_SHIFT_M)
        each = max(restitution.scatter, LASTING_SCATTER if rig.wall.delay_s > 0 else LEAST_SCATTER)
        together = LASTING_COMMON_SD if rig.wall.delay_s > 0 else restitution.slow_sd
        common = 1 / np.array([shift, together, *tangential_sd(rig.data, law)])
        self.prior = np.concatenate([np.zeros(6), common, np.full(MOST_IMPACTS, 1 / each)])

    def evaluate(self, theta: Array, count: int) -> _Evaluated:
        """Whitened residuals of the first ``count`` frames for unknowns ``theta``."""
        r = np.zeros((count, 3))
        none = np.zeros((0, 3, len(theta)))
        records, settled = self._simulated(theta, self.times[:count], self.observed, self.sd, none, r)
        r = self.noise.whitened(r)
        weight = np.sqrt(np.minimum(1.0, CLIP / np.maximum(np.abs(r), 1e-12)))
        # Huber's loss, whose slope the weighted rows have.
        cost = float(np.sum((r * weight) ** 2 * (2.0 - weight**2)) + np.sum((self.prior * theta) ** 2))
        return _Evaluated(theta, count, cost, r.ravel() * weight.ravel(), weight, records, settled)

    def jacobian(self, here: _Evaluated) -> Array:
        """Derivatives (3 count, P) of the weighted residual: a dozen simulations and more, so only where a step goes on
        from there.
        """
        theta, count = here.theta, here.count
        derivative = np.zeros((count, 3, len(theta)))
        self._simulated(theta, self.times[:count], self.observed, self.sd, derivative, np.zeros((count, 3)))
        return np.asarray(self.noise.whitened(derivative).reshape(-1, len(theta)) * here.weight.reshape(-1, 1))

    def _simulated(
        self, theta: Array, times: Array, observed: Array, sd: Array, jacobian: Array, r: Array
    ) -> tuple[Array, float]:
        """Records of the impacts up to the last of ``times``, and when the disk settles; fills ``r`` and, where it has
        rows, ``jacobian``.
        """
        records = np.zeros((MOST_RECORDS, len(RECORD)))
        frames = BounceFrames(self.start_s, times, observed, sd, self.fits.shared[:2])
        impacts, settled = bounce_residual(theta, STEPS, frames, self.rig, jacobian, records, r)
        return records[:impacts], settled

    def solve(self, last: int, open_end: bool) -> BounceSequence | None:
        """The best sequence up to frame ``last``; None where it has no impact or does not fit.

        Frames are added a few at a time: each impact's restitution is known before the frames that depend on it come
        in, and the fit is less likely to lock onto a sequence that is one hop off.  Several such paths are tried."""
        whole = int(np.searchsorted(self.index, last, side="right"))
        if whole < FEWEST_FRAMES:
            return None
        ends = [self._path(whole, at_once) for at_once in FRAMES_AT_ONCE]
        # Paths differ in where the disk settles; they are compared on all frames that any of them explains.
        whole = max(count for _, count in ends)
        if whole < FEWEST_FRAMES:
            return None
        here = min(
            (self._improve(self.evaluate(end.theta, whole), whole, 12) for end, _ in ends), key=lambda one: one.cost
        )
        return self._result(self._searched(here, whole), whole, open_end)

    def _path(self, whole: int, at_once: int) -> tuple[_Evaluated, int]:
        """A sequence grown by ``at_once`` frames at a time, and how many frames it explains: to ``whole`` or a little
        past where it settles.
        """
        theta, count = (
            np.concatenate([self.state, np.zeros(COMMON - len(self.state) + MOST_IMPACTS)]),
            min(whole, FEWEST_FRAMES),
        )
        while True:
            here = self._improve(self.evaluate(theta, count), count, 12 if count == whole else 2)
            limit = int(np.searchsorted(self.times, here.settled + SETTLED_FRAMES * self.period))
            if count >= min(whole, limit):
                return here, min(whole, limit)
            theta, count = here.theta, min(count + at_once, whole)

    def _searched(self, here: _Evaluated, count: int) -> list[_Evaluated]:
        """The best minimum and those beside it that are nearly as good: an impact before a short hop given another
        restitution.
        """
        minima = [here, self._from_the_law(here, count)]
        here = min(minima, key=lambda m: m.cost)
        for number in self._before_short_hops(here, count):
            for step in (-MOVED_SD, MOVED_SD):
                theta = here.theta.copy()
                theta[COMMON + number] += step / self.prior[COMMON + number]
                minima.append(self._improve(self.evaluate(theta, count), count, SEARCH_ROUNDS))
                here = min(here, minima[-1], key=lambda m: m.cost)
        distinct: list[_Evaluated] = []
        for one in sorted(minima, key=lambda m: m.cost):
            if one.cost < here.cost + NEARLY and all(
                np.max(np.abs((one.theta - m.theta) * self.prior)[COMMON:]) > SAME_SD for m in distinct
            ):
                distinct.append(one)
        return distinct

    def _from_the_law(self, here: _Evaluated, count: int) -> _Evaluated:
        """The minimum next to the best sequence of the law's own restitutions."""
        theta = here.theta.copy()
        theta[COMMON_RESTITUTION:] = 0.0
        held = self._improve(self.evaluate(theta, count), count, LAW_ROUNDS, COMMON_RESTITUTION)
        return self._improve(held, count, LAW_ROUNDS)

    def _before_short_hops(self, here: _Evaluated, count: int) -> list[int]:
        """Impacts above the reported speed after which the disk is back within a few frames."""
        time, speed = here.records[:, 0], here.records[:, 1]
        short = np.diff(time) < SHORT_HOP_FRAMES * self.period
        return [
            int(j)
            for j in np.flatnonzero(short & (speed[:-1] > SEARCHED_M_PER_S) & (time[:-1] < self.times[count - 1]))
            if j < MOST_IMPACTS - 1
        ]

    def _improve(self, here: _Evaluated, count: int, rounds: int, free: int | None = None) -> _Evaluated:
        """Levenberg-Marquardt steps, of the first ``free`` unknowns only where it is given."""
        damping, there = FIRST_DAMPING, here
        for number in range(rounds):
            if number == 0 or there is here:
                jacobian = self.jacobian(here)
                normal = jacobian.T @ jacobian
                right = -jacobian.T @ here.residual - self.prior**2 * here.theta
            step, system = np.zeros(len(right)), normal + np.diag(damping * np.diag(normal) + self.prior**2 + 1e-12)
            step[:free] = np.linalg.solve(system[:free, :free], right[:free])
            there = self.evaluate(here.theta + step, count)
            gained = here.cost - there.cost
            if gained > 0:
                here, damping = there, damping * LESS_DAMPING
                if gained < CONVERGED:
                    break
            else:
                damping = max(damping * MORE_DAMPING, RAISED_DAMPING)
                if damping > MOST_DAMPING or float(np.sum(step * right)) < CONVERGED:
                    break
        return here

    def _result(self, minima: list[_Evaluated], count: int, open_end: bool) -> BounceSequence | None:
        """The result: of the best of the ``minima``, and as far as others are as likely, between them."""
        here = minima[0]
        per_frame = np.sort(np.sum(here.residual.reshape(-1, 3) ** 2, 1))[
            : max(count - int(np.ceil(WORST_SHARE * count)), 1)
        ]
        misfit = float(per_frame.sum() / max(3 * len(per_frame) - 6, 1))
        if len(here.records) == 0 or misfit > BELIEVED or (open_end and not np.isfinite(here.settled)):
            return None
        jacobian = self.jacobian(here)
        covariance = np.linalg.pinv(jacobian.T @ jacobian + np.diag(self.prior**2), hermitian=True)
        n, free = len(here.records), len(here.theta)
        derivative = np.zeros((n, len(RECORD), free))
        times = np.append(self.times[:count], self.times[count - 1] + 4 * self.period)
        blank = np.zeros((len(times), 3))
        for j in range(free):
            h = STEP_SD * np.sqrt(covariance[j, j])
            if not h > 0.0:  # known exactly: it makes nothing uncertain
                continue
            moved = [here.theta.copy(), here.theta.copy()]
            moved[0][j] += h
            moved[1][j] -= h
            up, down = (
                self._simulated(theta, times, blank, blank[:, :2] + 1, blank[:0, :, None], blank)[0] for theta in moved
            )
            m = min(n, len(up), len(down))
            derivative[:m, :, j] = (up[:m] - down[:m]) / (2 * h)
        spread = derivative @ covariance @ derivative.transpose(0, 2, 1)
        deviations = np.sqrt(np.diag(covariance)[COMMON:])
        eps_sd = np.concatenate([deviations, np.full(max(n - len(deviations), 0), 1 / self.prior[-1])])[:n]
        records, between = _between(minima)
        # Junctions of two flights come this much later than the touch; so do a sequence's impacts until the tables are
        # made.
        records[:, TIME] += self.delay_s
        inside = here.records[:, TIME] <= self.times[count - 1]
        return BounceSequence(
            self.number,
            records[inside],
            (spread + between)[inside],
            eps_sd[inside],
            misfit,
            here.settled,
            int(self.index[0]),
            int(self.index[count - 1]),
        )


def _between(minima: list[_Evaluated]) -> tuple[Array, Array]:
    """Mean records (K, 9) of sequences weighted by their likelihood, and their covariance (K, 9, 9); an impact that a
    sequence lacks is the best's.
    """
    best = minima[0].records
    weight = np.exp([-0.5 * (one.cost - minima[0].cost) for one in minima])
    every = np.repeat(best[None], len(minima), 0)
    for all_of_it, one in zip(every, minima, strict=True):
        same = min(len(best), len(one.records))
        all_of_it[:same] = one.records[:same]
    mean = np.average(every, axis=0, weights=weight)
    off = every - mean
    return mean, np.einsum("m,mki,mkj->kij", weight / weight.sum(), off, off)
