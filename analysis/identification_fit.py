"""Runs of one rig to one set of parameters: floor, flights, wall and contact law, each fitted on what the one before left.

Shared unknowns of the flights (floor friction and the terms that ``[model]`` names) are found first, on all flights of all
runs; the impacts are where neighbouring flights meet; the wall is the circle on which they meet; the law is fitted to what happens
there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.contact_law import Law, LawData, fit_restitution, fit_tangential, law_data
from analysis.evidence import Evidence, columns_of, gather, solve
from analysis.flight_model import INDEX, PARAMETERS
from analysis.flights import ORIGIN, SHARED, WARP, FlightFits, fit_flights
from analysis.impacts import meet
from analysis.runs import NO_ANGLE_SD_RAD, Run
from analysis.wall import WALL_TERMS, Wall
from analysis.wall_fit import WallFit, fit_wall

Array = NDArray[np.float64]

# Terms of the flight model that a name in [model] effects stands for; they are estimated along with the friction.
TERMS_OF = {"viscous_drag": ("viscous",), "air_drag": ("air",), "table_tilt": ("tilt_x", "tilt_y"), "friction_drift": ("drift",)}
DEFAULT_EFFECTS = ("floor_friction", "spin_coupling")
# Lens residual of 0.03 mm per polynomial term (EXAMPLES' practice: up to 0.05 mm in all), markers' origin within 1 mm.
WARP_SD_M = 3e-5
ORIGIN_SD_M = 1e-3
# How far the wall may be from the design before the impacts themselves must say so: gluing and turning tolerances, generously.
WALL_PRIOR_SD_M = {"radius": 3e-4, "centre_x": 2e-4, "centre_y": 2e-4, "disk_x": 2e-4, "disk_y": 2e-4}
# Fall of chi-square from which a friction law other than [model]'s is taken: one free parameter would give 10 once in 600 series.
ANOTHER_LAW = 25.0
START_FRICTION = 0.25
ROUNDS = 5


@dataclass(frozen=True, eq=False)
class FloorFit:
    """Flights fitted with the best shared parameters: ``names`` of those estimated, ``estimate`` and ``covariance`` of them;
    ``correlation`` of neighbouring frames' errors, ``scale`` of the sds that the data show, ``misfit`` chi-square in all."""

    fits: tuple[FlightFits, ...]
    evidence: tuple[Evidence, ...]
    names: tuple[str, ...]
    estimate: Array
    covariance: Array
    correlation: float
    scale: float
    misfit: float
    coupling: float


@dataclass(frozen=True, eq=False)
class RigFit:
    """Everything fitted to one or more runs; ``law`` is None without an impact, ``angle`` False where no run shows the disk's angle."""

    runs: tuple[Run, ...]
    floor: FloorFit
    wall: WallFit
    data: LawData
    law: Law | None
    angle: bool
    notes: tuple[str, ...]


def fit_rig(runs: Sequence[Run], effects: Sequence[str] | None) -> RigFit:
    """Floor, wall and contact law of the runs of one rig; ``effects`` as in ``[model]``, None for the default."""
    named = DEFAULT_EFFECTS if effects is None else tuple(effects)
    angle = any(np.any(run.data.angle_sd_rad < NO_ANGLE_SD_RAD) for run in runs)
    floor, notes = choose_floor(runs, named, angle)
    wall = _wall(floor, named, angle)
    data = law_data(wall.impacts, wall.used, runs[0].data.radius_m, runs[0].data.inertia_factor)
    return RigFit(tuple(runs), floor, wall, data, fit_contact_law(data, angle), angle, tuple(notes))


def choose_floor(runs: Sequence[Run], effects: Sequence[str], angle: bool) -> tuple[FloorFit, list[str]]:
    """The floor as ``[model]`` has it, or with friction or its spin coupling added where the flights leave no doubt.

    A wrong flight law bends every extrapolation to an impact; the parameters of the impacts must not pay for it.
    """
    terms = [term for effect in effects for term in TERMS_OF.get(effect, ())]
    load = 1.0 if "vertical_motion" in effects else 0.0
    friction, coupled = "floor_friction" in effects, "spin_coupling" in effects and angle
    declared = fit_floor(runs, (["friction"] if friction or coupled else []) + terms, 1.0 if coupled else 0.0, load)
    if (friction or coupled) and (coupled or not angle):
        return declared, []
    richer = fit_floor(runs, ["friction", *terms], 1.0 if angle else 0.0, load)
    if declared.misfit - richer.misfit < ANOTHER_LAW * max(richer.scale, 1.0) ** 2:
        return declared, []
    what = "floor friction" if not friction else "the coupling of sliding and spinning friction"
    return richer, [f"The flights need {what}, which [model] effects does not name; it was fitted along."]


def fit_floor(runs: Sequence[Run], names: Sequence[str], coupling: float, load: float = 0.0) -> FloorFit:
    """Shared parameters ``names`` of the flight model on all flights of all runs, relinearised until they rest."""
    parameters = np.zeros(len(PARAMETERS))
    parameters[INDEX["coupling"]], parameters[INDEX["load"]] = coupling, load
    if "friction" in names:
        parameters[INDEX["friction"]] = START_FRICTION
    shared = np.zeros(2 + len(WARP))
    columns = columns_of([*names, *ORIGIN, *WARP])
    prior = np.array([{**dict.fromkeys(WARP, WARP_SD_M), **dict.fromkeys(ORIGIN, ORIGIN_SD_M)}.get(SHARED[c], np.inf) for c in columns]) ** -2.0
    at = [columns.index(SHARED.index(n)) for n in names]
    origin = [columns.index(SHARED.index(n)) for n in ORIGIN]
    correlation = 0.0
    for _ in range(ROUNDS):
        fits = [fit_flights(run.data, run.flights, parameters, shared) for run in runs]
        evidence = [gather(fit, columns, correlation) for fit in fits]
        correlation = noise_correlation(evidence)
        step, covariance, _ = solve(evidence, columns, prior)
        small = np.abs(step[[*at, *origin]]) <= 0.03 * np.sqrt(np.diag(covariance)[[*at, *origin]])
        if np.all(small):
            break
        for name, k in zip(names, at, strict=True):
            parameters[INDEX[name]] += step[k]
        parameters[0] = max(parameters[0], 0.0)
        shared[:2] += step[origin]
    count = sum(e.count for e in evidence) - len(names)
    misfit = sum(e.misfit for e in evidence)
    scale = float(np.sqrt(max(misfit / count, 1e-4))) if count > 0 else 1.0
    estimate = np.array([parameters[INDEX[n]] for n in names]) + step[at]
    return FloorFit(tuple(fits), tuple(evidence), tuple(names), estimate, covariance[np.ix_(at, at)] * max(scale, 1.0) ** 2,
                    correlation, scale, float(misfit - step @ (np.linalg.pinv(covariance, hermitian=True) @ step)), coupling)


def noise_correlation(evidence: Sequence[Evidence]) -> float:
    """Correlation of neighbouring frames' errors, from the residuals of all flights (0 to 0.9)."""
    weights = np.array([e.count for e in evidence], float)
    if not weights.sum() > 0:
        return 0.0
    lag = float(np.sum(weights * np.array([e.lag_one for e in evidence])) / weights.sum())
    return float(np.clip(lag, 0.0, 0.9))


def _wall(floor: FloorFit, effects: Sequence[str], angle: bool) -> WallFit:
    terms = [term for term in WALL_TERMS[:5] if angle or not term.startswith("disk")]
    if "wall_ellipticity" in effects:
        terms += WALL_TERMS[5:]
    start = Wall(floor.fits[0].run.contact_radius_m)
    return fit_wall(meet(floor.fits), start, terms, WALL_PRIOR_SD_M)


def fit_contact_law(data: LawData, angle: bool) -> Law | None:
    """Restitution, and where the angle is known wall friction and tangential restitution; None without an impact."""
    if len(data) == 0:
        return None
    (restitution,), _, scatter, normal = fit_restitution(data)
    if not angle:
        return Law(float(restitution), scatter, np.nan, np.nan, normal, np.nan, np.nan)
    (friction,), beta, tangential_scatter, tangential = fit_tangential(data)
    return Law(float(restitution), scatter, float(friction), float(np.clip(beta, -1, 1)), normal, tangential, tangential_scatter)


def refit_law(rig: RigFit, meetings: NDArray[np.bool_]) -> RigFit:
    """The contact law once more, on those of the usable impacts that are true for ``meetings`` (K,)."""
    if not np.any(rig.wall.used & ~meetings):
        return rig
    data = law_data(rig.wall.impacts, rig.wall.used & meetings, rig.runs[0].data.radius_m, rig.runs[0].data.inertia_factor)
    return replace(rig, data=data, law=fit_contact_law(data, rig.angle))
