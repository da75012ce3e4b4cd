"""Flights as stretches of frames: between kinks and contacts, long ones in pieces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.flights.cutting.run_data import RunData

Array = NDArray[np.float64]

# Fewer frames between two kinks are no flight of their own: three leave one number besides place and velocity, and hops
# that short hold impacts.
FEWEST_FRAMES = 4
# Unseen frames that a flight bridges: with a fit on both sides its path is known as well as where it is seen.
LONGEST_HOLE = 6
# A Host's overtone known to 0.2 um leaves the mean speed of a disk that slides to and fro open by 40 um/s, which no
# covariance of a flight holds: over this time it stays near the cameras' noise, and impacts under a strong drive are
# closer (the rig's own seconds).
LONGEST_FLIGHT_S = 0.15
FEWEST_IN_PIECE = 8
# A frame that lies on the cut between pieces exactly would change sides with the clock's rounding; none lies so much of
# a frame beside it.
BESIDE_FRAMES = 0.3
# Frames of a piece at the most: its errors are weighed all against all.
MOST_IN_PIECE = 150


@dataclass(frozen=True, eq=False)
class Flight:
    """Frames ``first..last`` of free flight; ``joined``: the next flight starts where this one ends, at an impact;
    ``goes_on``: the next is the same flight, cut for its length."""

    first: int
    last: int
    joined: bool
    goes_on: bool = False


def flights_from_segments(
    seen: NDArray[np.bool_],
    gaps: Sequence[int],
    contact: NDArray[np.int64],
    longest_hole: int = LONGEST_HOLE,
    fewest: int = FEWEST_FRAMES,
) -> list[Flight]:
    """Flights between kinks, contact stretches and holes of more than ``longest_hole`` unseen frames; too short ones
    are dropped.
    """
    pieces = _stretches(seen, gaps, contact, longest_hole)
    flights: list[Flight] = []
    for k, (first, last, joined) in enumerate(pieces):
        frames = np.count_nonzero(seen[first : last + 1])
        if frames >= fewest:
            flights.append(Flight(first, last, joined and k + 1 < len(pieces)))
            continue
        # A single frame between two kinks was exposed across an impact: the flights on both sides still meet there.
        # (A real flight that short means impacts below 0.1 m/s, which are not looked for.)
        smeared = frames <= 1 and joined and last - first <= 1
        if flights and not smeared:
            flights[-1] = Flight(flights[-1].first, flights[-1].last, False)
    return flights


def _stretches(
    seen: NDArray[np.bool_], gaps: Sequence[int], contact: NDArray[np.int64], longest_hole: int
) -> list[tuple[int, int, bool]]:
    """First and last frame of each stretch between kinks, contact and holes, however short, and whether the next one
    begins at the kink where it ends."""
    n = len(seen)
    blocked = np.zeros(n, bool)
    for first, last in contact:
        blocked[first : last + 1] = True
    cuts = {int(g) for g in gaps}
    pieces: list[tuple[int, int, bool]] = []
    start: int | None = None
    last_seen = -1
    for i in range(n):
        if blocked[i]:
            if start is not None:
                pieces.append((start, last_seen, False))
                start = None
            continue
        if seen[i]:
            if start is not None and i - last_seen > longest_hole + 1:
                pieces.append((start, last_seen, False))
                start = i
            start = i if start is None else start
            last_seen = i
        if i in cuts and start is not None:
            pieces.append((start, last_seen, i + 1 < n and not blocked[i + 1]))
            start = None
    if start is not None:
        pieces.append((start, last_seen, False))
    return pieces


def shortened(flights: Sequence[Flight], time_s: Array, seen: NDArray[np.bool_]) -> list[Flight]:
    """``flights`` with those longer than :data:`LONGEST_FLIGHT_S` cut into pieces, each of which is fitted by itself;
    ``time_s`` (N,) in the rig's own seconds.
    """
    pieces: list[Flight] = []
    for flight in flights:
        frames = np.flatnonzero(seen[flight.first : flight.last + 1]) + flight.first
        # From its first frame on: what is filmed after it changes nothing about how a flight begins.
        beside_s = BESIDE_FRAMES * (time_s[flight.last] - time_s[flight.first]) / max(flight.last - flight.first, 1)
        piece = np.floor((time_s[frames] - time_s[flight.first] + beside_s) / LONGEST_FLIGHT_S).astype(int)
        piece = np.maximum(piece, np.arange(len(frames)) // MOST_IN_PIECE)
        parts = [part for part in np.split(frames, np.flatnonzero(np.diff(piece)) + 1) if len(part)]
        while len(parts) > 1 and len(parts[-1]) < FEWEST_IN_PIECE:
            parts[-2:] = [np.concatenate(parts[-2:])]
        pieces += [Flight(int(part[0]), int(part[-1]), False, goes_on=True) for part in parts[:-1]]
        pieces.append(replace(flight, first=int(parts[-1][0]) if len(parts) > 1 else flight.first))
    return pieces


def seen_frames(run: RunData, flight: Flight) -> NDArray[np.int64]:
    """Numbers of a flight's frames in which the NES was seen."""
    index = np.arange(flight.first, flight.last + 1)
    return index[np.isfinite(run.xy_m[index, 0])]
