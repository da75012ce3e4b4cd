"""How true the chain is on the recordings of `other_films`, from boards to motion.

    python -m tests.vision.rendering.judge_films [--only plain] [--frames 6] [--seed 1] [--keep FOLDER] [--run]

From boards to motion it goes by the chain's own functions (``--run``: by ``ovines run``, up to the report); what they
wrote is compared with the truth, which never leaves this process.  ``seen``: of the markers that lie wholly in both
pictures, those with a point.  ``swaps``: tracks nearer to another marker than to their own.  ``px``: median error of
the centres, share inside 1.645 sd.  ``um``: RMS of the points' error in space as they are / once one rigid motion (the
calibration's) is taken off, the share of the latter inside 1.645 sd.  ``NES``: RMS of x, y [um] and of the angle [mrad]
without their median (the calibration's), and the shares inside.
``walls``: error of R_H and R_N [um] and the sd that the notes tell.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pandas as pd

from tests.vision.rendering.other_films import KINDS, Kind, drawn

HEAD = (
    f"{'kind':30s}    seen swaps |  px: med   in | um:  raw  fitted   in | NES: seen   um  mrad   in   in | walls: "
    f"R_H    sd    R_N    sd |   s"
)


def run(folder: Path) -> tuple[int, str, float]:
    """``ovines run``: exit status, what it said, seconds."""
    before = time.time()
    done = subprocess.run(
        [sys.executable, "-m", "ovines", "run", str(folder), "--out", str(folder / "results")],
        capture_output=True,
        text=True,
        check=False,
    )
    return done.returncode, done.stdout + done.stderr, time.time() - before


def followed(folder: Path) -> tuple[int, str, float]:
    """The same without the command: boards, tracks, points, motion."""
    from analysis.motion.bodies import motion_from_points
    from ovines.errors import InputError
    from ovines.recording import read_recording
    from vision.calibrate import calibrate_recording
    from vision.track import track
    from vision.triangulate import triangulate

    before, recording = time.time(), read_recording(folder)
    try:
        cameras = calibrate_recording(recording)
        found = track(recording, cameras.cameras)
        points = triangulate(found.tracks, cameras.cameras, recording.window_offset_px)
        motion = motion_from_points(points, recording)
    except InputError as error:
        return 2, str(error), time.time() - before
    (folder / "results").mkdir(exist_ok=True)
    for name, table in {"tracks": found.tracks, "points": points, "motion": motion, "walls": found.walls}.items():
        table.to_parquet(folder / "results" / f"{name}.parquet")
    return 0, "\n".join(cameras.advice + found.notes), time.time() - before


def judged(folder: Path, truth: pd.DataFrame, kind: Kind) -> str:
    """A row of the table."""
    results = folder / "results"
    tracks, points, motion, walls = (
        pd.read_parquet(results / f"{name}.parquet") for name in ("tracks", "points", "motion", "walls")
    )
    return " | ".join([_centres(truth, tracks), _space(truth, points), _pose(truth, motion), _walls(walls, kind)])


def _centres(truth: pd.DataFrame, tracks: pd.DataFrame) -> str:
    both = truth.merge(tracks, on=["camera", "frame", "marker"], suffixes=("_true", ""), how="left")
    off = both[["u_px", "v_px"]].to_numpy() - both[["u_px_true", "v_px_true"]].to_numpy()
    found, swaps = both["u_px"].notna().to_numpy(), 0
    for _, own in both.groupby(["camera", "frame"]):
        here = own[own["u_px"].notna()]
        apart = np.hypot(*(here[[f"{k}_px"]].to_numpy() - own[f"{k}_px_true"].to_numpy() for k in "uv"))
        swaps += int((own["marker"].to_numpy()[apart.argmin(1)] != here["marker"].to_numpy()).sum())
    whole = both.groupby(["frame", "marker"])["share"].transform("min").to_numpy() > 0.99
    pair = both["u_px"].notna().groupby([both["frame"], both["marker"]]).transform("all").to_numpy()
    inside = np.mean(np.abs(off[found]) < 1.645 * both.loc[found, ["sd_px"]].to_numpy())
    return f"{pair[whole].mean():7.2%} {swaps:5d} | {np.median(np.hypot(*off[found].T)):7.4f} {inside:4.0%}"


def _space(truth: pd.DataFrame, points: pd.DataFrame) -> str:
    both = points.merge(truth.drop_duplicates(["frame", "marker"]), on=["frame", "marker"], suffixes=("", "_true"))
    a, b = both[["x_m", "y_m", "z_m"]].to_numpy(), both[["x_m_true", "y_m_true", "z_m_true"]].to_numpy()
    left, _, right = np.linalg.svd((a - a.mean(0)).T @ (b - b.mean(0)))
    turn = left @ np.diag([1, 1, np.linalg.det(left @ right)]) @ right
    fitted = (a - a.mean(0)) @ turn - (b - b.mean(0))
    inside = np.mean(np.abs(fitted) < 1.645 * both[["x_sd_m", "y_sd_m", "z_sd_m"]].to_numpy())
    raw, left_over = (1e6 * np.sqrt(np.mean(np.sum(each**2, -1))) for each in (a - b, fitted))
    return f"{raw:9.1f} {left_over:7.1f} {inside:4.0%}"


def _pose(truth: pd.DataFrame, motion: pd.DataFrame) -> str:
    own = truth.drop_duplicates("frame").merge(motion, on="frame", how="left", suffixes=("_true", ""))
    seen = own["nes_x_m"].notna().to_numpy()
    off, sd = {}, {}
    for key, name in (("x_m", "x_sd_m"), ("y_m", "y_sd_m"), ("angle_rad", "angle_sd_rad")):
        off[key] = (own[f"nes_{key}"] - own[f"nes_{key}_true"]).to_numpy(float)[seen]
        if key == "angle_rad":
            off[key] = np.angle(np.exp(1j * off[key]))
        off[key] = off[key] - np.median(off[key])
        sd[key] = own[f"nes_{name}"].to_numpy(float)[seen]
    inside = {key: np.mean(np.abs(off[key]) < 1.645 * sd[key]) for key in off}
    place = 1e6 * np.sqrt(np.mean(np.r_[off["x_m"], off["y_m"]] ** 2))
    return (
        f"{seen.mean():9.1%} {place:5.2f} {1e3 * np.sqrt(np.mean(off['angle_rad'] ** 2)):5.2f} "
        f"{0.5 * (inside['x_m'] + inside['y_m']):4.0%} "
        f"{inside['angle_rad']:4.0%}"
    )


def _walls(walls: pd.DataFrame, kind: Kind) -> str:
    from vision.walls.table import scatter_of

    words = []
    for body, radius in (("host", kind.bodies.inner), ("nes", kind.bodies.washer)):
        own = walls[walls["body"] == body]
        words.append(
            f"{'-':>6s} {'-':>5s}"
            if len(own) < 3
            else "{:6.1f} {:5.1f}".format(*(1e6 * np.array(scatter_of(own)) - [1e6 * radius, 0]))
        )
    return "       " + "  ".join(words)


def main() -> None:
    parser = argparse.ArgumentParser(description="Recordings by another renderer, through the whole chain")
    parser.add_argument("--only", default="", help="kinds whose name holds this")
    parser.add_argument("--frames", type=int, default=6)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", type=Path, help="where the recordings stay")
    parser.add_argument("--run", action="store_true", help="by `ovines run`")
    args = parser.parse_args()
    print(HEAD)
    for name, kind in ((n, k) for n, k in KINDS.items() if args.only in n):
        with tempfile.TemporaryDirectory() as scratch:
            folder = (args.keep or Path(scratch)) / re.sub(r"\W+", "-", name)
            truth = drawn(folder, kind, args.frames, args.seed)
            if args.keep:
                truth.to_parquet(folder / "hidden_truth.parquet")
            status, said, seconds = (run if args.run else followed)(folder)
            print(
                f"{name:30s} {judged(folder, truth, kind) if status == 0 else f'exit {status}: {said[-300:]}'} | "
                f"{seconds:4.0f}",
                flush=True,
            )
            (folder / "said.txt").write_text(said, encoding="utf-8")


if __name__ == "__main__":
    main()
