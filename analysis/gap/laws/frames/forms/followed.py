"""Forms that follow what is known of a frame: time, run and phase, the Host, the spin, and the blow before."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from analysis.gap.laws.dictionary.candidate import Candidate, waves, ways
from analysis.gap.laws.dictionary.parts import ANGLE_STEP, SCALE_STEP
from analysis.gap.laws.frames.forms.by_run import by_run
from analysis.gap.laws.frames.forms.making import (
    SWINGS_FADE,
    Make,
    followed,
    period_s_of,
    scaled,
    swung,
    usual_flight_s,
)
from ovines.core.laws import words as W
from ovines.core.laws.terms import Factor, Term

Array = NDArray[np.float64]
# What a blow leaves fades in so many usual flights.
FADES = (0.2, 0.6)
# Rates (rad) in a usual flight of what swings after a blow, where they are not scanned: steps, and how many.
SWING_STEP, SWINGS = 2.0, 12
# Spins that a blow gives, over the usual one, from which on it leaves something at a stop.
STOPS = (0.3, 1.0)
# Shares of the Host's usual place, velocity or acceleration from which on something is drawn along.
DRAWN = 0.5
# Directions (rad) of a line along which the disk's place is followed up to an end.
FOLLOWED_LINES = tuple(math.pi * i / 4 for i in range(4))
# Shares of a run in which something settles.
SETTLES = (0.05, 0.2)


def settled(word: str, make: Make, known: Array) -> Iterator[Candidate]:
    """Candidates of a target whose terms ``make`` makes of a factor."""
    run_s, period_s = float(known[:, W.TIME].max()), period_s_of(known)
    driven = bool(np.any(known[:, W.CLOCK] > 0))
    follows = partial(followed, word, make)
    for quantity in ("time", "share"):
        line = Factor(quantity)
        yield follows(f"linear in {quantity}", line)
        yield follows(f"linear and square in {quantity}", line, Factor(quantity, "power", 2.0))
    for share in SETTLES:
        settling = partial(scaled, make, "time", "exponential")
        yield Candidate(f"{word}, settling in time", settling, (share * run_s,), (0.3,), (True,))
    yield follows("alternating from frame to frame", Factor("time", "cosine", 1.0, period_s / math.pi))
    yield from by_run(word, make, known)
    if driven:
        for order in (1.0, 2.0):
            yield follows(f"with the drive's phase, order {order:g}", *waves("phase", order))


def after_blows(word: str, make: Make, known: Array, counted: bool = True) -> list[Candidate]:
    """What the blow before leaves: as it was left, or as it fades; ``counted``: what slips a little in each.

    No clock does, and a clock that runs at a rate of its own goes nearly with the number of blows."""
    follows, usual_s = partial(followed, word, make), usual_flight_s(known)
    if usual_s is None:
        return []
    out = [follows("with the number of blows", Factor("blows"))] if counted else []
    out += [
        follows("with the blow before", Factor("last_approach")),
        follows("with the slip of the blow before", Factor("last_slip")),
        follows("with the spin that the blow before gave", Factor("last_spun")),
        follows("by the sense of the spin that the blow before gave", Factor("last_spun", "sign")),
    ]
    spun = max(float(np.sqrt(np.mean(known[:, W.LAST_SPUN] ** 2))), 1e-6)
    stop, name = partial(scaled, make, "last_spun", "tanh"), f"{word}, at the stop that the blow before drove it to"
    out += [Candidate(name, stop, (share * spun,), (SCALE_STEP,), (True,)) for share in STOPS]
    for size, of in ((None, ""), ("last_approach", ", with its speed"), ("last_spun", ", with the spin that it gave")):

        def fading(fades_s: float, size: str | None = size) -> tuple[Term, ...]:
            return make(*([] if size is None else [Factor(size)]), Factor("since", "exponential", 1.0, fades_s))

        name = f"{word}, fading after a blow{of}"
        out += [Candidate(name, fading, (share * usual_s,), (SCALE_STEP,), (True,)) for share in FADES]
    return out


def with_spin(word: str, make: Make, known: Array) -> list[Candidate]:
    """What goes with the disk's spin, up to an end or without one."""
    spin, square, size = Factor("spin"), Factor("spin", "power", 2.0), Factor("spin", "absolute_power")
    follows, usual = partial(followed, word, make), max(float(np.sqrt(np.mean(known[:, W.SPIN] ** 2))), 1e-6)
    out = [follows("with the spin", spin), follows("with its square", square), follows("its size", size)]
    bent = partial(scaled, make, "spin", "gaussian")
    return [*out, Candidate(f"{word}, with the spin, up to an end", bent, (usual,), (SCALE_STEP,), (True,))]


def struck_rim(word: str, make: Make) -> list[Candidate]:
    """What goes along the direction in which the rim was struck."""
    follows, along = partial(followed, word, make), waves("struck_rim")
    struck = times(along, Factor("last_approach"))
    return [
        follows("by where the rim was struck", *along),
        follows("by where the rim was struck, with the blow's speed", *struck),
    ]


def swung_round(word: str, make: Make, known: Array) -> list[Candidate]:
    """What swings after a blow with the spin that it gave, at rates that no scan has asked."""
    usual_s, out = usual_flight_s(known), list[Candidate]()
    for fades_s in () if usual_s is None else (share * usual_s for share in SWINGS_FADE):
        for k in range(1, SWINGS + 1):
            rate = k * SWING_STEP / usual_s if usual_s else 0.0
            out.append(
                Candidate(
                    f"{word}, swinging after a blow with the spin that it gave",
                    partial(swung, make, size="last_spun"),
                    (rate, fades_s),
                    (0.25 / k, SCALE_STEP),
                    (True, True),
                )
            )
    return out


def with_host(word: str, make: Make, known: Array) -> list[Candidate]:
    """What goes with the Host: evenly, to either side of a play, or where it draws at something from a value on."""
    follows, out = partial(followed, word, make), list[Candidate]()
    host = {
        "acceleration": known[:, W.HOST_AX],
        "velocity": known[:, W.VX] - known[:, W.UX],
        "place": known[:, W.X] - known[:, W.HX],
    }
    for what, along in host.items():
        quantity = f"host_{what}_along"
        out.append(follows(f"with the Host's {what} along the drive", Factor(quantity)))
        out.append(follows(f"with the Host's {what}", *ways(quantity)))
        if what == "place":
            out.append(follows("with the Host's place, late", *ways(quantity), *ways("host_velocity_along")))
        out.append(follows(f"by the sense of the Host's {what} along the drive", Factor(quantity, "sign")))
        usual = DRAWN * float(np.std(along))
        if usual > 0:
            for way_rad in (0.0, math.pi):

                def drawn(begins: float, quantity: str = quantity, way_rad: float = way_rad) -> tuple[Term, ...]:
                    return make(Factor(quantity, "above", 1.0, begins, way_rad))

                name = f"{word}, drawn along from a value of the Host's {what} on, along {way_rad:.0f} rad"
                out.append(Candidate(name, drawn, (usual,), (SCALE_STEP,), (True,)))
    return out


def with_disk(word: str, make: Make, known: Array) -> list[Candidate]:
    """What goes with the disk's place in the room, with a lag, with its velocity, or with its place up to an end: a
    camera that steadies its picture takes what moves in it for its own shake."""
    follows, place, velocity = partial(followed, word, make), ways("nes_place_along"), ways("velocity_along")
    out = [
        follows("with the disk's place", *place),
        follows("with the disk's velocity", *velocity),
        follows("with the disk's place, late", *place, *velocity),
    ]
    usual_m = float(np.std(known[:, W.X]))

    def to_an_end(way_rad: float, size_m: float) -> tuple[Term, ...]:
        return make(Factor("nes_place_along", "tanh", 1.0, size_m, way_rad))

    if usual_m > 0:
        name, steps = f"{word}, with the disk's place along a line, to an end", (ANGLE_STEP, SCALE_STEP)
        out += [Candidate(name, to_an_end, (at_rad, usual_m), steps, (False, True)) for at_rad in FOLLOWED_LINES]
    return out


def times(factors: Sequence[Factor], other: Factor) -> tuple[tuple[Factor, Factor], ...]:
    """Each of the factors times another."""
    return tuple((other, factor) for factor in factors)
