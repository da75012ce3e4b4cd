"""The disk's moment of inertia from its impacts: tangential impulses against the spins that they make.

An impulse j at the rim turns the disk by ``j / (q m R)`` whatever the contact's law, stick or slide, so that an error
of q is distinguished from any tangential restitution wherever the disk's angle is seen; without it the two are one.  A
disk's radius (or unit of length) that is off by as much looks alike: whether spins and impulses balance is asked first.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.contact.impacts import Impacts
from analysis.contact.law import FEWEST_FOR_SPEED_FLOOR, SPEED_FLOOR_M_PER_S, LawData, law_data
from analysis.statistics.gain import CUT_SD, regress
from ovines.robust import huber_loss, huber_weight

Array = NDArray[np.float64]
# Errors of an impulse beyond the flights' covariance, as a share of the normal one, as the angular probes have it.
SHARE_OF_NORMAL = 0.002
# Spins known worse than this (m/s at the rim) tell nothing: a motion without angles.
KNOWN_SPIN_M_PER_S = 1.0
FEWEST_IMPACTS = 15
# Spin against impulse: errors beyond this count linearly (Huber), and speed floors are tried up to 1 m/s.
BALANCE_CLIP_SD, SPEED_FLOORS_M_PER_S = 4.0, np.concatenate([[0.0], np.geomspace(1e-5, 1.0, 130)])


@dataclass(frozen=True)
class SpinBalance:
    """Tangential impulse over the angular momentum it must have given: ``ratio`` 1 with its sd where radius, inertia
    and length scale are right; ``speed_floor_m_per_s``: error of the impulses beyond the flights' covariance."""

    ratio: float
    ratio_sd: float
    speed_floor_m_per_s: float


def spin_balance(impacts: Impacts, used: NDArray[np.bool_], radius_m: float, inertia_factor: float) -> SpinBalance:
    """j_t against q R d(omega), which must agree whatever the contact law: by maximum likelihood."""
    data = law_data(impacts, used, radius_m, inertia_factor, 0.0)
    turned = data.angular + data.tangential_impulse
    if len(data) < FEWEST_FOR_SPEED_FLOOR or not np.median(data.angular_sd) < KNOWN_SPIN_M_PER_S:
        return SpinBalance(1.0, np.inf, SPEED_FLOOR_M_PER_S)
    best = (np.inf, 1.0, np.inf, 0.0)
    for floor in SPEED_FLOORS_M_PER_S:
        variance = data.angular_sd**2 + floor**2
        ratio, weight = 1.0, 1 / variance
        for _ in range(4):
            ratio = float(np.sum(weight * turned * data.tangential_impulse) / np.sum(weight * turned**2))
            z = (data.tangential_impulse - ratio * turned) / np.sqrt(variance)
            weight = huber_weight(z, BALANCE_CLIP_SD) / variance
        cost = float(np.sum(huber_loss(z, BALANCE_CLIP_SD) + np.log(variance)))
        if cost < best[0]:
            best = (cost, ratio, float(np.sum(weight * turned**2) ** -0.5), float(floor))
    return SpinBalance(*best[1:])


@dataclass(frozen=True, eq=False)
class InertiaFit:
    """``ratio`` of the true inertia to the one in use with its ``sd``; ``gain`` in -2 log L and ``significance`` (sds)
    of its difference from 1; ``beside``: the least gain that it has beside a torque of another form which alone
    explains more (that of the ratio where none does); ``held_out`` (R,): what the other runs' ratio takes of each run's
    sum of squares over the variance."""

    ratio: float
    sd: float
    gain: float
    significance: float
    beside: float
    held_out: Array


def fit_inertia(data: LawData, runs: int, radius_m: float) -> InertiaFit | None:
    """The inertia that the impacts of so many ``runs`` show, of a disk of ``radius_m``, against the one that ``data``
    was made with; None where they are too few, or without spins.

    A force that the flights lack bends their ends, and with them the impulses: only flights that hold what acts on them
    tell an inertia."""
    if len(data) < FEWEST_IMPACTS or not np.median(data.angular_sd) < KNOWN_SPIN_M_PER_S:
        return None
    sd = np.sqrt(data.angular_sd**2 + (SHARE_OF_NORMAL * data.normal_impulse) ** 2)
    columns = np.column_stack([np.ones(len(data)), data.tangential_impulse])
    gain, (slope,), (slope_sd,), _, significance = regress(columns, data.angular, sd)
    # angular / j = (q - q_true) / (1 + q_true), j being computed with q.
    q = data.inertia_factor
    ratio = float((q - slope) / (1 + slope) / q)
    ratio_sd = float(slope_sd) * (1 + q) / (1 + slope) ** 2 / q
    beside = _beside(data, columns, sd, float(gain), radius_m)
    return InertiaFit(
        ratio, float(ratio_sd), float(gain), float(significance), beside, _held_out(data, columns, sd, runs)
    )


def _beside(data: LawData, columns: Array, sd: Array, gain: float, radius_m: float) -> float:
    """What the ratio explains beside a torque of the blow itself, where that alone explains more: one that resists the
    spin, or follows the slip, or turns the disk one way, by how hard the blow is or always alike."""
    spin, slip = np.sign(data.at.spin), np.sign(data.slip)
    left = np.sign(radius_m * data.at.spin + data.tangential_impulse / data.inertia_factor)
    blow = data.normal_impulse
    out = gain
    for torque in (left * blow, left, spin * blow, spin, slip * blow, slip, blow):
        alone = float(regress(np.column_stack([np.ones(len(data)), torque]), data.angular, sd)[0])
        if alone > gain:
            out = min(out, float(regress(np.column_stack([columns, torque]), data.angular, sd)[0]) - alone)
    return out


def _held_out(data: LawData, columns: Array, sd: Array, runs: int) -> Array:
    """Fall of the sum of squares (R,) of each run by the other runs' slope; single errors are cut."""
    out = np.zeros(runs)
    for run in np.unique(data.at.run):
        here = data.at.run == run
        rest = ~here if np.count_nonzero(~here) >= FEWEST_IMPACTS else np.ones(len(data), bool)
        slope = regress(columns[rest], data.angular[rest], sd[rest])[1][0]
        before, after = (data.angular[here] - k * data.tangential_impulse[here] for k in (0.0, slope))
        cut = [np.sum(np.minimum((one / sd[here]) ** 2, (4 * CUT_SD) ** 2)) for one in (before, after)]
        out[run] = cut[0] - cut[1]
    return out
