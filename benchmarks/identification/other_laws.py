"""Identification where the law of flight is not ours, on rigs of any size anywhere on the bench: tests/plants against
its truth.

    python benchmarks/identification/other_laws.py SERIES [FIRST] [--laws NAME ...] [--runs N] [--noise KIND]
    [--at-origin] [--jobs N] [--rows FILE.csv]

SERIES series of every law (tests/plants/laws.py), drawn from seeds FIRST (0), FIRST + 1, ...  One row per law.

An impact counts above 0.15 m/s with six frames or more of flight on either side; the others are ``crowded``.
``missed``: no found impact within half a frame; ``false``: a found one above 0.15 m/s with no true one (of any speed)
within half a frame, ``false_crowd`` where the nearest true ones are crowded or the wall holds the disk.  ``time``: RMS
error in frames.  ``eps_z``, ``mu_c_z``, ``beta_z``, ``mu_s_z``: RMS of error over sd (infinite sds and missing values
left out, ``_none`` counts them), ``_held``: share of the 90 % intervals that hold the truth.  Where the floor's
friction has no single value its error is counted from the range that the disk met.  ``crashed``: series that ended in
an error.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
import traceback
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from analysis.identify import identify_series
from ovines.recording import read_series
from ovines.tables import read_table
from tests.plants import LAWS, Spec, make_series, write_series
from tests.plants.scoring import NAMES, impact_scores, parameter_scores


def row_of(law: str, seed: int, runs: int, noise: str | None, at_origin: bool) -> dict[str, Any]:
    """One series, made, written, read back and identified."""
    rng = np.random.default_rng([2026, sorted(LAWS).index(law), seed])
    made = make_series(Spec(law, noise=noise, at_origin=at_origin), rng, runs)
    rig = made[0].truth["rig"]
    row = {
        "law": law,
        "seed": seed,
        "reach_mm": 1e3 * rig.physics.reach_m,
        "drive_hz": rig.drive_hz,
        "rate_hz": made[0].truth["rate_hz"],
        "frames_per_flight": rig.frames_per_flight,
        "noise": rig.noise,
        "sd_um": 1e6 * rig.sd_m,
        "crashed": False,
    }
    with tempfile.TemporaryDirectory() as folder:
        series = read_series(write_series(made, Path(folder) / "series"))
        motions = [read_table(one.folder / "motion.parquet", "motion") for one in series]
        begin = time.process_time()
        try:
            joint, identified = identify_series(motions, series)
        except Exception:
            print(f"{law} {seed}:", traceback.format_exc(), file=sys.stderr)
            return {**row, "crashed": True}
    row["cpu_s"] = time.process_time() - begin
    scores = [impact_scores(one.impacts, run) for one, run in zip(identified, made, strict=True)]
    row |= {name: sum(score[name] for score in scores) for name in scores[0] if name != "errors"}
    errors = np.array([error for score in scores for error in score["errors"]])
    return row | {"time_ss": float(np.sum(errors**2)), "timed": len(errors)} | parameter_scores(joint, made)


def summary(rows: pd.DataFrame) -> pd.DataFrame:
    """One row per law."""
    table = {}
    for law, group in rows.groupby("law", sort=False):
        counts = ("impacts", "missed", "crowded", "crowded_missed", "false", "false_crowd", "crashed")
        one = {
            "series": len(group),
            **{name: int(group[name].fillna(0).sum()) if name in group else 0 for name in counts},
        }
        one["time"] = np.sqrt(group["time_ss"].sum() / max(group["timed"].sum(), 1)) if "timed" in group else np.nan
        for short in NAMES.values():
            if f"{short}_z" in group:
                known = group[f"{short}_z"].replace([np.inf, -np.inf], np.nan).dropna().astype(float)
                one |= {
                    f"{short}_z": np.sqrt(np.mean(known**2)) if len(known) else np.nan,
                    f"{short}_held": group[f"{short}_held"].dropna().mean(),
                    f"{short}_none": int(group[f"{short}_none"].dropna().sum()),
                }
        one["cpu_s"] = group["cpu_s"].mean() if "cpu_s" in group else np.nan
        table[law] = one
    return pd.DataFrame(table).T


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("series", type=int)
    parser.add_argument("first", type=int, nargs="?", default=0)
    parser.add_argument("--laws", nargs="+", choices=list(LAWS), default=list(LAWS))
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--noise", help="white, ar1 or lens; drawn without it")
    parser.add_argument("--at-origin", action="store_true", help="leave world, clock and frame numbers alone")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--rows", type=Path)
    arguments = parser.parse_args()
    wanted = [
        (law, seed) for seed in range(arguments.first, arguments.first + arguments.series) for law in arguments.laws
    ]
    rows: list[dict[str, Any]] = []

    def keep(row: dict[str, Any]) -> None:
        rows.append(row)
        if arguments.rows is not None:
            pd.DataFrame(rows).to_csv(arguments.rows, index=False)

    if arguments.jobs == 1:
        for law, seed in wanted:
            keep(row_of(law, seed, arguments.runs, arguments.noise, arguments.at_origin))
    else:
        with ProcessPoolExecutor(arguments.jobs) as pool:
            for future in [
                pool.submit(row_of, law, seed, arguments.runs, arguments.noise, arguments.at_origin)
                for law, seed in wanted
            ]:
                keep(future.result())
    with pd.option_context("display.width", 300, "display.max_columns", 60):
        print(summary(pd.DataFrame(rows)).to_string(float_format=lambda x: f"{x:.3g}"))


if __name__ == "__main__":
    main()
