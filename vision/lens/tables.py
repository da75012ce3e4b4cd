"""Lens fields and what they are worth, as the tables ``lens_field`` and ``lens_terms``."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ovines.camera import Camera
from ovines.camera.changes import PictureChange
from vision.lens.lattice import Lattice
from vision.lens.open_terms import OPEN_TERMS
from vision.lens.posterior import Posterior

Array = NDArray[np.float64]
_NODES_PER_SITE = 2  # of the table, so that a cubic spline through its values is the field


def field_table(posterior: Posterior, lattices: Sequence[Lattice], cameras: Sequence[Camera]) -> pd.DataFrame:
    """Table ``lens_field`` at the nodes of a grid twice as fine as the lattice."""
    tables, at = [], 0
    for lattice, camera in zip(lattices, cameras, strict=True):
        nodes = lattice.nodes_px(_NODES_PER_SITE)
        basis = lattice.basis(nodes)
        columns = {"camera": camera.name, "u_px": nodes[:, 0], "v_px": nodes[:, 1]}
        for axis in "uv":
            own = slice(at, at + lattice.size)
            columns[f"d{axis}_px"] = basis @ posterior.mean[own]
            variance = np.sum((basis @ posterior.covariance[own, own]) * basis, 1)
            columns[f"d{axis}_sd_px"] = np.sqrt(variance)
            at += lattice.size
        tables.append(pd.DataFrame(columns))
    return pd.concat(tables, ignore_index=True)


def terms_table(
    quality: dict[str, tuple[float, float]], posterior: Posterior, by_field: Array, changes: Sequence[PictureChange]
) -> pd.DataFrame:
    """Table ``lens_terms``: ``quality`` (value, sd), the prior found, the open terms, ``by_field`` along the
    field's coefficients, with and without the recordings, and the ``changes`` that are in the field."""
    rows = [
        *((term, *value_and_sd) for term, value_and_sd in quality.items()),
        ("amplitude_px", posterior.amplitude_px, np.nan),
        ("length_px", posterior.length_px, np.nan),
    ]
    for term, along in zip(OPEN_TERMS, by_field, strict=True):
        rows.append((term, float(along @ posterior.mean), float(np.sqrt(along @ posterior.covariance @ along))))
        rows.append((f"{term}_before", 0.0, float(np.sqrt(along @ posterior.expected @ along))))
    for one in changes:
        tail = f":{one.camera}" if one.camera else ""
        rows.append((f"{one.target}{tail}", one.value, one.sd))
        rows += [(f"{one.target}_{name}{tail}", *value_and_sd) for name, value_and_sd in one.own_numbers.items()]
    return pd.DataFrame(rows, columns=["term", "value", "sd"])
