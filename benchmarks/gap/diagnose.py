"""Seconds from tracks to verdict and page, by the clock and of the processors: twelve runs of about a second.

    python benchmarks/gap/diagnose.py [SERIES ...] [--against CHECKOUT] [--times N]

Each series is diagnosed in a process of its own, as a user meets it, its compiled code on the disk (a first process,
which is not counted, sees to that).  Without SERIES five are made by ``analysis.blind``'s plant (a seed, so the same
every time): an effect of each stage, all candidates.  ``--against`` runs the code of another checkout in turn with
this one and gives the ratio: on a machine that others use clocks are upper bounds, ratios stand.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from analysis.blind.recording.files import write_series
from analysis.blind.series import make_series

HERE = Path(__file__).resolve().parents[2]
BUDGET_S = 30.0
CASES = (
    ("none", "white"),
    ("table_tilt", "ar1"),
    ("speed_dependent_restitution", "warp"),
    ("camera_clock_offset", "white"),
    ("unknown_central", "white"),
)


@dataclass(frozen=True)
class Took:
    """Seconds of a process by the clock and of the processors, and the verdict's first words."""

    wall_s: float
    cpu_s: float
    verdict: str


def diagnosed(series: Path, code: Path, out: Path) -> Took:
    """``ovines diagnose`` of a series by the code in a checkout."""
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    done = subprocess.run(
        [sys.executable, "-m", "ovines", "diagnose", series.resolve(), "--out", out, "--yes"],
        env={**os.environ, "PYTHONPATH": str(code)},
        cwd=out.parent,
        check=True,
        capture_output=True,
        text=True,
    )
    wall, after = time.perf_counter() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return Took(wall, cpu, done.stdout.split(":")[0].strip()[:28])


def least(series: Path, code: Path, scratch: Path, times: int) -> Took:
    """The least that a process took of some."""
    every = [diagnosed(series, code, scratch / f"{series.name}-{code.name}-{k}") for k in range(times)]
    return Took(min(one.wall_s for one in every), min(one.cpu_s for one in every), every[0].verdict)


def main() -> None:
    """Print one row per series: seconds by the clock, their share of the budget, of the processors, and the ratios."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("series", nargs="*", type=Path, metavar="SERIES")
    parser.add_argument("--against", type=Path, metavar="CHECKOUT")
    parser.add_argument("--times", type=int, default=1, metavar="N", help="take the least of N (default: 1)")
    args = parser.parse_args()
    if args.against and not (args.against / "ovines").is_dir():
        parser.error(f"--against {args.against}: no checkout; expected a folder that holds ovines/")
    codes = [HERE, *([args.against.resolve()] if args.against else [])]
    with tempfile.TemporaryDirectory() as folder:
        scratch = Path(folder)
        made = list(args.series)
        for number, (kind, noise) in enumerate(() if made else CASES):
            made.append(scratch / f"{kind}, {noise}")
            write_series(make_series(kind, 1.0, np.random.default_rng(number), noise=noise), made[-1])
        for code in codes:
            diagnosed(made[-1], code, scratch / f"compiled by {code.name}")
        ratios = f"{'clock, ratio':>14s}{'CPU, ratio':>12s}" if args.against else ""
        print(f"{'series':36s}{'verdict':>28s}{'clock s':>9s}{f'of {BUDGET_S:.0f} s':>9s}{'CPU s':>8s}{ratios}")
        for series in made:
            one, *other = (least(series, code, scratch, args.times) for code in codes)
            print(
                f"{series.name:36s}{one.verdict:>28s}{one.wall_s:9.1f}{one.wall_s / BUDGET_S:9.2f}{one.cpu_s:8.1f}"
                + "".join(f"{one.wall_s / old.wall_s:14.2f}{one.cpu_s / old.cpu_s:12.2f}" for old in other),
                flush=True,
            )


if __name__ == "__main__":
    main()
