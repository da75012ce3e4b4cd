"""Candidates that remember: what the blows before, the way since or the runs before have left, and what rings or swings
after a blow."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from analysis.gap.laws.dictionary.between_runs import settling_runs
from analysis.gap.laws.dictionary.candidate import Candidate, waves
from analysis.gap.laws.dictionary.modulated import RING_STEP, RINGS
from analysis.gap.laws.dictionary.parts import SCALE_STEP, plain, scaled
from ovines.core.laws import words as W
from ovines.core.laws.terms import Factor, Term

Array = NDArray[np.float64]
# Ways from the contact before over the contact radius.
REACHES = (0.15, 0.4, 1.0)
# Times over the usual one between impacts in which what a blow has done fades.
FADES = (1.0, 3.0)
# Times over the usual one between impacts in which what swings after a blow fades; a wall's own wave, and its rate.
SWING_FADES, BREATHING = (0.5, 1.5), ("breathing", "breathing_rate")
#: what blows set swinging, in words
SWUNG = {
    "swing": "place of a ring that swings after blows", "swing_rate": "speed of a ring that swings after blows",
    "ovalling": "place of a ring that blows make oval", "ovalling_rate": "speed of a ring that blows make oval",
    "breathing": "place of a ring that blows make wider", "breathing_rate": "speed of a ring that blows make wider",
    "twist": "place of a ring that blows turn", "twist_rate": "speed of a ring that blows turn",
}  # fmt: skip
# Times over the usual one between impacts in which what does not swing back fades; in which heat goes.
STAYS, COOLS = (1.0, 3.0), 8.0
# Quantiles of what the disk has turned from which on, and over the spread of it within which, something changes.
TURNED, WITHIN_TURNS = (0.2, 0.5, 0.8), (0.15, 0.5)
# Quantiles of a turn or a speed that a blow has left at which a scale starts.
LEFT = (0.2, 0.5, 0.8)
# Width (rad) of what a blow leaves where it struck, and times over the usual one between impacts in which it fades.
STRUCK, STRUCK_FADES = (0.3, 0.7), (3.0, 10.0)


def usual_between_s(known: Array) -> float | None:
    """Usual time (s) between impacts; None where none has one before."""
    since = known[:, W.SINCE]
    since = since[since < 0.5 * W.LONG_AGO_S]
    return float(np.median(since)) if len(since) else None


def ringing(name: str, target: str, known: Array) -> list[Candidate]:
    """Restitution or friction at a wall that still rings from the impact before, as hard as that was or whatever it
    was."""
    usual_s = usual_between_s(known)
    if usual_s is None:
        return []

    def rings(factors: tuple[Factor, ...], rate: float, decay: float) -> tuple[Term, ...]:
        fades = (*factors, Factor("since", "exponential", 1.0, decay))
        return tuple(Term(target, 1.0, (*fades, wave)) for wave in waves("since", 1.0, 1.0 / rate))

    step, name = RING_STEP / usual_s, f"{name} of a wall that rings"
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
    usual_s = usual_between_s(known)
    if usual_s is None:
        return []

    def swings(rate: float, fades_s: float) -> tuple[Term, ...]:
        return tuple(Term(target, 1.0, (*factors, Factor(one, x=rate, y=fades_s))) for one in quantities)

    step = RING_STEP / usual_s
    return [
        Candidate(name, swings, (n * step, fades * usual_s), (0.3 / n, 0.3), (True, True))
        for n in range(1, RINGS + 1)
        for fades in SWING_FADES
    ]


def worn(name: str, target: str, known: Array) -> list[Candidate]:
    """What the blows before have done, as it fades."""
    usual_s, hard = usual_between_s(known), float(np.median(known[:, W.APPROACH] ** 2))
    if usual_s is None:
        return []

    def after(fades_s: float) -> tuple[Term, ...]:
        return (Term(target, 1.0, (Factor("recent_blows", y=fades_s),)),)

    def full(fades_s: float, enough: float) -> tuple[Term, ...]:
        return (Term(target, 1.0, (Factor("recent_blows", "rational", 1.0, enough, y=fades_s),)),)

    plainly = [
        Candidate(f"{name} with the recent blows", after, (times * usual_s,), (0.25,), (True,)) for times in FADES
    ]
    word = f"{name} with the recent blows, up to enough of them"
    return plainly + [Candidate(word, full, (times * usual_s, hard), (0.25, 0.25), (True, True)) for times in FADES]


def struck_here(name: str, target: str, known: Array) -> list[Candidate]:
    """What blows have done where they struck, the wall or the disk's rim: dents, a polish, what they rubbed off."""
    usual_s, hard = usual_between_s(known), float(np.median(known[:, W.APPROACH]))
    if usual_s is None:
        return []

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


def after_the_way(name: str, target: str, known: Array) -> list[Candidate]:
    """What a rim picks up, or loses, as it slides over the floor: the distance from the contact before is the way since
    within a tenth in 94 % of flights."""
    reaches = [share * float(np.median(known[:, W.CONTACT_RADIUS])) for share in REACHES] if len(known) else []
    return scaled(
        f"{name} with the way from the contact before, ending", target, ("from_contact", "exponential", 1.0), reaches
    )


def settling_by_run(name: str, target: str, known: Array) -> list[Candidate]:
    """What was new at the first run, or was mended before it."""
    sizes = settling_runs(len(np.unique(known[:, W.RUN])))
    return scaled(f"{name} that settles from run to run", target, ("run", "exponential", 1.0), sizes)


def leaning(name: str, target: str, known: Array, factors: tuple[Factor, ...] = ()) -> list[Candidate]:
    """What the blows before push away, squeeze, strain or warm, and what comes back as it fades without swinging."""
    usual_s = usual_between_s(known)
    if usual_s is None:
        return []

    def stays(quantity: str, own: tuple[Factor, ...], fades_s: float) -> tuple[Term, ...]:
        return (Term(target, 1.0, (*factors, *own, Factor(quantity, y=fades_s))),)

    against = (Factor("slip", "sign"),)
    return [
        Candidate(f"{name} {word}", partial(stays, quantity, own), (share * usual_s,), (0.25,), (True,))
        for word, quantity, own, times in (
            ("where the blows before have pushed it", "swing_rate", (), STAYS),
            ("where the blows before have made it oval", "ovalling_rate", (), STAYS),
            ("with the blows before, added up", "breathing_rate", (), STAYS),
            ("with the slips before, added up", "twist_rate", (), STAYS),
            ("with the slips before, added up, against its own", "twist_rate", against, STAYS),
            ("with the rubbing before", "recent_rubbing", (), (*STAYS, COOLS)),
            ("that blows warm", "recent_blows", (), (COOLS,)),
        )
        for share in times
    ]


def turning(name: str, target: str, known: Array) -> list[Candidate]:
    """What winds up, or loosens, as the disk turns: since the run began, every turn counted, or since the blow
    before."""
    turned = known[:, W.ANGLE] - known[:, W.START_ANGLE]
    spread = float(np.std(turned)) if len(turned) else 0.0
    if not spread > 0.0:
        return []

    def winds(from_rad: float, within_rad: float) -> tuple[Term, ...]:
        return (Term(target, 1.0, (Factor("turned", "tanh", 1.0, within_rad, from_rad),)),)

    places = sorted({float(one) for one in np.quantile(turned, TURNED)})
    steps = (SCALE_STEP * spread, SCALE_STEP)
    out = [
        plain(f"{name} with the disk's turns", Term(target, 1.0, (Factor("turned"),))),
        *(
            Candidate(f"{name} with the disk's turns, to an end", winds, (place, share * spread), steps, (False, True))
            for place in places
            for share in WITHIN_TURNS
        ),
    ]
    met = (known[:, W.LAST_X] != 0.0) | (known[:, W.LAST_Y] != 0.0)
    since = np.abs(known[met, W.ANGLE] - known[met, W.LAST_ANGLE])
    scales = sorted({float(one) for one in np.quantile(since, LEFT)}) if len(since) else []
    out.append(plain(f"{name} with the turn since the contact before", Term(target, 1.0, (Factor("turned_since"),))))
    for word, function in (("ending", "decay"), ("bent", "tanh")):
        shape = ("turned_since", function, 1.0)
        out += scaled(f"{name} with the turn since the contact before, {word}", target, shape, scales)
    return out


def left_fast(name: str, target: str, known: Array) -> list[Candidate]:
    """What a disk does that the blow before has left fast, as one that rises on its film of air."""
    left = known[:, W.LAST_LEFT]
    left = left[left > 0.0]
    word = f"{name} with the speed after the contact before"
    scales = sorted({float(one) for one in np.quantile(left, LEFT)}) if len(left) else []
    return [
        plain(word, Term(target, 1.0, (Factor("last_left"),))),
        plain(f"{word}, squared", Term(target, 1.0, (Factor("last_left", "power", 2.0),))),
        *scaled(f"{word}, up to an end", target, ("last_left", "rational", 2.0), scales),
    ]
