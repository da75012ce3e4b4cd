"""Causes that the library has beside those of FORMATS.md, at the sizes of this rig; parameters as `listed` has them."""

import numpy as np

from analysis.blind.recording.draft import Cause, Draft, Rng, Truth, sign, spread


def _wall_lobes(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    order = int(rng.integers(3, 7))
    amplitude, phase = 0.004 * size * spread(rng), float(rng.uniform(0.0, 2.0 * np.pi / order))
    draft.plant.update(lobes=amplitude, lobe_order=float(order), lobe_phase_rad=phase)
    return {"amplitude": amplitude, "order": float(order), "direction_rad": phase}


def _inertia_error(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    ratio = 1.0 + 0.15 * size * spread(rng) * sign(rng)
    draft.plant["inertia_factor"] = 0.5 * ratio
    return {"ratio": ratio}


def _restitution_drift(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    change = 0.25 * size * spread(rng) * sign(rng)
    if rng.random() < 0.5:
        per_run = change / max(runs - 1, 1)
        draft.run_restitution = 1.0 + per_run * np.arange(runs)
        return {"relative_per_run": per_run}
    draft.plant["ageing_per_s"] = -change
    return {"relative_per_s": change}


def _nes_rocking(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    draft.plant.update(settling=0.7 * size * spread(rng), settling_s=float(rng.uniform(0.012, 0.025)))
    return {"relative": -draft.plant["settling"], "decay_s": draft.plant["settling_s"]}


def _host_recoil(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    mass, hz, damping = 12.0 / size * spread(rng), float(rng.uniform(3.0, 8.0)), float(rng.uniform(0.15, 0.5))
    draft.plant.update(recoil_kg=mass, recoil_rad_per_s=2.0 * np.pi * hz, recoil_damping=damping)
    return {"mass_kg": mass, "frequency_hz": hz, "damping_ratio": damping}


def _host_ringing(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    mass, hz, damping = 3.0 / size * spread(rng), float(rng.uniform(40.0, 120.0)), float(rng.uniform(0.02, 0.1))
    draft.ringing = (mass, hz, damping)
    return {"mass_kg": mass, "frequency_hz": hz, "damping_ratio": damping}


def _host_sway(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    amplitude, hz = 2e-4 * size * spread(rng), float(rng.uniform(1.0, 3.5))
    draft.sway = (amplitude, hz, float(rng.uniform(0.0, np.pi)))
    return {"amplitude_m": amplitude, "frequency_hz": hz, "direction_rad": draft.sway[2]}


def _motion_blur(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    draft.view["blur_s"] = 6e-5 * size * spread(rng)
    return {"sd_s": draft.view["blur_s"]}


FURTHER = [
    Cause(name, stage, True, globals()["_" + name])
    for stage, names in {
        "flight": ("nes_rocking",),
        "impact": ("restitution_drift",),
        "geometry": ("wall_lobes", "inertia_error"),
        "drive": ("host_recoil", "host_ringing", "host_sway"),
        "measurement": ("motion_blur",),
    }.items()
    for name in names
]
