"""How few frames per flight, and how much noise, the identification bears: missed, false, restitution, as tables and a
figure.

    python benchmarks/identification/flight_frames.py SERIES [FIRST] [--frames N ...] [--noise PX ...] [--laws NAME ...]
    [--jobs N] [--rows FILE.csv] [--figure FILE.png]

SERIES series of three runs of a 50 mm ring (tests/plants, anywhere on the bench, white noise) per cell, the same
motions in every cell, so that cells differ by frames and noise alone.  Frames per flight: of the median flight between
two impacts; an impact counts above 0.15 m/s with six frames or more of flight on either side
(other_laws.py), the others are "nearer".  Noise in pixels of a marker, see PX_OVER_REACH.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
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
from tests.plants.scoring import impact_scores, parameter_scores

FRAMES = (6.0, 8.0, 12.0, 20.0, 35.0, 60.0, 100.0)
NOISE_PX = (0.01, 0.03, 0.1, 0.3, 0.5)
REACH_M, RUNS = 0.05, 3
# The disk's sd over the contact radius for one pixel of noise in each marker: the usual rig's 0.2 mm per pixel at 40
# mm, over the root of five markers in two views that share the error of a place.
PX_OVER_REACH = 2e-3
QUANTITIES = {
    "missed": "missed, % of those that count",
    "crowded_missed": "missed, % of those nearer",
    "false": "false, per 100 true",
    "eps_error": "restitution, mean error",
    "eps_z": "restitution, RMS error / sd",
}
# Written without a decimal in the figure: from two digits on, and what one decimal would round to 0.
TWO_DIGITS, ROUNDED = 10.0, 0.05
# What a quantity is multiplied with in the figure.
DRAWN_IN = {"eps_error": 1e4}
OUT_OF = {"missed": "impacts", "crowded_missed": "crowded", "false": "impacts"}


def cell(frames: float, noise_px: float, law: str, seed: int) -> dict[str, Any]:
    """One series of one cell."""
    # no scatter of its own: the restitution's error is then the measurement's
    spec = Spec(
        law, "white", REACH_M, frames, noise_px * PX_OVER_REACH, most_frames=3000, physics={"restitution_scatter": 0.0}
    )
    made = make_series(spec, np.random.default_rng([16, seed]), RUNS)
    row = {
        "frames": frames,
        "noise_px": noise_px,
        "law": law,
        "seed": seed,
        "rate_hz": made[0].truth["rate_hz"],
        "crashed": False,
    }
    with tempfile.TemporaryDirectory() as folder:
        series = read_series(write_series(made, Path(folder) / "series"))
        motions = [read_table(one.folder / "motion.parquet", "motion") for one in series]
        try:
            joint, identified = identify_series(motions, series)
        except Exception:
            print(frames, noise_px, law, seed, traceback.format_exc(), file=sys.stderr)
            return {**row, "crashed": True}
    scores = [impact_scores(one.impacts, run) for one, run in zip(identified, made, strict=True)]
    return (
        row
        | {name: sum(score[name] for score in scores) for name in scores[0] if name != "errors"}
        | parameter_scores(joint, made)
    )


def table(rows: pd.DataFrame, quantity: str) -> pd.DataFrame:
    """Noise down, frames across; NaN where nothing could be said."""

    def one(group: pd.DataFrame) -> float:
        if quantity in OUT_OF:
            return 100 * group[quantity].sum() / max(group[OUT_OF[quantity]].sum(), 1)
        known = group[quantity].replace([np.inf, -np.inf], np.nan).dropna().astype(float)
        if not len(known):
            return np.nan
        return float(known.mean() if quantity == "eps_error" else np.sqrt(np.mean(known**2)))

    values = {key: one(group) for key, group in rows.groupby(["noise_px", "frames"])}
    return pd.Series(values).unstack()


def draw(rows: pd.DataFrame, path: Path) -> None:
    """The maps as one figure, a panel per quantity."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(2, 3, figsize=(11.0, 6.4), constrained_layout=True)
    for axis, (quantity, title) in zip(axes.flat, QUANTITIES.items(), strict=False):
        found = table(rows, quantity) * DRAWN_IN.get(quantity, 1.0)
        shown = found.abs().to_numpy()
        largest = max(np.nanmax(shown, initial=0.0), 1e-12)
        axis.imshow(shown, cmap="Blues", origin="lower", aspect="auto", vmin=0.0, vmax=largest)
        for (i, k), value in np.ndenumerate(found.to_numpy()):
            # + 0.0: a rounded -0 is 0
            digits = 0 if abs(value) >= TWO_DIGITS or abs(value) < ROUNDED else 1
            text = f"{round(value, digits) + 0.0:.{digits}f}" if np.isfinite(value) else "-"
            dark = np.isfinite(shown[i, k]) and shown[i, k] > 0.6 * largest
            axis.text(k, i, text, ha="center", va="center", fontsize=9, color="white" if dark else "black")
        axis.set_xticks(range(found.shape[1]), [f"{frames:g}" for frames in found.columns])
        axis.set_yticks(range(found.shape[0]), [f"{noise:g}" for noise in found.index])
        unit = f" / {1 / DRAWN_IN[quantity]:g}" if quantity in DRAWN_IN else ""
        axis.set(title=title + unit, xlabel="frames per flight", ylabel="noise of a marker, px")
    axes.flat[-1].axis("off")
    figure.savefig(path, dpi=110)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("series", type=int)
    parser.add_argument("first", type=int, nargs="?", default=0)
    parser.add_argument("--frames", nargs="+", type=float, default=list(FRAMES))
    parser.add_argument("--noise", nargs="+", type=float, default=list(NOISE_PX))
    parser.add_argument("--laws", nargs="+", choices=list(LAWS), default=["ours"])
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--rows", type=Path)
    parser.add_argument("--figure", type=Path)
    arguments = parser.parse_args()
    wanted = [
        (frames, noise, law, seed)
        for seed in range(arguments.first, arguments.first + arguments.series)
        for law in arguments.laws
        for frames in arguments.frames
        for noise in arguments.noise
    ]
    rows: list[dict[str, Any]] = []
    with ProcessPoolExecutor(arguments.jobs) as pool:
        for future in [pool.submit(cell, *one) for one in wanted]:
            rows.append(future.result())
            if arguments.rows is not None:
                pd.DataFrame(rows).to_csv(arguments.rows, index=False)
    found = pd.DataFrame(rows)
    for quantity, title in QUANTITIES.items():
        if quantity in found:
            print(
                f"{title} (down: noise of a marker in px, across: frames per "
                f"flight)\n{table(found, quantity).to_string(float_format=lambda x: f'{x:.3g}')}\n"
            )
    print(f"{int(found['crashed'].sum())} of {len(found)} series ended in an error")
    if arguments.figure is not None:
        draw(found, arguments.figure)


if __name__ == "__main__":
    main()
