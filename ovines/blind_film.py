"""A blind case as images: the plant's motion, filmed by the renderer. Neither knows of the other."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from joblib import Parallel, delayed

from analysis.blind.recording.files import Series, calibration_of, recording_text
from analysis.blind.recording.markers import Poses
from analysis.blind.recording.views import GROUND_M, HOST_M
from analysis.blind.series import Outline
from ovines.camera import read_calibration
from vision.rendering.images import Look, Markers, Pose, Rig, View, render_frame

# The rig fills a quarter of the window's width: the rest would be rendered and stored for nothing.
FILM_COLUMNS = (1440, 1216)
# The series' Host markers sit on the edge of the wall, where half of a disc would hang over the opening.
OUTWARD = np.array([1.11, 1.11, 1.0])


def film_series(series: Series, outline: Outline, folder: Path) -> None:
    """Write `calibration.json` and per run `recording.toml` and the frames of both cameras as PNG.

    A frame is one instant (no motion blur), eight bits with two greys of noise; about 0.3 s and 0.4 MB each.
    """
    folder.mkdir(parents=True, exist_ok=True)
    calibration = folder / "calibration.json"
    # Rendered in the usual rig's frame and units: the same cameras around the rig where it stands see the same
    # pictures.
    calibration.write_text(json.dumps(calibration_of(outline.views), indent=1))
    cameras = read_calibration(calibration)
    calibration.write_text(json.dumps(series.calibration, indent=1))
    views = [
        replace(
            view,
            window_offset_px=(FILM_COLUMNS[0], view.window_offset_px[1]),
            window_size_px=(FILM_COLUMNS[1], 688),
        )
        for view in outline.views
    ]
    rig = _rig(outline)
    jobs = []
    for number, (text, _) in enumerate(series.recordings):
        run = folder / f"run-{number + 1:02d}"
        level = float(text.split("acceleration_g = ")[1].split()[0])
        name = f"{series.truth['case']} run {number + 1}"
        for camera, view, poses in zip(cameras, views, series.poses[number], strict=True):
            (run / camera.name).mkdir(parents=True, exist_ok=True)
            jobs += [(run / camera.name, k, camera, view, rig, poses) for k in range(len(poses.nes))]
        toml = recording_text(name, level, views, outline.model, HOST_M * OUTWARD, "{camera}/*.png", outline.place)
        (run / "recording.toml").write_text(toml)
    blocks = [jobs[i : i + 100] for i in range(0, len(jobs), 100)]
    Parallel(n_jobs=-1)(delayed(_film)(block, index) for index, block in enumerate(blocks))


def _rig(outline: Outline) -> Rig:
    """The bodies with their markers where they really sit."""
    host = outline.marks.host_m + HOST_M * (OUTWARD - 1.0)
    return Rig(
        markers={
            "ground": Markers(("G1", "G2", "G3"), GROUND_M, 0.002),
            "host": Markers(("H1", "H2", "H3", "H4"), host, 0.002),
            "nes": Markers(("N1", "N2", "N3", "N4", "N5"), outline.marks.nes_m, 0.0013),
        },
        wall_height_m=0.010,
    )


def _film(block: list[Any], seed: int) -> None:
    rng = np.random.default_rng(seed)
    seen: dict[str, View] = {}
    for folder, frame, camera, view, rig, poses in block:
        if camera.name not in seen:
            seen[camera.name] = View(camera, view.window_offset_px, view.window_size_px)
        image, _ = render_frame(seen[camera.name], rig, [_scene(poses, frame)], Look(), rng)
        cv2.imwrite(str(folder / f"{frame:05d}.png"), image)


def _scene(poses: Poses, frame: int) -> dict[str, Pose]:
    nes, host = poses.nes[frame], poses.host[frame]
    return {"nes": Pose(nes[0], nes[1], nes[2], nes[3]), "host": Pose(host[0], host[1], host[3], host[2])}
