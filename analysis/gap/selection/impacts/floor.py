"""What no law of the contact predicts: the impacts' noise floor, one impact ahead.

A law free to follow everything that is known before the impact (speed, slip, spin, azimuth, drive's phase, time, run)
is fitted to each residual, and the residual scaled back for what the columns swallow.  What then is left is noise and
the scatter from impact to impact, whatever the lens or the scatter of restitution add to the flights' own covariance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from analysis.contact.law import LawData, fit_restitution
from analysis.contact.restitution import restitution_design
from analysis.gap.selection.impacts.covariates import covariates
from analysis.gap.selection.impacts.fit import ImpactFit

Array = NDArray[np.float64]
# Slip over normal impulse at which the free tangential law may bend: from pure stick to pure slide on this rig.
KNOTS = (0.05, 0.15, 0.3, 0.5, 0.8, 1.2)


def impact_floor(impacts: ImpactFit, restitution_terms: Sequence[str]) -> tuple[Array, Array]:
    """Errors after the impact (K, 2: normal, tangential; m/s) and of the spin (K,; rad/s) that remain with a law free
    to follow anything.
    """
    data = impacts.data
    design = restitution_design(data, restitution_terms)
    c = fit_restitution(data, design)[0]
    table = np.column_stack(
        [np.ones(len(data)), *covariates(data).values(), np.cos(data.azimuth_rad), np.sin(data.azimuth_rad)]
    )
    speed = np.column_stack([np.exp(-data.before / s) for s in (0.4, 1.5)])
    normal = _left_over(data.after, data.before[:, None] * np.column_stack([design, table[:, 1:], speed]))
    # One impact ahead the normal impulse is the predicted one.
    impulse = data.before + data.by_laws + (design @ c) * data.before
    law = impacts.tangential_impulse(replace(data, normal_impulse=impulse))
    columns = np.column_stack([law, impulse[:, None] * np.column_stack([table, _tangential_columns(data, impulse)])])
    turn = impacts.junctions.radius_m * data.inertia_factor
    spin = _left_over((data.angular + data.tangential_impulse) / turn, columns)
    return np.column_stack([normal, _left_over(data.tangential_impulse, columns)]), spin


def _tangential_columns(data: LawData, impulse: Array) -> Array:
    ratio, sign = np.abs(data.slip) / np.maximum(impulse, 1e-9), np.sign(data.slip)
    return np.column_stack([sign * ratio, *[sign * np.maximum(ratio - k, 0.0) for k in KNOTS]])


def _left_over(y: Array, columns: Array) -> Array:
    """Residual (K,) of a least-squares fit, scaled so that its rms is that of the errors themselves."""
    q, r = np.linalg.qr(columns)
    q = q[:, np.abs(np.diag(r)) > 1e-9 * np.abs(np.diag(r)).max()]
    freedom = len(y) - q.shape[1]
    if freedom < 10:
        return np.full(len(y), np.nan)
    return (y - q @ (q.T @ y)) * np.sqrt(len(y) / freedom)
