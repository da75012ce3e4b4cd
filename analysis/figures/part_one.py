"""Figures of Part I's tests for docs/validation/simulator.md; `ovines simulate --figures DIR` makes them all."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon
from numpy.typing import NDArray

from ovines.core import SimulationResult, simulate, simulate_ensemble
from ovines.core.packing import contact_radius
from ovines.core.system.friction import farkas
from ovines.core.system.named import named_scenario

BLUE, ORANGE, GREY = "#2c6fad", "#d9722b", "#888888"


def make_figures(folder: Path) -> list[Path]:
    """Every figure as PNG in ``folder``; returns their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    makers: tuple[Callable[[], Figure], ...] = (
        drops,
        spinning_drops,
        extreme_speeds,
        near_wall,
        stops,
        farkas_functions,
        sprung_host,
        shaken_host,
        perspectives,
    )
    for make in makers:
        figure = make()
        path = folder / f"{make.__name__}.png"
        figure.savefig(path, dpi=110, metadata={"Software": "ovines"})
        plt.close(figure)
        paths.append(path)
    return paths


def panels(rows: int, columns: int, height: float = 3.3) -> tuple[Figure, NDArray[Any]]:
    """A figure of ``rows`` x ``columns`` axes."""
    figure, axes = plt.subplots(rows, columns, figsize=(4.0 * columns, height * rows), layout="constrained")
    return figure, np.atleast_1d(axes).ravel()


def path_in_host(
    axes: Axes, result: SimulationResult, colour: str = BLUE, label: str | None = None, width: float = 0.7
) -> None:
    """Centre of the NES as the Host sees it (not turned), and the circle it may reach."""
    m = result.motion
    axes.plot(m["nes_x_m"] - m["host_x_m"], m["nes_y_m"] - m["host_y_m"], lw=width, color=colour, label=label)
    if result.scenario.host.radius_m is not None:
        turn = np.linspace(0, 2 * np.pi, 400)
        room = contact_radius(result.scenario)
        axes.plot(room * np.cos(turn), room * np.sin(turn), "--", lw=0.8, color=GREY)
    axes.set(aspect="equal", xlabel="x (m)", ylabel="y (m)")


def energies(result: SimulationResult) -> np.ndarray:
    """Kinetic energy of the NES and a free Host, and the NES's potential energy, at each sample (J)."""
    nes, m = result.scenario.nes, result.motion
    inertia = nes.inertia_factor * nes.mass_kg * nes.radius_m**2
    kinetic = 0.5 * nes.mass_kg * (m["nes_vx_m_per_s"] ** 2 + m["nes_vy_m_per_s"] ** 2)
    kinetic = kinetic + 0.5 * inertia * m["nes_spin_rad_per_s"] ** 2
    if result.scenario.host.mass_kg is not None and result.scenario.host.motion == "free":
        speed_2 = m["host_vx_m_per_s"] ** 2 + m["host_vy_m_per_s"] ** 2
        kinetic = kinetic + 0.5 * result.scenario.host.mass_kg * speed_2
    return np.array([kinetic, -nes.mass_kg * result.scenario.gravity_m_per_s2[1] * m["nes_y_m"]])


def drops() -> Figure:
    """Tables 2, 3, 5, 6 (thesis Fig. 2-6, 21, 22)."""
    figure, axes = panels(2, 3)
    for ax, name in zip(axes[:2], ("table-2", "table-3"), strict=True):
        result = simulate(named_scenario(name))
        ax.plot(result.time_s, result.motion["nes_y_m"], lw=0.8, color=BLUE)
        ax.set(title=f"{name}: height", xlabel="time (s)", ylabel="y (m)")
    heights = (result.impacts["normal_speed_after_m_per_s"] ** 2) / (2 * 9.81)
    n = np.arange(1, len(heights) + 1)
    keep = heights > 1e-9
    axes[2].semilogy(n[keep], np.abs(heights / (9 * 0.81**n) - 1)[keep] + 1e-17, ".", color=BLUE)
    axes[2].set(title="table-3: error of the n-th height", xlabel="rebound", ylabel="relative error")
    elastic, lossy = simulate(named_scenario("table-5")), simulate(named_scenario("table-6"))
    total = energies(elastic).sum(0)
    axes[3].plot(elastic.time_s, total - total[0], lw=0.6, color=BLUE)
    axes[3].set(title="table-5: total energy less its start", xlabel="time (s)", ylabel="J")
    for part, label in zip(energies(elastic), ("kinetic", "potential"), strict=True):
        axes[4].plot(elastic.time_s, part, lw=0.8, label=label)
    axes[4].set(title="table-5", xlabel="time (s)", ylabel="energy (J)")
    axes[4].legend()
    axes[5].plot(lossy.time_s, energies(lossy).sum(0), lw=0.9, color=BLUE)
    axes[5].set(title="table-6: total energy", xlabel="time (s)", ylabel="J")
    return figure


def spinning_drops() -> Figure:
    """Table 4 (Fig. 20): opposite spins, mirrored paths."""
    figure, axes = panels(1, 3)
    left, right = simulate(named_scenario("table-4-positive")), simulate(named_scenario("table-4-negative"))
    for ax, result, colour in ((axes[0], left, BLUE), (axes[1], right, ORANGE)):
        path_in_host(ax, result, colour)
        ax.set(title=result.scenario.name)
    axes[2].plot(left.time_s, left.motion["nes_x_m"] + right.motion["nes_x_m"], lw=0.8, color=BLUE)
    axes[2].set(title="sum of both x", xlabel="time (s)", ylabel="m")
    return figure


def extreme_speeds() -> Figure:
    """Tables 7-10 (Fig. 23-27)."""
    figure, axes = panels(1, 5)
    results = [simulate(named_scenario(f"table-{i}", sample_rate_hz=2000.0)) for i in (7, 8, 9, 10)]
    for ax, result in zip(axes, results, strict=False):
        path_in_host(ax, result, width=0.25)
        ax.set(title=f"{result.scenario.name}: {len(result.impacts)} impacts")
    one, other = results[2].motion, results[3].motion
    axes[4].plot(results[2].time_s, np.abs(one["nes_x_m"] + other["nes_x_m"]), color=BLUE, label="|x1 + x2|")
    axes[4].plot(results[2].time_s, np.abs(one["nes_y_m"] - other["nes_y_m"]), "--", color=ORANGE, label="|y1 - y2|")
    axes[4].set(title="mirror symmetry of tables 9, 10", xlabel="time (s)", ylabel="m")
    axes[4].legend()
    return figure


def near_wall() -> Figure:
    """Tables 11 and 12 (Fig. 28-30): launched along the wall, and the case that left the container."""
    figure, axes = panels(1, 4)
    for k, name in enumerate(("table-11", "table-12")):
        result = simulate(named_scenario(name, sample_rate_hz=5000.0))
        path_in_host(axes[2 * k], result, width=0.3)
        axes[2 * k].set(title=f"{name}: {len(result.impacts)} impacts, {len(result.contacts)} sustained")
        m = result.motion
        room = contact_radius(result.scenario) - np.hypot(m["nes_x_m"] - m["host_x_m"], m["nes_y_m"] - m["host_y_m"])
        axes[2 * k + 1].semilogy(result.time_s, np.maximum(room, 1e-17), lw=0.4, color=BLUE)
        axes[2 * k + 1].set(title=f"room to the wall, least {np.min(room):.1e} m", xlabel="time (s)", ylabel="m")
    return figure


def stops() -> Figure:
    """Coulomb stop, Rabinowicz, joint stop (Fig. 8, 10-12, 19)."""
    figure, axes = panels(2, 3)
    slide = simulate(named_scenario("coulomb-stop"))
    axes[0].plot(slide.time_s, slide.motion["nes_x_m"], color=BLUE, label="x (m)")
    axes[0].plot(slide.time_s, slide.motion["nes_vx_m_per_s"], color=ORANGE, label="speed (m/s)")
    axes[0].axhline(1.0, ls="--", lw=0.8, color=GREY)
    axes[0].set(title=f"coulomb-stop: {slide.motion['nes_x_m'][-1]:.9f} m", xlabel="time (s)")
    axes[0].legend()
    block = simulate(named_scenario("rabinowicz"))
    u, v = block.motion["host_x_m"], block.motion["host_vx_m_per_s"]
    axes[1].plot(block.time_s, u, color=BLUE)
    axes[1].set(title="rabinowicz: displacement", xlabel="time (s)", ylabel="m")
    axes[2].plot(block.time_s, 98.1 * np.tanh((v - 0.5) / 0.05), color=ORANGE, label="friction")
    axes[2].plot(block.time_s, 10 * u, color=BLUE, label="spring")
    axes[2].set(title="rabinowicz: forces", xlabel="time (s)", ylabel="N")
    axes[2].legend()
    axes[3].plot(block.time_s, v - 0.5, color=BLUE)
    axes[3].set(title="rabinowicz: relative velocity", xlabel="time (s)", ylabel="m/s")
    both = simulate(named_scenario("farkas-stop"))
    axes[4].plot(both.time_s, both.motion["nes_vx_m_per_s"], color=BLUE, label="v / v0")
    axes[4].plot(both.time_s, both.motion["nes_spin_rad_per_s"] / 10, color=ORANGE, label="omega / omega0")
    axes[4].set(title="farkas-stop", xlabel="time (s)")
    axes[4].legend()
    moving = both.motion["nes_vx_m_per_s"] > 1e-2
    ratio = both.motion["nes_vx_m_per_s"][moving] / both.motion["nes_spin_rad_per_s"][moving]
    axes[5].plot(both.time_s[moving], ratio, color=BLUE)
    axes[5].set(title="farkas-stop: v / (R omega)", xlabel="time (s)")
    return figure


def farkas_functions() -> Figure:
    """F, T, their slopes, the admissible curve (Fig. 13-17)."""
    figure, axes = panels(1, 3)
    ratio = np.linspace(1e-3, 5, 2000)
    both = np.array([farkas(x) for x in ratio])
    for column, (name, colour) in enumerate((("F", BLUE), ("T", ORANGE))):
        axes[0].plot(ratio, both[:, column], color=colour, label=name)
        axes[1].plot(ratio, np.gradient(both[:, column], ratio), color=colour, label=f"d{name}")
    axes[1].plot([1, 1], [4 / (3 * math.pi), -4 / (3 * math.pi)], "k+", label="+-4/(3 pi) at 1")
    axes[0].set(title="force and torque functions", xlabel="v / (R omega)")
    axes[1].set(title="their slopes", xlabel="v / (R omega)")
    axes[2].plot(both[:, 0], both[:, 1], color=BLUE)
    axes[2].set(title="admissible curve", xlabel="F", ylabel="T", xlim=(0, 1), ylim=(0, 0.7))
    axes[0].legend()
    axes[1].legend()
    return figure


def sprung_host() -> Figure:
    """Table 13 (Fig. 31-33)."""
    figure, axes = panels(1, 4)
    result = simulate(named_scenario("table-13"))
    m = result.motion
    path_in_host(axes[0], result, width=0.3)
    axes[0].set(title=f"table-13: {len(result.impacts)} impacts")
    for ax, body in ((axes[1], "host"), (axes[2], "nes")):
        for axis, colour in (("vx", ORANGE), ("vy", BLUE)):
            ax.plot(result.time_s, m[f"{body}_{axis}_m_per_s"], lw=0.4, color=colour, label=axis)
        ax.plot(result.time_s, m[f"{body}_spin_rad_per_s"], lw=0.8, color="k", label="spin (rad/s)")
        ax.set(title=f"{body}: velocities (m/s)", xlabel="tau")
        ax.legend(loc="upper right")
    e = result.energy
    axes[3].bar(
        ["stored", "impacts", "dampers", "ground's\nwork"], [e.change, e.rubbed, e.dragged, e.worked], color=BLUE
    )
    axes[3].set(title=f"energy (J): adds up to {abs(e.relative_residual):.0e}")
    return figure


def shaken_host() -> Figure:
    """Tables 14-15 (Fig. 34-35): one run each, and what 1,000 scattered starts say."""
    figure, axes = panels(1, 4)
    spread = {"nes_x_m": 1e-4, "nes_y_m": 1e-4}
    for i, (case, colour) in enumerate(((1, BLUE), (2, ORANGE))):
        scenario = named_scenario(f"table-15-case-{case}")
        result = simulate(scenario)
        path_in_host(axes[i], result, colour)
        axes[i].set(title=f"case {case}: {len(result.impacts)} impacts")
        many = simulate_ensemble(scenario, 1000, spread, np.random.default_rng(case))
        label = f"case {case}: {np.mean(many.n_impacts):.1f} impacts"
        axes[2].hist(many.n_impacts, bins=np.arange(0, 45), color=colour, alpha=0.6, label=label)
        spin = np.abs(many.final_state[:, 5])
        axes[3].hist(spin, bins=40, color=colour, alpha=0.6, label=f"case {case}: median {np.median(spin):.0f}")
    axes[2].set(title="impacts in 1 s, 1,000 starts", xlabel="impacts")
    axes[3].set(title="spin at the end", xlabel="|spin| (rad/s)")
    axes[2].legend()
    axes[3].legend()
    return figure


def perspectives() -> Figure:
    """The rig, a central obstacle (Fig. 65), a triangular Host; sustained contact in red."""
    figure, axes = panels(1, 3, 3.8)
    for ax, name in zip(axes, ("rig", "obstacle", "triangle"), strict=True):
        result = simulate(named_scenario(name, sample_rate_hz=4000.0))
        path_in_host(ax, result, width=0.5)
        m, host = result.motion, result.scenario.host
        for start, end in result.contacts:
            held = (result.time_s >= start) & (result.time_s <= end)
            ax.plot((m["nes_x_m"] - m["host_x_m"])[held], (m["nes_y_m"] - m["host_y_m"])[held], color="#c22", lw=1.5)
        if host.obstacle_radius_m is not None:
            ax.add_patch(Circle((0, 0), host.obstacle_radius_m, color=GREY))
        if host.polygon_m is not None:
            ax.add_patch(Polygon(host.polygon_m, fill=False, ls="--", ec=GREY))
        ax.set(title=f"{name}: {len(result.impacts)} impacts, {len(result.contacts)} sustained")
    return figure
