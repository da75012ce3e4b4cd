"""Causes in nobody's list that were written after the diagnosis of commit 1df6508, for a sealed trial of it, by
somebody who had read neither the diagnosis nor its laws."""

import numpy as np

from analysis.blind.causes.unlisted import changes
from analysis.blind.recording.draft import Cause, Draft, Rng, Truth, sign, spread, vector


def _slipping_band(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """The tighter it sits, the more it hands on: without end at size 0."""
    draft.plant["band_m_per_s"] = 0.1 / np.sqrt(size * spread(rng))
    return {"band_m_per_s": draft.plant["band_m_per_s"]}


def _refitted_ring(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Put back once, half-way through the series."""
    x, y = vector(3.5e-4 * size * spread(rng), rng)
    side = np.where(np.arange(runs) < (runs + 1) // 2, 1.0, -1.0)
    draft.run_numbers.update(refit_x_m=x * side, refit_y_m=y * side)
    return {"refit_x_m": x, "refit_y_m": y, "runs_before": float((runs + 1) // 2)}


def _free_running_camera(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    draft.view["free_running"] = 1.2e-3 * size * spread(rng) * sign(rng)
    return {"free_running": draft.view["free_running"]}


def _bent_tab(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    draft.view.update(tab_m=5e-4 * size * spread(rng), tab_marker=int(rng.integers(4)))
    return {"tab_m": draft.view["tab_m"], "marker": float(draft.view["tab_marker"])}


UNDREAMT = [
    # A table on leaf springs moves on an arc: it rises as it leaves its middle, or sinks.
    Cause("unknown_leaf_springs", "flight", False, changes({"arc_per_m": 2.8}, signed=True)),
    # A blow tosses the disk up, the harder the higher; then it lands.
    Cause("unknown_tossed_disk", "flight", False, changes({"toss": 0.06})),
    # A washer is punched, and has a burr around its rim.
    Cause("unknown_punched_burr", "flight", False, changes({"burr": 0.8})),
    # The shaker's alternating field turns a magnetised washer to and fro.
    Cause(
        "unknown_alternating_field", "flight", False, changes({"alternating_rad_per_s2": 400.0}, ("alternating_rad",))
    ),
    # Below a lid the air goes with the ring, and carries the disk.
    Cause("unknown_enclosed_air", "flight", False, changes({"enclosed_per_m": 0.4})),
    # A mat keeps the disk's print for a while, and the disk would fall back into it.
    Cause("unknown_soft_mat", "flight", False, changes({"mat_per_s2": 20.0})),
    # Floor and washer are both brushed: they hold on to each other where their marks lie alike.
    Cause("unknown_brushed_pair", "flight", False, changes({"brushed": 0.4}, ("brushed_rad",))),
    # A ring cast with a draught leans over the disk, and presses it onto the floor.
    Cause("unknown_leaning_wall", "impact", False, changes({"leaning": 0.25})),
    # A thin sleeve in the ring is carried along by a blow, and still turns at the next.
    Cause("unknown_turning_sleeve", "impact", False, changes({"sleeve": 0.8})),
    # The ring's mount gives along one line.
    Cause("unknown_sprung_mount", "impact", False, changes({"mount": 0.12}, ("mount_rad",))),
    # A rubber band around the washer slips on it before it slips on the wall.
    Cause("unknown_slipping_band", "impact", False, _slipping_band),
    # A rubber liner tires from blow to blow, and recovers.
    Cause("unknown_tiring_liner", "impact", False, changes({"tired": 0.07})),
    # A ring that lies to one side of its seat, until it is taken out for cleaning and then lies to the other.
    Cause("unknown_refitted_ring", "geometry", False, _refitted_ring),
    # A sleeve on the washer's rim that is thicker at one side.
    Cause("unknown_eccentric_tyre", "geometry", False, changes({"tyre_m": 4e-4}, ("tyre_rad",))),
    # Two cameras started together in the middle of their buffers, each with a clock of its own.
    Cause("unknown_free_running_camera", "measurement", False, _free_running_camera),
    # One of the Host's markers sits on a tab that bends as the Host is accelerated.
    Cause("unknown_bent_tab", "measurement", False, _bent_tab),
]
