"""Identification of the practice series against their truth: recall, precision, times, parameters, seconds.

    python benchmarks/identification/identify.py SHARED [NUMBER ...]

SHARED holds ``practice/`` and ``practice_truth/``; without numbers all series are run.  One row per series.  ``s`` are
seconds of identification, ``cpu_s`` of the process; ``restitution_sd_over_bound`` the sd given over the least that any
estimate from these impacts can have (Cramer and Rao: the true scatter and the speeds' covariance known).
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.optimize import linear_sum_assignment

from analysis.contact.law import LawData
from analysis.identify import Identified, identify_series
from analysis.motion.bodies import bodies_clouds, layouts_from_points, motion_from_points
from ovines.camera import read_calibration
from ovines.recording import Recording, read_series
from ovines.tables import read_table
from vision.triangulate import triangulate

# Half a frame: a found impact farther from a true one is another.
SAME_FRAMES = 0.5
FAST_M_PER_S = 0.1
TRUE_NAMES = {
    "restitution": "eps",
    "wall_friction": "mu_c",
    "tangential_restitution": "beta0",
    "floor_friction": "mu_s",
}


def motions_of(folder: Path) -> tuple[list[Recording], list[pd.DataFrame]]:
    """Recordings of a practice series and their motion, the markers' layout learnt from all of them."""
    recordings = read_series(folder)
    cameras = read_calibration(recordings[0].calibration_file)
    points = [
        triangulate(read_table(r.folder / "tracks.parquet", "tracks"), cameras, r.window_offset_px) for r in recordings
    ]
    clouds = [bodies_clouds(p, r) for p, r in zip(points, recordings, strict=True)]
    layouts = layouts_from_points({body: [cloud[body] for cloud in clouds] for body in ("host", "nes")}, recordings[0])
    return recordings, [motion_from_points(p, r, layouts) for p, r in zip(points, recordings, strict=True)]


def scored(
    found: pd.DataFrame, true: np.ndarray, first_s: float, last_s: float, same_s: float
) -> tuple[int, int, int, list[float]]:
    """True fast impacts, missed ones, false fast ones, time errors (s)."""
    times, true = found["time_s"].to_numpy(), true.reshape(-1, 3)
    apart = np.abs(times - true[:, :1])
    # Most pairs, then the nearest: taken one by one, a displaced hop would take the next one's partner.
    own, partner = linear_sum_assignment(np.where(apart < same_s, apart, 1e6))
    paired = apart[own, partner] < same_s
    own, partner = own[paired], partner[paired]
    counted = (true[:, 1] > FAST_M_PER_S) & (first_s < true[:, 0]) & (true[:, 0] < last_s)
    fast, seen = int(counted.sum()), counted[own]
    left = np.ones(len(times), bool)
    left[partner] = False
    false = int(np.sum(left & (found["normal_speed_before_m_per_s"].to_numpy() > FAST_M_PER_S)))
    return fast, fast - int(seen.sum()), false, list((times[partner] - true[own, 0])[seen])


def row_of(shared: Path, name: str) -> dict[str, object]:
    """One series: what was found against what was true."""
    recordings, motions = motions_of(shared / "practice" / name)
    begin, begin_cpu = time.perf_counter(), time.process_time()
    joint, runs = identify_series(motions, recordings)
    seconds, cpu = time.perf_counter() - begin, time.process_time() - begin_cpu
    truth = json.loads((shared / "practice_truth" / f"{name}.json").read_text())
    return {
        "series": name,
        "effect": truth["effect"],
        "noise": truth["noise"],
        "s": round(seconds, 1),
        "cpu_s": round(cpu, 1),
        **_impacts(runs, motions, np.load(shared / "practice_truth" / f"{name}.npz")),
        **_parameters(joint, truth["plant"]),
        "restitution_sd_over_bound": round(
            float(joint.set_index("parameter").loc["restitution", "sd"])
            / restitution_bound(runs[0].rig.data, truth["plant"]["eps_sd"]),
            3,
        ),
    }


def restitution_bound(data: LawData, scatter: float) -> float:
    """Least sd of a restitution from these impacts, their scatter and the speeds' sds known (Cramer-Rao bound)."""
    return float(np.sum(data.before**2 / (data.normal_sd**2 + (scatter * data.before) ** 2)) ** -0.5)


def _impacts(runs: list[Identified], motions: list[pd.DataFrame], truth: dict[str, np.ndarray]) -> dict[str, object]:
    fast, missed, false, errors = all_scored(runs, motions, truth)
    return {
        "impacts": fast,
        "missed": missed,
        "false": false,
        "time_rms_frames": round(float(np.sqrt(np.mean(np.square(errors)))), 4),
    }


def all_scored(
    runs: list[Identified], motions: list[pd.DataFrame], truth: dict[str, np.ndarray]
) -> tuple[int, int, int, list[float]]:
    """Impacts above 0.1 m/s of all runs of a series: how many there are, are missed, are false, and their times' errors
    in frames.
    """
    fast = missed = false = 0
    errors: list[float] = []
    frame_s = float(np.median(np.diff(motions[0]["time_s"])))
    for k, (run, motion) in enumerate(zip(runs, motions, strict=True)):
        one = scored(
            run.impacts, truth[f"imp{k + 1:02d}"], motion["time_s"].min(), motion["time_s"].max(), SAME_FRAMES * frame_s
        )
        fast, missed, false, errors = fast + one[0], missed + one[1], false + one[2], errors + one[3]
    return fast, missed, false, [error / frame_s for error in errors]


def _parameters(joint: pd.DataFrame, plant: dict[str, float]) -> dict[str, object]:
    rows = joint.set_index("parameter")
    errors = {}
    for name, key in TRUE_NAMES.items():
        value, sd = (float(rows.loc[name, c]) for c in ("value", "sd"))
        errors[f"{name}_error"] = round(value - plant[key], 5)
        errors[f"{name}_sd"] = round(sd, 5)
    return errors


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("shared", type=Path)
    parser.add_argument("numbers", type=int, nargs="*")
    arguments = parser.parse_args()
    names = [f"practice-{n:02d}" for n in arguments.numbers] or sorted(
        p.name for p in (arguments.shared / "practice").iterdir()
    )
    rows = []
    for name in names:
        rows.append(row_of(arguments.shared, name))
        print(" ".join(f"{key}={value}" for key, value in rows[-1].items()), flush=True)
    print(pd.DataFrame(rows).to_string(index=False))


if __name__ == "__main__":
    main()
