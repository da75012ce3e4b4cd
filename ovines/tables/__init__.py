"""Every Parquet table once: column, type, unit, meaning, nullable; the only place that touches Parquet."""

from ovines.tables.column import Column, Table
from ovines.tables.declared import TABLES
from ovines.tables.parquet import checked, read_provenance, read_table, table_rows, write_table

__all__ = [
    "TABLES",
    "Column",
    "Table",
    "checked",
    "read_provenance",
    "read_table",
    "table_rows",
    "write_table",
]
