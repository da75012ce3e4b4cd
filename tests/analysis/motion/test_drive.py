"""The drive as measured against the drive asked for: each departure is found with its size, a clean one shows none."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.motion.drive import drive_findings
from analysis.motion.host_fit import fit_host_motion
from analysis.motion.rig_frame import RigFrame
from ovines.recording_schema import Excitation

TURN = 2 * np.pi
FRAME = RigFrame(np.zeros(2), 0.0, (0.5, 0.5, 0.5))
LEVEL_G = 0.0164 * (TURN * 11.0) ** 2 / 9.81
ASKED = Excitation(frequency_hz=11.0, acceleration_g=LEVEL_G, axis="x")
NOISE_M = 8e-6
T = (np.arange(800) - 400) / 800


def host(x, y=0.0, seed=1):
    """(times, HostMotion) of a Host at x, y (m) under the cameras' noise."""
    seen = NOISE_M * np.random.default_rng(seed).standard_normal((800, 4))
    seen[:, 0] += x
    seen[:, 1] += y
    return T, fit_host_motion(T, seen, np.full((800, 4), NOISE_M), 11.0)


def sine(hz=11.0, size=0.0164, phase=0.3):
    return size * np.sin(TURN * hz * T + phase)


def found(hosts, asked=ASKED):
    return {one.kind: one for one in drive_findings(hosts, [asked] * len(hosts), FRAME) if one.found}


def test_a_clean_drive_shows_nothing():
    for seed in range(10):
        assert found([host(sine(phase=seed), 0.004 * sine(phase=2.0), seed=seed)]) == {}
    assert found([host(0.0)], None) == {}


@pytest.mark.others_further
@pytest.mark.parametrize(
    ("kind", "x", "y", "size", "at"),
    [
        ("frequency", sine(11.4, 0.0164 * (11 / 11.4) ** 2), 0.0, 0.4 / 11, 11.4),
        ("level", 1.5 * sine(), 0.0, 0.5, None),
        ("crosswise", sine(), 0.3 * sine(phase=1.8), 0.3, None),
        ("line", sine() + sine(47.0, 1e-4), 0.0, 1e-4 / 0.0164, 47.0),
        ("no line", 0.01 * np.sin(TURN * (11 * T + 6 * T * T)), 0.0, 1.0, None),
        ("start-up", sine() * np.clip((T + 0.5) / 0.3, 0, 1), 0.0, None, None),
        ("jump", np.where(T < 0.1, sine(), sine(phase=2.5)), 0.0, None, 0.6),
        ("rest", sine() + 2e-4 * np.exp(-(((T - 0.05) / 0.03) ** 2)), 0.0, None, None),
    ],
)
def test_each_departure_is_found_with_its_size(kind, x, y, size, at):
    one = found([host(x, y)])[kind]
    assert size is None or one.size == pytest.approx(size, rel=0.1)
    assert at is None or one.at == pytest.approx(at, rel=2e-3)
    assert one.p < 1e-4 and one.words


def test_a_run_whose_drive_points_elsewhere_is_named():
    turned = [host(sine(), 0.0, 1), host(sine(), 0.0, 2), host(np.cos(0.1) * sine(), np.sin(0.1) * sine(), 3)]
    one = found(turned)["direction"]
    assert one.run == 2 and one.size == pytest.approx(0.1, abs=2e-3)


def test_a_host_at_rest_that_was_to_be_driven_is_reported():
    assert found([host(0.0)])["frequency"].size == -1.0


def test_sizes_are_the_worlds():
    """In the units of a rig four times as large frequencies are halved, and reported as they were."""
    large = RigFrame(np.zeros(2), 0.0, (0.5,), 4.0)
    asked = Excitation(frequency_hz=5.5, acceleration_g=LEVEL_G, axis="x")
    kinds = {one.kind: one for one in drive_findings([host(sine() + sine(47.0, 1e-4))], [asked], large)}
    assert kinds["line"].at == pytest.approx(23.5, rel=1e-3) and not kinds["frequency"].found
    assert "400" in kinds["line"].words and not kinds["level"].found
