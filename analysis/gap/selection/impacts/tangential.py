"""Probes in the tangential law, sliding and sticking, and in the angular one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, fdtrc

from analysis.contact.law import Law, LawData, predicted_tangential, sticks
from analysis.contact.sliding import MODEL_SHARE, surely_slid_or_stuck
from analysis.gap.cause import EACH_RUN
from analysis.gap.selection.impacts.covariates import (
    FEWEST_RUNS,
    PROBES,
    covariates,
    run_columns,
    runs_by_chance,
    standardised,
)
from analysis.gap.selection.impacts.gain import ImpactGain
from analysis.statistics.gain import regress

Array = NDArray[np.float64]

# Impacts that slide, or stick, of which probes ask.
FEWEST_FOR_PROBES = 15
# The residual is a share of the impulse (per mass, the rig's own units): of a weaker one it is mostly noise.
LEAST_IMPULSE_M_PER_S = 0.02
# What the angular law leaves of a perfect rig, as a share of the normal impulse.
ANGULAR_SHARE = 0.002
# So many impacts beyond one in each run say how far friction scatters within a run, but for this share, which may be
# gross; nothing is stated as less likely than this.
FEWEST_WITHIN, GROSS_SHARE, LEAST_P = 2, 0.1, 1e-200


def tangential_gains(data: LawData, law: Law) -> list[ImpactGain]:
    """Probes in the tangential law (wall friction that follows something) and in the angular law."""
    table = covariates(data)
    seen = data.at.azimuth_rad - data.at.host_angle_rad
    table = {
        **table,
        "cos azimuth": np.cos(seen),
        "sin azimuth": np.sin(seen),
        "approach speed": standardised(data.before),
    }
    groups = {**PROBES, "the azimuth": ("cos azimuth", "sin azimuth"), "the approach speed": ("approach speed",)}
    sliding = ~sticks(data, law.wall_friction, law.tangential_restitution)
    predicted = predicted_tangential(data, law.wall_friction, law.tangential_restitution)
    out = []
    for residual, part in (("sliding", sliding), ("sticking", ~sliding)):
        # Relative to the impulse the law predicts.
        size = np.abs(predicted)
        strong = part & (size > LEAST_IMPULSE_M_PER_S)
        enough = np.count_nonzero(strong) >= FEWEST_FOR_PROBES
        if residual == "sliding" and not (enough and run_columns(data.at.run[strong]) is not None):
            out += _friction_by_run(data, law)
        if not enough:
            continue
        y = (np.abs(data.tangential_impulse) - size)[strong] / size[strong]
        error = np.sqrt((data.tangential_sd[strong] / size[strong]) ** 2 + MODEL_SHARE**2)
        out += _regressions(residual, groups, {k: v[strong] for k, v in table.items()}, y, error)
        out += _run_regression(residual, data.at.run[strong], y, error)
    angular_sd = np.sqrt(data.angular_sd**2 + (ANGULAR_SHARE * data.normal_impulse) ** 2)
    out += _regressions("angular", groups, table, data.angular, angular_sd)
    out += _run_regression("angular", data.at.run, data.angular, angular_sd)
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


def _friction_by_run(data: LawData, law: Law) -> list[ImpactGain]:
    """A friction of each run's own where few impacts slide in each: those that surely have, each of which tells
    friction to a hundredth, lie farther apart between runs than within them, whichever run is left out.

    By the impulse, not by the nominal friction: beside that, those of a run of little friction pass for stuck."""
    friction = np.abs(data.tangential_impulse) / data.normal_impulse
    slid, _ = surely_slid_or_stuck(data, law)
    slid = _without_gross(friction, data.at.run, slid)
    numbers, which = np.unique(data.at.run[slid], return_inverse=True)
    if len(numbers) <= FEWEST_RUNS:
        return []
    run, friction, noise = data.at.run[slid], friction[slid], (data.tangential_sd / data.normal_impulse)[slid]
    usual = float(np.median(friction))
    off, weight = friction / usual - 1, 1 / ((noise / usual) ** 2 + MODEL_SHARE**2)
    p = max(_chance_of_runs(off[run != one], weight[run != one], run[run != one]) for one in numbers)
    information = np.bincount(which, weight)
    means = np.bincount(which, weight * off) / information
    # As much as a pair of columns that chance gives as seldom.
    gain, size = -2 * float(np.log(max(p, LEAST_P))), float(np.std(means[which]))
    return [ImpactGain(EACH_RUN, "sliding", gain, size, means, 1 / np.sqrt(information), False, float(np.sqrt(gain)))]


def _without_gross(values: Array, run: NDArray[np.int64], own: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """``own`` (K,) without the share of them that lie farthest off the medians of their runs."""
    out = own.copy()
    for _ in range(int(GROSS_SHARE * np.count_nonzero(own))):
        off = np.zeros(len(values))
        for one in np.unique(run[out]):
            here = out & (run == one)
            off[here] = np.abs(values[here] - np.median(values[here]))
        out[np.argmax(off)] = False
    return out


def _chance_of_runs(off: Array, weight: Array, run: NDArray[np.int64]) -> float:
    """How often chance sets the runs of values ``off`` (K,) as far apart, by what they scatter within runs where that
    is more than their noise of variances 1 / ``weight``."""
    numbers, which = np.unique(run, return_inverse=True)
    between, within = len(numbers) - 1, len(run) - len(numbers)
    if within < FEWEST_WITHIN:
        return 1.0
    information = np.bincount(which, weight)
    means = np.bincount(which, weight * off) / information
    inside = float(np.sum(weight * (off - means[which]) ** 2)) / within
    across = float(np.sum(information * (means - np.average(off, weights=weight)) ** 2))
    return float(chdtrc(between, across)) if inside <= 1 else float(fdtrc(between, within, across / between / inside))
