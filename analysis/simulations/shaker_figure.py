"""Figure of a shaker: the acceleration that its limits leave at each frequency, and the design point (Fig. 36)."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from analysis.figures.style import BLACK, BLUE, GREEN, MM, PURPLE, RED, label, legend, new_figure
from ovines.core.system.shaker import ShakerLimits, amplitude_of


def shaker_figure(limits: ShakerLimits, frequency_hz: float, acceleration_g: float, best_m: float) -> Figure:
    """Limits over frequency as acceleration (g) and as amplitude (mm), ``best_m`` the amplitude of L_g/pi."""
    figure, axes = new_figure(1, 2, height_in=3.4, gap_in=(0.62, 0.36), margins_in=(0.62, 0.12, 0.46, 0.5))
    frequency = np.geomspace(min(1.0, frequency_hz / 3.0), max(200.0, 3.0 * frequency_hz), 400)
    shown = (("travel", BLUE), ("velocity", GREEN), ("acceleration", RED))
    curves = limits.accelerations_g(frequency)
    lowest = np.min(list(curves.values()), axis=0)
    asked_mm = MM * float(amplitude_of(acceleration_g, frequency_hz))
    for ax, of, marked in (
        (axes[0, 0], lambda g: g, (acceleration_g,)),
        (axes[0, 1], lambda g: MM * amplitudes(g, frequency), (asked_mm, MM * best_m)),
    ):
        ax.set(xscale="log", yscale="log", xlim=(frequency[0], frequency[-1]))
        if np.isfinite(lowest).all():  # before anything is drawn: a travel alone is a line of one amplitude
            held = np.concatenate([of(lowest), marked])
            ax.set_ylim(0.3 * held.min(), 5.0 * held.max())
        for name, colour in shown:
            if np.isfinite(curves[name]).all():
                ax.plot(frequency, of(curves[name]), color=colour, lw=1.2, label=name)
        if np.isfinite(lowest).all():
            ax.fill_between(frequency, of(lowest), 1e-9, color=BLUE, alpha=0.08, lw=0)
    axes[0, 0].plot(frequency_hz, acceleration_g, "o", color=BLACK, ms=5, label="asked for")
    axes[0, 1].plot(frequency_hz, asked_mm, "o", color=BLACK, ms=5)
    axes[0, 1].axhline(MM * best_m, color=PURPLE, lw=1.0, ls="--", label="clearance/pi")
    label(axes[0, 0], "frequency (Hz)", "peak acceleration (g)")
    label(axes[0, 1], "frequency (Hz)", "amplitude (mm)")
    legend(axes[0, 0], ncols=2, handlelength=1.2)
    clearance = axes[0, 1].lines[-1]
    legend(axes[0, 1], handles=[clearance])
    return figure


def amplitudes(acceleration_g: np.ndarray, frequency_hz: np.ndarray) -> np.ndarray:
    """Amplitude (m) of each acceleration at each frequency, (n,)."""
    return acceleration_g * amplitude_of(1.0, 1.0) / frequency_hz**2
