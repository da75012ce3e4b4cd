"""A whole recording with known truth: board views, frames of both cameras, recording.toml, truth.parquet.

python -m vision.rendering.recording FOLDER [--frames N] [--seed N] [--window W H] [--views N]
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ovines.camera import Camera, write_calibration
from ovines.io.provenance import provenance
from ovines.tables import write_table
from vision.calibration.targets.boards import WORLD_FROM_BOARD, Board, find_board
from vision.rendering.board import render_board
from vision.rendering.images import Look, Markers, Pose, Rig, View, render_frame
from vision.rendering.motion import bouncing

Array = NDArray[np.float64]
PNG = [cv2.IMWRITE_PNG_COMPRESSION, 3]  # noise does not compress: 9 costs ten times the time for 3 % less
_WHOLLY_VISIBLE = 0.99  # share of a marker's disc from which it counts as visible
_JPEG = [cv2.IMWRITE_JPEG_QUALITY, 93]
Motion = Callable[[float], Mapping[str, Pose]]


@dataclass(frozen=True)
class Files:
    """What is written: the recording's name, views of the board per camera, suffixes of frames and views."""

    name: str = "rendered"
    views: int = 12
    suffix: str = ".png"
    board_suffix: str = ".png"


@dataclass(frozen=True, eq=False)
class Setup:
    """Cameras, rig, look and timing of a rendered recording."""

    cameras: tuple[Camera, ...]
    window_offset_px: tuple[tuple[int, int], ...]
    window_size_px: tuple[int, int]
    rig: Rig
    board: Board
    look: Look = Look()
    frame_rate_hz: float = 800.0
    exposure_s: float = 4e-4


def look_at(
    name: str,
    centre_m: Array,
    target_m: Array,
    focal_px: float,
    size_px: tuple[int, int],
    distortion: Array,
    principal_px: tuple[float, float],
    roll_rad: float = 0.0,
) -> Camera:
    """A camera at ``centre_m`` that looks at ``target_m``, its image's u along the world's x as nearly as it can be."""
    forward = np.asarray(target_m, float) - centre_m
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0.0, 1.0, 0.0])
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(forward, right), forward])
    rotation = cv2.Rodrigues(np.array([0, 0, roll_rad]))[0] @ rotation
    matrix = np.array([[focal_px, 0, principal_px[0]], [0, focal_px, principal_px[1]], [0, 0, 1.0]])
    return Camera(
        name, size_px, matrix, np.asarray(distortion, float), rotation, -rotation @ np.asarray(centre_m, float)
    )


def thesis_setup(rng: np.random.Generator, window_size_px: tuple[int, int] = (4096, 688)) -> Setup:
    """A rig of the thesis' size: two 12-megapixel cameras 1.2 m away, 40 degrees apart, f about 6,400 px."""
    middle = np.array([0.02, -0.028, 0.0])  # the board in the world position lies under the rig's middle
    size = (4096, 3072)
    cameras, offsets = [], []
    for name, side in (("VW1", -1), ("VW2", 1)):
        centre = middle + 1.23 * np.array([side * np.sin(0.36), rng.normal(0, 0.01), np.cos(0.36)])
        distortion = np.array([-0.055 + rng.normal(0, 0.005), 0.1, *rng.normal(0, 2e-4, 2), 0.0])
        camera = look_at(
            name,
            centre,
            middle + rng.normal(0, 0.002, 3) * [1, 1, 0],
            6380 + rng.normal(0, 20),
            size,
            distortion,
            (2047.5 + rng.normal(0, 12), 1535.5 + rng.normal(0, 12)),
            rng.normal(0, 0.01),
        )
        u, v = camera.project(middle)
        width, height = window_size_px
        offsets.append(
            (int(np.clip(u - width / 2, 0, size[0] - width)), int(np.clip(v - height / 2, 0, size[1] - height)))
        )
        cameras.append(camera)
    return Setup(tuple(cameras), tuple(offsets), window_size_px, thesis_rig(), find_board("charuco_5x7_8mm"))


def half_setup(rng: np.random.Generator) -> Setup:
    """The thesis' rig seen by cameras of half its resolution in a close window: small enough to be kept in a
    repository.
    """
    full = thesis_setup(rng)
    cameras, offsets, window = [], [], (448, 344)
    for camera in full.cameras:
        matrix = camera.matrix.copy()
        matrix[:2] *= 0.5
        matrix[:2, 2] -= 0.25  # the centre of the first pixel of two is half a pixel further out
        half = Camera(camera.name, (2048, 1536), matrix, camera.distortion, camera.rotation, camera.translation_m)
        u, v = half.project(np.array([0.02, -0.028, 0.005]))
        cameras.append(half)
        offsets.append((int(u - window[0] / 2), int(v - window[1] / 2)))
    # The thesis' small board has markers of less than 20 px at half its resolution.
    return Setup(tuple(cameras), tuple(offsets), window, full.rig, find_board("charuco_9x13_20mm"))


def thesis_rig() -> Rig:
    """Three ground markers, four on the Host's ring, five on the NES, none of them symmetric."""

    def ring(angles_deg: tuple[float, ...], radius_m: float, z_m: float) -> Array:
        angles = np.radians(angles_deg)
        return np.asarray(
            np.round(np.stack([radius_m * np.cos(angles), radius_m * np.sin(angles), 0 * angles + z_m], -1), 6), float
        )

    nes = np.array(
        [
            [0, 0, 0.01],
            [0.0061, 0.0003, 0.01],
            [-0.0008, 0.006, 0.01],
            [-0.0058, -0.0017, 0.01],
            [0.0024, -0.0056, 0.01],
        ]
    )
    return Rig(
        {
            "ground": Markers(
                ("G1", "G2", "G3"), np.array([[0.098, -0.005, 0.0], [-0.064, 0.01, 0.0], [0.094, -0.07, 0.0]]), 0.002
            ),
            "host": Markers(("H1", "H2", "H3", "H4"), ring((22, 118, 205, 309), 0.0555, 0.012), 0.002),
            "nes": Markers(("N1", "N2", "N3", "N4", "N5"), nes, 0.0013),
        }
    )


def board_poses(setup: Setup, camera: int, count: int, rng: np.random.Generator) -> list[tuple[Array, Array]]:
    """Poses of a hand-held board: about the rig's place, tilted up to 40 degrees, 15 % nearer and farther."""
    own = setup.cameras[camera]
    width, height = setup.board.size_m
    poses = []
    for k in range(count):
        tilt = rng.uniform(0.15, 0.7) * np.array([np.cos(2.4 * k), np.sin(2.4 * k), 0]) + [0, 0, rng.uniform(-0.6, 0.6)]
        turn = np.asarray(cv2.Rodrigues(tilt)[0], float)
        depth = rng.uniform(0.85, 1.15) * own.translation_m[2]
        spread = np.array(own.sensor_size_px) / own.matrix[0, 0] * depth
        middle = np.append(rng.uniform(-0.40, 0.40, 2) * spread, depth)
        poses.append((turn, middle - turn @ np.array([width / 2, height / 2, 0])))
    return poses


def render_recording(
    folder: Path,
    setup: Setup,
    motion: Motion,
    frames: int,
    rng: np.random.Generator,
    files: Files = Files(),
    *,
    looks: Callable[[str, int], Look] | None = None,
    clock_s: float = 0.0,
) -> pd.DataFrame:
    """Write the recording into ``folder`` and give its truth: one row per camera, frame and marker.

    ``motion(time_s)`` gives the bodies' poses in the world; the second camera sees them ``clock_s`` later, and its
    truth is what it saw.
    ``looks(camera, frame)``: light that changes, in place of the setup's.  Motion blur is the mean over the exposure in
    steps below one blur width.  Files: ``recording.toml``, ``CAMERA/frame_NNNNN``, ``calibration/``, ``truth.parquet``,
    ``true_calibration.json``.
    """
    folder = Path(folder)
    for c, camera in enumerate(setup.cameras):
        _write_views(folder, setup, c, files, rng)
        (folder / camera.name).mkdir(parents=True, exist_ok=True)
    truths = []
    windows = [
        View(camera, offset, setup.window_size_px)
        for camera, offset in zip(setup.cameras, setup.window_offset_px, strict=True)
    ]
    for frame in range(frames):
        time_s = frame / setup.frame_rate_hz
        for c, view in enumerate(windows):
            seen_s = time_s + c * clock_s
            steps = _steps(view, setup, motion, seen_s)
            poses = [motion(seen_s + part * setup.exposure_s) for part in (np.arange(steps) + 0.5) / steps - 0.5]
            image, truth = render_frame(
                view, setup.rig, poses, setup.look if looks is None else looks(view.camera.name, frame), rng
            )
            _write(folder / view.camera.name / f"frame_{frame:05d}{files.suffix}", image)
            here = motion(seen_s)
            truths.append(
                truth.assign(
                    camera=view.camera.name,
                    frame=frame,
                    time_s=time_s,
                    **{
                        f"{body}_{key}": getattr(here[body], key)
                        for body in ("host", "nes")
                        for key in ("x_m", "y_m", "angle_rad")
                    },
                )
            )
    truth = pd.concat(truths, ignore_index=True)
    truth["visible"] = truth["visible"] > _WHOLLY_VISIBLE
    truth = truth.sort_values(["camera", "frame", "marker"], ignore_index=True)
    write_table(
        truth, "truth", folder / "truth.parquet", provenance("render", {"frames": frames, "name": files.name}, {})
    )
    write_calibration(setup.cameras, folder / "true_calibration.json")
    (folder / "recording.toml").write_text(_toml(setup, files), encoding="utf-8")
    return truth


def _steps(view: View, setup: Setup, motion: Motion, time_s: float) -> int:
    """Odd number of poses through the exposure, each marker moving by at most one blur width between two."""
    first, last = (motion(time_s + half) for half in (-0.5 * setup.exposure_s, 0.5 * setup.exposure_s))
    still = Pose()
    moved = [0.0]
    for body, markers in setup.rig.markers.items():
        ends = [view.camera.project(poses.get(body, still).place(markers.layout_m)) for poses in (first, last)]
        moved.append(float(np.linalg.norm(ends[1] - ends[0], axis=-1).max()))
    return 1 + 2 * int(np.ceil(0.5 * max(moved) / setup.look.blur_px))


def _write_views(folder: Path, setup: Setup, c: int, files: Files, rng: np.random.Generator) -> None:
    suffix = files.board_suffix
    camera = setup.cameras[c]
    here = folder / "calibration" / camera.name
    (here / "intrinsic").mkdir(parents=True, exist_ok=True)
    view = View(camera)
    poses = board_poses(setup, c, files.views, rng)
    for k, (turn, shift) in enumerate(poses):
        _write(
            here / "intrinsic" / f"view_{k:02d}{suffix}",
            render_board(view, setup.board, turn, shift, setup.look, rng)[0],
        )
    world = camera.rotation @ WORLD_FROM_BOARD
    _write(
        here / f"extrinsic{suffix}", render_board(view, setup.board, world, camera.translation_m, setup.look, rng)[0]
    )


def _write(path: Path, image: NDArray[np.uint8]) -> None:
    cv2.imwrite(str(path), image, {".png": PNG, ".jpg": _JPEG}.get(path.suffix, []))


def _toml(setup: Setup, files: Files) -> str:
    lines = ["format = 1", f'name = "{files.name}"', "", "[time]", f"frame_rate_hz = {setup.frame_rate_hz}", ""]
    for camera, offset in zip(setup.cameras, setup.window_offset_px, strict=True):
        lines += [
            "[[cameras]]",
            f'name = "{camera.name}"',
            f'frames = "{camera.name}/*{files.suffix}"',
            f"sensor_size_px = {list(camera.sensor_size_px)}",
            f"window_offset_px = {list(offset)}",
            f"window_size_px = {list(setup.window_size_px)}",
            f"exposure_s = {setup.exposure_s}",
            "",
        ]
    lines += [
        "[calibration]",
        f'board = "{setup.board.name}"',
        f'intrinsic = "calibration/{{camera}}/intrinsic/*{files.board_suffix}"',
        f'extrinsic = "calibration/{{camera}}/extrinsic{files.board_suffix}"',
        "",
    ]
    for body, markers in setup.rig.markers.items():
        lines += [f"[bodies.{body}]", f"markers = {list(markers.names)}".replace("'", '"')]
        lines += [f"layout_m = {np.round(markers.layout_m, 7).tolist()}"]
        if body == "host":
            lines.append(f"inner_radius_m = {setup.rig.host_inner_radius_m}")
        if body == "nes":
            lines += [
                'centre_marker = "N1"',
                f"radius_m = {setup.rig.nes_radius_m}",
                "mass_kg = 0.0246",
                "inertia_factor = 0.5",
            ]
        lines.append("")
    lines += [
        "[excitation]",
        "frequency_hz = 11.0",
        "acceleration_g = 8.0",
        'axis = "x"',
        "",
        "[model]",
        'effects = ["floor_friction", "spin_coupling"]',
        "",
    ]
    return "\n".join(lines)


def main() -> None:
    """Write a recording of the thesis' rig with a bouncing NES."""
    parser = argparse.ArgumentParser(description="Render a stereo recording with known truth")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--frames", type=int, default=100)
    parser.add_argument("--views", type=int, default=12)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--window", type=int, nargs=2, default=(4096, 688))
    parser.add_argument("--noise", type=float, default=2.0)
    parser.add_argument(
        "--half",
        action="store_true",
        help="half the resolution in a close window, board views as JPEG (sample_data/rendered)",
    )
    args = parser.parse_args()
    rng = np.random.default_rng(args.seed)
    setup = half_setup(rng) if args.half else thesis_setup(rng, tuple(args.window))
    setup = Setup(**{**vars(setup), "look": Look(noise_grey=args.noise, gradient=(0.15, -0.1))})
    render_recording(
        args.folder,
        setup,
        bouncing(args.frames / setup.frame_rate_hz),
        args.frames,
        rng,
        Files(views=args.views, board_suffix=".jpg" if args.half else ".png"),
    )


if __name__ == "__main__":
    main()
