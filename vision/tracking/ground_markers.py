"""Ground markers that have no layout: the discs that two cameras see and that are no other body's."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ovines.camera import triangulate_points
from vision.identity.geometric_names import EPIPOLAR
from vision.markers.perspective import circle_centres
from vision.markers.row import CONTRAST, U, V, radius_px
from vision.tracking.camera_tracker import CameraTracker

_LARGEST_HEIGHT = 1.0  # of ground markers over the sliding plane, in radii of the rig
_LEVEL = 0.4  # such height counts as much as the largest miss
_MISSED = 0.4  # such a miss counts as much as a size other by so much (logarithm)
_TAKEN = 0.7  # radii of a tracked marker's disc: a disc so near to its middle is that marker
_UNLIKE_RADIUS = 0.25  # logarithm of the ratio of radii from which two discs are not one thing
_BESIDE = 1.1  # times the farthest of the Host's markers from its centre: beyond, a disc is beside the Host


class StereoDisc(NamedTuple):
    """A disc that both cameras see: position in the world (3,), each camera's fit (20,), radius, and miss of the
    epipolar lines in parts of the largest.
    """

    position_m: np.ndarray
    fits: tuple[np.ndarray, np.ndarray]
    radius_m: float
    miss: float


def name_ground(
    cameras: Sequence[CameraTracker],
    discs: Sequence[np.ndarray],
    frame: int,
    n_wanted: int,
    host_radius_m: float | None,
    fewer: bool,
) -> tuple[np.ndarray, list[np.ndarray]] | None:
    """Positions (k, 3) in the world and each camera's fits (k, 20), clockwise from above beginning at -x.

    The first two cameras find them; in any further one they are the discs where those positions are seen.

    None while the other bodies are not yet seen in both cameras, or fewer than `n_wanted` are found (unless
    `fewer` allows it).  Of too many, those most alike in size are taken.
    """
    layout = cameras[0].layout
    bodies = layout.bodies
    others = [b for b in range(len(bodies)) if layout.known[b]]
    if any(camera.bodies.last_frame[b] != frame for camera in cameras for b in others) and not fewer:
        return None
    free = [own[~_taken(camera, own)] for camera, own in zip(cameras, discs, strict=True)]
    if not all(len(own) for own in free):
        return None
    found = _stereo(cameras[:2], free[:2])
    host = bodies.index("host") if "host" in bodies else None
    centre = np.zeros(2)
    if host is not None and cameras[0].bodies.last_frame[host] == frame:
        centre = cameras[0].bodies.pose[host, :2]
        if host_radius_m:
            found = [each for each in found if np.hypot(*(each.position_m[:2] - centre)) > host_radius_m]
        # Screws of the ring are discs too; what lies beyond the Host's own markers is not on it.
        reach_m = _BESIDE * np.hypot(*cameras[0].markers.place_m[layout.of(host), :2].T).max()
        beyond = [each for each in found if np.hypot(*(each.position_m[:2] - centre)) > reach_m]
        found = beyond if len(beyond) >= n_wanted else found
    if len(found) < n_wanted and not (fewer and found):
        return None
    if len(found) > n_wanted:
        radius = _marker_radius(cameras) or float(np.median([each.radius_m for each in found]))
        found = sorted(found, key=lambda each: abs(np.log(each.radius_m / radius)) + _MISSED * each.miss)[:n_wanted]
    found.sort(key=lambda each: (np.pi - np.arctan2(*(each.position_m[:2] - centre)[::-1])) % (2 * np.pi))
    positions = np.array([each.position_m for each in found])
    fits = [np.array([each.fits[i] for each in found]) for i in range(2)]
    return positions, fits + [_seen_at(positions, *other) for other in zip(cameras[2:], free[2:], strict=True)]


def _seen_at(positions_m: np.ndarray, camera: CameraTracker, discs: np.ndarray) -> np.ndarray:
    """A further camera's discs (k, 20) at positions (k, 3) in the world; zeros where none lies there."""
    uv = camera.camera.project(positions_m) - camera.offset
    away = np.hypot(*(discs[None, :, [U, V]] - uv[:, None]).transpose(2, 0, 1))
    nearest = away.argmin(1)
    there = away[np.arange(len(uv)), nearest] < _TAKEN * radius_px(discs[nearest])
    return np.where(there[:, None], discs[nearest], 0.0)


def _taken(camera: CameraTracker, discs: np.ndarray) -> np.ndarray:
    """Discs that a tracked marker already is."""
    own = camera.detections.disc[camera.detections.used > 0]
    if not len(own):
        return np.zeros(len(discs), bool)
    return np.asarray(
        np.any(np.hypot(discs[:, None, U] - own[:, U], discs[:, None, V] - own[:, V]) < _TAKEN * radius_px(own), axis=1)
    )


def _stereo(cameras: Sequence[CameraTracker], free: Sequence[np.ndarray]) -> list[StereoDisc]:
    """Discs of both cameras that are one thing, each disc at most once."""
    radii = [circle_centres(own, one.camera, 0.0, one.offset)[1] for one, own in zip(cameras, free, strict=True)]
    a, b = (each.ravel() for each in np.meshgrid(np.arange(len(free[0])), np.arange(len(free[1])), indexing="ij"))
    alike = (np.abs(np.log(radii[0][a] / radii[1][b])) < _UNLIKE_RADIUS) & (
        free[0][a, CONTRAST] * free[1][b, CONTRAST] > 0
    )
    a, b = a[alike], b[alike]
    if not len(a):
        return []
    ones = np.ones(len(a))
    points = triangulate_points(
        [one.camera for one in cameras],
        [free[0][a][:, [U, V]] + cameras[0].offset, free[1][b][:, [U, V]] + cameras[1].offset],
        [ones, ones],
    )
    cost = np.abs(points.epipolar_px) / (EPIPOLAR * max(one.camera.sensor_size_px[0] for one in cameras))
    height = np.abs(points.points_m[:, 2]) / cameras[0].layout.rig_m
    fits = (cost < 1.0) & (height < _LARGEST_HEIGHT)
    found: list[StereoDisc] = []
    used: tuple[set[int], set[int]] = (set(), set())
    # Ground markers lie about the sliding plane: of two that share an epipolar line, the lower one is meant.
    for k in np.argsort(cost + height / _LEVEL):
        if fits[k] and a[k] not in used[0] and b[k] not in used[1]:
            used[0].add(a[k])
            used[1].add(b[k])
            radius_m = 0.5 * (radii[0][a[k]] + radii[1][b[k]])
            found.append(StereoDisc(points.points_m[k], (free[0][a[k]], free[1][b[k]]), radius_m, cost[k]))
    return found


def _marker_radius(cameras: Sequence[CameraTracker]) -> float | None:
    """Radius [m] of the markers already named: the ground's are usually the same."""
    radii = []
    for one in cameras:
        seen, heights_m = one.detections.used > 0, one.markers.place_m[:, 2]
        if seen.any():
            radii.append(circle_centres(one.detections.disc[seen], one.camera, heights_m[seen], one.offset)[1])
    return float(np.median(np.concatenate(radii))) if radii else None
