"""Speed of the core simulator: ratios against scipy's solve_ivp and heyoka, measured in one run.

python benchmarks/simulator/simulate.py            (a few minutes; heyoka is used where it is installed)
python benchmarks/simulator/simulate.py --fast     (short spans, ratios only roughly)

solve_ivp runs the thesis' way: an event on the distance, restart after each impact.
"""

from __future__ import annotations

import argparse
import math
import time
from dataclasses import replace

import numpy as np
from scipy.integrate import solve_ivp
from scipy.special import ellipe, ellipk

from ovines.core import Host, ImpactLaw, Nes, Scenario, Workers, simulate, simulate_ensemble
from ovines.core.system.friction import floor_friction
from ovines.core.system.named import named_scenario

TABLE_13_RADIUS = 0.8


def best_of(work, repeats: int = 3) -> tuple[float, object]:
    """Shortest processor time (s) of some repeats, and what the work gave: other users of the machine do not count."""
    times = []
    for _ in range(repeats):
        start = time.process_time()
        given = work()
        times.append(time.process_time() - start)
    return min(times), given


def event_loop(slope, gap, strike, y, end: float, method: str, tolerance: float) -> list[float]:
    """The thesis' loop: integrate to the event, apply the law, go on; impact times."""
    gap.terminal, gap.direction = True, 1
    t, times = 0.0, []
    while t < end:
        part = solve_ivp(slope, (t, end), y, method=method, rtol=tolerance, atol=tolerance, events=gap)
        t, y = part.t[-1], part.y[:, -1].copy()
        if part.status != 1:
            break
        times.append(t)
        strike(t, y)
    return times


def table_13_slope(t, y):
    """State: NES x, y, vx, vy, Host x, y, vx, vy (no spin: mu_c = 0)."""
    ground, rate = 0.005 * math.sin(t), 0.005 * math.cos(t)
    return [y[2], y[3], 0.0, 0.0, y[6], y[7],
            -y[4] - 0.04 * y[6], -(y[5] - ground) - 0.04 * (y[7] - rate)]  # fmt: skip


def table_13_gap(_t, y):
    """Positive outside."""
    return math.hypot(y[0] - y[4], y[1] - y[5]) - TABLE_13_RADIUS


def table_13_strike(_t, y):
    """Restitution 0.97, masses 0.2 and 1 kg."""
    nx, ny = (y[0] - y[4]) / TABLE_13_RADIUS, (y[1] - y[5]) / TABLE_13_RADIUS
    p = -1.97 * ((y[2] - y[6]) * nx + (y[3] - y[7]) * ny) / 6.0
    y[2] += p * nx / 0.2
    y[3] += p * ny / 0.2
    y[6] -= p * nx
    y[7] -= p * ny


def table_13_start() -> np.ndarray:
    """As the named scenario."""
    x = 0.99 * TABLE_13_RADIUS * math.sqrt(0.5)
    return np.array([x, -x, 0, 0, 0, 0, 0, 0], dtype=float)


def heyoka_system(hy):
    """Right-hand side of Table 13 and the gap's square, in heyoka's expressions."""
    x, y, vx, vy, hx, hy_, hvx, hvy = hy.make_vars("x", "y", "vx", "vy", "hx", "hy", "hvx", "hvy")
    ground, rate = 0.005 * hy.sin(hy.time), 0.005 * hy.cos(hy.time)
    zero = hy.expression(0.0)
    system = [(x, vx), (y, vy), (vx, zero * x), (vy, zero * x), (hx, hvx), (hy_, hvy),
              (hvx, -hx - 0.04 * hvx), (hvy, -(hy_ - ground) - 0.04 * (hvy - rate))]  # fmt: skip
    return system, (x - hx) * (x - hx) + (y - hy_) * (y - hy_) - TABLE_13_RADIUS**2


def heyoka_table_13(hy, end: float):
    """A Taylor integrator with a terminal event."""
    times = []

    def strike(ta, _d_sgn):
        times.append(ta.time)
        table_13_strike(ta.time, ta.state)
        return True

    system, gap = heyoka_system(hy)
    event = hy.t_event(gap, callback=strike, direction=hy.event_direction.positive)
    integrator = hy.taylor_adaptive(system, table_13_start(), t_events=[event], tol=1e-16)

    def work():
        times.clear()
        integrator.time = 0.0
        integrator.state[:] = table_13_start()
        while integrator.time < end:
            integrator.propagate_until(end)
        return list(times)

    return work


def heyoka_batch(hy, end: float, tolerance: float):
    """As many runs at a time as the processor has lanes, each from its own start: impacts of all of them."""
    lanes, count = hy.recommended_simd_size(), [0]

    def strike(ta, _d_sgn, lane):
        count[0] += 1
        table_13_strike(0.0, ta.state[:, lane])
        return True

    system, gap = heyoka_system(hy)
    event = hy.t_event_batch(gap, callback=strike, direction=hy.event_direction.positive)
    starts = np.repeat(table_13_start()[:, None], lanes, axis=1)
    starts[0] -= np.abs(1e-4 * np.random.default_rng(0).standard_normal(lanes))
    integrator = hy.taylor_adaptive_batch(system, starts.copy(), t_events=[event], tol=tolerance)

    def work():
        count[0] = 0
        integrator.set_time(0.0)
        integrator.state[:] = starts
        while np.min(integrator.time) < end:
            integrator.propagate_until(end)
        return count[0] / lanes

    return work, lanes


def thesis_friction(vx, vy, spin, radius, strength, regularisation, _coupling):
    """Farkas' law with scipy's elliptic functions in the form printed in (48)-(49), one regularisation."""
    speed, rim = math.hypot(vx, vy), radius * abs(spin)
    smooth = strength * math.tanh(math.hypot(speed, rim) / regularisation)
    if speed == 0.0:
        return 0.0, 0.0, -smooth * radius * 2 / 3 * (spin > 0) + smooth * radius * 2 / 3 * (spin < 0)
    e = speed / max(rim, 1e-4 * speed)
    m = min(e, 1 / e) ** 2
    big_e, big_k = ellipe(m), ellipk(min(m, 1 - 1e-15))
    if e <= 1:
        force = 4 / 3 * ((e * e + 1) * big_e + (e * e - 1) * big_k) / (e * math.pi)
        torque = 4 / 9 * ((4 - 2 * e * e) * big_e + (e * e - 1) * big_k) / math.pi
    else:
        force = 4 / 3 * ((e * e + 1) * big_e - (e * e - 1) * big_k) / math.pi
        torque = 4 * e / 9 * ((4 - 2 * e * e) * big_e + (2 * e * e - 5 + 3 / e**2) * big_k) / math.pi
    return -smooth * force * vx / speed, -smooth * force * vy / speed, -math.copysign(smooth * radius * torque, spin)


def shaken_loop(end: float, method: str, friction):
    """Table 15 case 2 through solve_ivp with the same laws; ``friction`` compiled or the thesis' own."""
    omega, amplitude, room = 2 * math.pi * 11.0, named_scenario("table-15-case-2").host.drive[0].amplitude, 0.08

    def host(t):
        return amplitude * (1 - math.cos(omega * t)), amplitude * omega * math.sin(omega * t)

    def slope(t, y):
        ax, ay, torque = friction(y[2], y[3] - host(t)[1], y[5], 0.02, 0.5 * 9.81, 1e-3, 1.0)
        return [y[2], y[3], ax, ay, y[5], torque / (0.5 * 0.02**2)]

    def gap(t, y):
        return math.hypot(y[0], y[1] - host(t)[0]) - room

    def strike(t, y):
        h, rate = host(t)
        size = math.hypot(y[0], y[1] - h)
        nx, ny = y[0] / size, (y[1] - h) / size
        vx, vy = y[2], y[3] - rate
        normal, slip = vx * nx + vy * ny, vy * nx - vx * ny + 0.02 * y[5]
        push = -2.0 * normal
        rub = -math.copysign(min(2.0 * abs(slip) / 3.0, 0.5 * abs(push)), slip)
        y[2] += push * nx - rub * ny
        y[3] += push * ny + rub * nx
        y[5] += rub / (0.5 * 0.02)
        y[0], y[1] = nx * room * (1 - 1e-15), h + ny * room * (1 - 1e-15)

    away = 0.98 * room * math.sqrt(0.5)
    return lambda: event_loop(slope, gap, strike, np.array([away, -away, 0, 0, 0, 0]), end, method, 1e-9)


def table_13(fast: bool) -> None:
    """Impacts per second, ratios and errors at impact 10."""
    span = 300.0 if fast else 2000.0
    scenario = named_scenario("table-13", duration_s=span, sample_rate_hz=0.0)
    simulate(scenario)
    ours, result = best_of(lambda: simulate(scenario), 20)
    exact = result.impacts["time_s"]
    bare, _ = best_of(lambda: simulate_ensemble(scenario, 64, {}, np.random.default_rng(0), workers=Workers(jobs=1)))
    bare /= 64
    print(f"Table 13 to tau = {span:.0f}: {len(exact)} impacts")
    line("this core, energy balance kept", ours, len(exact), ours)
    line("this core, in an ensemble", bare, len(exact), bare)
    for method in ("RK45", "DOP853"):
        seconds, times = best_of(
            lambda method=method: event_loop(
                table_13_slope, table_13_gap, table_13_strike, table_13_start(), span, method, 1e-9
            ),
            1,
        )
        line(f"solve_ivp {method} 1e-9", seconds, len(times), bare, abs(times[9] - exact[9]))
    try:
        import heyoka as hy
    except ImportError:
        print("  heyoka: not installed")
        return
    seconds, times = best_of(heyoka_table_13(hy, span), 5)
    line("heyoka, tolerance 1e-16", seconds, len(times), bare, abs(times[9] - exact[9]))
    for tolerance in (1e-16, 1e-9):  # the second: what the core's ensembles with friction hold
        work, lanes = heyoka_batch(hy, span, tolerance)
        apart = []
        for _ in range(5):  # in turn: a machine that others use is fast one minute and slow the next
            theirs, impacts = best_of(work, 1)
            ours, _ = best_of(
                lambda: simulate_ensemble(scenario, 64, {}, np.random.default_rng(0), workers=Workers(jobs=1)), 1
            )
            apart.append((theirs / lanes) / (ours / 64))
        line(f"heyoka, {lanes} lanes, tolerance {tolerance:g}", theirs / lanes, int(impacts), ours / 64)
        print(f"    five pairs in turn: {min(apart):.2f} to {max(apart):.2f}, median {np.median(apart):.2f}")


def line(what: str, seconds: float, impacts: int, ours: float, error: float | None = None) -> None:
    """One row: time, impacts per second, ratio of its time per impact-free span to ours."""
    more = f", differs from ours by {error:.1e} s at impact 10" if error is not None else ""
    print(f"  {what:<38} {seconds * 1e3:10.2f} ms {impacts / seconds:10.0f} impacts/s {seconds / ours:8.1f} x{more}")


def shaken(fast: bool) -> None:
    """Table 15 case 2: one run against RK45, and many runs on all cores."""
    scenario = named_scenario("table-15-case-2", sample_rate_hz=0.0)
    count = 2000 if fast else 100_000
    spread = {"nes_x_m": 1e-4, "nes_y_m": 1e-4}
    simulate_ensemble(scenario, 4, spread, np.random.default_rng(0))
    one, _ = best_of(lambda: simulate_ensemble(scenario, 100, {}, np.random.default_rng(0), workers=Workers(jobs=1)))
    one /= 100
    print("Tables 14-15, case 2, 1 s")
    line("this core, one run of an ensemble", one, len(simulate(scenario).impacts), one)
    seconds, times = best_of(shaken_loop(1.0, "RK45", thesis_friction), 2)
    line("solve_ivp RK45 1e-9, scipy's E, K", seconds, len(times), one)
    for method in ("RK45", "DOP853"):
        seconds, times = best_of(shaken_loop(1.0, method, floor_friction), 2)
        line(f"solve_ivp {method} 1e-9, our F, T", seconds, len(times), one)
    start = time.perf_counter()
    seconds, _ = best_of(lambda: simulate_ensemble(scenario, count, spread, np.random.default_rng(0)), 1)
    wall = time.perf_counter() - start
    print(f"  {count} runs on all cores: {wall:.1f} s, of one core {seconds:.1f} s "
          f"({seconds / count * 5e4:.0f} s per 100,000 on two cores of one's own)")  # fmt: skip


def straight() -> None:
    """Straight flights: fixed Host, no friction."""
    scenario = Scenario("straight", Nes(0.01, 0.02), Host(0.05), ImpactLaw(1.0, 0.0, 0.0), 1e5, None,
                        (0.01, 0.0, 3.0, 1.0, 0.0, 0.0), sample_rate_hz=0.0, max_impacts=20000)  # fmt: skip
    seconds, _ = best_of(lambda: simulate_ensemble(scenario, 10, {}, np.random.default_rng(0), workers=Workers(jobs=1)))
    print(f"Straight flights: {10 * 20000 / seconds:.0f} impacts per second and core")


def main() -> None:
    """Run everything."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--fast", action="store_true")
    fast = parser.parse_args().fast
    start = time.process_time()
    simulate(replace(named_scenario("rig"), duration_s=0.01))
    first = time.process_time() - start
    print(f"First simulate() of this process: {first:.2f} s (compiling or loading what was compiled before)")
    straight()
    table_13(fast)
    shaken(fast)


if __name__ == "__main__":
    main()
