"""How surely is it found what has happened to a camera since its calibration, and how often where nothing has?

``python benchmarks/gap/picture_changes.py [--series 12] [--runs 4] [--seed 7]``

Series of the blind plant, white, correlated and lens noise in turn: without any cause, with a first camera that was
focused anew or whose lens was knocked off its axis, with a second whose picture is skewed, and with boards that were
longer one way or bowed, at three severities.  Stated: natural logarithm of the odds of the likeliest change (what is
reported needs 6 and the logarithm of how many were tried), and its size over the true one.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

import vision.lens.changes as looked_for
from analysis.blind.recording.files import write_series
from analysis.blind.recording.markers import BOARD_M
from analysis.blind.recording.picture import REFOCUS_PX
from analysis.blind.series import make_series
from ovines.camera import read_calibration
from ovines.camera.changes import number_tried
from ovines.recording import read_series
from ovines.tables import read_table
from vision.lens.estimate import learn_lens_field

NOISE = ("white", "ar1", "warp")
SEVERITIES = (0.2, 0.4, 0.8)
# Kind: its parameter in a truth, and what a law's number is to be multiplied with to be that.
KINDS = {
    "unknown_refocused_lens": ("refocused_px", REFOCUS_PX**3),
    "unknown_knocked_lens": ("knocked_px", REFOCUS_PX**2),
    "unknown_skewed_picture": ("skewed", 1.0),
    "unknown_stretched_board": ("board_stretch", 1.0),
    "unknown_bowed_board": ("board_bow", BOARD_M**2),
}


def likeliest(kind: str, size: float, seed: int, runs: int, noise: str) -> tuple[str, float, float, dict[str, Any]]:
    """Target, value and log odds of the likeliest change of one series, and the truth."""
    made = make_series(kind, size, np.random.default_rng(seed), runs, noise)
    with tempfile.TemporaryDirectory() as folder:
        write_series(made, Path(folder) / "series")
        recordings = read_series(Path(folder) / "series")
        tracks = [read_table(one.folder / "tracks.parquet", "tracks") for one in recordings]
        calibration = recordings[0].calibration_file
        assert calibration is not None
        found = learn_lens_field(tracks, recordings, read_calibration(calibration))
    if not found.changes:  # no field is used: nothing predicts the other halves
        return "none", 0.0, 0.0, made.truth
    one = found.changes[0]
    return one.target, one.value, one.log_odds, made.truth


def main() -> None:
    """Print a row for each kind, severity and noise."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--series", type=int, default=12)
    parser.add_argument("--runs", type=int, default=4)
    parser.add_argument("--seed", type=int, default=7)
    asked = parser.parse_args()
    needed = looked_for.SURE + np.log(number_tried(2))
    looked_for.SURE, looked_for.MOST_CHANGES = -np.inf, 1  # the likeliest, however likely
    print(f"reported from {needed:.1f} on")
    for number in range(asked.series):
        noise = NOISE[number % 3]
        target, _, odds, _ = likeliest("none", 1.0, asked.seed + number, asked.runs, noise)
        print(f"none {noise:6} {target:18} {odds:6.1f}", flush=True)
    for kind, (name, unit) in KINDS.items():
        for size in SEVERITIES:
            for number, noise in enumerate(NOISE):
                target, value, odds, truth = likeliest(kind, size, asked.seed + number, asked.runs, noise)
                true = truth["parameters"][kind][name]
                share = value * unit / true
                print(f"{kind} {true:.3g} {noise:6} {target:18} {odds:6.1f} size {share:.3f}", flush=True)


if __name__ == "__main__":
    main()
