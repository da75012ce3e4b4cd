"""What the values of recording.toml may be: names, paths, sizes."""

from __future__ import annotations

import re
from typing import Annotated

from pydantic import AfterValidator, Field


def _plain(name: str) -> str:
    """Names end up in file names, tables and pages: no path, no control character, not empty."""
    if not name.strip() or len(name) > 100 or re.search(r"[/\\\x00-\x1f\x7f]", name) or name in (".", ".."):
        raise ValueError(f"{name[:40]!r} | a short name without slashes or control characters")
    return name


def _path(text: str) -> str:
    if not text.strip() or re.search(r"[\x00-\x1f]", text) or len(text) > 4000:
        raise ValueError(f"{text[:40]!r} | a path without control characters")
    return text


Name = Annotated[str, AfterValidator(_plain)]
PathText = Annotated[str, AfterValidator(_path)]
Pixels = Annotated[int, Field(gt=0, le=1_000_000)]
Offset = Annotated[int, Field(ge=0, le=1_000_000)]
# What no rig leaves, by far, so that squares and products of it mean something: a kilometre at the most, as in tables
Positive = Annotated[float, Field(gt=0, le=1e9)]
NotNegative = Annotated[float, Field(ge=0, le=1e9)]
Length = Annotated[float, Field(ge=1e-9, le=1e3)]
Coordinate = Annotated[float, Field(ge=-1e3, le=1e3)]
Mass = Annotated[float, Field(ge=1e-12, le=1e6)]
Point3 = tuple[Coordinate, Coordinate, Coordinate]
