"""What is there more on one side than on the other, or in one place, and changes besides: a wall that a lamp warms from
one side, a lane of the floor that wears.

Neither a wave around the wall nor what changes by itself is such a form, but their product with both of its parts:
columns of what changes, as it is and times a cosine and a sine.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from analysis.gap.laws.dictionary.candidate import QUARTER, Candidate, waves, ways
from analysis.gap.laws.dictionary.modulated import (
    BEYOND,
    DRAG,
    FEW,
    FRICTION,
    RANGES,
    ROOM,
    TIMES,
    WEARS,
    Carrier,
    Modulator,
    Products,
    changing,
    first_and_changing,
    fixed,
    patches,
    seams,
    tracks,
    with_scale,
)
from analysis.gap.laws.dictionary.parts import RigScales, pair
from ovines.core.laws import words as W
from ovines.core.laws.terms import Factor, Term

Array = NDArray[np.float64]
# Times over the longest run in which something comes to its last size, and at which it sets in.
RISES, SETS_IN = (0.1, 0.3), (0.2, 0.4, 0.6, 0.8)
# Quantiles of a quantity at which its scale starts; runs at which something sets in, at the most.
SCALES, MOST_RUNS = (0.3, 0.6), 5
_TIME, _RUN = Factor("time"), Factor("run")


def uneven(one: Modulator, quantity: str, order: float = 1.0) -> Modulator:
    """What ``one`` makes more or less, on one side (``order`` sides) more than on the other: each of its columns as it
    is, and times the waves of an angle."""

    def make(*numbers: float) -> Products:
        products = one.make(*numbers)
        around: Products = ((), *((wave,) for wave in waves(quantity, order)))
        return tuple((*factors, *wave) for wave in around for factors in products)

    return replace(one, name=f"{one.name}, unevenly with the {quantity.replace('_', ' ')}, order {order:g}", make=make)


def evenly(quantity: str, order: float = 1.0) -> Modulator:
    """The same of what does not change itself."""
    one = uneven(fixed("there"), quantity, order)
    return replace(one, make=lambda: ((), *((wave,) for wave in waves(quantity, order))))


def uneven_candidates(scales: RigScales) -> list[Candidate]:
    """Of the flights: friction, drags, pulls and slopes."""
    return [
        candidate
        for carrier, one in (*_friction(scales), *_others(scales), *_slopes(scales))
        for candidate in carrier.times(one)
    ]


def _friction(scales: RigScales) -> Iterator[tuple[Carrier, Modulator]]:
    """Of one side, of a place; what wears or gathers in the middle or along the wall: more there at first than at last,
    or less."""
    rises, changes = ([share * scales.run_s for share in shares] for shares in (RISES, SETS_IN))
    one_side = (
        fixed("with time", (_TIME,)),
        fixed("with the run", (_RUN,)),
        with_scale("that sets in", ("time", "rising", 1.0), rises),
        with_scale("that sets in at once", ("time", "beyond", 1.0), changes),
        with_scale("after an impact", ("since", "exponential", 1.0), [t * scales.flight_s for t in TIMES]),
        fixed("with the speed", (Factor("speed"),)),
        fixed("with the spin", (Factor("spin", "absolute_power"),)),
    )
    for one in one_side:
        yield FRICTION, uneven(one, "azimuth")
    for place, first in ((tracks(scales), 1), (seams(scales), 1), (patches(scales), 3)):
        for factor in (_TIME, _RUN):
            two = first_and_changing(place, factor)
            # From every second start, the larger width of each place, as numbers are searched from there; the middle
            # has a form of its own.
            name = f"{place.name}, changing with the {factor.quantity}"
            yield FRICTION, replace(two, name=name, starts=two.starts[first::2])
    middle, wall = ([share * scales.radius_m for share in shares] for shares in (BEYOND[:2], RANGES))
    for place_name, shape, sizes in (
        ("in the middle", ("radius", "gaussian", 1.0), middle),
        ("near the wall", ("gap", "exponential", 1.0), wall),
    ):
        for quantity in ("run", "time"):
            yield FRICTION, changing(f"{place_name}, changing with the {quantity}", shape, sizes, quantity)
    # A plate that bends about a line of the drive's own: place times phase.
    yield FRICTION, fixed("with the place and the phase", *_both(ways("along_host"), waves("phase")))


def of_impacts_uneven(known: Array, quantity: str = "azimuth") -> list[Modulator]:
    """What changes on one side of the wall more than on the other, or of the disk (``quantity`` ``"body_angle"``: of
    that only what a rim is likely to do, as each form more is one more that chance may find); ``known``
    (K, KNOWN_SIZE) of the impacts."""
    run_s = float(known[:, W.TIME].max(initial=0.0))
    since = known[:, W.SINCE]
    since = since[since < 0.5 * W.LONG_AGO_S]
    slow, small, recent = (
        np.quantile(np.abs(values), SCALES).tolist() if len(values) else []
        for values in (known[:, W.APPROACH], known[:, W.SLIP], since)
    )
    both = [
        fixed("with time", (_TIME,)),
        fixed("with the run", (_RUN,)),
        fixed("with the approach speed", (Factor("approach"),)),
        fixed("with the slip", (Factor("slip", "absolute_power"),)),
        fixed("with the spin", (Factor("spin", "absolute_power"),)),
        fixed("with the number of blows before", (Factor("blows"),)),
        with_scale("that sets in", ("time", "rising", 1.0), [share * run_s for share in RISES]),
    ]
    if quantity == "body_angle":
        return both
    last = int(known[:, W.RUN].max(initial=0.0))
    later = np.unique(np.round(np.linspace(1, last, min(last, MOST_RUNS)))) - 0.5
    return [
        *both,
        with_scale("that sets in at once", ("time", "beyond", 1.0), [share * run_s for share in SETS_IN]),
        *(fixed("from a run on", (Factor("run", "beyond", 1.0, float(run)),)) for run in later),
        with_scale("that the blows bring", ("blows", "rising", 1.0), WEARS),
        with_scale("at slow blows", ("approach", "exponential", 1.0), slow),
        with_scale("at small slips", ("slip", "decay", 1.0), small[1:]),
        with_scale("after an impact", ("since", "exponential", 1.0), recent),
    ]


def _both(some: tuple[Factor, ...], others: tuple[Factor, ...]) -> Products:
    return tuple((one, other) for one in some for other in others)


def _others(scales: RigScales) -> Iterator[tuple[Carrier, Modulator]]:
    """What no constant of the flights stands beside: there at first and changing, or setting in; uneven around."""
    rises, changes = ([share * scales.run_s for share in shares] for shares in (RISES, SETS_IN))
    later = (
        fixed("at first and changing with time", (), (_TIME,)),
        fixed("at first and changing with the run", (), (_RUN,)),
        with_scale("that sets in", ("time", "rising", 1.0), rises),
        with_scale("that sets in at once", ("time", "beyond", 1.0), changes),
    )
    for carrier in (ROOM, DRAG, *FEW):
        for one in later:
            yield carrier, one
    beside = Carrier("pull near the wall", (Term("outwards", 1.0, _beside(scales)),))
    for carrier in (DRAG, *FEW[:3], beside):
        for quantity in ("azimuth", "body_angle"):
            for order in (1.0, 2.0):
                yield carrier, evenly(quantity, order)


def _beside(scales: RigScales) -> tuple[Factor, ...]:
    return (Factor("gap", "exponential", 1.0, RANGES[1] * scales.radius_m),)


def _slopes(scales: RigScales) -> Iterator[tuple[Carrier, Modulator]]:
    """Forces that grow with the place along any direction, in any: a sheet that bends with the run, in step with the
    drive, or draws the disk by its pole."""
    rises = [share * scales.run_s for share in RISES]
    place = ways("along_host")
    bent = Carrier("slope with the place", tuple(replace(t, factors=(w,)) for w in place for t in ROOM.terms))
    for one in (
        fixed("and time", (_TIME,)),
        fixed("and the run", (_RUN,)),
        with_scale("that settles", ("time", "exponential", 1.0), rises[1:]),
        fixed("and the phase", *((wave,) for wave in waves("phase"))),
    ):
        yield bent, one
    pole = Carrier("force along the disk", pair("along_body", QUARTER))
    yield pole, fixed("with the place", *((way,) for way in place))
    yield pole, fixed("with the speed's square", (Factor("speed", "power", 2.0),))
