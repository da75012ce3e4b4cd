"""Sensitivities against 50 digits (mpmath, written apart), closed forms, and differences of plain runs."""

import math
from dataclasses import replace

import mpmath as mp
import numpy as np
import pytest

from ovines.core import FloorFriction, Harmonic, Host, ImpactLaw, Nes, Scenario, Suspension, simulate
from ovines.core.refusal import ScenarioError
from ovines.core.sensitivity.columns import row_of
from ovines.core.sensitivity.flight_slopes import floor_slopes
from ovines.core.sensitivity.run import STATES, sensitivities
from ovines.core.system.friction import farkas, farkas_slope, floor_friction
from ovines.core.system.named import named_scenario

GOAL = 1e-8  # issue 22: against mpmath differences on the smooth named scenarios
MOVED = mp.mpf(10) ** -20


class Exact:
    """A disk in a round ring, frictionless flights, Luding's law, 50 digits: a free ring, or one on springs over
    a ground that shakes along y.  Numbers are those of the scenario, moved by name.
    """

    def __init__(self, scenario, name=None, by=0):
        mp.mp.dps = 50
        nes, host, law = scenario.nes, scenario.host, scenario.impact
        n = {
            "nes_radius_m": nes.radius_m, "nes_mass_kg": nes.mass_kg, "restitution": law.restitution,
            "wall_friction": law.wall_friction, "tangential_restitution": law.tangential_restitution,
            "drive_amplitude_factor": 1.0, "drive_frequency_factor": 1.0, "drive_phase_shift_rad": 0.0,
        }  # fmt: skip
        n = {key: mp.mpf(value) for key, value in n.items()}
        state = [mp.mpf(value) for value in (*scenario.initial_nes, *scenario.initial_host)]
        if name in n:
            n[name] += by
        elif name is not None:
            state[row_of(name)] += by
        self.n, self.z, self.t = n, state, mp.mpf(0)
        self.gravity = [mp.mpf(g) for g in scenario.gravity_m_per_s2]
        self.room = mp.mpf(host.radius_m) - n["nes_radius_m"]
        self.heavy = mp.mpf(host.mass_kg) if host.mass_kg else mp.inf
        self.mass, self.q = n["nes_mass_kg"], mp.mpf(nes.inertia_factor)
        self.host_inertia = mp.mpf(host.inertia_factor) * self.heavy * mp.mpf(host.radius_m) ** 2
        self.ground = None
        if host.suspension is not None:
            (sine,) = host.suspension.ground
            self.k, self.c = mp.mpf(host.suspension.stiffness[0]), mp.mpf(host.suspension.damping[0])
            self.omega = mp.mpf(2.0 * math.pi * sine.frequency_hz) * n["drive_frequency_factor"]
            self.ground = mp.mpf(sine.amplitude) * n["drive_amplitude_factor"]

    def steady(self, axis, t):
        if axis != 1:
            return mp.mpf(0), mp.mpf(0)
        k, c, w = self.k / self.heavy, self.c / self.heavy, self.omega
        z = self.ground * (k + 1j * c * w) / (k - w * w + 1j * c * w)
        z *= mp.expj(w * t + self.n["drive_phase_shift_rad"])
        return mp.im(z), w * mp.re(z)

    def axis_after(self, q, v, axis, inertia, s):
        if self.ground is None:
            return q + v * s, v
        k, c = self.k / inertia, self.c / inertia
        q0, v0 = self.steady(axis, self.t)
        q1, v1 = self.steady(axis, self.t + s)
        root = mp.mpc(-c / 2, mp.sqrt(k - c * c / 4))
        a = mp.mpc(q - q0, -((v - v0) + c / 2 * (q - q0)) / mp.im(root)) * mp.exp(root * s)
        return mp.re(a) + q1, mp.re(a * root) + v1

    def after(self, s):
        z = list(self.z)
        for i in (0, 1):
            z[i] += s * (z[2 + i] + s * self.gravity[i] / 2)
            z[2 + i] += s * self.gravity[i]
        z[4] += s * z[5]
        for axis, (at, rate) in enumerate(((6, 8), (7, 9), (10, 11))):
            inertia = self.host_inertia if axis == 2 else self.heavy
            z[at], z[rate] = self.axis_after(self.z[at], self.z[rate], axis, inertia, s)
        return z

    def gap(self, s):
        z = self.after(s)
        return self.room**2 - (z[0] - z[6]) ** 2 - (z[1] - z[7]) ** 2

    def strike(self):
        z, n = self.z, self.n
        nx, ny = (z[0] - z[6]) / self.room, (z[1] - z[7]) / self.room
        vx, vy = z[2] - z[8], z[3] - z[9]
        reach, radius = self.room + n["nes_radius_m"], n["nes_radius_m"]
        normal = vx * nx + vy * ny
        slip = vy * nx - vx * ny + radius * z[5] - reach * z[11]
        both = 1 / self.mass + 1 / self.heavy
        p_n = -(1 + n["restitution"]) * normal / both
        own = self.q * self.mass * radius**2
        p_t = -(1 + n["tangential_restitution"]) * slip / (both + radius**2 / own + reach**2 / self.host_inertia)
        limit = n["wall_friction"] * abs(p_n)
        p_t = p_t if abs(p_t) <= limit else -mp.sign(slip) * limit
        fx, fy = p_n * nx - p_t * ny, p_n * ny + p_t * nx
        z[2], z[3], z[5] = z[2] + fx / self.mass, z[3] + fy / self.mass, z[5] + radius * p_t / own
        z[8], z[9] = z[8] - fx / self.heavy, z[9] - fy / self.heavy
        z[11] -= reach * p_t / self.host_inertia

    def run(self, impacts, end):
        """Through the impacts near the given times (known from a plain run), to ``end``: times and state."""
        times = []
        for near in impacts:
            s = mp.findroot(self.gap, mp.mpf(near) - self.t, tol=mp.mpf(10) ** -80)
            self.z = self.after(s)
            self.t += s
            self.strike()
            times.append(self.t)
        return times, self.after(mp.mpf(end) - self.t)


SMOOTH = {
    "table-2": 20.0, "table-4-positive": 20.0, "table-4-negative": 20.0, "table-6": 15.0, "table-7": 0.25,
    "table-9": 0.3, "table-10": 0.3, "table-11": 0.05, "table-13": 260.0,
}  # fmt: skip


@pytest.mark.others_further
@pytest.mark.parametrize("name", list(SMOOTH))
def test_against_differences_in_50_digits(name):
    """Every derivative of state and impact times within 1e-8 of the largest of its column, through up to 8 impacts."""
    scenario = named_scenario(name)
    times = sensitivities(scenario, times_s=[SMOOTH[name]], by=["nes_x_m"]).impact_time_s[:8]
    end = float(times[-1]) + 1e-3 * SMOOTH[name]
    found = sensitivities(scenario, times_s=[end])
    assert len(found.impact_time_s) == len(times) > 1
    assert np.isin(["nes_x_m", "nes_vy_m_per_s", "restitution", "nes_radius_m", "host_vx_m_per_s"], found.names).all()
    for j, by in enumerate(found.names):
        if by == "wall_friction" and scenario.impact.wall_friction == 0.0:
            continue  # at its bound: one side only
        (up_times, up), (down_times, down) = (
            Exact(scenario, by, side * MOVED).run(found.impact_time_s, end) for side in (1, -1)
        )
        state = np.array([float((a - b) / (2 * MOVED)) for a, b in zip(up, down, strict=True)])
        delays = np.array([float((a - b) / (2 * MOVED)) for a, b in zip(up_times, down_times, strict=True)])
        assert np.max(np.abs(found.by[-1, :, j] - state)) <= GOAL * max(1.0, np.max(np.abs(state))), by
        worst = np.max(np.abs(found.impact_time_by[:, j] - delays))
        assert worst <= GOAL * max(1.0, np.max(np.abs(delays))), by


def test_through_a_chatter_to_its_end():
    """Table 3: the impacts pile up at T = t (1 + e)/(1 - e), t the fall; then the disk lies still."""
    found = sensitivities(named_scenario("table-3"), by=["nes_y_m", "restitution"], times_s=[30.0])
    fall, e = math.sqrt(2 * 9 / 9.81), 0.9
    assert len(found.impact_time_s) > 130
    right = [(1 + e) / (1 - e) / (9.81 * fall), 2 * fall / (1 - e) ** 2]
    # what is left of the series falls as 0.9^n, times n for the restitution
    assert found.impact_time_by[-1] == pytest.approx(right, rel=2e-4)
    assert np.abs(found.by[-1]).max() < 1e-9


def test_coulomb_stop_in_closed_form():
    """sinh(v/v_d) = sinh(v0/v_d) exp(-mu g t/v_d), the regularised law's own solution."""
    mp.mp.dps = 60
    scenario = named_scenario("coulomb-stop", tolerance=1e-13)
    names = ("nes_vx_m_per_s", "floor_friction")

    def solved(v0, mu, t):
        slow = mp.mpf(scenario.friction.regularisation_m_per_s)
        start = mp.sinh(v0 / slow)
        return slow * mp.asinh(start * mp.exp(-mu * 10 * t / slow))

    v0, mu, h = mp.mpf(scenario.initial_nes[2]), mp.mpf("0.5"), mp.mpf(10) ** -25
    for t in (0.3, 0.6, 0.6320, 0.6325):
        found = sensitivities(scenario, by=names, times_s=[t])
        by_speed = (solved(v0 + h, mu, t) - solved(v0 - h, mu, t)) / (2 * h)
        by_friction = (solved(v0, mu + h, t) - solved(v0, mu - h, t)) / (2 * h)
        assert found.by[-1, 2] == pytest.approx([float(by_speed), float(by_friction)], rel=1e-8, abs=1e-8)


@pytest.mark.further
def test_slopes_of_the_floor_friction():
    """Farkas' slopes and the whole friction against differences in 40 digits of the elliptic forms."""
    mp.mp.dps = 40

    def exact(r):
        k = r if r <= 1 else 1 / r
        big_k, big_e = mp.ellipk(k * k), mp.ellipe(k * k)
        if r <= 1:
            return 4 / (3 * mp.pi * k) * ((1 + k * k) * big_e - (1 - k * k) * big_k)
        return 4 / (3 * mp.pi * k * k) * ((1 + k * k) * big_e - (1 - k * k) * big_k)

    for ratio in (1e-6, 0.01, 0.3, 0.97, 1.02, 3.0, 100.0):
        r, h = mp.mpf(ratio), mp.mpf(10) ** -15
        force, torque, steep = farkas_slope(ratio)
        assert (force, torque) == pytest.approx(farkas(ratio), rel=1e-14)
        assert steep == pytest.approx(float((exact(r + h) - exact(r - h)) / (2 * h)), rel=1e-12, abs=1e-15)
    rng = np.random.default_rng(5)
    for _ in range(40):
        v = rng.normal(size=3) * 10.0 ** rng.uniform(-4, 1, 3) * (1, 1, 50)
        coupling, out = rng.choice([0.0, 0.4, 1.0]), np.zeros(15)
        floor_slopes(*v, 0.02, 1e-3, coupling, out)
        assert out[:3] == pytest.approx(floor_friction(*v, 0.02, 1.0, 1e-3, coupling), rel=1e-12, abs=1e-15)
        for i in range(3):
            step = np.zeros(3)
            step[i] = 1e-5 * np.hypot(np.linalg.norm(v[:2]), 0.02 * abs(v[2])) * (1 if i < 2 else 50)
            up = np.array(floor_friction(*(v + step), 0.02, 1.0, 1e-3, coupling))
            down = np.array(floor_friction(*(v - step), 0.02, 1.0, 1e-3, coupling))
            slopes = out[[3 + i, 7 + i, 11 + i]]
            assert slopes == pytest.approx((up - down) / (2 * step[i]), rel=1e-4, abs=1e-4 * np.abs(slopes).max())


SHAKEN = (
    Harmonic("x", 0.018, 11.0, 0.3), Harmonic("y", 0.005, 7.0, 1.0), Harmonic("rotation", 0.05, 5.0, 0.2),
    Harmonic("z", 0.0005, 11.0, 0.2),
)  # fmt: skip
LAW, FLOOR, DISK = ImpactLaw(0.7, 0.13, 0.5), FloorFriction(0.2), Nes(0.01, 0.02)
START = (0.03, -0.01, 0.6, 0.4, 0.0, 5.0)
TRIANGLE = ((-0.07, -0.05), (0.07, -0.05), (0.0, 0.08))
PLAIN = {
    "held along the wall": named_scenario("rig", duration_s=0.5),
    "turned, shaken up and down, obstacle": Scenario(
        "", DISK, Host(0.05, obstacle_radius_m=0.01, motion="driven", drive=SHAKEN), LAW, 0.2, FLOOR, START
    ),
    "free": Scenario("", DISK, Host(0.05, motion="free", mass_kg=0.1), LAW, 0.2, FLOOR, START),
    "triangle": Scenario(
        "", DISK, Host(polygon_m=TRIANGLE, motion="driven", drive=SHAKEN), LAW, 0.15, FLOOR, (0, 0, 0.3, 0.2, 0, 5.0)
    ),
    "free triangle": Scenario(
        "", DISK, Host(polygon_m=TRIANGLE, motion="free", mass_kg=0.2), LAW, 0.3, None, (0, 0, 0.5, 0.2, 0, 5.0)
    ),
    "sprung, held, friction": Scenario(
        "", DISK,
        Host(0.05, motion="sprung", mass_kg=0.1, suspension=Suspension((400.0, 300.0, 0.1), (0.1, 0.2, 1e-4),
                                                                       SHAKEN[:3])),
        LAW, 0.25, FLOOR, START,
    ),
    "drag, tilt, a restitution that varies, held": Scenario(
        "", DISK, Host(0.05, motion="driven", drive=SHAKEN[:2]), LAW, 0.3, None, START,
        effects={
            "viscous_drag": {"rate_per_s": 0.5}, "air_drag": {"rate_per_m": 0.2},
            "table_tilt": {"tilt_rad": 0.02}, "restitution_drift": {"relative_per_s": -0.3},
            "speed_dependent_restitution": {"restitution_fast": 0.5},
            "direction_dependent_restitution": {"amplitude": 0.05, "direction_rad": 0.7},
        },
    ),
}  # fmt: skip


def moved(scenario, name, by):
    """The scenario with one named thing changed."""
    if name in ("restitution", "wall_friction", "tangential_restitution"):
        return replace(scenario, impact=replace(scenario.impact, **{name: getattr(scenario.impact, name) + by}))
    if name == "floor_friction":
        return replace(scenario, friction=replace(scenario.friction, coefficient=0.2 + by))
    if name in ("nes_radius_m", "nes_mass_kg"):
        field = name.removeprefix("nes_")
        return replace(scenario, nes=replace(scenario.nes, **{field: getattr(scenario.nes, field) + by}))
    if name == "host_radius_m":
        return replace(scenario, host=replace(scenario.host, radius_m=scenario.host.radius_m + by))
    if name.startswith("drive"):
        sines = scenario.host.drive or scenario.host.suspension.ground
        changed = tuple(
            replace(one, amplitude=one.amplitude * (1 + by)) if "amplitude" in name
            else replace(one, frequency_hz=one.frequency_hz * (1 + by)) if "frequency" in name
            else replace(one, phase_rad=one.phase_rad + by)
            for one in sines
        )  # fmt: skip
        if scenario.host.drive:
            return replace(scenario, host=replace(scenario.host, drive=changed))
        return replace(scenario, host=replace(scenario.host, suspension=replace(scenario.host.suspension,
                                                                               ground=changed)))  # fmt: skip
    row = row_of(name)
    field = "initial_nes" if row < 6 else "initial_host"
    values = list(getattr(scenario, field))
    values[row % 6] += by
    return replace(scenario, **{field: tuple(values)})


UNITS = np.array([1.0, 1.0, 10.0, 10.0, 10.0, 100.0])  # m, m/s, rad, rad/s that weigh alike


@pytest.mark.further
@pytest.mark.parametrize("case", list(PLAIN))
def test_against_differences_of_plain_runs(case):
    """Friction, contact, every kind of Host: what is left is the differences' own error, so that the best of four steps
    counts (rounding and tolerance over the step, times the growth of errors in the run; the step's square).
    """
    scenario = replace(PLAIN[case], tolerance=1e-13, sample_rate_hz=1.0 / PLAIN[case].duration_s)
    found = sensitivities(scenario, times_s=[scenario.duration_s])
    contacts = len(simulate(scenario).contacts)
    assert (contacts > 0) == ("held" in case)

    def end(name, by):
        result = simulate(moved(scenario, name, by))
        assert len(result.impacts) == len(found.impact_time_s)
        return np.array([result.motion[column][-1] for column in STATES])

    for j, name in enumerate(found.names):
        least = np.inf
        for by in (1e-9, 1e-8, 1e-7, 1e-6):
            differences = (end(name, by) - end(name, -by)) / (2 * by)
            off = np.abs(found.by[-1, :, j] - differences).reshape(2, 6) / UNITS
            least = min(least, np.max(off) / max(1.0, np.max(np.abs(differences.reshape(2, 6)) / UNITS)))
        assert least < 2e-5, name


def test_a_graze_is_refused():
    """A straight path past an obstacle: 0.1 nm too deep to miss it, and not refused 1 mm deeper."""
    host = Host(0.05, obstacle_radius_m=0.01)

    def past(depth_m):
        return Scenario("", DISK, host, LAW, 0.05, initial_nes=(-0.03, 0.02 - depth_m, 1.0, 0.0, 0.0, 0.0))

    assert len(sensitivities(past(1e-3)).impact_time_s) == 1
    with pytest.raises(ScenarioError, match="grazes a wall at 0.0299999"):
        sensitivities(past(1e-13))


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"by": ["nes_x"]}, "nes_x"),
        ({"by": ["restitution", "restitution"]}, "restitution"),
        ({"by": ["host_x_m"]}, "host_x_m"),
        ({"times_s": [0.2, 0.1]}, "times_s"),
        ({"times_s": [np.nan]}, "times_s"),
    ],
)
def test_what_means_nothing_is_refused(change, word):
    with pytest.raises(ScenarioError, match=word):
        sensitivities(named_scenario("rig"), **change)


@pytest.mark.parametrize("effect", ["mass_centre_offset", "finite_contact_time", "nes_rocking", "wall_ellipticity"])
def test_effects_left_out_are_refused(effect):
    values = {"mass_centre_offset": {"x_m": 1e-3}, "finite_contact_time": {"duration_s": 1e-3},
              "nes_rocking": {"relative": 0.5}, "wall_ellipticity": {"ellipticity": 0.01}}  # fmt: skip
    with pytest.raises(ScenarioError, match=effect):
        sensitivities(named_scenario("rig", effects={effect: values[effect]}))
