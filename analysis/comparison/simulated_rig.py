"""The rig as the simulator takes it: identified parameters, the Host's measured motion, measured states."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.contact.effect_rows import reported_effects
from analysis.contact.wall_fit import contact_time_s
from analysis.flights.stated_terms import drift_from_the_start, held_laws, stated_sizes
from analysis.motion.bodies import INERTIA_OF_A_DISK
from analysis.motion.host_fit import fit_host_motion
from analysis.motion.host_path import HostMotion
from analysis.walls.drawn import identified_wall
from analysis.walls.outlines import Ring, Sides
from analysis.walls.wall import Wall
from ovines.core import FloorFriction, Harmonic, Host, ImpactLaw, MeasuredMotion, Nes, Scenario
from ovines.core.effects import EFFECTS, is_law
from ovines.core.laws.terms import WrittenLaw
from ovines.errors import InputError
from ovines.recording import Recording

Array = NDArray[np.float64]
AXES = ("x", "y", "z", "rotation")
Laws = tuple[WrittenLaw, ...]
# Effects that the scenario has by itself: friction, and whatever is in the Host's measured motion; a recording's errors
# of measurement are no part of the motion.
HERE_ALREADY = {"floor_friction", "vertical_motion"} | {
    name for name, effect in EFFECTS.items() if effect.stage in ("measurement", "drive")
}
# Weight of the Host's frames, all alike: its path does not depend on it, only whether it counts as moving.
HOST_SD_M = 2e-5
# The simulator joins a table's rows by cubics: so many in a step of the measured path, and as many beside it.
TABLE_FINER, TABLE_BESIDE = 2, 4


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
    sizes = _sizes(identification, recording, effects, duration_s)
    floor = _value("floor_friction", identification, recording)
    if floor and "friction_drift" in sizes:
        # Identified about the middle of a run, and simulated from its start on.
        floor /= 1 + sizes["friction_drift"].get("relative_per_s", 0.0) * 0.5 * duration_s
    # Given from the clock's zero: a flight that begins at a time of its own counts from there.
    start_s = host_motion.zero_s - 0.5 * duration_s
    laws = tuple(one.later(-start_s, -host_motion.omega_rad_per_s * start_s) for one in held_laws([recording]))
    friction = (
        None
        if not floor
        else FloorFriction(
            floor, "farkas" if "spin_coupling" in effects or "floor_friction" not in effects else "coulomb"
        )
    )
    return Scenario(
        recording.name,
        Nes(nes.radius_m, nes.mass_kg or 1.0, nes.inertia_factor or INERTIA_OF_A_DISK),
        moved(
            Host(**simulated_wall(identified_wall(identification, recording), nes.radius_m)),
            host_motion,
            0.0,
            duration_s,
        ),
        law,
        max(duration_s, 1e-3),
        friction,
        sample_rate_hz=0.0,
        # What is held as a law knows of the impact before a flight.
        effects={name: one for name, one in sizes.items() if name not in HERE_ALREADY and not is_law(name)},
        laws=laws,
    )


def _sizes(
    identification: pd.DataFrame | None, recording: Recording, effects: Sequence[str], duration_s: float
) -> dict[str, dict[str, float]]:
    """Sizes of the ``effects`` of ``[model]``: as identified, where the data were asked, else as stated."""
    sizes = {name: dict(one) for name, one in stated_sizes(recording.model).items()}
    if identification is None:
        return sizes
    for name, reported in reported_effects(identification, effects).items():
        sizes[name] = sizes.get(name, {}) | EFFECTS[name].nearest({p: value for p, (value, _) in reported.items()})
    drift = identification.loc[identification["parameter"] == "friction_drift_per_s", "value"]
    if "friction_drift" in effects and len(drift) and np.isfinite(drift.iloc[0]):
        from_start = drift_from_the_start((float(drift.iloc[0]), 0.0), (0.0, 0.0), [-0.5 * duration_s])
        sizes["friction_drift"] = {"relative_per_s": from_start["relative_per_s"][0]}
    return sizes


def laws_from(laws: Sequence[WrittenLaw], host_motion: HostMotion, start_s: float) -> Laws:
    """``laws`` of a scenario of :func:`nominal_scenario` for a run that begins at ``start_s``."""
    return tuple(one.later(start_s, host_motion.omega_rad_per_s * start_s) for one in laws)


def simulated_wall(wall: Wall, nes_radius_m: float) -> dict[str, Any]:
    """The wall as :class:`ovines.core.Host` takes it."""
    outline, cylinder = wall.outline, wall.cylinder
    return {
        "radius_m": outline.radius_m + nes_radius_m if isinstance(outline, Ring) else None,
        "polygon_m": tuple(map(tuple, outline.corners_m(nes_radius_m))) if isinstance(outline, Sides) else None,
        "obstacle_radius_m": cylinder.radius_m - nes_radius_m if cylinder else None,
    }


def _needed(name: str, identification: pd.DataFrame | None, recording: Recording) -> float:
    value = _value(name, identification, recording)
    if value is None:
        raise InputError(
            f"no {name}, neither identified nor in [model]",
            "a value",
            f"give {name} in [model], or record impacts that inform it",
        )
    return value


def _value(name: str, identification: pd.DataFrame | None, recording: Recording | None) -> float | None:
    if identification is not None:
        row = identification[identification["parameter"] == name]
        if len(row):
            for column in ("value", "low", "high"):
                if np.isfinite(row.iloc[0][column]):
                    return _within(name, float(row.iloc[0][column]))
    return getattr(recording.model, name, None) if recording is not None and recording.model is not None else None


def _within(name: str, value: float) -> float:
    """An estimate may stray over the edge of what can be; the simulator may not."""
    return float(
        np.clip(value, -1.0 if name == "tangential_restitution" else 0.0, 1.0 if "restitution" in name else np.inf)
    )


def host_motion_of(motion: pd.DataFrame, recording: Recording) -> HostMotion:
    """The Host's motion in the world, from table ``motion``; phases count from the middle of the run."""
    names = ("host_x_m", "host_y_m", "host_z_m", "host_angle_rad")
    position = np.column_stack(
        [motion[n].to_numpy(float) if n in motion else np.full(len(motion), np.nan) for n in names]
    )
    asked = recording.excitation.frequency_hz if recording.excitation is not None else None
    times = motion["time_s"].to_numpy(float)
    middle_s = float(0.5 * (times.min() + times.max())) if len(times) else 0.0
    return fit_host_motion(times, position, np.full(position.shape, HOST_SD_M), asked, zero_s=middle_s)


def moved(host: Host, host_motion: HostMotion, start_s: float, duration_s: float) -> Host:
    """``host`` driven as it was measured from ``start_s`` on: by its lines, and by a table of what no line explains."""
    table = None
    paths = [one for one in host_motion.smooth if one is not None]
    if paths:
        step = paths[0].knot_s / TABLE_FINER
        time_s = step * np.arange(-TABLE_BESIDE, np.ceil(duration_s / step) + TABLE_BESIDE + 1)
        at = time_s + start_s - host_motion.zero_s
        x, y, z, angle = (np.zeros_like(at) if one is None else one.at(at) for one in host_motion.smooth)
        table = MeasuredMotion(time_s, x, y, angle, z)
    return replace(host, motion="driven", drive=lines_from(host_motion, start_s), table=table)


def lines_from(host_motion: HostMotion, start_s: float) -> tuple[Harmonic, ...]:
    """The Host's lines with their phases at ``start_s``, as the simulator takes them."""
    found = []
    for axis, row in zip(AXES, host_motion.coefficients, strict=True):
        found.append(Harmonic(axis, float(row[0]), 0.0, np.pi / 2))
        for omega, cos, sin in zip(host_motion.omegas, row[1::2], row[2::2], strict=True):
            phase = float(np.arctan2(cos, sin) + omega * (start_s - host_motion.zero_s))
            found.append(Harmonic(axis, float(np.hypot(cos, sin)), float(omega) / (2 * np.pi), phase))
    return tuple(found)


def met(
    impacts: pd.DataFrame, identification: pd.DataFrame | None, scenario: Scenario
) -> tuple[pd.DataFrame, tuple[float, float]]:
    """``impacts`` at the times at which the paths of their flights meet, where their speeds were measured, and how long
    before and after these the disk is in the wall (s): none, and the times of the table, of contacts of an instant.

    Table ``impacts`` has the times of the first touch, and ``identification`` how long contacts last."""
    duration_s = _value("contact_duration_s", identification, None)
    restitution = scenario.impact.restitution
    if not duration_s or not restitution > 0:
        return impacts, (0.0, 0.0)
    early_s = duration_s / contact_time_s(1.0, restitution)
    return impacts.assign(time_s=impacts["time_s"] + early_s), (early_s, early_s / restitution)


def states_after(impacts: pd.DataFrame, host_motion: HostMotion, nes_radius_m: float, wall: Wall) -> dict[str, Array]:
    """Measured NES velocity and spin after (and before) each impact in the world frame, from the contact's
    speeds: (n, 3) each.

    The inverse of thesis eq. (88) for any surface of the ``wall``: v_N = v_H + v_n e_n + (v_t - R_N omega_N) e_t +
    omega_H x (contact from the Host's centre).  NaN where a speed is missing.
    """
    time_s, azimuth = impacts["time_s"].to_numpy(float), impacts["azimuth_rad"].to_numpy(float)
    given = impacts["normal_rad"].to_numpy(float) if "normal_rad" in impacts else np.full(len(impacts), np.nan)
    direction = np.where(np.isfinite(given), given, azimuth)
    host, normal = host_motion.at(time_s, 1), np.column_stack([np.cos(direction), np.sin(direction)])
    tangent = np.column_stack([-normal[:, 1], normal[:, 0]])
    # The contact from the Host's centre: along the normal and, beside the foot of a flat side, across it.
    out = wall.reach(wall.numbers(impacts)) + nes_radius_m
    across = out * np.tan(azimuth - direction)
    turning = host[:, 3:] * (out[:, None] * tangent - across[:, None] * normal)
    found = {}
    for when, sign in (("before", 1.0), ("after", -1.0)):
        v_n = sign * impacts[f"normal_speed_{when}_m_per_s"].to_numpy(float)
        v_t = impacts[f"tangential_speed_{when}_m_per_s"].to_numpy(float)
        spin = impacts[f"spin_{when}_rad_per_s"].to_numpy(float)
        slide = v_t - nes_radius_m * spin
        found[when] = np.column_stack([host[:, :2] + v_n[:, None] * normal + slide[:, None] * tangent + turning, spin])
    return found
