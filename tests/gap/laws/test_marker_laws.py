"""Markers that move on their bodies: named, written as a law, taken out; and what only looks like it.

Causes of the plant, whose code shares nothing with the search; kinds in view: no blind result."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest

from analysis.blind.plant.host import HOST_M_PER_S2
from analysis.gap.drive.findings import DriveSteps
from analysis.gap.laws.dictionary.candidate import named_numbers, with_coefficients
from analysis.gap.laws.frames import asked as of_measurement
from analysis.gap.laws.frames.corrected import without_frame_laws
from analysis.gap.laws.frames.law import find_marker_laws
from analysis.gap.measurement.loose_markers import GOES_WITH, with_its_body
from analysis.gap.measurement.rigid_bodies import _moved, loose_markers, rigid_structure
from analysis.gap.measurement.tests import measurement_tests
from ovines.core.laws.formula import as_latex, as_text, legend
from ovines.core.laws.terms import Factor, Term, WrittenLaw
from ovines.core.refusal import ScenarioError
from ovines.errors import InputError
from ovines.law_file import law_text

SURE_90, RUNS = 1.645, 2


@pytest.mark.further
@pytest.mark.parametrize(("size", "seed", "noise"), [(1.0, 4, "white"), (0.4, 7, "warp")])
def test_a_marker_on_a_bent_tab_is_reported_and_written(loaded, tmp_path, size, seed, noise):
    """Its name, what it goes with, how far a unit of that moves it; read back, nothing moves on the Host any more.
    Before, a lens field took all of it."""
    true, series = loaded("unknown_bent_tab", size, seed, noise, RUNS)
    name = f"H{int(true['marker']) + 1}"
    (found,) = rigid_structure(series)
    assert found.goes_with == f"marker {name}, which moves on its body with the Host's acceleration"
    assert (series.cameras[0].field is None) == (noise == "white")
    (law,), _ = find_marker_laws(series, np.random.default_rng(0))
    (term,) = law.law.terms
    assert (term.target, term.x) == ("host_marker", true["marker"]), as_text(law.law)
    assert [one.quantity for one in term.factors] == ["host_acceleration_along"]
    value, sd, unit = law.numbers["coefficient"]
    assert unit == "s^2"
    assert abs(value + true["tab_m"] / HOST_M_PER_S2) < SURE_90 * sd < 0.2 * abs(value)
    assert abs(np.angle(np.exp(1j * (term.y - term.factors[0].x)))) < 0.05  # along the pull
    assert law.closed > 0.8 and law.halves.agree
    path = tmp_path / "law-1.toml"
    path.write_text(law_text(law.law, "tab"))
    assert not rigid_structure(loaded("unknown_bent_tab", size, seed, noise, RUNS, (path,))[1])


@pytest.mark.parametrize("seconds", [(1.0, 1.0, 1.0), (2.4, 0.9, 1.0)])
def test_a_marker_that_slides_is_reported_in_runs_of_any_length(loaded, seconds):
    """It goes farther in a longer run: half by half the three then disagreed by more than chance (found at 1 mm/s in
    none of 2.3, 0.9 and 1.0 s)."""
    _, series = loaded("none", 1.0, 4, "white", RUNS)
    rng, residuals = np.random.default_rng(0), []
    for number, long_s in enumerate(seconds):
        frames = int(800 * long_s)
        world = rng.normal(0.0, 2e-5, (frames, 5, 2))
        world[:, 3] += 1e-3 * np.linspace(0.0, long_s, frames)[:, None] * np.array([0.8, 0.6])
        residuals.append((number, np.zeros(frames), world))
    (found,) = _moved(residuals, series, "nes")
    assert (found.marker, found.with_what) == (3, "within the runs")
    still = [(number, angle, np.delete(world, 3, 1)) for number, angle, world in residuals]
    assert _moved(still, series, "nes") == []


@dataclass(frozen=True)
class Asked:
    """What a ladder of ``measured`` is asked for."""

    measured: object
    structure: tuple
    drive: DriveSteps = field(default_factory=DriveSteps)
    causes: tuple = ()


@pytest.mark.further
def test_without_the_marker_everything_is_asked_again(loaded, monkeypatch):
    """What was reported stays.  Before, the frames that the marker pulled with it were a scatter of the trigger."""
    _, series = loaded("unknown_bent_tab", 1.0, 4, "white", RUNS)
    assert measurement_tests(series).findings["trigger_jitter"].found
    monkeypatch.setattr(of_measurement, "find_frame_laws", lambda series, rng: ((), series))
    monkeypatch.setattr(of_measurement, "find_clock_law", lambda series, rng: (None, series))
    monkeypatch.setattr(of_measurement, "_card_law", lambda now, rng, withheld: now)
    again = []
    monkeypatch.setattr(of_measurement, "run_ladder", lambda one, rng, withheld: again.append(one) or Asked(one, ()))
    before = Asked(series, tuple(rigid_structure(series)))
    (law,), after = of_measurement.measurement_laws(before, np.random.default_rng(0), frozenset())
    assert law.law.terms[0].target == "host_marker"
    assert (after.measured, after.structure) == (series, before.structure)
    assert not rigid_structure(again[0]) and not measurement_tests(again[0]).findings["trigger_jitter"].found


@pytest.mark.further
def test_a_marker_that_slips_is_a_step_on_its_body(loaded):
    true, series = loaded("unknown_slipped_marker", 1.0, 3)
    (loose,) = loose_markers(series)
    (law,), after = find_marker_laws(series, np.random.default_rng(0))
    (term,) = law.law.terms
    assert (term.target, int(term.x)) == ("nes_marker", loose.marker)
    assert term.factors[0].function == "below" and term.factors[0].scale == pytest.approx(0.5, abs=0.01)
    assert abs(term.coefficient) == pytest.approx(np.hypot(*true.values()), rel=0.05)
    assert law.closed > 0.8 and not rigid_structure(after)


def test_a_marker_that_a_spin_throws_outwards_has_a_law(loaded):
    """Of the disk, in its own frame: points and tracks moved by a law, which is found again."""
    _, still = loaded("none", 1.0, 4, "white", RUNS)
    thrown = law_of(Term("nes_marker", -4e-9, (Factor("spin", "power", 2.0),), 1.0, 0.4))
    series = without_frame_laws(still, [thrown])
    (found,) = rigid_structure(series)
    assert found.goes_with == "marker N2, which moves on its body with the disk's spin"
    (law,), after = find_marker_laws(series, np.random.default_rng(0))
    (term,) = law.law.terms
    assert (term.target, term.x, term.y) == ("nes_marker", 1.0, pytest.approx(0.4, abs=0.05)), as_text(law.law)
    assert (term.factors[0].quantity, term.factors[0].order) == ("spin", 2.0)
    assert term.coefficient == pytest.approx(4e-9, rel=0.05) and not rigid_structure(after)
    again = series.triangulate(series.tracks[0], series.cameras, series.recordings[0], (0.0, 0.0))
    assert np.abs(again["x_m"] - series.points[0]["x_m"]).max() < 2e-7


@pytest.mark.others_further
@pytest.mark.parametrize(
    ("kind", "seed", "noise"),
    [
        ("none", 8, "warp"),
        ("none", 8, "ar1"),
        ("unknown_rolling_shutter", 6, "white"),
        ("unknown_zooming_camera", 8, "warp"),
    ],
)
def test_what_moves_all_markers_is_no_loose_one(loaded, kind, seed, noise):
    """Neither a lens, nor rows read one after the other, nor a camera that zooms."""
    _, series = loaded(kind, 1.0, seed, noise, RUNS)
    assert not [one for body in GOES_WITH for one in with_its_body(series, body)]
    assert find_marker_laws(series, np.random.default_rng(0))[0] == ()


def law_of(*terms):
    return WrittenLaw(tuple(terms))


BENT = Term("host_marker", -6e-6, (Factor("host_acceleration_along", x=0.2),), 2.0, 0.3)


def test_a_law_of_a_marker_is_said_with_its_number_and_direction():
    assert as_text(law_of(BENT)) == (
        "place of marker 3 of the Host += -6e-06 s^2 * host_acceleration_along(0.2 rad) * direction(0.3 rad)"
    )
    assert r"\Delta\vec s_{3}" in as_latex(law_of(BENT)) and r"\vec e_{\varphi}" in dict(legend(law_of(BENT)))
    assert BENT.unit == "s^2"
    numbers = named_numbers(law_of(BENT))
    assert numbers["direction_rad"] == (0.3, "rad") and numbers["line_rad"] == (0.2, "rad")
    with pytest.raises(ScenarioError, match="radius in a law of the measurement"):
        law_of(Term("nes_marker", 1.0, (Factor("radius"),)))
    with pytest.raises(ScenarioError, match="spin in a law of the measurement"):
        law_of(Term("picture_u", 1.0, (Factor("spin"),)))
    with pytest.raises(ScenarioError, match=r"marker 0\.5"):
        Term("nes_marker", 1.0, x=0.5)


def test_directions_of_markers_turn_with_their_world():
    """The Host's with the room, the NES' with the disk; units go with lengths and times."""
    (turned,) = law_of(BENT).moved(0.5, (1.0, 2.0)).terms
    assert (turned.x, turned.y, turned.factors[0].x) == pytest.approx((2.0, 0.8, 0.7))
    own = Term("nes_marker", 1e-6, (Factor("spin"),), 1.0, 0.3)
    (kept,) = law_of(own).moved(0.5).terms
    assert (kept.x, kept.y) == (1.0, 0.3)
    (small,) = law_of(own).in_units(0.1, 0.5).terms
    assert (small.coefficient, small.x, small.y) == pytest.approx((1e-6 / 0.1 / 0.5, 1.0, 0.3))


def test_what_stays_back_is_negative_along_its_line():
    """Two columns across each other become one term, whichever quarter they point to."""
    pair = [Term("host_marker", 1.0, (Factor("host_acceleration_along"),), 2.0, y) for y in (0.0, 0.5 * np.pi)]
    for a, b, size, angle in ((-3.0, 0.3, -np.hypot(3, 0.3), -np.arctan(0.1)), (0.0, 2.0, 2.0, 0.5 * np.pi)):
        (term,) = with_coefficients(pair, np.array([a, b]), np.eye(2))
        assert (term.coefficient, term.y) == pytest.approx((size, angle))


def test_a_law_of_a_marker_that_is_not_there_is_refused(loaded):
    _, series = loaded("none", 1.0, 4, "white", RUNS)
    strange = law_of(Term("nes_marker", 1e-6, (Factor("spin"),), 7.0))
    with pytest.raises(InputError, match="marker 8 of the nes"):
        without_frame_laws(series, [strange])
