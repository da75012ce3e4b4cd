"""Seconds from tracks to verdict: twelve runs of about a second, an effect of each stage, all candidates.

    python benchmarks/diagnose.py

The series are made by ``analysis.blind``'s plant (a seed, so the same every time).  The first row is a process of its
own with its start and its compiled code from the cache, as a user meets it; the others say where the time goes in a
process that is warm.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from analysis.blind.series import make_series, write_series
from analysis.gap.diagnose import diagnose
from analysis.gap.page.gap_page import gap_page
from ovines.pipeline.diagnosis import load_series
from ovines.recording import read_series

BUDGET_S = 60.0
CASES = (
    ("none", "white"),
    ("table_tilt", "ar1"),
    ("speed_dependent_restitution", "warp"),
    ("camera_clock_offset", "white"),
    ("unknown_central", "white"),
)


def main() -> None:
    """Print one row per case: seconds of reading, of the diagnosis, of the page; their sum and its share of the
    budget.
    """
    print(f"{'case':36s}{'verdict':>10s}{'read s':>8s}{'run_ladder s':>9s}{'page s':>8s}{'sum s':>8s}{'of 60 s':>9s}")
    with tempfile.TemporaryDirectory() as scratch:
        for number, (kind, noise) in enumerate(CASES):
            folder = Path(scratch) / f"{kind}"
            write_series(make_series(kind, 1.0, np.random.default_rng(number), noise=noise), folder)
            if number == 0:
                start = time.perf_counter()
                subprocess.run(
                    [sys.executable, "-m", "ovines", "diagnose", folder, "--out", folder / "process"],
                    check=True,
                    capture_output=True,
                )
                whole = time.perf_counter() - start
                print(f"{'a process of its own: ' + kind:36s}{'':>35s}{whole:8.1f}{whole / BUDGET_S:9.2f}")
            marks = [time.perf_counter()]
            series, _ = load_series(read_series(folder), folder / "warm")
            marks.append(time.perf_counter())
            found = diagnose(series, np.random.default_rng(0))
            marks.append(time.perf_counter())
            gap_page(found, kind).render()
            marks.append(time.perf_counter())
            steps = np.diff(marks)
            print(
                f"{kind + ', ' + noise:36s}{found.summary['verdict']:>10s}"
                + "".join(f"{s:{w}.1f}" for s, w in zip(steps, (8, 9, 8), strict=True))
                + f"{steps.sum():8.1f}{steps.sum() / BUDGET_S:9.2f}"
            )


if __name__ == "__main__":
    main()
