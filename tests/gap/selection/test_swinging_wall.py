"""Recoil or ringing: the contact distances know whether the wall swings with the markers; and which recording would
tell most."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analysis.blind.recording.files import write_run, write_series
from analysis.blind.series import Wish, further_run, outline_series, run_outline
from analysis.gap.drive.pushes import pushes_of
from analysis.gap.drive.swinging_wall import Contacts, borne_out, wall_swings
from analysis.gap.drive.swings import best_swing
from analysis.gap.ladder import run_ladder
from analysis.gap.next_test.choice import next_tests
from analysis.gap.selection.flight_steps import first_flights
from ovines.pipeline.blind.closed_loop import WISHES
from ovines.pipeline.series.diagnosis import load_series
from ovines.recording import read_series
from tests.gap.test_next_test import LOUD, SOFT

FLOOR = ("floor_friction", "spin_coupling")


def made(folder, kind, size, seed, further=()):
    """The outline of a series of one run of the plant, written to a folder with ``further`` runs as wished."""
    rng = np.random.default_rng(seed)
    outline = outline_series(kind, size, rng, 1, "white")
    write_series(run_outline(outline, rng), folder)
    for number, wish in enumerate(further, 2):
        write_run(folder, number, *further_run(outline, wish, rng))
    return outline


def brought(folder):
    return load_series(read_series(folder), folder.parent / "results")[0]


@pytest.mark.others_further
@pytest.mark.parametrize(("kind", "seed"), [("host_ringing", 1), ("host_recoil", 4)])
def test_the_wall_swings_with_a_host_that_recoils_and_not_with_markers_that_ring(tmp_path, kind, seed):
    made(tmp_path / "series", kind, 0.6, seed, [Wish()])
    series = brought(tmp_path / "series")
    ladder = run_ladder(series, np.random.default_rng(0))
    (cause,) = ladder.drive.causes
    assert cause.effect == kind and not cause.rivals
    steps = ladder.drive
    contacts = Contacts.of(first_flights(series, FLOOR).fits)
    (swing,) = steps.swings
    fall = wall_swings(swing, steps.paths, steps.pushes, contacts)
    assert (fall.sum() > 20) if kind == "host_recoil" else (fall.sum() < -20)
    assert (borne_out(swing, steps.paths, steps.pushes, contacts) == (fall if kind == "host_recoil" else 0)).all()


def test_too_few_contacts_say_nothing_of_the_wall(tmp_path):
    made(tmp_path / "series", "host_recoil", 0.3, 4)
    series = brought(tmp_path / "series")
    fits = first_flights(series, FLOOR).fits
    contacts, ladder = Contacts.of(fits), run_ladder(series, np.random.default_rng(0))
    (swing,) = ladder.drive.swings
    few = contacts.at(np.arange(len(contacts.run)) < contacts.columns.shape[1] + 3)
    assert (wall_swings(swing, ladder.drive.paths, ladder.drive.pushes, few) == 0).all()
    never_met = [replace(fit, flights=fit.flights[:1], states=fit.states[:1]) for fit in fits]
    none = Contacts.of(never_met)
    assert (wall_swings(swing, ladder.drive.paths, ladder.drive.pushes, none) == 0).all()


@pytest.mark.further
def test_a_host_at_rest_is_followed_after_blows_too(tmp_path):
    launch = Wish(launch=(2.0, 100.0))
    made(tmp_path / "series", "host_recoil", 1.0, 4, [launch, launch, launch])
    ladder = run_ladder(brought(tmp_path / "series"), np.random.default_rng(0))
    assert [path.drive_hz > 0 for path in ladder.drive.paths] == [True, False, False, False]
    (swing,) = ladder.drive.swings
    assert swing.effect == "host_recoil" and (swing.held_out > 0).all()


def said_for_a_ringing(folder) -> tuple[float, float]:
    """By how much -2 log L of paths and wall of a series is smaller for a ringing than for a recoil, in all runs but
    the first, and how long these are together (s)."""
    series = brought(folder)
    paths = [path for path in run_ladder(series, np.random.default_rng(0)).drive.paths if path.run > 0]
    fits = first_flights(series, FLOOR).fits
    contacts, pushes, left = Contacts.of(fits), pushes_of(fits), [path.place for path in paths]
    ringing, recoil = (best_swing(effect, paths, pushes, left) for effect in ("host_ringing", "host_recoil"))
    said = ringing.gain - recoil.gain - float(borne_out(recoil, paths, pushes, contacts).sum())
    return said, float(sum(np.ptp(path.time_s) for path in paths))


@pytest.mark.further
def test_further_recordings_keep_what_the_next_test_of_a_swing_promises(tmp_path):
    made(tmp_path / "series", "host_ringing", 0.2, 62)
    ladder = run_ladder(brought(tmp_path / "series"), np.random.default_rng(0))
    tests = next_tests(ladder, [replace(one, rivals=("host_recoil",)) for one in ladder.causes])
    assert tests is not None and tests.settings[0].setting == LOUD
    for words in (LOUD, SOFT):
        folder = tmp_path / words.replace(" ", "-")
        made(folder, "host_ringing", 0.2, 62, [WISHES[words]] * 6)
        said, duration_s = said_for_a_ringing(folder)
        (promised,) = (one.sd for one in tests.settings if one.setting == words)
        promised *= np.sqrt(duration_s / tests.duration_s)  # of all together
        # What so many standard deviations fall by scatters by twice as many.
        assert abs(said - promised**2) < 2.5 * 2 * promised


@pytest.mark.further
def test_a_swing_that_is_settled_needs_no_next_test(tmp_path):
    made(tmp_path / "series", "host_ringing", 0.6, 1, [Wish()])
    ladder = run_ladder(brought(tmp_path / "series"), np.random.default_rng(0))
    assert [one.effect for one in ladder.causes] == ["host_ringing"] and next_tests(ladder, ladder.causes) is None
