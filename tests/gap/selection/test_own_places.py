"""A wall that lies elsewhere in each run, in no order: with where it lay; nothing of walls that creep or stay."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from analysis.gap.cause import EACH_RUN, Structure
from analysis.gap.diagnose import _left
from analysis.gap.page.evidence import _each_run
from analysis.gap.selection.impacts.own_places import own_places
from analysis.motion.rig_frame import RigFrame
from analysis.report.page import Page

NOISE_M, EACH = 8e-6, 20


def wall_of(places_m, seed=0):
    """Contact distances of a wall that lay at ``places_m`` (R, 2) in its runs, one of them gross."""
    rng = np.random.default_rng(seed)
    run = np.repeat(np.arange(len(places_m)), EACH)
    normal = rng.uniform(-np.pi, np.pi, len(run))
    way = np.column_stack([np.cos(normal), np.sin(normal)])
    residual = np.sum(way * places_m[run], 1) + rng.normal(0.0, NOISE_M, len(run))
    residual[3] += 1e-3
    impacts = SimpleNamespace(junctions=SimpleNamespace(run=run), normal_rad=normal)
    return SimpleNamespace(impacts=impacts, residual_m=residual, used=np.ones(len(run), bool))


def ring(runs, order):
    angle = 2 * np.pi * np.array(order) / runs
    return 5e-5 * np.column_stack([np.cos(angle), np.sin(angle)])


def test_each_run_is_reported_with_its_place():
    """Within three sd, off the mean of all runs."""
    places = ring(5, [0, 3, 1, 4, 2])
    found, size_m, _, p = own_places(wall_of(places))
    assert [one.number for one in found] == list(range(5)) and p < 1e-6
    assert size_m == pytest.approx(5e-5 / np.sqrt(2), rel=0.15)
    for one, (x_m, y_m) in zip(found, places, strict=True):
        assert one.sd_m == pytest.approx(NOISE_M / np.sqrt(0.5 * EACH), rel=0.4)
        assert max(abs(one.x_m - x_m), abs(one.y_m - y_m)) < 4 * one.sd_m


@pytest.mark.parametrize(
    "places",
    [
        np.zeros((5, 2)),
        5e-5 * np.outer(np.linspace(-1.0, 1.0, 6), [0.6, 0.8]),
        5e-5 * np.outer([-1.0, -1.0, 1.0, 1.0, 1.0, 1.0], [0.6, -0.8]),
        ring(2, [0, 1]),
    ],
    ids=["still", "creeping", "bolted on anew once", "two runs"],
)
def test_what_stays_or_goes_in_order_has_no_place_of_each_run(places):
    """A line over the runs, or a step, is a law's."""
    assert own_places(wall_of(places))[0] == ()


def test_noise_has_no_places():
    """Of sixty series not one."""
    assert not any(own_places(wall_of(np.zeros((6, 2)), seed))[0] for seed in range(60))


def test_places_are_reported_in_the_world():
    """Turned and scaled as the rig lies in it, in diagnosis.json and on the page."""
    places, *_ = own_places(wall_of(ring(5, [0, 3, 1, 4, 2])))
    one = Structure("geometry", "impact", "radius", EACH_RUN, 4.0, 99.0, 5e-5, "m", 1e-12, places)
    frame = RigFrame(np.zeros(2), 0.5 * np.pi, (0.0,) * 5, 2.0)
    entry = _left(one, SimpleNamespace(frame=frame, names=[f"run-{k}" for k in range(5)]))
    assert entry["goes_with"] == EACH_RUN and [at["run"] for at in entry["runs"]][:2] == ["run-0", "run-1"]
    assert (entry["runs"][1]["x_m"], entry["runs"][1]["y_m"]) == pytest.approx((-2 * places[1].y_m, 2 * places[1].x_m))
    assert entry["runs"][1]["sd_m"] == 2 * places[1].sd_m
    page = Page("title", "kicker", "lead")
    _each_run(page.add_section("What is left", "left"), entry["runs"])
    assert f"{1e6 * entry['runs'][4]['y_m']:.0f}" in str([block.rows for block in page.sections[0].blocks])
    assert "runs" not in _left(Structure("flight", "all", "x", "run", 1.0, 1.0, 1.0, "1", 1.0), SimpleNamespace())
