"""What a rung of the ladder finds: causes with a name, structure without one, and the sizes that count as negligible."""

from __future__ import annotations

from dataclasses import dataclass

# Acceptance, set on series of analysis.blind and of the practice set (results tuned there are called that): a term must hold in
# most runs and stand clear of the scatter between them, not only of the noise.
SIGNIFICANCE, IMPROVED, GAIN = 5.0, 0.7, 50.0
IMPACT_GAIN = 25.0
# A probe overrides a named effect of the same residual when it explains more by this much (fall of -2 log L).
OVERRIDES = 10.0
# ... and structure left over beside an accepted effect makes the answer "unknown" when it is this share of the effect's own size.
LEFT_OVER = 0.25
# Two candidates whose held-out gains differ by less than this (fall of -2 log L) cannot be told apart by these data.
EQUIVALENT = 10.0
CENTRE_NEGLIGIBLE_M = 1.0e-4
MASS_CENTRE_NEGLIGIBLE_M = 5e-5
CONTACT_TIME_NEGLIGIBLE_S = 6e-5
# Ellipticity; where a lens residual is seen, what the like of it leaves in 50 series (0.7e-3 at most) is no finding.
ELLIPTICITY_NEGLIGIBLE, ELLIPTICITY_UNDER_LENS = 5e-4, 1.1e-3
ELLIPTICITY_SD_UNDER_LENS = 2.5e-4

@dataclass(frozen=True, eq=False)
class Cause:
    """One accepted effect: where it lies, parameters (value, sd), how many times its negligible size it is, its gain.

    ``rivals``: effects that explain the same residual as well as this one does, in these data."""

    effect: str
    stage: str
    parameters: dict[str, tuple[float, float]]
    strength: float
    gain: float
    coordinate: str
    phase: str
    rivals: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Structure:
    """Something no effect of the library explains: where it lies and what it goes with."""

    stage: str
    phase: str
    coordinate: str
    goes_with: str
    strength: float
    gain: float
