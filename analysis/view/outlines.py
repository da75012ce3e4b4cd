"""The bodies of a motion as lines in space, and as the cameras see them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.figures.trajectory import column
from analysis.walls.drawn import stated_wall
from ovines.camera import Camera
from ovines.recording import Recording

Array = NDArray[np.float64]
CORNERS = 64  # of a circle drawn as a polygon: 0.1 % of its radius off


def poses(motion: pd.DataFrame, body: str) -> Array:
    """x, y, z (m) and angle (rad) of "nes" or "host", (frames, 4); z and angle are 0 where they were not measured."""
    pose = np.column_stack([column(motion, f"{body}_{name}") for name in ("x_m", "y_m", "z_m", "angle_rad")])
    pose[:, 2:] = np.nan_to_num(pose[:, 2:])
    return pose


def placed(pose: Array, points_m: Array) -> Array:
    """Points (n, 3) of a body's frame in the world under poses (frames, 4): (frames, n, 3); NaN where not seen."""
    c, s = np.cos(pose[:, 3, None]), np.sin(pose[:, 3, None])
    x, y = points_m[:, 0], points_m[:, 1]
    return np.stack(
        [
            pose[:, 0, None] + c * x - s * y,
            pose[:, 1, None] + s * x + c * y,
            pose[:, 2, None] + np.broadcast_to(points_m[:, 2], (len(pose), len(points_m))),
        ],
        -1,
    )


def body_lines(recording: Recording) -> Mapping[str, list[Array]]:
    """Per body the lines (n, 3) that draw it, in its own frame.

    "nes": its edge on the floor and at its markers' height, with a radius at angle 0.  "host": the inner wall likewise,
    and the obstacle's edge where there is one.  Without ``layout_m`` both heights are the floor's.
    """
    host, nes = recording.settings.bodies.host, recording.settings.bodies.nes
    lines: dict[str, list[Array]] = {}
    if host is not None:
        edges = (
            [_circle(host.inner_radius_m)] if host.polygon_m is None else [_closed(np.asarray(host.polygon_m, float))]
        )
        if host.obstacle_radius_m:
            edges.append(_circle(host.obstacle_radius_m))
        lines["host"] = [_at(edge, z) for z in _levels(host.layout_m) for edge in edges]
    if nes is not None:
        edge = _circle(nes.radius_m)
        lines["nes"] = [_at(edge, z) for z in _levels(nes.layout_m)]
        lines["nes"].append(_at(np.array([[0.0, 0.0], edge[0]]), _levels(nes.layout_m)[-1]))
    return lines


def design_markers(recording: Recording) -> Mapping[str, Array]:
    """``layout_m`` (n, 3) of the bodies that move and have one."""
    bodies = {name: recording.bodies.get(name) for name in ("host", "nes")}
    return {name: np.asarray(one.layout_m, float) for name, one in bodies.items() if one is not None and one.layout_m}


def seen_by(camera: Camera, offset_px: tuple[int, int], points_m: Array) -> Array:
    """World points (..., 3) in the camera's window pixels (..., 2)."""
    return camera.project(points_m) - np.asarray(offset_px, float)


def _circle(radius_m: float | None) -> Array:
    angle = np.linspace(0, 2 * np.pi, CORNERS + 1)
    return (radius_m or 0.0) * np.column_stack([np.cos(angle), np.sin(angle)])


def _closed(polygon: Array) -> Array:
    return np.concatenate([polygon, polygon[:1]])


def _at(line: Array, z_m: float) -> Array:
    return np.column_stack([line, np.full(len(line), z_m)])


def _levels(layout_m: tuple[tuple[float, float, float], ...] | None) -> list[float]:
    top = max((z for _, _, z in layout_m), default=0.0) if layout_m else 0.0
    return [0.0, top] if top else [0.0]


def wall_gap_m(motion: pd.DataFrame, recording: Recording) -> Array | None:
    """Free room (frames,) between the disk's edge and the inner wall, by the radii of recording.toml; None without Host
    or NES.
    """
    if recording.settings.bodies.host is None or recording.settings.bodies.nes is None:
        return None
    nes, host = poses(motion, "nes"), poses(motion, "host")
    return -stated_wall(recording).gap(nes[:, :2] - host[:, :2], host[:, 3])
