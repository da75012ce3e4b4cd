"""A law as it is reported: formula, numbers with intervals, how far it closes the gap on runs held out, what else it
may be."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.flights.cutting.runs import Run
from analysis.gap.laws.choice.found import Found, Rival
from analysis.gap.laws.dictionary.candidate import Candidate, named_numbers, with_coefficients
from analysis.gap.laws.evidence import Evidence
from analysis.gap.laws.regression.halves import Halves
from analysis.gap.selection.flights.fit import FlightFit
from analysis.motion.rig_frame import RigFrame
from analysis.statistics.student import NORMAL_90
from ovines.core.laws.formula import as_latex, as_text
from ovines.core.laws.terms import Term, WrittenLaw

Array = NDArray[np.float64]
DRAWS, BAND = 400, (0.05, 0.95)


@dataclass(frozen=True, eq=False)
class Other:
    """Another formula: how much of the chosen one's held-out gain it has, and whether the data tell them apart;
    ``candidate`` and ``coefficients`` (T,) of it in the rig's frame, in place of the law's first part and ``beside``
    the terms of its other parts."""

    law: WrittenLaw
    share: float
    told_apart: bool
    candidate: Candidate
    coefficients: Array
    beside: tuple[Term, ...] = ()


@dataclass(frozen=True, eq=False)
class LawFound:
    """``law`` in the world's frame and ``rig_law`` in the rig's; ``numbers`` name -> (value, sd, unit) in the world;
    ``p`` of chance; squared errors per run (R,) on runs held out ``before``, ``after`` and the ``floor``; ``others``;
    ``paths`` of the flights by run, before and after; ``fitted``: runs that hold a flights' law, their fit;
    ``halves``: its size by halves of the runs; ``size``: RMS of what a law of the flights pushes (m/s^2), one of the
    measurement does to frames, or one of the wall to contact distances (m)."""

    law: WrittenLaw
    rig_law: WrittenLaw
    numbers: dict[str, tuple[float, float, str]]
    p: float
    before: Array
    after: Array
    floor: Array
    others: tuple[Other, ...]
    evidence: Evidence | None = None
    paths: tuple[list[Array], list[Array]] | None = None
    fitted: tuple[tuple[Run, ...], FlightFit] | None = None
    halves: Halves | None = None
    size: float = 0.0

    @property
    def closed(self) -> float:
        """Share of the gap that the law closes on runs that its coefficients have not seen; unclipped."""
        return self._closed(np.ones(len(self.before)))

    def _closed(self, weight: Array) -> float:
        whole = float(weight @ (self.before - self.floor))
        return float(weight @ (self.before - self.after)) / whole if whole > 0 else 0.0

    def shrinkage(self, rng: np.random.Generator) -> tuple[float, float, float]:
        """:attr:`closed` with a 90 % interval over runs."""
        n, value = len(self.before), self.closed
        drawn = [self._closed(np.bincount(rng.integers(0, n, n), minlength=n).astype(float)) for _ in range(DRAWS)]
        low, high = (float(x) for x in np.quantile(drawn, BAND))
        return value, min(low, value), max(high, value)

    def entry(self, file: str, rng: np.random.Generator) -> dict[str, Any]:
        """As diagnosis.json has it."""
        value, low, high = self.shrinkage(rng)
        return {
            "stage": self.law.stage,
            "formula": as_text(self.law),
            "latex": as_latex(self.law),
            "parameters": {
                name: {"value": v, "low": v - NORMAL_90 * sd, "high": v + NORMAL_90 * sd, "unit": unit}
                for name, (v, sd, unit) in self.numbers.items()
            },
            "shrinkage": value,
            "shrinkage_low": low,
            "shrinkage_high": high,
            "p": self.p,
            "halves": None if self.halves is None else self.halves.entry(),
            "others": [
                {"formula": as_text(one.law), "gain": one.share, "told_apart": one.told_apart} for one in self.others
            ],
            "file": file,
        }


def law_file(number: int) -> str:
    """The file of a series' law by its number, from 1."""
    return f"law-{number}.toml"


def others_of(found: Found, frame: RigFrame) -> tuple[Other, ...]:
    """The nearest other formulas, in the world."""
    beside = tuple(term for part in found.parts[1:] for term in part.terms)
    return tuple(_other(one, frame, beside) for one in found.rivals)


def _other(one: Rival, frame: RigFrame, beside: tuple[Term, ...]) -> Other:
    law = WrittenLaw(with_coefficients(one.candidate.terms, one.coefficients, one.covariance))
    return Other(in_world(law, frame), one.gain, one.told_apart, one.candidate, one.coefficients, beside)


def in_world(law: WrittenLaw, frame: RigFrame) -> WrittenLaw:
    """A law of the rig's frame in the world's."""
    return law.moved(frame.turn_rad, frame.origin_m.tolist())


def replaced(law: LawFound, terms: Sequence[Term] | None, frame: RigFrame) -> LawFound | None:
    """The law written by other ``terms`` of the rig's, whose numbers are known as well; None of none."""
    if terms is None:
        return None
    rig_law = WrittenLaw(tuple(terms))
    world_law = in_world(rig_law, frame)
    sds = {name: sd for name, (_, sd, _) in law.numbers.items()}
    numbers = {name: (value, sds.get(name, 0.0), unit) for name, (value, unit) in named_numbers(world_law).items()}
    return replace(law, law=world_law, rig_law=rig_law, numbers=numbers)
