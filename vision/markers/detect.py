"""Discs in a picture: found by thresholds at many levels, kept when the model of a blurred disc fits.

A single threshold fails under a lamp from one side or in a shadow band; a disc of any brightness stands out at
one of many levels, dark on light or light on dark.  Used on the whole window when a body is lost, and on the
surroundings of one that jumped.
"""

from __future__ import annotations

import cv2
import numpy as np

from vision.markers.fit import (
    CONTRAST,
    COVERAGE,
    LEVEL,
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
    fit_discs,
    radius_px,
)
from vision.markers.sector_fit import fit_by_sectors

_LEVELS = 15
_SMALLEST_PX, _LARGEST_PX = 2.5, 75.0  # markers of 60 px are larger where they lie nearer
_AS_LARGE = 1.35  # ratio of radii up to which a disc is as large as another
_FLATTEST = 0.45  # axis ratio of a circle seen at 63 degrees
_ROUND = 0.7  # axis ratio asked of a disc that only its sectors show
_MAX_MISFIT = 0.12  # rms at the edge over contrast; sharp corners and open shapes have more


def find_discs(
    image: np.ndarray, region: tuple[int, int, int, int] | None = None, like: np.ndarray | None = None
) -> np.ndarray:
    """Fits (n, 20), see `centre.fit_discs`, of everything disc-like in `image` or in region (u0, v0, u1, v1).

    Pixels are those of the whole picture.  Sorted by |contrast|, strongest first.  `like`: fits (m, 20) of discs as
    they looked before; only discs about as large, of their polarity and brightness are found, at a fifth of the cost
    (1.5 for 8.3 ms in 150 x 150 px with five discs).
    """
    u0, v0, u1, v1 = region or (0, 0, image.shape[1], image.shape[0])
    u0, v0, u1, v1 = max(u0, 0), max(v0, 0), min(u1, image.shape[1]), min(v1, image.shape[0])
    if u1 - u0 < 8 or v1 - v0 < 8:
        return np.empty((0, N_FIT))
    part = image[v0:v1, u0:u1]
    grey, levels = _thresholds(part, like)
    seeds = _seeds(grey, levels, _radius_range(like))
    if like is not None:
        seeds = seeds[np.isin(seeds[:, 4], np.sign(like[:, CONTRAST]))]
    level, contrast = _levels(part, seeds)
    # Noise makes round blobs too, as deep as itself: the search's blur leaves a third of it.
    noise = _noise(part)
    seen = np.abs(contrast) > max(5.0, 2.0 * noise)
    seeds, level, contrast = _merge(seeds[seen], level[seen], contrast[seen])
    if not len(seeds):
        return np.empty((0, N_FIT))
    starts = np.array(
        [
            disc_start(seed[0] + u0, seed[1] + v0, seed[2], a, c)
            for seed, a, c in zip(seeds, level, contrast, strict=True)
        ]
    )
    fits = fit_discs(image, starts, 15, 0.01)
    good = disc_like(fits)
    doubtful = ~good | (fits[:, OUTLIERS] >= STRUCTURED)
    second = np.array([fit_by_sectors(image, start, False) for start in starts[doubtful]]).reshape(-1, N_FIT)
    # A sector has nothing to fit but a straight edge: where that leaves more than noise, the shape was another.
    better = disc_like(second, _ROUND) & (second[:, NOISE] < 1.4 * noise + 0.7)
    better &= ~good[doubtful] | (second[:, SD] < fits[doubtful, SD])
    good[np.flatnonzero(doubtful)[better]] = False
    return marker_discs(_distinct(np.concatenate([fits[good], second[better]])))


def disc_like(fits: np.ndarray, flattest: float = _FLATTEST) -> np.ndarray:
    """Which fits (n, 20) are believable discs: converged, inside the picture, round enough, edge well described."""
    trace, det = fits[:, 2] + fits[:, 4], fits[:, 2] * fits[:, 4] - fits[:, 3] ** 2
    root = np.sqrt(np.maximum(trace**2 / 4 - det, 0))
    ratio = np.sqrt(np.maximum(trace / 2 - root, 0) / (trace / 2 + root))
    return (
        (fits[:, OK] > 0)
        & (fits[:, COVERAGE] > 0.9)
        & (ratio > flattest)
        & (fits[:, MISFIT] < _MAX_MISFIT * np.abs(fits[:, CONTRAST]) + 2.0 * fits[:, NOISE] + 1.0)
    )


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
        & (radius[None, :] < 0.7 * radius[:, None])
        & (contrast[None, :] > 0.5 * contrast[:, None])
    )
    return fits[~holds.any(1)]


def _radius_range(like: np.ndarray | None) -> tuple[float, float]:
    """Radii [px] to look for."""
    if like is None:
        return _SMALLEST_PX, _LARGEST_PX
    radius = radius_px(like)
    return float(radius.min() / _AS_LARGE), float(radius.max() * _AS_LARGE)


def _thresholds(part: np.ndarray, like: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """The picture in 8 bit, a little blurred, and grey levels at which outlines are sought in it."""
    scale, least = 1.0, 0.0
    grey = part
    if part.dtype != np.uint8:
        least = float(part.min())
        scale = 255.0 / max(float(part.max()) - least, 1.0)
        grey = cv2.convertScaleAbs(part, alpha=scale, beta=-least * scale)
    grey = cv2.GaussianBlur(grey, (5, 5), 1.1)  # noise makes outlines by the thousand, and they cost
    if like is not None:
        middle = (like[:, LEVEL] + 0.5 * like[:, CONTRAST] - least) * scale
        return grey, np.unique(np.quantile(middle, (0.0, 0.5, 1.0)).round())
    low, high = np.percentile(grey[::4, ::4], (0.2, 99.8)) if grey.size > 4000 else (grey.min(), grey.max())
    low, high = min(low, float(grey.min()) + 20), max(high, float(grey.max()) - 20)
    return grey, np.linspace(low, high, _LEVELS + 2)[1:-1]


def _seeds(grey: np.ndarray, levels: np.ndarray, radius_range_px: tuple[float, float]) -> np.ndarray:
    """(n, 5) u, v, radius, level index and polarity of round closed outlines at the grey levels."""
    least, most = np.pi * radius_range_px[0] ** 2 * 0.5, np.pi * radius_range_px[1] ** 2
    found = []
    for index, level in enumerate(levels):
        _, binary = cv2.threshold(grey, level, 255, cv2.THRESH_BINARY)
        contours, hierarchy = cv2.findContours(binary, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
        for contour, links in zip(contours, hierarchy[0] if hierarchy is not None else (), strict=True):
            n = len(contour)
            if n < 10 or n * n < 10 * least or n * n > 40 * most:  # far cheaper than the area
                continue
            area = cv2.contourArea(contour)
            if not least < area < most:
                continue
            moments = cv2.moments(contour)
            a = moments["m00"]
            uu, vv, uv = moments["mu20"] / a, moments["mu02"] / a, moments["mu11"] / a
            det = uu * vv - uv * uv
            # An ellipse's area is 4 pi sqrt(det of its second moments): any other shape covers less.
            if det <= 0 or not 0.9 < a / (4 * np.pi * np.sqrt(det)) < 1.05:
                continue
            half, root = 0.5 * (uu + vv), np.sqrt(0.25 * (uu - vv) ** 2 + uv * uv)
            if half - root < _FLATTEST**2 * (half + root):
                continue
            hole = links[3] >= 0
            found.append((moments["m10"] / a, moments["m01"] / a, 2 * det**0.25, index, -1.0 if hole else 1.0))
    return np.array(found).reshape(-1, 5)


def _merge(seeds: np.ndarray, level: np.ndarray, contrast: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """One seed per place, size and polarity; the middle one of those found at several levels."""
    kept = []
    left = np.arange(len(seeds))
    while len(left):
        first, others = seeds[left[0]], seeds[left]
        same = (
            (np.hypot(others[:, 0] - first[0], others[:, 1] - first[1]) < 0.35 * first[2])
            & (np.abs(others[:, 2] - first[2]) < 0.35 * first[2] + 0.5)
            & (others[:, 4] == first[4])
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
    return float(1.4826 * np.median(np.abs(second)) / np.sqrt(6.0))


def _levels(image: np.ndarray, seeds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Background level and contrast (n,) of discs (n, 3+) u, v, radius, from a ring about each and its middle."""
    height, width = image.shape
    angle = np.linspace(0, 2 * np.pi, 24, endpoint=False)

    def mean_on(factor: float, extra: float, middle: bool) -> np.ndarray:
        reach = (factor * seeds[:, 2] + extra)[:, None]
        u = np.clip(np.rint(seeds[:, 0, None] + reach * np.cos(angle)), 0, width - 1).astype(int)
        v = np.clip(np.rint(seeds[:, 1, None] + reach * np.sin(angle)), 0, height - 1).astype(int)
        return image[v, u].mean(1) if middle else np.median(image[v, u], axis=1)

    level = mean_on(1.25, 1.5, False)
    return level, mean_on(0.35, 0.0, True) - level


def _distinct(fits: np.ndarray) -> np.ndarray:
    """Drop what was found twice (the same place and size), keeping the better described edge."""
    order = np.argsort(fits[:, MISFIT] / np.abs(fits[:, CONTRAST]))
    kept: list[np.ndarray] = []
    for fit in fits[order]:
        r = radius_px(fit)
        if all(np.hypot(fit[U] - k[U], fit[V] - k[V]) > 0.3 * r or abs(radius_px(k) - r) > 0.3 * r for k in kept):
            kept.append(fit)
    kept.sort(key=lambda fit: -abs(fit[CONTRAST]))
    return np.array(kept).reshape(-1, N_FIT)
