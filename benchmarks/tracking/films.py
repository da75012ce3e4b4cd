"""How much of a film is followed, and how truly: whole rendered recordings of many kinds, against their truth.

    python benchmarks/tracking/films.py [--frames 40] [--seed 1] [--only glare] [--drops]

The thesis' rig (``film_kinds.py`` says what is changed in each kind) in windows of 1400 x 688 pixels,
rendered poses and the true calibration.  ``seen``: of the markers that the picture shows wholly, those with a track.
``swaps``: tracks nearer to another marker's true place than to their own.  ``px``: median, RMS and largest error of the
centres; ``in``: share of the errors' coordinates within 1.645 sd (honest: 90 %).  ``um``: median and 95th percentile of
the triangulated points' error in space, and share of its coordinates within 1.645 sd.  ``NES``: frames with a pose, RMS
error of x and y [um] and of the angle [mrad], and their shares within 1.645 sd.
``walls``: error of the radii of Host and NES from their edges, and the sd that the notes give them [um].

``--drops``: instead, one film of 120 frames from which pictures are taken away as a camera drops them, with a jittered
trigger.csv that misses pulses, through the whole chain; how many pictures end under a wrong instant.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np
import pandas as pd
from film_kinds import KINDS, Kind, filmed

from analysis.motion.bodies import motion_from_points
from ovines.camera import read_calibration
from ovines.recording import Recording, read_recording
from vision.track import Tracks, track
from vision.triangulate import triangulate
from vision.walls.table import scatter_of

HEAD = (
    f"{'film':34s}    seen swaps | px: med   rms  largest   in | um: med    95%   in | NES: seen    um  mrad    in  "
    f"in | walls: Host      sd"
    "     NES    sd"
)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--frames", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="kinds whose name holds this")
    parser.add_argument("--drops", action="store_true")
    args = parser.parse_args()
    if args.drops:
        from film_drops import drops

        drops(args.seed)
        return
    print(HEAD)
    for name, kind in ((n, k) for n, k in KINDS.items() if args.only in n):
        with tempfile.TemporaryDirectory() as folder:
            print(f"{name:34s} {row(Path(folder), kind, args.frames, args.seed)}", flush=True)


def row(folder: Path, kind: Kind, frames: int, seed: int) -> str:
    """Render, follow and judge one film: a row of the table."""
    truth = filmed(folder, kind, frames, seed)
    recording, cameras = read_recording(folder), read_calibration(folder / "true_calibration.json")
    found = track(recording, cameras)
    points = triangulate(found.tracks, cameras, recording.window_offset_px)
    return " | ".join(
        [centres(truth, found.tracks), in_space(truth, points), pose(truth, points, recording), walls(found, recording)]
    )


def centres(truth: pd.DataFrame, tracks: pd.DataFrame) -> str:
    """Markers seen, swapped, and how far off."""
    both = truth.merge(tracks, on=["camera", "frame", "marker"], suffixes=("_true", ""), how="left")
    off = both[["u_px", "v_px"]].to_numpy() - both[["u_px_true", "v_px_true"]].to_numpy()
    error, found = np.hypot(*off.T), both["u_px"].notna().to_numpy()
    swaps = 0
    for _, own in both[found].groupby(["camera", "frame"]):
        apart = np.hypot(*(own[[f"{k}_px"]].to_numpy() - own[f"{k}_px_true"].to_numpy() for k in "uv"))
        swaps += int((apart.argmin(1) != np.arange(len(own))).sum())
    inside = np.mean(np.abs(off[found]) < 1.645 * both.loc[found, ["sd_px"]].to_numpy())
    seen = found[both["visible"].to_numpy()].mean()
    return (
        f"{seen:7.2%} {swaps:5d} | {np.median(error[found]):7.4f} {np.sqrt(np.mean(error[found] ** 2)):7.4f} "
        f"{error[found].max():6.3f} {inside:5.0%}"
    )


def in_space(truth: pd.DataFrame, points: pd.DataFrame) -> str:
    """Errors of the triangulated points."""
    space = points.merge(truth.drop_duplicates(["frame", "marker"]), on=["frame", "marker"], suffixes=("", "_true"))
    off = space[["x_m", "y_m", "z_m"]].to_numpy() - space[["x_m_true", "y_m_true", "z_m_true"]].to_numpy()
    inside = np.mean(np.abs(off) < 1.645 * space[["x_sd_m", "y_sd_m", "z_sd_m"]].to_numpy())
    um = 1e6 * np.linalg.norm(off, axis=1)
    return f"{np.median(um):7.1f} {np.percentile(um, 95):6.1f} {inside:5.0%}"


def pose(truth: pd.DataFrame, points: pd.DataFrame, recording: Recording) -> str:
    """Errors of the NES' pose."""
    motion = motion_from_points(points, recording)
    own = truth.drop_duplicates("frame").merge(motion, on="frame", how="left", suffixes=("_true", ""))
    seen = own["nes_x_m"].notna()
    off = {key: own[f"nes_{key}"] - own[f"nes_{key}_true"] for key in ("x_m", "y_m", "angle_rad")}
    off["angle_rad"] = np.angle(np.exp(1j * off["angle_rad"]))
    inside = {
        key: np.mean(
            np.abs(off[key])[seen]
            < 1.645
            * own[f"nes_{key[0] if key != 'angle_rad' else 'angle'}_sd_{'m' if key != 'angle_rad' else 'rad'}"][seen]
        )
        for key in off
    }
    place = 1e6 * np.sqrt(np.mean(np.r_[off["x_m"][seen], off["y_m"][seen]] ** 2))
    turn = 1e3 * np.sqrt(np.mean(off["angle_rad"][seen] ** 2))
    return (
        f"{seen.mean():9.1%} {place:6.2f} {turn:5.2f} {0.5 * (inside['x_m'] + inside['y_m']):5.0%} "
        f"{inside['angle_rad']:4.0%}"
    )


def walls(found: Tracks, recording: Recording) -> str:
    """Errors of the radii from the images, in um, and what the notes say of them."""
    lines = []
    for body, radius_m in (
        ("host", recording.bodies["host"].inner_radius_m),
        ("nes", recording.bodies["nes"].radius_m),
    ):
        own = found.walls[found.walls["body"] == body]
        lines.append(
            f"{'-':>7s} {'-':>6s}"
            if len(own) < 3
            else "{:7.2f} {:6.2f}".format(*(1e6 * np.array(scatter_of(own)) - [1e6 * radius_m, 0]))
        )
    return " ".join(lines)


if __name__ == "__main__":
    main()
