"""Each of the newest causes does what its formula says (how much it does: test_blind_groups.py)."""

import numpy as np
import pytest

from analysis.blind.plant.dynamics import run_plant, state_at
from analysis.blind.plant.wall.contact import impact
from tests.gap.blind_rig import BARE, DRIVE, HOST, SLIDING, STILL, first_contacts, head_on, rate_of, state_of


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
    assert rate_of(SLIDING._replace(**changed), **state) == pytest.approx(expected, abs=1e-4)


def test_a_disk_that_slides_as_fast_as_its_rim_curls_most():
    """Rim speed over speed r: 2 r / (1 + r^2) of the stated share of mu g, across the slip."""
    for spin in (30.0, 100.0, 300.0):
        across = rate_of(SLIDING._replace(curling=0.2), vx=1.0, spin=spin)[1]
        ratio = 0.01 * spin
        assert across == pytest.approx(-0.2 * 2.943 * 2 * ratio / (1 + ratio**2), abs=1e-6)


def test_friction_that_lags_comes_in_exponentially():
    """From rest of the bristles: v = v0 - mu g (t - lag (1 - exp(-t / lag)))."""
    lag, late = 0.004, 0.012
    start = np.array([-0.03, 0.0, 0.9, 0.0, 0.0, 0.0])
    motion = run_plant(SLIDING._replace(lag_s=lag), STILL, start, 0.02, np.random.default_rng(0))
    speed = state_at(motion, np.array([late - 2e-3]))[0, 2]
    assert speed == pytest.approx(0.9 - 2.943 * (late - lag * (1 - np.exp(-late / lag))), abs=2e-6)


def test_impacts_by_their_formulas():
    assert head_on(BARE._replace(fading_grip=0.8), 3.0, 10.0)[1] == pytest.approx(-0.45 * 0.2 * 0.1)
    assert head_on(BARE._replace(fading_grip=0.8), 0.4, 10.0)[1] == pytest.approx(-0.45 * 0.6 * 0.1)
    slides = 4.0 - 3.0 * 0.15 * (1 - 0.4 * (1 - np.exp(-4.0 / 0.4))) * 1.7
    assert head_on(BARE._replace(greased=0.4), 1.0, 400.0)[1] == pytest.approx(slides)
    assert head_on(BARE._replace(offset_blow_m=1.5e-4))[2] == pytest.approx(-1.5e-4 * 1.7 / 5e-5)
    assert [head_on(BARE._replace(loose_chip=0.25), chance=c)[0] for c in (0.9, 1.1)] == pytest.approx([-0.7, -0.45])
    bruised = BARE._replace(bruise=0.35)
    assert head_on(bruised)[0] == pytest.approx(-0.7)  # nothing was hit before
    expected = [-0.35, -(0.7 - 0.35 * np.exp(-0.5)), -0.7]
    assert [head_on(bruised, impact_s=0.0, azimuth=a)[0] for a in (2 * np.pi, 0.4, 3.0)] == pytest.approx(
        expected, abs=1e-6
    )


def test_walls_stop_the_disk_where_their_formulas_say():
    """Head-on along x: the disk's middle gets to the told place, at the told time."""

    def stopped(p, host=STILL):
        return first_contacts(p, host)[0][0]

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
    for spin, expected in ((30.0, 30.0 * falls), (-30.0, 0.0)):  # the chip leaves the wall, or comes to it
        state = state_of(x=0.0407, spin=spin)  # where the wall stops it, but for the flank's slope
        assert impact(0.0, state, chipped, STILL, np.zeros(2), 1.0)[1] == pytest.approx(expected, rel=1e-3)


def test_a_springy_liners_speed_is_part_of_the_blow():
    state = state_of(x=0.06, vx=1.0)
    springy = BARE._replace(springy_m=4e-4)
    hard, soft = (impact(0.05, state, p, HOST, np.zeros(2), 1.0)[1] for p in (BARE, springy))
    liner = 4e-4 / 78.5 * 0.0164 * DRIVE**3 * np.cos(DRIVE * 0.05 + 2.0)
    assert hard - soft == pytest.approx(liner, abs=1e-6)
