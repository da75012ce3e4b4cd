"""A Host whose markers tilt: a law of the measurement that their heights show.

A cause of the plant, whose code shares nothing with the search; a kind in view: no blind result."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.blind.recording.place import Place
from analysis.blind.series import make_series
from analysis.gap.laws.frames.bodies.tilt import RESTLESS, find_tilt_law, tilt_rows
from analysis.gap.laws.frames.corrected import without_frame_laws
from analysis.gap.tests_by_hand import unknown_test
from ovines.core.laws.formula import as_latex, as_text, legend
from ovines.core.laws.terms import Factor, Term, WrittenLaw
from ovines.errors import InputError
from tests.gap.conftest import brought, laws_and_ladder

G_M_PER_S2 = 9.81


@pytest.fixture(scope="module")
def pitching(tmp_path_factory):
    made = make_series(
        "unknown_pitching_plate", 1.0, np.random.default_rng(13), 4, "white", place=Place(drive="random")
    )
    return made.truth["parameters"]["unknown_pitching_plate"], brought(made, tmp_path_factory.mktemp("tilt") / "series")


def of(marker, table):
    return table[table["marker"] == marker].set_index("frame")


@pytest.mark.further
def test_a_plate_that_pitches_has_its_law(pitching):
    """It had been answered as "none": places and flights hardly know of heights."""
    true, series = pitching
    (law,), ladder = laws_and_ladder(series)
    (term,) = law.rig_law.terms
    assert term.target == "host_tilt" and [one.quantity for one in term.factors] == ["host_acceleration_along"]
    per_push = term.coefficient * np.cos(term.x) * np.cos(term.factors[0].x)
    assert per_push == pytest.approx(true["pitched_rad"] / (8 * G_M_PER_S2), rel=0.02)
    assert law.closed > 0.95
    assert ladder.causes == () and [one.stage for one in ladder.structure] == ["measurement"]
    assert "spacers give" in unknown_test("measurement", ladder.structure[0].goes_with)


def test_without_their_law_the_markers_lean_no_more(pitching):
    true, series = pitching
    slope = true["pitched_rad"] / (8 * G_M_PER_S2)
    law = WrittenLaw((Term("host_tilt", slope, (Factor("host_acceleration_along"),)),))
    assert tilt_rows(series).problem.excess > 20
    level = without_frame_laws(series, [law])
    assert tilt_rows(level).problem.excess < RESTLESS
    # Pictures move as places do.
    marker = series.recordings[0].bodies["host"].markers[1]

    before, after = (of(marker, one.points[0]) for one in (series, level))
    for camera in series.cameras:
        place = [camera.project(one[["x_m", "y_m", "z_m"]].to_numpy(float)) for one in (before, after)]
        seen = [of(marker, one.tracks[0][one.tracks[0]["camera"] == camera.name]) for one in (series, level)]
        both = before.index.intersection(seen[0].index)
        pixels = [one.loc[both, ["u_px", "v_px"]].to_numpy(float) for one in seen]
        moved = pixels[1] - pixels[0]
        np.testing.assert_allclose(moved, (place[1] - place[0])[before.index.isin(both)], rtol=0, atol=1e-6)
        assert np.abs(moved).max() > 0.3


@pytest.mark.parametrize("kind", ["none", "vertical_motion", "camera_clock_offset"])
def test_a_host_that_stays_level_has_no_tilt(loaded, kind):
    _, series = loaded(kind, 1.0, 4, runs=2)
    assert find_tilt_law(series, np.random.default_rng(0)) is None


def test_markers_are_needed_and_a_tilt_is_read_and_written(loaded):
    law = WrittenLaw((Term("host_tilt", 2e-4, (Factor("host_acceleration_along", x=0.5),), x=0.5),))
    assert as_text(law) == (
        "tilt of the Host's markers += 0.0002 s^2/m * host_acceleration_along(0.5 rad) * direction(0.5 rad)"
    )
    assert "nabla z" in as_latex(law) and legend(law)
    _, series = loaded("none", 1.0, 4, runs=2)
    with pytest.raises(InputError, match="a law of the Host's tilt"):
        without_frame_laws(type(series)(**{**vars(series), "points": None}), [law])
