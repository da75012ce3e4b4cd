"""Each cause of the groups that are drawn only where they are asked for does as much as is stated and nothing else
(what their formulas say: test_plant_floor.py and the others)."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from analysis.blind.causes.named import CAUSES, draft_series, physics_of_run
from analysis.blind.draw import ASKED_FOR, draw_cases
from analysis.blind.plant.flight.accelerations import derivative
from analysis.blind.plant.flight.disk_friction import disk_friction_table
from analysis.blind.plant.state import STATES
from analysis.blind.plant.wall.contact import wall_gap
from analysis.blind.series import outline_series, run_outline
from tests.gap.blind.plant.amounts import CAMERA, OF_THE_DISK, ORDERS, OWN
from tests.gap.blind.plant.drawn_before import AS_BEFORE
from tests.gap.blind.plant.rig import DRIVE, HOST, PLACE, TIMES, after_blow, of_group, random_states

GROUPS = {group: of_group(group) for group in reversed(ASKED_FOR)}
EVERY = [cause for group in GROUPS.values() for cause in group]


def _physics(name):
    p = physics_of_run(draft_series(name, 1.0, np.random.default_rng(1), 12), 0, DRIVE, 1.2)
    return p._replace(gust_share=0.0, specked_share=0.0, rolling_draw=0.75)  # TIMES are early: what sets in has by then


@cache
def _done(name):
    """What the plant does with a cause ("none": without one): rates in the ring and states after a blow (60,
    STATES), gaps and normals at the wall (60, 3)."""
    p, table, free, there = _physics(name), disk_friction_table(), random_states(), random_states(True)
    chances = np.random.default_rng(2).normal(size=(60, 2))
    return (
        np.array([derivative(time, state, p, HOST, table) for time, state in zip(TIMES, free, strict=True)]),
        np.array([after_blow(t, s, p, HOST, c) for t, s, c in zip(TIMES, there, chances, strict=True)]),
        np.array([wall_gap(time, state, p, HOST) for time, state in zip(TIMES, there, strict=True)]),
    )


def _rms(off):
    return float(np.sqrt(np.mean(np.square(off))))


def _others(changes, name):
    """What a cause changes of the state beside velocity, spin and what is its own."""
    own = [2, 3, 5, *(PLACE.index(one) for one in OWN.get(name, ()))]
    return np.delete(changes, own, axis=1)


def test_every_one_has_its_stated_amount():
    assert ORDERS.keys() == {cause.name for cause in EVERY} and len(PLACE) == STATES


@pytest.mark.others_further
@pytest.mark.parametrize("name", [c.name for c in EVERY if c.stage != "measurement"])
def test_a_cause_changes_its_own_stage_by_the_stated_amount_and_no_other(name):
    rates, bounces, gaps = (a - b for a, b in zip(_done(name), _done("none"), strict=True))
    kind, stated = ORDERS[name]
    stage = CAUSES[name].stage
    if stage == "flight":
        remembered = [PLACE.index(one) for one in OWN.get(name, ())]  # of a blow by the flight after it
        assert np.all(np.delete(bounces, remembered, axis=1) == 0.0) and np.all(gaps == 0.0)
        assert np.all(_others(rates, name) == 0.0)
        assert kind != "force" or np.all(rates[:, 5] == 0.0)
        assert kind != "torque" or np.all(rates[:, 2:4] == 0.0)
        turned = kind.endswith("torque") and kind != "force and torque"
        amount = _rms(rates[:, 5]) if turned else _rms(np.hypot(rates[:, 2], rates[:, 3]))
    elif stage == "impact":
        assert np.all(rates == 0.0) and np.all(gaps == 0.0)
        assert np.abs(_others(bounces, name)).max() < 1e-15  # m: what lies at the wall to the last bit
        amount = _rms(bounces[:, 5]) if kind == "twist" else _rms(np.hypot(bounces[:, 2], bounces[:, 3]))
    else:
        assert np.all(rates == 0.0)
        amount = _rms(gaps[:, 0])
    assert 0.5 * stated < amount < 2.0 * stated, amount


@cache
def _plain():
    """A run without a cause, and what it was made of."""
    outline = outline_series("none", 1.0, np.random.default_rng(4), 1, "white")
    return outline, run_outline(outline, np.random.default_rng(5), 8.0)


@pytest.mark.others_further
@pytest.mark.parametrize("name", [c.name for c in EVERY if c.stage == "measurement"])
def test_a_cause_in_the_cameras_moves_the_picture_and_not_the_disk(name):
    """The same seed with and without it: the same markers in the same frames, the same impacts, other pixels."""
    outline, plain = _plain()
    view = draft_series(name, 1.0, np.random.default_rng(1), 1).view
    with_it = replace(outline, draft=replace(outline.draft, view=view))
    seen = run_outline(with_it, np.random.default_rng(5), 8.0)
    for key in ("imp01", "H01"):
        assert np.array_equal(seen.states[key], plain.states[key])
    keys = ["camera", "frame", "marker"]
    both = seen.recordings[0][1].merge(plain.recordings[0][1], on=keys, suffixes=("", "_plain"))
    assert len(both) > 0.97 * len(plain.recordings[0][1])
    off = np.hypot(both.u_px - both.u_px_plain, both.v_px - both.v_px_plain)
    one = next((view[f"{it}_camera"] for it in ("glare", "lid", "glint", "haze") if f"{it}_camera" in view), None)
    camera = CAMERA.get(name) if one is None else f"VW{one + 1}"
    if camera is not None:
        assert off[both.camera != camera].max() == 0.0 and off[both.camera == camera].max() > 0.0
        both, off = both[both.camera == camera], off[both.camera == camera]
    ground = off[both.marker.str.startswith("G")]
    if name == "unknown_alternating_clock":
        assert off[both.frame % 2 == 0].max() == 0.0
    if name == "unknown_stuttering_camera":
        assert 0.02 < both[off > 0].frame.nunique() / both.frame.nunique() < 0.09
    if name == "unknown_stretched_picture":
        assert np.abs(both.u_px - both.u_px_plain).max() == 0.0
    if name == "unknown_half_lid":
        assert np.ptp(ground.groupby(both.marker).mean()) > 0.1
    if name in (
        "unknown_grounded_trigger",
        "unknown_free_running_camera",
        "unknown_sync_pulses",
        "unknown_shocked_trigger",
        "unknown_dropped_frame",
        "unknown_flickering_lamps",
        "unknown_program_start",
        "unknown_exposure_control",
        "unknown_ticking_timer",
        "unknown_settling_loop",
    ):
        assert ground.max() < 1e-9
    if name == "unknown_bent_tab":
        assert off[both.marker != f"H{view['tab_marker'] + 1}"].max() == 0.0
    amount = _rms(off[both.marker.str.startswith("N" if name in OF_THE_DISK else "H")])
    assert 0.5 * ORDERS[name][1] < amount < 2.0 * ORDERS[name][1], amount


@pytest.mark.parametrize("group", GROUPS)
def test_they_are_drawn_only_where_they_are_asked_for(group):
    """Beside a listed cause, too, before those of earlier groups; none twice before all have come (of 18 causes 17: one
    may be put back that cannot stand beside the listed one)."""
    ours, earlier = {c.name for c in GROUPS[group]}, tuple(GROUPS)[: tuple(GROUPS).index(group)]
    rng = np.random.default_rng
    kinds = ("none", "listed", "pair", "triple", group, "beside")
    drawn = [cause for case in draw_cases(60, rng(3), kinds) for cause in case.causes if cause in ours]
    assert len(drawn) == 20 and len(set(drawn)) >= min(17, len(ours))
    for kinds, count in (((group, "beside"), 60), ((*earlier, group, "beside"), 120 // (len(earlier) + 2))):
        beside = [case.causes for case in draw_cases(120, rng(3), kinds) if len(case.causes) == 2]
        assert len(beside) in (count, count + 1) and all(
            listed not in ours and other in ours for listed, other in beside
        )
    for others in ((), ("unknown", "later", "latest", "beside"), (*earlier, "beside")):
        assert not any(ours & set(case.causes) for case in draw_cases(200, rng(3), others))


@pytest.mark.parametrize("group", AS_BEFORE)
def test_a_trial_of_an_earlier_group_is_drawn_as_before(group):
    cases = draw_cases(6, np.random.default_rng(1), (group, "beside"))
    assert [case.kind for case in cases] == AS_BEFORE[group]
