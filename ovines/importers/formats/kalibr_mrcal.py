"""Kalibr's camera chain and mrcal's camera model, as tables with OpenCV's names."""

from __future__ import annotations

import ast
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ovines.errors import InputError
from ovines.importers.reading.files import MOST_PARAMETER_BYTES, read_text
from ovines.io.nesting import refuse_deep

Array = NDArray[np.float64]
LENSES = {"LENSMODEL_PINHOLE": 0} | {f"LENSMODEL_OPENCV{n}": n for n in (4, 5, 8, 12)}


def is_chain(values: Mapping[str, Any]) -> bool:
    """Whether these are the tables cam0, cam1 and so on that Kalibr writes."""
    first = values.get("cam0")
    return isinstance(first, Mapping) and "camera_model" in first


def chain(values: Mapping[str, Any], where: str) -> list[tuple[str, dict[str, Any], Array | None]]:
    """Per camera of a Kalibr chain: name (its topic's, without the slash), matrix, distortion and size under OpenCV's
    names, and its pose (4, 4) to the camera before (None for the first).
    """
    found: list[tuple[str, dict[str, Any], Array | None]] = []
    while isinstance(one := values.get(f"cam{len(found)}"), Mapping):
        at = f"{where}: cam{len(found)}"
        model, lens = one.get("camera_model"), one.get("distortion_model")
        if model != "pinhole" or lens not in ("radtan", "none"):
            raise InputError(
                f"{at}: {model} with {lens}", "pinhole with radtan", "calibrate with --models pinhole-radtan"
            )
        fx, fy, cx, cy = _numbers(one, "intrinsics", (4,), at)
        camera: dict[str, Any] = {"k": [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]}
        if lens == "radtan":
            camera["d"] = _numbers(one, "distortion_coeffs", (4,), at)
        if one.get("resolution"):
            camera["size"] = one["resolution"]
        pose = _numbers(one, "T_cn_cnm1", (4, 4), at) if found else None
        name = str(one.get("rostopic") or f"cam{len(found)}").strip("/").removesuffix("/image_raw")
        found.append((name, camera, pose))
    return found


def _numbers(values: Mapping[str, Any], key: str, shape: tuple[int, ...], where: str) -> Array:
    try:
        numbers = np.asarray(values.get(key), float)
    except (TypeError, ValueError, OverflowError):
        numbers = np.empty(0)
    if numbers.shape != shape or not np.isfinite(numbers).all():
        raise InputError(f"{where}: {key} = {str(values.get(key))[:80]}", f"numbers of shape {shape}", "check the file")
    return numbers


def read_cameramodel(path: Path) -> dict[str, Any]:
    """A .cameramodel of mrcal under OpenCV's names; its extrinsics turn the reference's points into the camera's."""
    expected = "a .cameramodel of mrcal"
    text = read_text(path, expected, MOST_PARAMETER_BYTES)
    refuse_deep(text, path, expected)
    try:
        model = ast.literal_eval(text.strip())
    except (ValueError, SyntaxError, MemoryError, RecursionError) as error:
        raise InputError(f"{path}: {str(error)[:200]}", expected, "write the file again with mrcal") from None
    if not isinstance(model, dict):
        raise InputError(f"{path} holds a {type(model).__name__}", expected, "name the right file")
    kind = model.get("lensmodel", model.get("lens_model"))
    if kind not in LENSES:
        raise InputError(
            f"{path}: lens {str(kind)[:80]}",
            " or ".join(LENSES),
            "convert it: mrcal-convert-lensmodel LENSMODEL_OPENCV8",
        )
    lens = _numbers(model, "intrinsics", (4 + LENSES[kind],), str(path))
    fx, fy, cx, cy = lens[:4]
    key = next((key for key in _POSES if key in model), _POSES[0])
    pose = _numbers(model, key, (6,), str(path))
    return {
        "cameramatrix": [[fx, 0, cx], [0, fy, cy], [0, 0, 1]],
        "distortion": lens[4:] if len(lens) > 4 else np.zeros(5),
        "rvec": pose[:3],
        "tvec": pose[3:],
        "imagesize": model.get("imagersize"),
    }


_POSES: Sequence[str] = ("extrinsics", "rt_cam_ref")  # the old name and the new one
