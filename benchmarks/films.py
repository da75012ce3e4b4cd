"""How much of a film is tracked, and how truly: whole rendered recordings under bad light, noise, blur, fast spin, against their truth.

    python benchmarks/films.py [--frames 40] [--seed 1] [--only glare]

The thesis' rig, two windows of 4096 x 688 pixels, rendered poses and the true calibration.  ``seen``: of the markers that the picture
shows wholly, those with a track.  ``swaps``: tracks nearer to another marker's true place than to their own.  ``px``: median, RMS and largest
error; ``inside``: share of the errors' coordinates within 1.645 sd (honest: 90 %).  ``um``: median and 95th percentile of the
triangulated points' error in space.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from ovines.camera import read_calibration
from ovines.recording import read_recording
from vision.render import Band, Glare, Look
from vision.render_motion import bouncing
from vision.render_recording import render_recording, thesis_setup
from vision.render_scene import Pose
from vision.track import track
from vision.triangulate import triangulate

BANDS = (Band(1500, 120, 0.6, softness_px=6), Band(2100, 60, 0.5, 0.3, 3), Band(2700, 200, 0.7, softness_px=20))
GLARES = (Glare(1900, 300, 60, 90), Glare(2300, 400, 30, 120), Glare(2050, 200, 15, 100))
# name: the light, seconds of exposure, spin added to the NES' own in rad/s
CASES: dict[str, tuple[Look, float, float]] = {
    "plain": (Look(), 5e-5, 0.0),
    "noise of 6 greys": (Look(noise_grey=6.0), 5e-5, 0.0),
    "light from one side": (Look(gradient=(0.8, -0.5)), 5e-5, 0.0),
    "half the light": (Look(gain=0.5, noise_grey=2.0), 5e-5, 0.0),
    "shadow bands": (Look(bands=BANDS), 5e-5, 0.0),
    "glare": (Look(glares=GLARES), 5e-5, 0.0),
    "blurred by 0.4 ms": (Look(), 4e-4, 0.0),
    "500 rad/s": (Look(), 5e-5, 500.0),
}


def spun(motion: Callable[[float], Mapping[str, Pose]], spin_rad_per_s: float) -> Callable[[float], Mapping[str, Pose]]:
    """The motion with a spin added to the NES'."""
    def at(t: float) -> Mapping[str, Pose]:
        poses = motion(t)
        return {**poses, "nes": replace(poses["nes"], angle_rad=poses["nes"].angle_rad + spin_rad_per_s * t)}
    return at


def filmed(folder: Path, look: Look, exposure_s: float, spin: float, frames: int, seed: int) -> pd.DataFrame:
    """Render a recording into the folder; its truth."""
    rng = np.random.default_rng(seed)
    setup = replace(thesis_setup(rng), look=look, exposure_s=exposure_s)
    motion = spun(bouncing(frames / setup.frame_rate_hz), spin)
    truth = render_recording(folder, setup, motion, frames, rng, views=0, suffix=".png")
    text = (folder / "recording.toml").read_text(encoding="utf-8")
    head, tail = text.split("[calibration]", 1)
    (folder / "recording.toml").write_text(head + '[calibration]\nfile = "true_calibration.json"\n\n' + tail[tail.index("[bodies"):], encoding="utf-8")
    return truth


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--frames", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="cases whose name holds this")
    args = parser.parse_args()
    print(f"{'case':22s}  seen    swaps  px: median  rms    largest  inside   um: median  95 %")
    for name, (look, exposure_s, spin) in ((n, c) for n, c in CASES.items() if args.only in n):
        with tempfile.TemporaryDirectory() as folder:
            truth = filmed(Path(folder), look, exposure_s, spin, args.frames, args.seed)
            cameras = read_calibration(Path(folder) / "true_calibration.json")
            recording = read_recording(Path(folder))
            tracks = track(recording, cameras).tracks
            points = triangulate(tracks, cameras, recording.window_offset_px)
        print(f"{name:22s} {judged(truth, tracks, points)}", flush=True)


def judged(truth: pd.DataFrame, tracks: pd.DataFrame, points: pd.DataFrame) -> str:
    """The row of the table."""
    both = truth.merge(tracks, on=["camera", "frame", "marker"], suffixes=("_true", ""), how="left")
    off = both[["u_px", "v_px"]].to_numpy() - both[["u_px_true", "v_px_true"]].to_numpy()
    error, found = np.hypot(*off.T), both["u_px"].notna().to_numpy()
    swaps = 0
    for _, own in both[found].groupby(["camera", "frame"]):
        apart = np.hypot(*(own[[f"{k}_px"]].to_numpy() - own[f"{k}_px_true"].to_numpy() for k in "uv"))
        swaps += int((apart.argmin(1) != np.arange(len(own))).sum())
    inside = np.mean(np.abs(off[found]) < 1.645 * both.loc[found, ["sd_px"]].to_numpy())
    space = points.merge(truth.drop_duplicates(["frame", "marker"]), on=["frame", "marker"], suffixes=("", "_true"))
    um = 1e6 * np.linalg.norm(space[["x_m", "y_m", "z_m"]].to_numpy() - space[["x_m_true", "y_m_true", "z_m_true"]].to_numpy(), axis=1)
    seen = found[both["visible"].to_numpy()].mean()
    return (f"{seen:7.2%} {swaps:5d} {np.median(error[found]):9.4f} {np.sqrt(np.mean(error[found]**2)):9.4f} {error[found].max():8.3f} {inside:8.1%}"
            f" {np.median(um):8.1f} {np.percentile(um, 95):8.1f}")


if __name__ == "__main__":
    main()
