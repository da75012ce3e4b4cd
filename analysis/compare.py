"""Measured against simulated: one flight ahead, one impact ahead, and whole-run statistics.

Chaos multiplies an error by about three at every impact, so runs are never laid over each other point by
point: each flight starts from the state measured after its impact, each impact from the state measured before
it, and whole runs are compared through distributions over an ensemble of starts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.comparison.flights_ahead import one_flight_ahead
from analysis.comparison.laws_at_impacts import LawsAtImpacts, laws_at_impacts
from analysis.comparison.run_statistics import run_statistics
from analysis.comparison.simulated_rig import host_motion_of, met, nominal_scenario, states_after
from analysis.contact.effect_rows import CONTACT_TIME
from analysis.contact.held_laws import met_turn
from analysis.contact.tangential.lasting import LastingContact, stiffness_of
from analysis.walls.drawn import identified_wall
from ovines.core import Scenario
from ovines.errors import InputError
from ovines.recording import Recording

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Comparison:
    """Both sides of one recording.

    ``flights``: one row per flight between two impacts; ``impacts``: one row per impact, measured and
    simulated values after it; ``statistics``: one row per quantity of the whole run; ``samples``: the values
    behind them by quantity, (measured, simulated); ``scenario``: what was simulated.
    """

    flights: pd.DataFrame
    impacts: pd.DataFrame
    statistics: pd.DataFrame
    samples: dict[str, tuple[Array, Array]]
    scenario: Scenario


def compare(
    motion: pd.DataFrame,
    impacts: pd.DataFrame,
    identification: pd.DataFrame | None,
    recording: Recording,
    rng: np.random.Generator,
    runs: int = 40,
    contacts_s: Sequence[tuple[float, float]] = (),
) -> Comparison:
    """Compare the measured ``motion`` and ``impacts`` with the simulator at the identified parameters.

    A parameter that was not identified is taken from ``[model]`` of the recording; a bound alone is used at
    its end.  ``runs`` copies of the whole recording start from the first measured flight, scattered by its
    uncertainty (``rng``).  ``contacts_s``: start and end of sustained wall contacts; a stretch between two
    impacts that holds one is no flight.
    """
    if not len(motion):
        raise InputError(
            "a table motion without rows", "one row for each frame", "run ovines run on the recording again"
        )
    host_motion = host_motion_of(motion, recording)
    scenario = nominal_scenario(
        identification, recording, host_motion, float(motion["time_s"].max() - motion["time_s"].min())
    )
    wall = identified_wall(identification, recording)
    meeting, in_wall_s = met(impacts, identification, scenario)
    states = states_after(meeting, host_motion, scenario.nes.radius_m, wall)
    flights = one_flight_ahead(motion, meeting, states, scenario, host_motion, contacts_s, in_wall_s)
    after = one_impact_ahead(impacts, scenario, laws_at_impacts(meeting, scenario, host_motion))
    statistics, samples = run_statistics(motion, meeting, states, scenario, host_motion, rng, runs, contacts_s)
    return Comparison(flights, after, statistics, samples, scenario)


def one_impact_ahead(impacts: pd.DataFrame, scenario: Scenario, laws: LawsAtImpacts | None = None) -> pd.DataFrame:
    """What the impact law makes of each measured approach: measured and simulated normal and tangential speed
    and spin after.

    Luding law with a heavy Host (thesis eqs (91)-(102)), or a spring along the wall where contacts
    last (:mod:`analysis.contact.tangential.lasting`); spin by the tangential impulse,
    omega+ = omega- + (v_t+ - v_t-) / (R (1 + q)).  Impacts without a measured approach have null predictions.
    ``laws``: written ones, which add to its numbers at each impact (:func:`laws_at_impacts`).
    """
    law, nes, more = scenario.impact, scenario.nes, laws.added() if laws is not None else {}
    restitution = np.clip(law.restitution + more.get("restitution", 0.0), 0.0, 1.0)
    friction = np.maximum(law.wall_friction + more.get("wall_friction", 0.0), 0.0)
    reversal = np.clip(law.tangential_restitution + more.get("tangential_restitution", 0.0), -1.0, 1.0)
    v_n, v_t, spin = (
        impacts[name].to_numpy(float)
        for name in (
            "normal_speed_before_m_per_s",
            "tangential_speed_before_m_per_s",
            "spin_before_rad_per_s",
        )
    )
    passing = v_t - nes.radius_m * spin
    turn_rad = met_turn(more.get("contact_normal", np.zeros(len(v_n))), v_n, passing)
    v_n, v_t = v_n + _turned(turn_rad, v_n, passing), v_t + _turned(turn_rad, passing, -v_n)
    with np.errstate(divide="ignore", invalid="ignore"):
        sliding = -1 + friction * (1 + restitution) * (1 + 1 / nes.inertia_factor) * np.abs(v_n) / np.abs(v_t)
    tangential = np.where(v_t == 0, 0.0, -np.minimum(reversal, sliding) * v_t)
    if CONTACT_TIME in scenario.effects:
        tangential = _after_lasting(v_t, friction * (1 + restitution) * np.abs(v_n), scenario)
    after = spin + (tangential - v_t) / (nes.radius_m * (1 + nes.inertia_factor))
    more = laws.added(after) if laws is not None else {}
    turned = more.get("spin_kept", 0.0) * after + more.get("spin_added", 0.0)
    out = impacts[
        [
            "impact",
            "time_s",
            "normal_speed_after_m_per_s",
            "tangential_speed_after_m_per_s",
            "spin_after_rad_per_s",
        ]
    ].copy()
    left, passing = restitution * v_n, tangential - nes.radius_m * after
    # A blow that is turned into the wall does not go through it.
    out["simulated_normal_speed_after_m_per_s"] = np.maximum(left + _turned(turn_rad, left, passing), 0.0)
    along = tangential + _turned(turn_rad, passing, -left)
    out["simulated_tangential_speed_after_m_per_s"] = along + nes.radius_m * turned
    out["simulated_spin_after_rad_per_s"] = after + turned
    return out.reset_index(drop=True)


def _turned(turn_rad: Array, speed: Array, beside: Array) -> Array:
    """What a ``speed`` (n,) changes by where its direction is turned by ``turn_rad`` (n,) towards that of the speed
    ``beside`` it."""
    return np.where(turn_rad == 0.0, 0.0, (np.cos(turn_rad) - 1) * speed + np.sin(turn_rad) * beside)


def _after_lasting(slip: Array, sliding: Array, scenario: Scenario) -> Array:
    """Tangential speeds (n,) after contacts that last, of the spring that the tangential restitution stands for; of
    ``slip`` (n,) before, where friction that slides throughout gives impulses per mass of ``sliding`` (n,)."""
    law = scenario.impact
    stiffness = stiffness_of(law.tangential_restitution, law.restitution)
    share, known = 1 + 1 / scenario.nes.inertia_factor, np.isfinite(slip) & np.isfinite(sliding)
    after = np.full(len(slip), np.nan)
    spring = LastingContact(1.0, stiffness, law.restitution, np.nan)
    after[known] = slip[known] + share * spring.impulse(-slip[known] / share, sliding[known])
    return after
