"""What the seventh sealed trial's causes asked for: the disk against its own way, marks around the floor's middle, a
ring of two halves, markers that glint.  In view, therefore no blind result."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from analysis.gap.drive import steps, terms
from analysis.gap.laws.flight_law import find_flight_law
from analysis.gap.laws.frames.corrected import without_frame_laws
from analysis.gap.laws.frames.law import find_frame_laws
from analysis.gap.laws.impact_law import find_wall_law
from analysis.gap.measurement.turning_picture import GOES_WITH, turning_picture
from analysis.gap.measurement.two_views import two_views
from analysis.gap.selection.flight_steps import first_flights, select_flight_effects
from analysis.gap.selection.impacts.fit import fit_impacts
from analysis.gap.thresholds import DISTANCE_NEGLIGIBLE
from ovines.core.laws.formula import as_text
from tests.gap.conftest import laws_and_ladder
from tests.gap.laws.test_memory_laws import EFFECTS, made_series, quantities


def flight_law(series):
    """The law of a series' flights, beside nothing that was named."""
    rng = np.random.default_rng(0)
    named = select_flight_effects(series, EFFECTS, frozenset(), False, rng)
    return find_flight_law(series.runs, named, series.frame, rng)[0]


@pytest.mark.further
def test_a_sticker_that_stands_up_like_a_fin_trails(tmp_path):
    """A torque by the angle between the disk and its way, and its speed's square."""
    series, true = made_series(tmp_path, "unknown_weathervane", 1.0, 61, runs=2)
    law = flight_law(series)
    assert quantities(law) == [("spin", ["heading", "speed"])], as_text(law.law)
    (term,) = law.law.terms
    assert term.factors[0].order == 2.0
    assert abs(term.coefficient) == pytest.approx(true["vane_rad_per_s2"], rel=0.15)
    assert law.closed > 0.9


@pytest.mark.further
def test_marks_around_the_floors_middle_hold_what_slides_across_them(tmp_path):
    series, true = made_series(tmp_path, "unknown_concentric_marks", 1.0, 64, runs=2)
    law = flight_law(series)
    assert law.law.terms[0].target == "polar_floor_friction", as_text(law.law)
    # In the middle they have no direction, and hold less.
    assert 0.6 * true["rings"] < law.law.terms[0].coefficient < 1.1 * true["rings"]
    assert law.closed > 0.9


def test_a_ring_of_two_halves_has_two_steps(tmp_path):
    series, _ = made_series(tmp_path, "unknown_split_ring", 1.0, 63, runs=2)
    fits, least_m = first_flights(series, EFFECTS).fits, DISTANCE_NEGLIGIBLE * series.contact_radius_m
    law = find_wall_law(fit_impacts(fits), fits, series.frame, least_m, np.random.default_rng(0))
    assert law is not None
    (factor,) = law.law.terms[0].factors
    assert (factor.quantity, factor.function, factor.order) == ("azimuth", "sawtooth", 2.0), as_text(law.law)
    assert law.closed > 0.8


@pytest.mark.further
@pytest.mark.parametrize(
    ("kind", "severity", "seed", "glints"), [("unknown_glinting_stickers", 0.4, 64, True), ("none", 1.0, 4, False)]
)
def test_markers_that_glint_as_the_disk_turns_are_found(loaded, kind, severity, seed, glints):
    """The two views miss each other by a cosine of its angle; nothing else of a rig does."""
    _, series = loaded(kind, severity, seed, runs=2)
    assert [one.goes_with for one in turning_picture(series)] == ([GOES_WITH] if glints else [])


@pytest.mark.further
def test_stickers_that_glint_in_one_view_have_their_law(loaded):
    """In the camera whose picture of the disk goes with its angle: the other's would lead its path astray."""
    true, series = loaded("unknown_glinting_stickers", 0.4, 64, runs=2)
    (law,), ladder = laws_and_ladder(series)
    assert [(one.target, one.x) for one in law.law.terms] == [("nes_picture_u", 1.0), ("nes_picture_v", 1.0)]
    assert {factor.quantity for one in law.law.terms for factor in one.factors} == {"angle"}
    size_px = np.hypot(*(one.coefficient for one in law.law.terms))
    assert abs(size_px - true["glint_px"]) < 0.02 * true["glint_px"]
    assert law.closed > 0.95 and law.halves.agree
    assert ladder.causes == () and [one.stage for one in ladder.structure] == ["measurement"]
    again = turning_picture(without_frame_laws(series, [law.law]))
    assert again == []
    # A constant of the view is the window's: what bins share is not shown, how they differ lies on the law.
    shown = law.evidence
    assert shown.before_sd.max() < 0.02
    assert np.all(np.abs(shown.before - shown.law) < 4 * shown.before_sd)
    assert np.all(np.abs(shown.after) < 4 * shown.after_sd)


@pytest.mark.further
def test_what_goes_round_the_wall_has_its_rate(loaded):
    """A shim that wanders behind the ring: no restitution by direction, which it had passed for."""
    true, series = loaded("unknown_wandering_shim", 1.0, 72)
    (law,), ladder = laws_and_ladder(series)
    first = law.law.terms[0]
    assert first.target == "restitution" and [one.quantity for one in first.factors] == ["turning_azimuth"]
    assert first.factors[0].y == pytest.approx(true["shim_rad_per_s"], abs=0.6)
    assert law.closed > 0.9 and law.halves.agree
    assert ladder.causes == ()


@pytest.mark.further
def test_a_window_that_the_learnt_lens_leaves_open_is_none(loaded):
    """A camera that the drive twists bends the field that the runs teach; its law follows the Host's acceleration."""
    _, series = loaded("unknown_twisted_camera", 1.0, 65, runs=2)
    assert series.cameras[0].field is not None
    (window,) = (one for one in two_views(series, []).findings if one.effect == "sensor_window_offset")
    size_px = np.hypot(window.parameters["u_px"][0], window.parameters["v_px"][0])
    assert size_px > 0.05 and not window.found
    laws, _ = find_frame_laws(series, np.random.default_rng(0))
    assert [(law.law.terms[0].target, law.law.terms[0].factors[0].quantity) for law in laws] == [
        ("picture_turn", "host_acceleration_along")
    ]


@pytest.mark.further
def test_what_rings_on_for_ever_is_no_answer_to_a_blow(loaded, monkeypatch):
    """However much of the Host's path it explains: the drive swings as it likes."""
    _, series = loaded("none", 1.0, 4, runs=2)
    fits, best = first_flights(series, EFFECTS).fits, terms.best_swing

    def ringing(effect, *arguments, damping):
        held_out = np.full(len(series.runs), 1e5)
        return replace(best(effect, *arguments), share=0.1, damping=damping, gain=1e6, held_out=held_out)

    for damping, swings in ((1e-8, 0), (0.05, 2)):
        monkeypatch.setattr(terms, "best_swing", partial(ringing, damping=damping))
        found, _ = steps.drive_steps(series, fits, frozenset(), False)
        assert len(found.swings) == swings
