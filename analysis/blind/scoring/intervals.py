"""Shares and means with their 90 % intervals and goals."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Figure:
    """A figure with its 90 % interval, the goal (None: no goal) and on how many cases it rests."""

    name: str
    value: float | None
    low: float | None
    high: float | None
    n: int
    goal: str = ""
    met: bool | None = None


def wilson(right: int, n: int, level_z: float = 1.645) -> tuple[float, float]:
    """Wilson's interval of a proportion (J. Am. Stat. Assoc. 22, 209 (1927)), 90 % by default; (0, 1) for n
    = 0."""
    if n == 0:
        return 0.0, 1.0
    share, z2 = right / n, level_z**2
    middle = (share + z2 / (2 * n)) / (1 + z2 / n)
    half = level_z / (1 + z2 / n) * np.sqrt(share * (1 - share) / n + z2 / (4 * n * n))
    return float(max(middle - half, 0.0)), float(min(middle + half, 1.0))


def proportion(name: str, hits: list[bool], goal: float | None = None, at_most: bool = False) -> Figure:
    """Share of true entries with Wilson's interval; `goal` is the least (or with `at_most` the largest)
    allowed."""
    n, right = len(hits), int(np.sum(hits))
    if n == 0:
        return Figure(name, None, None, None, 0)
    value = right / n
    met = None if goal is None else (value <= goal if at_most else value >= goal)
    sign = "" if goal is None else f"{'<=' if at_most else '>='} {goal:g}"
    return Figure(name, value, *wilson(right, n), n, sign, met)


def mean(
    name: str, values: list[float], rng: np.random.Generator, goal: float | None = None, at_most: bool = False
) -> Figure:
    """Mean with a bootstrap interval over cases (90 %)."""
    if not values:
        return Figure(name, None, None, None, 0)
    data = np.asarray(values, dtype=float)
    draws = data[rng.integers(len(data), size=(2000, len(data)))].mean(axis=1)
    value = float(data.mean())
    met = None if goal is None else (value <= goal if at_most else value >= goal)
    sign = "" if goal is None else f"{'<=' if at_most else '>='} {goal:g}"
    return Figure(name, value, float(np.quantile(draws, 0.05)), float(np.quantile(draws, 0.95)), len(data), sign, met)
