"""Two listed effects at once, any pair that may stand together: are both named, nothing beside, and how large?

``python benchmarks/gap/pairs.py [--first 0] [--count 20] [--severity 0.7] [--runs 6] [--seed 77]``

Each pair is one series of the blind plant (round wall, sine; white, correlated and lens noise in turn), asked by the
ladder alone, which takes some seconds; ``nes_rocking`` gets its name later, by its law, and counts as left here.  Pairs
come in an order drawn by ``--seed``.  At the end: series right in every point, and the share of 90 % intervals that
hold the true size.
"""

from __future__ import annotations

import argparse
import tempfile
from itertools import combinations
from pathlib import Path

import numpy as np

from analysis.blind.causes.named import CAUSES, may_stand_together
from analysis.blind.recording.files import write_series
from analysis.blind.scoring.parameters import parameter_checks
from analysis.blind.series import make_series
from analysis.gap.ladder import run_ladder
from ovines.pipeline.series.diagnosis import load_series
from ovines.recording import read_series

NOISES = ("white", "ar1", "warp")
NORMAL_90 = 1.645
BY_ITS_LAW = "nes_rocking"


def asked(pair, severity, runs, noise, rng):
    """What the ladder names in one series of a pair, with intervals, what it leaves, and the truth."""
    made = make_series("+".join(pair), severity, rng, runs, noise)
    with tempfile.TemporaryDirectory() as folder:
        write_series(made, Path(folder) / "series")
        series, _ = load_series(read_series(Path(folder) / "series"), Path(folder) / "results")
    ladder = run_ladder(series, np.random.default_rng(0))
    parameters = {
        cause.effect: {
            name: {"value": value, "low": value - NORMAL_90 * sd, "high": value + NORMAL_90 * sd}
            for name, (value, sd) in cause.parameters.items()
        }
        for cause in ladder.causes
    }
    return parameters, [one.goes_with for one in ladder.structure], made.truth


def main() -> None:
    """Ask the pairs that were asked for, one line each."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, kind, default in (
        ("first", int, 0), ("count", int, 20), ("severity", float, 0.7), ("runs", int, 6), ("seed", int, 77),
    ):  # fmt: skip
        parser.add_argument(f"--{name}", type=kind, default=default)
    args = parser.parse_args()
    listed = sorted(cause.name for cause in CAUSES.values() if cause.listed)
    pairs = [pair for pair in combinations(listed, 2) if may_stand_together(pair, "round", "sine")]
    np.random.default_rng(args.seed).shuffle(pairs)
    right, inside = [], []
    for number, pair in list(enumerate(pairs))[args.first : args.first + args.count]:
        rng = np.random.default_rng([args.seed, number])
        answered, left, truth = asked(pair, args.severity, args.runs, NOISES[number % len(NOISES)], rng)
        later = BY_ITS_LAW in pair and BY_ITS_LAW not in answered
        right.append(set(answered) == set(pair) - ({BY_ITS_LAW} if later else set()) and len(left) == later)
        checks = parameter_checks(truth, {"parameters": answered})
        inside += [check["inside"] for check in checks]
        off = [f"{c['parameter']} {c['value']:.4g} for {c['true']:.4g}" for c in checks if not c["inside"]]
        verdict = "right" if right[-1] else f"WRONG: {', '.join(answered)}"
        rest = "".join(f"; {word}: {', '.join(what)}" for word, what in (("left", left), ("outside", off)) if what)
        print(f"{number:4d} {' + '.join(pair)} ({truth['noise']}): {verdict}{rest}", flush=True)
    print(f"right in every point {sum(right)} of {len(right)}; intervals {np.mean(inside):.2f} of {len(inside)}")


if __name__ == "__main__":
    main()
