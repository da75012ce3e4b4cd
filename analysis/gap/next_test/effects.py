"""What simulated recordings say of a named effect and its nearest rival.

Effects of the measurement and of centres are told apart on the bench, not by another excitation: for them
:mod:`analysis.gap.tests_by_hand` has the test.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from analysis.contact.law import fit_restitution
from analysis.contact.restitution import best_speed_scale, restitution_design
from analysis.flights.cutting.run_data import LENS_TERMS
from analysis.flights.equation.parameters import INDEX
from analysis.flights.fit import ORIGIN
from analysis.gap.cause import Cause
from analysis.gap.drive.swings import SWINGS
from analysis.gap.ladder import Ladder
from analysis.gap.next_test.recording import Recorded, Rig
from analysis.gap.next_test.separation import Information
from analysis.gap.next_test.swings import swing_information
from analysis.gap.selection.flights.fit import fit, information_of, prior_of
from analysis.gap.selection.flights.terms import EFFECT_TERMS
from analysis.gap.selection.impact_steps import LEAST_IMPACTS

Array = NDArray[np.float64]
# Slower impacts are neither found nor used.
SLOWEST_M_PER_S = 0.1
# What differs from run to run is nothing that one recording shows.
TERMS = {t.name: t for t in EFFECT_TERMS if t.name != "friction_drift"}
SHAPES = ("wall_ellipticity", "finite_contact_time")
RESTITUTION_EFFECTS = ("speed_dependent_restitution", "direction_dependent_restitution")
SIMULATED = frozenset((*TERMS, "friction_drift", "restitution_drift", "wall_lobes", *SHAPES, *RESTITUTION_EFFECTS))


def rival_of(ladder: Ladder, cause: Cause, causes: Sequence[Cause]) -> str | None:
    """What one of the ``causes`` is most easily taken for, among effects that another setting may tell from it."""
    named = {c.effect for c in causes}
    if cause.effect in SWINGS:  # what the path and the wall have settled needs no test
        return next((name for name in cause.rivals if name in SWINGS), None)
    for names in (TERMS, SHAPES, RESTITUTION_EFFECTS):
        if cause.effect in names:
            ranked = [
                *cause.rivals,
                *(g.term.name for g in sorted(ladder.flights.gains, key=lambda g: -g.held_out)),
                *names,
            ]
            return next((n for n in ranked if n in names and n not in named), None)
    return None


def effect_information(rig: Rig, recorded: Sequence[Recorded], cause: Cause, rival: str) -> Information | None:
    """What recordings say of a cause, its rival unknown; None where that is nothing."""
    if cause.effect in SWINGS:
        return swing_information(rig, recorded, cause.effect, rival)
    judge = _flight_information if cause.stage == "flight" else _impact_information
    return judge(rig, recorded, cause.effect, rival)


def _flight_information(rig: Rig, recorded: Sequence[Recorded], effect: str, rival: str) -> Information | None:
    """Where the rival, the nominal parameters and the lens are unknowns too."""
    ladder, model = rig.ladder, rig.flights.model
    runs = [run for run in (one.run(rig) for one in recorded) if run.flights]
    if not runs:
        return None
    columns = TERMS[effect].columns
    asked = tuple(dict.fromkeys(("friction", *model.free, *columns, *TERMS[rival].columns)))
    model = replace(model, drift_per_run=0.0, free=asked)
    evidence = fit(runs, model, rounds=0, every_column=False, noise=ladder.flights.fitted.noise).evidence
    others = [
        n
        for n in dict.fromkeys([*ladder.flights.fitted.model.free, *ORIGIN, *LENS_TERMS, *TERMS[rival].columns])
        if n not in (*columns, "drift_run")
    ]
    forms = [f for f in (information_of(e, [*columns, *others]) for e in evidence) if f is not None]
    prior = np.diag(prior_of([*columns, *others], rig.like.contact_radius_m))
    return Information(model.parameters[[INDEX[c] for c in columns]], forms, prior)


def _impact_information(rig: Rig, recorded: Sequence[Recorded], effect: str, rival: str) -> Information | None:
    """What the effect does to restitution or contact distance at the simulated impacts, the rival unknown."""
    ladder = rig.ladder
    assert ladder.impacts.fitted is not None
    fast = [one.result.impacts for one in recorded]
    fast = [one[one["normal_speed_before_m_per_s"] > SLOWEST_M_PER_S] for one in fast]
    if sum(len(one) for one in fast) < LEAST_IMPACTS:
        return None
    rows = [_impact_rows(ladder, one, effect, rival) for one in fast]
    size = rows[0][0]
    return Information(size, [weighted.T @ weighted for _, weighted in rows], np.zeros((rows[0][1].shape[1],) * 2))


def _impact_rows(ladder: Ladder, impacts: NDArray[np.void], effect: str, rival: str) -> tuple[Array, Array]:
    """Size (K,) of the effect and the weighted rows (I, M) of it, of what is unknown in any case, and of the rival."""
    assert ladder.impacts.fitted is not None
    speed, azimuth = impacts["normal_speed_before_m_per_s"], impacts["azimuth_rad"]
    data, wall = ladder.impacts.fitted.data, ladder.impacts.fitted.wall
    around, twice = _turning(azimuth), _turning(2 * azimuth)
    if effect in SHAPES:
        # A lasting contact goes with the speed of approach, an ellipse with twice the azimuth; radius and centre are
        # unknowns in any case.
        design = {"finite_contact_time": speed[:, None], "wall_ellipticity": twice * wall.wall.size_m}
        size = (
            np.array([ladder.impacts.fitted.contact_slope_s]) if effect == "finite_contact_time" else wall.wall.ellipse
        )
        always, sd = np.column_stack([np.ones(len(impacts)), around]), np.full(len(impacts), wall.scatter_m)
    else:
        terms = list(ladder.impacts.restitution_terms)
        scale = best_speed_scale(data) if "speed_dependent_restitution" in terms else 1.0
        design = {
            "speed_dependent_restitution": np.exp(-speed / scale)[:, None],
            "direction_dependent_restitution": around,
        }
        fitted = fit_restitution(data, restitution_design(data, terms))
        at = 1 + (effect == "direction_dependent_restitution" and "speed_dependent_restitution" in terms)
        size = fitted[0][at : at + design[effect].shape[1]]
        always = np.ones((len(impacts), 1))
        sd = np.hypot(max(fitted[2], 1e-3), float(np.median(data.normal_sd)) / speed)
    return np.asarray(size, float), np.column_stack([design[effect], always, design[rival]]) / sd[:, None]


def _turning(angle: Array) -> Array:
    return np.column_stack([np.cos(angle), np.sin(angle)])
