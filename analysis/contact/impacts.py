"""Impacts as junctions of two flights: when, where, and the velocities on both sides, with their covariance.

Each side comes from a flight fitted by itself.  Their paths meet at a time that is solved for; that position and angle
are continuous there is then used as a measurement (one Kalman update), which sharpens the velocities and says, by its
own misfit, whether the contact was instant.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.flights.cutting.run_data import RunData
from analysis.flights.fit import FlightFits
from analysis.flights.host_gives import TOO_HEAVY, Gives, at_corners, host_gives
from analysis.walls.outlines import Ring
from analysis.walls.wall import Wall

Array = NDArray[np.float64]

# How exactly positions agree at an instant contact: the flight model's own error, not the camera's (the rig's own
# units).
CONTINUITY_M = 2e-6
# Paths whose velocities differ by less than this have no kink, and no instant at which they intersect (the rig's own
# units).
LEAST_STEP_M_PER_S = 1e-3
# The instant is solved for to this, within so many steps, no farther from its gap than so many frames; there it is
# accepted where it lies in the gap or beside it.
INSTANT_S, INSTANT_STEPS, SEARCHED_FRAMES, ACCEPTED_FRAMES = 1e-9, 10, 2.0, 1.5
# Steps of the differences of :func:`measure`: places and angles, velocities and spins, before and after; the instant.
STEPS = np.array(2 * [*3 * [1e-7], *3 * [1e-5]] + [1e-8])
# Step of a wall's terms (m, rad), of :meth:`Impacts.design`.
TERM_STEP = 1e-6

#: rows of ``Impacts.value``
QUANTITIES = (
    "normal_before",
    "normal_after",
    "tangential_before",
    "tangential_after",
    "spin_before",
    "spin_after",
    "gap",
    "time",
)

# A disk whose middle is off its mass centre by less than this share of the wall's size (0.05 mm of 40 mm) counts as
# centred: what a run's impacts tell of a smaller offset is mostly noise, which the impulses should not have.
CENTRED_SHARE = 1.25e-3


@dataclass(frozen=True, eq=False)
class Junctions:
    """K flight junctions: ``state`` (K, 12) before and after (x, y, angle, vx, vy, spin each) at ``time_s``,
    ``covariance`` (K, 13, 13) with the time's as last; Host's pose and rate (K, 4) there; ``mismatch`` chi-square of
    continuity (2 degrees);
    ``sideways_m`` what failed to meet across the velocity step; ``run`` and ``flight`` index; ``drive_rad`` phase of
    the drive there and ``drive_start_rad`` at t = 0; ``lean_rad`` (K,) by which a law of the wall's shape turns its
    normal there, and ``wall_out_m_per_s`` (K,) with which it moves the wall outwards against the Host, nil where none
    is known; ``gives`` how the Host answers an impulse: ``host_rate`` is that of the
    middle of its own step."""

    state: Array
    time_s: Array
    covariance: Array
    host: Array
    host_rate: Array
    mismatch: Array
    sideways_m: Array
    run: NDArray[np.int64]
    flight: NDArray[np.int64]
    drive_rad: Array
    drive_start_rad: Array
    lean_rad: Array
    wall_out_m_per_s: Array
    radius_m: float
    gives: Gives = TOO_HEAVY

    def __len__(self) -> int:
        return len(self.time_s)

    def repeated(self, count: int) -> Junctions:
        """All of them ``count`` times over, one series behind the other."""
        return self.at(np.tile(np.arange(len(self)), count))

    def at(self, chosen: NDArray[np.int64] | NDArray[np.bool_]) -> Junctions:
        """Those of numbers (M,), or that a mask (K,) selects."""
        arrays = [f.name for f in fields(self) if isinstance(getattr(self, f.name), np.ndarray)]
        return replace(self, **{name: getattr(self, name)[chosen] for name in arrays})


@dataclass(frozen=True, eq=False)
class Impacts:
    """K impacts as the contact law sees them.

    ``value`` (K, 8) of :data:`QUANTITIES`: normal speeds (before: towards the wall, after: away from it), tangential
    speeds of the contact point against the wall (m/s), spins (rad/s), gap of the disk's edge past the wall (m), time
    (s);
    ``covariance`` (K, 8, 8); ``azimuth_rad`` of the contact seen from the Host's centre in the world, ``body_rad`` the
    same seen from the disk, ``normal_rad`` direction of the wall's outward normal there; ``surface`` of ``wall`` that
    was hit, ``junctions`` what they were made of.
    """

    value: Array
    covariance: Array
    azimuth_rad: Array
    body_rad: Array
    normal_rad: Array
    surface: NDArray[np.int64]
    wall: Wall
    junctions: Junctions

    def __len__(self) -> int:
        return len(self.value)

    def of(self, name: str) -> Array:
        """One quantity of :data:`QUANTITIES`, (K,)."""
        return self.value[:, QUANTITIES.index(name)]

    def levers_m(self, radius_m: float) -> Array:
        """The contact from the disk's centre of mass (K, 2): along the outward normal, and along the tangent; of a disk
        that is centred but for :data:`CENTRED_SHARE`, as if it were."""
        state, disk_m = self.junctions.state, self.wall.disk_m
        if np.hypot(*disk_m) < CENTRED_SHARE * self.wall.size_m:
            disk_m = np.zeros(2)
        centre = _turned(disk_m, 0.5 * (state[:, 2] + state[:, 8]))
        c, s = np.cos(self.normal_rad), np.sin(self.normal_rad)
        return np.column_stack([radius_m + c * centre[:, 0] + s * centre[:, 1], c * centre[:, 1] - s * centre[:, 0]])

    def host_levers_m(self, radius_m: float) -> Array:
        """The contact from the Host's centre (K, 2): along the outward normal, and along the tangent."""
        place = _place(self.junctions.state, np.zeros(len(self)), self.junctions, self.wall)
        c, s = np.cos(self.normal_rad), np.sin(self.normal_rad)
        return np.column_stack([radius_m + c * place[:, 0] + s * place[:, 1], c * place[:, 1] - s * place[:, 0]])

    def sd(self, name: str) -> Array:
        """Its standard deviation, (K,)."""
        i = QUANTITIES.index(name)
        return np.sqrt(self.covariance[:, i, i])

    def design(self, terms: Sequence[str]) -> Array:
        """(K, P) derivative of the place of the contact along the wall's normal, as observed, with respect to
        ``terms``: how much farther past a wall that is held still the disk is seen when the true one has moved.
        """
        columns = [
            (_gap(self.junctions, self.wall.moved({t: -TERM_STEP}), self.surface)
             - _gap(self.junctions, self.wall.moved({t: TERM_STEP}), self.surface)) / (2 * TERM_STEP)
            for t in terms
        ]  # fmt: skip
        return np.stack(columns, -1) if columns else np.zeros((len(self), 0))


def intersect(fits: Sequence[FlightFits]) -> Junctions:
    """Junctions of joined flights in the runs of a series; flights that do not intersect near their gap have none.

    Examples
    --------
    When flights meet, from the middle of the run.

    >>> from ovines.notebook import analyse, identify, read_calibration, read_recording, read_table, triangulate
    >>> recording = read_recording("sample_data/series_tilted/run-01")
    >>> cameras = read_calibration(recording.calibration_file)
    >>> points = triangulate(read_table(recording.folder / "tracks.parquet", "tracks"), cameras, recording)
    >>> motion = analyse(points, recording)
    >>> motion = motion[motion["time_s"] < 0.6]
    >>> rig = identify(motion, recording).rig
    >>> from analysis.contact.impacts import intersect
    >>> junctions = intersect(rig.floor.fits)
    >>> len(junctions), junctions.time_s[:3].round(3).tolist()
    (9, [-0.271, -0.241, -0.177])
    """
    return _intersected(tuple(fits))


@lru_cache(maxsize=4)
def _intersected(fits: tuple[FlightFits, ...]) -> Junctions:
    """Kept, for the drive, the disk and the impacts ask for the same flights'."""
    met = [
        [(k, one) for k, flight in enumerate(fit.flights[:-1]) if flight.joined and (one := _intersect(fit, k))]
        for fit in fits
    ]
    steps = [_steps(fit.run, [one for _, one in known]) for fit, known in zip(fits, met, strict=True)]
    gives = host_gives([fit.run for fit in fits], [np.array([one.t for _, one in known]) for known in met], steps)
    rows = []
    for number, (fit, known, step) in enumerate(zip(fits, met, steps, strict=True)):
        beside = _beside_host(fit.run, [one for _, one in known], step, gives)
        rows += [(*row, number, k) for (k, _), row in zip(known, beside, strict=True)]
    radius = fits[0].run.radius_m if fits else float("nan")
    if not rows:
        none = np.zeros(0)
        return Junctions(
            np.zeros((0, 12)),
            none,
            np.zeros((0, 13, 13)),
            np.zeros((0, 4)),
            np.zeros((0, 4)),
            none,
            none,
            np.zeros(0, np.int64),
            np.zeros(0, np.int64),
            none,
            none,
            none,
            none,
            radius,
        )
    state, time, covariance, host, rate, mismatch, sideways, drive, start, run, before = (
        np.array(c) for c in zip(*rows, strict=True)
    )
    nil = np.zeros(len(rows))
    return Junctions(
        state, time, covariance, host, rate, mismatch, sideways, run, before, drive, start, nil, nil, radius, gives
    )


class _Meeting(NamedTuple):
    """Two flights where they meet, in the room: ``state`` (12,) before and after at ``t`` (s), its ``covariance``
    (13, 13) with the shift of t, where the disk was (``place``, 2), what is left of the statements of continuity
    (``mismatch``), and of it across the velocity step (``sideways``, m)."""

    state: Array
    t: float
    covariance: Array
    place: Array
    mismatch: float
    sideways: float


def _intersect(fits: FlightFits, k: int) -> _Meeting | None:
    run = fits.run
    before_edge, after_edge = run.time_s[fits.flights[k].last], run.time_s[fits.flights[k + 1].first]
    period = run.period_s
    t = 0.5 * (before_edge + after_edge)
    length, time = run.own_units
    exact_m = CONTINUITY_M * length
    for _ in range(INSTANT_STEPS):
        met = np.array([t])
        (a,), (b,) = fits.path(k, met), fits.path(k + 1, met)
        step = a[3:5] - b[3:5]
        speed2 = float(step @ step)
        if not speed2 >= (LEAST_STEP_M_PER_S * length / time) ** 2:  # a path that a law leaves without numbers, too
            return None
        shift = float(-(a[:2] - b[:2]) @ step / speed2)
        t = float(np.clip(t + shift, before_edge - SEARCHED_FRAMES * period, after_edge + SEARCHED_FRAMES * period))
        if abs(shift) < INSTANT_S:
            break
    if t < before_edge - ACCEPTED_FRAMES * period or t > after_edge + ACCEPTED_FRAMES * period:
        return None
    (a,), (pa,) = fits.propagate(k, met)
    (b,), (pb,) = fits.propagate(k + 1, met)
    if not all(np.isfinite(one).all() for one in (a, b, pa, pb)):  # a force beside the wall that grows within it
        return None
    # One update with the three statements of continuity; the state is (before 6, after 6, shift of t).
    p = np.zeros((13, 13))
    p[:6, :6], p[6:12, 6:12], p[12, 12] = pa, pb, period**2
    h = np.zeros((3, 13))
    h[:, :3], h[:, 6:9] = np.eye(3), -np.eye(3)
    h[:, 12] = a[3:] - b[3:]
    noise = np.diag([exact_m**2, exact_m**2, (exact_m / run.radius_m) ** 2])
    innovation = b[:3] - a[:3]
    spread = h @ p @ h.T + noise
    gain = np.linalg.solve(spread, h @ p).T
    state = np.concatenate([a, b, [0.0]]) + gain @ innovation
    posterior = p - gain @ h @ p
    # With the time free, the remaining misfit lies across the velocity step and in the angle.
    mismatch = float(innovation @ np.linalg.solve(spread, innovation))
    across = np.array([-step[1], step[0]]) / np.sqrt(speed2)
    return _Meeting(
        state[:12], t + float(state[12]), posterior, 0.5 * (a[:2] + b[:2]), mismatch, float(innovation[:2] @ across)
    )


def _steps(run: RunData, meetings: Sequence[_Meeting]) -> Array:
    """What the disk's velocity in the room steps by where flights meet, and the moment of that about the Host's centre
    (K, 3; m/s, m^2/s)."""
    if not meetings:
        return np.zeros((0, 3))
    step = np.array([one.state[9:11] - one.state[3:5] for one in meetings])
    host = run.host.at(np.array([one.t for one in meetings]))
    place = np.array([one.place for one in meetings]) - host[:, :2]
    gaps, normals = run.wall.gaps(place, host[:, 3], run.radius_m)
    normal = np.take_along_axis(normals, np.argmax(gaps, axis=1)[:, None], axis=1)
    out = place + run.radius_m * np.hstack([np.cos(normal), np.sin(normal)])
    return np.column_stack([step, out[:, 0] * step[:, 1] - out[:, 1] * step[:, 0]])


def _beside_host(run: RunData, meetings: Sequence[_Meeting], steps: Array, gives: Gives) -> list[tuple[Any, ...]]:
    """The rows of :class:`Junctions`, all but the last two, of a run's ``meetings`` and their ``steps`` (K, 3): against
    the Host as it ``gives``."""
    if not meetings:
        return []
    moments, host = np.array([one.t for one in meetings]), run.host
    if gives == TOO_HEAVY:
        pose, rate, second_rate = (np.array([host.at(t, order)[0] for t in moments[:, None]]) for order in range(3))
    else:
        pose, rate, second_rate = at_corners(run, moments, steps, gives)
    opens = _host_covariance(run, moments, pose, np.array([one.place for one in meetings]))
    rows = []
    for n, one in enumerate(meetings):
        # Speeds count against the Host, which is accelerated: a later instant is a smaller approach, on both sides
        # alike.
        late = np.eye(13)
        late[3:5, 12] = late[9:11, 12] = -second_rate[n, :2]
        covariance = late @ one.covariance @ late.T + opens[n]
        drive = host.omega_rad_per_s * one.t + host.phase_rad
        rows.append((one.state, one.t, covariance, pose[n], rate[n], one.mismatch, one.sideways, drive, host.phase_rad))
    return rows


def _host_covariance(run: RunData, moments: Array, pose: Array, places: Array) -> Array:
    """What the Host's path leaves open of the states at ``moments`` (N,), (N, 13, 13): places and velocities count
    against the wall, which is taken to lie at the disk's ``places`` (N, 2), and both sides share its errors; ``pose``
    (N, 4) of the Host.  Those of harmonics alone are small and common to all impacts of a run: no scatter of theirs."""
    if run.host.harmonic:
        return np.zeros((len(moments), 13, 13))
    found = run.host.covariance(moments)
    out = np.empty((len(moments), 13, 13))
    for n, arm in enumerate(places - pose[:, :2]):
        turned = np.array([-arm[1], arm[0]])
        rows = np.zeros((13, 6))  # by errors of x, y, angle and of their rates
        for first, rate in ((0, 0), (3, 3), (6, 0), (9, 3)):
            rows[first : first + 2, rate : rate + 2] = np.eye(2)
            rows[first : first + 2, rate + 2] = turned
        joint = np.zeros((6, 6))
        for column, axis in enumerate((0, 1, 3)):
            joint[np.ix_([column, column + 3], [column, column + 3])] = found[n, axis, :2, :2]
        out[n] = rows @ joint @ rows.T
    return out


def measure(junctions: Junctions, wall: Wall) -> Impacts:
    """Normal and tangential speeds, gap and their covariance, for a wall that is known.

    Examples
    --------
    The restitution of each impact against the wall as recording.toml states it.

    >>> from ovines.notebook import analyse, identify, read_calibration, read_recording, read_table, triangulate
    >>> recording = read_recording("sample_data/series_tilted/run-01")
    >>> cameras = read_calibration(recording.calibration_file)
    >>> points = triangulate(read_table(recording.folder / "tracks.parquet", "tracks"), cameras, recording)
    >>> motion = analyse(points, recording)
    >>> motion = motion[motion["time_s"] < 0.6]
    >>> rig = identify(motion, recording).rig
    >>> from analysis.contact.impacts import intersect, measure
    >>> from analysis.walls.drawn import stated_wall
    >>> impacts = measure(intersect(rig.floor.fits), stated_wall(recording))
    >>> (impacts.value[:, 1] / impacts.value[:, 0]).round(2).tolist()
    [0.71, 0.71, 0.71, 0.71, 0.71, 0.71, 0.71, 0.71, 0.71]
    """
    state, count = junctions.state, len(junctions)
    place = _place(state, np.zeros(count), junctions, wall)
    surface = wall.hit(place, junctions.host[:, 3], state[:, 9:11] - state[:, 3:5])
    # All at once: the impacts as they are, then with each number of their state a step further.
    steps = np.vstack([np.zeros(len(STEPS)), np.diag(STEPS)])
    moved, shift = (state + steps[:, None, :-1]).reshape(-1, state.shape[1]), np.repeat(steps[:, -1], count)
    every = _evaluate(moved, shift, junctions.repeated(len(steps)), wall, np.tile(surface, len(steps)))
    value, seen = every[0][:count], every[1][:count]
    further = every[0][count:].reshape(len(STEPS), count, len(QUANTITIES))
    derivative = np.ascontiguousarray(((further - value) / STEPS[:, None, None]).transpose(1, 2, 0))
    covariance = derivative @ junctions.covariance @ derivative.transpose(0, 2, 1)
    normal = seen[:, 1]
    # On a ring the azimuth about its centre, which its slight ellipse does not turn.
    facing = np.where(surface == 0, seen[:, 2], normal) if isinstance(wall.outline, Ring) else normal
    angle = 0.5 * (state[:, 2] + state[:, 8])
    contact = place + junctions.radius_m * np.column_stack([np.cos(normal), np.sin(normal)])
    azimuth = np.arctan2(contact[:, 1], contact[:, 0])
    return Impacts(value, covariance, azimuth, facing - angle, normal, surface, wall, junctions)


def _place(state: Array, shift: Array, junctions: Junctions, wall: Wall) -> Array:
    """The disk's geometric centre (K, 2) from the Host's, in the room's directions; it sits at wall.disk_m in the
    disk.
    """
    before, after = state[:, :6], state[:, 6:]
    drift = shift[:, None]
    place = 0.5 * (before[:, :2] + after[:, :2]) + 0.5 * (before[:, 3:5] + after[:, 3:5]) * drift
    centre = place + _turned(wall.disk_m, 0.5 * (before[:, 2] + after[:, 2]))
    return np.asarray(centre - (junctions.host[:, :2] + junctions.host_rate[:, :2] * drift), float)


def _gap(junctions: Junctions, wall: Wall, surface: NDArray[np.int64]) -> Array:
    place = _place(junctions.state, np.zeros(len(junctions)), junctions, wall)
    return np.asarray(wall.seen(surface, place, junctions.host[:, 3], junctions.radius_m)[:, 0], float)


def _evaluate(
    state: Array, shift: Array, junctions: Junctions, wall: Wall, surface: NDArray[np.int64]
) -> tuple[Array, Array]:
    """Values (K, 8) of :data:`QUANTITIES`, and the surfaces as :meth:`Wall.seen` gives them (K, 3)."""
    before, after = state[:, :6], state[:, 6:]
    centre = _place(state, shift, junctions, wall)
    seen = wall.seen(surface, centre, junctions.host[:, 3], junctions.radius_m)
    seen[:, 1] += junctions.lean_rad
    er = np.stack([np.cos(seen[:, 1]), np.sin(seen[:, 1])], -1)
    et = np.stack([-er[:, 1], er[:, 0]], -1)
    # The contact from the Host's centre, and from the centre of mass.
    out = centre + junctions.radius_m * er
    lever = _turned(wall.disk_m, 0.5 * (before[:, 2] + after[:, 2])) + junctions.radius_m * er
    step, gives, half = after[:, 3:5] - before[:, 3:5], junctions.gives, np.zeros_like(junctions.host_rate)
    half[:, :2] = -0.5 * gives.share * step
    half[:, 3] = -0.5 * gives.turn_per_m2 * (out[:, 0] * step[:, 1] - out[:, 1] * step[:, 0])

    def at_contact(side: Array, rate: Array) -> tuple[Array, Array]:
        velocity = side[:, 3:5] + side[:, 5:6] * np.stack([-lever[:, 1], lever[:, 0]], -1)
        velocity = velocity - rate[:, :2] - rate[:, 3:4] * np.stack([-out[:, 1], out[:, 0]], -1)
        return np.sum(velocity * er, -1) - junctions.wall_out_m_per_s, np.sum(velocity * et, -1)

    normal_before, tangential_before = at_contact(before, junctions.host_rate - half)
    normal_after, tangential_after = at_contact(after, junctions.host_rate + half)
    value = np.stack(
        [
            normal_before,
            -normal_after,
            tangential_before,
            tangential_after,
            before[:, 5],
            after[:, 5],
            seen[:, 0],
            junctions.time_s + shift,
        ],
        -1,
    )
    return value, seen


def _turned(vector: Array, angle: Array) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([c * vector[0] - s * vector[1], s * vector[0] + c * vector[1]], -1)
