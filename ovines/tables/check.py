"""A DataFrame against its declaration: types, missing values, keys, the clock."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ovines.errors import InputError
from ovines.tables.column import Column, Table

# A table of motion has a row for every frame number between its first and its last, so numbers far apart cost memory
# and time for nothing.  More than so many missing for each that is there, or in all where few are there, are a mistake
# in a number.
MISSING_PER_FRAME, MISSING_IN_ALL = 100, 100_000


# The largest values that a table from outside may hold, by unit: a kilometre, a picture of a million pixels, times
# since 1970 in seconds with room to spare, speeds beyond any bullet's, and for the rest what can still be squared and
# summed.
MOST = {"m": 1e3, "px": 1e6, "s": 1e11, "m/s": 1e6, "rad/s": 1e9}
MOST_OTHER = 1e12
TEXT = pd.Series(dtype=str).dtype  # of text without missing values


def widest_span(count: int) -> int:
    """Largest difference of frame numbers that ``count`` frames may have."""
    return MISSING_PER_FRAME * count + MISSING_IN_ALL


def conform(frame: pd.DataFrame, table: Table, source: str) -> pd.DataFrame:
    """The declared columns of ``frame`` in declared order and type, rows sorted by the key.

    int64 (Int64 where nullable), float64 with NaN for missing, str, bool.  Optional columns that are absent
    are filled with missing values, so that a reader finds every declared column.  Raises `InputError` naming
    ``source``, column and row for anything else: a missing column, another type, a missing or infinite value
    where one must stand, a key that occurs twice, a clock that does not go forward.
    """
    repeated = sorted(set(frame.columns[frame.columns.duplicated()]))
    if repeated:
        raise InputError(
            f"{source}: column {', '.join(repeated)} stands more than once", "each column once", "rename one"
        )
    absent = [column.name for column in table.columns if column.required and column.name not in frame.columns]
    if absent:
        raise InputError(
            f"{source}: no column {', '.join(absent)} (there are: {', '.join(map(str, frame.columns)) or 'none'})",
            f"the table '{table.name}' with the columns {', '.join(c.name for c in table.columns if c.required)}",
            "add the column; a value that is not known is null",
        )
    columns: dict[str, pd.Series | NDArray[np.float64]] = {}
    for column in table.columns:
        if column.name in frame.columns:
            values = frame[column.name]
            if column.type == "float" and values.dtype == np.float64:  # as nearly all are: pandas asks much longer
                numbers = values.to_numpy()
                _refuse_missing(np.isnan(numbers), column, source)
                _refuse_numbers(numbers, column, source)
                columns[column.name] = numbers
            else:
                columns[column.name] = _typed(values.reset_index(drop=True), column, source)
        elif column.type == "float":
            columns[column.name] = np.full(len(frame), np.nan)
        else:
            columns[column.name] = pd.Series(
                [None if column.type == "str" else np.nan] * len(frame),
                dtype="Int64" if column.type == "int" else "object",
            )
    result = pd.DataFrame(columns)
    ordered = _in_order(result, table.key)
    if not ordered:
        _check_key(result, table, source)
    if table.clock is not None:
        _check_span(result, source)
        _check_clock(result, table, ordered, source)
    return result if ordered else result.sort_values(list(table.key), kind="stable", ignore_index=True)


def _typed(values: pd.Series, column: Column, source: str) -> pd.Series:
    missing = values.isna().to_numpy()
    _refuse_missing(missing, column, source)
    if column.type == "str":
        return _text(values, missing, column, source)
    if missing.all() and len(values):
        return pd.Series([np.nan] * len(values), dtype="Int64" if column.type == "int" else "float64")
    if column.type == "bool":
        if values.dtype != bool and not values.map(lambda v: isinstance(v, (bool, np.bool_))).all():
            raise _wrong_type(values, column, source)
        return values.astype(bool)
    kind = values.dtype
    numeric = pd.api.types.is_numeric_dtype(kind) and not pd.api.types.is_bool_dtype(kind)
    if len(values) and (not numeric or pd.api.types.is_complex_dtype(kind)):
        raise _wrong_type(values, column, source)
    return _whole(values, missing, column, source) if column.type == "int" else _real(values, column, source)


def _refuse_missing(missing: NDArray[np.bool_], column: Column, source: str) -> None:
    if missing.any() and not column.nullable:
        raise InputError(
            f"{source}: {column.name} is missing (null or NaN) in row {int(missing.argmax())}"
            f" and {int(missing.sum()) - 1} more",
            f"a value of {column.name} in every row",
            "leave the row out where nothing was seen",
        )


def _text(values: pd.Series, missing: np.ndarray, column: Column, source: str) -> pd.Series:
    if isinstance(values.dtype, pd.StringDtype) and values.dtype == TEXT and not missing.any():
        return values  # as it is read: nothing else than text can be in it
    present = values[~missing]
    if pd.api.types.infer_dtype(present.astype(object), skipna=False) not in ("string", "empty"):
        raise _wrong_type(values, column, source)
    result = values.astype(object).where(~missing, None)
    return result.astype(str) if not missing.any() else result


def _whole(values: pd.Series, missing: np.ndarray, column: Column, source: str) -> pd.Series:
    if not pd.api.types.is_integer_dtype(values.dtype):  # 3.0 is a whole number, 3.5 is none
        numbers = values[~missing].to_numpy(dtype=float)
        broken = ~np.isfinite(numbers) | (numbers != np.round(numbers)) | (np.abs(numbers) > 2.0**53)
        if broken.any():
            raise InputError(
                f"{source}: {column.name} holds {numbers[broken][0]!r}",
                "whole numbers",
                "write it as an integer",
            )
    elif (values[~missing] > 2**62).any():
        raise InputError(f"{source}: {column.name} holds {values.max()}", "numbers below 2^62", "correct it")
    result = values.astype("Int64") if column.nullable else values.astype("int64")
    if column.name == "frame" and len(result) and result.min() < 0:
        raise InputError(
            f"{source}: frame is {int(result.min())} in row {int(result.argmin())}",
            "frame numbers from 0",
            "number the frames from 0",
        )
    return result


def _real(values: pd.Series, column: Column, source: str) -> pd.Series:
    numbers = values.to_numpy(dtype=float, na_value=np.nan)
    _refuse_numbers(numbers, column, source)
    return pd.Series(numbers)


def _refuse_numbers(numbers: NDArray[np.float64], column: Column, source: str) -> None:
    """`InputError` for an infinite number, or an sd below zero."""
    infinite = np.isinf(numbers)
    if infinite.any():
        raise InputError(
            f"{source}: {column.name} is infinite in row {int(infinite.argmax())}",
            "finite numbers; a value that is not known is null",
            "correct the value, or leave it null" if column.nullable else "correct the value",
        )
    if column.is_sd and (numbers < 0).any():
        raise _out_of_range(numbers, numbers < 0, column, source, "a standard deviation, which is never negative")


def refuse_far(frame: pd.DataFrame, table: Table, source: str) -> None:
    """`InputError` for a value of a table from outside that no rig has (`MOST`): squares and differences of it would
    mean nothing.
    """
    for column in table.columns:
        if column.type == "float" and column.name in frame.columns:
            numbers = frame[column.name].to_numpy(dtype=float)
            most = MOST.get(column.unit, MOST_OTHER)
            if (np.abs(numbers) > most).any():
                unit = f" {column.unit}" if column.unit not in ("", "1") else ""
                raise _out_of_range(numbers, np.abs(numbers) > most, column, source, f"numbers up to {most:g}{unit}")


def _out_of_range(
    numbers: NDArray[np.float64], broken: NDArray[np.bool_], column: Column, source: str, expected: str
) -> InputError:
    row = int(broken.argmax())
    more = f" and in {int(broken.sum()) - 1} more" if broken.sum() > 1 else ""
    do = "correct the value, or leave it null" if column.nullable else "correct the value"
    return InputError(f"{source}: {column.name} is {numbers[row]:.6g} in row {row}{more}", expected, do)


def _wrong_type(values: pd.Series, column: Column, source: str) -> InputError:
    expected = {"int": "whole numbers", "float": "numbers", "str": "text", "bool": "true or false"}[column.type]
    unit = f" in {column.unit}" if column.unit not in ("", "1") else ""
    return InputError(
        f"{source}: {column.name} is of type {values.dtype}",
        expected + unit,
        "write the column with that type",
    )


def _in_order(frame: pd.DataFrame, key: tuple[str, ...]) -> bool:
    """Whether each row's key comes after the one before, as in all that ovines writes: none stands twice, and there is
    nothing to sort.  False also where it is not seen at once.
    """
    after, same = np.zeros((2, max(len(frame) - 1, 0)), dtype=bool)
    same[:] = True
    for name in key:
        values = frame[name]
        ranks = values.to_numpy() if values.dtype == np.int64 else pd.factorize(values, sort=True)[0]
        if ranks.min(initial=0) < 0:  # a missing value, or a number below zero
            return False
        after |= same & (ranks[1:] > ranks[:-1])
        same &= ranks[1:] == ranks[:-1]
    return bool(after.all()) or not key


def _check_key(frame: pd.DataFrame, table: Table, source: str) -> None:
    twice = frame.duplicated(list(table.key)).to_numpy()
    if twice.any():
        row = frame.loc[int(twice.argmax()), list(table.key)]
        raise InputError(
            f"{source}: {', '.join(f'{key} {value}' for key, value in row.items())} stands more than once"
            f" ({int(twice.sum())} such rows)",
            f"one row per {table.row}",
            "remove the repeated rows",
        )


def _check_span(frame: pd.DataFrame, source: str) -> None:
    """Frame numbers lie close together."""
    numbers = np.unique(frame["frame"].to_numpy())
    if not len(numbers) or numbers[-1] - numbers[0] <= widest_span(len(numbers)):
        return
    at = int(np.argmax(np.diff(numbers)))
    raise InputError(
        f"{source}: {len(numbers)} frames numbered from {numbers[0]} to {numbers[-1]}; frame {numbers[at]} is "
        f"followed by frame {numbers[at + 1]}",
        "frame numbers that go on from frame to frame; some may be missing",
        "correct the numbers, or split the recording there",
    )


def _check_clock(frame: pd.DataFrame, table: Table, ordered: bool, source: str) -> None:
    """Within a camera (or the table) a frame has one time, and a later frame a later one; ``ordered``: rows stand in
    the order of the key.
    """
    group = table.clock or ""
    if not group and all(np.all(np.diff(frame[name].to_numpy()) > 0) for name in ("frame", "time_s")):
        return  # seen at once where rows are in order
    by = [group] if group else []
    instants = frame[[*by, "frame", "time_s"]]
    if ordered and table.key[: len(by) + 1] == (*by, "frame"):  # rows of an instant stand together
        new = np.ones(len(frame), dtype=bool)
        new[1:] = (np.diff(instants["frame"].to_numpy()) != 0) | (np.diff(instants["time_s"].to_numpy()) != 0)
        for name in by:
            new[1:] |= np.diff(pd.factorize(instants[name])[0]) != 0
        instants = instants[new]
    else:
        instants = instants.drop_duplicates().sort_values([*by, "frame"], kind="stable")
    same = np.ones(max(len(instants) - 1, 0), dtype=bool)
    if group:
        names = instants[group].to_numpy()
        same = names[1:] == names[:-1]
    frames, times_s = instants["frame"].to_numpy(), instants["time_s"].to_numpy()
    broken = same & (~(np.diff(times_s) > 0) | (np.diff(frames) == 0))
    if broken.any():
        i = int(broken.argmax())
        what = "has two times" if frames[i] == frames[i + 1] else f"is followed by frame {frames[i + 1]}"
        of = f" of {instants[group].iloc[i]}" if group else ""
        raise InputError(
            f"{source}: frame {frames[i]}{of} at {times_s[i]:.9g} s {what}, at {times_s[i + 1]:.9g} s",
            "one time per frame, increasing from frame to frame",
            "remove repeated frames and correct the times",
        )
