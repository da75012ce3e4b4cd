"""Calibration on real images that nobody here made: inverted ChArUco from two webcams.  Chessboard and dot grid:
:mod:`tests.house.commands.test_real_in_three_commands`.
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from vision.calibrate import calibrate
from vision.calibration.targets.boards import Board
from vision.calibration.targets.detection import detect

ROOT = Path(__file__).resolve().parents[3]
REAL = ROOT.parent / "shared" / "real"


def both_cameras(board: Board, views: dict, size: tuple[int, int]):
    """Joint calibration of two cameras on simultaneous views; (result, second camera's rotation and translation to the
    first).
    """
    named = [{v.name: v for v in views[c]} for c in views]
    common = [k for k in named[0] if k in named[1] and all(len(n[k].points) >= 6 for n in named)]
    world = max(common, key=lambda k: min(len(n[k].points) for n in named))
    found = calibrate(
        board,
        views,
        dict.fromkeys(views, size),
        {c: n[world] for c, n in zip(views, named, strict=True)},
        simultaneous=True,
    )
    first, second = found.cameras
    rotation = second.rotation @ first.rotation.T
    return found, rotation, second.translation_m - rotation @ first.translation_m


@pytest.mark.long
@pytest.mark.skipif(not (REAL / "charuco_two_webcams").is_dir(), reason="no real images beside the checkout")
def test_inverted_charuco_of_two_webcams():
    from vision.calibration.images import video_frames

    board = Board("webcams", (4, 5), 0.054, 0.75 * 0.054, "DICT_4X4_1000", inverted=True)
    folder = REAL / "charuco_two_webcams" / "calibration" / "extrinsic"
    with open(folder / "timestamps.csv", encoding="utf-8") as handle:
        rows = list(csv.DictReader(handle))
    times = [np.array([float(r["frame_time"]) for r in rows if r["cam_id"] == str(c)]) for c in (0, 1)]
    near = np.abs(times[0][:, None] - times[1][None]).argmin(1)
    pairs = [(i, j) for i, j in enumerate(near) if abs(times[0][i] - times[1][j]) < 0.036]
    views = {}
    for c in (0, 1):
        frames = dict(video_frames(folder / f"cam_{c}.mp4", numbers=[p[c] for p in pairs]))
        views[c] = [
            detect(frames[f"frame_{p[c]:05d}"], board, f"pair_{k:03d}")
            for k, p in enumerate(pairs)
            if f"frame_{p[c]:05d}" in frames
        ]
    found, _, translation = both_cameras(board, views, (1280, 720))
    assert sum(len(v.points) >= 6 for v in views[0]) == 46
    # Another program's base line is 1.132 m, a plain OpenCV solve's 1.140 m with 1.07 px.
    assert np.linalg.norm(translation) == pytest.approx(1.136, abs=0.006)
    assert np.sqrt(np.mean([c.rms_px**2 for c in found.cameras])) < 1.07
