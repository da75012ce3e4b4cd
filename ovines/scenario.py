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
from ovines.tables import read_table

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
State = tuple[float, float, float, float, float, float]


class HarmonicEntry(Section):
    """One sine; ``amplitude_rad`` for rotation, ``amplitude_m`` for the rest."""

    amplitude_m: float | None = None
    amplitude_rad: float | None = None
    frequency_hz: NotNegative
    phase_rad: float = 0.0

    @model_validator(mode="after")
    def _one_amplitude(self) -> HarmonicEntry:
        if (self.amplitude_m is None) == (self.amplitude_rad is None):
            raise ValueError("both or no amplitude | one of amplitude_m, amplitude_rad")
        return self


class Motion(Section):
    """Sums of sines for x, y, z and rotation, and a measured motion beside or instead of them."""

    x: tuple[HarmonicEntry, ...] = ()
    y: tuple[HarmonicEntry, ...] = ()
    z: tuple[HarmonicEntry, ...] = ()
    rotation: tuple[HarmonicEntry, ...] = ()
    table: str | None = None

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
    damping: tuple[NotNegative, NotNegative, NotNegative]
    ground: Motion = Motion()


class HostEntry(Section):
    """``[host]``: its wall (m), how it moves, and its mass (kg) where it is free."""

    radius_m: Positive | None = None
    polygon_m: tuple[tuple[float, float], ...] | None = None
    obstacle_radius_m: Positive | None = None
    motion: Literal["fixed", "free", "driven", "sprung"] = "fixed"
    mass_kg: Positive | None = None
    inertia_factor: Positive = 1.0
    drive: Motion = Motion()
    suspension: SuspensionEntry | None = None


class NesEntry(Section):
    """``[nes]``: radius (m), mass (kg), inertia factor."""

    radius_m: Positive
    mass_kg: Positive
    inertia_factor: Positive = 0.5


class ImpactEntry(Section):
    """``[impact]``: restitution, wall friction, tangential restitution."""

    restitution: Annotated[float, Field(ge=0, le=1)]
    wall_friction: NotNegative
    tangential_restitution: Annotated[float, Field(ge=-1, le=1)]


class FrictionEntry(Section):
    """``[friction]``: the floor's coefficient and law, what it moves with, and its load (m/s^2)."""

    coefficient: NotNegative
    law: Literal["coulomb", "farkas"] = "farkas"
    support: Literal["host", "ground"] = "host"
    regularisation_m_per_s: Positive = 1e-3
    load_m_per_s2: NotNegative = 9.81


class Initial(Section):
    """``[initial]``: x, y (m), velocities (m/s), angle (rad), spin (rad/s) of NES and free Host."""

    nes: State = (0.0,) * 6
    host: State = (0.0,) * 6


class Run(Section):
    """``[run]``: duration (s), samples per second, limits and tolerance."""

    duration_s: Positive
    sample_rate_hz: Positive = 800.0
    max_impacts: Annotated[int, Field(ge=1, le=1_000_000_000)] = 10000
    number: Annotated[int, Field(ge=0, le=1_000_000_000)] = 0
    tolerance: Annotated[float, Field(ge=1e-15, le=1e-2)] = 1e-11  # below: rounding, which no step size reaches


class ScenarioFile(Section):
    """The whole file (FORMATS ``scenario.toml``); ``effects`` are tables ``[effects.NAME]``."""

    format: Literal[1]
    name: str = "scenario"
    gravity_m_per_s2: tuple[float, float] = (0.0, 0.0)
    nes: NesEntry
    host: HostEntry
    impact: ImpactEntry
    friction: FrictionEntry | None = None
    initial: Initial = Initial()
    run: Run
    effects: dict[str, dict[str, float]] = Field(default_factory=dict)


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
