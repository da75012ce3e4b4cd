"""What several tests of the diagnosis share."""

from __future__ import annotations

import pytest

import analysis.gap.diagnose


@pytest.fixture
def without_laws(monkeypatch) -> None:
    """No search of a formula for what is left: it takes longer than the rest, says nothing of verdict, stage or
    structure, and has its own tests (test_laws).
    """
    monkeypatch.setattr(analysis.gap.diagnose, "write_laws", lambda ladder, rng, withheld: ((), ladder))
