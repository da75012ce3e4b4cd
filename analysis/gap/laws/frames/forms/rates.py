"""Forms of rates that no list holds: of each target all are held against the frames at once - of the time, and of the
time since a blow, as it fades - and the best becomes a candidate that pays what the best gains where the signs of parts
of the runs are turned; so do a sawtooth (a timer that ticks, what sticks and slips, what is set back), gates (what has
two states) and pulses of that rate."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial

import numpy as np
from numpy.typing import NDArray

from analysis.gap.laws.dictionary.candidate import QUARTER, Candidate, waves
from analysis.gap.laws.dictionary.parts import ANGLE_STEP, SCALE_STEP
from analysis.gap.laws.frames.forms.making import SWINGS_FADE, Make, Rows, period_s_of, swung, usual_flight_s
from analysis.gap.laws.regression.problem import Profile
from analysis.gap.laws.regression.scan import Scan
from ovines.core.laws import words as W
from ovines.core.laws.terms import Factor, Term

Array = NDArray[np.float64]
# What has corners is no train of less than so many: a step or what settles, of which it would take the place.
FEWEST_PERIODS = 2.0
# Overtones that pulses may be found by; their width over their period.
OVERTONES, PULSE = (1, 2, 3), 0.08
# Rates about the best one, in this share of the steps in which all were looked at: what has corners has overtones,
# which turn faster.
FINER = 1 / 16
# Shares of a run in which what swings from its beginning on fades.
RINGS_OUT = (0.1, 0.3)
# Frequencies in steps of this over a run, up to this share of the frame rate; in turned series, too.  What alternates
# from frame to frame has no phase and is a candidate of its own.
APART, HIGHEST, TURNS = 0.25, 0.48, 19


def best_rates(units: Mapping[str, tuple[Make, Array]], rows: Rows, rng: np.random.Generator) -> list[Candidate]:
    """The best frequency of each target, by its word: how terms of it are made, and what a unit of it along each of its
    ways adds to the rows (M, W).  At the price of having looked for it."""
    problem, known = rows.problem, rows.known
    run_s, period_s = float(known[:, W.TIME].max()), period_s_of(known)
    left = Profile.of(problem).residual[: len(problem.residual)]
    word_of = np.repeat(np.arange(len(units)), [unit.shape[1] for _, unit in units.values()])
    ways = np.hstack([unit for _, unit in units.values()])
    out = list[Candidate]()

    def best(scan: Scan, rates: Array, block: NDArray[np.int64]) -> tuple[list[float], float]:
        """Best rate of each word, and what the best gains where the signs of each ``block`` (M,) are turned."""
        blocks, number = np.unique(block, return_inverse=True)
        turned = np.vstack([np.ones(len(blocks)), rng.choice([-1.0, 1.0], (TURNS, len(blocks)))])
        each = scan.gains(ways, np.asarray(turned[:, number.reshape(-1)], float), rates)
        gains = np.array([each[word_of == i].sum(0) for i in range(len(units))])
        return rates[np.argmax(gains[:, 0], 1)].tolist(), float(gains[:, 1:].max()) / problem.excess

    even = Scan.of(rows.at, left, known[:, W.TIME], np.ones(len(known)))
    rates: Array = np.asarray(2 * math.pi * np.arange(0.5, HIGHEST / period_s * run_s, APART) / run_s, float)
    swings, price = best(even, rates, problem.block)
    for (word, (make, unit)), rate in zip(units.items(), swings, strict=True):
        step = APART / run_s * math.pi / rate
        out.append(Candidate(f"{word}, swinging in time", partial(_swinging, make), (rate,), (step,), (True,), price))
        for share in RINGS_OUT:
            ringing, numbers = partial(_ringing_out, make), (rate, share * run_s)
            name = f"{word}, ringing out from the run's beginning"
            out.append(Candidate(name, ringing, numbers, (step, SCALE_STEP), (True, True), price))
        rate, phase = _finest(even, unit, rate, 2 * math.pi * APART / run_s)
        if rate * run_s < 2 * math.pi * FEWEST_PERIODS:
            continue
        near, positive = (FINER * step, ANGLE_STEP), (True, False)
        # A sawtooth rises or falls at its steps.
        for at in (phase - QUARTER, phase + QUARTER):
            ticking = partial(_ticking, make)
            out.append(Candidate(f"{word}, a sawtooth in time", ticking, (rate, at), near, positive, price))
        # Of narrow pulses an overtone may be the strongest: they are at one in so many of its crests.
        for overtone in (n for n in OVERTONES if rate / n * run_s >= 2 * math.pi * FEWEST_PERIODS):
            pulsing, every = partial(_pulsing, make), rate / overtone
            out += [
                Candidate(
                    f"{word}, in pulses",
                    pulsing,
                    (every, (phase + 2 * math.pi * crest) / overtone, PULSE),
                    (*near, SCALE_STEP),
                    (True, False, True),
                    price,
                )
                for crest in range(overtone)
            ]
        switching = partial(_switching, make)
        out.append(Candidate(f"{word}, in two states", switching, (rate, phase), near, positive, price))
    usual_s, struck = usual_flight_s(known), known[:, W.SINCE] < 0.5 * W.LONG_AGO_S
    since = np.where(struck, known[:, W.SINCE], 0.0)
    # What a blow leaves is another matter after each.
    flight = (known[:, W.RUN] * (1 + known[:, W.BLOWS].max()) + known[:, W.BLOWS]).astype(np.int64)[rows.at]
    for fades_s in () if usual_s is None else (share * usual_s for share in SWINGS_FADE):
        # What fades so soon tells no rates apart that turn by less in that time.
        slow: Array = np.asarray(2 * math.pi * np.arange(0.5, HIGHEST / period_s * fades_s, APART) / fades_s, float)
        if not len(slow):
            continue
        size = np.where(struck, known[:, W.LAST_APPROACH], 0.0) * np.exp(-since / fades_s)
        after = Scan.of(rows.at, left, since, size)
        swings, price = best(after, slow, flight)
        for (word, (make, _)), rate in zip(units.items(), swings, strict=True):
            step, swinging = APART / fades_s * math.pi / rate, partial(swung, make)
            name, positive = f"{word}, swinging after a blow", (True, True)
            out.append(Candidate(name, swinging, (rate, fades_s), (step, SCALE_STEP), positive, price))
    return out


def _swinging(make: Make, rate: float) -> tuple[Term, ...]:
    return tuple(term for wave in waves("time", 1.0, 1.0 / rate) for term in make(wave))


def _ringing_out(make: Make, rate: float, fades_s: float) -> tuple[Term, ...]:
    """A camera that was touched as a run began, a drive that was switched on."""
    fading = Factor("time", "exponential", 1.0, fades_s)
    return tuple(term for wave in waves("time", 1.0, 1.0 / rate) for term in make(wave, fading))


def _ticking(make: Make, rate: float, turned: float) -> tuple[Term, ...]:
    """A sawtooth of the time whose fundamental is sin(rate t - turned)."""
    return make(Factor("time", "sawtooth", 1.0, 2 * math.pi / rate, turned / rate))


def _switching(make: Make, rate: float, turned: float) -> tuple[Term, ...]:
    """One of two states, each for half of the time: the fundamental of the first is cos(rate t - turned)."""
    return make(Factor("time", "gates", math.pi / rate, 2 * math.pi / rate, turned / rate))


def _pulsing(make: Make, rate: float, turned: float, width: float) -> tuple[Term, ...]:
    """Pulses of the time, highest where cos(rate t - turned) is, and as wide as this share of their period."""
    period_s = 2 * math.pi / rate
    return make(Factor("time", "pulses", width * period_s, period_s, turned / rate))


def _finest(scan: Scan, unit: Array, rate: float, apart: float) -> tuple[float, float]:
    """The best rate near ``rate``, and the phase at which its wave, along the way that has most of it, is highest."""
    rates: Array = np.asarray(rate + apart * np.arange(-1, 1 + FINER, FINER), float)
    rates = rates[rates > 0]
    best = float(rates[int(np.argmax(scan.gains(unit, np.ones((1, len(unit))), rates).sum((0, 1))))])
    turn = best * scan.clock[scan.at]
    waved = [np.column_stack([way * np.cos(turn), way * np.sin(turn)]) for way in unit.T]
    along, across = max((np.linalg.lstsq(one, scan.left, rcond=None)[0] for one in waved), key=lambda one: one @ one)
    return best, math.atan2(across, along)
