"""What a missing force or torque may look like: directions times functions of invariants, in rig units.

Everything is written in the disk's own quantities (velocity in the room and against the floor, place in the Host and in
the room, gap, spin, its own angle, drive phase, time, time since the impact before), so that a formula keeps its form
when the world is turned; what has a direction of its own comes as a pair of columns and ends as one term with an angle.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from analysis.gap.laws.dictionary.candidate import QUARTER, Candidate, waves, ways
from analysis.gap.laws.dictionary.modulated import LIFTS, REACHES, SPEEDS, TIMES
from analysis.gap.laws.dictionary.parts import ANGLE_STEP, RigScales, pair, plain, rings, scaled
from ovines.core.laws.terms import Factor, Term

RAIL_DIRECTIONS = 12
# Winds: rings of so many directions, the air's speed over the usual one; and by how much a search first moves one.
WINDS, WIND_STEP = ((0.4, 6), (1.2, 8)), 0.2
# Spins of the air over the usual one, and by how much a search first moves one.
WHIRLS, WHIRL_STEP = (-1.5, -0.5, 0.5, 1.5), 0.25


def force_candidates(scales: RigScales) -> list[Candidate]:
    """Forces that are no carrier of :mod:`modulated`, and the carriers alone."""
    return [
        plain("force of the room", *pair("fixed_direction", QUARTER)),
        *_central(), *_along_and_across(scales), *_in_wind(scales), *_with_the_body(), *_to_the_last_contact(scales),
    ]  # fmt: skip


def _in_wind(scales: RigScales) -> list[Candidate]:
    """Drag with the square of the speed against air that moves past the rig: of one that goes with the speed, the wind
    is a force of the room."""

    def drag(x: float, y: float) -> tuple[Term, ...]:
        return (Term("along_airspeed", 1.0, (Factor("airspeed", "power", 2.0, x=x, y=y),), x, y),)

    speed = scales.speed_m_per_s
    steps = (WIND_STEP * speed, WIND_STEP * speed)
    return [Candidate("drag in a wind, squared", drag, wind, steps, (False, False)) for wind in rings(WINDS, speed)]


def _central() -> list[Candidate]:
    out = []
    for target, word in (("outwards", "pull"), ("swirl", "swirl")):
        out.append(plain(word, Term(target, 1.0)))
        cube = Factor("radius", "power", 3.0)
        out.append(plain(f"{word} with the radius' cube", Term(target, 1.0, (cube,))))
    out.append(plain("saddle in the Host", *pair("mirrored_radius", 0.25 * math.pi, Factor("radius"))))
    return out


def _along_and_across(scales: RigScales) -> list[Candidate]:
    speed, spin, sliding = Factor("speed"), Factor("spin"), Factor("sliding_speed")
    square, cube = Factor("speed", "power", 2.0), Factor("speed", "power", 3.0)
    slid2 = Factor("sliding_speed", "power", 2.0)
    out = [
        plain("drag of constant size", Term("along_velocity", 1.0)),
        plain("drag with the speed", Term("along_velocity", 1.0, (speed,))),
        plain("drag with the speed's square", Term("along_velocity", 1.0, (square,))),
        plain("drag with the speed's cube", Term("along_velocity", 1.0, (cube,))),
        plain("drag against the Host of constant size", Term("along_sliding", 1.0)),
        plain("drag against the Host", Term("along_sliding", 1.0, (sliding,))),
        plain("drag against the Host, squared", Term("along_sliding", 1.0, (slid2,))),
        plain("force across the path", Term("across_velocity", 1.0)),
        plain("force across the path with the speed", Term("across_velocity", 1.0, (speed,))),
        plain("force across the path with the speed's square", Term("across_velocity", 1.0, (square,))),
        plain("force across the path with the spin", Term("across_velocity", 1.0, (spin,))),
        plain("force across the path, by the sense of spin", Term("across_velocity", 1.0, (Factor("spin", "sign"),))),
        plain("force across sliding with the spin", Term("across_sliding", 1.0, (spin,))),
        plain("force across sliding with speed and spin", Term("across_sliding", 1.0, (sliding, spin))),
        plain("force across sliding", Term("across_sliding", 1.0)),
        plain("force across sliding, by the sense of spin", Term("across_sliding", 1.0, (Factor("spin", "sign"),))),
        plain("drag that differs by direction", *pair("mirrored_velocity", 0.25 * math.pi, speed)),
    ]
    fast = [share * scales.speed_m_per_s for share in LIFTS]
    out += scaled("drag beyond a speed", "along_velocity", ("speed", "above", 1.0), fast)
    slow = [share * scales.speed_m_per_s for share in SPEEDS]
    out += scaled("drag at slow motion", "along_velocity", ("speed", "exponential", 1.0), slow)

    def rail(angle: float) -> tuple[Term, ...]:
        return (Term("fixed_direction", 1.0, (Factor("velocity_along", x=angle),), x=angle),)

    angles = np.arange(RAIL_DIRECTIONS) * math.pi / RAIL_DIRECTIONS
    return out + [Candidate("drag along one direction", rail, (float(a),), (ANGLE_STEP,), (False,)) for a in angles]


def _to_the_last_contact(scales: RigScales) -> list[Candidate]:
    """Pulls towards the place of the contact before."""
    reaches = [share * scales.radius_m for share in REACHES]
    times = [share * scales.flight_s for share in TIMES]
    target, after = "from_last_contact", ("since", "exponential", 1.0)
    out = [
        plain("pull to the last contact", Term(target, 1.0)),
        plain("spring to the last contact", Term(target, 1.0, (Factor("from_contact"),))),
    ]
    out += scaled("pull to the last contact that ends", target, ("from_contact", "below", 1.0), reaches)
    out += scaled("pull to the last contact that fades", target, ("from_contact", "exponential", 1.0), reaches)
    spring = (Factor("from_contact"),)
    out += scaled("spring to the last contact that ends", target, ("from_contact", "below", 1.0), reaches, spring)
    out += scaled("pull to the last contact, for a time", target, after, times)
    return out + scaled("pull to the last contact, until a time", target, ("since", "below", 1.0), times)


def _with_the_body() -> list[Candidate]:
    """Forces along a direction that turns with the disk."""
    out = [plain("force along the disk", *pair("along_body", QUARTER))]
    for factor, word in ((Factor("speed"), "speed"), (Factor("radius"), "radius"), (Factor("spin"), "spin")):
        out.append(plain(f"force along the disk with the {word}", *pair("along_body", QUARTER, factor)))
    return out


def torque_candidates(scales: RigScales) -> list[Candidate]:
    """Torques: of the spin, of the disk's angle in the room and in the Host, of the motion."""
    spin, target = Factor("spin"), "spin"

    def whirl(air: float) -> tuple[Term, ...]:
        against = Factor("spin", x=air)
        return (Term(target, 1.0, (against, replace(against, function="absolute_power"))),)

    out = [
        plain("torque of constant size", Term(target, 1.0)),
        plain("torque with the spin's square", Term(target, 1.0, (spin, Factor("spin", "absolute_power")))),
        plain("torque with the spin's cube", Term(target, 1.0, (Factor("spin", "power", 3.0),))),
        plain("torque of air that turns, with the spin", Term(target, 1.0), Term(target, 1.0, (spin,))),
    ]
    unit = scales.spin_rad_per_s
    out += [
        Candidate("torque of air that turns, squared", whirl, (share * unit,), (WHIRL_STEP * unit,), (False,))
        for share in WHIRLS
    ]
    for order in (3.0, 4.0):
        terms = (Term(target, 1.0, (wave,)) for wave in waves("angle", order))
        out.append(plain(f"torque with the angle, order {order:g}", *terms))
    # What stands up on the disk trails in the air, or in what it slides over.
    for quantity, fast in (("heading", "speed"), ("sliding_heading", "sliding_speed")):
        for power in range(3):
            factors = (Factor(fast, "power", float(power)),) if power else ()
            terms = (Term(target, 1.0, (*factors, wave)) for wave in waves(quantity))
            if power or quantity == "heading":
                out.append(plain(f"torque with the {quantity} and the {fast} to the {power}", *terms))
    turned = (Term(target, 1.0, (axis, wave)) for axis in ways("along_host") for wave in waves("angle"))
    out.append(plain("torque with the place in the Host and the angle", *turned))
    for quantity in ("phase", "clock"):  # a magnet in an alternating field
        swinging = (Term(target, 1.0, (turn, wave)) for turn in waves("angle") for wave in waves(quantity))
        out.append(plain(f"torque with the angle and the {quantity}", *swinging))
    return out
