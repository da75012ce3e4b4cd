"""How often each check of a run is falsely doubtful: plants that follow our law (tests/plants), nothing spoiled.

    python benchmarks/identification/check_alarms.py RUNS [FIRST] [--noise KIND] [--rows FILE.csv]

RUNS rigs of any size, frame rate and noise anywhere on the bench, drawn from seeds FIRST (0), FIRST + 1, ..., one run
of each, identified by itself.  One row per check: runs in which it could be decided, in which it fails, and its least,
median and largest value.  Then the verdicts' words, and every alarm with what it says.  Checks of the markers (table
points) are not among them: the plant has none.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np
import pandas as pd

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from analysis.checks.recording import check_run, verdict
from analysis.identify import identify
from analysis.thesis.impacts import thesis_impacts
from ovines.recording import read_series
from ovines.tables import read_table
from tests.plants import Spec, make_series, write_series


def checks_of(seed: int, noise: str | None) -> pd.DataFrame:
    """Table ``checks`` of one run, and what rig it was."""
    made = make_series(Spec("ours", noise=noise), np.random.default_rng([17, seed]), 1)
    rig = made[0].truth["rig"]
    with tempfile.TemporaryDirectory() as folder:
        (recording,) = read_series(write_series(made, Path(folder) / "series"))
        motion = read_table(recording.folder / "motion.parquet", "motion")
    found = identify(motion, recording)
    peaks = thesis_impacts(motion, recording)
    checks = check_run(found.rig, 0, motion, recording, found.impacts, found.flights, peaks)
    return checks.assign(
        seed=seed,
        verdict=verdict(checks)[0],
        reach_mm=1e3 * rig.physics.reach_m,
        rate_hz=made[0].truth["rate_hz"],
        frames_per_flight=rig.frames_per_flight,
        noise=rig.noise,
    )


def summary(table: pd.DataFrame) -> pd.DataFrame:
    """One row per check."""
    grouped = table.groupby("check", sort=False)
    return pd.DataFrame(
        {
            "decided": grouped["state"].apply(lambda states: int((states != "open").sum())),
            "fails": grouped["state"].apply(lambda states: int((states == "fails").sum())),
            "least": grouped["value"].min(),
            "median": grouped["value"].median(),
            "largest": grouped["value"].max(),
        }
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", type=int)
    parser.add_argument("first", type=int, nargs="?", default=0)
    parser.add_argument("--noise", help="white, ar1 or lens; drawn without it")
    parser.add_argument("--rows", type=Path)
    arguments = parser.parse_args()
    tables: list[pd.DataFrame] = []
    for seed in range(arguments.first, arguments.first + arguments.runs):
        tables.append(checks_of(seed, arguments.noise))
        if arguments.rows is not None:
            pd.concat(tables).to_csv(arguments.rows, index=False)
    table = pd.concat(tables, ignore_index=True)
    with pd.option_context("display.width", 200, "display.max_colwidth", 120):
        print(summary(table).to_string(float_format=lambda x: f"{x:.3g}"), end="\n\n")
    print(table.groupby("seed")["verdict"].first().value_counts().to_string(), end="\n\n")
    for _, one in table[table["state"] == "fails"].iterrows():
        rig = f"{one['reach_mm']:.0f} mm, {one['rate_hz']:.0f} frames/s, {one['noise']}"
        print(f"seed {one['seed']} ({rig}): {one['check']}: {one['found']}")


if __name__ == "__main__":
    main()
