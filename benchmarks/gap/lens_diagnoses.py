"""Whole diagnoses of series with lens residuals: false alarms, and small tilts of the plane found beside one.

    python benchmarks/gap/lens_diagnoses.py FOLDER [--none 20] [--tilts 6] [--seed 1] [--at-home]

Series of the blind plant under noise "warp" (a lens residual of 0.2 to 0.3 px besides white noise), each with its rig,
place and clock drawn: `--none` without an effect, `--tilts` with the plane tilted by 4 mrad in a drawn direction.
`ovines diagnose` answers each, images apart the whole chain; FOLDER keeps series and answers, and what is there is not
done again. Prints the verdict of each, then the counts.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from analysis.blind.recording.files import write_series
from analysis.blind.recording.place import HOME, draw_place
from analysis.blind.series import outline_series, run_outline

TILT_RAD, RUNS = 4e-3, 12


def write_case(folder: Path, seed: int, case: int, tilted: bool, at_home: bool) -> None:
    """One series under ``folder``, its truth beside it."""
    rng = np.random.default_rng([seed, case, int(tilted)])
    place = HOME if at_home else draw_place(np.random.default_rng([seed, case, int(tilted), 1]), RUNS)
    kind = "plane_tilt" if tilted else "none"
    outline = outline_series(kind, 1.0, rng, runs=RUNS, noise="warp", name=folder.name, place=place)
    if tilted:
        way = rng.uniform(0, 2 * np.pi)
        x, y = TILT_RAD * np.cos(way), TILT_RAD * np.sin(way)
        outline.draft.view["plane_rad"] = (x, y)
        outline.truth["parameters"] = {"plane_tilt": place.world_parameters("plane_tilt", {"x_rad": x, "y_rad": y})}
    series = run_outline(outline, rng)
    part = folder.with_suffix(".part")
    write_series(series, part)
    (folder.parent / f"{folder.name}.truth.json").write_text(json.dumps(outline.truth, indent=1, default=str))
    part.rename(folder)


def answer(folder: Path, out: Path) -> dict[str, Any]:
    """`diagnosis.json` of a series."""
    if not (out / "diagnosis.json").exists():
        command = [sys.executable, "-m", "ovines", "diagnose", str(folder), "--out", str(out), "--quiet"]
        subprocess.run(command, check=True)
    found: dict[str, Any] = json.loads((out / "diagnosis.json").read_text())
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--none", type=int, default=20, help="series without an effect")
    parser.add_argument("--tilts", type=int, default=6, help="series with a plane tilted by 4 mrad")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--at-home", action="store_true", help="the usual rig at the world's origin")
    given = parser.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    right = {"none": 0, "tilt": 0}
    for name, count in (("tilt", given.tilts), ("none", given.none)):
        for case in range(count):
            folder = given.folder / f"{name}-{given.seed}-{case:02d}"
            if not folder.exists():
                write_case(folder, given.seed, case, name == "tilt", given.at_home)
            start = time.monotonic()
            found = answer(folder, given.folder / "answers" / folder.name)
            named = list(found.get("effects") or ())
            good = named == ["plane_tilt"] if name == "tilt" else found["verdict"] == "none"
            right[name] += good
            line = f"{folder.name}: {found['verdict']} {', '.join(named)} ({time.monotonic() - start:.0f} s)"
            print(line + ("" if good else "  <- WRONG"), flush=True)
    print(
        f"no effect: {right['none']} of {given.none} called none; 4 mrad: {right['tilt']} of {given.tilts} found alone"
    )


if __name__ == "__main__":
    main()
