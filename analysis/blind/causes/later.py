"""Causes in nobody's list that were written after the diagnosis' probes and its dictionary of laws were made (commit
ab05cce): how they are answered says what becomes of a cause that nobody thought of.
"""

import numpy as np

from analysis.blind.causes.unlisted import changes, seen
from analysis.blind.recording.draft import Cause, Draft, Rng, Truth, sign, spread


def _lost_frame(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    draft.view["lost_frame_share"] = float(rng.uniform(0.3, 0.7))
    return {"at_share_of_run": draft.view["lost_frame_share"]}


def _oval_disk(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    draft.plant.update(oval=0.004 * size * spread(rng), oval_rad=float(rng.uniform(0.0, np.pi)))
    return {"oval": draft.plant["oval"]}


def _dented_wall(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    draft.plant.update(dent_m=4e-4 * size * spread(rng) * sign(rng), dent_rad=float(rng.uniform(0.0, 2.0 * np.pi)))
    return {"dent_m": draft.plant["dent_m"]}


def _in(stage: str, apply: dict[str, object]) -> list[Cause]:
    return [Cause(f"unknown_{name}", stage, False, one) for name, one in apply.items()]  # type: ignore[arg-type]


LATER = [
    *_in(
        "flight",
        {
            "grooved_floor": changes({"groove": 0.5}, ("groove_rad", "groove_phase_rad")),
            "warming_floor": changes({"warming": 0.45}),
            "compass_needle": changes({"needle_rad_per_s2": 350.0}, ("needle_rad",)),
            "air_stream": changes({"stream_per_s": 1.6}, ("stream_rad",)),
            "saddle_floor": changes({"saddle_per_s2": 12.0}, ("saddle_rad",)),
            "lubricated_spin": changes({"film": 0.4}),
            "dusty_rim": changes({"rim": 0.7}),
            "sagging_table": changes({"sag_m_per_s2": 0.2}, ("sag_rad",)),
        },
    ),
    *_in(
        "impact",
        {
            "tacky_spot": changes({"tacky": 1.5}, ("tacky_rad",)),
            "nicked_disk": changes({"nick": 0.2}, ("nick_rad",)),
            "glancing_blows": changes({"glancing": 0.25}),
            "damaged_wall": changes({"damage": 0.12}),
            "toothed_wall": changes({"teeth_m_per_s": 0.2}, signed=True),
        },
    ),
    *_in("geometry", {"dented_wall": _dented_wall, "oval_disk": _oval_disk}),
    *_in("measurement", {"lost_frame": _lost_frame, "zooming_camera": seen("zoom", 1.2e-3)}),
]
