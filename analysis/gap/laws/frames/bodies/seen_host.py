"""A Host that is seen beside where it is: markers on soft pads, a lid that stays back.

All of its markers are off alike, so that neither bodies nor views know of it.  The wall does: the disk meets it where
it truly is, at another distance from where the Host is seen.  The floor is not where it is seen either, and so flights
miss its velocity: a ring that is loose in its seat leaves only the wall elsewhere."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.flights.fit import FlightFits
from analysis.gap.laws.choice.search import LEVEL_WHERE_LEFT, find_law
from analysis.gap.laws.dictionary.candidate import QUARTER, Candidate
from analysis.gap.laws.dictionary.parts import plain, scaled
from analysis.gap.laws.found_law import LawFound
from analysis.gap.laws.frames.bodies.moved_back import body_moved_back
from analysis.gap.laws.frames.evidence.rows import size_of
from analysis.gap.laws.impact_rows import distance_regression
from analysis.gap.laws.linear_law import reported_law
from analysis.gap.laws.regression.problem import Regression
from analysis.gap.selection.impacts.fit import ImpactFit
from analysis.gap.series import Series
from analysis.motion.rig_frame import RigFrame
from ovines.core.laws import words as W
from ovines.core.laws.targets import HOST_PLACE
from ovines.core.laws.terms import Factor, Term

Array = NDArray[np.float64]
# Parts of a law at the most.
MOST_PARTS = 2
# What a blow leaves fades in so many usual flights.
FADES = (0.2, 0.6)


@dataclass(frozen=True, eq=False)
class HostRows:
    """Contact distances as rows for what moves the Host's picture alone: the ``problem``, what laws ``known`` (K,
    KNOWN_SIZE) at each impact, and how a row answers a shift of that picture along x and y (K, 2) in ``answers``."""

    problem: Regression
    known: Array
    answers: Array

    def columns(self, terms: Sequence[Term]) -> Array:
        """Rows (K, T) that a unit of each term adds to the residuals' model."""
        return np.asarray(np.einsum("kd,kdt->kt", self.answers, shift(terms, self.known)))

    def cut_columns(self, term: Term, cut: Callable[[Array], Array]) -> Array:
        """Columns (K, B) of a term times the weights (K, B) that ``cut`` gives what is known."""
        return self.columns([term]) * cut(self.known)


def host_rows(impacts: ImpactFit, fits: Sequence[FlightFits]) -> HostRows:
    """What contact distances say of where the Host is seen: by as much as it is seen farther out along the wall's
    normal, the disk meets the wall too early."""
    rows = distance_regression(impacts, fits)
    normal_rad = impacts.wall.impacts.normal_rad[impacts.data.at.index]
    outwards = np.column_stack([np.cos(normal_rad), np.sin(normal_rad)])
    return HostRows(rows.problem, rows.known, -outwards * rows.answers["contact_radius"][:, None])


def find_seen_host_law(
    impacts: ImpactFit, fits: Sequence[FlightFits], frame: RigFrame, rng: np.random.Generator
) -> LawFound | None:
    """The formula of where the Host is seen beside its place, None where chance would find as much."""
    rows = host_rows(impacts, fits)
    asked = seen_host_candidates(rows.known)
    found, p = find_law(rows.problem, rows.columns, asked, rng, LEVEL_WHERE_LEFT, most_parts=MOST_PARTS)
    if found is None:
        return None
    moved = shift(found.terms, rows.known) @ found.coefficients
    size_m = float(np.sqrt(np.sum(np.var(moved, axis=0))))
    return replace(reported_law(rows, found, p, frame), size=size_m)


def seen_host_candidates(known: Array) -> list[Candidate]:
    """Every candidate for how far from its place the Host is seen: as it goes, with time, after a blow."""
    word, out = "Host seen beside its place", list[Candidate]()
    for what in ("acceleration", "velocity"):
        along, across = (_along(f"host_{what}_along", way_rad) for way_rad in (0.0, QUARTER))
        out.append(plain(f"{word} with its {what} along the drive", along))
        out.append(plain(f"{word} with its {what}", along, across))
    both = [_along(f"host_{what}_along", at) for what in ("acceleration", "velocity") for at in (0.0, QUARTER)]
    out.append(plain(f"{word} with its acceleration, late", *both))
    for quantity in ("time", "run", "blows"):
        out.append(plain(f"{word} with the {quantity}", *_either_way(Factor(quantity))))
    since = known[:, W.SINCE]
    struck = since[since < 0.5 * W.LONG_AGO_S]
    usual_s = float(np.median(struck)) if len(struck) else 0.0
    for quantity in ("last_approach", "last_slip") if usual_s > 0 else ():
        for way_rad in (0.0, QUARTER):
            fades = [share * usual_s for share in FADES]
            name = f"{word} after a blow, along {way_rad:.2g} rad"
            out += scaled(name, HOST_PLACE, ("since", "exponential", 1.0), fades, (Factor(quantity),))
    return out


def _along(quantity: str, way_rad: float) -> Term:
    return Term(HOST_PLACE, 1.0, (Factor(quantity, x=way_rad),), x=way_rad)


def _either_way(*factors: Factor) -> tuple[Term, Term]:
    return Term(HOST_PLACE, 1.0, factors), Term(HOST_PLACE, 1.0, factors, x=QUARTER)


def shift(terms: Sequence[Term], known: Array) -> Array:
    """How far a unit of each term moves the Host's picture in the room (N, 2, T; m)."""
    ways = np.array([[math.cos(term.x), math.sin(term.x)] for term in terms]).reshape(len(terms), 2)
    return size_of(terms, known)[:, None, :] * ways.T


def without_seen_host(series: Series, terms: Sequence[Term]) -> Series:
    """``series`` with the Host's points moved back by what ``terms`` say, and their pixels alike; `InputError` where
    there are no markers."""
    return body_moved_back(series, "host", "a law of where the Host is seen", lambda known: shift(terms, known).sum(2))
