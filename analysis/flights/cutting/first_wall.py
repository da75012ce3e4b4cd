"""Where the wall is, roughly, before anything is fitted: what is contact and what is flight hangs on it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from analysis.flights.cutting.run_data import RunData
from analysis.flights.cutting.segments import WALL_OFF_SHARE
from analysis.walls.lobes import LOBE_TERMS, LobedWall, best_order, lobe_columns
from analysis.walls.wall import Wall
from ovines.robust import residual_sd

Array = NDArray[np.float64]

# Nearer than this to the wall for four frames in a row is sustained contact (or chatter below 0.1 m/s: v^2 / 2a = 0.1
# mm); in the rig's own units.
CONTACT_MARGIN_M = 1.5e-4
# Of the runs' farthest distances: not the largest, which may be a wrong track's.
HIGH_QUANTILE = 0.8
# A rebound whose approach and leave differ by so much along the wall's normal (rig units) is no passing chord, which
# the circle bends by v^2/R in a frame; of so many of them, all round, the wall's place is known.
REBOUND_M_PER_S, FEWEST_REBOUNDS = 0.3, 16
# The wall's place is moved where it is off by more of its sds and by this share of the contact margin.
SURELY_OFF_SD, OFF_SHARE = 5.0, 0.5
ABSOLUTE_ROUNDS, MEAN_OF_ABSOLUTE = 30, 1.2533  # of a least absolute fit; its sd over that of least squares


def from_host(data: RunData) -> tuple[Array, Array]:
    """The NES' places (N, 2) from the Host's centre, in the room's directions, and the Host's angles (N,)."""
    host = data.host.at(data.time_s)
    return data.xy_m - host[:, :2], host[:, 3]


def reached_wall(datas: Sequence[RunData]) -> Wall:
    """First guess of the wall from the data: the design, its outline moved to where the NES gets in sustained contact
    and at impacts.

    First the outline is moved to where rebounds say that it stands (:func:`where_rebounds_turn`).  The farthest of each
    run but for single wrong frames (median of three neighbours), and of the runs a high quantile: a disk that comes to
    rest, or hits the wall but once and fast, never shows it.  The design where no run comes near it.
    """
    design, distance_m = where_rebounds_turn(datas, datas[0].wall)
    reached = []
    for data in datas:
        gap = design.outline_gap(*from_host(data))
        gap = gap[np.isfinite(gap)]
        if len(gap) > 2:
            reached.append(float(np.max(np.median(np.lib.stride_tricks.sliding_window_view(gap, 3), axis=1))))
    near = [one for one in reached if abs(one) < WALL_OFF_SHARE * design.size_m]
    # The farthest of many frames is the farthest of their noise; where rebounds turn it is not.
    most_m = distance_m + OFF_SHARE * CONTACT_MARGIN_M * datas[0].own_units[0]
    return design.grown(min(float(np.quantile(near, HIGH_QUANTILE)), most_m)) if near else design


def where_rebounds_turn(datas: Sequence[RunData], design: Wall) -> tuple[Wall, float]:
    """``design`` with its outline, in the Host's frame, and of a ring its ellipse and lobes, where rebounds say that
    they are, as far as that is sure and matters; and how far beyond it rebounds turn (m; infinite where too few do).

    Two frames before and two after each rebound, each on a line, meet at the wall: a least absolute fit of these gaps
    on the wall's normals and a ring's shapes, beside a distance that all share.
    """
    parts = zip(*(_rebounds(data, design) for data in datas), strict=True)
    gap, normal, azimuth, turn = map(np.concatenate, parts)
    near = np.abs(gap) < WALL_OFF_SHARE * design.size_m
    gap, normal, azimuth, turn = gap[near], normal[near], azimuth[near], turn[near]
    if len(gap) < FEWEST_REBOUNDS:
        return design, np.inf
    columns, order = np.column_stack([np.ones(len(gap)), normal]), 0
    if design.ellipse_terms:
        columns = np.column_stack([columns, lobe_columns(azimuth, 2)])
        order = best_order(azimuth - turn, columns, gap)
    if order:
        columns = np.column_stack([columns, lobe_columns(azimuth - turn, order)])
    found, variance = _least_absolute(columns, gap)
    least_m = OFF_SHARE * CONTACT_MARGIN_M * datas[0].own_units[0]

    def off_m(first: int) -> Array | None:
        """Two coefficients, where they are sure and matter."""
        own = found[first : first + 2]
        sd = np.sqrt(np.linalg.eigvalsh(variance[first : first + 2, first : first + 2])[-1]) if len(own) else np.inf
        return own if float(np.hypot(*own)) > max(SURELY_OFF_SD * float(sd), least_m) else None

    wall = design
    shift, ellipse, lobes = off_m(1), off_m(3) if design.ellipse_terms else None, off_m(5) if order else None
    if shift is not None:
        wall = wall.shifted(shift)
    if ellipse is not None:
        wall = wall.moved(dict(zip(design.ellipse_terms, ellipse / design.size_m, strict=True)))
    if lobes is not None:
        wall = LobedWall.of(wall, order).moved(dict(zip(LOBE_TERMS, lobes / design.size_m, strict=True)))
    return wall, float(found[0])


def _least_absolute(columns: Array, values: Array) -> tuple[Array, Array]:
    """Coefficients (P,) of the columns (K, P) with the least sum of absolute residuals, and their covariance."""
    found: Array = np.zeros(columns.shape[1])
    weight = np.ones(len(values))
    for _ in range(ABSOLUTE_ROUNDS):
        found = np.asarray(np.linalg.lstsq(columns * weight[:, None], values * weight, rcond=None)[0], float)
        left = values - columns @ found
        sd = residual_sd(left) + 1e-300
        weight = 1 / np.sqrt(np.maximum(np.abs(left), 1e-2 * sd))
    variance = (MEAN_OF_ABSOLUTE * sd) ** 2 * np.linalg.pinv(columns.T @ columns, hermitian=True)
    return np.asarray(found, float), np.asarray(variance, float)


def _rebounds(data: RunData, design: Wall) -> tuple[Array, Array, Array, Array]:
    """Of each rebound in a run: where its lines meet, past ``design`` (K,), the wall's outward normal in the Host's
    frame (K, 2), its azimuth (K,) from the Host's centre, in the room, and the Host's angle (K,).
    """
    relative, angle = from_host(data)
    gap = design.outline_gap(relative, angle)
    if len(gap) < 5:
        return np.zeros(0), np.zeros((0, 2)), np.zeros(0), np.zeros(0)
    seen = np.lib.stride_tricks.sliding_window_view(gap, 5)
    time = np.lib.stride_tricks.sliding_window_view(data.time_s, 5)
    approach = (seen[:, 1] - seen[:, 0]) / (time[:, 1] - time[:, 0])
    leave = (seen[:, 4] - seen[:, 3]) / (time[:, 4] - time[:, 3])
    length, unit = data.own_units
    turned_back = np.isfinite(seen).all(1) & (seen[:, 2] >= seen.max(1)) & (approach > 0) & (leave < 0)
    at = np.flatnonzero(turned_back & (approach - leave > REBOUND_M_PER_S * length / unit))
    # approach line through frames 0 and 1, leave line through 3 and 4
    later = time[at, 3] - time[at, 1]
    way = (seen[at, 3] - seen[at, 1] - leave[at] * later) / (approach[at] - leave[at])
    # Where the lines are then, not how far: the wall is curved.
    before = relative[at + 1] + (relative[at + 1] - relative[at]) * (way / (time[at, 1] - time[at, 0]))[:, None]
    back = (later - way) / (time[at, 4] - time[at, 3])
    after = relative[at + 3] - (relative[at + 4] - relative[at + 3]) * back[:, None]
    meet = design.outline_gap(0.5 * (before + after), angle[at + 2])
    place, turn = relative[at + 2], angle[at + 2]
    c, s, h = np.cos(turn), np.sin(turn), 1e-6 * design.size_m
    slopes = [
        (design.outline_gap(place + h * np.column_stack(along), turn) - design.outline_gap(place, turn)) / h
        for along in ((c, s), (-s, c))
    ]
    return meet, np.column_stack(slopes), np.arctan2(place[:, 1], place[:, 0]), turn
