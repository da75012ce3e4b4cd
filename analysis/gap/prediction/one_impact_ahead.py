"""One flight ahead through an impact: a flight's path, carried through wall and law of other runs, into the next
flight.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.contact.held_laws import added_by, known_at_impacts, without_laws
from analysis.contact.impacts import Junctions, measure
from analysis.contact.law import Law
from analysis.contact.restitution import Conditions, EffectsFit, fit_effects
from analysis.contact.tangential.lasting import LastingContact
from analysis.contact.wall_fit import fit_wall
from analysis.flights.cutting.runs import Run
from analysis.flights.fit import FlightFits
from analysis.gap.selection.impacts.fit import ImpactFit, law_of, wall_prior
from analysis.walls.wall import Wall

Array = NDArray[np.float64]

# Slower approaches are chatter, whose impacts follow each other within frames: none of them is predicted by itself (the
# rig's own units).
SLOWEST_APPROACH_M_PER_S = 0.05


@dataclass(frozen=True)
class _Learnt:
    """What some runs say of wall and law: ``late_s`` that a contact lasts (0: an instant) and its ``lasting`` law along
    the wall, and the ``restitution`` with its effects."""

    wall: Wall
    law: Law
    lasting: LastingContact | None
    late_s: float
    restitution: EffectsFit


def through_impacts(
    runs: Sequence[Run],
    fits: Sequence[FlightFits],
    impacts: ImpactFit,
    restitution_terms: Sequence[str],
    *,
    finite: bool,
    held: Array,
) -> list[Array]:
    """Predicted x, y, angle (N, 3) per run: each flight that follows an impact, from the flight before; NaN elsewhere.

    Wall and law come from the other runs (``finite``, ``restitution_terms``, ``held`` rows (T, ROW_SIZE) of written
    laws: what the model holds).
    """
    paths = [np.full((len(run.data.time_s), 3), np.nan) for run in runs]
    junctions = impacts.junctions
    data = impacts.data
    known = dict(zip(data.at.index.tolist(), known_at_impacts(data, junctions, fits), strict=True)) if len(held) else {}
    for number in range(len(runs)):
        here = junctions.run == number
        if not here.any():
            continue
        rest = ~here if len(runs) > 1 and np.count_nonzero(~here) >= 8 else np.ones(len(here), bool)
        learnt = _learn(junctions.at(rest), impacts.without(number), restitution_terms, finite, (fits, held))
        for one in np.flatnonzero(here):
            junction = junctions.at(np.array([one]))
            path = _carry(junction, runs[number], fits[number], learnt, added_by(held, known.get(int(one))))
            if path is not None:
                index, states = path
                paths[number][index] = states
    return paths


def _learn(
    junctions: Junctions,
    impacts: ImpactFit,
    restitution_terms: Sequence[str],
    finite: bool,
    held: tuple[Sequence[FlightFits], Array],
) -> _Learnt:
    """From ``junctions``, beside what is ``held``: laws' rows, between flights."""
    extra, start, terms = None, impacts.wall.wall, impacts.wall.terms
    prior = wall_prior(start)
    if finite:
        first = fit_wall(junctions, start, terms, prior, rounds=2)
        extra = np.maximum(first.impacts.of("normal_before"), 0)[:, None]
    fitted = fit_wall(junctions, start, terms, prior, extra)
    data = without_laws(law_of(fitted, impacts), junctions, *held)
    restitution = fit_effects(data, restitution_terms, {})
    slope = float(fitted.estimate[-1]) if finite else 0.0
    return _Learnt(
        fitted.wall,
        impacts.law,
        impacts.lasting if finite else None,
        slope,
        restitution,
    )


def _carry(
    one: Junctions, run: Run, fits: FlightFits, learnt: _Learnt, added: Mapping[str, float]
) -> tuple[NDArray[np.int64], Array] | None:
    law, impact = learnt.law, measure(one, learnt.wall)
    approach, gap_m, azimuth = float(impact.of("normal_before")[0]), float(impact.of("gap")[0]), impact.azimuth_rad
    if approach < SLOWEST_APPROACH_M_PER_S:
        return None
    if added["contact_normal"] != 0.0:
        turned = measure(replace(one, lean_rad=one.lean_rad + added["contact_normal"]), learnt.wall)
        impact = turned if float(turned.of("normal_before")[0]) > 0.0 else impact
    before, slip = float(impact.of("normal_before")[0]), float(impact.of("tangential_before")[0])
    here = Conditions(np.array([before]), azimuth, one.time_s - run.data.start_s, one.run.astype(float))
    after = (float(learnt.restitution.at(here)[0]) + added["restitution"]) * before
    q, radius = run.data.inertia_factor, one.radius_m
    gives = float(one.gives.along(impact.host_levers_m(radius)[:1, 0])[0])
    stop, pushed = abs(slip) / (1 + gives + 1 / q), (before + after) / (1 + one.gives.share)
    if learnt.lasting is not None:
        size = float(learnt.lasting.impulse(np.array([stop]), np.array([pushed]))[0])
    else:
        sticking = (1 + law.tangential_restitution + added["tangential_restitution"]) * stop
        size = min(sticking, max(law.wall_friction + added["wall_friction"], 0.0) * pushed)
    impulse = -np.sign(slip) * size
    turn_rad_per_s = impulse / (q * radius)
    turn_rad_per_s += added["spin_kept"] * (float(one.state[0, 5]) + turn_rad_per_s) + added["spin_added"]
    normal = float(impact.normal_rad[0])
    er = np.array([np.cos(normal), np.sin(normal)])
    et = np.array([-er[1], er[0]])
    start = one.state[0, :6].copy()
    # The path reaches the predicted wall a little before or after the place where the flights really met.
    late = (learnt.late_s * approach - gap_m) / approach
    late = float(np.clip(late, -3e-3, 3e-3))
    start[:2] += start[3:5] * late
    start[2] += start[5] * late
    start[3:5] += -pushed * er + impulse * et
    start[5] += turn_rad_per_s
    k = int(one.flight[0]) + 1
    flight = fits.flights[k]
    index = np.arange(flight.first, flight.last + 1)
    moved = replace(
        fits,
        states=np.where(np.arange(len(fits.states))[:, None] == k, start, fits.states),
        reference_s=np.where(np.arange(len(fits.reference_s)) == k, one.time_s[0] + late, fits.reference_s),
    )
    states = moved.path(k, run.data.time_s[index])
    c, s = np.cos(states[:, 2]), np.sin(states[:, 2])
    ox, oy = fits.shared[:2]
    return index, np.column_stack([states[:, 0] + c * ox - s * oy, states[:, 1] + s * ox + c * oy, states[:, 2]])
