"""Impacts that were measured elsewhere: from the table ``given_impacts`` to what the contact law sees.

Of a body that is no disk the contact lies at a lever from the centre of mass, and a normal impulse turns it: both
impulses then follow from both changes of the contact point's speed together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.contact.law import FEWEST_FOR_SPEED_FLOOR, SPEED_FLOOR_M_PER_S, Circumstances, LawData, joined
from analysis.contact.wall_fit import SLOWEST_M_PER_S
from ovines.recording_schema import Nes
from ovines.robust import residual_sd

Array = NDArray[np.float64]
INERTIA_OF_A_DISK = 0.5
UNKNOWN_M_PER_S = 1e6  # sd of a speed that was not measured
# An impact that leaves this many times faster than it came is no impact on a wall, but a mistake in a number.
MOST_RESTITUTION = 3.0
UNTIMED_S = 1.0  # from one impact to the next where the table has no times: none remembers the one before


def given_law_data(tables: Sequence[pd.DataFrame], nes: Nes) -> LawData:
    """The usable impacts of a series' tables ``given_impacts``: those that approach the wall and leave it, no
    faster than `MOST_RESTITUTION` allows.

    Tangential values are NaN where the table has none; ``index`` counts the rows of all tables one after another.
    """
    parts, first = [], 0
    for run, table in enumerate(tables):
        parts.append(_of_one(table, nes, run, first))
        first += len(table)
    data = joined(parts)
    # Where spins are known they must balance the impulses, whatever the law: what they do not is the speeds' error.
    known = data.angular_sd < UNKNOWN_M_PER_S
    floor = SPEED_FLOOR_M_PER_S
    if np.count_nonzero(known) >= FEWEST_FOR_SPEED_FLOOR:
        off = residual_sd(data.angular[known])
        floor = max(floor, float(np.sqrt(max(off**2 - float(np.median(data.angular_sd[known] ** 2)), 0.0))))
    return replace(
        data,
        normal_sd=np.hypot(data.normal_sd, floor),
        tangential_sd=np.hypot(data.tangential_sd, floor),
        angular_sd=np.hypot(data.angular_sd, floor),
    )


def with_slip(data: LawData) -> LawData:
    """The impacts whose tangential speeds are known."""
    return data.part(np.isfinite(data.tangential_impulse) & np.isfinite(data.slip))


def _of_one(table: pd.DataFrame, nes: Nes, run: int, first: int) -> LawData:
    def column(name: str, otherwise: Any) -> Array:
        values = table[name].to_numpy(float) if name in table else np.full(len(table), np.nan)
        return np.where(np.isfinite(values), values, otherwise)

    def speed(name: str) -> tuple[Array, Array]:
        return column(f"{name}_m_per_s", np.nan), column(f"{name}_sd_m_per_s", 0.0)

    (before, before_sd), (after, after_sd) = speed("normal_speed_before"), speed("normal_speed_after")
    (slip, slip_sd), (left, left_sd) = speed("tangential_speed_before"), speed("tangential_speed_after")
    inertia = nes.inertia_factor or INERTIA_OF_A_DISK
    gyration_m = np.sqrt(inertia) * nes.radius_m
    levers_m = np.column_stack([column("lever_normal_m", nes.radius_m), column("lever_tangential_m", 0.0)])
    normal, tangential = (levers_m / gyration_m).T
    # Changes of the contact point's speed (along the outward normal, along the tangent) by impulses per mass, inverted.
    whole = 1 + normal**2 + tangential**2
    own = np.stack([1 + normal**2, 1 + tangential**2], -1) / whole[:, None]
    cross = normal * tangential / whole
    change = np.stack([-(before + after), left - slip], -1)
    change_sd = np.stack([np.hypot(before_sd, after_sd), np.hypot(slip_sd, left_sd)], -1)
    # Without a lever along the wall the normal impulse is known although the slip is not.
    with np.errstate(invalid="ignore"):
        outward = own[:, 0] * change[:, 0] + np.where(cross != 0, cross * change[:, 1], 0.0)
        along = own[:, 1] * change[:, 1] + cross * change[:, 0]
    along_sd = np.hypot(own[:, 1] * change_sd[:, 1], cross * change_sd[:, 0])
    turn = column("spin_after_rad_per_s", np.nan) - column("spin_before_rad_per_s", np.nan)
    arm_m = np.hypot(*levers_m.T)
    angular = (gyration_m**2 * turn - (levers_m[:, 0] * along - levers_m[:, 1] * outward)) / arm_m
    known = np.isfinite(angular)
    count = len(table)
    none = np.zeros(count)
    data = LawData(
        before=before,
        after=after,
        slip=slip,
        normal_impulse=-outward,
        tangential_impulse=along,
        angular=np.where(known, angular, 0.0),
        normal_sd=np.sqrt(after_sd**2 + 0.5 * before_sd**2),
        tangential_sd=along_sd,
        angular_sd=np.where(known, along_sd, UNKNOWN_M_PER_S),
        at=Circumstances(
            spin=column("spin_before_rad_per_s", 0.0),
            run=np.full(count, run),
            time_s=column("time_s", np.arange(count) * UNTIMED_S),
            azimuth_rad=column("azimuth_rad", 0.0),
            host_angle_rad=none,
            drive_rad=none,
            drive_start_rad=none,
            index=first + np.arange(count),
        ),
        inertia_factor=inertia,
        levers=np.column_stack([normal, tangential]),
    )
    return data.part((before > SLOWEST_M_PER_S) & (after > 0) & (after < MOST_RESTITUTION * before))
