"""Identification where the measurement is bad: gaps, wrong points, correlated noise, a Host at rest, on series of the
independent plant.

    python benchmarks/identification/identify_hard.py SERIES [FIRST] [--kinds NAME ...] [--rows FILE.csv]

SERIES series of twelve runs of every kind of :data:`KINDS`, drawn from seeds FIRST (0), FIRST + 1, ...; no effect is
set on any; rigs, worlds and clocks are drawn (analysis/blind/recording/place.py).  One row per kind: impacts above 0.1
m/s, those missed and the false ones, times' rms error in frames; for each parameter the rms of its error (the floor
friction's relative), the mean of the restitution's with its standard error, and how many 90 % intervals held.
``--rows`` keeps every series' figures, written after each.
"""

from __future__ import annotations

import argparse
import re
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from analysis.blind.recording.files import write_series
from analysis.blind.recording.place import Place, draw_place, on_the_films_clock
from analysis.blind.series import outline_series, run_outline
from analysis.identify import Identified, identify_series
from benchmarks.identification.identify import all_scored, motions_of

NAMES = {
    "restitution": "eps",
    "restitution_scatter": "scatter",
    "wall_friction": "mu_c",
    "tangential_restitution": "beta",
    "floor_friction": "mu_s",
}


RUNS = 12


@dataclass(frozen=True)
class Kind:
    """What is wrong with a series: ``noise`` overrides fields of the plant's noise (``outliers``: share of the markers'
    points);
    ``gaps_per_run`` stretches of 2 to 8 frames in which no camera sees the NES; ``wrong_poses`` share of the frames
    whose NES pose is off by ``wrong_m`` (sd) and an angle to match; ``level_g`` of the drive, None as usual."""

    noise: dict[str, float]
    correlation: float = 0.0
    gaps_per_run: int = 0
    wrong_poses: float = 0.0
    wrong_m: float = 0.0
    level_g: float | None = None


KINDS = {
    "white": Kind({}),
    "gaps": Kind({}, gaps_per_run=10),
    "outliers, 2 % off by 1 px": Kind({"outliers": 0.02, "outlier_px": 1.0}),
    "outliers, 2 % off by 20 px": Kind({"outliers": 0.02, "outlier_px": 20.0}),
    "poses, 1 % off by 0.1 mm": Kind({}, wrong_poses=0.01, wrong_m=1e-4),
    "poses, 1 % off by 3 mm": Kind({}, wrong_poses=0.01, wrong_m=3e-3),
    "correlated by 0.5": Kind({}, correlation=0.5),
    "correlated by 0.8": Kind({}, correlation=0.8),
    "correlated by 0.95": Kind({}, correlation=0.95),
    "Host at rest": Kind({}, level_g=0.0),
    "gaps, outliers, correlated by 0.8": Kind({"outliers": 0.01, "outlier_px": 3.0}, correlation=0.8, gaps_per_run=6),
    "gaps, wrong poses, correlated by 0.6": Kind({}, correlation=0.6, gaps_per_run=6, wrong_poses=0.005, wrong_m=5e-4),
}


def rows_of(name: str, seed: int) -> dict[str, object]:
    """One series of a kind, made and identified."""
    kind = KINDS[name]
    rng = np.random.default_rng([99, list(KINDS).index(name), seed])
    place = draw_place(np.random.default_rng([98, list(KINDS).index(name), seed]), RUNS)
    outline = outline_series("none", 1.0, rng, RUNS, "ar1" if kind.correlation else "white", place=place)
    changed = {**kind.noise, **({"correlation": kind.correlation} if kind.correlation else {})}
    series = run_outline(replace(outline, noise=replace(outline.noise, **changed)), rng, kind.level_g)
    recordings = [
        (
            text if kind.level_g != 0.0 else re.sub(r"\[excitation\][^\[]*", "", text),
            with_gaps(tracks, kind.gaps_per_run, rng),
        )
        for text, tracks in series.recordings
    ]
    with tempfile.TemporaryDirectory() as folder:
        write_series(replace(series, recordings=recordings), Path(folder) / "series")
        read, motions = motions_of(Path(folder) / "series")
    motions = [with_wrong_poses(motion, kind.wrong_poses, kind.wrong_m, place, rng) for motion in motions]
    joint, runs = identify_series(motions, read)
    return {
        "kind": name,
        "seed": seed,
        **_impacts(runs, motions, on_the_films_clock(series.states, place)),
        **_parameters(joint, series.truth["plant"]),
    }


def with_gaps(tracks: pd.DataFrame, per_run: int, rng: np.random.Generator) -> pd.DataFrame:
    """``tracks`` without the NES' markers for ``per_run`` stretches of 2 to 8 frames."""
    last, hidden = int(tracks["frame"].max()), np.zeros(len(tracks), bool)
    for _ in range(per_run):
        start, length = int(rng.integers(5, max(last - 10, 6))), int(rng.integers(2, 9))
        hidden |= (
            tracks["frame"].between(start, start + length - 1).to_numpy()
            & tracks["marker"].str.startswith("N").to_numpy()
        )
    return tracks[~hidden].reset_index(drop=True)


def with_wrong_poses(
    motion: pd.DataFrame, share: float, off_m: float, place: Place, rng: np.random.Generator
) -> pd.DataFrame:
    """``motion`` with the NES somewhere else in a share of the frames, its standard deviations as if it were right."""
    if share == 0.0:
        return motion
    motion, wrong = motion.copy(), rng.random(len(motion)) < share
    for column, size in (
        ("nes_x_m", off_m * place.scale),
        ("nes_y_m", off_m * place.scale),
        ("nes_angle_rad", off_m / 0.01),
    ):
        motion.loc[wrong, column] += rng.normal(0.0, size, int(wrong.sum()))
    return motion


def _impacts(runs: list[Identified], motions: list[pd.DataFrame], states: dict[str, np.ndarray]) -> dict[str, object]:
    fast, missed, false, errors = all_scored(runs, motions, states)
    return {
        "impacts": fast,
        "missed": missed,
        "false": false,
        "time_ss": float(np.sum(np.square(errors))),
        "timed": len(errors),
    }


def _parameters(joint: pd.DataFrame, plant: dict[str, float]) -> dict[str, object]:
    found, row = joint.set_index("parameter"), {}
    for name, short in NAMES.items():
        if name in found.index:
            value, sd, low, high = (float(found.loc[name, c]) for c in ("value", "sd", "low", "high"))
            row |= {
                f"{short}_error": (value - plant[name]) / (plant[name] if name == "floor_friction" else 1.0),
                f"{short}_z": (value - plant[name]) / sd,
                f"{short}_held": not low > plant[name] and not high < plant[name],
            }
    return row


def summary(rows: pd.DataFrame) -> pd.DataFrame:
    """One row per kind."""
    table = {}
    for kind, group in rows.groupby("kind", sort=False):
        one = {
            "series": len(group),
            **{name: int(group[name].sum()) for name in ("impacts", "missed", "false")},
            "time_frames": np.sqrt(group["time_ss"].sum() / group["timed"].sum()),
            "eps_bias": group["eps_error"].mean(),
            "+-": group["eps_error"].std() / np.sqrt(len(group)),
            "mu_s_worst_%": 100 * group["mu_s_error"].abs().max(),
        }
        for short in NAMES.values():
            one[f"{short}_held"] = (
                f"{int(group[f'{short}_held'].sum())} of {int(group[f'{short}_error'].notna().sum())}"
            )
            one[f"{short}_z"] = rms(group[f"{short}_z"])
        table[kind] = one
    return pd.DataFrame(table).T


def rms(values: pd.Series) -> float:
    return float(np.sqrt(np.nanmean(np.square(values.astype(float)))))


def main(progress: Callable[[str], None] = print) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("series", type=int)
    parser.add_argument("first", type=int, nargs="?", default=0)
    parser.add_argument("--kinds", nargs="+", choices=list(KINDS), default=list(KINDS))
    parser.add_argument("--rows", type=Path)
    arguments = parser.parse_args()
    rows: list[dict[str, object]] = []
    for seed in range(arguments.first, arguments.first + arguments.series):
        for name in arguments.kinds:
            rows.append(rows_of(name, seed))
            if arguments.rows is not None:
                pd.DataFrame(rows).to_csv(arguments.rows, index=False)
    table = summary(pd.DataFrame(rows))
    with pd.option_context("display.width", 250, "display.max_columns", 40):
        progress(table.to_string(float_format=lambda x: f"{x:.4g}"))


if __name__ == "__main__":
    main()
