"""Which disc is which marker: a body's layout matched to the discs of a picture, as a rigid body.

Discs are carried to the plane of their markers (z = marker height) and compared there: every pair of discs that
is as far apart as two markers of the layout proposes a pose (x, y, angle), and the pose under which the whole
layout fits best wins.  Look-alike markers are distinguished by the layout's own irregularity, and where it has
none, by how far the pose would have jumped.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import overload

import numpy as np

_GATE = 3.0  # tolerances that a disc may lie off its marker's place
_MISSING = _GATE**2  # cost of a marker without a disc: as much as one that far off
_KEEP = 8  # matches
_AT_ONCE = 2000  # poses whose costs are taken together: each takes an array of discs times markers
_PRIOR_SDS = (4.0, 5.0)  # of position and angle about the expected pose
_SAME_POSE = 2.0  # tolerances within which two poses are one
_ROUNDS = 3  # in which discs and pose settle
_ALONE, _TOGETHER = 3, 5  # discs that name a body: in one camera alone, and in two together


@dataclass(frozen=True, eq=False)
class Match:
    """A layout laid over discs: pose (x [m], y [m], angle [rad]), disc of each marker (-1: none), cost."""

    pose: np.ndarray
    disc: np.ndarray
    cost: float

    @property
    def n_found(self) -> int:
        """Markers of the layout that have a disc."""
        return int((self.disc >= 0).sum())


def place(pose: np.ndarray, layout_xy_m: np.ndarray) -> np.ndarray:
    """Body-frame points (n, 2) in the world under pose(s) (..., 3): (..., n, 2)."""
    c, s = np.cos(pose[..., 2, None]), np.sin(pose[..., 2, None])
    x, y = layout_xy_m[:, 0], layout_xy_m[:, 1]
    return np.stack([pose[..., 0, None] + c * x - s * y, pose[..., 1, None] + s * x + c * y], -1)


def rigid_pose(layout_xy_m: np.ndarray, seen_xy_m: np.ndarray) -> np.ndarray:
    """Least-squares pose (x, y, angle) that carries layout points (n >= 2, 2) onto seen ones (n, 2)."""
    a, b = layout_xy_m.mean(0), seen_xy_m.mean(0)
    p, q = layout_xy_m - a, seen_xy_m - b
    angle = np.arctan2((p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]).sum(), (p * q).sum())
    c, s = np.cos(angle), np.sin(angle)
    return np.array([b[0] - c * a[0] + s * a[1], b[1] - s * a[0] - c * a[1], angle])


def match_layout(
    seen_xy_m: np.ndarray,
    layout_xy_m: np.ndarray,
    tolerance_m: float,
    prior: np.ndarray | None = None,
    prior_sd: tuple[float, float] = (np.inf, np.inf),
) -> list[Match]:
    """The best few ways to lay a layout over discs, cheapest first.

    Parameters
    ----------
    seen_xy_m : (m, n, 2) where disc i lies if it is marker j (marker heights may differ), or (m, 2)
    layout_xy_m : (n, 2)
    tolerance_m : one unit of cost; misfits count up to 3 of it
    prior : pose expected, with standard deviations (position [m], angle [rad]); None: anywhere

    Returns
    -------
    Matches of at least two markers; [] when nothing fits.
    """
    n = len(layout_xy_m)
    if seen_xy_m.ndim == 2:
        seen_xy_m = np.repeat(seen_xy_m[:, None], n, axis=1)
    poses = _pair_poses(seen_xy_m, layout_xy_m, tolerance_m)
    if prior is not None and len(poses):
        poses = poses[
            (np.hypot(*(poses[:, :2] - prior[:2]).T) < _PRIOR_SDS[0] * prior_sd[0])
            & (np.abs(wrapped(poses[:, 2] - prior[2])) < _PRIOR_SDS[1] * prior_sd[1])
        ]
    if not len(poses):
        return []
    costs = np.concatenate(
        [
            _costs(part, seen_xy_m, layout_xy_m, tolerance_m)[0]
            for part in np.array_split(poses, len(poses) // _AT_ONCE + 1)
        ]
    )
    poses = poses[np.argsort(costs)]
    extent = np.ptp(layout_xy_m, axis=0).max()
    matches: list[Match] = []
    while len(poses) and len(matches) < _KEEP:
        pose = poses[0]
        same = (np.hypot(*(poses[:, :2] - pose[:2]).T) < _SAME_POSE * tolerance_m) & (
            np.abs(wrapped(poses[:, 2] - pose[2])) < _GATE * tolerance_m / extent
        )
        same[0] = True
        poses = poses[~same]
        match = _refine(pose, seen_xy_m, layout_xy_m, tolerance_m, prior, prior_sd)
        if match is None:
            if len(matches) >= 2:
                break
        elif not any((match.disc == other.disc).all() for other in matches):
            matches.append(match)
    return sorted(matches, key=lambda match: match.cost)


@overload
def wrapped(angle_rad: float) -> float: ...
@overload
def wrapped(angle_rad: np.ndarray) -> np.ndarray: ...
def wrapped(angle_rad: np.ndarray | float) -> np.ndarray | float:
    """An angle in (-pi, pi]."""
    return (angle_rad + np.pi) % (2 * np.pi) - np.pi


def _pair_poses(seen: np.ndarray, layout: np.ndarray, tolerance: float) -> np.ndarray:
    n = len(layout)
    poses = []
    for i in range(n):
        for j in range(i + 1, n):
            span = layout[j] - layout[i]
            length = np.hypot(*span)
            between = seen[None, :, j] - seen[:, None, i]
            distance = np.hypot(between[..., 0], between[..., 1])
            first, second = np.nonzero(np.abs(distance - length) < _GATE * tolerance)
            keep = first != second
            first, second = first[keep], second[keep]
            along = between[first, second]
            angle = np.arctan2(along[:, 1], along[:, 0]) - np.arctan2(span[1], span[0])
            c, s = np.cos(angle), np.sin(angle)
            middle = 0.5 * (layout[i] + layout[j])
            at = 0.5 * (seen[first, i] + seen[second, j])
            poses.append(
                np.stack(
                    [at[:, 0] - c * middle[0] + s * middle[1], at[:, 1] - s * middle[0] - c * middle[1], angle], -1
                )
            )
    return np.concatenate(poses) if poses else np.empty((0, 3))


def _costs(poses: np.ndarray, seen: np.ndarray, layout: np.ndarray, tolerance: float) -> tuple[np.ndarray, np.ndarray]:
    """Cost (k,) and nearest disc per marker (k, n; -1: none within reach) of each pose."""
    wanted = place(poses, layout)
    square = ((wanted[:, None] - seen[None]) ** 2).sum(-1) / tolerance**2
    nearest = square.argmin(1)
    best = np.take_along_axis(square, nearest[:, None], 1)[:, 0]
    return np.minimum(best, _MISSING).sum(1), np.where(best < _MISSING, nearest, -1)


def _refine(
    pose: np.ndarray,
    seen: np.ndarray,
    layout: np.ndarray,
    tolerance: float,
    prior: np.ndarray | None,
    prior_sd: tuple[float, float],
) -> Match | None:
    marker = np.arange(len(layout))
    before = None
    for _ in range(_ROUNDS):
        cost, disc = _costs(pose[None], seen, layout, tolerance)
        if before is not None and np.array_equal(disc, before):
            break
        before, found = disc, disc[0] >= 0
        if found.sum() < 2 or len(set(disc[0][found])) < found.sum():
            return None
        pose = rigid_pose(layout[found], seen[disc[0][found], marker[found]])
    total = float(cost[0])
    if prior is not None:
        off = np.hypot(*(pose[:2] - prior[:2])) / prior_sd[0], wrapped(pose[2] - prior[2]) / prior_sd[1]
        total += off[0] ** 2 + off[1] ** 2
        pose = np.array([pose[0], pose[1], prior[2] + wrapped(pose[2] - prior[2])])
    return Match(pose, disc[0], total)


def match_in_all(
    matches: list[list[Match]], n_markers: int, reach_m: float, reach_rad: float = 0.12
) -> list[Match | None]:
    """The matches, one per camera, that agree about the pose, within `reach_m` and `reach_rad`, and together cost
    least.

    A camera may see nothing of the body (None), at the price of all its markers missing; two markers of one camera
    alone are too few for a name, and so are two in each unless the body has no more.
    """
    best: tuple[float, list[Match | None]] = (np.inf, [None] * len(matches))
    for i, own in enumerate(matches):
        for match in own:
            together: list[Match | None] = [None] * len(matches)
            together[i] = match
            if match.n_found >= _ALONE:
                total = match.cost + (len(matches) - 1) * n_markers * _MISSING
                best = min(best, (total, list(together)), key=lambda each: each[0])
            total = match.cost
            for j, others in enumerate(matches):
                if j != i:
                    partner, price = _partner(match, others, n_markers, reach_m, reach_rad)
                    together[j], total = partner, total + price
            if sum(each is not None for each in together) > 1 and total < best[0]:
                best = (total, together)
    return best[1]


def _partner(
    match: Match, others: list[Match], n_markers: int, reach_m: float, reach_rad: float
) -> tuple[Match | None, float]:
    """Another camera's match that agrees with this one at the least cost, and that cost; None: none agrees."""
    best: tuple[Match | None, float] = (None, n_markers * _MISSING)
    cheapest = np.inf
    for other in others:
        apart = np.hypot(*(match.pose[:2] - other.pose[:2])) / reach_m
        turned = abs(wrapped(match.pose[2] - other.pose[2])) / reach_rad
        price = other.cost + apart**2 + turned**2
        enough = match.n_found + other.n_found >= min(_TOGETHER, 2 * n_markers)
        if apart < 1 and turned < 1 and enough and price < cheapest:
            best, cheapest = (other, price), price
    return best
