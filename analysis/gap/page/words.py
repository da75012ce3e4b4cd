"""Names, units and formats in which the gap's page speaks of effects and their parameters."""

from __future__ import annotations

from math import isfinite

from analysis.report.numbers import MISSING, interval, with_unit

#: the effect's name on the page, and what it says of the rig
EFFECTS: dict[str, tuple[str, str]] = {
    "floor_friction": ("Floor friction", "the disk is braked by the Host's floor"),
    "spin_coupling": ("Spin coupling of the friction", "a spinning disk is braked less along its path"),
    "viscous_drag": ("Viscous drag", "a drag proportional to the disk's speed"),
    "air_drag": ("Air drag", "a drag that grows with the square of the disk's speed"),
    "table_tilt": ("Table tilt", "the sliding plane is not level"),
    "vertical_motion": (
        "Vertical motion of the Host",
        "its vertical acceleration changes the floor load and with it the friction",
    ),
    "nes_rocking": (
        "Rocking of the disk",
        "the floor brakes the disk less after each impact",
    ),
    "friction_drift": ("Drift of the friction", "the floor friction changes over a run or over the series"),
    "speed_dependent_restitution": ("Restitution that depends on speed", "harder impacts give back another share"),
    "direction_dependent_restitution": (
        "Restitution that depends on direction",
        "the wall gives back more on one side",
    ),
    "restitution_drift": ("Drift of the restitution", "the wall gives back more or less over a run or over the series"),
    "finite_contact_time": ("Contact of finite duration", "the wall yields: the contact is no instant"),
    "wall_ellipticity": ("Oval wall", "the wall is not round"),
    "wall_lobes": ("Lobed wall", "the wall bulges at three or more places"),
    "wall_centre_offset": ("Wall centre off the markers' centre", "the wall is not where the Host's layout says"),
    "mass_centre_offset": ("Mass centre off the disk's centre", "the disk is not balanced"),
    "inertia_error": ("Inertia of the disk", "impulses turn the disk more or less than its stated inertia says"),
    "centre_marker_offset": ("Centre marker off the disk's centre", "the marker at the centre is not at the centre"),
    "stated_radius": ("Stated radius of the wall", "the wall is nearer or farther than recording.toml says"),
    "host_recoil": ("Recoil of the Host", "impacts push the Host off its drive, and it swings back"),
    "host_ringing": ("Ringing of the Host's markers", "what carries the Host's markers rings after impacts"),
    "host_sway": ("Sway of the Host", "the Host moves slowly beside its drive"),
    "camera_clock_offset": ("Clock offset between the cameras", "the second camera sees the world later or earlier"),
    "sensor_window_offset": ("Window offset of a camera", "a sensor window is elsewhere than the recording says"),
    "length_scale_error": ("Length scale", "the calibration's unit is off"),
    "frame_rate_error": ("Frame rate", "the true frame rate is not the nominal one"),
    "plane_tilt": ("Tilted world plane", "the world's z is not the sliding plane's normal"),
    "motion_blur": ("Motion blur", "markers are found less well the faster they move"),
    "trigger_jitter": ("Trigger jitter", "the frames' times scatter"),
}
STAGES = {
    "measurement": "in the measurement",
    "flight": "in free flight",
    "impact": "at the impacts",
    "geometry": "in the geometry of the contact",
    "drive": "in the drive",
}
#: ending of a parameter's name -> (factor to the shown unit, unit); longest first
_UNITS = (
    ("m_per_s", 1.0, "m/s"),
    ("per_run", 100.0, "% per run"),
    ("per_s", 1.0, "1/s"),
    ("per_m", 1.0, "1/m"),
    ("direction_rad", 57.29578, "°"),
    ("rad", 1e3, "mrad"),
    ("px", 1.0, "px"),
    ("_hz", 1.0, "Hz"),
    ("_kg", 1.0, "kg"),
    ("_m", 1e3, "mm"),
    ("_s", 1e6, "µs"),
)
_NAMES = {
    "restitution_fast": "restitution of fast impacts",
    "relative_per_s": "change over a run",
    "relative_per_run": "change from run to run",
    "sd_s": "scatter over the speed",
}
#: parameters that are ratios to 1
RATIOS = ("ratio", "scale")


def plain(effect: str) -> str:
    """Name for people; a name that is not in the list stays itself with its underscores gone."""
    return EFFECTS[effect][0] if effect in EFFECTS else effect.replace("_", " ")


def meaning(effect: str) -> str:
    """What an effect is, in a phrase; empty for one that the page has no words for."""
    return EFFECTS[effect][1] if effect in EFFECTS else ""


def unit_of(parameter: str) -> tuple[float, str]:
    """Factor and unit in which a parameter is shown, from its name's ending."""
    if parameter == "relative_per_s":
        return 100.0, "% per s"
    return next(((factor, unit) for ending, factor, unit in _UNITS if parameter.endswith(ending)), (1.0, ""))


def shown(parameter: str, value: float | None, digits: int = 3) -> str:
    """``tilt_rad, 0.01755`` -> ``17.6 mrad``; ratios to five decimals, because their fourth decides."""
    if value is None or not isfinite(value):
        return MISSING
    if parameter in RATIOS:
        return f"{value:.5f}"
    factor, unit = unit_of(parameter)
    return with_unit(factor * value, unit, digits)


def shown_interval(parameter: str, low: float, high: float) -> str:
    """An interval in the unit in which the parameter is shown."""
    if parameter in RATIOS:
        return f"{low:.5f} to {high:.5f}"
    factor, unit = unit_of(parameter)
    return interval(factor * low, factor * high, unit)


def parameter_words(parameter: str) -> str:
    """``speed_scale_m_per_s`` -> ``speed scale``."""
    if parameter in _NAMES:
        return _NAMES[parameter]
    for ending in ("_rad_per_s", "_m_per_s", "_per_s", "_per_m", "_rad", "_px", "_hz", "_kg", "_m", "_s"):
        if parameter.endswith(ending) and len(parameter) > len(ending):
            return parameter[: -len(ending)].replace("_", " ")
    return parameter.replace("_", " ")


def bare(text: str) -> str:
    """A title as it stands within a sentence."""
    return text[0].lower() + text[1:] if text[:2].istitle() else text
