"""Effects withheld from the library: the formula that each is, and whether a search writes it."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.blind.causes.named import CAUSES
from analysis.blind.scoring.forms import FORMS, form_of, judge_law
from analysis.blind.scoring.withheld import judge_withheld, withheld_figures
from analysis.blind.series import make_series
from analysis.gap.laws.choice.search import find_law
from analysis.gap.laws.dictionary.flights import flight_candidates
from analysis.gap.laws.dictionary.parts import RigScales
from analysis.gap.laws.flight_rows import flight_regression
from analysis.gap.selection.flight_steps import first_flights
from ovines.core import FloorFriction, Harmonic, Host, ImpactLaw, Nes, Scenario, simulate
from ovines.core.laws.terms import Factor, Term, WrittenLaw
from tests.gap.conftest import brought

DRAG = WrittenLaw((Term("along_velocity", -0.6, (Factor("speed"),)),))
TRUTH = {
    "case": "case-001", "effect": "viscous_drag", "effects": ["viscous_drag"], "size": 1.0, "noise": "white",
    "stages": ["flight"], "parameters": {"viscous_drag": {"rate_per_s": 0.61}},
}  # fmt: skip
ENTRY = {"parameters": {"coefficient": {"value": -0.6, "low": -0.62, "high": -0.58}}}


def test_every_form_is_of_a_listed_cause_in_its_stage():
    """As the plant draws them; a law may say them."""
    for name in FORMS:
        assert CAUSES[name].listed, name


def test_the_forms_of_a_tilt_and_a_drag_move_the_disk_like_the_effects():
    """The simulator's own effects against the formulas by which withheld ones are judged."""
    rig = Scenario(
        "rig", Nes(0.01, 0.0246), Host(radius_m=0.05, motion="driven", drive=(Harmonic("x", 0.0164, 11.0, 0.3),)),
        ImpactLaw(0.72, 0.13, 0.49), 0.15, FloorFriction(0.2), (0.03, -0.01, 0.1, 0.0, 0.0, 20.0),
    )  # fmt: skip
    for effect, sizes in (
        ("table_tilt", {"tilt_rad": 0.03, "direction_rad": 0.4}), ("air_drag", {"rate_per_m": 0.45}),
    ):  # fmt: skip
        form = form_of({"effect": effect, "parameters": {effect: sizes}})
        factors = () if form.shape is None else (Factor(form.shape[0][0], form.shape[1], form.shape[2]),)
        term = Term(form.target, form.sizes["coefficient"], factors, form.sizes.get("direction_rad", 0.0))
        listed = simulate(Scenario(**{**vars(rig), "effects": {effect: sizes}})).motion["nes_x_m"]
        written = simulate(Scenario(**{**vars(rig), "laws": (WrittenLaw((term,)),)})).motion["nes_x_m"]
        np.testing.assert_allclose(written, listed, rtol=0, atol=1e-7)
        assert np.abs(simulate(rig).motion["nes_x_m"] - listed).max() > 1e-5


@pytest.mark.parametrize(
    ("law", "entry", "judged"),
    [
        (DRAG, ENTRY, (True, True)),
        (DRAG, {"parameters": {"coefficient": {"value": -0.5, "low": -0.52, "high": -0.48}}}, (True, False)),
        (WrittenLaw((*DRAG.terms, Term("swirl", 1.0))), ENTRY, (False, False)),
        (WrittenLaw((Term("along_sliding", -0.6, (Factor("sliding_speed"),)),)), ENTRY, (False, False)),
        (WrittenLaw((Term("along_velocity", -0.6, (Factor("speed", "power", 2.0),)),)), ENTRY, (False, False)),
    ],
)
def test_a_withheld_law_is_judged_by_form_and_size(law, entry, judged):
    """The one formula, nothing beside it, and the true size within the interval."""
    assert judge_law(TRUTH, (law,), (entry,)) == judged
    row = judge_withheld(TRUTH, {"verdict": "unknown", "stage": "flight", "laws": [entry]}, (law,))
    figures = {one.name: one.value for one in withheld_figures([row])}
    assert figures["the law is the withheld one"] == float(judged[0])
    assert judge_law(TRUTH | {"effect": "trigger_jitter"}, (law,), (entry,)) is None


def test_angles_of_a_withheld_law_are_compared_by_their_period():
    """An ellipse's axis has two ends."""
    truth = {
        "effect": "wall_ellipticity",
        "parameters": {"wall_ellipticity": {"ellipticity": 4e-3, "direction_rad": 3.0}},
    }
    law = WrittenLaw((Term("contact_radius", 1.6e-4, (Factor("azimuth", "cosine", 2.0, x=3.0 - np.pi),)),))
    stated = {"value": 3.0 - np.pi, "low": 2.9 - np.pi, "high": 3.1 - np.pi}
    entry = {
        "parameters": {"coefficient": {"value": 1.6e-4, "low": 1.5e-4, "high": 1.7e-4}, "azimuth_zero_rad": stated}
    }
    assert judge_law(truth, (law,), (entry,)) == (True, True)


def test_a_drag_that_no_library_holds_is_written_as_one(tmp_path):
    """Two runs with a viscous drag, searched without naming any effect."""
    made = make_series("viscous_drag", 0.8, np.random.default_rng(31), runs=2, noise="white")
    series = brought(made, tmp_path / "series")
    flights = flight_regression(first_flights(series, ("floor_friction", "spin_coupling")))
    candidates = flight_candidates(RigScales.of(flights.known, 69.0))
    found, p = find_law(flights.problem, flights.columns, candidates, np.random.default_rng(0))
    assert found is not None and p < 1e-3
    assert form_of(made.truth).is_law(WrittenLaw(found.terms)), [one.name for one in found.parts]
