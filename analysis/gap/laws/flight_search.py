"""The dictionary asked of flights: which of its forms runs held out want, beside what a fit names or in its place."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.flights.cutting.run_data import NO_ANGLE_SD_RAD
from analysis.flights.cutting.runs import Run
from analysis.flights.equation.parameters import INDEX
from analysis.flights.evidence import columns_of
from analysis.flights.fit import SHARED
from analysis.flights.stated_terms import DRIFT_OF_RUN
from analysis.gap.laws.choice.found import Found
from analysis.gap.laws.choice.listed import PER_UNKNOWN, Listed
from analysis.gap.laws.choice.numbers_inside import searched
from analysis.gap.laws.choice.search import MOST_PARTS, find_law, measured
from analysis.gap.laws.choice.shortlist import NEAR, gain_of, shortlist_of
from analysis.gap.laws.dictionary.candidate import Candidate
from analysis.gap.laws.dictionary.flights import flight_candidates
from analysis.gap.laws.dictionary.own_forms import is_effect_by_law
from analysis.gap.laws.dictionary.parts import RigScales
from analysis.gap.laws.dictionary.products import of_flights
from analysis.gap.laws.flight_rows import FlightRegression, flight_regression
from analysis.gap.laws.pulses import pulse_candidates
from analysis.gap.laws.regression.forms import forms_of, held_out_gains
from analysis.gap.laws.regression.problem import Profile, Regression
from analysis.gap.selection.flights.fit import FlightFit
from analysis.gap.selection.flights.model import run_places, value_of
from ovines.core.laws.terms import Term

Array = NDArray[np.float64]
FEWEST_FLIGHTS = 3
# What is left of a form beside the names' own, less than this share of it: it is theirs (of three such 0.001 to 0.004).
SAME = 0.05
# Targets and quantities of the disk's own angle.
OF_ANGLE = (
    *("spin", "along_body", "floor_lever", "floor_torque", "angle", "body_angle", "heading", "sliding_heading"),
    *("turned", "rim_angle"),
)


@dataclass(frozen=True, eq=False)
class FlightSearch:
    """The flights of a ``fit`` as a regression (``rows``), the rig's own ``scales``, and every candidate that these
    runs can be asked for, with its columns."""

    runs: Sequence[Run]
    fit: FlightFit
    rows: FlightRegression
    scales: RigScales
    listed: Listed

    @staticmethod
    def of(runs: Sequence[Run], fitted: FlightFit, rng: np.random.Generator) -> FlightSearch | None:
        """The search in a fit to ``runs``, None where too few flights speak."""
        rows = flight_regression(fitted)
        if len(rows.flights) < FEWEST_FLIGHTS:
            return None
        scales = RigScales.of(rows.known, float(runs[0].data.host.omega_rad_per_s))
        candidates = [*flight_candidates(scales), *pulse_candidates(rows, scales.run_s, rng)]
        seen = any(np.any(run.data.angle_sd_rad < NO_ANGLE_SD_RAD) for run in runs)
        candidates = [one for one in candidates if seen or not _asks_for_angle(one)]
        return FlightSearch(runs, fitted, rows, scales, Listed.of(candidates, rows.sums, rows.problem, rows.summed))

    def find(self, rng: np.random.Generator, level: float, most_parts: int = MOST_PARTS) -> tuple[Found | None, float]:
        """The formula that runs held out ask for beside what the fit holds, and how often chance finds as much."""
        return find_law(
            self.rows.problem, self.rows.columns, self.listed, rng, level, of_flights(self.scales), most_parts
        )

    def by_name(self, found: Found) -> list[Found]:
        """A law that was ``found`` with a listed effect in the place of its first part, beside its other parts and by
        itself: the nearest effect that is found by its law, where it gains nearly as much.

        Strong laws differ in the equation of motion from what their linear form says: a form of more numbers, which
        bends as that does, gains more there than the true one."""
        problem, candidates = self.rows.problem, self.listed.candidates
        own = [i for i, one in enumerate(candidates) if is_effect_by_law(one) and np.isfinite(self.listed.looked[i])]
        if not own or is_effect_by_law(found.parts[0]):
            return []
        gains = {i: gain_of(problem, self.rows.columns, candidates[i]) / problem.excess for i in own}
        best = max(own, key=lambda i: gains[i])
        if gains[best] < NEAR * found.gain:
            return []
        effect = searched(Profile.of(problem), self.rows.columns, candidates[best])
        wholes = [[effect, *found.parts[1:]], [effect]][: len(found.parts)]
        return [measured(problem, self.rows.columns, parts, found.p, (), problem.excess) for parts in wholes]

    def leaving_out(self, names: Sequence[str]) -> FlightSearch:
        """The search without forms of these names, or of which these are products."""
        price = [
            np.inf if any(f"{name},".startswith(f"{one.name},") for name in names) else looked
            for one, looked in zip(self.listed.candidates, self.listed.looked, strict=True)
        ]
        return replace(self, listed=replace(self.listed, looked=np.array(price, float)))

    def without(self, names: Sequence[str], leave_out: Callable[[Candidate], bool]) -> FlightSearch:
        """The search in the fit from which the columns ``names`` have been taken, linear where that is; ``leave_out``:
        candidates that are not asked."""
        price = [np.inf if leave_out(one) else one.looked for one in self.listed.candidates]
        rows = replace(self.rows, problem=self._problem_without(names))
        return replace(self, rows=rows, listed=replace(self.listed, looked=np.array(price, float)))

    def outdone(self, names: Sequence[str], leave_out: Callable[[Candidate], bool]) -> tuple[float, float]:
        """By how much (fall of -2 log L of runs held out, unknowns paid) the best single form that is not to be left
        out says more than the columns ``names`` of the fit do, negative where these say more; and how much these
        say."""
        own, without = self._columns(names), self.without(names, leave_out)
        problem, scale = without.rows.problem, self.rows.problem.excess
        named = self.said_by(names) / scale - PER_UNKNOWN * own.shape[1]
        gains = without.listed.gains(problem, scale)
        shortlist = shortlist_of(problem, self.rows.columns, without.listed.candidates, gains, scale)
        others = [one for one in shortlist if not _is_held(self.rows.columns(one[0].terms), own, problem.nuisances)]
        if not others:
            return -named, named
        best, gain = others[0]
        return gain - PER_UNKNOWN * best.unknowns - named, named

    def said_by(self, names: Sequence[str], terms: Sequence[Term] = ()) -> float:
        """Fall of the sum of squares of runs held out by the columns ``names`` of the fit and ``terms`` of a law,
        numbers inside as they are, together: of what flights leave without either."""
        own, problem = self._columns(names), self._problem_without(names)
        if terms:
            own = np.hstack([own, self.rows.columns(terms)])
        forms = forms_of(problem, own, [list(range(own.shape[1]))])
        return float(held_out_gains(forms, np.ones((1, len(forms.fold))))[0, 0])

    def _problem_without(self, names: Sequence[str]) -> Regression:
        """The problem of the fit from which the columns ``names`` have been taken, linear where that is."""
        own, held, problem = self._columns(names), self._held(), self.rows.problem
        kept = [i for i, name in enumerate(held) if name not in names]
        model = self.fit.model
        value = np.array([value_of(model, name) - model.stated.get(name, 0.0) for name in names])
        return replace(
            problem,
            residual=problem.residual + own @ value,
            nuisances=problem.nuisances[:, kept],
            prior=problem.prior[kept],
        )

    def _held(self) -> list[str]:
        """Names of the problem's nuisances."""
        return [SHARED[c] for c in columns_of([n for n in self.fit.columns if n in SHARED])]

    def _columns(self, names: Sequence[str]) -> Array:
        """Columns (M, C) that a unit of each name adds to the residuals' model."""
        held, problem = self._held(), self.rows.problem
        columns = []
        for name in names:
            if name == DRIFT_OF_RUN:  # a multiple of friction's column in each run
                number = np.array([place.number for place in run_places([run.data for run in self.runs])])
                friction = self.fit.model.parameters[INDEX["friction"]] * number[problem.run]
                columns.append(problem.nuisances[:, held.index("friction")] * friction)
            else:
                columns.append(problem.nuisances[:, held.index(name)])
        return np.column_stack(columns)


def _is_held(columns: Array, own: Array, nuisances: Array) -> bool:
    """Whether ``columns`` (M, C) are the names' ``own`` (M, P) in other words, beside the ``nuisances`` (M, Q): as
    friction on this side of a line that no flight crosses is, where friction differs from run to run."""
    known, _ = np.linalg.qr(nuisances)
    columns, own = (one - known @ (known.T @ one) for one in (columns, own))
    held, _ = np.linalg.qr(own)
    left = columns - held @ (held.T @ columns)
    return bool(np.all(np.linalg.norm(left, axis=0) <= SAME * np.linalg.norm(columns, axis=0)))


def _asks_for_angle(one: Candidate) -> bool:
    """Whether a candidate knows, or turns, the disk's angle, which not every motion has."""
    return any(
        term.target in OF_ANGLE or any(factor.quantity in OF_ANGLE for factor in term.factors) for term in one.terms
    )
