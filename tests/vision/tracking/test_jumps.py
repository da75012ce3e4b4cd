"""A body whose names slip along a lattice is reported; one that flies, turns and hits walls is not."""

import numpy as np

from vision.identity.layouts import Layout
from vision.tracking.jumps import jump_notes, jumps

GRID = np.array([[0.0, 0.0], [20.0, 0.0], [0.0, 20.0], [20.0, 20.0]])  # px, of the body's dots


def flight(speeds, frames=30):
    """Places (frames, 4, 2) of a body that flies with each of the velocities [px per frame] in turn, and spins."""
    step = np.repeat(np.asarray(speeds, float), frames, axis=0)
    middle = np.cumsum(step, axis=0)
    angle = 0.1 * np.arange(len(middle))
    turn = np.stack([np.cos(angle), -np.sin(angle), np.sin(angle), np.cos(angle)], -1).reshape(-1, 2, 2)
    return middle[:, None] + np.einsum("nij,mj->nmi", turn, GRID - GRID.mean(0))


def test_flights_and_impacts_are_no_jumps():
    rng = np.random.default_rng(1)
    place = flight([(30, 5), (-22, 9), (-20, -28), (33, -10)])
    place += 0.05 * rng.standard_normal(place.shape)
    place[rng.uniform(size=place.shape[:2]) < 0.1] = np.nan
    assert len(jumps(place)) == 0


def test_a_slip_by_one_pitch_is_reported():
    place = flight([(2, 1)], 60)
    place[40:] += (20.0, 0.0)
    assert jumps(place).tolist() == [40]
    layout = Layout(
        ("nes",), ("a", "b", "c", "d"), np.zeros((4, 3)), np.array([0, 4]), np.ones(1), np.ones(1, bool), 1.0
    )
    frames, marker = np.repeat(np.arange(60) + 100, 4), np.tile(np.arange(4), 60)
    (note,) = jump_notes("left", layout, frames, marker, place.reshape(-1, 2))
    assert note.startswith("left: nes jumps") and "frame 140" in note


def test_few_frames_say_nothing():
    assert len(jumps(flight([(2, 1)], 3))) == 0 and len(jumps(np.full((20, 2, 2), np.nan))) == 0
