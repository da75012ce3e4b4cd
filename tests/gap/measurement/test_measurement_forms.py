"""What cameras, clocks, markers and the disk's card may follow beside time and drive: the blow before, the Host's play,
ticks and two states.

Rows made by hand, and plain series in which a law has been undone that was never there."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from analysis.gap.ladder import stated_effects
from analysis.gap.laws.belief import believed
from analysis.gap.laws.choice.search import find_law
from analysis.gap.laws.frames.bodies.card import card_rows, find_card_law
from analysis.gap.laws.frames.bodies.markers import MarkerRows, restless_markers
from analysis.gap.laws.frames.corrected import without_frame_laws
from analysis.gap.laws.frames.dictionary import frame_candidates, marker_candidates
from analysis.gap.laws.frames.evidence.known import known_frames
from analysis.gap.laws.frames.evidence.rows import FrameRows, problem_of
from analysis.gap.laws.frames.law import find_marker_laws
from analysis.gap.measurement.body_residuals import loose_m
from analysis.gap.measurement.rigid_bodies import loose_markers
from analysis.gap.selection.flight_steps import first_flights
from ovines.core.laws import words as W
from ovines.core.laws.terms import Factor, Term, WrittenLaw

RUNS, FRAMES, PERIOD_S, FLIGHT_S, DRIVE = 4, 400, 1.25e-3, 0.05, 70.0
NOISE = 0.3


@pytest.fixture(scope="module")
def known():
    """Frames of runs with a blow every twentieth of a second, of any size and either sense, over a Host on a sine."""
    rng, parts = np.random.default_rng(3), []
    for run in range(RUNS):
        time_s = np.arange(FRAMES) * PERIOD_S
        out = np.zeros((FRAMES, W.KNOWN_SIZE))
        out[:, W.TIME], out[:, W.RUN], out[:, W.SHARE] = time_s, run, time_s / (FRAMES * PERIOD_S)
        number = np.floor(time_s / FLIGHT_S).astype(int)
        out[:, W.SINCE], out[:, W.BLOWS] = time_s - number * FLIGHT_S, number
        blow = number.max() + 1
        out[:, W.LAST_APPROACH] = rng.uniform(0.2, 1.5, blow)[number]
        out[:, W.LAST_SPUN] = rng.normal(0.0, 20.0, blow)[number]
        out[:, W.LAST_X], out[:, W.LAST_Y] = rng.normal(0.0, 0.03, (2, blow))[:, number]
        out[:, W.SPIN] = rng.normal(0.0, 30.0, blow)[number]
        turn = DRIVE * time_s + run
        out[:, W.CONTACT_RADIUS] = 0.04
        out[:, W.PHASE], out[:, W.CLOCK] = turn, DRIVE * time_s
        out[:, W.HOST_AX] = -60.0 * np.sin(turn)
        out[:, W.VX] = 60.0 / DRIVE * np.cos(turn)
        out[:, W.X] = 60.0 / DRIVE**2 * np.sin(turn)
        parts.append(out)
    return np.vstack(parts)


def frame_rows(known, value: Callable[[np.ndarray], np.ndarray], target="picture_u"):
    """Rows of one target, one of each frame, that see ``value`` of what is known, and noise."""
    at = np.arange(len(known))
    seen = value(known) + NOISE * np.random.default_rng(1).standard_normal(len(known))
    problem = problem_of(seen / NOISE, np.ones((len(known), 1)), known, at)
    return FrameRows(problem, known, at, {(target, 0): np.full(len(known), 1 / NOISE)})


def law_in(rows, candidates):
    found, _ = find_law(rows.problem, rows.columns, candidates, np.random.default_rng(0), most_parts=1)
    return None if found is None else (found.parts[0], found.coefficients)


def saw(time_s):
    return 0.5 - time_s % 1.0


@pytest.mark.others_further
@pytest.mark.parametrize(
    ("value", "function", "quantities"),
    [
        (lambda k: 2.0 * saw(k[:, W.TIME] / 0.0372 + 0.3), "sawtooth", {"time"}),
        (lambda k: -2.0 * saw(k[:, W.TIME] / 4.3e-4 + 0.7), "sawtooth", {"time"}),  # beats with the frames
        (lambda k: 1.0 * ((k[:, W.TIME] / 0.083 + 0.1) % 1.0 < 0.5), "gates", {"time"}),
        (lambda k: 2.0 * np.exp(-0.5 * (saw(k[:, W.TIME] / 0.093) * 0.093 / 0.004) ** 2), "pulses", {"time"}),
        (lambda k: np.sign(k[:, W.VX]), "sign", {"host_velocity_along"}),
        (lambda k: np.maximum(k[:, W.VX] - 0.5, 0.0) * 4.0, "above", {"host_velocity_along"}),
        (lambda k: 0.3 * k[:, W.BLOWS], "power", {"blows"}),
        (lambda k: np.sign(k[:, W.LAST_SPUN]), "sign", {"last_spun"}),
        (lambda k: 3.0 * k[:, W.LAST_APPROACH] * np.exp(-k[:, W.SINCE] / 0.012), "power", {"last_approach", "since"}),
        (
            lambda k: 3.0 * k[:, W.LAST_APPROACH] * np.exp(-k[:, W.SINCE] / 0.02) * np.sin(290.0 * k[:, W.SINCE]),
            "power",
            {"last_approach", "since"},
        ),
    ],
    ids=["sets back", "ticks", "two states", "pulses", "backlash", "cable", "slips", "a side", "fades", "swings"],
)
def test_a_picture_follows_what_moves_it(known, value, function, quantities):
    """The form, and all but a hundredth of what it does."""
    rows = frame_rows(known, value)
    part, coefficients = law_in(rows, frame_candidates(rows, np.random.default_rng(0)))
    assert {one.quantity for term in part.terms for one in term.factors} == quantities
    assert part.terms[0].factors[0].function == function
    true = value(known) - np.mean(value(known))
    fitted = NOISE * (rows.columns(part.terms) @ coefficients)
    assert np.sum((fitted - fitted.mean() - true) ** 2) < 0.02 * np.sum(true**2)


def test_a_timer_ticks_at_its_period(known):
    """Period and phase are free; the beat with the frames is what they show."""
    rows = frame_rows(known, lambda k: 2.0 * saw(k[:, W.TIME] / 0.0372 + 0.3), "clock_delay")
    part, (size,) = law_in(rows, frame_candidates(rows, np.random.default_rng(0)))
    (factor,) = part.terms[0].factors
    assert factor.function == "sawtooth"
    assert factor.scale == pytest.approx(0.0372, rel=2e-3) and size == pytest.approx(2.0, rel=0.02)


@pytest.mark.parametrize("target", ["picture_u", "clock_delay", "camera_delay"])
def test_noise_has_no_form(known, target):
    rows = frame_rows(known, lambda k: 0.0 * k[:, W.TIME], target)
    assert law_in(rows, frame_candidates(rows, np.random.default_rng(0))) is None


def test_a_sticker_lies_where_the_blow_has_left_it(known):
    """Along a direction of its disk, by the sense of the spin that the last blow gave."""
    at, unit = np.repeat(np.arange(len(known)), 2), np.tile(np.eye(2) / 1e-5, (len(known), 1))
    side = 3e-5 * np.sign(known[:, W.LAST_SPUN])
    seen = np.column_stack([0.6 * side, 0.8 * side]).reshape(-1) / 1e-5
    seen = seen + np.random.default_rng(2).standard_normal(len(seen))
    rows = MarkerRows(problem_of(seen, unit, known, at), known, at, ("nes_marker", 2), unit)
    part, coefficients = law_in(rows, marker_candidates(rows, np.random.default_rng(0)))
    assert [one.factors for one in part.terms] == [(Factor("last_spun", "sign"),)] * 2
    np.testing.assert_allclose(coefficients, [1.8e-5, 2.4e-5], rtol=0.05)


def test_frames_remember_the_blow_before_them(loaded):
    """Their time since it goes on evenly from each to the next; what it gave is the change of the spin."""
    _, series = loaded("none", 1.0, 8, "white", 2)
    run = series.runs[0]
    known = known_frames(run.data.time_s, run.data, run.flights)
    struck = known[:, W.SINCE] < 0.5 * W.LONG_AGO_S
    assert np.mean(struck) > 0.5 and np.all(known[~struck][:, W.LAST_SPUN] == 0.0)
    steps = np.diff(known[struck][:, W.SINCE])
    assert np.mean(np.abs(steps - run.data.period_s) < 1e-9) > 0.8 and known[struck][:, W.SINCE].min() >= 0.0
    given = [known[known[:, W.BLOWS] == n] for n in np.unique(known[struck][:, W.BLOWS])]
    before = {n: np.median(known[known[:, W.BLOWS] == n][:, W.SPIN]) for n in np.unique(known[:, W.BLOWS])}
    changes = [
        (one[0, W.LAST_SPUN], before[one[0, W.BLOWS]] - before.get(one[0, W.BLOWS] - 1, np.nan)) for one in given
    ]
    known_changes, seen = np.array([pair for pair in changes if np.isfinite(pair[1]) and pair[0] != 0.0]).T
    assert np.corrcoef(known_changes, seen)[0, 1] > 0.9


def undone(series, *terms):
    """A plain series as it would be if the opposite of ``terms`` had acted."""
    return without_frame_laws(series, [WrittenLaw(terms)])


@pytest.fixture
def flown():
    """Function series -> its flights with nominal effects."""
    return lambda series: first_flights(series, stated_effects(series))


@pytest.mark.further
def test_a_card_with_play_lies_at_the_stop_of_the_last_blow(loaded, flown):
    """No flight knows of it: its steps stand where flights meet.  Taken out, nothing of it is left."""
    _, plain = loaded("none", 1.0, 8, "white", 2)
    series = undone(plain, Term("nes_card_turn", 0.012, (Factor("last_spun", "sign"),)))
    law = find_card_law(flown(series), series, np.random.default_rng(0))
    assert law is not None and believed(law, law.size, loose_m(series)) is not None
    (term,) = law.law.terms
    assert (term.target, term.factors) == ("nes_card_turn", (Factor("last_spun", "sign"),))
    assert term.coefficient == pytest.approx(-0.012, rel=0.1) and law.closed > 0.8
    again = without_frame_laws(series, [law.law])
    assert find_card_law(flown(again), again, np.random.default_rng(0)) is None


@pytest.mark.further
def test_markers_printed_about_another_point_are_a_card_that_turns_with_its_angle(loaded, flown):
    """Their angle is read wrong, once around."""
    _, plain = loaded("none", 1.0, 8, "white", 2)
    series = undone(plain, Term("nes_card_turn", 0.012, (Factor("angle", "cosine", x=0.7),)))
    law = find_card_law(flown(series), series, np.random.default_rng(0))
    assert law is not None and believed(law, law.size, loose_m(series)) is not None
    (term,) = law.law.terms
    assert term.target == "nes_card_turn" and term.factors[0].quantity == "angle"
    assert abs(term.coefficient) == pytest.approx(0.012, rel=0.05) and law.closed > 0.9


def test_a_card_that_stays_has_no_law(loaded, flown):
    """Nor has one where too few flights meet."""
    _, series = loaded("none", 1.0, 8, "ar1", 2)
    fitted = flown(series)
    rows = card_rows(fitted)
    assert rows is not None and len(rows.meetings) > 8
    assert find_card_law(fitted, series, np.random.default_rng(0)) is None


@pytest.mark.further
def test_a_sticker_that_flutters_is_found_though_no_mean_tells_it(loaded):
    """The marker that moves beside what the others do, by its number; the plain series has none."""
    _, plain = loaded("none", 1.0, 8, "white", 3)
    assert restless_markers(plain) == [] and loose_markers(plain) == []
    flutter = (
        Factor("last_approach"),
        Factor("since", "exponential", 1.0, 0.02),
        Factor("since", "sine", 1.0, 1 / 200),
    )
    series = undone(plain, Term("nes_marker", -4e-4, flutter, 2.0, 0.5))
    laws, after = find_marker_laws(series, np.random.default_rng(0))
    assert {(term.target, term.x) for law in laws for term in law.law.terms} == {("nes_marker", 2.0)}
    assert laws[0].law.terms[0].factors[0].quantity == "last_approach" and laws[0].closed > 0.9
    assert restless_markers(after) == []
