"""Discs in a picture: found by thresholds at many levels, kept when the model of a blurred disc fits.

A single threshold fails under a lamp from one side or in a shadow band; a disc of any brightness stands out at
one of many levels, dark on light or light on dark.  Used on the whole window when a body is lost, and on the
surroundings of one that lost lock.
"""

from __future__ import annotations

import cv2
import numpy as np

from ovines.robust import residual_sd
from vision.markers.fit import fit_discs
from vision.markers.row import (
    CONTRAST,
    COVERAGE,
    LEVEL,
    M11,
    M12,
    M22,
    MISFIT,
    N_FIT,
    NOISE,
    OK,
    OUTLIERS,
    SD,
    STRUCTURED,
    U,
    V,
    disc_start,
    radius_px,
)
from vision.markers.sector_fit import fit_by_sectors

# What is looked for
SMALLEST_PX, LARGEST_PX = 2.5, 75.0  # radii; markers of 60 px are larger where they lie nearer
_AS_LARGE = 1.35  # ratio of radii up to which a disc is as large as another
_FLATTEST = 0.45  # axis ratio of a circle seen at 63 degrees
_SMALLEST_REGION_PX = 8  # side of a region that may hold a disc with its surroundings

# Outlines at many grey levels
_LEVELS = 15  # levels
_BLUR_PX, _BLUR_KERNEL = 1.1, (5, 5)  # noise makes outlines by the thousand, and they cost
_LIKE_LEVELS = (0.0, 0.5, 1.0)  # quantiles, over the discs that are known, of the levels for discs like them
_USUAL_GREYS = (0.2, 99.8)  # percentiles of a large picture between which the levels lie
_EXTREME_GREY = 20.0  # nearer to the darkest and brightest grey than this they reach all the same: a lone small disc
_THINNED, _LARGE_PX2 = 4, 4000  # every fourth row and column serves for these, of more pixels than this
_FEWEST_OUTLINE = 10  # pixels of an outline
# Squared number of an outline's pixels over area, between a small round one's and a flat ellipse's.
_ROUNDEST, _RAGGED = 10.0, 40.0
_HALF_AREA = 0.5  # share of a disc's area that its outline holds at least, at a level near its own grey
_ELLIPSE = (0.9, 1.05)  # area over that of the ellipse of the same second moments: any other shape covers less
_SAME_SEED, _SAME_SEED_PX = 0.35, 0.5  # radii, and pixels of radius, within which two outlines are one disc's

# Level and contrast of an outline, on rings (radii, px)
_RING_POINTS = 24
_OUTSIDE, _OUTSIDE_PX, _INSIDE = 1.25, 1.5, 0.35
_LEAST_CONTRAST = 5.0  # grey levels
# In parts of the noise: noise makes round blobs too, as deep as itself, and the search's blur leaves a third of it.
_NOISE_DEEP = 2.0

# What is kept
_ITERATIONS, _TOLERANCE_PX = 15, 0.01  # of a fit from an outline
_ROUND = 0.7  # axis ratio asked of a disc that only its sectors show
# Rms of a fit by sectors, which have nothing to fit but a straight edge: where that leaves more than noise (times, plus
# grey levels) the shape was another.
_SECTOR_NOISE, _SECTOR_GREY = 1.4, 0.7
_LEAST_COVERAGE = 0.9  # share of the window inside the picture
# Rms at the edge: over contrast (sharp corners and open shapes have more), over noise, and whole grey levels.
_MAX_MISFIT, _MISFIT_NOISE, _MISFIT_GREY = 0.12, 2.0, 1.0
_CARRIED_RADIUS, _CARRIED_CONTRAST = 0.7, 0.5  # parts of a disc's that one it carries may have, and has at least
_SAME_DISC = 0.3  # radii within which two fits are one disc

# Columns of a seed, an outline that may be a disc's: place and radius [px], number of its grey level, sign of contrast.
SEED_U, SEED_V, SEED_RADIUS, SEED_LEVEL, SEED_SIGN = range(5)
_N_SEED = 5


def find_discs(
    image: np.ndarray, region: tuple[int, int, int, int] | None = None, like: np.ndarray | None = None
) -> np.ndarray:
    """Fits (n, 20), columns of `vision.markers.row`, of everything disc-like in `image` or in region (u0, v0, u1, v1).

    Pixels are those of the whole picture.  Sorted by |contrast|, strongest first.  `like`: fits (m, 20) of discs as
    they looked before; only discs about as large, of their polarity and brightness are found, at a fifth of the cost
    (1.5 for 8.3 ms in 150 x 150 px with five discs).
    """
    u0, v0, u1, v1 = region or (0, 0, image.shape[1], image.shape[0])
    u0, v0, u1, v1 = max(u0, 0), max(v0, 0), min(u1, image.shape[1]), min(v1, image.shape[0])
    if min(u1 - u0, v1 - v0) < _SMALLEST_REGION_PX:
        return np.empty((0, N_FIT))
    part = image[v0:v1, u0:u1]
    grey, levels = _thresholds(part, like)
    seeds = _seeds(grey, levels, _radius_range(like))
    if like is not None:
        seeds = seeds[np.isin(seeds[:, SEED_SIGN], np.sign(like[:, CONTRAST]))]
    level, contrast = _levels(part, seeds)
    noise = _noise(part)
    clear = np.abs(contrast) > max(_LEAST_CONTRAST, _NOISE_DEEP * noise)
    seeds, level, contrast = _merge(seeds[clear], level[clear], contrast[clear])
    if not len(seeds):
        return np.empty((0, N_FIT))
    starts = np.array(
        [
            disc_start(seed[SEED_U] + u0, seed[SEED_V] + v0, seed[SEED_RADIUS], a, c)
            for seed, a, c in zip(seeds, level, contrast, strict=True)
        ]
    )
    fits = fit_discs(image, starts, _ITERATIONS, _TOLERANCE_PX)
    accepted = disc_like(fits)
    uncertain = ~accepted | (fits[:, OUTLIERS] >= STRUCTURED)
    second = np.array([fit_by_sectors(image, start, False) for start in starts[uncertain]]).reshape(-1, N_FIT)
    better = disc_like(second, _ROUND) & (second[:, NOISE] < _SECTOR_NOISE * noise + _SECTOR_GREY)
    better &= ~accepted[uncertain] | (second[:, SD] < fits[uncertain, SD])
    accepted[np.flatnonzero(uncertain)[better]] = False
    return marker_discs(_distinct(np.concatenate([fits[accepted], second[better]])))


def disc_like(fits: np.ndarray, flattest: float = _FLATTEST) -> np.ndarray:
    """Which fits (n, 20) are believable discs: converged, inside the picture, round enough, edge well described."""
    trace, det = fits[:, M11] + fits[:, M22], fits[:, M11] * fits[:, M22] - fits[:, M12] ** 2
    root = np.sqrt(np.maximum(trace**2 / 4 - det, 0))
    ratio = np.sqrt(np.maximum(trace / 2 - root, 0) / (trace / 2 + root))
    edge = _MAX_MISFIT * np.abs(fits[:, CONTRAST]) + _MISFIT_NOISE * fits[:, NOISE] + _MISFIT_GREY
    return (fits[:, OK] > 0) & (fits[:, COVERAGE] > _LEAST_COVERAGE) & (ratio > flattest) & (fits[:, MISFIT] < edge)


def marker_discs(fits: np.ndarray) -> np.ndarray:
    """Of discs, fits (n, 20), those that hold no smaller one of half their contrast: a disk that carries markers is
    found as a disc too.
    """
    if not len(fits):
        return fits
    radius, contrast = radius_px(fits), np.abs(fits[:, CONTRAST])
    apart = np.hypot(fits[:, None, U] - fits[None, :, U], fits[:, None, V] - fits[None, :, V])
    holds = (
        (apart < radius[:, None])
        & (radius[None, :] < _CARRIED_RADIUS * radius[:, None])
        & (contrast[None, :] > _CARRIED_CONTRAST * contrast[:, None])
    )
    return fits[~holds.any(1)]


def _radius_range(like: np.ndarray | None) -> tuple[float, float]:
    """Radii [px] to look for."""
    if like is None:
        return SMALLEST_PX, LARGEST_PX
    radius = radius_px(like)
    return float(radius.min() / _AS_LARGE), float(radius.max() * _AS_LARGE)


def _thresholds(part: np.ndarray, like: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """The picture in 8 bit, a little blurred, and the grey levels of its outlines."""
    scale, least = 1.0, 0.0
    grey = part
    if part.dtype != np.uint8:
        least = float(part.min())
        scale = 255.0 / max(float(part.max()) - least, 1.0)
        grey = cv2.convertScaleAbs(part, alpha=scale, beta=-least * scale)
    grey = cv2.GaussianBlur(grey, _BLUR_KERNEL, _BLUR_PX)
    if like is not None:
        middle = (like[:, LEVEL] + 0.5 * like[:, CONTRAST] - least) * scale
        return grey, np.unique(np.quantile(middle, _LIKE_LEVELS).round())
    low, high = float(grey.min()), float(grey.max())
    if grey.size > _LARGE_PX2:
        low, high = np.percentile(grey[::_THINNED, ::_THINNED], _USUAL_GREYS)
    low, high = min(low, float(grey.min()) + _EXTREME_GREY), max(high, float(grey.max()) - _EXTREME_GREY)
    return grey, np.linspace(low, high, _LEVELS + 2)[1:-1]


def _seeds(grey: np.ndarray, levels: np.ndarray, radius_range_px: tuple[float, float]) -> np.ndarray:
    """Seeds (n, _N_SEED): round closed outlines at the grey levels."""
    least, most = np.pi * radius_range_px[0] ** 2 * _HALF_AREA, np.pi * radius_range_px[1] ** 2
    found = []
    for index, level in enumerate(levels):
        _, binary = cv2.threshold(grey, level, 255, cv2.THRESH_BINARY)
        contours, hierarchy = cv2.findContours(binary, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
        for contour, links in zip(contours, hierarchy[0] if hierarchy is not None else (), strict=True):
            n = len(contour)
            # Far cheaper than the area, and most outlines end here.
            if n < _FEWEST_OUTLINE or n * n < _ROUNDEST * least or n * n > _RAGGED * most:
                continue
            area = cv2.contourArea(contour)
            if not least < area < most:
                continue
            moments = cv2.moments(contour)
            a = moments["m00"]
            uu, vv, uv = moments["mu20"] / a, moments["mu02"] / a, moments["mu11"] / a
            det = uu * vv - uv * uv
            # An ellipse's area is 4 pi sqrt(det of its second moments).
            if det <= 0 or not _ELLIPSE[0] < a / (4 * np.pi * np.sqrt(det)) < _ELLIPSE[1]:
                continue
            half, root = 0.5 * (uu + vv), np.sqrt(0.25 * (uu - vv) ** 2 + uv * uv)
            if half - root < _FLATTEST**2 * (half + root):
                continue
            hole = links[3] >= 0
            found.append((moments["m10"] / a, moments["m01"] / a, 2 * det**0.25, index, -1.0 if hole else 1.0))
    return np.array(found).reshape(-1, _N_SEED)


def _merge(seeds: np.ndarray, level: np.ndarray, contrast: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """One seed per place, size and polarity; the middle one of those found at several levels."""
    kept = []
    left = np.arange(len(seeds))
    while len(left):
        first, others = seeds[left[0]], seeds[left]
        apart = np.hypot(others[:, SEED_U] - first[SEED_U], others[:, SEED_V] - first[SEED_V])
        larger = np.abs(others[:, SEED_RADIUS] - first[SEED_RADIUS])
        same = (
            (apart < _SAME_SEED * first[SEED_RADIUS])
            & (larger < _SAME_SEED * first[SEED_RADIUS] + _SAME_SEED_PX)
            & (others[:, SEED_SIGN] == first[SEED_SIGN])
        )
        group = left[same]
        kept.append(group[len(group) // 2])
        left = left[~same]
    index = np.array(kept, int)
    return seeds[index], level[index], contrast[index]


def _noise(part: np.ndarray) -> float:
    """Grey-level noise: robust spread of second differences of every fourth row (structure has few of them)."""
    rows = part[::4].astype(np.int32)
    second = rows[:, :-2] - 2 * rows[:, 1:-1] + rows[:, 2:]
    return residual_sd(second) / float(np.sqrt(6.0))


def _levels(image: np.ndarray, seeds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Background level and contrast (n,) of seeds, from a ring about each and its middle."""
    height, width = image.shape
    angle = np.linspace(0, 2 * np.pi, _RING_POINTS, endpoint=False)

    def mean_on(factor: float, extra: float, middle: bool) -> np.ndarray:
        reach = (factor * seeds[:, SEED_RADIUS] + extra)[:, None]
        u = np.clip(np.rint(seeds[:, SEED_U, None] + reach * np.cos(angle)), 0, width - 1).astype(int)
        v = np.clip(np.rint(seeds[:, SEED_V, None] + reach * np.sin(angle)), 0, height - 1).astype(int)
        return image[v, u].mean(1) if middle else np.median(image[v, u], axis=1)

    level = mean_on(_OUTSIDE, _OUTSIDE_PX, False)
    return level, mean_on(_INSIDE, 0.0, True) - level


def _distinct(fits: np.ndarray) -> np.ndarray:
    """Drop what was found twice (the same place and size), keeping the better described edge."""
    order = np.argsort(fits[:, MISFIT] / np.abs(fits[:, CONTRAST]))
    kept: list[np.ndarray] = []
    for fit in fits[order]:
        r = radius_px(fit)
        if all(
            np.hypot(fit[U] - k[U], fit[V] - k[V]) > _SAME_DISC * r or abs(radius_px(k) - r) > _SAME_DISC * r
            for k in kept
        ):
            kept.append(fit)
    kept.sort(key=lambda fit: -abs(fit[CONTRAST]))
    return np.array(kept).reshape(-1, N_FIT)
