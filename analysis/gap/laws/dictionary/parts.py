"""What candidates are put together from: the rig's own sizes, places and lines that are tried, and their shapes.

Lengths inside a formula start as shares of the contact radius, speeds of the disk's usual speed, times of the usual
flight, spins of the usual spin: the same dictionary serves a rig of any size."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.gap.laws.dictionary.candidate import Candidate
from ovines.core.laws import words as W
from ovines.core.laws.terms import Factor, Term

Array = NDArray[np.float64]
# Places that are tried, over the contact radius: rings of so many.
RINGS = ((0.0, 1), (0.35, 6), (0.7, 12))
# By how much a search first moves a place or an edge (over the contact radius), an angle (rad), the logarithm of a
# scale.
PLACE_STEP, ANGLE_STEP, SCALE_STEP = 0.1, 0.1, 0.25


@dataclass(frozen=True)
class RigScales:
    """The rig's own sizes: contact radius (m), the disk's usual speed in the room (m/s), usual time
    since an impact (s), longest run (s), drive (rad/s, 0 without), usual spin (rad/s), number of runs."""

    radius_m: float
    speed_m_per_s: float
    flight_s: float
    run_s: float
    drive_rad_per_s: float
    spin_rad_per_s: float
    runs: int = 1

    @property
    def way_m(self) -> float:
        """About the way (m) in the longest run."""
        return self.speed_m_per_s * self.run_s

    @property
    def turned_rad(self) -> float:
        """About the angle (rad) by which the disk turns in it."""
        return self.spin_rad_per_s * self.run_s

    @staticmethod
    def of(known: Array, drive_rad_per_s: float) -> RigScales:
        """From what laws know at the flights' frames (N, KNOWN_SIZE)."""
        since = known[:, W.SINCE]
        seen = since[since < 0.5 * W.LONG_AGO_S]
        run_s = float(np.ptp(known[:, W.TIME])) if len(known) else 1.0
        return RigScales(
            float(np.median(known[:, W.CONTACT_RADIUS])),
            max(float(np.sqrt(np.mean(known[:, W.VX] ** 2 + known[:, W.VY] ** 2))), 1e-6),
            2 * float(np.median(seen)) if len(seen) else run_s,
            run_s,
            drive_rad_per_s,
            max(float(np.sqrt(np.mean(known[:, W.SPIN] ** 2))), 1e-6),
            int(known[:, W.RUN].max(initial=0.0)) + 1,
        )


def plain(name: str, *terms: Term) -> Candidate:
    """Terms without numbers of their own."""
    return Candidate(name, lambda: terms)


def pair(target: str, period: float, *factors: Factor) -> tuple[Term, Term]:
    """Two columns of a target with an angle."""
    return Term(target, 1.0, factors), Term(target, 1.0, factors, x=period)


def scaled(
    name: str,
    target: str,
    shape: tuple[str, str, float],
    sizes: Sequence[float],
    factors: tuple[Factor, ...] = (),
    step: float = SCALE_STEP,
) -> list[Candidate]:
    """A target times ``factors`` and a function (``shape``: quantity, function, order) whose scale is searched."""
    quantity, function, order = shape

    def make(scale: float) -> tuple[Term, ...]:
        return (Term(target, 1.0, (*factors, Factor(quantity, function, order, scale))),)

    return [Candidate(name, make, (float(size),), (step,), (True,)) for size in sizes if size > 0]


def spots(scales: RigScales) -> list[tuple[float, float]]:
    """Places (m) about the Host's centre."""
    return rings(RINGS, scales.radius_m)


def rings(shares: Sequence[tuple[float, int]], radius_m: float) -> list[tuple[float, float]]:
    """Places (m) on rings about the Host's centre: (radius over ``radius_m``, number of places) of each."""
    turns = [(share * radius_m, 2 * math.pi * i / count) for share, count in shares for i in range(count)]
    return [(radius * math.cos(angle), radius * math.sin(angle)) for radius, angle in turns]


def lines(
    directions: int, places: Sequence[float], scales: RigScales, turn: float = math.pi
) -> list[tuple[float, float]]:
    """Directions (rad) and offsets (m) of straight lines across the Host; ``turn``: pi where both sides are alike."""
    return [(turn * i / directions, share * scales.radius_m) for i in range(directions) for share in places]
