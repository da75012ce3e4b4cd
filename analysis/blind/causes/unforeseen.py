"""Causes in nobody's list that were written after the diagnosis of commit 212c22f, for a sealed trial of it, by
somebody who had read neither the diagnosis nor its laws."""

from analysis.blind.causes.unlisted import changes
from analysis.blind.recording.draft import Cause, Draft, Rng, Truth, spread, vector


def _gritty_floor(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    draft.plant["grit"] = 0.35 * size * spread(rng)
    draft.run_numbers["grit_draw"] = rng.random(runs)
    return {"grit": draft.plant["grit"]}


def _shaken_camera(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    draft.view.update(shaken_px=0.4 * size * spread(rng), shaken_hz=float(rng.uniform(15.0, 60.0)))
    return {"shaken_px": draft.view["shaken_px"], "frequency_hz": draft.view["shaken_hz"]}


def _glare(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    at = vector(0.02, rng)
    draft.view.update(glare_px=2.0 * size * spread(rng), glare_m=at, glare_camera=int(rng.integers(2)))
    return {"glare_px": draft.view["glare_px"], "x_m": at[0], "y_m": at[1]}


UNFORESEEN = [
    # A thick washer presses the air out between its rim and the wall, and draws it in again.
    Cause("unknown_air_cushion", "flight", False, changes({"cushion_per_s": 6.0})),
    # The shaker's coil draws the steel, whichever way its current flows.
    Cause("unknown_coil_pull", "flight", False, changes({"coil_m_per_s2": 0.5}, ("coil_rad",))),
    # A floor plate whose screws are loose follows the ring only in part.
    Cause("unknown_loose_floor", "flight", False, changes({"loose_floor": 0.6})),
    # Each blow shakes off one grain of grit and picks up another.
    Cause("unknown_gritty_floor", "flight", False, _gritty_floor),
    # A weld spatter under the disk, beside its middle.
    Cause("unknown_stuck_grain", "flight", False, changes({"grain": 0.35}, ("grain_rad",))),
    # Residue of an adhesive tape on the wall: it holds on to what leaves, until it tears.
    Cause("unknown_glue_thread", "flight", False, changes({"thread_m_per_s2": 5.0})),
    # A washer that rocks from blow to blow strikes with its upper edge, then with its lower one.
    Cause("unknown_two_edges", "impact", False, changes({"two_edges": 0.1}, signed=True)),
    # A tacky coating, which shears off at a force of its own, however light the blow.
    Cause("unknown_cohesive_wall", "impact", False, changes({"cohesion_m_per_s": 0.07})),
    # Half of the rim is taped.
    Cause("unknown_taped_rim", "impact", False, changes({"taped": 0.9}, ("taped_rad",))),
    # A soft rim flattens where it is pressed, and resists being turned.
    Cause("unknown_rolling_resistance", "impact", False, changes({"rolling_arm_m": 2e-4})),
    # A ring bent of a strip, its ends one upon the other.
    Cause("unknown_overlapping_strip", "geometry", False, changes({"joint_m": 6e-4}, ("joint_rad",), signed=True)),
    # A ring that lies in its groove with play, and stays where the last blow has pushed it.
    Cause("unknown_loose_ring", "geometry", False, changes({"loose_ring_m": 2.5e-4})),
    # A tripod that stands on the rig's own bench.
    Cause("unknown_shaken_camera", "measurement", False, _shaken_camera),
    # A lamp's reflection on a lid draws the markers' centres towards it.
    Cause("unknown_glare", "measurement", False, _glare),
]
