"""Parquet files <-> DataFrames, checked both ways, with units and provenance inside the file."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from ovines.errors import InputError
from ovines.io.atomic_write import written_whole
from ovines.tables.check import conform, refuse_far
from ovines.tables.column import Column, Table
from ovines.tables.declared import TABLES

METADATA_KEY = b"ovines"
CONTENT_KEY = b"ovines.content"  # hash of the values: whether somebody has changed them since
# 100,000 frames of two cameras with 20 markers are 4 million rows; a damaged or hostile header can claim any number
MAX_ROWS = 50_000_000
ENTRIES = ("tracks", "points", "motion", "given_impacts")  # tables that other programs write
ARROW_TYPES = {"int": pa.int64(), "float": pa.float64(), "str": pa.string(), "bool": pa.bool_()}


def checked(frame: pd.DataFrame, name: str, source: str = "table") -> pd.DataFrame:
    """``frame`` as the declared table ``name`` (see `ovines.tables.check.conform`), without touching a file."""
    return conform(frame, TABLES[name], source)


def read_table(path: str | Path, name: str) -> pd.DataFrame:
    """Read ``path`` as the declared table ``name``.

    Returns every declared column in declared order (int64, float64 with NaN for missing, str, bool; nullable
    integers Int64), rows sorted by the table's key; optional columns that the file lacks are all missing.
    Narrower types that lose nothing (int32, float32, large_string, dictionaries) are taken; columns that the
    declaration does not know stay in the file.  Anything else raises `InputError`.

    Examples
    --------
    >>> from ovines.tables import read_table
    >>> tracks = read_table("sample_data/series_tilted/run-01/tracks.parquet", "tracks")
    >>> list(tracks.columns), len(tracks)
    (['camera', 'frame', 'time_s', 'marker', 'u_px', 'v_px', 'sd_px'], 22702)
    """
    table = TABLES[name]
    source = str(path)
    stored = _open(Path(path), table)
    try:
        frame = pd.DataFrame(index=pd.RangeIndex(stored.metadata.num_rows))
        known = [column for column in stored.schema_arrow.names if column in table.names]
        if len(known) != len(set(known)):
            raise InputError(f"{source}: a column stands more than once", "each column once", "rename one")
        content = stored.read(columns=known, use_threads=False)
        content.validate(full=True)  # strings that are no UTF-8, lists that end before they begin
        frame = pd.DataFrame({column: content.column(column).to_pandas() for column in known}, index=frame.index)
    except (pa.ArrowException, OSError, ValueError, OverflowError) as error:
        raise _unreadable(source, table, error) from None
    result = conform(frame, table, source)
    if name in ENTRIES or METADATA_KEY not in (stored.schema_arrow.metadata or {}):
        refuse_far(result, table, source)
    return result


def read_foreign_numbers(path: Path) -> pd.DataFrame:
    """Every column of numbers of a Parquet file that some other program wrote, float64 with NaN for missing."""
    try:
        stored = pq.ParquetFile(_on_disk(path))
        if stored.metadata.num_rows > MAX_ROWS:
            raise InputError(f"{path}: {stored.metadata.num_rows} rows", f"{MAX_ROWS} at most", "split the file")
        content = stored.read(use_threads=False)
        content.validate(full=True)
        return pd.DataFrame(
            {
                name: content.column(i).cast(pa.float64()).to_numpy()
                for i, name in enumerate(content.column_names)
                if pa.types.is_integer(content.column(i).type) or pa.types.is_floating(content.column(i).type)
            }
        )
    except (pa.ArrowException, OSError, ValueError, OverflowError) as error:
        found = f"{path}: {str(error)[:200]}"
        raise InputError(found, "a Parquet file", "check the path, or write the file again") from None


def write_table(frame: pd.DataFrame, name: str, path: str | Path, provenance: Mapping[str, Any]) -> None:
    """Write ``frame`` as the declared table ``name`` to ``path``, whole or not at all.

    ``provenance`` (see `ovines.io.provenance.provenance`) goes into the file's metadata as JSON, each column's
    unit and meaning into its field's.  A column that is not declared, or a value that the declaration does not
    allow, is a mistake of the program: ValueError, and nothing is written.

    Examples
    --------
    >>> import tempfile
    >>> import pandas as pd
    >>> from ovines.tables import read_provenance, read_table, write_table
    >>> row = {"camera": ["VW1"], "frame": [0], "time_s": [0.0], "marker": ["N1"], "u_px": [1.5], "v_px": [2.0]}
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_table(pd.DataFrame({**row, "sd_px": [0.1]}), "tracks", f"{folder}/tracks.parquet", {"by": "hand"})
    ...     read_table(f"{folder}/tracks.parquet", "tracks")["u_px"].tolist()
    ...     read_provenance(f"{folder}/tracks.parquet")
    [1.5]
    {'by': 'hand'}
    """
    table = TABLES[name]
    undeclared = [str(column) for column in frame.columns if column not in table.names]
    if undeclared:
        raise ValueError(f"table '{name}': undeclared columns {', '.join(undeclared)}; declare or drop them")
    try:
        ordered = conform(frame, table, f"table '{name}'")
    except InputError as error:
        raise ValueError(str(error)) from error
    columns = [column for column in table.columns if column.required or column.name in frame.columns]
    arrays = [_arrow(ordered[column.name], column) for column in columns]
    metadata = {
        METADATA_KEY: json.dumps(provenance, sort_keys=True),
        CONTENT_KEY: _content([c.name for c in columns], arrays),
    }
    schema = pa.schema([_field(column) for column in columns], metadata)
    with written_whole(path) as temporary:
        pq.write_table(pa.Table.from_arrays(arrays, schema=schema), _on_disk(temporary))


def read_provenance(path: str | Path) -> dict[str, Any] | None:
    """What `write_table` was given as provenance; None for a file that ovines did not write.

    Examples
    --------
    >>> from ovines.tables import read_provenance
    >>> read_provenance("sample_data/rendered/truth.parquet")["version"]
    '0.1.0'
    """
    try:
        raw = (pq.read_schema(_on_disk(path)).metadata or {}).get(METADATA_KEY)
        return json.loads(raw) if raw else None
    except (pa.ArrowException, OSError, ValueError):
        return None


def is_as_written(path: str | Path) -> bool | None:
    """Whether the values of a table are those that `write_table` wrote; None for a file that ovines did not write."""
    try:
        metadata = pq.read_schema(_on_disk(path)).metadata or {}
        if METADATA_KEY not in metadata:
            return None
        if CONTENT_KEY not in metadata:
            return True  # of an ovines that kept no hash
    except (pa.ArrowException, OSError, ValueError):
        return None
    try:
        table = pq.read_table(_on_disk(path), use_threads=False)
        return (
            _content(table.column_names, [column.combine_chunks() for column in table.columns])
            == metadata[CONTENT_KEY].decode()
        )
    except (pa.ArrowException, OSError, ValueError, NotImplementedError):
        return False  # ours, but for types that ovines does not write, or pages that cannot be read


def _content(names: Sequence[str], arrays: Sequence[pa.Array]) -> str:
    """Hash of names, types and values; a missing value counts as missing, whatever stands behind it."""
    digest = hashlib.sha256()
    for name, array in zip(names, arrays, strict=True):
        digest.update(f"{name}:{array.type}:{len(array)}\n".encode())
        digest.update(np.packbits(array.is_valid().to_numpy(zero_copy_only=False)).tobytes())
        if pa.types.is_string(array.type):
            for value in array.dictionary_encode().dictionary.to_pylist():
                digest.update(str(value).encode("utf-8", "surrogatepass") + b"\0")
            digest.update(array.dictionary_encode().indices.fill_null(-1).to_numpy(zero_copy_only=False).tobytes())
        else:
            digest.update(
                array.fill_null(False if pa.types.is_boolean(array.type) else 0)
                .to_numpy(zero_copy_only=False)
                .tobytes()
            )
    return digest.hexdigest()


def table_rows(path: str | Path) -> int:
    """Number of rows, from the file's footer alone."""
    return pq.read_metadata(_on_disk(path)).num_rows


def _on_disk(path: str | Path) -> str:
    """The path from the root on: pyarrow takes one like ``tcp:/a`` for an address on the net."""
    return str(Path(path).absolute())


def _open(path: Path, table: Table) -> pq.ParquetFile:
    if not path.is_file():
        found = "is a folder" if path.is_dir() else "is not there"
        raise InputError(f"{path} {found}", f"the table '{table.name}' as a Parquet file", "check the path")
    try:
        stored = pq.ParquetFile(_on_disk(path))
    except (pa.ArrowException, OSError, ValueError, OverflowError) as error:
        raise _unreadable(str(path), table, error) from None
    if stored.metadata.num_rows > MAX_ROWS:
        raise InputError(f"{path}: {stored.metadata.num_rows} rows", f"at most {MAX_ROWS} rows", "split the recording")
    return stored


def _unreadable(source: str, table: Table, error: Exception) -> InputError:
    reason = str(error).split("\n")[0][:200]
    return InputError(
        f"{source} cannot be read as Parquet ({reason})",
        f"the table '{table.name}' as a whole Parquet file",
        "write or copy the file again",
    )


def _field(column: Column) -> pa.Field:
    metadata = {"unit": column.unit, "meaning": column.meaning}
    return pa.field(column.name, ARROW_TYPES[column.type], nullable=column.nullable, metadata=metadata)


def _arrow(values: pd.Series, column: Column) -> pa.Array:
    missing = values.isna().to_numpy()
    if column.type == "float":  # NaN is missing: null in the file
        return pa.array(values.to_numpy(dtype=float), mask=missing)
    if column.type == "int":
        filled = values.fillna(0) if missing.any() else values
        return pa.array(filled.to_numpy(dtype=np.int64), mask=missing)
    plain = [None if gone else value for value, gone in zip(values.tolist(), missing, strict=True)]
    return pa.array(plain, ARROW_TYPES[column.type])
