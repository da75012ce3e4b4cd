"""Which law the floor follows: ``[model]``'s, or another that the flights of all runs need beyond doubt."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from analysis.flights.cutting.run_data import LENS_TERMS
from analysis.flights.cutting.runs import Run
from analysis.flights.equation.parameters import INDEX
from analysis.flights.evidence import Evidence, columns_of, linearised, usable_flights
from analysis.flights.fit import ORIGIN, SHARED
from analysis.flights.frame_assignment import settled
from analysis.flights.stated_terms import DRIFT_OF_RUN
from analysis.flights.unknown_force import best_model, force_evidence, refined, tried_forces
from analysis.identification.contact_law.restitution_rows import few
from analysis.identification.floor.errors import disagreement
from analysis.identification.floor.fit import RESTS_SD, FirstLook, FloorFit, first_look, fit_floor
from analysis.identification.floor.priors import lens_priors, prior_of
from ovines.core.effects import EFFECTS

Array = NDArray[np.float64]
# Terms of the flight model that a name in [model] effects stands for.
TERMS_OF = {
    name: tuple(one for one in effect.in_flights.names if one in INDEX)
    for name, effect in EFFECTS.items()
    if effect.in_flights is not None
}
# Terms that are what they are where a name stands for them; the others are estimated along with the friction.
NAMED_AT = {
    TERMS_OF[name][0]: (name, effect.in_flights.named_at)
    for name, effect in EFFECTS.items()
    if effect.in_flights is not None and effect.in_flights.named_at
}
# Fall of -2 log L from which a friction law other than [model]'s is taken: one free parameter would give 10 once in 600
# series.
ANOTHER_LAW = 25.0
# Probability of an unknown force from which it counts as certain: notes speak of it, other laws are tried.
SURE_FORCE = 0.95
#: the column of a change of the friction per run, beyond those that flights know; fits until the change rests
PER_RUN, MOST_DRIFT_FITS = len(SHARED), 4
# A line through the runs has two unknowns: its scatter is read off so many runs less two.
DRIFT_UNKNOWNS = 2
UNCOUPLED_WORDS = (
    "The flights follow floor friction without its coupling to the spin (spin_coupling), which [model] effects names: "
    "the floor friction is that of plain sliding."
)
# The same for further terms, each model with the unknown force that it leaves: six candidates of up to two parameters
# give 25 by chance once in thirty thousand series.
ANOTHER_TERM = 40.0
MOST_ADDED = 3
# Effects that only take energy: one that would push is not taken up.
DRAGS = [name for name, effect in EFFECTS.items() if effect.in_flights is not None and effect.in_flights.drags]
# What else may bend a flight: each is taken up where the flights of all runs leave no doubt, and named.
CANDIDATES: dict[str, tuple[str, ...]] = {**TERMS_OF, "a force towards the Host's centre": ("centre_host",)}
# The same where an unknown force is certain: known forms of it, which the diagnosis would look into.
FORMS: dict[str, tuple[str, ...]] = {
    "a force across the path that grows with speed and spin": ("magnus",),
    "a force across the path": ("gyro",),
    "drag against the Host": ("host_drag",),
    "a spin that decays by itself": ("spin_decay",),
    "a torque": ("spin_drive",),
}


def choose_floor(
    runs: Sequence[Run],
    effects: Sequence[str],
    angle: bool,
    stated: Mapping[str, float] | None = None,
    search: bool = True,
    look: FirstLook | None = None,
) -> tuple[list[Run], FloorFit, list[str]]:
    """The floor as ``[model]`` has it, and with ``search`` with what else the flights need beyond doubt: friction, its
    spin coupling, further terms.  ``stated`` terms (:func:`analysis.flights.stated_terms.stated_terms`) are held.
    ``look``: the first look (:func:`looked_at`) at these runs, where there was one.

    A wrong flight law bends every extrapolation to an impact; the parameters of the impacts must not pay for it.
    Returns the runs too: without the frames that no flight explains.
    """
    names, held = _of_model(effects, stated)
    friction, coupled = "friction" in names, _coupled(effects, angle)
    floor, notes = fit_floor(runs, names, {"coupling": 1.0 if coupled else 0.0, **held}, look=look), []
    if search and (not friction or (angle and not coupled)):
        names = ["friction", *(n for n in names if n != "friction")]
        richer = fit_floor(runs, names, {**held, "coupling": 1.0 if angle else 0.0})
        if _cost(floor, richer) - _cost(richer, richer) > ANOTHER_LAW:
            what = "the coupling of sliding and spinning friction" if friction else "floor friction"
            floor, notes = (
                richer,
                [f"The flights need {what}, which [model] effects does not name; it was fitted along."],
            )
    found = [settled(run, fits) for run, fits in zip(runs, floor.fits, strict=True)]
    if any(run is not None for run in found):
        runs = [new or run for new, run in zip(found, runs, strict=True)]
        floor = fit_floor(runs, floor.names, held, floor)
    per_run = None
    if "friction_drift" in effects and DRIFT_OF_RUN not in (stated or {}):
        runs, floor, per_run = with_run_drift(runs, floor, held)
    if not search:
        return list(runs), replace(floor, per_run=per_run), notes
    floor, added = _with_terms(runs, floor, effects, held)
    if coupled and "coupling" not in held and floor.noise.sure > SURE_FORCE:
        # Last: what a tilt or a drag leaves over may look like friction that knows no spin.
        plain, others = _with_terms(runs, fit_floor(runs, names, {**held, "coupling": 0.0}), effects, held)
        if _cost(floor, plain) - _cost(plain, plain) > ANOTHER_LAW:
            floor, added = plain, [UNCOUPLED_WORDS, *others]
    return list(runs), replace(floor, per_run=per_run), [*notes, *added]


def looked_at(runs: Sequence[Run], effects: Sequence[str], angle: bool, stated: Mapping[str, float]) -> FirstLook:
    """The first look at the flights of ``runs`` under the floor that ``[model]`` has."""
    names, held = _of_model(effects, stated)
    return first_look(runs, names, {"coupling": 1.0 if _coupled(effects, angle) else 0.0, **held})


def _of_model(effects: Sequence[str], stated: Mapping[str, float] | None) -> tuple[list[str], dict[str, float]]:
    """Terms of the flight model that ``[model]`` wants estimated, and those that it holds."""
    held = {term: value for term, value in (stated or {}).items() if term in INDEX}
    for term, (effect, value) in NAMED_AT.items():
        held.setdefault(term, value if effect in effects else 0.0)
    names = [term for effect in effects for term in TERMS_OF.get(effect, ()) if term not in held]
    friction = "floor_friction" in effects or "spin_coupling" in effects
    return ["friction", *names] if friction else names, held


def _coupled(effects: Sequence[str], angle: bool) -> bool:
    return "spin_coupling" in effects and angle


def _with_terms(
    runs: Sequence[Run], floor: FloorFit, effects: Sequence[str], held: Mapping[str, float]
) -> tuple[FloorFit, list[str]]:
    """``floor`` with those of :data:`CANDIDATES` (and :data:`FORMS`) that its flights need beyond doubt, and a note on
    each.
    """
    notes, pushing = list[str](), set[str]()
    while len(notes) < MOST_ADDED:
        known = CANDIDATES | FORMS if floor.noise.sure > SURE_FORCE else CANDIDATES
        sought = {name: terms for name, terms in known.items() if name not in pushing}
        added = _needed_term(floor, sought)
        if added is None:
            break
        terms = sought[added]
        richer = fit_floor(runs, [*floor.names, *terms], held, floor)
        if added in DRAGS and richer.estimate[richer.names.index(terms[0])] < 0.0:
            pushing.add(added)
            continue
        if not _confirmed(richer, terms):
            break
        floor = richer
        other = f"another size of {added} than [model] states" if added in effects else None
        notes.append(
            f"The flights need {other or f'{added}, which [model] effects does not name'}; it was fitted along."
        )
    return floor, notes


def _cost(floor: FloorFit, judge: FloorFit) -> float:
    """-2 log L of a fit with the unknown force and the lens residual that it leaves, on the flights and with the noise
    of ``judge``: two fits are held against each other on the same frames."""
    columns = columns_of([*floor.names, *ORIGIN, *LENS_TERMS])
    rows = [linearised(fit, columns, usable_flights(other)) for fit, other in zip(floor.fits, judge.fits, strict=True)]
    noise = judge.noise.without_force()
    priors = lens_priors(columns, columns, floor.fits[0].shared)
    evidence = force_evidence(rows, tried_forces(rows, noise, floor.fits[0].run.radius_m))
    best, number, cost = best_model(evidence, priors)
    return refined(rows, best, cost, priors[number])[1]


def _needed_term(floor: FloorFit, sought: Mapping[str, tuple[str, ...]]) -> str | None:
    """The one of the candidates ``sought`` that raises the likelihood most (linearised), where that is beyond doubt;
    None where none does.

    Each candidate is held against the model without it, both with the unknown force and the lens residual that they
    leave: the terms of a lens residual make as good a tilt of a short run."""
    candidates = {name: terms for name, terms in sought.items() if not set(terms) & set(floor.names)}
    for term, (effect, _) in NAMED_AT.items():
        if effect in candidates and floor.fits[0].parameters[INDEX[term]] != 0.0:
            del candidates[effect]
    if not candidates:
        return None
    columns = columns_of([*floor.names, *(t for terms in candidates.values() for t in terms), *ORIGIN, *LENS_TERMS])
    rows = [linearised(fit, columns) for fit in floor.fits]
    evidence = force_evidence(rows, tried_forces(rows, floor.noise, floor.fits[0].run.radius_m))
    costs = {}
    for name, terms in {"": (), **candidates}.items():
        chosen = columns_of([*floor.names, *ORIGIN, *LENS_TERMS, *terms])
        costs[name] = best_model(evidence, lens_priors(columns, chosen, floor.fits[0].shared))[2]
    best = min(candidates, key=lambda name: costs[name])
    return best if costs[""] - costs[best] > ANOTHER_TERM else None


def _confirmed(floor: FloorFit, terms: Sequence[str]) -> bool:
    """Whether fitted ``terms`` stand out of their covariance, in which the runs' disagreement is: what the model misses
    pulls each run its own way."""
    at = [floor.names.index(term) for term in terms]
    value = floor.estimate[at]
    return bool(value @ np.linalg.solve(floor.covariance[np.ix_(at, at)], value) > ANOTHER_LAW)


def numbers_of(count: int) -> Array:
    """Numbers (R,) of so many runs, counted from the middle one."""
    return np.arange(count, dtype=np.float64) - 0.5 * (count - 1)


def with_run_drift(
    runs: Sequence[Run], floor: FloorFit, held: Mapping[str, float]
) -> tuple[list[Run], FloorFit, tuple[float, float] | None]:
    """``runs`` with the friction that each has of its own, ``floor`` fitted with it, and the relative change per run
    about the middle one, with its sd; None of a single run, or without friction."""
    if len(runs) < 2 or "friction" not in floor.names:
        return list(runs), floor, None
    change = 0.0
    number = numbers_of(len(runs))
    own = [run.data.friction_share for run in runs]
    for _ in range(MOST_DRIFT_FITS):
        step, sd = _step(floor, change, number)
        change += step
        runs = [
            replace(run, data=replace(run.data, friction_share=float(share * (1 + change * n))))
            for run, share, n in zip(runs, own, number, strict=True)
        ]
        if abs(step) < RESTS_SD * sd:
            break
        floor = fit_floor(runs, floor.names, held, floor)
    return list(runs), floor, (change, sd)


def _step(floor: FloorFit, change: float, number: Array) -> tuple[float, float]:
    """Step of the change per run from where it stands, and its sd, all other unknowns fitted along."""
    friction = float(floor.fits[0].parameters[INDEX["friction"]])
    evidence = [_with_column(e, friction * n / (1 + change * n)) for e, n in zip(floor.evidence, number, strict=True)]
    shared = columns_of([*floor.names, *ORIGIN, *LENS_TERMS])
    columns = [*shared, PER_RUN]
    prior, pull = prior_of(shared, floor.fits[0].shared, floor.lens_sd_m)
    information, score = np.diag([*prior, 0.0]), np.append(pull, 0.0)
    for e in evidence:
        a, b = e.take(columns)
        information, score = information + a, score + b
    # Unit diagonal first: friction, metres and rates differ by ten orders of magnitude.
    size = np.sqrt(np.diag(information))
    covariance = np.linalg.inv(information / np.outer(size, size)) / np.outer(size, size)
    step = covariance @ score
    wider = disagreement([e.only(columns) for e in evidence], step, covariance)
    grown = float(wider[-1]) * (few(len(number), DRIFT_UNKNOWNS) if wider[-1] > 1 else 1.0)
    return float(step[-1]), float(np.sqrt(covariance[-1, -1])) * grown


def _with_column(evidence: Evidence, slope: float) -> Evidence:
    """Evidence with the column of the change per run: ``slope`` times that of the run's friction."""
    at = evidence.columns.index(INDEX["friction"])
    turn = np.vstack([np.eye(len(evidence.columns)), np.zeros(len(evidence.columns))]).T
    turn[at, -1] = slope
    return replace(
        evidence,
        columns=(*evidence.columns, PER_RUN),
        information=turn.T @ evidence.information @ turn,
        score=turn.T @ evidence.score,
        parts=tuple((turn.T @ a @ turn, turn.T @ b) for a, b in evidence.parts),
    )
