"""``calibration.json`` <-> cameras, so that every part of the application speaks of the same ones."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ovines.camera.model import LENS_TERMS, Camera
from ovines.errors import InputError
from ovines.io.atomic_write import write_text_whole
from ovines.lens_field import field_from_json, field_json

Array = NDArray[np.float64]
MOST_SIDE_PX = 1_000_000  # as recording.toml allows
MOST_NUMBER = 1e9  # of a matrix, a lens or a place (m): what no camera has, by far


def read_calibration(path: Path) -> list[Camera]:
    """The cameras of a ``calibration.json`` (format 1); `InputError` with reasons when it is not one.

    Examples
    --------
    >>> from ovines.notebook import read_calibration
    >>> left, right = read_calibration("sample_data/series_tilted/calibration.json")
    >>> left.project([0.0, 0.0, 0.0]).round(1).tolist()  # the world's origin, pixels of the whole sensor
    [2031.3, 1539.7]
    """
    try:
        content = json.loads(Path(path).read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(
            f"no file {path}",
            "a calibration.json",
            "check [calibration] file in recording.toml, or run `ovines calibrate`",
        ) from None
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(f"{path}: {error}", "a JSON file with format = 1", "write the calibration again") from None
    if not isinstance(content, dict) or content.get("format") != 1 or not isinstance(content.get("cameras"), list):
        raise InputError(
            f"{path}: no `format: 1` with a list of cameras",
            '{"format": 1, "world": "board", "cameras": [...]}',
            "see calibration.json in docs/reference/files.md",
        )
    cameras = [_camera_from_json(entry, f"{path}: cameras[{i}]") for i, entry in enumerate(content["cameras"])]
    names = [camera.name for camera in cameras]
    if len(set(names)) != len(names):
        raise InputError(f"{path}: camera names {names}", "each name once", "rename one of them")
    return cameras


def _camera_from_json(entry: Any, where: str) -> Camera:
    if not isinstance(entry, dict) or not isinstance(entry.get("name"), str):
        raise InputError(f"{where} has no name", "an object with a name", "name the camera as recording.toml does")

    def numbers(key: str, *shapes: tuple[int, ...]) -> Array:
        try:
            value = np.asarray(entry.get(key), float)
        except (TypeError, ValueError, OverflowError):
            value = np.empty(0)
        if value.shape not in shapes or not (np.abs(value) <= MOST_NUMBER).all():
            raise InputError(
                f"{where} ({entry['name']}): {key} = {str(entry.get(key))[:120]}",
                f"finite numbers up to {MOST_NUMBER:g}, of shape {' or '.join(map(str, shapes))}",
                f"write {key} again, e.g. with `ovines calibrate`",
            )
        return value

    rotation = numbers("rotation", (3, 3))
    if not np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-4) or np.linalg.det(rotation) < 0:
        raise InputError(
            f"{where} ({entry['name']}): rotation is not one (R R^T differs from 1, or det R < 0)",
            "a proper rotation matrix",
            "check rows and columns, and that no axis is mirrored",
        )
    matrix = numbers("matrix", (3, 3))
    if matrix[0, 0] <= 0 or matrix[1, 1] <= 0:
        raise InputError(
            f"{where} ({entry['name']}): focal lengths {matrix[0, 0]}, {matrix[1, 1]}",
            "positive numbers of pixels",
            "check the intrinsic matrix",
        )
    rms_px = float("nan") if entry.get("rms_px") is None else float(numbers("rms_px", ()))
    width, height = numbers("sensor_size_px", (2,))
    if not all(0 < side <= MOST_SIDE_PX and side == int(side) for side in (width, height)):
        raise InputError(
            f"{where} ({entry['name']}): sensor_size_px = [{width:g}, {height:g}]",
            f"whole numbers from 1 to {MOST_SIDE_PX}",
            "write the sensor's size as recording.toml has it",
        )
    return Camera(
        entry["name"],
        (int(width), int(height)),
        matrix,
        numbers("distortion", *((terms,) for terms in LENS_TERMS)),
        rotation,
        numbers("translation_m", (3,)),
        rms_px,
        spline=field_from_json(entry.get("spline"), f"{where} ({entry['name']})"),
    )


def write_calibration(cameras: Sequence[Camera], path: Path, world: str = "board", **extra: Any) -> None:
    """Write ``calibration.json``; ``extra`` keys (provenance, standard deviations) go beside the cameras.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from ovines.camera import read_calibration, write_calibration
    >>> cameras = read_calibration("sample_data/series_tilted/calibration.json")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_calibration(cameras, Path(folder) / "calibration.json")
    ...     [camera.name for camera in read_calibration(Path(folder) / "calibration.json")]
    ['VW1', 'VW2']
    """
    write_text_whole(json.dumps({**calibration_json(cameras, world), **extra}, indent=1), path)


def calibration_json(cameras: Sequence[Camera], world: str = "board") -> dict[str, Any]:
    """The cameras as ``calibration.json`` has them, in JSON's own values."""
    entries = [
        {
            "name": c.name,
            "sensor_size_px": list(c.sensor_size_px),
            "matrix": c.matrix.tolist(),
            "distortion": c.distortion.tolist(),
            "rotation": c.rotation.tolist(),
            "translation_m": c.translation_m.tolist(),
            "rms_px": c.rms_px if np.isfinite(c.rms_px) else None,
            **({} if c.spline is None else {"spline": field_json(c.spline)}),
        }
        for c in cameras
    ]
    return {"format": 1, "world": world, "cameras": entries}
