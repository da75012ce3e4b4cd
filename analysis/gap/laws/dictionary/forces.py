"""What a missing force or torque may look like: directions times functions of invariants, in rig units.

Everything is written in the disk's own quantities (velocity in the room and against the floor, place in the Host and in
the room, gap, spin, its own angle, drive phase, time, time since the impact before), so that a formula keeps its form
when the world is turned; what has a direction of its own comes as a pair of columns and ends as one term with an angle.
"""

from __future__ import annotations

import math

import numpy as np

from analysis.gap.laws.dictionary.candidate import QUARTER, Candidate, waves, ways
from analysis.gap.laws.dictionary.parts import ANGLE_STEP, RigScales, pair, plain, scaled
from ovines.core.laws.terms import Factor, Term

# Ranges beside the wall over the contact radius; speeds over the usual one; times over the usual flight; radii over the
# contact radius, beyond which something acts.
RANGES, SPEEDS, TIMES, BEYOND = (0.05, 0.12, 0.3), (0.1, 0.25, 0.6), (0.1, 0.25, 0.6), (0.3, 0.55, 0.8)
# Speeds over the usual one, beyond which something acts.
FAST = (0.5, 0.9)
RAIL_DIRECTIONS = 12
# Frequencies of a force that nothing else moves with: cycles in a run; times over the run in which something fades.
MOST_CYCLES, FADES = 12, (0.1, 0.3)
# Shares of the longest run at which something changes at once.
CHANGES = (0.2, 0.4, 0.6, 0.8)


def force_candidates(scales: RigScales) -> list[Candidate]:
    """Forces that follow no place of their own."""
    return [
        *_central(scales),
        *_along_and_across(scales),
        *_drags_that_change(scales),
        *_fixed(scales),
        *_with_the_body(),
    ]


def _central(scales: RigScales) -> list[Candidate]:
    out = []
    ranges, beyond = ([share * scales.radius_m for share in shares] for shares in (RANGES, BEYOND))
    for target, word in (("outwards", "pull"), ("swirl", "swirl")):
        for power in (0, 1, 2, 3):
            factors = (Factor("radius", "power", power),) if power else ()
            out.append(plain(f"{word} with the radius to the power {power}", Term(target, 1.0, factors)))
        out += scaled(f"{word} near the wall", target, ("gap", "exponential", 1.0), ranges)
        out += scaled(f"{word} beyond a radius", target, ("radius", "above", 1.0), beyond)
        out += scaled(f"{word} that ends at a radius", target, ("radius", "below", 1.0), beyond)
        out += scaled(f"{word} after an impact", target, ("since", "exponential", 1.0), _times(scales))
        fades, radius = [share * scales.run_s for share in FADES], (Factor("radius"),)
        out += scaled(f"{word} with the radius that dies out", target, ("time", "exponential", 1.0), fades, radius)
        for quantity in ("spin", "speed"):
            out.append(plain(f"{word} with the {quantity}", Term(target, 1.0, (Factor(quantity),))))
        for quantity in ("phase", "clock"):
            terms = (Term(target, 1.0, (Factor("radius"), wave)) for wave in waves(quantity))
            out.append(plain(f"{word} with the radius and the {quantity}", *terms))
    out.append(plain("saddle in the Host", *pair("mirrored_radius", 0.25 * math.pi, Factor("radius"))))
    return out


def _times(scales: RigScales) -> list[float]:
    return [share * scales.flight_s for share in TIMES]


def _along_and_across(scales: RigScales) -> list[Candidate]:
    speed, spin, sliding = Factor("speed"), Factor("spin"), Factor("sliding_speed")
    square, cube = Factor("speed", "power", 2.0), Factor("speed", "power", 3.0)
    slid2 = Factor("sliding_speed", "power", 2.0)
    out = [
        plain("drag of constant size", Term("along_velocity", 1.0)),
        plain("drag with the speed", Term("along_velocity", 1.0, (speed,))),
        plain("drag with the speed's square", Term("along_velocity", 1.0, (square,))),
        plain("drag with the speed's cube", Term("along_velocity", 1.0, (cube,))),
        plain("drag with speed and spin", Term("along_velocity", 1.0, (speed, Factor("spin", "absolute_power")))),
        plain("drag against the Host of constant size", Term("along_sliding", 1.0)),
        plain("drag against the Host", Term("along_sliding", 1.0, (sliding,))),
        plain("drag against the Host, squared", Term("along_sliding", 1.0, (slid2,))),
        plain("force across the path", Term("across_velocity", 1.0)),
        plain("force across the path with the speed", Term("across_velocity", 1.0, (speed,))),
        plain("force across the path with the speed's square", Term("across_velocity", 1.0, (square,))),
        plain("force across the path with speed and spin", Term("across_velocity", 1.0, (speed, spin))),
        plain("force across the path with the spin", Term("across_velocity", 1.0, (spin,))),
        plain("force across the path, by the sense of spin", Term("across_velocity", 1.0, (Factor("spin", "sign"),))),
        plain("force across sliding with the spin", Term("across_sliding", 1.0, (spin,))),
        plain("force across sliding with speed and spin", Term("across_sliding", 1.0, (sliding, spin))),
        plain("force across sliding", Term("across_sliding", 1.0)),
        plain("force across sliding, by the sense of spin", Term("across_sliding", 1.0, (Factor("spin", "sign"),))),
        plain("drag that differs by direction", *pair("mirrored_velocity", 0.25 * math.pi, speed)),
    ]
    fast = [share * scales.speed_m_per_s for share in FAST]
    out += scaled("drag beyond a speed", "along_velocity", ("speed", "above", 1.0), fast)
    slow = [share * scales.speed_m_per_s for share in SPEEDS]
    out += scaled("drag at slow motion", "along_velocity", ("speed", "exponential", 1.0), slow)

    def rail(angle: float) -> tuple[Term, ...]:
        return (Term("fixed_direction", 1.0, (Factor("velocity_along", x=angle),), x=angle),)

    angles = np.arange(RAIL_DIRECTIONS) * math.pi / RAIL_DIRECTIONS
    return out + [Candidate("drag along one direction", rail, (float(a),), (ANGLE_STEP,), (False,)) for a in angles]


def _drags_that_change(scales: RigScales) -> list[Candidate]:
    """A drag in proportion to the speed, times something else."""
    target, speed = "along_velocity", Factor("speed")
    out = [
        plain("drag with speed and the radius' square", Term(target, 1.0, (speed, Factor("radius", "power", 2.0)))),
        plain("drag with speed and time", Term(target, 1.0, (speed, Factor("time")))),
        plain("drag with speed and run", Term(target, 1.0, (speed, Factor("run")))),
    ]
    for quantity in ("phase", "angle"):
        terms = (Term(target, 1.0, (speed, wave)) for wave in waves(quantity))
        out.append(plain(f"drag with speed and {quantity}", *terms))
    ranges = [share * scales.radius_m for share in RANGES]
    out += scaled("drag near the wall", target, ("gap", "exponential", 1.0), ranges, (speed,))
    out += scaled("drag after an impact", target, ("since", "exponential", 1.0), _times(scales), (speed,))
    changes = [share * scales.run_s for share in CHANGES]
    out += scaled("drag that changes at once", target, ("time", "below", 1.0), changes, (speed,))
    out += changed_runs("drag", target, scales, (speed,))
    spins = [share * scales.spin_rad_per_s for share in (0.3, 1.0)]
    return out + scaled("drag at slow spin", target, ("spin", "decay", 1.0), spins, (speed,))


def _fixed(scales: RigScales) -> list[Candidate]:
    target = "fixed_direction"
    out = [plain("force of the room", *pair(target, QUARTER))]
    for factor, word in (
        (Factor("time"), "time"), (Factor("run"), "run"), (Factor("spin"), "spin"), (Factor("speed"), "speed"),
    ):  # fmt: skip
        out.append(plain(f"force of the room with the {word}", *pair(target, QUARTER, factor)))
    for word in ("time", "run"):
        both = (*pair(target, QUARTER), *pair(target, QUARTER, Factor(word)))
        out.append(plain(f"force of the room, linear in the {word} from what it is at first", *both))
    for quantity, orders in (("phase", (1.0, 2.0)), ("clock", (1.0,)), ("angle", (1.0, 2.0))):
        for order in orders:
            cosine, sine = waves(quantity, order)
            terms = (*pair(target, QUARTER, cosine), *pair(target, QUARTER, sine))
            out.append(plain(f"force of the room with the {quantity}, order {order:g}", *terms))

    def sway(rate: float) -> tuple[Term, ...]:
        cosine, sine = waves("time", 1.0, 1.0 / rate)
        return (*pair(target, QUARTER, cosine), *pair(target, QUARTER, sine))

    rates = [2 * math.pi * 0.5 * n / scales.run_s for n in range(1, 2 * MOST_CYCLES + 1)]
    step = 0.3 / scales.run_s
    out += [Candidate("force of the room that sways", sway, (r,), (step / r,), (True,)) for r in rates]
    for quantity, word, sizes in (
        ("time", "that dies out", [share * scales.run_s for share in FADES]),
        ("since", "after an impact", _times(scales)),
    ):

        def fading(scale: float, quantity: str = quantity) -> tuple[Term, ...]:
            return pair(target, QUARTER, Factor(quantity, "exponential", 1.0, scale))

        out += [Candidate(f"force of the room {word}", fading, (size,), (0.25,), (True,)) for size in sizes]

    def changed(scale: float) -> tuple[Term, ...]:
        return pair(target, QUARTER, Factor("time", "below", 1.0, scale))

    name = "force of the room that changes at once"
    out += [Candidate(name, changed, (share * scales.run_s,), (0.1,), (True,)) for share in CHANGES]
    for run in range(1, scales.runs):
        later = pair(target, QUARTER, Factor("run", "below", 1.0, run - 0.5))
        out.append(plain("force of the room that changes with a run", *later))
    return out


def changed_runs(name: str, target: str, scales: RigScales, factors: tuple[Factor, ...] = ()) -> list[Candidate]:
    """What is different from one run of the series on."""
    return [
        plain(f"{name} that changes with a run", Term(target, 1.0, (*factors, Factor("run", "below", 1.0, run - 0.5))))
        for run in range(1, scales.runs)
    ]


def _with_the_body() -> list[Candidate]:
    """Forces along a direction that turns with the disk, and central ones that know how the disk is turned."""
    out = [plain("force along the disk", *pair("along_body", QUARTER))]
    for factor, word in ((Factor("speed"), "speed"), (Factor("radius"), "radius"), (Factor("spin"), "spin")):
        out.append(plain(f"force along the disk with the {word}", *pair("along_body", QUARTER, factor)))
    for target, word in (("outwards", "pull"), ("swirl", "swirl")):
        for order in (1.0, 2.0):
            terms = (Term(target, 1.0, (Factor("radius"), wave)) for wave in waves("body_angle", order))
            out.append(plain(f"{word} with the radius and the side of the disk, order {order:g}", *terms))
    return out


def torque_candidates(scales: RigScales) -> list[Candidate]:
    """Torques: of the spin, of the disk's angle in the room and in the Host, of the motion."""
    spin, speed, target = Factor("spin"), Factor("speed"), "spin"
    out = [
        plain("torque of constant size", Term(target, 1.0)),
        plain("torque against the spin", Term(target, 1.0, (Factor("spin", "sign"),))),
        plain("torque with the spin", Term(target, 1.0, (spin,))),
        plain("torque with the spin's square", Term(target, 1.0, (spin, Factor("spin", "absolute_power")))),
        plain("torque with the spin's cube", Term(target, 1.0, (Factor("spin", "power", 3.0),))),
        plain("torque with spin and speed", Term(target, 1.0, (spin, speed))),
        plain("torque with the speed", Term(target, 1.0, (speed,))),
        plain("torque with the time", Term(target, 1.0, (Factor("time"),))),
        plain("torque with spin and the radius' square", Term(target, 1.0, (spin, Factor("radius", "power", 2.0)))),
        plain("torque with spin and run", Term(target, 1.0, (spin, Factor("run")))),
    ]
    for quantity, orders in (("phase", (1.0, 2.0)), ("clock", (1.0,)), ("angle", (1, 2, 3, 4)), ("body_angle", (1, 2))):
        for order in orders:
            terms = (Term(target, 1.0, (wave,)) for wave in waves(quantity, float(order)))
            out.append(plain(f"torque with the {quantity}, order {order:g}", *terms))
    for quantity in ("angle", "body_angle"):
        terms = (Term(target, 1.0, (spin, wave)) for wave in waves(quantity))
        out.append(plain(f"torque with spin and {quantity}", *terms))
    # What stands up on the disk trails in the air, or in what it slides over.
    for quantity, fast in (("heading", "speed"), ("sliding_heading", "sliding_speed")):
        for power in range(3):
            factors = (Factor(fast, "power", float(power)),) if power else ()
            terms = (Term(target, 1.0, (*factors, wave)) for wave in waves(quantity))
            out.append(plain(f"torque with the {quantity} and the {fast} to the {power}", *terms))
    axes = ways("along_host")
    out.append(plain("torque with the place in the Host", *(Term(target, 1.0, (axis,)) for axis in axes)))
    turned = (Term(target, 1.0, (axis, wave)) for axis in axes for wave in waves("angle"))
    out.append(plain("torque with the place in the Host and the angle", *turned))
    for quantity in ("phase", "clock"):  # a magnet in an alternating field
        swinging = (Term(target, 1.0, (turn, wave)) for turn in waves("angle") for wave in waves(quantity))
        out.append(plain(f"torque with the angle and the {quantity}", *swinging))
    ranges = [share * scales.radius_m for share in RANGES]
    out += scaled("torque with the spin near the wall", target, ("gap", "exponential", 1.0), ranges, (spin,))
    return out + scaled(
        "torque with the spin after an impact", target, ("since", "exponential", 1.0), _times(scales), (spin,)
    )
