"""The blind plant is right by closed forms, by the practice truths, and shares nothing with the simulator."""

import ast
import json
from pathlib import Path

import numpy as np
import pytest
from scipy.special import ellipe, ellipk

from analysis.blind.plant import dynamics
from analysis.blind.plant.dynamics import START_S, host_at, run_plant, state_at
from analysis.blind.plant.flight.disk_friction import disk_friction_table
from analysis.blind.plant.host import host_pose
from analysis.blind.plant.parameters import PlantParameters

ROOT = Path(__file__).resolve().parents[4]
TRUTH = ROOT.parent / "shared" / "practice_truth"
STILL = np.array([[0.0, 0.0, 1.0, 0.0]])
BARE = PlantParameters(floor_friction=0.0, restitution=0.7)


def test_plant_imports_nothing_of_the_simulator():
    for path in (ROOT / "analysis" / "blind").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            compiler = ["ovines.core.compiled"]  # how code is compiled and kept, no physics
            assert not [n for n in names if n.startswith(("ovines.core", "analysis.gap")) and n not in compiler], (
                path.name
            )


def test_disk_friction_agrees_with_elliptic_integrals():
    """Farkas et al. in the stable form of ERRATA.md. The quadrature is off by 2.5e-5 at worst (near ratio
    1)."""
    angle = np.linspace(0.0, np.pi / 2, 1025)[1:-1]
    ratio = 1.0 / np.tan(angle)
    k = np.minimum(ratio, 1.0 / ratio)
    e, first = ellipe(k**2), ellipk(k**2)
    b, d = (e - (1 - k**2) * first) / k**2, (first - e) / k**2
    c = (d - b) / k**2
    slow = ratio <= 1.0
    force = np.where(slow, 4 * k / (3 * np.pi) * (b + e), 4 / (3 * np.pi) * (e + b))
    spinning = 4 / (9 * np.pi) * ((4 - 2 * k**2) * e - (1 - k**2) * first)
    torque = np.where(slow, spinning, 4 * k / (9 * np.pi) * (c + 3 * b - d))
    table = disk_friction_table()
    assert np.abs(table[1:-1, 0] - force).max() < 5e-5
    assert np.abs(table[1:-1, 1] - torque).max() < 5e-5
    assert table[0] == pytest.approx([1.0, 0.0], abs=1e-12)
    assert table[-1] == pytest.approx([0.0, 2.0 / 3.0], abs=1e-12)


def _after(parameters, start, duration_s, harmonics=STILL):
    motion = run_plant(parameters, harmonics, np.array(start, dtype=float), duration_s, np.random.default_rng(0))
    return motion, state_at(motion, np.array([duration_s - 1e-9]))[0]


def test_coulomb_slide_slows_at_mu_g():
    plain = BARE._replace(floor_friction=0.3, spin_share=0.0)
    _, end = _after(plain, [-0.03, 0.0, 0.5, 0.0, 0.0, 20.0], 0.05)
    assert end[2] == pytest.approx(0.5 - 0.3 * 9.81 * (0.05 - START_S), abs=1e-6)
    assert end[5] == 20.0  # plain Coulomb leaves the spin alone


def test_head_on_impact_returns_restitution():
    motion, end = _after(BARE, [0.03, 0.0, 1.0, 0.0, 0.0, 0.0], 0.02)
    assert motion.impacts[0] == pytest.approx([START_S + 0.01, 1.0, 0.0], abs=1e-9)
    assert end[2] == pytest.approx(-0.7, abs=1e-9)


@pytest.mark.parametrize(("spin", "sticks"), [(30.0, True), (400.0, False)])
def test_tangential_impulse_is_reversal_or_coulomb_limit(spin, sticks):
    """Head-on with spin: slip R w. Below the limit it comes back as -beta; above it changes by 3 mu (1 + e)
    v."""
    _, end = _after(BARE, [0.03, 0.0, 1.0, 0.0, 0.0, spin], 0.02)
    slip = 0.01 * spin
    slip_after = end[3] + 0.01 * end[5]
    expected = -BARE.tangential_restitution * slip if sticks else slip - 3.0 * BARE.wall_friction * 1.7
    assert slip_after == pytest.approx(expected, abs=1e-9)


def test_finite_contact_lasts_its_time_and_rebounds_as_the_closed_form():
    """The wall never pulls, so the disk leaves a little faster than after the full half period: Schwager and
    Poeschel, Granular Matter 9, 465 (2007), damped spring without attraction."""
    soft = BARE._replace(contact_time_s=8e-4)
    motion, end = _after(soft, [0.03, 0.0, 1.0, 0.0, 0.0, 0.0], 0.02)
    loss = -np.log(0.7) / np.pi
    ratio = loss / np.hypot(1.0, loss)
    leaves = np.exp(-ratio / np.sqrt(1 - ratio**2) * (np.pi - 2 * np.arcsin(ratio)))
    assert -end[2] == pytest.approx(leaves, abs=1e-3)
    inside = motion.nodes[motion.nodes[:, 7] == 1.0, 0]
    assert np.ptp(inside) == pytest.approx(8e-4, abs=1e-4)


def test_host_that_gives_swings_back_from_an_impact_as_the_closed_form():
    """Head-on at 1 m/s: the disk's momentum changes by m (1 + e), the Host's by the opposite."""
    gives = BARE._replace(recoil_kg=5.0, recoil_rad_per_s=40.0, recoil_damping=0.3)
    motion, _ = _after(gives, [0.03, 0.0, 1.0, 0.0, 0.0, 0.0], 0.06)
    time_s = np.linspace(0.0, 0.055, 30)
    late = np.maximum(time_s - motion.impacts[0, 0], 0.0)
    swing = 40.0 * np.sqrt(1 - 0.3**2)
    expected = 0.0246 * 1.7 / 5.0 * np.exp(-12.0 * late) * np.sin(swing * late) / swing
    assert host_at(motion, time_s)[:, 0] == pytest.approx(expected, abs=1e-9)
    assert len(motion.impacts) == 1 and np.all(host_at(motion, time_s)[:, 1] == 0.0)


def test_lobed_wall_stops_the_disk_where_its_formula_says():
    lobed = BARE._replace(lobes=0.004, lobe_order=3.0, lobe_phase_rad=0.4)
    motion, _ = _after(lobed, [0.03, 0.0, 1.0, 0.0, 0.0, 0.0], 0.02)
    reach = 0.04 * (1 + 0.004 * np.cos(3 * 0.4))
    assert motion.impacts[0, 0] == pytest.approx(START_S + reach - 0.03, abs=1e-9)


def test_still_host_never_gives_energy():
    start = [0.01, 0.005, 1.2, 0.7, 0.0, 80.0]
    motion, _ = _after(PlantParameters(restitution_scatter=0.0), start, 0.6)
    n = motion.nodes
    energy = 0.5 * (n[:, 3] ** 2 + n[:, 4] ** 2) + 0.25 * (0.01 * n[:, 6]) ** 2
    assert np.diff(energy).max() < 1e-12
    assert np.hypot(n[:, 1], n[:, 2]).max() < 0.04 + 1e-9


def _practice_parameters(plant):
    names = {
        "restitution": "eps",
        "wall_friction": "mu_c",
        "tangential_restitution": "beta0",
        "floor_friction": "mu_s",
        "tilt_x_m_per_s2": "tilt_ax",
        "tilt_y_m_per_s2": "tilt_ay",
        "ellipticity": "ell_e",
        "ellipticity_phase_rad": "ell_phi",
        "restitution_floor": "eps_inf",
        "restitution_speed_m_per_s": "eps_vs",
        "air_per_m": "quad_drag",
        "central_per_s2": "unk_a",
    }
    return PlantParameters(**{ours: plant[theirs] for ours, theirs in names.items() if theirs in plant})


@pytest.mark.skipif(not TRUTH.exists(), reason="the practice truths are not beside the checkout")
@pytest.mark.parametrize("case", [3, 4, 5, 8, 9, 13, 15])
def test_flights_and_impacts_agree_with_the_practice_truths(case):
    """Ten milliseconds from a true state, with and without an impact, land on the next true state. Two
    plants that share no code; scatter of the restitution (case 13) leaves flights only."""
    truth = json.loads((TRUTH / f"practice-{case:02d}.json").read_text())
    arrays = np.load(TRUTH / f"practice-{case:02d}.npz")
    parameters = _practice_parameters(truth["plant"])
    worst, compared = 0.0, 0
    for run in (1, 2):
        state, host = arrays[f"state{run:02d}"], arrays[f"H{run:02d}"]
        impacts, held = arrays[f"imp{run:02d}"][:, 0], arrays[f"held{run:02d}"]
        for k in range(0, len(state) - 9, 16):
            begin, end = k / 800.0, (k + 8) / 800.0
            if any(a < end and b > begin for a, b in held):
                continue
            if truth["plant"]["eps_sd"] > 0 and ((impacts > begin) & (impacts < end)).any():
                continue
            shifted = host.copy()
            shifted[:, 3] += shifted[:, 2] * (begin - START_S)
            start = state[k, :6].copy()
            start[:2] -= host_pose(START_S, shifted)[0][:2]
            duration = 0.01 + dynamics.START_S
            motion = run_plant(parameters, shifted, start, duration, np.random.default_rng(0))
            worst = max(worst, np.abs(state_at(motion, np.array([duration]))[0, :2] - state[k + 8, :2]).max())
            compared += 1
    assert compared > 30
    assert worst < 2e-6
