"""What several tests of the diagnosis share."""

from __future__ import annotations

import pytest

import analysis.gap.diagnose
import analysis.report.page


@pytest.fixture
def without_laws(monkeypatch) -> None:
    """No search of a formula for what is left: it takes longer than the rest, says nothing of verdict, stage or
    structure, and has its own tests (test_laws).
    """
    monkeypatch.setattr(analysis.gap.diagnose, "write_laws", lambda ladder, rng, withheld: ((), ladder))


@pytest.fixture
def unpainted(monkeypatch) -> None:
    """Pages hold all their figures, and none is turned into a picture: that takes longer than making them, and the
    pages of test_gap_page and of the commands are painted.
    """
    monkeypatch.setattr(analysis.report.page, "data_uri", lambda figure, image: "")
