"""Cameras from other programs' parameters: OpenCV's YAML and XML, VibrationTracker's JSON, caliscope's and Anipose's
TOML, Kalibr's chain, mrcal's camera model.

All of them are OpenCV's camera: a matrix, up to twelve distortion terms, and a pose ``X_camera = R X_file + t``.  They
differ in what they call it, in the unit of t, and in which way the world's z points.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ovines.camera import LENS_TERMS, MOST_SIDE_PX
from ovines.errors import InputError
from ovines.importers.formats import kalibr_mrcal
from ovines.importers.reading.files import read_values

Array = NDArray[np.float64]
MATRIX = ("cameramatrix", "k", "matrix", "mtx", "intrinsicmatrix")
DISTORTION = ("distortioncoefficients", "distcoeffs", "dist", "d", "distortions", "distortion")
ROTATION, TRANSLATION = ("rvec", "rotation", "r"), ("tvec", "translation", "t")
RMS = ("avgreprojectionerror", "rms", "reprojectionerror", "error")
OPENCV_TERMS = (*range(6), 8, 12, 14)  # the last two of 14 tilt the sensor
MOST_RMS_PX = 1e6  # beyond it is no number of pixels
SIZE = ("size", "imagesize", "resolution")


@dataclass(frozen=True, eq=False)
class Found:
    """One camera as a file has it: lengths in the file's unit, pixels of the images it was calibrated on.

    ``size_px`` None where the file does not say; ``undistorted_matrix``: the matrix of VibrationTracker's undistorted
    images.
    """

    matrix: Array
    distortion: Array
    rotation: Array
    translation: Array
    size_px: tuple[int, int] | None = None
    rms_px: float = float("nan")
    undistorted_matrix: Array | None = None


def read_cameras(specs: Sequence[str], names: Sequence[str], world: Path | None = None) -> dict[str, Found]:
    """Cameras by name from ``CAMERA=FILE[,FILE]``, ``CAMERA=FILE#SECTION``, or one ``FILE[,FILE]`` that holds all of
    them.

    ``world``: a file with rvec and tvec of the first camera, for a stereo calibration that only knows the cameras' own
    frame.
    """
    found: dict[str, Found] = {}
    for spec in specs:
        camera, equals, rest = spec.partition("=")
        if not equals or camera not in names:
            if equals and not Path(spec.partition(",")[0]).exists():
                raise InputError(
                    f"--calibration {spec}: no camera {camera}",
                    f"one of {', '.join(names)}",
                    "correct the name before '='",
                )
            found |= _all_cameras(spec.split(","), names, world)
            continue
        paths, _, section = rest.partition("#")
        values = _merged([Path(path) for path in paths.split(",")])
        if section:
            values = _section(values, section, paths)
        found[camera] = _camera(values, f"{camera}: {rest}")
    return found


def _merged(paths: Sequence[Path]) -> dict[str, Any]:
    values: dict[str, Any] = {}
    for path in paths:
        own = kalibr_mrcal.read_cameramodel(path) if path.suffix.lower() == ".cameramodel" else read_values(path)
        for name, value in own.items():
            key = name if isinstance(value, Mapping) else _key(name)
            if (
                key in values
                and not np.array_equal(values[key], value)
                and key in (*MATRIX, *DISTORTION, *ROTATION, *TRANSLATION)
            ):
                raise InputError(
                    f"{path}: {name} differs from that of {paths[0]}",
                    "files of one camera",
                    "name the files that belong together",
                )
            values[key] = value
    return values


def _key(name: str) -> str:
    return name.lower().replace("_", "").replace(" ", "")


def _plain(values: Mapping[str, Any]) -> dict[str, Any]:
    return {_key(name): value for name, value in values.items()}


def _section(values: Mapping[str, Any], section: str, where: str) -> dict[str, Any]:
    """A camera's table: by its key (dots go down, as TOML writes them), or by the ``name`` in it."""
    inside: Any = values
    for part in section.split("."):
        inside = inside.get(part) if isinstance(inside, Mapping) else None
    if not isinstance(inside, Mapping):
        inside = next((table for table in _tables(values).values() if str(table.get("name")) == section), None)
    if not isinstance(inside, Mapping):
        raise InputError(
            f"{where}: no section {section}",
            f"one of {', '.join(_tables(values)) or 'none'}",
            "correct the name after '#'",
        )
    return _plain(inside)


def _tables(values: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Every table that holds a camera's matrix, one or two levels deep, by its key."""
    found = {}
    for name, value in values.items():
        if isinstance(value, Mapping):
            inside = _plain(value)
            if any(key in inside for key in MATRIX):
                found[name] = inside
            else:
                found |= {
                    f"{name}.{key}": _plain(one)
                    for key, one in value.items()
                    if isinstance(one, Mapping) and any(k in _plain(one) for k in MATRIX)
                }
    return found


def _all_cameras(paths: Sequence[str], names: Sequence[str], world: Path | None) -> dict[str, Found]:
    values = _merged([Path(path) for path in paths])
    if {"m1", "m2"} <= set(values):
        return _stereo(values, names, world, ",".join(paths))
    if kalibr_mrcal.is_chain(values):
        return _chain(values, names, world, ",".join(paths))
    tables = _tables(values)
    if not tables:
        if any(key in values for key in MATRIX):
            raise InputError(
                f"{paths[0]} holds one camera",
                "its name too",
                f"write --calibration {names[0] if names else 'CAMERA'}={paths[0]}",
            )
        raise InputError(
            f"{paths[0]}: no camera (keys: {', '.join(values)[:200] or 'none'})",
            "cameraMatrix or matrix, a table per camera, or M1, D1, M2, D2, R, T",
            "name the right file",
        )
    by_name = {str(table.get("name", key)): table for key, table in tables.items()}
    if not set(by_name) & set(names):
        raise InputError(
            f"{paths[0]}: cameras {', '.join(by_name)}",
            f"the recording's {', '.join(names)}",
            f"say which is which: --calibration "
            f"{' '.join(f'{n}={paths[0]}#{k}' for n, k in zip(names, tables, strict=False))}",
        )
    return {name: _camera(by_name[name], f"{paths[0]}: {name}") for name in names if name in by_name}


def _stereo(values: Mapping[str, Any], names: Sequence[str], world: Path | None, where: str) -> dict[str, Found]:
    """OpenCV's stereo calibration: the second camera's pose to the first, and the first camera's pose to the plane."""
    if len(names) != 2:
        raise InputError(
            f"{where}: two cameras, the recording has {len(names)}",
            "two cameras",
            "give two [[cameras]] in recording.toml",
        )
    first = _first_pose(world, where)
    between = _pose({"r": values.get("r"), "t": values.get("t")}, where)
    second = between[0] @ first[0], between[0] @ first[1] + between[1]
    return {
        name: _camera(
            {
                "k": values[f"m{i}"],
                "d": values.get(f"d{i}", np.zeros(5)),
                "r": pose[0],
                "t": pose[1],
                **{key: values[key] for key in ("imagewidth", "imageheight", *SIZE) if key in values},
            },
            f"{where}: {name}",
        )
        for i, (name, pose) in enumerate(zip(names, (first, second), strict=True), 1)
    }


def _first_pose(world: Path | None, where: str) -> tuple[Array, Array]:
    """The first camera's pose in the world, which a file of the cameras' poses to each other lacks."""
    if world is None:
        raise InputError(
            f"{where}: R and T between the cameras, no pose of the sliding plane",
            "rvec and tvec of the first camera from a view of the board on the plane",
            "write them to a file (cv2.solvePnP) and name it with --world, or run ovines calibrate",
        )
    return _pose(_merged([world]), str(world))


def _chain(values: Mapping[str, Any], names: Sequence[str], world: Path | None, where: str) -> dict[str, Found]:
    """Kalibr's chain of cameras, by the names of their topics; by their order where these are none of ours."""
    cameras = kalibr_mrcal.chain(values, where)
    known = {name for name, _, _ in cameras} & set(names)
    if not known and len(cameras) != len(names):
        raise InputError(
            f"{where}: cameras {', '.join(name for name, _, _ in cameras)}",
            f"the recording's {', '.join(names)}, or as many of them",
            "name the topics as recording.toml names the cameras",
        )
    pose, found = _first_pose(world, where), {}
    for i, (name, camera, between) in enumerate(cameras):
        if between is not None:
            pose = between[:3, :3] @ pose[0], between[:3, :3] @ pose[1] + between[:3, 3]
        own = name if known else names[i]
        if own in names:
            found[own] = _camera({**camera, "r": pose[0], "t": pose[1]}, f"{where}: cam{i}")
    return found


def _camera(values: Mapping[str, Any], where: str) -> Found:
    if values.get("fisheye") in (True, 1, "true"):
        raise InputError(
            f"{where}: a fisheye camera",
            "OpenCV's pinhole camera with up to twelve distortion terms",
            "calibrate without fisheye",
        )
    matrix = _array(values, MATRIX, where, 9).reshape(3, 3)
    if matrix[0, 0] <= 0 or matrix[1, 1] <= 0 or not np.allclose(matrix[2], [0, 0, 1], rtol=1e-5, atol=1e-8):
        raise InputError(
            f"{where}: camera matrix {matrix.tolist()}", "[[fx, 0, cx], [0, fy, cy], [0, 0, 1]]", "check the file"
        )
    given = _array(values, DISTORTION, where, None) if any(key in values for key in DISTORTION) else np.zeros(5)
    whole = np.concatenate([given, np.zeros(max(0, max(LENS_TERMS) - len(given)))])
    if len(given) not in OPENCV_TERMS or (whole[max(LENS_TERMS) :] != 0).any():
        raise InputError(
            f"{where}: {len(given)} distortion terms",
            "OpenCV's five (k1, k2, p1, p2, k3), eight (rational) or twelve (thin prism)",
            "calibrate without the tilted model",
        )
    rotation, translation = _pose(values, where)
    new = values.get("newcameramatrix")
    new = None if new is None else _array({"newcameramatrix": new}, ("newcameramatrix",), where, 9).reshape(3, 3)
    return Found(
        matrix,
        whole[: next(terms for terms in LENS_TERMS if not (whole[terms:] != 0).any())],
        rotation,
        translation,
        _size(values, where),
        _rms(values),
        None if new is None or not np.any(new) else new,
    )


def _pose(values: Mapping[str, Any], where: str) -> tuple[Array, Array]:
    import cv2

    if not (
        any(values.get(key) is not None for key in ROTATION) and any(values.get(key) is not None for key in TRANSLATION)
    ):
        raise InputError(
            f"{where}: no pose of the camera",
            "rvec and tvec (or rotation and translation) of the world's board",
            "add a file that has them: CAMERA=LENS,POSE",
        )
    turn = _array(values, ROTATION, where, None)
    if turn.size not in (3, 9):
        raise InputError(
            f"{where}: a rotation of {turn.size} numbers", "a rotation vector or a 3 x 3 matrix", "check the file"
        )
    rotation = np.asarray(cv2.Rodrigues(turn)[0], float) if turn.size == 3 else turn.reshape(3, 3)
    if not np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-4) or np.linalg.det(rotation) < 0:
        raise InputError(
            f"{where}: the rotation is none (R R^T differs from 1, or it mirrors)",
            "a proper rotation",
            "check the file",
        )
    return rotation, _array(values, TRANSLATION, where, 3)


def _array(values: Mapping[str, Any], keys: Sequence[str], where: str, size: int | None) -> Array:
    key = next((key for key in keys if values.get(key) is not None), None)
    try:
        numbers = np.asarray(values[key], float).ravel() if key else np.empty(0)
    except (TypeError, ValueError, OverflowError):
        numbers = np.empty(0)
    if numbers.size == 0 or not np.isfinite(numbers).all() or (size is not None and numbers.size != size):
        raise InputError(
            f"{where}: {key or keys[0]} {'is not there' if key is None else f'holds {numbers.size} numbers'}",
            f"{size or 'some'} finite numbers (one of {', '.join(keys)})",
            "check the file",
        )
    return numbers


def _size(values: Mapping[str, Any], where: str) -> tuple[int, int] | None:
    if any(values.get(key) not in (None, 0, "") for key in ("imagewidth", "imageheight")):
        size = [_array(values, (key,), where, 1)[0] for key in ("imagewidth", "imageheight")]
    elif any(values.get(key) is not None for key in SIZE):
        size = list(_array(values, SIZE, where, 2))
    else:
        return None
    if not all(0 < side <= MOST_SIDE_PX for side in size):
        raise InputError(
            f"{where}: images of {size[0]:g} x {size[1]:g} px",
            f"whole numbers from 1 to {MOST_SIDE_PX}",
            "check the file",
        )
    return int(size[0]), int(size[1])


def _rms(values: Mapping[str, Any]) -> float:
    value = next((values[key] for key in RMS if isinstance(values.get(key), int | float)), float("nan"))
    return float(value) if 0 < value < MOST_RMS_PX else float("nan")
