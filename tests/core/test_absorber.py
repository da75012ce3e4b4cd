"""Energy taken from the Host, frequency response and design against closed forms, balances and a second simulator."""

import math
from dataclasses import replace

import numpy as np
import pytest

from ovines.core import FloorFriction, Harmonic, ImpactLaw, simulate
from ovines.core.absorber.design import Search, design
from ovines.core.absorber.linear import bare_gain, tuned_gain, tuned_mass_damper
from ovines.core.absorber.response import frequency_response
from ovines.core.absorber.sprung import designed
from ovines.core.absorber.taken import energy_taken
from ovines.core.orbits.period import changed
from ovines.core.refusal import ScenarioError
from ovines.core.system.named import named_scenario
from tests.core.reference.naive_plant import Plant, Rig

HOST = named_scenario("sprung-host")
RATE = 2 * math.pi * 5.0
STILL = changed(HOST, "drive_amplitude_factor", 0.0)
BAND = [0.9, 1.0, 1.1]


def along_both(scenario):
    """The ground shakes along x and y."""
    suspension = scenario.host.suspension
    ground = (*suspension.ground, Harmonic("y", 0.001, 5.0, 0.4))
    return replace(scenario, host=replace(scenario.host, suspension=replace(suspension, ground=ground)))


def test_energy_adds_up_and_the_bare_host_decays_as_it_must():
    """Host, NES, its losses, dampers and ground's work: nothing is left over; bare: exp(-c t/m) on average."""
    for scenario in (HOST, STILL, replace(STILL, friction=FloorFriction(0.1))):
        found = energy_taken(scenario)
        rest = found.host_j - found.host_j[0] + found.pumped_j + found.damper_j - found.work_j
        assert np.max(np.abs(rest)) < 1e-9 * found.host_j.max()
    found = energy_taken(replace(STILL, duration_s=20.0))
    t, first = found.time_s, found.bare_j[0]
    wobble = 0.02 * first  # twice the damping ratio: the rate of loss goes with the phase
    assert np.max(np.abs(found.bare_j - first * np.exp(-0.02 * RATE * t))) < wobble
    with_nes, bare = found.decay_s(0.1)
    assert bare == pytest.approx(math.log(10) / (0.02 * RATE), rel=0.05) and with_nes < bare
    assert found.pumped_j[-1] > 0.1 * first


@pytest.mark.others_further
@pytest.mark.parametrize("both", [False, True])
def test_response_of_a_disk_too_light_to_matter_is_the_bare_one(both):
    """In one and in two directions, with Farkas friction on its floor: 1e-4 for a disk of 1e-6 of the Host's mass."""
    scenario = replace(HOST, friction=FloorFriction(0.2), nes=replace(HOST.nes, mass_kg=1e-6), initial_host=(0.0,) * 6)
    found = frequency_response(
        along_both(scenario) if both else scenario, BAND, 1, np.random.default_rng(0), transient=300, periods=4
    )
    assert found.level_m().mean(axis=1) == pytest.approx(np.linalg.norm(found.bare_m, axis=1), rel=2e-4)
    assert (found.bare_m[:, 1] > 0).all() == both
    assert found.bare_m[1, 0] == pytest.approx(0.002 * math.hypot(1, 0.02) / 0.02, rel=1e-12)


@pytest.mark.further
def test_response_of_a_disk_that_sticks_is_that_of_one_mass():
    """Farkas friction too strong to slip on: a Host heavier by the disk, to what the regularised law lets it creep."""
    small = changed(HOST, "drive_amplitude_factor", 0.02)
    scenario = replace(small, friction=FloorFriction(1.0), initial_host=(0.0,) * 6)
    found = frequency_response(scenario, BAND, 1, np.random.default_rng(0), transient=300, periods=4)
    assert found.amplitude_m[:, :, 0].mean(axis=1) == pytest.approx(found.stuck_m[:, 0], rel=1e-2)
    assert not np.allclose(found.stuck_m, found.bare_m, rtol=0.02)


def test_response_with_friction_and_impacts_agrees_with_a_second_simulator():
    """One run at resonance against naive_plant.py, which shares no code: the Host's path in both axes."""
    scenario = replace(
        along_both(HOST), friction=FloorFriction(0.1), duration_s=0.3, sample_rate_hz=100.0,
        initial_host=(0.0, 0.0, 1.5, 0.6, 0.0, 0.0),
    )  # fmt: skip
    suspension = scenario.host.suspension
    result = simulate(scenario)
    nes, host = scenario.nes, scenario.host
    rig = Rig(
        radius=nes.radius_m, mass=nes.mass_kg, inertia=0.5 * nes.mass_kg * nes.radius_m**2, host_radius=host.radius_m,
        host_mass=1.0, host_inertia=host.radius_m**2, spring=(suspension.stiffness, suspension.damping),
        drive=tuple((("x", "y").index(one.axis), one.amplitude, 2 * math.pi * one.frequency_hz, one.phase_rad)
                    for one in suspension.ground),
        eps=0.7, mu=0.1, beta=0.5, floor=0.1,
    )  # fmt: skip
    plant = Plant(rig, scenario.initial_nes, scenario.initial_host)
    plant.run(0.3)
    other = plant.at(result.time_s)[:, 6:8]
    own = np.column_stack([result.motion["host_x_m"], result.motion["host_y_m"]])
    assert len(result.impacts) > 3
    assert np.max(np.abs(own - other)) < 1e-6


def test_tuned_mass_damper_of_den_hartog():
    """An undamped Host: the smallest largest gain is sqrt(1 + 2/mu), at the spring and damper of his fixed points."""
    suspension = replace(HOST.host.suspension, damping=(0.0, 0.0, 0.0))
    scenario = replace(HOST, host=replace(HOST.host, suspension=suspension))
    frequency = np.linspace(3.0, 7.0, 2001)
    for ratio in (0.02, 0.05, 0.1):
        found = tuned_mass_damper(scenario, 0, ratio, frequency)
        assert found.gain == pytest.approx(math.sqrt(1 + 2 / ratio), rel=2e-2 * ratio**0.5 + 2e-3)
        assert found.stiffness_n_per_m == pytest.approx(ratio * RATE**2 / (1 + ratio) ** 2, rel=0.02)
    assert tuned_gain(scenario, 0, 1e-12, np.array([1.0, 1.0]), frequency[:3]) == pytest.approx(
        bare_gain(scenario, frequency[:3])[:, 0]
    )


@pytest.mark.further
def test_a_design_finds_the_better_mass():
    """A range of masses from none to 8 % of the Host's: the heavier ones win, and beat the Host alone."""
    found = design(
        HOST, {"mass_ratio": (1e-4, 0.08)}, [0.97, 1.0, 1.03], np.random.default_rng(3), Search(8, 3, 4, 40, 20)
    )
    best = found.kept[0]
    assert best.numbers.get("mass_ratio", 0.05) > 0.03
    assert best.low_m <= best.level_m <= best.high_m < 0.7 * found.bare_m
    assert len(found.tried) == 9 and sum(one.best for one in found.kept) == pytest.approx(1.0)
    assert found.damper_m < found.bare_m and found.damper[0].mass_kg == designed(HOST, best.numbers).nes.mass_kg


@pytest.mark.others_further
@pytest.mark.parametrize(
    ("call", "word"),
    [
        (lambda: energy_taken(named_scenario("rig")), "driven"),
        (lambda: frequency_response(STILL, BAND, 2, np.random.default_rng(0)), "stands still"),
        (lambda: frequency_response(HOST, [], 2, np.random.default_rng(0)), "0 frequencies"),
        (lambda: design(HOST, {"colour": (0, 1)}, BAND, np.random.default_rng(0)), "colour"),
        (lambda: design(HOST, {}, BAND, np.random.default_rng(0)), "0 ranges"),
        (lambda: design(HOST, {"mass_ratio": (1, 0)}, BAND, np.random.default_rng(0)), "mass_ratio"),
    ],
)
def test_what_cannot_be_is_refused(call, word):
    with pytest.raises(ScenarioError, match=word):
        call()


def test_numbers_of_a_design():
    made = designed(HOST, {"clearance_m": 0.05, "mass_ratio": 0.03, "floor_friction": 0.2, "restitution": 0.6})
    assert (made.host.radius_m, made.nes.mass_kg) == (0.035, 0.03)
    assert (made.friction.coefficient, made.impact) == (0.2, ImpactLaw(0.6, 0.1, 0.5))
