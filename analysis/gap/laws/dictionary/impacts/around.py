"""Candidates over angles: around the wall, around the disk, with the drive, and what goes round or sways in time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from analysis.gap.laws.dictionary.candidate import Candidate, waves
from analysis.gap.laws.dictionary.parts import plain, scaled
from ovines.core.laws import words as W
from ovines.core.laws.terms import Factor, Term

Array = NDArray[np.float64]
# Places on the wall and widths of a spot (rad), half widths of an arc.
SPOTS, SPOT_WIDTHS, ARCS, ARC_WIDTHS = 16, (0.25, 0.5), 16, (0.4, 0.9, 1.57)
# Places around the disk, and widths (rad) of a nick or a flat.
SIDES, SIDE_WIDTHS = 8, (0.25, 0.5)
# Around the wall: screws, jaws and lobes; a tool that chattered leaves more.
ORDERS = tuple(float(order) for order in range(1, 17))
# A rim that is filed by hand has corners.
SIDE_ORDERS = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0)
# An arc's steps (rad) of a search.
PLACE_STEP = 0.15
# Spots at equal distances around the wall: how many, places that are tried between two, widths over their distance.
SPACED, SPACED_STARTS, SPACED_WIDTHS = (2, 3, 4, 6), 6, (0.07, 0.15)
# What goes round the wall with the time: orders of its waves, its turns in the longest run, step (rad in that) of a
# search.
CREEPS, CREEP_TURNS, CREEP_STEP = (1.0, 2.0), (0.25, 0.5, 1.0, 2.0), 0.3
# Orders around the wall and over the drive's phase of what differs with both.
IN_STEP = ((1.0, 1.0), (2.0, 1.0), (1.0, 2.0), (2.0, 2.0))
# Half cycles in the longest run of what comes and goes by itself.
CYCLES = 8


def around_everything(word: str, target: str, several: bool) -> list[Candidate]:
    """Around the wall, around the disk, with the drive; ``several``: spots at equal distances, too."""
    out = []
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
    if several:
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


def meshing(name: str, target: str) -> Candidate:
    """What differs around the wall and around the disk at once: two wheels that run out."""
    pairs = [(one, other) for one in waves("azimuth") for other in waves("body_angle")]
    return plain(f"{name} with the azimuth and the body_angle", *(Term(target, 1.0, one) for one in pairs))


def in_step(name: str, target: str, order: float = 1.0, cycles: float = 1.0) -> Candidate:
    """What differs around the wall and with the drive: a side that gives way in step, a wave that goes round."""
    pairs = [(one, other) for one in waves("azimuth", order) for other in waves("phase", cycles)]
    around = f"azimuth{'' if order == 1 else f', order {order:g},'}"
    phase = f"phase{'' if cycles == 1 else f', order {cycles:g}'}"
    return plain(f"{name} with the {around} and the {phase}", *(Term(target, 1.0, one) for one in pairs))
