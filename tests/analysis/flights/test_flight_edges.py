"""Frames that a flight denies: a wrong point is set aside, one on the wrong side of an impact changes sides."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from analysis.contact.impacts import intersect
from analysis.flights.cutting.pieces import Flight
from analysis.flights.cutting.run_data import LENS_TERMS, RunData
from analysis.flights.cutting.runs import Run
from analysis.flights.cutting.segments import Segments
from analysis.flights.equation.parameters import PARAMETERS
from analysis.flights.fit import fit_flights
from analysis.flights.frame_assignment import settled
from analysis.motion.host_path import HostMotion
from ovines.core.laws.terms import Term, rows_of
from ovines.core.laws.words import COEFFICIENT

SD = 5e-6
STILL = HostMotion(np.zeros((4, 1)), 0.0, 0.0, np.zeros(4), 0.0, np.zeros((0, 4)))


def bounced(last_of_first: int, wrong: int | None = None) -> Run:
    """Straight flights that turn at frame 19.96, cut after ``last_of_first``; one frame ``wrong`` by 12 sd."""
    t = np.arange(40) / 800
    turn = 19.96 / 800
    x = np.where(t < turn, 0.02 + 1.5 * (t - turn), 0.02 - 1.1 * (t - turn)) + SD * np.random.default_rng(
        5
    ).standard_normal(40)
    xy = np.column_stack([x, 0.3 * t + SD * np.random.default_rng(6).standard_normal(40)])
    if wrong is not None:
        xy[wrong, 1] += 12 * SD
    data = RunData("run", t, xy, np.zeros(40), np.full(40, SD), np.full(40, 1e-3), STILL, 0.04, 0.01, 0.5)
    none = np.zeros(0, np.int64)
    flights = (Flight(0, last_of_first, True), Flight(last_of_first + 1, 39, False))
    return Run(
        data,
        Segments(none, np.zeros((0, 2)), np.zeros((0, 2), np.int64), none),
        flights,
        np.zeros((40, 8)),
        np.arange(40),
    )


def after(run: Run) -> Run | None:
    return settled(run, fit_flights(run.data, run.flights, np.zeros(len(PARAMETERS)), np.zeros(2 + len(LENS_TERMS))))


def test_a_frame_past_the_impact_goes_to_the_next_flight():
    found = after(bounced(20))
    assert found is not None and [(f.first, f.last, f.joined) for f in found.flights] == [
        (0, 19, True),
        (20, 39, False),
    ]


def test_a_wrong_frame_is_set_aside_and_the_flight_stays():
    run = bounced(19, wrong=30)
    found = after(run)
    assert found is not None and found.flights == run.flights
    assert np.flatnonzero(np.isnan(found.data.xy_m[:, 0])).tolist() == [30]


def test_good_frames_are_left_alone():
    assert after(bounced(19)) is None


def test_many_denied_frames_are_no_wrong_points():
    run = bounced(19)
    xy = run.data.xy_m.copy()
    xy[25:33, 1] += 2e-4 * np.sin(np.arange(8))
    assert after(replace(run, data=replace(run.data, xy_m=xy))) is None


def test_a_law_without_a_number_ends_the_flight_and_gives_no_impact():
    """It had been integrated for ever."""
    run = bounced(19)
    fits = fit_flights(run.data, run.flights, np.zeros(len(PARAMETERS)), np.zeros(2 + len(LENS_TERMS)))
    assert len(intersect([fits])) == 1
    law = rows_of([Term("fixed_direction", 1.0)])
    law[:, COEFFICIENT] = np.nan
    lost = replace(fits, run=replace(run.data, law=law))
    assert np.isnan(lost.path(0, run.data.time_s[:3])[:, :2]).any()
    assert np.isnan(lost.propagate(1, np.array([np.nan]))[0]).any()
    assert not len(intersect([lost]))
