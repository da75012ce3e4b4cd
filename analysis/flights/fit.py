"""Flights between impacts, each fitted with the simulator's own flight model to the positions, never to derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from analysis.flights.cutting.impact_before import (
    blows_before,
    contact_before,
    contact_before_last,
    impact_before,
    number_of_blows,
    way_before,
)
from analysis.flights.cutting.pieces import Flight, seen_frames
from analysis.flights.cutting.run_data import LENS_POWERS, LENS_TERMS, NO_ANGLE_SD_RAD, RunData
from analysis.flights.equation.model import ANGLE, SPIN, STATES, X, Y
from analysis.flights.equation.parameters import (
    BLOW_TIMES,
    BLOWS,
    CONTACT_BEFORE,
    DRIFT,
    FRICTION,
    IMPACT_BEFORE_S,
    PARAMETERS,
    TWO_BEFORE_X,
    TWO_BEFORE_Y,
    WAY_BEFORE,
)
from analysis.flights.force_path import ForcePath
from analysis.flights.noise import PLAIN, FlightNoise, StandardResiduals
from analysis.flights.single_flight import WhiteFrames, fit_single, fly_with_derivatives, start_state

Array = NDArray[np.float64]

#: the markers' origin against the centre of mass (m)
ORIGIN = ["origin_x", "origin_y"]
# Frames whose parabola is the first guess of a flight: friction turns within longer stretches.
START_FRAMES = 12
# Slower than this against the floor, sliding and rim of the spin together, the disk counts as resting on it (the rig's
# own units).
REST_M_PER_S = 5e-3
#: every shared unknown, in the order of the columns of the evidence
SHARED: list[str] = [*PARAMETERS, *ORIGIN, *LENS_TERMS]


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
    the frames is fitted as if there were none; what the force changes is linear about it (:class:`ForcePath`).

    Examples
    --------
    Are flights under the identified floor friction noise about the fitted paths, and without friction? Chi-square per
    degree of freedom, median of the flights.

    >>> from ovines.notebook import analyse, identify, read_calibration, read_recording, read_table, triangulate
    >>> recording = read_recording("sample_data/series_tilted/run-01")
    >>> cameras = read_calibration(recording.calibration_file)
    >>> points = triangulate(read_table(recording.folder / "tracks.parquet", "tracks"), cameras, recording)
    >>> motion = analyse(points, recording)
    >>> motion = motion[motion["time_s"] < 0.6]
    >>> rig = identify(motion, recording).rig
    >>> import numpy as np
    >>> from analysis.flights.fit import fit_flights
    >>> run, known = rig.runs[0], rig.floor.fits[0]
    >>> for parameters in known.parameters, np.zeros_like(known.parameters):
    ...     fits = fit_flights(run.data, run.flights, parameters, known.shared)
    ...     print(round(float(np.median(fits.misfit / fits.freedom)), 1))
    0.9
    34.3
    """
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
    own[CONTACT_BEFORE] = contact_before(run, flights, k)[: len(CONTACT_BEFORE)]
    blows = blows_before(run, flights, k)
    own[BLOW_TIMES : BLOW_TIMES + blows.size] = blows.ravel()
    own[BLOWS] = number_of_blows(flights, k)
    own[WAY_BEFORE] = way_before(run, flights, k)
    own[TWO_BEFORE_X], own[TWO_BEFORE_Y] = contact_before_last(run, flights, k)[:2]
    return own


def without_lens(run: RunData, shared: Array) -> Array:
    """x, y less the lens residual of ``shared``, and angle (N, 3) of all frames."""
    n = len(LENS_POWERS)
    lens = run.lens_terms
    return np.column_stack(
        [run.xy_m[:, 0] - lens @ shared[2 : 2 + n], run.xy_m[:, 1] - lens @ shared[2 + n :], run.angle_rad]
    )


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
        rim = run.radius_m * np.abs(states[..., SPIN] - rate[..., 3]) * np.array(known, bool)[:, None]
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
        c, s = np.cos(states[:, ANGLE]), np.sin(states[:, ANGLE])
        ox, oy = self.shared[:2]
        out = np.empty((len(states), 3))
        out[:, 0] = states[:, X] + c * ox - s * oy
        out[:, 1] = states[:, Y] + s * ox + c * oy
        out[:, 2] = states[:, ANGLE]
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
