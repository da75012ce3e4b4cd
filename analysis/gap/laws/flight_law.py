"""The missing law of the flights: found in their residuals, fitted again by their equation of motion, held out by
run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from analysis.flights.cutting.run_data import NO_ANGLE_SD_RAD, RunData
from analysis.flights.cutting.runs import Run
from analysis.flights.equation.parameters import INDEX, LAW, LAW_TERMS
from analysis.gap.laws.choice.found import Found, Rival
from analysis.gap.laws.choice.search import LEVEL_BELIEVED, LEVEL_WHERE_LEFT, MOST_PARTS
from analysis.gap.laws.choice.shortlist import LEAST_SHARE, NEAR
from analysis.gap.laws.dictionary.candidate import law_at, with_sds
from analysis.gap.laws.evidence import evidence_of
from analysis.gap.laws.flight_rows import flight_regression
from analysis.gap.laws.flight_search import FlightSearch
from analysis.gap.laws.flight_sizes import SizedLaw, sized_law, with_law
from analysis.gap.laws.found_law import LawFound, in_world, others_of
from analysis.gap.laws.regression.problem import Regression
from analysis.gap.prediction import predict
from analysis.gap.selection.flight_steps import FlightSteps
from analysis.gap.selection.flights.fit import FlightFit, fit
from analysis.gap.selection.flights_beside_law import without_needless
from analysis.motion.rig_frame import RigFrame
from ovines.core.laws.kernel import pushes
from ovines.core.laws.terms import MOST_TERMS, rows_of
from ovines.workers.beside import made_by_two

Array = NDArray[np.float64]
# Angles that miss by more than so many medians are wrong tracks.
CLIP_SD = 8.0
# A law that no probe asked for, and whose linear form promises less than this share of what is left, is not fitted: it
# must close half to be believed, and fits have closed up to three times what was promised (0.047 promised, 0.136
# closed beside a mass centre).
LEAST_PROMISED = 0.1
# Searches at the most: forms that the equation of motion does not take are left out of the next.
SEARCHES = 2


@dataclass(frozen=True, eq=False)
class FittedLaw:
    """A law in the flights' equation of motion: ``runs`` that hold it, their ``fit`` with its coefficients free, and
    how large it is (``sized``)."""

    runs: tuple[Run, ...]
    fit: FlightFit
    sized: SizedLaw


def find_flight_law(
    runs: Sequence[Run],
    steps: FlightSteps,
    frame: RigFrame,
    rng: np.random.Generator,
    least_m_per_s2: float = 0.0,
    most_parts: int = MOST_PARTS,
    search: FlightSearch | None = None,
    least_gain: float = 0.0,
) -> tuple[LawFound | None, FlightSteps]:
    """The formula of what the flights lack beside the effects that ``steps`` name, None where chance would find as
    much, or where it pushes by less than ``least_m_per_s2`` (RMS; a torque counts as the force at the rim that would
    make it; 0 where a probe has found that something is left); and the steps without the names that the law makes
    needless.  ``search``: that of the steps' named fit, where it is known; ``least_gain``: fall of the sum of squares
    of runs held out that its linear form must promise."""
    base = steps.named
    search = FlightSearch.of(runs, base, rng) if search is None else search
    if search is None:
        return None, steps
    problem = search.rows
    lever_m = _lever_m(runs)
    asked = least_m_per_s2 == 0.0
    reached: tuple[Array, Array] | None = None
    for _ in range(SEARCHES):
        found, p = search.find(rng, LEVEL_WHERE_LEFT if asked else LEVEL_BELIEVED, most_parts)
        if found is None or found.gain * problem.problem.excess < least_gain:
            return None, steps
        if (size := _push(runs[0].data, problem.known, found)) < least_m_per_s2:
            return None, steps
        if reached is None:
            at_best = [predict.free_paths(run, base.noise.correlation) for run in runs]
            reached = _mean_square(runs, at_best, lever_m), _mean_square(runs, _paths(runs, base), lever_m)
        floor, without = reached
        gap_m2 = float(np.sum(without - floor))
        if not asked and _promised(problem.problem, found, gap_m2 / float(without.sum())) < LEAST_PROMISED:
            return None, steps
        chosen = _best_law(runs, base, found, search.by_name(found), lever_m, gap_m2)
        if chosen is not None:
            break
        search = search.leaving_out([one.name for one in (*found.parts, *(r.candidate for r in found.rivals))])
    else:
        return None, steps
    found, law = chosen
    fewer = without_needless(runs, law.fit, steps)
    if fewer is not steps:
        again = fitted_law(runs, fewer.named, found)
        if again is not None:
            law, steps, base = again, fewer, fewer.named
    paths = _paths(runs, base), _paths(law.runs, law.fit)
    before, after = (_mean_square(runs, one, lever_m) for one in paths)
    floor = floor * min(1.0, float(after.sum() / floor.sum()))  # never above the best model
    sized = law.sized
    rig_law = law_at(sized.parts, sized.values, sized.covariance)
    reported = LawFound(
        in_world(rig_law, frame),
        rig_law,
        with_sds(lambda v: in_world(law_at(sized.parts, v), frame), sized.values, sized.covariance),
        p,
        before,
        after,
        floor,
        others_of(found, frame),
        evidence_of(problem, flight_regression(law.fit), rig_law),
        paths,
        (law.runs, law.fit),
        sized.halves,
        size,
    )
    return reported, steps


def force_gain(runs: Sequence[Run], fitted: FlightFit, rng: np.random.Generator) -> float:
    """Fall of the sum of squares of runs held out that a force, a torque or a change of friction makes in the flights
    of a fit to ``runs``, their equation of motion linearised; 0 where chance finds as much."""
    search = FlightSearch.of(runs, fitted, rng)
    if search is None:
        return 0.0
    found, _ = search.find(rng, LEVEL_WHERE_LEFT)
    return 0.0 if found is None else found.gain * search.rows.problem.excess


def _best_law(
    runs: Sequence[Run], base: FlightFit, found: Found, by_name: Sequence[Found], lever_m: float, gap_m2: float
) -> tuple[Found, FittedLaw] | None:
    """The law among ``found``, the same ``by_name`` of an effect, and the rivals that gain nearly as much, which
    predicts runs held out best in the equation of motion itself: strong laws differ there from what their linearisation
    says.  Every unknown costs a share of the whole gap ``gap_m2``."""
    near = [k for k, one in enumerate(found.rivals) if len(found.parts) == 1 and one.gain > NEAR]
    # What the flights do not take whole they may take without its last part.
    shorter = (found.first(n) for n in range(len(found.parts) - 1, 0, -1))

    def weighed(one: Found) -> tuple[float, FittedLaw] | None:
        law = fitted_law(runs, base, one)
        if law is None:
            return None
        error_m2 = float(_mean_square(runs, _paths(law.runs, law.fit), lever_m).sum())
        unknowns = sum(part.unknowns for part in one.parts)
        # How forms are made is not for a pipe to take.
        bare = replace(law, sized=replace(law.sized, parts=()))
        return error_m2 + LEAST_SHARE * unknowns * max(gap_m2, 0.0), bare

    whole = [found, *by_name, *(_as_law(found, k) for k in near)]
    made = made_by_two([partial(weighed, one) for one in whole])
    tried = [(one, law) for one, law in zip(whole, made, strict=True) if law is not None]
    if not tried:
        fewer = ((one, weighed(one)) for one in shorter)
        tried = [(one, law) for one, law in fewer if law is not None][:1]
    if not tried:
        return None
    one, (_, law) = min(tried, key=lambda each: each[1][0])
    numbers = iter(law.sized.values[len(one.coefficients) :])
    parts = tuple(part.at([next(numbers) for _ in part.numbers]) for part in one.parts)
    return one, replace(law, sized=replace(law.sized, parts=parts))


def _promised(problem: Regression, found: Found, left: float) -> float:
    """What a law's linear form explains of held-out runs, as a share of what flights leave over their floor, ``left``
    (a share of their squares); 0 where they leave nothing over it."""
    over = left * float(np.sum(problem.residual**2))
    return found.gain * problem.excess / over if over > 0 else 0.0


def _as_law(found: Found, number: int) -> Found:
    """A law of one part whose rival ``number`` changes places with it."""
    rival, part = found.rivals[number], found.parts[0]
    first = Rival(part, found.coefficients, found.covariance, 1 / rival.gain, rival.told_apart)
    others = tuple(one for k, one in enumerate(found.rivals) if k != number)
    unknown = (np.zeros(len(rival.candidate.numbers)),)
    return Found(
        (rival.candidate,), rival.coefficients, rival.covariance, unknown, found.gain * rival.gain, found.p,
        (first, *others),
    )  # fmt: skip


def _push(disk: RunData, known: Array, found: Found) -> float:
    """RMS acceleration (m/s^2) that a law makes where flights ``known`` (N, KNOWN_SIZE) pass."""
    given = np.empty((len(known), 3, len(found.terms)))
    pushes(rows_of(found.terms), known, given)
    push = given @ found.coefficients * np.array([1.0, 1.0, disk.radius_m * disk.inertia_factor])
    return float(np.sqrt(np.mean(np.sum(push**2, 1))))


def _lever_m(runs: Sequence[Run]) -> float:
    """The radius at which an angle's noise is as large as a place's: what a torque does counts like what a force does;
    0 where no angle was seen."""
    place = np.concatenate([run.data.xy_sd_m for run in runs])
    angle = np.concatenate([run.data.angle_sd_rad for run in runs])
    seen = angle < NO_ANGLE_SD_RAD
    return float(np.median(place[seen]) / np.median(angle[seen])) if np.any(seen) else 0.0


def _mean_square(runs: Sequence[Run], paths: Sequence[Array], lever_m: float) -> Array:
    """Squared errors (R,) of place and of the angle at ``lever_m`` (m^2) that add up to the mean over all frames."""
    errors = predict.errors_of(runs, paths, None, None, None)
    total = errors.flight.copy()
    for i, (run, path) in enumerate(zip(runs, paths, strict=True)):
        turned = np.abs(predict.measured_paths(run)[:, 2] - path[:, 2])
        turned = turned[np.isfinite(turned)]
        if lever_m > 0 and len(turned):
            limit = CLIP_SD * max(float(np.median(turned)), 1e-12)
            total[i] += lever_m**2 * float(np.sum(turned[turned < limit] ** 2))
    return np.asarray(total / max(float(errors.flight_count.sum()), 1.0), float)


def squared_errors(runs: Sequence[Run], fitted: FlightFit) -> Array:
    """Squared errors (R,) of a fit to ``runs`` in runs held out (m^2), as :class:`LawFound` counts them."""
    return _mean_square(runs, _paths(runs, fitted), _lever_m(runs))


def _paths(runs: Sequence[Run], fitted: FlightFit) -> list[Array]:
    fits = predict.flights_of(runs, predict.held_out_models(fitted))
    return [predict.flight_paths(run, one) for run, one in zip(runs, fits, strict=True)]


def fitted_law(runs: Sequence[Run], base: FlightFit, found: Found) -> FittedLaw | None:
    """The parts of a found law in the equation of motion, coefficients and numbers refined; None where the flights do
    not take it."""
    held, count = len(runs[0].data.law), len(found.coefficients)
    if held + count > MOST_TERMS:
        return None
    sized = sized_law(runs, base, found.parts, found.coefficients)
    if sized is None:
        return None
    held_runs = with_law(runs, sized.parts, sized.values[:count])
    p = base.model.parameters.copy()
    for name, value in sized.beside.items():
        p[INDEX[name]] = value
    p[LAW + held : LAW + held + count] = 1.0
    free = (*base.model.free, *LAW_TERMS[held : held + count])
    return FittedLaw(held_runs, fit(held_runs, replace(base.model, parameters=p, free=free)), sized)
