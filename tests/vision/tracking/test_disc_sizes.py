"""Discs too small to be exact are noted, those large enough are not."""

import numpy as np

from vision.identity.layouts import Layout
from vision.tracking.disc_sizes import size_notes


def test_small_discs_are_noted_by_body():
    layout = Layout(
        ("host", "nes"), ("H1", "H2", "N1"), np.zeros((3, 3)), np.array([0, 2, 3]), np.ones(2), np.ones(2, bool), 0.05
    )
    marker = np.array([0, 1, 2, 0, 1, 2])
    (note,) = size_notes("VW1", layout, marker, np.array([3.1, 2.9, 1.9, 3.0, 3.0, 2.1]))
    assert "VW1" in note and "nes 2.0 px" in note and "host" not in note
    assert size_notes("VW1", layout, marker, np.full(6, 2.6)) == []
    assert size_notes("VW1", layout, marker[:0], np.empty(0)) == []
