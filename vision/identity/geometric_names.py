"""Which disc of the first frame may be which marker, from geometry alone: a suggestion that a person then corrects.

Discs of two cameras are paired where their rays intersect; many pairs share a height, because the markers of a body lie
in one plane, and wrong pairs do not.  The NES' markers are those that fit on the smallest disk, the Host's those of one
height on a circle around it, the ground's the lowest of the rest.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ovines.camera import Camera, triangulate_points
from ovines.recording import Recording
from vision.identity.layouts import rig_radius
from vision.markers.row import CONTRAST, U, V, radius_px

Array = NDArray[np.float64]
# Share of the sensor's width by which two pictures of one thing may miss each other's epipolar lines, for the
# calibration.
EPIPOLAR = 1e-3
# Lengths in radii of the rig (`vision.identity.layouts.rig_radius`).
_HEIGHT = (-0.2, 1.6)  # of markers over the sliding plane
_SAME_HEIGHT = 0.012  # two cameras see a height so exactly
_LEVEL = 0.06  # markers of the NES differ no more in height
_STRAIN = 0.02  # by which a ring's markers may differ in height or distance: one unit of strain
_MOST_STRAIN = 5.0
_COMPANY = 0.5  # what each e-fold of discs at its own height takes off a pair's miss of the epipolar lines
# A circle smaller than the wall, the NES outside it, and one larger than the wall by half: units of strain per radius.
_OUTSIDE_STRAIN, _LARGE_STRAIN, _LARGE = 10, 2, 1.5
_UNLIKE = 1.6  # markers of one body do not differ more in size
_MOST_HOST = 12  # candidates among which the Host's markers are looked for: combinations grow fast


@dataclass(frozen=True, eq=False)
class Pairs:
    """Discs that both cameras see: ``disc`` (n, 2) their rows per camera, ``place_m`` (n, 3) where they are,
    ``radius_m`` (n,) how large: negative for light ones.
    """

    disc: NDArray[np.intp]
    place_m: Array
    radius_m: Array

    def __getitem__(self, rows: Sequence[int]) -> Pairs:
        """Some of them."""
        return Pairs(self.disc[list(rows)], self.place_m[list(rows)], self.radius_m[list(rows)])


def pair_discs(
    cameras: Sequence[Camera], offsets_px: Sequence[tuple[int, int]], discs: Sequence[Array], rig_m: float
) -> Pairs:
    """Pair the discs, fits (n, 20) of `find_discs`, of two cameras; each disc at most once.  `rig_m`: see
    `vision.identity.layouts.rig_radius`.
    """
    a, b = (one.ravel() for one in np.meshgrid(*(np.arange(len(own)) for own in discs), indexing="ij"))
    alike = discs[0][a, CONTRAST] * discs[1][b, CONTRAST] > 0
    a, b = a[alike], b[alike]
    if not len(a):
        return Pairs(np.empty((0, 2), np.intp), np.empty((0, 3)), np.empty(0))
    seen = [own[k][:, [U, V]] + offset for own, k, offset in zip(discs, (a, b), offsets_px, strict=True)]
    found = triangulate_points(cameras, seen, [np.ones(len(a))] * 2)
    off, height = (
        np.abs(found.epipolar_px) / (EPIPOLAR * max(camera.sensor_size_px[0] for camera in cameras)),
        found.points_m[:, 2] / rig_m,
    )
    fits = (off < 1.0) & (height > _HEIGHT[0]) & (height < _HEIGHT[1])
    a, b, off, place = a[fits], b[fits], off[fits], found.points_m[fits]
    company = (np.abs(place[:, None, 2] - place[None, :, 2]) < _SAME_HEIGHT * rig_m).sum(1)
    chosen: list[int] = []
    for k in np.argsort(off - _COMPANY * np.log(company)):
        if all(a[k] != a[j] and b[k] != b[j] for j in chosen):
            chosen.append(int(k))
    a, b, place = a[chosen], b[chosen], place[chosen]
    return Pairs(np.column_stack([a, b]), place, _radii(cameras[0], discs[0][a], place))


def _radii(camera: Camera, fits: Array, place_m: Array) -> Array:
    """Signed radii [m] from their size in one picture: good enough to know a marker from a disk that carries some."""
    depth_m = (place_m @ camera.rotation.T + camera.translation_m)[:, 2]
    return -np.sign(fits[:, CONTRAST]) * radius_px(fits) * depth_m / camera.matrix[0, 0]


def suggest_names(pairs: Pairs, recording: Recording) -> dict[str, int]:
    """Marker -> row of ``pairs``.  Bodies for which too few discs are left get none.

    Within a body the centre marker is the one nearest to the middle; the others run clockwise as the cameras see
    them (from above), beginning left (-x), as the ground's always do.
    """
    bodies, place, rig_m = recording.bodies, pairs.place_m, rig_radius(recording)
    if not len(place):
        return {}
    left, names = list(range(len(place))), dict[str, int]()
    nes = recording.settings.bodies.nes
    if nes is not None and nes.markers:
        own = _on_smallest_disk(pairs, left, len(nes.markers), 2 * nes.radius_m, _LEVEL * rig_m)
        names |= _ordered(place, own, nes.markers, nes.centre_marker)
        left = [k for k in left if k not in own]
    host = recording.settings.bodies.host
    if host is not None and host.markers:
        inside = place[np.array([names[m] for m in nes.markers]), :2].mean(0) if nes is not None and names else None
        own = _around(pairs, left, len(host.markers), inside, host.inner_radius_m, _STRAIN * rig_m)
        names |= _ordered(place, own, host.markers, None)
        left = [k for k in left if k not in own]
    others = [marker for body in (nes, host) if body is not None for marker in body.markers]
    if "ground" in bodies and len(left) >= len(bodies["ground"].markers) and all(marker in names for marker in others):
        left.sort(key=lambda k: abs(place[k, 2]))
        names |= _ordered(place, left[: len(bodies["ground"].markers)], bodies["ground"].markers, None)
    return names


def _alike(radius_m: Array, k: int) -> NDArray[np.bool_]:
    """Discs about as large as disc ``k``, and dark or light as it is."""
    ratio = radius_m / radius_m[k]
    return np.asarray((ratio > 1 / _UNLIKE) & (ratio < _UNLIKE))


def _on_smallest_disk(pairs: Pairs, left: Sequence[int], n: int, across_m: float, level_m: float) -> list[int]:
    """The ``n`` alike points of about one height that lie closest together, on a disk at most ``across_m`` across; else
    [].
    """
    place = pairs.place_m
    best: tuple[float, list[int]] = (across_m, [])
    for k in left:
        alike = _alike(pairs.radius_m, k)
        level = [j for j in left if alike[j] and abs(place[j, 2] - place[k, 2]) < level_m]
        near = sorted(level, key=lambda j: float(np.hypot(*(place[j, :2] - place[k, :2]))))[:n]
        spread = _across(place[near, :2])
        if len(near) == n and spread < best[0]:
            best = (spread, near)
    return best[1]


def _across(points: Array) -> float:
    return float(np.hypot(*(points[:, None] - points[None]).T).max()) if len(points) else 0.0


def _around(
    pairs: Pairs, left: Sequence[int], n: int, inside: Array | None, inner_radius_m: float | None, strain_m: float
) -> list[int]:
    """The ``n`` alike points most like a ring: one height, on a circle no smaller than the wall, the NES inside; else
    [].
    """
    place = pairs.place_m
    middle = place[:, :2].mean(0) if inside is None else inside
    near = sorted(left, key=lambda k: float(np.hypot(*(place[k, :2] - middle))))[:_MOST_HOST]
    best: tuple[float, list[int]] = (_MOST_STRAIN, [])
    for chosen in combinations(near, n):
        points = place[list(chosen)]
        if not _alike(pairs.radius_m, chosen[0])[list(chosen)].all():
            continue
        strain = float(np.ptp(points[:, 2])) / strain_m
        if inner_radius_m is not None and n >= 3:
            centre, radius = _circle(points[:, :2])
            away = np.hypot(*(points[:, :2] - centre).T)
            strain += (
                float(np.ptp(away)) / strain_m + _OUTSIDE_STRAIN * max(0.0, inner_radius_m - radius) / inner_radius_m
            )
            strain += _OUTSIDE_STRAIN * max(0.0, float(np.hypot(*(middle - centre))) / inner_radius_m - 1)
            strain += _LARGE_STRAIN * max(0.0, radius / inner_radius_m - _LARGE)
        if strain < best[0]:
            best = (strain, list(chosen))
    return best[1]


def _circle(points: Array) -> tuple[Array, float]:
    """Least-squares circle (Kasa's): centre (2,) and radius."""
    design = np.column_stack([2 * points, np.ones(len(points))])
    solution = np.linalg.lstsq(design, (points**2).sum(1), rcond=None)[0]
    return solution[:2], float(np.sqrt(max(solution[2] + solution[:2] @ solution[:2], 0.0)))


def _ordered(place: Array, own: Sequence[int], markers: Sequence[str], centre: str | None) -> dict[str, int]:
    """Names in order; {} where there are not as many points as markers."""
    if len(own) != len(markers):
        return {}
    middle = place[list(own), :2].mean(0)
    away = place[list(own), :2] - middle
    clockwise = np.argsort((np.pi - np.arctan2(away[:, 1], away[:, 0])) % (2 * np.pi), kind="stable")
    order = [own[k] for k in clockwise]
    names: dict[str, int] = {}
    if centre is not None:
        nearest = own[int(np.argmin(np.hypot(*away.T)))]
        names[centre] = nearest
        order.remove(nearest)
    return names | dict(zip([marker for marker in markers if marker != centre], order, strict=True))


def as_rows(
    names: Mapping[str, int], pairs: Pairs, cameras: Sequence[str], discs: Sequence[Array]
) -> list[tuple[str, str, float, float]]:
    """Rows camera, marker, u_px, v_px of a ``names.csv``."""
    return [
        (camera, marker, float(discs[i][pairs.disc[row, i], U]), float(discs[i][pairs.disc[row, i], V]))
        for i, camera in enumerate(cameras)
        for marker, row in names.items()
    ]
