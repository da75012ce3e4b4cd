"""Each measured flight against the simulator's, started from the state after its impact."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.comparison.simulated_rig import laws_from, moved
from analysis.motion.host_path import HostMotion
from ovines.core import Scenario, simulate

Array = NDArray[np.float64]
# 20 kHz samples: between them a disk under 20 m/s^2 strays 6e-9 m from the straight line that interpolates.
SAMPLE_RATE_HZ = 20000.0


@dataclass(frozen=True, eq=False)
class FlownFlight:
    """A flight simulated from the impact before it: ``rows`` of ``motion`` that it covers (n,), ``place_m`` (n, 2)
    and ``angle_rad`` (n,) predicted there.
    """

    start_s: float
    end_s: float
    rows: NDArray[np.intp]
    place_m: Array
    angle_rad: Array


def flown_flights(
    motion: pd.DataFrame,
    impacts: pd.DataFrame,
    states: dict[str, Array],
    scenario: Scenario,
    host_motion: HostMotion,
    contacts_s: Sequence[tuple[float, float]] = (),
    to_the_end: bool = False,
    in_wall_s: tuple[float, float] = (0.0, 0.0),
) -> Iterator[FlownFlight]:
    """Each flight simulated from the measured state after its impact up to the next one (with ``to_the_end`` also
    from the last impact to the end of the recording).

    The start place is the mean offset that fits the first three frames: an impact's place is known less well
    than its velocity, and an offset is no prediction; the angle likewise.  Flights with fewer than five frames seen
    are left out.  ``in_wall_s``: how long before and after the times of ``impacts`` the disk is in the wall, where
    contacts last (:func:`analysis.comparison.simulated_rig.met`): no flight has those frames.
    """
    clock = motion["time_s"].to_numpy(float)
    place = motion[["nes_x_m", "nes_y_m"]].to_numpy(float)
    angle = motion["nes_angle_rad"].to_numpy(float) if "nes_angle_rad" in motion else np.full(len(motion), np.nan)
    times, (early_s, late_s) = impacts["time_s"].to_numpy(float), in_wall_s
    met = np.maximum(impacts["normal_speed_before_m_per_s"].to_numpy(float), 0.0)
    ends = times[1:] - early_s
    ends = np.append(ends, np.nextafter(clock[-1], np.inf)) if to_the_end else ends
    for k, end_s in enumerate(ends):
        inside = np.flatnonzero((clock > times[k] + late_s) & (clock < end_s) & np.isfinite(place).all(1))
        if len(inside) < 5 or not np.isfinite(states["after"][k]).all() or touches(contacts_s, times[k], end_s):
            continue
        velocity = states["after"][k]
        dt = clock[inside] - times[k]
        start = np.mean(place[inside[:3]] - velocity[:2] * dt[:3, None], axis=0)
        begun = replace(scenario, begins_with_m_per_s=float(met[k]) if np.isfinite(met[k]) else 0.0)
        path = fly(begun, host_motion, times[k], (*start, *velocity[:2], 0.0, velocity[2]), float(dt[-1]) + 1e-4)
        predicted = np.column_stack([np.interp(dt, path[0], column) for column in path[1:]])
        predicted[:, :2] += np.mean((place[inside] - predicted[:, :2])[:3], axis=0)
        turn = angle[inside[:3]] - predicted[:3, 2]
        predicted[:, 2] += np.nanmean(turn) if np.isfinite(turn).any() else np.nan
        yield FlownFlight(float(times[k]), float(end_s), inside, predicted[:, :2], predicted[:, 2])


def one_flight_ahead(
    motion: pd.DataFrame,
    impacts: pd.DataFrame,
    states: dict[str, Array],
    scenario: Scenario,
    host_motion: HostMotion,
    contacts_s: Sequence[tuple[float, float]] = (),
    in_wall_s: tuple[float, float] = (0.0, 0.0),
) -> pd.DataFrame:
    """Errors of `flown_flights` between two impacts: ``start_s, end_s, frames, rms_m, end_m`` (RMS over the frames
    and at the last one), ``angle_rms_rad`` (NaN where no angle was measured).
    """
    place = motion[["nes_x_m", "nes_y_m"]].to_numpy(float)
    angle = motion.get("nes_angle_rad", pd.Series(np.nan, motion.index)).to_numpy(float)
    rows = []
    for one in flown_flights(motion, impacts, states, scenario, host_motion, contacts_s, in_wall_s=in_wall_s):
        error = np.linalg.norm(place[one.rows] - one.place_m, axis=1)
        turn = angle[one.rows] - one.angle_rad
        rms_rad = float(np.sqrt(np.nanmean(turn**2))) if np.isfinite(turn).any() else np.nan
        rms_m = float(np.sqrt(np.mean(error**2)))
        rows.append((one.start_s, one.end_s, len(one.rows), rms_m, float(error[-1]), rms_rad))
    return pd.DataFrame(rows, columns=["start_s", "end_s", "frames", "rms_m", "end_m", "angle_rms_rad"])


def fly(
    scenario: Scenario, host_motion: HostMotion, start_s: float, state: tuple[float, ...], duration_s: float
) -> tuple[Array, ...]:
    """Time, x, y, angle of one free flight (no wall: a flight ends where the measured one does)."""
    wide = replace(scenario.host, radius_m=1e3, polygon_m=None, obstacle_radius_m=None)
    far = moved(wide, host_motion, start_s, duration_s)
    result = simulate(
        replace(
            scenario,
            host=far,
            initial_nes=state,
            duration_s=duration_s,
            sample_rate_hz=SAMPLE_RATE_HZ,
            laws=laws_from(scenario.laws, host_motion, start_s),
        )
    )
    return result.time_s, *(result.motion[name] for name in ("nes_x_m", "nes_y_m", "nes_angle_rad"))


def touches(spans_s: Sequence[tuple[float, float]], start_s: float, end_s: float) -> bool:
    """Whether any of the spans (start, end) overlaps start_s..end_s."""
    return any(start < end_s and end > start_s for start, end in spans_s)
