"""A camera whose instant follows what goes on: the law, which camera it is of, and a series that is whole without it.

Causes of the plant, whose code shares nothing with the search; kinds in view: no blind result."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from analysis.blind.recording import clock
from analysis.blind.recording.files import write_series
from analysis.blind.series import make_series
from analysis.gap.diagnose import verdict_of
from analysis.gap.laws.frames.asked import delay_structure
from analysis.gap.laws.frames.delay import delay_follows, late_camera
from analysis.gap.laws.frames.evidence.known import known_frames
from analysis.gap.laws.frames.evidence.rows import view_rows
from analysis.gap.laws.frames.law import find_frame_laws
from analysis.gap.laws.regression.problem import held_out_squares
from analysis.gap.tests_by_hand import unknown_test
from ovines.core.laws import words as W
from ovines.core.laws.formula import as_text
from ovines.core.laws.kernel import sizes
from ovines.core.laws.terms import Factor, Term, WrittenLaw, rows_of
from ovines.core.refusal import ScenarioError
from ovines.law_file import law_text
from ovines.pipeline.series.diagnosis import load_series
from ovines.recording import read_series
from tests.gap.conftest import laws_and_ladder

KIND = "unknown_exposure_control"


def exposed(folder, seed, runs=3, noise="white", laws=()):
    made = make_series(KIND, 1.0, np.random.default_rng(seed), runs, noise)
    if not folder.exists():
        write_series(made, folder)
    return made.truth["parameters"][KIND], load_series(read_series(folder), folder / "results", laws)[0]


@pytest.mark.further
def test_an_exposure_that_follows_the_disk_is_no_jitter(tmp_path):
    """It had been a jitter of all cameras, or nothing; held by the next diagnosis nothing of it is left."""
    true, series = exposed(tmp_path / "s", 17, 2, "ar1")
    (law,), ladder = laws_and_ladder(series)
    assert (verdict_of(ladder), ladder.causes) == ("unknown", ())
    assert [(one.stage, one.unit) for one in ladder.structure] == [("measurement", "s")]
    assert "the place from the Host's centre along a direction" in ladder.structure[0].goes_with
    (term,) = law.law.terms
    (factor,) = term.factors
    assert (term.target, term.x, factor.quantity, factor.order) == ("camera_delay", 1.0, "along_host", 1.0)
    assert abs(term.coefficient - true["exposure_s"] / clock.EXPOSED_M) < 3 * term.sd
    assert abs(np.angle(np.exp(1j * (factor.y - true["angle_rad"])))) < 3 * law.numbers["line_rad"][1]
    assert law.closed > 0.95 and law.halves.agree
    path = tmp_path / "law-1.toml"
    path.write_text(law_text(law.law, "exposure"))
    assert not delay_follows(exposed(tmp_path / "s", 17, 2, "ar1", [path])[1])


@pytest.mark.further
def test_it_is_the_first_camera_where_the_host_says_so(tmp_path):
    """Two views say how they miss each other only; of the mean of both the Host's path says whether it is late or
    early."""
    folder = tmp_path / "s"
    true, series = exposed(folder, 17)
    (law,), _ = find_frame_laws(series, np.random.default_rng(0))
    assert late_camera(series, law.rig_law.terms) == 1
    path = folder / "calibration.json"
    calibration = json.loads(path.read_text())
    path.write_text(json.dumps(calibration | {"cameras": calibration["cameras"][::-1]}))
    turned = load_series(read_series(folder), tmp_path / "turned")[0]
    (other,), _ = find_frame_laws(turned, np.random.default_rng(0))
    (term,) = other.law.terms
    assert (turned.cameras[0].name, term.x) == ("VW2", 0.0)
    assert abs(term.coefficient - true["exposure_s"] / clock.EXPOSED_M) < 3 * term.sd
    assert (law.law.terms[0].x, as_text(law.law)[-25:]) == (1.0, as_text(other.law)[-25:])


@pytest.mark.further
def test_a_trigger_that_the_shaker_pulls_follows_the_host(loaded):
    """Along the drive, for across it nothing moves that could tell a direction; by hand the cameras' own clocks are
    asked."""
    _, series = loaded("unknown_grounded_trigger", 0.8, 5, runs=2)
    assert delay_follows(series)
    (law,), _ = find_frame_laws(series, np.random.default_rng(0))
    (term,) = law.law.terms
    (factor,) = term.factors
    assert (term.target, factor.quantity) == ("camera_delay", "host_acceleration_along"), as_text(law.law)
    assert abs(np.sin(factor.x)) < 0.01 and law.closed > 0.95
    left = delay_structure(law, series)
    assert (left.stage, left.unit) == ("measurement", "s") and left.strength > 1
    assert left.goes_with == "the acceleration of the Host along a direction: the delay of a camera changes"
    by_hand = unknown_test(left.stage, left.goes_with)
    assert left.goes_with in by_hand and "the cameras' own counters or time stamps" in by_hand


@pytest.mark.others_further
@pytest.mark.parametrize(
    ("kind", "size", "noise"),
    [("none", 1.0, "ar1"), ("vertical_motion", 0.6, "warp"), ("trigger_jitter", 0.8, "white")],
)
def test_what_is_no_delay_that_follows_is_not_asked_further(loaded, kind, size, noise):
    assert not delay_follows(loaded(kind, size, 8, noise)[1])


@pytest.mark.further
def test_what_a_host_rises_in_a_run_is_no_error_on_runs_held_out(loaded):
    """No other run tells it: left in, it was 300 in -2 log L that a form of no size gained two times in seventy-one."""
    _, series = loaded("vertical_motion", 0.6, 8, "warp")
    rows = view_rows(series, ("camera_delay",))
    held = held_out_squares(rows.problem, np.zeros((len(rows.at), 0)))
    assert np.sum(held) / len(rows.at) < 1.2 * rows.problem.excess


def test_a_frame_knows_where_the_host_is_from_the_middle_of_its_path(loaded):
    """And nothing but a measurement may follow that: no force, for which a run has no middle yet."""
    _, series = loaded("none", 1.0, 8, "ar1", 2)
    data = series.runs[0].data
    known = known_frames(data.time_s, data, series.runs[0].flights)
    out = np.empty((len(known), 1))
    term = Term("camera_delay", 1.0, (Factor("host_place_along", x=0.5),), x=1.0)
    sizes(rows_of([term]), known, out)
    path = data.host.at(data.time_s)[:, :2] @ [np.cos(0.5), np.sin(0.5)]
    np.testing.assert_allclose(out[:, 0], path - path.mean(), rtol=0, atol=1e-12)
    assert np.hypot(*known[:, [W.HX, W.HY]].T).max() < 1.01 * data.contact_radius_m
    law = WrittenLaw((term,))
    assert law.moved(0.3, (5.0, 7.0)).terms[0].factors[0].x == pytest.approx(0.8)
    with pytest.raises(ScenarioError, match="host_place_along in a law"):
        WrittenLaw((replace(term, target="fixed_direction"),))
