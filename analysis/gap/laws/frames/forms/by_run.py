"""What a camera's picture does from run to run - knocked against between two, warming up over all of them - and in
which run it is nil: still markers know nothing of that."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtr

from analysis.gap.laws.dictionary.candidate import Candidate
from analysis.gap.laws.dictionary.parts import SCALE_STEP
from analysis.gap.laws.frames.forms.making import Make, Rows, followed
from analysis.gap.laws.regression.problem import Regression
from ovines.core.laws import words as W
from ovines.core.laws.terms import Factor, Term

Array = NDArray[np.float64]
SHIFTS = ("picture_u", "picture_v")
# Shares of all runs in which what warms up settles; runs in which it does at the least: what takes less is a step.
SETTLES, FEWEST_SETTLES = (0.15, 0.4), 0.7
# Parts of a run by which a run that stands alone is held against itself; runs that say how they scatter otherwise.
HALVES, FEWEST_OTHERS = 2, 3
# What a picture does at a step, and at how many ends a run may stand alone.
MOVES, ENDS = {"picture": SHIFTS, "zoom": ("picture_zoom",), "turn": ("picture_turn",)}, 2
TARGETS = tuple(target for targets in MOVES.values() for target in targets)


class PictureRows(Rows, Protocol):
    """Rows of a camera's picture, which makes columns (M, T) of any law's terms."""

    def columns(self, terms: Sequence[Term]) -> Array:
        """What a unit of each term adds."""


class LoneRun(NamedTuple):
    """A run at either end that lies apart: the ``steps`` that it may be, and the ``problem`` in whose place of runs
    stand halves of runs, which predict each other."""

    problem: Regression
    steps: list[Candidate]


def by_run(word: str, make: Make, known: Array, along: str = "") -> list[Candidate]:
    """What goes with the run, settles over the runs, or is another from one on; none of fewer than three runs."""
    runs, follows = int(known[:, W.RUN].max()) + 1, partial(followed, word, make)
    if runs < 3:
        return []
    out = [follows(f"linear in the run{along}", Factor("run"))]

    def settling(scale: float) -> tuple[Term, ...]:
        return make(Factor("run", "exponential", 1.0, max(scale, FEWEST_SETTLES)))

    name = f"{word}, settling over the runs{along}"
    out += [Candidate(name, settling, (share * runs,), (SCALE_STEP,), (True,)) for share in SETTLES]
    # A step between runs has two on either side at the least: each predicts the other.
    out += [follows(f"a step before run {first}{along}", _before(first)) for first in range(2, runs - 1)]
    return out


def shifts_by_run(known: Array, camera: int) -> list[Candidate]:
    """A shift of a camera's whole picture, along u and v at once."""
    return by_run("picture", _moved(SHIFTS, camera), known, ", along both axes")


def _moved(targets: Sequence[str], camera: int) -> Make:
    def make(*factors: Factor) -> tuple[Term, ...]:
        return tuple(Term(target, 1.0, factors, x=float(camera)) for target in targets)

    return make


def _before(first: int) -> Factor:
    return Factor("run", "below", 1.0, first - 0.5)


def lone_run(rows: PictureRows, camera: int, level: float) -> LoneRun | None:
    """Steps of a picture between the first run, or the last, and all others, and the problem whose runs are halves of
    runs: no other run predicts a single one, its own other half does.  None where the others scatter so from run to run
    that it may be one of them, as often as ``level``."""
    runs = int(rows.known[:, W.RUN].max()) + 1
    if runs < FEWEST_OTHERS + 1:
        return None
    off = _of_each_run(rows, camera, runs)
    steps: list[Candidate] = []
    for first, run in ((1, 0), (runs - 1, runs - 1)):
        chance = _alone(off, run)
        for word, targets in MOVES.items():
            if ENDS * len(TARGETS) * min(chance[TARGETS.index(one)] for one in targets) < level:
                steps.append(followed(word, _moved(targets, camera), f"a step before run {first}", _before(first)))
    if not steps:
        return None
    part = np.minimum((rows.known[:, W.SHARE] * HALVES).astype(np.int64), HALVES - 1)
    half = (rows.known[:, W.RUN].astype(np.int64) * HALVES + part)[rows.at]
    return LoneRun(replace(rows.problem, run=half), steps)


def _of_each_run(rows: PictureRows, camera: int, runs: int) -> Array:
    """What the picture does (runs, 4) in each run, against the mean of all."""
    problem, columns = rows.problem, []
    number = rows.known[rows.at, W.RUN].astype(int)
    for target in TARGETS:
        unit = rows.columns([Term(target, 1.0, (), x=float(camera))])[:, 0]
        columns += [unit * (number == run) for run in range(runs)]
    every = np.column_stack([*columns, problem.nuisances])
    size = np.sqrt(np.sum(every**2, 0))
    every /= np.where(size > 0, size, 1.0)
    # The mean is the markers' own places: a fit of least norm leaves it out.
    fit = np.linalg.lstsq(every.T @ every, every.T @ problem.residual, rcond=1e-10)[0]
    own = len(columns)
    off = (fit[:own] / np.where(size[:own] > 0, size[:own], 1.0)).reshape(len(TARGETS), runs).T
    return np.asarray(off - off.mean(0), float)


def _alone(off: Array, run: int) -> Array:
    """How often (4,) a run lies as far from the others (R, 4) as ``run`` does, by how these scatter (Student's t)."""
    others = np.delete(off, run, 0)
    count = len(others)
    sd = np.maximum(np.std(others, axis=0, ddof=1), 1e-12) * np.sqrt(1 + 1 / count)
    return np.asarray(2 * stdtr(count - 1, -np.abs(off[run] - others.mean(0)) / sd), float)


def nil_in(terms: Sequence[Term], run: float, last: float) -> tuple[Term, ...] | None:
    """The ``terms`` of a picture, but for a constant, as they are nil in a ``run``: the first (0), the ``last``, or, by
    halves, between, as far to one side as to the other; None where one follows anything but the run, or is not nil
    there."""
    moved = [_nil_term(term, run, last) for term in terms]
    return None if any(one is None for one in moved) else tuple(one for one in moved if one is not None)


def _nil_term(term: Term, run: float, last: float) -> Term | None:
    if term.target not in SHIFTS or [factor.quantity for factor in term.factors] != ["run"]:
        return None
    (factor,) = term.factors
    if factor.function in ("below", "beyond"):
        sense = 1.0 if factor.function == "beyond" else -1.0
        if 0.0 < run < last:
            middle = Factor("run", "sign", x=factor.scale)
            return replace(term, coefficient=0.5 * sense * term.coefficient, factors=(middle,))
        wanted, same = ("beyond", 1.0) if run == 0.0 else ("below", -1.0)
        return replace(term, coefficient=same * sense * term.coefficient, factors=(replace(factor, function=wanted),))
    if (factor.function, factor.order) == ("power", 1.0):
        return replace(term, factors=(replace(factor, x=run),))
    return term if factor.function == "exponential" and run == last else None
