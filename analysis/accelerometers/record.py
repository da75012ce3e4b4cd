"""The record of accelerometers as recording.toml describes it, in m/s²."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ovines.errors import InputError
from ovines.recording import FILE, Recording
from ovines.recording_schema.accelerometers import Accelerometers
from ovines.tables import read_foreign_numbers

Array = NDArray[np.float64]
FEWEST = 16  # samples below which a record shows no motion
# A sensor beyond its range repeats its last value: this share of all samples at an extreme is no chance.
CLIPPED = 0.01


@dataclass(frozen=True, eq=False)
class Record:
    """``time_s`` (n,) in the record's own clock, ``acceleration_m_per_s2`` (n, channels) by the stated sensitivities;
    ``clipped`` (channels,): whether the extremes are those of the sensor's range.
    """

    settings: Accelerometers
    time_s: Array
    acceleration_m_per_s2: Array
    clipped: tuple[bool, ...]


def read_record(recording: Recording) -> Record | None:
    """The record that ``[accelerometers]`` names; None without that section, `InputError` for what is wrong in it."""
    settings = recording.settings.accelerometers
    if settings is None:
        return None
    path = recording.path(settings.file)
    table = _table(path)
    columns = ", ".join(map(str, table.columns))[:200] or "none"
    correct = f"correct [accelerometers] in {recording.folder / FILE}"
    for channel in settings.channels:
        if channel.column not in table.columns:
            raise InputError(f"{path}: columns {columns}", f"a column {channel.column!r}", correct)
    if ("time_s" in table.columns) == (settings.rate_hz is not None):
        both = "time_s, and rate_hz in recording.toml" if settings.rate_hz is not None else "no time_s and no rate_hz"
        raise InputError(f"{path}: {both}", "the times of the samples once: time_s in the file, or rate_hz", correct)
    if len(table) < FEWEST:
        raise InputError(f"{path}: {len(table)} samples", f"{FEWEST} or more", "record the whole run")
    values = table[[channel.column for channel in settings.channels]].to_numpy(float)
    time_s = table["time_s"].to_numpy(float) if settings.rate_hz is None else np.arange(len(table)) / settings.rate_hz
    if not np.isfinite(time_s).all() or np.any(np.diff(time_s) <= 0):
        raise InputError(f"{path}: times that do not increase from row to row", "time_s in s, increasing", "correct it")
    if not np.isfinite(values).all():
        row, column = np.argwhere(~np.isfinite(values))[0]
        name = settings.channels[column].column
        raise InputError(
            f"{path}, sample {row}: no number in {name!r}", "a number in every row", "cut the record there"
        )
    for channel, one in zip(settings.channels, values.T, strict=True):
        if np.ptp(one) == 0:
            raise InputError(
                f"{path}: {channel.column!r} is {one[0]:g} throughout",
                "a sensor that was connected",
                f"leave the channel out of {recording.folder / FILE}",
            )
    scale = np.array([channel.m_per_s2_per_unit for channel in settings.channels])
    return Record(settings, time_s, values * scale, tuple(_clipped(one) for one in values.T))


def _table(path: Path) -> pd.DataFrame:
    """The file's columns of numbers."""
    if not path.is_file():
        raise InputError(f"{path} is not there", "the accelerometers' record", "correct file in [accelerometers]")
    if path.suffix.lower() == ".parquet":
        return read_foreign_numbers(path)
    do = "write a header with a name per channel, commas between, and a row per sample"
    try:
        table = pd.read_csv(path.absolute(), skipinitialspace=True, encoding="utf-8-sig")
        table.columns = [str(name).strip() for name in table.columns]
        return table.astype(float)
    except (OSError, ValueError) as error:  # pandas' own errors are ValueErrors
        raise InputError(f"{path}: {str(error)[:200]}", "a CSV file of numbers with a header", do) from None


def _clipped(values: Array) -> bool:
    """Whether the largest or the smallest value comes again and again (a constant number of digits alone repeats
    values all over, and its extremes as rarely as any)."""
    return any(np.mean(values == extreme) > CLIPPED for extreme in (values.max(), values.min()))
