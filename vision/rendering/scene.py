"""What the renderer draws: the rig's bodies, their poses, and the painter's list they make."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ovines.camera import Camera
from vision.rendering import kernel

Array = NDArray[np.float64]
BODIES = ("ground", "host", "nes")
OUTLINE_POINTS, _OUTLINE_RADII = 24, 1.01  # points about a round shape; so far out that their polygon holds it
_ON_WALL = 0.9  # of the wall's height, from which a Host's marker stands on the ring and not on the floor
# Points of a marker's disc by which its visible share is estimated: its centre, and rings of equal area.
_SHARE_RINGS, _SHARE_POINTS = 6, 16


@dataclass(frozen=True)
class Pose:
    """Where a body is: its origin in the world, turn about z, and small tilts about x and y (applied last)."""

    x_m: float = 0.0
    y_m: float = 0.0
    z_m: float = 0.0
    angle_rad: float = 0.0
    tilt_x_rad: float = 0.0
    tilt_y_rad: float = 0.0

    @property
    def position_m(self) -> Array:
        """The body's origin in the world (3,) [m]."""
        return np.array([self.x_m, self.y_m, self.z_m])

    @property
    def rotation(self) -> Array:
        """(3, 3), ``X_world = rotation @ X_body + position_m``."""
        c, s = np.cos(self.angle_rad), np.sin(self.angle_rad)
        cx, sx = np.cos(self.tilt_x_rad), np.sin(self.tilt_x_rad)
        cy, sy = np.cos(self.tilt_y_rad), np.sin(self.tilt_y_rad)
        about_z = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        return (
            np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
            @ np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
            @ about_z
        )

    def place(self, points_m: ArrayLike) -> Array:
        """Points (..., 3) of the body's frame in the world."""
        return np.asarray(points_m, float) @ self.rotation.T + self.position_m


@dataclass(frozen=True)
class Markers:
    """One body's circular markers: names, centres (n, 3) in the body's frame, radius and grey of the discs."""

    names: tuple[str, ...]
    layout_m: Array
    radius_m: float = 0.002
    grey: float = 20.0


@dataclass(frozen=True)
class Greys:
    """Greys 0..255 of what the renderer draws, before the light falls on it."""

    background: float = 95.0
    ring: float = 190.0
    outer_wall: float = 120.0
    inner_wall: float = 70.0
    floor: float = 140.0
    nes: float = 200.0
    nes_side: float = 100.0


@dataclass(frozen=True)
class Rig:
    """The bodies as the cameras see them.  A None radius leaves the shape out (markers only).

    ``markers`` by body name ("ground", "host", "nes").  The Host is a ring with an inner wall from its
    floor (z = 0) to ``wall_height_m``, round (``host_inner_radius_m``) or flat-walled (``host_polygon_m``,
    (n, 2)); the NES is a cylinder.
    """

    markers: Mapping[str, Markers] = field(default_factory=dict)
    host_inner_radius_m: float | None = 0.05
    host_polygon_m: Array | None = None
    host_outer_radius_m: float = 0.06
    wall_height_m: float = 0.012
    obstacle_radius_m: float | None = None
    nes_radius_m: float | None = 0.010
    nes_height_m: float = 0.010
    greys: Greys = Greys()


class Shape(NamedTuple):
    """One layer of the painting: a disc, cylinder or polygon (`kernel`) of a body, seen through layer ``clip`` and
    lying on layer ``on`` (-1: none); ``bottom_m`` None: flat.
    """

    kind: int
    body: str
    top_m: float
    grey: float
    radius_m: float = 0.0
    centre: tuple[float, float] = (0.0, 0.0)
    bottom_m: float | None = None
    clip: int = -1
    on: int = -1
    polygon_m: Array | None = None


class _Painter:
    """Collects layers and the world points that bound each."""

    def __init__(self, poses: Mapping[str, Pose]) -> None:
        self.poses = poses
        self.rows: list[Array] = []
        self.vertices: list[Array] = []
        self.outlines: list[Array] = []

    def add(self, shape: Shape) -> int:
        """Number of the new layer."""
        (x, y), top_m = shape.centre, shape.top_m
        bottom_m = top_m if shape.bottom_m is None else shape.bottom_m
        first, count = len(self.vertices), 0
        if shape.polygon_m is not None:
            outline, count = np.asarray(shape.polygon_m, float), len(shape.polygon_m)
            self.vertices.extend(outline)
        else:
            turn = np.linspace(0, 2 * np.pi, OUTLINE_POINTS, endpoint=False)
            outline = _OUTLINE_RADII * shape.radius_m * np.stack([np.cos(turn), np.sin(turn)], -1) + (x, y)
        row = np.zeros(kernel.COLUMNS)
        row[kernel.KIND], row[kernel.BODY] = shape.kind, BODIES.index(shape.body)
        row[kernel.X], row[kernel.Y], row[kernel.TOP], row[kernel.BOTTOM] = x, y, top_m, bottom_m
        row[kernel.RADIUS], row[kernel.GREY], row[kernel.CLIP], row[kernel.ON] = (
            shape.radius_m,
            shape.grey,
            shape.clip,
            shape.on,
        )
        row[kernel.FIRST_VERTEX], row[kernel.VERTICES] = first, count
        self.rows.append(row)
        heights = [np.c_[outline, np.full(len(outline), z)] for z in (top_m, bottom_m)]
        self.outlines.append(self.poses[shape.body].place(np.concatenate(heights)))
        return len(self.rows) - 1

    def markers(self, body: str, rig: Rig, clip: int, clip_below_m: float) -> None:
        if body not in rig.markers:
            return
        markers = rig.markers[body]
        for x, y, z in np.asarray(markers.layout_m, float):
            own_clip = clip if z < clip_below_m else -1
            self.add(Shape(kernel.DISC, body, z, markers.grey, markers.radius_m, (x, y), clip=own_clip))

    def opening(self, rig: Rig, z_m: float, grey: float, clip: int = -1) -> int:
        if rig.host_polygon_m is not None:
            return self.add(Shape(kernel.POLYGON, "host", z_m, grey, clip=clip, polygon_m=rig.host_polygon_m))
        return self.add(Shape(kernel.DISC, "host", z_m, grey, rig.host_inner_radius_m or 0.0, clip=clip))

    def cylinder(
        self, body: str, radius_m: float, height_m: float, wall_m: float, top: float, side: float, clip: int
    ) -> None:
        """A standing cylinder in the Host: what lies below the wall's top is seen through the opening only."""
        low = min(height_m, wall_m) if clip >= 0 else height_m
        beneath = self.add(Shape(kernel.CYLINDER, body, low, side, radius_m, bottom_m=0.0, clip=clip))
        if height_m > low:
            beneath = self.add(Shape(kernel.CYLINDER, body, height_m, side, radius_m, bottom_m=low))
        top_clip = clip if height_m < wall_m else -1
        self.add(Shape(kernel.DISC, body, height_m, top, radius_m, clip=top_clip, on=beneath))


def layers_of(rig: Rig, poses: Mapping[str, Pose]) -> tuple[Array, Array, list[Array]]:
    """Painter's list (L, COLUMNS), polygon vertices (V, 2), and per layer the world points around it."""
    painter, greys = _Painter(poses), rig.greys
    painter.markers("ground", rig, -1, 0.0)
    clip = -1
    if rig.host_inner_radius_m is not None or rig.host_polygon_m is not None:
        wall_m, outer_m = rig.wall_height_m, rig.host_outer_radius_m
        side = painter.add(Shape(kernel.CYLINDER, "host", wall_m, greys.outer_wall, outer_m, bottom_m=0.0))
        painter.add(Shape(kernel.DISC, "host", wall_m, greys.ring, outer_m, on=side))
        clip = painter.opening(rig, rig.wall_height_m, greys.inner_wall)
        painter.opening(rig, 0.0, greys.floor, clip)
    painter.markers("host", rig, clip, _ON_WALL * rig.wall_height_m if _inside(rig) else -1.0)
    if rig.obstacle_radius_m is not None:
        painter.cylinder(
            "host",
            rig.obstacle_radius_m,
            rig.wall_height_m,
            rig.wall_height_m,
            greys.ring,
            greys.outer_wall,
            clip,
        )
    if rig.nes_radius_m is not None:
        painter.cylinder("nes", rig.nes_radius_m, rig.nes_height_m, rig.wall_height_m, greys.nes, greys.nes_side, clip)
    painter.markers("nes", rig, clip, rig.wall_height_m)
    vertices = np.asarray(painter.vertices, float).reshape(-1, 2)
    return np.asarray(painter.rows, float).reshape(-1, kernel.COLUMNS), vertices, painter.outlines


def _inside(rig: Rig) -> bool:
    """Whether the Host's markers stand on its floor (seen through the opening) instead of on its ring."""
    if "host" not in rig.markers or rig.host_inner_radius_m is None:
        return False
    layout = np.asarray(rig.markers["host"].layout_m, float)
    reach = np.hypot(layout[:, 0], layout[:, 1]) + rig.markers["host"].radius_m
    return bool((reach < rig.host_inner_radius_m).all())


def visible_share(camera: Camera, rig: Rig, poses: Mapping[str, Pose], body: str, marker: int) -> float:
    """Share of a marker's disc that the Host's wall leaves in sight (0..1), by points of the disc."""
    markers = rig.markers[body]
    centre = np.asarray(markers.layout_m, float)[marker]
    has_wall = rig.host_inner_radius_m is not None and rig.host_polygon_m is None
    if body != "nes" or not has_wall or centre[2] >= rig.wall_height_m:
        return 1.0
    turn = np.linspace(0, 2 * np.pi, _SHARE_POINTS, endpoint=False)
    rings = [
        centre + r * markers.radius_m * np.stack([np.cos(turn), np.sin(turn), 0 * turn], -1)
        for r in np.sqrt((np.arange(_SHARE_RINGS) + 0.5) / _SHARE_RINGS)
    ]
    host = poses["host"]
    points = (poses[body].place(np.concatenate([centre[None], *rings])) - host.position_m) @ host.rotation
    camera_m = (camera.centre_m - host.position_m) @ host.rotation
    along = (rig.wall_height_m - points[:, 2]) / (camera_m[2] - points[:, 2])
    through = points + along[:, None] * (camera_m - points)
    return float(np.mean(np.hypot(through[:, 0], through[:, 1]) < rig.host_inner_radius_m))
