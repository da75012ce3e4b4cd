"""The plant's causes: what each changes, how large it is at size 1, and in which stage it lies.

Sizes are those of this rig at which an experimenter would notice (severity 1); a third of it is where diagnosis is decided.
Every cause takes `size` (1.0 or 0.35, or anything positive) and draws its own directions and a spread of 15 %.
"""
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from analysis.blind.observe import ViewErrors
from analysis.blind.plant_state import PlantParameters

FULL_MODEL = ("floor_friction", "spin_coupling")


@dataclass
class Draft:
    """One series before it runs; causes edit it. `per_run` maps a run's number to further changes of the physics."""
    plant: dict[str, float] = field(default_factory=dict)
    view: dict[str, object] = field(default_factory=dict)
    model_effects: tuple[str, ...] = FULL_MODEL
    vertical_amplitude_m: float = 0.0
    run_friction: np.ndarray | None = None
    parameters: dict[str, dict[str, float]] = field(default_factory=dict)


Apply = Callable[[Draft, float, np.random.Generator, int], dict[str, float]]


@dataclass(frozen=True)
class Cause:
    """A cause by name: its stage, whether FORMATS.md lists it, and the function that puts it into a draft.
    The function returns the true parameters by the names that `diagnosis.json` uses where there are any."""
    name: str
    stage: str
    listed: bool
    apply: Apply


def _spread(rng: np.random.Generator) -> float:
    return float(rng.uniform(0.85, 1.15))


def _vector(size: float, rng: np.random.Generator) -> tuple[float, float]:
    angle = rng.uniform(0.0, 2.0 * np.pi)
    return float(size * np.cos(angle)), float(size * np.sin(angle))


def _sign(rng: np.random.Generator) -> float:
    return 1.0 if rng.random() < 0.5 else -1.0


def _floor_friction(draft, size, rng, runs):
    draft.model_effects = ()
    draft.plant["floor_friction"] *= size
    return {"coefficient": draft.plant["floor_friction"]}


def _spin_coupling(draft, size, rng, runs):
    draft.model_effects = ("floor_friction",)
    draft.plant["spin_share"] = size
    return {"share": size}


def _viscous_drag(draft, size, rng, runs):
    draft.plant["viscous_per_s"] = 0.6 * size * _spread(rng)
    return {"rate_per_s": draft.plant["viscous_per_s"]}


def _air_drag(draft, size, rng, runs):
    draft.plant["air_per_m"] = 0.45 * size * _spread(rng)
    return {"coefficient_per_m": draft.plant["air_per_m"]}


def _table_tilt(draft, size, rng, runs):
    x, y = _vector(0.17 * size * _spread(rng), rng)
    draft.plant.update(tilt_x_m_per_s2=x, tilt_y_m_per_s2=y)
    return {"acceleration_x_m_per_s2": x, "acceleration_y_m_per_s2": y, "tilt_rad": float(np.hypot(x, y) / 9.81)}


def _vertical_motion(draft, size, rng, runs):
    draft.vertical_amplitude_m = 7.5e-4 * size * _spread(rng)
    return {"amplitude_m": draft.vertical_amplitude_m}


def _friction_drift(draft, size, rng, runs):
    change = 0.4 * size * _spread(rng) * _sign(rng)
    if rng.random() < 0.5:
        draft.run_friction = 1.0 + change * (np.arange(runs) / max(runs - 1, 1) - 0.5)
        return {"change_over_series": change, "change_per_run": change / max(runs - 1, 1)}
    draft.plant["friction_change_per_s"] = change / 0.7
    return {"change_per_s": change / 0.7}


def _speed_dependent_restitution(draft, size, rng, runs):
    top = 0.86
    bottom = top - 0.33 * size * _spread(rng)
    speed = float(rng.uniform(0.9, 1.3))
    draft.plant.update(restitution=top, restitution_floor=bottom, restitution_speed_m_per_s=speed)
    return {"restitution_slow": top, "restitution_fast": bottom, "speed_m_per_s": speed}


def _direction_dependent_restitution(draft, size, rng, runs):
    amplitude, phase = 0.1 * size * _spread(rng), float(rng.uniform(0.0, 2.0 * np.pi))
    draft.plant.update(direction_amplitude=amplitude, direction_phase_rad=phase)
    return {"amplitude": amplitude, "phase_rad": phase}


def _finite_contact_time(draft, size, rng, runs):
    draft.plant.update(contact_time_s=7.7e-4 * size * _spread(rng), restitution_scatter=0.0,
                       contact_shear_share=float(rng.uniform(0.75, 0.95)))
    return {"duration_s": draft.plant["contact_time_s"]}


def _wall_ellipticity(draft, size, rng, runs):
    amplitude, phase = 0.005 * size * _spread(rng), float(rng.uniform(0.0, np.pi))
    draft.plant.update(ellipticity=amplitude, ellipticity_phase_rad=phase)
    return {"ellipticity": amplitude, "phase_rad": phase}


def _wall_centre_offset(draft, size, rng, runs):
    x, y = _vector(4e-4 * size * _spread(rng), rng)
    draft.plant.update(wall_x_m=x, wall_y_m=y)
    return {"x_m": x, "y_m": y}


def _mass_centre_offset(draft, size, rng, runs):
    x, y = _vector(4e-4 * size * _spread(rng), rng)
    draft.plant.update(mass_x_m=x, mass_y_m=y)
    return {"x_m": x, "y_m": y}


def _centre_marker_offset(draft, size, rng, runs):
    x, y = _vector(4.2e-4 * size * _spread(rng), rng)
    draft.view["centre_marker_offset_m"] = (x, y)
    return {"x_m": x, "y_m": y}


def _camera_clock_offset(draft, size, rng, runs):
    draft.view["clock_s"] = 4.2e-4 * size * _spread(rng) * _sign(rng)
    return {"offset_s": draft.view["clock_s"]}


def _sensor_window_offset(draft, size, rng, runs):
    across, along = max(round(3 * size), 1) * _sign(rng), max(round(2 * size), 1) * _sign(rng)
    draft.view.update(window_px=(across, along), window_camera=int(rng.integers(2)))
    return {"u_px": across, "v_px": along, "camera": float(draft.view["window_camera"])}


def _length_scale_error(draft, size, rng, runs):
    draft.view["scale"] = 1.0 + 0.0116 * size * _spread(rng) * _sign(rng)
    return {"scale": draft.view["scale"]}


def _frame_rate_error(draft, size, rng, runs):
    draft.view["rate_ratio"] = 1.0 + 0.002 * size * _spread(rng) * _sign(rng)
    return {"ratio": draft.view["rate_ratio"]}


def _plane_tilt(draft, size, rng, runs):
    x, y = _vector(0.01 * size * _spread(rng), rng)
    draft.view["plane_rad"] = (x, y)
    return {"about_x_rad": x, "about_y_rad": y}


def _trigger_jitter(draft, size, rng, runs):
    draft.view["jitter_s"] = 6e-5 * size * _spread(rng)
    return {"sd_s": draft.view["jitter_s"]}


def _changes(scale: dict[str, float], angles: tuple[str, ...] = (), signed: bool = False) -> Apply:
    """A cause that sets numbers proportional to its size and draws the named angles at random."""
    def apply(draft, size, rng, runs):
        factor = size * _spread(rng) * (_sign(rng) if signed else 1.0)
        out = {name: value * factor for name, value in scale.items()}
        out.update({name: float(rng.uniform(0.0, 2.0 * np.pi)) for name in angles})
        draft.plant.update(out)
        return out
    return apply


def _pull(draft, size, rng, runs):
    x, y = _vector(0.02, rng)
    out = {"pull_m_per_s2": 0.7 * size * _spread(rng), "pull_x_m": x, "pull_y_m": y}
    draft.plant.update(out)
    return out


def _patch(draft, size, rng, runs):
    x, y = _vector(0.018, rng)
    out = {"patch_amplitude": 0.9 * size * _spread(rng), "patch_x_m": x, "patch_y_m": y}
    draft.plant.update(out)
    return out


def _wobble(draft, size, rng, runs):
    draft.view.update(wobble_px=0.9 * size * _spread(rng), wobble_hz=float(rng.uniform(15.0, 60.0)))
    return {"amplitude_px": draft.view["wobble_px"], "frequency_hz": draft.view["wobble_hz"]}


LISTED = [Cause(name, stage, True, globals()["_" + name]) for stage, names in {
    "flight": ("floor_friction", "spin_coupling", "viscous_drag", "air_drag", "table_tilt", "vertical_motion", "friction_drift"),
    "impact": ("speed_dependent_restitution", "direction_dependent_restitution", "finite_contact_time"),
    "geometry": ("wall_ellipticity", "wall_centre_offset", "mass_centre_offset", "centre_marker_offset"),
    "measurement": ("camera_clock_offset", "sensor_window_offset", "length_scale_error", "frame_rate_error", "plane_tilt",
                    "trigger_jitter")}.items() for name in names]
UNLISTED = [
    Cause("unknown_central", "flight", False, _changes({"central_per_s2": 13.3})),
    Cause("unknown_magnus", "flight", False, _changes({"magnus": 0.005}, signed=True)),
    Cause("unknown_magnetic_pull", "flight", False, _pull),
    Cause("unknown_patchy_friction", "flight", False, _patch),
    Cause("unknown_anisotropic_friction", "flight", False, _changes({"anisotropy": 0.25}, ("anisotropy_phase_rad",))),
    Cause("unknown_spin_drag", "flight", False, _changes({"spin_drag_per_s": 1.5})),
    Cause("unknown_hop", "flight", False, _changes({"hop_s": 0.012})),
    Cause("unknown_soft_spot", "impact", False, _changes({"soft_amplitude": 0.25}, ("soft_azimuth_rad",))),
    Cause("unknown_drive_phase_restitution", "impact", False, _changes({"phase_amplitude": 0.12}, ("phase_rad",))),
    Cause("unknown_spin_restitution", "impact", False, _changes({"spin_restitution_s": 0.0012})),
    Cause("unknown_ageing_restitution", "impact", False, _changes({"ageing_per_s": 0.35})),
    Cause("unknown_wall_friction_azimuth", "impact", False,
          _changes({"wall_friction_amplitude": 0.6}, ("wall_friction_phase_rad",))),
    Cause("unknown_camera_wobble", "measurement", False, _wobble),
]
CAUSES: dict[str, Cause] = {cause.name: cause for cause in LISTED + UNLISTED}


def draft_series(kind: str, size: float, rng: np.random.Generator, runs: int) -> Draft:
    """Ordinary physics with the causes of `kind` ("none", a name of CAUSES, or two joined by +) put in at `size`."""
    draft = Draft(plant={
        "restitution": rng.uniform(0.69, 0.80), "restitution_scatter": float(rng.choice([0.0, 0.015, 0.03])),
        "wall_friction": rng.uniform(0.115, 0.195), "tangential_restitution": rng.uniform(0.32, 0.58),
        "floor_friction": rng.uniform(0.18, 0.35)})
    names = [] if kind == "none" else kind.split("+")
    for name in names:
        draft.parameters[name] = {key: float(value) for key, value in CAUSES[name].apply(draft, size, rng, runs).items()}
    return draft


def physics_of_run(draft: Draft, run: int, drive_rad_per_s: float, duration_s: float) -> PlantParameters:
    """The numbers of one run: the draft's, with what differs from run to run."""
    numbers = dict(draft.plant, drive_rad_per_s=drive_rad_per_s, duration_s=duration_s)
    if draft.run_friction is not None:
        numbers["floor_friction"] *= draft.run_friction[run]
    return PlantParameters(**{key: float(value) for key, value in numbers.items()})


def view_of(draft: Draft) -> ViewErrors:
    """The measurement errors of the draft."""
    return ViewErrors(**draft.view)
