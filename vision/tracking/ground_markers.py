"""Ground markers that have no layout: the discs that both cameras see and no other body claims."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ovines.camera import triangulate_points
from vision.identity.geometric_names import EPIPOLAR
from vision.markers.fit import CONTRAST, U, V, radius_px
from vision.markers.perspective import circle_centres
from vision.tracking.camera_tracker import Eye

_LARGEST_HEIGHT = 1.0  # of ground markers over the sliding plane, in radii of the rig
_LEVEL = 0.4  # such height counts as much as the largest miss
_MISSED = 0.4  # such a miss counts as much as a size other by so much (logarithm)
_CLAIMED = 0.7  # radii of a followed marker's disc: a disc so near to its middle is that marker
_UNLIKE_RADIUS = 0.25
_BESIDE = 1.1  # times the farthest of the Host's markers from its centre: beyond, a disc is beside the Host


def name_ground(
    eyes: Sequence[Eye],
    discs: Sequence[np.ndarray],
    frame: int,
    n_wanted: int,
    host_radius_m: float | None,
    fewer: bool,
) -> tuple[np.ndarray, list[np.ndarray]] | None:
    """Positions (k, 3) in the world and each camera's fits (k, 20), clockwise from above beginning at -x.

    None while the other bodies are not yet seen in both cameras, or fewer than `n_wanted` are found (unless
    `fewer` allows it).  Of too many, those most alike in size are taken.
    """
    bodies = eyes[0].layout.bodies
    others = [b for b in range(len(bodies)) if eyes[0].layout.known[b]]
    if any(eye.last[b] != frame for eye in eyes for b in others) and not fewer:
        return None
    free = [own[~_claimed(eye, own)] for eye, own in zip(eyes, discs, strict=True)]
    if not all(len(own) for own in free):
        return None
    found = _stereo(eyes, free)
    host = bodies.index("host") if "host" in bodies else None
    centre = np.zeros(2)
    if host is not None and eyes[0].last[host] == frame:
        centre = eyes[0].pose[host, :2]
        if host_radius_m:
            found = [each for each in found if np.hypot(*(each[0][:2] - centre)) > host_radius_m]
        # Screws of the ring are discs too; what lies beyond the Host's own markers is surely not on it.
        reach_m = _BESIDE * np.hypot(*eyes[0].place_m[eyes[0].layout.of(host), :2].T).max()
        beyond = [each for each in found if np.hypot(*(each[0][:2] - centre)) > reach_m]
        found = beyond if len(beyond) >= n_wanted else found
    if len(found) < n_wanted and not (fewer and found):
        return None
    if len(found) > n_wanted:
        radius = _marker_radius(eyes, frame) or float(np.median([each[3] for each in found]))
        found = sorted(found, key=lambda each: abs(np.log(each[3] / radius)) + _MISSED * each[4])[:n_wanted]
    found.sort(key=lambda each: (np.pi - np.arctan2(*(each[0][:2] - centre)[::-1])) % (2 * np.pi))
    return np.array([each[0] for each in found]), [np.array([each[1 + i] for each in found]) for i in range(2)]


def _claimed(eye: Eye, discs: np.ndarray) -> np.ndarray:
    """Discs that a followed marker already is."""
    own = eye.fits[eye.use > 0]
    if not len(own):
        return np.zeros(len(discs), bool)
    return np.asarray(
        np.any(
            np.hypot(discs[:, None, U] - own[:, U], discs[:, None, V] - own[:, V]) < _CLAIMED * radius_px(own), axis=1
        )
    )


def _stereo(eyes: Sequence[Eye], free: Sequence[np.ndarray]) -> list[tuple[Any, ...]]:
    """Discs of both cameras that are one thing: (position, fit, fit, radius [m], miss of the epipolar lines in parts of
    the largest).
    """
    radii = [circle_centres(own, eye.camera, 0.0, eye.offset)[1] for eye, own in zip(eyes, free, strict=True)]
    a, b = (each.ravel() for each in np.meshgrid(np.arange(len(free[0])), np.arange(len(free[1])), indexing="ij"))
    alike = (np.abs(np.log(radii[0][a] / radii[1][b])) < _UNLIKE_RADIUS) & (
        free[0][a, CONTRAST] * free[1][b, CONTRAST] > 0
    )
    a, b = a[alike], b[alike]
    if not len(a):
        return []
    ones = np.ones(len(a))
    points = triangulate_points(
        [eye.camera for eye in eyes],
        [free[0][a][:, [U, V]] + eyes[0].offset, free[1][b][:, [U, V]] + eyes[1].offset],
        [ones, ones],
    )
    cost = np.abs(points.epipolar_px) / (EPIPOLAR * max(eye.camera.sensor_size_px[0] for eye in eyes))
    height = np.abs(points.points_m[:, 2]) / eyes[0].layout.rig_m
    fits = (cost < 1.0) & (height < _LARGEST_HEIGHT)
    found: list[tuple[Any, ...]] = []
    used: tuple[set[int], set[int]] = (set(), set())
    # Ground markers lie about the sliding plane: of two that share an epipolar line, the lower one is meant.
    for k in np.argsort(cost + height / _LEVEL):
        if fits[k] and a[k] not in used[0] and b[k] not in used[1]:
            used[0].add(a[k])
            used[1].add(b[k])
            found.append(
                (points.points_m[k], free[0][a[k]], free[1][b[k]], 0.5 * (radii[0][a[k]] + radii[1][b[k]]), cost[k])
            )
    return found


def _marker_radius(eyes: Sequence[Eye], frame: int) -> float | None:
    """Radius [m] of the markers already named: the ground's are usually the same."""
    radii = []
    for eye in eyes:
        seen = eye.use > 0
        if seen.any():
            radii.append(circle_centres(eye.fits[seen], eye.camera, eye.place_m[seen, 2], eye.offset)[1])
    return float(np.median(np.concatenate(radii))) if radii else None
