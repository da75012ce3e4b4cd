"""A body on its plane as one camera sees it: where a world point appears, and the pose (x, y, angle) laid through
markers.

Compiled, without Python's lock, so that both cameras run side by side while pictures are decoded.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ovines.camera import Camera
from vision.compiled import compiled

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def packed(camera: Camera, window_offset_px: tuple[int, int]) -> np.ndarray:
    """The camera as 24 numbers for compiled code: rotation 9, translation 3, fx, skew, cx, fy, cy, distortion 5, offset
    2.
    """
    k = camera.matrix
    return np.concatenate(
        [
            np.ravel(camera.rotation),
            camera.translation_m,
            [k[0, 0], k[0, 1], k[0, 2], k[1, 1], k[1, 2]],
            camera.distortion,
            window_offset_px,
        ]
    ).astype(float)


@compiled
def project(cam: Floats, x: float, y: float, z: float, out: Floats) -> None:
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
def robust_pose(layout: Floats, xy: Floats, use: Ints, n: int, gate: float, pose: Floats) -> tuple[int, float]:
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
