"""A sway beside a drive that sweeps: its band is the sweep's alone."""

from __future__ import annotations

import numpy as np

from analysis.gap.drive.measured_path import SLOWEST, band_of, is_sweep

FRAMES = np.arange(960) / 800.0
SWAY = 2e-4 * np.cos(2 * np.pi * 2.6 * FRAMES + 0.4)


def sweep(first_hz, last_hz):
    """Along a line, at one frequency at a time."""
    hz = first_hz + (last_hz - first_hz) * FRAMES / FRAMES[-1]
    place = 0.016 * np.cos(2 * np.pi * np.cumsum(hz) / 800.0)
    return np.column_stack([0.8 * place, 0.6 * place])


def random_drive(rng):
    """Of a band, with a level as chance has it."""
    waves = np.fft.rfft(rng.normal(0.0, 1.0, len(FRAMES)))
    hz = np.fft.rfftfreq(len(FRAMES), 1 / 800.0)
    waves[(hz < 8.0) | (hz > 14.0)] = 0.0
    place = np.fft.irfft(waves, len(FRAMES))
    return np.column_stack([0.012 * place / np.std(place), np.zeros(len(FRAMES))])


def test_a_sweep_is_told_from_a_random_drive():
    """A sway beside it changes nothing of that."""
    swayed = np.column_stack([SWAY, np.zeros(len(FRAMES))])
    for first_hz, last_hz in ((9.5, 12.5), (14.0, 9.0)):
        assert is_sweep(FRAMES, sweep(first_hz, last_hz))
        assert is_sweep(FRAMES, sweep(first_hz, last_hz) + 5.0 * swayed)
    assert sum(is_sweep(FRAMES, random_drive(np.random.default_rng(n))) for n in range(40)) <= 2


def test_the_band_of_a_sweep_ends_above_a_sway():
    """Which holds more than a thousandth of the power of a band that reaches down to it."""
    place = sweep(9.5, 12.5) + np.column_stack([5.0 * SWAY, np.zeros(len(FRAMES))])
    lowest_hz = [middle - half for middle, half in (band_of(FRAMES, place, one) for one in (0.0, SLOWEST))]
    assert lowest_hz[0] < 3.0 and lowest_hz[1] > 5.0
