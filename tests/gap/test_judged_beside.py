"""What a second processor judges while laws are sought is what this process would have said."""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
import pytest

import ovines.workers.beside
from analysis.gap.cause import Structure
from analysis.gap.diagnose import _judged, _judged_beside

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="processes are copied on Linux only")


def test_both_say_the_same_and_nothing_is_begun_where_something_is_left(tilted, without_next_test, monkeypatch):
    monkeypatch.setattr(ovines.workers.beside.os, "cpu_count", lambda: 2)
    ladder = tilted[0].ladder
    assert "table_tilt" in [cause.effect for cause in ladder.causes] and not ladder.structure
    with _judged_beside(ladder, np.random.default_rng(1)) as judged:
        beside = judged()
    here = _judged(ladder, (), np.random.default_rng(1))
    assert beside is not None and beside.gap == here.gap and beside.seen == here.seen
    causes, again = ([(one.effect, one.parameters) for one in judged.causes] for judged in (beside, here))
    assert causes == again and beside.detectable == here.detectable
    assert beside.predictions.equals(here.predictions)
    left = Structure("flight", "free flight", "x", "something", 2.0, 100.0, 0.1, "m/s^2", 1e-6)
    with _judged_beside(replace(ladder, structure=(left,)), np.random.default_rng(1)) as judged:
        assert judged() is None
