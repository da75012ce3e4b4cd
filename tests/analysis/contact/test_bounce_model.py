"""A bounce sequence in closed form: straight flights between the walls of a Host at rest."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.bounces.contact import RECORD, BounceRig, wall_frequency
from analysis.bounces.model import BouncePath, simulate_bounces
from analysis.flights.cutting.flight_rig import FlightRig
from analysis.flights.equation.parameters import PARAMETERS
from analysis.motion.host_path import HostMotion
from analysis.walls.wall import Wall

STILL = HostMotion(np.zeros((4, 1)), 0.0, 0.0, np.zeros(4), 0.0, np.zeros((0, 4)))
REST = BounceRig(
    FlightRig(STILL.table(0.0, 1.0), 60.0, 0.01, 0.5, 0.04, 0.0),
    np.zeros(len(PARAMETERS)),
    surfaces=Wall.ring(0.04).surfaces,
    disk_x_m=0.0,
    disk_y_m=0.0,
    wall_friction=0.15,
    tangential_restitution=0.4,
    stop_speed_m_per_s=0.02,
    wall_frequency_per_s=0.0,
    restitution=0.5,
    restitution_rise=0.0,
    restitution_speed_m_per_s=1.0,
)


def sequence(start, times, **rig):
    """A disk from ``start`` on within a wall of 40 mm contact radius at rest, without floor friction; (records,
    settled, states).
    """
    path = BouncePath(np.zeros((len(times), 6)), np.zeros((20, len(RECORD))), np.zeros((20, 6)))
    count, settled = simulate_bounces(
        np.array(start, float), 0.0, False, times, 0.0, np.zeros(20), REST._replace(**rig), path
    )
    return path.records[:count], settled, path.states


@pytest.mark.further
def test_impacts_come_where_straight_flights_intersect():
    records, _, out = sequence([0, 0, 0, 1, 0, 0], np.arange(0.0, 0.5, 1 / 800))
    place, moment, speed = 0.0, 0.0, 1.0
    for record in records[:3]:
        moment += (0.04 - place) / speed
        assert record[RECORD.index("time")] == pytest.approx(moment, abs=1e-9)
        assert record[RECORD.index("normal_before")] == pytest.approx(speed, rel=1e-9)
        place, speed = -0.04, 0.5 * speed
    assert np.max(np.abs(out[:, 0])) <= 0.04 + 1e-9


@pytest.mark.parametrize("restitution", [0.3, 0.72, 0.95])
def test_a_contact_that_lasts_gives_its_restitution_and_its_delay(restitution):
    """Straight paths before and after intersect past the wall by what the disk approaches during the delay."""
    delay_s = 3e-4
    times = np.array([0.0, 0.02, 0.03, 0.045, 0.05])
    records, settled, out = sequence(
        [0, 0, 0, 1, 0, 0], times, restitution=restitution, wall_frequency_per_s=wall_frequency(restitution, delay_s)
    )
    assert records[0, RECORD.index("time")] == pytest.approx(0.04, abs=1e-9) and settled == np.inf
    # Twelve steps to half a period: half a percent of a strongly damped one, less than a thousandth of the others.
    assert records[0, RECORD.index("normal_after")] == pytest.approx(
        restitution, rel=6e-3 if restitution < 0.5 else 1e-3
    )
    speed = (out[4, 0] - out[3, 0]) / 0.005
    assert speed == pytest.approx(-records[0, RECORD.index("normal_after")], rel=1e-9)
    crossing = (out[4, 0] - speed * times[4]) / (1 - speed)
    assert crossing == pytest.approx(0.04 + delay_s, abs=2e-6)


def test_a_soft_wall_catches_a_slow_disk_that_runs_along_it():
    # At 3.5 m/s the wall must push with v^2/R = 306 m/s^2: a touch at 0.02 m/s does not come off, the disk sits
    # v^2/R/w^2 deep.
    frequency = wall_frequency(0.7, 3e-4)
    records, settled, out = sequence(
        [0.04 - 1e-9, 0, 0, 0.02, 3.5, 0],
        np.arange(0.0, 0.02, 1 / 800),
        wall_friction=0.0,
        restitution=0.7,
        wall_frequency_per_s=frequency,
    )
    assert len(records) == 1 and settled == pytest.approx(records[0, 0], abs=1e-12)
    depth = np.hypot(out[-3:, 0], out[-3:, 1]) - 0.04
    assert depth == pytest.approx(3.5**2 / 0.04 / frequency**2, rel=0.02)


def test_restitution_may_follow_the_speed():
    law = {"restitution": 0.5, "restitution_rise": 0.3, "restitution_speed_m_per_s": 0.8}
    records, _, _ = sequence([0, 0, 0, 1, 0, 0], np.arange(0.0, 0.5, 1 / 800), **law)
    before, after = records[:3, RECORD.index("normal_before")], records[:3, RECORD.index("normal_after")]
    assert after / before == pytest.approx(0.5 + 0.3 * np.exp(-before / 0.8), rel=1e-12)


@pytest.mark.parametrize("wall_friction", [0.0, 0.1])
def test_a_settled_disk_slides_along_the_wall(wall_friction):
    # dv/dt = -mu v^2 / R: v = v0 / (1 + mu v0 t / R), on the wall all the time; the friction spins the disk up by twice
    # the speed lost.
    times = np.arange(0.0, 0.02, 1 / 800)
    _, settled, out = sequence([0.04 - 1e-9, 0, 0, 1e-3, 3.5, 0], times, wall_friction=wall_friction)
    slowed = 1 + wall_friction * 3.5 * times / 0.04
    path = 0.04 * np.log(slowed) / wall_friction if wall_friction else 3.5 * times
    assert settled < 1e-5
    assert np.max(np.abs(np.hypot(out[1:, 0], out[1:, 1]) - 0.04)) < 1e-9
    # Half a millimetre per second and 10 um after 19 ms: the model's steps of 0.2 ms.
    assert np.hypot(out[:, 3], out[:, 4]) == pytest.approx(3.5 / slowed, abs=5e-4)
    assert 0.04 * np.unwrap(np.arctan2(out[:, 1], out[:, 0])) == pytest.approx(path, abs=1.2e-5)
    assert 0.01 * out[:, 5] == pytest.approx(-2 * (3.5 - 3.5 / slowed), abs=1e-3)
