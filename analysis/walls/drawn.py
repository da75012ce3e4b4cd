"""The wall of a recording: as recording.toml draws it, as it was identified, and how near a motion comes to it."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.walls.outlines import Cylinder, Ring, Sides, wall_parameter
from analysis.walls.wall import Wall
from ovines.errors import InputError
from ovines.recording import Recording
from ovines.recording_schema import Host, Nes

Array = NDArray[np.float64]


def stated_wall(recording: Recording) -> Wall:
    """The wall as recording.toml has it, for the disk's centre (m); `InputError` where it lacks wall or disk.

    Examples
    --------
    The contact radius: that of the ring less that of the disk.

    >>> from analysis.walls.drawn import stated_wall
    >>> from ovines.notebook import read_recording
    >>> wall = stated_wall(read_recording("sample_data/series_tilted/run-01"))
    >>> f"{1e3 * wall.size_m:.1f} mm", wall.names
    ('40.0 mm', ('ring',))

    How far a disk 39 mm right of the Host's centre is past the wall (negative: inside), then with a ring that is 0.1 mm
    larger.

    >>> import numpy as np
    >>> place_m, host_angle_rad = np.array([[0.039, 0.0]]), np.zeros(1)
    >>> for one in wall, wall.moved({"radius": 1e-4}):
    ...     print(f"{1e3 * one.gap(place_m, host_angle_rad)[0]:.1f} mm")
    -1.0 mm
    -1.1 mm
    """
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
