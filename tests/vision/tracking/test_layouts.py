"""Layouts that look the same after a turn are noted; irregular ones are not."""

import numpy as np
import pandas as pd
import pytest

from vision.identity.layouts import Layout, symmetric_turn, symmetry_notes

SQUARE = 0.006 * np.array([[0, 0], [1, 0], [0, 1], [-1, 0], [0, -1]])
IRREGULAR = np.array([[0, 0], [0.0061, 0.0003], [-0.0008, 0.006], [-0.0058, -0.0017], [0.0024, -0.0056]])


def turned(points, angle_rad):
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return points @ np.array([[c, s], [-s, c]])


@pytest.mark.parametrize(
    ("points", "degrees"),
    [
        (SQUARE, 90),
        (turned(SQUARE, 0.3) + [0.001, 0.0], 90),
        (np.array([[0.005, 0], [-0.005, 0]]), 180),
        (np.array([[0.005, 0.002], [-0.005, -0.002], [0.005, -0.002], [-0.005, 0.002]]), 180),
        (0.005 * np.array([[np.cos(a), np.sin(a)] for a in np.arange(3) * 2 * np.pi / 3]), 120),
    ],
)
def test_a_symmetric_layout_is_seen(points, degrees):
    placed = points + np.random.default_rng(0).normal(0, 3e-5, points.shape)
    assert np.degrees(symmetric_turn(placed, 3e-4)) == pytest.approx(degrees, abs=2)


@pytest.mark.parametrize("points", [IRREGULAR, SQUARE[:4], np.array([[0.005, 0.0]]), np.zeros((3, 2))])
def test_an_irregular_one_is_not(points):
    assert symmetric_turn(points, 3e-4) is None


def test_the_note_names_the_body_and_is_gone_once_its_markers_are_named():
    layout = Layout(
        ("nes",),
        ("N1", "N2", "N3", "N4", "N5"),
        np.column_stack([SQUARE, np.full(5, 0.01)]),
        np.array([0, 5]),
        np.array([3e-4]),
        np.array([True]),
        0.05,
    )
    assert "nes markers lie the same after a turn by 90 degrees" in symmetry_notes(layout, None)[0]
    assert symmetry_notes(layout, pd.DataFrame({"marker": list(layout.markers)})) == []
