"""What the renderer draws: the rig's bodies, their poses, and the painter's list they make."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ovines.camera import Camera
from vision.rendering import kernel

Array = NDArray[np.float64]
BODIES = ("ground", "host", "nes")


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
class Rig:
    """The bodies as the cameras see them.  A None radius leaves the shape out (markers only).

    ``markers`` by body name ("ground", "host", "nes").  The Host is a ring with an inner wall from its
    floor (z = 0) to ``wall_height_m``, round (``host_inner_radius_m``) or flat-walled (``host_polygon_m``,
    (n, 2)); the NES is a cylinder.  Greys are 0..255 before the light falls on them.
    """

    markers: Mapping[str, Markers] = field(default_factory=dict)
    host_inner_radius_m: float | None = 0.05
    host_polygon_m: Array | None = None
    host_outer_radius_m: float = 0.06
    wall_height_m: float = 0.012
    obstacle_radius_m: float | None = None
    nes_radius_m: float | None = 0.010
    nes_height_m: float = 0.010
    background_grey: float = 95.0
    ring_grey: float = 190.0
    outer_wall_grey: float = 120.0
    inner_wall_grey: float = 70.0
    floor_grey: float = 140.0
    nes_grey: float = 200.0
    nes_side_grey: float = 100.0


class _Painter:
    """Collects layers and the world points that bound each."""

    def __init__(self, poses: Mapping[str, Pose]) -> None:
        self.poses = poses
        self.rows: list[list[float]] = []
        self.vertices: list[Array] = []
        self.outlines: list[Array] = []

    def add(
        self,
        kind: int,
        body: str,
        centre: ArrayLike,
        top_m: float,
        radius_m: float,
        grey: float,
        *,
        bottom_m: float | None = None,
        clip: int = -1,
        on: int = -1,
        polygon_m: Array | None = None,
    ) -> int:
        bottom_m = top_m if bottom_m is None else bottom_m
        x, y = np.asarray(centre, float)[:2]
        first, count = len(self.vertices), 0
        if polygon_m is not None:
            outline, count = np.asarray(polygon_m, float), len(polygon_m)
            self.vertices.extend(outline)
        else:
            turn = np.linspace(0, 2 * np.pi, 24, endpoint=False)
            outline = 1.01 * radius_m * np.stack([np.cos(turn), np.sin(turn)], -1) + (x, y)
        self.rows.append([kind, BODIES.index(body), x, y, top_m, bottom_m, radius_m, grey, clip, first, count, on])
        heights = [np.c_[outline, np.full(len(outline), z)] for z in (top_m, bottom_m)]
        self.outlines.append(self.poses[body].place(np.concatenate(heights)))
        return len(self.rows) - 1

    def markers(self, body: str, rig: Rig, clip: int, clip_below_m: float) -> None:
        if body not in rig.markers:
            return
        markers = rig.markers[body]
        for centre in np.asarray(markers.layout_m, float):
            self.add(
                kernel.DISC,
                body,
                centre,
                centre[2],
                markers.radius_m,
                markers.grey,
                clip=clip if centre[2] < clip_below_m else -1,
            )

    def opening(self, rig: Rig, z_m: float, grey: float, clip: int = -1) -> int:
        if rig.host_polygon_m is not None:
            return self.add(kernel.POLYGON, "host", (0, 0), z_m, 0.0, grey, clip=clip, polygon_m=rig.host_polygon_m)
        return self.add(kernel.DISC, "host", (0, 0), z_m, rig.host_inner_radius_m or 0.0, grey, clip=clip)

    def cylinder(
        self, body: str, radius_m: float, height_m: float, wall_m: float, top: float, side: float, clip: int
    ) -> None:
        """A standing cylinder in the Host: what lies below the wall's top is seen through the opening only."""
        low = min(height_m, wall_m) if clip >= 0 else height_m
        beneath = self.add(kernel.CYLINDER, body, (0, 0), low, radius_m, side, bottom_m=0.0, clip=clip)
        if height_m > low:
            beneath = self.add(kernel.CYLINDER, body, (0, 0), height_m, radius_m, side, bottom_m=low)
        self.add(kernel.DISC, body, (0, 0), height_m, radius_m, top, clip=clip if height_m < wall_m else -1, on=beneath)


def layers_of(rig: Rig, poses: Mapping[str, Pose]) -> tuple[Array, Array, list[Array]]:
    """Painter's list (L, COLUMNS), polygon vertices (V, 2), and per layer the world points around it."""
    painter = _Painter(poses)
    painter.markers("ground", rig, -1, 0.0)
    clip = -1
    if rig.host_inner_radius_m is not None or rig.host_polygon_m is not None:
        side = painter.add(
            kernel.CYLINDER,
            "host",
            (0, 0),
            rig.wall_height_m,
            rig.host_outer_radius_m,
            rig.outer_wall_grey,
            bottom_m=0.0,
        )
        painter.add(kernel.DISC, "host", (0, 0), rig.wall_height_m, rig.host_outer_radius_m, rig.ring_grey, on=side)
        clip = painter.opening(rig, rig.wall_height_m, rig.inner_wall_grey)
        painter.opening(rig, 0.0, rig.floor_grey, clip)
    painter.markers("host", rig, clip, 0.9 * rig.wall_height_m if _inside(rig) else -1.0)
    if rig.obstacle_radius_m is not None:
        painter.cylinder(
            "host",
            rig.obstacle_radius_m,
            rig.wall_height_m,
            rig.wall_height_m,
            rig.ring_grey,
            rig.outer_wall_grey,
            clip,
        )
    if rig.nes_radius_m is not None:
        painter.cylinder(
            "nes", rig.nes_radius_m, rig.nes_height_m, rig.wall_height_m, rig.nes_grey, rig.nes_side_grey, clip
        )
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
    """Share of a marker's disc that the Host's wall leaves in sight (0..1), by 97 points of the disc."""
    markers = rig.markers[body]
    centre = np.asarray(markers.layout_m, float)[marker]
    has_wall = rig.host_inner_radius_m is not None and rig.host_polygon_m is None
    if body != "nes" or not has_wall or centre[2] >= rig.wall_height_m:
        return 1.0
    turn = np.linspace(0, 2 * np.pi, 16, endpoint=False)
    rings = [
        centre + r * markers.radius_m * np.stack([np.cos(turn), np.sin(turn), 0 * turn], -1)
        for r in np.sqrt((np.arange(6) + 0.5) / 6)
    ]
    host = poses["host"]
    points = (poses[body].place(np.concatenate([centre[None], *rings])) - host.position_m) @ host.rotation
    eye = (camera.centre_m - host.position_m) @ host.rotation
    along = (rig.wall_height_m - points[:, 2]) / (eye[2] - points[:, 2])
    through = points + along[:, None] * (eye - points)
    return float(np.mean(np.hypot(through[:, 0], through[:, 1]) < rig.host_inner_radius_m))
