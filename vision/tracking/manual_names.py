"""Markers named by hand in the first frame: a table camera, marker, u_px, v_px, as `names.csv` holds it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from ovines.camera import triangulate_points
from ovines.errors import InputError
from vision.identity.layouts import layout_tolerance
from vision.identity.matching import rigid_pose
from vision.markers.perspective import on_plane
from vision.markers.row import U, V, radius_px
from vision.tracking.camera_tracker import CameraTracker

COLUMNS = ("camera", "marker", "u_px", "v_px")
_REACH = 3.0  # radii of a disc within which a click means it
_TRIANGULATED = 0.0002  # radii of the rig: sd of a layout that two cameras measured


def check_names(names: pd.DataFrame) -> pd.DataFrame:
    """`names` (window pixels) with pixels as numbers; `InputError` where a column or a cell is missing, or a
    marker named twice.
    """
    missing = [column for column in COLUMNS if column not in names]
    if missing:
        raise InputError(f"names: no column {', '.join(missing)}", f"columns {','.join(COLUMNS)}", "add it")
    places = names[["u_px", "v_px"]].apply(pd.to_numeric, errors="coerce")
    if not np.isfinite(places.to_numpy(float)).all() or names[["camera", "marker"]].isna().any().any():
        raise InputError(
            "names: an empty or non-numeric cell", "a camera, a marker and two pixels in each row", "fill it in"
        )
    if names.duplicated(["camera", "marker"]).any():
        twice = names[names.duplicated(["camera", "marker"])].iloc[0]
        raise InputError(
            f"names: marker {twice.marker} of {twice.camera} twice", "each marker once per camera", "remove one"
        )
    return names.assign(u_px=places["u_px"], v_px=places["v_px"])


def adopt_names(
    names: pd.DataFrame, cameras: Sequence[CameraTracker], discs: Sequence[np.ndarray], images: Sequence[np.ndarray]
) -> list[str]:
    """Give each camera's tracker the named discs as its markers; a body without layout takes theirs.  Returns notes."""
    layout = cameras[0].layout
    strangers = sorted(set(names["marker"]) - set(layout.markers)) + sorted(
        set(names["camera"]) - {one.camera.name for one in cameras}
    )
    if strangers:
        raise InputError(
            f"names speak of {strangers[0]!r}",
            "markers and cameras of recording.toml",
            "correct names.csv or recording.toml",
        )
    notes: list[str] = []
    picked = [_pick(names, one, own, notes) for one, own in zip(cameras, discs, strict=True)]
    for body, name in enumerate(layout.bodies):
        part = layout.of(body)
        markers = range(part.start, part.stop)
        if not layout.known[body]:
            absent = [layout.markers[m] for m in markers if not any(m in own for own in picked)]
            if len(absent) == len(markers):
                continue
            if absent:
                raise InputError(
                    f"names of body {name} without {absent[0]}",
                    f"all markers of {name}, which has no layout_m",
                    "add the missing rows, or layout_m to recording.toml",
                )
            _build(body, cameras, picked)
        for one, own, image in zip(cameras, picked, images, strict=True):
            mine = [m for m in markers if m in own]
            for m in mine:
                one.markers.disc[m] = own[m]
            if len(mine) < min(2, len(markers)):
                continue
            seen = np.array(
                [
                    on_plane(one.camera, own[m][None, [U, V]] + one.offset, one.markers.place_m[m, 2])[0, :2]
                    for m in mine
                ]
            )
            pose = (
                rigid_pose(one.markers.place_m[mine, :2], seen)
                if len(mine) > 1
                else np.array([*seen[0] - one.markers.place_m[mine[0], :2], 0])
            )
            if one.measure_at(image, body, pose, 1):
                one.accept(body)
            else:
                notes.append(
                    f"{one.camera.name}: the named {name} markers do not lie as the layout says; left to the search"
                )
    return notes


def _pick(names: pd.DataFrame, one: CameraTracker, discs: np.ndarray, notes: list[str]) -> dict[int, np.ndarray]:
    own: dict[int, np.ndarray] = {}
    for row in names[names["camera"] == one.camera.name].itertuples():
        away = np.hypot(discs[:, U] - row.u_px, discs[:, V] - row.v_px) if len(discs) else np.zeros(0)
        nearest = int(np.argmin(away)) if len(away) else -1
        if nearest < 0 or not away[nearest] < _REACH * radius_px(discs[nearest]):
            notes.append(f"{one.camera.name}: no disc within {_REACH:.0f} of its radii of the place named {row.marker}")
            continue
        own[one.layout.markers.index(row.marker)] = discs[nearest]
    return own


def _build(body: int, cameras: Sequence[CameraTracker], picked: Sequence[dict[int, np.ndarray]]) -> None:
    """A body's layout from where its named markers are in space; its origin is below their middle."""
    layout = cameras[0].layout
    part = layout.of(body)
    named = range(part.start, part.stop)
    both = [m for m in named if sum(m in own for own in picked) > 1]
    if not both:
        raise InputError(
            f"no marker of {layout.bodies[body]} named in two cameras and found there",
            "layout_m" if len(cameras) < 2 else "the body's markers named in two cameras",
            "add layout_m: one camera does not tell heights" if len(cameras) < 2 else "add rows for the other camera",
        )
    nowhere = np.full(2, np.nan)
    uv = [
        np.array([own[m][[U, V]] + one.offset if m in own else nowhere for m in both])
        for one, own in zip(cameras, picked, strict=True)
    ]
    found = triangulate_points([one.camera for one in cameras], uv, [np.ones(len(both))] * len(cameras))
    points = dict(zip(both, found.points_m, strict=True))
    height = float(np.mean([point[2] for point in points.values()]))
    for m in named:
        if m not in points:
            one, own = next((one, own) for one, own in zip(cameras, picked, strict=True) if m in own)
            points[m] = on_plane(one.camera, own[m][None, [U, V]] + one.offset, height)[0]
    middle = np.mean([points[m][:2] for m in points], axis=0)
    for m, point in points.items():
        layout.position_m[m] = [*point[:2] - middle, point[2]]
        for one in cameras:
            one.markers.place_m[m] = layout.position_m[m]
    layout.tolerance_m[body] = layout_tolerance(layout.position_m[part, :2], layout.rig_m, _TRIANGULATED * layout.rig_m)
    layout.known[body] = True
