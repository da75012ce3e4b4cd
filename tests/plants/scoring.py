"""What identification found on a plant's runs, against their truth: impacts one to one, parameters in their intervals.

An impact counts above ``FAST_M_PER_S`` with ``FEWEST_FRAMES`` or more of flight on either side; the others are
``crowded``.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from scipy.optimize import linear_sum_assignment

from tests.plants.recording import Run

FAST_M_PER_S = 0.15
FEWEST_FRAMES = 6  # of flight on either side of an impact that counts
SAME_FRAMES = 0.5
NAMES = {"restitution": "eps", "wall_friction": "mu_c", "tangential_restitution": "beta", "floor_friction": "mu_s"}
TRUE = {
    "restitution": "restitution",
    "wall_friction": "wall_friction",
    "tangential_restitution": "tangential_restitution",
    "floor_friction": "friction",
}


def impact_scores(found: pd.DataFrame, run: Run) -> dict[str, Any]:
    """Counts of one run, and the errors of the times in frames."""
    truth, frame_s = run.truth["impacts"], 1 / run.truth["rate_hz"]
    first, last = run.motion["time_s"].iloc[[0, -1]]
    true, times = truth["time_s"].to_numpy(), found["time_s"].to_numpy()
    edges = np.unique(np.concatenate([[first, last], true, run.truth["held"].ravel()]))
    before = true - edges[np.searchsorted(edges, true) - 1]
    after = edges[np.minimum(np.searchsorted(edges, true, side="right"), len(edges) - 1)] - true
    clear = np.minimum(before, after) >= FEWEST_FRAMES * frame_s
    fast = truth["normal_speed_before_m_per_s"].to_numpy() > FAST_M_PER_S
    apart = np.abs(times - true[:, None])
    own, partner = linear_sum_assignment(np.where(apart < SAME_FRAMES * frame_s, apart, 1e6))
    near = apart[own, partner] < SAME_FRAMES * frame_s
    own, partner = own[near], partner[near]
    seen = np.zeros(len(true), bool)
    seen[own] = True
    invented = np.ones(len(times), bool)
    invented[partner] = False
    invented &= found["normal_speed_before_m_per_s"].to_numpy() > FAST_M_PER_S
    crowd = np.array([_in_crowd(t, true[~clear], run.truth["held"], frame_s) for t in times], bool)
    counted = (fast & clear)[own]
    return {
        "impacts": int((fast & clear).sum()),
        "missed": int((fast & clear & ~seen).sum()),
        "crowded": int((fast & ~clear).sum()),
        "crowded_missed": int((fast & ~clear & ~seen).sum()),
        "false": int((invented & ~crowd).sum()),
        "false_crowd": int((invented & crowd).sum()),
        "errors": list((times[partner] - true[own])[counted] / frame_s),
    }


def _in_crowd(at_s: float, crowded_s: np.ndarray, held: np.ndarray, frame_s: float) -> bool:
    near = len(crowded_s) and np.abs(crowded_s - at_s).min() < FEWEST_FRAMES * frame_s
    return bool(
        near or any(start - FEWEST_FRAMES * frame_s < at_s < end + FEWEST_FRAMES * frame_s for start, end in held)
    )


def met_friction(runs: list[Run]) -> tuple[float, float]:
    """The range of the floor's friction where the disk went and as fast as it slid (two speeds or places that differ
    need no order).
    """
    rig = runs[0].truth["rig"]
    p, shares = rig.physics, [np.zeros(1)]
    for run in runs:
        s, rate = run.truth["states"], run.truth["rate_hz"]
        x, y = s["nes_x_m"] - s["host_x_m"], s["nes_y_m"] - s["host_y_m"]
        speed = np.hypot(np.gradient(x) * rate, np.gradient(y) * rate)
        c, n = np.cos(rig.place[2]), np.sin(rig.place[2])
        x, y = c * x + n * y, c * y - n * x
        share = np.zeros(len(s))
        if p.static_share:
            share = share + p.static_share * np.exp(-speed / p.static_m_per_s)
        if p.patch_share:
            share = share + p.patch_share * np.exp(
                -0.5 * ((x - p.patch_x_m) ** 2 + (y - p.patch_y_m) ** 2) / p.patch_width_m**2
            )
        shares.append(np.asarray(share + (p.gradient_x * x + p.gradient_y * y) / p.reach_m))
    met = np.concatenate(shares[1:])
    extra = max(p.memory_share, 0.0)
    return p.friction * (1 + met.min() - p.anisotropy - p.settling_share), p.friction * (
        1 + met.max() + p.anisotropy + extra
    )


def parameter_scores(joint: pd.DataFrame, runs: list[Run]) -> dict[str, Any]:
    """Errors, over their sds, and whether the intervals hold, by parameter."""
    rig, found, row = runs[0].truth["rig"], joint.set_index("parameter"), {}
    for name, short in NAMES.items():
        if name == "restitution" and not rig.law.restitution_known:
            continue
        true = rig.physics._asdict()[TRUE[name]]
        low_true, high_true = (
            met_friction(runs) if name == "floor_friction" and not rig.law.friction_known else (true, true)
        )
        if name not in found.index:
            row |= {f"{short}_none": True}
            continue
        value, sd, low, high = (float(found.loc[name, c]) for c in ("value", "sd", "low", "high"))
        error = value - float(np.clip(value, low_true, high_true))
        row |= {
            f"{short}_true": true,
            f"{short}_value": value,
            f"{short}_error": error,
            f"{short}_sd": sd,
            f"{short}_z": error / sd if sd > 0 else np.nan,
            f"{short}_held": np.nan
            if np.isnan(low) and np.isnan(high)
            else not low > high_true and not high < low_true,
            f"{short}_none": not np.isfinite(value),
        }
    return row
