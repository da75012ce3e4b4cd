"""What a camera or a clock may do: shift, zoom, turn or delay times functions of time, of the share of a run, of the
run and of the drive's phase; and where a marker may go on its body: besides, with what its body does.

What is constant is not here: a window's place and a camera's delay are effects of the library, a picture that is bent
in all frames alike is told by the lens fields (:mod:`analysis.gap.laws.frames.changed_pictures`).  No list holds every
frequency: of each target all are held against the frames at once, and the best becomes a candidate that pays what the
best gains where the signs of parts of the runs are turned."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from analysis.gap.laws.dictionary.candidate import QUARTER, Candidate, waves, ways
from analysis.gap.laws.dictionary.parts import plain
from analysis.gap.laws.frames.delay import TARGET as DELAY
from analysis.gap.laws.frames.delay import delay_candidates
from analysis.gap.laws.frames.markers import TARGETS, MarkerRows
from analysis.gap.laws.frames.rows import PICTURE, FrameRows, Key, size_of
from analysis.gap.laws.regression.problem import Profile
from ovines.core.laws import words as W
from ovines.core.laws.terms import Factor, Term

Array = NDArray[np.float64]
#: the terms of a target that a factor makes
Make = Callable[[Factor], tuple[Term, ...]]
WORDS = {
    "picture_u": "picture along u", "picture_v": "picture along v", "picture_zoom": "zoom", "picture_turn": "turn",
    "camera_delay": "delay of a camera", "clock_delay": "delay of all cameras",
    "nes_picture_u": "picture of the NES along u", "nes_picture_v": "picture of the NES along v",
    "host_marker": "marker on the Host", "nes_marker": "marker on the NES",
}  # fmt: skip
# Shares of a run (and of the longest run's time) at which a step is tried, and in which something settles.
STEPS, SETTLES = (0.15, 0.3, 0.45, 0.6, 0.75, 0.9), (0.05, 0.2)
# Frequencies in steps of this over a run, up to this share of the frame rate; in turned series, too.  What alternates
# from frame to frame has no phase and is a candidate of its own.
APART, HIGHEST, TURNS = 0.25, 0.48, 19
# Frequencies at a time: their cosines over all frames fit into a cache of some megabytes.
AT_ONCE = 64


def frame_candidates(rows: FrameRows, rng: np.random.Generator) -> list[Candidate]:
    """Every candidate for the targets that the rows answer."""
    known = rows.known
    run_s = float(known[:, W.TIME].max())
    out: list[Candidate] = []
    for key in rows.units:
        out += _of(WORDS[key[0]], partial(_term, key), rows.known)
        if key[0] == DELAY:
            out += delay_candidates(known, key[1])
        if key[0] in PICTURE:  # what hangs on the shaker's frame is shaken by its reaction, whatever the drive
            ways_along = ways("host_acceleration_along")
            out.append(_followed(WORDS[key[0]], partial(_term, key), "with the Host's acceleration", *ways_along))
    return [*out, *_lines(rows, run_s, rng)]


def disk_candidates(rows: FrameRows) -> list[Candidate]:
    """Every candidate for what a view does to the disk alone: what goes with its angle as it turns, and its spin."""
    keys = tuple(rows.units)

    def make(factor: Factor) -> tuple[Term, ...]:
        return tuple(term for key in keys for term in _term(key, factor))

    follows = partial(_followed, "picture of the NES", make)
    out = [follows(f"with its angle, order {order:g}", *waves("angle", order)) for order in (1.0, 2.0)]
    return [*out, follows("with its spin", Factor("spin"))]


def marker_candidates(rows: MarkerRows) -> list[Candidate]:
    """Every candidate for a marker that moves on its body: what a camera may follow, and what its body does."""
    make, word = partial(_both_ways, rows.key), WORDS[rows.key[0]]
    follows = partial(_followed, word, make)
    out = list(_of(word, make, rows.known))
    if rows.key[0] == TARGETS["nes"]:
        spin, square, size = Factor("spin"), Factor("spin", "power", 2.0), Factor("spin", "absolute_power")
        return [*out, follows("with the spin", spin), follows("with its square", square), follows("its size", size)]
    for quantity, of in (("host_acceleration_along", "acceleration"), ("host_velocity_along", "velocity")):
        out.append(follows(f"with the Host's {of} along the drive", Factor(quantity)))
        out.append(follows(f"with the Host's {of}", *ways(quantity)))
    return out


def _of(word: str, make: Make, known: Array) -> Iterator[Candidate]:
    """Candidates of a target whose terms ``make`` makes of a factor."""
    run_s, period_s = float(known[:, W.TIME].max()), _period_s(known)
    runs, driven = int(known[:, W.RUN].max()) + 1, bool(np.any(known[:, W.CLOCK] > 0))
    follows = partial(_followed, word, make)
    for quantity, span in (("time", run_s), ("share", 1.0)):
        line = Factor(quantity)
        yield follows(f"linear in {quantity}", line)
        yield follows(f"linear and square in {quantity}", line, Factor(quantity, "power", 2.0))
        for share in STEPS:
            step = partial(_scaled, make, quantity, "below")
            yield Candidate(f"{word}, a step in {quantity}", step, (share * span,), (0.05,), (True,))
    for share in SETTLES:
        settling = partial(_scaled, make, "time", "exponential")
        yield Candidate(f"{word}, settling in time", settling, (share * run_s,), (0.3,), (True,))
    yield follows("alternating from frame to frame", Factor("time", "cosine", 1.0, period_s / math.pi))
    if runs > 2:
        yield follows("linear in the run", Factor("run"))
    # A step between runs has two on either side at the least: each predicts the other.
    for first in range(2, runs - 1):
        yield follows(f"a step before run {first}", Factor("run", "below", 1.0, first - 0.5))
    if driven:
        for order in (1.0, 2.0):
            yield follows(f"with the drive's phase, order {order:g}", *waves("phase", order))


def _followed(word: str, make: Make, name: str, *factors: Factor) -> Candidate:
    """The target with the factors, each with a coefficient of its own."""
    return plain(f"{word}, {name}", *(term for factor in factors for term in make(factor)))


def _period_s(known: Array) -> float:
    return float(np.median(np.diff(known[:, W.TIME])))


def _term(key: Key, factor: Factor) -> tuple[Term, ...]:
    return (Term(key[0], 1.0, (factor,), x=float(key[1])),)


def _both_ways(key: Key, factor: Factor) -> tuple[Term, ...]:
    """Of a marker along two directions."""
    return tuple(Term(key[0], 1.0, (factor,), float(key[1]), way_rad) for way_rad in (0.0, QUARTER))


def _scaled(make: Make, quantity: str, function: str, scale: float) -> tuple[Term, ...]:
    return make(Factor(quantity, function, 1.0, scale))


def _swinging(key: Key, rate: float) -> tuple[Term, ...]:
    return tuple(term for wave in waves("time", 1.0, 1.0 / rate) for term in _term(key, wave))


def _lines(rows: FrameRows, run_s: float, rng: np.random.Generator) -> list[Candidate]:
    """The best frequency of each target, at the price of having looked for it."""
    problem = rows.problem
    period_s = _period_s(rows.known)
    rates: Array = np.asarray(2 * math.pi * np.arange(0.5, HIGHEST / period_s * run_s, APART) / run_s, float)
    left = Profile.of(problem).residual[: len(problem.residual)]
    blocks, block = np.unique(problem.block, return_inverse=True)
    turned = np.vstack([np.ones(len(blocks)), rng.choice([-1.0, 1.0], (TURNS, len(blocks)))])
    signs = np.asarray(turned[:, block], float)
    out, price = [], 0.0
    for key, unit in rows.units.items():
        weight = np.asarray(np.bincount(rows.at, unit**2, len(rows.known)), float)
        score = np.array([np.bincount(rows.at, unit * left * sign, len(rows.known)) for sign in signs])
        gains = _gains(rows.known[:, W.TIME], weight, score, rates)
        best = int(np.argmax(gains[0]))
        price = max(price, float(gains[1:].max()))
        numbers, step = (float(rates[best]),), (APART / run_s * math.pi / float(rates[best]),)
        out.append(Candidate(f"{WORDS[key[0]]}, swinging in time", partial(_swinging, key), numbers, step, (True,)))
    price /= problem.excess
    return [Candidate(c.name, c.make, c.numbers, c.steps, c.positive, price) for c in out]


def _gains(time_s: Array, weight: Array, score: Array, rates: Array) -> Array:
    """Fall of the sum of squares (K, F) that a cosine and a sine of each rate explain of each of ``score`` (K, N)."""
    out = np.zeros((len(score), len(rates)))
    for first in range(0, len(rates), AT_ONCE):
        turn = np.outer(time_s, rates[first : first + AT_ONCE])
        c, s = np.cos(turn), np.sin(turn)
        a, b, ab = weight @ (c * c), weight @ (s * s), weight @ (c * s)
        x, y = score @ c, score @ s
        out[:, first : first + AT_ONCE] = (b * x**2 - 2 * ab * x * y + a * y**2) / np.maximum(a * b - ab**2, 1e-300)
    return out


def moved_rms(rows: FrameRows, terms: Sequence[Term], coefficients: Array) -> dict[Key, float]:
    """RMS over all frames of what the terms do to each target of a camera."""
    size = size_of(terms, rows.known)
    out: dict[Key, float] = {}
    for key in rows.units:
        own = [j for j, term in enumerate(terms) if (term.target, int(term.x)) == key]
        if own:
            given = size[:, own] @ coefficients[own]
            out[key] = float(np.std(given))
    return out
