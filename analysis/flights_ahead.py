"""Each measured flight against the simulator's, started from the state after its impact."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.host_motion import HostMotion
from analysis.simulated_rig import harmonics_from
from ovines.core import Scenario, simulate

Array = NDArray[np.float64]
# 20 kHz samples: between them a disk under 20 m/s^2 strays 6e-9 m from the straight line that interpolates.
SAMPLE_RATE_HZ = 20000.0


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
            or touches(contacts_s, times[k], times[k + 1])
        ):
            continue
        velocity = states["after"][k]
        dt = clock[inside] - times[k]
        start = np.mean(place[inside[:3]] - velocity[:2] * dt[:3, None], axis=0)
        path = fly(
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


def fly(
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


def touches(spans_s: Sequence[tuple[float, float]], start_s: float, end_s: float) -> bool:
    return any(start < end_s and end > start_s for start, end in spans_s)
