"""What a step of the ladder finds: causes with a name, structure without one, and the sizes that count as
negligible.
"""

from __future__ import annotations

from dataclasses import dataclass


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
