"""Random driven, free and sprung scenarios: inside the wall, energy in balance, momentum kept, always an end."""

import math

import numpy as np
import pytest

from ovines.core import FloorFriction, Harmonic, Host, ImpactLaw, Nes, Scenario, Suspension, simulate

TRIANGLE = ((-0.07, -0.05), (0.07, -0.05), (0.0, 0.08))


def random_scenario(rng, motion, **shape):
    """A disk of 1 cm in a Host of about 5 cm, shaken, with floor and wall friction."""
    drive = (Harmonic("x", rng.uniform(0.002, 0.02), rng.uniform(5, 15)), Harmonic("rotation", 0.1, rng.uniform(5, 30)),
             Harmonic("z", rng.uniform(0, 8e-4), 11.0, 1.0))  # fmt: skip
    more = {"driven": {"drive": drive}, "free": {}, "sprung": {}}[motion]
    if motion == "sprung":
        ground = (Harmonic("x", 0.004, rng.uniform(5, 12)),)
        more = {"suspension": Suspension((300.0, 300.0, 0.3), (0.3, 0.3, 3e-4), ground)}
    host = Host(motion=motion, mass_kg=0.1, inertia_factor=0.8, **more, **shape)
    angle, r = rng.uniform(0, 2 * math.pi), rng.uniform(0.019, 0.038) if "radius_m" in shape else 0.005
    law = ImpactLaw(rng.uniform(0, 1), rng.uniform(0, 1), rng.uniform(-1, 1))
    friction = FloorFriction(rng.uniform(0, 0.4), rng.choice(["farkas", "coulomb"]))
    start = (r * math.cos(angle), r * math.sin(angle), rng.normal(), rng.normal(), 0.0, 50 * rng.normal())
    return Scenario("random", Nes(0.01, 0.0246), host, law, 0.3, friction, start)


@pytest.mark.parametrize("motion", ["driven", "free", "sprung"])
@pytest.mark.parametrize("shape", ["round", "obstacle", "triangle"])
def test_random_runs(motion, shape):
    sizes = {"round": {"radius_m": 0.05}, "obstacle": {"radius_m": 0.05, "obstacle_radius_m": 0.008},
             "triangle": {"polygon_m": TRIANGLE}}  # fmt: skip
    rng = np.random.default_rng(sum(map(ord, motion + shape)))
    impacts = 0
    for _ in range(12):
        result = simulate(random_scenario(rng, motion, **sizes[shape]))
        m = result.motion
        impacts += len(result.impacts)
        assert abs(result.energy.relative_residual) < 1e-9
        if shape != "triangle":
            distance = np.hypot(m["nes_x_m"] - m["host_x_m"], m["nes_y_m"] - m["host_y_m"])
            far = max(1.0, float(np.max(np.abs(m["host_x_m"]))) / 0.05, float(np.max(np.abs(m["host_y_m"]))) / 0.05)
            assert np.max(distance) <= 0.04 * (1 + 2e-15 * far)
            assert shape != "obstacle" or np.min(distance) >= 0.018 * (1 - 4e-15 * far)
        if motion == "free":
            for axis in ("vx", "vy"):
                total = 0.0246 * m[f"nes_{axis}_m_per_s"] + 0.1 * m[f"host_{axis}_m_per_s"]
                assert np.ptp(total) < 1e-13
    assert impacts > 12


def test_rest_in_a_corner():
    """Gravity into the tip of a triangle: it bounces, then lies on both walls."""
    host = Host(polygon_m=((0.0, -0.08), (0.07, 0.05), (-0.07, 0.05)))
    scenario = Scenario("tip", Nes(0.01, 0.02), host, ImpactLaw(0.5, 0.3, 0.3), 1.0, None,
                        (0.01, 0.0, 0.0, 0.0, 0.0, 3.0), gravity_m_per_s2=(0.0, -9.81))  # fmt: skip
    result = simulate(scenario)
    m = result.motion
    half = math.atan2(0.07, 0.13)  # half the tip's angle: the centre lies R / sin(half) above it
    assert m["nes_x_m"][-1] == pytest.approx(0.0, abs=1e-12)
    assert m["nes_y_m"][-1] == pytest.approx(-0.08 + 0.01 / math.sin(half), abs=1e-12)
    assert result.contacts[-1, 1] == 1.0
