"""Impacts: restitution, contact distance, tangential and angular law against what they may go with; held-out gains of
each covariate.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from analysis.contact.held_laws import since_before
from analysis.contact.law import Law, LawData, fit_restitution, predicted_tangential
from analysis.contact.restitution import (
    RESTITUTION_EFFECTS,
    best_speed_scale,
    conditions,
    restitution_columns,
    restitution_design,
)
from analysis.contact.wall_fit import DISTANCE_FLOOR_M
from analysis.figures.style import BLACK, BLUE, GREY, RED, label, legend, new_figure, robust_limits
from analysis.gap.ladder import Ladder
from analysis.gap.page.figures import Candidate, Panel
from analysis.gap.selection.impact_candidates import EACH_RUN, LOBES_AS_PROBE, PROBES, covariates
from analysis.gap.selection.impact_fit import ImpactFit
from analysis.statistics.robust import at_least_noise, least_squares
from analysis.walls.lobes import ORDERS, lobe_columns

Array = NDArray[np.float64]
DEGREES = 180 / np.pi
# Losses of single impacts are cut here (sd squared), as in the fits.
CLIP = 25.0
# Below this tangential impulse per mass its share of the law is mostly noise.
WEAK_M_PER_S = 0.02

#: residual and covariates that show a finding; findings are effects, coordinates of structure, or groups of probes
VIEWS: dict[str, tuple[str, tuple[str, ...]]] = {
    "speed_dependent_restitution": ("restitution", ("approach speed", "azimuth in the room")),
    "direction_dependent_restitution": ("restitution", ("azimuth in the room", "approach speed")),
    "restitution_drift": ("restitution", ("run", "time in the run")),
    "finite_contact_time": ("distance", ("approach speed", "azimuth in the room")),
    "wall_ellipticity": ("distance", ("azimuth in the room", "approach speed")),
    "wall_lobes": ("distance", ("azimuth in the Host", "approach speed")),
    "wall_centre_offset": ("distance", ("azimuth in the Host", "azimuth in the disk")),
    "stated_radius": ("distance", ("azimuth in the Host", "approach speed")),
    "mass_centre_offset": ("distance", ("azimuth in the disk", "azimuth in the Host")),
    "inertia_error": ("angular", ("tangential impulse", "spin before")),
}
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
    if finding in VIEWS:
        return VIEWS[finding][0], VIEWS[finding][1][0]
    if "place on the wall" in finding:
        return SHOWN_OF.get(coordinate, "restitution"), "azimuth in the Host"
    other = "azimuth in the Host" if finding.endswith("times the azimuth") else "approach speed"
    return SHOWN_OF.get(coordinate, "restitution"), GOES_WITH.get(finding, other)


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
    names = tuple(dict.fromkeys((first, *VIEWS.get(finding, ("", ()))[1], *others)))[:6]
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


def covariate_of(fitted: ImpactFit, name: str) -> Array:
    """A covariate (K,) of the usable impacts; angles in degrees from -180 to 180."""
    d = fitted.data
    angles = {
        "azimuth in the room": d.azimuth_rad,
        "azimuth in the Host": d.azimuth_rad - d.host_angle_rad,
        "azimuth in the disk": fitted.wall.impacts.body_rad[d.index],
        "drive phase": d.drive_rad,
        "clock of the drive": d.drive_rad - d.drive_start_rad,
    }
    if name in angles:
        return np.asarray(DEGREES * np.angle(np.exp(1j * angles[name])), float)
    plain: dict[str, Array] = {
        "approach speed": d.before,
        "slip": d.slip,
        "tangential impulse": d.tangential_impulse,
        "spin before": d.spin,
        "time in the run": d.time_s,
        "run": d.run.astype(float) + 1,
        "time since the impact before": 1e3 * since_before(d),
    }
    return plain[name]


def residual_of(fitted: ImpactFit, restitution_terms: Sequence[str], residual: str, put_back: str = "") -> Array:
    """One residual (K,) per usable impact; ``put_back`` names a centre whose offset the nominal wall has taken up
    already.
    """
    d = fitted.data
    if residual == "restitution":
        design = restitution_design(d, restitution_terms)
        return np.asarray(d.after / d.before - design @ fit_restitution(d, design)[0], float)
    if residual == "distance":
        r = fitted.wall.residual_m[d.index]
        if put_back in ("wall_centre_offset", "mass_centre_offset"):
            # The layout's wall, not the recalibrated one, is what the effect is an error of.
            impacts, wall = fitted.wall.impacts, fitted.wall.wall
            if put_back == "wall_centre_offset":
                off, seen = wall.centre_m, impacts.normal_rad - impacts.junctions.host[:, 3]
            else:
                off, seen = -wall.disk_m, impacts.body_rad
            r = r + (np.cos(seen) * off[0] + np.sin(seen) * off[1])[d.index]
        return 1e6 * r
    if residual == "angular":
        return 1e3 * d.angular
    law = np.abs(predicted_tangential(d, fitted.law.wall_friction, fitted.law.tangential_restitution))
    return np.asarray(
        np.where(law > WEAK_M_PER_S, 100 * (np.abs(d.tangential_impulse) / np.maximum(law, 1e-9) - 1), np.nan), float
    )


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
    for law, colour, style in ((before.law, RED, "--"), (after.law, BLUE, "-")):
        ax.plot(grid, _tangential(grid, law, d), color=colour, ls=style, lw=1.2)
    ax.set_xlim(0, grid[-1])
    ax.set_ylim(0, 1.6 * float(max(before.law.wall_friction, after.law.wall_friction)))
    label(ax, "slip / normal impulse", "tangential / normal impulse")
    ax = axes[0, 2]
    ax.plot(d.tangential_impulse, d.angular + d.tangential_impulse, ".", ms=3, color=GREY, alpha=0.7)
    ends = np.array([d.tangential_impulse.min(), d.tangential_impulse.max()])
    ax.plot(ends, ends, color=BLACK, lw=0.9)
    label(ax, "tangential impulse / mass (m/s)", "q R Δω (m/s)")
    return figure


def _tangential(share: Array, law: Law, data: LawData) -> Array:
    return np.minimum((1 + law.tangential_restitution) * share / (1 + 1 / data.inertia_factor), law.wall_friction)


# --- ranking
# -------------------------------------------------------------------------------------------------------------


def impact_candidates(ladder: Ladder, probes: bool) -> list[Candidate]:
    """Gain of each effect (on the recalibrated model) or of each probe (on the final one) on runs held out of its
    estimate.
    """
    fitted = ladder.impacts.fitted if probes else ladder.impacts.nominal
    if fitted is None:
        return []
    d, runs = fitted.data, len(ladder.series.runs)
    terms = ladder.impacts.restitution_terms if probes else ()
    design = restitution_design(d, terms)
    restitution = (d.after / d.before, d.normal_sd / d.before, design)
    wall = fitted.wall
    distance_sd = np.hypot(wall.impacts.sd("gap")[d.index], DISTANCE_FLOOR_M)
    nominal, ellipse = (wall.impacts.design(t)[d.index] for t in (wall.wall.nominal_terms, wall.wall.ellipse_terms))
    speed = d.before[:, None]
    base = np.hstack(
        [
            nominal,
            ellipse if ladder.impacts.shape.ellipse and probes else ellipse[:, :0],
            speed if ladder.impacts.shape.finite and probes else speed[:, :0],
        ]
    )
    distance = (wall.residual_m[d.index], distance_sd, base)
    if not probes:
        found = {c.effect for c in ladder.causes}
        blocks = {
            RESTITUTION_EFFECTS: (
                restitution,
                [
                    restitution_columns(conditions(d), [name], best_speed_scale(d))[:, 1:]
                    for name in RESTITUTION_EFFECTS
                ],
            ),
            ("wall_ellipticity", "wall_lobes", "finite_contact_time"): (distance, [ellipse, _lobes(ladder), speed]),
        }
        return [
            Candidate(name, True, gains, name in found)
            for names, (data, columns) in blocks.items()
            for name, gains in zip(names, _gains(*data, columns, d.run, runs), strict=True)
            if name not in ("wall_ellipticity", "wall_lobes") or ellipse.shape[1]
        ]
    return _probe_candidates(ladder, fitted, {"restitution": restitution, "distance": distance})


def _lobes(ladder: Ladder) -> Array:
    """Lobes (K, 2) of the order that was tried, at the impacts of the recalibrated fit."""
    d = ladder.both_impacts()[0].data
    order = next((gain.order for gain in ladder.impacts.gains if gain.order), ORDERS[0])
    return lobe_columns(d.azimuth_rad - d.host_angle_rad, order)


def _probe_candidates(
    ladder: Ladder, fitted: ImpactFit, regressions: dict[str, tuple[Array, Array, Array]]
) -> list[Candidate]:
    """Every group of covariates tried on every residual: the two of ``regressions`` (y, sd, base) and the two of the
    tangential law.
    """
    d, runs = fitted.data, len(ladder.series.runs)
    law = np.abs(predicted_tangential(d, fitted.law.wall_friction, fitted.law.tangential_restitution))
    strong = law > WEAK_M_PER_S
    share = np.where(strong, np.abs(d.tangential_impulse) / np.maximum(law, 1e-9) - 1, 0.0)
    share_sd = np.where(strong, np.hypot(d.tangential_sd / np.maximum(law, 1e-9), 0.01), 1e3)
    one = np.ones((len(d), 1))
    data = {
        **regressions,
        "tangential": (share, share_sd, one),
        "angular": (d.angular, np.hypot(d.angular_sd, 0.002 * d.normal_impulse), one),
    }
    coordinates = {shown: coordinate for coordinate, shown in SHOWN_OF.items()}
    found = {(s.coordinate, s.goes_with) for s in ladder.structure}
    table = covariates(d)
    out = []
    for residual, regression in data.items():
        # The wall's own shape is a named effect, not a probe.
        groups = {name: parts for name, parts in PROBES.items() if residual != "distance" or name not in LOBES_AS_PROBE}
        columns = [np.column_stack([table[p] for p in parts]) for parts in groups.values()]
        for name, gains in zip(groups, _gains(*regression, columns, d.run, runs), strict=True):
            words = f"{residual} with {name}".replace(
                "the recording's time at the drive's frequency", "the drive's clock"
            )
            out.append(Candidate(words, False, gains, (coordinates[residual], name) in found))
    return out


def _gains(
    y: Array, sd: Array, base: Array, columns: Sequence[Array], run: NDArray[np.int64], runs: int
) -> list[Array]:
    """For each block of ``columns`` the fall of -2 log L per run (runs,) when it joins ``base``, coefficients from the
    other runs.
    """
    without = _loss(y, sd, base, run, runs)
    return [without - _loss(y, sd, np.hstack([base, c]), run, runs) for c in columns]


def _loss(y: Array, sd: Array, design: Array, run: NDArray[np.int64], runs: int) -> Array:
    """-2 log L of each run (runs,) under a regression of the other runs; single losses are clipped."""
    out = np.zeros(runs)
    for number in np.unique(run):
        here = run == number
        rest = ~here if np.any(~here) else here
        z = (y - design @ least_squares(design[rest], y[rest], sd[rest], rounds=4).coefficients) / sd
        # Each model has its own scatter, learnt from the other runs, never below the noise ``sd``.
        scale = at_least_noise(z[rest])
        out[number] = np.sum(np.minimum((z[here] / scale) ** 2, CLIP) + 2 * np.log(scale))
    return out
