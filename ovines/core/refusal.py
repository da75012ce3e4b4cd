"""How the core refuses what cannot be: found, expected, do."""

from __future__ import annotations

import math


class ScenarioError(ValueError):
    """A scenario that cannot be: what was found, what was expected, what to do."""

    def __init__(self, found: str, expected: str, do: str) -> None:
        super().__init__(f"found:    {found}\nexpected: {expected}\ndo:       {do}")
        self.found, self.expected, self.do = found, expected, do

    def __reduce__(self) -> tuple[type[ScenarioError], tuple[str, str, str]]:  # a worker hands it through a pickle
        return type(self), (self.found, self.expected, self.do)


def require(holds: bool, found: str, expected: str, do: str) -> None:
    """Raise :class:`ScenarioError` unless ``holds``."""
    if not holds:
        raise ScenarioError(found, expected, do)


def require_range(name: str, value: float | None, low: float, high: float, above: bool = False) -> None:
    """Refuse ``value`` outside ``low..high`` (``above``: ``low`` itself is refused), NaN and nothing at all."""
    inside = value is not None and math.isfinite(value) and (low < value if above else low <= value) and value <= high
    bounds = f"{'above' if above else 'at least'} {low:g}" + (f" and at most {high:g}" if high < math.inf else "")
    require(inside, f"{name} = {value}", f"a finite number {bounds}", f"correct {name}")


def require_an_end(name: str, end_s: float, duration_s: float, most_impacts: bool) -> None:
    """Refuse a run that ended before its duration, and not because it had the most impacts that it may have: its steps
    came to nothing."""
    require(
        end_s >= duration_s or most_impacts,
        f"{name}: steps that come to nothing at {end_s:.6g} s",
        "forces and laws under which the disk moves on",
        "look for a law whose sign changes where it drives the disk to, or ask for a shorter duration_s",
    )
