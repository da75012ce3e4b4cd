"""Known points of one camera's picture: a CSV of pixels and places."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ovines.errors import InputError
from ovines.importers.reading.cells import numbers, read_cells
from ovines.importers.reading.declared import METRES, metres

Array = NDArray[np.float64]
EXPECTED = "a CSV file with a row per known point: u_px, v_px, x, y (z, sd_px)"
CLICKED_SD_PX = 0.5  # of a pixel that a person pointed at


def read_plane_points(path: Path, unit: str | None, offset_px: tuple[int, int]) -> tuple[Array, Array, Array]:
    """Full-sensor pixels (n, 2), places (n, 3) in metres and pixel sd (n,) of a CSV with a header.

    Pixels are those of the camera's pictures, whose window begins at ``offset_px``; ``z`` left out is 0, the sliding
    plane, ``sd_px`` that of a person's click.
    """
    header, rows, lines = read_cells(path, EXPECTED)
    names = [name.strip().lower() for name in header]
    at = {name.partition("_")[0]: k for k, name in enumerate(names)}
    missing = [name for name in ("u", "v", "x", "y") if name not in at]
    if missing:
        raise InputError(
            f"{path}: columns {', '.join(header)[:200]}", f"{EXPECTED}; no {', '.join(missing)}", "correct the header"
        )

    def column(name: str) -> Array:
        values = np.asarray(numbers(rows, lines, at[name], path), float)
        if not np.isfinite(values).all():
            raise InputError(f"{path}: an empty cell in {header[at[name]]}", "a number in each row", "fill it in")
        return values

    def length(name: str) -> Array:
        ending = names[at[name]].rpartition("_")[2]
        return column(name) * metres(unit, ending if ending in METRES else None, f"{path}: {header[at[name]]}")

    uv = np.column_stack([column("u"), column("v")]) + np.asarray(offset_px, float)
    z = length("z") if "z" in at else np.zeros(len(uv))
    sd = column("sd") if "sd" in at else np.full(len(uv), CLICKED_SD_PX)
    if (sd <= 0).any():
        raise InputError(f"{path}: sd_px of 0 or below", "a standard deviation above 0", "correct it")
    return uv, np.column_stack([length("x"), length("y"), z]), sd
