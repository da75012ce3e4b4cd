"""The thesis' identification (Sec. 7.4): relative errors of the speeds after impacts, least on a grid."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
# Slower impacts do not stand out of the noise of straight lines (the thesis picked by hand).
SLOWEST_M_PER_S = 0.3
# The grid's upper end (steel on plastic: 0.1 to 0.3), and the relative error of an impact from which it counts as
# wrong.
MOST_FRICTION, CAP = 0.5, 1.0


def predicted_tangential_speed(
    table: pd.DataFrame,
    wall_friction: ArrayLike,
    tangential_restitution: ArrayLike,
    restitution: ArrayLike,
    inertia_factor: float,
) -> Array:
    """v_theta after an impact by the Luding law, eqs (91)-(95) with a heavy Host: shape (n_impacts, *grid).

    ``wall_friction`` and ``tangential_restitution`` broadcast against each other to the grid; ``restitution``
    is one number or one per impact (the measured one: then the normal impulse is the measured one too).
    """
    mu, beta_0 = np.broadcast_arrays(np.asarray(wall_friction, float), np.asarray(tangential_restitution, float))
    shape = (len(table),) + (1,) * mu.ndim
    v_t = table["tangential_speed_before_m_per_s"].to_numpy(float).reshape(shape)
    v_n = table["normal_speed_before_m_per_s"].to_numpy(float).reshape(shape)
    with np.errstate(divide="ignore", invalid="ignore"):
        impulse = 1 + np.broadcast_to(np.asarray(restitution, float), len(table)).reshape(shape)
        beta_1 = -1 + mu * impulse * (1 + 1 / inertia_factor) * np.abs(v_n) / np.abs(v_t)
    return -np.minimum(beta_0, beta_1) * v_t


def tangential_error(
    table: pd.DataFrame,
    wall_friction: ArrayLike,
    tangential_restitution: ArrayLike,
    restitution: float,
    inertia_factor: float,
) -> Array:
    """J_t of eq. (123) for each impact over the grid: shape (n_impacts, n_friction, n_tangential).

    One impact gives one number, min(beta_0, beta_1): its zeros form an L, and the two legs are only lower
    bounds of the two parameters.  Only impacts on either side of the critical angle together close on a
    point.
    """
    mu = np.asarray(wall_friction, float)[:, None]
    beta_0 = np.asarray(tangential_restitution, float)[None, :]
    model = predicted_tangential_speed(table, mu, beta_0, restitution, inertia_factor)
    after = table["tangential_speed_after_m_per_s"].to_numpy(float)[:, None, None]
    return np.abs((model - after) / after)


def usable(table: pd.DataFrame, picked: Sequence[int] = ()) -> pd.DataFrame:
    """The impacts whose straight lines exist and which were ``picked`` by their numbers, as the thesis did by hand;
    without, those that are fast enough to stand out of the noise.
    """
    before = table["normal_speed_before_m_per_s"]
    chosen = table["impact"].isin(picked) & (before > 0) if len(picked) else before > SLOWEST_M_PER_S
    fine = chosen & (table["normal_speed_after_m_per_s"] > 0)
    return table[fine].reset_index(drop=True)


def thesis_identification(table: pd.DataFrame, inertia_factor: float, picked: Sequence[int] = ()) -> pd.DataFrame:
    """Table ``identification`` by the thesis' recipe: mean and sd of the restitutions, minimum of the summed
    J_t.

    ``sd`` of the restitution is the scatter over the impacts (n - 1), as Table 16 means it, not that of the mean;
    ``low`` and ``high`` are null: the recipe gives no interval.  Wall friction and tangential restitution are null
    with fewer than two impacts; ``picked``: :func:`usable`.  J_t is capped at :data:`CAP` per impact: v_theta near
    zero after an impact makes its relative error arbitrarily large.
    """
    chosen = usable(table, picked)
    eps = chosen["restitution"].to_numpy(float)
    mu = beta_0 = np.nan
    tangential = chosen[np.isfinite(chosen["tangential_speed_after_m_per_s"])]
    if len(tangential) >= 2:
        grid_mu, grid_beta = np.linspace(0.0, MOST_FRICTION, 126), np.linspace(-1.0, 1.0, 101)
        error = np.minimum(
            tangential_error(tangential, grid_mu, grid_beta, float(np.mean(eps)), inertia_factor), CAP
        ).sum(0)
        i, j = np.unravel_index(np.argmin(error), error.shape)
        mu, beta_0 = float(grid_mu[i]), float(grid_beta[j])
    spread = float(np.std(eps, ddof=1)) if len(eps) > 1 else np.nan
    return pd.DataFrame(
        {
            "parameter": ["restitution", "wall_friction", "tangential_restitution"],
            "value": [float(np.mean(eps)) if len(eps) else np.nan, mu, beta_0],
            "sd": [spread, np.nan, np.nan],
            "low": np.nan,
            "high": np.nan,
            "n_impacts": [len(eps), len(tangential), len(tangential)],
        }
    )
