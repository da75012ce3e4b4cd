"""What a missing law of the impact may look like: functions of what is known before the impact - approach, slip, angle
of incidence, the wall's own speed, spin, azimuth, the side of the disk, phase, time, rest before."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from analysis.gap.laws.dictionary.candidate import Candidate, waves, ways
from analysis.gap.laws.dictionary.modulated import RING_STEP, RINGS, WEARS, Carrier
from analysis.gap.laws.dictionary.parts import plain, scaled
from analysis.gap.laws.dictionary.uneven import of_impacts_uneven, uneven
from ovines.core.laws import words as W
from ovines.core.laws.terms import Factor, Term

Array = NDArray[np.float64]
LAWS = ("restitution", "wall_friction", "tangential_restitution", "spin_kept")
# A spin that an impact adds: by what, in the sense of what.
ADDED = (
    ("constant", ()),
    ("with the approach speed", (Factor("approach"),)),
    ("with the approach speed, by the sense of spin", (Factor("approach"), Factor("spin", "sign"))),
    ("with the approach speed, by the sense of slip", (Factor("approach"), Factor("slip", "sign"))),
    ("by the sense of spin", (Factor("spin", "sign"),)),
    ("by the sense of slip", (Factor("slip", "sign"),)),
    ("with the approach speed and the slip", (Factor("approach"), Factor("slip"))),
    ("with the centre's signed speed along the wall", (Factor("passing"),)),
    ("with the approach speed, by the sense of the spin left", (Factor("approach"), Factor("spin_left", "sign"))),
    ("by the sense of the spin left", (Factor("spin_left", "sign"),)),
    ("with the approach speed and the spin left", (Factor("approach"), Factor("spin_left"))),
    ("with the Host's acceleration about its centre", (Factor("host_acceleration_around"),)),
)
WORDS = {
    "restitution": "restitution", "wall_friction": "wall friction",
    "tangential_restitution": "tangential restitution", "spin_kept": "spin kept",
}  # fmt: skip
# Two quantities together.
PRODUCTS = (
    ("approach speed and slip", (Factor("approach"), Factor("slip", "absolute_power"))),
    ("approach speed and spin", (Factor("approach"), Factor("spin", "absolute_power"))),
    ("approach speed and the sense of slip", (Factor("approach"), Factor("slip", "sign"))),
    ("approach speed and the sense of spin", (Factor("approach"), Factor("spin", "sign"))),
    ("the slip against the spin", (Factor("slip", "sign"), Factor("spin"))),
    ("the slip and the spin", (Factor("slip"), Factor("spin"))),
    ("whether slip and spin have one sense", (Factor("slip", "sign"), Factor("spin", "sign"))),
    ("approach speed and the wall's own speed", (Factor("approach"), Factor("wall_speed"))),
    ("slip and the wall's own speed", (Factor("slip", "absolute_power"), Factor("wall_speed"))),
    ("approach speed and time", (Factor("approach"), Factor("time"))),
    ("approach speed and run", (Factor("approach"), Factor("run"))),
    ("slip over approach speed", (Factor("slip", "absolute_power"), Factor("approach", "absolute_power", -1.0))),
    ("spin over approach speed", (Factor("spin", "absolute_power"), Factor("approach", "absolute_power", -1.0))),
    ("whether it slips as the contact before did", (Factor("slip", "sign"), Factor("last_slip", "sign"))),
    ("the slip of the contact before, against its own", (Factor("slip", "sign"), Factor("last_slip"))),
)
# Quantiles of a quantity at which a scale starts; places on the wall and widths of a spot (rad), half widths of an arc.
SCALES, SPOTS, SPOT_WIDTHS, ARCS, ARC_WIDTHS = (0.1, 0.3, 0.6), 16, (0.25, 0.5), 16, (0.4, 0.9, 1.57)
# Places around the disk, and widths (rad) of a nick or a flat.
SIDES, SIDE_WIDTHS = 8, (0.25, 0.5)
# Around the wall: screws, jaws and lobes; a tool that chattered leaves more.
ORDERS = tuple(float(order) for order in range(1, 17))
TURNING_ORDERS = (1.0, 2.0)
INVERSE_APPROACH = (Factor("approach", "absolute_power", -1.0),)
# A rim that is filed by hand has corners.
SIDE_ORDERS = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0)
# Quantiles of the time in the run at which something changes at once; an arc's steps (rad) of a search.
CHANGES, PLACE_STEP = (0.2, 0.4, 0.6, 0.8), 0.15
# Quantiles of a speed or a spin at which something changes at once; ways from the contact before over the contact
# radius.
STEPS, REACHES = (0.3, 0.5, 0.7), (0.15, 0.4, 1.0)
# Spots at equal distances around the wall: how many, places that are tried between two, widths over their distance.
SPACED, SPACED_STARTS, SPACED_WIDTHS = (2, 3, 4, 6), 6, (0.07, 0.15)
# What goes round the wall with the time: orders of its waves, its turns in the longest run, step (rad in that) of a
# search.
CREEPS, CREEP_TURNS, CREEP_STEP = (1.0, 2.0), (0.25, 0.5, 1.0, 2.0), 0.3
# Times over the usual one between impacts in which what a blow has done fades.
FADES = (1.0, 3.0)
# Times over the usual one between impacts in which what swings after a blow fades; a wall's own wave, and its rate.
SWING_FADES, BREATHING = (0.5, 1.5), ("breathing", "breathing_rate")
# Width (rad) of what a blow leaves where it struck, and times over the usual one between impacts in which it fades.
STRUCK, STRUCK_FADES = (0.3, 0.7), (3.0, 10.0)
# Half cycles in the longest run of what comes and goes by itself; angles of incidence (rad) at which something changes
# at once; runs over all of them in which what was mended settles.
CYCLES, GLANCES, SETTLING_RUNS = 8, (0.2, 0.45, 0.8), (0.2, 0.5)


def law_candidates(known: Array) -> list[Candidate]:
    """Candidates for every number of the contact law, from what is known at the impacts (K, KNOWN_SIZE)."""
    out = []
    for target in LAWS:
        if target == "spin_kept":
            out.append(plain(f"{WORDS[target]}: constant", Term("spin_kept", 1.0)))
        out += [plain(f"{WORDS[target]} with {name}", Term(target, 1.0, (factor,))) for name, factor in _plain()]
        out += [plain(f"{WORDS[target]} with {name}", Term(target, 1.0, factors)) for name, factors in PRODUCTS]
        for quantity in ("azimuth", "body_angle", "phase"):
            for factor, name in (
                (Factor("approach"), "the approach speed"),
                (Factor("slip", "sign"), "the sense of slip"),
            ):
                terms = (Term(target, 1.0, (factor, wave)) for wave in waves(quantity))
                out.append(plain(f"{WORDS[target]} with {name} and the {quantity}", *terms))
        out.append(in_step(WORDS[target], target))
        for quantity in ("host_acceleration_along", "host_velocity_along"):
            terms = (Term(target, 1.0, (way,)) for way in ways(quantity))
            out.append(plain(f"{WORDS[target]} with {quantity.replace('_', ' ')}", *terms))
        out += _around(target)
        if target in ("restitution", "wall_friction"):
            out += creeping(WORDS[target], target, known)
            out += swaying(WORDS[target], target, known)
        out += _scaled(target, known)
        if target != "spin_kept":
            carrier = Carrier(WORDS[target], (Term(target, 1.0),))
            out += [
                candidate
                for quantity in ("azimuth", "body_angle")
                for one in of_impacts_uneven(known, quantity)
                for candidate in carrier.times(uneven(one, quantity))
            ]
    for target in ("restitution", "wall_friction"):
        out += _ringing(target, known)
    out += swinging("restitution of a wall that swings", "restitution", ("swing_rate",), known, INVERSE_APPROACH)
    out += swinging("restitution of a wall that breathes", "restitution", BREATHING, known)
    out += [plain(f"spin added {name}", Term("spin_added", 1.0, factors)) for name, factors in ADDED]
    out += _turned_blow(known)
    for order in SIDE_ORDERS:
        sides = (Term("spin_added", 1.0, (Factor("approach"), wave)) for wave in waves("body_angle", order))
        out.append(plain(f"spin added with the approach speed and the side of the disk, order {order:g}", *sides))
    for order in TURNING_ORDERS:  # a wall that turns in its seat, or on a side of it only
        sides = (Term("spin_added", 1.0, (wave,)) for wave in waves("azimuth", order))
        out.append(plain(f"spin added around the wall, order {order:g}", *sides))
    for order in ORDERS:  # a wall whose normals lean to one side and the other
        leans = (Term("spin_added", 1.0, (Factor("approach"), wave)) for wave in waves("azimuth", order))
        out.append(plain(f"spin added with the approach speed around the wall, order {order:g}", *leans))
    return out


def _turned_blow(known: Array) -> list[Candidate]:
    """A blow that is turned against the slip, or with it, as a lining that piles up before the disk turns it: it moves
    the disk along the wall without a torque, which is missing in the spin then; or one that resists the spin, and stops
    a slow one."""
    out = []
    for word, quantity, column in (("slip", "slip", W.SLIP), ("spin left", "spin_left", W.SPIN_LEFT)):
        values = np.abs(known[:, column])
        sizes = sorted({float(s) for s in np.quantile(values, SCALES)}) if len(values) else []
        name = f"spin added with the approach speed and the {word}, bent"
        out += scaled(name, "spin_added", (quantity, "tanh", 1.0), sizes, (Factor("approach"),))
    return out


def _ringing(target: str, known: Array) -> list[Candidate]:
    """Restitution or friction at a wall that still rings from the impact before, as hard as that was or whatever it
    was."""
    since = known[:, W.SINCE]
    since = since[since < 0.5 * W.LONG_AGO_S]
    if not len(since):
        return []
    usual_s = float(np.median(since))

    def rings(factors: tuple[Factor, ...], rate: float, decay: float) -> tuple[Term, ...]:
        fades = (*factors, Factor("since", "exponential", 1.0, decay))
        return tuple(Term(target, 1.0, (*fades, wave)) for wave in waves("since", 1.0, 1.0 / rate))

    step, name = RING_STEP / usual_s, f"{WORDS[target]} of a wall that rings"
    return [
        Candidate(f"{name}{word}", partial(rings, factors), (n * step, usual_s), (0.3 / n, 0.3), (True, True))
        for word, factors in (("", ()), (" from the blow before", (Factor("last_approach"),)))
        for n in range(1, RINGS + 1)
    ]


def swinging(
    name: str, target: str, quantities: Sequence[str], known: Array, factors: tuple[Factor, ...] = ()
) -> list[Candidate]:
    """What the blows before have set swinging on springs of its own, as it fades: ``quantities`` of it, a column
    each."""
    since = known[:, W.SINCE]
    since = since[since < 0.5 * W.LONG_AGO_S]
    if not len(since):
        return []
    usual_s = float(np.median(since))

    def swings(rate: float, fades_s: float) -> tuple[Term, ...]:
        return tuple(Term(target, 1.0, (*factors, Factor(one, x=rate, y=fades_s))) for one in quantities)

    step = RING_STEP / usual_s
    return [
        Candidate(name, swings, (n * step, fades * usual_s), (0.3 / n, 0.3), (True, True))
        for n in range(1, RINGS + 1)
        for fades in SWING_FADES
    ]


def _plain() -> list[tuple[str, Factor]]:
    return [
        ("the approach speed", Factor("approach")),
        ("the approach speed's square", Factor("approach", "power", 2.0)),
        ("the approach speed to the power -1/4", Factor("approach", "absolute_power", -0.25)),
        ("the approach speed to the power 1/5", Factor("approach", "absolute_power", 0.2)),
        ("the inverse approach speed", Factor("approach", "absolute_power", -1.0)),
        ("the inverse square of the approach speed", Factor("approach", "absolute_power", -2.0)),
        ("the slip", Factor("slip", "absolute_power")),
        ("the slip's square", Factor("slip", "power", 2.0)),
        ("the sense of slip", Factor("slip", "sign")),
        ("the signed slip", Factor("slip")),
        ("the angle of incidence", Factor("incidence")),
        ("the angle of incidence, squared", Factor("incidence", "power", 2.0)),
        ("how glancing it is", Factor("incidence", "cosine", 2.0)),
        ("the centre's speed along the wall", Factor("passing", "absolute_power")),
        ("the square of the centre's speed along the wall", Factor("passing", "power", 2.0)),
        ("the centre's signed speed along the wall", Factor("passing")),
        ("the sense of the centre's way along the wall", Factor("passing", "sign")),
        ("the speed against the Host", Factor("sliding_speed")),
        ("the square of the speed against the Host", Factor("sliding_speed", "power", 2.0)),
        ("the wall's own speed", Factor("wall_speed")),
        ("the size of the wall's own speed", Factor("wall_speed", "absolute_power")),
        ("the square of the wall's own speed", Factor("wall_speed", "power", 2.0)),
        ("the sense of the wall's own speed", Factor("wall_speed", "sign")),
        ("the spin", Factor("spin", "absolute_power")),
        ("the spin's square", Factor("spin", "power", 2.0)),
        ("the sense of spin", Factor("spin", "sign")),
        ("the signed spin", Factor("spin")),
        ("the time in the run", Factor("time")),
        ("the run", Factor("run")),
        ("the speed in the room", Factor("speed")),
        ("the square of the speed in the room", Factor("speed", "power", 2.0)),
        ("the size of the Host's acceleration", Factor("host_acceleration")),
        ("the Host's acceleration outwards", Factor("host_acceleration_outwards")),
        ("the Host's acceleration outwards alone", Factor("host_acceleration_outwards", "above", 1.0, 0.0)),
        ("the sense of the Host's acceleration outwards", Factor("host_acceleration_outwards", "sign")),
        ("the Host's acceleration about its centre", Factor("host_acceleration_around")),
        ("the way from the contact before", Factor("from_contact")),
        ("the approach speed of the contact before", Factor("last_approach")),
        ("the slip of the contact before", Factor("last_slip", "absolute_power")),
        ("the signed slip of the contact before", Factor("last_slip")),
        ("the number of blows before", Factor("blows")),
        ("the surface", Factor("at_cylinder")),
    ]


def _around(target: str) -> list[Candidate]:
    """Around the wall, around the disk, with the drive."""
    word, out = WORDS[target], []
    for quantity, orders in (
        ("azimuth", ORDERS), ("phase", (1.0, 2.0)), ("clock", (1.0,)), ("body_angle", SIDE_ORDERS),
        ("angle", (1.0, 2.0)), ("contact_turn", (1.0, 2.0)), ("rim_turn", (1.0, 2.0)),
    ):  # fmt: skip
        for order in orders:
            terms = tuple(Term(target, 1.0, (wave,)) for wave in waves(quantity, order))
            out.append(plain(f"{word} with the {quantity}, order {order:g}", *terms))
    for name, quantity, function, count, widths in (
        ("of a spot of the wall", "azimuth", "gaussian", SPOTS, SPOT_WIDTHS),
        ("of an arc of the wall", "azimuth", "within", ARCS, ARC_WIDTHS),
        ("of a side of the disk", "body_angle", "gaussian", SIDES, SIDE_WIDTHS),
    ):
        out += around(f"{word} {name}", target, (quantity, function), count, widths)
    if target in ("restitution", "wall_friction"):
        out += spaced(word, target)
    out += scaled(f"{word} near the contact before", target, ("contact_turn", "gaussian", 1.0), SPOT_WIDTHS)
    out += scaled(f"{word} where the rim was struck before", target, ("rim_turn", "gaussian", 1.0), SPOT_WIDTHS)
    return out


def around(name: str, target: str, shape: tuple[str, str], count: int, widths: Sequence[float]) -> list[Candidate]:
    """A function (``shape``: quantity, function) of an angle about ``count`` places, of several ``widths`` (rad)."""
    quantity, function = shape

    def spot(place: float, width: float) -> tuple[Term, ...]:
        return (Term(target, 1.0, (Factor(quantity, function, 1.0, width, place),)),)

    return [
        Candidate(name, spot, (2 * math.pi * i / count - math.pi, width), (PLACE_STEP, 0.2), (False, True))
        for i in range(count)
        for width in widths
    ]


def spaced(name: str, target: str) -> list[Candidate]:
    """Spots of the wall at equal distances: screws, jaws, what the drive has worn at both of its ends."""

    def spots(count: int, place: float, width: float) -> tuple[Term, ...]:
        return (Term(target, 1.0, (Factor("azimuth", "pulses", width, 2 * math.pi / count, place),)),)

    return [
        Candidate(
            f"{name} of {count} spots of the wall", partial(spots, count),
            (2 * math.pi / count * i / SPACED_STARTS, share * 2 * math.pi / count), (PLACE_STEP, 0.2), (False, True),
        )
        for count in SPACED
        for i in range(SPACED_STARTS)
        for share in SPACED_WIDTHS
    ]  # fmt: skip


def creeping(name: str, target: str, known: Array) -> list[Candidate]:
    """A pattern around the wall that goes round with the time: a shim that wanders, a ring that turns in its seat."""
    run_s = float(known[:, W.TIME].max(initial=0.0))
    if not run_s > 0.0:
        return []

    def goes_round(order: float, rate: float) -> tuple[Term, ...]:
        return tuple(Term(target, 1.0, (Factor("turning_azimuth", one, order, y=rate),)) for one in ("cosine", "sine"))

    word, step = f"{name} that goes round the wall, order", CREEP_STEP / run_s
    return [
        Candidate(f"{word} {order:g}", partial(goes_round, order), (2 * math.pi * turns / run_s,), (step,), (False,))
        for order in CREEPS
        for turns in (*(-one for one in CREEP_TURNS), *CREEP_TURNS)
    ]


def swaying(name: str, target: str, known: Array) -> list[Candidate]:
    """What comes and goes in the run by itself, slowly."""
    run_s = float(known[:, W.TIME].max(initial=0.0))

    def sways(rate: float) -> tuple[Term, ...]:
        return tuple(Term(target, 1.0, (wave,)) for wave in waves("time", 1.0, 1.0 / rate))

    rates = [math.pi * n / run_s for n in range(2, CYCLES + 1)] if run_s > 0.0 else []
    return [Candidate(f"{name} that sways", sways, (rate,), (CREEP_STEP / (rate * run_s),), (True,)) for rate in rates]


def in_step(name: str, target: str, order: float = 1.0) -> Candidate:
    """What differs around the wall and with the drive: a side that gives way in step, a wave that goes round."""
    terms = (Term(target, 1.0, (one, other)) for one in waves("azimuth", order) for other in waves("phase"))
    return plain(f"{name} with the azimuth{'' if order == 1 else f', order {order:g},'} and the phase", *terms)


def settling_by_run(name: str, target: str, known: Array) -> list[Candidate]:
    """What was new at the first run, or was mended before it."""
    runs = len(np.unique(known[:, W.RUN]))
    sizes = [share * runs for share in SETTLING_RUNS] if runs > 2 else []
    return scaled(f"{name} that settles from run to run", target, ("run", "exponential", 1.0), sizes)


def struck_here(name: str, target: str, known: Array) -> list[Candidate]:
    """What blows have done where they struck, the wall or the disk's rim: dents, a polish, what they rubbed off."""
    since = known[:, W.SINCE]
    since = since[since < 0.5 * W.LONG_AGO_S]
    if not len(since):
        return []
    usual_s, hard = float(np.median(since)), float(np.median(known[:, W.APPROACH]))

    def lasting(quantity: str, width: float) -> tuple[Term, ...]:
        return (Term(target, 1.0, (Factor(quantity, y=width),)),)

    def full(quantity: str, width: float, enough: float) -> tuple[Term, ...]:
        return (Term(target, 1.0, (Factor(quantity, "rational", 1.0, enough, y=width),)),)

    def fading(quantity: str, width: float, fades_s: float) -> tuple[Term, ...]:
        return (Term(target, 1.0, (Factor(quantity, x=fades_s, y=width),)),)

    out = []
    for quantity, word in (("blows_here", "the wall"), ("rim_blows_here", "the rim")):
        before = f"{name} where {word} was struck"
        for width in STRUCK:
            out.append(Candidate(before, partial(lasting, quantity), (width,), (0.25,), (True,)))
            both = ((0.25, 0.25), (True, True))
            out.append(Candidate(f"{before}, up to enough", partial(full, quantity), (width, hard), *both))
            out += [
                Candidate(f"{before}, as it fades", partial(fading, quantity), (width, share * usual_s), *both)
                for share in STRUCK_FADES
            ]
    return out


def worn(name: str, target: str, known: Array) -> list[Candidate]:
    """What the blows before have done, as it fades."""
    since = known[:, W.SINCE]
    since = since[since < 0.5 * W.LONG_AGO_S]
    if not len(since):
        return []

    def after(fades_s: float) -> tuple[Term, ...]:
        return (Term(target, 1.0, (Factor("recent_blows", y=fades_s),)),)

    def full(fades_s: float, enough: float) -> tuple[Term, ...]:
        return (Term(target, 1.0, (Factor("recent_blows", "rational", 1.0, enough, y=fades_s),)),)

    usual_s, hard = float(np.median(since)), float(np.median(known[:, W.APPROACH] ** 2))
    plainly = [
        Candidate(f"{name} with the recent blows", after, (times * usual_s,), (0.25,), (True,)) for times in FADES
    ]
    word = f"{name} with the recent blows, up to enough of them"
    return plainly + [Candidate(word, full, (times * usual_s, hard), (0.25, 0.25), (True, True)) for times in FADES]


def after_the_way(name: str, target: str, known: Array) -> list[Candidate]:
    """What a rim picks up, or loses, as it slides over the floor: the distance from the contact before is the way since
    within a tenth in 94 % of flights."""
    reaches = [share * float(np.median(known[:, W.CONTACT_RADIUS])) for share in REACHES] if len(known) else []
    return scaled(
        f"{name} with the way from the contact before, ending", target, ("from_contact", "exponential", 1.0), reaches
    )


def _scaled(target: str, known: Array) -> list[Candidate]:
    """What fades, bends or saturates at a scale of its own."""
    word, out = WORDS[target], worn(WORDS[target], target, known)
    out += struck_here(word, target, known)
    out += scaled(f"{word} that the blows wear off", target, ("blows", "exponential", 1.0), WEARS)
    out += after_the_way(word, target, known)
    for name, column, shape, at in (
        ("the time since the impact before", W.SINCE, ("since", "exponential", 1.0), SCALES),
        ("the approach speed, ending", W.APPROACH, ("approach", "exponential", 1.0), SCALES),
        ("the approach speed, fading", W.APPROACH, ("approach", "rational", 2.0), SCALES),
        ("the approach speed beyond one", W.APPROACH, ("approach", "above", 1.0), SCALES[1:]),
        ("the approach speed, at once", W.APPROACH, ("approach", "beyond", 1.0), STEPS),
        ("the number of blows before, at once", W.BLOWS, ("blows", "below", 1.0), CHANGES),
        ("the slip, at once", W.SLIP, ("slip", "within", 1.0), STEPS),
        ("the spin, at once", W.SPIN, ("spin", "within", 1.0), STEPS),
        ("the slip of the contact before, ending", W.LAST_SLIP, ("last_slip", "decay", 1.0), SCALES[1:]),
        ("the slip, ending", W.SLIP, ("slip", "decay", 1.0), SCALES[1:]),
        ("the slip, bent", W.SLIP, ("slip", "tanh", 1.0), SCALES[1:]),
        ("the slip, fading", W.SLIP, ("slip", "rational", 1.0), SCALES[1:]),
        ("the spin, ending", W.SPIN, ("spin", "decay", 1.0), SCALES[1:]),
        ("the time in the run, settling", W.TIME, ("time", "exponential", 1.0), SCALES),
        ("the time in the run, at once", W.TIME, ("time", "below", 1.0), CHANGES),
        ("the run, at once", W.RUN, ("run", "below", 1.0), CHANGES),
    ):
        values = np.abs(known[:, column])
        seen = values[values < 0.5 * W.LONG_AGO_S]
        if column == W.RUN:
            sizes = sorted({math.floor(s) + 0.5 for s in np.quantile(seen, at)}) if np.ptp(seen) > 0 else []
            out += [plain(f"{word} with {name}", Term(target, 1.0, (Factor("run", "below", 1.0, s),))) for s in sizes]
            continue
        sizes = sorted({float(s) for s in np.quantile(seen, at)}) if len(seen) else []
        out += scaled(f"{word} with {name}", target, shape, sizes)
        if column == W.SINCE:  # as hard as that impact was
            out += scaled(f"{word} with {name} and its speed", target, shape, sizes, (Factor("last_approach"),))
    out += settling_by_run(word, target, known)
    return out + scaled(f"{word} with the angle of incidence, at once", target, ("incidence", "within", 1.0), GLANCES)
