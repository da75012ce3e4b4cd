"""Probes in the tangential law, sliding and sticking, and in the angular one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.contact.law import Law, LawData, predicted_tangential, sticks
from analysis.gap.cause import EACH_RUN
from analysis.gap.selection.impacts.covariates import PROBES, covariates, run_columns, runs_by_chance, standardised
from analysis.gap.selection.impacts.gain import ImpactGain
from analysis.statistics.gain import regress

Array = NDArray[np.float64]


def tangential_gains(data: LawData, law: Law) -> list[ImpactGain]:
    """Probes in the tangential law (wall friction that follows something) and in the angular law."""
    table = covariates(data)
    seen = data.azimuth_rad - data.host_angle_rad
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
