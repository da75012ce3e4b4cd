"""Forms that remember the disk's way, go in waves along it or push it aside: what a cause written from physics, added
to the flights of a series without one, comes out as; and the way itself, measured from frames."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analysis.flights.cutting.way_slid import way_slid
from analysis.gap.laws.choice.listed import Listed
from analysis.gap.laws.choice.numbers_inside import searched
from analysis.gap.laws.choice.shortlist import shortlist_of
from analysis.gap.laws.dictionary.flights import flight_candidates
from analysis.gap.laws.dictionary.flights.waves import wave_candidates
from analysis.gap.laws.dictionary.flights.way import way_candidates
from analysis.gap.laws.dictionary.parts import RigScales
from analysis.gap.laws.dictionary.places import place_candidates
from analysis.gap.laws.flight_rows import _columns, flight_regression
from analysis.gap.laws.regression.problem import Profile
from analysis.gap.selection.flight_steps import first_flights
from ovines.core.laws import words as W
from ovines.core.laws.allowed import OF_FLIGHTS_ONLY
from tests.gap.laws.test_memory_laws import EFFECTS

RADIUS_M, DISK_M = 0.04, 0.01


@pytest.fixture(scope="module")
def flights(loaded):
    """Flights of two runs, and the candidates of the way with their columns."""
    _, series = loaded("none", 1.0, 4, runs=2)
    rows = flight_regression(first_flights(series, EFFECTS))
    scales = RigScales.of(rows.known, float(series.runs[0].data.host.omega_rad_per_s))
    return rows, Listed.of(way_candidates(scales), rows.columns, rows.problem)


def _slip(known):
    """Speed against the floor, and its direction (N, 2)."""
    slip = known[:, [W.UX, W.UY]]
    speed = np.hypot(*slip.T)
    return speed, slip / speed[:, None]


def _left(along):
    return np.column_stack([-along[:, 1], along[:, 0]])


def _friction(share, known):
    return share[:, None] * known[:, [W.FX, W.FY, W.FT]]


def _force(push):
    return np.column_stack([push, np.zeros(len(push))])


def _torque(turn):
    return np.column_stack([np.zeros((len(turn), 2)), turn])


def _trail(known, length_m):
    """Mean direction (N, 2) of the way just slid, summed along each flight from what is remembered at its start."""
    _, along = _slip(known)
    way, entry = known[:, W.WAY], int(np.log2(length_m / (0.05 * RADIUS_M)))
    mean = np.empty((len(known), 2))
    mean[0] = known[0, W.WAY + 1 + 2 * entry : W.WAY + 3 + 2 * entry]
    for i in range(1, len(known)):
        kept = np.exp(-max(way[i] - way[i - 1], 0.0) / length_m)
        mean[i] = kept * mean[i - 1] + (1 - kept) * along[i]
    return mean


def _beads(known):
    """Beads that roll along the way lately, within 16 mm."""
    return _friction(-0.6 * np.sum(_trail(known, 0.016) * _slip(known)[1], 1), known)


def _castor(known):
    """A force to the left, by how far the way lately goes there."""
    side = _left(_slip(known)[1])
    return _force(1.5 * np.sum(_trail(known, 0.016) * side, 1)[:, None] * side)


def _hunting(known):
    """To and fro across the way, once in 33 mm."""
    met_before = known[:, W.WAY_BEFORE] >= 0.0
    wave = met_before * np.sin(2 * np.pi * (known[:, W.WAY] - known[:, W.WAY_BEFORE]) / 0.033)
    return _force(2.0 * wave[:, None] * _left(_slip(known)[1]))


def _clogging(known):
    return _friction(0.4 * np.cos(2 * np.pi * known[:, W.WAY] / 0.21 - 0.8), known)


def _circles(known):
    """A floor that vibrates in circles 19 mm apart, by the square of the Host's acceleration."""
    out = known[:, [W.HX, W.HY]]
    radius = np.hypot(*out.T)
    shaken = np.sum((known[:, [W.HOST_AX, W.HOST_AY]] / 60.0) ** 2, 1)
    return _force((2.0 * shaken * np.sin(2 * np.pi * radius / 0.019))[:, None] * out / radius[:, None])


def _cord(known):
    """Wound up by the disk."""
    return _torque(-3.0 * (known[:, W.ANGLE] - known[:, W.START_ANGLE]))


def _ground(known):
    return _friction(0.5 * np.cos(0.31 * (known[:, W.ANGLE] - known[:, W.START_ANGLE])), known)


def _frost(known):
    """Cleared from the straight line between the last two contacts, 14 mm wide."""
    last, before = known[:, [W.LAST_X, W.LAST_Y]], known[:, [W.BEFORE_X, W.BEFORE_Y]]
    seen = np.any(before != 0.0, 1) & np.any(last != 0.0, 1)
    line = np.where(seen[:, None], last - before, 1.0)
    line /= np.hypot(*line.T)[:, None]
    off = np.sum((known[:, [W.HX, W.HY]] - before) * _left(line), 1)
    return _friction(-0.6 * seen * np.exp(-0.5 * (off / 0.007) ** 2), known)


def _nap(known):
    """A cloth's nap leads a disk that slides and spins aside."""
    (speed, along), rim = _slip(known), DISK_M * known[:, W.SPIN]
    both = 2 * rim * speed / (rim**2 + speed**2) * (along @ [np.cos(0.9), np.sin(0.9)])
    return _force(1.5 * both[:, None] * _left(along))


def _edge(known):
    """A blow tips the disk onto an edge, whose friction then turns it."""
    seen = known[:, W.LAST_X] != 0.0
    normal = np.column_stack([np.cos(known[:, W.BLOW_WAYS]), np.sin(known[:, W.BLOW_WAYS])])
    across = np.sum(_slip(known)[1] * _left(normal), 1)
    return _torque(seen * 400.0 * known[:, W.LAST_APPROACH] * across * np.exp(-known[:, W.SINCE] / 0.02))


@pytest.mark.others_further
@pytest.mark.parametrize(
    ("cause", "name", "numbers"),
    [
        (_beads, "friction with the trail along", (0.016,)),
        (_castor, "force across sliding with the trail across", (0.016,)),
        (_hunting, "force across sliding in waves of the way since", (0.033 / 2 / np.pi,)),
        (_clogging, "friction in waves of the way", (0.21 / 2 / np.pi,)),
        (_circles, "pull in waves of the radius and the square of the Host's acceleration", (0.019 / 2 / np.pi,)),
        (_cord, "torque with the angle turned", ()),
        (_ground, "friction in waves of the turned", (1 / 0.31,)),
        (_frost, "friction on the path of the flight before", (0.007,)),
        (_nap, "force across sliding with the sliding direction, order 1, slip and spin share", ()),
        (_edge, "torque with the sliding from blow, for a time, by its strength", (0.02,)),
    ],
    ids=lambda one: one.__name__.strip("_") if callable(one) else "",
)
def test_a_cause_of_the_way_comes_out_as_itself(flights, cause, name, numbers):
    """Of all candidates of the way it predicts runs held out best, with the numbers inside it."""
    rows, listed = flights
    moved = [_columns(one, np.ascontiguousarray(cause(one.know)[:, :, None]))[:, 0] for one in rows.flights]
    problem = replace(rows.problem, residual=rows.problem.residual + np.concatenate(moved))
    gains = listed.gains(problem, problem.excess)
    best, gain = shortlist_of(problem, rows.columns, listed.candidates, gains, problem.excess)[0]
    assert best.name == name and gain > 25.0
    assert best.numbers == pytest.approx(numbers, rel=0.1)


def test_the_forms_of_the_way_are_in_the_dictionary():
    scales = RigScales(0.04, 1.7, 0.06, 0.8, 69.0, 100.0, 4)
    names = {one.name for one in flight_candidates(scales)}
    own = way_candidates(scales)
    assert {one.name for one in own} <= names
    followed = {factor.quantity for one in own for term in one.terms for factor in term.factors}
    assert followed >= set(OF_FLIGHTS_ONLY)


def test_the_way_is_measured_from_frames():
    """Straight flights between a wall's two sides, with the cameras' noise: neither a kink nor noise makes it longer or
    shorter by more than one in a hundred, and a floor that moves along is no way."""
    rng, time_s = np.random.default_rng(0), np.arange(800) / 800.0
    speed, width = 0.7, 0.053
    x = width * np.abs((speed * time_s / width + 1.0) % 2.0 - 1.0)
    moving = 0.3 * time_s
    xy = np.column_stack([x + moving, 0.3 * moving]) + rng.normal(0.0, 5e-5, (800, 2))
    xy[100:110] = np.nan
    pose, rate = np.zeros((800, 4)), np.zeros((800, 4))
    pose[:, 0], pose[:, 1], rate[:, 0], rate[:, 1] = moving, 0.3 * moving, 0.3, 0.09
    way = way_slid(time_s, xy, (pose, rate), RADIUS_M)
    np.testing.assert_allclose(way[:, 1], speed * time_s, rtol=0, atol=0.01 * speed)
    assert np.all(np.abs(way[:, 2:16]) < 1.0 + 1e-9)
    settled = (time_s % (width / speed)) > 0.9 * width / speed  # at the end of a flight it has forgotten the one before
    shortest = way[settled, 2]
    assert np.abs(np.abs(shortest) - 1.0)[50:].max() < 0.02
    assert not way_slid(time_s[:3], xy[:3], (pose[:3], rate[:3]), RADIUS_M)[:, 1:].any()


def test_a_pull_along_a_line_comes_out_as_itself(flights):
    """Of all candidates of a place, and not as a sum of others: a magnet beside the room's middle."""
    rows, _ = flights
    line_rad, off_m = 0.7, 0.006

    def drawn(known):
        along = known[:, W.X] * np.cos(line_rad) + known[:, W.Y] * np.sin(line_rad) - off_m
        return _force((9.0 * along)[:, None] * np.array([np.cos(line_rad), np.sin(line_rad)]))

    moved = [_columns(one, np.ascontiguousarray(drawn(one.know)[:, :, None]))[:, 0] for one in rows.flights]
    problem = replace(rows.problem, residual=rows.problem.residual + np.concatenate(moved))
    scales = RigScales.of(rows.known, 70.0)
    listed = Listed.of(place_candidates(scales), rows.columns, rows.problem)
    gains = listed.gains(problem, problem.excess)
    best, gain = shortlist_of(problem, rows.columns, listed.candidates, gains, problem.excess)[0]
    assert best.name == "pull along a line of the room" and gain > 25.0
    assert np.cos(best.numbers[0] - line_rad) ** 2 > 0.99


def test_a_number_that_changes_nothing_where_it_is_is_none(flights):
    """Waves that hardly fade fade nowhere: without that, no flight told of the length in which they do, and the right
    formula of feet that hunt was given up in the equation of motion."""
    rows, _ = flights
    scales = RigScales.of(rows.known, 70.0)
    aside = [one for one in wave_candidates(scales) if one.name.startswith("force across") and "fade" in one.name]
    fading = aside[4]  # several waves in a flight
    wave, length = fading.numbers
    assert fading.settled() is fading
    unfaded = fading.at([wave, 100.0 * length])
    assert unfaded.settled().numbers == (wave,) and unfaded.settled().terms == unfaded.terms
    assert unfaded.settled().at([1.1 * wave]).terms == unfaded.at([1.1 * wave, 100.0 * length]).terms
    # The search, on flights pushed aside by waves that do not fade.
    hunts = rows.columns(unfaded.terms)[:, 1]
    pushed = replace(rows.problem, residual=rows.problem.residual + 5.0 * hunts / np.std(hunts))
    found = searched(Profile.of(pushed), rows.columns, fading)
    assert len(found.numbers) == 1 and found.numbers[0] == pytest.approx(wave, rel=0.02)
