"""What a missing law of the impact, or a missing shape of the wall, may look like: functions of what is known before
the impact."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from analysis.gap.laws.candidate import Candidate, waves
from ovines.core.laws import words as W
from ovines.core.laws.terms import Factor, Term

Array = NDArray[np.float64]
LAWS = ("restitution", "wall_friction", "tangential_restitution", "spin_kept")
WORDS = {
    "restitution": "restitution", "wall_friction": "wall friction",
    "tangential_restitution": "tangential restitution", "spin_kept": "spin kept", "contact_radius": "contact radius",
}  # fmt: skip
# Quantiles of a quantity at which a scale starts; places on the wall and widths of a spot (rad).
SCALES, SPOTS, SPOT_WIDTHS = (0.1, 0.3, 0.6), 16, (0.25, 0.5)
ORDERS, WALL_ORDERS, BODY_ORDERS = (1.0, 2.0, 3.0, 4.0), range(2, 9), range(2, 6)


def law_candidates(known: Array) -> list[Candidate]:
    """Candidates for every number of the contact law."""
    out = []
    for target in LAWS:
        if target == "spin_kept":
            out.append(Candidate(f"{WORDS[target]}: constant", lambda: (Term("spin_kept", 1.0),)))
        out += _of(target, known)
    return out


def _of(target: str, known: Array) -> list[Candidate]:
    word = WORDS[target]
    out = [_one(f"{word} with {name}", target, factor) for name, factor in _plain()]
    for quantity, orders in (("azimuth", ORDERS), ("phase", (1.0, 2.0)), ("clock", (1.0,)), ("body_angle", (1.0, 2.0))):
        for order in orders:
            terms = tuple(Term(target, 1.0, (wave,)) for wave in waves(quantity, order))
            out.append(Candidate(f"{word} with the {quantity}, order {order:g}", lambda terms=terms: terms))

    def spot(place: float, width: float) -> tuple[Term, ...]:
        return (Term(target, 1.0, (Factor("azimuth", "gaussian", 1.0, width, place),)),)

    for i in range(SPOTS):
        for width in SPOT_WIDTHS:
            numbers = (2 * math.pi * i / SPOTS - math.pi, width)
            out.append(Candidate(f"{word} of a spot of the wall", spot, numbers, (0.15, 0.2), (False, True)))
    for quantity, name, values in (
        ("since", "the time since the impact before", known[:, W.SINCE]),
        ("approach", "the approach speed, ending", known[:, W.APPROACH]),
    ):
        seen = values[values < 0.5 * W.LONG_AGO_S]
        scales = {float(s) for s in np.quantile(seen, SCALES)} if len(seen) else set()

        def fading(scale: float, quantity: str = quantity) -> tuple[Term, ...]:
            return (Term(target, 1.0, (Factor(quantity, "exponential", 1.0, scale),)),)

        out += [Candidate(f"{word} with {name}", fading, (s,), (0.25,), (True,)) for s in sorted(scales) if s > 0]
    return out


def _plain() -> list[tuple[str, Factor]]:
    return [
        ("the approach speed", Factor("approach")),
        ("the approach speed's square", Factor("approach", "power", 2.0)),
        ("the slip", Factor("slip", "absolute_power")),
        ("the slip's square", Factor("slip", "power", 2.0)),
        ("the sense of slip", Factor("slip", "sign")),
        ("the spin", Factor("spin", "absolute_power")),
        ("the spin's square", Factor("spin", "power", 2.0)),
        ("the sense of spin", Factor("spin", "sign")),
        ("the signed spin", Factor("spin")),
        ("the time in the run", Factor("time")),
        ("the run", Factor("run")),
        ("the speed in the room", Factor("speed")),
    ]


def _one(name: str, target: str, factor: Factor) -> Candidate:
    return Candidate(name, lambda: (Term(target, 1.0, (factor,)),))


def wall_candidates() -> list[Candidate]:
    """Candidates for the contact radius: over the azimuth, and over the disk's own angle."""
    target, word = "contact_radius", WORDS["contact_radius"]
    out = []
    for quantity, orders in (("azimuth", WALL_ORDERS), ("body_angle", BODY_ORDERS)):
        for order in orders:
            terms = tuple(Term(target, 1.0, (wave,)) for wave in waves(quantity, float(order)))
            out.append(Candidate(f"{word} with the {quantity}, order {order}", lambda terms=terms: terms))
    for name, factor in (
        ("the approach speed", Factor("approach")), ("the slip", Factor("slip")), ("the spin", Factor("spin")),
        ("the time in the run", Factor("time")), ("the run", Factor("run")),
    ):  # fmt: skip
        out.append(_one(f"{word} with {name}", target, factor))
    return out
