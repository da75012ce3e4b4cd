"""Causes in nobody's list that were written after the diagnosis of commit 78d768d, for a sealed trial of it."""

import numpy as np

from analysis.blind.causes.unlisted import changes, seen
from analysis.blind.recording.draft import Cause, Draft, Rng, Truth, sign, spread, vector


def _tether(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    x, y = vector(0.03, rng)
    out = {"tether_per_s2": 40.0 * size * spread(rng), "tether_x_m": x, "tether_y_m": y}
    draft.plant.update(out)
    return out


def _seam(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    out = {"seam": 0.5 * size * spread(rng), "seam_m": float(rng.uniform(-0.012, 0.012))}
    draft.plant.update(out, seam_rad=float(rng.uniform(0.0, 2.0 * np.pi)))
    return out


def _slam(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """At its own time in each run, in half of the runs only."""
    out = {"slam_m_per_s2": 1.2 * size * spread(rng), "slam_rad": float(rng.uniform(0.0, 2.0 * np.pi))}
    draft.plant.update(out)
    draft.run_numbers["slam_s"] = np.where(rng.permutation(runs) % 2 == 0, rng.uniform(0.05, 0.3, runs), 1e3)
    return out


def _windmill(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    out = {"windmill_per_s": 1.2 * size * spread(rng), "windmill_rad_per_s": 150.0 * sign(rng)}
    draft.plant.update(out)
    return out


def _skipped_frame(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    draft.view["skipped_frame_share"] = float(rng.uniform(0.3, 0.7))
    return {"at_share_of_run": draft.view["skipped_frame_share"]}


def _swinging_zoom(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    draft.view.update(zoom_swing=8e-4 * size * spread(rng), zoom_swing_hz=float(rng.uniform(4.0, 40.0)))
    return {"zoom": draft.view["zoom_swing"], "frequency_hz": draft.view["zoom_swing_hz"]}


LATEST = [
    Cause("unknown_tether", "flight", False, _tether),
    Cause("unknown_bowl_rim", "flight", False, changes({"bowl_m_per_s2": 1.5}, signed=True)),
    Cause("unknown_cubic_drag", "flight", False, changes({"cubic_s_per_m2": 0.26})),
    Cause("unknown_slam", "flight", False, _slam),
    Cause("unknown_windmill", "flight", False, _windmill),
    Cause("unknown_bistable_disk", "flight", False, changes({"bistable_rad_per_s2": 300.0}, ("bistable_rad",))),
    Cause("unknown_floor_seam", "flight", False, _seam),
    Cause("unknown_lift", "flight", False, changes({"lift": 0.5})),
    Cause("unknown_adhesion", "impact", False, changes({"adhesion_m_per_s": 0.35})),
    Cause("unknown_three_clamps", "impact", False, changes({"clamps": 0.1}, ("clamps_rad",))),
    Cause("unknown_yielding_wall", "impact", False, changes({"yielding_s_per_m": 0.2}, signed=True)),
    Cause("unknown_rough_wall", "impact", False, changes({"rough_rad": 0.04})),
    Cause("unknown_polished_wall", "impact", False, changes({"polish": 0.6})),
    Cause("unknown_stepped_wall", "geometry", False, changes({"step_m": 4e-4}, ("step_rad",))),
    Cause("unknown_lobed_disk", "geometry", False, changes({"trilobe": 0.004}, ("trilobe_rad",))),
    Cause("unknown_breathing_wall", "geometry", False, changes({"breathing_m": 2e-4}, signed=True)),
    Cause("unknown_uneven_clock", "measurement", False, seen("uneven_s", 1e-3)),
    Cause("unknown_skipped_frame", "measurement", False, _skipped_frame),
    Cause("unknown_swinging_zoom", "measurement", False, _swinging_zoom),
]
