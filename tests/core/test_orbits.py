"""Lyapunov exponents, periodic orbits, sections and basins against closed forms and published results."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from ovines.core import Harmonic, Host, ImpactLaw, Nes, Scenario
from ovines.core.orbits.lyapunov import lyapunov
from ovines.core.orbits.period import changed, drive_period_s
from ovines.core.orbits.periodic import follow_orbit, periodic_orbit
from ovines.core.orbits.section import basins, bifurcation, section
from ovines.core.refusal import ScenarioError
from ovines.core.system.named import named_scenario

LINE = ["host_x_m", "host_vx_m_per_s"]
OSCILLATOR = named_scenario("impact-oscillator")


def impact_speed(omega, restitution, n=1, sigma=0.0):
    """Speed before the one impact in n periods of x'' + x = cos(omega t), x < sigma, closed form; the sign of the
    discriminant that gives a positive speed (Budd and Dux 1994).
    """
    gain, tangent = 1 / (1 - omega**2), math.tan(math.pi * n / omega)
    a = (1 + restitution) / (2 * tangent)
    b = (1 - restitution) / (2 * omega)
    whole = a * a + b * b
    root = math.sqrt((a * sigma) ** 2 - whole * (sigma**2 - gain**2))
    return (-a * sigma + root) / whole


def test_closed_form_of_the_impact_oscillator():
    """The orbit's speed, that it is stable, and the product of its multipliers: restitution squared, no damping."""
    orbit = periodic_orbit(OSCILLATOR, LINE)
    assert orbit.impact_speed_m_per_s == pytest.approx([impact_speed(2.2, 0.8)], rel=1e-9)
    assert np.prod(orbit.multipliers).real == pytest.approx(0.64, rel=1e-8)
    assert orbit.stable and orbit.period_s == pytest.approx(2 * math.pi / 2.2)


@pytest.mark.further
@pytest.mark.parametrize("over", ["drive_frequency_factor", "restitution", "drive_amplitude_factor"])
def test_curves_of_the_impact_oscillator(over):
    """Followed over frequency, restitution and amplitude: every orbit's speed as in closed form (issue 22: 1 %)."""
    between = {"drive_frequency_factor": (0.85, 1.25), "restitution": (0.5, 0.95), "drive_amplitude_factor": (0.5, 2.0)}
    branch = follow_orbit(OSCILLATOR, LINE, over, between[over], step=0.05)
    values = np.array([orbit.value for orbit in branch.orbits])
    assert len(values) > 15 and np.all(np.diff(values) > 0)
    for orbit in branch.orbits:
        omega = 2.2 * (orbit.value if over == "drive_frequency_factor" else 1.0)
        restitution = orbit.value if over == "restitution" else 0.8
        size = orbit.value if over == "drive_amplitude_factor" else 1.0
        assert orbit.impact_speed_m_per_s == pytest.approx([size * impact_speed(omega, restitution)], rel=1e-7)
        assert np.prod(orbit.multipliers).real == pytest.approx(restitution**2, rel=1e-6)


def single_impact(omega, n, sigma=0.0, restitution=0.8):
    """The orbit with one impact in n periods of x'' + x = cos(omega t), x < sigma: place and speed at time 0, and the
    trace of its multipliers, whose product is restitution squared.

    Derived here for the oscillator of S. W. Shaw and P. J. Holmes, J. Sound Vib. 90, 129 (1983), undamped: with the
    speed of :func:`impact_speed`, the phase at the impact follows, and from the acceleration there the trace.
    """
    speed, gain, span = impact_speed(omega, restitution, n, sigma), 1 / (1 - omega**2), 2 * math.pi * n / omega
    a = -speed * (1 + restitution) / (2 * math.tan(span / 2))
    b = a * math.tan(span / 2)
    cosine, sine = (sigma - a) / gain, -(1 - restitution) * speed / (2 * gain * omega)
    since = -math.atan2(sine, cosine) / omega % span  # of time 0, after the impact
    angle = omega * since + math.atan2(sine, cosine)
    place = a * math.cos(since) + b * math.sin(since) + gain * math.cos(angle)
    rate = b * math.cos(since) - a * math.sin(since) - gain * omega * math.sin(angle)
    turn = (1 + restitution) * (cosine - sigma) / speed
    return place, rate, turn * math.sin(span) - 2 * restitution * math.cos(span)


def subharmonic(omega, n, sigma, between):
    """The branch of that orbit over the drive's frequency: frequencies (rad/s) and traces."""
    place, rate, _trace = single_impact(omega, n, sigma)
    made = changed(OSCILLATOR, "drive_frequency_factor", omega / 2.2)
    made = replace(made, initial_nes=(-50 + sigma, *made.initial_nes[1:]), initial_host=(place, 0, rate, 0, 0, 0))
    factors = (between[0] / omega, between[1] / omega)
    branch = follow_orbit(made, LINE, "drive_frequency_factor", factors, periods=n, step=0.03, most=100)
    assert all(np.prod(orbit.multipliers).real == pytest.approx(0.64, rel=1e-6) for orbit in branch.orbits)
    traces = np.array([orbit.multipliers.sum().real for orbit in branch.orbits])
    return omega * np.array([orbit.value for orbit in branch.orbits]), traces


@pytest.mark.others_further
@pytest.mark.parametrize(("n", "omega", "low", "high"), [(1, 2.0, 1.2, 2.7), (2, 4.0, 3.3, 4.7), (3, 6.0, 5.3, 6.7)])
def test_subharmonics_double_their_period_where_shaw_and_holmes_say(n, omega, low, high):
    """Period 1, 2 and 3 with one impact: the multipliers along each branch, and where the first passes -1."""
    omegas, traces = subharmonic(omega, n, 0.0, (low, high))
    assert traces == pytest.approx([single_impact(one, n)[2] for one in omegas], abs=1e-6)
    beyond = -(1 + 0.64) - traces  # 0 where one multiplier is -1
    passed = np.flatnonzero(beyond[:-1] * beyond[1:] < 0)
    right = [brentq(lambda one: single_impact(one, n)[2] + 1.64, *ends) for ends in ((low, omega), (omega, high))]
    found = [omegas[k] - beyond[k] * (omegas[k + 1] - omegas[k]) / (beyond[k + 1] - beyond[k]) for k in passed]
    assert sorted(found) == pytest.approx(right, rel=2e-3)  # between two orbits in a straight line; issue 22: 1 %


@pytest.mark.others_further
@pytest.mark.parametrize(
    ("n", "sigma", "low", "omega", "high"),
    [(1, 0.45, 1.8, 1.9, 1.98), (2, 0.3, 3.4, 3.6, 3.9), (3, 0.3, 5.0, 5.2, 5.7)],
)
def test_subharmonics_fold_where_shaw_and_holmes_say(n, sigma, low, omega, high):
    """Before a stop off the mass' rest two orbits meet, with a multiplier 1, where the speed's root is 0."""

    def square(one):
        whole = ((1 + 0.8) / (2 * math.tan(math.pi * n / one))) ** 2 + ((1 - 0.8) / (2 * one)) ** 2
        return whole - (0.2 / (2 * one)) ** 2 - whole * (1 - 1 / ((1 - one**2) * sigma) ** 2)

    fold = brentq(square, omega, high)
    omegas, traces = subharmonic(omega, n, sigma, (low, high))
    last = int(np.argmax(omegas))
    assert omegas[last] == pytest.approx(fold, rel=1e-3)
    assert 0 < last < len(omegas) - 1  # both orbits that meet there are on the branch
    assert (traces[0] - 1.64) * (traces[-1] - 1.64) < 0 and traces[last] == pytest.approx(1.64, abs=0.05)


def test_exponents_of_a_stable_orbit_are_its_multipliers():
    orbit = periodic_orbit(OSCILLATOR, LINE)
    start = replace(OSCILLATOR, initial_host=tuple(orbit.state[6:]), duration_s=200 * orbit.period_s)
    found = lyapunov(start, LINE, orbit.period_s, 20 * orbit.period_s)
    right = np.log(np.abs(orbit.multipliers)) / orbit.period_s
    assert found.exponents_per_s == pytest.approx(right, abs=2e-2 * abs(right).max())
    assert found.exponents_per_s.sum() == pytest.approx(right.sum(), rel=1e-6)


def test_exponents_of_a_chaotic_impact_oscillator():
    """Whatever the exponents are, their sum is that of areas, 2 ln r per impact: nothing else takes energy."""
    scenario = replace(changed(OSCILLATOR, "drive_frequency_factor", 2.8 / 2.2), duration_s=3000.0)
    period = drive_period_s(scenario)
    found = lyapunov(scenario, LINE, period, 100 * period)
    assert found.exponents_per_s[0] > 5 * found.sd_per_s[0]
    assert found.exponents_per_s.sum() == pytest.approx(2 * math.log(0.8) * found.impacts_per_s, rel=1e-3)


def impact_map_exponent(omega, restitution, impacts):
    """Largest exponent (1/s) of x'' + x = cos(omega t), x < 0, with its sd: the map from impact to impact in closed
    form and its derivative by hand; shares nothing with the core.
    """
    gain = 1 / (1 - omega**2)
    t, v = 0.3, -0.5
    tangent, logs, began = np.array([1.0, 0.3]), [], 0.0
    step = np.arange(1, 4000) * 5e-3
    for n in range(impacts):
        a, b = -gain * math.cos(omega * t), v + gain * omega * math.sin(omega * t)

        def place(s, t=t, a=a, b=b):
            return a * np.cos(s) + b * np.sin(s) + gain * np.cos(omega * (t + s))

        def rate(s, t=t, a=a, b=b):
            return b * np.cos(s) - a * np.sin(s) - gain * omega * np.sin(omega * (t + s))

        outside = np.flatnonzero(place(step) > 0.0)
        low, high = (step[outside[0]] - 5e-3 if outside[0] else 1e-9), step[outside[0]]
        s = brentq(place, low, high, xtol=1e-14) if place(low) < 0.0 else low
        dx, dv = -v * tangent[0], tangent[1] - math.cos(omega * t) * tangent[0]
        dx, dv = math.cos(s) * dx + math.sin(s) * dv, math.cos(s) * dv - math.sin(s) * dx
        before, t = float(rate(s)), t + s
        tangent = np.array([-dx / before, -restitution * (dv - math.cos(omega * t) * dx / before)])
        v = -restitution * before
        if n == 100:
            began = t
        if n >= 100:
            logs.append(math.log(np.linalg.norm(tangent)))
        tangent /= np.linalg.norm(tangent)
    means = np.array([part.mean() for part in np.array_split(logs, 10)])
    per_second = len(logs) / (t - began)
    return means.mean() * per_second, means.std(ddof=1) / math.sqrt(10) * per_second


@pytest.mark.further
def test_exponent_of_a_chaotic_impact_oscillator_by_its_map():
    """The same attractor by the map from impact to impact, written apart: exponents agree within their scatter."""
    scenario = replace(changed(OSCILLATOR, "drive_frequency_factor", 2.8 / 2.2), duration_s=6000.0)
    period = drive_period_s(scenario)
    found = lyapunov(scenario, LINE, period, 100 * period)
    value, sd = impact_map_exponent(2.8, 0.8, 3000)
    assert sd < 0.1 * value and found.sd_per_s[0] < 0.1 * value
    assert found.exponents_per_s[0] == pytest.approx(value, abs=3 * math.hypot(sd, found.sd_per_s[0]))


def test_exponents_of_a_billiard_are_those_published():
    """A disk among round scatterers on a hexagonal lattice, folded into one cell with elastic walls.

    DynamicalBilliards.jl prints its exponents (scatterers of radius 1, cells of side 2, speed 1, 1,000 s) in the
    documentation of four versions: 0.624, 0.681, 0.706, 0.648; zero twice; the largest with the other sign.
    """
    printed = np.array([0.6239620797, 0.6814592707, 0.7060535305, 0.6478956955])
    radius = 0.1
    reach = 2.0 * (1.0 + radius / math.sqrt(3.0))  # the disk's centre keeps its radius off each wall
    corners = tuple((reach * math.cos(n * math.pi / 3), reach * math.sin(n * math.pi / 3)) for n in range(6))
    scenario = Scenario(
        "", Nes(radius, 1.0), Host(polygon_m=corners, obstacle_radius_m=1.0 - radius), ImpactLaw(1.0, 0.0, 0.0),
        4000.0, initial_nes=(1.3, 0.2, math.cos(0.7), math.sin(0.7), 0.0, 0.0), max_impacts=10**6,
        gravity_m_per_s2=(0.0, 0.0),
    )  # fmt: skip
    found = lyapunov(scenario, ["nes_x_m", "nes_y_m", "nes_vx_m_per_s", "nes_vy_m_per_s"], 1.0)
    sd = math.hypot(float(found.sd_per_s[0]), printed.std(ddof=1) / 2)
    assert sd < 0.04
    assert found.exponents_per_s[0] == pytest.approx(printed.mean(), abs=3 * sd)
    assert found.exponents_per_s[3] == pytest.approx(-found.exponents_per_s[0], abs=1e-3)
    assert np.abs(found.exponents_per_s[1:3]).max() < 5e-3


def ball(acceleration_g, restitution, bounces_s):
    """An elastic ball far above a table that shakes hardly: the standard map."""
    box = ((-5.0, 0.0), (5.0, 0.0), (5.0, 1e6), (-5.0, 1e6))
    size = acceleration_g * 9.81 / (2 * math.pi * 1.0) ** 2
    drive = (Harmonic("y", size, 1.0),)
    return Scenario(
        "", Nes(0.01, 0.01), Host(polygon_m=box, motion="driven", drive=drive), ImpactLaw(restitution, 0.0, 0.0),
        bounces_s, initial_nes=(0.0, 300.0, 0.0, 0.0, 0.0, 0.0), gravity_m_per_s2=(0.0, -9.81),
    )  # fmt: skip


@pytest.mark.others_further
@pytest.mark.parametrize("acceleration_g", [2.5, 5.0])
def test_bouncing_ball_has_the_exponent_of_the_standard_map(acceleration_g):
    """Elastic and high, the ball's impacts are Chirikov's map with K = 4 A w^2/g, whose exponent is ln(K/2) per impact
    (Chirikov, Phys. Rep. 52, 263 (1979)) for K well above 4.
    """
    scenario = ball(acceleration_g, 1.0, 150000.0)
    found = lyapunov(scenario, ["nes_y_m", "nes_vy_m_per_s"], 50.0)
    per_impact = found.exponents_per_s[0] / found.impacts_per_s
    assert found.impacts > 800
    assert per_impact == pytest.approx(math.log(2 * acceleration_g), abs=0.08)
    assert abs(found.exponents_per_s.sum()) < 1e-3 * found.exponents_per_s[0]


def test_bouncing_ball_locks_where_holmes_says():
    """Period 1: v = g T/2 at the phase where the table gives what the restitution takes; its multipliers' product."""
    g, e, f = 9.81, 0.8, 10.0
    scenario = named_scenario("bouncing-ball", impact=ImpactLaw(e, 0.0, 0.0))
    size = scenario.host.drive[0].amplitude * 0.5
    scenario = changed(scenario, "drive_amplitude_factor", 0.5)
    rise = g / (2 * f) * (1 - e) / (1 + e)  # the table's speed at impact
    phase = math.acos(rise / (2 * math.pi * f * size))
    height = 0.01 + size * math.sin(phase)
    elapsed = (1 / f) - phase / (2 * math.pi * f)  # from impact to the next zero of the phase
    up = g / (2 * f)
    start = (0.0, height + up * elapsed - 0.5 * g * elapsed**2, 0.0, up - g * elapsed, 0.0, 0.0)
    orbit = periodic_orbit(replace(scenario, initial_nes=start), ["nes_y_m", "nes_vy_m_per_s"])
    assert orbit.gap < 1e-10
    assert orbit.state[[1, 3]] == pytest.approx([start[1], start[3]], rel=1e-8)
    assert orbit.impact_speed_m_per_s == pytest.approx([up + rise], rel=1e-9)
    assert np.prod(orbit.multipliers).real == pytest.approx(e**2, rel=1e-7)
    assert np.sum(orbit.multipliers).real == pytest.approx(trace_of_map(e, size, f, phase), rel=1e-6)


def trace_of_map(e, size, f, phase):
    """Trace of the impact-to-impact map of time t and speed u after the impact, differentiated by hand.

    y(t) + u s - g s^2/2 = y(t + s) and u' = -e (u - g s) + (1 + e) v(t + s), s one period.
    """
    g, w = 9.81, 2 * math.pi * f
    table, table_rate = size * w * math.cos(phase), -size * w * w * math.sin(phase)
    t_by_u = -(1 / f) / (g / (2 * f) - g / f - table)
    return 1 - e + (e * g + (1 + e) * table_rate) * t_by_u


def test_section_bifurcation_and_basins_of_the_impact_oscillator():
    """One place per period on the stable orbit, whatever the start; the map of basins knows what is outside."""
    orbit = periodic_orbit(OSCILLATOR, LINE)
    found = section(OSCILLATOR, 5, 300)
    assert pytest.approx(np.tile(orbit.state[[6, 8]], (5, 1)), abs=1e-8) == found[0, :, [6, 8]].T
    values = [0.95, 1.0, 1.05]
    diagram = bifurcation(OSCILLATOR, "drive_frequency_factor", values, 5, 300)
    for value, states in zip(values, diagram.states, strict=True):
        own = periodic_orbit(changed(OSCILLATOR, "drive_frequency_factor", value), LINE)
        assert states[:, 6] == pytest.approx(np.full(5, own.state[6]), abs=1e-8)
    xs, vs = np.linspace(-1.0, 0.5, 7), np.linspace(-1.0, 1.0, 4)
    regions = basins(OSCILLATOR, ("host_x_m", xs), ("host_vx_m_per_s", vs), 300, seen=LINE, near=1e-6)
    assert np.array_equal(regions.labels[0] < 0, xs > 0)
    first = regions.attractors[0]
    assert first.period == 1 and first.impacts == pytest.approx(1.0)
    assert first.states[0, [6, 8]] == pytest.approx(orbit.state[[6, 8]], abs=1e-4)


@pytest.mark.parametrize(
    ("call", "word"),
    [
        (lambda: periodic_orbit(OSCILLATOR, ["restitution"]), "unknowns"),
        (lambda: periodic_orbit(named_scenario("table-3"), ["nes_y_m"]), "periodic drive"),
        (lambda: follow_orbit(OSCILLATOR, LINE, "restitution", (0.1, 0.2)), "restitution"),
        (lambda: follow_orbit(OSCILLATOR, LINE, "colour", (0.1, 0.2)), "colour"),
        (lambda: lyapunov(OSCILLATOR, ["restitution"], 1.0), "directions"),
        (lambda: lyapunov(OSCILLATOR, LINE, 100.0), "every_s"),
        (lambda: section(OSCILLATOR, 0), "periods"),
        (lambda: basins(OSCILLATOR, ("colour", [1.0]), ("host_x_m", [0.0])), "colour"),
        (lambda: basins(OSCILLATOR, ("host_x_m", [9.0]), ("host_vx_m_per_s", [0.0])), "outside"),
    ],
)
def test_what_cannot_be_is_refused(call, word):
    with pytest.raises(ScenarioError, match=word):
        call()


def test_periods_of_drives():
    assert drive_period_s(named_scenario("rig")) == pytest.approx(1 / 11)
    both = (Harmonic("x", 1e-3, 4.0), Harmonic("y", 1e-3, 6.0))
    assert drive_period_s(replace(named_scenario("rig"), host=Host(0.05, motion="driven", drive=both))) == 0.5
    never = (Harmonic("x", 1e-3, 1.0), Harmonic("y", 1e-3, math.sqrt(2)))
    with pytest.raises(ScenarioError, match="Hz"):
        drive_period_s(replace(named_scenario("rig"), host=Host(0.05, motion="driven", drive=never)))
