"""Impacts that no two separate flights show: chatter before sustained contact, impacts in gaps and at the ends of a
run.

Hops of one to four frames leave too few positions for a flight of their own.  The laws found from the well-resolved
impacts predict the whole sequence from the last good flight; its start state, the restitution of every impact and the
wall's place there are then fitted to all frames of the sequence (maximum a posteriori; the restitutions' prior is the
scatter found).  A sequence that does not fit is not reported.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from analysis.contact.restitution import SpeedLaw, speed_law
from analysis.flights.cutting.runs import with_frames_in_wall
from analysis.flights.fit import FlightFits
from analysis.flights.single_flight import start_state
from analysis.identification.bounce_fit import SequenceFit
from analysis.identification.bounce_sequences import BounceSequence
from analysis.identification.fit import RigFit
from ovines.workers.threads import in_threads

Array = NDArray[np.float64]

# Flights of at least this many frames and this misfit against the usual one stand by themselves.
ANCHOR_FRAMES = 5
ANCHOR_MISFIT = 4.0
# Frames of a flight that a sequence takes along at its start and at its end.
FRAMES_BEFORE, FRAMES_AFTER = 24, 16
# A sequence is followed this long (chatter ends within it); longer stretches without a good flight cost minutes and fit
# nothing.
LONGEST_SEQUENCE_S = 0.25


def find_sequences(rig: RigFit, resolved: NDArray[np.bool_]) -> list[BounceSequence]:
    """Bounce sequences of all runs; ``resolved`` (K,) marks the junctions that are impacts beyond doubt."""
    if rig.law is None or not rig.angle or not np.isfinite(rig.law.wall_friction):
        return []
    restitution = speed_law(rig.data, rig.law)
    # A sequence explains the frames in which the disk is in the wall, too.
    every = [
        replace(fits, run=with_frames_in_wall(run, fits.run)) if run.in_wall_m is not None else fits
        for run, fits in zip(rig.runs, rig.floor.fits, strict=True)
    ]
    followed = in_threads(
        _follow,
        [
            (rig, fits, number, restitution, *window)
            for number, fits in enumerate(every)
            for window in _windows(rig, fits, number, resolved)
        ],
    )
    return [sequence for sequence in followed if sequence is not None]


def _windows(
    rig: RigFit, fits: FlightFits, number: int, resolved: NDArray[np.bool_]
) -> Iterator[tuple[int | None, int, int, int | None]]:
    """(flight to start from, first frame, last frame, next good flight) of every stretch that needs a sequence."""
    data, flights = fits.run, fits.flights
    ratio = fits.misfit / np.maximum(fits.freedom, 1)
    seen = np.isfinite(data.xy_m[:, 0])
    anchors = [
        k
        for k, f in enumerate(flights)
        if np.count_nonzero(seen[f.first : f.last + 1]) >= ANCHOR_FRAMES and ratio[k] < ANCHOR_MISFIT
    ]
    if not anchors:
        return
    junctions = rig.wall.impacts.junctions
    met = {int(k) for k in junctions.flight[(junctions.run == number) & resolved]}
    ahead = np.flatnonzero(seen[: flights[anchors[0]].first])
    contact = rig.runs[number].segments.contact
    if len(ahead) >= 2 and not any(a <= ahead[0] <= b for a, b in contact):
        yield None, int(ahead[0]), flights[anchors[0]].first, anchors[0]
    for k, following in zip(anchors, [*anchors[1:], None], strict=True):
        if following == k + 1 and (k in met or flights[k].goes_on):
            continue
        stop = flights[following].first if following is not None else int(np.flatnonzero(seen)[-1])
        if stop > flights[k].last:
            yield k, max(flights[k].first, flights[k].last - FRAMES_BEFORE), stop, following


def _follow(
    rig: RigFit,
    fits: FlightFits,
    number: int,
    restitution: SpeedLaw,
    start: int | None,
    first: int,
    stop: int,
    following: int | None,
) -> BounceSequence | None:
    data = fits.run
    furthest = max(
        int(np.searchsorted(data.time_s, data.time_s[first] + LONGEST_SEQUENCE_S, side="right")) - 1, first + 8
    )
    if stop > furthest:
        stop, following = furthest, None
    last = stop if following is None else min(fits.flights[following].last, stop + FRAMES_AFTER)
    t0 = float(data.time_s[first])
    if start is None:
        state = np.empty(6)
        few = np.flatnonzero(np.isfinite(data.xy_m[:stop, 0]))
        end = int(few[few >= first][:3][-1])
        start_state(data.time_s, data.xy_m[:, 0], data.xy_m[:, 1], data.angle_rad, first, end, t0, state)
    else:
        state = fits.propagate(start, np.array([t0]))[0][0]
    fit = SequenceFit(rig, fits, number, first, last, state, restitution)
    for end, open_end in ((last, False), (stop - 1, True)):
        sequence = fit.solve(end, open_end)
        if sequence is not None:
            return sequence
    return None
