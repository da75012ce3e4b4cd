"""``films.py --drops``: pictures taken away as cameras drop them, under a trigger that jitters and misses
pulses.
"""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from film_kinds import Kind, filmed

from analysis.motion.bodies import motion_from_points
from ovines.camera import read_calibration
from ovines.recording import read_recording
from vision.track import track
from vision.triangulate import triangulate

FRAMES, RATE_HZ = 120, 800.0
# of the stamps: the pictures are rendered at even times, so that more would be an error of the times, not a jitter
JITTER_S = 5e-6
# name: instants that the first camera lacks, that the second lacks, whether file names keep the hole, rows that
# trigger.csv lacks
DROPS: dict[str, tuple[Sequence[int], Sequence[int], bool, Sequence[int]]] = {
    "nothing": ((), (), False, ()),
    "trigger misses five": ((), (), False, (0, 7, 60, 61, 119)),
    "one in the second": ((), (60,), False, ()),
    "one in the first, early": ((3,), (), False, ()),
    "one in the second, late": ((), (114,), False, (7, 60)),
    "one in each": ((40,), (80,), False, ()),
    "one in each, 3 frames apart": ((10,), (13,), False, ()),
    "three in a row": ((), (50, 51, 52), False, ()),
    "six in a row": ((30, 31, 32, 33, 34, 35), (), False, ()),
    "three in the second": ((), (20, 50, 80), False, ()),
    "the same in both": ((60,), (60,), False, ()),
    "first starts late": ((0, 1), (), False, ()),
    "names keep the hole": ((20,), (70, 71), True, ()),
}


def drops(seed: int) -> None:
    """Print a row per way of dropping."""
    print(f"{'dropped':30s} pictures under a wrong instant   times off by, us   NES, um (RMS)   notes")
    with tempfile.TemporaryDirectory() as folder:
        whole = Path(folder) / "whole"
        truth = filmed(whole, Kind(), FRAMES, seed)
        rng = np.random.default_rng(seed)
        times_s = np.arange(FRAMES) / RATE_HZ + JITTER_S * rng.standard_normal(FRAMES)
        for name, (first, second, hole, untimed) in DROPS.items():
            part = without(whole, Path(folder) / "part", (first, second), hole, times_s, untimed)
            print(f"{name:30s} {judged(part, truth, times_s, untimed)}", flush=True)


def without(
    whole: Path, part: Path, lost: Sequence[Sequence[int]], hole: bool, times_s: np.ndarray, untimed: Sequence[int]
) -> Path:
    """The recording without some pictures, numbered on without a hole (or with it), and its trigger.csv."""
    shutil.rmtree(part, ignore_errors=True)
    for camera, gone in zip(("VW1", "VW2"), lost, strict=True):
        (part / camera).mkdir(parents=True)
        for k, n in enumerate(np.setdiff1d(np.arange(FRAMES), gone)):
            os.link(whole / camera / f"frame_{n:05d}.bmp", part / camera / f"frame_{n if hole else k:05d}.bmp")
    shutil.copy(whole / "true_calibration.json", part)
    text = (whole / "recording.toml").read_text(encoding="utf-8")
    (part / "recording.toml").write_text(
        text.replace("[time]\n", '[time]\ntrigger = "trigger.csv"\n'), encoding="utf-8"
    )
    timed = np.setdiff1d(np.arange(FRAMES), untimed)
    pd.DataFrame({"frame": timed, "time_s": times_s[timed]}).to_csv(part / "trigger.csv", index=False)
    return part


def judged(part: Path, truth: pd.DataFrame, times_s: np.ndarray, untimed: Sequence[int]) -> str:
    """Follow, triangulate, lay the body through it: what ended under a wrong instant."""
    recording, cameras = read_recording(part), read_calibration(part / "true_calibration.json")
    found = track(recording, cameras)
    both = found.tracks.merge(truth, on=["camera", "frame", "marker"], suffixes=("", "_true"), how="left")
    off = np.hypot(both["u_px"] - both["u_px_true"], both["v_px"] - both["v_px_true"])
    wrong = both[~(off < 1.0)].drop_duplicates(["camera", "frame"])
    timed = ~found.tracks["frame"].isin(list(untimed))
    late = np.abs(found.tracks["time_s"] - times_s[found.tracks["frame"].to_numpy()])[timed].max()
    motion = motion_from_points(triangulate(found.tracks, cameras, recording.window_offset_px), recording)
    own = motion.merge(truth.drop_duplicates("frame"), on="frame", suffixes=("", "_true"))
    um = 1e6 * np.sqrt(
        np.nanmean(np.r_[own["nes_x_m"] - own["nes_x_m_true"], own["nes_y_m"] - own["nes_y_m_true"]] ** 2)
    )
    notes = [note.split(":")[0] for note in found.notes if "from images" not in note]
    return (
        f"{len(wrong):4d} of {len(both.drop_duplicates(['camera', 'frame'])):3d} {1e6 * late:30.3f} {um:14.2f}   "
        f"{'; '.join(notes) or 'none'}"
    )
