"""What a step of the ladder finds: causes with a name, structure without one, and the sizes that count as
negligible.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from scipy.special import ndtr

from analysis.gap.by_run import ByRun

#: probabilities below this are not distinguished from it: no tail is known so far out
SMALLEST_P = 1e-12
#: what a structure goes with that is different in each run, in no order
EACH_RUN = "each run by itself"
#: what one begins with that goes with nothing that was asked
NONE_TESTED = "none of the covariates tested"
#: what friction of the wall goes with that each blow has of its own, or that holds by more than it slips with
EACH_BLOW = f"{NONE_TESTED} (scatter of the wall's friction from impact to impact)"
HELD_BY_MORE = "how far it would slip: where that is little, the wall holds by more than it slips with"
#: what one begins with that bends the picture of a camera, in all frames alike
IN_PICTURE = "the place in the picture of"
#: what one begins with of markers that have each other's name
EXCHANGED = "the names of"
#: what one begins with of a tracker that stays behind what it follows
OWN_WAY = "the way that each marker goes: it is seen behind where it is"
#: what one begins with of places that hold something of the frames beside them
BESIDE = "the frames before and after each"
#: what one ends with of markers that do not go with the Host
SEEN_HOST = "the Host is seen beside where it is"
#: ... that lean as it goes
TILTING_HOST = "the Host's markers tilt"
#: what one ends with of a clock: that of all cameras, or that of one against the other
CLOCKS = ("all cameras are late by a time that changes", "the delay of a camera changes")
#: what markers have in their words that lie on their body otherwise than stated
THAN_STATED = "than layout_m says"
BENT = "it is bent, by more than a calibration leaves of a lens"
BY_BOARDS = "the place in the world, as the boards measured it"


def two_sided(z: float) -> float:
    """How often chance is ``z`` standard deviations or more off, either way."""
    return float(max(2 * ndtr(-abs(z)), SMALLEST_P))


@dataclass(frozen=True, eq=False)
class Cause:
    """One accepted effect: where it lies, parameters (value, sd), how many times its negligible size it is, its gain.

    ``rivals``: effects that explain the same residual as well as this one does, in these data; ``by_run``: what each
    run says of an effect of the measurement; ``instead``: the best formula in its place that is no effect's;
    ``matters``: how much its strength counts beside others'."""

    effect: str
    stage: str
    parameters: dict[str, tuple[float, float]]
    strength: float
    gain: float
    coordinate: str
    phase: str
    rivals: tuple[str, ...] = ()
    by_run: ByRun | None = None
    instead: Instead | None = None
    matters: float = 1.0

    @property
    def weight(self) -> float:
        """Its strength as it counts beside that of others."""
        return self.strength * self.matters


@dataclass(frozen=True)
class Instead:
    """A ``formula`` in the place of a name, and what it says ``more`` of runs held out, the price of its unknowns taken
    off (fall of -2 log L; below 0 where it says less)."""

    formula: str
    more: float


@dataclass(frozen=True)
class RunPlace:
    """Where something lies in a run (its ``number``) off its mean place: x and y (m) with the sd of either."""

    number: int
    x_m: float
    y_m: float
    sd_m: float


@dataclass(frozen=True, eq=False)
class Structure:
    """Something no effect of the library explains: where it lies, what it goes with, and its ``size`` in ``unit``.

    ``strength``: how many times what is negligible; ``gain``: fall of -2 log L; ``p``: how often chance makes the best
    of all that was tried look so; ``places`` of the runs where each lies in its own, in no order; ``matters``: how much
    its strength counts beside others', of a residual that shows less than what matters elsewhere."""

    stage: str
    phase: str
    coordinate: str
    goes_with: str
    strength: float
    gain: float
    size: float
    unit: str
    p: float
    places: tuple[RunPlace, ...] = ()
    matters: float = 1.0

    @property
    def weight(self) -> float:
        """Its strength as it counts beside that of others."""
        return self.strength * self.matters

    @property
    def is_no_formula(self) -> bool:
        """Whether it says nothing of where to look for a formula: what each run or blow has of its own, and friction
        that decides who slips, not by how much."""
        return self.goes_with in (EACH_RUN, EACH_BLOW, HELD_BY_MORE)

    @property
    def is_taken_out(self) -> bool:
        """Whether it is out of the series as it is measured, and nothing need be asked because of it: a picture that is
        bent in no form, by the field that was learnt; markers with each other's name, frame by frame."""
        return self.goes_with.endswith(BENT) or self.goes_with.startswith(EXCHANGED)

    def entry(self) -> dict[str, Any]:
        """It in ``left`` of diagnosis.json."""
        return {
            "stage": self.stage,
            "phase": self.phase,
            "coordinate": self.coordinate,
            "goes_with": self.goes_with,
            "p": self.p,
            "size": self.size,
            "unit": self.unit,
            "times_negligible": self.strength,
        }
