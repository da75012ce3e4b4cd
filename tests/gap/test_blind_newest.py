"""Each of the newest and of the unforeseen causes does as much as is stated and nothing else; the newest, what their
formulas say (the unforeseen: test_blind_unforeseen.py)."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.blind.causes.named import CAUSES, draft_series, physics_of_run
from analysis.blind.causes.newest import NEWEST
from analysis.blind.causes.unforeseen import UNFORESEEN
from analysis.blind.draw import draw_cases
from analysis.blind.plant.accelerations import derivative, host_pose
from analysis.blind.plant.contact import impact, wall_gap
from analysis.blind.plant.disk_friction import disk_friction_table
from analysis.blind.plant.dynamics import run_plant, state_at
from analysis.blind.plant.state import STATES, PlantParameters
from analysis.blind.series import outline_series, run_outline

DRIVE = 22.0 * np.pi
HOST = np.array([[0.0, 0.0164, DRIVE, 2.0, 0.0, 0.0, 0.0]])  # 8 g along x, as half of a trial's runs
STILL = np.zeros((1, 7))
SLIDING = PlantParameters(floor_friction=0.3, smoothing_m_per_s=1e-6)
BARE = PlantParameters(floor_friction=0.0, restitution=0.7, wall_friction=0.15, tangential_restitution=0.45)
# RMS over random states at severity 1, to a factor of two; the spread of sizes is 15 %.
ORDERS = {
    "unknown_canted_friction": ("force", 0.25),  # m/s^2
    "unknown_curling": ("force", 0.2),
    "unknown_lagging_friction": ("force", 2.4),  # all of the friction, at first
    "unknown_warped_washer": ("force", 0.6),
    "unknown_eddy_brake": ("force", 1.0),
    "unknown_rocking_table": ("force", 0.3),
    "unknown_spin_ratchet": ("torque", 80.0),  # rad/s^2
    "unknown_fading_grip": ("twist", 5.0),  # rad/s
    "unknown_bruised_wall": ("kick", 0.15),  # m/s
    "unknown_offset_blow": ("twist", 4.0),
    "unknown_greased_wall": ("kick", 0.04),
    "unknown_loose_chip": ("kick", 0.07),
    "unknown_chipped_disk": ("gap", 1.3e-4),  # m
    "unknown_creeping_liner": ("gap", 1.4e-4),
    "unknown_springy_liner": ("gap", 1.8e-4),
    "unknown_alternating_clock": ("pixels", 0.4),  # of the Host's markers
    "unknown_stuttering_camera": ("pixels", 0.75),
    "unknown_stretched_picture": ("pixels", 1.0),
    "unknown_air_cushion": ("force", 1.9),
    "unknown_coil_pull": ("force", 0.26),
    "unknown_loose_floor": ("friction", 1.4),
    "unknown_gritty_floor": ("friction", 0.7),
    "unknown_stuck_grain": ("friction", 0.23),
    "unknown_glue_thread": ("force", 3.5),
    "unknown_two_edges": ("kick", 0.07),
    "unknown_cohesive_wall": ("kick", 0.055),
    "unknown_taped_rim": ("twist", 3.3),
    "unknown_rolling_resistance": ("twist", 5.0),
    "unknown_overlapping_strip": ("gap", 1.45e-4),
    "unknown_loose_ring": ("gap", 1.75e-4),
    "unknown_shaken_camera": ("pixels", 0.7),  # of the first camera
    "unknown_glare": ("pixels", 0.5),  # of the disk's markers, in one camera
}
BOTH = NEWEST + UNFORESEEN


def _states(at_wall=False):
    """Forty states (40, STATES) in the ring, or at its wall and on their way into it."""
    rng, out = np.random.default_rng(7), np.zeros((40, STATES))
    azimuth = rng.uniform(0.0, 2.0 * np.pi, 40)
    radius = np.full(40, 0.04) if at_wall else 0.036 * np.sqrt(rng.random(40))
    out[:, :2] = radius[:, None] * np.column_stack([np.cos(azimuth), np.sin(azimuth)])
    out[:, 2:4] = rng.normal(0.0, 0.86, (40, 2))
    out[:, 4], out[:, 5], out[:, 6] = rng.uniform(0.0, 2.0 * np.pi, 40), rng.normal(0.0, 32.0, 40), 0.04
    out[:, 12], out[:, 13], out[:, 14] = azimuth, np.arange(1, 41), rng.uniform(0.0, 2.0 * np.pi, 40)
    if at_wall:
        inwards = np.minimum(np.sum(out[:, :2] * out[:, 2:4], axis=1) / 0.04**2, 0.0)
        out[:, 2:4] -= 2.0 * inwards[:, None] * out[:, :2]
        out[:, 12] = azimuth + rng.normal(0.0, 0.5, 40)
    else:
        out[:, 0] += host_pose(0.05, HOST)[0][0]
    return out


def _physics(name):
    return physics_of_run(draft_series(name, 1.0, np.random.default_rng(1), 12), 0, DRIVE, 1.2)


def _rates(p):
    table = disk_friction_table()
    return np.array([derivative(0.05, state, p, HOST, table) for state in _states()])


def _bounces(p):
    chances = np.random.default_rng(2).normal(size=(40, 2))
    return np.array([impact(0.05, s, p, STILL, c, 1.0)[0] for s, c in zip(_states(True), chances, strict=True)])


def _gaps(p):
    return np.array([wall_gap(0.05, state, p, HOST) for state in _states()])


def _rms(off):
    return float(np.sqrt(np.mean(np.square(off))))


@pytest.mark.parametrize("name", [c.name for c in BOTH if c.stage != "measurement"])
def test_a_cause_changes_its_own_stage_by_the_stated_amount_and_no_other(name):
    with_it, without = _physics(name), _physics("none")
    rates, bounces, gaps = (of(with_it) - of(without) for of in (_rates, _bounces, _gaps))
    kind, stated = ORDERS[name]
    stage = CAUSES[name].stage
    if stage == "flight":
        assert np.all(bounces == 0.0) and np.all(gaps == 0.0)
        way = [] if name == "unknown_loose_floor" else [8]  # it is slid over the floor
        assert np.all(rates[:, [0, 1, 4, 6, 7, 9, 12, 13, 14, *way]] == 0.0)
        assert kind == "friction" or np.all(rates[:, 5 if kind == "force" else 2] == 0.0)
        amount = _rms(rates[:, 5]) if kind == "torque" else _rms(np.hypot(rates[:, 2], rates[:, 3]))
    elif stage == "impact":
        assert np.all(rates == 0.0) and np.all(gaps == 0.0)
        assert np.all(bounces[:, [0, 1, 4, *range(6, STATES)]] == 0.0)
        amount = _rms(bounces[:, 5]) if kind == "twist" else _rms(np.hypot(bounces[:, 2], bounces[:, 3]))
    else:
        assert np.all(rates == 0.0)
        amount = _rms(gaps[:, 0])
    assert 0.5 * stated < amount < 2.0 * stated, amount


@pytest.mark.parametrize("name", [c.name for c in BOTH if c.stage == "measurement"])
def test_a_cause_in_the_cameras_moves_the_picture_and_not_the_disk(name):
    """The same seed with and without it: the same markers in the same frames, the same impacts, other pixels."""
    outline = outline_series("none", 1.0, np.random.default_rng(4), 1, "white")
    plain = run_outline(outline, np.random.default_rng(5))
    view = draft_series(name, 1.0, np.random.default_rng(1), 1).view
    with_it = replace(outline, draft=replace(outline.draft, view=view))
    seen = run_outline(with_it, np.random.default_rng(5))
    for key in ("imp01", "H01"):
        assert np.array_equal(seen.states[key], plain.states[key])
    keys = ["camera", "frame", "marker"]
    both = seen.recordings[0][1].merge(plain.recordings[0][1], on=keys, suffixes=("", "_plain"))
    assert len(both) > 0.97 * len(plain.recordings[0][1])
    off = np.hypot(both.u_px - both.u_px_plain, both.v_px - both.v_px_plain)
    if name == "unknown_alternating_clock":
        assert off[both.frame % 2 == 0].max() == 0.0
    if name == "unknown_stuttering_camera":
        assert off[both.camera == "VW2"].max() == 0.0
        moved = both[off > 0].groupby("frame").size()
        assert 0.02 < len(moved) / both.frame.nunique() < 0.09
    if name == "unknown_stretched_picture":
        assert np.abs(both.u_px - both.u_px_plain).max() == 0.0
    if name in ("unknown_shaken_camera", "unknown_glare"):
        still = both.camera == ("VW2" if name == "unknown_shaken_camera" or view["glare_camera"] == 0 else "VW1")
        assert off[still].max() == 0.0 and off[~still].max() > 0.0
        off = off[~still]
    amount = _rms(off[both.marker.str.startswith("N" if name == "unknown_glare" else "H")])
    assert 0.5 * ORDERS[name][1] < amount < 2.0 * ORDERS[name][1], amount


def _rate(p, **state):
    """Acceleration (x, y) and spin's rate over a Host at rest."""
    place = {"x": 0, "y": 1, "vx": 2, "vy": 3, "angle": 4, "spin": 5}
    full = np.zeros(STATES)
    for name, value in state.items():
        full[place[name]] = value
    return derivative(0.0, full, p, STILL, disk_friction_table())[[2, 3, 5]]


@pytest.mark.parametrize(
    ("changed", "state", "expected"),
    [
        ({"canted_rad": 0.12}, {"vx": 1.0}, (-2.943 * np.cos(0.12), -2.943 * np.sin(0.12), 0.0)),
        ({"warped": 0.3, "warped_rad": 0.5}, {"vx": 1.0, "angle": -0.5}, (-2.943 * 1.3, 0.0, 0.0)),
        ({"warped": 0.3, "warped_rad": 0.5}, {"vy": 1.0, "angle": -0.5}, (0.0, -2.943 * 0.7, 0.0)),
        ({"eddy_per_s": 2.5, "eddy_x_m": 0.01}, {"vy": 1.0, "x": 0.01}, (0.0, -2.943 - 2.5, 0.0)),
        ({"ratchet_rad_per_s2": 120.0, "floor_friction": 0.0}, {"spin": 60.0}, (0.0, 0.0, -120.0)),
        ({"ratchet_rad_per_s2": 120.0, "floor_friction": 0.0}, {"spin": -60.0}, (0.0, 0.0, 0.0)),
        ({"ratchet_rad_per_s2": -120.0, "floor_friction": 0.0}, {"spin": -60.0}, (0.0, 0.0, 120.0)),
    ],
)
def test_accelerations_by_their_formulas(changed, state, expected):
    assert _rate(SLIDING._replace(**changed), **state) == pytest.approx(expected, abs=1e-4)


def test_a_disk_that_slides_as_fast_as_its_rim_curls_most():
    """Rim speed over speed r: 2 r / (1 + r^2) of the stated share of mu g, across the slip."""
    for spin in (30.0, 100.0, 300.0):
        across = _rate(SLIDING._replace(curling=0.2), vx=1.0, spin=spin)[1]
        ratio = 0.01 * spin
        assert across == pytest.approx(-0.2 * 2.943 * 2 * ratio / (1 + ratio**2), abs=1e-6)


def test_friction_that_lags_comes_in_exponentially():
    """From rest of the bristles: v = v0 - mu g (t - lag (1 - exp(-t / lag)))."""
    lag, late = 0.004, 0.012
    start = np.array([-0.03, 0.0, 0.9, 0.0, 0.0, 0.0])
    motion = run_plant(SLIDING._replace(lag_s=lag), STILL, start, 0.02, np.random.default_rng(0))
    speed = state_at(motion, np.array([late - 2e-3]))[0, 2]
    assert speed == pytest.approx(0.9 - 2.943 * (late - lag * (1 - np.exp(-late / lag))), abs=2e-6)


def _head_on(p, speed=1.0, spin=0.0, chance=0.0, last=None):
    """Normal velocity, slip and spin after a blow along x against a wall at rest."""
    state = np.zeros(STATES)
    state[[0, 2, 5, 6]] = 0.04, speed, spin, -1.0
    if last is not None:
        state[[6, 12]] = 0.0, last
    out = impact(0.1, state, p, STILL, np.array([0.0, chance]), 1.0)[0]
    return out[2], out[3] + 0.01 * out[5], out[5]


def test_impacts_by_their_formulas():
    assert _head_on(BARE._replace(fading_grip=0.8), 3.0, 10.0)[1] == pytest.approx(-0.45 * 0.2 * 0.1)
    assert _head_on(BARE._replace(fading_grip=0.8), 0.4, 10.0)[1] == pytest.approx(-0.45 * 0.6 * 0.1)
    slides = 4.0 - 3.0 * 0.15 * (1 - 0.4 * (1 - np.exp(-4.0 / 0.4))) * 1.7
    assert _head_on(BARE._replace(greased=0.4), 1.0, 400.0)[1] == pytest.approx(slides)
    assert _head_on(BARE._replace(offset_blow_m=1.5e-4))[2] == pytest.approx(-1.5e-4 * 1.7 / 5e-5)
    assert [_head_on(BARE._replace(loose_chip=0.25), chance=c)[0] for c in (0.9, 1.1)] == pytest.approx([-0.7, -0.45])
    bruised = BARE._replace(bruise=0.35)
    assert _head_on(bruised)[0] == pytest.approx(-0.7)  # nothing was hit before
    expected = [-0.35, -(0.7 - 0.35 * np.exp(-0.5)), -0.7]
    assert [_head_on(bruised, last=a)[0] for a in (2 * np.pi, 0.4, 3.0)] == pytest.approx(expected, abs=1e-6)


def test_walls_stop_the_disk_where_their_formulas_say():
    """Head-on along x: the disk's middle gets to the told place, at the told time."""

    def stopped(p, host=STILL):
        start = np.array([0.03, 0.0, 1.0, 0.0, 0.7, 0.0])
        return run_plant(p, host, start, 0.02, np.random.default_rng(0)).impacts[0, 0] + 2e-3

    assert stopped(BARE._replace(chip_m=7e-4, chip_rad=-0.7)) == pytest.approx(0.0107, abs=1e-9)
    turning = BARE._replace(liner=0.005, liner_rad=0.3, liner_rad_per_s=2.0)
    late = stopped(turning)
    assert late == pytest.approx(0.01 + 0.04 * 0.005 * np.cos(2 * (0.3 + 2.0 * (late - 2e-3))), abs=1e-9)
    springy = BARE._replace(springy_m=4e-4)
    late = stopped(springy, HOST)
    swing = DRIVE * (late - 2e-3) + 2.0
    host = 0.0164 * (np.sin(swing) - np.sin(2.0 - DRIVE * 2e-3))
    shift = 4e-4 * 0.0164 * DRIVE**2 * np.sin(swing) / 78.5
    assert late == pytest.approx(0.01 + host + shift, abs=1e-9)


def test_a_chips_flank_strikes_as_the_disk_turns():
    """At rest but for its spin, the disk's middle is driven off as fast as its reach falls."""
    chipped = BARE._replace(chip_m=7e-4, chip_rad=0.2)
    falls = np.diff([7e-4 * np.exp(-0.5 * ((turn + 0.2) / 0.35) ** 2) for turn in (1e-5, -1e-5)])[0] / 2e-5
    state = np.zeros(STATES)
    state[0] = 0.0407  # where the wall stops it, but for the flank's slope
    for spin, expected in ((30.0, 30.0 * falls), (-30.0, 0.0)):  # the chip leaves the wall, or comes to it
        state[5] = spin
        assert impact(0.0, state, chipped, STILL, np.zeros(2), 1.0)[1] == pytest.approx(expected, rel=1e-3)


def test_a_springy_liners_speed_is_part_of_the_blow():
    state = np.zeros(STATES)
    state[[0, 2]] = 0.06, 1.0
    springy = BARE._replace(springy_m=4e-4)
    hard, soft = (impact(0.05, state, p, HOST, np.zeros(2), 1.0)[1] for p in (BARE, springy))
    liner = 4e-4 / 78.5 * 0.0164 * DRIVE**3 * np.cos(DRIVE * 0.05 + 2.0)
    assert hard - soft == pytest.approx(liner, abs=1e-6)


@pytest.mark.parametrize(("group", "of_it"), [("newest", NEWEST), ("unforeseen", UNFORESEEN)])
def test_they_are_drawn_only_where_they_are_asked_for(group, of_it):
    """Beside a listed cause, too; none twice before all have come."""
    newest = {c.name for c in of_it}
    rng = np.random.default_rng
    kinds = ("none", "listed", "pair", "triple", group, "beside")
    drawn = [cause for case in draw_cases(60, rng(3), kinds) for cause in case.causes if cause in newest]
    assert len(drawn) == 20 and len(set(drawn)) >= min(17, len(newest))
    beside = [case.causes for case in draw_cases(40, rng(3), (group, "beside")) if len(case.causes) == 2]
    assert len(beside) == 20 and all(listed not in newest and other in newest for listed, other in beside)
    for others in ((), ("unknown", "later", "latest", "beside")):
        assert not any(newest & set(case.causes) for case in draw_cases(200, rng(3), others))
