"""Noise that no law of flight can touch, and a force of unknown form: sizes found, and what they leave open."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.flights.cutting.run_data import LENS_TERMS
from analysis.flights.equation.model import STATES
from analysis.flights.evidence import FlightRows, RunRows, columns_of
from analysis.flights.fit import ORIGIN, SHARED
from analysis.flights.force_path import ForcePath
from analysis.flights.noise import (
    PLAIN,
    FlightNoise,
    StandardResiduals,
    alike,
    cells,
    displacement,
    frame_noise,
    response,
)
from analysis.flights.single_flight import whiten
from analysis.flights.unknown_force import ForceEvidence, Prior, force_evidence, tried_forces
from analysis.identification.floor.priors import LENS_SDS_M, prior_in

PERIOD_S = 1 / 800


def noise(correlation, shape, rng):
    """AR(1) errors of unit variance along the first axis."""
    errors = rng.standard_normal(shape)
    for i in range(1, shape[0]):
        errors[i] = correlation * errors[i - 1] + np.sqrt(1 - correlation**2) * errors[i]
    return errors


def residuals(correlation, scale, rng, force=0.0):
    """Frames of 250 flights of 8 to 60 frames: noise, and the smooth path that a wrong law leaves."""
    flights = []
    for count in rng.integers(8, 61, 250):
        t = np.arange(count) * PERIOD_S
        smooth = force * (np.sin(2 * np.pi * 11 * t + rng.uniform(0, 6)) + rng.normal() * t / 0.02)
        flights.append(
            StandardResiduals(np.arange(count), scale * noise(correlation, (count, 3), rng) + smooth[:, None])
        )
    return flights


@pytest.mark.parametrize(("correlation", "within"), [(0.0, 0.01), (0.5, 0.06), (0.8, 0.05)])
@pytest.mark.parametrize("force", [0.0, 50.0])
def test_scale_and_correlation_do_not_know_the_law(correlation, within, force):
    """Fifty sds of model error, alike for a drive's period, change neither."""
    found = frame_noise(residuals(correlation, 1.7, np.random.default_rng(5), force), PERIOD_S, True)
    assert abs(found.correlation - correlation) <= within
    # Scale and correlation are found together; the first differences' size, which flights feel, is known better than
    # either.
    assert found.scale * np.sqrt(1 - found.correlation) == pytest.approx(1.7 * np.sqrt(1 - correlation), rel=0.03)
    assert found.angle_scale == pytest.approx(found.scale, rel=0.05)


def test_a_kink_and_wrong_points_do_not_speak_for_the_noise():
    rng = np.random.default_rng(6)
    flights = residuals(0.0, 1.0, rng)
    for flight in flights[:12]:
        flight.residual[rng.integers(len(flight.index))] += 300.0
    for flight in flights[12:24]:
        flight.residual[len(flight.index) // 2 :] += 40 * np.arange(len(flight.index) - len(flight.index) // 2)[:, None]
    assert frame_noise(flights, PERIOD_S, True).scale == pytest.approx(1.0, abs=0.04)


def test_nothing_to_learn_from_leaves_the_stated_noise():
    assert frame_noise([], PERIOD_S, True) == FlightNoise()
    assert frame_noise([StandardResiduals(np.arange(4), np.zeros((4, 3)))], PERIOD_S, True) == FlightNoise()


def test_whitened_errors_are_independent():
    rng = np.random.default_rng(1)
    model = FlightNoise(0.8, 2.0, 3.0)
    index = np.flatnonzero(rng.random(900) > 0.2)
    sd, angle_sd = np.full(len(index), 1e-5), np.full(len(index), 1e-3)
    errors = noise(0.8, (900, 3), rng)[index] * [2e-5, 2e-5, 3e-3]
    whiten(np.zeros((len(index), 3, 0)), errors, *model.whitening(index, index * PERIOD_S, sd, angle_sd))
    assert errors.std() == pytest.approx(1.0, abs=0.05)  # 2,160 of unit variance: sd 0.015
    assert abs(np.mean(errors[1:] * errors[:-1])) < 0.06


def test_displacements_of_a_steady_force_in_closed_form():
    """A force that never changes moves a disk by t^2 / 2 from its first frame on, backwards as well."""
    times = np.array([0.0, 0.013, 0.05, 0.1])
    assert displacement(times, 1e6) == pytest.approx(np.outer(times**2, times**2) / 4, rel=1e-6, abs=1e-12)
    place, speed = response(np.array([-0.02, 0.03]), 0.0, np.arange(-3, 5) * 0.01)
    assert place.sum(1) == pytest.approx([0.02**2 / 2, 0.03**2 / 2], rel=1e-12)
    assert speed.sum(1) == pytest.approx([-0.02, 0.03], rel=1e-12)


def test_displacements_of_a_forgetful_force_in_closed_form():
    """White acceleration of spectral density q = 2 A^2 T: velocity's variance q t, place's q t^3 / 3."""
    memory, t = 1e-3, 0.2
    edges = cells(np.arange(0, t + 1e-9, 2.5e-4), memory)
    place, speed = response(np.array([t]), 0.0, edges)
    together = alike(edges, memory)
    assert float((speed @ together @ speed.T)[0, 0]) == pytest.approx(2 * memory * t, rel=0.03)
    assert float((place @ together @ place.T)[0, 0]) == pytest.approx(2 * memory * t**3 / 3, rel=0.03)


def test_a_force_shows_in_the_frames_of_a_flight_and_its_sd_holds():
    """Straight flights under a force that the law lacks: place and velocity past the last frame, against truth over 400
    draws.
    """
    rng = np.random.default_rng(3)
    count, sd, force, memory = 30, 1e-5, 3.0, 0.02
    model = FlightNoise(0.0, 1.0, 1.0, force, 0.0, memory)
    times = np.arange(count) * PERIOD_S
    ahead = np.array([times[-1] + 0.6 * PERIOD_S])
    edges = cells(times, memory, ahead)
    root = np.linalg.cholesky(alike(edges, memory) + 1e-12 * np.eye(len(edges) - 1))
    (own, _), (place, speed) = response(times, 0.0, edges), response(ahead, 0.0, edges)
    rows = np.zeros((count, 3, 6))
    rows[:, range(3), range(3)] = 1.0
    rows[:, range(3), range(3, 6)] = times[:, None]
    far = np.zeros((1, 6, 6))
    far[0] = np.eye(6)
    far[0, range(3), range(3, 6)] = ahead[0]
    white = model.whitening(np.arange(count), times, np.full(count, sd), np.full(count, 1e-3))
    errors = []
    for _ in range(400):
        pushes = force * root @ rng.standard_normal((len(edges) - 1, 2))
        seen = np.column_stack([own @ pushes + sd * rng.standard_normal((count, 2)), 1e-3 * rng.standard_normal(count)])
        found, spread = ForcePath(model, times, white, seen, rows).at(ahead, np.zeros((1, 6)), far)
        true = np.concatenate([place @ pushes, speed @ pushes], 1)[0]
        errors.append((found[0, [0, 1, 3, 4]] - true) / np.sqrt(np.diag(spread[0])[[0, 1, 3, 4]]))
    assert np.std(errors) == pytest.approx(1.0, abs=0.06)  # 1,600 numbers, correlated in pairs: sd 0.025


def test_where_the_unknowns_stand_does_not_change_how_likely_the_data_are():
    """Rows that are linear: the fit's linearisation may lie anywhere.  (A prior that says that the lens leaves nothing,
    judging a fit that had moved its terms by 0.08 mm, once made a law without friction likelier by 6e9.)"""
    rng = np.random.default_rng(11)
    columns = columns_of([*ORIGIN, *LENS_TERMS])
    sd = np.full((40, 3), 1e-5)
    # Smooth, as lenses and paths are: a frame far from its neighbours counts as a gross error.
    phase = rng.uniform(0, 6, (1, 3, STATES + len(columns)))
    rows = np.cos(0.02 * np.arange(40)[:, None, None] * (1 + np.arange(STATES + len(columns))) / 10 + phase)
    error = sd * rng.standard_normal((40, 3))

    def costs(stands):
        shared = np.zeros(len(ORIGIN) + len(LENS_TERMS))
        shared[-len(LENS_TERMS) :] = stands
        moved = np.array([shared[[SHARED.index(n) for n in (*ORIGIN, *LENS_TERMS)].index(c)] for c in columns])
        flight = FlightRows(np.arange(40), np.arange(40) * PERIOD_S, rows, error - rows[:, :, STATES:] @ moved, sd)
        run = [RunRows(tuple(columns), (flight,), 0)]
        evidence = force_evidence(run, tried_forces(run, PLAIN, 0.01))[0]
        return np.array([evidence.costs(prior_in(columns, columns, shared, one)) for one in LENS_SDS_M])

    assert np.allclose(costs(8e-5), costs(0.0), rtol=0, atol=0.01)


@pytest.mark.parametrize("alike", [False, True])
def test_costs_are_those_of_determinants_and_solutions(alike, monkeypatch):
    """By one triangle, and the long way where columns are alike to rounding and have none."""
    rng = np.random.default_rng(3)
    rows = rng.normal(size=(7, 60, 6)) * 10.0 ** rng.integers(-4, 5, 6)
    pull, weight, integrated = rng.normal(size=4), np.array([1e-4, 1e6, 2.0, 1e3]), np.array([False, True, False, True])
    prior, score = Prior((3, 1, 0, 5), weight, pull, 0.7, integrated), np.sum(rows, 1)
    evidence = ForceEvidence((), np.arange(7.0), rows.transpose(0, 2, 1) @ rows, score, np.zeros((0, 7)))
    if alike:

        def none(matrices):
            raise np.linalg.LinAlgError

        monkeypatch.setattr("numpy.linalg.cholesky", none)
    for k, cost in enumerate(evidence.costs(prior)):
        chosen = list(prior.columns)
        information, pulled = evidence.information[k][np.ix_(chosen, chosen)] + np.diag(weight), score[k, chosen] + pull
        volume = np.linalg.slogdet(information)[1] - np.linalg.slogdet(information[~integrated][:, ~integrated])[1]
        own = k + volume + 0.7 - np.log(weight[integrated]).sum() - pulled @ np.linalg.solve(information, pulled)
        assert cost == pytest.approx(own, rel=1e-10)
