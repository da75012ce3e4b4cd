"""What a missing force may look like: directions times functions of invariants, in rig units.

Everything is written in the disk's own quantities (velocity in the room and against the floor, place in the Host and in
the room, gap, spin, drive phase, time, time since the impact before), so that a formula keeps its form when the world
is turned; what has a direction of its own comes as a pair of columns and ends as one term with an angle.  Lengths
inside are shares of the contact radius, speeds of the disk's usual speed, times of the usual flight."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.gap.laws.candidate import Candidate, waves
from ovines.core.laws import words as W
from ovines.core.laws.terms import Factor, Term

Array = NDArray[np.float64]
# Ranges beside the wall and widths of places, over the contact radius; speeds over the usual one; times over the usual
# flight.
RANGES, WIDTHS, SPEEDS, TIMES = (0.05, 0.12, 0.3), (0.25, 0.45), (0.1, 0.25, 0.6), (0.1, 0.25, 0.6)
# Places that are tried, over the contact radius: rings of so many.
RINGS = ((0.0, 1), (0.35, 6), (0.7, 12))
RIDGE_DIRECTIONS, RIDGE_PLACES, RIDGE_WIDTH = 8, (-0.6, -0.3, 0.0, 0.3, 0.6), 0.1
RAIL_DIRECTIONS = 12
# Frequencies of a force that nothing else moves with: cycles in a run, and the drive's multiples.
MOST_CYCLES = 12


@dataclass(frozen=True)
class RigScales:
    """The rig's own sizes: contact radius (m), the disk's usual speed in the room (m/s), usual time
    since an impact (s), longest run (s), drive (rad/s, 0 without)."""

    radius_m: float
    speed_m_per_s: float
    flight_s: float
    run_s: float
    drive_rad_per_s: float

    @staticmethod
    def of(known: Array, drive_rad_per_s: float) -> RigScales:
        """From what laws know at the flights' frames (N, KNOWN_SIZE)."""
        since = known[:, W.SINCE]
        seen = since[since < 0.5 * W.LONG_AGO_S]
        run_s = float(np.ptp(known[:, W.TIME])) if len(known) else 1.0
        return RigScales(
            float(np.median(known[:, W.CONTACT_RADIUS])),
            max(float(np.sqrt(np.mean(known[:, W.VX] ** 2 + known[:, W.VY] ** 2))), 1e-6),
            2 * float(np.median(seen)) if len(seen) else run_s,
            run_s,
            drive_rad_per_s,
        )


def flight_candidates(scales: RigScales) -> list[Candidate]:
    """Every candidate for a force, a torque or a change of the floor's friction."""
    return [
        *_central(scales),
        *_along_and_across(),
        *_fixed(scales),
        *_places(scales),
        *_friction(scales),
        *_torques(scales),
    ]


def _plain(name: str, *terms: Term) -> Candidate:
    return Candidate(name, lambda: terms)


def _pair(target: str, period: float, *factors: Factor) -> tuple[Term, Term]:
    """Two columns of a target with an angle."""
    return Term(target, 1.0, factors), Term(target, 1.0, factors, x=period)


def _scaled(name: str, target: str, quantity: str, function: str, sizes: tuple[float, ...]) -> list[Candidate]:
    """A target times a function whose scale is searched."""

    def make(scale: float) -> tuple[Term, ...]:
        return (Term(target, 1.0, (Factor(quantity, function, 1.0, scale),)),)

    return [Candidate(name, make, (size,), (0.25,), (True,)) for size in sizes]


def _central(scales: RigScales) -> list[Candidate]:
    out = []
    for target, word in (("outwards", "pull"), ("swirl", "swirl")):
        for power in (0, 1, 2, 3):
            factors = (Factor("radius", "power", power),) if power else ()
            out.append(_plain(f"{word} with the radius to the power {power}", Term(target, 1.0, factors)))
        sizes = tuple(share * scales.radius_m for share in RANGES)
        out += _scaled(f"{word} near the wall", target, "gap", "exponential", sizes)
        for quantity in ("spin", "speed"):
            out.append(_plain(f"{word} with the {quantity}", Term(target, 1.0, (Factor(quantity),))))
    out.append(_plain("saddle in the Host", *_pair("mirrored_radius", 0.25 * math.pi, Factor("radius"))))
    return out


def _along_and_across() -> list[Candidate]:
    speed, spin, sliding = Factor("speed"), Factor("spin"), Factor("sliding_speed")
    square, cube = Factor("speed", "power", 2.0), Factor("speed", "power", 3.0)
    out = [
        _plain("drag of constant size", Term("along_velocity", 1.0)),
        _plain("drag with the speed", Term("along_velocity", 1.0, (speed,))),
        _plain("drag with the speed's square", Term("along_velocity", 1.0, (square,))),
        _plain("drag with the speed's cube", Term("along_velocity", 1.0, (cube,))),
        _plain("drag with speed and spin", Term("along_velocity", 1.0, (speed, Factor("spin", "absolute_power")))),
        _plain("drag against the Host", Term("along_sliding", 1.0, (sliding,))),
        _plain("drag against the Host, squared", Term("along_sliding", 1.0, (Factor("sliding_speed", "power", 2.0),))),
        _plain("force across the path", Term("across_velocity", 1.0)),
        _plain("force across the path with the speed", Term("across_velocity", 1.0, (speed,))),
        _plain("force across the path with speed and spin", Term("across_velocity", 1.0, (speed, spin))),
        _plain("force across the path with the spin", Term("across_velocity", 1.0, (spin,))),
        _plain("force across sliding with the spin", Term("across_sliding", 1.0, (spin,))),
        _plain("force across sliding with speed and spin", Term("across_sliding", 1.0, (sliding, spin))),
        _plain("force across sliding", Term("across_sliding", 1.0)),
        _plain("drag that differs by direction", *_pair("mirrored_velocity", 0.25 * math.pi, speed)),
    ]

    def rail(angle: float) -> tuple[Term, ...]:
        return (Term("fixed_direction", 1.0, (Factor("velocity_along", x=angle),), x=angle),)

    angles = np.arange(RAIL_DIRECTIONS) * math.pi / RAIL_DIRECTIONS
    return out + [Candidate("drag along one direction", rail, (float(a),), (0.1,), (False,)) for a in angles]


def _fixed(scales: RigScales) -> list[Candidate]:
    quarter = 0.5 * math.pi
    out = [_plain("force of the room", *_pair("fixed_direction", quarter))]
    for factor, word in ((Factor("time"), "time"), (Factor("run"), "run"), (Factor("spin"), "spin")):
        out.append(_plain(f"force of the room with the {word}", *_pair("fixed_direction", quarter, factor)))
    for quantity, orders in (("phase", (1.0, 2.0)), ("clock", (1.0,))):
        for order in orders:
            cosine, sine = waves(quantity, order)
            terms = (*_pair("fixed_direction", quarter, cosine), *_pair("fixed_direction", quarter, sine))
            out.append(_plain(f"force of the room with the {quantity}, order {order:g}", *terms))

    def sway(rate: float) -> tuple[Term, ...]:
        cosine, sine = waves("time", 1.0, 1.0 / rate)
        return (*_pair("fixed_direction", quarter, cosine), *_pair("fixed_direction", quarter, sine))

    rates = [2 * math.pi * 0.5 * n / scales.run_s for n in range(1, 2 * MOST_CYCLES + 1)]
    step = 0.3 / scales.run_s
    return out + [Candidate("force of the room that sways", sway, (r,), (step / r,), (True,)) for r in rates]


def _spots(scales: RigScales) -> list[tuple[float, float]]:
    out = []
    for share, count in RINGS:
        for i in range(count):
            angle = 2 * math.pi * i / count
            out.append((share * scales.radius_m * math.cos(angle), share * scales.radius_m * math.sin(angle)))
    return out


def _places(scales: RigScales) -> list[Candidate]:
    radius, step = scales.radius_m, 0.1 * scales.radius_m
    out = []
    for where in ("room", "host"):

        def pull(x: float, y: float, width: float, where: str = where) -> tuple[Term, ...]:
            far = f"distance_in_{where}"
            factors = (Factor(far, x=x, y=y), Factor(far, "gaussian", 1.0, width, x, y))
            return (Term(f"from_place_in_{where}", 1.0, factors, x, y),)

        for x, y in _spots(scales):
            for share in WIDTHS:
                numbers, steps = (x, y, share * radius), (step, step, 0.2)
                name = f"pull of a place in the {where}"
                out.append(Candidate(name, pull, numbers, steps, (False, False, True)))

    def ridge(angle: float, place: float, width: float) -> tuple[Term, ...]:
        factors = (Factor("along_host", x=place, y=angle), Factor("along_host", "gaussian", 1.0, width, place, angle))
        return (Term("fixed_direction", 1.0, factors, x=angle),)

    for i in range(RIDGE_DIRECTIONS):
        for share in RIDGE_PLACES:
            numbers = (math.pi * i / RIDGE_DIRECTIONS, share * radius, RIDGE_WIDTH * radius)
            out.append(Candidate("ridge across the floor", ridge, numbers, (0.1, step, 0.2), (False, False, True)))
    return out


def _friction(scales: RigScales) -> list[Candidate]:
    target = "floor_friction"
    out = []
    for factor, word in (
        (Factor("radius"), "the radius"), (Factor("radius", "power", 2.0), "the radius' square"),
        (Factor("sliding_speed"), "the sliding speed"), (Factor("time"), "time"), (Factor("run"), "the run"),
        (Factor("spin", "absolute_power"), "the spin"), (Factor("spin", "sign"), "the sense of spin"),
    ):  # fmt: skip
        out.append(_plain(f"friction with {word}", Term(target, 1.0, (factor,))))
    axes = (Factor("along_host"), Factor("along_host", y=0.5 * math.pi))
    out.append(_plain("friction with the place in the Host", *(Term(target, 1.0, (axis,)) for axis in axes)))
    for quantity, order in (("phase", 1.0), ("phase", 2.0), ("clock", 1.0)):
        terms = (Term(target, 1.0, (wave,)) for wave in waves(quantity, order))
        out.append(_plain(f"friction with the {quantity}, order {order:g}", *terms))
    out.append(_plain("friction that differs by direction", *_pair("mirrored_floor_friction", 0.25 * math.pi)))
    speeds = tuple(share * scales.speed_m_per_s for share in SPEEDS)
    out += _scaled("friction at slow sliding", target, "sliding_speed", "exponential", speeds)
    times = tuple(share * scales.flight_s for share in TIMES)
    out += _scaled("friction after an impact", target, "since", "exponential", times)
    out += _scaled("friction just after an impact", target, "since", "below", times)
    step = 0.1 * scales.radius_m

    def patch(x: float, y: float, width: float) -> tuple[Term, ...]:
        return (Term(target, 1.0, (Factor("distance_in_host", "gaussian", 1.0, width, x, y),)),)

    for x, y in _spots(scales):
        for share in WIDTHS:
            numbers = (x, y, share * scales.radius_m)
            out.append(Candidate("friction of a patch", patch, numbers, (step, step, 0.2), (False, False, True)))
    return out


def _torques(scales: RigScales) -> list[Candidate]:
    spin = Factor("spin")
    out = [
        _plain("torque of constant size", Term("spin", 1.0)),
        _plain("torque against the spin", Term("spin", 1.0, (Factor("spin", "sign"),))),
        _plain("torque with the spin", Term("spin", 1.0, (spin,))),
        _plain("torque with the spin's square", Term("spin", 1.0, (spin, Factor("spin", "absolute_power")))),
        _plain("torque with spin and speed", Term("spin", 1.0, (spin, Factor("speed")))),
        _plain("torque with the speed", Term("spin", 1.0, (Factor("speed"),))),
    ]
    out.append(_plain("torque with the phase", *(Term("spin", 1.0, (wave,)) for wave in waves("phase"))))
    times = tuple(share * scales.flight_s for share in TIMES)

    def settling(scale: float) -> tuple[Term, ...]:
        return (Term("spin", 1.0, (spin, Factor("since", "exponential", 1.0, scale))),)

    return out + [Candidate("torque with the spin after an impact", settling, (t,), (0.25,), (True,)) for t in times]
