"""Effects on the impact: restitution that varies, contact that lasts."""

from __future__ import annotations

import math

from ovines.core.effects.effect import Effect, EffectParameter, Values, Words, with_floats
from ovines.core.effects.law_form import FactorForm, LawForm
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
            EffectParameter("restitution_fast", "1", 0.0, 1.0, row="restitution_fast"),
            EffectParameter("speed_scale_m_per_s", "m/s", 1e-9, INF, 1.0, row="restitution_speed_scale_m_per_s"),
        ),
        "eps(v) = eps_fast + (eps_0 - eps_fast) exp(-v/v_s), v the normal approach speed, eps_0 the nominal "
        "restitution: losses grow with speed (plastic or viscous contact).",
        Words(
            "Restitution that depends on speed",
            "harder impacts give back another share",
            "Drop the disk against the wall at 0.3, 1 and 3 m/s by hand launches: restitution against speed alone.",
        ),
        _speed_dependent,
        forms=(LawForm("restitution", (FactorForm("approach", "exponential"),)),),
        views=(("restitution", "approach speed"), ("restitution", "azimuth in the room")),
    ),
    Effect(
        "direction_dependent_restitution", "impact",
        (
            EffectParameter("amplitude", "1", -1.0, 1.0, row="restitution_direction_amplitude"),
            EffectParameter("direction_rad", "rad", -INF, INF, 0.0, row="restitution_direction_rad"),
        ),
        "eps_0 + a cos(azimuth - phi), azimuth of the contact from the Host's centre, world frame, kept in 0..1: "
        "a wall that is stiffer on one side.",
        Words(
            "Restitution that depends on direction",
            "the wall gives back more on one side",
            "Turn the ring by 90 degrees in its mount: a stiffness of the ring turns with it, one of the mount does "
            "not.",
        ),
        _direction_dependent,
        forms=(LawForm("restitution", (FactorForm("azimuth", "cosine"),), by_any_function=True),),
        views=(("restitution", "azimuth in the room"), ("restitution", "approach speed")),
    ),
    Effect(
        "restitution_drift", "impact",
        (
            EffectParameter("relative_per_s", "1/s", -INF, INF, 0.0, row="restitution_drift_per_s"),
            EffectParameter("relative_per_run", "1/run", -INF, INF, 0.0, row="restitution_drift_per_run"),
        ),
        "Restitution times (1 + a t)(1 + b run), kept in 0..1: a wall that wears, hardens or warms.",
        Words(
            "Drift of the restitution",
            "the wall gives back more or less over a run or over the series",
            "Repeat the first run at the end of the series, and once more after the ring has been turned: wear stays "
            "at its place, warmth goes.",
        ),
        _restitution_drift,
        forms=tuple(LawForm("restitution", (FactorForm(one),)) for one in ("time", "run")),
        views=(("restitution", "run"), ("restitution", "time in the run")),
    ),
    Effect(
        "finite_contact_time", "impact", (EffectParameter("duration_s", "s", 0.0, 0.1, row="contact_duration_s"),),
        "A Kelvin-Voigt contact of half period T with the same restitution, a tangential spring with a Coulomb limit "
        "that reverses beta_0 of the slip when it sticks. The disk enters the wall by about v T / pi meanwhile.",
        Words(
            "Contact of finite duration",
            "the wall yields: the contact is no instant",
            "Film one impact at ten times the frame rate: the disk's centre goes past the contact radius by about v "
            "T / pi.",
        ),
        _finite_contact,
        views=(("distance", "approach speed"), ("distance", "azimuth in the room")),
    ),
)  # fmt: skip
