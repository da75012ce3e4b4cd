"""Periodic orbits by Newton's method on the stroboscopic map, followed over a parameter through folds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ovines.core.orbits.period import changed, drive_period_s
from ovines.core.packing import pack
from ovines.core.refusal import ScenarioError
from ovines.core.sensitivity.columns import names_for, refuse_unfollowed, row_of, tangents_of
from ovines.core.sensitivity.run import STATES, follow_packed, sampled
from ovines.core.sensitivity.strike import flow
from ovines.core.system import parameters as P
from ovines.core.system.model import Scenario
from ovines.core.system.packed import Contact, Packed

CLOSED = 1e-10  # of length and speed: an orbit that comes back so near is closed
MOST_STEPS = 25
FACTORS = ("drive_amplitude_factor", "drive_frequency_factor")


@dataclass(frozen=True)
class Orbit:
    """A periodic orbit: ``value`` of the parameter, ``period_s``, ``state`` (12,) at time 0 (columns ``STATES``),
    complex ``multipliers`` of the unknowns (largest first), ``impact_time_s`` and ``impact_speed_m_per_s`` in it,
    and ``gap`` by which it misses closing, in lengths and speeds of the scenario.
    """

    value: float
    period_s: float
    state: np.ndarray
    multipliers: np.ndarray
    impact_time_s: np.ndarray
    impact_speed_m_per_s: np.ndarray
    gap: float

    @property
    def stable(self) -> bool:
        """Whether every multiplier is inside the unit circle."""
        return bool(np.all(np.abs(self.multipliers) < 1.0))


@dataclass(frozen=True)
class _Return:
    """One period: how far the unknowns come back from, its slopes over them (n, n) and over the parameter (n,)."""

    miss: np.ndarray
    slopes: np.ndarray
    by_value: np.ndarray
    impacts: np.ndarray


class _Problem:
    """The stroboscopic map of a scenario, its unknowns in units of the scenario's own length and speed."""

    def __init__(self, scenario: Scenario, unknowns: Sequence[str], over: str | None, periods: int) -> None:
        self.scenario, self.unknowns, self.over, self.periods = scenario, tuple(unknowns), over, periods
        packed = pack(scenario, with_energy=False)
        refuse_unfollowed(packed)
        known = names_for(packed)
        self.columns = self.unknowns + ((over,) if over is not None else ())
        if over is not None and over not in known:
            raise ScenarioError(f"orbits over {over!r}", "one of " + ", ".join(known), "correct the name")
        if not self.unknowns or any(name not in known or name not in STATES for name in self.unknowns):
            raise ScenarioError(
                f"unknowns {', '.join(self.unknowns) or 'none'}", "states of bodies that move freely, as nes_x_m",
                "correct the names",
            )  # fmt: skip
        length, speed = float(packed.p[P.LENGTH]), float(packed.p[P.SPEED])
        radius = float(packed.p[P.RADIUS])
        units = (length, length, speed, speed, 1.0, speed / radius)
        self.rows = [row_of(name) for name in self.unknowns]
        self.units = np.array([units[row % 6] for row in self.rows])

    def period_s(self, scenario: Scenario) -> float:
        return self.periods * drive_period_s(scenario)

    def at(self, z: np.ndarray, value: float | None) -> Scenario:
        """The scenario that starts at unknowns ``z``."""
        made = self.scenario if self.over is None or value is None else changed(self.scenario, self.over, value)
        start = list(made.initial_nes) + list(made.initial_host)
        for row, number in zip(self.rows, z * self.units, strict=True):
            start[row] = float(number)
        return replace(made, initial_nes=tuple(start[:6]), initial_host=tuple(start[6:]))

    def once(self, z: np.ndarray, value: float | None) -> _Return:
        """One return of the map."""
        made = self.at(z, value)
        period = self.period_s(made)
        packed = pack(replace(made, duration_s=period), with_energy=False)
        start, numbers = tangents_of(packed, self.columns)
        found, count = follow_packed(packed, start, numbers, np.array([period]))
        end = sampled(packed, period, found.states[-1])
        n = len(self.rows)
        slopes = found.tangents[-1][self.rows]
        by_value = np.zeros(n)
        if self.over is not None and value is not None:
            by_value = slopes[:, n].copy()
            if self.over in FACTORS:
                by_value /= value  # columns are per factor of the changed drive
            if self.over == "drive_frequency_factor":
                by_value -= self.rates(packed, period, found.states[-1])[self.rows] * period / value
        return _Return(
            (end[self.rows] / self.units) - z,
            slopes[:, :n] * self.units[None, :] / self.units[:, None],
            by_value / self.units,
            found.impacts[:count],
        )

    @staticmethod
    def rates(packed: Packed, time_s: float, y: np.ndarray) -> np.ndarray:
        out = np.zeros(12)
        flow(time_s, y, Contact(P.FLIGHT, -1, 0.0), packed.system, np.zeros((P.N_WORK, P.N_STATE)), out)
        return out

    def orbit(self, z: np.ndarray, value: float | None, back: _Return) -> Orbit:
        made = self.at(z, value)
        period = self.period_s(made)
        multipliers = np.linalg.eigvals(back.slopes)
        multipliers = multipliers[np.argsort(-np.abs(multipliers))]
        state = np.array([*made.initial_nes, *made.initial_host])
        gap = float(np.max(np.abs(back.miss)))
        return Orbit(
            np.nan if value is None else value, period, state, multipliers, back.impacts[:, 0], back.impacts[:, 2], gap
        )


def periodic_orbit(scenario: Scenario, unknowns: Sequence[str], periods: int = 1) -> Orbit:
    """The periodic orbit near a scenario's start, stable or not.

    Parameters
    ----------
    scenario
        Its start is the guess; its drive must be periodic.
    unknowns
        States that must come back (``nes_x_m``, ``nes_vx_m_per_s`` ...): those of the bodies that move by themselves,
        in the directions in which they move.
    periods
        Periods of the drive in one of the orbit.

    Returns
    -------
    Orbit
        With Floquet multipliers, from sensitivities that are exact through every impact.

    Raises
    ------
    ScenarioError
        Newton's method does not close the orbit from there, or it grazes a wall.

    Examples
    --------
    >>> from ovines.core.orbits.periodic import periodic_orbit
    >>> from ovines.notebook import read_scenario
    >>> orbit = periodic_orbit(read_scenario("impact-oscillator"), ["host_x_m", "host_vx_m_per_s"])
    >>> orbit.stable, len(orbit.impact_time_s), bool(orbit.gap < 1e-10)
    (True, 1, True)
    """
    problem = _Problem(scenario, unknowns, None, periods)
    start = np.array([*scenario.initial_nes, *scenario.initial_host])
    z, back = _close(problem, start[problem.rows] / problem.units)
    return problem.orbit(z, None, back)


def _close(problem: _Problem, z: np.ndarray) -> tuple[np.ndarray, _Return]:
    """Newton's method with halved steps."""
    back = problem.once(z, None)
    for _ in range(MOST_STEPS):
        miss = float(np.max(np.abs(back.miss)))
        if miss < CLOSED:
            return z, back
        step = np.linalg.lstsq(np.eye(len(z)) - back.slopes, back.miss, rcond=1e-12)[0]
        for part in 0.5 ** np.arange(8):
            try:
                tried = problem.once(z + part * step, None)
            except ValueError:  # a graze, or a start outside the wall: a shorter step
                continue
            if float(np.max(np.abs(tried.miss))) < miss * (1.0 - 0.1 * part) or part < 0.01:
                z, back = z + part * step, tried
                break
        else:
            break
    raise ScenarioError(
        f"no periodic orbit near this start (it misses closing by {float(np.max(np.abs(back.miss))):.2g} of the "
        "scenario's length or speed)",
        "a start near a periodic orbit",
        "start nearer (end of a long run), or ask for other unknowns or more periods",
    )


@dataclass(frozen=True)
class Branch:
    """Periodic orbits along a curve, in its order, and ``ends``: why it stops at its first and last."""

    over: str
    orbits: tuple[Orbit, ...]
    ends: tuple[str, str]


def follow_orbit(
    scenario: Scenario,
    unknowns: Sequence[str],
    over: str,
    between: tuple[float, float],
    periods: int = 1,
    step: float = 0.01,
    most: int = 400,
) -> Branch:
    """Follow a periodic orbit over a number of the scenario, both ways and round folds, until it leaves the range.

    Parameters
    ----------
    scenario, unknowns, periods
        As :func:`periodic_orbit` has them; the curve begins at the scenario's own value.
    over
        Name of a number (``drive_frequency_factor``, ``restitution``, ``drive_amplitude_factor`` ...).
    between
        Lowest and highest value.
    step
        Longest step along the curve, the range being 1.
    most
        Orbits to each side.

    Returns
    -------
    Branch

    Raises
    ------
    ScenarioError
        No orbit to begin with, or names that mean nothing.

    Examples
    --------
    >>> from ovines.core.orbits.periodic import follow_orbit
    >>> from ovines.notebook import read_scenario
    >>> unknowns, over = ["host_x_m", "host_vx_m_per_s"], "drive_frequency_factor"
    >>> branch = follow_orbit(read_scenario("impact-oscillator"), unknowns, over, (0.98, 1.02))
    >>> sorted({len(orbit.impact_time_s) for orbit in branch.orbits}), branch.ends[0]
    ([1], 'the range ends')
    """
    problem = _Problem(scenario, unknowns, over, periods)
    low, high = between
    begin = 1.0 if over in FACTORS else own_value(scenario, over)
    if not (low <= begin <= high and low < high):
        raise ScenarioError(
            f"{over} from {low:g} to {high:g}", f"a range with the scenario's own {begin:g} in it", "widen the range"
        )
    first = periodic_orbit(scenario, unknowns, periods)
    z = first.state[problem.rows] / problem.units
    sides, ends = [], []
    for sign in (-1.0, 1.0):
        orbits, reason = _one_way(problem, z, begin, sign, (low, high), step, most)
        sides.append(orbits)
        ends.append(reason)
    start = problem.orbit(z, begin, problem.once(z, begin))
    return Branch(over, (*reversed(sides[0]), start, *sides[1]), (ends[0], ends[1]))


def own_value(scenario: Scenario, name: str) -> float:
    """The scenario's own value of a number."""
    if name == "floor_friction":
        return scenario.friction.coefficient if scenario.friction else 0.0
    if name == "drive_phase_shift_rad":
        return 0.0
    if name in ("nes_radius_m", "nes_mass_kg"):
        return float(getattr(scenario.nes, name.removeprefix("nes_")))
    if name == "host_radius_m":
        return float(scenario.host.radius_m or np.nan)
    if name in STATES:
        state = (*scenario.initial_nes, *scenario.initial_host)
        return float(state[STATES.index(name)])
    return float(getattr(scenario.impact, name))


def _one_way(
    problem: _Problem, z: np.ndarray, value: float, sign: float, between: tuple[float, float], step: float, most: int
) -> tuple[list[Orbit], str]:
    """Pseudo-arclength steps in one direction; the value counts in units of the range."""
    span = between[1] - between[0]
    back = problem.once(z, value)
    tangent = _tangent(back, span, np.append(np.zeros(len(z)), sign))
    count = len(back.impacts)
    orbits: list[Orbit] = []
    size = step
    while len(orbits) < most:
        found = _corrected(problem, z, value, tangent, size, span)
        if found is not None and len(found[2].impacts) != count:
            found = None  # past a graze: another family
        if found is None:
            size *= 0.5
            if size < 1e-4 * step:
                return orbits, "it grazes a wall, or ends"
            continue
        z, value, back = found
        if not between[0] <= value <= between[1]:
            return orbits, "the range ends"
        orbits.append(problem.orbit(z, value, back))
        tangent = _tangent(back, span, tangent)
        size = min(step, 1.5 * size)
    return orbits, "as many orbits as asked for"


def _tangent(back: _Return, span: float, along: np.ndarray) -> np.ndarray:
    """Unit tangent of the curve, on the side of ``along``."""
    matrix = np.column_stack([back.slopes - np.eye(len(back.miss)), back.by_value * span])
    tangent = np.linalg.svd(matrix)[2][-1]
    return tangent if tangent @ along >= 0.0 else -tangent


def _corrected(
    problem: _Problem, z: np.ndarray, value: float, tangent: np.ndarray, size: float, span: float
) -> tuple[np.ndarray, float, _Return] | None:
    """The orbit one step along the tangent, or None."""
    u = np.append(z, value / span) + size * tangent
    aim = u.copy()
    for _ in range(8):
        try:
            back = problem.once(u[:-1], float(u[-1] * span))
        except ValueError:
            return None
        rest = np.append(back.miss, tangent @ (u - aim))
        if np.max(np.abs(rest)) < CLOSED:
            return u[:-1], float(u[-1] * span), back
        if not np.max(np.abs(rest)) < 1.0:
            return None
        matrix = np.column_stack([back.slopes - np.eye(len(z)), back.by_value * span])
        u = u - np.linalg.lstsq(np.vstack([matrix, tangent]), rest, rcond=1e-13)[0]
    return None
