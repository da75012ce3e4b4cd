"""The Host's wall as three independent witnesses put it: circle of the markers, edges in the images, the impacts
themselves.

Each is brought to the same quantities: the contact radius R_c = R_H - R_N and the wall's centre in the Host's frame
(that of the markers' layout).  What a source cannot give is NaN; a source that is absent says why.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.motion.host_circle import fit_circles
from analysis.statistics.correlation import slow_mean
from analysis.statistics.robust import MEDIAN_SD
from analysis.walls.drawn import drawn_wall, identified_wall
from analysis.walls.outlines import Sides, side_term, wall_parameter
from analysis.walls.wall import Wall
from ovines.recording import Recording
from ovines.robust import residual_sd

Array = NDArray[np.float64]
NOTHING = (np.nan, np.nan)
# Rims of the rendered recording (sample_data/rendered): wall 2 um too large, disk 11 um too small at 0.29 mm a pixel.
EDGE_BIAS_PX = 0.04


@dataclass(frozen=True)
class WallSource:
    """One witness: what it measured, in words; contact radius and wall centre (Host's frame) with sd, NaN where it does
    not tell.

    ``count``: frames, instants or impacts; ``missing``: why there is nothing, "" where there is."""

    name: str
    measured: str
    contact_radius_m: float = np.nan
    contact_radius_sd_m: float = np.nan
    centre_m: tuple[float, float] = NOTHING
    centre_sd_m: tuple[float, float] = NOTHING
    count: int = 0
    missing: str = ""


def wall_sources(
    recording: Recording,
    motion: pd.DataFrame | None,
    circles: pd.DataFrame | None,
    walls: pd.DataFrame | None,
    identification: pd.DataFrame | None,
    pixel_m: float = np.nan,
) -> list[WallSource]:
    """Design, markers, image edges and impacts, in this order.

    ``circles`` table ``host_circle``, ``walls`` of the image edges; ``pixel_m`` what a pixel shows at the rig (NaN:
    unknown)."""
    return [
        _design(recording),
        _markers(recording, motion, circles),
        _edges(motion, walls, pixel_m),
        _impacts(recording, identification),
    ]


def _design(recording: Recording) -> WallSource:
    name, inner, radius = "recording.toml", _inner_radius_m(recording), _disk_radius_m(recording)
    if not np.isfinite(inner - radius):
        return WallSource(name, "", missing="recording.toml lacks the wall of the Host or radius_m of the NES.")
    flat = getattr(recording.bodies.get("host"), "polygon_m", None) is not None
    what = "flat sides on average" if flat else "wall"
    return WallSource(name, f"{what} {1e3 * inner:.3f} mm less disk {1e3 * radius:.3f} mm", inner - radius)


def _markers(recording: Recording, motion: pd.DataFrame | None, circles: pd.DataFrame | None) -> WallSource:
    """The circle through the markers; beside their layout it is a scale, and the wall's design radius is taken by that
    scale.

    The sd is that of the frames' mean, correlated as they are, and of the placement (layout_sd_m) where it is given."""
    name = "Host markers"
    if circles is None or not np.isfinite(circles["fit_radius_m"]).any():
        return WallSource(name, "", missing="It takes three or more Host markers with coordinates.")
    radius, radius_sd, count = _mean(circles["fit_radius_m"].to_numpy(float))
    measured = f"circle {1e3 * radius:.3f} mm"
    host = recording.settings.bodies.host
    if host is None or host.layout_m is None:
        return WallSource(
            name, measured, count=count, missing="Without layout_m nobody knows how far from the wall the markers sit."
        )
    layout = np.asarray(host.layout_m, float)
    placed = (host.layout_sd_m or 0.0) / np.sqrt(len(layout))
    own_centre, own_radius, _ = (one[0] for one in fit_circles(layout[None]))
    if not np.isfinite(own_radius):
        return WallSource(name, measured, count=count, missing="The markers' layout_m lies on no circle.")
    contact = _inner_radius_m(recording) * radius / own_radius - _disk_radius_m(recording)
    at, at_sd = NOTHING, NOTHING
    if motion is not None:
        seen = (
            _in_host_frame(motion, circles["frame"], circles[["fit_x_m", "fit_y_m"]].to_numpy(float)) - own_centre[:2]
        )
        (x, x_sd, _), (y, y_sd, _) = _mean(seen[:, 0]), _mean(seen[:, 1])
        at = (x, y)
        at_sd = (float(np.hypot(x_sd, np.sqrt(2) * placed)), float(np.hypot(y_sd, np.sqrt(2) * placed)))
    measured += f" (layout_m: {1e3 * own_radius:.3f} mm)"
    return WallSource(name, measured, float(contact), float(np.hypot(radius_sd, placed)), at, at_sd, count)


def _edges(motion: pd.DataFrame | None, walls: pd.DataFrame | None, pixel_m: float) -> WallSource:
    """Rim of the Host's wall less that of the disk, from their edges in the pictures.

    Blur and threshold may set an edge off, at all instants alike: :data:`EDGE_BIAS_PX` is in the radius' sd."""
    name = "image edges"
    if walls is None or not len(walls):
        return WallSource(
            name, "", missing="The recording brought no images, or no rim was seen whole (walls.parquet)."
        )
    host, nes = walls[walls["body"] == "host"], walls[walls["body"] == "nes"]
    at, at_sd = NOTHING, NOTHING
    if motion is not None and len(host):
        seen = _in_host_frame(motion, host["frame"], host[["x_m", "y_m"]].to_numpy(float))
        (x, x_sd, _), (y, y_sd, _) = (
            _mean(seen[:, 0], host["x_sd_m"].to_numpy(float)),
            _mean(seen[:, 1], host["y_sd_m"].to_numpy(float)),
        )
        at, at_sd = (x, y), (x_sd, y_sd)
    wall, wall_sd, _ = _mean(host["radius_m"].to_numpy(float), host["radius_sd_m"].to_numpy(float))
    disk, disk_sd, _ = _mean(nes["radius_m"].to_numpy(float), nes["radius_sd_m"].to_numpy(float))
    bias = EDGE_BIAS_PX * pixel_m if np.isfinite(pixel_m) else 0.0
    parts = [f"{what} {1e3 * value:.3f} mm" for what, value in (("wall", wall), ("disk", disk)) if np.isfinite(value)]
    missing = "" if len(parts) == 2 else f"The rim of the {'disk' if np.isfinite(wall) else 'wall'} was not seen whole."
    return WallSource(
        name,
        " less ".join(parts),
        wall - disk,
        float(np.sqrt(wall_sd**2 + disk_sd**2 + 2 * bias**2)),
        at,
        at_sd,
        len(host),
        missing,
    )


def _impacts(recording: Recording, identification: pd.DataFrame | None) -> WallSource:
    """The distance of the two centres at impacts; along their normals where the sides are flat."""
    name = "impacts"
    rows = {} if identification is None else {str(row["parameter"]): row for _, row in identification.iterrows()}
    if wall_parameter(side_term(1)) in rows:
        return _flat_sides(identified_wall(identification, recording), rows)
    if "contact_radius_m" not in rows:
        return WallSource(name, "", missing="No impact was identified.")
    radius = rows["contact_radius_m"]
    centre = [rows.get(f"wall_centre_{axis}_m") for axis in "xy"]
    at, at_sd = (tuple(float("nan") if row is None else float(row[c]) for row in centre) for c in ("value", "sd"))
    count = 0 if pd.isna(radius["n_impacts"]) else int(radius["n_impacts"])
    return WallSource(
        name,
        "centres' distance at contact",
        float(radius["value"]),
        float(radius["sd"]),
        (at[0], at[1]),
        (at_sd[0], at_sd[1]),
        count,
    )


def _flat_sides(wall: Wall, rows: dict[str, pd.Series]) -> WallSource:
    """Mean contact distance of the flat sides, and how far they are off their place together."""
    assert isinstance(wall.outline, Sides)
    sides = [rows[wall_parameter(side_term(k + 1))] for k in range(len(wall.outline.names))]
    sd = np.array([float(side["sd"]) for side in sides])
    x, y = wall.centre_m
    x_sd, y_sd = np.sqrt(wall.outline.to_centre**2 @ sd**2)
    return WallSource(
        "impacts",
        "centre's distance from flat sides at contact",
        float(np.mean(wall.outline.distance_m)),
        float(np.sqrt(np.mean(sd**2) / len(sd))),
        (float(x), float(y)),
        (float(x_sd), float(y_sd)),
        0 if pd.isna(sides[0]["n_impacts"]) else int(sides[0]["n_impacts"]),
    )


def _inner_radius_m(recording: Recording) -> float:
    """Radius of the round wall, or the mean distance of flat sides, from the Host's centre (m)."""
    host, nes = recording.settings.bodies.host, recording.settings.bodies.nes
    if host is None or nes is None:
        return float("nan")
    outline = drawn_wall(host, nes).outline
    return nes.radius_m + float(np.mean(outline.distance_m) if isinstance(outline, Sides) else outline.radius_m)


def _disk_radius_m(recording: Recording) -> float:
    value = getattr(recording.bodies.get("nes"), "radius_m", None)
    return float("nan") if value is None else float(value)


def _in_host_frame(motion: pd.DataFrame, frames: pd.Series, xy_m: Array) -> Array:
    """Places (F, 2) in the room as seen from the Host's pose in those frames; NaN where that is unknown."""
    pose = (
        motion.drop_duplicates("frame")
        .set_index("frame")[["host_x_m", "host_y_m", "host_angle_rad"]]
        .reindex(frames)
        .to_numpy(float)
    )
    relative, c, s = xy_m - pose[:, :2], np.cos(pose[:, 2]), np.sin(pose[:, 2])
    return np.column_stack([c * relative[:, 0] + s * relative[:, 1], -s * relative[:, 0] + c * relative[:, 1]])


def _mean(values: Array, sd: Array | None = None) -> tuple[float, float, int]:
    """Median of the finite ``values`` (F,), sd of it and their number.

    The sd is that of the scatter, widened by the correlation of neighbours (AR(1)), and no less than the single ``sd``
    allow."""
    good = np.isfinite(values)
    x = values[good]
    if not len(x):
        return float("nan"), float("nan"), 0
    middle = float(np.median(x))
    residual = x - middle
    spread = residual_sd(residual)
    result = MEDIAN_SD * spread * slow_mean(residual, np.inf) / np.sqrt(len(x)) if len(x) > 2 else float("nan")
    if sd is not None:
        result = float(np.fmax(result, np.median(sd[good]) / np.sqrt(len(x))))
    return middle, float(result), len(x)
