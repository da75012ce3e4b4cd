"""Turning while the shutter is open: the mean of an arc, undone."""

import numpy as np

from vision.tracking.exposure import arc_shift, spins


def test_mean_of_an_arc_is_carried_back_to_its_middle():
    offset, spin, exposure_s = np.array([[0.006, 0.0], [0.0, -0.003]]), np.array([500.0, -300.0]), 8e-4
    turn = (np.linspace(-0.5, 0.5, 20001) * exposure_s)[:, None] * spin
    mean = np.stack(
        [
            np.cos(turn) * offset[:, 0] - np.sin(turn) * offset[:, 1],
            np.sin(turn) * offset[:, 0] + np.cos(turn) * offset[:, 1],
        ],
        -1,
    ).mean(0)
    assert np.hypot(*(mean - offset)[0]) > 3e-5  # 40 um at 6 mm
    # The measured offset is shortened already: what is added scales it back to its full length.
    assert np.abs(mean + arc_shift(mean, spin, exposure_s) - offset).max() < 1e-8


def test_spin_is_that_of_the_neighbours_and_none_over_a_gap():
    frames = np.array([0, 1, 2, 9, 20, 21])
    times = frames / 800.0
    found = spins(frames, 100.0 * times, times)
    assert np.allclose(found, [100, 100, 100, 0, 100, 100], rtol=1e-5, atol=1e-8)
    assert spins(frames[:1], times[:1], times[:1]).tolist() == [0.0]
