"""Every Parquet table once: column, type, unit, meaning, nullable; the only place that touches Parquet."""

from ovines.tables.check import widest_span
from ovines.tables.column import Column, Table
from ovines.tables.declared import TABLES
from ovines.tables.parquet import (
    checked,
    is_as_written,
    read_foreign_numbers,
    read_provenance,
    read_table,
    table_rows,
    write_table,
)

__all__ = [
    "TABLES",
    "Column",
    "Table",
    "checked",
    "is_as_written",
    "read_foreign_numbers",
    "read_provenance",
    "read_table",
    "table_rows",
    "widest_span",
    "write_table",
]
