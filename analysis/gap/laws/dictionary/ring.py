"""What the ring's own motion does to the disk, and what slows the disk beside the wall: drags of the motion against the
Host towards and around its wall, forces and friction that go with the Host's velocity or acceleration."""

from __future__ import annotations

from functools import partial

from analysis.gap.laws.dictionary.candidate import Candidate, waves, ways
from analysis.gap.laws.dictionary.modulated import RANGES
from analysis.gap.laws.dictionary.parts import SCALE_STEP, RigScales, plain, rings, scaled
from ovines.core.laws.terms import Factor, Term

OUTWARDS = Factor("host_acceleration_outwards")
# Sliding speed over the usual one below which a floor of its own motion turns friction no further.
SLOW = 0.1
# Places about which a floor may turn: rings (radius over the contact radius, how many), and a search's first step.
PIVOTS, PIVOT_STEP = ((0.6, 6), (1.5, 12)), 0.2


def ring_candidates(scales: RigScales) -> list[Candidate]:
    """Every candidate of the motion against the wall, and with the ring."""
    return [*_against_the_wall(scales), *_with_the_ring(), *_with_the_floor(scales)]


def _with_the_floor(scales: RigScales) -> list[Candidate]:
    """A floor that turns about the Host's centre or another place, always or with the Host's velocity (a plate on one
    screw), or creeps along: friction follows the motion against it, and is turned aside by what of the floor's own goes
    across the sliding."""
    slow = Factor("sliding_speed", "rational", 2.0, SLOW * scales.speed_m_per_s)
    turning = Term("across_sliding", 1.0, (Factor("radius"), Factor("radial_speed"), slow))
    creeping = [Term("across_sliding", 1.0, (way, slow)) for way in ways("sliding_along")]

    def about(factors: tuple[Factor, ...], x: float, y: float, speed: float) -> tuple[Term, ...]:
        turned = (Factor("place_along_sliding", x=x, y=y), Factor("sliding_speed", "rational", 2.0, speed))
        return tuple(Term("across_sliding", 1.0, (*turned, *one)) for one in ([[way] for way in factors] or [[]]))

    step, swung = PIVOT_STEP * scales.radius_m, "floor that swings about a place with the Host's velocity"
    numbers, steps, positive = (slow.scale,), (step, step, SCALE_STEP), (False, False, True)
    return [
        plain("floor that turns", turning),
        plain("floor that creeps", *creeping),
        *(
            Candidate(name, partial(about, factors), (*place, *numbers), steps, positive)
            for name, factors in (
                ("floor that turns about a place", ()),
                (f"{swung} along the drive", (Factor("host_velocity_along"),)),
                (swung, ways("host_velocity_along")),
            )
            for place in rings(PIVOTS, scales.radius_m)
        ),
    ]


def _against_the_wall(scales: RigScales) -> list[Candidate]:
    ranges, beside = [share * scales.radius_m for share in RANGES], ("gap", "exponential", 1.0)
    out = []
    for name, target, along in (
        ("drag of the way to the wall and from it", "outwards", Factor("radial_speed")),
        ("drag of the way around", "swirl", Factor("circling_speed")),
    ):
        out += scaled(f"{name}, near the wall", target, beside, ranges, (along,))
    squared = Factor("sliding_speed", "power", 2.0)
    out += scaled("drag against the Host, squared, near the wall", "along_sliding", beside, ranges, (squared,))
    # Pressed out towards the wall, or drawn in from it: one sense of the way only.
    speed, outwards = Factor("radial_speed"), Factor("radial_speed", "above", 1.0, 0.0)
    inwards = (speed, Factor("radial_speed", "below", 1.0, 0.0))
    out += scaled("drag of the way to the wall, near it", "outwards", beside, ranges, (outwards,))
    out += scaled("drag of the way from the wall, near it", "outwards", beside, ranges, inwards)
    out += scaled("torque of the way around, near the wall", "spin", beside, ranges, (Factor("circling_speed"),))
    return out


def _with_the_ring() -> list[Candidate]:
    out = []
    for target, quantity, word in (
        ("along_host_velocity", "host_speed", "velocity"),
        ("along_host_acceleration", "host_acceleration", "acceleration"),
    ):
        out.append(plain(f"force along the Host's {word}", Term(target, 1.0, (Factor(quantity),))))
        out.append(plain(f"force along the Host's {word} of constant size", Term(target, 1.0)))
    along = (Term("along_host_acceleration", 1.0, (Factor("host_acceleration"), wave)) for wave in waves("angle"))
    out.append(plain("force along the Host's acceleration with the disk's angle", *along))
    return out
