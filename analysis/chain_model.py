"""A chain of flights and impacts, simulated through: what chattering against the wall must look like if the laws found hold.

Flight model, wall and contact law are those of the identification; the start state, a shift of the wall at this place, and the restitution of
each impact are arguments, so that they can be fitted to the frames.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.chain_contact import contact_view, squeeze, stay, strike, touch
from analysis.compiled import compiled
from analysis.flight_model import LONGEST_STEP_S, advance, strongest_acceleration

Array = NDArray[np.float64]
# Steps of a disk that stays at the wall, whose friction acts all along.
SETTLED_STEP_S = 2e-4
# Steps of a contact that lasts, in 1/frequency: half a period in twelve (its restitution to 5e-4, of a strongly damped one to 5e-3).
CONTACT_STEP = np.pi / 12
# A contact that goes on for this many half periods has caught the disk.
CAUGHT_HALF_PERIODS = 3.0


@compiled
def _step(y: Array, t: float, h: float, p: Array, harmonics: Array, rig: Array, k: Array, trial: Array, host: Array, a: Array, out: Array) -> None:
    strongest = strongest_acceleration(p, harmonics, rig[11])
    advance(y, t, h, p, harmonics, rig[11], rig[9], rig[10], rig[0], rig[12], strongest, k, trial, host, a, out)


@compiled
def _look(y: Array, t: float, view: Array, rig: Array, shift: float, p: Array, harmonics: Array, host: Array, later: Array, k: Array, trial: Array,
          a: Array, probe: Array) -> float:
    """The disk leaves the wall at t: ``view`` there, and the longest step.  The hop lasts 2 v / a, a step covers a quarter of it at most."""
    contact_view(y, t, harmonics, rig, shift, host, view)
    leaving = -view[1]
    view[0] = 0.0
    _step(y, t, 1e-5, p, harmonics, rig, k, trial, host, a, probe)
    contact_view(probe, t + 1e-5, harmonics, rig, shift, host, later)
    back = (later[1] - view[1]) / 1e-5
    return min(LONGEST_STEP_S, max(0.5 * leaving / back, 2e-6)) if back > 0 else LONGEST_STEP_S


@compiled
def _press(y: Array, t: float, h: float, caught: bool, view: Array, press: Array, shift: float, p: Array, harmonics: Array, rig: Array, host: Array,
           k: Array, trial: Array, a: Array, moved: Array) -> None:
    """``y`` and ``view`` a step h later within a contact that lasts: half a free step, the wall's impulse, half a free step (Strang)."""
    _step(y, t, 0.5 * h, p, harmonics, rig, k, trial, host, a, moved)
    contact_view(moved, t + 0.5 * h, harmonics, rig, shift, host, view)
    squeeze(moved, view, rig, h, caught, press)
    _step(moved, t + 0.5 * h, 0.5 * h, p, harmonics, rig, k, trial, host, a, y)
    contact_view(y, t + h, harmonics, rig, shift, host, view)


@compiled
def _arrival(y: Array, t: float, h: float, view: Array, later: Array, shift: float, p: Array, harmonics: Array, rig: Array, host: Array, k: Array,
             trial: Array, a: Array, probe: Array) -> float:
    """Time after t, within h, at which the disk reaches the wall; ``probe`` is the state and ``later`` the view there.

    ``later`` at the start is the view at t + h."""
    low, high, middle = 0.0, h, h
    for _ in range(60):
        # Newton's step from the far side where it falls inside, else bisection.
        middle = high - later[0] / later[1] if later[1] > 0 else 0.5 * (low + high)
        if middle <= low or middle >= high:
            middle = 0.5 * (low + high)
        _step(y, t, middle, p, harmonics, rig, k, trial, host, a, probe)
        contact_view(probe, t + middle, harmonics, rig, shift, host, later)
        if abs(later[0]) < 1e-12 or high - low < 1e-13:
            break
        if later[0] > 0 and later[1] > 0:
            high = middle
        else:
            low = middle
            _step(y, t, high, p, harmonics, rig, k, trial, host, a, probe)
            contact_view(probe, t + high, harmonics, rig, shift, host, later)
    return middle


@compiled
def simulate_chain(start: Array, t0: float, at_impact: bool, times: Array, shift: float, deviation: Array, p: Array, harmonics: Array,
                   rig: Array, out: Array, records: Array, befores: Array) -> tuple[int, float]:
    """States (len(times), 6) at the sorted ``times`` >= t0, and ``records`` (K, 8) of the impacts up to the last of them.

    ``deviation`` (K,) of the impacts' restitution from the law's, in order; after K impacts, or when one comes in slower than rig's stop
    speed, the disk slides or rolls along the wall; a contact that lasts (rig's wall frequency) keeps a disk that is too slow to leave.
    ``at_impact``: the start is the state just before the first impact.  ``befores`` (K, 6) takes the states just before each
    impact.  Returns the number of impacts and the time at which the disk settled (inf when it never did).
    """
    host, a, view, later = np.empty(9), np.empty(4), np.empty(5), np.empty(5)
    k, trial, moved, probe = np.empty((4, 6)), np.empty(6), np.empty(6), np.empty(6)
    y, t, impacts, settled = start.copy(), t0, 0, np.inf
    lasts, pressed, press, longest = rig[14] > 0, False, np.zeros(3), LONGEST_STEP_S
    contact_view(y, t, harmonics, rig, shift, host, view)
    arrived = at_impact
    for i in range(len(times)):
        while arrived or t < times[i] - 1e-12:
            if arrived:
                arrived = False
                if impacts >= len(deviation) or (view[1] < rig[13] and not lasts and not (at_impact and impacts == 0)):
                    settled = t
                    continue
                befores[impacts] = y
                if lasts:
                    touch(y, view, rig, deviation[impacts], records[impacts], t, press)
                    pressed = True
                else:
                    strike(y, view, rig, deviation[impacts], records[impacts], t)
                    longest = _look(y, t, view, rig, shift, p, harmonics, host, later, k, trial, a, probe)
                impacts += 1
                continue
            if pressed:
                h = min(CONTACT_STEP / rig[14], times[i] - t)
                _press(y, t, h, settled < np.inf, view, press, shift, p, harmonics, rig, host, k, trial, a, moved)
                t += h
                if view[0] <= 0 and view[1] < 0:
                    pressed, settled = False, np.inf
                    records[impacts - 1, 2], records[impacts - 1, 4], records[impacts - 1, 6] = -view[1], view[2], y[5]
                    longest = _look(y, t, view, rig, shift, p, harmonics, host, later, k, trial, a, probe)
                elif settled == np.inf and t - press[2] > CAUGHT_HALF_PERIODS * np.pi / rig[14]:
                    settled = press[2]
                continue
            h = min(longest if settled == np.inf else SETTLED_STEP_S, times[i] - t)
            _step(y, t, h, p, harmonics, rig, k, trial, host, a, moved)
            contact_view(moved, t + h, harmonics, rig, shift, host, later)
            if settled < np.inf:
                stay(moved, view, later, rig, h)
                y[:] = moved
                t += h
                contact_view(y, t, harmonics, rig, shift, host, view)
            elif later[0] > 0 and later[1] > 0 and (view[0] <= 0 or view[1] <= 0):
                t += _arrival(y, t, h, view, later, shift, p, harmonics, rig, host, k, trial, a, probe)
                y[:] = probe
                view[:] = later
                arrived = True
            else:
                if view[1] <= 0 < later[1] and h < LONGEST_STEP_S:
                    longest = LONGEST_STEP_S
                y[:] = moved
                t += h
                view[:] = later
        out[i] = y
    return impacts, settled


#: unknowns of a chain before the restitutions of its impacts: start state, shift of the wall, common shift of the restitution
COMMON = 8


@compiled
def _residual(out: Array, first: int, observed: Array, sd: Array, origin: Array, r: Array) -> None:
    for i in range(len(out)):
        c, s = np.cos(out[i, 2]), np.sin(out[i, 2])
        o = first + i
        r[o, 0] = (observed[o, 0] - out[i, 0] - c * origin[0] + s * origin[1]) / sd[o, 0]
        r[o, 1] = (observed[o, 1] - out[i, 1] - s * origin[0] - c * origin[1]) / sd[o, 0]
        r[o, 2] = (observed[o, 2] - out[i, 2]) / sd[o, 1]


@compiled
def chain_residual(theta: Array, steps: Array, t0: float, times: Array, observed: Array, sd: Array, origin: Array, p: Array,
                   harmonics: Array, rig: Array, jacobian: Array, records: Array, r: Array) -> tuple[int, float]:
    """Standardised residuals ``r`` (N, 3) of a chain, their ``jacobian`` (N, 3, P) in theta (P,) where it has rows, ``records``.

    theta: :data:`COMMON` unknowns, then deviations of the impacts' restitutions from the law; later impacts have the common shift alone.
    """
    n, m = len(times), len(records)
    out, befores = np.empty((n, 6)), np.empty((m, 6))
    other, unused = np.empty((m, 8)), np.empty((m, 6))
    deviation = np.empty(m)

    for i in range(m):
        deviation[i] = theta[7] + (theta[COMMON + i] if COMMON + i < len(theta) else 0.0)
    impacts, settled = simulate_chain(theta[:6], t0, False, times, theta[6], deviation, p, harmonics, rig, out, records, befores)
    _residual(out, 0, observed, sd, origin, r)
    if len(jacobian) == 0:
        return impacts, settled
    moved, shifted = np.empty((n, 3)), theta.copy()
    for j in range(len(theta)):
        h = steps[j]
        if j < COMMON:
            shifted[j] += h
            changed = deviation + (h if j == 7 else 0.0)
            simulate_chain(shifted[:6], t0, False, times, shifted[6], changed, p, harmonics, rig, out, other, unused)
            shifted[j] = theta[j]
            begin = 0
        else:
            number = j - COMMON
            jacobian[:, :, j] = 0.0
            if number >= impacts:
                continue
            t = records[number, 0]
            begin = int(np.searchsorted(times, t))
            if begin >= n:
                continue
            changed = deviation[number:].copy()
            changed[0] += h
            simulate_chain(befores[number], t, True, times[begin:], theta[6], changed, p, harmonics, rig, out[begin:], other, unused)
        _residual(out[begin:], begin, observed, sd, origin, moved)
        for i in range(begin, n):
            for q in range(3):
                jacobian[i, q, j] = (moved[i, q] - r[i, q]) / h
    return impacts, settled
