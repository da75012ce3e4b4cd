"""Two results of one recording: what was done differently, and what that changed."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ovines.errors import InputError
from ovines.pipeline.ownership import STAGE_FILES, read_source, refuse_changed
from ovines.pipeline.stages import STAGES, stored_state
from ovines.tables import read_table

SAME_SD = 1e-9  # of an sd: less is the last digits of a sum


def refuse_no_results(folder: Path) -> None:
    """`InputError` where ``folder`` holds no results of ours, or some that were changed by hand."""
    if not any((folder / name).is_file() for name in STAGE_FILES):
        raise InputError(f"{folder} holds no results of `ovines run`", "two results folders of one recording",
                         "name the folders that --out named")  # fmt: skip
    refuse_changed(folder, STAGE_FILES)


def refuse_two_recordings(first: Path, second: Path) -> None:
    """`InputError` where two results folders say that they were made from different recordings."""
    contents = [read_source(folder).get("content") for folder in (first, second)]
    states = [_inputs(folder) for folder in (first, second)]
    shared = [artifact for artifact in states[0].keys() & states[1].keys() if artifact in ENTERED]
    same = any(states[0][artifact] == states[1][artifact] for artifact in shared)
    if contents[0] != contents[1] and not same:
        named = [read_source(folder).get("recording", folder) for folder in (first, second)]
        raise InputError(f"{first} is of {named[0]}, {second} of {named[1]}", "two results of one recording",
                         "`ovines run` a series tells its recordings side by side")  # fmt: skip


ENTERED = ("frames", "tracks.parquet", "points.parquet", "motion.parquet", "points.parquet or motion.parquet")


def _inputs(folder: Path) -> dict[str, str]:
    """Hash of what each stage in ``folder`` read, the first stage's first: those of the recording itself."""
    found: dict[str, str] = {}
    for one in STAGES:
        state = stored_state(folder / one.writes[0]) or {}
        for artifact, digest in state.get("inputs", {}).items():
            found.setdefault(artifact, digest)
    return found


def done_differently(first: Path, second: Path) -> list[str]:
    """Per stage what differs: version, code, settings (with both values) and what it read."""
    lines = []
    for one in STAGES:
        states = [stored_state(folder / one.writes[0]) for folder in (first, second)]
        if states[0] is None and states[1] is None:
            continue
        if states[0] is None or states[1] is None:
            lines.append(f"{one.name}: in {first if states[0] is not None else second} only")
            continue
        for key, word in (("version", "version"), ("code", "code")):
            if states[0].get(key) != states[1].get(key):
                lines.append(f"{one.name}: {word} {states[0].get(key)} -> {states[1].get(key)}")
        lines += [f"{one.name}: {line}" for line in _settings(states[0].get("parameters"), states[1].get("parameters"))]
        read = [states[i].get("inputs", {}) for i in (0, 1)]  # type: ignore[union-attr]
        changed = sorted(name for name in {*read[0], *read[1]} if read[0].get(name) != read[1].get(name))
        if changed:
            lines.append(f"{one.name}: read other {', '.join(changed)}")
    return lines


def _settings(first: Any, second: Any, key: str = "") -> list[str]:
    """Keys of recording.toml whose values differ, dotted, with both values."""
    if isinstance(first, Mapping) and isinstance(second, Mapping):
        names = [*first, *(name for name in second if name not in first)]
        return [
            line
            for name in names
            for line in _settings(first.get(name), second.get(name), f"{key}.{name}" if key else str(name))
        ]
    if first == second:
        return []
    if isinstance(first, list) and isinstance(second, list) and all(isinstance(one, Mapping) for one in first + second):
        return _settings(_by_name(first), _by_name(second), key)
    return [f"{key} {_short(first)} -> {_short(second)}"]


def _by_name(entries: list[Any]) -> dict[str, Any]:
    """Entries of a list of tables (``[[cameras]]``) by their name, or by their place."""
    return {str(entry.get("name", number)): entry for number, entry in enumerate(entries)}


def _short(value: Any) -> str:
    text = "none" if value is None else str(value)
    return text if len(text) <= 60 else text[:57] + "..."


def parameters_side_by_side(first: Path, second: Path) -> pd.DataFrame:
    """A row per parameter of either ``identification``: ``value_1``, ``sd_1``, ``value_2``, ``sd_2``, and ``sds``,
    their difference in units of the larger sd (NaN where either is not determined).

    The same measurements give both: the difference is no matter of noise, so the sds do not add up.
    """
    tables = []
    for folder in (first, second):
        path = folder / "identification.parquet"
        table = (
            read_table(path, "identification") if path.is_file() else pd.DataFrame(columns=["parameter", "value", "sd"])
        )
        tables.append(table.set_index("parameter")[["value", "sd"]].astype(float))
    joined = tables[0].add_suffix("_1").join(tables[1].add_suffix("_2"), how="outer")
    apart = joined["value_2"] - joined["value_1"]
    return joined.assign(sds=apart / np.fmax(joined["sd_1"], joined["sd_2"])).reset_index()


def paths_apart(first: Path, second: Path) -> dict[str, float]:
    """RMS distance of each body's two paths [m] over the frames of both, and the number of these; {} without motion."""
    motions = [
        read_table(path, "motion")
        for path in (folder / "motion.parquet" for folder in (first, second))
        if path.is_file()
    ]
    if len(motions) < 2:
        return {}
    both = motions[0].merge(motions[1], on="frame", suffixes=("_1", "_2"))
    found = {"frames": float(len(both))}
    for body in ("nes", "host"):
        apart = [both[f"{body}_{axis}_m_2"] - both[f"{body}_{axis}_m_1"] for axis in "xy"]
        square = (apart[0] ** 2 + apart[1] ** 2).to_numpy(float)
        found[body] = float(np.sqrt(np.nanmean(square))) if np.isfinite(square).any() else float("nan")
    return found


def counts(first: Path, second: Path) -> dict[str, tuple[int, int]]:
    """Rows of the tables of what was found."""
    found = {}
    for name in ("impacts", "flights"):
        paths = [folder / f"{name}.parquet" for folder in (first, second)]
        if all(path.is_file() for path in paths):
            rows = [len(read_table(path, name)) for path in paths]
            found[name] = (rows[0], rows[1])
    return found
