"""Places that hold something of the frames beside them: what two ways that meet at a blow tell of tracks, and its
undoing.

Causes of the plant, whose code shares nothing with the search, and points that the test itself smooths; kinds in view:
no blind result."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from analysis.gap.cause import BESIDE
from analysis.gap.laws.frames.bodies.at_blows import corner_rows, find_blow_law, off_by
from analysis.gap.laws.frames.bodies.sharpened import REACHES
from analysis.gap.laws.frames.corrected import without_frame_laws
from analysis.gap.page.figures.at_blows import blow_figure
from analysis.gap.series import with_points
from analysis.gap.tests_by_hand import unknown_test
from ovines.core.laws.formula import as_latex, as_text, latex_lines, legend
from ovines.core.laws.terms import Term, WrittenLaw
from ovines.errors import InputError
from ovines.law_file import law_text, read_law
from tests.gap.conftest import laws_and_ladder

RNG = np.random.default_rng
#: frames of the plant's mean
MEAN = 5


def shares(law, series):
    """Share of each frame, by how many frames after."""
    return {round(term.x / series.period_s): term.coefficient for term in law.rig_law.terms}


def mixed(points, weights):
    """Points whose places hold ``weights`` of the frames beside them, by how many frames after."""
    out = points.copy()
    for marker, own in points.groupby("marker", sort=False):
        own = own.set_index("frame")[["x_m", "y_m"]]
        every = own.reindex(np.arange(own.index[0], own.index[-1] + 1))
        moved = sum((share * (every.shift(-k) - every) for k, share in weights.items()), 0 * every).fillna(0.0)
        out.loc[(points["marker"] == marker).to_numpy(), ["x_m", "y_m"]] += moved.loc[own.index].to_numpy()
    return out


def smoothed(loaded, weights):
    """A series without effect whose points hold ``weights`` of the frames beside them."""
    _, series = loaded("none", 1.0, 8, "white", 3)
    series = replace(series, tracks=None)
    return with_points(series, [mixed(points, weights) for points in series.points])


@pytest.mark.further
def test_tracks_that_were_smoothed_hold_a_share_of_each_frame_of_the_mean(loaded):
    """Of the measurement; no force beside the wall and nothing of the impacts is left without it."""
    true, series = loaded("unknown_smoothed_tracks", 0.6, 3, "ar1", 3)
    (law,), ladder = laws_and_ladder(series)
    found = shares(law, series)
    assert set(found) == {-2, -1, 1, 2}, as_text(law.law)
    assert np.mean(list(found.values())) == pytest.approx(true["smoothed"] / MEAN, rel=0.1)
    assert law.closed > 0.8 and law.halves.agree
    assert [one.stage for one in ladder.structure] == ["measurement"] and ladder.causes == ()
    assert ladder.structure[0].goes_with.startswith(BESIDE)
    assert "smoothed" in unknown_test("measurement", ladder.structure[0].goes_with)
    axes = blow_figure(ladder.measured, law).axes[0]
    at, said = axes.get_lines()[-1].get_data()
    assert at[np.argmax(said)] == pytest.approx(0.0, abs=0.1 * 1e3 * series.period_s)  # the corner is cut at the blow


@pytest.mark.further
@pytest.mark.parametrize(
    ("weights", "what"),
    [
        ({-1: 0.4, -2: -0.2}, "goes on from the two frames before"),
        ({-1: 0.1, 1: 0.1}, "a mean of three"),
        ({-1: 0.2}, "an average that lags"),
        ({-2: 0.2, -1: 0.2, 1: 0.2, 2: 0.2}, "nothing but a mean of five"),
        ({k: (59 - 5 * k**2) / 231 if k else 0.0 for k in range(-4, 5)}, "a parabola through nine (Savitzky-Golay)"),
    ],
)
def test_what_a_place_holds_comes_back_whatever_it_is(loaded, weights, what):
    """And without the law there is none left."""
    series = smoothed(loaded, weights)
    law = find_blow_law(series, RNG(0))
    assert law is not None, what
    found = shares(law, series)
    for k in range(-REACHES[1], REACHES[1] + 1):
        if k:
            assert found.get(k, 0.0) == pytest.approx(weights.get(k, 0.0), abs=0.03), as_text(law.law)
    assert law.closed > 0.8
    again = find_blow_law(without_frame_laws(series, [law.law]), RNG(0))
    assert again is None or again.size < 0.2 * law.size


@pytest.mark.further
def test_it_matters_not_where_the_rig_stands_and_when(loaded):
    """Turned and moved in the room, a day later and with the markers' rows in another order."""
    series = smoothed(loaded, {-1: 0.1, 1: 0.1})
    turn, day_s = np.array([[0.6, -0.8], [0.8, 0.6]]), 86400.0

    def moved(points):
        out = points.sample(frac=1.0, random_state=0).sort_values("frame", kind="stable", ignore_index=True)
        out[["x_m", "y_m"]] = out[["x_m", "y_m"]].to_numpy() @ turn.T + [0.3, -0.2]
        return out.assign(time_s=out["time_s"] + day_s)

    here = find_blow_law(series, RNG(0))
    there = find_blow_law(with_points(series, [moved(points) for points in series.points]), RNG(0))
    assert shares(there, series) == pytest.approx(shares(here, series), rel=1e-3)
    assert there.size == pytest.approx(here.size, rel=1e-3)


@pytest.mark.further
def test_a_tracker_that_guesses_near_the_wall_goes_on_from_two_frames(loaded):
    """By shares of two and minus one: evenly on from where the marker was."""
    _, series = loaded("unknown_guessing_tracker", 0.9, 3, "white", 3)
    law = find_blow_law(series, RNG(0))
    found = shares(law, series)
    assert -found[-1] / found[-2] == pytest.approx(2.0, rel=0.25), as_text(law.law)
    assert set(found) <= {-3, -2, -1} and abs(found.get(-3, 0.0)) < 0.3 * abs(found[-2])


@pytest.mark.others_further
@pytest.mark.parametrize(
    ("kind", "noise"),
    [("none", "ar1"), ("none", "warp"), ("nes_rocking", "white"), ("speed_dependent_restitution", "white")],
)
def test_places_of_their_own_have_no_law(loaded, kind, noise):
    _, series = loaded(kind, 1.0, 8, noise, 2)
    law = find_blow_law(series, RNG(0))
    assert law is None, as_text(law.law)


@pytest.mark.further
def test_a_contact_that_lasts_keeps_its_name(loaded):
    """It cuts corners, too, for less than a frame."""
    _, series = loaded("finite_contact_time", 1.0, 8, "white", 3)
    laws, ladder = laws_and_ladder(series)
    assert [cause.effect for cause in ladder.causes] == ["finite_contact_time"] and laws == ()


@pytest.mark.further
def test_a_law_that_is_held_is_not_found_again(loaded, tmp_path):
    """Written into a file and given to the diagnosis: what advice says to do."""
    _, series = loaded("unknown_smoothed_tracks", 0.6, 3, "ar1", 3)
    law = find_blow_law(series, RNG(0)).law
    path = tmp_path / "law-1.toml"
    path.write_text(law_text(law, "smoothed"), encoding="utf-8")
    assert as_text(read_law(path)) == as_text(law)
    _, held = loaded("unknown_smoothed_tracks", 0.6, 3, "ar1", 3, (path,))
    assert find_blow_law(held, RNG(0)) is None


def test_two_straight_ways_that_meet_say_what_a_share_makes_of_each_frame():
    """A mean of three about a corner, by hand: the corner's frame is a third of a frame's change off."""
    after = np.array([-2.0, -0.5, 0.0, 0.5, 2.0])
    way = np.maximum(after, 0.0)
    mean = (np.maximum(after - 1, 0) + way + np.maximum(after + 1, 0)) / 3
    np.testing.assert_allclose((off_by(after, 1.0) + off_by(after, -1.0)) / 3, mean - way, atol=1e-12)
    # What is late as a whole is nothing that two ways tell.
    np.testing.assert_allclose(off_by(np.array([-5.0, 5.0]), -2.0), 0.0, atol=1e-12)


def test_no_blow_that_tells_and_no_markers(loaded):
    _, series = loaded("none", 1.0, 4, runs=2)
    law = WrittenLaw((Term("marker_neighbour", 0.1, x=series.period_s),))
    with pytest.raises(InputError, match="a law of every marker"):
        without_frame_laws(replace(series, points=None, tracks=None), [law])
    one = series.runs[0]
    short = replace(series, runs=(replace(one, flights=one.flights[:1]),))
    assert corner_rows(short, REACHES[0]) is None and find_blow_law(short, RNG(0)) is None
    assert blow_figure(short, SimpleNamespace(rig_law=law)) is None


def test_a_long_formula_stands_in_lines():
    law = WrittenLaw(tuple(Term("marker_neighbour", 0.05, x=1e-3 * k) for k in (-2, -1, 1, 2)))
    assert as_text(law) == (
        "place of every marker += 0.05 * step(-2 ms) + 0.05 * step(-1 ms) + 0.05 * step(+1 ms) + 0.05 * step(+2 ms)"
    )
    lines = latex_lines(law, 80)
    assert len(lines) == 2 and " ".join(lines).replace(r"\quad ", "") == as_latex(law)
    assert dict(legend(law)).keys() == {r"\vec s"}
