"""Checks of one recording's identification that can fail: what holds, what is doubtful, which parameters not to use,
and what to do.

None of them believes the laws that the identification rests on.  An approach to the wall that turns back is seen in the
distances alone; a flight's second half is predicted from its first; the thesis' peaks know nothing of flights; drive,
exposure and sds are held against what recording.toml says, the markers against each other.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from analysis.checks.fit import check_fit
from analysis.checks.impacts import COUNT
from analysis.checks.motion import check_motion
from analysis.checks.points import check_points
from analysis.checks.row import COLUMNS, DIAGNOSE, PRINCIPAL, Row
from analysis.identification.fit import RigFit
from analysis.walls.drawn import motion_gaps, stated_wall
from ovines.recording import Recording

__all__ = ["COLUMNS", "DIAGNOSE", "PRINCIPAL", "check_run", "in_words", "summed", "verdict"]


def check_run(
    rig: RigFit,
    run: int,
    motion: pd.DataFrame,
    recording: Recording,
    impacts: pd.DataFrame,
    flights: pd.DataFrame,
    thesis: pd.DataFrame | None,
    points: pd.DataFrame | None = None,
) -> pd.DataFrame:
    """Table ``checks`` of a run, a row as `analysis.checks.row.Row` says.

    ``motion``, ``impacts``, ``flights``, ``thesis`` (thesis_impacts; None: not compared) and ``points`` (None: the
    recording enters later) are the world's tables of that run.

    Examples
    --------
    Which checks fail, and the verdict.

    >>> from ovines.notebook import analyse, identify, read_calibration, read_recording, read_table, triangulate
    >>> recording = read_recording("sample_data/series_tilted/run-01")
    >>> cameras = read_calibration(recording.calibration_file)
    >>> points = triangulate(read_table(recording.folder / "tracks.parquet", "tracks"), cameras, recording)
    >>> motion = analyse(points, recording)
    >>> motion = motion[motion["time_s"] < 0.6]
    >>> found = identify(motion, recording)
    >>> from analysis.checks.recording import check_run, verdict
    >>> checks = check_run(found.rig, 0, motion, recording, found.impacts, found.flights, None, points)
    >>> len(checks), checks.loc[checks["state"] == "fails", "check"].tolist(), verdict(checks)[0]
    (17, [], 'Good')
    """
    wall = stated_wall(recording)
    farthest_m = float(np.nanmax(motion_gaps(motion, wall), initial=-wall.size_m))
    rows: list[Row | None] = check_motion(rig, run, motion, recording, impacts, flights, thesis)
    rows += check_fit(rig, run, recording, farthest_m)
    rows += check_points(points, recording)
    return pd.DataFrame([one for one in rows if one is not None], columns=list(COLUMNS))


def verdict(checks: pd.DataFrame) -> tuple[str, list[str], list[str]]:
    """("Good" | "Doubtful" | "Do not use", parameters not to use, what to do) of one run's table ``checks`` or several
    one under the other.

    Examples
    --------
    What a run may be used for whose restitution failed a check.

    >>> import pandas as pd
    >>> from analysis.checks.recording import verdict
    >>> failed = {"check": "impacts", "state": "fails", "parameters": "restitution", "do": "film more impacts"}
    >>> verdict(pd.DataFrame([failed]))
    ('Doubtful', ['restitution'], ['film more impacts'])
    """
    failed = checks[checks["state"] == "fails"]
    if not len(failed):
        return "Good", [], []
    named = {name for text in failed["parameters"] for name in str(text).split(",")}
    parameters = [name for name in PRINCIPAL if name in named]
    steps = sorted(dict.fromkeys(failed["do"]), key=lambda step: DIAGNOSE not in step)
    return ("Do not use" if len(parameters) == len(PRINCIPAL) else "Doubtful"), parameters, steps


def in_words(checks: pd.DataFrame) -> list[str]:
    """The verdict for a terminal: a line for the word and what not to use, one per check that fails, one per thing to
    do.
    """
    word, parameters, steps = verdict(checks)
    which = (
        f"Do not use: {', '.join(parameters)}." if parameters else "The parameters may be used with their intervals."
    )
    lines = [
        f"{word}: every check that could be made holds."
        if word == "Good"
        else f"{word}: no parameter can be trusted."
        if word == "Do not use"
        else f"{word}. {which}"
    ]
    lines += [f"- {text}" for text in dict.fromkeys(checks.loc[checks["state"] == "fails", "found"])]
    return [*lines, *(f"Do: {step}" for step in steps)]


def summed(tables: Sequence[pd.DataFrame], names: Sequence[str]) -> pd.DataFrame:
    """One table of the runs called ``names``: a row per check, the share of runs in which it holds, the first failing
    run's words.

    Impacts add up: a series needs enough of them together."""
    every = pd.concat([table.assign(run=name) for table, name in zip(tables, names, strict=True)], ignore_index=True)
    return pd.DataFrame(
        [_added(str(name), group) for name, group in every.groupby("check", sort=False)], columns=list(COLUMNS)
    )


def _added(name: str, group: pd.DataFrame) -> Row:
    if name == COUNT:
        count, limit = float(group["value"].sum()), float(group["limit"].iloc[0])
        worst = group.sort_values("value").iloc[0]
        enough = count >= limit
        return Row(
            name,
            count,
            limit,
            "holds" if enough else "fails",
            f"{count:.0f} impacts of {len(group)} runs could be used.",
            *("", "") if enough else (worst["parameters"], worst["do"]),
        )
    decided = group[group["state"] != "open"]
    fails = decided[decided["state"] == "fails"]
    if not len(decided):
        return Row(name, np.nan, 1.0, "open", str(group["found"].iloc[0]), "", "")
    share = float((decided["state"] == "holds").mean())
    if not len(fails):
        return Row(
            name,
            share,
            1.0,
            "holds",
            f"Holds in {'each' if len(decided) == len(group) else len(decided)} of {len(group)} runs.",
            "",
            "",
        )
    one = fails.iloc[0]
    where = (
        f"In {one['run']}"
        + ("" if len(fails) == 1 else f", and so in {_listed(fails['run'][1:])}")
        + f" (of {len(decided)} runs): "
    )
    return Row(name, share, 1.0, "fails", where + str(one["found"]), str(one["parameters"]), str(one["do"]))


def _listed(names: Sequence[str], most: int = 3) -> str:
    few = [str(name) for name in list(names)[:most]]
    return ", ".join(few) + (f" and {len(names) - most} more" if len(names) > most else "")
