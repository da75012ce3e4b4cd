"""Impacts as the meeting of two flights: when, where, and the velocities on both sides, with their covariance.

Each side comes from a flight fitted by itself.  Their paths meet at a time that is solved for; that position and angle
are continuous there is then used as a measurement (one Kalman update), which sharpens the velocities and says, by its own misfit,
whether the contact was instant.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.flights import FlightFits

Array = NDArray[np.float64]

# How exactly positions agree at an instant contact: the flight model's own error, not the camera's.
CONTINUITY_M = 2e-6

#: the quantities of one impact, in the order of the rows of ``Impacts.covariance``
QUANTITIES = ("normal_before", "normal_after", "tangential_before", "tangential_after", "spin_before", "spin_after", "radius", "time")


@dataclass(frozen=True, eq=False)
class Impacts:
    """K impacts of one run.

    ``value`` (K, 8) of :data:`QUANTITIES`: normal speeds (before: towards the wall, after: away from it, both positive for an
    impact), tangential speeds of the contact point against the wall (m/s), spins (rad/s), distance of the disk's centre from the
    Host's at contact (m), time (s); ``covariance`` (K, 8, 8).  ``azimuth_rad`` of the contact seen from the Host's centre in the
    world, ``angle_rad`` of the disk, ``slide_m_per_s`` change of the centre's tangential velocity and ``push_m_per_s`` of its
    normal one (impulse per mass), ``mismatch`` chi-square (2 degrees) of continuity, ``gap_m`` (K, 2) what failed to meet (normal,
    tangential) after the best time, ``flight`` (K,) index of the flight before, ``drive_rad`` phase of the drive.
    """

    value: Array
    covariance: Array
    azimuth_rad: Array
    angle_rad: Array
    host_angle_rad: Array
    mismatch: Array
    sideways_m: Array
    flight: NDArray[np.int64]
    drive_rad: Array
    place_m: Array

    def __getattr__(self, name: str) -> Array:
        if name in QUANTITIES:
            return self.value[:, QUANTITIES.index(name)]
        raise AttributeError(name)

    def __len__(self) -> int:
        return len(self.value)


def find_impacts(fits: FlightFits, usual_misfit: float = 1.0) -> Impacts:
    """The impacts between joined flights of a run (see :class:`Impacts`)."""
    rows = []
    for k, flight in enumerate(fits.flights[:-1]):
        if not flight.joined or fits.freedom[k] < 0 or fits.freedom[k + 1] < 0:
            continue
        row = _meet(fits, k)
        if row is not None:
            rows.append(row)
    if not rows:
        empty = np.zeros(0)
        return Impacts(np.zeros((0, 8)), np.zeros((0, 8, 8)), empty, empty, empty, empty, empty, np.zeros(0, np.int64), empty, np.zeros((0, 2)))
    columns = list(zip(*rows, strict=True))
    return Impacts(*(np.array(c) for c in columns))


def _meet(fits: FlightFits, k: int):
    run = fits.run
    before_edge, after_edge = run.time_s[fits.flights[k].last], run.time_s[fits.flights[k + 1].first]
    t = 0.5 * (before_edge + after_edge)
    for _ in range(8):
        (a,), (pa,) = fits.propagate(k, np.array([t]))
        (b,), (pb,) = fits.propagate(k + 1, np.array([t]))
        step = a[3:5] - b[3:5]
        speed2 = float(step @ step)
        if speed2 < 1e-8:
            return None
        shift = float(-(a[:2] - b[:2]) @ step / speed2)
        t = float(np.clip(t + shift, before_edge - 2.5e-3, after_edge + 2.5e-3))
        if abs(shift) < 1e-9:
            break
    period = np.median(np.diff(run.time_s))
    if t < before_edge - 1.5 * period or t > after_edge + 1.5 * period:
        return None
    # One update with the three statements of continuity; the state is (before 6, after 6, shift of t).
    p = np.zeros((13, 13))
    p[:6, :6], p[6:12, 6:12], p[12, 12] = pa, pb, (10 * period) ** 2
    h = np.zeros((3, 13))
    h[:, :3], h[:, 6:9] = np.eye(3), -np.eye(3)
    h[:, 12] = a[3:] - b[3:]
    noise = np.diag([CONTINUITY_M**2, CONTINUITY_M**2, (CONTINUITY_M / run.radius_m) ** 2])
    innovation = b[:3] - a[:3]
    spread = h @ p @ h.T + noise
    gain = np.linalg.solve(spread, h @ p).T
    state = np.concatenate([a, b, [0.0]]) + gain @ innovation
    posterior = p - gain @ h @ p
    # With the time free, what is left of the misfit lies across the velocity step and in the angle.
    mismatch = float(innovation @ np.linalg.solve(spread, innovation))
    value, derivative, extra = _quantities(state, t, fits)
    covariance = derivative @ posterior @ derivative.T
    across = np.array([-step[1], step[0]]) / np.sqrt(speed2)
    return (value, covariance, extra[0], float(a[2]), extra[1], mismatch, float(innovation[:2] @ across), k, extra[2], extra[3])


def _quantities(state: Array, t: float, fits: FlightFits):
    """The eight quantities at contact, their derivative (8, 13), and (azimuth, Host angle, drive phase, place in the room)."""

    run = fits.run

    def evaluate(s: Array) -> Array:
        moment = t + s[12]
        host, rate = run.host.at(np.array([moment]))[0], run.host.at(np.array([moment]), 1)[0]
        place = 0.5 * (s[:2] + s[6:8]) + (0.5 * (s[3:5] + s[9:11])) * s[12]
        relative = place - host[:2]
        radius = np.hypot(*relative)
        er = relative / radius
        et = np.array([-er[1], er[0]])
        wall = (radius + run.radius_m) * rate[3]
        before, after = s[3:5] - rate[:2], s[9:11] - rate[:2]
        return np.array([before @ er, -after @ er, before @ et + run.radius_m * s[5] - wall,
                         after @ et + run.radius_m * s[11] - wall, s[5], s[11], radius, moment, np.arctan2(er[1], er[0])])

    base = evaluate(state)
    derivative = np.empty((8, 13))
    for j in range(13):
        h = 1e-7 if j in (0, 1, 2, 6, 7, 8) else (1e-8 if j == 12 else 1e-5)
        moved = state.copy()
        moved[j] += h
        derivative[:, j] = (evaluate(moved)[:8] - base[:8]) / h
    host = run.host.at(np.array([base[7]]))[0]
    drive = run.host.omega_rad_per_s * base[7] + run.host.phase_rad
    return base[:8], derivative, (base[8], float(host[3]), float(drive), 0.5 * (state[:2] + state[6:8]))
