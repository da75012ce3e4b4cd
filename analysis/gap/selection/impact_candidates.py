"""The impacts' side of the ladder: contact distance, restitution, tangential and angular law; named effects and probes.

Every statement is a regression of one residual per impact on something it may go with.  Restitution scatters from
impact to impact, which is a nuisance in every model; structure in that scatter is not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from analysis.contact.held_laws import since_before
from analysis.contact.law import (
    Law,
    LawData,
    fit_restitution,
    predicted_tangential,
    sticks,
)
from analysis.contact.restitution import (
    best_speed_scale,
    conditions,
    restitution_columns,
    restitution_design,
)
from analysis.contact.wall_fit import WallFit, fit_wall, lobe_order
from analysis.gap.cause import EACH_RUN
from analysis.gap.selection.impact_fit import ImpactFit, Shape, wall_prior
from analysis.statistics.gain import regress
from analysis.walls.lobes import LOBE_TERMS, ORDERS, LobedWall, lobe_columns
from ovines.robust import MEDIAN_TO_SD

Array = NDArray[np.float64]

#: what a term must explain to be more than negligible: of a law of the contact in its own units, of the angular one (a
#: velocity) as a share of the median approach
NEGLIGIBLE = {"restitution": 0.012, "sliding": 0.04, "sticking": 0.04, "angular": 5e-3}


def negligible_size(residual: str, data: LawData) -> float:
    """What a term of ``residual`` must explain of these impacts to be more than negligible."""
    return NEGLIGIBLE[residual] * (float(np.median(data.before)) if residual == "angular" else 1.0)


@dataclass(frozen=True, eq=False)
class ImpactGain:
    """What one term explains: fall of -2 log L, the rms of what it adds (units of the residual), coefficients and
    sd; ``columns`` (K, .) of a term of the restitution.
    """

    name: str
    residual: str
    gain: float
    size: float
    estimate: Array
    sd: Array
    named: bool
    significance: float = 0.0
    columns: Array | None = None
    order: int = 0


def covariates(data: LawData) -> dict[str, Array]:
    """What a residual of an impact may go with, each centred and of unit spread unless it is an angle's cosine or
    sine.
    """
    seen = data.azimuth_rad - data.host_angle_rad
    plain = {
        "slip speed": np.abs(data.slip),
        "slip direction": np.sign(data.slip),
        "spin": np.abs(data.spin) / 100,
        "sense of spin": data.spin / 100,
        "time in the run": data.time_s,
        "run": data.run.astype(float),
        "memory of the impact before": np.exp(-since_before(data) / MEMORY_S),
    }
    out = {name: _standardised(values) for name, values in plain.items()}
    # Seconds of the recording at the drive's frequency: what another machine in step with the drive would follow.
    clock = data.drive_rad - data.drive_start_rad
    out.update({"cos clock": np.cos(clock), "sin clock": np.sin(clock)})
    out.update(
        {
            "cos drive phase": np.cos(data.drive_rad),
            "sin drive phase": np.sin(data.drive_rad),
            "cos 2 azimuth": np.cos(2 * seen),
            "sin 2 azimuth": np.sin(2 * seen),
            "cos 3 azimuth": np.cos(3 * seen),
            "sin 3 azimuth": np.sin(3 * seen),
        }
    )
    return out


def _standardised(values: Array) -> Array:
    spread = np.std(values)
    return (values - values.mean()) / spread if spread > 1e-12 else np.zeros_like(values)


#: how long a wall may remember the impact before, for the probe that asks
MEMORY_S = 0.03
#: probes as groups of covariates that belong together
PROBES = {
    "the time since the impact before": ("memory of the impact before",),
    "the slip speed": ("slip speed",),
    "the direction of slip": ("slip direction",),
    "the spin": ("spin",),
    "the sense of spin": ("sense of spin",),
    "the time in the run": ("time in the run",),
    "the run": ("run",),
    "the drive's phase": ("cos drive phase", "sin drive phase"),
    "the recording's time at the drive's frequency": ("cos clock", "sin clock"),
    "twice the azimuth": ("cos 2 azimuth", "sin 2 azimuth"),
    "three times the azimuth": ("cos 3 azimuth", "sin 3 azimuth"),
}
# It is asked where so many runs have so many impacts each.
FEWEST_RUNS, FEWEST_IN_RUN = 3, 4
# What chance gains as seldom by the columns of all runs as by those of a pair, it may: this seldom.
SELDOM = 1e-3
#: what the contact distance shows as a wall's shape
LOBES_AS_PROBE = ("twice the azimuth", "three times the azimuth")
#: so many orders of lobes are tried, of which the best gains this much more by chance
LOBES_BY_CHANCE = 2 * float(np.log(len(ORDERS)))
#: twenty places and two widths are tried (:func:`spots`): the best of them gains about this much by chance
SPOTS_BY_CHANCE = 8.0


def run_columns(run: NDArray[np.int64]) -> Array | None:
    """One column for each run but the last (K, R - 1), each of mean zero; short runs stay with the last, None where too
    few are left."""
    numbers, counts = np.unique(run, return_counts=True)
    numbers = numbers[counts >= FEWEST_IN_RUN]
    if len(numbers) < FEWEST_RUNS:
        return None
    columns = (run[:, None] == numbers[:-1]).astype(float)
    return np.asarray(columns - columns.mean(0), float)


def runs_by_chance(columns: Array) -> float:
    """How much more chance gains by ``columns`` (K, C) than by a pair of them."""
    return float(chi2.isf(SELDOM, columns.shape[1]) - chi2.isf(SELDOM, 2))


def restitution_gains(
    data: LawData, base: Sequence[str], withheld: frozenset[str] = frozenset(), beside: Array | None = None
) -> list[ImpactGain]:
    """Named effects and probes in the restitution, on top of a model with the effects ``base`` and the columns
    ``beside`` (K, .); ``withheld`` ones are probes.
    """
    design = _beside(restitution_design(data, base), beside)
    _, _, _, value = fit_restitution(data, design)
    out = []
    groups = [(name, columns, named, 0.0) for name, columns, named in restitution_groups(data, base, withheld)]
    spot = best_spot(data, design, value)
    if spot is not None:
        groups.append((f"a place on the wall at azimuth {spot[0]:.1f} rad", spot[1][:, None], False, SPOTS_BY_CHANCE))
    runs = run_columns(data.run)
    if runs is not None:
        groups.append((EACH_RUN, runs, False, runs_by_chance(runs)))
    for name, columns, named, penalty in groups:
        out.append(_restitution_gain(data, design, value, columns, name=name, named=named, penalty=penalty))
    return sorted(out, key=lambda g: -g.gain)


def _beside(design: Array, beside: Array | None) -> Array:
    return design if beside is None else np.column_stack([design, beside])


def _restitution_gain(
    data: LawData, design: Array, value: float, columns: Array, *, name: str, named: bool, penalty: float = 0.0
) -> ImpactGain:
    """What ``columns`` (K, .) gain on top of ``design``, at which -2 log L is ``value``."""
    k = design.shape[1]
    c, covariance, _, new = fit_restitution(data, np.column_stack([design, columns]))
    significance = float(np.sqrt(max(float(c[k:] @ np.linalg.pinv(covariance[k:, k:], hermitian=True) @ c[k:]), 0.0)))
    return ImpactGain(
        name,
        "restitution",
        value - new - penalty,
        float(np.std(columns @ c[k:])),
        c[k:],
        np.sqrt(np.diag(covariance))[k:],
        named,
        significance,
        columns,
    )


def kept_gain(data: LawData, names: Sequence[str], name: str, beside: Array | None) -> ImpactGain:
    """What an effect that the model ``names`` holds gains over the model without it."""
    others = [n for n in names if n != name]
    design = _beside(restitution_design(data, others), beside)
    scale = best_speed_scale(data) if name == "speed_dependent_restitution" else 1.0
    columns = restitution_columns(conditions(data), [name], scale)[:, 1:]
    return _restitution_gain(data, design, fit_restitution(data, design)[3], columns, name=name, named=True)


def restitution_groups(
    data: LawData, base: Sequence[str], withheld: frozenset[str] = frozenset()
) -> list[tuple[str, Array, bool]]:
    """What the restitution may follow beyond ``base``: name, columns (K, .), and whether it is an effect of the
    library.
    """
    speeds, directions = (
        _columns(_standardised(data.before), _standardised(data.before**2)),
        _columns(np.cos(data.azimuth_rad), np.sin(data.azimuth_rad)),
    )
    out: list[tuple[str, Array, bool]] = []
    if "speed_dependent_restitution" in withheld:
        out.append(("the approach speed", speeds, False))
    elif "speed_dependent_restitution" not in base:
        out.append(("speed_dependent_restitution", _columns(np.exp(-data.before / best_speed_scale(data))), True))
    else:
        out.append(("the approach speed in another way", speeds, False))
    if "direction_dependent_restitution" in withheld:
        out.append(("the azimuth", directions, False))
    elif "direction_dependent_restitution" not in base:
        out.append(("direction_dependent_restitution", directions, True))
    if "restitution_drift" not in (*base, *withheld):
        at = conditions(data)
        out.append(("restitution_drift", _columns(at.since_start_s, at.run), True))
    table = covariates(data)
    return out + [(name, _columns(*(table[p] for p in parts)), False) for name, parts in PROBES.items()]


def _columns(*columns: Array) -> Array:
    return np.column_stack(columns)


def spots(data: LawData) -> list[tuple[float, Array]]:
    """Bumps (K,) at places of the wall, with their azimuth (rad, Host's frame): twenty places, two widths, where
    impacts are.
    """
    seen = data.azimuth_rad - data.host_angle_rad
    out = []
    for width in (0.25, 0.5):
        for centre in np.arange(-np.pi, np.pi, np.pi / 10):
            bump = np.exp(-0.5 * (np.angle(np.exp(1j * (seen - centre))) / width) ** 2)
            if np.count_nonzero(bump > 0.5) >= 4:
                out.append((float(centre), bump))
    return out


def best_spot(data: LawData, design: Array, value: float) -> tuple[float, Array] | None:
    """Bump of restitution at one place of the wall: the best of a scan over azimuth (Host's frame) and width."""
    best, found = 0.0, None
    for spot in spots(data):
        gain = value - fit_restitution(data, np.column_stack([design, spot[1]]))[3]
        if gain > best:
            best, found = gain, spot
    return found


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
    table = {**covariates(base.data), "approach speed": _standardised(base.data.before)}
    # The wall's own shape is among the names; further lobes beside named ones have no name.
    probes = {k: v for k, v in PROBES.items() if k not in LOBES_AS_PROBE}
    if "wall_ellipticity" in withheld:
        probes["twice the azimuth"] = PROBES["twice the azimuth"]
    if order and not named:
        lobes = lobe_columns(base.data.azimuth_rad - base.data.host_angle_rad, order)
        table |= {"cos lobes": lobes[:, 0], "sin lobes": lobes[:, 1]}
        probes["three times the azimuth" if order == 3 else f"{order} times the azimuth"] = ("cos lobes", "sin lobes")
    if "finite_contact_time" in withheld:
        probes["the approach speed"] = ("approach speed",)
    for name, parts in probes.items():
        full = np.zeros((len(base.junctions), len(parts)))
        full[base.data.index] = np.column_stack([table[p] for p in parts])
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


def tangential_gains(data: LawData, law: Law) -> list[ImpactGain]:
    """Probes in the tangential law (wall friction that follows something) and in the angular law."""
    table = covariates(data)
    seen = data.azimuth_rad - data.host_angle_rad
    table = {
        **table,
        "cos azimuth": np.cos(seen),
        "sin azimuth": np.sin(seen),
        "approach speed": _standardised(data.before),
    }
    groups = {**PROBES, "the azimuth": ("cos azimuth", "sin azimuth"), "the approach speed": ("approach speed",)}
    sliding = ~sticks(data, law.wall_friction, law.tangential_restitution)
    predicted = predicted_tangential(data, law.wall_friction, law.tangential_restitution)
    out = []
    for residual, part in (("sliding", sliding), ("sticking", ~sliding)):
        # Relative to the impulse the law predicts; a percent of model error keeps the noise-free ones from ruling
        # alone.
        size = np.abs(predicted)
        strong = part & (size > 0.02)
        if np.count_nonzero(strong) < 15:
            continue
        y = (np.abs(data.tangential_impulse) - size)[strong] / size[strong]
        error = np.sqrt((data.tangential_sd[strong] / size[strong]) ** 2 + 0.01**2)
        out += _regressions(residual, groups, {k: v[strong] for k, v in table.items()}, y, error)
        out += _run_regression(residual, data.run[strong], y, error)
    angular_sd = np.sqrt(data.angular_sd**2 + (0.002 * data.normal_impulse) ** 2)
    out += _regressions("angular", groups, table, data.angular, angular_sd)
    out += _run_regression("angular", data.run, data.angular, angular_sd)
    return sorted(out, key=lambda g: -g.gain)


def _regressions(
    residual: str, groups: dict[str, tuple[str, ...]], table: dict[str, Array], y: Array, sd: Array
) -> list[ImpactGain]:
    out = []
    for name, parts in groups.items():
        gain, estimate, e, size, significance = regress(
            np.column_stack([np.ones(len(y)), *[table[p] for p in parts]]), y, sd
        )
        out.append(ImpactGain(name, residual, gain, size, estimate, e, False, significance))
    return out


def _run_regression(residual: str, run: NDArray[np.int64], y: Array, sd: Array) -> list[ImpactGain]:
    columns = run_columns(run)
    if columns is None:
        return []
    gain, estimate, e, size, significance = regress(np.column_stack([np.ones(len(y)), columns]), y, sd)
    gain -= runs_by_chance(columns)
    return [ImpactGain(EACH_RUN, residual, gain, size, estimate, e, False, significance)]
