"""What a camera or a clock may do: shift, zoom, turn or delay times functions of time, of the share of a run, of the
run, of the drive's phase, of the Host's motion and of the blow before; and where a marker may go on its body: besides,
with what its body does.

What is constant is not here: a window's place and a camera's delay are effects of the library, a picture that is bent
in all frames alike is told by the lens fields (:mod:`analysis.gap.laws.frames.changed_pictures`).  No list holds every
frequency: of each target all are held against the frames at once - of the time, and of the time since a blow, as it
fades - and the best becomes a candidate that pays what the best gains where the signs of parts of the runs are turned;
so do a sawtooth (a timer that ticks, what sticks and slips, what is set back), gates (what has two states) and pulses
of that rate."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from analysis.gap.laws.dictionary.candidate import QUARTER, Candidate, waves, ways
from analysis.gap.laws.dictionary.parts import ANGLE_STEP, SCALE_STEP, plain
from analysis.gap.laws.frames.delay import TARGET as DELAY
from analysis.gap.laws.frames.delay import delay_candidates
from analysis.gap.laws.frames.markers import TARGETS, MarkerRows
from analysis.gap.laws.frames.rows import PICTURE, FrameRows, Key, size_of
from analysis.gap.laws.regression.problem import Profile
from ovines.core.laws import words as W
from ovines.core.laws.terms import Factor, Term

Array = NDArray[np.float64]
#: the terms of a target that factors make, as a product
Make = Callable[..., tuple[Term, ...]]
WORDS = {
    "picture_u": "picture along u", "picture_v": "picture along v", "picture_zoom": "zoom", "picture_turn": "turn",
    "camera_delay": "delay of a camera", "clock_delay": "delay of all cameras",
    "nes_picture_u": "picture of the NES along u", "nes_picture_v": "picture of the NES along v",
    "host_marker": "marker on the Host", "nes_marker": "marker on the NES",
}  # fmt: skip
# What a blow leaves fades in so many usual flights; what it leaves swinging, in so many.
FADES, SWINGS_FADE = (0.2, 0.6), (0.3, 1.0)
# Rates (rad) in a usual flight of what swings after a blow, where they are not scanned: steps, and how many.
SWING_STEP, SWINGS = 2.0, 12
# Spins that a blow gives, over the usual one, from which on it leaves something at a stop.
STOPS = (0.3, 1.0)
# Shares of the Host's usual place, velocity or acceleration from which on something is drawn along.
DRAWN = 0.5
# What has corners is no train of less than so many: a step or what settles, of which it would take the place.
FEWEST_PERIODS = 2.0
# Overtones that pulses may be found by; their width over their period.
OVERTONES, PULSE = (1, 2, 3), 0.08
# Rates about the best one, in this share of the steps in which all were looked at: what has corners has overtones,
# which turn faster.
FINER = 1 / 16
# Shares of a run (and of the longest run's time) at which a step is tried, and in which something settles.
STEPS, SETTLES = (0.15, 0.3, 0.45, 0.6, 0.75, 0.9), (0.05, 0.2)
# Frequencies in steps of this over a run, up to this share of the frame rate; in turned series, too.  What alternates
# from frame to frame has no phase and is a candidate of its own.
APART, HIGHEST, TURNS = 0.25, 0.48, 19
# Instants (s) and sizes (of the largest) that are the same, but for rounding.
SAME_INSTANT_S, SAME_SIZE = 1e-8, 1e-8
# Frequencies at a time: their cosines over all frames fit into a cache of some megabytes.
AT_ONCE = 64


def frame_candidates(rows: FrameRows, rng: np.random.Generator) -> list[Candidate]:
    """Every candidate for the targets that the rows answer."""
    known = rows.known
    out: list[Candidate] = []
    for key in rows.units:
        make = partial(_term, key)
        out += settled(WORDS[key[0]], make, known)
        out += after_blows(WORDS[key[0]], make, known, counted=key[0] in PICTURE)
        if key[0] == DELAY:
            out += delay_candidates(known, key[1])
        if key[0] in PICTURE:  # what hangs on the shaker's frame is shaken by its reaction, whatever the drive
            out += _with_host(WORDS[key[0]], make, known)
    units = {WORDS[key[0]]: (partial(_term, key), unit[:, None]) for key, unit in rows.units.items()}
    return [*out, *_lines(units, rows, rng)]


def disk_candidates(rows: FrameRows, rng: np.random.Generator) -> list[Candidate]:
    """Every candidate for what a view does to the disk alone: what goes with its angle as it turns, its spin, its
    velocity, the blow before, and what swings in time."""
    keys = tuple(rows.units)

    def make(*factors: Factor) -> tuple[Term, ...]:
        return tuple(term for key in keys for term in _term(key, *factors))

    follows = partial(_followed, "picture of the NES", make)
    out = [follows(f"with its angle, order {order:g}", *waves("angle", order)) for order in (1.0, 2.0)]
    out += [follows("with its spin", Factor("spin")), follows("with its speed", Factor("speed"))]
    out.append(follows("with its velocity", *ways("velocity_along")))
    units = {WORDS[key[0]]: (partial(_term, key), unit[:, None]) for key, unit in rows.units.items()}
    out += after_blows("picture of the NES", make, rows.known)
    return [*out, *_lines(units, rows, rng)]


def marker_candidates(rows: MarkerRows, rng: np.random.Generator) -> list[Candidate]:
    """Every candidate for a marker that moves on its body: what a camera may follow, and what its body does."""
    make, word = partial(_both_ways, rows.key), WORDS[rows.key[0]]
    follows = partial(_followed, word, make)
    out = [*settled(word, make, rows.known), *after_blows(word, make, rows.known)]
    if rows.key[0] == TARGETS["nes"]:
        out += with_spin(word, make, rows.known)
        out += [follows(f"with the angle, order {order:g}", *waves("angle", order)) for order in (1.0, 2.0)]
        for power in (1.0, 2.0):
            blown = _times(waves("heading"), Factor("speed", order=power))
            out.append(follows(f"by the air, speed to the power {power:g}", *blown))
        out += struck_rim(word, make)
    else:
        out += _with_host(word, make, rows.known)
    return [*out, *_lines({word: (make, rows.unit)}, rows, rng)]


def with_spin(word: str, make: Make, known: Array) -> list[Candidate]:
    """What goes with the disk's spin, up to an end or without one."""
    spin, square, size = Factor("spin"), Factor("spin", "power", 2.0), Factor("spin", "absolute_power")
    follows, usual = partial(_followed, word, make), max(float(np.sqrt(np.mean(known[:, W.SPIN] ** 2))), 1e-6)
    out = [follows("with the spin", spin), follows("with its square", square), follows("its size", size)]
    bent = partial(_scaled, make, "spin", "gaussian")
    return [*out, Candidate(f"{word}, with the spin, up to an end", bent, (usual,), (SCALE_STEP,), (True,))]


def struck_rim(word: str, make: Make) -> list[Candidate]:
    """What goes along the direction in which the rim was struck."""
    follows, along = partial(_followed, word, make), waves("struck_rim")
    struck = _times(along, Factor("last_approach"))
    return [
        follows("by where the rim was struck", *along),
        follows("by where the rim was struck, with the blow's speed", *struck),
    ]


def swung_round(word: str, make: Make, known: Array) -> list[Candidate]:
    """What swings after a blow with the spin that it gave, at rates that no scan has asked."""
    usual_s, out = _usual_flight_s(known), list[Candidate]()
    for fades_s in () if usual_s is None else (share * usual_s for share in SWINGS_FADE):
        for k in range(1, SWINGS + 1):
            rate = k * SWING_STEP / usual_s if usual_s else 0.0
            out.append(
                Candidate(
                    f"{word}, swinging after a blow with the spin that it gave",
                    partial(_swung, make, size="last_spun"),
                    (rate, fades_s),
                    (0.25 / k, SCALE_STEP),
                    (True, True),
                )
            )
    return out


def after_blows(word: str, make: Make, known: Array, counted: bool = True) -> list[Candidate]:
    """What the blow before leaves: as it was left, or as it fades; ``counted``: what slips a little in each.

    No clock does, and a clock that runs at a rate of its own goes nearly with the number of blows."""
    follows, usual_s = partial(_followed, word, make), _usual_flight_s(known)
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
    stop, name = partial(_scaled, make, "last_spun", "tanh"), f"{word}, at the stop that the blow before drove it to"
    out += [Candidate(name, stop, (share * spun,), (SCALE_STEP,), (True,)) for share in STOPS]
    for size, of in ((None, ""), ("last_approach", ", with its speed"), ("last_spun", ", with the spin that it gave")):

        def fading(fades_s: float, size: str | None = size) -> tuple[Term, ...]:
            return make(*([] if size is None else [Factor(size)]), Factor("since", "exponential", 1.0, fades_s))

        name = f"{word}, fading after a blow{of}"
        out += [Candidate(name, fading, (share * usual_s,), (SCALE_STEP,), (True,)) for share in FADES]
    return out


def _with_host(word: str, make: Make, known: Array) -> list[Candidate]:
    """What goes with the Host: evenly, to either side of a play, or where it draws at something from a value on."""
    follows, out = partial(_followed, word, make), list[Candidate]()
    host = {
        "acceleration": known[:, W.HOST_AX],
        "velocity": known[:, W.VX] - known[:, W.UX],
        "place": known[:, W.X] - known[:, W.HX],
    }
    for what, along in host.items():
        quantity = f"host_{what}_along"
        out.append(follows(f"with the Host's {what} along the drive", Factor(quantity)))
        out.append(follows(f"with the Host's {what}", *ways(quantity)))
        out.append(follows(f"by the sense of the Host's {what} along the drive", Factor(quantity, "sign")))
        usual = DRAWN * float(np.std(along))
        if usual > 0:
            for way_rad in (0.0, math.pi):

                def drawn(begins: float, quantity: str = quantity, way_rad: float = way_rad) -> tuple[Term, ...]:
                    return make(Factor(quantity, "above", 1.0, begins, way_rad))

                name = f"{word}, drawn along from a value of the Host's {what} on, along {way_rad:.0f} rad"
                out.append(Candidate(name, drawn, (usual,), (SCALE_STEP,), (True,)))
    return out


def _times(factors: Sequence[Factor], other: Factor) -> tuple[tuple[Factor, Factor], ...]:
    return tuple((other, factor) for factor in factors)


def _usual_flight_s(known: Array) -> float | None:
    """Of frames that a blow was before; None without any."""
    since = known[:, W.SINCE]
    struck = since[(since < 0.5 * W.LONG_AGO_S) & (known[:, W.LAST_APPROACH] > 0)]
    return 2 * float(np.median(struck)) if len(struck) else None


def settled(word: str, make: Make, known: Array) -> Iterator[Candidate]:
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


def _followed(word: str, make: Make, name: str, *factors: Factor | tuple[Factor, ...]) -> Candidate:
    """The target with the factors, or products of them, each with a coefficient of its own."""
    products = [one if isinstance(one, tuple) else (one,) for one in factors]
    return plain(f"{word}, {name}", *(term for product in products for term in make(*product)))


def _period_s(known: Array) -> float:
    return float(np.median(np.diff(known[:, W.TIME])))


def _term(key: Key, *factors: Factor) -> tuple[Term, ...]:
    return (Term(key[0], 1.0, factors, x=float(key[1])),)


def _both_ways(key: Key, *factors: Factor) -> tuple[Term, ...]:
    """Of a marker along two directions."""
    return tuple(Term(key[0], 1.0, factors, float(key[1]), way_rad) for way_rad in (0.0, QUARTER))


def _scaled(make: Make, quantity: str, function: str, scale: float) -> tuple[Term, ...]:
    return make(Factor(quantity, function, 1.0, scale))


def _swinging(make: Make, rate: float) -> tuple[Term, ...]:
    return tuple(term for wave in waves("time", 1.0, 1.0 / rate) for term in make(wave))


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


def _swung(make: Make, rate: float, fades_s: float, size: str = "last_approach") -> tuple[Term, ...]:
    """What a blow leaves swinging by its ``size``."""
    fades = Factor(size), Factor("since", "exponential", 1.0, fades_s)
    return tuple(term for wave in waves("since", 1.0, 1.0 / rate) for term in make(*fades, wave))


@dataclass(frozen=True, eq=False)
class _Scan:
    """Instants (N,; s) in which something swings by a ``size`` (N,), those of all rows (M,) among them ``at``, and what
    is ``left`` in these."""

    clock_s: Array
    size: Array
    at: NDArray[np.int64]
    left: Array

    @classmethod
    def of(cls, rows: FrameRows | MarkerRows, left: Array, clock_s: Array, size: Array) -> _Scan:
        """Frames of all runs at one instant are one."""
        both = np.round(np.column_stack([clock_s / SAME_INSTANT_S, size / max(np.abs(size).max(), 1e-300) / SAME_SIZE]))
        _, first, number = np.unique(both, axis=0, return_index=True, return_inverse=True)
        return cls(clock_s[first], size[first], number.reshape(-1)[rows.at], left)

    def gains(self, ways: Array, signs: Array, rates: Array) -> Array:
        """Falls of the sum of squares (W, K, F) that a cosine and a sine of each rate explain of what is left with the
        ``signs`` (K, M), by each of ``ways`` (M, W) in which the rows answer."""
        count, out = len(self.clock_s), np.zeros((ways.shape[1], len(signs), len(rates)))
        weight = np.array([np.bincount(self.at, way**2, count) for way in ways.T]) * self.size**2
        moved = [way * self.left for way in ways.T]
        score = np.array([np.bincount(self.at, way * sign, count) for way in moved for sign in signs]) * self.size
        for first in range(0, len(rates), AT_ONCE):
            turn = np.outer(self.clock_s, rates[first : first + AT_ONCE])
            c, s = np.cos(turn), np.sin(turn)
            a, b, ab = (np.asarray(weight @ one)[:, None] for one in (c * c, s * s, c * s))
            x, y = ((score @ one).reshape(len(weight), len(signs), -1) for one in (c, s))
            square = (b * x**2 - 2 * ab * x * y + a * y**2) / np.maximum(a * b - ab**2, 1e-300)
            out[:, :, first : first + AT_ONCE] = square
        return out


def _lines(
    units: Mapping[str, tuple[Make, Array]], rows: FrameRows | MarkerRows, rng: np.random.Generator
) -> list[Candidate]:
    """The best frequency of each target, by its word: how terms of it are made, and what a unit of it along each of its
    ways adds to the rows (M, W).  At the price of having looked for it."""
    problem, known = rows.problem, rows.known
    run_s, period_s = float(known[:, W.TIME].max()), _period_s(known)
    left = Profile.of(problem).residual[: len(problem.residual)]
    word_of = np.repeat(np.arange(len(units)), [unit.shape[1] for _, unit in units.values()])
    ways = np.hstack([unit for _, unit in units.values()])
    out = list[Candidate]()

    def best(scan: _Scan, rates: Array, block: NDArray[np.int64]) -> tuple[list[float], float]:
        """Best rate of each word, and what the best gains where the signs of each ``block`` (M,) are turned."""
        blocks, number = np.unique(block, return_inverse=True)
        turned = np.vstack([np.ones(len(blocks)), rng.choice([-1.0, 1.0], (TURNS, len(blocks)))])
        each = scan.gains(ways, np.asarray(turned[:, number.reshape(-1)], float), rates)
        gains = np.array([each[word_of == i].sum(0) for i in range(len(units))])
        return rates[np.argmax(gains[:, 0], 1)].tolist(), float(gains[:, 1:].max()) / problem.excess

    even = _Scan.of(rows, left, known[:, W.TIME], np.ones(len(known)))
    rates: Array = np.asarray(2 * math.pi * np.arange(0.5, HIGHEST / period_s * run_s, APART) / run_s, float)
    swings, price = best(even, rates, problem.block)
    for (word, (make, unit)), rate in zip(units.items(), swings, strict=True):
        step = APART / run_s * math.pi / rate
        out.append(Candidate(f"{word}, swinging in time", partial(_swinging, make), (rate,), (step,), (True,), price))
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
    usual_s, struck = _usual_flight_s(known), known[:, W.SINCE] < 0.5 * W.LONG_AGO_S
    since = np.where(struck, known[:, W.SINCE], 0.0)
    # What a blow leaves is another matter after each.
    flight = (known[:, W.RUN] * (1 + known[:, W.BLOWS].max()) + known[:, W.BLOWS]).astype(np.int64)[rows.at]
    for fades_s in () if usual_s is None else (share * usual_s for share in SWINGS_FADE):
        # What fades so soon tells no rates apart that turn by less in that time.
        slow: Array = np.asarray(2 * math.pi * np.arange(0.5, HIGHEST / period_s * fades_s, APART) / fades_s, float)
        if not len(slow):
            continue
        size = np.where(struck, known[:, W.LAST_APPROACH], 0.0) * np.exp(-since / fades_s)
        after = _Scan.of(rows, left, since, size)
        swings, price = best(after, slow, flight)
        for (word, (make, _)), rate in zip(units.items(), swings, strict=True):
            step, swung = APART / fades_s * math.pi / rate, partial(_swung, make)
            name, positive = f"{word}, swinging after a blow", (True, True)
            out.append(Candidate(name, swung, (rate, fades_s), (step, SCALE_STEP), positive, price))
    return out


def _finest(scan: _Scan, unit: Array, rate: float, apart: float) -> tuple[float, float]:
    """The best rate near ``rate``, and the phase at which its wave, along the way that has most of it, is highest."""
    rates: Array = np.asarray(rate + apart * np.arange(-1, 1 + FINER, FINER), float)
    rates = rates[rates > 0]
    best = float(rates[int(np.argmax(scan.gains(unit, np.ones((1, len(unit))), rates).sum((0, 1))))])
    turn = best * scan.clock_s[scan.at]
    waved = [np.column_stack([way * np.cos(turn), way * np.sin(turn)]) for way in unit.T]
    along, across = max((np.linalg.lstsq(one, scan.left, rcond=None)[0] for one in waved), key=lambda one: one @ one)
    return best, math.atan2(across, along)


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
