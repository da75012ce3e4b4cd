"""Free flight: the next contact, by closed form where there is one and by the integrator elsewhere."""

from __future__ import annotations

import math

from ovines.core import state as S
from ovines.core.compiled import Floats, Ints, compiled, inlined
from ovines.core.integration.disk_step import flight_step
from ovines.core.system import parameters as P
from ovines.core.system.host import ROTATION, host_after, host_starts, rows_of, sprung_response
from ovines.core.system.kinematics import in_host, place, relative_acceleration
from ovines.core.system.packed import System
from ovines.core.system.walls import gap_measure, safe_time

ROUNDING = 4e-16  # of a length: gaps below this are contact


@compiled
def glide(t0: float, s: float, y0: Floats, system: System, scratch: Floats, out: Floats) -> None:
    """Closed-form state ``s`` after ``y0``: no friction, no drag (energies are not touched)."""
    p, k = system.p, system.k
    host_starts(t0, y0, system, scratch)
    host_after(t0, s, y0, system, scratch)
    gx, gy = p[P.GRAVITY_X], p[P.GRAVITY_Y]
    out[S.X] = y0[S.X] + s * (y0[S.VX] + 0.5 * s * gx)
    out[S.Y] = y0[S.Y] + s * (y0[S.VY] + 0.5 * s * gy)
    out[S.VX] = y0[S.VX] + s * gx
    out[S.VY] = y0[S.VY] + s * gy
    out[S.ANGLE] = y0[S.ANGLE] + s * y0[S.SPIN]
    out[S.SPIN] = y0[S.SPIN]
    for i in range(P.ENERGIES, min(P.HOST, k[P.STATE_SIZE])):
        out[i] = y0[i]
    if k[P.STATE_SIZE] > P.HOST:
        out[P.HOST], out[P.HOST + S.Y], out[P.HOST + S.ANGLE] = (
            scratch[S.BASE_X],
            scratch[S.BASE_Y],
            scratch[S.BASE_ANGLE],
        )
        out[P.HOST + S.VX], out[P.HOST + S.VY], out[P.HOST + S.SPIN] = (
            scratch[S.BASE_VX],
            scratch[S.BASE_VY],
            scratch[S.BASE_SPIN],
        )


@compiled
def glide_in_host(
    t0: float, s: float, y0: Floats, system: System, scratch: Floats, at: Floats
) -> tuple[float, float, float, float]:
    """The same, only the centre in the Host's frame; ``scratch`` as :func:`host_starts` leaves it for ``y0``."""
    p, k = system.p, system.k
    host_after(t0, s, y0, system, scratch)
    gx, gy = p[P.GRAVITY_X], p[P.GRAVITY_Y]
    at[S.X] = y0[S.X] + s * (y0[S.VX] + 0.5 * s * gx)
    at[S.Y] = y0[S.Y] + s * (y0[S.VY] + 0.5 * s * gy)
    at[S.VX] = y0[S.VX] + s * gx
    at[S.VY] = y0[S.VY] + s * gy
    at[S.HOST_X], at[S.HOST_Y], at[S.HOST_ANGLE] = scratch[S.BASE_X], scratch[S.BASE_Y], scratch[S.BASE_ANGLE]
    at[S.HOST_VX], at[S.HOST_VY], at[S.HOST_SPIN] = scratch[S.BASE_VX], scratch[S.BASE_VY], scratch[S.BASE_SPIN]
    return in_host(at, k)


@compiled
def acceleration_bound(t0: float, y0: Floats, p: Floats, k: Ints, drive: Floats) -> float:
    """Bound on the relative acceleration in the Host's frame during a closed-form flight (m/s^2)."""
    bound = math.hypot(p[P.GRAVITY_X], p[P.GRAVITY_Y]) + p[P.HOST_ACCELERATION]
    spin, spin_rate = p[P.HOST_SPIN], p[P.HOST_SPIN_RATE]
    if k[P.HOST_KIND] == P.FREE:
        spin = abs(y0[P.HOST + S.SPIN])
    elif k[P.HOST_KIND] == P.SPRUNG:
        for axis in range(3):
            at, rate_at = rows_of(axis)
            at, rate_at = P.HOST + at, P.HOST + rate_at
            inverse = p[P.INVERSE_HOST_INERTIA] if axis == ROTATION else p[P.INVERSE_HOST_MASS]
            stiffness, damping = p[P.STIFFNESS_X + axis] * inverse, p[P.DAMPING_X + axis] * inverse
            q, rate = sprung_response(t0, axis, p, drive)
            # energy of the free part only falls, so v <= top, omega q <= top
            top = math.sqrt((y0[rate_at] - rate) ** 2 + stiffness * (y0[at] - q) ** 2)
            if axis == ROTATION:
                spin += top
                spin_rate += (damping + math.sqrt(stiffness)) * top
            else:
                bound += (damping + math.sqrt(stiffness)) * top
    if k[P.WALL_TURNS]:
        reach = 2.0 * p[P.LENGTH]
        fast = math.hypot(y0[S.VX], y0[S.VY]) + p[P.SPEED] + spin * reach
        bound += 2.0 * spin * fast + (spin_rate + spin * spin) * reach
    return bound


@compiled
def quiet_room(system: System, scratch: Floats) -> float:
    """Radius (m) of the circle in the room that a sprung round Host's wall cannot enter during a flight, less than 0
    where there is none: the contact radius less how far springs let it swing, steadily and from the flight's start.

    ``scratch``: as :func:`host_starts` leaves it.  The free part's energy only falls.
    """
    p, k, drive = system.p, system.k, system.drive
    if k[P.HOST_KIND] != P.SPRUNG or k[P.N_WALLS] > P.EDGES or p[P.OBSTACLE_RADIUS] > 0.0 or k[P.WALL_TURNS]:
        return -1.0
    if p[P.GRAVITY_X] != 0.0 or p[P.GRAVITY_Y] != 0.0 or p[P.WALL_SHAPE] != 0.0:
        return -1.0
    square = 0.0
    for axis in range(2):
        stiffness = p[P.STIFFNESS_X + axis] * p[P.INVERSE_HOST_MASS]
        damping = p[P.DAMPING_X + axis] * p[P.INVERSE_HOST_MASS]
        if stiffness <= 0.0:
            return -1.0
        swing = math.sqrt(scratch[S.FREE_PLACES + axis] ** 2 + scratch[S.FREE_RATES + axis] ** 2 / stiffness)
        for row in range(drive.shape[0]):
            if int(drive[row, P.AXIS]) == axis:
                omega = drive[row, P.OMEGA]
                real, imaginary = stiffness - omega * omega, damping * omega
                gain = (stiffness * stiffness + imaginary * imaginary) / (real * real + imaginary * imaginary)
                swing += abs(drive[row, P.AMPLITUDE]) * math.sqrt(gain)
        square += swing * swing
    offset = math.sqrt(p[P.WALL_X] ** 2 + p[P.WALL_Y] ** 2)
    return p[P.CONTACT_RADIUS] * (1.0 - 1e-12) - offset - math.sqrt(square)


@inlined
def leaves(room: float, x: float, y: float, vx: float, vy: float) -> float:
    """When a straight path leaves the circle of radius ``room`` about the origin (0 where it is not in it)."""
    inside, speed = room * room - x * x - y * y, vx * vx + vy * vy
    if inside <= 0.0 or speed == 0.0:
        return 0.0
    along = x * vx + y * vy
    return (math.sqrt(along * along + speed * inside) - along) / speed


@compiled
def glide_to_contact(
    t: float,
    y: Floats,
    end: float,
    grace: float,
    system: System,
    work: Floats,
) -> tuple[float, int]:
    """Duration of a closed-form flight until the next wall, and that wall (-1: ``end`` comes first).

    ``grace``: time at the start in which contact is not looked for (just released from a wall).
    """
    p, k, drive, polygon = system.p, system.k, system.drive, system.polygon
    bend = acceleration_bound(t, y, p, k, drive)
    remaining = end - t
    s = min(grace, remaining)
    tiny = ROUNDING * p[P.LENGTH]
    scratch, at = work[P.SCRATCH], work[P.PLACE]
    host_starts(t, y, system, scratch)
    room = quiet_room(system, scratch)
    horizon = remaining
    while s < remaining:
        x, yy, vx, vy = glide_in_host(t, s, y, system, scratch, at)
        if bend > 0.0:
            speed = math.hypot(vx, vy)
            horizon = 0.25 * (speed + math.sqrt(speed * speed + 8.0 * bend * p[P.LENGTH])) / bend
            if speed * horizon > 2.0 * p[P.LENGTH]:
                horizon = 2.0 * p[P.LENGTH] / speed
        advance = min(remaining - s, horizon)
        for wall in range(k[P.N_WALLS]):
            if not wall_stands(wall, p, k):
                continue
            f, rate = gap_measure(wall, x, yy, vx, vy, p, polygon)
            if f <= tiny and rate < 0.0:
                return s, wall
            advance = min(advance, safe_time(wall, x, yy, vx, vy, bend, advance, system))
        if room > 0.0:
            advance = max(advance, min(leaves(room, at[S.X], at[S.Y], at[S.VX], at[S.VY]), remaining - s))
        s += max(advance, 1e-16 * (t + s))
    return remaining, -1


@compiled
def wall_stands(wall: int, p: Floats, k: Ints) -> bool:
    """Whether this wall exists: round or polygon, obstacle if any."""
    if wall == P.ROUND:
        return k[P.N_WALLS] <= P.EDGES
    if wall == P.OBSTACLE:
        return p[P.OBSTACLE_RADIUS] > 0.0
    return True


@compiled
def relative(t: float, y: Floats, system: System, work: Floats, dy: Floats, out: Floats) -> None:
    """Centre in the Host's frame with rates: position, velocity, acceleration (6 numbers) from state and derivative."""
    k = system.k
    scratch, at = work[P.SCRATCH], work[P.PLACE]
    place(t, y, system, scratch, at)
    out[0], out[1], out[2], out[3] = in_host(at, k)
    ax, ay, turn = relative_acceleration(y, at, dy, k, scratch)
    if k[P.WALL_TURNS]:
        spin = at[S.HOST_SPIN]
        cosine, sine = math.cos(at[S.HOST_ANGLE]), math.sin(at[S.HOST_ANGLE])
        ax, ay = cosine * ax + sine * ay, cosine * ay - sine * ax
        ax += turn * out[1] + spin * spin * out[0] + 2.0 * spin * out[3]
        ay += -turn * out[0] + spin * spin * out[1] - 2.0 * spin * out[2]
    out[4], out[5] = ax, ay


@compiled
def quintic(a: Floats, b: Floats, h: float, axis: int, c: Floats) -> None:
    """Coefficients (in s/h) of the fifth-degree path through two ends' position, velocity, acceleration."""
    p0, v0, a0 = a[axis], a[2 + axis] * h, a[4 + axis] * h * h
    p1, v1, a1 = b[axis], b[2 + axis] * h, b[4 + axis] * h * h
    gap, rise, turn = p1 - p0 - v0 - 0.5 * a0, v1 - v0 - a0, a1 - a0
    c[0], c[1], c[2] = p0, v0, 0.5 * a0
    c[3] = 10.0 * gap - 4.0 * rise + 0.5 * turn
    c[4] = -15.0 * gap + 7.0 * rise - turn
    c[5] = 6.0 * gap - 3.0 * rise + 0.5 * turn


@inlined
def stays_clear(a: Floats, b: Floats, h: float, p: Floats, k: Ints) -> bool:
    """Whether the quintic path of a step in a round Host surely keeps off the wall, and there is nothing else to hit.

    A path lies in the hull of its Bernstein points; where these are inside a circle, it is.
    """
    if k[P.N_WALLS] > P.EDGES or p[P.OBSTACLE_RADIUS] > 0.0:
        return False
    room = p[P.CONTACT_RADIUS] * (1.0 - p[P.WALL_DEPTH])
    first, second = h / 5.0, h * h / 20.0
    square = 0.0
    for end, way in ((a, first), (b, -first)):
        x, y = end[0] - p[P.WALL_X], end[1] - p[P.WALL_Y]
        square = max(square, x * x + y * y)
        x, y = x + way * end[2], y + way * end[3]
        square = max(square, x * x + y * y)
        x, y = x + way * end[2] + second * end[4], y + way * end[3] + second * end[5]
        square = max(square, x * x + y * y)
    return square < room * room


@compiled
def first_crossing(
    a: Floats, b: Floats, h: float, start: float, system: System, cx: Floats, cy: Floats
) -> tuple[float, int]:
    """First contact on the quintic path of one step (time after the step's start, wall), or (h, -1)."""
    p, k, polygon = system.p, system.k, system.polygon
    if stays_clear(a, b, h, p, k):
        return h, -1
    quintic(a, b, h, 0, cx)
    quintic(a, b, h, 1, cy)
    bend = 0.0
    for m in range(2, 6):
        bend += m * (m - 1) * math.sqrt(cx[m] * cx[m] + cy[m] * cy[m])
    bend /= h * h
    tiny = ROUNDING * p[P.LENGTH]
    s = start
    while s < h:
        u = s / h
        x = cx[0] + u * (cx[1] + u * (cx[2] + u * (cx[3] + u * (cx[4] + u * cx[5]))))
        yy = cy[0] + u * (cy[1] + u * (cy[2] + u * (cy[3] + u * (cy[4] + u * cy[5]))))
        vx = (cx[1] + u * (2.0 * cx[2] + u * (3.0 * cx[3] + u * (4.0 * cx[4] + u * 5.0 * cx[5])))) / h
        vy = (cy[1] + u * (2.0 * cy[2] + u * (3.0 * cy[3] + u * (4.0 * cy[4] + u * 5.0 * cy[5])))) / h
        advance = h - s
        for wall in range(k[P.N_WALLS]):
            if not wall_stands(wall, p, k):
                continue
            f, rate = gap_measure(wall, x, yy, vx, vy, p, polygon)
            if f <= tiny and rate < 0.0:
                return s, wall
            advance = min(advance, safe_time(wall, x, yy, vx, vy, bend, advance, system))
        s += max(advance, 1e-16 * h)
    return h, -1


@compiled
def land(
    t: float,
    y: Floats,
    guess: float,
    h: float,
    wall: int,
    system: System,
    work: Floats,
    out: Floats,
) -> tuple[float, bool]:
    """Refine a contact by stepping to it from the step's start: (duration, whether it is a contact).

    Newton on the integrator itself, so the contact has the integrator's accuracy, not the interpolant's.
    ``out`` is the state there: the last instant inside, to rounding.
    """
    p, k, polygon = system.p, system.k, system.polygon
    tiny = ROUNDING * p[P.LENGTH]
    s, known = guess, h
    for _ in range(12):
        flight_step(t, y, s, known, system, work, out)
        known = s
        place(t + s, out, system, work[P.SCRATCH], work[P.PLACE])
        x, yy, vx, vy = in_host(work[P.PLACE], k)
        f, rate = gap_measure(wall, x, yy, vx, vy, p, polygon)
        if abs(f) <= 4.0 * tiny and rate < 0.0:
            return s, True
        if rate >= 0.0:
            break
        change = -f / rate
        if abs(change) <= 2e-16 * (t + s):
            return s, True
        s = min(max(s + change, 0.25 * s), h)
    return s, f <= 4.0 * tiny and rate < 0.0


@compiled
def rest_speed(y: Floats, p: Floats) -> float:
    """Speed that decides whether the disk rests: sliding, and the rim where the floor brakes it too."""
    sliding = math.hypot(y[S.VX], y[S.VY])
    return math.hypot(sliding, p[P.RADIUS] * y[S.SPIN]) if p[P.COUPLING] > 0.0 else sliding
