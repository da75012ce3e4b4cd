"""What the impacts together say about wall friction and tangential restitution: a joint likelihood over both.

One impact gives one number, min(beta_0, beta_1): its zero set in the plane of the two parameters is an L
(thesis Fig. 64, and its erratum).  Summed over impacts on both sides of the critical angle the L's close on a point;
on one side only they leave one parameter with a bound.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from analysis.thesis.parameters import predicted_tangential_speed

Array = NDArray[np.float64]
# -2 ln of the likelihood ratio that 90 % regions of two parameters reach (chi-square, 2 degrees of freedom)
REGION_90 = 4.605
# A map whose 90 % region fills more than this share of it needs no close-up.
FILLED_SHARE = 0.4
# Sd of a tangential speed that comes without one: that of a straight line through five frames.
UNKNOWN_SD_M_PER_S = 0.02
# Upper ends: wall friction of the map (steel on plastic: 0.1 to 0.3), and a restitution that noise may show.
MOST_FRICTION, MOST_RESTITUTION = 0.4, 1.5
# A residual beyond this counts as if it were this large: one wrong impact must not move the map.
CUT_SD = 4.0
# Median of a squared normal error (chi-square of 1 degree); of fewer impacts it shows no scatter.
MEDIAN_SQUARE, FEWEST_FOR_SCATTER = 0.455, 3


@dataclass(frozen=True)
class ErrorMap:
    """``deviance`` (F, B) over ``wall_friction`` (F,) and ``tangential_restitution`` (B,): -2 ln likelihood,
    minimum 0.

    ``sliding_scatter`` and ``sticking_scatter``: the share of the change of tangential speed by which impacts of either
    regime scatter beyond their standard deviations at the minimum; ``n_impacts`` informed the map.
    """

    wall_friction: Array
    tangential_restitution: Array
    deviance: Array
    sliding_scatter: float
    sticking_scatter: float
    n_impacts: int

    @property
    def best(self) -> tuple[float, float]:
        """Wall friction and tangential restitution of the grid's least deviance."""
        i, j = np.unravel_index(np.argmin(self.deviance), self.deviance.shape)
        return float(self.wall_friction[i]), float(self.tangential_restitution[j])

    def close_up(self) -> tuple[Array, Array] | None:
        """Grids (81,) for a second map of the neighbourhood of the 90 % region; None where the region is
        large or open.
        """
        if self.open_ends():
            return None
        inside = self.deviance <= 2 * REGION_90
        grids = []
        for values, hit in (
            (self.wall_friction, inside.any(1)),
            (self.tangential_restitution, inside.any(0)),
        ):
            step, span = values[1] - values[0], values[-1] - values[0]
            low, high = values[hit].min() - 2 * step, values[hit].max() + 2 * step
            if high - low > FILLED_SHARE * span:
                return None
            grids.append(np.linspace(max(low, values[0]), min(high, values[-1]), 81))
        return grids[0], grids[1]

    def open_ends(self) -> list[str]:
        """Ends of the map that the 90 % region runs into: what these impacts do not bound."""
        inside = self.deviance <= REGION_90
        edges = {
            "wall friction from below": inside[0].any(),
            "wall friction from above": inside[-1].any(),
            "tangential restitution from below": inside[:, 0].any(),
            "tangential restitution from above": inside[:, -1].any(),
        }
        return [name for name, is_open in edges.items() if is_open]


def error_map(
    impacts: pd.DataFrame,
    restitution: float,
    inertia_factor: float,
    wall_friction: ArrayLike | None = None,
    tangential_restitution: ArrayLike | None = None,
    default_sd_m_per_s: float = UNKNOWN_SD_M_PER_S,
) -> ErrorMap | None:
    """Joint likelihood map of the impacts with tangential speeds on both sides; None where there is none.

    ``restitution`` stands in where an impact's own is missing.  Each residual is v_theta measured minus
    predicted (Luding law) over its sd: the measured sd after, the sd before carried through the effective
    restitution, and a scatter of the regime's own, as in the identification.  ``default_sd_m_per_s`` stands in for
    missing sd.  Residuals beyond
    :data:`CUT_SD` count as that.
    """
    needed = [
        "normal_speed_before_m_per_s",
        "tangential_speed_before_m_per_s",
        "tangential_speed_after_m_per_s",
    ]
    table = impacts[np.isfinite(impacts[needed].to_numpy(float)).all(1)]
    table = table[table["normal_speed_before_m_per_s"] > 0]
    if not len(table):
        return None
    mu = np.linspace(0, MOST_FRICTION, 121) if wall_friction is None else np.asarray(wall_friction, float)
    beta = np.linspace(-1, 1, 121) if tangential_restitution is None else np.asarray(tangential_restitution, float)
    # The tangential impulse of a sliding impact goes with the normal impulse it had, not with the mean one.
    after, before = (
        table[f"normal_speed_{when}_m_per_s"].to_numpy(float)
        if f"normal_speed_{when}_m_per_s" in table
        else np.full(len(table), np.nan)
        for when in ("after", "before")
    )
    measured = np.where(np.isfinite(after), np.clip(after / before, 0.0, MOST_RESTITUTION), restitution)
    model = predicted_tangential_speed(table, mu[:, None], beta[None, :], measured, inertia_factor)
    residual = table["tangential_speed_after_m_per_s"].to_numpy(float)[:, None, None] - model
    sd = np.hypot(_sd(table, "after", default_sd_m_per_s), 0.5 * _sd(table, "before", default_sd_m_per_s))[
        :, None, None
    ]
    slip, sliding, sticking = table["tangential_speed_before_m_per_s"].to_numpy(float), 0.0, 0.0
    scatter = np.zeros_like(sd)
    for _ in range(3):
        misfit = np.minimum(residual**2 / (sd**2 + scatter**2), CUT_SD**2).sum(0)
        i, j = np.unravel_index(np.argmin(misfit), misfit.shape)
        changed = np.abs(model[:, i, j] - slip)
        sticks = np.isclose(model[:, i, j], -beta[j] * slip, rtol=1e-5, atol=1e-8)
        sliding, sticking = (
            _extra_scatter(residual[own, i, j], sd[own, 0, 0], changed[own]) for own in (~sticks, sticks)
        )
        scatter[:, 0, 0] = np.where(sticks, sticking, sliding) * changed
    misfit = np.minimum(residual**2 / (sd**2 + scatter**2), CUT_SD**2).sum(0)
    return ErrorMap(mu, beta, misfit - misfit.min(), sliding, sticking, len(table))


def _sd(table: pd.DataFrame, when: str, default: float) -> Array:
    name = f"tangential_speed_{when}_sd_m_per_s"
    sd = table[name].to_numpy(float) if name in table else np.full(len(table), np.nan)
    return np.where(np.isfinite(sd) & (sd > 0), sd, default)


def _extra_scatter(residual: Array, sd: Array, size: Array) -> float:
    """Scatter, as a share of ``size``, that brings the median squared residual to that of a normal law; 0 where none
    is needed.
    """
    if len(residual) < FEWEST_FOR_SCATTER or np.median(residual**2 / sd**2) <= MEDIAN_SQUARE:
        return 0.0
    low, high = 0.0, float(np.max(np.abs(residual) / np.maximum(size, 1e-12))) + 1e-12
    for _ in range(60):
        middle = 0.5 * (low + high)
        over = np.median(residual**2 / (sd**2 + (middle * size) ** 2)) > MEDIAN_SQUARE
        low, high = (middle, high) if over else (low, middle)
    return high
