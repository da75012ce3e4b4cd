"""Checks on the triangulated markers: two views of one marker meet, a rigid body stays as it is, the Host's markers lie
on its wall.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pandas as pd

from analysis.checks.row import ALL, Row, figure, row
from analysis.motion.host_circle import host_circle
from ovines.recording import Recording
from ovines.robust import spread

# Half a pixel is five times what a circular marker's centre scatters by on a good image; more points to the
# calibration.
POOR_REPROJECTION_PX = 0.5
# Distances between Host markers over what their sds say: sample series and rendered films 0.7 to 1.3; a quarter more is
# a lens' residual.
POOR_DISTANCE_SD = 3.0
# The Host markers' circle is the wall's where they are glued on it: the thesis' largest error (Fig. 56) is 0.9 % of its
# radius.
POOR_CIRCLE_SHARE = 0.01
FEWEST_FRAMES = 10


def check_points(points: pd.DataFrame | None, recording: Recording) -> list[Row | None]:
    """Rows on the table ``points``; none where a recording enters after it."""
    if points is None or not len(points):
        return []
    return [_reprojection(points), _rigid(points, recording), _circle(points, recording)]


def _reprojection(points: pd.DataFrame) -> Row | None:
    if not points["reprojection_px"].notna().any():
        return None
    value = float(np.nanmedian(points["reprojection_px"]))
    return row(
        "reprojection",
        value,
        POOR_REPROJECTION_PX,
        value <= POOR_REPROJECTION_PX,
        f"The cameras' views of a marker miss each other by {figure(value)} px (median).",
        ALL,
        "Check window_offset_px and the extrinsic view, or calibrate again.",
    )


def _rigid(points: pd.DataFrame, recording: Recording) -> Row | None:
    host = recording.bodies.get("host")
    value = worst_distance(points, list(host.markers)) if host is not None else None
    if value is None:
        return None
    name, size, sd_m = value
    return row(
        "distances between Host markers, over their sds",
        size,
        POOR_DISTANCE_SD,
        size <= POOR_DISTANCE_SD,
        f"The distance {name} varies by {figure(1e6 * sd_m)} µm, {figure(size)} times what the markers' sds say.",
        ALL,
        "Look for a loose marker or a mistaken name.",
    )


def worst_distance(points: pd.DataFrame, markers: list[str]) -> tuple[str, float, float] | None:
    """The pair whose distance varies most over what its sds say, that ratio, and the distance's robust sd (m); None
    without a pair.
    """
    axes = ["x_m", "y_m", "z_m"][: 2 if points["z_m"].isna().all() else 3]  # of one camera: as seen from above
    wide = points[points["marker"].isin(markers)].pivot(
        index="frame", columns="marker", values=[*axes, *(f"{axis[0]}_sd_m" for axis in axes)]
    )
    worst = None
    for one, other in combinations([name for name in markers if ("x_m", name) in wide], 2):
        apart = np.column_stack([wide[axis, one] - wide[axis, other] for axis in axes])
        sds = np.column_stack([np.hypot(wide[f"{axis[0]}_sd_m", one], wide[f"{axis[0]}_sd_m", other]) for axis in axes])
        size = np.linalg.norm(apart, axis=1)
        expected = np.linalg.norm(sds * apart, axis=1) / size
        known = np.isfinite(size) & np.isfinite(expected) & (expected > 0)
        if known.sum() < FEWEST_FRAMES:
            continue
        sd_m = spread(size[known])
        ratio = sd_m / float(np.median(expected[known]))
        if worst is None or ratio > worst[1]:
            worst = f"{one}-{other}", ratio, sd_m
    return worst


def _circle(points: pd.DataFrame, recording: Recording) -> Row | None:
    host = recording.bodies.get("host")
    inner = getattr(host, "inner_radius_m", None)
    if host is None or inner is None or host.layout_m is not None or len(host.markers) < 3:
        return None  # with a layout the markers need not lie on the wall's circle
    radii = host_circle(points, recording)["mean_radius_m"].to_numpy(float)
    if not np.isfinite(radii).any():
        return None
    off = float(np.nanmedian(radii)) / inner - 1
    return row(
        "circle through the Host's markers against the wall",
        off,
        POOR_CIRCLE_SHARE,
        abs(off) <= POOR_CIRCLE_SHARE,
        f"The circle through the Host's markers is {100 * off:+.2g} % from inner_radius_m.",
        "",
        "Give layout_m, or check inner_radius_m and the board's square size.",
    )
