"""Flights fitted with the simulator's own flight model: states, friction, covariance."""

from __future__ import annotations

from dataclasses import astuple, replace
from itertools import pairwise

import numpy as np
import pytest

from analysis.flights.cutting.flight_rig import FlightRig
from analysis.flights.cutting.pieces import LONGEST_FLIGHT_S, Flight, shortened
from analysis.flights.cutting.run_data import LENS_TERMS, RunData
from analysis.flights.equation.model import fly
from analysis.flights.equation.parameters import INDEX, PARAMETERS
from analysis.flights.evidence import columns_of, gather, solve
from analysis.flights.fit import fit_flights
from analysis.motion.host_path import HostMotion

SD, SD_ANGLE = 1.2e-5, 2e-3
OMEGA = 2 * np.pi * 11.0
HARMONICS = np.zeros((4, 7))
HARMONICS[0, 2] = 0.0164
HOST = HostMotion(HARMONICS, OMEGA, 1e-3, np.zeros(4), 0.0, np.zeros((0, 4)))
TRUE = np.zeros(len(PARAMETERS))
TRUE[INDEX["friction"]], TRUE[INDEX["coupling"]] = 0.25, 1.0
SHARED = np.zeros(2 + len(LENS_TERMS))
RIG = FlightRig(HOST.table(-0.1, 1.0), OMEGA, 0.01, 0.5, 0.04, 0.0)


def flown(start, frames=40, t0=0.02, p=TRUE):
    times = t0 + np.arange(frames) / 800
    out = np.empty((frames, 6))
    fly(np.asarray(start, float), t0, times, p, RIG, out)
    return times, out


def run_of(times, states, rng, rho=0.0):
    noise = rng.standard_normal((len(times), 3))
    for i in range(1, len(times)):
        noise[i] = rho * noise[i - 1] + np.sqrt(1 - rho**2) * noise[i]
    return RunData(
        "run",
        times,
        states[:, :2] + SD * noise[:, :2],
        states[:, 2] + SD_ANGLE * noise[:, 2],
        np.full(len(times), SD),
        np.full(len(times), SD_ANGLE),
        HOST,
        0.04,
        0.01,
        0.5,
    )


STARTS = [
    (0.01, 0.0, 0.1, 0.6, -0.4, 40.0),
    (-0.02, 0.01, 2.0, 0.2, 0.9, -80.0),
    (0.0, 0.02, 0.0, -1.1, 0.1, 5.0),
    (0.0, 0.0, 0.0, 0.9, 0.9, 150.0),
]


def test_integration_has_converged():
    """Against a start half-way: forwards and backwards agree."""
    times, states = flown(STARTS[1])
    back = np.empty((len(times), 6))
    fly(states[20], times[20], times, TRUE, RIG, back)
    assert np.abs(back[:, :2] - states[:, :2]).max() < 1e-8


def test_states_scatter_as_their_covariance_says():
    z = []
    for seed in range(40):
        times, states = flown(STARTS[seed % 4])
        fit = fit_flights(run_of(times, states, np.random.default_rng(seed)), [Flight(0, 39, False)], TRUE, SHARED)
        at = int(np.argmin(np.abs(times - fit.reference_s[0])))
        got, covariance = fit.propagate(0, times[at : at + 1])
        error = got[0] - states[at]
        z.append(error @ np.linalg.solve(covariance[0], error))
        assert fit.misfit[0] / fit.freedom[0] < 2
    # chi-square of 6: mean 6, sd of the mean of 40 is 0.55
    assert 4.3 < np.mean(z) < 7.7


@pytest.mark.parametrize("outlier", [False, True])
def test_friction_from_flights(outlier):
    fits = []
    for seed, start in enumerate(STARTS * 3):
        run = run_of(*flown(start, p=TRUE), np.random.default_rng(seed))
        if outlier and seed == 2:
            run.xy_m[17] += 5e-4
        begin = TRUE.copy()
        begin[INDEX["friction"]] = 0.24
        fits.append(fit_flights(run, [Flight(0, 39, False)], begin, SHARED))
    columns = columns_of(["friction"])
    step, covariance, _ = solve([gather(f, columns) for f in fits], columns, np.zeros(1))
    assert abs(0.24 + step[0] - 0.25) < 4 * np.sqrt(covariance[0, 0]) + (2e-4 if outlier else 0)
    assert np.sqrt(covariance[0, 0]) < 2e-3


def test_a_start_from_an_earlier_fit_ends_in_the_same_place():
    run = run_of(*flown(STARTS[1]), np.random.default_rng(9))
    first = fit_flights(run, [Flight(0, 39, False)], TRUE, SHARED)
    again = fit_flights(run, [Flight(0, 39, False)], TRUE, SHARED, first)
    assert np.all(
        np.abs(again.states - first.states) < 0.05 * np.sqrt(np.diagonal(first.covariances, axis1=1, axis2=2))
    )


def test_friction_that_turns_is_integrated_through():
    """A disk without spin on a shaken floor turns its friction 22 times a second, each time within microseconds."""
    start = np.array([0.0, 0.0, 0.0, 0.4, 0.02, 0.0])
    ends = []
    for frames in (641, 400_001):
        states = np.empty((frames, 6))
        fly(start, 0.0, np.linspace(0, 0.8, frames), TRUE, RIG, states)
        ends.append(states[-1, :2])
    assert np.all(np.abs(ends[0] - ends[1]) < 2e-7)


def test_a_disk_that_comes_to_rest_tells_its_start_and_the_friction():
    """Friction 0.25 stops 0.3 m/s and 20 rad/s within 0.15 s; the other half second lies still."""
    still = HostMotion(np.zeros((4, 1)), 0.0, 0.0, np.zeros(4), 0.0, np.zeros((0, 4)))
    start, times, states = np.array([0.01, 0.0, 0.1, 0.3, -0.1, 20.0]), np.arange(400) / 800, np.empty((400, 6))
    fly(start, 0.0, times, TRUE, RIG._replace(host=still.table(0.0, 1.0), omega_rad_per_s=0.0), states)
    assert np.abs(states[200, 3:]).max() < 1e-3
    run = replace(run_of(times, states, np.random.default_rng(4)), host=still)
    fit = fit_flights(run, [Flight(0, 399, False)], TRUE, SHARED)
    assert fit.misfit[0] / fit.freedom[0] < 1.2
    got, covariance = fit.propagate(0, times[:1])
    assert np.all(np.abs(got[0] - start) < 4 * np.sqrt(np.diag(covariance[0])))
    assert np.sqrt(covariance[0, 3, 3]) < 5e-3


def test_long_flights_are_cut_and_short_ones_are_not():
    times, seen = np.arange(800) / 800, np.ones(800, bool)
    seen[300:305] = False
    whole = [Flight(0, 79, True), Flight(80, 679, True), Flight(680, 799, False)]
    pieces = shortened(whole, times, seen)
    assert [astuple(pieces[0]), astuple(pieces[-1])] == [(0, 79, True, False), (680, 799, False, False)]
    middle = pieces[1:-1]
    assert (middle[0].first, middle[-1].last, middle[-1].joined) == (80, 679, True)
    assert [p.goes_on for p in middle] == [True] * (len(middle) - 1) + [False]
    # Equal in seen frames: the piece with the gap is longer by it.
    assert all(times[p.last] - times[p.first] <= LONGEST_FLIGHT_S + 5 / 800 for p in middle)
    assert all(b.first > a.last for a, b in pairwise(middle))
