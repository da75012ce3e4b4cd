"""The plant's own law of an unlisted cause: what it adds along flights and to blows, and what of the rows it closes."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from analysis.blind.causes.named import CAUSES, draft_series, without_cause
from analysis.blind.plant.dynamics import remembered_at
from analysis.blind.recording.files import write_series
from analysis.blind.recording.place import HOME, Place
from analysis.blind.scoring.plants_law import blow_changes, physics_without, pushes
from analysis.blind.series import outline_series, run_outline
from ovines.core.laws.terms import Factor, Term, WrittenLaw
from ovines.law_file import law_text
from ovines.pipeline.blind.law_oracle import ASKED, law_figure, shares_of_case, unlisted_asked

ELSEWHERE = Place(scale=2.5, turned_rad=1.1, rig_at_m=(-0.4, 1.2), start_s=(3.0, 8.0), first_frame=(50, 4000))


def remembered(kind, place=HOME, size=0.8):
    """An outlined series of one run with its motion, and the run's numbers without its unlisted cause."""
    outline = outline_series(kind, size, np.random.default_rng(3), 1, "white", place=place)
    (motion,) = run_outline(outline, np.random.default_rng(4), remembered=True).motions
    (cause,) = unlisted_asked(outline)
    return outline, motion, physics_without(outline.draft, cause, 0, 1, motion)


def test_a_run_that_is_remembered_is_the_same():
    outline = outline_series("unknown_scuffed_rim", 0.8, np.random.default_rng(3), 1, "warp")
    plain, whole = (run_outline(outline, np.random.default_rng(4), remembered=one) for one in (False, True))
    assert not plain.motions and len(whole.motions) == 1
    assert all(np.array_equal(plain.states[name], whole.states[name]) for name in plain.states)
    assert all(one.equals(other) for (_, one), (_, other) in zip(plain.recordings, whole.recordings, strict=True))


@pytest.mark.parametrize("place", [Place(), ELSEWHERE])
def test_what_a_central_force_adds_along_a_flight(place):
    outline, motion, without = remembered("unknown_central", place)
    (rate_per_s2,) = outline.draft.parameters["unknown_central"].values()
    time_s = np.linspace(0.05, 0.35, 40)
    states = remembered_at(motion, time_s)
    host = np.array([np.sin(time_s * row[2] + row[3]) * row[1] for row in motion.lines if row[0] == 0]).sum(0)
    aside = np.array([np.sin(time_s * row[2] + row[3]) * row[1] for row in motion.lines if row[0] == 1]).sum(0)
    off = np.column_stack([states[:, 0] - host, states[:, 1] - aside])
    c, s = np.cos(place.turned_rad), np.sin(place.turned_rad)
    expected = -rate_per_s2 * off @ np.array([[c, s], [-s, c]])
    added = pushes(motion, without, time_s * place.slower, place)
    assert np.allclose(added[:, :2], expected, atol=1e-9, rtol=1e-6)
    assert np.allclose(added[:, 2], 0.0, atol=1e-9)
    assert not pushes(motion, without, np.array([-1.0, 1e3]), place).any()  # nobody knows what it did there


@pytest.mark.parametrize("place", [Place(), ELSEWHERE])
def test_what_a_scuffed_rim_takes_of_blows(place):
    """It follows the slip of the last blow, at none at first, and nothing of friction beside a blow as hard."""
    outline, motion, without = remembered("unknown_scuffed_rim", place)
    changes, lost = blow_changes(motion, without, place), outline.draft.parameters["unknown_scuffed_rim"]
    slips = np.abs(motion.impacts[:, 2])
    expected = [0.0, *(-lost["scuffed_s_per_m"] * before for before, _ in pairwise(slips))]
    assert len(changes.restitution) > 5 and np.ptp(expected) > 0.05
    assert np.allclose(changes.restitution, expected, atol=1e-6, rtol=1e-6)
    assert np.allclose(changes.along_m_per_s, 0.0, atol=1e-4 * place.slower, rtol=0)
    assert np.allclose(changes.reach_m, 0.0, atol=1e-12, rtol=0)
    assert np.allclose(changes.time_s, motion.impacts[:, 0] * place.slower, atol=1e-12, rtol=0)


def test_what_a_bared_rim_does_along_the_wall():
    """Friction alone: the impulse of blows that slide by it, no rebound, and as much of the spin as the impulse."""
    _, motion, without = remembered("unknown_bared_rim")
    changes = blow_changes(motion, without, Place())
    assert np.allclose(changes.restitution, 0.0, atol=1e-9, rtol=0)
    assert np.allclose(changes.turned_m_per_s, 0.0, atol=1e-9, rtol=0)
    assert np.max(np.abs(changes.along_m_per_s)) > 0.05
    assert changes.along_m_per_s[0] == pytest.approx(0.0, abs=1e-12)  # nothing was struck before


def test_what_a_flattened_rim_does_to_the_walls_reach():
    outline, motion, without = remembered("unknown_flattened_rim")
    changes = blow_changes(motion, without, Place())
    most_m = outline.draft.parameters["unknown_flattened_rim"]["flattened_m"]
    assert changes.reach_m[0] == pytest.approx(0.0, abs=1e-9)
    assert np.all(changes.reach_m > -1e-6) and 0.1 * most_m < changes.reach_m.max() <= 1.01 * most_m


def test_every_cause_that_is_asked_for_can_be_taken_out():
    names = [name for name, one in CAUSES.items() if not one.listed and one.stage in ASKED]
    plain, refused = draft_series("none", 1.0, np.random.default_rng(1), 4), []
    for name in names:
        draft = draft_series(name, 0.7, np.random.default_rng(1), 4)
        try:
            left = without_cause(draft, name, 4)
        except ValueError:
            refused.append(name)
            continue
        assert left.plant == plain.plant and not left.run_numbers, name
        assert left.run_friction is None and left.run_restitution is None, name
    assert not refused


def test_what_changes_ordinary_physics_cannot_be_taken_out():
    draft = draft_series("speed_dependent_restitution", 1.0, np.random.default_rng(0), 2)
    with pytest.raises(ValueError, match="ordinary physics"):
        without_cause(draft, "speed_dependent_restitution", 2)


def held_against_the_plants(law, outline, folder):
    """What a written law of a series, made in ``folder`` as a trial's first case, closes of what the plant's does."""
    seed, answers = [7, 1, 1], folder / "answers" / "case-001"
    write_series(run_outline(outline, np.random.default_rng(seed)), folder / "cases" / "case-001")
    answers.mkdir(parents=True)
    (answers / "law-1.toml").write_text(law_text(law, "a law"))
    (share,) = shares_of_case(folder, outline, seed)
    return share


@pytest.mark.long
def test_a_law_written_as_the_plant_has_it_closes_what_the_oracle_closes(tmp_path):
    """Where lenses leave something in the frames, too; without a law nothing is closed."""
    place = replace(ELSEWHERE, start_s=(3.0, 8.0, 9.5), first_frame=(50, 4000, 7))
    outline = outline_series("unknown_central", 0.8, np.random.default_rng(3), 3, "warp", "case-001", place=place)
    rates = outline.draft.parameters["unknown_central"].values()
    (rate_per_s2,) = (place.in_units("_per_s2", one) for one in rates)
    law = WrittenLaw((Term("outwards", -rate_per_s2, (Factor("radius"),)),))
    share = held_against_the_plants(law, outline, tmp_path)
    assert share.law == pytest.approx(1.0, abs=0.02)
    assert share.size == pytest.approx(1.0, abs=0.05)
    assert share.before > 2 * share.oracle
    nothing = replace(share, law=0.0)
    figure = law_figure([share, nothing])
    assert (figure.value, figure.n) == (0.5, 2)


@pytest.mark.further
def test_a_law_of_the_walls_friction_is_held_against_the_impacts_that_stick_beside_it(tmp_path):
    """Where friction is less, impacts slide that would stick by the nominal law: by the nominal law's sides the true
    formula closed 0.58."""
    outline = outline_series("unknown_smeared_wall", 0.4, np.random.default_rng(4), 4, "white", "case-001")
    lost = outline.draft.plant["wall_friction"] * outline.draft.parameters["unknown_smeared_wall"]["smeared_s_per_m"]
    law = WrittenLaw((Term("wall_friction", -lost, (Factor("approach"),)),))
    share = held_against_the_plants(law, outline, tmp_path)
    assert share.law == pytest.approx(1.0, abs=0.01)
    assert share.size == pytest.approx(1.0, abs=0.05)
    assert share.before > 1.5 * share.oracle


def test_only_unlisted_causes_of_flights_impacts_and_wall_are_asked_for():
    several = outline_series("air_drag+unknown_scuffed_rim", 0.8, np.random.default_rng(0), 1, "white")
    assert unlisted_asked(several) == ["unknown_scuffed_rim"]
    seen = outline_series("unknown_lifting_card", 0.8, np.random.default_rng(0), 1, "white")
    assert unlisted_asked(seen) == []
    assert law_figure([]).value is None
