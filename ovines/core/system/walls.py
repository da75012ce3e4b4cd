"""Walls as the disk's centre sees them: gap, normal, curvature, in the Host's frame.

Every wall is fixed in the Host, so all is done in its frame: ``x, y`` is the disk's geometric centre there.
"""

from __future__ import annotations

import math

from ovines.core.compiled import Floats, compiled
from ovines.core.system import parameters as P
from ovines.core.system.packed import System


@compiled
def gap_measure(wall: int, x: float, y: float, vx: float, vy: float, p: Floats, polygon: Floats) -> tuple[float, float]:
    """A smooth function that is positive inside and zero in contact, and its rate.

    Round walls: half the difference of squared radii over the contact radius, which is a length, has the
    gap's slope at the wall, and is a polynomial of the position; edges: the distance itself.
    """
    if wall == P.ROUND:
        radius = p[P.CONTACT_RADIUS]
        x -= p[P.WALL_X]
        y -= p[P.WALL_Y]
        square = x * x + y * y
        rate = x * vx + y * vy
        if p[P.WALL_SHAPE] == 0.0 or square == 0.0:
            return 0.5 * (radius - square / radius), -rate / radius
        stretch, slope, _bend = stretched(x, y, p)
        turning = (x * vy - y * vx) / square
        return (
            0.5 * (radius * stretch * stretch - square / radius),
            radius * stretch * slope * turning - rate / radius,
        )
    if wall == P.OBSTACLE:
        radius = p[P.OBSTACLE_RADIUS]
        return 0.5 * ((x * x + y * y) / radius - radius), (x * vx + y * vy) / radius
    edge = wall - P.EDGES
    nx, ny = polygon[edge, 0], polygon[edge, 1]
    return polygon[edge, 2] - nx * x - ny * y, -nx * vx - ny * vy


@compiled
def stretched(x: float, y: float, p: Floats) -> tuple[float, float, float]:
    """Contact radius over the round one, 1 + e cos 2(azimuth - phi) and lobes likewise, and its first and second
    derivative with azimuth (effects ``wall_ellipticity``, ``wall_lobes``).
    """
    azimuth = math.atan2(y, x)
    angle = 2.0 * (azimuth - p[P.ELLIPSE_DIRECTION])
    oval = p[P.ELLIPTICITY] * math.cos(angle)
    slope = -2.0 * p[P.ELLIPTICITY] * math.sin(angle)
    value, bend = 1.0 + oval, -4.0 * oval
    for i in range(int(p[P.LOBES])):
        size, order = p[P.LOBE_TABLE + 3 * i], p[P.LOBE_TABLE + 3 * i + 1]
        angle = order * (azimuth - p[P.LOBE_TABLE + 3 * i + 2])
        lobe = size * math.cos(angle)
        value, bend = value + lobe, bend - order * order * lobe
        slope -= order * size * math.sin(angle)
    return value, slope, bend


@compiled
def contact_frame(wall: int, x: float, y: float, p: Floats, polygon: Floats) -> tuple[float, float, float, float]:
    """Unit normal towards the wall (two numbers), gap (m) to first order, curvature of the allowed region (1/m).

    Curvature is that of the path of the centre along the wall: 1/R_c round, 0 flat, negative on the obstacle.
    """
    if wall == P.ROUND:
        x -= p[P.WALL_X]
        y -= p[P.WALL_Y]
        distance = math.hypot(x, y)
        radius = p[P.CONTACT_RADIUS]
        if distance == 0.0:
            return 1.0, 0.0, radius, 1.0 / radius
        nx, ny = x / distance, y / distance
        if p[P.WALL_SHAPE] == 0.0:
            return nx, ny, radius - distance, 1.0 / radius
        stretch, slope, bend = stretched(x, y, p)
        rho, d_rho, dd_rho = radius * stretch, radius * slope, radius * bend
        steep = math.hypot(rho, d_rho)
        cosine, sine = rho / steep, -d_rho / steep
        curvature = (rho * rho + 2.0 * d_rho * d_rho - rho * dd_rho) / steep**3
        return nx * cosine - ny * sine, ny * cosine + nx * sine, (rho - distance) * cosine, curvature
    if wall == P.OBSTACLE:
        distance = math.hypot(x, y)
        if distance == 0.0:
            return -1.0, 0.0, -p[P.OBSTACLE_RADIUS], -1.0 / p[P.OBSTACLE_RADIUS]
        return -x / distance, -y / distance, distance - p[P.OBSTACLE_RADIUS], -1.0 / p[P.OBSTACLE_RADIUS]
    edge = wall - P.EDGES
    nx, ny = polygon[edge, 0], polygon[edge, 1]
    return nx, ny, polygon[edge, 2] - nx * x - ny * y, 0.0


@compiled
def safe_time(
    wall: int, x: float, y: float, vx: float, vy: float, bend: float, horizon: float, system: System
) -> float:
    """A time no longer than ``horizon`` within which this wall cannot be reached.

    ``bend`` bounds the acceleration in the Host's frame.  The gap measure f has |f''| bounded by M
    on the horizon, so f(s) >= f + f' s - M s^2/2: its positive root is safe.  Conservative advancement
    converges quadratically at a transversal contact and cannot step over a graze.
    """
    p, polygon = system.p, system.polygon
    f, rate = gap_measure(wall, x, y, vx, vy, p, polygon)
    if wall >= P.EDGES:
        bound = bend
    else:
        speed = math.hypot(vx, vy)
        radius = p[P.CONTACT_RADIUS] if wall == P.ROUND else p[P.OBSTACLE_RADIUS]
        if wall == P.ROUND and p[P.WALL_SHAPE] != 0.0:
            e = p[P.WALL_SHAPE]
            distance = math.hypot(x - p[P.WALL_X], y - p[P.WALL_Y])
            inner = radius * (1.0 - p[P.WALL_DEPTH])
            if distance < 0.6 * inner:  # the ellipse's measure is rough near the centre: go by displacement alone
                room = inner - distance
                return min(horizon, 2.0 * room / (speed + math.sqrt(speed * speed + 2.0 * bend * room)))
            top = speed + bend * horizon
            bound = (1.0 + 32.0 * e) * (top * top / radius + bend * (1.0 + e))
        else:
            top = speed + bend * horizon
            bound = top * top / radius + bend
            if wall == P.OBSTACLE:  # f'' = (v^2 + r.a)/R: only the second term can bring the wall nearer
                bound = bend * p[P.LENGTH] / radius
    f = max(f, 0.0) + 1e-16 * p[P.LENGTH]  # rounding: without it a graze would stop time
    root = rate * rate + 2.0 * bound * f
    if rate >= 0.0:
        if bound == 0.0:
            return horizon
        return min(horizon, (rate + math.sqrt(root)) / bound)
    return min(horizon, 2.0 * f / (math.sqrt(root) - rate))
