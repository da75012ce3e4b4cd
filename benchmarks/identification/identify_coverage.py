"""How often the 90 % intervals of the identification hold the truth, on series of the independent plant without any
effect.

    python benchmarks/identification/identify_coverage.py SERIES [FIRST] [--rows FILE.csv]

SERIES series of twelve runs, rigs, worlds and clocks drawn (analysis/blind/recording/place.py), their noise white,
correlated and with a lens residual in turn, drawn from seeds FIRST (0), FIRST + 1, ... One row per parameter, then one
per parameter and kind of noise: intervals that held, rms of error over sd, mean and rms of the error, median sd; for
the restitution the rms of the error over that of the least possible one (identify.py).  ``--rows`` keeps
every series' figures, written after each series.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np
import pandas as pd

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from analysis.blind.recording.files import write_series
from analysis.blind.recording.markers import Marks
from analysis.blind.recording.place import Place, draw_place
from analysis.blind.recording.views import HOST_M
from analysis.blind.series import NOISE_KINDS, outline_series, run_outline
from analysis.identify import identify_series
from analysis.motion.pose import MarkerCloud, fit_pose
from benchmarks.identification.identify import motions_of, restitution_bound

SAME_NAME = ("restitution", "restitution_scatter", "wall_friction", "tangential_restitution", "floor_friction")
# True in every series of the plant: its wall is round and the disk's mass in its middle.
ALWAYS = dict.fromkeys(
    (
        "restitution_speed_slope_s_per_m",
        "wall_ellipticity_cos",
        "wall_ellipticity_sin",
        "disk_centre_x_m",
        "disk_centre_y_m",
    ),
    0.0,
)
RUNS = 12


def rows_of(seed: int, noise: str) -> list[dict[str, object]]:
    """One series, made and identified: each parameter's error, sd, and whether its interval held the truth."""
    rng = np.random.default_rng([77, seed])
    place = draw_place(np.random.default_rng([76, seed]), RUNS)
    outline = outline_series("none", 1.0, rng, RUNS, noise, place=place)
    series = run_outline(outline, rng)
    with tempfile.TemporaryDirectory() as folder:
        write_series(series, Path(folder) / "series")
        recordings, motions = motions_of(Path(folder) / "series")
    joint, runs = identify_series(motions, recordings)
    found = joint.set_index("parameter")
    truth = {
        **ALWAYS,
        "contact_radius_m": 0.04 * place.scale,
        "drive_frequency_hz": place.in_units("_hz", place.drive_hz),
        **{name: series.truth["plant"][name] for name in SAME_NAME},
        **dict(zip(("wall_centre_x_m", "wall_centre_y_m"), wall_centre(outline.marks, place), strict=True)),
    }
    rows = []
    for name in truth.keys() & set(found.index):
        value, sd, low, high = (float(found.loc[name, c]) for c in ("value", "sd", "low", "high"))
        rows.append(
            {
                "parameter": name,
                "noise": noise,
                "seed": seed,
                "scale": place.scale,
                "frame_rate_hz": place.in_units("_hz", place.frame_rate_hz),
                "error": value - truth[name],
                "sd": sd,
                "bound": restitution_bound(runs[0].rig.data, truth["restitution_scatter"])
                if name == "restitution"
                else np.nan,
                "held": not low > truth[name] and not high < truth[name],
            }
        )
    return rows


def wall_centre(marks: Marks, place: Place) -> tuple[float, float]:
    """Where the plant's wall has its centre in the frame of the layout, which was fitted to markers glued a little
    off.
    """
    one = MarkerCloud(np.zeros(1, np.int64), np.zeros(1), marks.host_m[None], np.full((1, *HOST_M.shape), 3e-5))
    pose = fit_pose(one, HOST_M.round(6), 0.0)
    seen = -complex(*pose.xy_m[0]) * np.exp(-1j * pose.angle_rad[0])
    return seen.real * place.scale, seen.imag * place.scale


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("series", type=int)
    parser.add_argument("first", type=int, nargs="?", default=0)
    parser.add_argument("--rows", type=Path)
    arguments = parser.parse_args()
    rows: list[dict[str, object]] = []
    for seed in range(arguments.first, arguments.first + arguments.series):
        rows += rows_of(seed, NOISE_KINDS[seed % len(NOISE_KINDS)])
        if arguments.rows is not None:
            pd.DataFrame(rows).to_csv(arguments.rows, index=False)
    table = pd.DataFrame(rows)
    for by in (["parameter"], ["parameter", "noise"]):
        print(summary(table, by).to_string(), end="\n\n")


def summary(table: pd.DataFrame, by: list[str]) -> pd.DataFrame:
    """Intervals that held, and errors against their sds (over the series that gave a value), per group."""
    grouped = table.assign(z=table["error"] / table["sd"]).groupby(by)
    return pd.DataFrame(
        {
            "series": grouped.size(),
            "held": grouped["held"].mean(),
            "error_over_sd_rms": grouped["z"].apply(rms),
            "error_mean": grouped["error"].mean(),
            "error_rms": grouped["error"].apply(rms),
            "sd_median": grouped["sd"].median(),
            "error_over_bound_rms": grouped["error"].apply(rms) / grouped["bound"].apply(rms),
        }
    )


def rms(values: pd.Series) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


if __name__ == "__main__":
    main()
