"""What is known of a calibration's worth, as tables: lenses tried, points and boards, maps of image and plane."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ovines.camera import Camera
from vision.calibration.bundle.unknowns import N_CAMERA, lens_places, spline_places
from vision.calibration.single_camera import Single
from vision.calibration.targets.boards import Board
from vision.calibration.uncertainty import shifts
from vision.pinhole import N_INTRINSICS
from vision.validation.halves import Field, Halves, compare_halves, flagged, residual_field
from vision.validation.image_map import ImageMap, image_map
from vision.validation.lens_choice import Tried
from vision.validation.next_view import next_views

Array = NDArray[np.float64]
ACROSS = 21  # places of the plane's map along its longer side


def validation_tables(
    cameras: Sequence[Camera],
    singles: Mapping[str, Single],
    tried: Mapping[str, Sequence[Tried]],
    covariance: Array,
    board: Board,
) -> tuple[dict[str, pd.DataFrame], pd.DataFrame, list[str]]:
    """Tables by name, more rows for ``calibration_parameters``, and sentences for what the calibration contradicts.

    ``covariance``: of all cameras' parameters (N_CAMERA each, then the splines), NaN for what was held.
    """
    covariance = np.nan_to_num(covariance)
    image, following, found, said = [], [], [], []
    for c, camera in enumerate(cameras):
        name, single = camera.name, singles[camera.name]
        solved = single.adjusted.state
        at = image_map(solved.intrinsics[0], camera.sensor_size_px, single.views, solved.splines[0])
        lens = lens_places([one.spline for one in cameras], c)
        halves, field = compare_halves(single, board, at), residual_field(single, board)
        image.append(_image_rows(name, at, at.sd_px(covariance[np.ix_(lens, lens)]), halves))
        following += [
            (name, order, one.pose, one.now_px, one.then_px)
            for order, one in enumerate(next_views(single, board, camera.sensor_size_px, at), 1)
        ]
        found += [(name, "field_p", field.p), (name, "field_px", field.rms_px)]
        found += [] if halves is None else [(name, "halves_p", halves.p)]
        said += _said(name, at, halves, field)
        if camera.spline is not None:
            spline_px = float(np.sqrt(np.mean(np.sum(camera.spline.at(at.uv_px[at.visited]) ** 2, -1))))
            found.append((name, "spline_px", spline_px))
            said.append(
                f"{name}: residuals hang together over the image, and a spline of {spline_px:.2g} px RMS beside the "
                "distortion terms takes them up: it is a part of this camera now. Programs that know OpenCV's lenses "
                "only cannot be given it."
            )
    tables = {
        "calibration_lens": _lens_table(tried),
        "calibration_spline": _spline_table(cameras, covariance),
        "calibration_corners": _corner_table(singles),
        "calibration_boards": _board_table(cameras, singles, board),
        "calibration_image": pd.concat(image, ignore_index=True),
        "calibration_plane": _plane_table(cameras, covariance),
        "calibration_world": pd.concat(
            [_world_table(cameras, covariance), _distance_table(cameras, covariance)], ignore_index=True
        ),
        "calibration_next": pd.DataFrame(following, columns=["camera", "order", "pose", "now_px", "then_px"]),
    }
    rows = pd.DataFrame(found, columns=["camera", "parameter", "value"]).assign(sd=np.nan)
    return tables, rows, said


def _said(name: str, at: ImageMap, halves: Halves | None, field: Field) -> list[str]:
    said = []
    halves_speak, field_speaks = flagged(halves, field)
    if field_speaks:
        said.append(
            f"{name}: residuals hang together over the image ({field.rms_px:.2g} px RMS, chance {field.p:.1g}): "
            "no lens that was tried describes this one to the points' noise; points err by as much at least."
        )
    if halves is not None and halves_speak:
        apart = np.sqrt(np.mean(halves.apart_px[at.visited] ** 2))
        allowed = np.sqrt(np.mean(halves.sd_px[at.visited] ** 2))
        said.append(
            f"{name}: two halves of the views give lenses {apart:.2g} px apart where the covariance allows "
            f"{allowed:.2g} px (chance {halves.p:.1g}): the standard deviations are too small."
        )
    return said


def _lens_table(tried: Mapping[str, Sequence[Tried]]) -> pd.DataFrame:
    rows = [
        (name, one.lens, one.terms, one.fitted_px, one.held_out_px, one.p, one.chosen, one.reason)
        for name, lenses in tried.items()
        for one in lenses
    ]
    columns = ["camera", "lens", "terms", "fitted_px", "held_out_px", "p", "chosen", "reason"]
    return pd.DataFrame(rows, columns=columns)


def _spline_table(cameras: Sequence[Camera], covariance: Array) -> pd.DataFrame:
    """The nodes of the splines with their sd; empty where no camera has one."""
    columns = ["camera", "u_px", "v_px", "du_px", "dv_px", "du_sd_px", "dv_sd_px"]
    splines, tables = [camera.spline for camera in cameras], []
    for c, (camera, spline) in enumerate(zip(cameras, splines, strict=True)):
        if spline is not None:
            sd = np.sqrt(np.maximum(np.diag(covariance)[spline_places(splines, c)], 0)).reshape(2, -1).T
            numbers = np.column_stack([spline.nodes_px, spline.shift_px.reshape(-1, 2), sd])
            tables.append(pd.DataFrame(numbers, columns=columns[1:]).assign(camera=camera.name)[columns])
    if not tables:
        return pd.DataFrame(columns=columns).astype({name: float for name in columns[1:]} | {"camera": str})
    return pd.concat(tables, ignore_index=True)


def _corner_table(singles: Mapping[str, Single]) -> pd.DataFrame:
    return pd.concat(
        [
            pd.DataFrame(
                {
                    "camera": name,
                    "view": view.name,
                    "point": view.points,
                    "u_px": view.uv_px[:, 0],
                    "v_px": view.uv_px[:, 1],
                    "residual_u_px": residual[:, 0],
                    "residual_v_px": residual[:, 1],
                }
            )
            for name, single in singles.items()
            for view, residual in zip(single.views, single.adjusted.residuals_px, strict=True)
        ],
        ignore_index=True,
    )


def _board_table(cameras: Sequence[Camera], singles: Mapping[str, Single], board: Board) -> pd.DataFrame:
    """The board's four corners in the world, in order, for each view."""
    width, height = board.size_m
    outline = np.array([[0, 0, 0], [width, 0, 0], [width, height, 0], [0, height, 0]], float)
    rows = []
    for camera in cameras:
        single = singles[camera.name]
        for k, view in enumerate(single.views):
            seen = outline @ single.adjusted.state.rotation[k].T + single.adjusted.state.translation[k]
            world = (seen - camera.translation_m) @ camera.rotation
            rows += [(camera.name, view.name, corner, *place) for corner, place in enumerate(world)]
    return pd.DataFrame(rows, columns=["camera", "view", "corner", "x_m", "y_m", "z_m"])


def _image_rows(name: str, at: ImageMap, sd_px: Array, halves: Halves | None) -> pd.DataFrame:
    nothing = np.full((len(sd_px), 2), np.nan)
    apart = nothing if halves is None else halves.apart_px
    return pd.DataFrame(
        {
            "camera": name,
            "u_px": at.uv_px[:, 0],
            "v_px": at.uv_px[:, 1],
            "visited": at.visited,
            "lens_sd_px": sd_px,
            "apart_u_px": apart[:, 0],
            "apart_v_px": apart[:, 1],
            "apart_sd_px": nothing[:, 0] if halves is None else halves.sd_px,
        }
    )


def _plane_table(cameras: Sequence[Camera], covariance: Array) -> pd.DataFrame:
    """Sd of points of the plane z = 0 that all cameras see, by the calibration alone; empty for one camera."""
    columns = ["x_m", "y_m", "x_sd_m", "y_sd_m", "z_sd_m"]
    corners = [_on_plane(camera) for camera in cameras]
    if len(cameras) < 2 or not all(len(one) for one in corners):
        return pd.DataFrame(columns=columns, dtype=float)
    low = np.max([one.min(0) for one in corners], 0)
    high = np.min([one.max(0) for one in corners], 0)
    if (high <= low).any():
        return pd.DataFrame(columns=columns, dtype=float)
    step = (high - low).max() / ACROSS
    x, y = (np.arange(a + step / 2, b, step) for a, b in zip(low, high, strict=True))
    places = np.stack([*np.meshgrid(x, y), np.zeros((len(y), len(x)))], -1).reshape(-1, 3)
    seen = np.all([_inside(camera, places) for camera in cameras], 0)
    places = places[seen]
    moved = shifts(places, cameras)
    sd = np.sqrt(np.maximum(np.sum((moved @ covariance) * moved, axis=-1), 0))
    return pd.DataFrame(np.column_stack([places[:, :2], sd]), columns=columns)


def _world_table(cameras: Sequence[Camera], covariance: Array) -> pd.DataFrame:
    """Sd of the plane z = 0 as the calibration has it: its height at the origin, its slopes along x and y."""
    plane = _plane_table(cameras, covariance)
    columns = ["quantity", "sd"]
    if len(plane) < 3:
        return pd.DataFrame(columns=columns).astype({"quantity": str, "sd": float})
    places = np.column_stack([plane[["x_m", "y_m"]], np.zeros(len(plane))])
    fit = np.linalg.pinv(np.column_stack([np.ones(len(places)), places[:, :2]]))
    moved = fit @ shifts(places, cameras)[:, 2]
    sd = np.sqrt(np.maximum(np.einsum("ip,pq,iq->i", moved, covariance, moved), 0))
    return pd.DataFrame({"quantity": ["height_m", "slope_x", "slope_y"], "sd": sd})


def _distance_table(cameras: Sequence[Camera], covariance: Array) -> pd.DataFrame:
    """Sd [m] of the distance between the centres of each two cameras."""
    rows = []
    for a, b in combinations(range(len(cameras)), 2):
        apart = cameras[a].centre_m - cameras[b].centre_m
        slope = np.zeros(len(covariance))
        for c, along in ((a, apart), (b, -apart)):
            rotation, (x, y, z) = cameras[c].rotation, cameras[c].translation_m
            turned = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])  # centre = - rotation' translation
            by_pose = -rotation.T @ np.concatenate([turned, np.eye(3)], 1)
            slope[N_CAMERA * c + N_INTRINSICS : N_CAMERA * (c + 1)] = along @ by_pose / np.linalg.norm(apart)
        sd = float(np.sqrt(max(float(slope @ covariance @ slope), 0.0)))
        rows.append((distance_name(cameras[a].name, cameras[b].name), sd))
    return pd.DataFrame(rows, columns=["quantity", "sd"]).astype({"quantity": str, "sd": float})


def distance_name(camera: str, other: str) -> str:
    """What ``calibration_world`` calls the distance of two cameras' centres."""
    return f"distance_m of {camera} and {other}"


def _on_plane(camera: Camera) -> Array:
    """Where rays through the sensor's edge meet the plane z = 0 (n, 2)."""
    width, height = camera.sensor_size_px
    edge = np.linspace(0, 1, 9)
    u, v = edge * (width - 1), edge * (height - 1)
    border = np.concatenate(
        [np.column_stack([u, 0 * u]), np.column_stack([u, 0 * u + height - 1]), np.column_stack([0 * v, v]),
         np.column_stack([0 * v + width - 1, v])]
    )  # fmt: skip
    rays = camera.rays(border)
    down = rays[:, 2] < 0
    return np.asarray((camera.centre_m - (camera.centre_m[2] / rays[down, 2:]) * rays[down])[:, :2])


def _inside(camera: Camera, places_m: Array) -> NDArray[np.bool_]:
    uv = camera.project(places_m)
    return np.asarray(((uv >= 0) & (uv <= np.array(camera.sensor_size_px) - 1)).all(1))
