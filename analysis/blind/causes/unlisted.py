"""Causes that are in nobody's list: a diagnosis has to call them unknown."""

import numpy as np

from analysis.blind.recording.draft import Apply, Cause, Draft, Rng, Truth, sign, spread, vector


def changes(scale: dict[str, float], angles: tuple[str, ...] = (), signed: bool = False) -> Apply:
    """A cause that sets numbers proportional to its size and draws the named angles at random."""

    def apply(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
        factor = size * spread(rng) * (sign(rng) if signed else 1.0)
        out = {name: value * factor for name, value in scale.items()}
        out.update({name: float(rng.uniform(0.0, 2.0 * np.pi)) for name in angles})
        draft.plant.update(out)
        return out

    return apply


def _pull(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    x, y = vector(0.02, rng)
    out = {"pull_m_per_s2": 0.7 * size * spread(rng), "pull_x_m": x, "pull_y_m": y}
    draft.plant.update(out)
    return out


def _patch(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    x, y = vector(0.018, rng)
    out = {"patch_amplitude": 0.9 * size * spread(rng), "patch_x_m": x, "patch_y_m": y}
    draft.plant.update(out)
    return out


def _wobble(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    draft.view.update(wobble_px=0.9 * size * spread(rng), wobble_hz=float(rng.uniform(15.0, 60.0)))
    return {"amplitude_px": draft.view["wobble_px"], "frequency_hz": draft.view["wobble_hz"]}


def _sway(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    out = {"sway_m_per_s2": 0.35 * size * spread(rng), "sway_rad_per_s": float(rng.uniform(8.0, 30.0))}
    draft.plant.update(out, sway_rad=float(rng.uniform(0.0, 2.0 * np.pi)))
    return out


def _ridge(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    out = {"ridge_m_per_s2": 1.2 * size * spread(rng), "ridge_m": float(rng.uniform(-0.015, 0.015))}
    draft.plant.update(out, ridge_rad=float(rng.uniform(0.0, np.pi)))
    return out


def _slipped_marker(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    draft.view.update(slipped_m=vector(0.5e-3 * size * spread(rng), rng))
    return {"x_m": draft.view["slipped_m"][0], "y_m": draft.view["slipped_m"][1]}


def seen(name: str, value: float) -> Apply:
    """A cause in the cameras: one number, proportional to its size."""

    def apply(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
        draft.view[name] = value * size * spread(rng)
        return {name: draft.view[name]}

    return apply


UNLISTED = [
    Cause("unknown_central", "flight", False, changes({"central_per_s2": 13.3})),
    Cause("unknown_magnus", "flight", False, changes({"magnus": 0.005}, signed=True)),
    Cause("unknown_magnetic_pull", "flight", False, _pull),
    Cause("unknown_patchy_friction", "flight", False, _patch),
    Cause(
        "unknown_anisotropic_friction",
        "flight",
        False,
        changes({"anisotropy": 0.25}, ("anisotropy_phase_rad",)),
    ),
    Cause("unknown_spin_drag", "flight", False, changes({"spin_drag_per_s": 1.5})),
    Cause("unknown_hop", "flight", False, changes({"hop_s": 0.012})),
    Cause("unknown_soft_spot", "impact", False, changes({"soft_amplitude": 0.25}, ("soft_azimuth_rad",))),
    Cause(
        "unknown_drive_phase_restitution",
        "impact",
        False,
        changes({"phase_amplitude": 0.12}, ("phase_rad",)),
    ),
    Cause("unknown_spin_restitution", "impact", False, changes({"spin_restitution_s": 0.0012})),
    Cause("unknown_ageing_restitution", "impact", False, changes({"ageing_per_s": 0.35})),
    Cause(
        "unknown_wall_friction_azimuth",
        "impact",
        False,
        changes({"wall_friction_amplitude": 0.6}, ("wall_friction_phase_rad",)),
    ),
    Cause("unknown_camera_wobble", "measurement", False, _wobble),
    Cause("unknown_wall_pull", "flight", False, changes({"wall_pull_m_per_s2": 2.5}, signed=True)),
    Cause("unknown_swirl", "flight", False, changes({"swirl_per_s2": 10.0}, signed=True)),
    Cause("unknown_weakening_friction", "flight", False, changes({"weakening": 0.5})),
    Cause("unknown_rail_drag", "flight", False, changes({"rail_per_s": 0.7}, ("rail_rad",))),
    Cause("unknown_swaying_floor", "flight", False, _sway),
    Cause("unknown_ridge", "flight", False, _ridge),
    Cause("unknown_restless_restitution", "impact", False, changes({"rest_amplitude": 0.2})),
    Cause("unknown_slip_restitution", "impact", False, changes({"slip_restitution_s_per_m": 0.15})),
    Cause("unknown_handed_wall_friction", "impact", False, changes({"handed": 0.4}, signed=True)),
    Cause("unknown_rolling_loss", "impact", False, changes({"rolling_loss": 0.05})),
    Cause("unknown_slipped_marker", "measurement", False, _slipped_marker),
    Cause("unknown_rolling_shutter", "measurement", False, seen("shutter_s", 6e-4)),
    Cause("unknown_camera_creep", "measurement", False, seen("creep_px", 1.5)),
]
