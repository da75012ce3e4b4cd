"""What no law of the contact predicts: the impacts' noise floor, one impact ahead.

A law free to follow what is usually known before the impact (speed, slip, spin, azimuth, drive's phase, time, run),
and what those laws follow that were written for what is left, is fitted to each residual, and the residual scaled back
for what the columns swallow.  What then is left is noise and the scatter from impact to impact, whatever the lens or
the scatter of restitution add to the flights' own covariance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from analysis.contact.held_laws import OF_IMPACTS, along_normals, known_at_impacts
from analysis.contact.law import LawData, fit_restitution
from analysis.contact.restitution import restitution_design
from analysis.flights.fit import FlightFits
from analysis.gap.selection.impacts.covariates import covariates
from analysis.gap.selection.impacts.fit import ImpactFit
from analysis.statistics.robust import least_squares
from ovines.core.laws import words as W
from ovines.core.laws.kernel import sizes
from ovines.core.laws.terms import Term, WrittenLaw, rows_of

Array = NDArray[np.float64]
# Slip over normal impulse at which the free tangential law may bend: from pure stick to pure slide on this rig.
KNOTS = (0.05, 0.15, 0.3, 0.5, 0.8, 1.2)
# A column counts whose part that no other has is this share of the largest; so many impacts must be left over from all
# columns to tell what scatters.
LEAST_OWN, LEAST_FREEDOM = 1e-9, 10


def impact_floor(
    impacts: ImpactFit,
    restitution_terms: Sequence[str],
    fits: Sequence[FlightFits] = (),
    laws: Sequence[WrittenLaw] = (),
) -> tuple[Array, Array]:
    """Errors after the impact (K, 2: normal, tangential; m/s) and of the spin (K,; rad/s) that remain with a law free
    to follow anything; ``laws`` in the rig's frame, asked between the flights of ``fits``.
    """
    data = impacts.data
    terms = _of_impacts(laws)
    sized, passing = _sized(terms, impacts, fits)
    design, turns = _with_laws(data, restitution_terms, terms, sized), sized[:, _turning(terms)]
    c, _, scatter = fit_restitution(along_normals(data, passing, turns.sum(1)), design)[:3]
    table = np.column_stack(
        [np.ones(len(data)), *covariates(data).values(), np.cos(data.at.azimuth_rad), np.sin(data.at.azimuth_rad)]
    )
    speed = np.column_stack([np.exp(-data.before / s) for s in (0.4, 1.5)])
    normal_sd = np.hypot(data.normal_sd, scatter * data.before)
    # Along a turned normal the disk meets the wall with a part of its speed along it, and is pushed aside.
    met = (data.normal_impulse / data.before * passing + data.tangential_impulse)[:, None] * turns
    followed = np.column_stack([data.before[:, None] * np.column_stack([design, table[:, 1:], speed]), met])
    normal = _left_over(data.after, followed, normal_sd)
    # One impact ahead the normal impulse is the predicted one.
    impulse = data.impulse_with((design @ c) * data.before)
    law = impacts.tangential_impulse(replace(data, normal_impulse=impulse))
    radius_m = impacts.junctions.radius_m
    table = np.column_stack([table, _tangential_columns(data, impulse)])
    along = [_lever(term.target, data, impulse, radius_m) * size for term, size in zip(terms, sized.T, strict=True)]
    columns = np.column_stack([law, impulse[:, None] * table, *along])
    turn = radius_m * data.inertia_factor
    spin = _left_over((data.angular + data.tangential_impulse) / turn, columns, data.angular_sd / turn)
    return np.column_stack([normal, _left_over(data.tangential_impulse, columns, data.tangential_sd)]), spin


def scatter_beside(
    impacts: ImpactFit, restitution_terms: Sequence[str], fits: Sequence[FlightFits], laws: Sequence[WrittenLaw]
) -> float:
    """Scatter of the restitution from impact to impact beside what ``laws`` predict of it."""
    terms = _of_impacts(laws)
    sized, passing = _sized(terms, impacts, fits)
    data = along_normals(impacts.data, passing, sized[:, _turning(terms)].sum(1))
    return fit_restitution(data, _with_laws(data, restitution_terms, terms, sized))[2]


def _of_impacts(laws: Sequence[WrittenLaw]) -> list[Term]:
    return [term for law in laws for term in law.terms if term.target in OF_IMPACTS]


def _with_laws(data: LawData, restitution_terms: Sequence[str], terms: Sequence[Term], sized: Array) -> Array:
    """Columns of the restitution: of its effects, and of what laws add to it."""
    own = np.array([term.target == "restitution" for term in terms], bool)
    return np.column_stack([restitution_design(data, restitution_terms), sized[:, own]])


def _turning(terms: Sequence[Term]) -> NDArray[np.bool_]:
    """Which terms turn the blow."""
    return np.array([term.target == "contact_normal" for term in terms], bool)


def _sized(terms: Sequence[Term], impacts: ImpactFit, fits: Sequence[FlightFits]) -> tuple[Array, Array]:
    """What each term adds to what it acts on, at each impact (K, T); and the centre's speed along the wall there (K,;
    m/s), where there is any term."""
    out, passing = np.zeros((len(impacts.data), len(terms))), np.zeros(len(impacts.data))
    if terms:
        known = known_at_impacts(impacts.data, impacts.junctions, fits)
        sizes(rows_of(terms), known, out)
        passing = known[:, W.PASSING]
    return np.nan_to_num(out), passing


def _lever(target: str, data: LawData, impulse: Array, radius_m: float) -> Array:
    """What a unit of a law's target moves along the wall (K,; m/s) but for a factor."""
    return {
        "restitution": np.zeros(len(data)),  # the impulse holds it
        "wall_friction": np.sign(data.slip) * impulse,
        "tangential_restitution": data.slip,
        "spin_kept": radius_m * data.at.spin,
        "spin_added": np.full(len(data), radius_m),
        "contact_normal": impulse,
    }[target]


def _tangential_columns(data: LawData, impulse: Array) -> Array:
    ratio, sign = np.abs(data.slip) / np.maximum(impulse, 1e-9), np.sign(data.slip)
    return np.column_stack([sign * ratio, *[sign * np.maximum(ratio - k, 0.0) for k in KNOTS]])


def _left_over(y: Array, columns: Array, sd: Array) -> Array:
    """Residual (K,) of a fit that a few blows of another kind (into a corner) do not move, scaled so that its rms is
    that of the errors themselves."""
    q, r = np.linalg.qr(columns / sd[:, None])
    q = q[:, np.abs(np.diag(r)) > LEAST_OWN * np.abs(np.diag(r)).max()]
    freedom = len(y) - q.shape[1]
    if freedom < LEAST_FREEDOM:
        return np.full(len(y), np.nan)
    return sd * least_squares(q, y / sd, np.ones(len(y))).residual * np.sqrt(len(y) / freedom)
