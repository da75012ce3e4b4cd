"""Shaker figures with the corrected arithmetic."""

import math
import warnings

import pytest

from analysis.simulations.shaker_figure import shaker_figure
from ovines.core import ScenarioError
from ovines.core.system.shaker import (
    ShakerLimits,
    amplitude_of,
    best_amplitude,
    clearance,
    host_radius_for,
)


def test_thesis_figures():
    amplitude = amplitude_of(9.0, 11.0)
    assert amplitude == pytest.approx(0.01848, abs=5e-6)  # (124)
    assert host_radius_for(amplitude) == pytest.approx(0.03629, abs=5e-6)  # what (126) gives
    assert host_radius_for(amplitude, share=0.8) == pytest.approx(0.04536, abs=5e-6)  # what the thesis prints
    radius = host_radius_for(amplitude)
    assert best_amplitude(radius, 0.2 * radius) == pytest.approx(amplitude)
    assert clearance(0.05, 0.01) == pytest.approx(0.08)


def test_limits_and_refusals():
    assert ShakerLimits(0.0254, 1.5, 20.0).narrowest(11.0)[1] > 9.0
    which, most_g = ShakerLimits(0.0127, 1.5, 20.0).narrowest(11.0)  # one inch peak to peak is too little (ERRATA)
    assert which == "travel" and most_g < 9.0
    assert amplitude_of(1.0, 1.0) * (2 * math.pi) ** 2 == pytest.approx(9.81)
    with pytest.raises(ScenarioError):
        amplitude_of(9.0, 0.0)


def test_a_figure_shows_what_was_asked_for_under_every_limit():
    """A travel alone leaves one amplitude at every frequency; points far from the limits stay in the picture."""
    for limits in (ShakerLimits(0.5, math.inf, math.inf), ShakerLimits(0.0254, 1.5, 20.0)):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            figure = shaker_figure(limits, 11.0, 8.0, 0.0164)
        for ax in figure.axes[:2]:
            dots = [line for line in ax.lines if line.get_marker() == "o"]
            assert len(dots) == 1
            low, high = ax.get_ylim()
            assert low < dots[0].get_ydata()[0] < high
