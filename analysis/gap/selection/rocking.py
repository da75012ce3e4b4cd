"""A disk that rocks after an impact: how much its friction changes at first, and how soon that dies out.

The flights' own term dies out within :data:`analysis.flights.model.SETTLING_S`; it says whether the friction follows
the time since the impact.  How long it does, the residuals of the flights without it tell: for each decay the change of
friction is integrated twice along every flight, and the decay that takes most of the residuals is kept.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from analysis.flights.evidence import impact_before
from analysis.flights.fit import FlightFits
from analysis.flights.model import SETTLING_S, acceleration
from analysis.flights.parameters import INDEX
from analysis.gap.selection.flight_candidates import FlightFit

Array = NDArray[np.float64]
# Decays tried (s): from about a frame to a flight.
DECAYS_S = np.geomspace(2e-3, 0.15, 30)
FEWEST_FRAMES = 8
# Frames farther off than this (sd) are wrong tracks.
CUT_SD = 6.0
# Relative to the sd of a decay that the curvature gives: the law of the flight is linearised.
STEP = 0.1


@dataclass(frozen=True)
class Rocking:
    """Friction times ``1 + relative exp(-s / decay_s)`` at s after an impact, with sds."""

    relative: float
    relative_sd: float
    decay_s: float
    decay_sd_s: float


def share_at_settling(decay_s: float) -> float:
    """Which multiple of ``exp(-s / SETTLING_S)`` is nearest to ``exp(-s / decay_s)``, over all s > 0: what the flights'
    term makes of a rocking of another decay."""
    return 2 * decay_s / (decay_s + SETTLING_S)


def rocking(without: FlightFit) -> Rocking | None:
    """The rocking that flights fitted ``without`` it show; None where no flight follows an impact."""
    parts = [part for fits in without.fits for part in _flights(fits)]
    if not parts:
        return None

    def solved(decay_s: float) -> tuple[float, Array, Array]:
        normal, right = np.zeros((2, 2)), np.zeros(2)
        for since, pushed, residual, weight in parts:
            changes = np.stack([np.ones_like(since), np.exp(-since / decay_s)], -1)
            columns = np.stack([_bent(since, pushed * changes[:, k : k + 1]) for k in range(2)], -1)
            normal += np.einsum("nai,naj,n->ij", columns, columns, weight)
            right += np.einsum("nai,na,n->i", columns, residual, weight)
        covariance: Array = np.asarray(np.linalg.pinv(normal, hermitian=True), float)
        estimate = covariance @ right
        return float(right @ estimate), estimate, covariance

    gains = [solved(float(decay))[0] for decay in DECAYS_S]
    k = int(np.clip(np.argmax(gains), 1, len(DECAYS_S) - 2))
    # The top of a parabola through the best and its neighbours, in the logarithm.
    low, top, high = gains[k - 1 : k + 2]
    bend = low - 2 * top + high
    step = float(np.log(DECAYS_S[1] / DECAYS_S[0]))
    shift = float(np.clip(0.5 * (low - high) / bend, -1, 1)) if bend < 0 else 0.0
    decay = float(DECAYS_S[k] * np.exp(shift * step))
    _, (friction, change), covariance = solved(decay)
    excess = max(without.misfit / max(without.count, 1), 1.0)
    decay_sd = decay * step * float(np.sqrt(2 * excess / -bend)) if bend < 0 else decay
    # Both were told as shares of the friction that the fit without rocking has: it changes along.
    relative, fixed = change / (1 + friction), float(np.sqrt(excess * covariance[1, 1]))
    sides = [solved(decay + s * min(decay_sd, 0.5 * decay))[1] for s in (-1, 1)]
    moved = 0.5 * float(abs(sides[1][1] - sides[0][1]))
    return Rocking(float(relative), float(np.hypot(fixed, moved)), decay, decay_sd)


def _flights(fits: FlightFits) -> list[tuple[Array, Array, Array, Array]]:
    """Of flights that follow an impact: time since it (N,), acceleration by the floor's friction (N, 2), residual of x,
    y without a uniform motion (N, 2) and the weight (N,) of a frame."""
    out = []
    data, p = fits.run, fits.parameters.copy()
    still = p.copy()
    still[INDEX["friction"]] = 0.0
    for k, flight in enumerate(fits.flights):
        before = impact_before(fits, k)
        i = np.arange(flight.first, flight.last + 1)
        i = i[np.isfinite(data.xy_m[i, 0])]
        if len(i) < FEWEST_FRAMES or not np.isfinite(before) or before < data.start_s:
            continue
        t = data.time_s[i]
        states, _ = fits.propagate(k, t)
        rig = data.flight_rig
        with_floor = np.array([acceleration(a, s, p, rig)[:2] for a, s in zip(t, states, strict=True)])
        without = np.array([acceleration(a, s, still, rig)[:2] for a, s in zip(t, states, strict=True)])
        c, s = np.cos(states[:, 2]), np.sin(states[:, 2])
        ox, oy = fits.shared[:2]
        seen = states[:, :2] + np.column_stack([c * ox - s * oy, s * ox + c * oy])
        sd = data.xy_sd_m[i]
        residual = np.clip(data.xy_m[i] - seen, -CUT_SD * sd[:, None], CUT_SD * sd[:, None])
        out.append((t - before, with_floor - without, _straightened(t, residual), 1 / sd**2))
    return out


def _bent(time_s: Array, push: Array) -> Array:
    """What an acceleration (N, 2) does to a flight's places beside a uniform motion."""
    return _straightened(time_s, CubicSpline(time_s, push).antiderivative(2)(time_s))


def _straightened(time_s: Array, places: Array) -> Array:
    line = np.column_stack([np.ones_like(time_s), time_s - time_s.mean()])
    q, _ = np.linalg.qr(line)
    return np.asarray(places - q @ (q.T @ places))
