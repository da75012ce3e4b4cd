"""A disk that is seen beside where it is: in the wall's shadow, a lamp's shade, a reflection on a part of the floor.

All of its markers in both views are off alike, so that neither bodies nor views know of it.  Flights do: what moves the
disk bends its path, what moves its picture does not, and stands in their residuals as it is."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.gap.laws.choice.search import LEVEL_WHERE_LEFT, find_law
from analysis.gap.laws.dictionary.candidate import QUARTER, Candidate
from analysis.gap.laws.dictionary.modulated import RANGES
from analysis.gap.laws.dictionary.parts import ANGLE_STEP, PLACE_STEP, SCALE_STEP, RigScales, pair, plain, scaled, spots
from analysis.gap.laws.flight_rows import FlightRegression, flight_regression
from analysis.gap.laws.found_law import LawFound
from analysis.gap.laws.frames.bodies.moved_back import body_moved_back
from analysis.gap.laws.frames.evidence.rows import size_of
from analysis.gap.laws.linear_law import reported_law
from analysis.gap.laws.regression.problem import Regression
from analysis.gap.selection.flights.fit import FlightFit
from analysis.gap.series import Series
from analysis.motion.rig_frame import RigFrame
from ovines.core.laws import words as W
from ovines.core.laws.targets import NES_PLACE
from ovines.core.laws.terms import Factor, Term

Array = NDArray[np.float64]
# Directions of a lamp; places over the contact radius where its shade begins; width of a spot, the same.
LAMPS, SHADES, SPOT = 12, (-0.3, 0.0, 0.3), 0.3
# Parts of a law at the most.
MOST_PARTS = 2


@dataclass(frozen=True, eq=False)
class SeenRows:
    """The ``flights`` of a series as rows for what moves the disk's picture alone."""

    problem: Regression
    flights: FlightRegression

    @property
    def known(self) -> Array:
        """What laws know at all the frames, (N, KNOWN_SIZE)."""
        return self.flights.known

    def columns(self, terms: Sequence[Term]) -> Array:
        """Rows (M, T) that a unit of each term adds to the residuals' model."""
        return self.flights.seen_beside([shift(terms, known) for known in self.flights.knowns])

    def cut_columns(self, term: Term, cut: Callable[[Array], Array]) -> Array:
        """Columns (M, B) of a term times the weights (N, B) that ``cut`` gives what is known."""
        moved = [shift([term], known) * cut(known)[:, None, :] for known in self.flights.knowns]
        return self.flights.seen_beside(moved)


def find_seen_disk_law(fitted: FlightFit, frame: RigFrame, rng: np.random.Generator) -> tuple[LawFound | None, float]:
    """The formula of where the disk is seen beside its flights, None where chance would find as much; and by how much
    the sum of squares of runs held out falls with it."""
    flights = flight_regression(fitted)
    if not len(flights.flights):
        return None, 0.0
    rows = SeenRows(flights.problem, flights)
    scales = RigScales.of(rows.known, float(fitted.fits[0].run.host.omega_rad_per_s))
    found, p = find_law(
        rows.problem, rows.columns, seen_candidates(scales), rng, LEVEL_WHERE_LEFT, most_parts=MOST_PARTS
    )
    if found is None:
        return None, 0.0
    size_m = float(np.sqrt(np.mean(np.sum((shift(found.terms, rows.known) @ found.coefficients) ** 2, 1))))
    return replace(reported_law(rows, found, p, frame), size=size_m), found.gain * rows.problem.excess


def seen_candidates(scales: RigScales) -> list[Candidate]:
    """Every candidate for how far from its place the disk is seen."""
    along, outwards = NES_PLACE
    ranges = [share * scales.radius_m for share in RANGES]
    out = scaled("disk seen outwards near the wall", outwards, ("gap", "exponential", 1.0), ranges)
    out += [
        plain(f"disk seen outwards with the radius to the power {n}", Term(outwards, 1.0, (Factor("radius", order=n),)))
        for n in (2.0, 3.0, 4.0)
    ]

    def begins(range_m: float) -> tuple[Term, ...]:
        depth = Factor("gap", "below", 1.0, range_m)
        return Term(outwards, 1.0, (depth,)), Term(outwards, 1.0, (depth, Factor("gap")))

    out += [Candidate("disk seen outwards from a gap on", begins, (r,), (SCALE_STEP,), (True,)) for r in ranges]

    def beside(scale: float) -> tuple[Term, ...]:
        return pair(along, QUARTER, Factor("gap", "exponential", 1.0, scale))

    out += [
        Candidate("disk seen along a direction near the wall", beside, (r,), (SCALE_STEP,), (True,)) for r in ranges
    ]
    step = PLACE_STEP * scales.radius_m
    for function, word in (("above", "from a line on, ever farther"), ("below", "on one side of a line")):

        def shade(angle: float, place: float, function: str = function) -> tuple[Term, ...]:
            return (Term(along, 1.0, (Factor("along_host", function, 1.0, place, 0.0, angle),), x=angle),)

        name = f"disk seen along a direction {word}"
        out += [
            Candidate(
                name, shade, (2 * math.pi * i / LAMPS, share * scales.radius_m), (ANGLE_STEP, step), (False, False)
            )
            for i in range(LAMPS)
            for share in SHADES
        ]

    def spot(x: float, y: float, width: float) -> tuple[Term, ...]:
        return pair(along, QUARTER, Factor("distance_in_host", "gaussian", 1.0, width, x, y))

    width = SPOT * scales.radius_m
    name = "disk seen along a direction at a place"
    steps, positive = (step, step, 0.2), (False, False, True)
    return out + [Candidate(name, spot, (x, y, width), steps, positive) for x, y in spots(scales)]


def shift(terms: Sequence[Term], known: Array) -> Array:
    """How far a unit of each term moves the disk's picture in the room (N, 2, T; m)."""
    sizes, radius = size_of(terms, known), np.maximum(np.hypot(known[:, W.HX], known[:, W.HY]), 1e-12)
    outwards = known[:, [W.HX, W.HY]] / radius[:, None]
    ways = [
        outwards if term.target == NES_PLACE[1] else np.array([[math.cos(term.x), math.sin(term.x)]]) for term in terms
    ]
    return np.stack([size[:, None] * way for size, way in zip(sizes.T, ways, strict=True)], -1)


def without_seen_disk(series: Series, terms: Sequence[Term]) -> Series:
    """``series`` with the disk's points moved back by what ``terms`` say, and their pixels alike; `InputError` where
    there are no markers."""
    return body_moved_back(series, "nes", "a law of where the NES is seen", lambda known: shift(terms, known).sum(2))
