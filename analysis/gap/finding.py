"""What a measurement test finds, and the sizes below which a good rig's calibration, placement and lens leave nothing
better.
"""

from __future__ import annotations

from dataclasses import dataclass

from analysis.gap.thresholds import NEGLIGIBLE, SIGNIFICANCE


@dataclass(frozen=True)
class Finding:
    """One measurement effect: its parameters with sd, how many sd it is from nothing, and whether it is more than
    negligible.

    ``rivals``: effects that alone would explain the same residuals as well."""

    effect: str
    parameters: dict[str, tuple[float, float]]
    significance: float
    size: float
    found: bool
    rivals: tuple[str, ...] = ()

    @property
    def unit(self) -> str:
        """Unit of ``size``, from the names of the parameters."""
        ending = next(iter(self.parameters)).rsplit("_", 1)[-1]
        return ending if ending in ("s", "px", "rad") else "1"

    def times_least(self) -> float:
        """Size over the smallest that would have been found in these data: its rank among findings."""
        noise = SIGNIFICANCE * self.size / self.significance if self.significance > 0 else 0.0
        return self.size / max(NEGLIGIBLE[self.effect], noise)


def judge(effect: str, parameters: dict[str, tuple[float, float]], size: float, significance: float) -> Finding:
    """A finding with its parameters (value, sd), ``found`` when it is both significant and more than negligible."""
    return Finding(
        effect,
        parameters,
        float(significance),
        float(size),
        bool(size > NEGLIGIBLE[effect] and significance > SIGNIFICANCE),
    )
