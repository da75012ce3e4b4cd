"""Sensitivities of one run: ``sensitivities(scenario)``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ovines.core.integration.sampling import take_sample
from ovines.core.packing import pack
from ovines.core.refusal import ScenarioError
from ovines.core.sensitivity.columns import names_for, refuse_unfollowed, tangents_of
from ovines.core.sensitivity.follow import CORNERED, FOLLOWED, GRAZED, Found, follow
from ovines.core.sensitivity.tangents import N_ROWS
from ovines.core.simulate import sample_times
from ovines.core.system import parameters as P
from ovines.core.system.model import Scenario
from ovines.core.system.packed import Packed

STATES = tuple(
    f"{body}_{name}"
    for body in ("nes", "host")
    for name in ("x_m", "y_m", "vx_m_per_s", "vy_m_per_s", "angle_rad", "spin_rad_per_s")
)


@dataclass(frozen=True)
class Sensitivities:
    """How a run answers: ``names`` (m) of what was varied; ``time_s`` (n,) with ``state`` (n, 12; :data:`STATES`) and
    its derivatives ``by`` (n, 12, m); ``impact_time_s`` (k,) and theirs, ``impact_time_by`` (k, m).

    Derivatives are of the state at a fixed instant, in SI units of state over name.  They hold as long as the
    same impacts happen in the same order; in a chaotic run they grow exponentially and lose as many digits as the run.
    """

    scenario: Scenario
    names: tuple[str, ...]
    time_s: np.ndarray
    state: np.ndarray
    by: np.ndarray
    impact_time_s: np.ndarray
    impact_time_by: np.ndarray


def sensitivities(
    scenario: Scenario, by: Sequence[str] | None = None, times_s: np.ndarray | None = None
) -> Sensitivities:
    """Derivatives of the state and of impact times with respect to start, numbers and drive, exact through impacts.

    Parameters
    ----------
    scenario
        One run.
    by
        Names of what is varied (``nes_x_m`` ... ``restitution``, ``drive_amplitude_factor``, ``nes_radius_m``); None:
        all that mean something for this run.
    times_s
        Instants (n,) from 0 up; None: the run's own samples, and its end.

    Returns
    -------
    Sensitivities

    Raises
    ------
    ScenarioError
        The path grazes a wall or rests in a corner: there derivatives do not exist (or are not followed); effects that
        the variational equations leave out; names that mean nothing for this run.

    Examples
    --------
    >>> from ovines.core.sensitivity.run import sensitivities
    >>> from ovines.notebook import read_scenario
    >>> found = sensitivities(read_scenario("table-3"), by=["nes_y_m", "restitution"], times_s=[3.0])
    >>> found.by.shape, found.impact_time_by[0].round(4).tolist()  # fall time sqrt(2 h/g), h counts from the floor
    ((1, 12, 2), [0.0753, 0.0])
    """
    packed = pack(scenario, with_energy=False)
    refuse_unfollowed(packed)
    names = tuple(by) if by is not None else names_for(packed)
    start, numbers = tangents_of(packed, names)
    times = asked_times(scenario, times_s)
    found, count = follow_packed(packed, start, numbers, times)
    states = np.array([sampled(packed, t, y) for t, y in zip(times, found.states, strict=True)]).reshape(-1, 12)
    return Sensitivities(scenario, names, times, states, found.tangents, found.impacts[:count, 0], found.delays[:count])


def asked_times(scenario: Scenario, times_s: np.ndarray | None) -> np.ndarray:
    """Instants (n,), or the run's samples and its end; refused where they are no instants of the run."""
    if times_s is None:
        return np.unique(np.append(sample_times(scenario), scenario.duration_s))
    times = np.atleast_1d(np.asarray(times_s, dtype=float))
    if not (times.size and np.isfinite(times).all() and times[0] >= 0.0 and (np.diff(times) > 0.0).all()):
        raise ScenarioError(f"times_s of {times.size} numbers", "finite, increasing, from 0 up", "correct times_s")
    return times


def follow_packed(
    packed: Packed,
    start: np.ndarray,
    numbers: np.ndarray,
    times: np.ndarray,
    kept: Sequence[int] = (),
    begin_s: float = 0.0,
) -> tuple[Found, int]:
    """Run with tangents to the last of ``times``; what was kept, and the number of impacts.

    ``start`` (12, m), ``numbers`` (13, m); ``kept``: at each of ``times`` tangents are made
    orthonormal again, in these rows.
    """
    m, rows = start.shape[1], 1024
    system = packed.system
    while True:
        found = Found(
            times,
            np.full((len(times), P.N_STATE), np.nan),
            np.full((len(times), N_ROWS, m), np.nan),
            np.zeros((len(times) if len(kept) else 0, m)),
            np.isin(np.arange(N_ROWS), kept).astype(float),
            np.zeros((rows, 3)),
            np.zeros((rows, m)),
        )
        y, s = packed.y.copy(), np.zeros((N_ROWS, m + 1))
        s[:, :m] = start
        how, reached, count = follow(system, y, s, numbers, begin_s, found)
        if how != FOLLOWED:
            refuse_end(how, reached)
        if count <= rows:
            return found, count
        rows = count


def refuse_end(how: int, time_s: float) -> None:
    """`ScenarioError` for a run whose tangents end before it does."""
    if how == GRAZED:
        raise ScenarioError(
            f"a path that grazes a wall at {time_s:.6g} s",
            "impacts with some normal speed: at a graze the state changes with the root of the start, and has no "
            "derivative",
            "end the run before it, or move the start",
        )
    if how == CORNERED:
        raise ScenarioError(
            f"a disk that rests in a corner from {time_s:.6g} s on",
            "flights, impacts, and contact with one wall at a time",
            "end the run before it",
        )
    raise ScenarioError(
        f"more impacts than run.max_impacts before {time_s:.6g} s", "fewer", "raise run.max_impacts, or end the run"
    )


def sampled(packed: Packed, time_s: float, y: np.ndarray) -> np.ndarray:
    """NES and Host (12,) of an engine state."""
    row = np.zeros(12)
    take_sample(float(time_s), y, packed.system, np.zeros((P.N_WORK, P.N_STATE)), row)
    return row
