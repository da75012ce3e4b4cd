"""Further runs are made as they were asked for, and a loop counts them until the true cause stands alone."""

from __future__ import annotations

import argparse
import math

import numpy as np
import pytest

from analysis.blind import trial
from analysis.blind.recording.files import write_series
from analysis.blind.recording.place import Place
from analysis.blind.series import Wish, further_run, outline_series, run_outline
from analysis.gap.next_test.recording import AS_RECORDED
from ovines.commands.diagnosis.blind import run as blind
from ovines.errors import InputError
from ovines.pipeline.blind.closed_loop import MOST_RUNS, WISHES, Course, is_open, markdown, runs_needed, settle
from ovines.recording import read_recording

LARGE = Place(scale=4.0, turned_rad=0.7, rig_at_m=(0.3, -0.2), start_s=(5.0, 9.0), first_frame=(100, 700))


@pytest.fixture(scope="module")
def outline():
    return outline_series("air_drag", 0.3, np.random.default_rng(1), 2, "white", place=LARGE)


def test_a_launch_starts_as_asked_over_a_host_at_rest(outline):
    """2 m/s and 100 rad/s of this rig, four times as large as the plant's own."""
    text, tracks = further_run(outline, Wish(launch=(2.0, 100.0)), np.random.default_rng(4))
    assert "[excitation]" not in text
    seen = tracks[tracks["camera"] == "VW1"].pivot_table(index="time_s", columns="marker", values=["u_px", "v_px"])
    host, centre = (np.column_stack([seen[q][m] for q in ("u_px", "v_px")]) for m in ("H1", "N1"))
    assert np.nanstd(host, axis=0).max() < 0.5
    # The usual rig fills 4.8 px per mm; this one is as many times farther away.
    time_s = seen.index.to_numpy()
    early = slice(0, 12)
    speed = np.hypot(*np.polyfit(time_s[early], centre[early], 1)[0]) / (4.8e3 / LARGE.scale)
    assert speed == pytest.approx(2.0, rel=0.2)  # the view is not from straight above


def test_a_drive_is_changed_as_asked(outline, tmp_path):
    (tmp_path / "calibration.json").write_text("{}")
    plain, fast, strong = (
        further_run(outline, wish, np.random.default_rng(4))[0]
        for wish in (Wish(), Wish(frequency=1.4), Wish(level=1.5))
    )

    def asked(text):
        lines = dict(
            line.split(" = ") for line in text.split("[excitation]")[1].split("[model]")[0].split("\n") if " = " in line
        )
        return float(lines["frequency_hz"]), float(lines["acceleration_g"])

    assert asked(fast)[0] == pytest.approx(1.4 * asked(plain)[0]) and asked(fast)[1] == asked(plain)[1]
    assert asked(strong) == (asked(plain)[0], pytest.approx(1.5 * asked(plain)[1]))


def test_every_setting_of_the_next_test_can_be_made():
    assert AS_RECORDED in WISHES and len(WISHES) > 5
    assert {w.launch is None for w in WISHES.values()} == {True, False}


def answers(*sets, setting="half the level"):
    """A diagnosis that gives these answers in turn, and notes how many runs it saw."""
    left, seen = list(sets), []

    def diagnose(folder, out):
        seen.append(len(list(folder.glob("run-*/recording.toml"))))
        return answer(left.pop(0), setting)

    return diagnose, seen


def answer(names, setting="half the level"):
    return {"effects": names[:1], "equivalent": names, "next_tests": {"recommended": setting}}


def test_the_loop_ends_when_the_cause_stands_alone(outline, tmp_path):
    write_series(run_outline(outline, np.random.default_rng(2)), tmp_path / "case")
    first = answer(["viscous_drag", "air_drag"])
    assert is_open(outline.truth, first) and not is_open(outline.truth, answer(["air_drag"]))
    assert not is_open(outline.truth, answer(["table_tilt", "viscous_drag"]))
    diagnose, seen = answers(["air_drag", "viscous_drag"], ["viscous_drag"], ["air_drag"])
    course = settle(outline, tmp_path / "case", first, "recommended", diagnose, np.random.default_rng(0))
    assert course.settled == 3 and seen == [3, 4, 5] and set(course.settings) == {"half the level"}
    assert course.possible[1] == ("viscous_drag",)
    run = read_recording(tmp_path / "case" / "run-05")
    assert run.settings.time.frame_rate_hz == pytest.approx(
        read_recording(tmp_path / "case" / "run-01").settings.time.frame_rate_hz
    )


def test_a_set_that_stays_open_counts_as_one_more_than_the_most(outline, tmp_path):
    write_series(run_outline(outline, np.random.default_rng(2)), tmp_path / "case")
    names = ["viscous_drag", "air_drag"]
    diagnose, _ = answers(*[names] * MOST_RUNS)
    course = settle(outline, tmp_path / "case", answer(names), "random", diagnose, np.random.default_rng(0))
    assert course.settled is None and len(course.settings) == MOST_RUNS
    quick = Course("a", "air_drag", "recommended", ("air_drag",), (AS_RECORDED,), (("air_drag",),), 1)
    assert runs_needed([course]) == MOST_RUNS + 1 and math.isclose(runs_needed([course, quick, quick]), 1, rel_tol=1e-9)
    assert "| recommended | 1 | 1 | 1 |" in markdown([course, quick])


def test_a_trial_without_an_open_case_is_refused(tmp_path):
    trial.make_trial(tmp_path, trial.TrialPlan(1, 5, ("none",), runs=1))
    with pytest.raises(InputError, match="no open case"):
        blind(argparse.Namespace(step="loop", folder=tmp_path, seed=5, most=None, jobs=1, yes=True))
