"""The causes that the diagnosis knows by name, at the sizes of this rig.

Each returns its true parameters by the names of `ovines simulate` and `diagnosis.json`, relative changes
from the first run or from a run's start as these count them.
"""

import numpy as np

from analysis.blind.cause import Cause, Draft, Rng, Truth, sign, spread, vector
from analysis.blind.plant.parameters import PlantParameters


def _floor_friction(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    draft.model_effects = ()
    draft.plant["floor_friction"] *= size
    return {"coefficient": draft.plant["floor_friction"]}


def _spin_coupling(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    draft.model_effects = ("floor_friction",)
    draft.plant["spin_share"] = size
    return {"coupling": size}


def _viscous_drag(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    draft.plant["viscous_per_s"] = 0.6 * size * spread(rng)
    return {"rate_per_s": draft.plant["viscous_per_s"]}


def _air_drag(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    draft.plant["air_per_m"] = 0.45 * size * spread(rng)
    return {"rate_per_m": draft.plant["air_per_m"]}


def _table_tilt(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    x, y = vector(0.17 * size * spread(rng), rng)
    draft.plant.update(tilt_x_m_per_s2=x, tilt_y_m_per_s2=y)
    return {"tilt_rad": float(np.hypot(x, y) / 9.81), "direction_rad": float(np.arctan2(y, x))}


def _vertical_motion(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    draft.vertical_amplitude_m = 7.5e-4 * size * spread(rng)
    return {"amplitude_m": draft.vertical_amplitude_m}


def _friction_drift(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    change = 0.4 * size * spread(rng) * sign(rng)
    if rng.random() < 0.5:
        draft.run_friction = 1.0 + change * (np.arange(runs) / max(runs - 1, 1) - 0.5)
        return {"relative_per_run": change / max(runs - 1, 1) / (1.0 - 0.5 * change)}
    slope = change / 0.7
    draft.plant["friction_change_per_s"] = slope
    return {"relative_per_s": slope / (1.0 - 0.5 * slope * PlantParameters().duration_s)}


def _speed_dependent_restitution(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    top = 0.86
    bottom = top - 0.33 * size * spread(rng)
    speed = float(rng.uniform(0.9, 1.3))
    draft.plant.update(restitution=top, restitution_floor=bottom, restitution_speed_m_per_s=speed)
    return {"restitution_slow": top, "restitution_fast": bottom, "speed_scale_m_per_s": speed}


def _direction_dependent_restitution(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    amplitude, phase = 0.1 * size * spread(rng), float(rng.uniform(0.0, 2.0 * np.pi))
    draft.plant.update(direction_amplitude=amplitude, direction_phase_rad=phase)
    return {"amplitude": amplitude, "direction_rad": phase}


def _finite_contact_time(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    draft.plant.update(
        contact_time_s=7.7e-4 * size * spread(rng),
        restitution_scatter=0.0,
        contact_shear_share=float(rng.uniform(0.75, 0.95)),
    )
    return {"duration_s": draft.plant["contact_time_s"]}


def _wall_ellipticity(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    amplitude, phase = 0.005 * size * spread(rng), float(rng.uniform(0.0, np.pi))
    draft.plant.update(ellipticity=amplitude, ellipticity_phase_rad=phase)
    return {"ellipticity": amplitude, "direction_rad": phase}


def _wall_centre_offset(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    x, y = vector(4e-4 * size * spread(rng), rng)
    draft.plant.update(wall_x_m=x, wall_y_m=y)
    return {"x_m": x, "y_m": y}


def _mass_centre_offset(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    x, y = vector(4e-4 * size * spread(rng), rng)
    draft.plant.update(mass_x_m=x, mass_y_m=y)
    return {"x_m": x, "y_m": y}


def _centre_marker_offset(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    x, y = vector(4.2e-4 * size * spread(rng), rng)
    draft.view["centre_marker_offset_m"] = (x, y)
    return {"x_m": x, "y_m": y}


def _camera_clock_offset(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    draft.view["clock_s"] = 4.2e-4 * size * spread(rng) * sign(rng)
    return {"offset_s": draft.view["clock_s"]}


def _sensor_window_offset(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    across, along = max(round(3 * size), 1) * sign(rng), max(round(2 * size), 1) * sign(rng)
    draft.view.update(window_px=(across, along), window_camera=int(rng.integers(2)))
    return {"u_px": across, "v_px": along}


def _length_scale_error(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    draft.view["scale"] = 1.0 + 0.0116 * size * spread(rng) * sign(rng)
    return {"scale": draft.view["scale"]}


def _frame_rate_error(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    draft.view["rate_ratio"] = 1.0 + 0.002 * size * spread(rng) * sign(rng)
    return {"ratio": draft.view["rate_ratio"]}


def _plane_tilt(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    x, y = vector(0.01 * size * spread(rng), rng)
    draft.view["plane_rad"] = (x, y)
    return {"x_rad": x, "y_rad": y}


def _trigger_jitter(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    draft.view["jitter_s"] = 6e-5 * size * spread(rng)
    return {"sd_s": draft.view["jitter_s"]}


def _nes_rocking(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    draft.plant.update(settling=0.7 * size * spread(rng), settling_s=float(rng.uniform(0.012, 0.025)))
    return {"relative": -draft.plant["settling"], "decay_s": draft.plant["settling_s"]}


def _restitution_drift(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    change = 0.25 * size * spread(rng) * sign(rng)
    if rng.random() < 0.5:
        per_run = change / max(runs - 1, 1)
        draft.run_restitution = 1.0 + per_run * np.arange(runs)
        return {"relative_per_run": per_run}
    draft.plant["ageing_per_s"] = -change
    return {"relative_per_s": change}


def _wall_lobes(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    order = int(rng.integers(3, 7))
    amplitude, phase = 0.004 * size * spread(rng), float(rng.uniform(0.0, 2.0 * np.pi / order))
    draft.plant.update(lobes=amplitude, lobe_order=float(order), lobe_phase_rad=phase)
    return {"amplitude": amplitude, "order": float(order), "direction_rad": phase}


def _inertia_error(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    ratio = 1.0 + 0.15 * size * spread(rng) * sign(rng)
    draft.plant["inertia_factor"] = 0.5 * ratio
    return {"ratio": ratio}


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


LISTED = [
    Cause("floor_friction", "flight", _floor_friction, listed=True),
    Cause("spin_coupling", "flight", _spin_coupling, listed=True, rivals=("floor_friction",)),
    Cause("viscous_drag", "flight", _viscous_drag, listed=True),
    Cause("air_drag", "flight", _air_drag, listed=True),
    Cause("table_tilt", "flight", _table_tilt, listed=True),
    Cause("vertical_motion", "flight", _vertical_motion, listed=True),
    Cause(
        "friction_drift",
        "flight",
        _friction_drift,
        listed=True,
        rivals=(
            "floor_friction",
            "spin_coupling",
        ),
    ),
    Cause("nes_rocking", "flight", _nes_rocking, listed=True),
    Cause("speed_dependent_restitution", "impact", _speed_dependent_restitution, listed=True),
    Cause("direction_dependent_restitution", "impact", _direction_dependent_restitution, listed=True),
    Cause("finite_contact_time", "impact", _finite_contact_time, listed=True),
    Cause("restitution_drift", "impact", _restitution_drift, listed=True),
    Cause("wall_ellipticity", "geometry", _wall_ellipticity, listed=True, round_only=True),
    Cause("wall_centre_offset", "geometry", _wall_centre_offset, listed=True),
    Cause("mass_centre_offset", "geometry", _mass_centre_offset, listed=True),
    Cause("centre_marker_offset", "geometry", _centre_marker_offset, listed=True),
    Cause("wall_lobes", "geometry", _wall_lobes, listed=True, round_only=True),
    Cause("inertia_error", "geometry", _inertia_error, listed=True),
    Cause("host_recoil", "drive", _host_recoil, listed=True),
    Cause("host_ringing", "drive", _host_ringing, listed=True, rivals=("host_recoil",)),
    Cause(
        "host_sway",
        "drive",
        _host_sway,
        listed=True,
        rivals=(
            "host_recoil",
            "host_ringing",
        ),
    ),
    Cause("camera_clock_offset", "measurement", _camera_clock_offset, listed=True),
    Cause("sensor_window_offset", "measurement", _sensor_window_offset, listed=True),
    Cause("length_scale_error", "measurement", _length_scale_error, listed=True),
    Cause("frame_rate_error", "measurement", _frame_rate_error, listed=True, steady_only=True),
    Cause("plane_tilt", "measurement", _plane_tilt, listed=True),
    Cause("trigger_jitter", "measurement", _trigger_jitter, listed=True),
    Cause("motion_blur", "measurement", _motion_blur, listed=True),
]

# In the order that a trial draws them in.
LISTED_GROUPS: dict[str, tuple[str, ...]] = {
    "listed": (
        "floor_friction",
        "spin_coupling",
        "viscous_drag",
        "air_drag",
        "table_tilt",
        "vertical_motion",
        "friction_drift",
        "speed_dependent_restitution",
        "direction_dependent_restitution",
        "finite_contact_time",
        "wall_ellipticity",
        "wall_centre_offset",
        "mass_centre_offset",
        "centre_marker_offset",
        "camera_clock_offset",
        "sensor_window_offset",
        "length_scale_error",
        "frame_rate_error",
        "plane_tilt",
        "trigger_jitter",
    ),
    # the library's further ones
    "further": (
        "nes_rocking",
        "restitution_drift",
        "wall_lobes",
        "inertia_error",
        "host_recoil",
        "host_ringing",
        "host_sway",
        "motion_blur",
    ),
}
