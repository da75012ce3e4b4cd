"""Figures as a paper wants them: its column's width, its font."""

from __future__ import annotations

from dataclasses import dataclass

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.text import Text

from analysis.figures.style import FONT_PT, place_labels
from ovines.errors import InputError

MM_PER_IN = 25.4
LEAST_AXES_IN = 0.3  # narrower ones show nothing
FLATTEST = 0.6  # axes lose height with their width down to this share, so that curves stay readable


@dataclass(frozen=True)
class PrintSize:
    """Width of the figure, size and family of its font; None leaves it as the pages have it."""

    width_mm: float | None = None
    font_pt: float | None = None
    family: str | None = None


def fit_to_print(figure: Figure, size: PrintSize) -> None:
    """Give ``figure`` that width and font. Margins and gaps grow with the font alone, so that labels keep their room;
    lines and markers keep their size. `InputError` where nothing would be left between the margins.
    """
    grown = 1.0 if size.font_pt is None else size.font_pt / FONT_PT
    for text in figure.findobj(Text):
        assert isinstance(text, Text)
        text.set_fontsize(grown * float(text.get_fontsize()))
        if size.family is not None:
            text.set_fontfamily(size.family)
    for ax in figure.axes:
        for axis in (ax.xaxis, ax.yaxis):
            labels = axis.get_ticklabels()
            if labels:
                axis.set_tick_params(labelsize=labels[0].get_fontsize(), labelfontfamily=size.family)
        place_labels(ax, grown)
    width_in = float(figure.get_figwidth()) if size.width_mm is None else size.width_mm / MM_PER_IN
    _resize(figure, width_in, grown)


def _resize(figure: Figure, new_in: float, grown: float) -> None:
    width_in, height_in = (float(one) for one in figure.get_size_inches())
    rows, columns = _grid(figure.axes)
    pars = figure.subplotpars
    left, right = grown * pars.left * width_in, grown * (1 - pars.right) * width_in
    bottom, top = grown * pars.bottom * height_in, grown * (1 - pars.top) * height_in
    was_wide = (pars.right - pars.left) * width_in / (columns + pars.wspace * (columns - 1))
    was_high = (pars.top - pars.bottom) * height_in / (rows + pars.hspace * (rows - 1))
    across, down = grown * pars.wspace * was_wide, grown * pars.hspace * was_high
    wide = (new_in - left - right - across * (columns - 1)) / columns
    if wide < LEAST_AXES_IN:
        raise InputError(
            f"a figure of {MM_PER_IN * new_in:.3g} mm with {columns} columns and a font of {grown * FONT_PT:.3g} pt",
            f"room for axes of {MM_PER_IN * LEAST_AXES_IN:.2g} mm",
            "choose a larger --width or a smaller --font",
        )
    high = was_high * max(wide / was_wide, FLATTEST)
    new_high = bottom + top + rows * high + down * (rows - 1)
    figure.set_size_inches(new_in, new_high)
    figure.subplots_adjust(
        left / new_in, bottom / new_high, 1 - right / new_in, 1 - top / new_high, across / wide, down / high
    )


def _grid(axes: list[Axes]) -> tuple[int, int]:
    """Rows and columns of the figure's grid."""
    specs = [spec for ax in axes if (spec := ax.get_subplotspec()) is not None]
    grid = specs[0].get_topmost_subplotspec().get_gridspec() if specs else None
    return (grid.nrows, grid.ncols) if grid is not None else (1, 1)
