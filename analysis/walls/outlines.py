"""What a wall is made of: a ring (nearly round), flat sides, a cylinder in the middle, each with its free terms."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from analysis.walls.surfaces import CYLINDER, RING, SIDE
from ovines.core.laws import words as W
from ovines.core.laws.kernel import sizes

Array = NDArray[np.float64]

#: free terms of a ring beside its ellipse, those of the disk and the ellipse's
ROUND_TERMS, DISK_TERMS, ELLIPSE_TERMS = (
    ("radius", "centre_x", "centre_y"),
    ("disk_x", "disk_y"),
    ("ellipse_c", "ellipse_s"),
)
#: ... of a cylinder, and of flat sides as a whole beside the distance of each (:func:`side_term`)
CYLINDER_TERMS, TURN = ("cylinder_radius", "cylinder_x", "cylinder_y"), "turn"
# Step of the azimuth by which a wall's slope is taken, and the steepest that is one: a step in a formula is none.
LEAN_STEP_RAD, MOST_LEAN_RAD = 0.01, 0.2
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


def no_offset() -> Array:
    """On its place (2,)."""
    return np.zeros(2)


def no_law() -> Array:
    """Rows (0, ROW_SIZE) of none."""
    return np.zeros((0, W.ROW_SIZE))


def side_term(number: int) -> str:
    """Name of the free term that is the contact distance of flat side ``number`` (from 1)."""
    return f"side_{number}"


def wall_parameter(term: str) -> str:
    """What a free term of the wall is called in the table; "side_3", the third flat side's, by its contact distance."""
    return PARAMETERS.get(term, f"{term}_contact_distance_m")


@dataclass(frozen=True, eq=False)
class Ring:
    """Contact distance ``radius_m`` (1 + ellipse . (cos 2 azimuth, sin 2 azimuth)) about ``centre_m`` (2,), in the
    Host's frame; the ellipse in the room, and so what written laws of the contact radius, held ``law`` rows
    (T, ROW_SIZE) that follow the azimuth alone, add to it."""

    radius_m: float
    centre_m: Array = field(default_factory=no_offset)
    ellipse: Array = field(default_factory=no_offset)
    law: Array = field(default_factory=no_law)

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
        centre_m, ellipse = np.array([v["centre_x"], v["centre_y"]]), np.array([v["ellipse_c"], v["ellipse_s"]])
        return replace(self, radius_m=v["radius"], centre_m=centre_m, ellipse=ellipse)

    def grown(self, by_m: float) -> Ring:
        """Standing farther out all round."""
        return replace(self, radius_m=self.radius_m + by_m)

    def shifted(self, by_m: Array) -> Ring:
        """Standing elsewhere by (2,) of the Host's frame."""
        return replace(self, centre_m=self.centre_m + by_m)

    def over(self, length: float) -> Ring:
        """In units of ``length``."""
        law = self.law.copy()
        law[:, W.COEFFICIENT] /= length
        return replace(self, radius_m=self.radius_m / length, centre_m=self.centre_m / length, law=law)

    def by_law(self, azimuth_rad: Array) -> tuple[Array, Array]:
        """How far (N,) its laws move it outwards at azimuths (N,) in the room, and by how much (N,; rad) its normal
        leans: by -r'/r, as that of any wall that is nearly round."""
        steps = azimuth_rad + LEAN_STEP_RAD * np.array([[-1.0], [0.0], [1.0]])
        known = np.zeros((steps.size, W.KNOWN_SIZE))
        known[:, W.HX], known[:, W.HY] = np.cos(steps).ravel(), np.sin(steps).ravel()
        parts = np.empty((steps.size, len(self.law)))
        sizes(self.law, known, parts)
        behind, here, ahead = parts.sum(1).reshape(steps.shape)
        lean = (behind - ahead) / (2 * LEAN_STEP_RAD * self.radius_m)
        return here, np.clip(lean, -MOST_LEAN_RAD, MOST_LEAN_RAD)


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
    centre_m: Array = field(default_factory=no_offset)

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
