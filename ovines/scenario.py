"""scenario.toml -> `ovines.core.Scenario`: read, checked, refused with reasons."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from ovines import core
from ovines.core.packing import pack
from ovines.errors import InputError
from ovines.io.toml_input import Section, read_toml
from ovines.law_file import read_law
from ovines.tables import read_table

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
State = tuple[float, float, float, float, float, float]


class HarmonicEntry(Section):
    """One sine; ``amplitude_rad`` for rotation, ``amplitude_m`` for the rest."""

    amplitude_m: float | None = None
    """Amplitude along x, y or z. Example: `0.0164`."""
    amplitude_rad: float | None = None
    """Amplitude of a rotation. Example: `0.02`."""
    frequency_hz: NotNegative
    """Frequency. Example: `11.0`."""
    phase_rad: float = 0.0
    """Phase of the sine at time 0. Example: `0.3`."""

    @model_validator(mode="after")
    def _one_amplitude(self) -> HarmonicEntry:
        if (self.amplitude_m is None) == (self.amplitude_rad is None):
            raise ValueError("both or no amplitude | one of amplitude_m, amplitude_rad")
        return self


class Motion(Section):
    """Sums of sines for x, y, z and rotation, and a measured motion beside or instead of them."""

    x: tuple[HarmonicEntry, ...] = ()
    """Sines along x, as tables of the keys below. Example: `[{amplitude_m = 0.0164, frequency_hz = 11.0}]`."""
    y: tuple[HarmonicEntry, ...] = ()
    """Sines along y. Example: `[{amplitude_m = 0.001, frequency_hz = 11.0, phase_rad = 1.6}]`."""
    z: tuple[HarmonicEntry, ...] = ()
    """Sines along z: they modulate the floor's load. Example: `[{amplitude_m = 0.0008, frequency_hz = 11.0}]`."""
    rotation: tuple[HarmonicEntry, ...] = ()
    """Sines of the angle. Example: `[{amplitude_rad = 0.01, frequency_hz = 11.0}]`."""
    table: str | None = None
    """A ``motion.parquet`` whose Host moves as measured, beside or instead of sines; not for the ground.
    Example: `"motion.parquet"`.
    """

    def harmonics(self) -> tuple[core.Harmonic, ...]:
        """All sines as the core has them."""
        return tuple(
            core.Harmonic(
                axis,
                entry.amplitude_m if entry.amplitude_m is not None else entry.amplitude_rad,
                entry.frequency_hz,
                entry.phase_rad,
            )
            for axis in ("x", "y", "z", "rotation")
            for entry in getattr(self, axis)
        )


class SuspensionEntry(Section):
    """``[host.suspension]``: springs (N/m, N/m, N m/rad) and dampers of x, y and rotation, and the ground's motion."""

    stiffness: tuple[NotNegative, NotNegative, NotNegative]
    """Springs of x, y (N/m) and rotation (N m/rad). Example: `[1.0, 1.0, 1.0]`."""
    damping: tuple[NotNegative, NotNegative, NotNegative]
    """Dampers of x, y (N s/m) and rotation (N m s/rad). Example: `[0.04, 0.04, 0.04]`."""
    ground: Motion = Motion()


class HostEntry(Section):
    """``[host]``: its wall (m), how it moves, and its mass (kg) where it is free."""

    radius_m: Positive | None = None
    """Radius of the round wall; either this or ``polygon_m``. Example: `0.05`."""
    polygon_m: tuple[tuple[float, float], ...] | None = None
    """Corners of flat walls, counter-clockwise, in the Host's frame.
    Example: `[[-0.05, -0.05], [0.05, -0.05], [0.0, 0.06]]`.
    """
    obstacle_radius_m: Positive | None = None
    """Radius of a cylinder fixed at the Host's centre. Example: `0.01`."""
    motion: Literal["fixed", "free", "driven", "sprung"] = "fixed"
    """Held still, free to move, driven by ``[host.drive]``, or sprung by ``[host.suspension]``. Example: `"driven"`."""
    mass_kg: Positive | None = None
    """Its mass; free and sprung only. Example: `1.0`."""
    inertia_factor: Positive = 1.0
    """q of I = q m R²; free and sprung only. Example: `1.0`."""
    drive: Motion = Motion()
    suspension: SuspensionEntry | None = None


class NesEntry(Section):
    """``[nes]``: radius (m), mass (kg), inertia factor."""

    radius_m: Positive
    """Radius of the disk. Example: `0.01`."""
    mass_kg: Positive
    """Its mass. Example: `0.0246`."""
    inertia_factor: Positive = 0.5
    """q of I = q m R²; 0.5 is a full disk. Example: `0.5`."""


class ImpactEntry(Section):
    """``[impact]``: restitution, wall friction, tangential restitution."""

    restitution: Annotated[float, Field(ge=0, le=1)]
    """Normal speed after an impact over the one before. Example: `0.72`."""
    wall_friction: NotNegative
    """Coulomb's coefficient at the wall. Example: `0.13`."""
    tangential_restitution: Annotated[float, Field(ge=-1, le=1)]
    """Of an impact whose contact sticks: -1 smooth, 0 stays, 1 full reversal. Example: `0.49`."""


class FrictionEntry(Section):
    """``[friction]``: the floor's coefficient and law, what it moves with, and its load (m/s^2)."""

    coefficient: NotNegative
    """Coefficient of the floor. Example: `0.2`."""
    law: Literal["coulomb", "farkas"] = "farkas"
    """``farkas``: sliding and spinning are coupled; ``coulomb``: they are not. Example: `"farkas"`."""
    support: Literal["host", "ground"] = "host"
    """What the disk slides on: the Host's floor, or the fixed ground. Example: `"host"`."""
    regularisation_m_per_s: Positive = 1e-3
    """Speed below which friction falls to zero smoothly. Example: `1e-3`."""
    load_m_per_s2: NotNegative = 9.81
    """Gravity normal to the plane. Example: `9.81`."""


class Initial(Section):
    """``[initial]``: x, y (m), velocities (m/s), angle (rad), spin (rad/s) of NES and free Host."""

    nes: State = (0.0,) * 6
    """x, y (m), vx, vy (m/s), angle (rad), spin (rad/s) of the disk. Example: `[0.03, -0.01, 0.1, 0.0, 0.0, 0.0]`."""
    host: State = (0.0,) * 6
    """The same of the Host; ignored where it is driven or fixed. Example: `[0.0, 0.0, 0.0, 0.0, 0.0, 0.0]`."""


class Run(Section):
    """``[run]``: duration (s), samples per second, limits and tolerance."""

    duration_s: Positive
    """Simulated time. Example: `1.0`."""
    sample_rate_hz: Positive = 800.0
    """Rows per second of ``simulation.parquet``. Example: `800.0`."""
    max_impacts: Annotated[int, Field(ge=1, le=1_000_000_000)] = 10000
    """The simulation ends after so many impacts. Example: `10000`."""
    number: Annotated[int, Field(ge=0, le=1_000_000_000)] = 0
    """Number of the run in its series, for effects that change from run to run. Example: `0`."""
    tolerance: Annotated[float, Field(ge=1e-15, le=1e-2)] = 1e-11  # below: rounding, which no step size reaches
    """Of the integration, per length and speed of the scenario. Example: `1e-11`."""


class ScenarioFile(Section):
    """The whole file (FORMATS ``scenario.toml``); ``effects`` are tables ``[effects.NAME]``."""

    format: Literal[1]
    """Version of this format, always 1. Example: `1`."""
    name: str = "scenario"
    """What pages and tables call it. Example: `"shaken host"`."""
    gravity_m_per_s2: tuple[float, float] = (0.0, 0.0)
    """Gravity in the plane; the thesis' Part I has [0.0, -9.81]. Example: `[0.0, 0.0]`."""
    nes: NesEntry
    host: HostEntry
    impact: ImpactEntry
    friction: FrictionEntry | None = None
    initial: Initial = Initial()
    run: Run
    effects: dict[str, dict[str, float]] = Field(default_factory=dict)
    """Tables ``[effects.NAME]`` of sizes ([names and sizes](effects.md)).
    Example: `{table_tilt = {tilt_rad = 0.0188, direction_rad = -0.59}}`.
    """
    laws: tuple[str, ...] = ()
    """Files of written laws, from this file on ([law.toml](law-toml.md)). Example: `["law-1.toml"]`."""


def read_scenario(path: str | Path) -> core.Scenario:
    """Read and check ``path``; a scenario that cannot run is refused with `InputError` before anything runs."""
    path = Path(path)
    return checked_scenario(lambda: as_scenario(read_toml(path, ScenarioFile), path.parent), str(path))


def checked_scenario(make: Callable[[], core.Scenario], source: str) -> core.Scenario:
    """The scenario that ``make()`` gives, tried on the engine's door; the core's refusals become `InputError`."""
    try:
        scenario = make()
        pack(scenario)
    except core.ScenarioError as error:
        raise InputError(f"{source}: {error.found}", error.expected, error.do) from None
    return scenario


def as_scenario(content: ScenarioFile, folder: Path) -> core.Scenario:
    """The file's content as the core's scenario; a measured motion is looked for beside the file."""
    host = content.host
    suspension = None
    if host.suspension is not None:
        if host.suspension.ground.table is not None:
            raise InputError("host.suspension.ground.table", "harmonics for the ground", "give x, y or rotation")
        suspension = core.Suspension(
            host.suspension.stiffness, host.suspension.damping, host.suspension.ground.harmonics()
        )
    table = measured_motion(folder / host.drive.table) if host.drive.table is not None else None
    return core.Scenario(
        name=content.name,
        nes=core.Nes(content.nes.radius_m, content.nes.mass_kg, content.nes.inertia_factor),
        host=core.Host(
            host.radius_m, host.polygon_m, host.obstacle_radius_m, host.motion, host.mass_kg, host.inertia_factor,
            host.drive.harmonics(), table, suspension,
        ),
        impact=core.ImpactLaw(**content.impact.model_dump()),
        friction=core.FloorFriction(**content.friction.model_dump()) if content.friction else None,
        initial_nes=content.initial.nes,
        initial_host=content.initial.host,
        gravity_m_per_s2=content.gravity_m_per_s2,
        duration_s=content.run.duration_s,
        sample_rate_hz=content.run.sample_rate_hz,
        max_impacts=content.run.max_impacts,
        run_number=content.run.number,
        tolerance=content.run.tolerance,
        effects=content.effects,
        laws=tuple(read_law(folder / name) for name in content.laws),
    )  # fmt: skip


def measured_motion(path: Path) -> core.MeasuredMotion:
    """The Host's motion of a ``motion.parquet``; rows without the Host are left out, a missing angle is 0."""
    frame = read_table(path, "motion")
    frame = frame[np.isfinite(frame["host_x_m"]) & np.isfinite(frame["host_y_m"])]
    column = {name: frame[f"host_{name}"].to_numpy(dtype=float) for name in ("x_m", "y_m", "z_m", "angle_rad")}
    return core.MeasuredMotion(
        frame["time_s"].to_numpy(dtype=float), column["x_m"], column["y_m"],
        np.nan_to_num(column["angle_rad"]), np.nan_to_num(column["z_m"]),
    )  # fmt: skip
