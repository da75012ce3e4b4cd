"""Frequency response of a sprung Host with its NES, from ensembles of runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ovines.core.absorber.linear import bare_gain, ground_amplitude_m
from ovines.core.absorber.sprung import suspension_of
from ovines.core.ensemble import ALL_CORES, Workers, simulate_ensemble
from ovines.core.orbits.period import changed, drive_period_s
from ovines.core.packing import contact_radius
from ovines.core.refusal import ScenarioError
from ovines.core.system.model import Scenario

PER_PERIOD = 24  # samples of a period of the drive
SCATTER = 0.2  # sd of the disk's start, of the contact radius


@dataclass(frozen=True)
class Response:
    """Host's amplitude along x and y over ``frequency_hz`` (n,) of the ground.

    ``amplitude_m`` (n, runs, 2) of each run (root of twice the variance over the last periods: a sine's amplitude);
    ``bare_m`` (n, 2) without NES and ``stuck_m`` (n, 2) with a disk that sticks to the floor, closed forms;
    ``impacts_per_period`` (n,) on average.
    """

    frequency_hz: np.ndarray
    amplitude_m: np.ndarray
    bare_m: np.ndarray
    stuck_m: np.ndarray
    impacts_per_period: np.ndarray

    def level_m(self) -> np.ndarray:
        """Amplitude of both axes together, of each run (n, runs)."""
        return np.linalg.norm(self.amplitude_m, axis=2)


def frequency_response(
    scenario: Scenario,
    factors: Sequence[float] | np.ndarray,
    runs: int,
    rng: np.random.Generator,
    transient: int = 100,
    periods: int = 50,
    workers: Workers = ALL_CORES,
) -> Response:
    """Host's amplitude at factors of the ground's frequency; the ground's amplitude stays.

    Parameters
    ----------
    scenario
        A sprung Host over a ground of one frequency, along x or y or both, with a NES.
    factors
        Of the scenario's own frequency.
    runs
        Runs at each, from starts of the disk that scatter by a fifth of the contact radius.
    rng
        For the starts.
    transient, periods
        Periods of the drive before, and over which, the amplitude is measured.

    Returns
    -------
    Response

    Raises
    ------
    ScenarioError
        A Host that is not sprung, a ground that does not shake, nothing to run.

    Examples
    --------
    >>> import numpy as np
    >>> from ovines.core.absorber.response import frequency_response
    >>> from ovines.notebook import read_scenario
    >>> found = frequency_response(read_scenario("sprung-host"), [0.9, 1.0, 1.1], 4, np.random.default_rng(0))
    >>> bool(found.level_m()[1].mean() < 0.8 * found.bare_m[1, 0])  # at resonance the NES takes a part
    True
    """
    suspension_of(scenario)
    at = np.asarray(factors, dtype=float)
    if not (len(at) and np.isfinite(at).all() and bool((at > 0.0).all()) and runs > 0 and periods > 0):
        raise ScenarioError(f"{len(at)} frequencies, {runs} runs, {periods} periods", "some, above 0", "correct them")
    size, room = ground_amplitude_m(scenario), SCATTER * contact_radius(scenario)
    if not size.any():
        raise ScenarioError("a ground that stands still", "host.suspension.ground with sines", "give the drive")
    amplitude = np.zeros((len(at), runs, 2))
    impacts, frequency = np.zeros(len(at)), np.zeros(len(at))
    for n, factor in enumerate(at):
        made = changed(scenario, "drive_frequency_factor", float(factor))
        period = drive_period_s(made)
        times = period * (transient + np.arange(periods * PER_PERIOD) / PER_PERIOD)
        made = replace(made, duration_s=period * (transient + periods), max_impacts=10**9)
        spread = {"nes_x_m": room, "nes_y_m": room}
        found = simulate_ensemble(made, runs, spread, rng, sample_times_s=times, tolerance=1e-7, workers=workers)
        amplitude[n] = np.sqrt(2.0 * np.var(found.samples[:, :, 6:8], axis=1))
        impacts[n] = float(np.mean(found.n_impacts)) / (transient + periods)
        frequency[n] = 1.0 / period
    bare = bare_gain(scenario, frequency) * size
    stuck = bare_gain(scenario, frequency, scenario.nes.mass_kg) * size
    return Response(frequency, amplitude, bare, stuck, impacts)
