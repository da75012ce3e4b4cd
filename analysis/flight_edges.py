"""Frames that a fitted flight denies: wrong points are set aside, a frame on the wrong side of an impact changes sides.

The cutting (:mod:`analysis.segment`) places an impact between two frames; one a hundredth of a frame past it may count to either side.
There it pulls at the end of a flight, where the velocities at the impact are read off.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from analysis.flights import WARP_POWERS, Flight, FlightFits, RunData, warp_basis
from analysis.runs import Run

Array = NDArray[np.float64]

# A frame is denied from here: none of 600 frames x 3 by chance, even where neighbours' errors are correlated.
DENIED_SD = 6.0
# The other side must do this much better to get it.
ACCEPTED_SD = 4.0
# More denied frames than this in a flight are a hidden impact or a wrong law, not wrong points.
MOST_DENIED_SHARE = 0.12


def settled(run: Run, fits: FlightFits, scale: float) -> Run | None:
    """``run`` with frames set aside or moved to the neighbouring flight; None where nothing changes.

    ``scale``: how much larger than their sds the residuals of all flights are."""
    flights, aside = list(fits.flights), []
    seen = np.isfinite(run.data.xy_m[:, 0])
    for k, flight in enumerate(fits.flights):
        index = np.arange(flight.first, flight.last + 1)
        index = index[seen[index]]
        denied = index[_misfit(fits, k, index) > DENIED_SD * max(scale, 1.0)]
        if not 0 < len(denied) <= max(1.0, MOST_DENIED_SHARE * len(index)):
            continue
        for frame in denied:
            if frame == index[-1] and flight.joined and _fits(fits, k + 1, frame, scale):
                flights[k], flights[k + 1] = replace(flights[k], last=int(index[-2])), replace(flights[k + 1], first=int(frame))
            elif frame == index[0] and k > 0 and fits.flights[k - 1].joined and _fits(fits, k - 1, frame, scale):
                flights[k], flights[k - 1] = replace(flights[k], first=int(index[1])), replace(flights[k - 1], last=int(frame))
            else:
                aside.append(int(frame))
    if flights == list(fits.flights) and not aside:
        return None
    return replace(run, data=_without(run, aside), flights=tuple(flights)) if all(_enough(f, seen, aside) for f in flights) else None


def _misfit(fits: FlightFits, k: int, index: NDArray[np.int64]) -> Array:
    """Largest standardised residual (x, y, angle) of each frame against flight k."""
    run = fits.run
    states, _ = fits.propagate(k, run.time_s[index])
    lens, n = warp_basis(run.xy_m[index], run.contact_radius_m), len(WARP_POWERS)
    c, s = np.cos(states[:, 2]), np.sin(states[:, 2])
    ox, oy = fits.shared[:2]
    x = run.xy_m[index, 0] - states[:, 0] - c * ox + s * oy - lens @ fits.shared[2:2 + n]
    y = run.xy_m[index, 1] - states[:, 1] - s * ox - c * oy - lens @ fits.shared[2 + n:]
    sd = run.xy_sd_m[index]
    return np.max(np.abs([x / sd, y / sd, (run.angle_rad[index] - states[:, 2]) / run.angle_sd_rad[index]]), axis=0)


def _fits(fits: FlightFits, k: int, frame: int, scale: float) -> bool:
    return bool(_misfit(fits, k, np.array([frame]))[0] < ACCEPTED_SD * max(scale, 1.0))


def _without(run: Run, aside: list[int]) -> RunData:
    if not aside:
        return run.data
    xy = run.data.xy_m.copy()
    xy[aside] = np.nan
    return replace(run.data, xy_m=xy)


def _enough(flight: Flight, seen: NDArray[np.bool_], aside: list[int]) -> bool:
    left = seen[flight.first:flight.last + 1].copy()
    left[[i - flight.first for i in aside if flight.first <= i <= flight.last]] = False
    return bool(np.count_nonzero(left) >= 3)
