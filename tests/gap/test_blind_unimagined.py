"""Each of the unimagined causes does as much as is stated and nothing else, by its own formula."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.blind.causes.named import CAUSES, draft_series, may_stand_together, physics_of_run
from analysis.blind.causes.unimagined import UNIMAGINED
from analysis.blind.draw import draw_cases
from analysis.blind.plant.accelerations import derivative, host_pose
from analysis.blind.plant.contact import impact, wall_gap
from analysis.blind.plant.disk_friction import disk_friction_table
from analysis.blind.plant.dynamics import run_plant
from analysis.blind.plant.state import STATES, PlantParameters
from analysis.blind.recording.unimagined import grounded_s, through_lid
from analysis.blind.recording.views import ViewErrors, draw_views
from analysis.blind.series import outline_series, run_outline

DRIVE = 22.0 * np.pi
HOST = np.array([[0.0, 0.0164, DRIVE, 2.0, 0.0, 0.0, 0.0]])  # 8 g along x, as half of a trial's runs
STILL = np.zeros((1, 7))
PLACE = ["x", "y", "vx", "vy", "angle", "spin", "impact_s", "stretch", "way", "hard", "lx", "ly", "azimuth", "count"]
FREE = PlantParameters(floor_friction=0.0, smoothing_m_per_s=1e-6)
SLIDING = FREE._replace(floor_friction=0.3)
BARE = PlantParameters(floor_friction=0.0, restitution=0.7, wall_friction=0.15, tangential_restitution=0.45)
G = 0.3 * 9.81
# RMS over random states at severity 1, to a factor of two; the spread of sizes is 15 %.
ORDERS = {
    "unknown_napped_floor": ("friction", 0.6),  # m/s^2
    "unknown_turning_floor": ("friction", 0.6),
    "unknown_stray_poles": ("force and torque", 0.4),
    "unknown_domed_disk": ("torque", 35.0),  # rad/s^2
    "unknown_chattering_slide": ("friction", 0.65),
    "unknown_pitching_floor": ("friction", 0.4),
    "unknown_bellows": ("force", 0.35),
    "unknown_ringing_wall": ("kick", 0.08),  # m/s
    "unknown_squeezed_grease": ("kick", 0.05),
    "unknown_sawtooth_wall": ("kick", 0.075),
    "unknown_seated_ring": ("kick", 0.06),
    "unknown_yielding_skin": ("twist", 3.5),  # rad/s
    "unknown_squashed_ring": ("gap", 1.8e-4),  # m
    "unknown_slipping_ring": ("gap", 2.1e-4),
    "unknown_half_lid": ("pixels", 0.8),  # of the disk's markers, in one camera
    "unknown_grounded_trigger": ("pixels", 0.8),  # of the Host's, in the second camera
}


def _state(**numbers):
    state = np.zeros(STATES)
    state[6] = -1.0
    for name, value in numbers.items():
        state[PLACE.index(name)] = value
    return state


def _states(at_wall=False):
    """Sixty states (60, STATES) in the ring at 0.05 s, or at its wall and on their way into it, 5 to 100 ms after the
    impact before."""
    rng, out = np.random.default_rng(7), np.zeros((60, STATES))
    azimuth = rng.uniform(0.0, 2.0 * np.pi, 60)
    radius = np.full(60, 0.04) if at_wall else 0.036 * np.sqrt(rng.random(60))
    out[:, :2] = radius[:, None] * np.column_stack([np.cos(azimuth), np.sin(azimuth)])
    out[:, 2:4] = rng.normal(0.0, 0.86, (60, 2))
    out[:, 4], out[:, 5] = rng.uniform(0.0, 2.0 * np.pi, 60), rng.normal(0.0, 32.0, 60)
    out[:, 6], out[:, 12], out[:, 13] = 0.05 - rng.uniform(0.005, 0.1, 60), azimuth, np.arange(1, 61)
    if at_wall:
        inwards = np.minimum(np.sum(out[:, :2] * out[:, 2:4], axis=1) / 0.04**2, 0.0)
        out[:, 2:4] -= 2.0 * inwards[:, None] * out[:, :2]
    position, velocity, _ = host_pose(0.05, HOST)
    out[:, 0] += position[0]
    out[:, 2] += velocity[0]
    return out


def _physics(name):
    return physics_of_run(draft_series(name, 1.0, np.random.default_rng(1), 12), 0, DRIVE, 1.2)


def _rates(p):
    table = disk_friction_table()
    return np.array([derivative(0.05, state, p, HOST, table) for state in _states()])


def _bounces(p):
    return np.array([impact(0.05, state, p, HOST, np.zeros(2), 1.0)[0] for state in _states(True)])


def _gaps(p):
    return np.array([wall_gap(0.05, state, p, HOST) for state in _states()])


def _rms(off):
    return float(np.sqrt(np.mean(np.square(off))))


def test_every_one_has_its_stated_amount():
    assert ORDERS.keys() == {cause.name for cause in UNIMAGINED}


@pytest.mark.parametrize("name", [c.name for c in UNIMAGINED if c.stage != "measurement"])
def test_a_cause_changes_its_own_stage_by_the_stated_amount_and_no_other(name):
    with_it, without = _physics(name), _physics("none")
    rates, bounces, gaps = (of(with_it) - of(without) for of in (_rates, _bounces, _gaps))
    kind, stated = ORDERS[name]
    stage = CAUSES[name].stage
    if stage == "flight":
        assert np.all(bounces == 0.0) and np.all(gaps == 0.0)
        way = [] if name == "unknown_turning_floor" else [8]  # it is slid over the floor
        assert np.all(rates[:, [0, 1, 4, 6, 7, 9, 12, 13, 14, *way]] == 0.0)
        assert kind != "force" or np.all(rates[:, 5] == 0.0)
        amount = _rms(rates[:, 5]) if kind == "torque" else _rms(np.hypot(rates[:, 2], rates[:, 3]))
    elif stage == "impact":
        assert np.all(rates == 0.0) and np.all(gaps == 0.0)
        place = [10, 11, 13] if name == "unknown_sawtooth_wall" else range(6, STATES)  # where it is struck, how hard
        assert np.abs(bounces[:, [0, 1, 4, *place]]).max() < 1e-15  # m: what lies at the wall to the last bit
        amount = _rms(bounces[:, 5]) if kind == "twist" else _rms(np.hypot(bounces[:, 2], bounces[:, 3]))
    else:
        assert np.all(rates == 0.0)
        amount = _rms(gaps[:, 0])
    assert 0.5 * stated < amount < 2.0 * stated, amount


@pytest.mark.parametrize("name", [c.name for c in UNIMAGINED if c.stage == "measurement"])
def test_a_cause_in_the_cameras_moves_one_picture_and_not_the_disk(name):
    """The same seed with and without it: the same markers in the same frames, the same impacts, other pixels."""
    outline = outline_series("none", 1.0, np.random.default_rng(4), 1, "white")
    plain = run_outline(outline, np.random.default_rng(5), 8.0)
    view = draft_series(name, 1.0, np.random.default_rng(1), 1).view
    with_it = replace(outline, draft=replace(outline.draft, view=view))
    seen = run_outline(with_it, np.random.default_rng(5), 8.0)
    for key in ("imp01", "H01"):
        assert np.array_equal(seen.states[key], plain.states[key])
    keys = ["camera", "frame", "marker"]
    both = seen.recordings[0][1].merge(plain.recordings[0][1], on=keys, suffixes=("", "_plain"))
    assert len(both) > 0.97 * len(plain.recordings[0][1])
    off = np.hypot(both.u_px - both.u_px_plain, both.v_px - both.v_px_plain)
    touched = both.camera == f"VW{view.get('lid_camera', 1) + 1}"
    assert off[~touched].max() == 0.0
    ground = off[touched & both.marker.str.startswith("G")]
    assert np.ptp(ground.groupby(both.marker).mean()) > 0.1 if name == "unknown_half_lid" else ground.max() < 1e-9
    amount = _rms(off[touched & both.marker.str.startswith("N" if name == "unknown_half_lid" else "H")])
    assert 0.5 * ORDERS[name][1] < amount < 2.0 * ORDERS[name][1], amount


def _rate(p, time=0.0, host=STILL, **numbers):
    """Acceleration (x, y) and spin's rate."""
    return derivative(time, _state(**numbers), p, host, disk_friction_table())[[2, 3, 5]]


@pytest.mark.parametrize(
    ("changed", "state", "expected"),
    [
        # a nap along x: against it, with it, across it, and from all sides under a disk that only spins
        ({"nap": 0.35, "nap_rad": 0.0}, {"vx": 1.0}, (-1.35 * G, 0.0, 0.0)),
        ({"nap": 0.35, "nap_rad": 0.0}, {"vx": -1.0}, (0.65 * G, 0.0, 0.0)),
        ({"nap": 0.35, "nap_rad": 0.0}, {"vy": 1.0}, (0.0, -G, 0.0)),
        ({"nap": 0.35, "nap_rad": 0.0}, {"spin": 50.0}, (0.0, 0.0, -G * 0.01 * 2.0 / 3.0 / 5e-5)),
        # a floor that turns at 7 rad/s carries what rests, and leaves alone what goes with it
        ({"floor_turn_rad_per_s": 7.0}, {"x": 0.02, "spin": 7.0}, (0.0, G, 0.0)),
        ({"floor_turn_rad_per_s": 7.0}, {"y": 0.02, "vx": -0.14, "spin": 7.0}, (0.0, 0.0, 0.0)),
        # a dished disk: the same friction as it slides, half the torque as it spins
        ({"dome": 0.5}, {"vx": 1.0}, (-G, 0.0, 0.0)),
        ({"dome": 0.5}, {"spin": 50.0}, (0.0, 0.0, -0.5 * G * 0.01 * 2.0 / 3.0 / 5e-5)),
        # chatter in its band of speeds, half as much at 1.18 of its width, none far from it
        ({"chatter": 0.6, "chatter_m_per_s": 0.7}, {"vx": 0.7}, (-0.4 * G, 0.0, 0.0)),
        ({"chatter": 0.6}, {"vy": -0.7 - 0.2 * np.sqrt(2 * np.log(2))}, (0.0, 0.7 * G, 0.0)),
        ({"chatter": 0.6}, {"vx": 2.0}, (-G, 0.0, 0.0)),
    ],
)
def test_friction_by_its_formulas(changed, state, expected):
    assert _rate(SLIDING._replace(**changed), **state) == pytest.approx(expected, abs=1e-3)


def test_poles_push_and_turn_by_one_energy():
    """Force and torque are what one energy, -B m (x cos a - y sin a), falls by along x, y and the angle."""
    poles = FREE._replace(poles_m_per_s2=0.4, poles_rad=0.3)

    def energy(x, y, angle):
        return -0.4 * (x * np.cos(angle + 0.3) - y * np.sin(angle + 0.3))

    at, h = np.array([0.012, -0.021, 1.1]), 1e-6
    falls = [-(energy(*(at + h * e)) - energy(*(at - h * e))) / (2 * h) for e in np.eye(3)]
    expected = (falls[0], falls[1], falls[2] / 5e-5)
    assert _rate(poles, x=at[0], y=at[1], angle=at[2]) == pytest.approx(expected, abs=1e-4)


@pytest.mark.parametrize("time", [0.0, 0.02, 0.03])
def test_what_goes_with_the_host(time):
    """A pitching floor presses in proportion to place times acceleration; bellows blow with the velocity's square."""
    phase = DRIVE * time + 2.0
    x, v, a = 0.0164 * np.sin(phase), 0.0164 * DRIVE * np.cos(phase), -0.0164 * DRIVE**2 * np.sin(phase)
    share = 1.0 + 0.6 * 0.02 * a / (0.04 * 78.5)
    got = _rate(SLIDING._replace(pitching=0.6), time, HOST, x=x + 0.02, y=0.01, vx=v, vy=1.0)
    assert got == pytest.approx((0.0, -share * G, 0.0), abs=1e-6)
    blown = 0.7 * v * abs(v) / 1.136**2
    assert _rate(FREE._replace(bellows_m_per_s2=0.7), time, HOST) == pytest.approx((blown, 0.0, 0.0), abs=1e-12)


def _head_on(p, speed=1.0, spin=0.0, since_s=9.0, host=STILL, time=0.1):
    """Normal velocity against the wall, slip and spin after a blow along x; the impact before: so long ago."""
    position, velocity, _ = host_pose(time, host)
    state = _state(x=position[0] + 0.04, vx=velocity[0] + speed, spin=spin, impact_s=time - since_s, count=since_s < 1)
    out = impact(time, state, p, host, np.zeros(2), 1.0)[0]
    return out[2] - velocity[0], out[3] + 0.01 * out[5], out[5]


def test_impacts_by_their_formulas():
    rings = BARE._replace(ringing=0.2, ringing_rad_per_s=250.0)
    for since in (0.004, 0.02, 0.05):
        gain = 0.2 * np.exp(-since / 0.06) * np.sin(250.0 * since)
        assert _head_on(rings, since_s=since)[0] == pytest.approx(-0.7 - gain)
    assert _head_on(rings)[0] == pytest.approx(-0.7)  # nothing was hit before
    assert _head_on(rings._replace(ringing=0.5), since_s=0.005)[0] == pytest.approx(-0.98)  # the most there is
    for speed in (0.3, 1.0, 2.0):  # it slides: what is lost is the limit
        lost = 3.0 * 0.15 * (1.0 + 0.9 * (1.0 - np.exp(-speed / 0.8))) * 1.7 * speed
        assert _head_on(BARE._replace(squeezed=0.9), speed, 800.0)[1] == pytest.approx(8.0 - lost)
    for spin in (3.0, -30.0):  # it sticks
        back = 0.45 / (1.0 + 1.5 * 0.01 * abs(spin) / 0.3)
        assert _head_on(BARE._replace(skin=1.5), 1.0, spin)[1] == pytest.approx(-back * 0.01 * spin)
    for time in (0.0, 0.02, 0.03):
        host = -0.0164 * DRIVE**2 * np.sin(DRIVE * time + 2.0)
        seated = _head_on(BARE._replace(seated=0.13), host=HOST, time=time)[0]
        assert seated == pytest.approx(-0.7 - 0.13 * host / 78.5)


def test_leaning_teeth_turn_the_blow_and_give_no_energy():
    """Head-on without wall friction: the impulse is along the teeth's normal, 0.045 rad beside the wall's; with it,
    no blow leaves more energy than it finds; what is held meets the wall itself."""
    saw = BARE._replace(saw_rad=0.045)
    out = impact(0.1, _state(x=0.04, vx=1.0), saw._replace(wall_friction=0.0), STILL, np.zeros(2), 1.0)[0]
    pushed = -1.7 * np.cos(0.045) * np.array([np.cos(0.045), np.sin(0.045)])
    assert out[2:4] == pytest.approx([1.0 + pushed[0], pushed[1]]) and out[5] == 0.0

    def energy(s):
        return 0.5 * (s[2] ** 2 + s[3] ** 2) + 0.25 * (0.01 * s[5]) ** 2

    position, velocity, _ = host_pose(0.05, HOST)
    for state in _states(True):
        state[:4] -= [*position[:2], *velocity[:2]]
        assert energy(impact(0.05, state, saw, STILL, np.zeros(2), 1.0)[0]) <= energy(state) + 1e-12
    state = _state(x=0.04, vx=0.3, vy=1.0)
    held = [impact(0.1, state, p, STILL, np.zeros(2), 0.0)[0] for p in (saw, BARE)]
    assert np.array_equal(*held)


def test_walls_stop_the_disk_where_their_formulas_say():
    """Head-on along x: the disk's middle gets to the told place, at the told time."""

    def stopped(p, host=STILL):
        start = np.array([0.03, 0.0, 1.0, 0.0, 0.7, 0.0])
        late, approach, _ = run_plant(p, host, start, 0.02, np.random.default_rng(0)).impacts[0]
        return late + 2e-3, approach

    late, approach = stopped(BARE._replace(slipping_m=3.5e-4, slipping_rad=0.4))
    way = 3.5e-4 * (2.0 * (late - 2e-3) / 1.2 - 1.0)
    x = way * np.cos(0.4) + np.sqrt(0.04**2 - (way * np.sin(0.4)) ** 2)
    assert late == pytest.approx(x - 0.03, abs=1e-9)
    assert approach == pytest.approx(
        1.0 - 7e-4 / 1.2 * np.cos(0.4), abs=1e-5
    )  # the wall's own speed; normal 3 mrad off
    late, _ = stopped(BARE._replace(squash_m=3.5e-4, squash_rad=0.5), HOST)
    swing = DRIVE * (late - 2e-3) + 2.0
    host = 0.0164 * (np.sin(swing) - np.sin(2.0 - DRIVE * 2e-3))
    start = -0.0164 * DRIVE**2 * np.sin(swing) * np.cos(0.5) / 78.5
    assert late == pytest.approx(0.01 + host + 3.5e-4 * start * np.cos(-1.0), abs=1e-9)


def test_a_squashed_rings_speed_is_part_of_the_blow_but_a_cylinder_stands():
    squashed = BARE._replace(squash_m=3.5e-4, squash_rad=0.5)
    jerk = -0.0164 * DRIVE**3 * np.cos(DRIVE * 0.05 + 2.0) * np.cos(0.5)
    moves = 3.5e-4 / 78.5 * jerk * np.cos(-1.0)
    position, velocity, _ = host_pose(0.05, HOST)
    for far, along, expected in ((0.045, 1.0, moves), (0.018, -1.0, 0.0)):
        state = _state(x=position[0] + far, vx=velocity[0] + along)
        pair = (impact(0.05, state, p._replace(obstacle_m=0.018), HOST, np.zeros(2), 1.0)[1] for p in (BARE, squashed))
        assert np.subtract(*pair) == pytest.approx(expected, abs=1e-4)  # the wall's slope: 0.01 rad


def test_a_pane_displaces_what_lies_beyond_its_edge():
    view = draw_views(np.random.default_rng(8))[1]
    errors = ViewErrors(lid_px=1.2, lid_m=(0.01, -0.005), lid_rad=np.pi / 2, lid_camera=1)
    points = np.array([[[0.03, -0.004, 0.01], [-0.03, -0.006, 0.01]]])
    plain = view.pixels(points)
    moved = through_lid(plain, 1, view, errors) - plain
    up = view.pixels(np.array([[0.01, 0.005, 0.01], [0.01, -0.005, 0.01]]))
    across = (up[0] - up[1]) / np.hypot(*(up[0] - up[1]))
    assert moved[0] == pytest.approx(np.array([1.2 * across, [0.0, 0.0]]), abs=1e-9)
    assert np.array_equal(through_lid(plain, 0, view, errors), plain)


def test_a_grounded_trigger_is_late_with_the_hosts_acceleration():
    time = np.array([0.0, 0.01, 0.033])
    host = -0.0164 * DRIVE**2 * np.sin(DRIVE * time + 2.0)
    assert grounded_s(time, HOST, ViewErrors(grounded_s=4e-4)) == pytest.approx(4e-4 * host / 78.5, abs=1e-12)
    assert np.all(grounded_s(time, HOST, ViewErrors()) == 0.0)


def test_they_are_drawn_only_where_they_are_asked_for():
    """Beside a listed cause, too, before those of earlier groups; none twice before all have come."""
    ours = {c.name for c in UNIMAGINED}
    rng = np.random.default_rng
    kinds = ("none", "listed", "pair", "triple", "unimagined", "beside")
    drawn = [cause for case in draw_cases(60, rng(3), kinds) for cause in case.causes if cause in ours]
    assert len(drawn) == 20 and set(drawn) == ours
    beside = [c.causes for c in draw_cases(40, rng(3), ("newest", "unforeseen", "unimagined", "beside"))]
    beside = [causes for causes in beside if len(causes) == 2]
    assert len(beside) == 10 and all(listed not in ours and other in ours for listed, other in beside)
    for others in ((), ("unknown", "later", "latest", "beside"), ("newest", "unforeseen", "beside")):
        assert not any(ours & set(case.causes) for case in draw_cases(200, rng(3), others))


def test_only_a_round_wall_is_squashed_and_no_blow_has_two_laws():
    assert not may_stand_together(("table_tilt", "unknown_squashed_ring"), "square", "sine")
    assert may_stand_together(("table_tilt", "unknown_squashed_ring"), "cylinder", "sine")
    for name in (cause.name for cause in UNIMAGINED if cause.stage == "impact"):
        assert not may_stand_together(("finite_contact_time", name), "round", "sine")
