"""The law of the floor that one simulated run slides on."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from analysis.figures.style import (
    BLACK,
    BLUE,
    GREY,
    MM,
    RED,
    label,
    legend,
    new_figure,
)
from ovines.core import SimulationResult
from ovines.core.system.friction import farkas

Array = NDArray[np.float64]


def floor_friction(result: SimulationResult) -> Figure:
    """The floor's law: share of the friction over the speed (Fig. 7), over the ratio of sliding to rim (Figs 13-17),
    and how that ratio changes by itself (Fig. 18).
    """
    friction = result.scenario.friction
    assert friction is not None
    figure, axes = new_figure(1, 3, height_in=2.8)
    slow = friction.regularisation_m_per_s
    speed = np.linspace(-6.0, 6.0, 400) * slow
    axes[0, 0].plot(MM * speed, np.tanh(speed / slow), color=BLUE, lw=1.2)
    axes[0, 0].axhline(1.0, color=GREY, lw=0.6, ls="--")
    axes[0, 0].axhline(-1.0, color=GREY, lw=0.6, ls="--")
    label(axes[0, 0], "speed (mm/s)", "share", f"Near rest, floor friction {friction.coefficient:g}")
    ratio = np.geomspace(1e-2, 1e2, 500)
    force, torque = np.array([farkas(one) for one in ratio]).T if friction.law == "farkas" else _coulomb(ratio)
    axes[0, 1].semilogx(ratio, force, color=BLUE, lw=1.2, label="sliding")
    axes[0, 1].semilogx(ratio, torque, color=RED, lw=1.2, label="spinning")
    label(axes[0, 1], "sliding speed over the rim's", "share", friction.law.capitalize())
    legend(axes[0, 1], loc="center left", bbox_to_anchor=None, ncols=1)
    change = ratio_change(ratio, force, torque, result.scenario.nes.inertia_factor)
    axes[0, 2].semilogx(ratio, change, color=BLUE, lw=1.2)
    axes[0, 2].axhline(0.0, color=GREY, lw=0.6, ls="--")
    for k in np.flatnonzero((change[:-1] > 0.0) & (change[1:] <= 0.0)):
        axes[0, 2].plot(ratio[k], 0.0, "o", color=BLACK, ms=4)
        axes[0, 2].text(1.4 * ratio[k], 0.02, f"both stop\nat once: {ratio[k]:.2f}", fontsize=7, color=BLACK)
    label(axes[0, 2], "sliding speed over the rim's", "change (1)", "How the ratio changes")
    return figure


def ratio_change(ratio: Array, force: Array, torque: Array, inertia_factor: float) -> Array:
    """How the ratio of sliding speed v to rim speed u changes where the floor alone acts, (u / (mu g)) d(ratio)/dt:
    ratio T / q - F, the f of Farkas et al. (2003) for a disk (q = 1/2).  Where it falls through zero, sliding and
    spinning end together.
    """
    return ratio * torque / inertia_factor - force


def _coulomb(ratio: Array) -> tuple[Array, Array]:
    return np.ones_like(ratio), np.zeros_like(ratio)
