"""What compiling costs the first run: `ovines run` from an empty cache against the same with a warm one.

    python benchmarks/commands/first_run.py [--recording sample_data/rendered] [--warm 2]

``cold``: the clock and the processor time of all processes, with a cache folder that is empty; ``warm``: of ``--warm``
runs after it the fastest.  ``cold / warm``: their clocks.  Python keeps its own compiled modules, as it does unless it
is asked not to.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def timed(recording: Path, out: Path, cache: Path) -> tuple[float, float]:
    """Clock and processor time [s] of one run and its children."""
    kept = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    subprocess.run(
        [sys.executable, "-m", "ovines", "run", str(recording), "--out", str(out)],
        env={**kept, "NUMBA_CACHE_DIR": str(cache), "PYTHONPATH": str(ROOT)},
        stdout=subprocess.DEVNULL,
        check=True,
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.monotonic() - began, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--recording", type=Path, default=ROOT / "sample_data" / "rendered")
    parser.add_argument("--warm", type=int, default=2)
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        cache = Path(folder) / "cache"
        cold = timed(args.recording, Path(folder) / "cold", cache)
        warm = min(timed(args.recording, Path(folder) / f"warm-{n}", cache) for n in range(args.warm))
    print(f"cold {cold[0]:.0f} s, {cold[1]:.0f} s of processors")
    print(f"warm {warm[0]:.0f} s, {warm[1]:.0f} s of processors")
    print(f"cold / warm {cold[0] / warm[0]:.1f}")


if __name__ == "__main__":
    main()
