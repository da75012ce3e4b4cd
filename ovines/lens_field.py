"""What a camera's lens model leaves over, as a smooth field over its sensor: the one place that reads it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class LensField:
    """Where a camera sees a point, less where its lens model puts it.

    ``u_px`` (U,), ``v_px`` (V,) nodes of a grid, full-sensor pixels; ``shift_px`` (U, V, 2) at them.  Between them a
    bicubic spline, beyond them the value at the border.  ``open_sd``: standard deviations of what rigid bodies leave
    open of the fields of both cameras, by the names of table ``lens_terms``.
    """

    u_px: Array
    v_px: Array
    shift_px: Array
    open_sd: Mapping[str, float] = field(default_factory=dict)

    def at(self, uv_px: ArrayLike) -> Array:
        """The field [px] at full-sensor pixels (..., 2)."""
        uv = np.asarray(uv_px, float)
        seen = np.isfinite(uv).all(-1)
        u = np.clip(np.where(seen, uv[..., 0], self.u_px[0]), self.u_px[0], self.u_px[-1])
        v = np.clip(np.where(seen, uv[..., 1], self.v_px[0]), self.v_px[0], self.v_px[-1])
        return np.stack([spline.ev(u, v) for spline in self._splines], -1)

    @cached_property
    def _splines(self) -> tuple[Any, Any]:
        from scipy.interpolate import RectBivariateSpline  # slow to load, and most cameras have no field

        first, second = (RectBivariateSpline(self.u_px, self.v_px, self.shift_px[..., k]) for k in range(2))
        return first, second


def lens_fields(table: pd.DataFrame, terms: pd.DataFrame) -> dict[str, LensField]:
    """The field of each camera of tables ``lens_field`` and ``lens_terms``, by the camera's name."""
    fields = {}
    known = terms[terms["sd"].notna()]
    open_sd = dict(zip(known["term"], known["sd"].astype(float), strict=True))
    for name, rows in table.groupby("camera"):
        ordered = rows.sort_values(["u_px", "v_px"])
        u, v = np.unique(ordered["u_px"]), np.unique(ordered["v_px"])
        shift = ordered[["du_px", "dv_px"]].to_numpy(float).reshape(len(u), len(v), 2)
        fields[str(name)] = LensField(u, v, shift, open_sd)
    return fields
