"""Candidates of the impacts and the wall whose rate or order no list holds: of each family all are held against the
impacts at once, and the best becomes a candidate that pays what the best gains where the signs of impacts are turned.

A ring that hums by itself or swings after blows, at a rate of its own; waves over the disk's turns; teeth around the
wall or the disk, finer than those that are listed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from analysis.gap.laws.dictionary.candidate import Candidate, waves
from analysis.gap.laws.dictionary.impacts.around import CYCLES, ORDERS, SIDE_ORDERS
from analysis.gap.laws.dictionary.impacts.law import INVERSE_APPROACH, WORDS
from analysis.gap.laws.dictionary.impacts.memory import SWUNG, usual_between_s
from analysis.gap.laws.dictionary.impacts.normals import TARGET as NORMAL_TARGET
from analysis.gap.laws.dictionary.impacts.normals import WORD as NORMAL_WORD
from analysis.gap.laws.dictionary.impacts.walls import BODY_ORDERS, TARGET, WALL_ORDERS, WORD
from analysis.gap.laws.dictionary.parts import ANGLE_STEP, SCALE_STEP
from analysis.gap.laws.impact_rows import ImpactRegression
from analysis.gap.laws.regression.problem import Profile
from analysis.gap.laws.regression.scan import Scan
from ovines.core.laws import words as W
from ovines.core.laws.terms import Factor, Term

Array = NDArray[np.float64]
# Series with turned signs whose best says what looking for a rate takes.
TURNS = 19
# Rates in steps of this share of a turn over all that a clock shows; of a hum no more than so many, and none that turns
# by more (rad) within the sd of an impact's time.
APART, MOST_RATES, MOST_TURNED = 0.25, 3000, 0.5
# The fastest wave over the disk's turns (rad per rad), the finest teeth around the wall and around the disk.
MOST_PER_TURN, MOST_AROUND, MOST_SIDES = 2.0, 40, 24
# Of what swings after blows: times over the usual one between impacts in which it fades; steps of its rate over one
# over the longest of these; its fastest rate over that of the frames, between two of which a blow was.
SWINGS_FADE, SWING_APART, FASTEST = (0.7, 2.0, 5.0), 0.8, 2.0
# A column of which nuisances leave a smaller share says nothing.
LEAST_OWN = 1e-9


@dataclass(frozen=True)
class _Word:
    """What may swing: the product of each of ``ways`` with a wave."""

    name: str
    target: str
    ways: tuple[tuple[Factor, ...], ...] = ((),)

    @property
    def terms(self) -> tuple[Term, ...]:
        """Without the wave."""
        return tuple(Term(self.target, 1.0, factors) for factors in self.ways)


_WAVE = waves("azimuth")
_BOTH_WAYS = tuple((wave,) for wave in _WAVE)
_HUMS = (
    _Word("restitution of a wall that hums", "restitution", (INVERSE_APPROACH,)),
    _Word(
        "restitution of a wall that hums along two lines", "restitution", tuple((*INVERSE_APPROACH, w) for w in _WAVE)
    ),
    *(_Word(f"{WORDS[one]} that sways fast", one) for one in ("restitution", "wall_friction")),
    _Word(f"{WORDS['wall_friction']} that sways fast along two lines", "wall_friction", _BOTH_WAYS),
    _Word(f"{WORDS['tangential_restitution']} that sways", "tangential_restitution"),
    _Word("spin added by a wall that hums", "spin_added"),
    _Word(f"{WORD} that sways fast", TARGET),
    _Word(f"{WORD} that sways fast along two lines", TARGET, _BOTH_WAYS),
)
_TARGETS = (*((WORDS[one], one) for one in ("restitution", "wall_friction", "tangential_restitution")), (WORD, TARGET))
_OVER_TURNS = tuple(_Word(f"{word} in waves over the disk's turns", target) for word, target in _TARGETS)
_SPUN = ("spin added with the approach speed", "spin_added", ((Factor("approach"),),))
_AROUND = (*(_Word(f"{word} in fine waves around the wall", target) for word, target in _TARGETS),
           _Word(f"{NORMAL_WORD} in fine waves around the wall", NORMAL_TARGET))  # fmt: skip
_SIDES = (*(_Word(f"{word} in fine waves around the disk", target) for word, target in _TARGETS),
          _Word(f"{_SPUN[0]} in fine waves around the disk", *_SPUN[1:]))  # fmt: skip


@dataclass(frozen=True)
class _Swing:
    """What swings after blows: ``quantities`` of it, each times the ``factors``."""

    name: str
    target: str
    factors: tuple[Factor, ...]
    quantities: tuple[str, ...]


_SWINGS = (
    _Swing("restitution", "restitution", (), tuple(SWUNG)),
    _Swing("restitution of a wall that goes", "restitution", INVERSE_APPROACH, tuple(SWUNG)),
    _Swing("wall friction", "wall_friction", (), tuple(SWUNG)),
    _Swing("tangential restitution", "tangential_restitution", (), tuple(SWUNG)),
    _Swing("spin added", "spin_added", (), ("twist", "twist_rate")),
    _Swing(WORD, TARGET, (), ("swing", "ovalling", "breathing")),
)
# What is listed with a few rates has the same name here.
_LISTED = {
    ("restitution", INVERSE_APPROACH, "swing_rate"): "restitution of a wall that swings",
    (TARGET, (), "swing"): f"{WORD} of a ring that swings after blows",
    (TARGET, (), "ovalling"): f"{WORD} of a ring that blows make oval",
    (TARGET, (), "breathing"): f"{WORD} of a ring that blows make wider",
}


def rate_candidates(
    rows: ImpactRegression, period_s: float, time_sd_s: float, rng: np.random.Generator
) -> list[Candidate]:
    """The best of each family for the targets that ``rows`` answer; ``period_s``: from frame to frame, ``time_sd_s`` of
    an impact's time, where two flights meet."""
    known = rows.known
    if not len(known):
        return []
    run_s, turns = float(known[:, W.TIME].max()), known[:, W.ANGLE] - known[:, W.START_ANGLE]
    azimuth = np.arctan2(known[:, W.HY], known[:, W.HX])
    walls = TARGET in rows.answers
    teeth = (max(WALL_ORDERS), max(BODY_ORDERS)) if walls else (int(max(ORDERS)), int(max(SIDE_ORDERS)))
    around, sides = (np.arange(a + 1.0, b + 1.0) for a, b in zip(teeth, (MOST_AROUND, MOST_SIDES), strict=True))
    out = _best_swings(rows, period_s, rng)
    if run_s > 0.0:
        step = 2 * math.pi * APART / run_s
        slowest = CYCLES * math.pi / run_s
        fast = np.arange(slowest, min(MOST_TURNED / time_sd_s, slowest + MOST_RATES * step), step)
        out += _best_waves(rows, "time", known[:, W.TIME], fast, _HUMS, rng, step)
    if (span := float(np.ptp(turns))) > 0.0:
        step = 2 * math.pi * APART / span
        # Slower than once over all turns it is no wave: what winds up is listed.
        slow = np.arange(step / APART, MOST_PER_TURN, step)
        out += _best_waves(rows, "turned", turns, slow, _OVER_TURNS, rng, step)
    out += _best_waves(rows, "azimuth", azimuth, around, _AROUND, rng)
    return out + _best_waves(rows, "body_angle", azimuth - known[:, W.ANGLE], sides, _SIDES, rng)


def _best_waves(
    rows: ImpactRegression,
    quantity: str,
    clock: Array,
    rates: Array,
    words: Sequence[_Word],
    rng: np.random.Generator,
    step: float = 0.0,
) -> list[Candidate]:
    """The best wave of each of ``words`` over a ``clock`` (K,), the value of a ``quantity`` at the impacts, whose rates
    may be searched in steps of ``step`` (0: whole orders)."""
    words = [one for one in words if one.target in rows.answers]
    if not words or not len(rates):
        return []
    problem = rows.problem
    ways = [rows.columns(word.terms) for word in words]
    word_of = np.repeat(np.arange(len(words)), [one.shape[1] for one in ways])
    profile = Profile.of(problem)
    left = profile.residual[: len(problem.residual)]
    scan = Scan.of(problem.block, left, clock, np.ones(len(clock)))
    each = scan.gains(np.hstack(ways), _turned(problem.block, rng), rates)
    gains = np.array([each[word_of == i].sum(0) for i in range(len(words))])
    prices = {
        target: float(gains[[word.target == target for word in words], 1:].max()) / problem.excess
        for target in {word.target for word in words}
    }
    out = []
    for word, of_word in zip(words, gains[:, 0], strict=True):
        price = prices[word.target]
        rate = float(rates[int(np.argmax(of_word))])
        make = partial(_waving, word, quantity)
        if step > 0.0:
            near = 0.5 * step / rate
            out.append(Candidate(word.name, make, (rate,), (near,), (True,), price))
            if len(word.ways) > 1:
                sizes = profile.gain(rows.columns(make(rate)))[1].reshape(len(word.ways), -1)
                most = np.linalg.svd(sizes)[0][:, 0]
                name, along = word.name.replace("two lines", "a line"), partial(_along_line, word, quantity)
                numbers, steps = (rate, math.atan2(most[1], most[0])), (near, ANGLE_STEP)
                out.append(Candidate(name, along, numbers, steps, (True, False), price))
        else:
            terms = make(rate)
            out.append(Candidate(f"{word.name}, order {rate:g}", lambda terms=terms: terms, looked=price))
    return out


def _waving(word: _Word, quantity: str, rate: float) -> tuple[Term, ...]:
    pair = waves(quantity, rate) if quantity in ("azimuth", "body_angle") else waves(quantity, 1.0, 1.0 / rate)
    return tuple(Term(word.target, 1.0, (*factors, wave)) for factors in word.ways for wave in pair)


def _along_line(word: _Word, quantity: str, rate: float, angle: float) -> tuple[Term, ...]:
    """The same along one line: its part of the first of the word's ways, turned."""
    *factors, across = word.ways[0]
    turned = (*factors, replace(across, x=angle))
    return tuple(Term(word.target, 1.0, (*turned, wave)) for wave in waves(quantity, 1.0, 1.0 / rate))


def _turned(block: NDArray[np.int64], rng: np.random.Generator) -> Array:
    """Signs (1 + TURNS, M) of each row: as they are, then turned impact by impact."""
    blocks, number = np.unique(block, return_inverse=True)
    signs = np.vstack([np.ones(len(blocks)), rng.choice([-1.0, 1.0], (TURNS, len(blocks)))])
    return np.asarray(signs[:, number.reshape(-1)], float)


def _best_swings(rows: ImpactRegression, period_s: float, rng: np.random.Generator) -> list[Candidate]:
    """The best rate, and of it the best time in which it fades, of everything that may swing after blows."""
    usual_s = usual_between_s(rows.known)
    if usual_s is None:
        return []
    fades = [share * usual_s for share in SWINGS_FADE]
    apart = SWING_APART / fades[-1]
    rates: Array = np.arange(apart, FASTEST / period_s, apart)
    problem, swung = rows.problem, swung_values(rows.known, rates, fades)
    profile, signs = Profile.of(problem), _turned(problem.block, rng)
    signed, basis = signs * profile.residual[: len(problem.residual)], profile.basis[: len(problem.residual)]
    found = list[tuple[_Swing, str, Array]]()
    for swing in (one for one in _SWINGS if one.target in rows.answers):
        unit = rows.columns([Term(swing.target, 1.0, swing.factors)])[:, 0]
        own = np.flatnonzero(unit)
        impact = own % len(rows.known)
        for quantity in swing.quantities:
            table = unit[own, None] * swung[quantity][impact]
            # Nuisances leave the residual as it is, and take of a column what they explain.
            square = np.sum(table**2, 0) - np.sum((basis[own].T @ table) ** 2, 0)
            gain = (signed[:, own] @ table) ** 2 / np.maximum(square, 1e-300)
            found.append((swing, quantity, np.where(square > LEAST_OWN * np.sum(table**2, 0), gain, 0.0)))
    out = []
    for swing, quantity, gain in found:
        price = max(float(one[1:].max()) for other, _, one in found if other.target == swing.target) / problem.excess
        at, rate = divmod(int(np.argmax(gain[0])), len(rates))
        own_numbers, steps = (float(rates[rate]), fades[at]), (0.5 * apart / float(rates[rate]), SCALE_STEP)
        name = _LISTED.get((swing.target, swing.factors, quantity), f"{swing.name} with the {SWUNG[quantity]}")
        make = partial(_swings, swing.target, swing.factors, quantity)
        out.append(Candidate(name, make, own_numbers, steps, (True, True), price))
    return out


def _swings(target: str, factors: tuple[Factor, ...], quantity: str, rate: float, fades_s: float) -> tuple[Term, ...]:
    return (Term(target, 1.0, (*factors, Factor(quantity, x=rate, y=fades_s))),)


def swung_values(known: Array, rates: Array, fades: Sequence[float]) -> dict[str, Array]:
    """By quantity of :data:`SWUNG` what swings at each of the ``rates`` (R,), for each of the times (s) in which it
    ``fades``, (K, F R): :func:`ovines.core.laws.quantities.swing` of all at once."""
    speeds, slips = known[:, W.BLOW_SPEEDS : W.BLOW_WAYS], known[:, W.BLOW_SLIPS : W.START_ANGLE]
    struck = speeds > 0.0
    since = np.where(struck, known[:, [W.TIME]] - known[:, W.BLOW_TIMES : W.BLOW_SPEEDS], 0.0)
    off = np.arctan2(known[:, W.HY], known[:, W.HX])[:, None] - known[:, W.BLOW_WAYS : W.BLOW_SIDES]
    sizes = (speeds * np.cos(off), speeds * np.cos(2.0 * off), speeds, slips)
    faded = [np.where(struck, size * np.exp(-since / s), 0.0) for size in sizes for s in fades]
    weights, turned = np.stack(faded, 1), since[:, :, None] * rates
    values = [(weights @ wave(turned)).reshape(len(known), len(sizes), -1) for wave in (np.sin, np.cos)]
    return {name: values[i % 2][:, i // 2] for i, name in enumerate(SWUNG)}
