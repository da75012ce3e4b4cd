"""What an oracle would close: held-out predictions of flights beside the plant's own path, which nobody measured.

The oracle knows every law and every number; it only does not know where each flight begins, as no model does.  What
it leaves is the measurement's own error.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.blind.recording.place import Place
from ovines.robust import residual_sd

Array = NDArray[np.float64]
# A frame this many robust sds off the true path is an outlier of the measurement, and asked of nobody.
OUTLIER_SD = 6.0
SHORTEST = 6  # frames of a flight: fewer say nothing beyond their start
STEPS = ("recalibrated", "with_effect")


def in_flights(truth: dict[str, Any]) -> bool:
    """Whether a case can be asked: all its causes are listed and lie in the flights, and no lens residual in what was
    measured.  (What a law closes is not in the predictions.)
    """
    return truth["verdict"] == "effect" and set(truth["stages"]) == {"flight"} and truth["noise"] != "warp"


def oracle_share(predictions: pd.DataFrame, states: dict[str, Array], place: Place) -> float | None:
    """Share that the named effects close of what the oracle closes of the recalibrated model's squared error, over all
    flights; None where the oracle closes nothing or nothing was predicted.

    ``predictions``: the table of a diagnosis; ``states``: those of the plant's series (`Series.states`).
    """
    total = dict.fromkeys((*STEPS, "oracle"), 0.0)
    for name, rows in predictions[predictions["quantity"] != "nes_angle_rad"].groupby("run"):
        run = int(str(name).rsplit("-", 1)[-1]) - 1
        wide = rows.pivot_table(index="frame", columns="quantity", values=["measured", *STEPS])
        if wide.empty:
            continue
        first = place.first_frame[run] if place.first_frame else 0
        at = wide.index.to_numpy() - first
        path = in_world(states[f"state{run + 1:02d}"][:, :2], place)
        known = at < len(path)
        wide, at = wide[known], at[known]
        seen = {step: wide[step][["nes_x_m", "nes_y_m"]].to_numpy(float) for step in ("measured", *STEPS)}
        off = seen["measured"] - path[at]
        bounces = states[f"imp{run + 1:02d}"][:, 0] * float(place.in_units("_hz", place.frame_rate_hz))
        flight = np.searchsorted(bounces, at) + 10**6 * np.cumsum(np.diff(at, prepend=at[:1]) > 1)
        for here in (flight == one for one in np.unique(flight)):
            if np.count_nonzero(here) < SHORTEST:
                continue
            oracle = _without_start(off[here], at[here])
            good = (np.abs(oracle) <= OUTLIER_SD * residual_sd(oracle)).all(1)
            good &= np.isfinite(np.hstack([seen[step][here] for step in STEPS])).all(1)
            total["oracle"] += float(np.sum(oracle[good] ** 2))
            for step in STEPS:
                total[step] += float(np.sum((seen[step][here] - seen["measured"][here])[good] ** 2))
    whole = total["recalibrated"] - total["oracle"]
    return (total["recalibrated"] - total["with_effect"]) / whole if whole > 0 else None


def in_world(xy_m: Array, place: Place) -> Array:
    """Places (n, 2) of the rig's own frame, in its own units, in the world."""
    c, s = np.cos(place.turned_rad), np.sin(place.turned_rad)
    return xy_m @ np.array([[c, s], [-s, c]]) + np.asarray(place.rig_at_m, float)


def _without_start(off_m: Array, frame: Array) -> Array:
    """Errors (n, 2) of one flight without what its start, place and velocity, takes."""
    design = np.column_stack([np.ones(len(frame)), frame - np.mean(frame)])
    return np.asarray(off_m - design @ np.linalg.lstsq(design, off_m, rcond=None)[0], float)
