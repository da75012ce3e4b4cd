"""What a second processor judges, or asks of the measurement, while laws are sought is what this process would have
said."""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
import pytest

import analysis.gap.written_laws
import ovines.workers.beside
from analysis.gap.cause import Structure
from analysis.gap.diagnose import _judged, _judged_beside
from analysis.gap.laws.found_law import LawFound

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


@pytest.mark.parametrize("processors", [1, 2])
@pytest.mark.parametrize("stages", [(), ("flight",), ("flight", "measurement")])
@pytest.mark.parametrize("there", [False, True])
def test_the_measurement_is_asked_beside_the_flights(quiet, monkeypatch, processors, stages, there):
    """With a second processor and without: laws of it, and flights asked anew of the series without them, where there
    are any; else what the flights have said meanwhile.  Where something of it is left, it is asked first."""
    monkeypatch.setattr(ovines.workers.beside.os, "cpu_count", lambda: processors)
    left = [Structure(stage, "all", "x", "something", 2.0, 100.0, 0.1, "m/s^2", 1e-6) for stage in stages]
    ladder = replace(quiet, structure=tuple(left))
    again, law = replace(ladder), object.__new__(LawFound)
    asked, written = [], analysis.gap.written_laws

    def of_flights(ladder, left, rng):
        asked.append((ladder, rng.random()))
        return written._FlightsAsked(None, None, ladder.flights)

    monkeypatch.setattr(written, "_flights_asked", of_flights)
    monkeypatch.setattr(
        written, "_measured_laws", lambda ladder, *_: ((law,), again, False) if there else ((), ladder, False)
    )
    monkeypatch.setattr(written, "_contact_laws", lambda ladder, *_: ([], [], ladder))
    laws, last = written.write_laws(ladder, np.random.default_rng(3))
    assert laws == ((law,) if there else ()) and last is (again if there else ladder)
    first = () if "measurement" in stages else (ladder,)
    assert [one for one, _ in asked] == [*first, *((again,) if there else () if first else (ladder,))]
    assert asked[0][1] == pytest.approx(np.random.default_rng(3).spawn(2)[1].random())
