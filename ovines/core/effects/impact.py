"""Effects on the impact: restitution that varies, contact that lasts."""

from __future__ import annotations

import math

from ovines.core.effects.effect import Effect, EffectParameter, Values, with_floats
from ovines.core.system import parameters as P
from ovines.core.system.model import Scenario
from ovines.core.system.packed import Packed

INF = math.inf


def _speed_dependent(packed: Packed, values: Values, scenario: Scenario) -> Packed:
    changes = {P.RESTITUTION_FAST: values["restitution_fast"], P.RESTITUTION_SPEED: values["speed_scale_m_per_s"]}
    return with_floats(packed, changes)


def _direction_dependent(packed: Packed, values: Values, scenario: Scenario) -> Packed:
    changes = {P.RESTITUTION_SWING: values["amplitude"], P.RESTITUTION_DIRECTION: values["direction_rad"]}
    return with_floats(packed, changes)


def _restitution_drift(packed: Packed, values: Values, scenario: Scenario) -> Packed:
    changes = {
        P.RESTITUTION_PER_S: values["relative_per_s"],
        P.RESTITUTION_OF_RUN: values["relative_per_run"] * scenario.run_number,
    }
    return with_floats(packed, changes)


def _finite_contact(packed: Packed, values: Values, scenario: Scenario) -> Packed:
    return with_floats(packed, {P.CONTACT_DURATION: values["duration_s"]})


IMPACT_EFFECTS = (
    Effect(
        "speed_dependent_restitution", "impact",
        (
            EffectParameter("restitution_fast", "1", 0.0, 1.0),
            EffectParameter("speed_scale_m_per_s", "m/s", 1e-9, INF, 1.0),
        ),
        "eps(v) = eps_fast + (eps_0 - eps_fast) exp(-v/v_s), v the normal approach speed, eps_0 the nominal "
        "restitution: losses grow with speed (plastic or viscous contact).",
        _speed_dependent,
    ),
    Effect(
        "direction_dependent_restitution", "impact",
        (
            EffectParameter("amplitude", "1", -1.0, 1.0),
            EffectParameter("direction_rad", "rad", -INF, INF, 0.0),
        ),
        "eps_0 + a cos(azimuth - phi), azimuth of the contact from the Host's centre, world frame, kept in 0..1: "
        "a wall that is stiffer on one side.",
        _direction_dependent,
    ),
    Effect(
        "restitution_drift", "impact",
        (
            EffectParameter("relative_per_s", "1/s", -INF, INF, 0.0),
            EffectParameter("relative_per_run", "1/run", -INF, INF, 0.0),
        ),
        "Restitution times (1 + a t)(1 + b run), kept in 0..1: a wall that wears, hardens or warms.",
        _restitution_drift,
    ),
    Effect(
        "finite_contact_time", "impact", (EffectParameter("duration_s", "s", 0.0, 0.1),),
        "A Kelvin-Voigt contact of half period T with the same restitution, a tangential spring with a Coulomb limit "
        "that reverses beta_0 of the slip when it sticks. The disk enters the wall by about v T / pi meanwhile.",
        _finite_contact,
    ),
)  # fmt: skip
