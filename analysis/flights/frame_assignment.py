"""Frames that a fitted flight denies: wrong points are set aside, a frame on the wrong side of an impact changes sides.

The cutting (:mod:`analysis.flights.cutting`) places an impact between two frames; one a hundredth of a frame past it
may count to either side. There it pulls at the end of a flight, where the velocities at the impact are read off.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from analysis.flights.cutting.pieces import Flight, seen_frames
from analysis.flights.cutting.run_data import RunData
from analysis.flights.cutting.runs import Run
from analysis.flights.fit import FlightFits

Array = NDArray[np.float64]

# A frame is denied from here: none of 600 frames x 3 by chance, even where neighbours' errors are correlated.
DENIED_SD = 6.0
# The other side must do this much better to get it.
ACCEPTED_SD = 4.0
# More denied frames than this in a flight are a hidden impact or a wrong law, not wrong points.
MOST_DENIED_SHARE = 0.12
# A flight keeps so many frames: nine places and angles for its six unknowns.
FEWEST_FRAMES = 3


def settled(run: Run, fits: FlightFits) -> Run | None:
    """``run`` with frames set aside or moved to the neighbouring flight; None where nothing changes."""
    flights, aside = list(fits.flights), []
    seen = np.isfinite(run.data.xy_m[:, 0])
    for k, flight in enumerate(fits.flights):
        index = seen_frames(fits.run, flight)
        denied = index[_misfit(fits, k, index) > DENIED_SD]
        if not 0 < len(denied) <= max(1.0, MOST_DENIED_SHARE * len(index)):
            continue
        for frame in denied:
            if frame == index[-1] and flight.joined and _accepts(fits, k + 1, frame):
                flights[k], flights[k + 1] = (
                    replace(flights[k], last=int(index[-2])),
                    replace(flights[k + 1], first=int(frame)),
                )
            elif frame == index[0] and k > 0 and fits.flights[k - 1].joined and _accepts(fits, k - 1, frame):
                flights[k], flights[k - 1] = (
                    replace(flights[k], first=int(index[1])),
                    replace(flights[k - 1], last=int(frame)),
                )
            else:
                aside.append(int(frame))
    if flights == list(fits.flights) and not aside:
        return None
    return (
        replace(run, data=_without(run, aside), flights=tuple(flights))
        if all(_enough(f, seen, aside) for f in flights)
        else None
    )


def _misfit(fits: FlightFits, k: int, index: NDArray[np.int64]) -> Array:
    """Largest residual (x, y, angle) of each frame against flight k, in the noise's sd."""
    sd = np.column_stack([fits.run.xy_sd_m[index]] * 2) * fits.noise.scale
    sds = np.column_stack([sd, fits.run.angle_sd_rad[index] * fits.noise.angle_scale])
    return np.max(np.abs(fits.residuals(k, index) / sds), axis=1)


def _accepts(fits: FlightFits, k: int, frame: int) -> bool:
    return bool(_misfit(fits, k, np.array([frame]))[0] < ACCEPTED_SD)


def _without(run: Run, aside: list[int]) -> RunData:
    if not aside:
        return run.data
    xy = run.data.xy_m.copy()
    xy[aside] = np.nan
    return replace(run.data, xy_m=xy)


def _enough(flight: Flight, seen: NDArray[np.bool_], aside: list[int]) -> bool:
    remaining = seen[flight.first : flight.last + 1].copy()
    remaining[[i - flight.first for i in aside if flight.first <= i <= flight.last]] = False
    return bool(np.count_nonzero(remaining) >= FEWEST_FRAMES)
