"""Shaker figures with the corrected arithmetic."""

import math

import pytest

from ovines.core import ScenarioError
from ovines.core.system.shaker import amplitude_of, best_amplitude, clearance, host_radius_for, within_shaker


def test_thesis_figures():
    amplitude = amplitude_of(9.0, 11.0)
    assert amplitude == pytest.approx(0.01848, abs=5e-6)  # (124)
    assert host_radius_for(amplitude) == pytest.approx(0.03629, abs=5e-6)  # what (126) gives
    assert host_radius_for(amplitude, share=0.8) == pytest.approx(0.04536, abs=5e-6)  # what the thesis prints
    radius = host_radius_for(amplitude)
    assert best_amplitude(radius, 0.2 * radius) == pytest.approx(amplitude)
    assert clearance(0.05, 0.01) == pytest.approx(0.08)


def test_limits_and_refusals():
    assert within_shaker(9.0, 11.0, (0.0254, 1.5, 20.0))
    assert not within_shaker(9.0, 11.0, (0.0127, 1.5, 20.0))  # one inch peak to peak is too little (ERRATA)
    assert amplitude_of(1.0, 1.0) * (2 * math.pi) ** 2 == pytest.approx(9.81)
    with pytest.raises(ScenarioError):
        amplitude_of(9.0, 0.0)
