"""Figures of what a NES takes from its Host, of the Host's response, and of a search for the best NES."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from analysis.figures.style import BLACK, BLUE, GREEN, GREY, MM, PURPLE, RED, SKY, label, legend, new_figure
from analysis.simulations.energy_figure import CHANNELS
from analysis.simulations.sweep_figure import in_words
from ovines.core.absorber.design import Design
from ovines.core.absorber.linear import bare_gain, ground_amplitude_m, tuned_gain
from ovines.core.absorber.response import Response
from ovines.core.absorber.taken import EnergyTaken
from ovines.core.system.model import Scenario

MJ = 1e3
SMOOTH = 300  # points of a closed form


def taken_figure(found: EnergyTaken) -> Figure:
    """Host's energy with and without the NES; where what was pumped went."""
    figure, axes = new_figure(2, 1, height_in=5.2, sharex=True)
    top, low = axes[:, 0]
    top.plot(found.time_s, MJ * found.bare_j, color=GREY, lw=1.2, label="Host without NES")
    top.plot(found.time_s, MJ * found.host_j, color=RED, lw=1.2, label="Host with NES")
    low.plot(found.time_s, MJ * found.pumped_j, color=BLACK, lw=1.4, label="pumped into the NES")
    low.plot(found.time_s, MJ * found.nes_j, color=GREY, lw=1.0, label="still in it")
    for name, energy in found.dissipated_j.items():
        if energy[-1] > 1e-3 * max(found.pumped_j[-1], 1e-300):
            word, colour = CHANNELS[name]
            low.plot(found.time_s, MJ * energy, color=colour, lw=1.0, ls="--", label=word)
    low.plot(found.time_s, MJ * found.damper_j, color=SKY, lw=1.0, ls=":", label="Host's dampers")
    label(top, "", "energy (mJ)", "Energy of the Host")
    label(low, "time (s)", "energy (mJ)", "")
    legend(top)
    legend(low, fontsize=7)
    return figure


def response_figure(found: Response, scenario: Scenario, design: Design | None = None) -> Figure:
    """Amplitude of the Host over frequency: means with 5 to 95 % of the runs, bare, stuck, and a tuned mass damper."""
    figure, axes = new_figure(2, 1, height_in=5.4, sharex=True, gridspec_kw={"height_ratios": (2.2, 1.0)})
    top, low = axes[:, 0]
    shown = found if design is None else design.kept[0].response
    size = ground_amplitude_m(scenario)
    at = found.frequency_hz
    fine = np.union1d(at, np.linspace(at.min(), at.max(), SMOOTH))  # closed forms: as smooth as they are
    for name, added_kg, style in (("bare", 0.0, "-"), ("disk stuck to it", scenario.nes.mass_kg, ":")):
        level = np.linalg.norm(bare_gain(scenario, fine, added_kg) * size, axis=1)
        top.plot(fine, MM * level, style, color=GREY, lw=1.2, label=name)
    drawn = [("with NES", found, BLUE)] + ([("best NES", shown, GREEN)] if design is not None else [])
    for name, one, colour in drawn:
        level = one.level_m()
        low_mm, high_mm = (MM * np.percentile(level, q, axis=1) for q in (5, 95))
        top.fill_between(one.frequency_hz, low_mm, high_mm, color=colour, alpha=0.18, lw=0)
        top.plot(one.frequency_hz, MM * level.mean(axis=1), ".-", color=colour, lw=1.2, ms=4, label=name)
        low.plot(one.frequency_hz, one.impacts_per_period, ".-", color=colour, lw=1.0, ms=4)
    if design is not None:
        axes_shaken = [axis for axis in range(2) if size[axis] > 0.0]
        gains = [
            size[axis] * tuned_gain(scenario, axis, one.mass_kg,
                                    np.array([one.stiffness_n_per_m, one.damping_n_s_per_m]), fine)
            for axis, one in zip(axes_shaken, design.damper, strict=True)
        ]  # fmt: skip
        top.plot(fine, MM * np.linalg.norm(gains, axis=0), color=PURPLE, lw=1.2, ls="--", label="tuned mass damper")
    top.set_yscale("log")
    label(top, "", "Host's amplitude (mm)", "Frequency response")
    label(low, "frequency of the ground (Hz)", "impacts per period")
    legend(top)
    return figure


def design_figure(found: Design) -> Figure:
    """Largest amplitude over each number of the candidates; those kept with their 90 %."""
    names = list(found.tried[-1].numbers)
    columns = min(len(names), 3)
    figure, axes = new_figure(
        -(-len(names) // columns), columns, height_in=2.9 * -(-len(names) // columns), sharey=True
    )
    for ax in axes.ravel()[len(names) :]:
        ax.set_visible(False)
    for ax, name in zip(axes.ravel(), names, strict=False):
        tried = [one for one in found.tried if one.numbers]
        ax.plot(
            [one.numbers[name] for one in tried],
            [MM * one.level_m for one in tried],
            ".",
            color=GREY,
            ms=5,
            label="tried",
        )
        for n, one in enumerate(k for k in found.kept if k.numbers):
            colour = GREEN if one is found.kept[0] else BLUE
            bars = MM * np.array([[one.level_m - one.low_m], [one.high_m - one.level_m]])
            name_it = ("best, 90 %", "kept, 90 %")[n] if n < 2 else None
            ax.errorbar(one.numbers[name], MM * one.level_m, bars, fmt="o", color=colour, ms=4, lw=1.0, label=name_it)
        ax.axhline(MM * found.damper_m, color=PURPLE, lw=1.2, ls="--", label="tuned mass damper")
        ax.locator_params(axis="x", nbins=6)
        ax.set_ylim(bottom=0.0)
        label(ax, in_words(name), "largest amplitude (mm)" if ax in axes[:, 0] else "")
    legend(axes[0, min(len(names), columns) - 1], ncols=4)  # it is wider than a panel, and grows to the left
    return figure
