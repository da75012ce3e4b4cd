"""Each effect shows in the simulator, with the size that was given (FORMATS' definitions)."""

import math
from dataclasses import replace

import numpy as np
import pytest

from ovines.core import FloorFriction, Harmonic, Host, ImpactLaw, Nes, Scenario, ScenarioError, simulate
from ovines.core.effects import EFFECTS

WIDE = Scenario(
    "wide", Nes(0.01, 0.02), Host(50.0), ImpactLaw(0.7, 0.1, 0.5), 0.5, FloorFriction(0.2, "coulomb", "ground", 1e-5),
    (0.0, 0.0, 3.0, 1.0, 0.0, 20.0),
)  # fmt: skip
BARE = replace(WIDE, friction=None)
# straight at the wall of a small ring, again and again
RING = Scenario(
    "ring", Nes(0.01, 0.02), Host(0.05), ImpactLaw(0.7, 0.1, 0.5), 2.0, None, (0.0, 0.0, 2.0, 0.3, 0.0, 10.0)
)


def with_effect(scenario, name, **values):
    return simulate(replace(scenario, effects={name: values}))


def speeds(result):
    return np.hypot(result.motion["nes_vx_m_per_s"], result.motion["nes_vy_m_per_s"])


def test_names_and_stages_are_the_contract():
    expected = {
        "flight": {"floor_friction", "spin_coupling", "viscous_drag", "air_drag", "table_tilt", "vertical_motion",
                   "friction_drift"},
        "impact": {"speed_dependent_restitution", "direction_dependent_restitution", "finite_contact_time"},
        "geometry": {"wall_ellipticity", "wall_centre_offset", "mass_centre_offset", "centre_marker_offset"},
        "measurement": {"camera_clock_offset", "sensor_window_offset", "length_scale_error", "frame_rate_error",
                        "plane_tilt", "trigger_jitter"},
    }  # fmt: skip
    for stage, names in expected.items():
        assert names == {effect.name for effect in EFFECTS.values() if effect.stage == stage}


def test_floor_friction():
    result = with_effect(BARE, "floor_friction", coefficient=0.3)
    assert np.allclose(np.gradient(speeds(result), result.time_s)[1:-1], -0.3 * 9.81, rtol=1e-8)
    assert np.all(result.motion["nes_spin_rad_per_s"] == 20.0)


def test_spin_coupling():
    spinning = replace(WIDE, initial_nes=(0, 0, 1e-9, 0, 0, 400.0), duration_s=0.05)
    result = with_effect(spinning, "spin_coupling", coupling=1.0)
    slope = np.gradient(result.motion["nes_spin_rad_per_s"], result.time_s)[1:-1]
    # torque 2/3 mu m g R over m R^2/2
    assert np.allclose(slope, -(2 / 3) * 0.2 * 9.81 / (0.5 * 0.01), rtol=1e-6)
    half = with_effect(spinning, "spin_coupling", coupling=0.5)
    assert np.allclose(np.gradient(half.motion["nes_spin_rad_per_s"], half.time_s)[1:-1], slope / 2, rtol=1e-6)


def test_viscous_drag():
    result = with_effect(BARE, "viscous_drag", rate_per_s=0.8)
    assert np.allclose(speeds(result), math.hypot(3, 1) * np.exp(-0.8 * result.time_s), rtol=1e-9)


def test_air_drag():
    result = with_effect(BARE, "air_drag", rate_per_m=0.4)
    assert np.allclose(1 / speeds(result), 1 / math.hypot(3, 1) + 0.4 * result.time_s, rtol=1e-9)


def test_table_tilt():
    result = with_effect(BARE, "table_tilt", tilt_rad=0.02, direction_rad=2.0)
    fall = 0.5 * 9.81 * 0.02 * result.time_s**2
    assert np.allclose(result.motion["nes_x_m"] - 3 * result.time_s, fall * math.cos(2.0), atol=1e-12)
    assert np.allclose(result.motion["nes_y_m"] - result.time_s, fall * math.sin(2.0), atol=1e-12)


def test_vertical_motion():
    """Speed lost = mu (g t + z'(t) - z'(0)) while the disk slides one way."""
    still = Host(50.0, motion="driven", drive=(Harmonic("x", 1e-12, 11.0),))
    friction = FloorFriction(0.2, "coulomb", "host", 1e-5)
    scenario = replace(WIDE, host=still, friction=friction)
    result = with_effect(scenario, "vertical_motion", amplitude_m=8e-4, phase_rad=1.0)
    omega = 2 * math.pi * 11.0
    rate = 8e-4 * omega * (np.cos(omega * result.time_s + 1.0) - math.cos(1.0))
    assert np.allclose(speeds(result), math.hypot(3, 1) - 0.2 * (9.81 * result.time_s + rate), atol=1e-8)
    assert np.allclose(result.motion["nes_z_m"], 8e-4 * np.sin(omega * result.time_s + 1.0), atol=1e-15)


def test_friction_drift():
    result = with_effect(replace(WIDE, run_number=3), "friction_drift", relative_per_s=0.5, relative_per_run=-0.05)
    t = result.time_s
    lost = 0.2 * 9.81 * (1 - 0.15) * (t + 0.25 * t**2)
    assert np.allclose(speeds(result), math.hypot(3, 1) - lost, atol=1e-9)


def test_speed_dependent_restitution():
    impacts = with_effect(RING, "speed_dependent_restitution", restitution_fast=0.4, speed_scale_m_per_s=0.8).impacts
    before, after = impacts["normal_speed_before_m_per_s"], -impacts["normal_speed_after_m_per_s"]
    assert len(impacts) > 5
    assert np.allclose(after / before, 0.4 + 0.3 * np.exp(-before / 0.8), atol=1e-12)


def test_direction_dependent_restitution():
    impacts = with_effect(RING, "direction_dependent_restitution", amplitude=0.15, direction_rad=0.7).impacts
    ratio = -impacts["normal_speed_after_m_per_s"] / impacts["normal_speed_before_m_per_s"]
    assert np.allclose(ratio, 0.7 + 0.15 * np.cos(impacts["azimuth_rad"] - 0.7), atol=1e-12)


def test_finite_contact_time():
    """One stuck impact: same restitution and reversal as the instant law, half a millimetre deep, T long."""
    scenario = replace(RING, duration_s=0.05, sample_rate_hz=1e5, impact=ImpactLaw(0.7, 50.0, 0.5), max_impacts=1)
    lasting = with_effect(scenario, "finite_contact_time", duration_s=2e-3)
    instant = simulate(scenario)
    for name in ("normal_speed_after_m_per_s", "tangential_speed_after_m_per_s"):
        # during T the disk travels along the wall and the normal turns: 1 % of the approach speed, 2 m/s
        assert lasting.impacts[name][0] == pytest.approx(instant.impacts[name][0], abs=0.02)
    assert lasting.end_s - instant.end_s == pytest.approx(2e-3, rel=0.05)
    brief = with_effect(scenario, "finite_contact_time", duration_s=1e-6)
    for name in ("normal_speed_after_m_per_s", "tangential_speed_after_m_per_s", "spin_after_rad_per_s"):
        # the end of the push, where even mu = 50 cannot hold the tangential spring, costs 1 %
        assert brief.impacts[name][0] == pytest.approx(instant.impacts[name][0], rel=2e-2, abs=5e-3)
    assert abs(lasting.energy.relative_residual) < 1e-7


def test_finite_contact_time_slides_at_the_coulomb_limit():
    scenario = replace(RING, impact=ImpactLaw(0.7, 0.05, 0.5), max_impacts=1, initial_nes=(0, 0.02, 2.0, 0, 0, 0))
    brief, instant = with_effect(scenario, "finite_contact_time", duration_s=1e-6), simulate(scenario)
    assert instant.impacts["stuck"][0] == 0
    # while it separates the damper pulls: friction misses that share of the impulse (measured 2 %)
    change = [r.impacts["spin_after_rad_per_s"][0] for r in (brief, instant)]
    assert change[0] == pytest.approx(change[1], rel=0.1)


def contact_radii(result):
    """Distance of the centre from the Host's at the moments of impact, from a dense sampling."""
    distance = np.hypot(result.motion["nes_x_m"], result.motion["nes_y_m"])
    azimuth = np.arctan2(result.motion["nes_y_m"], result.motion["nes_x_m"])
    return distance, azimuth


def test_wall_ellipticity():
    scenario = replace(RING, impact=ImpactLaw(1.0, 0.0, 0.0), sample_rate_hz=2e5, duration_s=1.0)
    distance, azimuth = contact_radii(with_effect(scenario, "wall_ellipticity", ellipticity=0.02, direction_rad=0.4))
    room = 0.04 * (1 + 0.02 * np.cos(2 * (azimuth - 0.4))) - distance
    assert -1e-12 < np.min(room) < 1e-6
    touched = azimuth[room < 1e-5]
    assert np.ptp(touched) > 1.0  # it was asked in more than one place


def test_wall_centre_offset():
    scenario = replace(RING, impact=ImpactLaw(1.0, 0.0, 0.0), sample_rate_hz=2e5)
    result = with_effect(scenario, "wall_centre_offset", x_m=1e-3, y_m=-5e-4)
    distance = np.hypot(result.motion["nes_x_m"] - 1e-3, result.motion["nes_y_m"] + 5e-4)
    assert -1e-12 < 0.04 - np.max(distance) < 1e-5


def test_mass_centre_offset():
    """In free flight the centre of mass goes straight, the geometric centre circles it; contact keeps the energy."""
    result = with_effect(BARE, "mass_centre_offset", x_m=1e-3, y_m=0.0)
    angle = result.motion["nes_angle_rad"]
    x = result.motion["nes_x_m"] + 1e-3 * np.cos(angle)
    y = result.motion["nes_y_m"] + 1e-3 * np.sin(angle)
    assert np.allclose(np.diff(x, 2), 0, atol=1e-12)
    assert np.allclose(np.diff(y, 2), 0, atol=1e-12)
    elastic = replace(RING, impact=ImpactLaw(1.0, 0.0, 0.0))
    bounced = with_effect(elastic, "mass_centre_offset", x_m=1e-3, y_m=5e-4)
    assert len(bounced.impacts) > 5
    assert abs(bounced.energy.change) < 1e-10 * bounced.energy.exchanged
    assert np.ptp(bounced.motion["nes_spin_rad_per_s"]) > 1.0  # a smooth wall turns an off-centre disk


def test_centre_marker_offset():
    plain = simulate(RING)
    shown = with_effect(RING, "centre_marker_offset", x_m=1e-3, y_m=2e-4)
    angle = plain.motion["nes_angle_rad"]
    shift = 1e-3 * np.cos(angle) - 2e-4 * np.sin(angle)
    assert np.allclose(shown.motion["nes_x_m"] - plain.motion["nes_x_m"], shift, atol=1e-15)
    assert np.array_equal(shown.impacts["time_s"], plain.impacts["time_s"])


def test_measurement_effects():
    plain = simulate(RING)
    scaled = with_effect(RING, "length_scale_error", scale=1.02)
    assert np.allclose(scaled.motion["nes_x_m"], 1.02 * plain.motion["nes_x_m"], atol=0)
    clock = with_effect(RING, "frame_rate_error", ratio=1.01)
    assert np.allclose(clock.time_s, 1.01 * plain.time_s, atol=0)
    tilted = with_effect(RING, "plane_tilt", x_rad=0.1, y_rad=0.0)
    assert np.allclose(tilted.motion["nes_y_m"], math.cos(0.1) * plain.motion["nes_y_m"], atol=0)
    late = simulate(replace(RING, effects={"trigger_jitter": {"sd_s": 1e-4}}), np.random.default_rng(5))
    moved = (late.motion["nes_x_m"] - plain.motion["nes_x_m"]) / plain.motion["nes_vx_m_per_s"]
    assert np.std(moved) == pytest.approx(1e-4, rel=0.15)


def test_refusals():
    with pytest.raises(ScenarioError, match="no_such"):
        with_effect(RING, "no_such", size=1.0)
    with pytest.raises(ScenarioError, match="without coefficient"):
        with_effect(RING, "floor_friction")
    with pytest.raises(ScenarioError, match="rate_per_s"):
        with_effect(RING, "viscous_drag", rate_per_s=-1.0)
    with pytest.raises(ScenarioError, match="vertical_motion"):
        with_effect(RING, "vertical_motion", amplitude_m=1e-3)
