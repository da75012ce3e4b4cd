"""Tables as CSV and MATLAB files, and marker paths as NetCDF."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ovines.errors import InputError
from ovines.exporters.marker_paths import MarkerPaths
from ovines.exporters.units import displayed
from ovines.io.atomic_write import written_whole
from ovines.tables import TABLES

INDIVIDUAL = "rig"


def write_csv(frame: pd.DataFrame, path: Path, units: dict[str, str]) -> None:
    """One table, as many digits as the numbers have; a missing value is an empty cell."""
    with written_whole(path) as temporary:
        displayed(frame, units).to_csv(temporary, index=False, lineterminator="\n", encoding="utf-8")


def write_mat(
    tables: Mapping[str, pd.DataFrame], provenance: Mapping[str, Any], path: Path, units: dict[str, str]
) -> None:
    """One MATLAB file (version 5): a struct per table with a column vector per column, texts as cells, missing as NaN;
    ``units`` and ``meaning`` by table and column, ``provenance`` as JSON.
    """
    from scipy.io import savemat

    content: dict[str, Any] = {"provenance": json.dumps(provenance, sort_keys=True)}
    for name, frame in tables.items():
        shown = displayed(frame, units)
        content[name] = {str(column): _vector(shown[column]) for column in shown.columns}
        content.setdefault("meaning", {})[name] = {
            str(new): TABLES[name].column(str(old)).meaning
            for old, new in zip(frame.columns, shown.columns, strict=True)
        }
    with written_whole(path) as temporary, open(temporary, "wb") as handle:
        savemat(handle, content, long_field_names=True, oned_as="column", do_compression=True)


def _vector(values: pd.Series) -> Any:
    if pd.api.types.is_bool_dtype(values):
        return values.to_numpy(bool)
    if pd.api.types.is_numeric_dtype(values):
        return values.to_numpy(float, na_value=np.nan)
    texts = np.empty(len(values), dtype=object)
    texts[:] = ["" if pd.isna(value) else str(value) for value in values]
    return texts


def write_netcdf(paths: MarkerPaths, path: Path, source: str) -> None:
    """``paths`` as NetCDF 3 (extra ``export``) in the layout of movement's poses: ``position`` (time, space, keypoints,
    individuals) in m, ``confidence`` all missing, times in s.
    """
    try:
        import xarray
    except ImportError:
        raise InputError(
            "--to netcdf without xarray", "the optional extra 'export'", "in the checkout: pip install -e '.[export]'"
        ) from None
    count = len(paths.times_s)
    dataset = xarray.Dataset(
        {
            "position": (
                ("time", "space", "keypoints", "individuals"),
                paths.xyz_m.transpose(0, 2, 1)[..., None],
                {"units": "m"},
            ),
            "confidence": (("time", "keypoints", "individuals"), np.full((count, len(paths.names), 1), np.nan)),
            "frame": (("time",), np.arange(paths.first, paths.first + count, dtype=np.int32)),
        },
        coords={
            "time": ("time", paths.times_s, {"units": "s"}),
            "space": list("xyz"),
            "keypoints": list(paths.names),
            "individuals": [INDIVIDUAL],
        },
        attrs={
            "ds_type": "poses",
            "fps": paths.rate_hz,
            "time_unit": "seconds",
            "source_software": "ovines",
            "source_file": source,
        },
    )
    with written_whole(path) as temporary:
        dataset.to_netcdf(temporary, engine="scipy", format="NETCDF3_64BIT")
