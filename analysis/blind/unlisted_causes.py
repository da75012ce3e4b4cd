"""Causes that are in nobody's list: a diagnosis has to call them unknown."""

import numpy as np

from analysis.blind.draft import Apply, Cause, Draft, Rng, Truth, sign, spread, vector


def _changes(scale: dict[str, float], angles: tuple[str, ...] = (), signed: bool = False) -> Apply:
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


UNLISTED = [
    Cause("unknown_central", "flight", False, _changes({"central_per_s2": 13.3})),
    Cause("unknown_magnus", "flight", False, _changes({"magnus": 0.005}, signed=True)),
    Cause("unknown_magnetic_pull", "flight", False, _pull),
    Cause("unknown_patchy_friction", "flight", False, _patch),
    Cause(
        "unknown_anisotropic_friction",
        "flight",
        False,
        _changes({"anisotropy": 0.25}, ("anisotropy_phase_rad",)),
    ),
    Cause("unknown_spin_drag", "flight", False, _changes({"spin_drag_per_s": 1.5})),
    Cause("unknown_hop", "flight", False, _changes({"hop_s": 0.012})),
    Cause("unknown_soft_spot", "impact", False, _changes({"soft_amplitude": 0.25}, ("soft_azimuth_rad",))),
    Cause(
        "unknown_drive_phase_restitution",
        "impact",
        False,
        _changes({"phase_amplitude": 0.12}, ("phase_rad",)),
    ),
    Cause("unknown_spin_restitution", "impact", False, _changes({"spin_restitution_s": 0.0012})),
    Cause("unknown_ageing_restitution", "impact", False, _changes({"ageing_per_s": 0.35})),
    Cause(
        "unknown_wall_friction_azimuth",
        "impact",
        False,
        _changes({"wall_friction_amplitude": 0.6}, ("wall_friction_phase_rad",)),
    ),
    Cause("unknown_camera_wobble", "measurement", False, _wobble),
]
