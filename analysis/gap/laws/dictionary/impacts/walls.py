"""What a missing shape of the wall, or of the disk, may look like: the contact radius over azimuth and over the disk's
own angle, and what it follows besides."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from analysis.gap.laws.dictionary.between_runs import wall_between
from analysis.gap.laws.dictionary.candidate import QUARTER, Candidate, waves
from analysis.gap.laws.dictionary.impacts.around import IN_STEP, around, creeping, in_step, spaced, swaying
from analysis.gap.laws.dictionary.impacts.law import SCALES
from analysis.gap.laws.dictionary.impacts.memory import (
    BREATHING,
    after_the_way,
    leaning,
    left_fast,
    settling_by_run,
    struck_here,
    swinging,
    turning,
    worn,
)
from analysis.gap.laws.dictionary.modulated import WEARS, Carrier, fixed, with_scale
from analysis.gap.laws.dictionary.parts import SCALE_STEP, plain, scaled
from analysis.gap.laws.dictionary.uneven import of_impacts_uneven, uneven
from ovines.core.laws import words as W
from ovines.core.laws.terms import Factor, Term

Array = NDArray[np.float64]
TARGET, WORD = "contact_radius", "contact radius"
WALL_ORDERS, BODY_ORDERS = range(2, 13), range(2, 7)
# Places around the wall and the disk, widths of dents and flats, half widths of arcs (rad).
PLACES, DENTS, ARCS = 16, (0.15, 0.35), (0.4, 0.9, 1.57)
# A turn, and by how much a search first moves a step of the wall (rad).
TURN, STEP_RAD = 2 * math.pi, 0.15
# Two bodies that are round where they touch stay in contact for a time with the power -1/5 of the approach speed
# (Hertz), and the disk goes on meanwhile; of a rim that gives evenly that time is the same at any speed.
HERTZ = 0.8
LASTING = f"{WORD} of round bodies that give way"
# Orders around the wall and the disk that may change with something; scales over the usual spin or slip.
CHANGING_WALL, CHANGING_BODY, SHARES = (1, 2, 3, 4), (1, 2, 3), (0.5, 1.5)
# So much more of -2 log L must a shape that changes say than one that stays, beside what looking for it takes: an oval
# disk in three runs gained 10 more with the time by chance.  One that remembers turns or blows: by chance the same
# oval disk had a further part by its turns, which 7 more did not keep out.
CLEARLY, REMEMBERS = 9.0, 8.0
_FOLLOWED = (
    ("the time", Factor("time")), ("the run", Factor("run")), ("the approach speed", Factor("approach")),
    ("the slip", Factor("slip", "absolute_power")), ("the signed slip", Factor("slip")),
    ("the spin", Factor("spin", "absolute_power")), ("the signed spin", Factor("spin")),
    ("the spin's square", Factor("spin", "power", 2.0)), ("the sense of spin", Factor("spin", "sign")),
    ("the wall's own speed", Factor("wall_speed")), ("the recent blow", Factor("last_approach")),
    ("the Host's acceleration outwards", Factor("host_acceleration_outwards")),
)  # fmt: skip
# Shares of the usual acceleration, or speed, at which a ring with play lies near its stop.
THROWN = (0.25, 0.7)
# Directions in which a clamped ring is squashed first.
SQUASHED = 6
# Share of the run in which a wall settles; quantiles of the time at which it changes at once.
SETTLES, CHANGES = (0.1, 0.3), (0.2, 0.4, 0.6, 0.8)


def _step(azimuth: float) -> tuple[Term, ...]:
    """A strip bent to a ring, its ends one upon the other."""
    return (Term(TARGET, 1.0, (Factor("azimuth", "sawtooth", x=azimuth),)),)


def _two_steps(azimuth: float) -> tuple[Term, ...]:
    """Two halves put together askew along their joint."""
    return (Term(TARGET, 1.0, (Factor("azimuth", "sawtooth", 2.0, x=azimuth),)),)


def _squashed() -> list[Candidate]:
    """A ring that the Host's acceleration squashes: clamped at one side, or held all around."""

    def clamped(angle: float) -> tuple[Term, ...]:
        along = Factor("host_acceleration_along", x=angle)
        return tuple(Term(TARGET, 1.0, (along, wave)) for wave in waves("azimuth", 2.0))

    squares = (Factor("host_acceleration_outwards", "power", 2.0), Factor("host_acceleration", "power", 2.0))
    angles = [math.pi * i / SQUASHED for i in range(SQUASHED)]
    return [
        *(Candidate(f"{WORD} of a ring clamped at one side", clamped, (a,), (STEP_RAD,), (False,)) for a in angles),
        plain(f"{WORD} of a ring that is squashed", *(Term(TARGET, 1.0, (one,)) for one in squares)),
    ]


def _thrown(known: Array) -> list[Candidate]:
    """A ring that lies in its seat with play, along the drive or across it: the Host's acceleration throws it to either
    side, or what it goes through drags at it, the sooner the less holds it."""
    out = []
    for way_rad, acceleration, speeds in ((0.0, W.HOST_AX, (W.VX, W.UX)), (QUARTER, W.HOST_AY, (W.VY, W.UY))):
        side = Factor("azimuth", "cosine", 1.0, x=way_rad)
        floor = known[:, speeds[0]] - known[:, speeds[1]]
        for done, quantity, values in (
            ("thrown in", "host_acceleration_along", known[:, acceleration]),
            ("dragged back in", "host_velocity_along", floor),
        ):
            usual = float(np.median(np.abs(values))) if len(known) else 0.0

            def thrown(
                held: float, side: Factor = side, way_rad: float = way_rad, quantity: str = quantity
            ) -> tuple[Term, ...]:
                return (Term(TARGET, 1.0, (Factor(quantity, "tanh", 1.0, held, 0.0, way_rad), side)),)

            name = f"{WORD} of a ring that is {done} its seat, along {way_rad:.2g} rad"
            sizes = [share * usual for share in THROWN if usual > 0]
            out += [Candidate(name, thrown, (size,), (SCALE_STEP,), (True,)) for size in sizes]
    return out


def _shapes_that_change(known: Array) -> list[Candidate]:
    """Each wave around the wall or the disk times each of what may make it more or less: a wall that creeps, a rim that
    spin or speed lets bulge."""
    run_s = float(np.max(known[:, W.TIME], initial=0.0))
    usual_spin, usual_slip = (float(np.median(np.abs(known[:, at]))) if len(known) else 0.0 for at in (W.SPIN, W.SLIP))
    modulators = [
        *(fixed(f"with {name}", (factor,)) for name, factor in _FOLLOWED),
        *(with_scale(name, shape, [share * size for share in SHARES]) for name, shape, size in (
            ("as the spin takes it", ("spin", "rational", 2.0), usual_spin),
            ("at slow spin", ("spin", "decay", 1.0), usual_spin),
            ("at small slips", ("slip", "decay", 1.0), usual_slip),
            ("that settles", ("time", "exponential", 1.0), run_s * SETTLES[1]),
        ) if size > 0),
        *of_impacts_uneven(known),
    ]  # fmt: skip
    carriers = [
        Carrier(f"{WORD} with the {quantity.replace('_', ' ')}, order {order}, changing",
                tuple(Term(TARGET, 1.0, (wave,)) for wave in waves(quantity, float(order))))
        for quantity, orders in (("azimuth", CHANGING_WALL), ("body_angle", CHANGING_BODY))
        for order in orders
    ]  # fmt: skip
    made = [one for carrier in carriers for modulator in modulators for one in carrier.times(modulator)]
    whole = Carrier(WORD, (Term(TARGET, 1.0),))
    for modulator in of_impacts_uneven(known):
        made += whole.times(uneven(modulator, "azimuth"))
    price = CLEARLY + 2.0 * math.log(len(modulators))
    made = list({_form(one): one for one in reversed(made)}.values())[::-1]  # some quantities stand in both lists
    return [replace(one, looked=one.looked + price) for one in made]


def _form(one: Candidate) -> frozenset[frozenset[Factor]]:
    """What a candidate says, in whatever order its factors stand."""
    return frozenset(frozenset(term.factors) for term in one.terms)


def wall_candidates(known: Array) -> list[Candidate]:
    """Candidates for the contact radius, from what is known at the impacts (K, KNOWN_SIZE)."""
    out = [*_around(), *wall_between(WORD, TARGET, known)]
    # A form that stands above is no rival of itself.
    listed = {_form(one) for one in out}
    out += [one for one in _shapes_that_change(known) if _form(one) not in listed]
    return [*out, *_moving(known), *_places(), *_followed(known), *_remembered(known), *_in_time(known)]


def _around() -> list[Candidate]:
    """Waves around wall and disk and in step with the drive, and how they change straight on."""
    out = []
    for quantity, orders in (
        ("azimuth", WALL_ORDERS),
        ("body_angle", BODY_ORDERS),
        ("phase", (1, 2)),
        ("clock", (1,)),
        ("contact_turn", (1, 2)),
        ("rim_turn", (1,)),
    ):
        for order in orders:
            terms = tuple(Term(TARGET, 1.0, (wave,)) for wave in waves(quantity, float(order)))
            out.append(plain(f"{WORD} with the {quantity}, order {order}", *terms))
    turned = (Term(TARGET, 1.0, (Factor("last_approach"), wave)) for wave in waves("contact_turn"))
    out.append(plain(f"{WORD} with the contact before and its speed", *turned))
    for quantity, word in (("time", "time"), ("run", "run")):
        for order in (1, 2):  # a wall that creeps, or bends
            terms = tuple(Term(TARGET, 1.0, (Factor(quantity), wave)) for wave in waves("azimuth", float(order)))
            out.append(plain(f"{WORD} with the azimuth and the {word}, order {order}", *terms))
    return out


def _moving(known: Array) -> list[Candidate]:
    """A wall that sways, creeps, wears, swings after blows, or is left out of shape by them."""
    out = []
    out += [in_step(WORD, TARGET, *orders) for orders in IN_STEP]
    out += swaying(WORD, TARGET, known)
    out += settling_by_run(WORD, TARGET, known)
    out += struck_here(WORD, TARGET, known)
    out += spaced(WORD, TARGET)
    out += creeping(WORD, TARGET, known)
    out += worn(WORD, TARGET, known)
    out += swinging(f"{WORD} of a ring that swings after blows", TARGET, ("swing",), known)
    out += swinging(f"{WORD} of a ring that blows make oval", TARGET, ("ovalling",), known)
    out += swinging(f"{WORD} of a ring that blows make wider", TARGET, BREATHING[:1], known)
    out.append(plain(f"{WORD} with the number of blows before", Term(TARGET, 1.0, (Factor("blows"),))))
    out += scaled(f"{WORD} that the blows wear off", TARGET, ("blows", "exponential", 1.0), WEARS)
    out += [*_squashed(), *_thrown(known)]
    return out


def _places() -> list[Candidate]:
    """Steps, dents, arcs and flats, wherever they are."""
    out = []
    out += [
        Candidate(f"{WORD} of a step of the wall", _step, (TURN * i / PLACES,), (STEP_RAD,), (False,))
        for i in range(PLACES)
    ]
    out += [
        Candidate(f"{WORD} of two halves", _two_steps, (0.5 * TURN * i / PLACES,), (STEP_RAD,), (False,))
        for i in range(PLACES)
    ]
    for name, shape, widths in (
        ("of a dent of the wall", ("azimuth", "gaussian"), DENTS),
        ("of an arc of the wall", ("azimuth", "within"), ARCS),
        ("of a flat of the disk", ("body_angle", "gaussian"), DENTS),
    ):
        out += around(f"{WORD} {name}", TARGET, shape, PLACES, widths)
    return out


def _followed(known: Array) -> list[Candidate]:
    """What is known of the impact itself, and of the run."""
    out = []
    for name, factor in (
        ("the approach speed", Factor("approach")), ("the slip", Factor("slip", "absolute_power")),
        ("the signed spin", Factor("spin")), ("the spin's square", Factor("spin", "power", 2.0)),
        ("the spin", Factor("spin", "absolute_power")), ("the signed slip", Factor("slip")),
        ("the wall's own speed", Factor("wall_speed")),
        ("the Host's acceleration outwards", Factor("host_acceleration_outwards")),
        ("the time in the run", Factor("time")), ("the run", Factor("run")),
        ("the sense of spin", Factor("spin", "sign")),
        ("the sense of the wall's own speed", Factor("wall_speed", "sign")),
        ("the sense of the Host's acceleration outwards", Factor("host_acceleration_outwards", "sign")),
        ("the Host's acceleration about its centre", Factor("host_acceleration_around")),
        ("the inverse approach speed", Factor("approach", "absolute_power", -1.0)),
        ("the speed against the Host", Factor("sliding_speed")),
        ("the sense of slip", Factor("slip", "sign")),
        ("the signed slip of the contact before", Factor("last_slip")),
    ):  # fmt: skip
        out.append(plain(f"{WORD} with {name}", Term(TARGET, 1.0, (factor,))))
    out.append(plain(LASTING, Term(TARGET, 1.0, (Factor("approach", "absolute_power", HERTZ),))))
    for name, column, form in (
        ("the slip, ending", W.SLIP, ("slip", "decay", 1.0)),
        ("the approach speed, ending", W.APPROACH, ("approach", "exponential", 1.0)),
        ("the spin, up to an end", W.SPIN, ("spin", "rational", 2.0)),
        ("the spin, ending", W.SPIN, ("spin", "decay", 1.0)),
        ("the approach speed of the contact before, up to an end", W.LAST_APPROACH, ("last_approach", "rational", 2.0)),
    ):
        sizes = np.quantile(np.abs(known[:, column]), SCALES[1:]).tolist() if len(known) else []
        out += scaled(f"{WORD} with {name}", TARGET, form, sizes)
    return out


def _remembered(known: Array) -> list[Candidate]:
    """What the way, the blows and the contact before have left."""
    out = []
    out += after_the_way(WORD, TARGET, known)
    remembering = [*leaning(WORD, TARGET, known), *turning(WORD, TARGET, known), *left_fast(WORD, TARGET, known)]
    out += [replace(one, looked=REMEMBERS) for one in remembering]
    since = known[:, W.SINCE]
    since = since[since < 0.5 * W.LONG_AGO_S]
    fades = np.quantile(since, SCALES).tolist() if len(since) else []
    for word, factors in (
        ("", ()), (" and its speed", (Factor("last_approach"),)), (" and its slip", (Factor("last_slip"),)),
        (" and the sense of its slip", (Factor("last_slip", "sign"),)),
    ):  # fmt: skip
        name = f"{WORD} with the time since the contact before{word}"
        out += scaled(name, TARGET, ("since", "exponential", 1.0), fades, factors)
    return out


def _in_time(known: Array) -> list[Candidate]:
    """A wall that settles, or changes at once."""
    time_s = known[:, W.TIME]
    last = float(time_s.max(initial=0.0))
    settles = [share * last for share in SETTLES]
    out = scaled(f"{WORD} that settles", TARGET, ("time", "exponential", 1.0), settles)
    changes, worn_at = (np.quantile(known[:, at], CHANGES).tolist() if len(known) else [] for at in (W.TIME, W.BLOWS))
    out += scaled(f"{WORD} that changes at once with the blows", TARGET, ("blows", "below", 1.0), worn_at)
    return out + scaled(f"{WORD} that changes at once", TARGET, ("time", "below", 1.0), changes)
