"""The simulator's side of a recording, to lay beside the measured motion: every flight from the impact before it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from analysis.comparison.flights_ahead import flown_flights
from analysis.comparison.simulated_rig import host_motion_of, met, nominal_scenario, states_after
from analysis.report.results import Results
from analysis.walls.drawn import identified_wall
from ovines.errors import InputError
from ovines.recording import Recording


def simulated_motion(
    motion: pd.DataFrame,
    impacts: pd.DataFrame,
    identification: pd.DataFrame | None,
    recording: Recording,
    contacts_s: Sequence[tuple[float, float]] = (),
) -> pd.DataFrame:
    """A table ``simulation`` at the times of ``motion``.

    The NES is where the simulator's nominal model takes it from the state measured after the impact before; it is
    missing before the first impact and where no flight could be predicted (see `flown_flights`).  The Host follows
    its fitted motion.  A run is never simulated as a whole: chaos would carry it away after a few impacts.
    Raises `InputError` where neither ``identification`` nor ``[model]`` give a parameter of the wall.
    """
    clock = motion["time_s"].to_numpy(float)
    host_motion = host_motion_of(motion, recording)
    scenario = nominal_scenario(identification, recording, host_motion, float(np.ptp(clock)))
    wall = identified_wall(identification, recording)
    impacts, in_wall_s = met(impacts, identification, scenario)
    states = states_after(impacts, host_motion, scenario.nes.radius_m, wall)
    host = host_motion.at(clock)
    table = pd.DataFrame({"frame": motion["frame"].to_numpy(), "time_s": clock})
    table[["nes_x_m", "nes_y_m", "nes_z_m", "nes_angle_rad"]] = np.nan
    table[["host_x_m", "host_y_m", "host_z_m", "host_angle_rad"]] = host
    nes = np.full((len(table), 4), np.nan)
    flown = flown_flights(motion, impacts, states, scenario, host_motion, contacts_s, True, in_wall_s)
    for one in flown:
        nes[one.rows] = np.column_stack([one.place_m, np.zeros(len(one.rows)), one.angle_rad])
    table[["nes_x_m", "nes_y_m", "nes_z_m", "nes_angle_rad"]] = nes
    return table


def simulated_beside(found: Results) -> tuple[pd.DataFrame | None, list[str]]:
    """`simulated_motion` of what a results folder holds, and in words what it is or why there is none."""
    motion, impacts = found.get("motion"), found.get("impacts")
    if motion is None or impacts is None:
        return None, []
    try:
        table = simulated_motion(
            motion, impacts, found.get("identification"), found.recording, found.spans_s("contact")
        )
    except InputError as error:
        return None, [f"no simulation: {error.found}"]
    return table, ["simulated: each flight from the state measured after the impact before it"]
