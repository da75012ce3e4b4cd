"""A chain of flights and impacts, simulated through: what chattering against the wall must look like if the laws found hold.

Flight model, wall and contact law are those of the identification; the start state, a shift of the wall at this place, and the restitution of
each impact are arguments, so that they can be fitted to the frames.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.compiled import compiled
from analysis.flight_model import LONGEST_STEP_S, advance, strongest_acceleration

Array = NDArray[np.float64]
#: columns of an impact's record
RECORD = ("time", "normal_before", "normal_after", "tangential_before", "tangential_after", "spin_before", "spin_after", "azimuth")
#: entries of ``rig``, after which the flight model's parameters follow as an array of their own; the restitution at approach speed v is
#: restitution + restitution_rise exp(-v / restitution_speed)
RIG = ("radius", "centre_x", "centre_y", "disk_x", "disk_y", "ellipse_c", "ellipse_s", "wall_friction", "tangential_restitution",
       "disk_radius", "inertia", "omega", "phase", "stop_speed", "delay", "restitution", "restitution_rise", "restitution_speed")
# Steps of a disk that stays at the wall, whose friction acts all along.
SETTLED_STEP_S = 2e-4
LEAST_RESTITUTION = 0.02


@compiled
def _step(y: Array, t: float, h: float, p: Array, harmonics: Array, rig: Array, k: Array, trial: Array, host: Array, a: Array, out: Array) -> None:
    strongest = strongest_acceleration(p, harmonics, rig[11])
    advance(y, t, h, p, harmonics, rig[11], rig[9], rig[10], rig[0], rig[12], strongest, k, trial, host, a, out)


@compiled
def _host_place(t: float, harmonics: Array, omega: float, host: Array) -> None:
    for axis in range(4):
        host[axis] = harmonics[axis, 0]
        host[4 + axis] = 0.0
    for n in range((harmonics.shape[1] - 1) // 2):
        w = omega * (n + 1)
        c, s = np.cos(w * t), np.sin(w * t)
        for axis in range(4):
            u, v = harmonics[axis, 1 + 2 * n], harmonics[axis, 2 + 2 * n]
            host[axis] += u * c + v * s
            host[4 + axis] += w * (v * c - u * s)


@compiled
def contact_view(y: Array, t: float, harmonics: Array, rig: Array, shift: float, host: Array, view: Array) -> None:
    """view = gap beyond the wall (m, > 0: outside), normal and tangential speed of the contact point, azimuth, normal's direction.

    A contact that lasts is an instant one that comes ``delay`` later, past the wall by as much as the disk approaches meanwhile."""
    _host_place(t, harmonics, rig[11], host)
    c, s = np.cos(host[3]), np.sin(host[3])
    cd, sd = np.cos(y[2]), np.sin(y[2])
    cx = y[0] + cd * rig[3] - sd * rig[4]
    cy = y[1] + sd * rig[3] + cd * rig[4]
    rx = cx - host[0] - (c * rig[1] - s * rig[2])
    ry = cy - host[1] - (s * rig[1] + c * rig[2])
    azimuth = np.arctan2(ry, rx)
    radius = rig[0] * (1 + rig[5] * np.cos(2 * azimuth) + rig[6] * np.sin(2 * azimuth)) + shift
    normal = azimuth + 2 * (rig[5] * np.sin(2 * azimuth) - rig[6] * np.cos(2 * azimuth))
    ex, ey = np.cos(normal), np.sin(normal)
    px, py = cx + rig[9] * ex, cy + rig[9] * ey
    vx = y[3] - y[5] * (py - y[1]) - host[4] + host[7] * (py - host[1])
    vy = y[4] + y[5] * (px - y[0]) - host[5] - host[7] * (px - host[0])
    view[1] = vx * ex + vy * ey
    view[0] = np.sqrt(rx * rx + ry * ry) - radius - rig[14] * max(view[1], 0.0)
    view[2] = -vx * ey + vy * ex
    view[3] = azimuth
    view[4] = normal


@compiled
def _push(y: Array, view: Array, rig: Array, normal_impulse: float, tangential_restitution: float) -> float:
    """``y`` after an impulse per mass along the wall's normal and what wall friction gives along it, which is returned."""
    share = 1 + 1 / rig[10]
    tangential = -np.sign(view[2]) * min((1 + tangential_restitution) * abs(view[2]) / share, rig[7] * normal_impulse)
    ex, ey = np.cos(view[4]), np.sin(view[4])
    y[3] += -normal_impulse * ex - tangential * ey
    y[4] += -normal_impulse * ey + tangential * ex
    y[5] += tangential / (rig[10] * rig[9])
    return tangential


@compiled
def _stay(y: Array, view: Array, later: Array, rig: Array, h: float) -> None:
    """Put ``y``, after a free step of h from the wall (``view``) to past it (``later``), back on the wall: no gap, no normal speed."""
    ex, ey = np.cos(later[4]), np.sin(later[4])
    # The wall pushes along a normal that turns meanwhile, and rubs all along the step.
    turned = 0.5 * np.sin(later[4] - view[4]) * later[1]
    rubbed = _push(y, later, rig, max(later[1], 0.0), 0.0)
    normal = min(later[1], 0.0)
    y[0] += -later[0] * ex - 0.5 * h * rubbed * ey
    y[1] += -later[0] * ey + 0.5 * h * rubbed * ex
    y[3] += -normal * ex - turned * ey
    y[4] += -normal * ey + turned * ex


@compiled
def _strike(y: Array, view: Array, rig: Array, deviation: float, record: Array, t: float) -> None:
    """Luding's law at the contact, its restitution changed by ``deviation``: ``y`` after it, ``record`` filled."""
    share = 1 + 1 / rig[10]
    restitution = min(max(rig[15] + rig[16] * np.exp(-view[1] / rig[17]) + deviation, LEAST_RESTITUTION), 1.0)
    record[0], record[1], record[2], record[3] = t, view[1], restitution * view[1], view[2]
    record[5] = y[5]
    record[4] = view[2] + share * _push(y, view, rig, (1 + restitution) * view[1], rig[8])
    record[6], record[7] = y[5], view[3]


@compiled
def _strike_and_look(y: Array, t: float, view: Array, rig: Array, deviation: float, shift: float, p: Array, harmonics: Array,
                     record: Array, host: Array, later: Array, k: Array, trial: Array, a: Array, probe: Array) -> float:
    """Impact at t; ``view`` is the one after it.  Returns the longest step: the hop lasts 2 v / a, a step covers a quarter of it at most."""
    _strike(y, view, rig, deviation, record, t)
    contact_view(y, t, harmonics, rig, shift, host, view)
    leaving = -view[1]
    view[0] = 0.0
    _step(y, t, 1e-5, p, harmonics, rig, k, trial, host, a, probe)
    contact_view(probe, t + 1e-5, harmonics, rig, shift, host, later)
    back = (later[1] - view[1]) / 1e-5
    return min(LONGEST_STEP_S, max(0.5 * leaving / back, 2e-6)) if back > 0 else LONGEST_STEP_S


@compiled
def simulate_chain(start: Array, t0: float, at_impact: bool, times: Array, shift: float, deviation: Array, p: Array, harmonics: Array,
                   rig: Array, out: Array, records: Array, befores: Array) -> tuple[int, float]:
    """States (len(times), 6) at the sorted ``times`` >= t0, and ``records`` (K, 8) of the impacts up to the last of them.

    ``deviation`` (K,) of the impacts' restitution from the law's, in order; after K impacts, or when one comes in slower than rig's stop
    speed, the disk slides or rolls along the wall.  ``at_impact``: the start is the state just before the first impact.  ``befores`` (K, 6) takes the states just before each
    impact.  Returns the number of impacts and the time at which the disk settled (inf when it never did).
    """
    host, a, view, later = np.empty(9), np.empty(4), np.empty(5), np.empty(5)
    k, trial, moved, probe = np.empty((4, 6)), np.empty(6), np.empty(6), np.empty(6)
    y, t, impacts, settled = start.copy(), t0, 0, np.inf
    longest = LONGEST_STEP_S
    contact_view(y, t, harmonics, rig, shift, host, view)
    if at_impact:
        befores[0] = y
        longest = _strike_and_look(y, t, view, rig, deviation[0], shift, p, harmonics, records[0], host, later, k, trial, a, probe)
        impacts = 1
    for i in range(len(times)):
        while t < times[i] - 1e-12:
            h = min(longest if settled == np.inf else SETTLED_STEP_S, times[i] - t)
            _step(y, t, h, p, harmonics, rig, k, trial, host, a, moved)
            contact_view(moved, t + h, harmonics, rig, shift, host, later)
            if settled < np.inf:
                _stay(moved, view, later, rig, h)
                y[:] = moved
                t += h
                contact_view(y, t, harmonics, rig, shift, host, view)
                continue
            if later[0] > 0 and later[1] > 0 and (view[0] <= 0 or view[1] <= 0):
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
                y[:] = probe
                t += middle
                view[:] = later
                if impacts >= len(deviation) or view[1] < rig[13]:
                    settled = t
                    continue
                befores[impacts] = y
                longest = _strike_and_look(y, t, view, rig, deviation[impacts], shift, p, harmonics, records[impacts], host, later, k, trial,
                                           a, probe)
                impacts += 1
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
