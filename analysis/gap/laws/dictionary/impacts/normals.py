"""Candidates for the direction of a blow: a lining that piles up before the disk, teeth that lean, a wall that a tool
has left wavy turn it from the wall's normal.

Such a blow moves the disk along the wall without a torque, which no number of the contact law does.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.gap.laws.dictionary.candidate import Candidate, waves
from analysis.gap.laws.dictionary.impacts.around import ORDERS, SIDE_ORDERS
from analysis.gap.laws.dictionary.parts import plain, scaled
from ovines.core.laws import words as W
from ovines.core.laws.terms import Factor, Term

Array = NDArray[np.float64]
WORD, TARGET = "direction of the blow", "contact_normal"
PLAIN = (
    ("constant", ()),
    ("by the sense of slip", (Factor("slip", "sign"),)),
    ("with the signed slip", (Factor("slip"),)),
    ("by the sense of spin", (Factor("spin", "sign"),)),
    ("with the signed spin", (Factor("spin"),)),
    ("by the sense of the centre's way along the wall", (Factor("passing", "sign"),)),
    ("with the centre's signed speed along the wall", (Factor("passing"),)),
    ("with the approach speed", (Factor("approach"),)),
    ("with the approach speed, by the sense of slip", (Factor("approach"), Factor("slip", "sign"))),
    ("with the Host's acceleration about its centre", (Factor("host_acceleration_around"),)),
)
# What it goes around with, in so many waves.
AROUND = (("azimuth", ORDERS), ("body_angle", SIDE_ORDERS), ("phase", (1.0, 2.0)), ("clock", (1.0,)))
# Quantiles of a slip or a spin at which a scale starts.
SCALES = (0.1, 0.3, 0.6)


def normal_candidates(known: Array) -> list[Candidate]:
    """From what is known at the impacts (K, KNOWN_SIZE)."""
    out = [plain(f"{WORD} {name}", Term(TARGET, 1.0, factors)) for name, factors in PLAIN]
    for quantity, orders in AROUND:
        for order in orders:
            terms = (Term(TARGET, 1.0, (wave,)) for wave in waves(quantity, order))
            out.append(plain(f"{WORD} with the {quantity}, order {order:g}", *terms))
    for quantity, column in (("slip", W.SLIP), ("spin", W.SPIN), ("passing", W.PASSING)):
        values = np.abs(known[:, column])
        sizes = sorted({float(size) for size in np.quantile(values, SCALES)}) if len(values) else []
        out += scaled(f"{WORD} with the {quantity}, bent", TARGET, (quantity, "tanh", 1.0), sizes)
    return out
