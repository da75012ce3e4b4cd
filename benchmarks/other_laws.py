"""Identification where the law of flight is not ours, on rigs of any size anywhere on the bench: tests/plants against
its truth.

    python benchmarks/other_laws.py SERIES [FIRST] [--laws NAME ...] [--runs N] [--noise KIND] [--at-origin] [--jobs N]
    [--rows FILE.csv]

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
from scipy.optimize import linear_sum_assignment

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from analysis.identify import identify_series
from ovines.recording import read_series
from ovines.tables import read_table
from tests.plants import LAWS, Run, Spec, make_series, write_series

FAST_M_PER_S = 0.15
FEWEST_FRAMES = 6  # of flight on either side of an impact that counts
SAME_FRAMES = 0.5
NAMES = {"restitution": "eps", "wall_friction": "mu_c", "tangential_restitution": "beta", "floor_friction": "mu_s"}
TRUE = {
    "restitution": "restitution",
    "wall_friction": "wall_friction",
    "tangential_restitution": "tangential_restitution",
    "floor_friction": "friction",
}


def impact_scores(found: pd.DataFrame, run: Run) -> dict[str, Any]:
    """Counts of one run, and the errors of the times in frames."""
    truth, frame_s = run.truth["impacts"], 1 / run.truth["rate_hz"]
    first, last = run.motion["time_s"].iloc[[0, -1]]
    true, times = truth["time_s"].to_numpy(), found["time_s"].to_numpy()
    edges = np.unique(np.concatenate([[first, last], true, run.truth["held"].ravel()]))
    before = true - edges[np.searchsorted(edges, true) - 1]
    after = edges[np.minimum(np.searchsorted(edges, true, side="right"), len(edges) - 1)] - true
    clear = np.minimum(before, after) >= FEWEST_FRAMES * frame_s
    fast = truth["normal_speed_before_m_per_s"].to_numpy() > FAST_M_PER_S
    apart = np.abs(times - true[:, None])
    own, partner = linear_sum_assignment(np.where(apart < SAME_FRAMES * frame_s, apart, 1e6))
    near = apart[own, partner] < SAME_FRAMES * frame_s
    own, partner = own[near], partner[near]
    seen = np.zeros(len(true), bool)
    seen[own] = True
    invented = np.ones(len(times), bool)
    invented[partner] = False
    invented &= found["normal_speed_before_m_per_s"].to_numpy() > FAST_M_PER_S
    crowd = np.array([_in_crowd(t, true[~clear], run.truth["held"], frame_s) for t in times], bool)
    counted = (fast & clear)[own]
    return {
        "impacts": int((fast & clear).sum()),
        "missed": int((fast & clear & ~seen).sum()),
        "crowded": int((fast & ~clear).sum()),
        "crowded_missed": int((fast & ~clear & ~seen).sum()),
        "false": int((invented & ~crowd).sum()),
        "false_crowd": int((invented & crowd).sum()),
        "errors": list((times[partner] - true[own])[counted] / frame_s),
    }


def _in_crowd(at_s: float, crowded_s: np.ndarray, held: np.ndarray, frame_s: float) -> bool:
    near = len(crowded_s) and np.abs(crowded_s - at_s).min() < FEWEST_FRAMES * frame_s
    return bool(
        near or any(start - FEWEST_FRAMES * frame_s < at_s < end + FEWEST_FRAMES * frame_s for start, end in held)
    )


def met_friction(runs: list[Run]) -> tuple[float, float]:
    """The range of the floor's friction where the disk went and as fast as it slid (two speeds or places that differ
    need no order).
    """
    rig = runs[0].truth["rig"]
    p, shares = rig.physics, [np.zeros(1)]
    for run in runs:
        s, rate = run.truth["states"], run.truth["rate_hz"]
        x, y = s["nes_x_m"] - s["host_x_m"], s["nes_y_m"] - s["host_y_m"]
        speed = np.hypot(np.gradient(x) * rate, np.gradient(y) * rate)
        c, n = np.cos(rig.place[2]), np.sin(rig.place[2])
        x, y = c * x + n * y, c * y - n * x
        share = np.zeros(len(s))
        if p.static_share:
            share = share + p.static_share * np.exp(-speed / p.static_m_per_s)
        if p.patch_share:
            share = share + p.patch_share * np.exp(
                -0.5 * ((x - p.patch_x_m) ** 2 + (y - p.patch_y_m) ** 2) / p.patch_width_m**2
            )
        shares.append(np.asarray(share + (p.gradient_x * x + p.gradient_y * y) / p.reach_m))
    met = np.concatenate(shares[1:])
    extra = max(p.memory_share, 0.0)
    return p.friction * (1 + met.min() - p.anisotropy - p.settling_share), p.friction * (
        1 + met.max() + p.anisotropy + extra
    )


def parameter_scores(joint: pd.DataFrame, runs: list[Run]) -> dict[str, Any]:
    """Errors, over their sds, and whether the intervals hold, by parameter."""
    rig, found, row = runs[0].truth["rig"], joint.set_index("parameter"), {}
    for name, short in NAMES.items():
        if name == "restitution" and not rig.law.restitution_known:
            continue
        true = rig.physics._asdict()[TRUE[name]]
        low_true, high_true = (
            met_friction(runs) if name == "floor_friction" and not rig.law.friction_known else (true, true)
        )
        if name not in found.index:
            row |= {f"{short}_none": True}
            continue
        value, sd, low, high = (float(found.loc[name, c]) for c in ("value", "sd", "low", "high"))
        error = value - float(np.clip(value, low_true, high_true))
        row |= {
            f"{short}_true": true,
            f"{short}_value": value,
            f"{short}_error": error,
            f"{short}_sd": sd,
            f"{short}_z": error / sd if sd > 0 else np.nan,
            f"{short}_held": np.nan
            if np.isnan(low) and np.isnan(high)
            else not low > high_true and not high < low_true,
            f"{short}_none": not np.isfinite(value),
        }
    return row


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
