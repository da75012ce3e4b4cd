"""What the impacts that have surely slid say of the wall's friction, by themselves.

The fit of the whole law takes impacts that stick, which scatter by nothing, for the rule, and those that slide for
gross where one friction does not describe them all."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.contact.law import Law, LawData, stick_impulse
from ovines.robust import residual_sd

# A percent of model error of an impulse keeps the noise-free ones from ruling alone.
MODEL_SHARE = 0.01
# An impact has surely slid where it gives so many sds, and this share, less than a stick asks for.
SURE_SD, SURE_SHARE = 5.0, 0.1
# Impacts that slide, whose friction is asked by itself; and a stick that takes so much more than they do.
FEWEST_SLIDING, HELD_BEYOND = 4, 0.2
# Friction of dry contacts scatters by a tenth from impact to impact, which so many that slide show; and a stick takes
# hardly more than a slip does: so many that take more are no chance.
USUAL_FRICTION_SCATTER, FEWEST_FOR_SCATTER, FEWEST_BEYOND = 0.1, 8, 3


class FrictionOfBlows(NamedTuple):
    """The ``usual`` friction (median) of the impacts that ``slid``, so many, and its ``scatter`` over that; how many
    sticks took more, ``beyond`` it, and how many times the usual the strongest ``held``."""

    usual: float
    scatter: float
    held: float
    beyond: int
    slid: int

    @property
    def is_each_blows(self) -> bool:
        """Whether it is another one at each blow, by more than that of dry contacts is."""
        return self.scatter > USUAL_FRICTION_SCATTER and self.slid >= FEWEST_FOR_SCATTER

    @property
    def holds_by_more(self) -> bool:
        """Whether the wall holds by more than it slips with."""
        return self.scatter <= USUAL_FRICTION_SCATTER and self.beyond >= FEWEST_BEYOND


def surely_slid_or_stuck(data: LawData, law: Law) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Which impacts (K,) have surely slid, and which surely stuck, by their impulses."""
    wanted, given = np.abs(stick_impulse(data, law.tangential_restitution)), np.abs(data.tangential_impulse)
    sd = np.hypot(data.tangential_sd, MODEL_SHARE * wanted)
    off = np.maximum(SURE_SD * sd, SURE_SHARE * wanted)
    return wanted - given > off, np.abs(wanted - given) < 0.5 * off


def friction_of_blows(data: LawData, law: Law) -> FrictionOfBlows | None:
    """The friction of impacts that have surely slid; None of too few."""
    slid, stuck = surely_slid_or_stuck(data, law)
    if np.count_nonzero(slid) < FEWEST_SLIDING:
        return None
    friction = np.abs(data.tangential_impulse[slid]) / data.normal_impulse[slid]
    usual = float(np.median(friction))
    noise = float(np.median(data.tangential_sd[slid] / data.normal_impulse[slid])) / usual
    scatter = float(np.sqrt(max(residual_sd(friction / usual - 1) ** 2 - noise**2, 0.0)))
    held = np.abs(data.tangential_impulse[stuck]) / data.normal_impulse[stuck] / usual
    beyond = held > 1 + HELD_BEYOND + SURE_SD * scatter
    strongest = float(held[beyond].max(initial=1.0))
    return FrictionOfBlows(usual, scatter, strongest, int(np.count_nonzero(beyond)), len(friction))
