"""How a camera's picture has changed since its calibration: the field that the recordings have taught, and the law; and
what boards that were not true have made of the world."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from analysis.figures.style import BLUE, GREY, label, legend, new_figure
from ovines.camera import Camera
from ovines.camera.bends import bend_px
from ovines.camera.boards import board_move_m
from ovines.core.laws.terms import Term

Array = NDArray[np.float64]
# Nodes along the longer side at the most; length of the longest arrow over their distance.
NODES, ARROW = 12, 0.9
# Nodes along a side of the world that boards have measured, and how far it goes, in contact radii.
WORLD_NODES, WORLD_REACH = 9, 1.6
# Markers of a quiver are drawn above the grid.
ABOVE = 3


def changed_picture_figure(term: Term, camera: Camera) -> Figure:
    """Arrows, enlarged, of what the field does to the picture and of what ``term`` says of it, where markers went."""
    field = camera.field
    assert field is not None, "a change is read off a field"
    step = max(1, -(-max(len(field.u_px), len(field.v_px)) // NODES))
    u, v = np.meshgrid(field.u_px[::step], field.v_px[::step], indexing="ij")
    nodes = np.column_stack([u.ravel(), v.ravel()])
    learnt = field.at(nodes)
    by_law = term.coefficient * bend_px(term.target, term.y, nodes - camera.matrix[:2, 2])
    apart = float(np.diff(field.u_px[::step]).min())
    larger = ARROW * apart / max(float(np.hypot(*by_law.T).max()), 1e-12)
    figure, axes = new_figure(height_in=3.4, margins_in=(0.75, 0.3, 0.5, 0.55))
    ax = axes[0, 0]
    for moved, colour, width, name in (
        (learnt, GREY, 0.008, "field, from the recordings"),
        (by_law, BLUE, 0.0035, "the law"),
    ):
        ax.quiver(
            *nodes.T, *(larger * moved.T), angles="xy", scale_units="xy", scale=1, width=width, color=colour,
            zorder=ABOVE, label=name,
        )  # fmt: skip
    ax.set(xlim=(u.min() - apart, u.max() + apart), ylim=(v.max() + apart, v.min() - apart), aspect="equal")
    label(ax, f"u on the sensor of {camera.name} (px); arrows {larger:.0f} times longer", "v (px)", math=False)
    legend(ax, loc="lower left", bbox_to_anchor=(0, 1.02))
    return figure


def boards_figure(term: Term, origin_m: Array, radius_m: float) -> Figure:
    """Arrows, enlarged, of what boards add to places about the Host, whose middle is ``origin_m`` (2,), of contact
    radius ``radius_m``, both in the world."""
    side = np.linspace(-WORLD_REACH * radius_m, WORLD_REACH * radius_m, WORLD_NODES)
    x, y = np.meshgrid(origin_m[0] + side, origin_m[1] + side, indexing="ij")
    nodes = np.column_stack([x.ravel(), y.ravel()])
    moved = term.coefficient * board_move_m(term.target, term.x, term.y, nodes)
    moved -= moved.mean(0)
    apart = float(side[1] - side[0])
    larger = ARROW * apart / max(float(np.hypot(*moved.T).max()), 1e-12)
    figure, axes = new_figure(height_in=3.8, margins_in=(0.75, 0.3, 0.5, 0.35))
    ax = axes[0, 0]
    ax.quiver(
        *(1e3 * nodes.T), *(1e3 * larger * moved.T), angles="xy", scale_units="xy", scale=1, width=0.0045, color=BLUE,
        zorder=ABOVE,
    )  # fmt: skip
    reach_mm = 1e3 * (side[-1] + apart)
    middle_mm = 1e3 * np.asarray(origin_m)
    ax.set(
        xlim=(middle_mm[0] - reach_mm, middle_mm[0] + reach_mm),
        ylim=(middle_mm[1] - reach_mm, middle_mm[1] + reach_mm),
        aspect="equal",
    )
    largest_mm = 1e3 * float(np.hypot(*moved.T).max())
    label(ax, f"x in the world (mm); arrows {larger:.0f} times longer, up to {largest_mm:.2g} mm", "y (mm)", math=False)
    return figure
