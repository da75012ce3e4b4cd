"""One camera over the plane against two, on rendered films whose truth is known.

    python benchmarks/calibration/one_view.py [--seeds 4] [--frames 64]

Each seed is a rig of its own (cameras, lenses, calibration from nine rendered views of the board).  Host and NES move
smoothly, so that every frame's pose is the truth of its exposure.  Cases: as designed; every marker placed wrong by
0.1 mm (sd) in all three directions, which recording.toml says (`layout_sd_m`); the Host with NES lifted by 0.3 mm.
Printed per answer: rms of the error about its mean over the claimed sd, and of the mean error over the claimed sd of
what is the same in all frames.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from analysis.motion.bodies import motion_from_points
from ovines.recording import read_recording
from vision.calibrate import calibrate_recording
from vision.calibration.uncertainty import covariance_table, with_calibration_sd
from vision.one_view import one_view_heights, one_view_notes, vertical_motion
from vision.rendering.images import Look, Markers, Pose
from vision.rendering.recording import Files, half_setup, render_recording
from vision.track import track
from vision.triangulate import triangulate

PLACED_SD_M = 1e-4
LIFT_M = 3e-4
CASES = ("as designed", "markers misplaced", "lifted")


def motion(lift_m: float):
    """Host at 11 Hz along x, NES on a curve of its own and spinning; both lifted at twice that frequency."""

    def at(t: float) -> Mapping[str, Pose]:
        x = 0.02 + 0.012 * np.sin(2 * np.pi * 11 * t)
        z = lift_m * np.sin(2 * np.pi * 22 * t + 0.7)
        own = 0.015 * np.array([np.cos(40 * t), np.sin(33 * t + 1)])
        return {"host": Pose(x, -0.028, z), "nes": Pose(x + own[0], -0.028 + own[1], z, 60.0 * t)}

    return at


def one_camera(folder: Path, keep: str) -> None:
    """recording.toml with the other cameras left out."""
    text = (folder / "recording.toml").read_text()
    head, *rest = text.split("[[cameras]]")
    cameras, tail = [], ""
    for part in rest:
        camera, bracket, after = part.partition("[calibration]")
        cameras += ["[[cameras]]" + camera] if f'name = "{keep}"' in camera else []
        tail = bracket + after or tail
    (folder / "recording.toml").write_text(head + "".join(cameras) + tail)


def measured(recording, cameras, covariance) -> tuple[pd.DataFrame, pd.DataFrame, list[str]]:
    """Points and motion by the recording's own cameras."""
    own = [next(c for c in cameras if c.name == camera.name) for camera in recording.cameras]
    tracks = track(recording, own).tracks
    heights = one_view_heights(recording)
    points = triangulate(tracks, own, recording.window_offset_px, heights)
    levels = None if heights is None else {marker: one.place_m[2] for marker, one in heights.items()}
    notes = one_view_notes(recording, tracks, points, own)
    if heights is not None:
        seen = vertical_motion(points, own[0], heights)
        notes = notes[-1:] + ([f"z {1e3 * seen.z_m:.3f} mm"] if seen else [])
    points = with_calibration_sd(points, own, covariance, levels)
    return points, motion_from_points(points, recording), notes


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--frames", type=int, default=64)
    args = parser.parse_args()
    rows = []
    for seed in range(args.seeds):
        rng = np.random.default_rng(seed)
        setup = replace(half_setup(rng), look=Look(noise_grey=1.5), exposure_s=1e-4)
        found = None
        for case in CASES:
            with tempfile.TemporaryDirectory() as name:
                folder = Path(name)
                files = Files(views=9 if found is None else 3, board_suffix=".jpg")
                shown = setup
                if case == "markers misplaced":
                    moved = {
                        body: Markers(
                            one.names, one.layout_m + rng.normal(0, PLACED_SD_M, one.layout_m.shape), one.radius_m
                        )
                        for body, one in setup.rig.markers.items()
                    }
                    shown = replace(setup, rig=replace(setup.rig, markers=moved))
                truth = render_recording(
                    folder, shown, motion(LIFT_M if case == "lifted" else 0.0), args.frames, rng, files
                )
                text = (folder / "recording.toml").read_text()
                if case == "markers misplaced":  # recording.toml keeps the design
                    for body, one in setup.rig.markers.items():
                        wrong = np.round(shown.rig.markers[body].layout_m, 7).tolist()
                        text = text.replace(
                            f"layout_m = {wrong}", f"layout_m = {one.layout_m.tolist()}\nlayout_sd_m = {PLACED_SD_M}"
                        )
                    (folder / "recording.toml").write_text(text)
                if found is None:
                    result = calibrate_recording(read_recording(folder))
                    found = result.cameras, covariance_table(result.covariance, result.labels)
                true = truth.drop_duplicates("frame").reset_index(drop=True)
                for keep in ("both", *(camera.name for camera in setup.cameras)):
                    (folder / "recording.toml").write_text(
                        (folder / "recording.toml").read_text() if keep == "both" else text
                    )
                    if keep == "both":
                        text = (folder / "recording.toml").read_text()
                    else:
                        one_camera(folder, keep)
                    recording = read_recording(folder)
                    points, moved_m, notes = measured(recording, *found)
                    rows.append(
                        (seed, case, "both" if keep == "both" else "one", *compared(points, moved_m, true, recording))
                    )
                    for note in notes:
                        print(f"  seed {seed}, {case}, {keep}: {note}")
    table = pd.DataFrame(rows, columns=["seed", "case", "cameras", *FIGURES])
    print(
        table.groupby(["case", "cameras"])[list(FIGURES)]
        .agg(lambda v: float(np.sqrt(np.mean(v**2))))
        .round(3)
        .to_string()
    )


FIGURES = ("place um", "claimed um", "ratio", "angle ratio", "NES-Host um", "offset um", "offset claimed um")


def compared(points: pd.DataFrame, found: pd.DataFrame, true: pd.DataFrame, recording) -> tuple[float, ...]:
    """Figures of FIGURES, rms over Host and NES, x and y."""
    error = {
        (body, axis): found[f"{body}_{axis}_m"].to_numpy() - true[f"{body}_{axis}_m"].to_numpy()
        for body in ("host", "nes")
        for axis in "xy"
    }
    claimed = np.array([found[f"{body}_{axis}_sd_m"].to_numpy() for body, axis in error])
    off = np.array(list(error.values()))
    mean = off.mean(1)
    about = off - mean[:, None]
    turns = []
    for body in ("host", "nes"):
        off_rad = (found[f"{body}_angle_rad"] - true[f"{body}_angle_rad"] + np.pi) % (2 * np.pi) - np.pi
        turns.append((off_rad - off_rad.mean()) / found[f"{body}_angle_sd_rad"])
    angle = np.concatenate(turns)
    between = np.array([error["nes", axis] - error["host", axis] for axis in "xy"])
    between = between - between.mean(1, keepdims=True)
    same = [
        float(
            points.loc[points["marker"].isin(recording.bodies[body].markers), f"{axis}_calibration_sd_m"].pow(2).mean()
            ** 0.5
        )
        for body, axis in error
    ]
    return (
        1e6 * rms(about), 1e6 * rms(claimed), rms(about / claimed), rms(angle),
        1e6 * rms(between), 1e6 * rms(mean), 1e6 * rms(np.array(same)),
    )  # fmt: skip


def rms(values) -> float:
    return float(np.sqrt(np.mean(np.asarray(values, float) ** 2)))


if __name__ == "__main__":
    main()
