"""The table ``walls``: inner wall of the Host and rim of the NES from their edges in both pictures, at instants of a
recording.

A second opinion that needs no marker but to know where to look: its radii stand against those of recording.toml and of
the circles through the Host's markers, its centres against where the markers' layouts put them.
"""

from __future__ import annotations

from collections.abc import Container, Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ovines.camera import Camera
from ovines.recording import Recording
from ovines.robust import spread
from vision.identity.layouts import Layout
from vision.walls.rims import Rim, fit_rim

AT_MOST = 16  # instants; a rim costs about as much as tracking 25 frames
_LARGEST_SD = 0.004  # radii of the largest circle looked for: one less certain than this is none
# Share of a radius' sd that does not average out over the instants: light and edges are the same in all (by rendered
# scenes).
_SHARED = 0.7
_FEWEST = 3  # instants that give a body's radius and height, and a note on them
_SEARCH = 0.06  # of the radius, until it is known
_FARTHEST = 0.06  # of those radii from where the markers say; farther, another edge was taken
COLUMNS = (
    "frame",
    "time_s",
    "body",
    "x_m",
    "y_m",
    "z_m",
    "radius_m",
    "x_sd_m",
    "y_sd_m",
    "z_sd_m",
    "radius_sd_m",
    "residual_px",
    "points",
    "marker_x_m",
    "marker_y_m",
)


def instants(numbers: Sequence[int]) -> set[int]:
    """Frames at which the walls are looked at: evenly over the recording, away from its ends."""
    if not len(numbers):
        return set()
    place = (np.arange(AT_MOST) + 0.5) / AT_MOST * len(numbers)
    return {int(numbers[int(k)]) for k in place}


def expected_rims(recording: Recording, layout: Layout) -> dict[str, tuple[float, float]]:
    """Per round body of known `layout` its radius [m] and the height at which its rim is looked for: that of its
    markers.
    """
    rims = {}
    for name, radius_m in (
        ("host", getattr(recording.bodies.get("host"), "inner_radius_m", None)),
        ("nes", getattr(recording.bodies.get("nes"), "radius_m", None)),
    ):
        if radius_m and name in layout.bodies and layout.known[layout.bodies.index(name)]:
            rims[name] = (radius_m, float(layout.position_m[layout.of(layout.bodies.index(name)), 2].mean()))
    return rims


def rim_row(
    frame: int, body: str, rim: Rim, marker_xy_m: NDArray[np.float64], largest_m: float
) -> dict[str, Any] | None:
    """One row of the table; None for a circle that is not this body's.  `largest_m`: radius of the largest circle
    looked for.
    """
    sd = rim.sd_m
    if not np.all(sd < _LARGEST_SD * largest_m) or np.hypot(*(rim.centre_m[:2] - marker_xy_m)) > _FARTHEST * largest_m:
        return None
    x, y, z = rim.centre_m
    return {
        "frame": frame,
        "body": body,
        "x_m": x,
        "y_m": y,
        "z_m": z,
        "radius_m": rim.radius_m,
        "x_sd_m": sd[0],
        "y_sd_m": sd[1],
        "z_sd_m": sd[2],
        "radius_sd_m": sd[3],
        "residual_px": rim.residual_px,
        "points": int(sum(rim.n_points)),
        "marker_x_m": marker_xy_m[0],
        "marker_y_m": marker_xy_m[1],
    }


def rims_at(
    frame: int,
    images: Sequence[NDArray[Any]],
    cameras: Sequence[Camera],
    offsets_px: Sequence[tuple[int, int]],
    rims: dict[str, tuple[float, float]],
    centres_m: dict[str, NDArray[np.float64]],
    before: Sequence[dict[str, Any]] = (),
) -> list[dict[str, Any]]:
    """Rows of the table for one instant; `centres_m`: (2,) of each body that both cameras follow.

    `before`: rows of earlier instants, whose radius and height save the search for them.
    """
    rows = []
    largest_m = max((radius_m for radius_m, _ in rims.values()), default=0.0)
    for body, (radius_m, height_m) in rims.items():
        if body not in centres_m:
            continue
        known = [(row["radius_m"], row["z_m"]) for row in before if row["body"] == body]
        search = _SEARCH
        if len(known) >= _FEWEST:
            (radius_m, height_m), search = np.median(known, axis=0), 0.0
        rim = fit_rim(images, cameras, offsets_px, np.append(centres_m[body], height_m), radius_m, search)
        row = None if rim is None else rim_row(frame, body, rim, centres_m[body], largest_m)
        if row is not None:
            rows.append(row)
    return rows


def wall_table(rows: Sequence[dict[str, Any]], frames: NDArray[Any], times_s: NDArray[Any]) -> pd.DataFrame:
    """The table from its rows, with the frames' times."""
    table = pd.DataFrame(list(rows), columns=[name for name in COLUMNS if name != "time_s"])
    times = pd.Series(times_s, index=frames)
    table.insert(1, "time_s", times.reindex(table["frame"]).to_numpy(float))
    return table[table["time_s"].notna()].reset_index(drop=True)


def scatter_of(own: pd.DataFrame) -> tuple[float, float]:
    """Radius [m] of one body over the instants, and its sd without the calibration's own."""
    radius = float(own["radius_m"].median())
    scatter = spread(own["radius_m"]) / np.sqrt(len(own))
    one = float(own["radius_sd_m"].median())
    return radius, float(np.hypot(max(scatter, one / np.sqrt(len(own))), _SHARED * one))


def wall_notes(walls: pd.DataFrame, rims: dict[str, tuple[float, float]], placed: Container[str]) -> list[str]:
    """One line per body: radius with its scatter over the instants, and how far the centre lies from where the layout
    of those ``placed`` (with a `layout_m`) has it.
    """
    notes = []
    for body, (radius_m, _) in rims.items():
        own = walls[walls["body"] == body]
        if len(own) < _FEWEST:
            continue
        radius, sd = scatter_of(own)
        off = np.median(own[["x_m", "y_m"]].to_numpy() - own[["marker_x_m", "marker_y_m"]].to_numpy(), axis=0)
        notes.append(
            f"{'inner wall of the Host' if body == 'host' else 'rim of the NES'} from images at {len(own)} instants: "
            f"radius {1e3 * radius:.3f} mm, sd {1e6 * sd:.1f} um without the calibration's own "
            f"(recording.toml: {1e3 * radius_m:g} mm)"
            + (
                f"; its centre lies {1e6 * np.hypot(*off):.0f} um from where the markers' layout puts it"
                if body in placed
                else ""
            )
        )
    return notes
