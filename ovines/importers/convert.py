"""Foreign tracks, points and cameras as the chain has them: named, timed, in SI and in the world's frame."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ovines.camera import Camera
from ovines.errors import InputError
from ovines.importers.formats import marker_csv, trc, vibration_tracker
from ovines.importers.formats.opencv_cameras import Found
from ovines.importers.named_markers import numbered, of_known_markers, renamed
from ovines.importers.reading.declared import AS_THEY_ARE, BOARD_AXES, metres, times_on_grid, turn, without_zeros
from ovines.recording import Recording
from ovines.recording_schema import CameraSettings

Array = NDArray[np.float64]


def tracks_table(
    files: Mapping[str, Path],
    recording: Recording,
    markers: Sequence[str] | None = None,
    zeros: str | None = None,
    lenses: Mapping[str, Found] | None = None,
) -> tuple[pd.DataFrame, list[str]]:
    """Table ``tracks`` from one file per camera (VibrationTracker's JSON or a CSV), and notes.

    ``markers``: names of the points in the file's order, ``-`` for one that is left out.  ``lenses``: per camera, the
    lens by which its images were undistorted before they were tracked; the pixels are bent back to those of the
    camera's own images.
    """
    parts, notes = [], []
    for camera, path in files.items():
        if _is_json(path):
            rows = numbered(vibration_tracker.read_tracks(path), ("u", "v"), markers, recording, path)
            decimals = 0
        else:
            rows, unit, decimals, unused = marker_csv.read_csv(path)
            if unit not in (None, "px"):
                raise InputError(
                    f"{path}: coordinates in {unit}", "pixels of the camera's images", "import positions with --points"
                )
            rows = rows.rename(columns={"x": "u", "y": "v"} if not {"u", "v"} <= set(rows.columns) else {})
            if "camera" in rows.columns:
                rows = rows[rows["camera"] == camera]
            if not {"u", "v"} <= set(rows.columns):
                raise InputError(
                    f"{path}: columns {', '.join(map(str, rows.columns))}",
                    "two coordinates in pixels, u and v",
                    "correct the header",
                )
            notes += _unused(path, unused)
            rows = without_zeros(renamed(rows, markers, path), ["u", "v"], zeros, str(path))
        if lenses is not None:
            rows[["u", "v"]] = bent_back(rows[["u", "v"]].to_numpy(float), lenses[camera], camera)
        rows["camera"] = camera
        rows["time_s"] = _times(rows, recording, decimals, notes, path)
        parts.append(rows)
    table = of_known_markers(pd.concat(parts, ignore_index=True), recording, notes)
    sd = table["sd"] if "sd" in table.columns else np.nan
    return pd.DataFrame(
        {
            "camera": table["camera"],
            "frame": table["frame"],
            "time_s": table["time_s"],
            "marker": table["marker"],
            "u_px": table["u"],
            "v_px": table["v"],
            "sd_px": sd,
        }
    ), notes


def points_table(
    path: Path,
    recording: Recording,
    markers: Sequence[str] | None = None,
    unit: str | None = None,
    axes: str | None = None,
    zeros: str | None = None,
) -> tuple[pd.DataFrame, list[str]]:
    """Table ``points`` from VibrationTracker's displacementResults.json, a TRC or a CSV, and notes.

    Positions are turned by ``axes`` and scaled to metres; what the file gives no sd for has a null one.
    """
    notes: list[str] = []
    decimals, file_unit = 0, None
    if _is_json(path):
        rows = numbered(vibration_tracker.read_points(path), ("x", "y", "z"), markers, recording, path)
        axes = axes or BOARD_AXES
    else:
        if path.suffix.lower() == ".trc":
            rows, file_unit = trc.read_trc(path)
        else:
            rows, file_unit, decimals, unused = marker_csv.read_csv(path)
            notes += _unused(path, unused)
            if file_unit == "px" or not {"x", "y", "z"} <= set(rows.columns):
                raise InputError(
                    f"{path}: columns {', '.join(map(str, rows.columns))}",
                    "three coordinates x, y, z in a unit of length",
                    "import pixels with --tracks",
                )
        rows = without_zeros(renamed(rows, markers, path), ["x", "y", "z"], zeros, str(path))
        axes = axes or AS_THEY_ARE
    scale, world = metres(unit, file_unit, str(path)), turn(axes)
    rows = of_known_markers(rows, recording, notes)
    place = scale * rows[["x", "y", "z"]].to_numpy(float) @ world.T
    table = pd.DataFrame(
        {"frame": rows["frame"], "time_s": _times(rows, recording, decimals, notes, path), "marker": rows["marker"]}
    )
    given = (
        scale
        * np.stack([rows.get(f"{axis}_sd", pd.Series(np.nan, rows.index)).to_numpy(float) for axis in "xyz"], -1)
        @ np.abs(world).T
    )
    for i, axis in enumerate("xyz"):
        table[f"{axis}_m"], table[f"{axis}_sd_m"] = place[:, i], given[:, i]
    table["reprojection_px"] = np.nan
    notes.append(f"axes taken as {axes}: the world's z has to point up from the sliding plane, towards the cameras")
    return table, notes + _doubtful_axes(table, recording)


def cameras_in_world(
    found: Mapping[str, Found],
    recording: Recording,
    unit: str | None = None,
    axes: str | None = None,
    calibrated_on: str | None = None,
) -> tuple[list[Camera], list[str]]:
    """The recording's cameras in metres, full-sensor pixels and the world's frame, and notes.

    Without ``axes`` a world that looks away from the cameras (OpenCV's board frame) is turned to look at them.
    """
    scale = metres(unit, None, "the calibration")
    heights = np.array([float(-(camera.rotation.T @ camera.translation)[2]) for camera in found.values()])
    if axes is None:
        if (heights > 0).any() and (heights < 0).any():
            raise InputError(
                "cameras on both sides of the calibration's plane z = 0",
                "all cameras above the sliding plane",
                "say by --axes how the world lies, e.g. x,-z,y where the file's -z and y are the world's y and z",
            )
        axes = BOARD_AXES if (heights < 0).all() else AS_THEY_ARE
    world, cameras = turn(axes), []
    for name, one in found.items():
        settings = recording.camera(name)
        matrix = one.matrix.copy()
        matrix[:2, 2] += _shift_px(one, settings, calibrated_on)
        cameras.append(
            Camera(
                name,
                (settings.sensor_size_px[0], settings.sensor_size_px[1]),
                matrix,
                one.distortion,
                one.rotation @ world.T,
                scale * one.translation,
                one.rms_px,
            )
        )
    notes = [
        f"{camera.name}: {camera.centre_m[2]:.3g} m above the plane z = 0, axes taken as {axes}" for camera in cameras
    ]
    if any(camera.centre_m[2] <= 0 for camera in cameras):
        raise InputError(f"--axes {axes} puts cameras below the plane", "z up, towards the cameras", "correct --axes")
    return sorted(cameras, key=lambda camera: [c.name for c in recording.cameras].index(camera.name)), notes


def bent_back(uv_px: Array, lens: Found, camera: str) -> Array:
    """Pixels (N, 2) of the undistorted image to those of the image as the camera took it."""
    if lens.undistorted_matrix is None:
        raise InputError(
            f"{camera}: no newCameraMatrix, by which its images were undistorted",
            "VibrationTracker's poseEstimationResults.json",
            "name it after the lens: --calibration CAMERA=calibrationResults.json,poseEstimationResults.json",
        )
    ahead = np.concatenate([uv_px, np.ones((len(uv_px), 1))], 1) @ np.linalg.inv(lens.undistorted_matrix).T
    return Camera(camera, (1, 1), lens.matrix, lens.distortion, np.eye(3), np.zeros(3)).project(ahead)


def _shift_px(one: Found, settings: CameraSettings, calibrated_on: str | None) -> Array:
    """Full-sensor pixels minus those of the images the camera was calibrated on."""
    sensor, window = tuple(settings.sensor_size_px), tuple(settings.window_px)
    if one.size_px is not None and one.size_px not in (sensor, window):
        raise InputError(
            f"{settings.name} was calibrated on {one.size_px[0]} x {one.size_px[1]} px",
            f"the sensor's {sensor[0]} x {sensor[1]} or the window's {window[0]} x {window[1]}",
            "correct sensor_size_px in recording.toml, or name the right file",
        )
    if sensor == window:
        return np.zeros(2)
    if one.size_px is not None:
        calibrated_on = "sensor" if one.size_px == sensor else "window"
    if calibrated_on is None:
        raise InputError(
            f"{settings.name}: its file does not say whether the whole sensor or the window was calibrated",
            "--calibrated-on sensor or --calibrated-on window",
            "add it: the principal point moves by the window's offset",
        )
    return np.array(settings.window_offset_px, float) if calibrated_on == "window" else np.zeros(2)


def _unused(path: Path, columns: Sequence[str]) -> list[str]:
    return [f"{path.name}: not used: {', '.join(columns)}"] if columns else []


def _is_json(path: Path) -> bool:
    return path.suffix.lower() == ".json"


def _times(rows: pd.DataFrame, recording: Recording, decimals: int, notes: list[str], path: Path) -> Array:
    """The measured trigger's times, else the file's, else frame / frame_rate_hz."""
    frames = rows["frame"].to_numpy(np.int64)
    if "time_s" not in rows.columns or recording.settings.time.trigger is not None:
        return np.asarray(recording.times_s(frames), float)
    times_s = times_on_grid(rows["time_s"].to_numpy(float), frames, decimals, recording.frame_rate_hz)
    if not np.isfinite(times_s).all():
        raise InputError(
            f"{path}: a row without its time", "a time in every row, or no times at all", "complete the column"
        )
    span = np.ptp(frames)
    if recording.frame_rate_hz is not None and span > 0:
        rate_hz = span / np.ptp(times_s) if np.ptp(times_s) > 0 else np.inf
        if abs(rate_hz / recording.frame_rate_hz - 1) > 1e-3:
            notes.append(
                f"{path.name} runs at {rate_hz:.6g} frames per second, recording.toml says "
                f"{recording.frame_rate_hz:.6g}: the file's times are kept"
            )
    return times_s


def _doubtful_axes(table: pd.DataFrame, recording: Recording) -> list[str]:
    """A note where the NES moves more along z than along x or y: most motion-capture programs have y up."""
    nes = recording.bodies.get("nes")
    own = table[table["marker"].isin(nes.markers)] if nes is not None else table.iloc[:0]
    if len(own) < 10:
        return []
    spread = own.groupby("marker")[["x_m", "y_m", "z_m"]].std().mean().to_numpy(float)
    if not np.isfinite(spread).all() or spread[2] <= min(spread[:2]):
        return []
    least = "xy"[int(np.argmin(spread[:2]))]
    return [
        (
            f"the NES moves by {1e3 * spread[2]:.3g} mm (sd) along z and {1e3 * min(spread[:2]):.3g} mm along {least}: "
            "are the axes right? Where the file's y points up, it is --axes x,-z,y"
        )
    ]
