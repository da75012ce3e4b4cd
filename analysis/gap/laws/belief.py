"""Whether a law that nothing else asked for is believed, and the structure that it stands for."""

from __future__ import annotations

import numpy as np

from analysis.gap.cause import CLOCKS, Structure
from analysis.gap.laws.found_law import LawFound
from analysis.gap.thresholds import NEGLIGIBLE_FRAMES
from ovines.core.laws.words import QUANTITIES

# A law that no probe asked for closes at least this share of what is left: what a smeared disk passed for closed 0.26,
# a nick in the rim 0.95 to 1.0 (four series in view).
UNPROMPTED_CLOSED = 0.5


def believed(law: LawFound, size: float, least: float) -> LawFound | None:
    """A law that nothing else asked for, where it is surely there: larger than negligible, closing most of what is left
    in whichever runs are drawn, shown by both halves of the runs alike.  One flight that hides a glancing impact makes
    a force beside the wall that closes everything, and the other half, or most runs, know nothing of it."""
    alike = law.halves is not None and law.halves.agree and law.halves.both_show_it
    closes = law.closed > UNPROMPTED_CLOSED and law.shrinkage(np.random.default_rng(0))[1] > 0
    return law if size > least and closes and alike else None


def structure_of_law(
    law: LawFound, stage: str, coordinate: str, size: float, least: float, matters: float = 1.0
) -> Structure:
    """The structure that an unprompted law stands for: it goes with what the law's first term follows; ``matters``: how
    much its strength counts beside others'."""
    gain = float(np.sum(law.before - law.after))
    unit = "m" if stage == "geometry" else "1"
    phase = "free flight" if stage == "flight" else "impact"
    return Structure(stage, phase, coordinate, followed_by(law), size / least, gain, size, unit, law.p, matters=matters)


def followed_by(law: LawFound) -> str:
    """What the first term of a law follows, in words."""
    follows = [QUANTITIES[factor.quantity].in_words for factor in law.law.terms[0].factors]
    return " and ".join(f"the {one}" for one in follows) or "nothing: a constant"


def structure_of_clock(law: LawFound, period_s: float) -> Structure:
    """A clock that no effect of the library is: what its law leaves, in the smallest scatter of times that counts."""
    gain = float(np.sum(law.before - law.after))
    size_s = law.size
    least_s = NEGLIGIBLE_FRAMES["trigger_jitter"] * period_s
    goes_with = f"{followed_by(law)}: {CLOCKS[0]}"
    return Structure("measurement", "all", "x", goes_with, size_s / least_s, gain, size_s, "s", law.p)
