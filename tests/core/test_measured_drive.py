"""A Host that moves as it was measured: a table of times and places in place of harmonics."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ovines.core import MeasuredMotion, simulate
from ovines.core.system.named import named_scenario


def as_table(drive, rate_hz, duration_s):
    """The drive's path at ``rate_hz``, by its definition: a sum of a sin(2 pi f t + phase)."""
    time_s = np.arange(-0.01, duration_s + 0.01, 1 / rate_hz)
    place = {
        axis: sum(
            (h.amplitude * np.sin(2 * np.pi * h.frequency_hz * time_s + h.phase_rad) for h in drive if h.axis == axis),
            np.zeros_like(time_s),
        )
        for axis in ("x", "y", "rotation", "z")
    }
    return MeasuredMotion(time_s, place["x"], place["y"], place["rotation"], place["z"])


@pytest.mark.parametrize("name", ["rig", "table-15-case-2"])
def test_a_measured_path_moves_the_disk_as_its_harmonics_do(name):
    """To 1e-8 m before errors grow over impacts: a spline through samples 50 us apart misses a path of 11 Hz by far
    less (its fourth derivative times h^4/384 is 1e-13 m), and its acceleration by h^2/12 of the fourth, 4e-6 m/s^2."""
    duration_s = 0.1
    harmonic = named_scenario(name, duration_s=duration_s, sample_rate_hz=800.0)
    table = as_table(harmonic.host.drive, 20_000.0, duration_s)
    measured = replace(harmonic, host=replace(harmonic.host, drive=(), table=table))
    by_drive, by_table = simulate(harmonic), simulate(measured)
    assert len(by_drive.impacts) == len(by_table.impacts) > 0
    first = by_drive.impacts["time_s"][0]
    assert abs(by_table.impacts["time_s"][0] - first) < 1e-8
    for body in ("nes", "host"):
        for axis in "xy":
            before = by_drive.time_s <= first
            gone = np.abs(by_table.motion[f"{body}_{axis}_m"] - by_drive.motion[f"{body}_{axis}_m"])
            assert gone[before].max() < 1e-8
            assert gone.max() < 1e-5  # each impact takes an error by about three
    # it does move: without its drive the disk meets the wall elsewhere
    still = replace(harmonic, host=replace(harmonic.host, drive=(), motion="fixed"))
    assert np.abs(simulate(still).motion["nes_x_m"] - by_drive.motion["nes_x_m"]).max() > 1e-4
