"""What a measurement test finds, and the sizes below which a good rig's calibration, placement and lens leave nothing
better.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from analysis.gap.by_run import ByRun
from analysis.gap.thresholds import NEGLIGIBLE, SIGNIFICANCE


@dataclass(frozen=True)
class Finding:
    """One measurement effect: its parameters with sd, how many sd it is from nothing, and whether it is more than
    negligible.

    ``rivals``: effects that alone would explain the same residuals as well; ``negligible``: its smallest size in this
    rig's units, where it is no constant of :mod:`analysis.gap.thresholds`; ``by_run``: what each run says of it."""

    effect: str
    parameters: dict[str, tuple[float, float]]
    significance: float
    size: float
    found: bool
    rivals: tuple[str, ...] = ()
    negligible: float | None = None
    by_run: ByRun | None = None

    @property
    def unit(self) -> str:
        """Unit of ``size``, from the names of the parameters."""
        ending = next(iter(self.parameters)).rsplit("_", 1)[-1]
        return ending if ending in ("s", "px", "rad") else "1"

    @property
    def least(self) -> float:
        """The smallest size that is no longer negligible."""
        return NEGLIGIBLE[self.effect] if self.negligible is None else self.negligible

    def times_least(self) -> float:
        """Size over the smallest that would have been found in these data: its rank among findings."""
        noise = SIGNIFICANCE * self.size / self.significance if self.significance > 0 else 0.0
        return self.size / max(self.least, noise)


def judge(
    effect: str,
    parameters: dict[str, tuple[float, float]],
    size: float,
    significance: float,
    negligible: float | None = None,
) -> Finding:
    """A finding with its parameters (value, sd), ``found`` when it is both significant and more than negligible."""
    one = Finding(effect, parameters, float(significance), float(size), False, negligible=negligible)
    return replace(one, found=bool(size > one.least and significance > SIGNIFICANCE))
