"""What changes between two runs: a table levelled anew, a ring bolted on again, a rim that was cleaned, a bench that
is not warm at once.

From one run on it is another, and nothing says that it was nil before: where no constant is fitted along, both belong
to one candidate, for a step alone explains half of what lies to both sides of the mean."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from analysis.gap.laws.dictionary.candidate import Candidate, waves
from analysis.gap.laws.dictionary.modulated import (
    DRAG,
    FEW,
    FRICTION,
    ROOM,
    Carrier,
    Modulator,
    Products,
    fixed,
    with_scale,
)
from analysis.gap.laws.dictionary.parts import SCALE_STEP, RigScales, plain
from ovines.core.laws import words as W
from ovines.core.laws.terms import Factor, Term

Array = NDArray[np.float64]
# How often what comes and goes does so over all runs, and the fewest runs in which once: fewer are no wave.
TURNS, SHORTEST, TURN = (0.7, 1.0, 2.0), 4.0, 2 * math.pi
# Runs after which what is cleaned, charged or rested now and then begins anew; and how many of the second time must be
# there.
ANEW, SECOND_TIME = range(3, 7), 2
# Runs over all of them in which what was mended, or is not warm yet, settles.
SETTLING_RUNS = (0.2, 0.5)
# Through three runs go a start, an end and a rate, whatever there is; these many say whether it settles so.
FEWEST_SETTLING = 5


def steps_between(known: Array) -> list[float]:
    """Between which runs (numbers from 0, and a half) of those that are ``known`` (K, KNOWN_SIZE) a step may lie."""
    number = np.unique(known[:, W.RUN])
    return [float(one) for one in 0.5 * (number[:-1] + number[1:])]


def of_flights_between(scales: RigScales) -> Iterator[Candidate]:
    """Forces, drags and torques that are one before a run and another from it on."""
    for step in range(1, scales.runs):
        for carrier in (ROOM, DRAG, *FEW):
            yield from carrier.times(_there_and_from(step - 0.5))
    yield from FRICTION.times(_comes_and_goes(scales.runs))
    for every in ANEW:
        for first in range(every if scales.runs >= every + SECOND_TIME else 0):
            yield from FRICTION.times(_begins_anew(every, first))
    settles = with_scale("that settles from run to run", ("run", "exponential", 1.0), settling_runs(scales.runs))
    for carrier in (FRICTION, DRAG, ROOM):
        yield from carrier.times(settles)


def settling_runs(runs: int) -> list[float]:
    """How many runs it may take until something has settled, of so many; none where too few would show it."""
    return [share * runs for share in SETTLING_RUNS] if runs >= FEWEST_SETTLING else []


def _there_and_from(step: float) -> Modulator:
    return fixed(f"that is another from run {step + 1.5:g} on", (), (Factor("run", "beyond", 1.0, step),))


def _comes_and_goes(runs: int) -> Modulator:
    """Once or twice up and down over the series, as the air of a room in the course of a day."""

    def make(scale: float) -> Products:
        return tuple((wave,) for wave in waves("run", 1.0, max(scale, SHORTEST / TURN)))

    starts = tuple(((runs / turns / TURN,), (SCALE_STEP,)) for turns in TURNS if runs / turns >= SHORTEST)
    return Modulator("that comes and goes over the runs", make, starts, (True,))


def _begins_anew(every: int, first: int) -> Modulator:
    """Evenly more with each run, and back before run ``first`` (from 0) and every few runs from it on: dust that is
    wiped off, a battery that is charged."""
    tooth = Factor("run", "sawtooth", 1.0, float(every), first - 0.5)
    return fixed("that begins anew every few runs", (tooth,))


def law_between(word: str, target: str, known: Array) -> list[Candidate]:
    """A number of the contact law, which has a constant beside it."""
    return [
        plain(f"{word} with the run, at once", Term(target, 1.0, (Factor("run", "below", 1.0, step),)))
        for step in steps_between(known)
    ]


def wall_between(word: str, target: str, known: Array) -> list[Candidate]:
    """The wall's radius, or its centre, which have constants beside them."""
    out = []
    for step in steps_between(known):
        later = Factor("run", "beyond", 1.0, step)
        out.append(plain(f"{word} from a run on", Term(target, 1.0, (later,))))
        moved = Carrier(word, tuple(Term(target, 1.0, (wave,)) for wave in waves("azimuth")))
        out += moved.times(fixed("about another centre from a run on", (later,)))
    return out
