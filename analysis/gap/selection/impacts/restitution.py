"""Candidates in the restitution: named effects, probes, a place of the wall, a value of each run's own.

Restitution scatters from impact to impact, which is a nuisance in every model; structure in that scatter is not.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from analysis.contact.law import LawData, fit_restitution
from analysis.contact.restitution import best_speed_scale, conditions, restitution_columns, restitution_design
from analysis.gap.cause import EACH_RUN
from analysis.gap.selection.impacts.covariates import PROBES, covariates, run_columns, runs_by_chance, standardised
from analysis.gap.selection.impacts.gain import ImpactGain

Array = NDArray[np.float64]

#: twenty places and two widths are tried (:func:`spots`): the best of them gains about this much by chance
SPOTS_BY_CHANCE = 8.0


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
    runs = run_columns(data.at.run)
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
    scale = best_speed_scale(data, design[:, 1:]) if name == "speed_dependent_restitution" else 1.0
    columns = restitution_columns(conditions(data), [name], scale)[:, 1:]
    return _restitution_gain(data, design, fit_restitution(data, design)[3], columns, name=name, named=True)


def restitution_groups(
    data: LawData, base: Sequence[str], withheld: frozenset[str] = frozenset()
) -> list[tuple[str, Array, bool]]:
    """What the restitution may follow beyond ``base``: name, columns (K, .), and whether it is an effect of the
    library.
    """
    speeds, directions = (
        _columns(standardised(data.before), standardised(data.before**2)),
        _columns(np.cos(data.at.azimuth_rad), np.sin(data.at.azimuth_rad)),
    )
    out: list[tuple[str, Array, bool]] = []
    if "speed_dependent_restitution" in withheld:
        out.append(("the approach speed", speeds, False))
    elif "speed_dependent_restitution" not in base:
        scale = best_speed_scale(data, restitution_design(data, base)[:, 1:])
        out.append(("speed_dependent_restitution", _columns(np.exp(-data.before / scale)), True))
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
    seen = data.at.azimuth_rad - data.at.host_angle_rad
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
