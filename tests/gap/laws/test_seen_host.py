"""A Host that is seen beside where it is: a law of the measurement that the wall and the flights show together.

Causes of the plant, whose code shares nothing with the search; kinds in view: no blind result."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analysis.blind.series import make_series
from analysis.gap.laws.frames.corrected import without_frame_laws
from analysis.gap.tests_by_hand import unknown_test
from ovines.core.laws.formula import as_latex, as_text, legend
from ovines.core.laws.terms import Factor, Term, WrittenLaw
from ovines.errors import InputError
from tests.gap.conftest import brought, laws_and_ladder

G_M_PER_S2 = 9.80665


@pytest.mark.further
def test_markers_on_soft_pads_are_a_host_that_is_seen_beside_its_place(tmp_path):
    """One law in the place of two, of flights and wall, which closes all: nothing else is left or named."""
    made = make_series("unknown_padded_markers", 0.6, np.random.default_rng(6), runs=3, noise="white")
    series = brought(made, tmp_path / "series")
    (law,), ladder = laws_and_ladder(series)
    assert {term.target for term in law.rig_law.terms} == {"host_place"}, as_text(law.law)
    stays_s2 = made.truth["parameters"]["unknown_padded_markers"]["pads_m"] / (8 * G_M_PER_S2)
    for term in law.rig_law.terms:
        (factor,) = term.factors
        assert factor.quantity == "host_acceleration_along" and factor.x == term.x
        assert term.coefficient == pytest.approx(-stays_s2, rel=0.1)
    assert law.closed > 0.9
    assert ladder.causes == () and [one.stage for one in ladder.structure] == ["measurement"]
    assert "Glue the markers to the ring itself" in unknown_test("measurement", ladder.structure[0].goes_with)


@pytest.mark.further
def test_a_ring_that_is_thrown_on_the_host_is_a_law_of_the_wall(tmp_path):
    """Contact distances say the same of it; flights, whose floor is where it is seen, fit worse with the Host moved."""
    made = make_series("unknown_seat_play", 0.6, np.random.default_rng(4), runs=3, noise="white")
    laws, _ = laws_and_ladder(brought(made, tmp_path / "series"))
    assert [law.law.stage for law in laws][-1] == "geometry", [as_text(law.law) for law in laws]
    assert all(term.target != "host_place" for law in laws for term in law.law.terms)


def test_a_host_is_moved_back_by_the_law_of_where_it_is_seen(loaded):
    """All of its markers alike, in points and pictures; a series without markers is refused."""
    _, series = loaded("none", 1.0, 4, runs=2)
    law = WrittenLaw((Term("host_place", -3e-6, (Factor("host_acceleration_along", x=0.5),), x=0.5),))
    moved = without_frame_laws(series, [law])
    host = series.recordings[0].bodies["host"].markers
    before, after = series.points[0], moved.points[0]
    way = before[["x_m", "y_m"]].to_numpy() - after[["x_m", "y_m"]].to_numpy()
    of_host = before["marker"].isin(list(host)).to_numpy()
    along = np.array([np.cos(0.5 - series.frame.turn_rad), np.sin(0.5 - series.frame.turn_rad)])
    push = series.runs[0].data.host.at(before["time_s"].to_numpy(float), 2)[:, :2] @ along
    assert np.all(way[~of_host] == 0.0) and np.std(push) > 1.0
    np.testing.assert_allclose(way[of_host], -3e-6 * push[of_host, None] * along, rtol=0, atol=1e-9)
    pixels = [one.tracks[0].set_index(["camera", "marker", "frame"])["u_px"] for one in (series, moved)]
    shift = (pixels[0] - pixels[1]).groupby("marker").apply(lambda one: one.abs().max())
    assert all((shift[name] > 1e-6) == (name in host) for name in shift.index)
    with pytest.raises(InputError):
        without_frame_laws(replace(series, points=None), [law])


def test_it_is_set_as_a_formula():
    """With its direction, in words and in LaTeX, and every symbol explained; it turns with the world."""
    law = WrittenLaw((Term("host_place", -3e-6, (Factor("host_acceleration_along", x=0.5),), x=0.5),))
    assert as_text(law).startswith("place where the Host is seen += -3e-06 s^2 * ")
    assert as_text(law).endswith("direction(0.5 rad)")
    assert as_latex(law).count(r"\vec x_{\mathrm{Host}}") == 1 and as_latex(law).endswith(r"\vec e_{\varphi}")
    assert r"\vec e_{\varphi}" in dict(legend(law))
    (turned,) = law.moved(0.3).terms
    assert turned.x == turned.factors[0].x == pytest.approx(0.8)
    (small,) = law.in_units(2.0, 1.0).terms
    assert small.coefficient == pytest.approx(-3e-6)
