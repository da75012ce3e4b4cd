"""Dot grids with three ring-shaped dots that mark origin and directions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from vision.calibration.targets.boards import Board
from vision.markers.fit import fit_discs
from vision.markers.row import CONTRAST, MISFIT, N_FIT, SD, U, V, disc_start
from vision.markers.shared_shape import sd_without_shared_shape

Array = NDArray[np.float64]
Blob = tuple[Sequence[float], float]  # centre (u, v), radius
# rms at the edge over contrast: 0.12 on the aliased, simulated dots of stereo_dots, whose centres are still good
# to 0.005 px; a dot cut by the image border or with a scratch has more
WORST_MISFIT = 0.25
FEWEST_DOTS, FEWEST_NUMBERED = 8, 6  # found, and numbered from the rings on
MOST_MOVED_PX = 1.5  # of a fit from its outline: farther it is another dot's
# Of an outline: pixels, area [px^2], axis ratio, difference of its area from the ellipse's; hole's share of it that
# makes a ring; sizes over the median dot's.
FEWEST_OUTLINE, LEAST_AREA_PX2, FLATTEST, UNELLIPTIC, LEAST_HOLE, SIZES = 12, 40, 0.3, 0.2, 0.05, (0.5, 2.0)
REACHES = (0.25, 0.3, 0.3, 0.3)  # pitches within which a dot is a grid point's, as the mapping is refined
LEAST_NUMBERED = 0.6  # share of the board's dots
BESIDE, PAPER_PERCENTILE = 1.4, 90  # radii around a dot, and percentile there, that show the paper
LIGHT_BLUR = 0.25  # of the light's width
LIGHT_PX = 640  # longer side of the picture in which the light is looked for: it is smooth
# Widths over the image's shorter side: a dot must be narrower, the light's own changes wider.
LIGHT_SHARES = (0.06, 0.15, 0.35)
FLAT_GREY = 220.0  # of the paper, once its light is taken out
NOTHING = (np.empty(0, np.int64), np.empty((0, N_FIT)))


def detect_dots(image: NDArray[np.uint8], board: Board) -> tuple[NDArray[np.int64], Array]:
    """Numbers of the full dots and their fits (``vision.markers.fit.fit_discs`` rows); nothing when the rings are not
    seen.

    The rings only show which dot is which: a ring's two edges make its centre less exact, so it is left out.
    """
    for lit in lights(image):
        dots, rings = dark_blobs(lit)
        placed = None
        if len(rings) == 3 and len(dots) >= FEWEST_DOTS:
            placed = _number(np.array([d[0] for d in dots]), np.array([r[0] for r in rings]), board)
        if placed is not None:
            break
    else:
        return NOTHING
    return fit_dots(image, [(number, dots[k]) for k, number in enumerate(placed) if number >= 0])


def fit_dots(image: NDArray[np.uint8], chosen: Sequence[tuple[int, Blob]]) -> tuple[NDArray[np.int64], Array]:
    """Numbers and fits of the numbered outlines that are dots."""
    starts = []
    for _, ((u, v), radius) in chosen:
        level, middle = _levels(image, u, v, radius)
        starts.append(disc_start(u, v, radius, level, middle - level))
    image = np.ascontiguousarray(image)
    fits = fit_discs(image, np.asarray(starts))
    # A print is no marker in the dark: what counts is a fit that ended (it has an sd) near its start with good
    # contrast.
    moved = np.hypot(*(fits[:, [U, V]] - np.asarray(starts)[:, [U, V]]).T)
    good = (fits[:, SD] > 0) & (fits[:, MISFIT] < WORST_MISFIT * np.abs(fits[:, CONTRAST])) & (moved < MOST_MOVED_PX)
    fits = fits[good]
    fits[:, SD] = sd_without_shared_shape(image, fits)
    return np.array([number for number, _ in chosen])[good], fits


def lights(image: NDArray[np.uint8]) -> Iterator[NDArray[np.uint8]]:
    """The image, then the image over its own light: one threshold does for a grid under a lamp from one side no other
    way.

    The light is the brightest grey around, as wide as a dot and its neighbourhood at least; dots of several sizes are
    tried.
    """
    yield image
    scale = max(1.0, max(image.shape) / LIGHT_PX)
    small = cv2.resize(image, None, fx=1 / scale, fy=1 / scale, interpolation=cv2.INTER_AREA)
    for share in LIGHT_SHARES:
        side = 2 * int(0.5 * share * min(small.shape)) + 1
        light = cv2.morphologyEx(small, cv2.MORPH_CLOSE, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side)))
        light = cv2.resize(
            cv2.GaussianBlur(light, (0, 0), LIGHT_BLUR * side), image.shape[::-1], interpolation=cv2.INTER_LINEAR
        )
        yield np.asarray(cv2.divide(image, light, scale=FLAT_GREY), np.uint8)


def dark_blobs(image: NDArray[np.uint8]) -> tuple[list[Blob], list[Blob]]:
    """Dark ellipses (centre, radius) without and with a hole."""
    _level, binary = cv2.threshold(image, 0, 255, cv2.THRESH_BINARY_INV | cv2.THRESH_OTSU)
    contours, tree = cv2.findContours(binary, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    dots: list[Blob] = []
    rings: list[Blob] = []
    if tree is None:
        return dots, rings
    for contour, (_, _, child, parent) in zip(contours, tree[0], strict=True):
        area = cv2.contourArea(contour)
        if parent >= 0 or len(contour) < FEWEST_OUTLINE or area < LEAST_AREA_PX2:
            continue
        centre, axes, _ = cv2.fitEllipse(contour)
        # an ellipse fills pi a b; the grid's dots do, scratches and frames do not
        if min(axes) < FLATTEST * max(axes) or abs(area / (0.25 * np.pi * axes[0] * axes[1]) - 1) > UNELLIPTIC:
            continue
        hole = child >= 0 and cv2.contourArea(contours[child]) > LEAST_HOLE * area
        (rings if hole else dots).append((centre, 0.25 * (axes[0] + axes[1])))
    middle = np.median([r for _, r in dots]) if dots else 0.0
    return [d for d in dots if SIZES[0] * middle < d[1] < SIZES[1] * middle], rings


def _number(dots_px: Array, rings_px: Array, board: Board) -> NDArray[np.int64] | None:
    """Which grid point each dot is (-1: none), from the rings outwards; None when no order of the rings fits."""
    grid = board.points_m()[:, :2] / board.square_size_m
    rings = np.asarray(board.rings, float)
    best, best_seen = None, 0
    for order in ((0, 1, 2), (0, 2, 1), (1, 0, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0)):
        picked = rings_px[list(order)]
        if _turn(picked) * _turn(rings) <= 0:  # a face seen from the front is not mirrored
            continue
        affine = cv2.getAffineTransform(rings.astype(np.float32), picked.astype(np.float32))
        mapping = np.vstack([affine, [0, 0, 1]])
        numbers = np.full(len(dots_px), -1)
        for reach in REACHES:
            predicted = cv2.perspectiveTransform(grid[None].astype(np.float64), mapping)[0]
            pitch = np.sqrt(abs(np.linalg.det(affine[:, :2])))
            distance = np.linalg.norm(dots_px[:, None] - predicted[None], axis=-1)
            nearest = distance.argmin(1)
            numbers = np.where(
                (distance.min(1) < reach * pitch) & (distance.argmin(0)[nearest] == np.arange(len(dots_px))),
                nearest,
                -1,
            )
            known = numbers >= 0
            if known.sum() < FEWEST_NUMBERED:
                break
            mapping, _ = cv2.findHomography(
                np.concatenate([grid[numbers[known]], rings]), np.concatenate([dots_px[known], picked])
            )
            if mapping is None:
                break
        if (numbers >= 0).sum() > best_seen:
            best, best_seen = numbers, int((numbers >= 0).sum())
    return best if best_seen >= LEAST_NUMBERED * (len(grid) - len(rings)) else None


def _turn(triangle: Array) -> float:
    (ax, ay), (bx, by) = triangle[1] - triangle[0], triangle[2] - triangle[0]
    return float(ax * by - ay * bx)


def _levels(image: NDArray[np.uint8], u: float, v: float, radius: float) -> tuple[float, float]:
    """Grey beside the dot and in its middle."""
    rows, columns = image.shape
    reach = int(BESIDE * radius) + 1
    patch = image[
        max(0, int(v) - reach) : min(rows, int(v) + reach + 1),
        max(0, int(u) - reach) : min(columns, int(u) + reach + 1),
    ]
    return float(np.percentile(patch, PAPER_PERCENTILE)), float(image[round(v), round(u)])
