"""Energies of one simulated run: what is stored, lost by each channel, and done."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from analysis.figures.style import (
    BLACK,
    BLUE,
    GREEN,
    ORANGE,
    PURPLE,
    RED,
    SKY,
    label,
    legend,
    new_figure,
)
from ovines.core import SimulationResult

Array = NDArray[np.float64]
STORED = {
    "nes_kinetic_j": ("NES sliding", BLUE), "nes_spin_j": ("NES spinning", SKY),
    "nes_potential_j": ("NES potential", GREEN), "host_kinetic_j": ("Host moving", RED),
    "host_spin_j": ("Host turning", ORANGE), "host_and_springs_j": ("Host and springs", PURPLE),
}  # fmt: skip
CHANNELS = {
    "restitution_loss_j": ("restitution", BLUE), "wall_friction_loss_j": ("wall friction", RED),
    "floor_sliding_loss_j": ("floor, sliding", GREEN), "floor_spinning_loss_j": ("floor, spinning", PURPLE),
    "drag_loss_j": ("drag", ORANGE), "damper_loss_j": ("dampers", SKY),
}  # fmt: skip
HEAVY_KG = 1e6  # a Host as heavy stands still: its own energy would hide the disk's


def energies(result: SimulationResult) -> Figure:
    """What is stored, and what was lost by each channel and done since the start, over time (Figs 21-28b)."""
    figure, axes = new_figure(2, 1, height_in=5.2, sharex=True)
    e = dict(result.energies)
    if result.scenario.host.motion == "sprung":  # each by itself only swings to and fro
        e["host_and_springs_j"] = np.sum(
            [e.pop(name) for name in ("host_kinetic_j", "host_spin_j", "spring_j")], axis=0
        )
    heavy = result.scenario.host.mass_kg is not None and result.scenario.host.mass_kg >= HEAVY_KG
    stored = {
        name: e[name]
        for name in STORED
        if name in e and np.any(e[name] != 0.0) and not (heavy and name.startswith("host"))
    }
    lost = {name: e[name] for name in CHANNELS if np.nanmax(np.abs(e[name]), initial=0.0) > 0.0}
    _, scale, unit = energy_unit(*stored.values(), *lost.values(), e["work_j"])
    if len(stored) > 1:
        total = np.sum(list(stored.values()), axis=0)
        axes[0, 0].plot(e["time_s"], scale * total, color=BLACK, lw=1.3, label="together")
    for name, values in stored.items():
        axes[0, 0].plot(e["time_s"], scale * values, color=STORED[name][1], lw=0.8, label=STORED[name][0])
    for name, values in lost.items():
        axes[1, 0].plot(e["time_s"], scale * values, color=CHANNELS[name][1], lw=1.2, label=CHANNELS[name][0])
    if np.any(e["work_j"] != 0.0):
        who = "work of the ground" if result.scenario.host.motion == "sprung" else "work of the driver"
        axes[1, 0].plot(e["time_s"], scale * e["work_j"], "--", color=BLACK, lw=1.0, label=who)
    label(axes[0, 0], y=unit, title="Stored")
    label(axes[1, 0], "time (s)", unit, "Lost")
    for ax in axes[:, 0]:
        legend(ax)
    return figure


def energy_unit(*values: Array) -> tuple[str, float, str]:
    """Unit in which the largest of ``values`` (J) reads well, its factor, and an axis' words."""
    largest = max((float(np.nanmax(np.abs(one), initial=0.0)) for one in values), default=0.0)
    name, scale = next(
        ((name, scale) for name, scale in (("J", 1.0), ("mJ", 1e3), ("µJ", 1e6)) if largest * scale >= 1.0), ("µJ", 1e6)
    )
    return name, scale, f"energy ({name})"
