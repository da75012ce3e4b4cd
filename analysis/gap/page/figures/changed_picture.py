"""How a camera's picture has changed since its calibration: the field that the recordings have taught, and the law."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from analysis.figures.style import BLUE, GREY, label, legend, new_figure
from ovines.camera import Camera
from ovines.camera.bends import bend_px
from ovines.camera.boards import BOARDS, board_bend_px
from ovines.core.laws.terms import Term

# Nodes along the longer side at the most; length of the longest arrow over their distance.
NODES, ARROW = 12, 0.9
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
    if term.target in BOARDS:  # a shift of all is nobody's
        told = term.coefficient * board_bend_px(term.target, term.x, term.y, camera, 0.0, nodes)
        told += (learnt - told).mean(0)
    else:
        told = term.coefficient * bend_px(term.target, term.y, nodes - camera.matrix[:2, 2])
    apart = float(np.diff(field.u_px[::step]).min())
    larger = ARROW * apart / max(float(np.hypot(*told.T).max()), 1e-12)
    figure, axes = new_figure(height_in=3.4, margins_in=(0.75, 0.3, 0.5, 0.55))
    ax = axes[0, 0]
    for moved, colour, width, name in (
        (learnt, GREY, 0.008, "field, from the recordings"),
        (told, BLUE, 0.0035, "the law"),
    ):
        ax.quiver(
            *nodes.T, *(larger * moved.T), angles="xy", scale_units="xy", scale=1, width=width, color=colour,
            zorder=ABOVE, label=name,
        )  # fmt: skip
    ax.set(xlim=(u.min() - apart, u.max() + apart), ylim=(v.max() + apart, v.min() - apart), aspect="equal")
    label(ax, f"u on the sensor of {camera.name} (px); arrows {larger:.0f} times longer", "v (px)", math=False)
    legend(ax, loc="lower left", bbox_to_anchor=(0, 1.02))
    return figure
