"""A body on its plane as one camera sees it: where a world point appears, and the pose (x, y, angle) fitted to
its markers.

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

X, Y, ANGLE = range(3)  # of a pose [m, m, rad]
# A camera as compiled code takes it: rotation, translation, camera matrix, distortion, window's offset.
# fmt: off
(
    R11, R12, R13, R21, R22, R23, R31, R32, R33, TX, TY, TZ,
    FX, SKEW, CX, FY, CY, K1, K2, P1, P2, K3, K4, K5, K6, S1, S2, S3, S4, OFFSET_U, OFFSET_V,
) = range(31)
# fmt: on
N_CAMERA = 31
# What `project` gives: window pixel, and its derivatives by the world's x and y.
AT_U, AT_V, DU_DX, DU_DY, DV_DX, DV_DY = range(6)
N_PROJECTED = 6
_NOWHERE = 1e30  # more than any sum of squares


def packed(camera: Camera, window_offset_px: tuple[int, int]) -> np.ndarray:
    """The camera as numbers (N_CAMERA,) for compiled code.

    Without its spline: predictions only say where a marker is looked for, and what is found there counts.
    """
    k = camera.matrix
    return np.concatenate(
        [
            np.ravel(camera.rotation),
            camera.translation_m,
            [k[0, 0], k[0, 1], k[0, 2], k[1, 1], k[1, 2]],
            camera.distortion,
            np.zeros(OFFSET_U - K1 - len(camera.distortion)),  # a plainer lens is one without these terms
            window_offset_px,
        ]
    ).astype(float)


@compiled
def project(cam: Floats, x: float, y: float, z: float, out: Floats) -> None:
    """Window pixel of a world point and its derivative by x and y: `out` (N_PROJECTED,)."""
    xc = cam[R11] * x + cam[R12] * y + cam[R13] * z + cam[TX]
    yc = cam[R21] * x + cam[R22] * y + cam[R23] * z + cam[TY]
    zc = cam[R31] * x + cam[R32] * y + cam[R33] * z + cam[TZ]
    a, b = xc / zc, yc / zc
    k1, k2, p1, p2, k3 = cam[K1], cam[K2], cam[P1], cam[P2], cam[K3]
    r2 = a * a + b * b
    below = 1 + r2 * (cam[K4] + r2 * (cam[K5] + r2 * cam[K6]))
    radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / below
    slope = 2 * (k1 + r2 * (2 * k2 + 3 * r2 * k3))
    slope = (slope - radial * 2 * (cam[K4] + r2 * (2 * cam[K5] + 3 * r2 * cam[K6]))) / below
    ad = a * radial + 2 * p1 * a * b + p2 * (r2 + 2 * a * a) + r2 * (cam[S1] + r2 * cam[S2])
    bd = b * radial + p1 * (r2 + 2 * b * b) + 2 * p2 * a * b + r2 * (cam[S3] + r2 * cam[S4])
    across, down = 2 * (cam[S1] + 2 * cam[S2] * r2), 2 * (cam[S3] + 2 * cam[S4] * r2)
    daa = radial + a * a * slope + 2 * p1 * b + 6 * p2 * a + across * a
    dab = a * b * slope + 2 * p1 * a + 2 * p2 * b + across * b
    dba = a * b * slope + 2 * p1 * a + 2 * p2 * b + down * a
    dbb = radial + b * b * slope + 6 * p1 * b + 2 * p2 * a + down * b
    out[AT_U] = cam[FX] * ad + cam[SKEW] * bd + cam[CX] - cam[OFFSET_U]
    out[AT_V] = cam[FY] * bd + cam[CY] - cam[OFFSET_V]
    for i in range(2):
        da = (cam[R11 + i] - a * cam[R31 + i]) / zc
        db = (cam[R21 + i] - b * cam[R31 + i]) / zc
        dad, dbd = daa * da + dab * db, dba * da + dbb * db
        out[DU_DX + i] = cam[FX] * dad + cam[SKEW] * dbd
        out[DV_DX + i] = cam[FY] * dbd


@compiled
def px2_per_m2(at: Floats) -> float:
    """Determinant of the derivatives that `project` gave: pixels per square metre of the plane, with its sign."""
    return at[DU_DX] * at[DV_DY] - at[DU_DY] * at[DV_DX]


@compiled
def wrapped_turn(one_rad: float, other_rad: float) -> float:
    """Turn from the other angle to the one, without whole turns."""
    turn = one_rad - other_rad
    return turn - 2.0 * math.pi * round(turn / (2.0 * math.pi))


@compiled
def _fit_pose(layout: Floats, xy: Floats, use: Ints, n: int, pose: Floats) -> None:
    """Least-squares pose (x, y, angle) over the markers in use; the angle is the one nearest to the pose's."""
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
        pose[ANGLE] += wrapped_turn(math.atan2(cross, dot), pose[ANGLE])
    c, s = math.cos(pose[ANGLE]), math.sin(pose[ANGLE])
    pose[X] = bx - c * ax + s * ay
    pose[Y] = by - s * ax - c * ay


@compiled
def _worst_residual(layout: Floats, xy: Floats, use: Ints, n: int, pose: Floats) -> tuple[int, float, float]:
    """Index and squared distance of the marker that fits the pose worst, and the sum of squares."""
    c, s = math.cos(pose[ANGLE]), math.sin(pose[ANGLE])
    worst, most, total = -1, -1.0, 0.0
    for i in range(n):
        if use[i]:
            dx = pose[X] + c * layout[i, 0] - s * layout[i, 1] - xy[i, 0]
            dy = pose[Y] + s * layout[i, 0] + c * layout[i, 1] - xy[i, 1]
            d2 = dx * dx + dy * dy
            total += d2
            if d2 > most:
                worst, most = i, d2
    return worst, most, total


@compiled
def robust_pose(layout: Floats, xy: Floats, use: Ints, n: int, gate: float, pose: Floats) -> tuple[int, float]:
    """Fit the body's pose to its markers and leave out those that lie off by more than `gate` [m]; how many stay, and
    their rms [m].
    """
    scratch = np.empty(3)
    while True:
        m = 0
        for i in range(n):
            m += use[i]
        if m == 0:
            return 0, 0.0
        _fit_pose(layout, xy, use, n, pose)
        _, most, total = _worst_residual(layout, xy, use, n, pose)
        if m == 1 or most <= gate * gate:
            return m, math.sqrt(total / m)
        if m == 2:  # one of the two is wrong, and nothing says which
            for i in range(n):
                use[i] = 0
            return 0, 0.0
        drop, least = -1, _NOWHERE
        for i in range(n):  # the one whose absence helps most: the worst residual may be an innocent neighbour's
            if use[i]:
                use[i] = 0
                scratch[:] = pose
                _fit_pose(layout, xy, use, n, scratch)
                rest = _worst_residual(layout, xy, use, n, scratch)[2]
                use[i] = 1
                if rest < least:
                    drop, least = i, rest
        use[drop] = 0
