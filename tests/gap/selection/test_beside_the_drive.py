"""What the Host does beside its drive is found whatever the drive is, and whenever a run begins."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.blind.recording.place import Place
from analysis.blind.series import make_series
from analysis.gap.drive.steps import drive_steps
from analysis.gap.selection.flight_steps import first_flights
from tests.gap.conftest import brought


def drive_of(tmp_path, kind, drive, seed, runs=4):
    made = make_series(kind, 1.0, np.random.default_rng(seed), runs, "white", place=Place(drive=drive))
    series = brought(made, tmp_path / kind)
    fits = first_flights(series, ("floor_friction", "spin_coupling")).fits
    return made.truth["parameters"], drive_steps(series, fits, frozenset(), False)[0]


@pytest.mark.further
@pytest.mark.parametrize(
    ("kind", "drive", "seed", "runs"),
    [
        # Each run with a second line of its own, a hundred times as large as the recoil.
        ("host_recoil", "two_lines", 5, 5),
        # The third run begins just after a blow: without what that set going the frequency is 7 sds off.
        ("host_recoil", "sine", 3, 3),
        ("host_recoil", "start_up", 3, 3),
        # Runs end with the disk at the wall: without what it does there this passed for a recoil.
        ("host_ringing", "random", 2, 2),
        ("host_ringing", "chirp", 2, 3),
    ],
)
def test_a_swing_is_measured_beside_any_drive(tmp_path, kind, drive, seed, runs):
    true, steps = drive_of(tmp_path, kind, drive, seed, runs)
    assert [cause.effect for cause in steps.causes] == [kind]
    for name, (value, sd) in steps.causes[0].parameters.items():
        assert abs(value - true[kind][name]) < 4 * sd, name
    mass, sd = steps.causes[0].parameters["mass_kg"]
    assert sd < 0.03 * mass


@pytest.mark.further
def test_a_sway_is_reported_beside_a_drive_that_starts(tmp_path):
    true, steps = drive_of(tmp_path, "host_sway", "start_up", 1)
    assert [cause.effect for cause in steps.causes] == ["host_sway"]
    for name in ("amplitude_m", "frequency_hz"):
        value, sd = steps.causes[0].parameters[name]
        assert abs(value - true["host_sway"][name]) < 3 * sd


@pytest.mark.others_further
@pytest.mark.parametrize(("drive", "runs"), [("two_lines", 2), ("random", 2), ("chirp", 2), ("start_up", 2)])
def test_nothing_is_found_beside_a_drive_where_nothing_is(tmp_path, drive, runs):
    _, steps = drive_of(tmp_path, "none", drive, 1, runs)
    assert steps.paths and not steps.causes and not steps.structure
    assert steps.tells_sway == (drive == "two_lines")  # within a band a slow line would be the drive's
