"""A drive whose second line is set anew from run to run hides no swing of the Host."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.blind.recording.place import Place
from analysis.blind.series import make_series, write_series
from analysis.gap.drive.steps import drive_steps
from analysis.gap.selection.flight_steps import first_flights
from ovines.pipeline.diagnosis import load_series
from ovines.recording import read_series


def drive_of(tmp_path, kind, runs):
    made = make_series(kind, 0.9, np.random.default_rng(5), runs, "white", place=Place(drive="two_lines"))
    write_series(made, tmp_path / kind)
    series, _ = load_series(read_series(tmp_path / kind), tmp_path / "results")
    fits = first_flights(series, ("floor_friction", "spin_coupling")).fits
    return made, drive_steps(series, fits, frozenset(), False)[0]


def test_a_recoil_is_found_under_a_drive_of_two_lines(tmp_path):
    """Six runs, each with a second line of its own, a hundred times as large as the recoil."""
    made, steps = drive_of(tmp_path, "host_recoil", 6)
    assert [cause.effect for cause in steps.causes] == ["host_recoil"]
    true = made.truth["parameters"]["host_recoil"]
    for name in ("frequency_hz", "mass_kg"):
        assert steps.causes[0].parameters[name][0] == pytest.approx(true[name], rel=0.02)


def test_nothing_is_found_beside_two_lines_where_nothing_is(tmp_path):
    _, steps = drive_of(tmp_path, "none", 4)
    assert not steps.causes and not steps.structure
