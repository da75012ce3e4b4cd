"""Where the disk is and how its contact moves: places, normals, lever arms, the contact's velocity and inverse mass."""

from __future__ import annotations

import math

import numpy as np

from ovines.core import state as S
from ovines.core.compiled import Floats, Ints, compiled, inlined
from ovines.core.system import parameters as P
from ovines.core.system.host import base_motion
from ovines.core.system.packed import Face, System
from ovines.core.system.walls import contact_frame

N_SCRATCH = S.FREE_RATES + 3  # base motion, then what `dynamics.derivatives` or `host.host_starts` leaves


@inlined
def place(t: float, y: Floats, system: System, scratch: Floats, out: Floats) -> None:
    """Disk's geometric centre and the Host in the world at state ``y``.

    ``out``: 0-3 centre's position and velocity, 4-9 Host x, y, angle and rates, 10-11 mass offset (world).
    A driven Host's motion is left in ``scratch`` (BASE_X to BASE_SPIN_RATE).
    """
    p, k, drive, table = system.p, system.k, system.drive, system.table
    kind = k[P.HOST_KIND]
    if kind == P.DRIVEN:
        base_motion(t, k, drive, table, scratch)
        for i in range(6):
            out[S.HOST_X + i] = scratch[S.BASE_X + i]
    elif kind == P.FIXED:
        for i in range(6):
            out[S.HOST_X + i] = 0.0
    else:
        out[S.HOST_X], out[S.HOST_Y], out[S.HOST_ANGLE] = y[P.HOST], y[P.HOST + S.Y], y[P.HOST + S.ANGLE]
        out[S.HOST_VX], out[S.HOST_VY], out[S.HOST_SPIN] = y[P.HOST + S.VX], y[P.HOST + S.VY], y[P.HOST + S.SPIN]
    out[S.X], out[S.Y], out[S.VX], out[S.VY] = y[S.X], y[S.Y], y[S.VX], y[S.VY]
    out[S.OFF_X], out[S.OFF_Y] = 0.0, 0.0
    if k[P.OFF_CENTRE]:
        cosine, sine = math.cos(y[S.ANGLE]), math.sin(y[S.ANGLE])
        dx = cosine * p[P.MASS_X] - sine * p[P.MASS_Y]
        dy = sine * p[P.MASS_X] + cosine * p[P.MASS_Y]
        out[S.X] -= dx
        out[S.Y] -= dy
        out[S.VX] += y[S.SPIN] * dy
        out[S.VY] -= y[S.SPIN] * dx
        out[S.OFF_X], out[S.OFF_Y] = dx, dy


@inlined
def in_host(at: Floats, k: Ints) -> tuple[float, float, float, float]:
    """Centre's position and velocity in the Host's frame; turned only where the walls are not round."""
    x, y = at[S.X] - at[S.HOST_X], at[S.Y] - at[S.HOST_Y]
    vx, vy = at[S.VX] - at[S.HOST_VX], at[S.VY] - at[S.HOST_VY]
    if k[P.WALL_TURNS]:
        vx += at[S.HOST_SPIN] * y
        vy -= at[S.HOST_SPIN] * x
        cosine, sine = math.cos(at[S.HOST_ANGLE]), math.sin(at[S.HOST_ANGLE])
        return cosine * x + sine * y, cosine * y - sine * x, cosine * vx + sine * vy, cosine * vy - sine * vx
    return x, y, vx, vy


@compiled
def placed_in_host(
    t: float, y: Floats, system: System, scratch: Floats, at: Floats
) -> tuple[float, float, float, float]:
    """`place` and then `in_host`, for Python: what is inlined would be compiled anew in every process that calls it."""
    place(t, y, system, scratch, at)
    x, y_host, vx, vy = in_host(at, system.k)
    return x, y_host, vx, vy


@compiled
def normal_here(wall: int, at: Floats, p: Floats, k: Ints, polygon: Floats) -> Face:
    """The wall as the disk meets it at a placed state, in the world."""
    x, y, _vx, _vy = in_host(at, k)
    nx, ny, gap, curvature = contact_frame(wall, x, y, p, polygon)
    if k[P.WALL_TURNS]:
        cosine, sine = math.cos(at[S.HOST_ANGLE]), math.sin(at[S.HOST_ANGLE])
        return Face(cosine * nx - sine * ny, sine * nx + cosine * ny, gap, curvature)
    return Face(nx, ny, gap, curvature)


@compiled
def levers(face: Face, at: Floats, p: Floats) -> tuple[float, float, float, float]:
    """Contact point from the NES's centre of mass and from the Host's centre, each along normal and tangent."""
    nx, ny = face.x, face.y
    radius = p[P.RADIUS]
    host_n = (at[S.X] - at[S.HOST_X]) * nx + (at[S.Y] - at[S.HOST_Y]) * ny + radius
    host_t = -(at[S.X] - at[S.HOST_X]) * ny + (at[S.Y] - at[S.HOST_Y]) * nx
    if (
        abs(host_t) < 1e-15 * host_n
    ):  # a round wall's normal goes through the Host's centre: no torque, not a rounded one
        host_t = 0.0
    return radius - at[S.OFF_X] * nx - at[S.OFF_Y] * ny, at[S.OFF_X] * ny - at[S.OFF_Y] * nx, host_n, host_t


@compiled
def inverse_mass(face: Face, at: Floats, p: Floats) -> tuple[float, float, float]:
    """Contact's inverse mass matrix (k_nn, k_nt, k_tt; 1/kg): what an impulse does to the contact's velocity."""
    nes_n, nes_t, host_n, host_t = levers(face, at, p)
    mass = 1.0 / p[P.MASS] + p[P.INVERSE_HOST_MASS]
    nes, host = 1.0 / p[P.INERTIA], p[P.INVERSE_HOST_INERTIA]
    return (
        mass + nes_t * nes_t * nes + host_t * host_t * host,
        -(nes_n * nes_t * nes + host_n * host_t * host),
        mass + nes_n * nes_n * nes + host_n * host_n * host,
    )


@compiled
def contact_velocity(face: Face, spin: float, at: Floats, p: Floats) -> tuple[float, float]:
    """Velocity of the NES's contact point relative to the wall's, along normal (towards it) and tangent (88)."""
    nx, ny = face.x, face.y
    x, y = at[S.X] - at[S.HOST_X], at[S.Y] - at[S.HOST_Y]
    vx, vy = at[S.VX] - at[S.HOST_VX] + at[S.HOST_SPIN] * y, at[S.VY] - at[S.HOST_VY] - at[S.HOST_SPIN] * x
    return vx * nx + vy * ny, vy * nx - vx * ny + p[P.RADIUS] * (spin - at[S.HOST_SPIN])


@compiled
def wall_and_centre(face: Face, at: Floats) -> tuple[float, float]:
    """Speed of the wall at the disk's centre along its outward normal, and of that centre along the wall (m/s)."""
    x, y = at[S.X] - at[S.HOST_X], at[S.Y] - at[S.HOST_Y]
    wx, wy = at[S.HOST_VX] - at[S.HOST_SPIN] * y, at[S.HOST_VY] + at[S.HOST_SPIN] * x
    return wx * face.x + wy * face.y, (at[S.VY] - wy) * face.x - (at[S.VX] - wx) * face.y


@compiled
def relative_acceleration(y: Floats, at: Floats, dy: Floats, k: Ints, scratch: Floats) -> tuple[float, float, float]:
    """Acceleration of the disk's geometric centre less the Host's (world axes), and the Host's angular one.

    ``dy``: derivative of the state ``y`` placed in ``at``; ``scratch``: a driven Host's motion, as `place` leaves it.
    """
    ax, ay = dy[S.VX], dy[S.VY]
    if k[P.OFF_CENTRE]:
        ax += dy[S.SPIN] * at[S.OFF_Y] + y[S.SPIN] * y[S.SPIN] * at[S.OFF_X]
        ay += -dy[S.SPIN] * at[S.OFF_X] + y[S.SPIN] * y[S.SPIN] * at[S.OFF_Y]
    turn = 0.0
    if k[P.HOST_KIND] == P.DRIVEN:
        ax -= scratch[S.BASE_AX]
        ay -= scratch[S.BASE_AY]
        turn = scratch[S.BASE_SPIN_RATE]
    elif k[P.HOST_KIND] != P.FIXED:
        ax -= dy[P.HOST + S.VX]
        ay -= dy[P.HOST + S.VY]
        turn = dy[P.HOST + S.SPIN]
    return ax, ay, turn


def empty_scratch() -> tuple[np.ndarray, np.ndarray]:
    """Scratch and place vectors of the right sizes."""
    return np.zeros(N_SCRATCH), np.zeros(12)
