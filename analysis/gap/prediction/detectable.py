"""The smallest size of each effect that this series would have shown: the acceptance rules turned round.

Two things decide it: what the noise of these data lets stand out (``noise_limit``: the significance asked for, times
the Fisher information's standard deviation), and what is worth a name at all (calibration, placement of markers, lens).
``size`` is the larger. Beside them stands what was measured of each effect that was not named, with its sd of the noise
alone: often surely there, and too small to matter.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from analysis.contact.law import LawData
from analysis.contact.restitution import conditions
from analysis.flights.equation.model import GRAVITY_M_PER_S2
from analysis.flights.equation.parameters import INDEX
from analysis.gap import thresholds as rules
from analysis.gap.drive.findings import NEGLIGIBLE_SHARE
from analysis.gap.ladder import Ladder
from analysis.gap.measurement.two_views import LENS_TILTS
from analysis.gap.selection import inertia
from analysis.gap.selection.centres import centre_negligible_m
from analysis.gap.selection.flight_candidates import Gain
from analysis.gap.selection.impact_laws import HasLaw
from analysis.gap.selection.impact_steps import contact_negligible_s
from analysis.gap.selection.impacts.fit import ImpactFit
from analysis.gap.selection.impacts.gain import ImpactGain, negligible_share
from analysis.gap.thresholds import SIGNIFICANCE
from analysis.walls.outlines import Ring
from ovines.core.effects import EFFECTS

_MEASURED = {
    "camera_clock_offset": "offset_s",
    "sensor_window_offset": "u_px",
    "length_scale_error": "scale",
    "frame_rate_error": "ratio",
    "plane_tilt": "x_rad",
    "trigger_jitter": "sd_s",
    "motion_blur": "sd_s",
}
Entry = dict[str, Any]


def detectable_sizes(steps: Ladder) -> dict[str, Entry]:
    """``{effect: {"parameter", "size", "noise_limit", "limited_by", "measured", "measured_sd"}}``.

    Sizes of a ratio are its distance from 1.  ``measured`` is None for what is in the final model (see ``parameters``)
    and for what these data do not tell."""
    out = _of_measurement(steps)
    left = {g.term.name: g for g in steps.flights.left}
    for gain in steps.flights.gains:
        if len(gain.sd):
            out |= _of_flight(gain, left.get(gain.term.name, gain), steps)
    if steps.impacts.fitted is not None:
        impacts_left = {g.name: g for g in steps.impacts.left}
        out |= of_impacts(steps.impacts.fitted, impacts_left, steps.impacts.shape.finite)
        out |= _of_wall(steps.impacts.fitted, impacts_left, steps.measurement.lens_residual_found)
    out |= _of_centres(steps)
    if steps.inertia.impulse is not None:
        # What flights contradict is no inertia: they tell the stated one.
        size, sd = 0.0 if steps.inertia.contradicted else abs(steps.inertia.ratio - 1), steps.inertia.sd
        out["inertia_error"] = _entry("ratio", inertia.NEGLIGIBLE, rules.SIGNIFICANCE * sd, (size, sd))
    if steps.drive.tells_sway:
        least = float(np.sqrt(2)) * NEGLIGIBLE_SHARE * steps.series.runs[0].data.contact_radius_m
        out["host_sway"] = _entry("amplitude_m", least, None)
    out.setdefault("centre_marker_offset", _entry("x_m", centre_negligible_m(steps.series), None))
    for cause in steps.causes:
        if cause.effect in out:
            out[cause.effect] |= {"measured": None, "measured_sd": None}
    return {k: v for k, v in out.items() if np.isfinite(v["size"])}


def _of_measurement(steps: Ladder) -> dict[str, Entry]:
    out: dict[str, Entry] = {}
    lens = steps.measurement.lens_residual_found or steps.measurement.lens_learnt
    for effect, parameter in _MEASURED.items():
        finding = steps.measurement.findings.get(effect)
        if finding is not None:
            sd = max(s for _, s in finding.parameters.values())
            by_lens = lens and effect in ("plane_tilt", "sensor_window_offset")
            noise = (LENS_TILTS if by_lens else SIGNIFICANCE) * sd
            out[effect] = _entry(parameter, finding.least, noise, (finding.size, sd))
    return out


def _of_centres(steps: Ladder) -> dict[str, Entry]:
    out: dict[str, Entry] = {}
    for offset in steps.centres:
        parameter, (_, sd) = next(iter(offset.parameters.items()))
        size = float(np.linalg.norm([v for v, _ in offset.parameters.values()]))
        noise = None if offset.effect == "centre_marker_offset" else rules.SIGNIFICANCE * size / np.sqrt(offset.gain)
        out[offset.effect] = _entry(parameter, size / max(offset.strength, 1e-9), noise, (size, sd))
    return out


def _entry(
    parameter: str, negligible: float, noise: float | None, measured: tuple[float, float] | None = None
) -> Entry:
    size = max(negligible, noise or 0.0)
    return {
        "parameter": parameter,
        "size": float(size),
        "noise_limit": None if noise is None or not np.isfinite(noise) else float(noise),
        "limited_by": "noise" if noise is not None and noise >= negligible else "what counts as negligible",
        "measured": None if measured is None else float(measured[0]),
        "measured_sd": None if measured is None else float(measured[1]),
    }


def _of_flight(gain: Gain, left: Gain, steps: Ladder) -> dict[str, Entry]:
    noise = rules.SIGNIFICANCE * float(gain.sd[0])
    name, units = gain.term.name, steps.flights.units
    negligible = units.negligible_m_per_s2
    known = len(left.sd) > 0 and bool(np.isfinite(left.sd).all())
    measured = (
        (float(np.linalg.norm(left.estimate[:2] if name == "table_tilt" else left.estimate[:1])), float(left.sd[0]))
        if known
        else None
    )
    if left.pushes and measured is not None:  # a drag below nothing is none
        measured = (0.0, measured[1])
    if name == "table_tilt":
        return {
            name: _entry(
                "tilt_rad",
                negligible / GRAVITY_M_PER_S2,
                noise / GRAVITY_M_PER_S2,
                measured and (measured[0] / GRAVITY_M_PER_S2, measured[1] / GRAVITY_M_PER_S2),
            )
        }
    if name == "vertical_motion":
        friction = max(float(steps.flights.fitted.model.parameters[INDEX["friction"]]), 1e-3)
        omega = float(np.median([r.data.host.omega_rad_per_s for r in steps.series.runs]))
        if omega == 0:
            return {}
        # The rms of mu z'' equals the negligible acceleration; the load's column is per unit of the measured z'', so
        # its sd is no length.
        return {name: _entry("amplitude_m", float(np.sqrt(2) * negligible / (friction * omega**2)), None)}
    own = EFFECTS[name].in_flights
    assert own is not None and own.parameter, f"{name}: which of its parameters is its size?"
    return {name: _entry(own.parameter, negligible / max(units.of(gain.term.columns[0]), 1e-12), noise, measured)}


def of_impacts(impacts: HasLaw, left: dict[str, ImpactGain], lasts: bool) -> dict[str, Entry]:
    """Restitution's effects, of contacts that last or not.  An amplitude a of a cosine over K impacts has sd scatter
    sqrt(2/K); its rms is a/sqrt 2."""
    data, law = impacts.data, impacts.law
    sd = np.sqrt(2 / max(len(data), 1)) * max(law.scatter, float(np.median(data.normal_sd / data.before)))
    spread = float(np.std(np.exp(-data.before / 1.2))) or 1.0
    worth = negligible_share("restitution", lasts)
    return {
        "direction_dependent_restitution": _entry(
            "amplitude",
            float(np.sqrt(2) * worth),
            rules.SIGNIFICANCE * sd,
            _measured(left.get("direction_dependent_restitution")),
        ),
        "speed_dependent_restitution": _entry(
            "restitution_fast",
            worth / spread,
            rules.SIGNIFICANCE * sd / np.sqrt(2) / spread,
            _measured(left.get("speed_dependent_restitution")),
        ),
        **_of_drift(data, law.restitution, (worth, sd / np.sqrt(2)), left.get("restitution_drift")),
    }


def _of_drift(
    data: LawData, restitution: float, least: tuple[float, float], left: ImpactGain | None
) -> dict[str, Entry]:
    """Drift over the runs, or within them where there is one; ``least``: what is worth to be said of a restitution, and
    the sd of the mean of a column of unit spread."""
    at, (worth, sd) = conditions(data), least
    i = int(np.ptp(at.run) > 0)
    parameter, column = (("relative_per_s", at.since_start_s), ("relative_per_run", at.run))[i]
    if not np.ptp(column):
        return {}
    spread = float(np.std(column)) * restitution
    measured = None if left is None else (abs(float(left.estimate[i])) / restitution, float(left.sd[i]) / restitution)
    size = worth / spread
    return {"restitution_drift": _entry(parameter, size, rules.SIGNIFICANCE * sd / spread, measured)}


def _measured(gain: ImpactGain | None) -> tuple[float, float] | None:
    return None if gain is None else (float(np.linalg.norm(gain.estimate[:2])), float(gain.sd[0]))


def _of_wall(impacts: ImpactFit, left: dict[str, ImpactGain], lens_residual_found: bool) -> dict[str, Entry]:
    """Shape of the wall and lasting contact, from the contact distance."""
    scatter, radius = impacts.wall.scatter_m, impacts.wall.wall.size_m
    noise_m = rules.SIGNIFICANCE * scatter * np.sqrt(2 / max(int(impacts.wall.used.sum()), 1))
    speed = impacts.data.before
    per_slope = (1 + impacts.law.restitution) / max(impacts.law.restitution, 0.05)
    ellipse = rules.ELLIPTICITY_UNDER_LENS if lens_residual_found else rules.ELLIPTICITY_NEGLIGIBLE
    finite = left.get("finite_contact_time")
    found = {
        "finite_contact_time": _entry(
            "duration_s",
            contact_negligible_s(impacts),
            noise_m / np.sqrt(2) / max(float(np.std(speed)), 1e-6) * per_slope,
            None if finite is None else (float(finite.estimate[-1]) * per_slope, float(finite.sd[-1]) * per_slope),
        ),
        "wall_ellipticity": _entry("ellipticity", ellipse, noise_m / radius, _measured(left.get("wall_ellipticity"))),
        "wall_lobes": _entry("amplitude", ellipse, noise_m / radius, _measured(left.get("wall_lobes"))),
    }
    return (
        found if isinstance(impacts.wall.wall.outline, Ring) else {"finite_contact_time": found["finite_contact_time"]}
    )
