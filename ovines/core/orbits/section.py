"""Poincare sections (one state per period), bifurcation diagrams, basins of attraction: ensembles of plain runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ovines.core.ensemble import ALL_CORES, STATE_PLACES, Workers, inside, simulate_ensemble
from ovines.core.orbits.period import changed, drive_period_s
from ovines.core.packing import pack
from ovines.core.refusal import ScenarioError
from ovines.core.sensitivity.columns import row_of
from ovines.core.sensitivity.run import STATES
from ovines.core.system import parameters as P
from ovines.core.system.model import Scenario


def section(
    scenario: Scenario,
    periods: int,
    transient: int = 0,
    phase: float = 0.0,
    starts: Mapping[str, np.ndarray] | None = None,
    workers: Workers = ALL_CORES,
) -> np.ndarray:
    """Stroboscopic Poincare section: states (runs, periods, 12) once per period of the drive.

    Parameters
    ----------
    scenario
        With a periodic drive.
    periods, transient
        Periods kept, and those before them.
    phase
        Part of a period (0 up to 1) at which the section is taken.
    starts
        Values (n,) of states by name, one run each; None: the scenario's own start.
    workers
        As :func:`ovines.core.ensemble.simulate_ensemble` has them.

    Examples
    --------
    >>> import numpy as np
    >>> from ovines.core.orbits.section import section
    >>> from ovines.notebook import read_scenario
    >>> found = section(read_scenario("impact-oscillator"), periods=3, transient=200)
    >>> found.shape, bool(np.ptp(found[0, :, 6]) < 1e-6)  # the same place every period
    ((1, 3, 12), True)
    """
    if periods < 1 or transient < 0 or not 0.0 <= phase < 1.0:
        raise ScenarioError(
            f"{periods} periods after {transient} at phase {phase:g}",
            "at least one, none or more, 0 up to 1",
            "correct",
        )
    period = drive_period_s(scenario)
    times = period * (transient + phase + np.arange(1, periods + 1))
    rows = len(next(iter(starts.values()))) if starts else 1
    made = replace(scenario, duration_s=float(times[-1]) * (1.0 + 1e-12), max_impacts=10**9)
    found = simulate_ensemble(
        made, rows, dict(starts or {}), np.random.default_rng(0), sample_times_s=times, workers=workers
    )
    return found.samples


@dataclass(frozen=True)
class Bifurcation:
    """``values`` (n,) of the number ``over``; ``states`` (n, periods, 12) of the section at each; ``impacts`` (n,) per
    period of the drive.
    """

    over: str
    values: np.ndarray
    states: np.ndarray
    impacts: np.ndarray


def bifurcation(
    scenario: Scenario,
    over: str,
    values: Sequence[float],
    periods: int = 100,
    transient: int = 200,
    carry: bool = True,
    progress: Callable[[int], object] | None = None,
) -> Bifurcation:
    """Section at each value of a number, in the order given; with ``carry`` each run begins where the last one ended.

    Examples
    --------
    >>> from ovines.core.orbits.section import bifurcation
    >>> from ovines.notebook import read_scenario
    >>> found = bifurcation(read_scenario("impact-oscillator"), "drive_frequency_factor", [0.98, 1.0, 1.02], 4, 100)
    >>> found.states.shape, found.impacts.tolist()
    ((3, 4, 12), [1.0, 1.0, 1.0])
    """
    states, impacts = [], []
    start = scenario
    for value in values:
        made = replace(
            changed(scenario, over, float(value)), initial_nes=start.initial_nes, initial_host=start.initial_host
        )
        period = drive_period_s(made)
        times = period * np.arange(transient, transient + periods + 1)
        made = replace(made, duration_s=float(times[-1]) * (1.0 + 1e-12), max_impacts=10**9)
        whole = simulate_ensemble(made, 1, {}, np.random.default_rng(0), sample_times_s=times, workers=Workers(jobs=1))
        before = replace(made, duration_s=max(float(times[0]), 1e-9 * period))
        early = (
            simulate_ensemble(before, 1, {}, np.random.default_rng(0), workers=Workers(jobs=1)) if transient else None
        )
        states.append(whole.samples[0, 1:])
        impacts.append((int(whole.n_impacts[0]) - (int(early.n_impacts[0]) if early else 0)) / periods)
        if carry:
            last = whole.samples[0, -1]
            start = replace(scenario, initial_nes=tuple(last[:6]), initial_host=tuple(last[6:]))
        if progress is not None:
            progress(1)
    return Bifurcation(over, np.asarray(values, dtype=float), np.array(states), np.array(impacts))


@dataclass(frozen=True)
class Attractor:
    """``period`` in drive periods (0: none up to the longest asked for), ``states`` (period, 12; one where there is
    none), ``share`` of the starts that end there, ``impacts`` per drive period.
    """

    period: int
    states: np.ndarray
    share: float
    impacts: float


@dataclass(frozen=True)
class Basins:
    """``labels`` (len(y), len(x)): which of ``attractors`` a start ends on; -1 where it is outside the walls."""

    x: tuple[str, np.ndarray]
    y: tuple[str, np.ndarray]
    labels: np.ndarray
    attractors: tuple[Attractor, ...]


def basins(
    scenario: Scenario,
    x: tuple[str, Sequence[float]],
    y: tuple[str, Sequence[float]],
    transient: int = 200,
    longest: int = 8,
    seen: Sequence[str] = STATES[:4],
    near: float = 1e-3,
    workers: Workers = ALL_CORES,
) -> Basins:
    """Basins of attraction over a grid of starts: on which attractor each ends.

    Parameters
    ----------
    scenario
        With a periodic drive.
    x, y
        Names of two states and their values, the map's axes.
    transient
        Periods of the drive before the attractor is looked at.
    longest
        Longest period (in drive periods) that counts as one.
    seen
        States by which attractors differ.
    near
        Two states are one where they differ by less than this, in lengths and speeds of the scenario.

    Returns
    -------
    Basins
        Attractors with the largest basin first; what has no period up to ``longest`` is the last of them.

    Examples
    --------
    >>> from ovines.core.orbits.section import basins
    >>> from ovines.notebook import read_scenario
    >>> host = read_scenario("impact-oscillator")
    >>> found = basins(host, ("host_x_m", [-1.0, -0.5]), ("host_vx_m_per_s", [0.0, 0.5, 1.0]), transient=100)
    >>> len(found.attractors), found.attractors[0].period
    (1, 1)
    """
    for name, values in (x, y):
        if name not in STATE_PLACES or not len(values):
            raise ScenarioError(
                f"an axis {name!r} of {len(values)} values", "a state and its values", "correct the axis"
            )
    period = drive_period_s(scenario)
    grid_x, grid_y = (one.ravel() for one in np.meshgrid(np.asarray(x[1], float), np.asarray(y[1], float)))
    packed = pack(scenario, with_energy=False)
    rows = np.tile(packed.y, (len(grid_x), 1))
    rows[:, STATE_PLACES[x[0]]], rows[:, STATE_PLACES[y[0]]] = grid_x, grid_y
    fine = np.flatnonzero(inside(packed, rows, np.broadcast_to(packed.drive, (len(rows), *packed.drive.shape))))
    if not len(fine):
        raise ScenarioError("a map whose starts are all outside the walls", "starts inside", "move the ranges")
    times = period * np.arange(transient, transient + 2 * longest + 1)
    made = replace(scenario, duration_s=float(times[-1]) * (1.0 + 1e-12), max_impacts=10**9)
    spread = {x[0]: grid_x[fine], y[0]: grid_y[fine]}
    found = simulate_ensemble(made, len(fine), spread, np.random.default_rng(0), sample_times_s=times, workers=workers)
    chosen = [row_of(name) for name in seen]
    radius = float(packed.p[P.RADIUS])
    length, speed = float(packed.p[P.LENGTH]), float(packed.p[P.SPEED])
    units = np.array([length, length, speed, speed, 1.0, speed / radius] * 2)[chosen]
    scaled = found.samples[:, :, chosen] / units
    labels = np.full(len(grid_x), -1)
    labels[fine], kinds = _kinds(scaled, longest, near)
    attractors = []
    for label, (repeat, row) in enumerate(kinds):
        states = found.samples[row, -max(repeat, 1) :]
        share = float(np.mean(labels[fine] == label))
        attractors.append(Attractor(repeat, states, share, _impacts_per_period(found.samples[row, -1], made, period)))
    shape = (len(y[1]), len(x[1]))
    axes = ((x[0], np.asarray(x[1], float)), (y[0], np.asarray(y[1], float)))
    return Basins(*axes, labels.reshape(shape), tuple(attractors))


def _impacts_per_period(last: np.ndarray, made: Scenario, period: float) -> float:
    """From the state ``last`` (12,) on, at a whole number of periods."""
    periods = 40
    again = replace(
        made, initial_nes=tuple(last[:6]), initial_host=tuple(last[6:]), duration_s=periods * period * (1.0 + 1e-12)
    )
    return (
        float(simulate_ensemble(again, 1, {}, np.random.default_rng(0), workers=Workers(jobs=1)).n_impacts[0]) / periods
    )


def _kinds(scaled: np.ndarray, longest: int, near: float) -> tuple[np.ndarray, list[tuple[int, int]]]:
    """Label of each run from its last states (runs, 2 longest + 1, n), and per label (period, a run of it)."""
    runs, last = len(scaled), scaled.shape[1] - 1
    repeat = np.zeros(runs, dtype=int)
    for period in range(longest, 0, -1):
        back = np.abs(scaled[:, period:] - scaled[:, :-period]).max(axis=(1, 2))
        repeat[back < near] = period
    labels = np.full(runs, -1)
    kinds: list[tuple[int, int, int]] = []  # size, period, a run
    for period in range(1, longest + 1):
        left = np.flatnonzero(repeat == period)
        while len(left):
            orbit = scaled[left[0], last - period + 1 : last + 1]
            distance = np.abs(scaled[left][:, last, None, :] - orbit[None]).max(axis=2).min(axis=1)
            same = left[distance < 3.0 * near]
            labels[same] = len(kinds)
            kinds.append((len(same), period, int(left[0])))
            left = left[distance >= 3.0 * near]
    wild = np.flatnonzero(repeat == 0)
    order = sorted(range(len(kinds)), key=lambda n: -kinds[n][0])
    renamed = np.empty(len(kinds) + 1, dtype=int)
    renamed[order] = np.arange(len(kinds))
    labels[repeat > 0] = renamed[labels[repeat > 0]]
    named = [(kinds[n][1], kinds[n][2]) for n in order]
    if len(wild):
        labels[wild] = len(named)
        named.append((0, int(wild[0])))
    return labels, named
