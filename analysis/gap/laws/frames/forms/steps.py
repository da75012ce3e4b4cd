"""Steps in the course of a run - a frame that was skipped, a tripod that was knocked against - at the instant that no
list holds: of each target all are held against the frames, and the best becomes a candidate that pays what the best
gains where the signs of parts of the runs are turned."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from analysis.gap.laws.dictionary.candidate import Candidate
from analysis.gap.laws.frames.forms.making import Make, Rows, scaled
from analysis.gap.laws.regression.problem import Profile, scaled_inverse
from ovines.core.laws import words as W
from ovines.core.laws.terms import Term

Array = NDArray[np.float64]
# Steps are looked for at so many instants, evenly over a run but for this share at either end: what is there in less is
# no step.  Turned series.
INSTANTS, ENDS, TURNS = 64, 0.05, 19


class StepRows(Rows, Protocol):
    """Rows which make columns (M, T) of any law's terms."""

    def columns(self, terms: Sequence[Term]) -> Array:
        """What a unit of each term adds."""


def best_steps(targets: Mapping[str, Make], rows: StepRows, rng: np.random.Generator) -> list[Candidate]:
    """The best step of each target, by its word, in the share of a run and in its time."""
    problem, known = rows.problem, rows.known
    profile = Profile.of(problem)
    left = profile.residual[: len(problem.residual)]
    blocks, number = np.unique(problem.block, return_inverse=True)
    turned = np.vstack([np.ones(len(blocks)), rng.choice([-1.0, 1.0], (TURNS, len(blocks)))])
    signed = (left * turned[:, number.reshape(-1)]).T
    at: Array = np.asarray(np.linspace(ENDS, 1 - ENDS, INSTANTS), float)
    out = list[Candidate]()
    for word, make in targets.items():
        for quantity, span in (("share", 1.0), ("time", float(known[:, W.TIME].max()))):
            step = partial(scaled, make, quantity, "below")
            gains = np.array([_gains(profile, rows.columns(step(one * span)), signed) for one in at])
            best = float(at[np.argmax(gains[:, 0])])
            price = float(gains[:, 1:].max()) / problem.excess
            name = f"{word}, a step in {quantity}"
            out.append(Candidate(name, step, (best * span,), (0.5 / INSTANTS / best,), (True,), price))
    return out


def _gains(profile: Profile, columns: Array, signed: Array) -> Array:
    """Falls of the sum of squares (K,) that ``columns`` (M, C) explain of what is left, ``signed`` (M, K)."""
    score = profile.free(columns)[: len(columns)].T @ signed
    return np.asarray(np.sum(score * (scaled_inverse(profile.information(columns)) @ score), 0), float)
