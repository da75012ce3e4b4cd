"""What a column and a table are."""

from __future__ import annotations

from dataclasses import dataclass

UNITS = {  # longest suffix first: "x_m_per_s" is a speed, no length
    "_rad_per_s2": "rad/s^2", "_m_per_s2": "m/s^2", "_rad_per_s": "rad/s", "_px_per_s": "px/s",
    "_mv_per_g": "mV/g",
    "_m_per_s": "m/s", "_per_px": "1/px", "_rad": "rad", "_deg": "deg", "_px": "px", "_hz": "Hz",
    "_kg": "kg", "_m": "m", "_s": "s", "_j": "J", "_w": "W",
}  # fmt: skip


@dataclass(frozen=True)
class Column:
    """One column: ``type`` is "int", "float", "str" or "bool".

    ``nullable``: the value may be missing (null in the file, NaN or <NA> in a DataFrame).
    ``required``: False where the column itself may be absent from a file.
    """

    name: str
    type: str
    meaning: str
    nullable: bool = False
    required: bool = True

    @property
    def is_sd(self) -> bool:
        """Whether it is a standard deviation, by its name."""
        return self.type == "float" and (
            "_sd_" in self.name or self.name.endswith("_sd") or self.name.startswith("sd_") or self.name == "sd"
        )

    @property
    def unit(self) -> str:
        """The unit that the name ends in; "1" for a number without dimension, "" for text and flags."""
        if self.type in ("str", "bool"):
            return ""
        return next((unit for suffix, unit in UNITS.items() if self.name.endswith(suffix)), "1")


@dataclass(frozen=True)
class Table:
    """One table: what a row is, its columns, and what identifies a row.

    ``key`` columns together occur once; rows are handed over sorted by them.  ``clock`` names the column
    within each value of which ``time_s`` must increase strictly with ``frame`` ("" for the whole table; None
    where the table has no clock).
    """

    name: str
    row: str
    columns: tuple[Column, ...]
    key: tuple[str, ...] = ()
    clock: str | None = None

    def column(self, name: str) -> Column:
        """The column of that name."""
        return next(column for column in self.columns if column.name == name)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns, in their order."""
        return tuple(column.name for column in self.columns)


def integer(name: str, meaning: str, **options: bool) -> Column:
    """A whole number."""
    return Column(name, "int", meaning, **options)


def text(name: str, meaning: str, **options: bool) -> Column:
    """A text."""
    return Column(name, "str", meaning, **options)


def flag(name: str, meaning: str, **options: bool) -> Column:
    """True or false."""
    return Column(name, "bool", meaning, **options)


def number(name: str, meaning: str, **options: bool) -> Column:
    """A float that is always there."""
    return Column(name, "float", meaning, **options)


def maybe(name: str, meaning: str) -> Column:
    """A float whose value may be missing."""
    return Column(name, "float", meaning, nullable=True)


def optional(name: str, meaning: str) -> Column:
    """A float column that may be absent altogether, and whose value may be missing."""
    return Column(name, "float", meaning, nullable=True, required=False)
