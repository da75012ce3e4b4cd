"""How the viewer's window is divided: pictures on the left, scene and curves on the right."""

from __future__ import annotations

import rerun.blueprint as rrb

from analysis.view.stream import CURVES, Shown, camera_path, curve_path


def layout(shown: Shown) -> rrb.Blueprint:
    """Views of what there is; nothing empty is shown."""
    pictures = [rrb.Spatial2DView(origin=camera_path(camera.name), name=camera.name) for camera in shown.cameras]
    curves = [rrb.TimeSeriesView(origin=curve_path(title), name=title) for title in (*CURVES, "room to the wall (mm)")]
    scene = rrb.Spatial3DView(
        origin="world",
        name="scene",
        eye_controls=rrb.EyeControls3D(position=(-0.12, -0.2, 0.2), look_target=(0.02, -0.02, 0.0), eye_up=(0, 0, 1)),
    )
    texts: list[rrb.View] = []
    if shown.impacts is not None and len(shown.impacts):
        texts.append(rrb.TextLogView(origin="impacts", name="impacts"))
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
