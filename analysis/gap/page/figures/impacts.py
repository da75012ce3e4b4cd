"""Impacts: restitution, contact distance, tangential and angular law against what they may go with; held-out gains of
each covariate.
"""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from analysis.contact.law import LawData, fit_restitution
from analysis.contact.restitution import (
    restitution_design,
)
from analysis.figures.style import BLACK, BLUE, GREY, RED, label, legend, new_figure, robust_limits
from analysis.gap.cause import EACH_BLOW, EACH_RUN, HELD_BY_MORE
from analysis.gap.ladder import Ladder
from analysis.gap.page.figures.impact_residuals import covariate_of, residual_of
from analysis.gap.page.figures.panels import Panel
from analysis.gap.selection.impacts.fit import ImpactFit
from ovines.core.effects import EFFECTS

Array = NDArray[np.float64]

#: (residual, covariate) that show a wall which is elsewhere than stated
STATED_RADIUS = (("distance", "azimuth in the Host"), ("distance", "approach speed"))
SHOWN_OF = {"normal": "restitution", "tangential": "tangential", "spin": "angular", "radius": "distance"}
GOES_WITH = {
    "the time since the impact before": "time since the impact before",
    "the slip speed": "slip",
    "the direction of slip": "slip",
    "the spin": "spin before",
    "the sense of spin": "spin before",
    "the time in the run": "time in the run",
    "the run": "run",
    EACH_RUN: "run",
    EACH_BLOW: "slip",
    HELD_BY_MORE: "slip",
    "the drive's phase": "drive phase",
    "twice the azimuth": "azimuth in the Host",
    "three times the azimuth": "azimuth in the Host",
    "the azimuth": "azimuth in the Host",
    "the recording's time at the drive's frequency": "clock of the drive",
    "the approach speed": "approach speed",
    "the approach speed in another way": "approach speed",
}
CIRCULAR = ("azimuth in the room", "azimuth in the Host", "azimuth in the disk", "drive phase", "clock of the drive")
UNITS = {
    "approach speed": "m/s",
    "slip": "m/s",
    "tangential impulse": "m/s",
    "spin before": "rad/s",
    "time in the run": "s",
    "run": "number",
    "time since the impact before": "ms",
}
RESIDUALS = {
    "restitution": "restitution − model",
    "distance": "distance − wall (µm)",
    "tangential": "tangential excess (%)",
    "angular": "angular law (mm/s)",
}


def impact_view(finding: str, coordinate: str = "") -> tuple[str, str]:
    """Residual and first covariate for a finding (an effect, or what a structure goes with and its coordinate)."""
    own = _own_views(finding)
    if own:
        return own[0]
    if "place on the wall" in finding:
        return SHOWN_OF.get(coordinate, "restitution"), "azimuth in the Host"
    other = "azimuth in the Host" if finding.endswith("times the azimuth") else "approach speed"
    return SHOWN_OF.get(coordinate, "restitution"), GOES_WITH.get(finding, other)


def _own_views(finding: str) -> tuple[tuple[str, str], ...]:
    """(residual, covariate) that an effect of the contact names itself; empty for others."""
    if finding == "stated_radius":
        return STATED_RADIUS
    effect = EFFECTS.get(finding)
    return effect.views if effect is not None and effect.stage in ("impact", "geometry") else ()


def impact_panels(ladder: Ladder, finding: str, coordinate: str = "") -> list[Panel]:
    """Panels of the finding's residual against its own covariate, and against five others."""
    before, after = ladder.impacts.nominal, ladder.impacts.fitted
    if before is None or after is None:
        return []
    residual, first = impact_view(finding, coordinate)
    others = (
        "approach speed",
        "azimuth in the room",
        "azimuth in the Host",
        "azimuth in the disk",
        "slip",
        "spin before",
        "drive phase",
        "time in the run",
        "run",
    )
    names = tuple(dict.fromkeys((first, *(covariate for _, covariate in _own_views(finding)), *others)))[:6]
    return [_panel(ladder, residual, name, finding) for name in names]


def overview_panels(ladder: Ladder) -> list[Panel]:
    """One look at every residual of the impacts."""
    if ladder.impacts.fitted is None or ladder.impacts.nominal is None:
        return []
    pairs = (
        ("restitution", "approach speed"),
        ("restitution", "azimuth in the room"),
        ("distance", "azimuth in the room"),
        ("distance", "approach speed"),
        ("tangential", "slip"),
        ("angular", "spin before"),
    )
    return [_panel(ladder, residual, covariate, "") for residual, covariate in pairs]


def _panel(ladder: Ladder, residual: str, covariate: str, finding: str) -> Panel:
    before, after = ladder.both_impacts()
    x, y = covariate_of(before, covariate), residual_of(before, (), residual, finding)
    x_after, y_after = (
        covariate_of(after, covariate),
        residual_of(after, ladder.impacts.restitution_terms, residual),
    )
    if finding == "inertia_error":
        y = y + 1e3 * _turned_otherwise(before.data, ladder.inertia.ratio)
    unit = "°" if covariate in CIRCULAR else UNITS[covariate]
    return Panel(x, y, x_after, y_after, f"{covariate} ({unit})", RESIDUALS[residual], covariate in CIRCULAR)


def _turned_otherwise(data: LawData, ratio: float) -> Array:
    """What the angular law (K,; m/s) shows besides, when an inertia smaller by ``ratio`` than the data's is taken."""
    right = data.inertia_factor
    stated = right / ratio
    impulse = data.tangential_impulse * (1 + 1 / right) / (1 + 1 / stated)
    return np.asarray((stated - right) / (1 + right) * impulse, float)


def law_figure(ladder: Ladder) -> Figure:
    """The measured law itself: leaving over approach speed, tangential over normal impulse, angular law; lines are the
    models.
    """
    before, after = ladder.both_impacts()
    d = after.data
    figure, axes = new_figure(1, 3, height_in=2.8, gap_in=(0.68, 0.3))
    ax = axes[0, 0]
    ax.plot(d.before, d.after / d.before, ".", ms=3, color=GREY, alpha=0.7)
    order = np.argsort(d.before)
    ax.axhline(before.law.restitution, color=RED, lw=1.2, ls="--", label="recalibrated")
    design = restitution_design(d, ladder.impacts.restitution_terms)
    model = design @ fit_restitution(d, design)[0]
    ax.plot(
        d.before[order],
        model[order],
        "-" if "direction_dependent_restitution" not in ladder.impacts.restitution_terms else ".",
        color=BLUE,
        lw=1.2,
        ms=2.5,
        label="with the effect",
    )
    limits = robust_limits(d.after / d.before, 0.01, 0.2)
    if limits:
        ax.set_ylim(*limits)
    label(ax, "approach speed (m/s)", "restitution")
    legend(ax)
    ax = axes[0, 1]
    share = np.abs(d.slip) / d.normal_impulse
    ax.plot(share, np.abs(d.tangential_impulse) / d.normal_impulse, ".", ms=3, color=GREY, alpha=0.7)
    grid = np.linspace(0, np.quantile(share, 0.98), 200)
    for fit, colour, style in ((before, RED, "--"), (after, BLUE, "-")):
        ax.plot(grid, _tangential(grid, fit), color=colour, ls=style, lw=1.2)
    ax.set_xlim(0, grid[-1])
    ax.set_ylim(0, 1.6 * float(max(before.law.wall_friction, after.law.wall_friction)))
    label(ax, "slip / normal impulse", "tangential / normal impulse")
    ax = axes[0, 2]
    ax.plot(d.tangential_impulse, d.angular + d.tangential_impulse, ".", ms=3, color=GREY, alpha=0.7)
    ends = np.array([d.tangential_impulse.min(), d.tangential_impulse.max()])
    ax.plot(ends, ends, color=BLACK, lw=0.9)
    label(ax, "tangential impulse / mass (m/s)", "q R Δω (m/s)")
    return figure


def _tangential(share: Array, fit: ImpactFit) -> Array:
    """Tangential over normal impulse at a slip of ``share`` (N,) of the normal impulse."""
    stopping = share / (1 + 1 / fit.data.inertia_factor)
    if fit.lasting is not None:
        return fit.lasting.impulse(stopping, np.ones_like(share))
    return np.minimum((1 + fit.law.tangential_restitution) * stopping, fit.law.wall_friction)
