"""The causes that FORMATS.md lists, at the sizes of this rig.

Each returns its true parameters by the names of `ovines simulate` and `diagnosis.json`, relative changes
from the first run or from a run's start as these count them.
"""

import numpy as np

from analysis.blind.plant.parameters import PlantParameters
from analysis.blind.recording.draft import Cause, Draft, Rng, Truth, sign, spread, vector


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


LISTED = [
    Cause(name, stage, True, globals()["_" + name])
    for stage, names in {
        "flight": (
            "floor_friction",
            "spin_coupling",
            "viscous_drag",
            "air_drag",
            "table_tilt",
            "vertical_motion",
            "friction_drift",
        ),
        "impact": ("speed_dependent_restitution", "direction_dependent_restitution", "finite_contact_time"),
        "geometry": ("wall_ellipticity", "wall_centre_offset", "mass_centre_offset", "centre_marker_offset"),
        "measurement": (
            "camera_clock_offset",
            "sensor_window_offset",
            "length_scale_error",
            "frame_rate_error",
            "plane_tilt",
            "trigger_jitter",
        ),
    }.items()
    for name in names
]
