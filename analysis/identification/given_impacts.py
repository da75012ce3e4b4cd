"""Impacts by themselves to the contact law: a recording without motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.contact.given_impacts import MOST_RESTITUTION, given_law_data, with_slip
from analysis.contact.law import LawData, fit_restitution, fit_tangential, restitution_gain, sticks
from analysis.contact.restitution import SPEED, rig_sizes
from analysis.flights.stated_terms import stated_sizes
from analysis.identification.contact_law.deviance import best_tangential
from analysis.identification.contact_law.interval import Interval, normal_interval
from analysis.identification.contact_law.intervals import restitution_interval, scatter_interval, tangential_intervals
from analysis.identification.contact_law.restitution_rows import (
    effect_sizes,
    few,
    reported_restitution,
    restitution_fit,
    rows_of,
    without_effects,
)
from analysis.motion.rig_frame import RigFrame
from ovines.errors import InputError
from ovines.recording import Recording
from ovines.recording_schema import Nominal
from ovines.tables import checked

Array = NDArray[np.float64]
#: impacts by themselves stand in the world as they were brought
UNMOVED = RigFrame(np.zeros(2), 0.0, ())
OPEN = Interval(np.nan, np.nan, np.nan, np.nan)
FEWEST_FOR_SCATTER, FEWEST_FOR_SLOPE = 3, 5


@dataclass(frozen=True, eq=False)
class GivenImpacts:
    """``identification`` of all tables together, ``impacts`` of each with what it informs, ``notes`` in words."""

    identification: pd.DataFrame
    impacts: list[pd.DataFrame]
    notes: tuple[str, ...]


def identify_impacts(tables: Sequence[pd.DataFrame], recordings: Sequence[Recording]) -> GivenImpacts:
    """The contact law of impacts that recordings of one rig bring (tables ``given_impacts``).

    `InputError` without [bodies.nes].
    """
    nes = recordings[0].settings.bodies.nes
    if nes is None:
        raise InputError(
            f"{recordings[0].folder}/recording.toml: no [bodies.nes]",
            "its radius_m, mass_kg and inertia_factor",
            "add the section",
        )
    data = given_law_data(tables, nes)
    rows, notes, friction, beta = _law(data, recordings[0].model)
    identification = pd.DataFrame(
        [(name, i.value, i.sd, i.low, i.high) for name, i, _ in rows],
        columns=["parameter", "value", "sd", "low", "high"],
    )
    identification["n_impacts"] = pd.array([count for _, _, count in rows], dtype="Int64")
    out, first = [], 0
    for table in tables:
        here = (data.at.index >= first) & (data.at.index < first + len(table))
        out.append(checked(_informed(table, data, here, first, friction, beta), "impacts"))
        first += len(table)
    left_out = first - len(data)
    if left_out:
        notes.append(
            f"{left_out} of {first} impacts do not approach the wall and leave it (at most {MOST_RESTITUTION:g} times "
            "as fast): left out."
        )
    return GivenImpacts(checked(identification, "identification"), out, tuple(notes))


def _law(data: LawData, model: Nominal | None) -> tuple[list[tuple[str, Interval, int]], list[str], float, float]:
    """Rows of the table, notes, wall friction and tangential restitution (NaN where nothing tells them)."""
    n = len(data)
    restitution = friction = tangential = OPEN
    if n == 0:
        names = ("restitution", "wall_friction", "tangential_restitution")
        return [(name, OPEN, 0) for name in names], ["No impact could be used."], np.nan, np.nan
    # No clock began with the run: times count from its first impact.
    first = np.array(
        [np.min(data.at.time_s[data.at.run == run], initial=np.inf) for run in range(int(data.at.run.max()) + 1)]
    )
    from_start = data.from_starts(first)
    named = model.effects if model is not None else ()
    fit = restitution_fit(from_start, named, rig_sizes(stated_sizes(model), UNMOVED))
    if fit is None:
        (value,), covariance, _, _ = fit_restitution(data)
        restitution, plain = restitution_interval(data, float(value), float(np.sqrt(covariance[0, 0]))), data
    else:
        value, restitution, plain = fit.value, reported_restitution(fit, n), without_effects(data, from_start, fit)
    sliding, notes = with_slip(data), []
    best = (np.nan, np.nan)
    if len(sliding):
        (start,), start_beta, _, _ = fit_tangential(sliding)
        best = best_tangential(sliding, float(start), start_beta)[:2]
        best = best[0], float(np.clip(best[1], -1, 1))
        friction, tangential = tangential_intervals(sliding, *best)
    else:
        notes.append("No tangential speeds: of the contact law only the restitution is determined.")
    rows = [
        ("restitution", restitution, n),
        ("wall_friction", friction, len(sliding)),
        ("tangential_restitution", tangential, len(sliding)),
    ]
    if n >= FEWEST_FOR_SCATTER:
        rows.append(("restitution_scatter", scatter_interval(plain, float(value)), n))
    if n >= FEWEST_FOR_SLOPE and SPEED not in named:
        _, (slope,), (sd,) = restitution_gain(data, [data.before - data.before.mean()])
        rows.append(("restitution_speed_slope_s_per_m", normal_interval(slope, few(n, 2) * sd), n))
    if fit is not None:
        rows += [(name, interval, n) for name, interval in rows_of(effect_sizes(fit, n, 0.0, 0.0))]
    for name, interval in (("wall friction", friction), ("tangential restitution", tangential)):
        if len(sliding) and not np.isfinite(interval.value):
            regime = "slides" if name == "wall friction" else "sticks"
            notes.append(f"The impacts do not determine the {name}: none of them surely {regime}.")
    return rows, notes, *best


def _informed(
    table: pd.DataFrame, data: LawData, here: NDArray[np.bool_], first: int, friction: float, beta: float
) -> pd.DataFrame:
    """The table with what each used impact tells of the law; what it brought of that itself is replaced."""
    out = table.copy()
    at = data.at.index[here] - first
    with np.errstate(divide="ignore", invalid="ignore"):
        values = {
            "restitution": data.after / data.before,
            "restitution_sd": data.normal_sd / data.before,
            "effective_tangential_restitution": -1
            - (data.mobility * data.tangential_impulse + data.coupling * data.normal_impulse) / data.slip,
            "impulse_ratio": -np.sign(data.slip) * data.tangential_impulse / data.normal_impulse,
            "impulse_ratio_sd": data.tangential_sd / data.normal_impulse,
        }
        values["effective_tangential_restitution_sd"] = data.mobility * data.tangential_sd / np.abs(data.slip)
    stick = sticks(data, friction, beta)
    known = np.isfinite(data.tangential_impulse) & np.isfinite(friction)
    for name, of, regime in (
        ("tangential_restitution", "effective_tangential_restitution", stick),
        ("wall_friction", "impulse_ratio", ~stick),
    ):
        for ending in ("", "_sd"):
            values[name + ending] = np.where(known & regime, values[of + ending], np.nan)
    for name, whole in values.items():
        column = np.full(len(table), np.nan)
        column[at] = whole[here]
        out[name] = column
    regimes = np.full(len(table), None, object)
    regimes[at] = [_regime(*one) for one in zip(known[here], stick[here], strict=True)]
    out["regime"] = pd.Series(list(regimes), dtype=object)
    return out


def _regime(known: bool, sticks: bool) -> str | None:
    if not known:
        return None
    return "stick" if sticks else "slide"
