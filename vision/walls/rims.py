"""The Host's inner wall and the NES' rim from their edges in both pictures: circles in space, no markers needed.

What a camera sees of a cylinder's mouth is its top rim, all the way round: on the near side it hides what lies
below, on the far side the wall begins under it.  Edge points are found to a fraction of a pixel along the
normals of the expected image curve, and one horizontal circle (x, y, z, R) is laid through those of both cameras;
points that belong to something else (the floor's edge, the other body, a shadow) do not agree with it and drop out.
Where the cylinder is seen along its wall its foot runs beside the rim, and both edges blur into one: those points are
left out.  A blurred edge that bends lies nearer to its centre of curvature by blur^2 / (2 radius): that is put back.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.ndimage import maximum_filter1d

from ovines.camera import Camera
from ovines.errors import InputError
from ovines.robust import MEDIAN_TO_SD, TUKEY_SD, spread, tukey_weight
from vision.walls.edges import SMOOTH_PX, STEP_PX, slopes

_SPACING_PX = 2.0  # along the curve; nearer points share their pixels
_SEARCH_SPACING_PX = 6.0  # the same while the radius is only searched for
_LEAST_RADII = 81  # tried in that search; of a large circle as many as leave no pixel out
_GATES_PX = (10.0, 5.0, 3.0, 2.0, 2.0, 2.0)  # to both sides of the circle, as it is refined
_LEAST_POINTS = 40
# By which all edges of a picture may be off together (by 16 rendered scenes of different light, blur and tilt).
_SHARED_PX = 0.004
# An edge is clear from this derivative on: grey levels/px, in parts of the usual edge's, and of the profiles' noise.
_LEAST_SLOPE, _OF_USUAL, _OF_NOISE = 1.0, 0.25, 0.5
_USUAL_WIDTH2 = 2.0  # squared width of the smoothed edge [px^2] where none is clear
_STRONGEST = 12.0  # grey levels/px that count while the radius is searched: no bright scratch outweighs the rest
_PRIOR_SD = 0.6  # of the searched range, about the expected radius
_LEAST_SCALE_PX = 0.05  # least robust sd of the edge points
_RADII = (0.5, 1.5)  # of the expected radius: beyond, the circle is another's
_COARSE_POINTS = 90  # of the circle's image, for its length
_POINTS = (60, 1500)  # fewest and most along it
# Unknowns of a circle in the order of the fit: with one camera the last, the height, is held.
CENTRE_X, CENTRE_Y, CENTRE_Z, RADIUS = range(4)
_FIT_ORDER = (CENTRE_X, CENTRE_Y, RADIUS, CENTRE_Z)
_LONGEST, _VANISHED = 60, 0.05  # points over which errors may be alike; correlation that is none
_FOOT_WIDTHS = 3.7  # of the smoothed edge: nearer than this, the foot's edge moves the rim's
_FOOT_KEPT = 0.3  # share of the points that is kept at least, the farthest from the foot


@dataclass(frozen=True, eq=False)
class Rim:
    """A horizontal circle in space: centre (x, y, z) and radius [m], their standard deviations, and how it was seen.

    The covariance (4, 4) is that of the edges; the calibration's own uncertainty is not in it.
    """

    centre_m: np.ndarray
    radius_m: float
    covariance_m2: np.ndarray
    n_points: tuple[int, ...]
    residual_px: float

    @property
    def sd_m(self) -> np.ndarray:
        """Standard deviations of x, y, z, R."""
        return np.sqrt(np.diag(self.covariance_m2))


def fit_rim(
    images: Sequence[np.ndarray],
    cameras: Sequence[Camera],
    window_offsets_px: Sequence[tuple[int, int]],
    centre_m: np.ndarray,
    radius_m: float,
    search: float = 0.12,
) -> Rim | None:
    """Fit a horizontal circle to its edges in all pictures of one instant.

    Parameters
    ----------
    images : one (h, w) picture per camera;  window_offsets_px : top-left corners of their windows on the sensor
    centre_m : expected centre, z being the rim's height;  radius_m : expected radius
    search : the radius is first searched for within this share of the expectation; 0: trust it

    Returns
    -------
    `Rim`, or None where fewer than 40 edge points in some camera agree with one circle.  With one camera, the
    height is held at its expectation.
    """
    seen = [
        _Picture(image, camera, offset)
        for image, camera, offset in zip(images, cameras, window_offsets_px, strict=True)
    ]
    circle = np.array([*centre_m, radius_m], float)
    if search > 0:
        circle[RADIUS] = _strongest_radius(seen, circle, search)
    free = list(_FIT_ORDER[: 4 if len(seen) > 1 else 3])  # the height comes from the parallax
    for gate in _GATES_PX:
        residual, jacobian, strength, count = _edges(seen, circle, gate)
        if min(count) < _LEAST_POINTS:
            return None
        weight = strength * _tukey(residual)
        jacobian = jacobian[:, free]
        normal = jacobian.T @ (weight[:, None] * jacobian)
        try:
            step = np.linalg.solve(normal, jacobian.T @ (weight * residual))
        except np.linalg.LinAlgError:
            return None
        circle[free] += step
    used = weight > 0
    counts = _per_camera(used, count)
    if min(counts) < _LEAST_POINTS or not _RADII[0] * radius_m < circle[RADIUS] < _RADII[1] * radius_m:
        return None
    return Rim(
        circle[:3].copy(),
        float(circle[RADIUS]),
        _covariance(residual, jacobian, weight, free, count),
        counts,
        float(np.sqrt(np.mean(residual[used] ** 2))),
    )


class _Curve(NamedTuple):
    """Points of a circle's image: window pixels (n, 2), unit normals (n, 2) outward, the shift along them per x, y, z,
    R (n, 4), how far along them the foot of a cylinder standing on the plane lies [px], and the curvature [1/px]."""

    uv: np.ndarray
    normal: np.ndarray
    moved: np.ndarray
    foot_px: np.ndarray
    bent: np.ndarray


class _Picture:
    """A picture and the camera that took it: where circles in space appear in it."""

    def __init__(self, image: np.ndarray, camera: Camera, offset: tuple[int, int]) -> None:
        self.image, self.camera, self.offset = image, camera, np.asarray(offset, float)

    def curve(self, circle: np.ndarray, spacing_px: float = _SPACING_PX) -> _Curve:
        """The circle's image at points `spacing_px` apart."""
        coarse = self._at(circle, np.linspace(0, 2 * np.pi, _COARSE_POINTS, endpoint=False))[0]
        length = np.hypot(*np.diff(coarse, axis=0, append=coarse[:1]).T).sum()
        if not np.isfinite(length):
            raise InputError(
                f"a wall of {circle[RADIUS]:.4g} m reaches behind camera {self.camera.name}",
                "a wall in front of both cameras",
                "correct inner_radius_m or radius_m in recording.toml (metres)",
            )
        turn = np.linspace(0, 2 * np.pi, int(np.clip(length / spacing_px, *_POINTS)), endpoint=False)
        uv, jacobian = self._at(circle, turn)
        radial = np.stack([np.cos(turn), np.sin(turn), 0 * turn], -1)
        tangent = np.einsum("nij,nj->ni", jacobian, np.stack([-np.sin(turn), np.cos(turn), 0 * turn], -1))
        outward = np.einsum("nij,nj->ni", jacobian, radial)
        normal = np.stack([tangent[:, 1], -tangent[:, 0]], -1)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        normal *= np.sign(np.einsum("ni,ni->n", normal, outward))[:, None]
        moved = np.concatenate([jacobian, outward[:, :, None]], -1)
        foot = np.abs(np.einsum("ni,ni->n", normal, jacobian[:, :, 2])) * abs(circle[CENTRE_Z])
        step = np.roll(uv, -1, 0) - uv
        bent = np.abs(np.einsum("ni,ni->n", normal, step - np.roll(step, 1, 0))) / np.maximum((step**2).sum(1), 1e-9)
        return _Curve(uv, normal, np.einsum("ni,nij->nj", normal, moved), foot, bent)

    def _at(self, circle: np.ndarray, turn: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        points = circle[:3] + circle[RADIUS] * np.stack([np.cos(turn), np.sin(turn), 0 * turn], -1)
        uv, jacobian = self.camera.project_with_jacobian(points)
        return uv - self.offset, jacobian


def _edges(
    seen: Sequence[_Picture], circle: np.ndarray, gate_px: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[int]]:
    """Where the strongest edge lies along each normal within the gate: residual (n,), Jacobian (n, 4), strength
    (n,).
    """
    residual, jacobian, strength, count = [], [], [], []
    for picture in seen:
        curve = picture.curve(circle)
        along, slope = slopes(picture.image, curve.uv, curve.normal, gate_px)
        size = np.abs(slope)
        noise = MEDIAN_TO_SD * np.nanmedian(size)  # `residual_sd` takes twice as long, and most of this function
        best = np.argmax(np.nan_to_num(size), axis=1)
        inner = (best > 0) & (best < len(along) - 1)
        row = np.arange(len(curve.uv))[inner]
        k = best[inner]
        left, top, right = size[row, k - 1], size[row, k], size[row, k + 1]
        with np.errstate(divide="ignore", invalid="ignore"):
            offset = along[k] + STEP_PX * 0.5 * (left - right) / (left - 2 * top + right)
            width2 = STEP_PX**2 / np.log(top**2 / (left * right))
        least = max(_LEAST_SLOPE, _OF_USUAL * np.median(top) if len(top) else 0.0)
        clear = np.isfinite(offset) & (top > least) & (top > _OF_NOISE * noise)
        width2_usual = float(np.nanmedian(width2[clear])) if clear.any() else _USUAL_WIDTH2
        clear &= curve.foot_px[row] > min(
            _FOOT_WIDTHS * np.sqrt(width2_usual), np.quantile(curve.foot_px, 1 - _FOOT_KEPT)
        )
        blur2 = max(width2_usual - SMOOTH_PX**2, 0.0)
        residual.append(offset[clear] + 0.5 * blur2 * curve.bent[row[clear]])
        jacobian.append(curve.moved[row[clear]])
        strength.append(np.minimum(top[clear], np.median(top[clear]) if clear.any() else 1.0) ** 2)
        count.append(int(clear.sum()))
    weight = np.concatenate(strength)
    return np.concatenate(residual), np.concatenate(jacobian), weight / (weight.mean() if len(weight) else 1.0), count


def _strongest_radius(seen: Sequence[_Picture], circle: np.ndarray, search: float) -> float:
    """The radius at which the curve runs along an edge over most of its length, in all pictures."""
    curves = [picture.curve(circle, _SEARCH_SPACING_PX) for picture in seen]
    wide_px = 2 * search * circle[RADIUS] * max(float(np.abs(curve.moved[:, RADIUS]).max()) for curve in curves)
    radii = circle[RADIUS] * np.linspace(1 - search, 1 + search, max(_LEAST_RADII, int(np.ceil(wide_px)) + 1))
    share = []
    for picture, curve in zip(seen, curves, strict=True):
        shift = curve.moved[:, RADIUS:] * (radii - circle[RADIUS])
        along, slope = slopes(picture.image, curve.uv, curve.normal, float(np.abs(shift).max()) + 1.0)
        size = maximum_filter1d(np.nan_to_num(np.abs(slope)), round(2.0 / STEP_PX) + 1, axis=1)  # a pixel to both sides
        size = np.take_along_axis(size, np.round((shift - along[0]) / STEP_PX).astype(int), axis=1)
        share.append(np.minimum(size, _STRONGEST).mean(0))
    score = np.min(share, axis=0)
    prior = np.exp(-0.5 * ((radii / circle[RADIUS] - 1) / (_PRIOR_SD * search)) ** 2)
    return float(radii[np.argmax(score * prior)])


def _tukey(residual: np.ndarray) -> np.ndarray:
    """Tukey's biweights (n,), wider by the median of the residuals: the circle may still be off by it."""
    centre = np.median(residual)
    scale = max(spread(residual), _LEAST_SCALE_PX)
    return tukey_weight(residual / (TUKEY_SD * scale + abs(centre)))


def _per_camera(used: np.ndarray, count: Sequence[int]) -> tuple[int, ...]:
    return tuple(int(part.sum()) for part in np.split(used, np.cumsum(count)[:-1]))


def _covariance(
    residual: np.ndarray, jacobian: np.ndarray, weight: np.ndarray, free: list[int], count: Sequence[int]
) -> np.ndarray:
    """(4, 4) of x, y, z, R; edge points near each other agree in their errors, which their autocorrelation shows, and
    all of a picture share what the model of an edge leaves."""
    used = weight > 0
    variance = np.sum(weight * residual**2) / np.sum(weight)
    variance *= _correlated(residual[used])
    normal = jacobian.T @ (weight[:, None] * jacobian) * (np.sum(weight) / np.sum(weight**2))
    covariance = np.zeros((4, 4))
    own = variance * np.linalg.inv(normal)
    weighted = np.linalg.solve(jacobian.T @ (weight[:, None] * jacobian), (weight[:, None] * jacobian).T)
    for part in np.split(weighted, np.cumsum(count)[:-1], axis=1):
        shared = _SHARED_PX * part.sum(1)
        own += np.outer(shared, shared)
    covariance[np.ix_(free, free)] = own
    return covariance


def _correlated(r: np.ndarray) -> float:
    """How many neighbours share one error: 1 + 2 times the autocorrelations, summed until they vanish."""
    total, square = 1.0, float(np.mean(r**2))
    for lag in range(1, min(_LONGEST, len(r) // 4)):
        alike = float(np.mean(r[lag:] * r[:-lag])) / square
        if alike < _VANISHED:
            break
        total += 2 * alike
    return total
