"""Effects on the Host's motion: it steps back at impacts, rings after them, sways beside its drive."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ovines.core import state as S
from ovines.core.effects.effect import Effect, EffectParameter, Measurement, Values, Words
from ovines.core.refusal import require
from ovines.core.system import parameters as P
from ovines.core.system.host import base_motion_at
from ovines.core.system.model import Scenario
from ovines.core.system.packed import AXES, Packed

INF = math.inf
# The Host's rotation does not give: its inertia is this many times that of a ring of its effective mass.
STIFF_ROTATION = 1e6


def _sway(packed: Packed, values: Values, scenario: Scenario) -> Packed:
    movable = packed.k[P.HOST_KIND] != P.FREE
    require(bool(movable), "effects.host_sway of a free Host", "a fixed, driven or sprung one", "leave it out")
    swayed = packed.copy()
    if swayed.k[P.HOST_KIND] == P.FIXED:
        swayed.k[P.HOST_KIND] = P.DRIVEN
    omega, size = 2.0 * math.pi * values["frequency_hz"], values["amplitude_m"]
    along = {"x": math.cos(values["direction_rad"]), "y": math.sin(values["direction_rad"])}
    rows = [[AXES[axis], size * share, omega, values["phase_rad"]] for axis, share in along.items()]
    return replace(swayed, drive=np.vstack([packed.drive, np.array(rows)]))


def _recoil(packed: Packed, values: Values, scenario: Scenario) -> Packed:
    """The Host on a spring that takes its impulses, over a ground that moves so that the steady motion is the drive."""
    driven = packed.k[P.HOST_KIND] in (P.FIXED, P.DRIVEN) and not len(packed.table)
    require(bool(driven), "effects.host_recoil of a free or sprung Host or of one that follows a table",
            "a fixed Host or one driven by harmonics", "give it a mass and springs yourself")  # fmt: skip
    give = packed.copy()
    p, y, omega_0 = give.p, give.y, 2.0 * math.pi * values["frequency_hz"]
    mass = values["mass_kg"]
    inertia = STIFF_ROTATION * mass * p[P.LENGTH] ** 2
    stiffness, damping = omega_0**2, 2.0 * values["damping_ratio"] * omega_0  # per unit mass
    p[P.INVERSE_HOST_MASS], p[P.INVERSE_HOST_INERTIA] = 1.0 / mass, 1.0 / inertia
    p[P.STIFFNESS_X] = p[P.STIFFNESS_Y] = mass * stiffness
    p[P.DAMPING_X] = p[P.DAMPING_Y] = mass * damping
    p[P.STIFFNESS_R], p[P.DAMPING_R] = inertia * stiffness, inertia * damping
    at_start = np.zeros(S.N_BASE)
    base_motion_at(0.0, packed.k, packed.drive, packed.table, at_start)
    y[P.HOST :] = at_start[S.BASE_IN_STATE]
    for row in give.drive:
        axis, amplitude, omega, phase = row
        if omega > 0.0 and axis != AXES["z"]:
            over = (stiffness - omega**2 + 1j * damping * omega) / (stiffness + 1j * damping * omega)
            row[P.AMPLITUDE], row[P.PHASE] = amplitude * abs(over), phase + float(np.angle(over))
    give.k[P.HOST_KIND] = P.SPRUNG
    return give


def _ringing(shown: Measurement, values: Values, rng: np.random.Generator) -> Measurement:
    seen, omega_0 = shown.samples.copy(), 2.0 * math.pi * values["frequency_hz"]
    decay = values["damping_ratio"] * omega_0
    omega = omega_0 * math.sqrt(1.0 - values["damping_ratio"] ** 2)
    for impact in shown.impacts:
        after = np.flatnonzero(shown.times > impact[P.TIME])
        late = shown.times[after] - impact[P.TIME]
        impulse = shown.mass_kg * (impact[P.NORMAL_BEFORE] - impact[P.NORMAL_AFTER])
        start = impulse / values["mass_kg"]
        place = start / omega * np.exp(-decay * late) * np.sin(omega * late)
        rate = start * np.exp(-decay * late) * (np.cos(omega * late) - decay / omega * np.sin(omega * late))
        for axis, share in enumerate((math.cos(impact[P.NORMAL]), math.sin(impact[P.NORMAL]))):
            seen[after, 6 + axis] += share * place
            seen[after, 8 + axis] += share * rate
    return replace(shown, samples=seen)


HOST_EFFECTS = (
    Effect(
        "host_recoil", "drive",
        (
            EffectParameter("mass_kg", "kg", 1e-9, INF),
            EffectParameter("frequency_hz", "Hz", 1e-3, INF, 5.0),
            EffectParameter("damping_ratio", "1", 1e-3, 1.0, 0.3),
        ),
        "The Host has a finite effective mass: an impact (and the floor's friction) pushes it off its drive, and it "
        "swings back about it at the frequency and damping of shaker and controller. 25 g against 20 kg at 1 m/s: "
        "2 mm/s.",
        Words(
            "Recoil of the Host",
            "impacts push the Host off its drive, and it swings back",
            "Tap the Host at rest with a soft hammer and record it: it swings back as it does after impacts; a "
            "heavier table recoils less.",
        ),
        _recoil,
    ),
    Effect(
        "host_ringing", "drive",
        (
            EffectParameter("mass_kg", "kg", 1e-9, INF),
            EffectParameter("frequency_hz", "Hz", 1e-3, INF),
            EffectParameter("damping_ratio", "1", 0.0, 0.99, 0.05),
        ),
        "The Host's markers ring after an impact: the part that carries them, of this modal mass, takes the normal "
        "impulse and swings along the wall's normal. The contact itself does not see it.",
        Words(
            "Ringing of the Host's markers",
            "what carries the Host's markers rings after impacts",
            "Tap the Host beside its markers with the shaker off: they ring at the frequency found; glue them to the "
            "ring itself for one run.",
        ),
        observe=_ringing,
    ),
    Effect(
        "host_sway", "drive",
        (
            EffectParameter("amplitude_m", "m", 0.0, INF),
            EffectParameter("frequency_hz", "Hz", 1e-6, INF),
            EffectParameter("direction_rad", "rad", -INF, INF, 0.0),
            EffectParameter("phase_rad", "rad", -INF, INF, 0.0),
        ),
        "The Host sways slowly beside its drive, a sin(2 pi f t + phase) towards the direction, with floor and wall; "
        "the cameras stand still: a table on air, a building. A drift is a frequency far below one over the run.",
        Words(
            "Sway of the Host",
            "the Host moves slowly beside its drive",
            "Record the Host with the shaker off and the building at work, and once more with the air legs of the "
            "table blocked.",
        ),
        _sway,
    ),
)  # fmt: skip
