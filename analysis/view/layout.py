"""How the viewer's window is divided: pictures on the left, scene and curves on the right."""

from __future__ import annotations

import numpy as np
import rerun.blueprint as rrb
from numpy.typing import NDArray

from analysis.view.outlines import poses
from analysis.view.stream import CURVES, Shown, camera_path, curve_path


def layout(shown: Shown) -> rrb.Blueprint:
    """Views of what there is; nothing empty is shown."""
    pictures = [rrb.Spatial2DView(origin=camera_path(camera.name), name=camera.name) for camera in shown.cameras]
    titles = (*CURVES, "room to the wall (mm)")
    curves = [  # one legend is enough, it covers what lies behind it
        rrb.TimeSeriesView(origin=curve_path(title), name=title, plot_legend=rrb.PlotLegend(visible=title == titles[0]))
        for title in titles
    ]
    middle, reach_m = _middle_and_reach_m(shown)
    eye = middle + reach_m * np.array([-0.8, -1.9, 2.0])
    scene = rrb.Spatial3DView(
        origin="world",
        contents=["+ $origin/bodies/**", "+ $origin/points/**", "+ $origin/path"],  # the cameras would be far away
        name="scene",
        eye_controls=rrb.EyeControls3D(position=eye, look_target=middle, eye_up=(0, 0, 1)),
        line_grid=rrb.LineGrid3D(spacing=0.01, color=(35, 35, 35)),
    )
    texts: list[rrb.View] = []
    if shown.impacts is not None and len(shown.impacts):
        texts.append(rrb.TextLogView(origin="impacts", name="impacts"))
    if shown.doubtful:
        texts.append(rrb.TextLogView(origin="doubtful", name="to look at"))
    if shown.notes:
        texts.append(rrb.TextDocumentView(origin="notes", name="notes"))
    right: list[rrb.View | rrb.Container] = [scene]
    if shown.motion is not None:
        right.append(rrb.Tabs(rrb.Grid(*curves, grid_columns=2, name="curves"), *texts))
    columns = [rrb.Vertical(*pictures), rrb.Vertical(*right)] if pictures else [rrb.Vertical(*right)]
    return rrb.Blueprint(
        rrb.Horizontal(*columns),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline="frame"),
    )


def _middle_and_reach_m(shown: Shown) -> tuple[NDArray[np.float64], float]:
    """Middle (3,) of the Host's path, and how far from there it reaches with its wall; without a motion a usual
    rig's.
    """
    host = shown.recording.settings.bodies.host
    if shown.motion is None or host is None:
        return np.zeros(3), 0.08
    places = poses(shown.motion, "host")[:, :2]
    places = places[np.isfinite(places).all(1)]
    wall_m = host.inner_radius_m or float(np.abs(np.asarray(host.polygon_m, float)).max())
    if not len(places):
        return np.zeros(3), wall_m
    middle = (places.min(0) + places.max(0)) / 2
    return np.array([*middle, 0.0]), wall_m + float(np.hypot(*(places - middle).T).max())
