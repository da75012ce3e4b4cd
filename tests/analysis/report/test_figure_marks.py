import math

"""Figures whose labels once lay over their ticks, their legends over their data, or their numbers outside."""

import re

import numpy as np
import pandas as pd
import pytest

from analysis.contact.wall_sources import WallSource
from analysis.figures.calibration import reprojection, view_errors
from analysis.figures.geometry import COLOURS, wall_comparison
from analysis.figures.print_size import PrintSize, fit_to_print
from analysis.figures.style import angle_scale, save_figure
from ovines.errors import InputError


def shown(figure, ax):
    """Boxes (pixels) of the axis' label and of its tick labels as drawn."""
    figure.canvas.draw()
    renderer = figure.canvas.get_renderer()
    return ax.yaxis.label.get_window_extent(renderer), [
        text.get_window_extent(renderer) for text in ax.get_yticklabels() if text.get_text()
    ]


@pytest.mark.parametrize("scale_px", [0.002, 0.1, 3.0])
def test_the_label_of_an_axis_stands_beside_its_ticks(scale_px):
    noise = np.random.default_rng(1).random(200)
    points = pd.DataFrame(
        {
            "time_s": np.repeat(np.arange(100) / 800, 2),
            "marker": ["N1", "N2"] * 100,
            "reprojection_px": scale_px * noise,
        }
    )
    views = pd.DataFrame({"camera": "VW1", "used": True, "rms_px": scale_px * noise[:9]})
    for figure in (reprojection(points), view_errors(views)):
        for ax in figure.axes:
            label, ticks = shown(figure, ax)
            assert ticks and not any(label.overlaps(one) for one in ticks)


def test_the_legend_of_the_walls_stands_above_the_ellipses():
    sources = [
        WallSource(name, "", 0.04, 1e-6, (0.0, 0.0), (sd, sd))
        for name, sd in zip(list(COLOURS)[:3], (1e-6, 5e-6, 2e-4), strict=True)
    ]
    figure = wall_comparison(sources)
    figure.canvas.draw()
    ax = figure.axes[1]
    box = ax.get_legend().get_window_extent(figure.canvas.get_renderer())
    assert not any(box.overlaps(patch.get_window_extent(figure.canvas.get_renderer())) for patch in ax.patches)


@pytest.mark.parametrize(("width_mm", "font_pt"), [(None, None), (84.0, 7.0), (160.0, 11.0), (193.04, 9.0)])
def test_a_figure_takes_a_paper_s_width_and_font(width_mm, font_pt, tmp_path):
    noise = np.random.default_rng(1).random(200)
    points = pd.DataFrame({"time_s": np.arange(200) / 800, "marker": ["N1", "N2"] * 100, "reprojection_px": noise})
    figure = reprojection(points)
    height_in = figure.get_figheight()
    fit_to_print(figure, PrintSize(width_mm, font_pt, "serif"))
    path = save_figure(figure, tmp_path / "a.svg")
    written_pt = float(re.search(r'width="([\d.]+)pt"', path.read_text())[1])
    assert written_pt == pytest.approx((width_mm or 193.04) / 25.4 * 72, abs=0.01)
    for ax in figure.axes:
        label, ticks = shown(figure, ax)
        assert not any(label.overlaps(one) for one in ticks) and label.x0 >= 0
        assert ax.yaxis.label.get_fontsize() == pytest.approx(font_pt or 9.0)
        assert ax.get_yticklabels()[-1].get_fontsize() == pytest.approx((font_pt or 9.0) * 8 / 9)
        assert ax.yaxis.label.get_fontfamily() == ["serif"] == ax.get_yticklabels()[0].get_fontfamily()
    if width_mm in (None, 193.04):
        assert figure.get_figheight() == pytest.approx(height_in)


def test_a_figure_without_room_for_its_axes_is_refused():
    points = pd.DataFrame({"time_s": [0.0, 1.0], "marker": "N1", "reprojection_px": 0.1})
    with pytest.raises(InputError, match="larger --width"):
        fit_to_print(reprojection(points), PrintSize(30.0, 20.0))


def test_an_axis_of_many_turns_counts_them():
    unit, per_rad = angle_scale([0.0, np.nan, -10.0])
    assert unit == "°" and math.isclose(10.0 * per_rad, 572.96, abs_tol=0.01)
    unit, per_rad = angle_scale([[0.0], [200.0 * np.pi]])
    assert unit == "turns" and math.isclose(200.0 * np.pi * per_rad, 100.0, abs_tol=1e-9)
    assert angle_scale([])[0] == "°"
