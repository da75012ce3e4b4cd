"""How often the 90 % intervals of the identification hold the truth, on series of the independent plant without any effect.

    python benchmarks/identify_coverage.py SERIES [FIRST]

SERIES series of twelve runs, their noise white, correlated and with a lens residual in turn, drawn from seeds FIRST (0), FIRST + 1, ...
One row per parameter and kind of noise: intervals that held, rms of error over sd, rms of the error, median sd.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np
import pandas as pd

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from analysis.blind.plant import NOISE_KINDS, make_series, write_series
from analysis.identify import identify_series
from benchmarks.identify import motions_of

SAME_NAME = ("restitution", "restitution_scatter", "wall_friction", "tangential_restitution", "floor_friction")
# True in every series of the plant: its wall is round, 40 mm from the disk's centre, and the drive runs at 11 Hz.
ALWAYS = {"restitution_speed_slope_s_per_m": 0.0, "contact_radius_m": 0.04, "wall_ellipticity_cos": 0.0, "wall_ellipticity_sin": 0.0,
          "drive_frequency_hz": 11.0}


def rows_of(seed: int, noise: str) -> list[dict[str, object]]:
    """One series, made and identified: each parameter's error, sd, and whether its interval held the truth."""
    series = make_series("none", 1.0, np.random.default_rng([77, seed]), noise=noise)
    with tempfile.TemporaryDirectory() as folder:
        write_series(series, Path(folder) / "series")
        recordings, motions = motions_of(Path(folder) / "series")
    found = identify_series(motions, recordings)[0].set_index("parameter")
    truth = {**ALWAYS, **{name: series.truth["plant"][name] for name in SAME_NAME}}
    rows = []
    for name in truth.keys() & set(found.index):
        value, sd, low, high = (float(found.loc[name, c]) for c in ("value", "sd", "low", "high"))
        rows.append({"parameter": name, "noise": noise, "error": value - truth[name], "sd": sd,
                     "held": not low > truth[name] and not high < truth[name]})
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("series", type=int)
    parser.add_argument("first", type=int, nargs="?", default=0)
    arguments = parser.parse_args()
    table = pd.DataFrame([row for seed in range(arguments.first, arguments.first + arguments.series)
                          for row in rows_of(seed, NOISE_KINDS[seed % len(NOISE_KINDS)])])
    table["z"] = table["error"] / table["sd"]
    grouped = table.groupby(["parameter", "noise"])
    print(pd.DataFrame({"series": grouped.size(), "held": grouped["held"].mean(), "error_over_sd_rms": grouped["z"].apply(rms),
                        "error_rms": grouped["error"].apply(rms), "sd_median": grouped["sd"].median()}).to_string())


def rms(values: pd.Series) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


if __name__ == "__main__":
    main()
