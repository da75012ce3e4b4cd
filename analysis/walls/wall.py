"""The wall of a Host: its outline (a ring, nearly round, or flat sides), perhaps a cylinder in its middle, each with
its free terms.

One seam for all: where the disk's centre may go is asked of :class:`Wall`, whose surfaces give gap, normal and azimuth
(:mod:`analysis.walls.surfaces`), and whose ``terms`` are what the impacts may move.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.walls.surfaces import CYLINDER, RING, ROW, SIDE, surfaces_seen
from ovines.errors import InputError
from ovines.recording import Recording
from ovines.recording_schema import Host, Nes

Array = NDArray[np.float64]

#: free terms of a ring beside its ellipse, those of the disk and the ellipse's
ROUND_TERMS, DISK_TERMS, ELLIPSE_TERMS = (
    ("radius", "centre_x", "centre_y"),
    ("disk_x", "disk_y"),
    ("ellipse_c", "ellipse_s"),
)
#: ... of a cylinder, and of flat sides as a whole beside the distance of each (:func:`side_term`)
CYLINDER_TERMS, TURN = ("cylinder_radius", "cylinder_x", "cylinder_y"), "turn"
#: what the free terms are called in table ``identification``
PARAMETERS = {
    "radius": "contact_radius_m",
    "centre_x": "wall_centre_x_m",
    "centre_y": "wall_centre_y_m",
    "disk_x": "disk_centre_x_m",
    "disk_y": "disk_centre_y_m",
    "ellipse_c": "wall_ellipticity_cos",
    "ellipse_s": "wall_ellipticity_sin",
    "turn": "wall_turn_rad",
    "cylinder_radius": "cylinder_contact_radius_m",
    "cylinder_x": "cylinder_centre_x_m",
    "cylinder_y": "cylinder_centre_y_m",
}
# How far a wall may be from the design before the impacts themselves must say so: gluing and turning tolerances,
# generously (shares of the wall's size: 0.3 and 0.2 mm of 40 mm; rad).
LENGTH_PRIOR_SHARE, PLACE_PRIOR_SHARE, TURN_PRIOR_SD_RAD = 7.5e-3, 5e-3, 5e-3
# Surfaces as near as this share of the wall's size may both have been hit: the impulse tells which.
BOTH_SHARE = 0.05


def _zero() -> Array:
    return np.zeros(2)


def side_term(number: int) -> str:
    """Name of the free term that is the contact distance of flat side ``number`` (from 1)."""
    return f"side_{number}"


def wall_parameter(term: str) -> str:
    """What a free term of the wall is called in the table; "side_3", the third flat side's, by its contact distance."""
    return PARAMETERS.get(term, f"{term}_contact_distance_m")


@dataclass(frozen=True, eq=False)
class Ring:
    """Contact distance ``radius_m`` (1 + ellipse . (cos 2 azimuth, sin 2 azimuth)) about ``centre_m`` (2,), in the
    Host's frame; the ellipse in the room."""

    radius_m: float
    centre_m: Array = field(default_factory=_zero)
    ellipse: Array = field(default_factory=_zero)

    @property
    def names(self) -> tuple[str, ...]:
        """Its one surface."""
        return ("ring",)

    @property
    def size_m(self) -> float:
        """Its radius."""
        return self.radius_m

    def rows(self) -> list[list[float]]:
        """Its surfaces for :mod:`analysis.walls.surfaces`."""
        return [[RING, self.radius_m, *self.centre_m, *self.ellipse]]

    def values(self) -> dict[str, float]:
        """Free terms."""
        every = (self.radius_m, *self.centre_m, *self.ellipse)
        return dict(zip((*ROUND_TERMS, *ELLIPSE_TERMS), map(float, every), strict=True))

    def moved(self, step: dict[str, float]) -> Ring:
        """With its terms changed."""
        v = {name: value + step.get(name, 0.0) for name, value in self.values().items()}
        return Ring(v["radius"], np.array([v["centre_x"], v["centre_y"]]), np.array([v["ellipse_c"], v["ellipse_s"]]))

    def grown(self, by_m: float) -> Ring:
        """Standing farther out all round."""
        return replace(self, radius_m=self.radius_m + by_m)

    def shifted(self, by_m: Array) -> Ring:
        """Standing elsewhere by (2,) of the Host's frame."""
        return replace(self, centre_m=self.centre_m + by_m)

    def over(self, length: float) -> Ring:
        """In units of ``length``."""
        return replace(self, radius_m=self.radius_m / length, centre_m=self.centre_m / length)


@dataclass(frozen=True, eq=False)
class Sides:
    """Flat sides of a convex wall: ``direction_rad`` (S,) of their outward normals in the Host's frame, all turned by
    ``turn_rad``; ``distance_m`` (S,) of the disk's centre from the Host's, along them, at contact, designed as
    ``stated_m`` (S,)."""

    direction_rad: Array
    distance_m: Array
    stated_m: Array
    turn_rad: float = 0.0

    @property
    def names(self) -> tuple[str, ...]:
        """Its surfaces."""
        return tuple(f"side {k + 1}" for k in range(len(self.distance_m)))

    @property
    def normals(self) -> Array:
        """Outward normals (S, 2) in the Host's frame."""
        normal = self.direction_rad + self.turn_rad
        return np.stack([np.cos(normal), np.sin(normal)], -1)

    @property
    def to_centre(self) -> Array:
        """(2, S) by which distances beyond the stated ones give a shift of all sides together; growing is none."""
        return np.asarray(np.linalg.pinv(np.column_stack([self.normals, np.ones(len(self.stated_m))]))[:2], float)

    @property
    def centre_m(self) -> Array:
        """How far (2,) the sides are off their place, together."""
        return np.asarray(self.to_centre @ (self.distance_m - self.stated_m), float)

    @property
    def size_m(self) -> float:
        """Radius of the circle whose area the disk's centre may reach."""
        x, y = self.corners_m().T
        return float(np.sqrt(0.5 * abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / np.pi))

    def corners_m(self, out_m: float = 0.0) -> Array:
        """Corners (S, 2) of the region that the disk's centre may reach, in the Host's frame; of the wall itself
        ``out_m`` farther out, by the disk's radius."""
        n = self.normals
        pairs = np.stack([np.roll(n, 1, axis=0), n], 1)
        distance = self.distance_m + out_m
        return np.asarray(np.linalg.solve(pairs, np.stack([np.roll(distance, 1), distance], -1)[..., None])[..., 0])

    def rows(self) -> list[list[float]]:
        """Its surfaces for :mod:`analysis.walls.surfaces`."""
        return [
            [SIDE, float(direction + self.turn_rad), float(distance), 0.0, 0.0, 0.0]
            for direction, distance in zip(self.direction_rad, self.distance_m, strict=True)
        ]

    def values(self) -> dict[str, float]:
        """Free terms."""
        return {side_term(k + 1): float(d) for k, d in enumerate(self.distance_m)} | {TURN: self.turn_rad}

    def moved(self, step: dict[str, float]) -> Sides:
        """With its terms changed."""
        shift = np.array([step.get(side_term(k + 1), 0.0) for k in range(len(self.distance_m))])
        return replace(self, distance_m=self.distance_m + shift, turn_rad=self.turn_rad + step.get(TURN, 0.0))

    def grown(self, by_m: float) -> Sides:
        """Standing farther out all round."""
        return replace(self, distance_m=self.distance_m + by_m)

    def shifted(self, by_m: Array) -> Sides:
        """Standing elsewhere by (2,) of the Host's frame."""
        return replace(self, distance_m=self.distance_m + self.normals @ by_m)

    def over(self, length: float) -> Sides:
        """In units of ``length``."""
        return replace(self, distance_m=self.distance_m / length, stated_m=self.stated_m / length)


@dataclass(frozen=True, eq=False)
class Cylinder:
    """A cylinder in the Host's middle: ``radius_m`` of the disk's centre about ``centre_m`` (Host's frame) at
    contact."""

    radius_m: float
    centre_m: Array = field(default_factory=_zero)

    @property
    def names(self) -> tuple[str, ...]:
        """Its one surface."""
        return ("cylinder",)

    def rows(self) -> list[list[float]]:
        """Its surfaces for :mod:`analysis.walls.surfaces`."""
        return [[CYLINDER, self.radius_m, *self.centre_m, 0.0, 0.0]]

    def values(self) -> dict[str, float]:
        """Free terms."""
        return dict(zip(CYLINDER_TERMS, map(float, (self.radius_m, *self.centre_m)), strict=True))

    def moved(self, step: dict[str, float]) -> Cylinder:
        """With its terms changed."""
        radius, x, y = (value + step.get(name, 0.0) for name, value in self.values().items())
        return Cylinder(radius, np.array([x, y]))

    def over(self, length: float) -> Cylinder:
        """In units of ``length``."""
        return Cylinder(self.radius_m / length, self.centre_m / length)


@dataclass(frozen=True, eq=False)
class Wall:
    """All that the disk can meet: ``outline``, perhaps a ``cylinder``; ``disk_m`` (2,): geometric centre of the disk
    against its centre of mass, in the disk's frame (m)."""

    outline: Ring | Sides
    cylinder: Cylinder | None = None
    disk_m: Array = field(default_factory=_zero)

    @classmethod
    def ring(cls, contact_radius_m: float) -> Wall:
        """A round wall and nothing else."""
        return cls(Ring(float(contact_radius_m)))

    @property
    def size_m(self) -> float:
        """Contact radius, of flat sides that of the circle with as large an area."""
        return self.outline.size_m

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the surfaces (S,)."""
        return self.outline.names + (self.cylinder.names if self.cylinder else ())

    @property
    def surfaces(self) -> Array:
        """Rows (S, 6) for :mod:`analysis.walls.surfaces`."""
        return np.array(self.outline.rows() + (self.cylinder.rows() if self.cylinder else [])).reshape(-1, ROW)

    def values(self) -> dict[str, float]:
        """Free terms and their values: outline, cylinder, disk, and a ring's ellipse last."""
        outline = self.outline.values()
        ellipse = {name: outline.pop(name) for name in ELLIPSE_TERMS if name in outline}
        disk = dict(zip(DISK_TERMS, map(float, self.disk_m), strict=True))
        return outline | (self.cylinder.values() if self.cylinder else {}) | disk | ellipse

    @property
    def terms(self) -> tuple[str, ...]:
        """Names of all free terms."""
        return tuple(self.values())

    @property
    def nominal_terms(self) -> tuple[str, ...]:
        """The free terms of a wall that is what it is meant to be: all but the ellipse."""
        return tuple(name for name in self.values() if name not in ELLIPSE_TERMS)

    @property
    def ellipse_terms(self) -> tuple[str, ...]:
        """The free terms of a ring's ellipse; none of flat sides."""
        return ELLIPSE_TERMS if isinstance(self.outline, Ring) else ()

    @property
    def centre_m(self) -> Array:
        """How far (2,) the outline is off its stated place, in the Host's frame."""
        return self.outline.centre_m

    @property
    def ellipse(self) -> Array:
        """Ellipse (2,) of a ring; none of flat sides."""
        return self.outline.ellipse if isinstance(self.outline, Ring) else np.zeros(2)

    def moved(self, step: dict[str, float]) -> Wall:
        """With its terms changed."""
        disk = self.disk_m + np.array([step.get(name, 0.0) for name in DISK_TERMS])
        return Wall(self.outline.moved(step), self.cylinder.moved(step) if self.cylinder else None, disk)

    def grown(self, by_m: float) -> Wall:
        """With the outline farther out all round."""
        return replace(self, outline=self.outline.grown(by_m))

    def shifted(self, by_m: Array) -> Wall:
        """With the outline elsewhere by (2,) of the Host's frame."""
        return replace(self, outline=self.outline.shifted(by_m))

    def over(self, length: float) -> Wall:
        """In units of ``length``."""
        return Wall(
            self.outline.over(length), self.cylinder.over(length) if self.cylinder else None, self.disk_m / length
        )

    def seen(self, which: NDArray[np.int64], places_m: Array, host_angle_rad: Array, radius_m: float) -> Array:
        """Surfaces ``which`` (N,) from disks at ``places_m`` (N, 2) from the Host's centre, in the room's directions:
        (N, 3: gap, normal, azimuth)."""
        out = np.empty((len(places_m), 3))
        places, angles = (np.ascontiguousarray(one, dtype=float) for one in (places_m, host_angle_rad))
        surfaces_seen(self.surfaces, np.ascontiguousarray(which, np.int64), places, angles, float(radius_m), out)
        return out

    def gaps(self, places_m: Array, host_angle_rad: Array, radius_m: float = 0.0) -> tuple[Array, Array]:
        """Gap and normal's direction of every surface, (N, S) each."""
        one = np.ones(len(places_m), np.int64)
        seen = [self.seen(k * one, places_m, host_angle_rad, radius_m) for k in range(len(self.names))]
        return np.column_stack([s[:, 0] for s in seen]), np.column_stack([s[:, 1] for s in seen])

    def gap(self, places_m: Array, host_angle_rad: Array) -> Array:
        """How far (N,) past the wall each place is, whichever surface it is nearest to; NaN where unknown."""
        return np.asarray(self.gaps(places_m, host_angle_rad)[0].max(axis=1), float)

    def outline_gap(self, places_m: Array, host_angle_rad: Array) -> Array:
        """The same of the outline alone."""
        return np.asarray(replace(self, cylinder=None).gap(places_m, host_angle_rad), float)

    def hit(self, places_m: Array, host_angle_rad: Array, step_m_per_s: Array) -> NDArray[np.int64]:
        """Which surface (N,) gave the disk the change of velocity ``step_m_per_s`` (N, 2): of those within reach the
        one along whose normal it is largest."""
        gaps, normal = self.gaps(places_m, host_angle_rad)
        along = -(step_m_per_s[:, :1] * np.cos(normal) + step_m_per_s[:, 1:] * np.sin(normal))
        near = gaps > gaps.max(axis=1, keepdims=True) - BOTH_SHARE * self.size_m
        return np.asarray(np.argmax(np.where(near, along, -np.inf), axis=1), np.int64)

    def normal(self, which: NDArray[np.int64], azimuth_rad: Array, host_angle_rad: Array) -> Array:
        """Direction (N,) in the room of the outward normal of surfaces ``which`` (N,) where contacts are at
        ``azimuth_rad`` (N,).
        """
        rows = self.surfaces[which]
        twice = 2 * azimuth_rad
        turn = 2 * (rows[:, 4] * np.sin(twice) - rows[:, 5] * np.cos(twice))
        found = np.where(rows[:, 0] == SIDE, rows[:, 1] + host_angle_rad, azimuth_rad + turn)
        return np.asarray(np.where(rows[:, 0] == CYLINDER, azimuth_rad + np.pi, found), float)

    def on_cylinder(self, which: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Whether surfaces ``which`` (N,) are the cylinder in the middle."""
        return np.asarray(self.surfaces[which, 0] == CYLINDER, bool)

    def numbers(self, impacts: pd.DataFrame) -> NDArray[np.int64]:
        """Number of the surface (N,) that each row of table ``impacts`` is on; the first where the table does not
        tell."""
        names = {name: number for number, name in enumerate(self.names)}
        told = impacts["surface"] if "surface" in impacts else pd.Series(self.names[0], impacts.index)
        return told.map(names).fillna(0).to_numpy(np.int64)

    def edges_m(self) -> list[Array]:
        """The closed curves (N, 2) on which the disk's centre is at contact, in the Host's frame, the outline first."""
        angle = np.linspace(0, 2 * np.pi, 201)
        around = np.column_stack([np.cos(angle), np.sin(angle)])
        if isinstance(self.outline, Sides):
            corners = self.outline.corners_m()
            curves = [np.concatenate([corners, corners[:1]])]
        else:
            curves = [self.outline.centre_m + self.outline.radius_m * around]
        return curves + ([self.cylinder.centre_m + self.cylinder.radius_m * around] if self.cylinder else [])

    def reach(self, which: NDArray[np.int64]) -> Array:
        """How far (N,) along their normal surfaces ``which`` (N,) hold the disk's centre from the Host's (< 0 at a
        cylinder); of a ring, as if about the Host's centre."""
        rows = self.surfaces[which]
        return np.asarray(
            np.where(rows[:, 0] == SIDE, rows[:, 2], rows[:, 1] * np.where(rows[:, 0] == CYLINDER, -1, 1))
        )

    @staticmethod
    def is_length(term: str) -> bool:
        """Whether a free term is a length that recording.toml states: a radius, or the distance of a flat side."""
        return term.startswith("side_") or term.endswith("radius")

    def prior_sd(self, term: str) -> float:
        """How far a free term may be from the design (m, rad)."""
        if term in ELLIPSE_TERMS:
            return float("inf")
        if term == TURN:
            return TURN_PRIOR_SD_RAD
        return self.size_m * (PLACE_PRIOR_SHARE if term.endswith(("_x", "_y")) else LENGTH_PRIOR_SHARE)


def stated_wall(recording: Recording) -> Wall:
    """The wall as recording.toml has it, for the disk's centre (m); `InputError` where it lacks wall or disk."""
    bodies = recording.settings.bodies
    if bodies.host is None or bodies.nes is None:
        raise InputError(
            f"{recording.folder}: no wall (inner_radius_m or polygon_m) or no disk (radius_m) in [bodies]",
            "[bodies.host] with its wall and [bodies.nes] radius_m",
            "add them to recording.toml",
        )
    return drawn_wall(bodies.host, bodies.nes)


def drawn_wall(host: Host, nes: Nes) -> Wall:
    """The wall of a Host for the centre of the disk ``nes``, as they are drawn (m); `InputError` where a polygon is not
    convex or leaves the Host's centre outside.
    """
    disk = nes.radius_m
    cylinder = None if host.obstacle_radius_m is None else Cylinder(host.obstacle_radius_m + disk)
    if host.polygon_m is None:
        assert host.inner_radius_m is not None  # the schema has one of the two
        return Wall(Ring(host.inner_radius_m - disk), cylinder)
    corners = np.asarray(host.polygon_m, float)
    side = np.roll(corners, -1, axis=0) - corners
    outwards = np.stack([side[:, 1], -side[:, 0]], -1) / np.linalg.norm(side, axis=1)[:, None]
    distance = np.sum(corners * outwards, axis=1) - disk
    following = np.roll(side, -1, axis=0)
    turns = side[:, 0] * following[:, 1] - side[:, 1] * following[:, 0]
    if np.any(turns <= 0) or np.any(distance <= 0):
        raise InputError(
            "[bodies.host] polygon_m is not convex, or the Host's centre is not a disk's radius inside it",
            "corners of a convex polygon about the Host's centre, counter-clockwise",
            "correct polygon_m in recording.toml",
        )
    return Wall(Sides(np.arctan2(outwards[:, 1], outwards[:, 0]), distance, distance), cylinder)


def identified_wall(identification: pd.DataFrame | None, recording: Recording) -> Wall:
    """The stated wall with what table ``identification`` has of its terms (m)."""
    stated = stated_wall(recording)
    if identification is None:
        return stated
    found = identification.set_index("parameter")["value"].astype(float).to_dict()
    step = {term: found.get(wall_parameter(term), np.nan) - value for term, value in stated.values().items()}
    return stated.moved({term: by for term, by in step.items() if np.isfinite(by)})


def motion_gaps(motion: pd.DataFrame, wall: Wall) -> Array:
    """Gap (N, S) of every surface of ``wall`` in each frame of table ``motion`` (m); NaN where NES or Host is unknown.

    A Host of unknown angle is taken as it was drawn."""
    places = [motion[[f"{body}_x_m", f"{body}_y_m"]].to_numpy(float) for body in ("nes", "host")]
    angle = motion["host_angle_rad"].to_numpy(float) if "host_angle_rad" in motion else np.zeros(len(motion))
    return wall.gaps(places[0] - places[1], angle if np.isfinite(angle).any() else np.zeros(len(motion)))[0]
