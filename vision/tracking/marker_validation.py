"""Whether a marker is where its body puts it: a disc that looks as it did, measured by the cheapest fit that serves."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vision.compiled import compiled
from vision.markers.fit import fit_discs
from vision.markers.row import (
    BY_SECTORS,
    CONTRAST,
    COVERAGE,
    M11,
    MISFIT,
    NOISE,
    OK,
    OUTLIERS,
    S11,
    S22,
    SD,
    STRUCTURED,
    U,
    V,
    determinant,
)
from vision.markers.sector_fit import fit_by_sectors

Floats = NDArray[np.float64]

_FAR_RADIUS = 0.13  # relative change of a marker's radius from frame to frame that is no longer the same disc
# The same where another edge runs through and the marker's size is known: a disc that is gradually covered shrinks.
_FAR_COVERED = 0.05
# A blur that jumps is a shadow's edge taken for the disc's: times the squared blur of before, plus px^2.
_MORE_BLUR, _MORE_BLUR_PX2 = 3.0, 3.0
_LEAST_COVERAGE = 0.9  # share of the window inside the picture
# Rms at the edge: over contrast, over noise, and whole grey levels.
_MAX_MISFIT, _MISFIT_NOISE, _MISFIT_GREY = 0.15, 2.0, 1.0
_ALL_BUT = 0.05  # share of sectors left out that may be chance
_ITERATIONS = 8  # more help no disc that is there: with 12 a film's tracks were the same to 7e-5 px in the mean
_TOLERANCE_PX = 0.001
# Edge residual over noise, plus grey levels of rounding, from which shape and blur of an earlier frame no longer serve.
_STALE_SHAPE, _STALE_GREY = 1.12, 0.3
# Pixels that show at a glance that no disc is there: a ring about it, and its middle (radii, px); in ascending order
# the one of the ring and the one of the middle that are compared, and the share of the contrast that is none.
_RING, _RING_RADII, _RING_PX, _RING_QUARTER = 16, 1.3, 1.5, 3
_MIDDLE, _MIDDLE_RADII, _MIDDLE_BEST = 9, 0.5, 7
_NO_CONTRAST = 0.1


@compiled
def _most_blur_px2(start: Floats) -> float:
    """Squared blur that the disc may have next."""
    return _MORE_BLUR * max(start[S11], start[S22]) + _MORE_BLUR_PX2


@compiled
def _same_disc(start: Floats, fit: Floats, sized: bool) -> bool:
    """Whether a fit is the disc it was started on: converged, as large, of the same polarity, its edge described."""
    if fit[OK] == 0.0 or fit[COVERAGE] < _LEAST_COVERAGE:
        return False
    change = (determinant(start) / determinant(fit)) ** 0.25
    if (
        abs(change - 1.0) > (_FAR_COVERED if sized and fit[OUTLIERS] >= STRUCTURED else _FAR_RADIUS)
        or fit[CONTRAST] * start[CONTRAST] < 0.0
    ):
        return False
    if max(fit[S11], fit[S22]) > _most_blur_px2(start):
        return False
    return fit[MISFIT] <= _MAX_MISFIT * abs(fit[CONTRAST]) + _MISFIT_NOISE * fit[NOISE] + _MISFIT_GREY


@compiled
def nothing_there(image: NDArray[Any], start: Floats, u: float, v: float) -> bool:
    """Whether no disc of the start's polarity can be at (u, v): then four kinds of fits need not find that out.

    Generous: the middle, against the quarter of its surroundings that lets it stand out most, shows a tenth of the
    contrast neither here nor half a radius beside.
    """
    r = determinant(start) ** -0.25
    sign = 1.0 if start[CONTRAST] > 0.0 else -1.0
    height, width = image.shape
    ring, middle = np.empty(_RING), np.empty(_MIDDLE)
    far = _RING_RADII * r + _RING_PX
    for k in range(_RING):
        angle = 2 * math.pi * k / _RING
        i, j = round(v + far * math.sin(angle)), round(u + far * math.cos(angle))
        if not (0 <= i < height and 0 <= j < width):
            return False
        ring[k] = sign * image[i, j]
    ring.sort()
    for k in range(_MIDDLE):
        far = _MIDDLE_RADII * r if k else 0.0
        i, j = round(v + far * math.sin(0.25 * math.pi * k)), round(u + far * math.cos(0.25 * math.pi * k))
        if not (0 <= i < height and 0 <= j < width):
            return False
        middle[k] = sign * image[i, j]
    middle.sort()
    return middle[_MIDDLE_BEST] - ring[_RING_QUARTER] < _NO_CONTRAST * abs(start[CONTRAST])


@compiled
def _sectors_first(start: Floats, hold_shape: bool, sized: bool) -> bool:
    """Last seen across an edge, where the plain model fails; of known size it waits until no sector crosses the edge
    any more.
    """
    return start[OUTLIERS] >= BY_SECTORS and (hold_shape or (sized and start[OUTLIERS] > BY_SECTORS + _ALL_BUT))


@compiled
def find(image: NDArray[Any], start: Floats, hold_shape: bool, sized: bool, fit: Floats) -> bool:
    """Fit the marker that looked like `start` from where fit (1, 20) puts it, as it looked; whether it is there.

    `sized`: the start's shape is that of a marker whose size is known, and may be relied upon.
    """
    u, v = fit[0, U], fit[0, V]
    if _sectors_first(start, hold_shape, sized):
        fit[0] = fit_by_sectors(image, fit[0], True)
        if _same_disc(start, fit[0], sized):
            return True
        # What spoils so many sectors spoils the plain model first; now and then it is tried all the same.
        if hold_shape:
            return False
        fit[0] = start
        fit[0, U], fit[0, V] = u, v
    held = hold_shape and start[MISFIT] < _STALE_SHAPE * start[NOISE] + _STALE_GREY
    while True:
        fit[:] = fit_discs(image, fit, _ITERATIONS, _TOLERANCE_PX, held, _most_blur_px2(start))
        least = _STALE_SHAPE * min(fit[0, NOISE], start[NOISE]) + _STALE_GREY
        if not held or (fit[0, OK] > 0.0 and fit[0, MISFIT] <= least):
            break
        held = False
        fit[0] = start
        fit[0, U], fit[0, V] = u, v
    if not _same_disc(start, fit[0], sized):
        return False
    if fit[0, OUTLIERS] >= STRUCTURED:  # another edge runs through: the sectors without it may know better
        again = fit[0].copy()
        if sized:
            again[M11:S11] = start[M11:S11]
        again = fit_by_sectors(image, again, sized)
        if _same_disc(start, again, sized) and again[SD] < fit[0, SD]:
            fit[0] = again
    return True


@compiled
def find_though_covered(image: NDArray[Any], start: Floats, hold_shape: bool, sized: bool, fit: Floats) -> bool:
    """As `find`, where that failed: in a shadow's edge a shape fitted freely goes astray, so the known one is kept, or
    the sectors are fitted.
    """
    if hold_shape and _sectors_first(start, hold_shape, sized):
        return False  # `find` has tried them
    u, v = fit[0, U], fit[0, V]
    known = start[OK] > 0.0
    if known:
        fit[:] = fit_discs(image, fit, _ITERATIONS, _TOLERANCE_PX, known, _most_blur_px2(start))
        if _same_disc(start, fit[0], sized):
            return True
        if _sectors_first(start, hold_shape, sized):
            return False  # `find` has tried them
    fit[0] = start
    fit[0, U], fit[0, V] = u, v
    fit[0] = fit_by_sectors(image, fit[0], known)
    return _same_disc(start, fit[0], sized)
