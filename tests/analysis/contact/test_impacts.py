"""Impacts from two flights: instant, speeds and covariance; the wall from where they intersect; bounce sequences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analysis.bounces.contact import RECORD, BounceRig
from analysis.bounces.model import BouncePath, simulate_bounces
from analysis.contact.impacts import intersect, measure
from analysis.contact.wall_fit import fit_wall
from analysis.flights.cutting.flight_rig import FlightRig
from analysis.flights.cutting.pieces import Flight
from analysis.flights.cutting.run_data import LENS_TERMS, RunData
from analysis.flights.equation.parameters import INDEX, PARAMETERS
from analysis.flights.fit import fit_flights
from analysis.motion.host_path import HostMotion
from analysis.walls.wall import Wall

SD, SD_ANGLE = 1.2e-5, 2e-3
OMEGA = 2 * np.pi * 11.0
HARMONICS = np.zeros((4, 7))
HARMONICS[0, 2] = 0.0164
HOST = HostMotion(HARMONICS, OMEGA, 1e-3, np.zeros(4), 0.3, np.zeros((0, 4)))
PARAMETER = np.zeros(len(PARAMETERS))
PARAMETER[INDEX["friction"]], PARAMETER[INDEX["coupling"]] = 0.25, 1.0
LAW = {"restitution": 0.72, "wall_friction": 0.15, "tangential_restitution": 0.45}
RADIUS = 0.04
RIG = BounceRig(
    FlightRig(HOST.table(-0.1, 2.0), OMEGA, 0.01, 0.5, RADIUS, 0.0),
    PARAMETER,
    surfaces=Wall.ring(RADIUS).surfaces,
    disk_x_m=0.0,
    disk_y_m=0.0,
    stop_speed_m_per_s=0.02,
    wall_frequency_per_s=0.0,
    restitution_rise=0.0,
    restitution_speed_m_per_s=1.0,
    **LAW,
)


def path_of(frames):
    return BouncePath(np.empty((frames, 6)), np.zeros((80, len(RECORD))), np.empty((80, 6)))


def sequence(start, frames=200, rig=RIG):
    times, path = np.arange(frames) / 800, path_of(frames)
    n, settled = simulate_bounces(np.asarray(start, float), 0.0, False, times, 0.0, np.zeros(80), rig, path)
    return times, path.states, path.records[:n], settled


def fitted(seed, frames=220, start=(0.01, 0.005, 0.0, 0.8, -0.9, 50.0)):
    times, out, records, settled = sequence(start, frames)
    rng = np.random.default_rng(seed)
    data = RunData(
        "run",
        times,
        out[:, :2] + SD * rng.standard_normal((frames, 2)),
        out[:, 2] + SD_ANGLE * rng.standard_normal(frames),
        np.full(frames, SD),
        np.full(frames, SD_ANGLE),
        HOST,
        RADIUS,
        0.01,
        0.5,
    )
    moments = records[np.concatenate([[True], np.diff(records[:, 0]) > 8 / 800])][:, 0]
    edges = np.floor(moments[moments < min(settled, times[-1])] * 800).astype(int)
    # The flight before the first chattering hop ends the run.
    flights, first = [], 0
    for edge in edges:
        if edge - first < 6:
            break
        flights.append(Flight(first, edge, True))
        first = edge + 1
    flights[-1] = Flight(flights[-1].first, flights[-1].last, False)
    return fit_flights(data, flights, PARAMETER, np.zeros(2 + len(LENS_TERMS))), records


@pytest.fixture(scope="module")
def pairs():
    """(impacts, truth) of several runs with different noise."""
    found = []
    for seed in range(12):
        fit, records = fitted(seed, start=(0.01, 0.005, 0.0, 0.8 + 0.05 * seed, -0.9, 50.0))
        junctions = intersect([fit])
        impacts = measure(junctions, Wall.ring(RADIUS))
        true = records[[int(np.argmin(np.abs(records[:, 0] - t))) for t in junctions.time_s]]
        found.append((impacts, true))
    return found


def test_instants_to_a_hundredth_of_a_frame(pairs):
    errors = np.concatenate([impacts.of("time") - true[:, 0] for impacts, true in pairs])
    assert len(errors) >= 20
    assert np.sqrt(np.mean(errors**2)) * 800 < 0.02


@pytest.mark.parametrize(
    ("name", "column"),
    [
        ("normal_before", 1),
        ("normal_after", 2),
        ("tangential_before", 3),
        ("tangential_after", 4),
        ("spin_before", 5),
        ("time", 0),
    ],
)
def test_errors_are_as_large_as_the_covariance_says(pairs, name, column):
    z = np.concatenate([(impacts.of(name) - true[:, column]) / impacts.sd(name) for impacts, true in pairs])
    assert np.sqrt(np.mean(z**2)) < 1.5 and np.median(np.abs(z)) < 1.1


@pytest.mark.parametrize("frames", [-5, 5])
def test_flights_that_intersect_far_from_their_gap_are_no_impact(frames):
    """The same two flights, the gap between them said to be five frames earlier or later than where they intersect."""
    fit, _ = fitted(0)
    first, second = fit.flights[:2]
    moved = (replace(first, last=first.last + frames), replace(second, first=second.first + frames, joined=False))
    assert intersect([fit]).flight[0] == 0
    assert len(intersect([replace(fit, flights=moved)])) == 0


def test_the_wall_is_where_the_flights_intersect(pairs):
    fit, _ = fitted(3)
    found = fit_wall(intersect([fit]), Wall.ring(RADIUS + 1e-4), ["radius"], {"radius": 3e-4})
    assert abs(found.wall.size_m - RADIUS) < 1.5e-5


@pytest.mark.parametrize(("mismatch", "off_m", "used"), [(1e4, 1e-3, False), (1e4, 0.0, True), (0.0, 1e-3, True)])
def test_flights_that_neither_meet_nor_end_at_the_wall_are_no_impact(pairs, mismatch, off_m, used):
    """A junction that is missed and far from the wall is left out; one that is missed at the wall (a contact that
    lasts), or far from it where both flights meet (a dent), is not."""
    fit, _ = fitted(3)
    junctions = intersect([fit])
    first = int(np.argmax(fit_wall(junctions, Wall.ring(RADIUS), ["radius"], {"radius": 3e-4}).used))
    state, mismatches = junctions.state.copy(), junctions.mismatch.copy()
    outwards = (state[first, :2] - junctions.host[first, :2]) / RADIUS
    state[first, :2] += off_m * outwards
    state[first, 6:8] += off_m * outwards
    mismatches[first] = mismatch
    found = fit_wall(
        replace(junctions, state=state, mismatch=mismatches), Wall.ring(RADIUS), ["radius"], {"radius": 3e-4}
    )
    assert bool(found.used[first]) is used
    assert abs(found.wall.size_m - RADIUS) < 5e-5


def test_a_sequence_ends_at_the_wall_and_loses_speed_by_the_law():
    times, out, records, settled = sequence((0.0, 0.03, 0.0, 0.3, 0.5, 0.0), 400)
    np.testing.assert_allclose(records[:, 2], LAW["restitution"] * records[:, 1], rtol=1e-12)
    assert np.all(np.diff(records[:, 0]) > 0)
    at_impacts = np.searchsorted(times, records[:, 0])
    assert len(at_impacts) > 5
    inside = np.hypot(out[:, 0] - HOST.at(times)[:, 0], out[:, 1])
    assert inside.max() < RADIUS + 1e-9
    if np.isfinite(settled):
        after = (times > settled + 0.002) & (times < settled + 0.006)
        np.testing.assert_allclose(inside[after], RADIUS, atol=1e-7)


def test_a_sequence_continues_from_the_state_before_an_impact():
    times, out, records, _ = sequence((0.01, 0.005, 0.0, 0.8, -0.9, 50.0), 120)
    start = np.array([0.01, 0.005, 0.0, 0.8, -0.9, 50.0])
    first = path_of(120)
    simulate_bounces(start, 0.0, False, times, 0.0, np.zeros(80), RIG, first)
    later = times[times > records[0, 0]]
    again = path_of(len(later))
    simulate_bounces(first.befores[0], records[0, 0], True, later, 0.0, np.zeros(80), RIG, again)
    np.testing.assert_allclose(again.states[:20, :2], out[times > records[0, 0]][:20, :2], atol=1e-8)
