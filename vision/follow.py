"""One camera, one frame: markers looked for where their bodies should be, and the bodies laid through them.

Compiled, without Python's lock, so that both cameras run side by side while pictures are decoded.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ovines.camera import Camera
from vision.centre import (
    CONTRAST,
    COVERAGE,
    M11,
    MISFIT,
    N_FIT,
    NOISE,
    OK,
    OUTLIERS,
    S11,
    S22,
    SD,
    STRUCTURED,
    fit_discs,
)
from vision.centre_sectors import BY_SECTORS, fit_by_sectors
from vision.compiled import compiled

_FAR_RADIUS = 0.13  # relative change of a marker's radius from frame to frame that is no longer the same disc
_FAR_COVERED = 0.05  # the same where another edge runs through and the marker's size is known: a covered disc shrinks by and by
_MAX_MISFIT = 0.15
_STALE_SHAPE = 1.12  # edge residual over noise from which shape and blur of an earlier frame no longer serve

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def packed(camera: Camera, window_offset_px: tuple[int, int]) -> np.ndarray:
    """The camera as 24 numbers for compiled code: rotation 9, translation 3, fx, skew, cx, fy, cy, distortion 5, offset 2."""
    k = camera.matrix
    return np.concatenate([np.ravel(camera.rotation), camera.translation_m, [k[0, 0], k[0, 1], k[0, 2], k[1, 1], k[1, 2]],
                           camera.distortion, window_offset_px]).astype(float)


@compiled
def _project(cam: Floats, x: float, y: float, z: float, out: Floats) -> None:
    """Window pixel of a world point and its derivative by x and y: out = u, v, du/dx, du/dy, dv/dx, dv/dy."""
    xc = cam[0] * x + cam[1] * y + cam[2] * z + cam[9]
    yc = cam[3] * x + cam[4] * y + cam[5] * z + cam[10]
    zc = cam[6] * x + cam[7] * y + cam[8] * z + cam[11]
    a, b = xc / zc, yc / zc
    k1, k2, p1, p2, k3 = cam[17], cam[18], cam[19], cam[20], cam[21]
    r2 = a * a + b * b
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    slope = 2 * (k1 + r2 * (2 * k2 + 3 * r2 * k3))
    ad = a * radial + 2 * p1 * a * b + p2 * (r2 + 2 * a * a)
    bd = b * radial + p1 * (r2 + 2 * b * b) + 2 * p2 * a * b
    daa = radial + a * a * slope + 2 * p1 * b + 6 * p2 * a
    dab = a * b * slope + 2 * p1 * a + 2 * p2 * b
    dbb = radial + b * b * slope + 6 * p1 * b + 2 * p2 * a
    out[0] = cam[12] * ad + cam[13] * bd + cam[14] - cam[22]
    out[1] = cam[15] * bd + cam[16] - cam[23]
    for i in range(2):
        da = (cam[i] - a * cam[6 + i]) / zc
        db = (cam[3 + i] - b * cam[6 + i]) / zc
        dad, dbd = daa * da + dab * db, dab * da + dbb * db
        out[2 + i] = cam[12] * dad + cam[13] * dbd
        out[4 + i] = cam[15] * dbd


@compiled
def _lay(layout: Floats, xy: Floats, use: Ints, n: int, pose: Floats) -> None:
    """Least-squares pose (x, y, angle) over the markers in use; the angle is the one nearest to pose[2]."""
    ax = ay = bx = by = 0.0
    m = 0
    for i in range(n):
        if use[i]:
            ax += layout[i, 0]
            ay += layout[i, 1]
            bx += xy[i, 0]
            by += xy[i, 1]
            m += 1
    if m == 0:
        return
    ax, ay, bx, by = ax / m, ay / m, bx / m, by / m
    if m > 1:
        cross = dot = 0.0
        for i in range(n):
            if use[i]:
                px, py = layout[i, 0] - ax, layout[i, 1] - ay
                qx, qy = xy[i, 0] - bx, xy[i, 1] - by
                cross += px * qy - py * qx
                dot += px * qx + py * qy
        turn = math.atan2(cross, dot) - pose[2]
        pose[2] += turn - 2 * math.pi * round(turn / (2 * math.pi))
    c, s = math.cos(pose[2]), math.sin(pose[2])
    pose[0] = bx - c * ax + s * ay
    pose[1] = by - s * ax - c * ay


@compiled
def _worst(layout: Floats, xy: Floats, use: Ints, n: int, pose: Floats) -> tuple[int, float, float]:
    """Index and squared distance of the marker that fits the pose worst, and the sum of squares."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    worst, most, total = -1, -1.0, 0.0
    for i in range(n):
        if use[i]:
            dx = pose[0] + c * layout[i, 0] - s * layout[i, 1] - xy[i, 0]
            dy = pose[1] + s * layout[i, 0] + c * layout[i, 1] - xy[i, 1]
            d2 = dx * dx + dy * dy
            total += d2
            if d2 > most:
                worst, most = i, d2
    return worst, most, total


@compiled
def _robust_pose(layout: Floats, xy: Floats, use: Ints, n: int, gate: float, pose: Floats) -> tuple[int, float]:
    """Lay the body through its markers and leave out those that do not fit; how many stay, and their rms [m]."""
    scratch = np.empty(3)
    while True:
        m = 0
        for i in range(n):
            m += use[i]
        if m == 0:
            return 0, 0.0
        _lay(layout, xy, use, n, pose)
        _, most, total = _worst(layout, xy, use, n, pose)
        if m == 1 or most <= gate * gate:
            return m, math.sqrt(total / m)
        if m == 2:  # one of the two is wrong, and nothing says which
            for i in range(n):
                use[i] = 0
            return 0, 0.0
        drop, least = -1, 1e30
        for i in range(n):  # the one whose absence helps most: the worst residual may be an innocent neighbour's
            if use[i]:
                use[i] = 0
                scratch[:] = pose
                _lay(layout, xy, use, n, scratch)
                rest = _worst(layout, xy, use, n, scratch)[2]
                use[i] = 1
                if rest < least:
                    drop, least = i, rest
        use[drop] = 0


@compiled
def _same_disc(start: Floats, fit: Floats, sized: bool) -> bool:
    """Whether a fit is the disc it was started on: converged, as large, of the same polarity, its edge described."""
    if fit[OK] == 0.0 or fit[COVERAGE] < 0.9:
        return False
    change = ((start[2] * start[4] - start[3] ** 2) / (fit[2] * fit[4] - fit[3] ** 2)) ** 0.25
    if abs(change - 1.0) > (_FAR_COVERED if sized and fit[OUTLIERS] >= STRUCTURED else _FAR_RADIUS) or fit[CONTRAST] * start[CONTRAST] < 0.0:
        return False
    if max(fit[S11], fit[S22]) > 3.0 * max(start[S11], start[S22]) + 3.0:
        return False  # a blur that jumps is a shadow's edge taken for the disc's
    return fit[MISFIT] <= _MAX_MISFIT * abs(fit[CONTRAST]) + 2.0 * fit[NOISE] + 1.0


@compiled
def _find(image: NDArray[Any], start: Floats, hold_shape: bool, sized: bool, fit: Floats) -> bool:
    """Fit the marker that looked like `start` from where fit (1, 20) puts it; whether it is there.

    `sized`: the start's shape is that of a marker whose size is known, and may be relied upon.
    """
    u, v = fit[0, 0], fit[0, 1]
    if hold_shape and start[OUTLIERS] >= BY_SECTORS:  # last seen across an edge: the plain model fails there
        fit[0] = fit_by_sectors(image, fit[0], True)
        if _same_disc(start, fit[0], sized):
            return True
        fit[0] = start
        fit[0, 0], fit[0, 1] = u, v
    held = hold_shape and start[MISFIT] < _STALE_SHAPE * start[NOISE] + 0.3
    fit[:] = fit_discs(image, fit, 12, 0.001, held)
    if held and (fit[0, OK] == 0.0 or fit[0, MISFIT] > _STALE_SHAPE * min(fit[0, NOISE], start[NOISE]) + 0.3):
        fit[0] = start
        fit[0, 0], fit[0, 1] = u, v
        fit[:] = fit_discs(image, fit, 12, 0.001, False)
        held = False
    known = start[OK] > 0.0
    if _same_disc(start, fit[0], sized):
        if fit[0, OUTLIERS] >= STRUCTURED:  # another edge runs through: the sectors without it may know better
            again = fit[0].copy()
            if sized:
                again[M11:S11] = start[M11:S11]
            again = fit_by_sectors(image, again, sized)
            if _same_disc(start, again, sized) and again[SD] < fit[0, SD]:
                fit[0] = again
        return True
    if not held and known and fit[0, COVERAGE] > 0.9:
        # In a shadow's edge the shape fitted freely goes astray: keep the one it had.
        fit[0] = start
        fit[0, 0], fit[0, 1] = u, v
        fit[:] = fit_discs(image, fit, 12, 0.001, True)
        if _same_disc(start, fit[0], sized):
            return True
    fit[0] = start
    fit[0, 0], fit[0, 1] = u, v
    fit[0] = fit_by_sectors(image, fit[0], known)
    return _same_disc(start, fit[0], sized)


@compiled
def _circle_shape(at: Floats, radius_m: float, row: Floats) -> None:
    """The ellipse in which a horizontal circle of `radius_m` is seen: row[M11:S11], from the derivatives that `_project` gave."""
    a, b, c, d = at[2], at[3], at[4], at[5]
    scale = 1.0 / ((a * d - b * c) * radius_m) ** 2
    row[M11], row[M11 + 1], row[M11 + 2] = scale * (c * c + d * d), -scale * (a * c + b * d), scale * (a * a + b * b)


@compiled
def follow(
    image: NDArray[Any], cam: Floats, layout: Floats, first: Ints, active: Ints, pose: Floats, gate_m: Floats, starts: Floats,
    hold_shape: bool, radius_m: Floats, fits: Floats, xy: Floats, use: Ints, n_seen: Ints, rms_m: Floats, seen_m: Floats,
) -> None:  # fmt: skip
    """Look for every marker of the active bodies where `pose` puts it.

    Parameters
    ----------
    image : (h, w);  cam : `packed`;  layout : (n, 3) body frames;  first : (bodies + 1,) first marker of each body
    active : (bodies,) 0/1;  pose : (bodies, 3) expected x, y, angle: replaced by what is found
    gate_m : (bodies,) how far a marker may lie from its place in the body
    hold_shape : keep each marker's shape and blur of the frame before, where they still serve
    starts : (n, 20) fit of each marker when last seen, for its shape, blur and levels (radius 0: never seen)
    radius_m : (n,) radius of each marker where it is known, else 0: its shape follows from it while other edges run through
    fits (n, 20), xy (n, 2) world [m] on z = marker height, use (n,) 0/1 accepted, n_seen (bodies,), rms_m (bodies,), seen_m (n,)
    radius of each marker [m], 0 where other edges run through: out
    """
    at, start = np.empty(6), np.empty(N_FIT)
    for b in range(len(active)):
        if not active[b]:
            continue
        c, s = math.cos(pose[b, 2]), math.sin(pose[b, 2])
        lo, hi = first[b], first[b + 1]
        for i in range(lo, hi):
            use[i] = 0
            if starts[i, 2] <= 0.0:
                continue
            x = pose[b, 0] + c * layout[i, 0] - s * layout[i, 1]
            y = pose[b, 1] + s * layout[i, 0] + c * layout[i, 1]
            _project(cam, x, y, layout[i, 2], at)
            if not (-5.0 < at[0] < image.shape[1] + 5.0 and -5.0 < at[1] < image.shape[0] + 5.0):
                continue
            start[:] = starts[i]
            if radius_m[i] > 0.0 and start[OUTLIERS] >= STRUCTURED:
                _circle_shape(at, radius_m[i], start)
            fits[i] = start
            fits[i, 0], fits[i, 1] = at[0], at[1]
            seen_m[i] = 0.0
            if not _find(image, start, hold_shape, radius_m[i] > 0.0, fits[i:i + 1]):
                continue
            use[i] = 1
            du, dv = fits[i, 0] - at[0], fits[i, 1] - at[1]
            det = at[2] * at[5] - at[3] * at[4]
            if fits[i, OUTLIERS] < STRUCTURED:
                seen_m[i] = (fits[i, 2] * fits[i, 4] - fits[i, 3] ** 2) ** -0.25 / math.sqrt(abs(det))
            xy[i, 0] = x + (at[5] * du - at[3] * dv) / det
            xy[i, 1] = y + (at[2] * dv - at[4] * du) / det
        found, rms = _robust_pose(layout[lo:hi], xy[lo:hi], use[lo:hi], hi - lo, gate_m[b], pose[b])
        n_seen[b] = found
        rms_m[b] = rms


def empty_fits(n: int) -> np.ndarray:
    """Starts of n markers never seen."""
    return np.zeros((n, N_FIT))
