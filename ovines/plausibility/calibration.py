"""A recording's cameras as calibrated, or why that calibration is not this recording's."""

from __future__ import annotations

from pathlib import Path

from ovines.camera import Camera, read_calibration
from ovines.errors import InputError
from ovines.recording import Recording


def calibrated(path: Path, recording: Recording) -> list[Camera]:
    """The cameras of ``path``; `InputError` where the recording has another camera, or one with another sensor."""
    cameras = read_calibration(path)
    by_name = {camera.name: camera for camera in cameras}
    for camera in recording.cameras:
        if camera.name not in by_name:
            raise InputError(
                f"no camera {camera.name} in {path}",
                "every camera of the recording",
                "give both files the same camera names",
            )
        size = tuple(by_name[camera.name].sensor_size_px)
        if size != camera.sensor_size_px:
            raise InputError(
                f"sensor of {camera.name}: {size} px in the calibration, {camera.sensor_size_px} px in recording.toml",
                "the same sensor",
                "correct sensor_size_px, or calibrate with full-sensor images",
            )
    used = [by_name[camera.name] for camera in recording.cameras]
    _refuse_one_place(used, path)
    _refuse_edge_on(used, path)
    return cameras


def refuse_camera_count(recording: Recording) -> None:
    """`InputError` where one camera is to place markers whose heights nobody gave."""
    if recording.entry() not in ("frames", "tracks") or len(recording.cameras) != 1:
        return
    without = [
        name for name, body in recording.bodies.items() if name != "ground" and body.markers and body.layout_m is None
    ]
    if without:
        raise InputError(
            f"one camera in {recording.folder} ({recording.cameras[0].name}), and no layout_m of {', '.join(without)}",
            "two cameras, or the markers' heights: the third number of each place in layout_m",
            "add layout_m, or a second [[cameras]]",
        )


def _refuse_one_place(cameras: list[Camera], path: Path) -> None:
    """Two cameras at one place see no depth."""
    for i, first in enumerate(cameras):
        for second in cameras[i + 1 :]:
            apart_m = float(((first.centre_m - second.centre_m) ** 2).sum() ** 0.5)
            far_m = max(float((first.centre_m**2).sum() ** 0.5), float((second.centre_m**2).sum() ** 0.5))
            if apart_m <= CLOSEST * far_m:
                raise InputError(
                    f"{path}: cameras {first.name} and {second.name} stand {apart_m:.3g} m apart, {far_m:.3g} m from "
                    f"the world's origin",
                    "two places, from which the same point is seen in two directions",
                    "calibrate both cameras in one world",
                )


def _refuse_edge_on(cameras: list[Camera], path: Path) -> None:
    """A camera in the plane that the bodies slide in sees it as a line, and at the world's origin nothing at all."""
    for camera in cameras:
        x, y, z = (float(one) for one in camera.centre_m)
        if abs(z) <= CLOSEST * (x * x + y * y + z * z) ** 0.5:
            raise InputError(
                f"{path}: camera {camera.name} stands at ({x:.3g}, {y:.3g}, {z:.3g}) m, in the sliding plane z = 0",
                "a camera above the plane that it looks at",
                "correct its rotation and translation_m, or calibrate with the board lying on the plane",
            )


CLOSEST = 1e-3  # of their distance: nearer ones, or lower, see depth a thousand times worse than directions
