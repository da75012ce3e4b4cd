"""Cameras as other programs' files, to the last digit; what a format cannot hold is refused by name.

All hold OpenCV's camera.  Lengths are in metres, the world is ours (z up from the sliding plane), and each file says so
where the format has room for a remark.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from ovines.camera import LENS_TERMS, Camera
from ovines.errors import InputError

Array = NDArray[np.float64]
REMARK = "ovines; lengths in metres, z up from the sliding plane, pixels of the whole sensor"
WORLD = "world.yaml"  # beside a Kalibr chain, which knows the cameras' poses to each other only


@dataclass(frozen=True)
class Format:
    """``files``: names and texts of some cameras; ``terms``: lengths of the distortion that it holds; ``reads``:
    how ``ovines import --calibration`` names the files.
    """

    program: str
    files: Callable[[Sequence[Camera]], dict[str, str]]
    terms: tuple[int, ...]
    reads: str


def export(cameras: Sequence[Camera], name: str) -> dict[str, str]:
    """File names and texts of the cameras in the format ``name`` of FORMATS; `InputError` for what it cannot hold."""
    chosen = FORMATS[name]
    for camera in cameras:
        if camera.matrix[0, 1] != 0:
            raise InputError(
                f"{camera.name}: a skew of {camera.matrix[0, 1]:.4g} px, which {chosen.program} does not know",
                "a camera matrix [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]",
                "calibrate with `ovines calibrate`, which holds it at 0",
            )
        if camera.spline is not None:
            raise InputError(
                f"{camera.name}: a spline beside the distortion terms, up to "
                f"{np.abs(camera.spline.shift_px).max():.2g} px, which {chosen.program} does not hold",
                "a lens of distortion terms alone",
                'read calibration.json itself ("spline", docs/reference/files.md), or undistort with ovines: without '
                "the spline the terms are not the lens",
            )
        needed = _terms_in_use(camera.distortion)
        if needed > max(chosen.terms):
            raise InputError(
                f"{camera.name}: {chosen.program} holds the distortion's first {max(chosen.terms)} terms "
                f"({', '.join(_TERMS[: max(chosen.terms)])}); {_TERMS[needed - 1]} = "
                f"{camera.distortion[needed - 1]:.4g} would be lost",
                "a lens without it",
                f"export to {' or '.join(n for n, one in FORMATS.items() if max(one.terms) >= needed)}",
            )
    return chosen.files(cameras)


_TERMS = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4")


def _terms_in_use(distortion: Array) -> int:
    return int(np.flatnonzero(distortion).max(initial=-1)) + 1


def _turn(camera: Camera) -> Array:
    return np.asarray(cv2.Rodrigues(camera.rotation)[0], float).ravel()


def _numbers(values: Array) -> str:
    """A list of numbers, each with every digit it has; rows of a matrix as lists of their own."""
    return str(np.asarray(values, float).tolist())


def _text(value: str) -> str:
    """A quoted string, as YAML and TOML both read it."""
    return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'


def _opencv_matrix(name: str, values: Array) -> str:
    rows, columns = values.shape
    return (
        f"{name}: !!opencv-matrix\n   rows: {rows}\n   cols: {columns}\n   dt: d\n   data: {_numbers(values.ravel())}\n"
    )


def _opencv(cameras: Sequence[Camera]) -> dict[str, str]:
    """One YAML per camera, with the names of OpenCV's calibration example and its pose as rvec and tvec."""
    files = {}
    for camera in cameras:
        rms = f"avg_reprojection_error: {camera.rms_px!r}\n" if np.isfinite(camera.rms_px) else ""
        files[f"{camera.name}.yaml"] = (
            f"%YAML:1.0\n---\n# {REMARK}\ncamera_name: {_text(camera.name)}\n"
            f"image_width: {camera.sensor_size_px[0]}\nimage_height: {camera.sensor_size_px[1]}\n"
            + _opencv_matrix("camera_matrix", camera.matrix)
            + _opencv_matrix("distortion_coefficients", camera.distortion[:, None])
            + rms
            + _opencv_matrix("rvec", _turn(camera)[:, None])
            + _opencv_matrix("tvec", camera.translation_m[:, None])
        )
    return files


def _kalibr(cameras: Sequence[Camera]) -> dict[str, str]:
    """``camchain.yaml``: each camera's pose to the one before; the first one's pose in the world in a file of its
    own.
    """
    lines = [f"# {REMARK}"]
    for i, camera in enumerate(cameras):
        k = camera.matrix
        lines += [
            f"cam{i}:",
            "  camera_model: pinhole",
            f"  intrinsics: {_numbers(np.array([k[0, 0], k[1, 1], k[0, 2], k[1, 2]]))}",
            "  distortion_model: radtan",
            f"  distortion_coeffs: {_numbers(camera.distortion[:4])}",
            f"  resolution: {list(camera.sensor_size_px)}",
            f"  rostopic: {_text('/' + camera.name)}",
        ]
        if i:
            before = cameras[i - 1]
            turn = camera.rotation @ before.rotation.T
            shift = camera.translation_m - turn @ before.translation_m
            rows = np.vstack([np.column_stack([turn, shift]), [0, 0, 0, 1]])
            lines += ["  T_cn_cnm1:", *(f"  - {_numbers(row)}" for row in rows)]
    first = cameras[0]
    world = _opencv_matrix("rvec", _turn(first)[:, None]) + _opencv_matrix("tvec", first.translation_m[:, None])
    return {
        "camchain.yaml": "\n".join(lines) + "\n",
        WORLD: f"%YAML:1.0\n---\n# pose of {_text(first.name)} in the world; {REMARK}\n{world}",
    }


def _mrcal(cameras: Sequence[Camera]) -> dict[str, str]:
    """One ``.cameramodel`` per camera: a Python literal, as mrcal's own are."""
    files = {}
    for camera in cameras:
        k = camera.matrix
        lens = np.concatenate([[k[0, 0], k[1, 1], k[0, 2], k[1, 2]], camera.distortion])
        files[f"{camera.name}.cameramodel"] = (
            f"# {REMARK}\n{{\n    'lensmodel':  'LENSMODEL_OPENCV{len(camera.distortion)}',\n\n"
            f"    # intrinsics are fx,fy,cx,cy,distortion0,distortion1,....\n    'intrinsics': {_numbers(lens)},\n\n"
            f"    # extrinsics are rt_fromref\n"
            f"    'extrinsics': {_numbers(np.concatenate([_turn(camera), camera.translation_m]))},\n\n"
            f"    'imagersize': {list(camera.sensor_size_px)},\n}}\n"
        )
    return files


def _caliscope(cameras: Sequence[Camera]) -> dict[str, str]:
    """``camera_array.toml``: tables [cameras.N], the rotation as a matrix."""
    parts = [f"# {REMARK}\n"]
    for i, camera in enumerate(cameras):
        rms = f"error = {camera.rms_px!r}\n" if np.isfinite(camera.rms_px) else ""
        parts.append(
            f"[cameras.{i}]\ncam_id = {i}\nname = {_text(camera.name)}\nrotation_count = 0\n{rms}ignore = false\n"
            f"size = {list(camera.sensor_size_px)}\nmatrix = {_numbers(camera.matrix)}\n"
            f"distortions = {_numbers(camera.distortion)}\ntranslation = {_numbers(camera.translation_m)}\n"
            f"rotation = {_numbers(camera.rotation)}\n"
        )
    return {"camera_array.toml": "\n".join(parts)}


def _anipose(cameras: Sequence[Camera]) -> dict[str, str]:
    """``calibration.toml``: tables [cam_N], the rotation as a vector."""
    parts = [f"# {REMARK}\n"]
    for i, camera in enumerate(cameras):
        parts.append(
            f"[cam_{i}]\nname = {_text(camera.name)}\nsize = {list(camera.sensor_size_px)}\n"
            f"matrix = {_numbers(camera.matrix)}\ndistortions = {_numbers(camera.distortion)}\n"
            f"rotation = {_numbers(_turn(camera))}\ntranslation = {_numbers(camera.translation_m)}\n"
        )
    return {"calibration.toml": "\n".join([*parts, "[metadata]\nadjusted = true\n"])}


_ALL = tuple(LENS_TERMS)
FORMATS = {
    "opencv": Format("OpenCV's YAML", _opencv, _ALL, "{camera}={out}/{camera}.yaml"),
    "kalibr": Format("Kalibr's radtan lens", _kalibr, (4,), "{out}/camchain.yaml --world {out}/" + WORLD),
    "mrcal": Format("mrcal's .cameramodel", _mrcal, _ALL, "{camera}={out}/{camera}.cameramodel"),
    "caliscope": Format("caliscope's TOML", _caliscope, (5,), "{out}/camera_array.toml"),
    "anipose": Format("Anipose's TOML", _anipose, (5,), "{out}/calibration.toml"),
}
