"""Floor friction that each run has of its own: what changes it from run to run, in whatever order, makes runs disagree
on all that acts beside it, and a tilt of many standard deviations is then within their scatter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, chdtri

from analysis.flights.cutting.runs import Run
from analysis.flights.equation.model import GRAVITY_M_PER_S2
from analysis.flights.equation.parameters import INDEX
from analysis.flights.evidence import Evidence
from analysis.gap.cause import SMALLEST_P
from analysis.gap.selection.flights.fit import FlightFit, fit
from analysis.gap.thresholds import GAIN

Array = NDArray[np.float64]
FRICTION = "friction"
# Runs that tell a friction of their own from a law of it; by chance so much is seldom gained.
FEWEST_RUNS, SELDOM = 4, 1e-6
# It explains at least this share of what the flights leave beyond their noise: what a missing force makes of the runs'
# frictions is less.
LEAST_SHARE = 0.25
# Share of a column's information below which rounding has left it.
NOTHING_LEFT = 1e-9


@dataclass(frozen=True, eq=False)
class OwnFriction:
    """``shares`` (R,) of the common friction that the runs have (NaN of a run all of whose flights are so far off the
    common one that none is heeded), the fall of -2 log L by them, the RMS acceleration
    (m/s^2) that they make, and how often chance makes as much of them."""

    shares: Array
    gain: float
    acceleration_m_per_s2: float
    p: float


def with_own_friction(base: FlightFit) -> FlightFit:
    """``base`` in whose evidence each run's friction is an unknown of its own, eliminated: what is judged by it is
    judged beside whatever friction does from run to run."""
    return replace(
        base,
        evidence=tuple(_eliminated(one) for one in base.evidence),
        columns=tuple(name for name in base.columns if name != FRICTION),
    )


def own_friction(base: FlightFit, beside: Sequence[str] = ()) -> OwnFriction | None:
    """The runs' frictions where they surely differ, ``beside`` further columns that the fit does not hold; None else,
    or where they explain little of what the flights leave."""
    runs, friction = len(base.evidence), float(base.model.parameters[INDEX[FRICTION]])
    if runs < FEWEST_RUNS or FRICTION not in base.columns or not friction > 0:
        return None
    names = list(dict.fromkeys([*base.columns, *beside]))
    others = [name for name in names if name != FRICTION]
    own, forms = with_own_friction(base).forms.solved(others), base.forms
    at, inner = forms.at([FRICTION])[0], forms.at(others)
    information = forms.information[:, at, at]
    known = information > 0
    if np.count_nonzero(known) < FEWEST_RUNS:
        return None
    over = np.where(known, 1 / np.where(known, information, 1.0), np.nan)
    # Each run's own step where the others' rest.
    steps = (forms.score[:, at] - forms.information[:, at][:, inner] @ own.step) * over
    eliminated = float(np.nansum(forms.score[:, at] ** 2 * over))
    gain = forms.solved(names).cost - (own.cost - eliminated)
    shares = np.maximum(1 + steps / friction, 0.0)
    acceleration = friction * GRAVITY_M_PER_S2 * float(np.nanstd(shares))
    excess = max(base.misfit - base.count, 0.0)
    if gain < max(GAIN + float(chdtri(runs - 1, SELDOM)), LEAST_SHARE * excess):
        return None
    return OwnFriction(shares, gain, acceleration, max(float(chdtrc(runs - 1, gain)), SMALLEST_P))


def holding_friction(runs: Sequence[Run], own: OwnFriction, base: FlightFit) -> tuple[Run, ...]:
    """The runs with the frictions that they have of their own; one that ``base`` does not heed is fitted by itself."""
    common = float(base.model.parameters[INDEX[FRICTION]])
    out = []
    for run, share in zip(runs, own.shares, strict=True):
        if not np.isfinite(share):
            alone = fit((run,), base.model, noise=base.noise)
            share = float(alone.model.parameters[INDEX[FRICTION]]) / common
        out.append(replace(run, data=replace(run.data, friction_share=run.data.friction_share * float(share))))
    return tuple(out)


def _eliminated(one: Evidence) -> Evidence:
    """A run's evidence without its friction, which is free in it."""
    at = one.columns.index(INDEX[FRICTION])
    kept = [i for i in range(len(one.columns)) if i != at]
    across, own = one.information[kept, at], float(one.information[at, at])
    over = 1 / own if own > 0 else 0.0
    information = one.information[np.ix_(kept, kept)] - over * np.outer(across, across)
    # What is nothing but friction has no information left, whatever the rounding says.
    determined = np.diag(information) > NOTHING_LEFT * np.diag(one.information)[kept]
    information = np.where(np.outer(determined, determined), information, 0.0)
    score = np.where(determined, one.score[kept] - over * across * one.score[at], 0.0)
    return replace(one, columns=tuple(one.columns[i] for i in kept), information=information, score=score)
