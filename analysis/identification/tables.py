"""Tables ``impacts`` and ``flights`` of one run from what was fitted."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.contact.impacts import QUANTITIES
from analysis.flights.cutting.runs import with_frames_in_wall
from analysis.identification.bounce_sequences import BounceSequence, Merged
from analysis.identification.contact_law.interval import Interval
from analysis.identification.fit import HOST_ACCELERATION_M_PER_S2, RigFit

Array = NDArray[np.float64]
# sd of a tangential speed from which the disk's angle says nothing about it (m/s).
UNKNOWN_SPEED_M_PER_S = 10.0
#: what stands in the table for every impact whatever its regime, each with its sd
EVERY = ("effective_tangential_restitution", "impulse_ratio", "spin_imbalance_m_per_s")
COLUMNS = {
    "normal_before": "normal_speed_before_m_per_s",
    "normal_after": "normal_speed_after_m_per_s",
    "tangential_before": "tangential_speed_before_m_per_s",
    "tangential_after": "tangential_speed_after_m_per_s",
}


def impacts_table(rig: RigFit, run: int, law: dict[str, Interval], merged: Merged) -> pd.DataFrame:
    """Table ``impacts`` of one run: the junctions of two flights, and the impacts of its sequences.

    ``regime`` is what the law of all impacts says of this one; the parameter that it informs stands in its row with the
    sd of this impact alone, the other is null; the impulse ratio and the effective tangential restitution (-v_t'/v_t)
    stand in every row, and how far spin and tangential impulse disagree.  An impact of a sequence has time, place and
    what came before it; what came after it was predicted, not measured on its own: null.  Without an angle everything
    tangential is null.
    """
    chosen = np.flatnonzero(merged.junctions & (rig.wall.impacts.junctions.run == run))
    floor = rig.balance.speed_floor_m_per_s
    parts = [_impacts_of_junctions(rig, chosen, law)] + [
        _impacts_of_sequence(rig, sequence, floor) for sequence in merged.sequences if sequence.run == run
    ]
    table = pd.concat([part for part in parts if len(part)] or parts[:1], ignore_index=True).sort_values(
        "time_s", ignore_index=True
    )
    table.insert(0, "impact", np.arange(len(table)))
    return table


def _impacts_of_sequence(rig: RigFit, sequence: BounceSequence, speed_floor_m_per_s: float) -> pd.DataFrame:
    wall, surface = rig.wall.wall, np.rint(sequence.of("surface")).astype(np.int64)
    host_angle = rig.runs[sequence.run].data.host.at(sequence.of("time"))[:, 3]
    table = pd.DataFrame(
        {
            "time_s": sequence.of("time") - rig.wall.delay_s,
            "time_sd_s": sequence.sd("time"),
            "azimuth_rad": sequence.of("azimuth"),
            "surface": np.array(wall.names, object)[surface],
            "normal_rad": wall.normal(surface, sequence.of("azimuth"), host_angle),
        }
    )
    for quantity, column in COLUMNS.items():
        known = quantity.endswith("before")
        table[column] = sequence.of(quantity) if known else np.nan
        table[column.replace("_m_per_s", "_sd_m_per_s")] = (
            np.hypot(sequence.sd(quantity), speed_floor_m_per_s) if known else np.nan
        )
    table["spin_before_rad_per_s"], table["spin_after_rad_per_s"] = sequence.of("spin_before"), np.nan
    unknown = [
        column
        for name in ("restitution", "tangential_restitution", "wall_friction", *EVERY)
        for column in (name, _sd_name(name))
    ]
    table[unknown] = np.nan
    table["regime"] = pd.Series([None] * len(table), dtype=object)
    return table


def _impacts_of_junctions(rig: RigFit, chosen: NDArray[np.int64], law: dict[str, Interval]) -> pd.DataFrame:
    impacts = rig.wall.impacts
    table = pd.DataFrame(
        {
            "time_s": impacts.of("time")[chosen] - rig.wall.delay_s,
            "time_sd_s": impacts.sd("time")[chosen],
            "azimuth_rad": impacts.azimuth_rad[chosen],
            "surface": np.array(rig.wall.wall.names, object)[impacts.surface[chosen]],
            "normal_rad": impacts.normal_rad[chosen],
        }
    )
    floor = np.hypot(rig.balance.speed_floor_m_per_s, rig.wall.delay_s * HOST_ACCELERATION_M_PER_S2)
    for quantity, column in COLUMNS.items():
        sd = np.hypot(impacts.sd(quantity)[chosen], floor)
        known = sd < UNKNOWN_SPEED_M_PER_S
        table[column] = np.where(known, impacts.of(quantity)[chosen], np.nan)
        table[column.replace("_m_per_s", "_sd_m_per_s")] = np.where(known, sd, np.nan)
    angle = np.isfinite(table["tangential_speed_before_m_per_s"].to_numpy(float))
    for when in ("before", "after"):
        table[f"spin_{when}_rad_per_s"] = np.where(angle, impacts.of(f"spin_{when}")[chosen], np.nan)
    value, covariance = impacts.value[chosen], impacts.covariance[chosen]
    with np.errstate(divide="ignore", invalid="ignore"):
        (restitution, restitution_sd), (beta, beta_sd), (friction, friction_sd) = _ratios(rig, value, covariance, floor)
        regime = _regime(value, rig, law)
    table["restitution"], table["restitution_sd"] = restitution, restitution_sd
    regime[~(angle & np.isfinite(beta))] = None
    for name, values, sd, kind in (
        ("tangential_restitution", beta, beta_sd, "stick"),
        ("wall_friction", friction, friction_sd, "slide"),
    ):
        table[name] = np.where(regime == kind, values, np.nan)
        table[f"{name}_sd"] = np.where(regime == kind, sd, np.nan)
    turned, turned_sd = _imbalance(rig, value, covariance, floor)
    for name, values, sd in zip(EVERY, (beta, friction, turned), (beta_sd, friction_sd, turned_sd), strict=True):
        table[name], table[_sd_name(name)] = np.where(angle, values, np.nan), np.where(angle, np.abs(sd), np.nan)
    table["regime"] = pd.Series(list(regime), dtype=object)
    return table


def _ratios(rig: RigFit, value: Array, covariance: Array, floor: Array | float) -> tuple[tuple[Array, Array], ...]:
    """Restitution, effective tangential restitution and impulse ratio of each impact, with their sds (K,).

    ``value`` (K, 8) and ``covariance`` (K, 8, 8) of :data:`QUANTITIES`, ``floor`` (m/s) the error of a speed beyond
    them."""
    before, after, slip, slip_after = value[:, :4].T
    share = 1 + rig.data.host_mobility + 1 / rig.data.inertia_factor
    normal = (before + after) / (1 + rig.data.host_share)
    restitution = after / before
    restitution_sd = _sd_of(
        covariance, {"normal_after": 1 / before, "normal_before": -restitution / before}, floor / before
    )
    beta = -slip_after / slip
    beta_sd = _sd_of(covariance, {"tangential_after": 1 / slip, "tangential_before": beta / slip}, floor / slip)
    friction = -np.sign(slip) * (slip_after - slip) / share / normal
    along = -np.sign(slip) / share / normal
    row = {
        "tangential_after": along,
        "tangential_before": -along,
        "normal_before": -friction / (before + after),
        "normal_after": -friction / (before + after),
    }
    return (restitution, restitution_sd), (beta, beta_sd), (friction, _sd_of(covariance, row, floor / normal))


def _sd_name(column: str) -> str:
    """Name of the column with a quantity's sd: its unit stays last."""
    return f"{column.removesuffix('_m_per_s')}_sd{'_m_per_s' if column.endswith('_m_per_s') else ''}"


def _imbalance(rig: RigFit, value: Array, covariance: Array, floor: Array | float) -> tuple[Array, Array]:
    """q R d(omega) less the tangential impulse per mass of each impact (m/s), and its sd: 0 whatever the contact
    law.
    """
    q, radius = rig.data.inertia_factor, rig.runs[0].data.radius_m
    share = 1 + rig.data.host_mobility + 1 / q
    row = {
        "spin_after": q * radius,
        "spin_before": -q * radius,
        "tangential_after": -1 / share,
        "tangential_before": 1 / share,
    }
    return (
        np.sum([value[:, QUANTITIES.index(name)] * factor for name, factor in row.items()], axis=0),
        _sd_of(
            covariance, {name: np.full(len(value), factor) for name, factor in row.items()}, np.full(len(value), floor)
        ),
    )


def _regime(value: Array, rig: RigFit, law: dict[str, Interval]) -> NDArray[np.object_]:
    """ "stick" where (1 + beta_0) |v_t| / (1 + 1/q) is within mu_c j_n; a parameter without value never is the smaller
    side.
    """
    count, slip, normal_impulse = len(value), np.abs(value[:, 2]), value[:, 0] + value[:, 1]
    normal_impulse = normal_impulse / (1 + rig.data.host_share)
    share = 1 + rig.data.host_mobility + 1 / rig.data.inertia_factor
    if rig.law is None or not rig.angle:
        return np.full(count, None, object)
    friction, beta = law["wall_friction"], law["tangential_restitution"]
    if np.isfinite(friction.value) and np.isfinite(beta.value):
        stick = (1 + beta.value) * slip / share <= friction.value * normal_impulse
    elif np.isfinite(beta.value):
        stick = np.ones(count, bool)
    elif np.isfinite(friction.value):
        stick = np.zeros(count, bool)
    else:
        stick = (1 + rig.law.tangential_restitution) * slip / share <= rig.law.wall_friction * normal_impulse
    return np.where(stick, "stick", "slide").astype(object)


def _sd_of(covariance: Array, row: dict[str, Array], floor: Array) -> Array:
    """sd of a linear combination of :data:`QUANTITIES` whose coefficients differ from impact to impact."""
    coefficients = np.zeros((len(covariance), len(QUANTITIES)))
    for name, values in row.items():
        coefficients[:, QUANTITIES.index(name)] = values
    return np.sqrt(np.einsum("ki,kij,kj->k", coefficients, covariance, coefficients) + floor**2)


def flights_table(rig: RigFit, run: int, merged: Merged) -> pd.DataFrame:
    """Table ``flights``: the whole run cut into what each part of it is.

    "flight" (fitted), "rest" (a flight with no motion against the floor), "chatter" (hops of a sequence, from its first
    impact to its last), "contact" (sustained, at the wall), "unseen" (the NES hidden for more frames than a flight
    bridges) and "unresolved" (seen, but no flight could be fitted).  All but the first two are time excluded from the
    fit of the floor.
    """
    fits, segments = rig.floor.fits[run], rig.runs[run].segments
    data = with_frames_in_wall(rig.runs[run], rig.runs[run].data)
    if len(data.time_s) == 0:
        return pd.DataFrame({"flight": [], "start_s": [], "end_s": [], "kind": []})
    spans = [
        (float(data.time_s[f.first]), float(data.time_s[f.last]), "rest" if fits.rests(k) else "flight")
        for k, f in enumerate(fits.flights)
    ]
    junctions = rig.wall.impacts.junctions
    for i in np.flatnonzero((junctions.run == run) & merged.junctions):
        k, moment = int(junctions.flight[i]), float(junctions.time_s[i])
        spans[k] = (spans[k][0], moment, spans[k][2])
        spans[k + 1] = (moment, spans[k + 1][1], spans[k + 1][2])
    spans = _whole(spans, [f.goes_on for f in fits.flights])
    spans += [(float(data.time_s[a]), float(data.time_s[b]), "contact") for a, b in segments.contact]
    for first, last in merged.chatter(run):
        spans = [piece for span in spans for piece in _without(span, first, last)] + [(first, last, "chatter")]
    spans.sort()
    seen = np.isfinite(data.xy_m[:, 0])
    rows, here, end = [], float(data.time_s[0]), float(data.time_s[-1])
    for start, stop, kind in [*spans, (end, end, "")]:
        if start > here + 1e-9:
            inside = (data.time_s > here) & (data.time_s < start)
            rows.append((here, start, "unseen" if inside.any() and not seen[inside].any() else "unresolved"))
        if kind and stop > max(start, here):
            rows.append((max(start, here), stop, kind))
        here = max(here, stop)
    table = pd.DataFrame(rows, columns=["start_s", "end_s", "kind"])
    table.insert(0, "flight", np.arange(len(table)))
    return table


def _whole(spans: Sequence[tuple[float, float, str]], goes_on: Sequence[bool]) -> list[tuple[float, float, str]]:
    """The pieces of a long flight as one where they are of a kind, else end to end."""
    whole: list[tuple[float, float, str]] = []
    for k, (start, end, kind) in enumerate(spans):
        if k > 0 and goes_on[k - 1]:
            before = whole.pop()
            if before[2] == kind:
                start = before[0]
            else:
                whole.append((before[0], start, before[2]))
        whole.append((start, end, kind))
    return whole


def _without(span: tuple[float, float, str], first: float, last: float) -> list[tuple[float, float, str]]:
    """What is left of a span outside first..last."""
    start, end, kind = span
    return [
        piece for piece in ((start, min(end, first), kind), (max(start, last), end, kind)) if piece[1] - piece[0] > 1e-9
    ]
