"""TRC and C3D, the formats of motion capture: markers in mm on an even clock, frames numbered from 1."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ovines.errors import InputError
from ovines.exporters.marker_paths import MarkerPaths
from ovines.io.atomic_write import write_text_whole, written_whole

MM = 1e3


def write_trc(paths: MarkerPaths, path: Path) -> None:
    """``paths`` as TRC; a marker not seen is three empty cells, times stand as they were measured."""
    count, rate = len(paths.times_s), f"{paths.rate_hz:.9g}"
    header = [
        f"PathFileType\t4\t(X/Y/Z)\t{path.name}",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames",
        f"{rate}\t{rate}\t{count}\t{len(paths.names)}\tmm\t{rate}\t{paths.first + 1}\t{count}",
        "Frame#\tTime\t" + "\t\t\t".join(paths.names) + "\t\t",
        "\t\t" + "\t".join(f"{axis}{i}" for i in range(1, len(paths.names) + 1) for axis in "XYZ"),
        "",
    ]
    cells = np.where(np.isnan(paths.xyz_m), "", np.char.mod("%.7g", MM * paths.xyz_m)).reshape(count, -1)
    rows = [
        f"{paths.first + 1 + i}\t{time_s:.9f}\t" + "\t".join(row)
        for i, (time_s, row) in enumerate(zip(paths.times_s, cells, strict=True))
    ]
    write_text_whole("\n".join([*header, *rows]) + "\n", path)


def write_c3d(paths: MarkerPaths, path: Path) -> None:
    """``paths`` as C3D (single precision; extra ``export``); a marker not seen has the residual -1."""
    ezc3d = _ezc3d()
    content = ezc3d.c3d()
    points = np.full((4, len(paths.names), len(paths.times_s)), np.nan)
    points[:3] = MM * paths.xyz_m.transpose(2, 1, 0)
    points[3] = 1.0
    content["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
    content["parameters"]["POINT"]["RATE"]["value"] = [paths.rate_hz]
    content["parameters"]["POINT"]["LABELS"]["value"] = list(paths.names)
    content["header"]["points"]["first_frame"] = paths.first
    content["data"]["points"] = points
    missing = np.isnan(points[:1])
    content["data"]["meta_points"] = {
        "residuals": np.where(missing, -1.0, 0.0),
        "camera_masks": np.zeros((7, *missing.shape[1:]), dtype=bool),
    }
    with written_whole(path) as temporary:
        written = temporary.with_name(temporary.name + ".c3d")  # ezc3d adds the ending where it is not there
        try:
            content.write(str(written))
            written.replace(temporary)
        finally:
            written.unlink(missing_ok=True)


def _ezc3d() -> Any:
    try:
        import ezc3d
    except ImportError:
        raise InputError(
            "--to c3d without ezc3d", "the optional extra 'export'", "in the checkout: pip install -e '.[export]'"
        ) from None
    return ezc3d
