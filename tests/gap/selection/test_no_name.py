"""Causes that no effect of the library has: each is located, described, and never given another's name."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from analysis.blind.series import make_series
from analysis.gap.diagnose import verdict_of
from analysis.gap.ladder import run_ladder, stated_effects
from analysis.gap.laws.flight_sizes import holding
from analysis.gap.page.evidence import evidence_section
from analysis.gap.selection.flight_steps import select_flight_effects
from analysis.gap.selection.flights.missing_acceleration import COMPONENTS
from analysis.gap.selection.flights.terms import EFFECT_TERMS
from analysis.gap.selection.left_in_flights import _best_pair
from analysis.report.page import Page
from analysis.statistics.gain import regress
from ovines.core.laws.terms import Factor, Term
from tests.gap.conftest import brought

#: kinds of one series, size, noise, runs -> stage of each kind, a word of what it goes with
CASES = [
    ("unknown_slipped_marker+unknown_swirl", 0.35, "warp", 2, ("measurement", "flight"), ("marker N3", "swirl")),
    ("unknown_rolling_shutter", 0.35, "ar1", 2, ("measurement",), ("velocity",)),
    ("unknown_handed_wall_friction", 0.35, "ar1", 6, ("impact",), ("direction of slip",)),
]
MORE = [
    ("unknown_wall_pull", 1.0, "white", 12, ("flight",), ("pull",)),
    ("unknown_weakening_friction", 1.0, "ar1", 12, ("flight",), ("sliding speed",)),
    ("unknown_rail_drag", 0.35, "ar1", 6, ("flight",), ("",)),
    ("unknown_swaying_floor", 1.0, "white", 12, ("flight",), ("",)),
    ("unknown_ridge", 1.0, "white", 12, ("flight",), ("",)),
    ("unknown_restless_restitution", 1.0, "ar1", 12, ("impact",), ("",)),
    ("unknown_slip_restitution", 0.35, "warp", 6, ("impact",), ("slip speed",)),
    ("unknown_rolling_loss", 1.0, "warp", 12, ("impact",), ("spin",)),
    ("unknown_camera_creep", 0.35, "white", 6, ("measurement",), ("ground",)),
]
#: figures of the evidence for what is left in a stage
FIGURES = {"measurement": "gap-rigid", "flight": "gap-flights", "impact": "gap-impacts"}


def ladder_of(folder, kind, size, noise, runs):
    """What a diagnosis finds: all that verdict and evidence are made of."""
    series = brought(make_series(kind, size, np.random.default_rng(51), runs=runs, noise=noise), folder)
    return run_ladder(series, np.random.default_rng(0))


@pytest.mark.others_further
@pytest.mark.parametrize(
    ("kind", "size", "noise", "runs", "stages", "words"),
    [*CASES, *(pytest.param(*c, marks=pytest.mark.long) for c in MORE)],
)
def test_a_cause_without_a_name_is_unknown_in_its_stage(tmp_path, unpainted, kind, size, noise, runs, stages, words):
    """Two of different stages are both answered.  Probes and floors were made with these kinds in view: a check against
    falling back, not a blind result.
    """
    ladder = ladder_of(tmp_path / "series", kind, size, noise, runs)
    left = [one.entry() for one in ladder.structure]
    assert (verdict_of(ladder), ladder.causes) == ("unknown", ())
    assert max(ladder.structure, key=lambda one: one.strength).stage == left[0]["stage"] in stages
    page = Page("a series", "what is left")
    evidence_section(page, SimpleNamespace(summary={"verdict": "unknown", "left": left}, ladder=ladder))
    (evidence,) = page.sections
    for stage, word in zip(stages, words, strict=True):
        first = next(one for one in left if one["stage"] == stage)
        assert word in first["goes_with"]
        expected = "gap-ground" if word == "ground" else FIGURES[stage]
        assert any(name.startswith(expected) for name in evidence.figures)


def test_a_drag_that_pushes_is_left_and_no_drag(loaded):
    """Flights whose model holds a drag that the disk does not feel are driven by what grows with the speed: as surely
    as a drag would get its name, that is left, and no drag is there."""
    _, series = loaded("none", 1.0, 41)
    held = replace(series, runs=holding(series.runs, [Term("along_velocity", -0.2, (Factor("speed"),))]))
    steps, driven = (
        select_flight_effects(one, stated_effects(one), frozenset(), False, np.random.default_rng(0))
        for one in (series, held)
    )
    assert (steps.causes, steps.structure) == ((), ())
    (drag,) = (one for one in EFFECT_TERMS if one.name == "viscous_drag")
    assert driven.causes == () and [one.goes_with for one in driven.structure] == [drag.driving.name]
    assert drag.driving.columns == drag.columns and not drag.driving.named
    (left,) = (one for one in driven.left if one.term == drag)
    assert left.pushes and left.estimate[0] == pytest.approx(-0.2, abs=0.02)


def test_a_part_of_the_impacts_that_follows_another_law_is_seen():
    """A tenth of the residuals far off, all of one sense: neither an outlier each, nor noise of all."""
    rng = np.random.default_rng(1)
    sense = np.where(np.arange(100) < 15, -1.0, 1.0)
    y = np.where(sense < 0, 1.2, 0.0) + 0.01 * rng.standard_normal(100)
    sd = np.full(100, 0.01)
    gain, estimate, error, size, significance = regress(np.column_stack([np.ones(100), sense]), y, sd)
    assert gain > 15 * 24 and significance > 100
    assert estimate[0] == pytest.approx(-0.6, abs=5 * error[0]) and size == pytest.approx(0.6 * np.std(sense), rel=0.02)
    gain, _, _, _, significance = regress(np.column_stack([np.ones(100), rng.standard_normal(100)]), y, sd)
    assert gain < 15 and significance < 4


def pieces_of(rng: np.random.Generator, bump_m_per_s2: float = 0.0) -> pd.DataFrame:
    """Missing accelerations of 8 runs of 10 flights, a piece each 50 ms, in noise of 0.1 m/s^2: a push along x in one
    sixth of each run.
    """
    runs, flights, each = 8, 10, 3
    n = runs * flights * each
    time = np.tile((np.arange(flights * each) + 0.5) / (flights * each), runs)
    table = {name: 0.1 * rng.standard_normal(n) for name in COMPONENTS}
    table["x"] = table["x"] + bump_m_per_s2 * ((time > 0.4) & (time < 0.57))
    return pd.DataFrame(
        table
        | {
            "time in the run": time,
            "radius": rng.uniform(0, 40, n),
            "drive phase": rng.uniform(-180, 180, n),
            "run": np.repeat(np.arange(runs), flights * each),
            "number": np.repeat(np.arange(runs * flights), each),
            "weight": np.ones(n),
        }
    )


def test_a_push_at_one_time_of_each_run_is_found_by_the_time():
    gain, p, size, component, covariate = _best_pair(pieces_of(np.random.default_rng(4), 0.3), np.random.default_rng(5))
    assert (component, covariate) == ("x", "time in the run")
    assert p < 1e-4 and gain > 50
    # RMS over the run of a push that lasts a sixth of it, spread over the bins that it touches.
    assert 0.05 < size < 0.3 * np.sqrt(0.17)


def test_a_covariate_that_no_piece_knows_is_left_out():
    pieces = pieces_of(np.random.default_rng(4), 0.3)
    with_unknown = pieces.assign(**{"flight's place": np.nan})
    asked = [_best_pair(one, np.random.default_rng(5)) for one in (pieces, with_unknown)]
    assert asked[0] == asked[1]


@pytest.mark.further
def test_noise_alone_has_no_covariate():
    """Of forty series without anything left, p is below a tenth in about four."""
    found = [_best_pair(pieces_of(np.random.default_rng(s)), np.random.default_rng(s))[1] for s in range(40)]
    assert 0 <= np.sum(np.array(found) < 0.1) <= 10
    assert min(found) > 1e-3
