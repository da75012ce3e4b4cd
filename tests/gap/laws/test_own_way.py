"""Markers that are all seen off along their own way: what bodies that spin tell of a tracker, and its undoing.

Causes of the plant, whose code shares nothing with the search; kinds in view: no blind result."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analysis.gap.cause import OWN_WAY
from analysis.gap.laws.frames.bodies.own_way import find_way_law
from analysis.gap.laws.frames.corrected import without_frame_laws
from analysis.gap.tests_by_hand import unknown_test
from ovines.core.laws.formula import as_text
from ovines.core.laws.terms import Factor, Term, WrittenLaw
from ovines.errors import InputError
from ovines.law_file import law_text, read_law
from tests.gap.conftest import laws_and_ladder

BACK = WrittenLaw((Term("marker_way", -4e-5),))


@pytest.mark.further
def test_a_dead_band_is_one_length_along_the_way(loaded):
    """Of the measurement, and nothing of flights, impacts or wall is left without it."""
    true, series = loaded("unknown_dead_band", 0.6, 3, "ar1", 3)
    (law,), ladder = laws_and_ladder(series)
    (term,) = law.law.terms
    assert (term.target, term.factors) == ("marker_way", ()), as_text(law.law)
    camera = series.cameras[0]
    length_m = true["dead_band_px"] * np.linalg.norm(camera.centre_m) / camera.matrix[0, 0]
    # In the world, and pictures see the floor aslant.
    assert -term.coefficient == pytest.approx(length_m * series.frame.length, rel=0.15)
    assert law.closed > 0.8 and law.halves.agree
    assert [one.stage for one in ladder.structure] == ["measurement"] and ladder.causes == ()
    assert ladder.structure[0].goes_with == OWN_WAY
    assert "own way" in unknown_test("measurement", ladder.structure[0].goes_with)


@pytest.mark.further
def test_a_shutter_that_stays_open_goes_with_the_square_of_the_speed(loaded):
    true, series = loaded("unknown_long_shutter", 0.8, 5, "white", 3)
    law = find_way_law(series, np.random.default_rng(0))
    (term,) = law.law.terms
    assert (term.target, term.factors) == ("marker_way", (Factor("speed", "power", 2.0),)), as_text(law.law)
    assert -term.coefficient == pytest.approx(true["smear_s2_per_m"], rel=0.1)
    assert law.closed > 0.8
    assert find_way_law(without_frame_laws(series, [law.law]), np.random.default_rng(0)) is None


@pytest.mark.further
def test_a_search_window_that_is_too_small_begins_at_a_speed(loaded):
    """The plant's holds 4 px from frame to frame."""
    true, series = loaded("unknown_small_window", 0.7, 6, "white", 3)
    law = find_way_law(series, np.random.default_rng(0))
    ((factor,),) = (term.factors for term in law.law.terms)
    assert (factor.quantity, factor.function) == ("speed", "above"), as_text(law.law)
    camera, period_s = series.cameras[0], series.motions[0]["time_s"].diff().median()
    metres_per_px = np.linalg.norm(camera.centre_m) / camera.matrix[0, 0] * series.frame.length
    assert factor.scale == pytest.approx(4.0 * metres_per_px / period_s, rel=0.15)
    assert -law.law.terms[0].coefficient == pytest.approx(true["missed"] * period_s, rel=0.15)
    assert find_way_law(without_frame_laws(series, [law.law]), np.random.default_rng(0)) is None


@pytest.mark.further
def test_a_law_that_is_held_is_not_found_again(loaded, tmp_path):
    """Written into a file and given to the diagnosis: what advice says to do."""
    _, series = loaded("unknown_small_window", 0.7, 6, "white", 3)
    law = find_way_law(series, np.random.default_rng(0)).law
    path = tmp_path / "law-1.toml"
    path.write_text(law_text(law, "window"), encoding="utf-8")
    assert as_text(read_law(path)) == as_text(law)
    _, held = loaded("unknown_small_window", 0.7, 6, "white", 3, (path,))
    assert find_way_law(held, np.random.default_rng(0)) is None


@pytest.mark.others_further
@pytest.mark.parametrize(("kind", "noise"), [("none", "ar1"), ("none", "warp"), ("sensor_window_offset", "white")])
def test_markers_in_their_places_have_no_law(loaded, kind, noise):
    _, series = loaded(kind, 1.0, 8, noise, 2)
    assert find_way_law(series, np.random.default_rng(0)) is None


@pytest.mark.further
def test_every_marker_of_host_and_disk_is_moved_back(loaded):
    """By one length where it moves, along its own velocity, in points and pictures; ground markers stay."""
    _, series = loaded("none", 1.0, 4, runs=2)
    moved = without_frame_laws(series, [BACK])
    before, after = series.points[0].set_index(["marker", "frame"]), moved.points[0].set_index(["marker", "frame"])
    way = after[["x_m", "y_m"]] - before[["x_m", "y_m"]]
    size = np.hypot(way["x_m"], way["y_m"]) * series.frame.length
    for body in ("host", "nes"):
        for marker in series.recordings[0].bodies[body].markers:
            assert np.median(size[marker]) == pytest.approx(4e-5, rel=1e-6)
    assert all(size[marker].max() == 0.0 for marker in series.recordings[0].bodies["ground"].markers)
    gone = before.loc["N1"][["x_m", "y_m"]].diff().to_numpy()
    along = way.loc["N1"].to_numpy()
    cosine = np.sum(gone * along, 1) / np.maximum(np.hypot(*gone.T) * np.hypot(*along.T), 1e-300)
    assert np.nanmedian(cosine) > 0.999  # what stayed behind comes forward
    pixels = [one.tracks[0].set_index(["camera", "marker", "frame"])["u_px"] for one in (series, moved)]
    assert (pixels[0] - pixels[1]).abs().groupby("marker").max()["H1"] > 0.05


def test_a_series_without_markers_is_refused(loaded):
    _, series = loaded("none", 1.0, 4, runs=2)
    with pytest.raises(InputError, match="a law of every marker"):
        without_frame_laws(replace(series, points=None, tracks=None), [BACK])
    assert find_way_law(replace(series, points=None), np.random.default_rng(0)) is None
