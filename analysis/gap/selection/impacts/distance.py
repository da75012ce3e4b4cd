"""Candidates in the contact distance: the wall's ellipticity and lobes, contacts that last, and probes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.contact.wall_fit import WallFit, fit_wall, lobe_order
from analysis.gap.selection.impacts.covariates import PROBES, covariates, standardised
from analysis.gap.selection.impacts.fit import ImpactFit, Shape, wall_prior
from analysis.gap.selection.impacts.gain import ImpactGain
from analysis.walls.lobes import LOBE_TERMS, ORDERS, LobedWall, lobe_columns
from ovines.robust import MEDIAN_TO_SD

#: what the contact distance shows as a wall's shape
LOBES_AS_PROBE = ("twice the azimuth", "three times the azimuth")
#: so many orders of lobes are tried, of which the best gains this much more by chance
LOBES_BY_CHANCE = 2 * float(np.log(len(ORDERS)))


def distance_gains(base: ImpactFit, shape: Shape, withheld: frozenset[str] = frozenset()) -> list[ImpactGain]:
    """Ellipticity, lobes, finite contact and probes in the contact distance, on top of a wall of ``shape``."""
    used, wall = base.wall.used, base.wall
    speed = np.maximum(wall.impacts.of("normal_before"), 0)
    out = []
    scatter = _scatter(wall, used)

    def add(name: str, trial: WallFit, at: slice, size: float, named: bool, order: int = 0) -> None:
        other = _scatter(trial, used)
        n = int(used.sum())
        gain = n * 2 * np.log(scatter / other) if other > 0 else 0.0
        estimate, sd = trial.estimate[at], np.sqrt(np.diag(trial.covariance))[at]
        sure = float(np.linalg.norm(np.divide(estimate, sd, out=np.zeros(len(sd)), where=sd > 0)))
        gain -= LOBES_BY_CHANCE if order else 0.0
        out.append(ImpactGain(name, "distance", float(gain), size, estimate, sd, named, sure, order=order))

    held = speed[:, None] if shape.finite else None
    terms = shape.terms(wall.wall)
    prior, last = wall_prior(wall.wall), slice(len(terms), len(terms) + 2)
    if not shape.ellipse and "wall_ellipticity" not in withheld and wall.wall.ellipse_terms:
        trial = fit_wall(base.junctions, wall.wall, [*terms, *wall.wall.ellipse_terms], prior, held)
        add(
            "wall_ellipticity",
            trial,
            last,
            float(np.hypot(*trial.wall.ellipse) * trial.wall.size_m / np.sqrt(2)),
            True,
        )
    if not shape.finite and "finite_contact_time" not in withheld:
        trial = fit_wall(base.junctions, wall.wall, terms, prior, speed[:, None])
        add("finite_contact_time", trial, slice(-1, None), float(abs(trial.estimate[-1]) * np.std(speed[used])), True)
    order = lobe_order(base.wall, shape.order)
    named = order > 0 and not shape.order and "wall_lobes" not in withheld
    if named:
        trial = fit_wall(base.junctions, LobedWall.of(wall.wall, order), [*terms, *LOBE_TERMS], prior, held)
        size = float(np.hypot(*trial.estimate[last]) * trial.wall.size_m / np.sqrt(2))
        add("wall_lobes", trial, last, size, True, order)
    table = {**covariates(base.data), "approach speed": standardised(base.data.before)}
    # The wall's own shape is among the names; further lobes beside named ones have no name.
    probes = {k: v for k, v in PROBES.items() if k not in LOBES_AS_PROBE}
    if "wall_ellipticity" in withheld:
        probes["twice the azimuth"] = PROBES["twice the azimuth"]
    if order and not named:
        lobes = lobe_columns(base.data.at.azimuth_rad - base.data.at.host_angle_rad, order)
        table |= {"cos lobes": lobes[:, 0], "sin lobes": lobes[:, 1]}
        probes["three times the azimuth" if order == 3 else f"{order} times the azimuth"] = ("cos lobes", "sin lobes")
    if "finite_contact_time" in withheld:
        probes["the approach speed"] = ("approach speed",)
    for name, parts in probes.items():
        full = np.zeros((len(base.junctions), len(parts)))
        full[base.data.at.index] = np.column_stack([table[p] for p in parts])
        trial = fit_wall(
            base.junctions, wall.wall, terms, prior, full if held is None else np.column_stack([full, held]), rounds=3
        )
        own = slice(len(terms), len(terms) + len(parts))
        add(name, trial, own, float(np.std(full[used] @ trial.estimate[own])), False, order * ("lobes" in parts[0]))
    return sorted(out, key=lambda g: -g.gain)


def _scatter(wall: WallFit, used: NDArray[np.bool_]) -> float:
    """Robust rms (m) of the contact distance's residual, outliers clipped."""
    r = np.abs(wall.residual_m[used])
    if len(r) == 0:
        return float("nan")
    limit = 4 * max(MEDIAN_TO_SD * float(np.median(r)), 1e-6)
    return float(np.sqrt(np.mean(np.minimum(r, limit) ** 2)))
