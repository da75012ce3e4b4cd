"""Laws written in other units and at other times: the same law."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.gap.laws.dictionary.flights import flight_candidates
from analysis.gap.laws.dictionary.impacts.law import law_candidates
from analysis.gap.laws.dictionary.parts import RigScales
from ovines.core.laws import words as W
from ovines.core.laws.kernel import push, size
from ovines.core.laws.memory import LATELY
from ovines.core.laws.targets import TARGETS
from ovines.core.laws.terms import Factor, Term, WrittenLaw

LENGTH_M, TIME_S = 2.7, 1.9
PLACES = (
    *(W.X, W.Y, W.HX, W.HY, W.CONTACT_RADIUS, W.LAST_X, W.LAST_Y, W.BEFORE_X, W.BEFORE_Y, W.DISK_RADIUS),
    *(W.WAY, W.WAY_BEFORE, W.MEMORY_M, *(W.WAY + LATELY + i for i in range(W.LATELIES))),
)
BLOWS = range(W.MOST_BLOWS)
SPEEDS = (
    *(W.VX, W.VY, W.UX, W.UY, W.APPROACH, W.SLIP, W.WALL_SPEED, W.PASSING, W.LAST_APPROACH, W.LAST_SLIP),
    *(W.BLOW_SPEEDS + i for i in BLOWS),
    *(W.BLOW_SLIPS + i for i in BLOWS),
    W.LAST_LEFT,
)
TIMES = (W.TIME, W.SINCE, W.MEMORY_S, *(W.BLOW_TIMES + i for i in BLOWS))


def in_units(known):
    """What a law knows, in units of LENGTH_M and TIME_S."""
    out = known.copy()
    out[list(PLACES)] /= LENGTH_M
    out[list(SPEEDS)] /= LENGTH_M / TIME_S
    out[[W.SPIN, W.SPIN_LEFT]] *= TIME_S
    out[list(TIMES)] /= TIME_S
    out[[W.FX, W.FY, W.HOST_AX, W.HOST_AY, W.WALL_ACCELERATION]] /= LENGTH_M / TIME_S**2
    out[W.FT] *= TIME_S**2
    return out


def test_every_candidate_is_the_same_law_in_other_units():
    known = np.random.default_rng(3).uniform(0.02, 0.9, W.KNOWN_SIZE)
    known[[W.BLOW_TIMES + i for i in BLOWS]] -= 0.9  # before the time that it is
    varied = known * np.linspace(0.7, 1.4, 5)[:, None]  # no scale that starts at a quantile lies on what is asked
    candidates = [*flight_candidates(RigScales(0.04, 1.6, 0.04, 1.2, 69.0, 100.0)), *law_candidates(varied)]
    pulses = Term("fixed_direction", 1.6, (Factor("time", "pulses", 0.02, 0.3, 0.1),), x=0.4)
    terms = {one.name: one.terms for one in candidates} | {"pulses": (pulses,)}
    terms["gates"] = (Term("swirl", 1.6, (Factor("time", "gates", 0.2, 0.3, 0.1),)),)
    for name, those in terms.items():
        for term in those:
            (other,) = WrittenLaw((term,)).in_units(LENGTH_M, TIME_S).terms
            if TARGETS[term.target].stage == "flight":
                ours, theirs = np.zeros(3), np.zeros(3)
                push(np.array(term.row()), 1.0, known, ours)
                push(np.array(other.row()), 1.0, in_units(known), theirs)
                scale = np.array([LENGTH_M / TIME_S**2, LENGTH_M / TIME_S**2, TIME_S**-2])
                assert theirs * scale == pytest.approx(ours, rel=1e-9), name
            else:
                ours = size(np.array(term.row()), known)
                theirs = size(np.array(other.row()), in_units(known)) / (TIME_S if term.target == "spin_added" else 1.0)
                assert theirs == pytest.approx(ours, rel=1e-9), name
    assert len(terms) > 60


def test_a_law_asked_by_a_later_clock_says_the_same():
    factors = (
        Factor("time", "cosine", 1.0, 0.3, 0.1),
        Factor("clock", "cosine", 2.0),
        Factor("since", "exponential", 1.0, 0.05),
    )
    law = WrittenLaw((Term("fixed_direction", 1.0, factors),))
    known = np.zeros(W.KNOWN_SIZE)
    known[W.TIME], known[W.CLOCK], known[W.SINCE] = 0.83, 57.0, 0.031
    later = known.copy()
    later[W.TIME], later[W.CLOCK] = 0.031, 57.0 - 70.0 * 0.799
    (ours,), (theirs,) = law.terms, law.later(0.799, 70.0 * 0.799).terms
    assert size(np.array(theirs.row()), later) == pytest.approx(size(np.array(ours.row()), known), rel=1e-12)
