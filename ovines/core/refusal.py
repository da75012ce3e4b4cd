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
