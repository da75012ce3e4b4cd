"""Flights fitted with the simulator's own flight model: states, friction, covariance."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.evidence import columns_of, gather, solve
from analysis.flight_model import INDEX, PARAMETERS, fly
from analysis.flights import WARP, Flight, RunData, fit_flights
from analysis.host_motion import HostMotion

SD, SD_ANGLE = 1.2e-5, 2e-3
OMEGA = 2 * np.pi * 11.0
HARMONICS = np.zeros((4, 7))
HARMONICS[0, 2] = 0.0164
HOST = HostMotion(HARMONICS, OMEGA, 1e-3, np.zeros(4), 0.0, np.zeros((0, 4)))
TRUE = np.zeros(len(PARAMETERS))
TRUE[INDEX["friction"]], TRUE[INDEX["coupling"]] = 0.25, 1.0
SHARED = np.zeros(2 + len(WARP))
ARGUMENTS = (HARMONICS, OMEGA, 0.01, 0.5, 0.04, 0.0)


def flown(start, frames=40, t0=0.02, p=TRUE):
    times = t0 + np.arange(frames) / 800
    out = np.empty((frames, 6))
    fly(np.asarray(start, float), t0, times, p, *ARGUMENTS, out)
    return times, out


def run_of(times, states, rng, rho=0.0):
    noise = rng.standard_normal((len(times), 3))
    for i in range(1, len(times)):
        noise[i] = rho * noise[i - 1] + np.sqrt(1 - rho**2) * noise[i]
    return RunData("run", times, states[:, :2] + SD * noise[:, :2], states[:, 2] + SD_ANGLE * noise[:, 2], np.full(len(times), SD),
                   np.full(len(times), SD_ANGLE), HOST, 0.04, 0.01, 0.5)


STARTS = [(0.01, 0.0, 0.1, 0.6, -0.4, 40.0), (-0.02, 0.01, 2.0, 0.2, 0.9, -80.0), (0.0, 0.02, 0.0, -1.1, 0.1, 5.0), (0.0, 0.0, 0.0, 0.9, 0.9, 150.0)]


def test_integration_has_converged():
    """Against a start half-way: forwards and backwards agree."""
    times, states = flown(STARTS[1])
    back = np.empty((len(times), 6))
    fly(states[20], times[20], times, TRUE, *ARGUMENTS, back)
    assert np.abs(back[:, :2] - states[:, :2]).max() < 1e-8


def test_states_scatter_as_their_covariance_says():
    z = []
    for seed in range(40):
        times, states = flown(STARTS[seed % 4])
        fit = fit_flights(run_of(times, states, np.random.default_rng(seed)), [Flight(0, 39, False)], TRUE, SHARED)
        at = int(np.argmin(np.abs(times - fit.reference_s[0])))
        got, covariance = fit.propagate(0, times[at:at + 1])
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


def test_correlation_of_the_noise_is_seen():
    evidence = []
    for rho in (0.0, 0.5):
        run = run_of(*flown(STARTS[0], frames=300), np.random.default_rng(5), rho)
        fit = fit_flights(run, [Flight(0, 299, False)], TRUE, SHARED)
        evidence.append(gather(fit, columns_of(["friction"])))
    assert abs(evidence[0].lag_one) < 0.12
    assert abs(evidence[1].lag_one - 0.5) < 0.12


def test_a_start_from_an_earlier_fit_ends_in_the_same_place():
    run = run_of(*flown(STARTS[1]), np.random.default_rng(9))
    first = fit_flights(run, [Flight(0, 39, False)], TRUE, SHARED)
    again = fit_flights(run, [Flight(0, 39, False)], TRUE, SHARED, first)
    assert np.all(np.abs(again.states - first.states) < 0.05 * np.sqrt(np.diagonal(first.covariances, axis1=1, axis2=2)))


def test_friction_that_turns_is_integrated_through():
    """A disk without spin on a shaken floor turns its friction 22 times a second, each time within microseconds."""
    start = np.array([0.0, 0.0, 0.0, 0.4, 0.02, 0.0])
    ends = []
    for frames in (641, 400_001):
        states = np.empty((frames, 6))
        fly(start, 0.0, np.linspace(0, 0.8, frames), TRUE, *ARGUMENTS, states)
        ends.append(states[-1, :2])
    assert np.all(np.abs(ends[0] - ends[1]) < 2e-7)
