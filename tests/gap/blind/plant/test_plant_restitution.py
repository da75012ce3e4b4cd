"""The restitution of a blow: each cause does what its formula says."""

import numpy as np
import pytest

from analysis.blind.causes.named import draft_series, physics_of_run
from analysis.blind.plant.host import host_pose
from analysis.blind.plant.wall.contact import impact
from tests.gap.blind.plant.rig import BARE, DRIVE, HOST, PLACE, STILL, TIMES, head_on, state_of, struck

PINNED = {"impact_s": 0.08, "count": 3}  # the impact before: 20 ms ago where the time is 0.1 s
R = 0.01


@pytest.mark.further
def test_a_loose_chip_and_a_bruise():
    assert [head_on(BARE._replace(loose_chip=0.25), chance=c)[0] for c in (0.9, 1.1)] == pytest.approx([-0.7, -0.45])
    bruised = BARE._replace(bruise=0.35)
    assert head_on(bruised)[0] == pytest.approx(-0.7)  # nothing was hit before
    expected = [-0.35, -(0.7 - 0.35 * np.exp(-0.5)), -0.7]
    assert [head_on(bruised, impact_s=0.0, azimuth=a)[0] for a in (2 * np.pi, 0.4, 3.0)] == pytest.approx(
        expected, abs=1e-6
    )


def test_two_edges_strike_in_turn():
    assert [head_on(BARE._replace(two_edges=0.1), count=n)[0] for n in (0, 1, 2)] == pytest.approx([-0.8, -0.6, -0.8])


def test_a_wall_that_rings_and_one_that_is_seated():
    rings = BARE._replace(ringing=0.2, ringing_rad_per_s=250.0)
    for since in (0.004, 0.02, 0.05):
        gain = 0.2 * np.exp(-since / 0.06) * np.sin(250.0 * since)
        assert head_on(rings, impact_s=0.1 - since, count=1)[0] == pytest.approx(-0.7 - gain)
    assert head_on(rings)[0] == pytest.approx(-0.7)  # nothing was hit before
    assert head_on(rings._replace(ringing=0.5), impact_s=0.095, count=1)[0] == pytest.approx(-0.98)  # the most there is
    for time in (0.0, 0.02, 0.03):
        host = -0.0164 * DRIVE**2 * np.sin(DRIVE * time + 2.0)
        seated = head_on(BARE._replace(seated=0.13), host=HOST, time=time)[0]
        assert seated == pytest.approx(-0.7 - 0.13 * host / 78.5)


def test_a_liner_tires_and_recovers():
    tired = BARE._replace(tired=0.07)
    assert head_on(tired)[0] == pytest.approx(-0.7)  # nothing was hit before
    loss = 0.07 * 1.5 * np.exp(-0.02 / 0.12)
    assert head_on(tired, tired=1.5, **PINNED)[0] == pytest.approx(-0.7 + loss)
    after = struck(tired, vx=2.0, tired=1.5, **PINNED)
    assert after[15:17] == pytest.approx([2.0, 1.5 * np.exp(-0.02 / 0.12) + 4.0])


def test_a_rolled_sheet_and_a_wandering_shim():
    sheet = BARE._replace(sheet=0.1, sheet_rad=0.3)
    for angle, gain in ((-0.3, 0.1), (np.pi - 0.3, 0.1), (np.pi / 2 - 0.3, -0.1), (np.pi / 4 - 0.3, 0.0)):
        assert head_on(sheet, angle=angle)[0] == pytest.approx(-0.7 - gain)
    assert head_on(sheet._replace(restitution=0.95), angle=-0.3)[0] == pytest.approx(-0.98)
    shim = BARE._replace(shim=0.25, shim_rad=-0.5, shim_rad_per_s=3.0)
    for time in (0.1, 0.5 / 3.0, 0.4):
        lost = 0.25 * np.exp(-0.5 * ((0.5 - 3.0 * time) / 0.7) ** 2)
        assert head_on(shim, time=time)[0] == pytest.approx(-0.7 + lost)


def test_shingles_and_a_rattling_weight():
    shingled = BARE._replace(shingled=0.1)
    for spin in (-60.0, 0.0, 30.0):
        assert head_on(shingled, 1.0, spin)[0] == pytest.approx(-0.7 + 0.1 * np.tanh(R * spin / 0.4))
    assert head_on(shingled._replace(restitution=0.95), 1.0, -60.0)[0] == pytest.approx(-0.98)
    rattling = BARE._replace(rattling=0.12)
    assert head_on(rattling)[0] == pytest.approx(-0.7)  # nothing was hit before
    for last in (0.0, 2.0, np.pi):
        assert head_on(rattling, normal=last, count=3)[0] == pytest.approx(-0.7 - 0.12 * np.cos(last))


def test_a_shifted_band_and_lead_shot():
    shifted = BARE._replace(shifted=0.12)
    assert head_on(shifted)[0] == pytest.approx(-0.7)  # nothing was hit before
    for angle, last in ((0.0, 0.0), (0.5, -0.5), (0.5, 2.0), (0.0, np.pi)):
        got = head_on(shifted, angle=angle, struck=last, count=3)[0]
        assert got == pytest.approx(-0.7 - 0.12 * np.cos(-angle - last))
    assert head_on(shifted._replace(restitution=0.95), struck=0.0, count=1)[0] == pytest.approx(-0.98)
    assert struck(shifted, angle=0.7)[PLACE.index("struck")] == pytest.approx(-0.7)
    shot = BARE._replace(shot=0.12)
    for time in TIMES[::9]:
        lost = 0.12 * abs(host_pose(time, HOST)[2][0]) / 78.5
        assert head_on(shot, 1.0, time=time, host=HOST)[0] == pytest.approx(-0.7 + lost)


def test_an_armature_a_warm_ring_and_oblique_blows():
    soft = BARE._replace(armature=0.2)
    assert head_on(soft)[0] == pytest.approx(-0.7 * 0.8)
    for azimuth in (0.5, np.pi / 2, np.pi, 4.0):
        x, y = np.cos(azimuth), np.sin(azimuth)
        state = state_of(x=0.04 * x, y=0.04 * y, vx=x, vy=y)
        after = impact(0.1, state, soft, STILL, np.zeros(2), 1.0)[0]
        assert -(after[2] * x + after[3] * y) == pytest.approx(0.7 * (1.0 - 0.2 * x**2))
    assert head_on(BARE._replace(warmed=0.1), 0.8)[0] == pytest.approx(-0.7 * 0.9 * 0.8)
    for oblique in (0.25, -0.25):
        p = BARE._replace(oblique=oblique)
        assert head_on(p)[0] == pytest.approx(-0.7)
        for spin, share in ((100.0, 0.5), (-300.0, 0.9)):  # slips of 1 and 3 m/s
            assert head_on(p, 1.0, spin)[0] == pytest.approx(-0.7 * (1.0 - oblique * share))
    assert head_on(BARE._replace(oblique=-0.9), 1.0, 300.0)[0] == pytest.approx(-0.98)  # no wall gives back more


def test_the_ring_warms_evenly_from_run_to_run():
    draft = draft_series("unknown_warming_ring", 1.0, np.random.default_rng(1), 7)
    warmed = np.array([physics_of_run(draft, run, DRIVE, 1.2).warmed for run in range(7)])
    most = draft.parameters["unknown_warming_ring"]["warmed"]
    assert 0.085 <= most <= 0.115 and warmed == pytest.approx(most * np.arange(-3, 4) / 3.0)
