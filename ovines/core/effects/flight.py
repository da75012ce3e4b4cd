"""Effects on the free flight: friction, drag, tilt, vertical motion, drift."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ovines.core.effects.effect import Effect, EffectParameter, InFlights, Values, VectorRows, Words, with_floats
from ovines.core.effects.law_form import FactorForm, LawForm
from ovines.core.refusal import require
from ovines.core.system import parameters as P
from ovines.core.system.model import Scenario
from ovines.core.system.packed import ACCELERATION_OF_GRAVITY, AXES, Packed

INF = math.inf


def _floor_friction(packed: Packed, values: Values, scenario: Scenario) -> Packed:
    load = scenario.friction.load_m_per_s2 if scenario.friction else ACCELERATION_OF_GRAVITY
    return with_floats(packed, {P.FLOOR_FRICTION: values["coefficient"], P.FLOOR_LOAD: load})


def _spin_coupling(packed: Packed, values: Values, scenario: Scenario) -> Packed:
    return with_floats(packed, {P.COUPLING: values["coupling"]})


def _viscous_drag(packed: Packed, values: Values, scenario: Scenario) -> Packed:
    return with_floats(packed, {P.VISCOUS_DRAG: values["rate_per_s"]})


def _air_drag(packed: Packed, values: Values, scenario: Scenario) -> Packed:
    return with_floats(packed, {P.AIR_DRAG: values["rate_per_m"]})


def _table_tilt(packed: Packed, values: Values, scenario: Scenario) -> Packed:
    load = scenario.friction.load_m_per_s2 if scenario.friction else ACCELERATION_OF_GRAVITY
    pull = load * values["tilt_rad"]
    x = packed.p[P.GRAVITY_X] + pull * math.cos(values["direction_rad"])
    y = packed.p[P.GRAVITY_Y] + pull * math.sin(values["direction_rad"])
    return with_floats(packed, {P.GRAVITY_X: x, P.GRAVITY_Y: y})


def _vertical_motion(packed: Packed, values: Values, scenario: Scenario) -> Packed:
    plane = [row for row in packed.drive if row[P.AXIS] < 2 and row[P.OMEGA] > 0.0]
    require(bool(plane), "effects.vertical_motion without a drive along x or y", "a driven Host",
            "give [host.drive], or put a z harmonic there yourself")  # fmt: skip
    row = np.array([[AXES["z"], values["amplitude_m"], plane[0][P.OMEGA], values["phase_rad"]]])
    return replace(packed.copy(), drive=np.vstack([packed.drive, row]))


def _friction_drift(packed: Packed, values: Values, scenario: Scenario) -> Packed:
    factor = max(1.0 + values["relative_per_run"] * scenario.run_number, 0.0)
    strength = packed.p[P.FLOOR_FRICTION] * factor
    return with_floats(packed, {P.FLOOR_FRICTION: strength, P.DRIFT_PER_S: values["relative_per_s"]})


def _rocking(packed: Packed, values: Values, scenario: Scenario) -> Packed:
    return with_floats(packed, {P.ROCKING: values["relative"], P.ROCKING_S: values["decay_s"]})


FLIGHT_EFFECTS = (
    Effect(
        "floor_friction", "flight", (EffectParameter("coefficient", "1", 0.0, INF, row="floor_friction"),),
        "Coulomb friction on the Host's floor (thesis Eq. 22, 45); steel on PVC 0.2-0.3 in the practice series.",
        Words(
            "Floor friction",
            "the disk is braked by the Host's floor",
            "Flick the disk over the Host's floor at rest and let it stop twice, once spinning: the stopping "
            "distance gives mu_s alone.",
        ),
        _floor_friction,
        views=(("along sliding", "sliding speed"), ("along sliding", "time in the run")),
    ),
    Effect(
        "spin_coupling", "flight", (EffectParameter("coupling", "1", 0.0, 1.0, 1.0),),
        "Sliding and spinning friction of one contact area (Farkas 2003; thesis Eq. 45-54): 0 plain Coulomb, "
        "1 a uniformly loaded disk. Spin lightens the friction on sliding and decays.",
        Words(
            "Spin coupling of the friction",
            "a spinning disk is braked less along its path",
            "Flick the disk once without spin and once with a fast one: with coupling the spinning disk slides "
            "further.",
        ),
        _spin_coupling,
        views=(("along sliding", "rim over sliding speed"), ("along sliding", "sliding speed")),
    ),
    Effect(
        "viscous_drag", "flight", (EffectParameter("rate_per_s", "1/s", 0.0, INF, row="viscous_drag_per_s"),),
        "Acceleration -c v against the room. The air film under a washer of 25 g gives 0.01-1 1/s.",
        Words(
            "Viscous drag",
            "a drag proportional to the disk's speed",
            "Let the disk coast over twice the distance at 2 m/s and at 0.5 m/s: drag proportional to v keeps the "
            "relative loss equal.",
        ),
        _viscous_drag,
        in_flights=InFlights(
            ("viscous",), "a force along the path that grows with the speed", "rate_per_s", drags=True
        ),
        forms=(LawForm("along_velocity", (FactorForm("speed"),)),),
        views=(("along the path", "speed"), ("along sliding", "sliding speed")),
    ),
    Effect(
        "air_drag", "flight", (EffectParameter("rate_per_m", "1/m", 0.0, INF, row="air_drag_per_m"),),
        "Acceleration -c |v| v against the room; c = rho C_d A / (2 m), 0.005 1/m for the bare washer.",
        Words(
            "Air drag",
            "a drag that grows with the square of the disk's speed",
            "Let the disk coast at 2 m/s and at 0.5 m/s, and once with a card of twice its area on it: quadratic "
            "drag grows with both.",
        ),
        _air_drag,
        in_flights=InFlights(
            ("air",), "a force along the path that grows with the square of the speed", "rate_per_m", drags=True
        ),
        forms=(LawForm("along_velocity", (FactorForm("speed", "power", 2.0),)),),
        views=(("along the path", "speed"), ("along sliding", "sliding speed")),
    ),
    Effect(
        "table_tilt", "flight",
        (
            EffectParameter("tilt_rad", "rad", 0.0, 0.5),
            EffectParameter("direction_rad", "rad", -INF, INF, 0.0),
        ),
        "Constant acceleration g times tilt, towards the direction (world frame, from x). A spirit level shows 1e-3.",
        Words(
            "Table tilt",
            "the sliding plane is not level",
            "Turn the Host by 90 degrees on the shaker and repeat: a tilted table stays in the room, a force of the "
            "Host turns with it.",
        ),
        _table_tilt,
        in_flights=InFlights(("tilt_x", "tilt_y"), "a constant force in the room"),
        forms=(LawForm("fixed_direction"),),
        rows=VectorRows(("table_tilt_x_m_per_s2", "table_tilt_y_m_per_s2"), ACCELERATION_OF_GRAVITY),
        views=(("x", "time in the run"), ("y", "time in the run")),
    ),
    Effect(
        "vertical_motion", "flight",
        (
            EffectParameter("amplitude_m", "m", 0.0, INF),
            EffectParameter("phase_rad", "rad", -INF, INF, 0.0),
        ),
        "Host's harmonic z at the drive's frequency; the floor load becomes m (g + z''). At 11 Hz 0.8 mm is 0.4 g.",
        Words(
            "Vertical motion of the Host",
            "its vertical acceleration changes the floor load and with it the friction",
            "Run once at half the level: z'' and the share of the load that follows it halve, a plain change of "
            "friction does not.",
        ),
        _vertical_motion,
        in_flights=InFlights(("load",), "friction that follows the Host's z''", named_at=1.0),
        forms=tuple(
            LawForm("floor_friction", (FactorForm(one, "cosine"),), by_any_function=True) for one in ("phase", "clock")
        ),
        views=(("along sliding", "vertical acceleration of the Host"), ("along sliding", "drive phase")),
    ),
    Effect(
        "friction_drift", "flight",
        (
            EffectParameter("relative_per_s", "1/s", -INF, INF, 0.0),
            EffectParameter("relative_per_run", "1/run", -INF, INF, 0.0),
        ),
        "Floor friction times (1 + a t)(1 + b run): wear, dust or charge (thesis Sec. 9.1 saw PVC washers slow down).",
        Words(
            "Drift of the friction",
            "the floor friction changes over a run or over the series",
            "Repeat the first run at the end of the series and clean the floor before one in the middle: wear stays, "
            "dust goes.",
        ),
        _friction_drift,
        in_flights=InFlights(("drift", "drift_run"), "friction that follows time and run", "relative_per_s"),
        forms=tuple(LawForm("floor_friction", (FactorForm(one),)) for one in ("time", "run")),
        views=(("along sliding", "time in the run"), ("along sliding", "run")),
    ),
    Effect(
        "nes_rocking", "flight",
        (
            EffectParameter("relative", "1", -1.0, INF),
            EffectParameter("decay_s", "s", 1e-6, INF, 0.02),
        ),
        "After each impact the disk rocks on its rim: floor friction times 1 + a exp(-s / T), s since the last impact. "
        "a is negative where it touches the floor less.",
        Words(
            "Rocking of the disk",
            "the floor brakes the disk less after each impact",
            "Film an impact from the side, in the plane of the floor: a disk that rocks lifts its rim for the time "
            "found.",
        ),
        _rocking,
        forms=(
            LawForm(
                "floor_friction", (FactorForm("since", "exponential", scale="decay_s"),), "relative", named=(-1.0, 0.0)
            ),
        ),
        views=(("along sliding", "time since the impact before"), ("along sliding", "sliding speed")),
    ),
)  # fmt: skip
