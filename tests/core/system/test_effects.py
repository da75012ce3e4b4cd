"""Each effect shows in the simulator, with the size that was given (FORMATS' definitions)."""

import math
from dataclasses import replace

import numpy as np
import pytest

from ovines.core import FloorFriction, Harmonic, Host, ImpactLaw, Nes, Scenario, ScenarioError, simulate
from ovines.core.effects import EFFECTS, Effect, EffectParameter
from ovines.core.effects.effect import Words
from ovines.core.effects.law_form import LawForm
from ovines.core.laws.terms import Factor, Term, WrittenLaw
from ovines.documentation.reference_pages import effects_page

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
                   "friction_drift", "nes_rocking"},
        "impact": {"speed_dependent_restitution", "direction_dependent_restitution", "finite_contact_time",
                   "restitution_drift"},
        "geometry": {"wall_ellipticity", "wall_centre_offset", "mass_centre_offset", "centre_marker_offset",
                     "wall_lobes", "inertia_error"},
        "drive": {"host_recoil", "host_ringing", "host_sway"},
        "measurement": {"camera_clock_offset", "sensor_window_offset", "length_scale_error", "frame_rate_error",
                        "plane_tilt", "trigger_jitter", "motion_blur"},
    }  # fmt: skip
    for stage, names in expected.items():
        assert names == {effect.name for effect in EFFECTS.values() if effect.stage == stage}


def test_an_effect_that_is_added_is_known_everywhere_at_once_and_gone_when_it_is_taken_out(monkeypatch):
    """A steady push along x, as docs/how-to/add-effect.md has it: one object in the library, and the simulator moves by
    it, the reference lists it, and a size out of its bounds is refused.  (That the diagnosis names such a one:
    `tests/gap/laws/test_laws.py`.)"""
    push = Effect(
        "steady_push",
        "flight",
        (EffectParameter("push_m_per_s2", "m/s^2", 0.0, 5.0),),
        "a push",
        Words("Steady push", "something pushes along x", "Turn the rig."),
        forms=(LawForm("fixed_direction", coefficient="push_m_per_s2"),),
    )
    bare = simulate(BARE).motion["nes_vx_m_per_s"]
    with monkeypatch.context() as added:
        added.setitem(EFFECTS, push.name, push)
        result = with_effect(BARE, push.name, push_m_per_s2=2.0)
        np.testing.assert_allclose(result.motion["nes_vx_m_per_s"] - bare, 2.0 * result.time_s, rtol=0, atol=1e-9)
        assert push.name in effects_page()
        with pytest.raises(ScenarioError, match="push_m_per_s2"):
            with_effect(BARE, push.name, push_m_per_s2=9.0)
    with pytest.raises(ScenarioError, match="steady_push"):
        with_effect(BARE, push.name, push_m_per_s2=2.0)
    assert push.name not in effects_page()


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


def test_restitution_drift():
    drifting = replace(RING, run_number=2)
    impacts = with_effect(drifting, "restitution_drift", relative_per_s=-0.2, relative_per_run=0.03).impacts
    ratio = -impacts["normal_speed_after_m_per_s"] / impacts["normal_speed_before_m_per_s"]
    assert len(impacts) > 5
    assert np.allclose(ratio, 0.7 * (1 - 0.2 * impacts["time_s"]) * 1.06, atol=1e-12)
    hard = with_effect(replace(RING, run_number=50), "restitution_drift", relative_per_run=0.03).impacts
    assert np.allclose(-hard["normal_speed_after_m_per_s"], hard["normal_speed_before_m_per_s"], rtol=1e-12)


def test_nes_rocking():
    """Speed lost s after an impact: mu g (s + a T (1 - exp(-s / T))); before the first it is plain friction's."""
    rubbed = replace(RING, friction=FloorFriction(0.2, "coulomb", "host", 1e-5), initial_nes=(0, 0, 2, 0, 0, 0))
    scenario = replace(rubbed, duration_s=0.06, sample_rate_hz=4e3)
    result = with_effect(scenario, "nes_rocking", relative=-0.6, decay_s=0.015)
    hits, speed = result.impacts, speeds(result)
    late = result.time_s - hits["time_s"][0]
    assert np.allclose(speed[late < 0], 2.0 - 0.2 * 9.81 * result.time_s[late < 0], atol=1e-8)
    after = (late > 0) & (result.time_s < np.append(hits["time_s"], 1.0)[1])
    s, left = late[after], -hits["normal_speed_after_m_per_s"][0]
    assert s[-1] > 0.03
    assert np.allclose(speed[after], left - 0.2 * 9.81 * (s - 0.6 * 0.015 * (1 - np.exp(-s / 0.015))), atol=1e-8)


def test_inertia_error():
    """A contact that sticks shares its slip between speed and spin as the true inertia has it (thesis eq. 96)."""
    scenario = replace(RING, impact=ImpactLaw(0.7, 50.0, 0.5), max_impacts=1)
    for ratio in (0.8, 1.3):
        hit = with_effect(scenario, "inertia_error", ratio=ratio).impacts[0]
        slip, q = hit["tangential_speed_before_m_per_s"], 0.5 * ratio
        impulse_per_mass = -1.5 * slip / (1 + 1 / q)
        spun = hit["spin_after_rad_per_s"] - hit["spin_before_rad_per_s"]
        assert spun == pytest.approx(impulse_per_mass / (q * 0.01), rel=1e-9)


@pytest.mark.parametrize("order", [3, 5])
def test_wall_lobes(order):
    """The disk never crosses R_c (1 + a cos n(azimuth - phi)) and touches it; a smooth elastic impact mirrors there."""
    scenario = replace(RING, impact=ImpactLaw(1.0, 0.0, 0.0), sample_rate_hz=2e5, duration_s=1.0)
    result = with_effect(scenario, "wall_lobes", amplitude=0.01, order=order, direction_rad=0.4)
    distance, azimuth = contact_radii(result)
    room = 0.04 * (1 + 0.01 * np.cos(order * (azimuth - 0.4))) - distance
    assert -1e-12 < np.min(room) < 1e-6
    assert np.ptp(azimuth[room < 1e-5]) > 1.0
    for hit in result.impacts[:20]:
        k = int(np.searchsorted(result.time_s, hit["time_s"]))
        velocity = np.array([[result.motion[f"nes_v{axis}_m_per_s"][i] for axis in "xy"] for i in (k - 1, k)])
        # the wall's normal by differences of its own equation
        around = azimuth[k] + np.array([-1e-6, 1e-6])
        edge = 0.04 * (1 + 0.01 * np.cos(order * (around - 0.4))) * np.array([np.cos(around), np.sin(around)])
        along = (edge[:, 1] - edge[:, 0]) / np.linalg.norm(edge[:, 1] - edge[:, 0])
        before, after = velocity @ along
        assert before == pytest.approx(after, abs=2e-3)
        before, after = velocity @ np.array([along[1], -along[0]])
        assert before == pytest.approx(-after, abs=2e-3) and before > 0.01


def test_lobes_and_ellipse_add_up():
    scenario = replace(RING, impact=ImpactLaw(1.0, 0.0, 0.0), sample_rate_hz=2e5, duration_s=1.0)
    both = {"wall_ellipticity": {"ellipticity": 0.01}, "wall_lobes": {"amplitude": 0.006}}
    distance, azimuth = contact_radii(simulate(replace(scenario, effects=both)))
    room = 0.04 * (1 + 0.01 * np.cos(2 * azimuth) + 0.006 * np.cos(3 * azimuth)) - distance
    assert -1e-12 < np.min(room) < 1e-6


def test_a_wall_of_many_fine_lobes_is_met_where_it_is():
    """A disk between the middle and the wall had been taken for one outside: the run went on without an end."""
    sizes = {9: 5e-3, 11: 5e-3, 12: 5e-3}
    waves = (Term("contact_radius", 0.04 * size, (Factor("azimuth", "cosine", n),)) for n, size in sizes.items())
    smooth = replace(RING, impact=ImpactLaw(1.0, 0.0, 0.0), sample_rate_hz=2e5, duration_s=1.0)
    distance, azimuth = contact_radii(simulate(replace(smooth, laws=(WrittenLaw(tuple(waves)),))))
    assert np.min(distance) < 0.6 * 0.04 < np.max(distance)
    room = 0.04 * (1 + sum(size * np.cos(n * azimuth) for n, size in sizes.items())) - distance
    assert -1e-12 < np.min(room) < 1e-6


SHAKEN = replace(
    RING, host=Host(0.05, motion="driven", drive=(Harmonic("x", 0.0164, 11.0, 0.3), Harmonic("z", 1e-3, 11.0, 1.0)))
)


def drive_x(time_s):
    return 0.0164 * np.sin(2 * math.pi * 11.0 * time_s + 0.3)


@pytest.mark.parametrize("scenario", [SHAKEN, RING], ids=["driven", "fixed"])
def test_host_recoil(scenario):
    """Between two impacts the Host swings about its drive as a damped oscillator, from the momentum of the first."""
    drive = drive_x if scenario is SHAKEN else np.zeros_like
    scenario = replace(scenario, sample_rate_hz=2e4, duration_s=0.2)
    shown = with_effect(scenario, "host_recoil", mass_kg=2.0, frequency_hz=20.0, damping_ratio=0.25)
    time, hits = shown.time_s, shown.impacts["time_s"]
    before = time < hits[0]
    assert np.allclose(shown.motion["host_x_m"][before], drive(time[before]), atol=1e-12)
    span = (time > hits[0] + 1e-9) & (time < hits[1])
    late, k = time[span] - hits[0], int(np.flatnonzero(span)[0])
    largest = 0.0
    # without friction the disk's velocity is constant but for the impact
    for axis, home in (("x", drive), ("y", np.zeros_like)):
        change = shown.motion[f"nes_v{axis}_m_per_s"][k] - shown.motion[f"nes_v{axis}_m_per_s"][k - 2]
        kick, omega = -0.02 / 2.0 * change, 2 * math.pi * 20.0
        damped = omega * math.sqrt(1 - 0.25**2)
        swing = kick / damped * np.exp(-0.25 * omega * late) * np.sin(damped * late)
        assert np.allclose(shown.motion[f"host_{axis}_m"][span] - home(time[span]), swing, atol=1e-8)
        largest = max(largest, np.ptp(swing))
    assert largest > 1e-5
    assert np.all(np.abs(shown.motion["host_angle_rad"]) < 1e-6)
    assert np.array_equal(shown.motion["host_z_m"], simulate(scenario).motion["host_z_m"])
    assert abs(shown.energy.relative_residual) < 1e-8


def test_a_heavy_host_does_not_recoil():
    shown, plain = with_effect(SHAKEN, "host_recoil", mass_kg=1e9), simulate(SHAKEN)
    early = plain.time_s < 0.2
    for name in ("nes_x_m", "nes_y_m", "host_x_m"):
        assert np.allclose(shown.motion[name][early], plain.motion[name][early], atol=1e-7)


SQUARE_M = ((0.05, -0.05), (0.05, 0.05), (-0.05, 0.05), (-0.05, -0.05))


def outward_normal_rad(azimuth_rad, wall):
    """Of the ring, the square or the cylinder in the middle, where the disk touches it."""
    if wall == "square":
        return 0.5 * math.pi * round(azimuth_rad / (0.5 * math.pi))
    return azimuth_rad + (math.pi if wall == "cylinder" else 0.0)


@pytest.mark.parametrize("wall", ["ring", "square", "cylinder"])
def test_host_ringing(wall):
    """After each impact the markers swing along the wall's normal as damped oscillators of a modal mass; the motion
    itself stays the same."""
    scenario = replace(SHAKEN, sample_rate_hz=2e4, duration_s=0.2)
    host, start = scenario.host, scenario.initial_nes
    if wall == "square":
        host, start = replace(host, radius_m=None, polygon_m=SQUARE_M), (0, 0, 2, 1.3, 0, 10)
    elif wall == "cylinder":
        host, start = replace(host, obstacle_radius_m=0.01), (0.025, 0, -3, 0.5, 0, 9)
    scenario = replace(scenario, host=host, initial_nes=start)
    plain = simulate(scenario)
    shown = with_effect(scenario, "host_ringing", mass_kg=0.5, frequency_hz=90.0, damping_ratio=0.1)
    assert np.array_equal(shown.impacts, plain.impacts)
    assert np.array_equal(shown.motion["nes_x_m"], plain.motion["nes_x_m"])
    root = (-0.1 + 1j * math.sqrt(0.99)) * 2 * math.pi * 90.0
    place, rate = np.zeros((len(plain.time_s), 2)), np.zeros((len(plain.time_s), 2))
    for hit in plain.impacts:
        late = plain.time_s - hit["time_s"]
        speed = 0.02 / 0.5 * (hit["normal_speed_before_m_per_s"] - hit["normal_speed_after_m_per_s"])
        wave = np.where(late > 0, np.exp(root * np.clip(late, 0, None)), 0.0)
        inside = wall == "cylinder" and hit["wall"] == 1
        normal = outward_normal_rad(hit["azimuth_rad"], "cylinder" if inside else wall.replace("cylinder", "ring"))
        towards = [math.cos(normal), math.sin(normal)]
        place += np.outer(speed * np.imag(wave) / root.imag, towards)
        rate += np.outer(speed * np.imag(root * wave) / root.imag, towards)
    for column, axis in enumerate("xy"):
        off = shown.motion[f"host_{axis}_m"] - plain.motion[f"host_{axis}_m"]
        assert np.allclose(off, place[:, column], atol=1e-15) and np.ptp(off) > 1e-6
        speed = shown.motion[f"host_v{axis}_m_per_s"] - plain.motion[f"host_v{axis}_m_per_s"]
        assert np.allclose(speed, rate[:, column], atol=1e-12)


@pytest.mark.parametrize("scenario", [SHAKEN, RING], ids=["driven", "fixed"])
def test_host_sway(scenario):
    values = {"amplitude_m": 2e-4, "frequency_hz": 0.7, "direction_rad": 0.5, "phase_rad": 1.1}
    shown, plain = with_effect(scenario, "host_sway", **values), simulate(scenario)
    sway = 2e-4 * np.sin(2 * math.pi * 0.7 * plain.time_s + 1.1)
    assert np.allclose(shown.motion["host_x_m"] - plain.motion["host_x_m"], math.cos(0.5) * sway, atol=1e-15)
    assert np.allclose(shown.motion["host_y_m"] - plain.motion["host_y_m"], math.sin(0.5) * sway, atol=1e-15)
    # the wall sways, too: the disk turns back there
    reach = np.hypot(*(shown.motion[f"nes_{a}_m"] - shown.motion[f"host_{a}_m"] for a in "xy"))
    assert 0.039 < np.max(reach) < 0.04 + 1e-12


def test_motion_blur():
    plain = simulate(SHAKEN)
    shown = simulate(replace(SHAKEN, effects={"motion_blur": {"sd_s": 2e-5}}), np.random.default_rng(4))
    errors = []
    for body in ("nes", "host"):
        speed = np.hypot(*(plain.motion[f"{body}_v{a}_m_per_s"] for a in "xy"))
        for axis in "xy":
            errors.append((shown.motion[f"{body}_{axis}_m"] - plain.motion[f"{body}_{axis}_m"]) / speed)
    assert np.allclose(np.std(errors, axis=1), 2e-5, rtol=0.08)
    assert abs(np.corrcoef(errors)[np.triu_indices(4, 1)]).max() < 0.1
    turned = (shown.motion["nes_angle_rad"] - plain.motion["nes_angle_rad"]) / plain.motion["nes_spin_rad_per_s"]
    assert np.std(turned) == pytest.approx(2e-5, rel=0.08)


@pytest.mark.parametrize(
    ("name", "values", "said"),
    [
        ("wall_lobes", {"amplitude": 0.01, "order": 3.5}, "whole number"),
        ("wall_lobes", {"amplitude": 0.01, "order": 2.0}, "order"),
        ("wall_lobes", {"amplitude": 0.05, "order": 6.0}, "bends inwards"),
        ("inertia_error", {"ratio": 0.0}, "ratio"),
        ("host_recoil", {"mass_kg": 0.0}, "mass_kg"),
        ("host_recoil", {"mass_kg": 1.0, "damping_ratio": 0.0}, "damping_ratio"),
        ("host_ringing", {"mass_kg": 1.0, "frequency_hz": 90.0, "damping_ratio": 1.0}, "damping_ratio"),
        ("host_sway", {"amplitude_m": 1e-3}, "without frequency_hz"),
        ("nes_rocking", {"relative": -1.5}, "relative"),
        ("nes_rocking", {"relative": 0.5, "decay_s": 0.0}, "decay_s"),
        ("motion_blur", {"sd_s": -1e-5}, "sd_s"),
    ],
)
def test_nonsense_is_refused(name, values, said):
    with pytest.raises(ScenarioError, match=said):
        with_effect(RING, name, **values)


def test_effects_that_a_host_cannot_have_are_refused():
    free = replace(RING, host=Host(0.05, motion="free", mass_kg=1.0))
    for name, values in (
        ("host_recoil", {"mass_kg": 1.0}),
        ("host_sway", {"amplitude_m": 1e-3, "frequency_hz": 1.0}),
    ):
        with pytest.raises(ScenarioError, match=name):
            with_effect(free, name, **values)
    square = Host(polygon_m=((0.05, -0.05), (0.05, 0.05), (-0.05, 0.05), (-0.05, -0.05)))
    with pytest.raises(ScenarioError, match="flat walls"):
        with_effect(replace(RING, host=square), "wall_lobes", amplitude=0.01)


def test_refusals():
    with pytest.raises(ScenarioError, match="no_such"):
        with_effect(RING, "no_such", size=1.0)
    with pytest.raises(ScenarioError, match="without coefficient"):
        with_effect(RING, "floor_friction")
    with pytest.raises(ScenarioError, match="rate_per_s"):
        with_effect(RING, "viscous_drag", rate_per_s=-1.0)
    with pytest.raises(ScenarioError, match="vertical_motion"):
        with_effect(RING, "vertical_motion", amplitude_m=1e-3)
