"""What several tests of the diagnosis share."""

from __future__ import annotations

import numpy as np
import pytest

import analysis.gap.diagnose
from analysis.gap.ladder import Ladder, run_ladder
from analysis.gap.laws.found_law import LawFound
from analysis.gap.series import Series
from analysis.gap.written_laws import write_laws


def laws_and_ladder(series: Series, withheld: frozenset[str] = frozenset()) -> tuple[tuple[LawFound, ...], Ladder]:
    """What a diagnosis finds, by its own code and the same draws, before it asks how large and how far: the laws, and
    the ladder with its causes and what is left.  For tests of nothing else, in less than half of the time.
    """
    rng = np.random.default_rng(0)
    return write_laws(run_ladder(series, rng, withheld), rng, withheld)


@pytest.fixture
def without_laws(monkeypatch) -> None:
    """No search of a formula for what is left: it takes longer than the rest, says nothing of verdict, stage or
    structure, and has its own tests (test_laws).
    """
    monkeypatch.setattr(analysis.gap.diagnose, "write_laws", lambda ladder, rng, withheld: ((), ladder))
