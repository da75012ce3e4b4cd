"""What somebody changes between two runs, and what goes with the run: forces, walls, pictures, and where a picture's
law is nil.  Causes of the plant's are in view, therefore no blind result."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from analysis.gap.finding import Finding
from analysis.gap.laws.belief import believed
from analysis.gap.laws.dictionary.flights import flight_candidates
from analysis.gap.laws.dictionary.impacts.law import law_candidates
from analysis.gap.laws.dictionary.impacts.walls import wall_candidates
from analysis.gap.laws.dictionary.parts import RigScales
from analysis.gap.laws.found_law import LawFound
from analysis.gap.laws.frames import law as frame_law
from analysis.gap.laws.frames.drifting_clock import drift_of, drifting_clock_law
from analysis.gap.laws.frames.evidence.rows import FrameRows, problem_of
from analysis.gap.laws.frames.forms.by_run import by_run, lone_run, nil_in
from analysis.gap.laws.regression.halves import halves_of
from analysis.motion.rig_frame import RigFrame
from ovines.core.laws import words as W
from ovines.core.laws.kernel import sizes
from ovines.core.laws.targets import PICTURE
from ovines.core.laws.terms import Factor, Term, WrittenLaw, rows_of

RUNS = 12
STEPS = [first - 0.5 for first in range(1, RUNS)]


def steps_of(candidates, target):
    """Steps in the run that a target has, with the number of terms of each."""
    found = {}
    for one in candidates:
        for term in one.terms:
            for factor in term.factors:
                if term.target == target and factor.quantity == "run" and factor.function in ("below", "beyond"):
                    found.setdefault(factor.scale, set()).add(len(one.terms))
    return found


def known_impacts():
    """Three impacts in each of twelve runs."""
    rng = np.random.default_rng(0)
    known = rng.uniform(0.1, 1.0, (3 * RUNS, W.KNOWN_SIZE))
    known[:, W.RUN] = np.repeat(np.arange(RUNS), 3)
    return known


@pytest.mark.parametrize("target", ["fixed_direction", "along_velocity", "outwards", "spin"])
def test_a_force_may_be_another_from_any_run_on(target):
    """Constant and step are one candidate: a step alone explains half of what lies to both sides of the mean."""
    scales = RigScales(0.04, 1.7, 0.06, 0.8, 69.0, 100.0, RUNS)
    constants = [one for one in flight_candidates(scales) if len(one.terms) in (2, 4) and one.name.endswith("on")]
    by_step = steps_of(constants, target)
    both = 4 if target == "fixed_direction" else 2
    assert sorted(step for step, terms in by_step.items() if both in terms) == STEPS


def test_laws_and_walls_may_change_between_any_two_runs():
    """Quantiles of the runs leave steps out."""
    known = known_impacts()
    for target in ("restitution", "wall_friction", "tangential_restitution"):
        assert sorted(steps_of(law_candidates(known), target)) == STEPS
    radius = steps_of(wall_candidates(known), "contact_radius")
    assert all({1, 2} <= radius[step] for step in STEPS)  # its size, and its centre


def test_friction_may_begin_anew_every_few_runs():
    """Evenly more or less with each run, back before the first of them; not asked where it would not begin twice."""
    for runs, every in ((RUNS, [3, 4, 5, 6]), (6, [3, 4]), (4, [])):
        scales = RigScales(0.04, 1.7, 0.06, 0.8, 69.0, 100.0, runs)
        anew = [one.terms[0] for one in flight_candidates(scales) if "begins anew" in one.name]
        assert sorted({t.factors[0].scale for t in anew}) == every and len(anew) == sum(every)
        known = np.zeros((runs, W.KNOWN_SIZE))
        known[:, W.RUN] = np.arange(runs)
        for term in anew:
            assert term.target == "floor_friction"
            given = np.empty((runs, 1))
            sizes(rows_of([term]), known, given)
            steps, (first, length) = np.diff(given[:, 0]), (term.factors[0].x + 0.5, int(term.factors[0].scale))
            back = (np.arange(1, runs) - first) % length == 0
            np.testing.assert_allclose(steps, np.where(back, 1.0 - 1.0 / length, -1.0 / length), atol=1e-12)


def still_rows(shift, runs=6, frames=40, noise=0.01, scatter=0.0):
    """Two markers on the axes of a picture whose camera moves by ``shift`` (4,) of the run's number."""
    rng = np.random.default_rng(1)
    known = np.zeros((runs * frames, W.KNOWN_SIZE))
    known[:, W.RUN] = np.repeat(np.arange(runs), frames)
    known[:, W.SHARE] = np.tile(np.linspace(0.0, 1.0, frames, endpoint=False), runs)
    known[:, W.TIME] = 0.01 * np.tile(np.arange(frames), runs)
    places = np.array([[300.0, 0.0], [0.0, 300.0]])
    motion = np.stack([[[1, 0], [0, 1], [x, y], [-y, x]] for x, y in places])  # markers, PICTURE, axes
    motion = motion.transpose(0, 2, 1).reshape(4, 4)
    moved = np.array([shift(run) for run in range(runs)]) + rng.normal(0.0, 1.0, (runs, 4)) * scatter
    value = (moved[known[:, W.RUN].astype(int)] @ motion.T + rng.normal(0.0, noise, (len(known), 4))).ravel() / noise
    at, column = np.repeat(np.arange(len(known)), 4), np.tile(np.arange(4), len(known))
    units = {(name, 1): motion[column, j] / noise for j, name in enumerate(PICTURE)}
    nuisances = (column[:, None] == np.arange(4)) / noise
    return FrameRows(problem_of(value, nuisances, known, at), known, at, units)


@pytest.mark.parametrize(("moved", "word"), [((0.3, -0.2, 0.0, 0.0), "picture"), ((0.0, 0.0, 0.0, 2e-3), "turn")])
def test_one_run_may_stand_alone(moved, word):
    """No other run predicts it, its own other half does; where all runs scatter, it is one of them."""
    rows = still_rows(lambda run: np.array(moved) * (run == 0))
    problem, candidates = lone_run(rows, 1, 1e-3)
    assert [one.name.split(",")[0] for one in candidates] == [word]
    assert {factor.scale for term in candidates[0].terms for factor in term.factors} == {0.5}
    assert len(np.unique(problem.run)) == 12
    assert halves_of(problem, rows.columns(candidates[0].terms).sum(1)) is not None
    scattered = still_rows(lambda run: np.array(moved) * (run == 0), scatter=np.array([0.1, 0.1, 0.0, 1e-3]))
    assert lone_run(scattered, 1, 1e-3) is None
    assert lone_run(still_rows(lambda run: np.array(moved) * (run == 0), runs=3), 1, 1e-3) is None


def test_what_settles_within_a_run_is_a_step():
    """An exponential of a tenth of a run would pass for one."""
    one = next(
        one for one in by_run("zoom", lambda *f: (Term("picture_zoom", 1.0, f),), known_impacts()) if one.numbers
    )
    assert one.at([0.01]).terms[0].factors[0].scale > 0.5


def test_a_pictures_law_is_nil_where_it_is_asked_to_be():
    """Every form of it is the same but for a constant."""
    number = np.arange(6.0)
    value = {
        "power": lambda f: number - f.x, "below": lambda f: number < f.scale, "beyond": lambda f: number >= f.scale,
        "sign": lambda f: np.sign(number - f.x),
    }  # fmt: skip
    for factor in (Factor("run"), Factor("run", "below", 1.0, 1.5), Factor("run", "beyond", 1.0, 1.5)):
        term = Term("picture_u", 0.7, (factor,), 1.0)
        given = 0.7 * value[factor.function](factor)
        for run, way in ((0, lambda s: s[0]), (5, lambda s: s[-1]), (2.5, lambda s: s[0] + s[-1])):
            (other,) = nil_in([term], run, 5)
            again = other.coefficient * value[other.factors[0].function](other.factors[0])
            np.testing.assert_allclose(again - again[0], given - given[0], atol=1e-12)
            assert way(again) == pytest.approx(0.0)
    settling = Term("picture_u", 0.7, (Factor("run", "exponential", 1.0, 2.0),), 1.0)
    assert nil_in([settling], 5, 5) == (settling,) and nil_in([settling], 0, 5) is None
    assert nil_in([replace(settling, factors=(Factor("time"),))], 5, 5) is None


def test_a_law_is_nil_in_the_run_that_leaves_no_window(monkeypatch):
    """A camera knocked before the third of five runs: still markers say the same of either side."""
    written = WrittenLaw((Term("picture_u", -0.7, (Factor("run", "below", 1.0, 1.5),), 1.0, 0.0, 0.01),))
    none = np.zeros(5)
    numbers = {"coefficient": (-0.7, 0.01, "px"), "run_scale": (1.5, 0.0, "1")}
    whole = LawFound(written, written, numbers, 0.0, none, none, none, ())
    series = SimpleNamespace(runs=[None] * 5, frame=RigFrame(np.zeros(2), 0.0, (0.0,) * 5))

    def window(_, laws):
        size = 0.0 if laws[0].law.terms[0].factors[0].function == "beyond" else 0.7
        return Finding("sensor_window_offset", {}, 9.0, size, size > 0.0)

    monkeypatch.setattr(frame_law, "_window", window)
    (law,) = frame_law._nil_somewhere([whole], series)
    assert law.law.terms == (Term("picture_u", 0.7, (Factor("run", "beyond", 1.0, 1.5),), 1.0, 0.0, 0.01),)
    assert law.numbers == {"coefficient": (0.7, 0.01, "px"), "run_scale": (1.5, 0.0, "1")}
    # Where there is no window, nothing is asked.
    monkeypatch.setattr(frame_law, "_window", lambda *_: None)
    assert frame_law._nil_somewhere([whole], series) == [whole]


def test_a_drive_whose_frequency_goes_with_the_run_is_a_clocks_law():
    """About the middle run, for what is alike in all is the frame rate's; with time and run as the law has them the
    drive is the asked one in every run."""
    rng, number = np.random.default_rng(2), np.arange(8.0)
    share = 1e-3 + 4e-4 * (number - 3.5) + 1e-5 * rng.normal(size=8)
    asked, period_s = SimpleNamespace(frequency_hz=11.0), 0.8
    run_s = np.linspace(0.0, period_s, 50)
    runs = [
        SimpleNamespace(data=SimpleNamespace(
            time_s=run_s, host=SimpleNamespace(frequency_hz=11.0 * (1 + one), omega_rad_per_s=69.0 * (1 + one))))
        for one in share
    ]  # fmt: skip
    series = SimpleNamespace(
        runs=runs, recordings=[SimpleNamespace(excitation=asked)] * 8, frame=RigFrame(np.zeros(2), 0.0, (0.0,) * 8)
    )
    steady = SimpleNamespace(paths=[SimpleNamespace(run=run, tells_lines=True) for run in range(8)])
    law, structure = drifting_clock_law(series, steady)
    (term,) = law.law.terms
    assert (term.target, [factor.quantity for factor in term.factors]) == ("clock_delay", ["time", "run"])
    assert term.factors[1].x == 3.5 and abs(term.coefficient - 4e-4) < 3 * term.sd
    assert law.closed > 0.95 and law.halves.agree and law.halves.both_show_it and believed(law, 1.0, 0.0) is law
    assert structure.stage == "measurement" and "shaker" in structure.goes_with
    np.testing.assert_allclose((law.evidence.before - law.evidence.after) / period_s, 4e-4 * (number - 3.5), atol=5e-5)
    # A sweep or a random drive has no one frequency, and there is none where nothing was asked.
    sweeping = SimpleNamespace(paths=[SimpleNamespace(run=run, tells_lines=False) for run in range(8)])
    assert drifting_clock_law(series, sweeping) is None
    series.recordings = [SimpleNamespace(excitation=None)] * 8
    assert drifting_clock_law(series, steady) is None


def test_frequencies_in_no_order_are_no_drift():
    """As large as they may be; and what is surely there may be negligible."""
    rng = np.random.default_rng(3)
    for runs in (4, 6, 12):
        assert not any(drift_of(np.arange(runs), 2e-3 * rng.normal(size=runs)) for _ in range(300))
    number = np.arange(12.0)
    assert drift_of(number, 1e-5 * number + 1e-9 * rng.normal(size=12)) is None
    assert drift_of(number, 1e-3 * number + 1e-5 * rng.normal(size=12)) is not None
