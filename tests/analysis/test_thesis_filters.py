"""The thesis' smoothing and peaks against those of scipy.signal, which the program does not load for them."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from scipy.signal import find_peaks, savgol_filter

from analysis.thesis.filters import highest, savitzky_golay


@pytest.mark.parametrize(("count", "window", "order"), [(200, 7, 3), (41, 41, 2), (57, 3, 1), (300, 21, 5)])
def test_smoothing_is_scipys(count, window, order):
    values = np.random.default_rng(count).normal(0, 1, count).cumsum()
    ours = savitzky_golay(values, window, order)
    # Both solve the same least squares; their conditions leave some digits below 1e-10.
    np.testing.assert_allclose(ours, savgol_filter(values, window, order), rtol=0, atol=1e-10 * np.abs(values).max())


@pytest.mark.parametrize("seed", range(40))
@pytest.mark.parametrize("levels", [3, 1000])
def test_peaks_are_scipys(seed, levels):
    """Noise of few levels has plateaus and equal heights everywhere, with ends among the highest."""
    rng = np.random.default_rng(seed)
    values = rng.integers(0, levels, 3 + 7 * seed).astype(float)
    if levels > 3:
        values += rng.normal(0, 1e-3, len(values))  # no two alike: of equal maxima scipy keeps either
    for prominence in (0.0, 0.3 * levels):
        distance = 1 if levels == 3 else 1 + seed % 9
        places, heights = highest(values, prominence, distance)
        expected, properties = find_peaks(values, prominence=prominence, distance=distance)
        assert list(places) == list(expected)
        assert list(heights) == list(properties["prominences"])


def test_what_has_no_peak():
    for values in (np.zeros(5), np.arange(5.0), np.array([2.0, 1.0, 3.0]), np.array([1.0])):
        assert len(highest(values, 0.0, 1)[0]) == 0


def test_a_run_does_not_load_scipys():
    """Half a second each, for what a run asks of them."""
    modules = "analysis.thesis.impacts, vision.calibrate, vision.track, vision.triangulate, analysis.identify"
    said = subprocess.run(
        [sys.executable, "-c", f"import sys, {modules}\nprint({{'scipy.signal', 'scipy.stats'}} & set(sys.modules))"],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert said.stdout.strip() == "set()", said.stdout
