"""The smallest size of each effect that this series would have shown: the acceptance rules turned round."""

from __future__ import annotations

from typing import Any

import numpy as np

from analysis.flight_model import GRAVITY_M_PER_S2, INDEX
from analysis.gap import cause as rules
from analysis.gap.finding import NEGLIGIBLE as MEASUREMENT_NEGLIGIBLE
from analysis.gap.finding import SIGNIFICANT
from analysis.gap.flight_stage import Gain
from analysis.gap.flight_terms import NEGLIGIBLE_M_PER_S2
from analysis.gap.impact_stage import NEGLIGIBLE as IMPACT_NEGLIGIBLE
from analysis.gap.ladder import Ladder
from analysis.gap.two_views import LENS_TILTS

_MEASURED = {"camera_clock_offset": "offset_s", "sensor_window_offset": "u_px", "length_scale_error": "scale", "frame_rate_error": "ratio",
             "plane_tilt": "x_rad", "trigger_jitter": "sd_s"}


def detectable_sizes(climbed: Ladder) -> dict[str, dict[str, Any]]:
    """``{effect: {"parameter", "size"}}``; ``size`` of a ratio is its distance from 1."""
    out: dict[str, dict[str, Any]] = {}
    for effect, parameter in _MEASURED.items():
        finding = climbed.measurement.findings.get(effect)
        if finding is not None:
            sd = max(s for _, s in finding.parameters.values())
            factor = LENS_TILTS if climbed.measurement.lens_seen and effect in ("plane_tilt", "sensor_window_offset") else SIGNIFICANT
            out[effect] = {"parameter": parameter, "size": float(max(MEASUREMENT_NEGLIGIBLE[effect], factor * sd))}
    for gain in climbed.flight_gains:
        size = _flight_size(gain, climbed)
        if size:
            out[gain.term.name] = size
    if climbed.impacts is not None:
        data, law = climbed.impacts.data, climbed.impacts.law
        # An amplitude a of a cosine over K impacts has sd scatter sqrt(2/K); its rms is a/sqrt 2.
        sd = np.sqrt(2 / max(len(data), 1)) * max(law.scatter, float(np.median(data.normal_sd / data.before)))
        amplitude = float(max(np.sqrt(2) * IMPACT_NEGLIGIBLE["restitution"], rules.SIGNIFICANCE * sd))
        out["direction_dependent_restitution"] = {"parameter": "amplitude", "size": amplitude}
        spread = float(np.std(np.exp(-data.before / 1.2))) or 1.0
        fall = float(max(IMPACT_NEGLIGIBLE["restitution"] / spread, rules.SIGNIFICANCE * sd / np.sqrt(2) / spread))
        out["speed_dependent_restitution"] = {"parameter": "restitution_fast", "size": fall}
        out["finite_contact_time"] = {"parameter": "duration_s", "size": rules.CONTACT_TIME_NEGLIGIBLE_S}
        out["wall_ellipticity"] = {"parameter": "ellipticity", "size": rules.ELLIPTICITY_UNDER_LENS if climbed.measurement.lens_seen else rules.ELLIPTICITY_NEGLIGIBLE}
        out["wall_centre_offset"] = {"parameter": "x_m", "size": rules.CENTRE_NEGLIGIBLE_M}
        out["mass_centre_offset"] = {"parameter": "x_m", "size": rules.MASS_CENTRE_NEGLIGIBLE_M}
    out["centre_marker_offset"] = {"parameter": "x_m", "size": rules.CENTRE_NEGLIGIBLE_M}
    return {k: v for k, v in out.items() if np.isfinite(v["size"])}


def _flight_size(gain: Gain, climbed: Ladder) -> dict[str, Any] | None:
    if not len(gain.sd):
        return None
    noise = rules.SIGNIFICANCE * float(gain.sd[0])
    name = gain.term.name
    if name == "table_tilt":
        return {"parameter": "tilt_rad", "size": max(NEGLIGIBLE_M_PER_S2, noise) / GRAVITY_M_PER_S2}
    if name == "vertical_motion":
        friction = max(float(climbed.flight.model.parameters[INDEX["friction"]]), 1e-3)
        omega = float(np.median([r.data.host.omega_rad_per_s for r in climbed.series.runs]))
        if omega == 0:
            return None
        # rms of mu z'' equals the negligible acceleration
        return {"parameter": "amplitude_m", "size": float(np.sqrt(2) * NEGLIGIBLE_M_PER_S2 / (friction * omega**2))}
    parameter = {"viscous_drag": "rate_per_s", "air_drag": "rate_per_m", "friction_drift": "relative_per_s"}[name]
    return {"parameter": parameter, "size": max(NEGLIGIBLE_M_PER_S2 / gain.term.scale[0], noise)}
