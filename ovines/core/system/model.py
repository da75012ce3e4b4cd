"""What a simulation is made of: frozen descriptions in SI units, refused when they cannot be."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from ovines.core import limits as L
from ovines.core.laws.terms import WrittenLaw
from ovines.core.refusal import require, require_range
from ovines.core.system.gaps import refuse_gaps


@dataclass(frozen=True)
class Nes:
    """The disk inside: radius, mass, q of I = q m R^2 (0.5 for a solid disk)."""

    radius_m: float
    mass_kg: float
    inertia_factor: float = 0.5

    def __post_init__(self) -> None:
        require_range("nes.radius_m", self.radius_m, *L.LENGTHS_M)
        require_range("nes.mass_kg", self.mass_kg, *L.MASSES_KG)
        require_range("nes.inertia_factor", self.inertia_factor, *L.INERTIA_FACTORS)


_STATE = (L.LENGTHS_M[1],) * 2 + (L.MOST_M_PER_S,) * 2 + (L.MOST_RAD, L.MOST_RAD_PER_S)
MOST = {"initial_nes": _STATE, "initial_host": _STATE, "gravity_m_per_s2": (L.MOST_M_PER_S2,) * 2}
_ROUNDING = 1e-6  # of a step, which a table of times in seconds may be off


@dataclass(frozen=True)
class Harmonic:
    """``amplitude sin(2 pi frequency t + phase)`` along an axis: "x", "y", "z" (m) or "rotation" (rad).

    Frequency 0 is a constant ``amplitude sin(phase)``.
    """

    axis: str
    amplitude: float
    frequency_hz: float
    phase_rad: float = 0.0

    def __post_init__(self) -> None:
        axes = ("x", "y", "z", "rotation")
        require(self.axis in axes, f"drive axis {self.axis!r}", "x, y, z or rotation", "name one of these axes")
        require_range(f"frequency_hz of {self.axis}", self.frequency_hz, 0.0, L.FREQUENCIES_HZ[1])
        require_range(f"amplitude of {self.axis}", self.amplitude, -L.LENGTHS_M[1], L.LENGTHS_M[1])
        require_range(f"phase_rad of {self.axis}", self.phase_rad, -L.MOST_RAD, L.MOST_RAD)


@dataclass(frozen=True)
class MeasuredMotion:
    """A measured Host motion: ``time_s`` (n,), increasing; ``x_m``, ``y_m``, ``angle_rad``, ``z_m`` (n,)."""

    time_s: np.ndarray
    x_m: np.ndarray
    y_m: np.ndarray
    angle_rad: np.ndarray
    z_m: np.ndarray

    def __post_init__(self) -> None:
        n = len(self.time_s)
        require(n >= 4, f"a Host table of {n} rows", "at least 4 rows", "give the measured motion at more times")
        for name in ("time_s", "x_m", "y_m", "angle_rad", "z_m"):
            values = np.asarray(getattr(self, name), dtype=float)
            fine = values.shape == (n,) and bool(np.all(np.isfinite(values)))
            require(fine, f"{name} of the Host table with gaps or another length", f"{n} finite numbers", "fill gaps")
        rising = bool(np.all(np.diff(self.time_s) > 0))
        require(rising, "times of the Host table that do not increase", "increasing time_s", "sort, drop repeats")

    def require_covers(self, duration_s: float) -> None:
        """Refuse a run that begins before the table or ends after it, or in which the table lacks too much; by one step
        of its own it may: n frames last n steps, and the last of them stands n - 1 steps after the first.
        """
        first, second, before, last = (float(self.time_s[k]) for k in (0, 1, -2, -1))
        early = first > (1 + _ROUNDING) * (second - first)
        late = duration_s > last + (1 + _ROUNDING) * (last - before)
        require(
            not early and not late,
            f"a Host table from {first:g} to {last:g} s for a run of {duration_s:g} s from 0",
            "a table that covers the run: beyond it nothing was measured",
            "count the table's time_s from the start of the run"
            if early
            else f"set run.duration_s = {last:g} or less, or give a longer table",
        )
        axes = {"x (m)": self.x_m, "y (m)": self.y_m, "angle (rad)": self.angle_rad, "z (m)": self.z_m}
        refuse_gaps(self.time_s, axes, duration_s)


@dataclass(frozen=True)
class Suspension:
    """Springs and dampers for x, y and rotation, and the ground's motion under them."""

    stiffness: tuple[float, float, float]
    damping: tuple[float, float, float]
    ground: tuple[Harmonic, ...] = ()

    def __post_init__(self) -> None:
        for name in ("stiffness", "damping"):
            values = getattr(self, name)
            require(len(values) == 3, f"{len(values)} values of {name}", "3: x, y, rotation", f"give 3 {name} values")
            for value in values:
                require_range(f"host.suspension.{name}", value, 0.0, L.MOST_STIFFNESS)


@dataclass(frozen=True)
class Host:
    """The container: a ring of inner radius ``radius_m`` or a convex polygon, and how it moves.

    ``motion`` is "fixed", "free", "driven" (``drive`` harmonics and/or ``table``) or "sprung".  ``polygon_m`` are
    corners in the Host's frame, counter-clockwise.  ``mass_kg``, ``inertia_factor`` (I = q M R^2, R the ring's radius
    or the farthest corner) matter for free and sprung Hosts only.  Gravity acts on the NES alone (thesis Eq. 3-4).
    """

    radius_m: float | None = None
    polygon_m: tuple[tuple[float, float], ...] | None = None
    obstacle_radius_m: float | None = None
    motion: str = "fixed"
    mass_kg: float | None = None
    inertia_factor: float = 1.0
    drive: tuple[Harmonic, ...] = ()
    table: MeasuredMotion | None = None
    suspension: Suspension | None = None

    def __post_init__(self) -> None:
        motions = ("fixed", "free", "driven", "sprung")
        require(self.motion in motions, f"host.motion = {self.motion!r}", ", ".join(motions), "name one of these")
        one = (self.radius_m is None) != (self.polygon_m is None)
        require(one, "both or neither of host.radius_m, host.polygon_m", "exactly one", "keep the wall you mean")
        if self.radius_m is not None:
            require_range("host.radius_m", self.radius_m, *L.LENGTHS_M)
        else:
            require_convex(self.polygon_m)
        if self.obstacle_radius_m is not None:
            require_range("host.obstacle_radius_m", self.obstacle_radius_m, *L.LENGTHS_M)
        if self.motion in ("free", "sprung"):
            require(self.mass_kg is not None, f"a {self.motion} Host without mass_kg", "a mass", "give host.mass_kg")
            require_range("host.mass_kg", self.mass_kg, *L.MASSES_KG)
            require_range("host.inertia_factor", self.inertia_factor, *L.INERTIA_FACTORS)
        if self.motion == "sprung":
            found = self.suspension is not None
            require(found, "a sprung Host without suspension", "springs and dampers", "add [host.suspension]")
        if self.motion == "driven":
            moved = bool(self.drive) or self.table is not None
            require(
                moved, "a driven Host without drive", "harmonics or a table", "add [host.drive] or motion = 'fixed'"
            )


def require_convex(corners: object) -> None:
    """Refuse a polygon that is not convex and counter-clockwise."""
    points = np.asarray(corners, dtype=float)
    shape = points.ndim == 2 and points.shape[1:] == (2,) and len(points) >= 3 and bool(np.all(np.isfinite(points)))
    require(shape, "host.polygon_m of another shape", "at least three finite [x, y]", "list the corners as [x, y]")
    farthest, most = float(np.max(np.abs(points))), L.LENGTHS_M[1]
    require(farthest <= most, f"host.polygon_m with {farthest:g} m", f"at most {most:g} m", "correct the corners")
    edges = np.roll(points, -1, axis=0) - points
    following = np.roll(edges, -1, axis=0)
    turns = edges[:, 0] * following[:, 1] - edges[:, 1] * following[:, 0]
    convex = bool(np.all(turns > 0)) and abs(_winding(edges, following) - 1.0) < 1e-6
    require(convex, "host.polygon_m that is not convex or not counter-clockwise",
            "corners of a convex polygon, counter-clockwise", "reorder the corners")  # fmt: skip


def _winding(edges: np.ndarray, following: np.ndarray) -> float:
    cross = edges[:, 0] * following[:, 1] - edges[:, 1] * following[:, 0]
    return float(np.sum(np.arctan2(cross, np.sum(edges * following, axis=1))) / (2 * np.pi))


@dataclass(frozen=True)
class ImpactLaw:
    """Luding's law: normal restitution, wall friction, tangential restitution (-1 smooth ... 1 full reversal)."""

    restitution: float
    wall_friction: float
    tangential_restitution: float

    def __post_init__(self) -> None:
        require_range("impact.restitution", self.restitution, 0.0, 1.0)
        require_range("impact.wall_friction", self.wall_friction, 0.0, L.MOST_FRICTION)
        require_range("impact.tangential_restitution", self.tangential_restitution, -1.0, 1.0)


@dataclass(frozen=True)
class FloorFriction:
    """Friction of what the disk slides on: the "host" floor or the fixed "ground"; law "coulomb" or "farkas"."""

    coefficient: float
    law: str = "farkas"
    support: str = "host"
    regularisation_m_per_s: float = 1e-3
    load_m_per_s2: float = 9.81

    def __post_init__(self) -> None:
        require_range("friction.coefficient", self.coefficient, 0.0, L.MOST_FRICTION)
        slow, fast = L.SLOWEST_M_PER_S, L.MOST_M_PER_S
        require_range("friction.regularisation_m_per_s", self.regularisation_m_per_s, slow, fast)
        require_range("friction.load_m_per_s2", self.load_m_per_s2, 0.0, L.MOST_M_PER_S2)
        require(self.law in ("coulomb", "farkas"), f"friction.law = {self.law!r}", "coulomb or farkas", "name one")
        known = self.support in ("host", "ground")
        require(known, f"friction.support = {self.support!r}", "host or ground", "name one")


@dataclass(frozen=True)
class Scenario:
    """Everything one run needs (FORMATS ``scenario.toml``).

    ``initial_nes`` and ``initial_host`` are x, y, vx, vy, angle, spin; the NES's are of its geometric centre;
    the Host's are ignored when it is fixed or driven.  ``effects`` maps an effect's name
    (:data:`ovines.core.effects.EFFECTS`) to its parameters; ``laws`` are formulas beside them.  ``run_number`` counts
    runs of a series (drift).  ``begins_with_m_per_s``: normal speed of an impact at which the run begins, for what
    remembers the contact before; None where it begins in flight.  ``tolerance`` is the integrator's, relative to the
    scenario's own length and speed; closed-form flights ignore it.
    """

    name: str
    nes: Nes
    host: Host
    impact: ImpactLaw
    duration_s: float
    friction: FloorFriction | None = None
    initial_nes: tuple[float, ...] = (0.0,) * 6
    initial_host: tuple[float, ...] = (0.0,) * 6
    gravity_m_per_s2: tuple[float, float] = (0.0, 0.0)
    sample_rate_hz: float = 800.0
    max_impacts: int = 10000
    effects: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    laws: tuple[WrittenLaw, ...] = ()
    run_number: int = 0
    begins_with_m_per_s: float | None = None
    tolerance: float = 1e-11

    def __post_init__(self) -> None:
        require_range("run.duration_s", self.duration_s, 0.0, L.MOST_S, above=True)
        require_range("run.sample_rate_hz", self.sample_rate_hz, 0.0, L.MOST_RATE_HZ)
        require_range("run.tolerance", self.tolerance, 0.0, 1e-2, above=True)
        if self.begins_with_m_per_s is not None:
            require_range("begins_with_m_per_s", self.begins_with_m_per_s, 0.0, L.MOST_M_PER_S)
        require(self.max_impacts >= 1, f"run.max_impacts = {self.max_impacts}", "at least 1", "raise run.max_impacts")
        for name, most in MOST.items():
            values = getattr(self, name)
            fine = len(values) == len(most) and all(abs(one) <= of for one, of in zip(values, most, strict=True))
            expected = f"{len(most)} finite numbers, of size up to {', '.join(f'{of:g}' for of in most)}"
            require(fine, f"{name} = {values}", expected, f"correct {name}")
        if self.host.motion == "driven" and self.host.table is not None:
            self.host.table.require_covers(self.duration_s)
