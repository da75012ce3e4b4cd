"""Measured against simulated: one flight ahead, one impact ahead, and whole-run statistics.

Chaos multiplies an error by about three at every impact, so runs are never laid over each other point by
point: each flight starts from the state measured after its impact, each impact from the state measured before
it, and whole runs are compared through distributions over an ensemble of starts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.stats import ks_2samp

from analysis.host_motion import HostMotion, fit_host_motion
from ovines.core import FloorFriction, Harmonic, Host, ImpactLaw, Nes, Scenario, simulate
from ovines.errors import InputError
from ovines.recording import Recording

Array = NDArray[np.float64]
# 20 kHz samples: between them a disk under 20 m/s^2 strays 6e-9 m from the straight line that interpolates.
SAMPLE_RATE_HZ = 20000.0
# Impacts below this drown in measured noise, and chatter has infinitely many: statistics count the others.
COUNTED_SPEED_M_PER_S = 0.1
AXES = ("x", "y", "z", "rotation")


@dataclass(frozen=True)
class Comparison:
    """Both sides of one recording.

    ``flights``: one row per flight between two impacts; ``impacts``: one row per impact, measured and
    simulated values after it; ``statistics``: one row per quantity of the whole run; ``samples``: the values
    behind them by quantity, (measured, simulated); ``scenario``: what was simulated.
    """

    flights: pd.DataFrame
    impacts: pd.DataFrame
    statistics: pd.DataFrame
    samples: dict[str, tuple[Array, Array]]
    scenario: Scenario


def compare(
    motion: pd.DataFrame,
    impacts: pd.DataFrame,
    identification: pd.DataFrame | None,
    recording: Recording,
    rng: np.random.Generator,
    runs: int = 40,
    contacts_s: Sequence[tuple[float, float]] = (),
) -> Comparison:
    """Compare the measured ``motion`` and ``impacts`` with the simulator at the identified parameters.

    A parameter that was not identified is taken from ``[model]`` of the recording; a bound alone is used at
    its end.  ``runs`` copies of the whole recording start from the first measured flight, scattered by its
    uncertainty (``rng``).  ``contacts_s``: start and end of sustained wall contacts; a stretch between two
    impacts that holds one is no flight.
    """
    host_motion = _host_motion(motion, recording)
    scenario = nominal_scenario(
        identification, recording, host_motion, float(motion["time_s"].max() - motion["time_s"].min())
    )
    states = states_after(impacts, host_motion, scenario.nes.radius_m, scenario.host.radius_m or 0.0)
    flights = one_flight_ahead(motion, impacts, states, scenario, host_motion, contacts_s)
    after = one_impact_ahead(impacts, scenario)
    statistics, samples = run_statistics(
        motion, impacts, states, scenario, host_motion, rng, runs, contacts_s
    )
    return Comparison(flights, after, statistics, samples, scenario)


def nominal_scenario(
    identification: pd.DataFrame | None, recording: Recording, host_motion: HostMotion, duration_s: float
) -> Scenario:
    """The simulator's nominal model of this rig; `InputError` where neither data nor ``[model]`` give a
    parameter of the wall.
    """
    host, nes = recording.settings.bodies.host, recording.settings.bodies.nes
    if host is None or nes is None:
        raise InputError(
            "no [bodies.host] or no [bodies.nes] in recording.toml",
            "both, with the wall and radius_m",
            "add them",
        )
    law = ImpactLaw(
        *(
            _needed(name, identification, recording)
            for name in ("restitution", "wall_friction", "tangential_restitution")
        )
    )
    effects = recording.model.effects if recording.model is not None else ("floor_friction", "spin_coupling")
    floor = _value("floor_friction", identification, recording)
    friction = (
        None
        if not floor
        else FloorFriction(
            floor, "farkas" if "spin_coupling" in effects or "floor_friction" not in effects else "coulomb"
        )
    )
    radius = _contact_radius(identification, nes.radius_m, host.inner_radius_m)
    return Scenario(
        recording.name,
        Nes(nes.radius_m, nes.mass_kg or 1.0, nes.inertia_factor or 0.5),
        Host(
            radius_m=radius,
            polygon_m=host.polygon_m,
            obstacle_radius_m=host.obstacle_radius_m,
            motion="driven",
            drive=harmonics_from(host_motion, 0.0),
        ),
        law,
        max(duration_s, 1e-3),
        friction,
        sample_rate_hz=0.0,
    )


def _needed(name: str, identification: pd.DataFrame | None, recording: Recording) -> float:
    value = _value(name, identification, recording)
    if value is None:
        raise InputError(
            f"no {name}, neither identified nor in [model]",
            "a value",
            f"give {name} in [model], or record impacts that inform it",
        )
    return value


def _value(name: str, identification: pd.DataFrame | None, recording: Recording) -> float | None:
    if identification is not None:
        row = identification[identification["parameter"] == name]
        if len(row):
            for column in ("value", "low", "high"):
                if np.isfinite(row.iloc[0][column]):
                    return _within(name, float(row.iloc[0][column]))
    return getattr(recording.model, name, None) if recording.model is not None else None


def _within(name: str, value: float) -> float:
    """An estimate may stray over the edge of what can be; the simulator may not."""
    return float(
        np.clip(
            value, -1.0 if name == "tangential_restitution" else 0.0, 1.0 if "restitution" in name else np.inf
        )
    )


def _contact_radius(
    identification: pd.DataFrame | None, nes_radius_m: float, inner_radius_m: float | None
) -> float | None:
    """Wall radius that puts the contact edge where the impacts put it, where they tell; None for polygons."""
    if inner_radius_m is None or identification is None:
        return inner_radius_m
    row = identification[identification["parameter"] == "contact_radius_m"]
    found = float(row.iloc[0]["value"]) if len(row) else np.nan
    return found + nes_radius_m if np.isfinite(found) else inner_radius_m


def _host_motion(motion: pd.DataFrame, recording: Recording) -> HostMotion:
    names = ("host_x_m", "host_y_m", "host_z_m", "host_angle_rad")
    position = np.column_stack(
        [motion[n].to_numpy(float) if n in motion else np.full(len(motion), np.nan) for n in names]
    )
    asked = recording.excitation.frequency_hz if recording.excitation is not None else None
    return fit_host_motion(motion["time_s"].to_numpy(float), position, np.full(position.shape, 2e-5), asked)


def harmonics_from(host_motion: HostMotion, start_s: float) -> tuple[Harmonic, ...]:
    """The Host's harmonics with their phases at ``start_s``, as the simulator takes them."""
    found = []
    for axis, row in zip(AXES, host_motion.harmonics, strict=True):
        found.append(Harmonic(axis, float(row[0]), 0.0, np.pi / 2))
        for k in range(1, (len(row) - 1) // 2 + 1):
            cos, sin = row[2 * k - 1], row[2 * k]
            phase = float(np.arctan2(cos, sin) + k * host_motion.omega_rad_per_s * start_s)
            found.append(Harmonic(axis, float(np.hypot(cos, sin)), k * host_motion.frequency_hz, phase))
    return tuple(found)


def states_after(
    impacts: pd.DataFrame, host_motion: HostMotion, nes_radius_m: float, host_radius_m: float
) -> dict[str, Array]:
    """Measured NES velocity and spin after (and before) each impact in the world frame, from the contact's
    speeds: (n, 3) each.

    The inverse of thesis eq. (88): v_N = v_H + v_n e_r + (v_t - R_N omega_N + R_H omega_H) e_theta;
    ``host_radius_m`` is 0 for a polygon; NaN where a speed is missing.
    """
    time_s, azimuth = impacts["time_s"].to_numpy(float), impacts["azimuth_rad"].to_numpy(float)
    wall, normal = host_motion.at(time_s, 1), np.column_stack([np.cos(azimuth), np.sin(azimuth)])
    tangent = np.column_stack([-normal[:, 1], normal[:, 0]])
    found = {}
    for when, sign in (("before", 1.0), ("after", -1.0)):
        v_n = sign * impacts[f"normal_speed_{when}_m_per_s"].to_numpy(float)
        v_t = impacts[f"tangential_speed_{when}_m_per_s"].to_numpy(float)
        spin = impacts[f"spin_{when}_rad_per_s"].to_numpy(float)
        slide = v_t - nes_radius_m * spin + host_radius_m * wall[:, 3]
        found[when] = np.column_stack([wall[:, :2] + v_n[:, None] * normal + slide[:, None] * tangent, spin])
    return found


def one_flight_ahead(
    motion: pd.DataFrame,
    impacts: pd.DataFrame,
    states: dict[str, Array],
    scenario: Scenario,
    host_motion: HostMotion,
    contacts_s: Sequence[tuple[float, float]] = (),
) -> pd.DataFrame:
    """Each flight simulated from the measured state after its impact up to the next one.

    ``start_s, end_s, frames, rms_m, end_m`` (RMS over the frames and at the last one), ``angle_rms_rad``.
    The start place is the mean offset that fits the first three frames: an impact's place is known less well
    than its velocity, and an offset is no prediction.  Flights with fewer than five frames seen have no row.
    """
    clock = motion["time_s"].to_numpy(float)
    place = motion[["nes_x_m", "nes_y_m"]].to_numpy(float)
    angle = (
        motion["nes_angle_rad"].to_numpy(float) if "nes_angle_rad" in motion else np.full(len(motion), np.nan)
    )
    times, rows = impacts["time_s"].to_numpy(float), []
    for k in range(len(times) - 1):
        inside = np.flatnonzero((clock > times[k]) & (clock < times[k + 1]) & np.isfinite(place).all(1))
        if (
            len(inside) < 5
            or not np.isfinite(states["after"][k]).all()
            or _touches(contacts_s, times[k], times[k + 1])
        ):
            continue
        velocity = states["after"][k]
        dt = clock[inside] - times[k]
        start = np.mean(place[inside[:3]] - velocity[:2] * dt[:3, None], axis=0)
        path = _fly(
            scenario, host_motion, times[k], (*start, *velocity[:2], 0.0, velocity[2]), float(dt[-1]) + 1e-4
        )
        predicted = np.column_stack([np.interp(dt, path[0], column) for column in path[1:]])
        offset = np.mean((place[inside] - predicted[:, :2])[:3], axis=0)
        error = np.linalg.norm(place[inside] - predicted[:, :2] - offset, axis=1)
        turn = angle[inside] - predicted[:, 2]
        turn = turn - np.nanmean(turn[:3]) if np.isfinite(turn[:3]).any() else turn * np.nan
        rows.append(
            (
                times[k],
                times[k + 1],
                len(inside),
                float(np.sqrt(np.mean(error**2))),
                float(error[-1]),
                float(np.sqrt(np.nanmean(turn**2))) if np.isfinite(turn).any() else np.nan,
            )
        )
    return pd.DataFrame(rows, columns=["start_s", "end_s", "frames", "rms_m", "end_m", "angle_rms_rad"])


def _fly(
    scenario: Scenario, host_motion: HostMotion, start_s: float, state: tuple[float, ...], duration_s: float
) -> tuple[Array, ...]:
    """Time, x, y, angle of one free flight (no wall: a flight ends where the measured one does)."""
    far = replace(
        scenario.host,
        radius_m=1e3,
        polygon_m=None,
        obstacle_radius_m=None,
        drive=harmonics_from(host_motion, start_s),
    )
    result = simulate(
        replace(scenario, host=far, initial_nes=state, duration_s=duration_s, sample_rate_hz=SAMPLE_RATE_HZ)
    )
    return result.time_s, *(result.motion[name] for name in ("nes_x_m", "nes_y_m", "nes_angle_rad"))


def _touches(spans_s: Sequence[tuple[float, float]], start_s: float, end_s: float) -> bool:
    return any(start < end_s and end > start_s for start, end in spans_s)


def one_impact_ahead(impacts: pd.DataFrame, scenario: Scenario) -> pd.DataFrame:
    """What the impact law makes of each measured approach: measured and simulated normal and tangential speed
    and spin after.

    Luding law with a heavy Host (thesis eqs (91)-(102), checked in ERRATA); spin by the tangential impulse,
    omega+ = omega- + (v_t+ - v_t-) / (R (1 + q)).  Impacts without a measured approach have null predictions.
    """
    law, nes = scenario.impact, scenario.nes
    v_n, v_t, spin = (
        impacts[name].to_numpy(float)
        for name in (
            "normal_speed_before_m_per_s",
            "tangential_speed_before_m_per_s",
            "spin_before_rad_per_s",
        )
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        sliding = -1 + law.wall_friction * (1 + law.restitution) * (1 + 1 / nes.inertia_factor) * np.abs(
            v_n
        ) / np.abs(v_t)
    tangential = np.where(v_t == 0, 0.0, -np.minimum(law.tangential_restitution, sliding) * v_t)
    out = impacts[
        [
            "impact",
            "time_s",
            "normal_speed_after_m_per_s",
            "tangential_speed_after_m_per_s",
            "spin_after_rad_per_s",
        ]
    ].copy()
    out["simulated_normal_speed_after_m_per_s"] = law.restitution * v_n
    out["simulated_tangential_speed_after_m_per_s"] = tangential
    out["simulated_spin_after_rad_per_s"] = spin + (tangential - v_t) / (
        nes.radius_m * (1 + nes.inertia_factor)
    )
    return out.reset_index(drop=True)


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

    ``quantity, measured, simulated, low, high, p``: medians (the rate itself), the 5-95 % range over the
    simulated runs of the same statistic, and the share of runs at least as far from their median as the
    measured one (two-sided).  Empty without a usable start.
    """
    start = _first_start(motion, impacts, states, scenario, host_motion, contacts_s)
    if start is None or runs < 1:
        return pd.DataFrame(columns=["quantity", "measured", "simulated", "low", "high", "p", "ks"]), {}
    start_s, state = start
    duration = float(motion["time_s"].max()) - start_s
    counted = impacts[
        (impacts["time_s"] > start_s) & (impacts["normal_speed_before_m_per_s"] > COUNTED_SPEED_M_PER_S)
    ]
    measured = _quantities(
        counted["normal_speed_before_m_per_s"],
        counted["azimuth_rad"],
        len(counted) / duration,
        _energy(scenario, motion[motion["time_s"] > start_s]),
    )
    copies = []
    drive = replace(scenario.host, drive=harmonics_from(host_motion, start_s))
    rate = 1 / float(np.median(np.diff(motion["time_s"])))
    for _ in range(runs):
        scattered = np.array(state) + rng.normal(0, 1, 6) * (2e-5, 2e-5, 5e-3, 5e-3, 0.0, 0.5)
        result = simulate(
            replace(
                scenario, host=drive, initial_nes=tuple(scattered), duration_s=duration, sample_rate_hz=rate
            )
        )
        hit = result.impacts[result.impacts["normal_speed_before_m_per_s"] > COUNTED_SPEED_M_PER_S]
        copies.append(
            _quantities(
                hit["normal_speed_before_m_per_s"],
                hit["azimuth_rad"],
                len(hit) / duration,
                _energy(scenario, pd.DataFrame({"time_s": result.time_s, **result.motion})),
            )
        )
    rows, samples = [], {}
    for name, value in measured.items():
        middles = np.array([np.median(copy[name]) if len(copy[name]) else np.nan for copy in copies])
        middles = middles[np.isfinite(middles)]
        if not len(value) or not len(middles):
            continue
        pooled = np.concatenate([copy[name] for copy in copies])
        here, centre = float(np.median(value)), float(np.median(middles))
        p = float((1 + np.sum(np.abs(middles - centre) >= abs(here - centre))) / (1 + len(middles)))
        low, high = np.quantile(middles, [0.05, 0.95])
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
    return pd.DataFrame(
        rows, columns=["quantity", "measured", "simulated", "low", "high", "p", "ks"]
    ), samples


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
            or times[k + 1] - times[k] < 0.01
            or _touches(contacts_s, times[k], times[k + 1])
        ):
            continue
        seen = np.flatnonzero((clock > times[k]) & (clock < times[k + 1]) & np.isfinite(place).all(1))
        if len(seen):
            middle, velocity = seen[len(seen) // 2], states["after"][k]
            path = _fly(
                scenario,
                host_motion,
                times[k],
                (*place[seen[0]], *velocity[:2], 0.0, velocity[2]),
                float(clock[middle] - times[k]),
            )
            rates = [float((column[-1] - column[-2]) / (path[0][-1] - path[0][-2])) for column in path[1:]]
            return float(clock[middle]), (*place[middle], *rates[:2], 0.0, rates[2])
    return None
