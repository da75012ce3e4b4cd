"""What few observations leave open about the size of their own errors."""

from __future__ import annotations

from scipy.special import stdtrit

# Of a two-sided 90 % interval.
UPPER_90, NORMAL_90 = 0.95, 1.6448536269514722


def student_over_normal(free: int) -> float:
    """What the sd of a normal 90 % interval is to be multiplied with where the errors' size is read off ``free``
    freedoms: Student's t over the normal."""
    return float(stdtrit(free, UPPER_90)) / NORMAL_90
