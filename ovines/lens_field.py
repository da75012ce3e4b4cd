"""A smooth field over a camera's sensor, added to a lens model: what a calibration with a spline has beside its
distortion terms, and what recordings teach of the rest.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from ovines.errors import InputError

Array = NDArray[np.float64]
FEWEST_NODES = 4  # along u and v: a cubic spline needs as many


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

    def seen(self, uv_px: ArrayLike) -> Array:
        """Where a point is seen, (..., 2) px, that the lens model alone puts at ``uv_px`` (..., 2)."""
        uv = np.asarray(uv_px, float)
        return np.asarray(uv + self.at(uv + self.at(uv)))  # a thousandth from pixel to pixel: twice is exact

    @property
    def size(self) -> int:
        """Numbers that it is made of: the shifts of all nodes."""
        return int(self.shift_px.size)

    @property
    def values_px(self) -> Array:
        """All its numbers (size,): the nodes' shifts along u, then those along v, each as ``shift_px`` has them."""
        return np.asarray(np.moveaxis(self.shift_px, -1, 0).ravel(), float)

    @property
    def labels(self) -> list[str]:
        """Names of ``values_px``: spline_u_I_J and spline_v_I_J of the node ``u_px[I]``, ``v_px[J]``."""
        n_u, n_v = self.shift_px.shape[:2]
        return [f"spline_{axis}_{i}_{j}" for axis in "uv" for i in range(n_u) for j in range(n_v)]

    @property
    def nodes_px(self) -> Array:
        """Places (U V, 2) of the nodes, u slower than v."""
        return np.stack(np.meshgrid(self.u_px, self.v_px, indexing="ij"), -1).reshape(-1, 2)

    def with_values(self, values_px: Array) -> LensField:
        """The field over the same nodes that ``values_px`` (size,) make."""
        return replace(self, shift_px=np.moveaxis(values_px.reshape(2, *self.shift_px.shape[:2]), 0, -1))

    def basis(self, uv_px: Array) -> Array:
        """Derivatives (n, size / 2) of either coordinate of the field at pixels (n, 2) by its own half of
        ``values_px``: the same for both.
        """
        along = [
            _cardinal(tuple(nodes.tolist()))(np.clip(at, nodes[0], nodes[-1]))
            for nodes, at in ((self.u_px, uv_px[:, 0]), (self.v_px, uv_px[:, 1]))
        ]
        return np.asarray((along[0][:, :, None] * along[1][:, None, :]).reshape(len(uv_px), -1))

    def slopes(self, uv_px: Array) -> Array:
        """Derivatives (n, 2, size) of the field at pixels (n, 2) by ``values_px``."""
        basis = self.basis(uv_px)
        out = np.zeros((len(uv_px), 2, self.size))
        out[:, 0, : basis.shape[1]] = out[:, 1, basis.shape[1] :] = basis
        return out

    @cached_property
    def _splines(self) -> tuple[Any, Any]:
        from scipy.interpolate import RectBivariateSpline  # slow to load, and most cameras have no field

        first, second = (RectBivariateSpline(self.u_px, self.v_px, self.shift_px[..., k]) for k in range(2))
        return first, second


@lru_cache(maxsize=16)
def _cardinal(nodes: tuple[float, ...]) -> Any:
    """Cubic splines that are one at a node each and zero at the others."""
    from scipy.interpolate import make_interp_spline

    return make_interp_spline(nodes, np.eye(len(nodes)), k=3)


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


def field_json(spline: LensField) -> dict[str, Any]:
    """The field as ``calibration.json`` has it, in JSON's own values."""
    return {"u_px": spline.u_px.tolist(), "v_px": spline.v_px.tolist(), "shift_px": spline.shift_px.tolist()}


def field_from_json(entry: Any, where: str) -> LensField | None:
    """What :func:`field_json` wrote; None for None, `InputError` for anything else."""
    if entry is None:
        return None
    try:
        u, v, shift = (np.asarray(entry[key], float) for key in ("u_px", "v_px", "shift_px"))
    except (KeyError, TypeError, ValueError, OverflowError):
        u = v = shift = np.empty(0)
    if not (
        u.ndim == v.ndim == 1
        and min(len(u), len(v)) >= FEWEST_NODES
        and shift.shape == (len(u), len(v), 2)
        and all(np.isfinite(one).all() for one in (u, v, shift))
        and (np.diff(u) > 0).all()
        and (np.diff(v) > 0).all()
    ):
        raise InputError(
            f"{where}: spline = {str(entry)[:120]}",
            f"u_px and v_px, {FEWEST_NODES} or more rising numbers each, and shift_px, for each u a list of [du, dv] "
            "for each v",
            "write it again with `ovines calibrate`, or leave it out",
        )
    return LensField(u, v, shift)
