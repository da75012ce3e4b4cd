"""The Host's wall circle from its markers: the thesis' four three-marker circles, their mean, and a
least-squares circle.

Thesis Sec. 7.3.1.  The four circles share three of their markers pairwise, so their spread says how well the
markers lie on one circle; it is no independent estimate of the error of their mean.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ovines.errors import InputError
from ovines.recording import Recording

Array = NDArray[np.float64]


def host_circle(points: pd.DataFrame, recording: Recording) -> pd.DataFrame:
    """Table ``host_circle``: one row per frame of ``points``.

    ``circle1`` .. ``circle4`` run through the markers (1, 2, 3), (1, 2, 4), (1, 3, 4), (2, 3, 4) of the
    Host's first four; ``mean`` is the mean of those four and needs all of them; ``fit`` is the least-squares
    circle through all Host markers seen (three or more), ``fit_residual_m`` their RMS distance from it (null
    for three: a circle through three points leaves nothing over).  A circle whose markers are not all seen,
    or lie on one line, is null.

    Examples
    --------
    The radius of the circle through the Host's markers, and how far they are off it.

    >>> from ovines.notebook import read_calibration, read_recording, read_table, triangulate
    >>> recording = read_recording("sample_data/series_tilted/run-01")
    >>> cameras = read_calibration(recording.calibration_file)
    >>> points = triangulate(read_table(recording.folder / "tracks.parquet", "tracks"), cameras, recording)
    >>> from analysis.motion.host_circle import host_circle
    >>> circle = host_circle(points, recording)
    >>> [f"{1e3 * circle[name].median():.2f} mm" for name in ("fit_radius_m", "fit_residual_m")]
    ['50.00 mm', '0.01 mm']
    """
    host = recording.settings.bodies.host
    if host is None or len(host.markers) < 3:
        raise InputError(
            f"{0 if host is None else len(host.markers)} Host markers in recording.toml",
            "three or more",
            "name them in [bodies.host] markers, or leave the Host's circle to inner_radius_m",
        )
    frames, time_s, position_m = marker_positions(points, host.markers)
    columns: dict[str, Array] = {}
    four = list(combinations(range(min(4, position_m.shape[1])), 3))
    circles = []
    for number in range(1, 5):
        if number <= len(four):
            centre, radius = circle_through(*(position_m[:, i] for i in four[number - 1]))
        else:
            centre, radius = np.full((len(frames), 3), np.nan), np.full(len(frames), np.nan)
        circles.append(np.column_stack([centre, radius]))
        columns |= _named(f"circle{number}", centre, radius)
    mean = np.mean(circles, axis=0)  # NaN as soon as one of the four is missing: never a mean of fewer, it would jump
    columns |= _named("mean", mean[:, :3], mean[:, 3])
    centre, radius, residual = fit_circles(position_m)
    columns |= _named("fit", centre, radius)
    if points["z_m"].isna().all():  # one camera measures no height
        columns |= {name: np.full(len(frames), np.nan) for name in columns if name.endswith("_z_m")}
    return pd.DataFrame({"frame": frames, "time_s": time_s, **columns, "fit_residual_m": residual})


def marker_positions(points: pd.DataFrame, markers: tuple[str, ...]) -> tuple[NDArray[np.int64], Array, Array]:
    """Frames (F,), their times (F,) and the positions (F, markers, 3) in metres, NaN where a marker is
    unseen.

    Every frame that stands in ``points`` with any marker has a row.
    """
    clock = points.drop_duplicates("frame").sort_values("frame")
    frames = clock["frame"].to_numpy(np.int64)
    position = np.full((len(frames), len(markers), 3), np.nan)
    marker_of = points["marker"].to_numpy(str)
    for i, marker in enumerate(markers):
        seen = points[marker_of == marker]
        position[np.searchsorted(frames, seen["frame"].to_numpy()), i] = seen[["x_m", "y_m", "z_m"]].to_numpy(float)
    if len(points) and points["z_m"].isna().all():  # of one camera: as seen from above
        position[..., 2] = np.where(np.isfinite(position[..., 0]), 0.0, np.nan)
    return frames, clock["time_s"].to_numpy(float), position


def circle_through(a_m: Array, b_m: Array, c_m: Array) -> tuple[Array, Array]:
    """Centre (..., 3) and radius (...,) of the circle through three points in space, thesis eqs (110)-(113).

    NaN where the three lie on one line (to 1e-9 of their distances squared) or one is missing.
    """
    a, b = a_m - c_m, b_m - c_m
    cross = np.cross(a, b)
    aa, bb, cc = (np.sum(v * v, -1, keepdims=True) for v in (a, b, cross))
    usable = cc > 1e-18 * aa * bb
    with np.errstate(divide="ignore", invalid="ignore"):
        centre = np.cross(aa * b - bb * a, cross) / (2 * cc) + c_m
        radius = np.sqrt(aa * bb * np.sum((a - b) ** 2, -1, keepdims=True) / cc) / 2
    return np.where(usable, centre, np.nan), np.where(usable, radius, np.nan)[..., 0]


def fit_circles(position_m: Array) -> tuple[Array, Array, Array]:
    """Least-squares circle of each row of (F, K, 3), missing markers NaN: centre (F, 3), radius (F,), RMS
    residual (F,).

    The plane is the total-least-squares plane of the markers; in it the geometric distance to the circle is
    minimised by Gauss-Newton from the algebraic circle (Kasa 1976).  With three markers this is the circle
    through them.
    """
    seen: NDArray[np.bool_] = np.all(np.isfinite(position_m), axis=-1)
    count = seen.sum(1)
    enough = count >= 3
    origin = np.where(seen[..., None], position_m, 0.0).sum(1) / np.maximum(count, 1)[:, None]
    offset = np.where(seen[..., None], position_m - origin[:, None], 0.0)
    axes = np.linalg.svd(offset, full_matrices=False)[2]
    u, v = (np.einsum("fkx,fx->fk", offset, axes[:, i]) for i in (0, 1))
    weight = seen.astype(float)
    # Kasa: u^2 + v^2 = 2 a u + 2 b v + c is linear in a, b, c
    design = np.stack([2 * u, 2 * v, np.ones_like(u)], -1) * weight[..., None]
    a, b, c = _least_squares(design, (u**2 + v**2) * weight).T
    radius = np.sqrt(np.maximum(c + a**2 + b**2, 0))
    for _ in range(4):
        distance = np.hypot(u - a[:, None], v - b[:, None])
        distance_safe = np.where(distance > 0, distance, 1.0)
        design = np.stack([(u - a[:, None]) / distance_safe, (v - b[:, None]) / distance_safe, np.ones_like(u)], -1)
        step = _least_squares(design * weight[..., None], (distance - radius[:, None]) * weight)
        a, b, radius = a + step[:, 0], b + step[:, 1], radius + step[:, 2]
    missed = (np.hypot(u - a[:, None], v - b[:, None]) - radius[:, None]) * weight
    residual = np.where(count > 3, np.sqrt(np.sum(missed**2, 1) / np.maximum(count, 1)), np.nan)
    centre = origin + a[:, None] * axes[:, 0] + b[:, None] * axes[:, 1]
    bad = ~enough | ~np.isfinite(radius)
    return (
        np.where(bad[:, None], np.nan, centre),
        np.where(bad, np.nan, radius),
        np.where(bad, np.nan, residual),
    )


def _least_squares(design: Array, right: Array) -> Array:
    """Rows of (F, K, P) x = (F, K); NaN where the normal matrix is singular (markers on one line)."""
    normal = np.swapaxes(design, -1, -2) @ design
    projected = np.einsum("fkp,fk->fp", design, right)
    scale = np.sqrt(np.diagonal(normal, axis1=-2, axis2=-1))
    with np.errstate(divide="ignore", invalid="ignore"):
        scaled = normal / (scale[..., :, None] * scale[..., None, :])
    good = np.isfinite(scaled).reshape(len(scaled), -1).all(1)
    good[good] = np.abs(np.linalg.det(scaled[good])) > 1e-12
    solution = np.full_like(projected, np.nan)
    solution[good] = np.linalg.solve(scaled[good], (projected[good] / scale[good])[..., None])[..., 0] / scale[good]
    return solution


def _named(circle: str, centre: Array, radius: Array) -> dict[str, Array]:
    return {
        **{f"{circle}_{axis}_m": centre[:, i] for i, axis in enumerate("xyz")},
        f"{circle}_radius_m": radius,
    }
