"""Whole runs, measured and simulated, as distributions over an ensemble of starts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.comparison.flights_ahead import fly, touches
from analysis.comparison.simulated_rig import laws_from, moved
from analysis.motion.host_path import HostMotion
from ovines.core import Scenario, simulate

Array = NDArray[np.float64]
# Impacts below this drown in measured noise, and chatter has infinitely many: statistics count the others.
COUNTED_SPEED_M_PER_S = 0.1
# A flight of fewer frames gives no velocity worth the name.
APART_FRAMES = 5
# How far a simulated run's start scatters about the measured one: sds of x, y (m), velocity (m/s), angle, spin (rad/s)
# of a state in the middle of a flight.
START_SD = (2e-5, 2e-5, 5e-3, 5e-3, 0.0, 0.5)
RANGE = (0.05, 0.95)
# A flight this short has no middle worth starting from.
SHORTEST_FLIGHT_S = 0.01
COLUMNS = ("quantity", "measured", "simulated", "low", "high", "p", "ks")


def run_statistics(
    motion: pd.DataFrame,
    impacts: pd.DataFrame,
    states: dict[str, Array],
    scenario: Scenario,
    host_motion: HostMotion,
    rng: np.random.Generator,
    runs: int,
    contacts_s: Sequence[tuple[float, float]] = (),
) -> tuple[pd.DataFrame, dict[str, tuple[Array, Array]]]:
    """Whole runs as distributions: impact rate, normal speeds, kinetic energies, azimuths.

    ``quantity, measured, simulated, low, high, p, ks``: medians (the rate itself), the 5-95 % range over the
    simulated runs of the same statistic, and the share of runs at least as far from their median as the
    measured one (two-sided), and the Kolmogorov-Smirnov distance of all values.  Empty without a usable start.
    """
    start = _first_start(motion, impacts, states, scenario, host_motion, contacts_s)
    if start is None or runs < 1:
        return pd.DataFrame(columns=list(COLUMNS)), {}
    start_s, state = start
    duration = float(motion["time_s"].max()) - start_s
    rate = 1 / float(np.median(np.diff(motion["time_s"])))
    later = impacts[impacts["time_s"] > start_s]
    counted = later[_resolved(later["time_s"], later["normal_speed_before_m_per_s"], rate)]
    measured = _quantities(
        counted["normal_speed_before_m_per_s"],
        counted["azimuth_rad"],
        len(counted) / duration,
        _energy(scenario, motion[motion["time_s"] > start_s]),
    )
    copies = []
    driven = moved(scenario.host, host_motion, start_s, duration)
    scenario = replace(scenario, laws=laws_from(scenario.laws, host_motion, start_s))
    for _ in range(runs):
        scattered = np.array(state) + rng.normal(0, 1, 6) * START_SD
        result = simulate(
            replace(scenario, host=driven, initial_nes=tuple(scattered), duration_s=duration, sample_rate_hz=rate)
        )
        hit = result.impacts
        hit = hit[_resolved(hit["time_s"], hit["normal_speed_before_m_per_s"], rate)]
        copies.append(
            _quantities(
                hit["normal_speed_before_m_per_s"],
                hit["azimuth_rad"],
                len(hit) / duration,
                _energy(scenario, pd.DataFrame({"time_s": result.time_s, **result.motion})),
            )
        )
    return _against(measured, copies)


def _against(
    measured: dict[str, Array], copies: list[dict[str, Array]]
) -> tuple[pd.DataFrame, dict[str, tuple[Array, Array]]]:
    """Each statistic of the measured run among those of the simulated ones."""
    from scipy.stats import ks_2samp  # takes long to load, and only comparisons need it

    rows, samples = [], {}
    for name, value in measured.items():
        middles = np.array([np.median(copy[name]) if len(copy[name]) else np.nan for copy in copies])
        middles = middles[np.isfinite(middles)]
        if not len(value) or not len(middles):
            continue
        pooled = np.concatenate([copy[name] for copy in copies])
        here, centre = float(np.median(value)), float(np.median(middles))
        p = float((1 + np.sum(np.abs(middles - centre) >= abs(here - centre))) / (1 + len(middles)))
        low, high = np.quantile(middles, RANGE)
        rows.append(
            (
                name,
                here,
                centre,
                float(low),
                float(high),
                p,
                float(ks_2samp(value, pooled).statistic) if len(value) > 1 else np.nan,
            )
        )
        samples[name] = (value, pooled)
    return pd.DataFrame(rows, columns=list(COLUMNS)), samples


def _resolved(time_s: Array, normal_speed_m_per_s: Array, rate_hz: float) -> NDArray[np.bool_]:
    """Which impacts a camera of this rate can tell: fast enough, ``APART_FRAMES`` from their neighbours.

    Both sides are counted alike; otherwise simulated chatter, which no measurement resolves, would be a gap.
    """
    times = np.concatenate([[-np.inf], np.asarray(time_s, float), [np.inf]])
    apart = np.minimum(np.diff(times)[:-1], np.diff(times)[1:]) >= APART_FRAMES / rate_hz
    return apart & (np.asarray(normal_speed_m_per_s, float) > COUNTED_SPEED_M_PER_S)


def _quantities(speeds: Array, azimuths: Array, rate_per_s: float, energies: Array) -> dict[str, Array]:
    return {
        "impact_rate_hz": np.array([rate_per_s]),
        "normal_speed_m_per_s": np.asarray(speeds, float),
        "energy_j": energies,
        "azimuth_rad": np.mod(np.asarray(azimuths, float) + np.pi, 2 * np.pi) - np.pi,
    }


def _energy(scenario: Scenario, motion: pd.DataFrame) -> Array:
    """Kinetic energy in the room (J) at each frame, by central differences of the positions: the same on both
    sides.
    """
    if len(motion) < 3:
        return np.empty(0)
    clock = motion["time_s"].to_numpy(float)
    speed = [np.gradient(motion[f"nes_{axis}_m"].to_numpy(float), clock) for axis in "xy"]
    energy = 0.5 * scenario.nes.mass_kg * (speed[0] ** 2 + speed[1] ** 2)
    return energy[np.isfinite(energy)]


def _first_start(
    motion: pd.DataFrame,
    impacts: pd.DataFrame,
    states: dict[str, Array],
    scenario: Scenario,
    host_motion: HostMotion,
    contacts_s: Sequence[tuple[float, float]],
) -> tuple[float, tuple[float, ...]] | None:
    """The state in the middle of the first flight that was measured well: time, (x, y, vx, vy, angle, spin).

    The middle, because a start beside the wall could lie outside of it by its noise.
    """
    times, clock = impacts["time_s"].to_numpy(float), motion["time_s"].to_numpy(float)
    place = motion[["nes_x_m", "nes_y_m"]].to_numpy(float)
    for k in range(len(times) - 1):
        if (
            not np.isfinite(states["after"][k]).all()
            or times[k + 1] - times[k] < SHORTEST_FLIGHT_S
            or touches(contacts_s, times[k], times[k + 1])
        ):
            continue
        seen = np.flatnonzero((clock > times[k]) & (clock < times[k + 1]) & np.isfinite(place).all(1))
        if len(seen):
            middle, velocity = seen[len(seen) // 2], states["after"][k]
            path = fly(
                scenario,
                host_motion,
                times[k],
                (*place[seen[0]], *velocity[:2], 0.0, velocity[2]),
                float(clock[middle] - times[k]),
            )
            rates = [float((column[-1] - column[-2]) / (path[0][-1] - path[0][-2])) for column in path[1:]]
            return float(clock[middle]), (*place[middle], *rates[:2], 0.0, rates[2])
    return None
