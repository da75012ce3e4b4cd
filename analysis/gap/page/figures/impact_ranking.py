"""Effects and probes of the impacts by what they gain on runs held out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from analysis.contact.restitution import (
    RESTITUTION_EFFECTS,
    best_speed_scale,
    conditions,
    restitution_columns,
    restitution_design,
)
from analysis.contact.wall_fit import DISTANCE_FLOOR_M
from analysis.gap.ladder import Ladder
from analysis.gap.page.figures.impact_residuals import WEAK_M_PER_S
from analysis.gap.page.figures.impacts import SHOWN_OF
from analysis.gap.page.figures.panels import Candidate
from analysis.gap.selection.impacts.covariates import PROBES, covariates
from analysis.gap.selection.impacts.distance import LOBES_AS_PROBE
from analysis.gap.selection.impacts.fit import ImpactFit
from analysis.gap.selection.impacts.tangential import ANGULAR_SHARE
from analysis.statistics.robust import at_least_noise, least_squares
from analysis.walls.lobes import ORDERS, lobe_columns

Array = NDArray[np.float64]

# Losses of single impacts are cut here (sd squared), as in the fits.
CLIP = 25.0


def impact_candidates(ladder: Ladder, probes: bool) -> list[Candidate]:
    """Gain of each effect or of each probe on runs held out of its estimate, beside everything else that was
    accepted."""
    fitted = ladder.impacts.fitted if probes else ladder.impacts.nominal
    if fitted is None:
        return []
    d, runs = fitted.data, len(ladder.series.runs)
    terms = ladder.impacts.restitution_terms if probes else ()
    design = restitution_design(d, terms)
    restitution = (d.after / d.before, d.normal_sd / d.before, design)
    wall = fitted.wall
    distance_sd = np.hypot(wall.impacts.sd("gap")[d.at.index], DISTANCE_FLOOR_M)
    nominal, ellipse = (wall.impacts.design(t)[d.at.index] for t in (wall.wall.nominal_terms, wall.wall.ellipse_terms))
    speed = d.before[:, None]
    base = np.hstack(
        [
            nominal,
            ellipse if ladder.impacts.shape.ellipse and probes else ellipse[:, :0],
            speed if ladder.impacts.shape.finite and probes else speed[:, :0],
        ]
    )
    distance = (wall.residual_m[d.at.index], distance_sd, base)
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
            Candidate(
                name,
                True,
                _gains(y, sd, _beside(name, base, names, columns, found), [own], d.at.run, runs)[0],
                name in found,
            )
            for names, ((y, sd, base), columns) in blocks.items()
            for name, own in zip(names, columns, strict=True)
            if name not in ("wall_ellipticity", "wall_lobes") or ellipse.shape[1]
        ]
    return _probe_candidates(ladder, fitted, {"restitution": restitution, "distance": distance})


def _beside(name: str, base: Array, names: Sequence[str], columns: Sequence[Array], found: set[str]) -> Array:
    """``base`` with the ``columns`` of all effects of ``names`` that were ``found``, but that of the one ``name``."""
    others = [own for other, own in zip(names, columns, strict=True) if other in found and other != name]
    return np.hstack([base, *others])


def _lobes(ladder: Ladder) -> Array:
    """Lobes (K, 2) of the order that was tried, at the impacts of the recalibrated fit."""
    d = ladder.both_impacts()[0].data
    order = next((gain.order for gain in ladder.impacts.gains if gain.order), ORDERS[0])
    return lobe_columns(d.at.azimuth_rad - d.at.host_angle_rad, order)


def _probe_candidates(
    ladder: Ladder, fitted: ImpactFit, regressions: dict[str, tuple[Array, Array, Array]]
) -> list[Candidate]:
    """Every group of covariates tried on every residual: the two of ``regressions`` (y, sd, base) and the two of the
    tangential law.
    """
    d, runs = fitted.data, len(ladder.series.runs)
    law = np.abs(fitted.tangential_impulse(d))
    strong = law > WEAK_M_PER_S
    share = np.where(strong, np.abs(d.tangential_impulse) / np.maximum(law, 1e-9) - 1, 0.0)
    share_sd = np.where(strong, np.hypot(d.tangential_sd / np.maximum(law, 1e-9), 0.01), 1e3)
    one = np.ones((len(d), 1))
    data = {
        **regressions,
        "tangential": (share, share_sd, one),
        "angular": (d.angular, np.hypot(d.angular_sd, ANGULAR_SHARE * d.normal_impulse), one),
    }
    coordinates = {shown: coordinate for coordinate, shown in SHOWN_OF.items()}
    found = {(s.coordinate, s.goes_with) for s in ladder.structure}
    table = covariates(d)
    out = []
    for residual, regression in data.items():
        # The wall's own shape is a named effect, not a probe.
        groups = {name: parts for name, parts in PROBES.items() if residual != "distance" or name not in LOBES_AS_PROBE}
        columns = [np.column_stack([table[p] for p in parts]) for parts in groups.values()]
        for name, gains in zip(groups, _gains(*regression, columns, d.at.run, runs), strict=True):
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
