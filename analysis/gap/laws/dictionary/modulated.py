"""Each carrier - friction, drags, forces, torques - times each of what may make it more or less.

A list written cause by cause holds what somebody thought of; the cause that nobody listed is mostly a known carrier
that follows a known quantity, only not in a pair that somebody wrote down.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

from analysis.gap.laws.dictionary.candidate import QUARTER, Candidate, waves, ways
from analysis.gap.laws.dictionary.parts import ANGLE_STEP, PLACE_STEP, SCALE_STEP, RigScales, lines, pair, spots
from ovines.core.laws.terms import Factor, Term
from ovines.core.laws.words import MOST_FACTORS

Products = tuple[tuple[Factor, ...], ...]
# Ranges beside the wall over the contact radius; speeds over the usual one; times over the usual flight; radii over the
# contact radius, inside or beyond which something acts.
RANGES, SPEEDS, TIMES, BEYOND = (0.05, 0.12, 0.3), (0.1, 0.25, 0.6), (0.1, 0.25, 0.6), (0.3, 0.55, 0.8)
# Speeds over the usual one at which something is half gone, or beyond which it begins; spins over the usual one.
LIFTS, SPINS = (0.5, 1.0), (0.3, 1.0)
# Times over the longest run in which something fades, and at which it changes at once.
FADES, CHANGES = (0.1, 0.3), (0.2, 0.4, 0.6, 0.8)
# Angles (rad) by which a disk turns until what a blow has brought below it is thrown out.
TURNS = (1.0, 4.0)
# Blows after which what each of them does comes to an end; distances over the contact radius from the contact before.
WEARS, REACHES = (4.0, 12.0), (0.1, 0.2, 0.35, 0.6)
# Cycles in the longest run of what nothing else moves with, by half of one.
MOST_CYCLES = 14
# Rates of what a blow leaves ringing: steps (rad) in the usual time between impacts, and how many.
RING_STEP, RINGS = 1.5, 16
# Widths of places over the contact radius; directions and places of a seam's line.
WIDTHS, SEAM_DIRECTIONS, SEAM_PLACES = (0.25, 0.45), 8, (-0.6, -0.3, 0.0, 0.3, 0.6)
# Radii and widths of a worn track, over the contact radius.
TRACKS, TRACK_WIDTHS = (0.3, 0.5, 0.7, 0.9), (0.06, 0.15)
# Wave vectors of what is periodic in place, times the contact radius: their distance from each other, and the largest.
# Half a distance off, a wave of the right phase in the middle is wrong by 0.8 rad at the wall.
WAVE_VECTOR, MOST_WAVE_VECTOR = 1.6, 20.0
# A start: the numbers inside, and the steps by which a search first moves them.
Start = tuple[tuple[float, ...], tuple[float, ...]]


@dataclass(frozen=True)
class Modulator:
    """``make(*numbers)`` gives products of factors, each a column of its own, at each of the ``starts``; ``positive``:
    which of the numbers are scales, as a :class:`Candidate` has it."""

    name: str
    make: Callable[..., Products]
    starts: tuple[Start, ...] = (((), ()),)
    positive: tuple[bool, ...] = ()


@dataclass(frozen=True)
class Carrier:
    """What is there more or less: its ``terms`` without a modulator."""

    name: str
    terms: tuple[Term, ...]

    def times(self, one: Modulator) -> Iterator[Candidate]:
        """Candidates from all the modulator's starts; none where a formula would have too many factors, or two powers
        of one quantity."""
        products = one.make(*one.starts[0][0]) if one.starts else ()
        own = {factor.quantity for term in self.terms for factor in term.factors}
        most = max(len(term.factors) for term in self.terms) + max((len(p) for p in products), default=0)
        again = any(factor.quantity in own and factor.function.endswith("power") for p in products for factor in p)
        if most <= MOST_FACTORS and not again:
            make = partial(_product, self.terms, one.make)
            for numbers, steps in one.starts:
                yield Candidate(f"{self.name} {one.name}", make, numbers, steps, one.positive)


def _product(terms: tuple[Term, ...], make: Callable[..., Products], *numbers: float) -> tuple[Term, ...]:
    return tuple(replace(term, factors=(*term.factors, *factors)) for factors in make(*numbers) for term in terms)


# What is there more or less: on friction, a force of the room and a drag everything is tried.
_SPEED, _SPIN, _RADIUS = Factor("speed"), Factor("spin"), Factor("radius")
# 1 after a contact that is known, as all that goes with it is 0 without one.
_STRUCK = Factor("last_left", "beyond", 1.0, 0.0)
FRICTION = Carrier("friction", (Term("floor_friction", 1.0),))
ROOM = Carrier("force of the room", pair("fixed_direction", QUARTER))
DRAG = Carrier("drag", (Term("along_velocity", 1.0, (_SPEED,)),))
FEW = (
    Carrier("drag against the Host", (Term("along_sliding", 1.0, (Factor("sliding_speed"),)),)),
    Carrier("pull", (Term("outwards", 1.0),)),
    Carrier("pull with the radius", (Term("outwards", 1.0, (_RADIUS,)),)),
    Carrier("swirl", (Term("swirl", 1.0),)),
    Carrier("swirl with the radius", (Term("swirl", 1.0, (_RADIUS,)),)),
    Carrier("force across the path with the speed", (Term("across_velocity", 1.0, (_SPEED,)),)),
    Carrier("force across the path with speed and spin", (Term("across_velocity", 1.0, (_SPEED, _SPIN)),)),
    Carrier("torque", (Term("spin", 1.0),)),
    Carrier("torque with the spin", (Term("spin", 1.0, (_SPIN,)),)),
    Carrier("torque of the floor's friction", (Term("floor_torque", 1.0),)),
)


def modulated(scales: RigScales) -> list[Candidate]:
    """Every carrier times every modulator; those that are many - places, waves, lines - on what has its own place
    mostly: friction, a force of the room, a drag.  (A force in waves over the floor goes along them: `places`.)"""
    usual = [*_plain(), *_waves(), *_of_motion(scales), *_of_time(scales), *_of_blows(scales)]
    rhythms = [_sways(scales), _rings(scales), _rings_as_hard(scales)]
    places = [seams(scales), patches(scales)]
    of_friction = [*usual, *rhythms, *places, tracks(scales), _place_waves(scales)]
    grid = [
        *((FRICTION, one) for one in of_friction),
        *((ROOM, one) for one in (*usual, *rhythms, *places)),
        *((DRAG, one) for one in (*usual, *rhythms, *places, patches(scales, "room"))),
        *((carrier, one) for carrier in FEW for one in usual),
        *((carrier, _sways(scales)) for carrier in FEW if carrier.name.startswith("torque")),
    ]
    every = (candidate for carrier, one in grid for candidate in carrier.times(one))
    # Carriers with and without a factor of their own meet in some products.
    return list({frozenset(candidate.terms): candidate for candidate in every}.values())


def all_with_scale(scales: RigScales) -> list[Modulator]:
    """What makes a carrier more or less by a scale of its own: of motion, of time, of the blows before."""
    return [one for one in (*_of_motion(scales), *_of_time(scales), *_of_blows(scales)) if one.positive]


def fixed(name: str, *products: tuple[Factor, ...]) -> Modulator:
    """A modulator without numbers of its own: ``products`` of factors, a column each."""
    return Modulator(name, lambda: products)


def with_scale(
    name: str, shape: tuple[str, str, float], sizes: Sequence[float], factors: tuple[Factor, ...] = ()
) -> Modulator:
    """A function (``shape``: quantity, function, order) whose scale is searched from each of ``sizes``."""
    quantity, function, order = shape

    def make(scale: float) -> Products:
        return ((*factors, Factor(quantity, function, order, scale)),)

    return Modulator(name, make, tuple(((float(s),), (SCALE_STEP,)) for s in sizes if s > 0), (True,))


def changing(name: str, shape: tuple[str, str, float], sizes: Sequence[float], quantity: str) -> Modulator:
    """The same as :func:`with_scale`, and it times a ``quantity``: what is there at first, and how it changes."""
    return first_and_changing(with_scale(name, shape, sizes), Factor(quantity))


def settling(name: str, shape: tuple[str, str, float], sizes: Sequence[float]) -> Modulator:
    """What is there at last, and what else is there at first, which fades by a scale of its own."""
    one = with_scale(name, shape, sizes)
    return replace(one, make=lambda scale: ((), *one.make(scale)))


def since_struck(one: Modulator) -> Modulator:
    """What is there after a blow, and how much of it: where the contact before is not known, as before the first,
    neither is, and that nought is no value of what it was."""

    def make(*numbers: float) -> Products:
        return ((_STRUCK,), *one.make(*numbers))

    return replace(one, make=make)


def first_and_changing(one: Modulator, factor: Factor) -> Modulator:
    """What is there at first, and the same times a ``factor``."""

    def make(*numbers: float) -> Products:
        products = one.make(*numbers)
        return (*products, *((*factors, factor) for factors in products))

    return replace(one, make=make)


def _plain() -> list[Modulator]:
    out = [
        fixed(f"with {name}", (factor,))
        for name, factor in (
            ("the radius", Factor("radius")), ("the radius' square", Factor("radius", "power", 2.0)),
            ("the radius to the fourth", Factor("radius", "power", 4.0)),
            ("the speed", Factor("speed")), ("the speed's square", Factor("speed", "power", 2.0)),
            ("the sliding speed", Factor("sliding_speed")),
            ("the sliding speed's square", Factor("sliding_speed", "power", 2.0)),
            ("the signed spin", Factor("spin")), ("the spin", Factor("spin", "absolute_power")),
            ("the spin's square", Factor("spin", "power", 2.0)), ("the sense of spin", Factor("spin", "sign")),
            ("time", Factor("time")), ("the run", Factor("run")),
            ("the Host's speed", Factor("host_speed")),
            ("the square of the Host's speed", Factor("host_speed", "power", 2.0)),
            ("the size of the Host's acceleration", Factor("host_acceleration")),
            ("the square of the Host's acceleration", Factor("host_acceleration", "power", 2.0)),
            ("the Host's acceleration outwards", Factor("host_acceleration_outwards")),
            ("the speed outwards", Factor("radial_speed")), ("the speed around", Factor("circling_speed")),
            ("the last blow", Factor("last_approach")), ("the signed slip of the last blow", Factor("last_slip")),
            ("the slip of the last blow", Factor("last_slip", "absolute_power")),
            ("the number of blows before", Factor("blows")),
        )
    ]  # fmt: skip
    # A floor that pitches as it is accelerated presses at one side: place times acceleration.
    out.append(
        fixed("with the radius and the Host's acceleration outwards",
               (Factor("radius"), Factor("host_acceleration_outwards")))
    )  # fmt: skip
    return out


def _waves() -> list[Modulator]:
    """With angles, and with what has two parts along directions of the room."""
    out = [
        fixed(f"with the {quantity.replace('_', ' ')}, order {order:g}", *((wave,) for wave in waves(quantity, order)))
        for quantity, orders in (
            ("phase", (1.0, 2.0)), ("clock", (1.0,)), ("angle", (1.0, 2.0)), ("azimuth", (1.0, 2.0, 3.0)),
            ("body_angle", (1.0, 2.0)), ("sliding_direction", (1.0, 2.0)), ("sliding_heading", (1.0, 2.0)),
            ("last_azimuth", (1.0, 2.0)),
        )
        for order in orders
    ]  # fmt: skip
    return out + [
        fixed(f"with the {quantity.replace('_', ' ')}", *((way,) for way in ways(quantity)))
        for quantity in ("sliding_along", "host_acceleration_along", "host_velocity_along", "along_host", "along_room")
    ]


def _of_motion(scales: RigScales) -> list[Modulator]:
    speeds, lifts, spins, radii, ranges = (
        [share * unit for share in shares]
        for shares, unit in (
            (SPEEDS, scales.speed_m_per_s), (LIFTS, scales.speed_m_per_s), (SPINS, scales.spin_rad_per_s),
            (BEYOND, scales.radius_m), (RANGES, scales.radius_m),
        )
    )  # fmt: skip
    return [
        with_scale("at slow sliding", ("sliding_speed", "exponential", 1.0), speeds),
        with_scale("at slow motion", ("speed", "exponential", 1.0), speeds),
        with_scale("that the speed takes", ("speed", "rational", 2.0), lifts),
        with_scale("that sliding takes", ("sliding_speed", "rational", 2.0), lifts),
        with_scale("beyond a speed", ("speed", "above", 1.0), lifts),
        with_scale("at slow spin", ("spin", "decay", 1.0), spins),
        with_scale("that the spin takes", ("spin", "rational", 2.0), spins),
        with_scale("at spins below one", ("spin", "gaussian", 1.0), spins),
        with_scale("inside a radius", ("radius", "below", 1.0), radii),
        with_scale("beyond a radius", ("radius", "above", 1.0), radii),
        with_scale("near the wall", ("gap", "exponential", 1.0), ranges),
    ]


def _of_time(scales: RigScales) -> list[Modulator]:
    fades, changes = ([share * scales.run_s for share in shares] for shares in (FADES, CHANGES))
    return [
        with_scale("that settles in the run", ("time", "exponential", 1.0), fades),
        with_scale("that changes at once", ("time", "below", 1.0), changes),
        *(fixed("that changes with a run", (Factor("run", "below", 1.0, run - 0.5),)) for run in range(1, scales.runs)),
    ]


def _of_blows(scales: RigScales) -> list[Modulator]:
    """What remembers the blows before: when the last was, how hard, where; how many there were."""
    times = [share * scales.flight_s for share in TIMES]
    lifts = [share * scales.speed_m_per_s for share in LIFTS]
    # A blow that tosses the disk up, or sets it rocking, does so the longer the harder it was.
    by_blow = [time / scales.speed_m_per_s for time in times]
    hard = (Factor("last_approach"),)

    def recent(fades_s: float) -> Products:
        return ((Factor("recent_blows", y=fades_s),),)

    return [
        with_scale("after an impact", ("since", "exponential", 1.0), times),
        with_scale("just after an impact", ("since", "below", 1.0), times),
        with_scale("with the last blow, for a time", ("since", "exponential", 1.0), times, hard),
        with_scale("until a time that goes with the last blow", ("since_by_blow", "below", 1.0), by_blow),
        with_scale("for a time that goes with the last blow", ("since_by_blow", "exponential", 1.0), by_blow),
        since_struck(fixed("with the speed after the last blow", (Factor("last_left"),))),
        since_struck(with_scale("that the speed after the last blow takes", ("last_left", "rational", 2.0), lifts)),
        since_struck(
            with_scale("that wears off as the disk turns after a blow", ("turned_since", "decay", 1.0), TURNS)
        ),
        with_scale("that the blows wear off", ("blows", "exponential", 1.0), WEARS),
        with_scale(
            "near the last contact", ("from_contact", "exponential", 1.0), [s * scales.radius_m for s in REACHES]
        ),
        Modulator("with the recent blows", recent, tuple(((time,), (SCALE_STEP,)) for time in times), (True,)),
    ]


def _sways(scales: RigScales) -> Modulator:
    """What comes and goes in the run at a rate that nothing else has."""

    def make(rate: float) -> Products:
        return tuple((wave,) for wave in waves("time", 1.0, 1.0 / rate))

    rates = [math.pi * n / scales.run_s for n in range(1, 2 * MOST_CYCLES + 1)]
    step = 0.3 / scales.run_s
    return Modulator("that sways", make, tuple(((rate,), (step / rate,)) for rate in rates), (True,))


def _rings(scales: RigScales, factors: tuple[Factor, ...] = ()) -> Modulator:
    """What a blow leaves ringing, to and fro as it fades."""

    def make(rate: float, fades_s: float) -> Products:
        fades = (*factors, Factor("since", "exponential", 1.0, fades_s))
        return tuple((*fades, wave) for wave in waves("since", 1.0, 1.0 / rate))

    starts = tuple(
        ((n * RING_STEP / scales.flight_s, 0.5 * scales.flight_s), (0.3 / n, 0.3)) for n in range(1, RINGS + 1)
    )
    return Modulator("that rings after an impact", make, starts, (True, True))


def _rings_as_hard(scales: RigScales) -> Modulator:
    return replace(_rings(scales, (Factor("last_approach"),)), name="that rings as hard as the last blow was")


def patches(scales: RigScales, where: str = "host") -> Modulator:
    """Places of the Host, or of the ``"room"``: what stands below the table acts there."""
    step = PLACE_STEP * scales.radius_m

    def make(x: float, y: float, width: float) -> Products:
        return ((Factor(f"distance_in_{where}", "gaussian", 1.0, width, x, y),),)

    starts = tuple(((x, y, share * scales.radius_m), (step, step, 0.2)) for x, y in spots(scales) for share in WIDTHS)
    return Modulator("of a patch" if where == "host" else "of a patch of the room", make, starts, (False, False, True))


def seams(scales: RigScales) -> Modulator:
    """The sides of a straight line."""

    def make(angle: float, place: float) -> Products:
        return ((Factor("along_host", "below", 1.0, place, 0.0, angle),),)

    steps = (ANGLE_STEP, PLACE_STEP * scales.radius_m)
    starts = tuple((line, steps) for line in lines(SEAM_DIRECTIONS, SEAM_PLACES, scales))
    return Modulator("on one side of a line", make, starts, (False, False))


def tracks(scales: RigScales) -> Modulator:
    """A worn or oily track around the Host's centre."""

    def make(radius: float, width: float) -> Products:
        return ((Factor("radius", "gaussian", 1.0, width, radius),),)

    unit, steps = scales.radius_m, (PLACE_STEP * scales.radius_m, 0.2)
    starts = tuple(((share * unit, width * unit), steps) for share in TRACKS for width in TRACK_WIDTHS)
    return Modulator("of a track", make, starts, (False, True))


def _place_waves(scales: RigScales) -> Modulator:
    """What is periodic in place: grooves, holes in rows, a plate that buckles."""

    def make(angle: float, length: float) -> Products:
        return tuple((wave_along(one, angle, length, scales),) for one in waves("along_host"))

    return Modulator("in waves over the floor", make, tuple(wave_starts(scales)), (False, True))


def wave_along(wave: Factor, angle: float, length: float, scales: RigScales) -> Factor:
    """``wave`` of the place in the Host along a direction (rad); its length over a turn of 2 pi is ``length`` (m), the
    contact radius at the most: one that is longer is a slope or a parabola which poses as a wave."""
    return replace(wave, scale=min(length, scales.radius_m), y=angle)


def wave_starts(scales: RigScales) -> Iterator[Start]:
    """Direction (rad) and length (m, over a turn of 2 pi) of wave vectors on a square grid, each with its opposite."""
    most = int(MOST_WAVE_VECTOR / WAVE_VECTOR)
    for i in range(-most, most + 1):
        for j in range(most + 1):
            size = WAVE_VECTOR * math.hypot(i, j)
            if 0.0 < size <= MOST_WAVE_VECTOR and (j > 0 or i > 0):
                yield (math.atan2(j, i), scales.radius_m / size), (0.5 / size, 0.5 / size)
