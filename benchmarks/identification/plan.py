"""`ovines plan` against days that it did not make: predicted sds beside what the identification of the day then states.

    python benchmarks/identification/plan.py DAYS [FIRST] [--usual] [--runs N] [--simulated N] [--rows FILE.csv]

DAYS rigs, each with a test day of three runs, are drawn by tests/plants, which shares no code with the simulator, from
seeds FIRST (0), FIRST + 1, ...  The plan gets what an experimenter has before the day: the rig's sizes, drive, frame
rate, runs, their length, the noise of the poses and an earlier day's four parameters and scatter (here the true ones);
both end a film when the wall has held the disk for 0.4 periods, and start a run anew that lasts less than three
periods or has fewer than ten impacts;
with ``--usual`` it gets no parameters and takes the usual ones.  Per parameter: days on which both are determined,
share of them with a predicted sd within a factor 1.5 of the day's, the median and 10 and 90 % of predicted over day's,
days on which only one of the two is determined; in the last row the four main parameters together.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from analysis.identify import identify_series
from analysis.plan.day import Settings
from analysis.plan.noise import PoseNoise
from analysis.plan.predict import MAIN, changes, predict, sds_of
from ovines.recording import Recording, read_series
from ovines.tables import read_table
from tests.plants import Spec, make_series, write_series

FACTOR = 1.5
ANGLE_SHARE = 0.7  # tests/plants: a marker 0.7 radii out gives the angle


def day_of(seed: int, runs: int, usual: bool, simulated: int) -> list[dict[str, object]]:
    """One day planned and then made: a row per parameter."""
    made = make_series(Spec("ours", noise="white"), np.random.default_rng([2308, seed]), runs)
    rig = made[0].truth["rig"]
    with tempfile.TemporaryDirectory() as folder:
        series = read_series(write_series(made, Path(folder) / "series"))
        motions = [read_table(one.folder / "motion.parquet", "motion") for one in series]
        began = time.process_time()
        plan = planned(series, rig, usual, simulated, seed)
        planned_s = time.process_time() - began
        day = identify_series(motions, series)[0].set_index("parameter")
    rows = []
    for name in dict.fromkeys([*plan.index, *day.index]):
        predicted = float(plan["sd"].get(name, np.nan))
        rows.append({"seed": seed, "parameter": name, "predicted": predicted, "day": float(sds_of([day], name)[0]),
                     "planned_s": planned_s})  # fmt: skip
    return rows


def planned(series: list[Recording], rig: Any, usual: bool, simulated: int, seed: int) -> pd.DataFrame:
    """Table ``plan`` of the day as stated."""
    recording, physics, sd = series[0], rig.physics, rig.sd_m
    if not usual:
        names = {**dict.fromkeys(MAIN[:3]), "floor_friction": "friction"}
        known = {name: getattr(physics, other or name) for name, other in names.items()}
        file = recording.settings
        model = file.model.model_copy(update=known)
        recording = Recording(recording.folder, file.model_copy(update={"model": model}))
    noise = PoseNoise(
        (sd, sd),
        sd / (ANGLE_SHARE * physics.radius_m),
        (sd, sd),
        sd / (ANGLE_SHARE * (physics.reach_m + physics.radius_m)),
    )
    rate, scatter = recording.frame_rate_hz, physics.restitution_scatter
    length_s = min(rig.spec.periods / rig.drive_hz, rig.spec.most_frames / rate)  # asked for; a film may end earlier
    settings = Settings(rig.level_g, rig.drive_hz, rate, len(series), length_s, noise, 0.01 if usual else scatter)
    asked = changes(settings)[:1]
    return predict(recording, asked, simulated, seed).set_index("parameter")


def summary(rows: pd.DataFrame) -> pd.DataFrame:
    """A row per parameter, and one of the four main ones together."""
    rows = rows.assign(ratio=rows["predicted"] / rows["day"])
    groups = [*rows.groupby("parameter"), ("the four together", rows[rows["parameter"].isin(MAIN)])]
    found = {}
    for name, group in groups:
        both = group["ratio"].dropna()
        within = (both < FACTOR) & (both > 1 / FACTOR)
        found[name] = {
            "days": len(both),
            "within": within.mean() if len(both) else np.nan,
            "median": both.median(),
            "low": both.quantile(0.1),
            "high": both.quantile(0.9),
            "one_only": int((group["predicted"].isna() != group["day"].isna()).sum()),
        }
    return pd.DataFrame(found).T


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("days", type=int)
    parser.add_argument("first", type=int, nargs="?", default=0)
    parser.add_argument("--usual", action="store_true")
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--simulated", type=int, default=3)
    parser.add_argument("--rows", type=Path)
    arguments = parser.parse_args()
    rows: list[dict[str, object]] = []
    for seed in range(arguments.first, arguments.first + arguments.days):
        rows += day_of(seed, arguments.runs, arguments.usual, arguments.simulated)
        if arguments.rows is not None:
            pd.DataFrame(rows).to_csv(arguments.rows, index=False)
        print(f"day {seed}", file=sys.stderr, flush=True)
    print(summary(pd.DataFrame(rows)).to_string(float_format=lambda x: f"{x:.2f}"))


if __name__ == "__main__":
    main()
