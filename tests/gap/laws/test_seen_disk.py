"""A disk that is seen beside where it is: a law of the measurement that only flights show, and its undoing.

Causes of the plant, whose code shares nothing with the search; kinds in view: no blind result."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analysis.blind.series import make_series
from analysis.gap.laws.frames.corrected import without_frame_laws
from ovines.core.laws.formula import as_latex, as_text, legend
from ovines.core.laws.terms import Factor, Term, WrittenLaw
from ovines.core.refusal import ScenarioError
from ovines.errors import InputError
from tests.gap.conftest import brought, laws_and_ladder


@pytest.mark.further
def test_a_disk_that_is_seen_beside_its_place_in_the_shade(tmp_path):
    """A law of the measurement, with the lamp's direction and where the shade begins; no force, and no wall's shape."""
    made = make_series("unknown_shaded_wall", 0.8, np.random.default_rng(4), runs=3, noise="white")
    series = brought(made, tmp_path / "series")
    (law,), ladder = laws_and_ladder(series)
    (term,) = law.rig_law.terms
    assert law.law.stage == "measurement" and term.target == "nes_place", as_text(law.law)
    lamp_rad, (line,) = made.truth["parameters"]["unknown_shaded_wall"]["angle_rad"], term.factors
    assert abs(np.angle(np.exp(1j * (term.x - lamp_rad)))) < 0.05
    assert (line.quantity, line.function) == ("along_host", "above") and line.scale == pytest.approx(0.012, abs=0.002)
    assert term.coefficient < 0 and law.closed > 0.9
    assert ladder.causes == () and [one.stage for one in ladder.structure] == ["measurement"]


@pytest.mark.further
def test_a_floor_that_leans_with_the_host_is_no_disk_seen_elsewhere(tmp_path):
    """Both move the disk by a share of the Host's way; what is seen elsewhere would have left the wall oval."""
    made = make_series("unknown_bent_guide", 0.9, np.random.default_rng(7), runs=2, noise="white")
    series = brought(made, tmp_path / "series")
    laws, _ = laws_and_ladder(series)
    assert [law.law.stage for law in laws] == ["flight"], [as_text(law.law) for law in laws]
    assert laws[0].closed > 0.8


def test_a_disk_is_moved_back_by_the_law_of_where_it_is_seen(loaded):
    """All of its markers alike, in points and pictures; a series without markers is refused."""
    _, series = loaded("none", 1.0, 4, runs=2)
    law = WrittenLaw((Term("nes_place", 2e-3, (Factor("along_host", "below", 1.0, 0.0),), x=0.5),))
    moved = without_frame_laws(series, [law])
    disk = series.recordings[0].bodies["nes"].markers
    before, after = series.points[0], moved.points[0]
    way = before[["x_m", "y_m"]].to_numpy() - after[["x_m", "y_m"]].to_numpy()
    of_disk = before["marker"].isin(list(disk)).to_numpy()
    turn = series.frame.turn_rad
    expected = 2e-3 * np.array([np.cos(0.5 - turn), np.sin(0.5 - turn)])
    size = np.hypot(*way.T)
    assert np.all(size[~of_disk] == 0.0) and set(np.round(size[of_disk], 9)) == {0.0, 2e-3}
    np.testing.assert_allclose(way[size > 0], np.broadcast_to(expected, (np.count_nonzero(size), 2)), rtol=0, atol=1e-9)
    pixels = [one.tracks[0].set_index(["camera", "marker", "frame"])["u_px"] for one in (series, moved)]
    shift = (pixels[0] - pixels[1]).groupby("marker").apply(lambda one: one.abs().max())
    assert all((shift[name] > 1.0) == (name in disk) for name in shift.index)
    with pytest.raises(InputError):
        without_frame_laws(replace(series, points=None), [law])


def test_it_is_set_as_a_formula():
    """With its direction, in words and in LaTeX, and every symbol explained; it follows places, no speeds."""
    away = Term("nes_place_outwards", -4e-4, (Factor("gap", "exponential", 1.0, 5e-3),))
    law = WrittenLaw((away, Term("nes_place", 1e-4, (Factor("radius", "power", 2.0),), x=0.5)))
    assert as_text(law).startswith(
        "place where the NES is seen += -0.0004 m * exp(-gap / 0.005 m) * outwards + 0.0001 1/m"
    )
    assert as_text(law).endswith("direction(0.5 rad)")
    assert as_latex(law).count(r"\vec x_{\mathrm{NES}}") == 1 and as_latex(law).endswith(r"\vec e_{\varphi}")
    assert r"\hat r" in dict(legend(law)) and r"\vec e_{\varphi}" in dict(legend(law))
    assert law.moved(0.3).terms[1].x == pytest.approx(0.8)
    assert law.in_units(2.0, 1.0).terms[0].coefficient == pytest.approx(-2e-4)
    with pytest.raises(ScenarioError):
        WrittenLaw((Term("nes_place", 1e-4, (Factor("approach"),)),))
