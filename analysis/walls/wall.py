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

from analysis.walls.outlines import DISK_TERMS, ELLIPSE_TERMS, TURN, Cylinder, Ring, Sides, no_offset
from analysis.walls.surfaces import (
    CYLINDER,
    DISTANCE,
    KIND,
    NORMAL,
    OVAL_COS,
    OVAL_SIN,
    RADIUS,
    RING,
    ROW,
    SIDE,
    surfaces_seen,
)

Array = NDArray[np.float64]

# How far a wall may be from the design before the impacts themselves must say so: gluing and turning tolerances,
# generously (shares of the wall's size: 0.3 and 0.2 mm of 40 mm; rad).
LENGTH_PRIOR_SHARE, PLACE_PRIOR_SHARE, TURN_PRIOR_SD_RAD = 7.5e-3, 5e-3, 5e-3
# Surfaces as near as this share of the wall's size may both have been hit: the impulse tells which.
BOTH_SHARE = 0.05


@dataclass(frozen=True, eq=False)
class Wall:
    """All that the disk can meet: ``outline``, perhaps a ``cylinder``; ``disk_m`` (2,): geometric centre of the disk
    against its centre of mass, in the disk's frame (m)."""

    outline: Ring | Sides
    cylinder: Cylinder | None = None
    disk_m: Array = field(default_factory=no_offset)

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

    def holding(self, rows: Array) -> Wall:
        """Whose ring has laws of its contact radius, packed ``rows`` (T, ROW_SIZE), besides what it has."""
        if not len(rows):
            return self
        assert isinstance(self.outline, Ring), "laws of the contact radius are of a round wall"
        return replace(self, outline=replace(self.outline, law=np.vstack([self.outline.law, rows])))

    def seen(self, which: NDArray[np.int64], places_m: Array, host_angle_rad: Array, radius_m: float) -> Array:
        """Surfaces ``which`` (N,) from disks at ``places_m`` (N, 2) from the Host's centre, in the room's directions:
        (N, 3: gap, normal, azimuth)."""
        out = np.empty((len(places_m), 3))
        places, angles = (np.ascontiguousarray(one, dtype=float) for one in (places_m, host_angle_rad))
        surfaces_seen(self.surfaces, np.ascontiguousarray(which, np.int64), places, angles, float(radius_m), out)
        if isinstance(self.outline, Ring) and len(self.outline.law):
            reach_m, lean_rad = self.outline.by_law(out[:, 2])
            ring = self.surfaces[which][:, 0] == RING
            out[:, 0] -= np.where(ring, reach_m, 0.0)
            out[:, 1] += np.where(ring, lean_rad, 0.0)
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
        turn = 2 * (rows[:, OVAL_COS] * np.sin(twice) - rows[:, OVAL_SIN] * np.cos(twice))
        found = np.where(rows[:, KIND] == SIDE, rows[:, NORMAL] + host_angle_rad, azimuth_rad + turn)
        return np.asarray(np.where(rows[:, KIND] == CYLINDER, azimuth_rad + np.pi, found), float)

    def on_cylinder(self, which: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Whether surfaces ``which`` (N,) are the cylinder in the middle."""
        return np.asarray(self.surfaces[which, 0] == CYLINDER, bool)

    def numbers(self, impacts: pd.DataFrame) -> NDArray[np.int64]:
        """Number of the surface (N,) that each row of table ``impacts`` is on; the first where the table does not
        tell."""
        names = {name: number for number, name in enumerate(self.names)}
        surface = impacts["surface"] if "surface" in impacts else pd.Series(self.names[0], impacts.index)
        return surface.map(names).fillna(0).to_numpy(np.int64)

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
            np.where(
                rows[:, KIND] == SIDE, rows[:, DISTANCE], rows[:, RADIUS] * np.where(rows[:, KIND] == CYLINDER, -1, 1)
            )
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
