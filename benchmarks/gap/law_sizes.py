"""Do the intervals of the flights' written laws hold the true sizes?

``python benchmarks/gap/law_sizes.py [--kinds a,b] [--seeds 11,12] [--runs 6] [--size 0.8]``

Effects of the library whose formula is known, drawn by the blind plant under white, correlated and lens noise; the
nominal model does not hold them, and the search of the missing law is called directly.  Stated is every number of a law
whose form is the effect's, off by so many of its own sds.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np

from analysis.blind.recording.files import write_series
from analysis.blind.series import make_series
from analysis.flights.equation.model import GRAVITY_M_PER_S2
from analysis.gap.laws.choice.search import find_law
from analysis.gap.laws.dictionary.candidate import law_at, with_sds
from analysis.gap.laws.dictionary.flights import flight_candidates
from analysis.gap.laws.dictionary.parts import RigScales
from analysis.gap.laws.flight_law import fitted_law
from analysis.gap.laws.flight_rows import flight_regression
from analysis.gap.laws.found_law import NORMAL_90, in_world
from analysis.gap.selection.flight_steps import first_flights
from analysis.gap.selection.flights.fit import fit
from ovines.pipeline.series.diagnosis import load_series
from ovines.recording import read_series

EFFECTS = ("floor_friction", "spin_coupling")
# effect -> the form's name, and number of the law, parameter of the effect, number over parameter
FORMS = {
    "viscous_drag": ("drag with the speed", [("coefficient", "rate_per_s", -1.0)]),
    "air_drag": ("drag with the speed's square", [("coefficient", "rate_per_m", -1.0)]),
    "nes_rocking": (
        "friction after an impact",
        [("coefficient", "relative", 1.0), ("since_scale_s", "decay_s", 1.0)],
    ),
    "table_tilt": (
        "force of the room",
        [("coefficient", "tilt_rad", GRAVITY_M_PER_S2), ("direction_rad", "direction_rad", 1.0)],
    ),
    "friction_drift": (
        "friction with",
        [("coefficient", "relative_per_s", 1.0), ("coefficient", "relative_per_run", 1.0)],
    ),
}


def stated_numbers(kind, rng, runs, size, noise):
    """Names of the parts that were found, and (number, sds off the truth, relative sd) of each."""
    made = make_series(kind, size, rng, runs, noise)
    with tempfile.TemporaryDirectory() as folder:
        write_series(made, Path(folder) / "series")
        series, _ = load_series(read_series(Path(folder) / "series"), Path(folder) / "results")
    base = fit(series.runs, first_flights(series, EFFECTS).model)
    rows = flight_regression(base)
    scales = RigScales.of(rows.known, float(series.runs[0].data.host.omega_rad_per_s))
    found, _ = find_law(rows.problem, rows.columns, flight_candidates(scales), np.random.default_rng(0))
    law = None if found is None else fitted_law(series.runs, base, found)
    if found is None or law is None:
        return [], []
    sized, truth = law.sized, made.truth["parameters"][kind]
    numbers = with_sds(lambda v: in_world(law_at(sized.parts, v), series.frame), sized.values, sized.covariance)
    checks = [
        (name, (numbers[name][0] - factor * truth[own]) / numbers[name][1], numbers[name][1] / abs(factor * truth[own]))
        for name, own, factor in FORMS[kind][1]
        if name in numbers and own in truth
    ]
    return [part.name for part in found.parts], checks


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--kinds", default=",".join(FORMS))
    parser.add_argument("--seeds", default="11,12")
    parser.add_argument("--runs", type=int, default=6)
    parser.add_argument("--size", type=float, default=0.8)
    options = parser.parse_args()
    off = []
    print("| effect | seed | noise | law | number: sds off (relative sd) |\n|---|---|---|---|---|")
    for kind in options.kinds.split(","):
        for seed in map(int, options.seeds.split(",")):
            for noise in ("white", "ar1", "warp"):
                rng = np.random.default_rng([seed, 7])
                parts, checks = stated_numbers(kind, rng, options.runs, options.size, noise)
                right = len(parts) == 1 and parts[0].startswith(FORMS[kind][0])
                off += [z for _, z, _ in checks] if right else []
                words = "; ".join(f"{name} {z:+.2f} ({sd:.2g})" for name, z, sd in checks)
                print(f"| {kind} | {seed} | {noise} | {' and '.join(parts) or 'none'} | {words} |", flush=True)
    inside = int(np.sum(np.abs(off) < NORMAL_90))
    rms = float(np.sqrt(np.mean(np.square(off))))
    print(f"90 % intervals that hold the truth: {inside} of {len(off)}; rms of sds off {rms:.2f}")


if __name__ == "__main__":
    main()
