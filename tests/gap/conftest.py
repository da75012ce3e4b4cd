"""What several tests of the diagnosis share."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import analysis.gap.diagnose
from analysis.blind.recording.files import write_series
from analysis.blind.series import Series as Made
from analysis.blind.series import make_series
from analysis.gap.diagnose import Diagnosis, diagnose
from analysis.gap.ladder import Ladder, run_ladder
from analysis.gap.laws.found_law import LawFound
from analysis.gap.next_test.choice import next_tests
from analysis.gap.series import Series
from analysis.gap.written_laws import write_laws
from ovines.pipeline.series.diagnosis import load_series
from ovines.recording import read_series

pytest.register_assert_rewrite("tests.gap.blind.plant.rig")  # what it finds is shown as in a test


def laws_and_ladder(series: Series, withheld: frozenset[str] = frozenset()) -> tuple[tuple[LawFound, ...], Ladder]:
    """What a diagnosis finds, by its own code and the same draws, before it asks how large and how far: the laws, and
    the ladder with its causes and what is left.  For tests of nothing else.
    """
    rng = np.random.default_rng(0)
    return write_laws(run_ladder(series, rng, withheld), rng, withheld)


def brought(made: Made, folder: Path, laws: tuple[Path, ...] = ()) -> Series:
    """The series that the plant has ``made``, written to ``folder`` where it is not there yet, as the diagnosis reads
    it.

    Of white noise, and of causes in which no camera has a part, no lens field is learnt in vain: it takes half a second
    and is none (`test_marker_laws.py` asks for that)."""
    if not folder.exists():
        write_series(made, folder)
    with pytest.MonkeyPatch.context() as patched:
        if made.truth["noise"] == "white" and "measurement" not in made.truth["stages"]:
            patched.setattr("ovines.pipeline.series.diagnosis.learn_together", lambda *_: None)
        return load_series(read_series(folder), folder.parent / "results", laws)[0]


@pytest.fixture
def without_laws(monkeypatch) -> None:
    """No search of a formula for what is left: it takes longer than the rest, says nothing of verdict, stage or
    structure, and has its own tests (test_laws).
    """
    monkeypatch.setattr(analysis.gap.diagnose, "write_laws", lambda ladder, rng, withheld: ((), ladder))


@pytest.fixture
def without_flight_laws(monkeypatch) -> None:
    """No formula is searched for the flights, where impacts or the wall are asked about: it takes a third of the time
    and more.  That none is found where flights have nothing left, tests of the same kinds of cause ask that do search
    (`test_unsuspected_laws`' shim, `test_uneven_laws`' lamp).
    """
    monkeypatch.setattr("analysis.gap.written_laws._flight_law", lambda ladder, *_: (None, ladder))


@pytest.fixture(scope="session")
def tilted(tmp_path_factory) -> tuple[Diagnosis, dict[str, Any]]:
    """Three runs on a table that is tilted a little, diagnosed from their tracks, and the truth: for all that is asked
    of a whole diagnosis but the search of a formula, which finds none beside a tilt, as the tutorial shows.
    """
    folder = tmp_path_factory.mktemp("tilted")
    made = make_series("table_tilt", 0.35, np.random.default_rng(5), runs=3, noise="white")
    series = brought(made, folder / "series")
    with pytest.MonkeyPatch.context() as whole:  # a module that does without may be the first to ask
        whole.setattr(analysis.gap.diagnose, "next_tests", next_tests)
        whole.setattr(analysis.gap.diagnose, "write_laws", lambda ladder, *_: ((), ladder))
        return diagnose(series, np.random.default_rng(0)), made.truth


@pytest.fixture(scope="session")
def loaded(tmp_path_factory) -> Callable[..., tuple[dict[str, Any] | None, Series]]:
    """Function (kind, size, seed, noise, runs, laws) -> truth of the plant's cause (of several, by name), series as the
    diagnosis reads it: made once, however many tests ask for it; none may change it.
    """

    @cache
    def made(kind: str, size: float, seed: int, noise: str, runs: int) -> tuple[Made, Path]:
        folder = tmp_path_factory.mktemp(kind) / "series"
        return make_series(kind, size, np.random.default_rng(seed), runs, noise), folder

    @cache
    def read(
        kind: str, size: float, seed: int, noise: str = "white", runs: int = 3, laws: tuple[Path, ...] = ()
    ) -> tuple[dict[str, Any] | None, Series]:
        series, folder = made(kind, size, seed, noise, runs)
        true = series.truth["parameters"]
        return true if "+" in kind else true.get(kind), brought(series, folder, laws)

    return read


@pytest.fixture(scope="session")
def quiet(loaded) -> Ladder:
    """The ladder of three runs without any cause."""
    return run_ladder(loaded("none", 1.0, 41)[1], np.random.default_rng(0))
