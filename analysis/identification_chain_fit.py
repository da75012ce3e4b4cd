"""One chain of hops fitted to its frames: start state, a shift of the wall, and the restitution of every impact (maximum a posteriori)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.chain_model import COMMON, RECORD, chain_residual
from analysis.flights import WARP_POWERS, FlightFits, warp_basis
from analysis.identification_chains import Chain
from analysis.identification_fit import RigFit

Array = NDArray[np.float64]

# A hop is followed down to this approach speed; below it the disk counts as settled at the wall.
STOP_M_PER_S = 0.02
# Impacts with a restitution of their own; later ones, below 0.05 m/s, share the mean.
MOST_IMPACTS = 16
# Restitution of slow impacts may differ from the mean of all (speed dependence): sd of a common shift.
COMMON_SD = 0.05
LEAST_SCATTER = 0.005
# Of a contact that lasts, taken as an instant: the Host's acceleration meanwhile changes a slow impact's restitution by this much.
LASTING_SCATTER = 0.05
# Misfit per residual, its worst frames left out (wrong points), up to which a chain is believed.  Right ones were seen
# at up to 2.1, under a lens residual; with this limit none was wrong on the practice series.
BELIEVED = 2.5
WORST_SHARE = 0.06
CLIP = 5.0
MOST_RECORDS = 60
STEPS = np.concatenate([[1e-7, 1e-7, 1e-5, 1e-5, 1e-5, 1e-3, 1e-7, 1e-4], np.full(MOST_IMPACTS, 1e-4)])


@dataclass(frozen=True, eq=False)
class _Evaluated:
    """A chain at unknowns ``theta``: weighted ``residual`` and ``jacobian``, ``cost`` with the prior, its ``records``."""

    theta: Array
    cost: float
    residual: Array
    jacobian: Array
    records: Array
    settled: float


class ChainFit:
    """The least-squares problem of one chain: constants once, then :meth:`solve`."""

    def __init__(self, rig: RigFit, fits: FlightFits, number: int, first: int, last: int, state: Array) -> None:
        data, wall, law = fits.run, rig.wall.wall, rig.law
        assert law is not None  # find_chains follows none without a law
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
                             data.radius_m, data.inertia_factor, data.host.omega_rad_per_s, data.host.phase_rad, STOP_M_PER_S,
                             rig.wall.delay_s])
        self.mean = law.restitution
        rho = rig.floor.correlation
        self.inflation = (1 + rho) / (1 - rho)
        shift = max(2 * rig.wall.scatter_m, 1e-5)
        each = max(law.scatter, LASTING_SCATTER if rig.wall.delay_s > 0 else LEAST_SCATTER)
        self.prior = np.concatenate([np.zeros(6), [1 / shift, 1 / COMMON_SD], np.full(MOST_IMPACTS, 1 / each)])

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
