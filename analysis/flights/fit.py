"""Flights between impacts, each fitted with the simulator's own flight model to the positions, never to derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.flights.force_path import ForcePath
from analysis.flights.model import NO_LAW, STATES, FlightRig
from analysis.flights.noise import PLAIN, FlightNoise, StandardResiduals
from analysis.flights.parameters import BLOW_TIMES, CONTACT_BEFORE, DRIFT, FRICTION, IMPACT_BEFORE_S, PARAMETERS
from analysis.flights.single_flight import WhiteFrames, fit_single, fly_with_derivatives, start_state
from analysis.motion.host_path import HostMotion
from analysis.motion.rig_frame import own_units
from analysis.walls.wall import Wall
from ovines.core.laws.terms import asks_for_contacts
from ovines.core.laws.words import MOST_BLOWS

Array = NDArray[np.float64]

# Degree of the lens residual's polynomials: what remains of one beyond it changes its sign within a fifth of the
# contact radius (analysis.bounces.noise).
LENS_DEGREE = 4
#: powers (i, j) of the lens-residual polynomials x^i y^j in units of the contact radius
LENS_POWERS = [(d - j, j) for d in range(1, LENS_DEGREE + 1) for j in range(d + 1)]
#: the markers' origin against the centre of mass (m)
ORIGIN = ["origin_x", "origin_y"]
#: the lens residual's coefficients (m), first all along x
LENS_TERMS = [f"lens_{axis}_{i}{j}" for axis in "xy" for i, j in LENS_POWERS]
# Frames whose parabola is the first guess of a flight: friction turns within longer stretches.
START_FRAMES = 12
# Fewer frames between two kinks are no flight of their own: three leave one number besides place and velocity, and hops
# that short hold impacts.
FEWEST_FRAMES = 4
# Frames on either side of an impact that say where it was; fewer than these make no line.
CONTACT_FRAMES, LINE = 4, 2
# Unseen frames that a flight bridges: with a fit on both sides its path is known as well as where it is seen.
LONGEST_HOLE = 6
# Slower than this against the floor, sliding and rim of the spin together, the disk counts as resting on it (the rig's
# own units).
REST_M_PER_S = 5e-3
# Where the motion gives no angle, the flight fit sees one of no weight.
NO_ANGLE_SD_RAD = 1e6
# A Host's overtone known to 0.2 um leaves the mean speed of a disk that slides to and fro open by 40 um/s, which no
# covariance of a flight holds: over this time it stays near the cameras' noise, and impacts under a strong drive are
# closer (the rig's own seconds).
LONGEST_FLIGHT_S = 0.15
FEWEST_IN_PIECE = 8
# A frame that lies on the cut between pieces exactly would change sides with the clock's rounding; none lies so much of
# a frame beside it.
BESIDE_FRAMES = 0.3
# Frames of a piece at the most: its errors are weighed all against all.
MOST_IN_PIECE = 150


class Contact(NamedTuple):
    """Where the disk touched the wall, from the Host's centre (m), its normal speed before that (m/s), its angle then
    (rad), and the tangential speed of the contact point before (m/s)."""

    x_m: float
    y_m: float
    approach_m_per_s: float
    angle_rad: float
    slip_m_per_s: float


NO_CONTACT = Contact(0.0, 0.0, 0.0, 0.0, 0.0)
#: every shared unknown, in the order of the columns of the evidence
SHARED: list[str] = [*PARAMETERS, *ORIGIN, *LENS_TERMS]
# An impact that never was: long ago (s).
LONG_AGO_S = -1e6


@dataclass(frozen=True, eq=False)
class RunData:
    """What the fit needs of one run: N frames; NaN where the NES was not seen; ``stated``: the wall as designed (None:
    round); ``law``: packed terms of a written law; ``number`` of the run in its series, from 0; ``friction_share``: its
    floor friction over the one that the series shares; ``later_s``: from its start to its middle, less the runs'
    mean of that, for a friction that drifts from the start on; ``middle_m``: the disk's geometric centre, where the
    floor's friction acts, from its centre of mass, in the disk's frame.
    """

    name: str
    time_s: Array
    xy_m: Array
    angle_rad: Array
    xy_sd_m: Array
    angle_sd_rad: Array
    host: HostMotion
    contact_radius_m: float
    radius_m: float
    inertia_factor: float
    stated: Wall | None = None
    law: Array = field(default_factory=NO_LAW.copy)
    number: int = 0
    friction_share: float = 1.0
    later_s: float = 0.0
    middle_m: tuple[float, float] = (0.0, 0.0)

    @property
    def wall(self) -> Wall:
        """The wall as it was designed."""
        return self.stated or Wall.ring(self.contact_radius_m)

    @cached_property
    def period_s(self) -> float:
        """From frame to frame (median)."""
        return float(np.median(np.diff(self.time_s))) if len(self.time_s) > 1 else 1.0

    @property
    def own_units(self) -> tuple[float, float]:
        """Metres and seconds of these data in one of the rig's own."""
        return own_units(self.contact_radius_m)

    @cached_property
    def host_at_frames(self) -> tuple[Array, Array]:
        """The Host's place and angle (N, 4) at all frames, and their rates."""
        return self.host.at(self.time_s), self.host.at(self.time_s, 1)

    @cached_property
    def lens_terms(self) -> Array:
        """:func:`lens_basis` at the places of all frames (N, len(LENS_POWERS))."""
        return lens_basis(self.xy_m, self.contact_radius_m)

    @property
    def start_s(self) -> float:
        """Time of the first frame; 0 without any."""
        return float(self.time_s[0]) if len(self.time_s) else 0.0

    @cached_property
    def remembers(self) -> bool:
        """Whether the law that the run holds asks for contacts before a flight."""
        return asks_for_contacts(self.law)

    @cached_property
    def contacts(self) -> dict[tuple[int, ...], Contact]:
        """:func:`contact_before` by the frames of both flights: it is asked for at each step of each fit."""
        return {}

    @cached_property
    def flight_rig(self) -> FlightRig:
        """What a flight knows of this run beside its parameters."""
        return FlightRig(
            self.host.table(self.time_s[0], self.time_s[-1]) if len(self.time_s) else self.host.table(0.0, 1.0),
            float(self.host.omega_rad_per_s),
            float(self.radius_m),
            float(self.inertia_factor),
            float(self.contact_radius_m),
            float(self.host.phase_rad),
            self.law,
            self.start_s,
            float(self.number),
            *self.middle_m,
        )


@dataclass(frozen=True, eq=False)
class Flight:
    """Frames ``first..last`` of free flight; ``joined``: the next flight starts where this one ends, at an impact;
    ``goes_on``: the next is the same flight, cut for its length."""

    first: int
    last: int
    joined: bool
    goes_on: bool = False


def flights_from_segments(
    seen: NDArray[np.bool_],
    gaps: Sequence[int],
    contact: NDArray[np.int64],
    longest_hole: int = LONGEST_HOLE,
    fewest: int = FEWEST_FRAMES,
) -> list[Flight]:
    """Flights between kinks, contact stretches and holes of more than ``longest_hole`` unseen frames; too short ones
    are dropped.
    """
    n = len(seen)
    blocked = np.zeros(n, bool)
    for first, last in contact:
        blocked[first : last + 1] = True
    cuts = {int(g) for g in gaps}
    flights: list[Flight] = []
    start: int | None = None
    last_seen = -1
    pieces: list[tuple[int, int, bool]] = []
    for i in range(n):
        if blocked[i]:
            if start is not None:
                pieces.append((start, last_seen, False))
                start = None
            continue
        if seen[i]:
            if start is not None and i - last_seen > longest_hole + 1:
                pieces.append((start, last_seen, False))
                start = i
            start = i if start is None else start
            last_seen = i
        if i in cuts and start is not None:
            pieces.append((start, last_seen, i + 1 < n and not blocked[i + 1]))
            start = None
    if start is not None:
        pieces.append((start, last_seen, False))
    for k, (first, last, joined) in enumerate(pieces):
        if np.count_nonzero(seen[first : last + 1]) < fewest:
            # A single frame between two kinks was exposed across an impact: the flights on both sides still meet there.
            # (A real flight that short means impacts below 0.1 m/s, which are not looked for.)
            smeared = np.count_nonzero(seen[first : last + 1]) <= 1 and joined and last - first <= 1
            if flights and not smeared:
                flights[-1] = Flight(flights[-1].first, flights[-1].last, False)
            continue
        follows = joined and k + 1 < len(pieces)
        flights.append(Flight(first, last, follows))
    return flights


def shortened(flights: Sequence[Flight], time_s: Array, seen: NDArray[np.bool_]) -> list[Flight]:
    """``flights`` with those longer than :data:`LONGEST_FLIGHT_S` cut into pieces, each of which is fitted by itself;
    ``time_s`` (N,) in the rig's own seconds.
    """
    pieces: list[Flight] = []
    for flight in flights:
        frames = np.flatnonzero(seen[flight.first : flight.last + 1]) + flight.first
        # From its first frame on: what is filmed after it changes nothing about how a flight begins.
        beside_s = BESIDE_FRAMES * (time_s[flight.last] - time_s[flight.first]) / max(flight.last - flight.first, 1)
        piece = np.floor((time_s[frames] - time_s[flight.first] + beside_s) / LONGEST_FLIGHT_S).astype(int)
        piece = np.maximum(piece, np.arange(len(frames)) // MOST_IN_PIECE)
        parts = [part for part in np.split(frames, np.flatnonzero(np.diff(piece)) + 1) if len(part)]
        while len(parts) > 1 and len(parts[-1]) < FEWEST_IN_PIECE:
            parts[-2:] = [np.concatenate(parts[-2:])]
        pieces += [Flight(int(part[0]), int(part[-1]), False, goes_on=True) for part in parts[:-1]]
        pieces.append(replace(flight, first=int(parts[-1][0]) if len(parts) > 1 else flight.first))
    return pieces


def lens_basis(xy_m: Array, contact_radius_m: float) -> Array:
    """Polynomials (N, len(LENS_POWERS)) of the places ``xy_m`` (N, 2) in the room."""
    x, y = xy_m[:, 0] / contact_radius_m, xy_m[:, 1] / contact_radius_m
    return np.stack([x**i * y**j for i, j in LENS_POWERS], -1)


def fit_flights(
    run: RunData,
    flights: Sequence[Flight],
    parameters: Array,
    shared: Array,
    start: FlightFits | None = None,
    noise: FlightNoise = PLAIN,
) -> FlightFits:
    """Each flight alone (no continuity): states, covariances and misfits, robust against single wrong frames.

    ``noise``: how the frames' errors go together.  ``start``: an earlier fit of the same flights to begin from (other
    parameters, say); the minimum is the same, found sooner.  Under an unknown force (``noise.forced``) the path near
    the frames is fitted as if there were none; what the force changes is linear about it (:class:`ForcePath`)."""
    states, covariances = np.empty((len(flights), STATES)), np.empty((len(flights), STATES, STATES))
    reference, misfit, freedom = np.empty(len(flights)), np.empty(len(flights)), np.empty(len(flights), np.int64)
    rig, frames_alone, seen = run.flight_rig, noise.without_force(), without_lens(run, shared)
    for k, f in enumerate(flights):
        index = seen_frames(run, f)
        # From the first frame on: friction forgets what it has stopped, so that from behind a rest no path leads back.
        reference[k] = run.time_s[f.first]
        if start is None:
            few = int(index[:START_FRAMES][-1])
            start_state(
                run.time_s, run.xy_m[:, 0], run.xy_m[:, 1], run.angle_rad, f.first, few, reference[k], states[k]
            )
        else:
            states[k] = start.states[k]
        white = frames_alone.whitening(index, run.time_s[index], run.xy_sd_m[index], run.angle_sd_rad[index])
        frames = WhiteFrames(run.time_s[index], seen[index], *white)
        own = with_impact_before(parameters, run, flights, k)
        misfit[k] = fit_single(states[k], reference[k], frames, own, shared[:2], rig, covariances[k])
        freedom[k] = 3 * len(index) - STATES
    gross = start.gross if start is not None else frozenset[int]()
    fits = FlightFits(
        run, tuple(flights), reference, states, covariances, misfit, freedom, parameters, shared, noise, gross
    )
    if noise.forced:
        for k in range(len(flights)):
            path = fits.force_path(k)
            covariances[k], misfit[k] = path.covariance, path.misfit
    return fits


def with_impact_before(parameters: Array, run: RunData, flights: Sequence[Flight], k: int) -> Array:
    """``parameters`` of flight ``k``, which know when the impact before it was and what the floor is in its run."""
    own = parameters.copy()
    later = 1 + own[DRIFT] * run.later_s
    own[FRICTION] *= run.friction_share * later
    own[DRIFT] /= later
    own[IMPACT_BEFORE_S] = impact_before(run, flights, k)
    if run.remembers:
        own = with_contacts_before(own, run, flights, k)
    return own


def with_contacts_before(parameters: Array, run: RunData, flights: Sequence[Flight], k: int) -> Array:
    """``parameters`` of flight ``k``, which know the contact before it, and the blows before that."""
    own = parameters.copy()
    own[CONTACT_BEFORE] = contact_before(run, flights, k)
    own[BLOW_TIMES : BLOW_TIMES + 2 * MOST_BLOWS] = blows_before(run, flights, k).ravel()
    return own


def impact_before(run: RunData, flights: Sequence[Flight], k: int) -> float:
    """When the impact was with which flight ``k`` began and the flight before ended; long ago without one.

    Midway between their frames: the first frame comes half a frame late, which made what dies out after an impact
    smaller.  Pieces of a long flight began with the first of them.
    """
    k = first_piece(flights, k)
    if k == 0 or not flights[k - 1].joined:
        return LONG_AGO_S
    return 0.5 * float(run.time_s[flights[k - 1].last] + run.time_s[flights[k].first])


def first_piece(flights: Sequence[Flight], k: int) -> int:
    """The piece with which the flight began that flight ``k`` is a piece of."""
    while k > 0 and flights[k - 1].goes_on:
        k -= 1
    return k


def contact_before(run: RunData, flights: Sequence[Flight], k: int) -> Contact:
    """The contact with which flight ``k`` began; zeros without such a contact.

    From the few frames on either side of it, as they were seen: what a law asks for, not what a fit is made of.  The
    normal is the direction in which the velocity jumped."""
    k = first_piece(flights, k)
    if k == 0 or not flights[k - 1].joined:
        return NO_CONTACT
    before, after = flights[k - 1], flights[k]
    asked = before.first, before.last, after.first, after.last
    if asked not in run.contacts:
        run.contacts[asked] = _contact_between(run, before, after, impact_before(run, flights, k))
    return run.contacts[asked]


def blows_before(run: RunData, flights: Sequence[Flight], k: int) -> Array:
    """Times (s) and normal speeds (m/s) of the impacts before flight ``k`` (2, MOST_BLOWS), the latest first, as far
    back as flights meet; zeros further back."""
    out, k = np.zeros((2, MOST_BLOWS)), first_piece(flights, k)
    for i in range(MOST_BLOWS):
        if k == 0 or not flights[k - 1].joined:
            break
        out[:, i] = impact_before(run, flights, k), contact_before(run, flights, k).approach_m_per_s
        k = first_piece(flights, k - 1)
    return out


def _contact_between(run: RunData, before: Flight, after: Flight, time_s: float) -> Contact:
    host, rate = run.host.at(np.array([time_s]))[0, :2], run.host.at(np.array([time_s]), 1)[0, :2]
    sides = [seen_frames(run, before)[-CONTACT_FRAMES:], seen_frames(run, after)[:CONTACT_FRAMES]]
    lines = [_line(run.time_s[at] - time_s, run.xy_m[at]) for at in sides if len(at)]
    if not lines:
        return NO_CONTACT
    place = np.mean([line[0] for line in lines], 0) - host
    velocity, jump = lines[0][1] - rate, lines[-1][1] - lines[0][1]
    size = float(np.hypot(*jump))
    normal = -jump / size if size > 0 else np.zeros(2)
    angle, spin = _turning(run, sides, time_s)
    slip = float(velocity[1] * normal[0] - velocity[0] * normal[1]) + run.radius_m * spin
    return Contact(float(place[0]), float(place[1]), max(float(velocity @ normal), 0.0), angle, slip)


def _turning(run: RunData, sides: Sequence[NDArray[np.int64]], time_s: float) -> tuple[float, float]:
    """The disk's angle (rad) at a contact between frames of two ``sides``, and its spin before (rad/s); zeros where no
    angle was seen."""
    seen = [at[run.angle_sd_rad[at] < NO_ANGLE_SD_RAD] for at in sides]
    lines = [_line(run.time_s[at] - time_s, run.angle_rad[at]) for at in seen if len(at)]
    if not lines:
        return 0.0, 0.0
    return float(np.mean([line[0] for line in lines])), float(lines[0][1]) if len(seen[0]) else 0.0


def _line(time_s: Array, values: Array) -> tuple[Array, Array]:
    """Value at time 0 and slope of the straight line through ``values`` (N,) or (N, 2); at rest with one frame."""
    if len(time_s) < LINE:
        return values.mean(0), np.zeros(values.shape[1:])
    slope, value = np.polyfit(time_s, values, 1)
    return value, slope


def without_lens(run: RunData, shared: Array) -> Array:
    """x, y less the lens residual of ``shared``, and angle (N, 3) of all frames."""
    n = len(LENS_POWERS)
    lens = run.lens_terms
    return np.column_stack(
        [run.xy_m[:, 0] - lens @ shared[2 : 2 + n], run.xy_m[:, 1] - lens @ shared[2 + n :], run.angle_rad]
    )


def seen_frames(run: RunData, flight: Flight) -> NDArray[np.int64]:
    """Numbers of a flight's frames in which the NES was seen."""
    index = np.arange(flight.first, flight.last + 1)
    return index[np.isfinite(run.xy_m[index, 0])]


@dataclass(frozen=True, eq=False)
class FlightFits:
    """Flights fitted one by one: ``states`` (F, 6) at ``reference_s``, ``covariances`` (F, 6, 6), ``misfit`` against
    ``freedom``; ``gross``: those that hold something else than flight, and speak for nothing shared.

    Under an unknown force (``noise.forced``) a state is that of the path without it which lies nearest to the frames;
    :meth:`propagate` adds what the force changes, and covariances and misfits are those under it."""

    run: RunData
    flights: tuple[Flight, ...]
    reference_s: Array
    states: Array
    covariances: Array
    misfit: Array
    freedom: NDArray[np.int64]
    parameters: Array
    shared: Array
    noise: FlightNoise = PLAIN
    gross: frozenset[int] = frozenset()
    _force_paths: dict[int, ForcePath] = field(default_factory=dict)

    def path(self, k: int, times: Array) -> Array:
        """States (n, 6) of flight k at sorted ``times``, as :meth:`propagate` gives them, without their covariances."""
        times = np.ascontiguousarray(times)
        if not self.noise.forced:
            return self.flown(k, times, derivatives=False)[0]
        return self.force_path(k).states_at(times, *self.flown(k, times))

    def propagate(self, k: int, times: Array) -> tuple[Array, Array]:
        """States (n, 6) of flight k at sorted ``times`` and their covariances (n, 6, 6)."""
        times = np.ascontiguousarray(times)
        out, derivative = self.flown(k, times)
        if not self.noise.forced:
            return out, derivative @ self.covariances[k] @ derivative.transpose(0, 2, 1)
        return self.force_path(k).at(times, out, derivative)

    def residuals(self, k: int, index: NDArray[np.int64]) -> Array:
        """What frames ``index`` miss flight k by, (N, 3): x, y (m), angle (rad)."""
        return self.measured(index) - self.markers_at(self.path(k, self.run.time_s[index]))

    def rests(self, k: int) -> bool:
        """Whether the disk lies still on the floor in flight k: in its middle and at its end (how it began, friction
        has soon forgotten).
        """
        return bool(self._resting[k])

    @cached_property
    def _resting(self) -> NDArray[np.bool_]:
        """Of all flights (F,)."""
        run = self.run
        looked = np.array([((one.first + one.last) // 2, one.last) for one in self.flights], np.int64).reshape(-1, 2)
        states = np.empty((len(looked), 2, STATES))
        for k, index in enumerate(looked):
            states[k] = self.path(k, run.time_s[index])
        host, rate = (motion[looked] for motion in run.host_at_frames)
        arm = states[..., :2] - host[..., :2]
        slide = states[..., 3:5] - rate[..., :2] - rate[..., 3:4] * np.stack([-arm[..., 1], arm[..., 0]], -1)
        known = [np.any(run.angle_sd_rad[one.first : one.last + 1] < NO_ANGLE_SD_RAD) for one in self.flights]
        rim = run.radius_m * np.abs(states[..., 5] - rate[..., 3]) * np.array(known, bool)[:, None]
        length, time = run.own_units
        fastest = np.hypot(slide[..., 0], slide[..., 1]) + rim
        return np.asarray(np.all(fastest < REST_M_PER_S * length / time, 1), bool)

    def standard_residuals(self, k: int) -> StandardResiduals:
        """What the path of flight k without an unknown force, which follows the noise, misses its own frames by, over
        the sds given.
        """
        index, run = seen_frames(self.run, self.flights[k]), self.run
        states, _ = self.flown(k, np.ascontiguousarray(run.time_s[index]), derivatives=False)
        sd = run.xy_sd_m[index]
        return StandardResiduals(
            index, (self.measured(index) - self.markers_at(states)) / np.column_stack([sd, sd, run.angle_sd_rad[index]])
        )

    def measured(self, index: NDArray[np.int64]) -> Array:
        """x, y without the lens residual, and angle (N, 3) of frames ``index``."""
        return np.asarray(self._seen[index])

    @cached_property
    def _seen(self) -> Array:
        return without_lens(self.run, self.shared)

    def markers_at(self, states: Array) -> Array:
        """Where the markers' origin is at ``states`` (N, 6), and the angle: (N, 3)."""
        c, s = np.cos(states[:, 2]), np.sin(states[:, 2])
        ox, oy = self.shared[:2]
        out = np.empty((len(states), 3))
        out[:, 0] = states[:, 0] + c * ox - s * oy
        out[:, 1] = states[:, 1] + s * ox + c * oy
        out[:, 2] = states[:, 2]
        return out

    def flown(
        self,
        k: int,
        times: Array,
        parameters: Array | None = None,
        free: Sequence[int] = (),
        derivatives: bool = True,
    ) -> tuple[Array, Array]:
        """States (N, 6) of flight k's path without an unknown force at sorted ``times`` and their derivatives (N, 6,
        6 + F) with respect to its start state and the parameters ``free`` (F,); ``parameters``: other than the fit's.
        Without ``derivatives`` there are none (0, 6, 6 + F).
        """
        out = np.empty((len(times), STATES))
        derivative = np.empty((len(times) if derivatives else 0, STATES, STATES + len(free)))
        fly_with_derivatives(
            self.states[k],
            self.reference_s[k],
            times,
            with_impact_before(self.parameters if parameters is None else parameters, self.run, self.flights, k),
            np.array(free, np.int64),
            self.run.flight_rig,
            out,
            derivative,
        )
        if FRICTION in free and len(derivative):
            self._of_the_series(
                derivative[:, :, STATES:], list(free), self.parameters if parameters is None else parameters
            )
        return out, derivative

    def _of_the_series(self, derivative: Array, free: list[int], parameters: Array) -> None:
        """Derivatives (N, 6, F) with respect to the run's own friction and its drift made those with respect to the
        series', in place."""
        share, later = self.run.friction_share, 1 + parameters[DRIFT] * self.run.later_s
        friction = derivative[:, :, free.index(FRICTION)]
        if DRIFT in free:
            drift = derivative[:, :, free.index(DRIFT)]
            drift /= later**2
            drift += parameters[FRICTION] * share * self.run.later_s * friction
        friction *= share * later

    def force_path(self, k: int) -> ForcePath:
        """What the frames of flight k say of the unknown force."""
        if k not in self._force_paths:
            self._force_paths[k] = self._made_force_path(k)
        return self._force_paths[k]

    def _made_force_path(self, k: int) -> ForcePath:
        index = seen_frames(self.run, self.flights[k])
        times = self.run.time_s[index]
        states, derivative = self.flown(k, times)
        white = self.noise.whitening(index, times, self.run.xy_sd_m[index], self.run.angle_sd_rad[index])
        return ForcePath(
            self.noise,
            times,
            white,
            self.measured(index) - self.markers_at(states),
            derivative[:, :3],
        )
