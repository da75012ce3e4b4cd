"""Forces and accelerations: the right-hand side of motion in flight, along a wall, and pressed into it."""

from __future__ import annotations

import math

import numpy as np

from ovines.core import state as S
from ovines.core.compiled import Floats, Ints, compiled, inlined, making_arrays
from ovines.core.laws import words as W
from ovines.core.laws.kernel import push as push_law
from ovines.core.system import parameters as P
from ovines.core.system.friction import floor_friction
from ovines.core.system.host import ROTATION, base_motion, rows_of, vertical_acceleration
from ovines.core.system.kinematics import (
    contact_velocity,
    inverse_mass,
    levers,
    normal_here,
    place,
    relative_acceleration,
)
from ovines.core.system.known import known_of
from ovines.core.system.packed import Contact, Face, System

# what `derivatives` leaves in its scratch vector: base motion, then contact figures
PUSH, RUB, NEED, SLIP = range(S.N_BASE, S.N_BASE + 4)  # wall force N, tangential force, force to roll, slip velocity


@inlined
def free_accelerations(t: float, y: Floats, at: Floats, system: System, scratch: Floats, dy: Floats) -> None:
    """Fill ``dy`` with the motion without wall force, Host included, and the powers of friction, drag and drive."""
    p, k = system.p, system.k
    for i in range(k[P.STATE_SIZE]):
        dy[i] = 0.0
    mass = p[P.MASS]
    dy[S.X], dy[S.Y], dy[S.ANGLE] = y[S.VX], y[S.VY], y[S.SPIN]
    dy[S.VX], dy[S.VY] = p[P.GRAVITY_X], p[P.GRAVITY_Y]
    kind = k[P.HOST_KIND]
    moving = kind == P.FREE or kind == P.SPRUNG
    if p[P.VISCOUS_DRAG] != 0.0 or p[P.AIR_DRAG] != 0.0:
        speed = math.hypot(y[S.VX], y[S.VY])
        rate = p[P.VISCOUS_DRAG] + p[P.AIR_DRAG] * speed
        dy[S.VX] -= rate * y[S.VX]
        dy[S.VY] -= rate * y[S.VY]
        if k[P.STATE_SIZE] > 6:
            dy[P.LOST_DRAG] = mass * rate * speed * speed
    if kind == P.SPRUNG:
        springs(t, y, system, scratch, dy)
    if moving:
        dy[P.HOST], dy[P.HOST + S.Y], dy[P.HOST + S.ANGLE] = y[P.HOST + S.VX], y[P.HOST + S.VY], y[P.HOST + S.SPIN]
    before_x, before_y, before_spin = dy[S.VX], dy[S.VY], dy[S.SPIN]
    if p[P.FLOOR_FRICTION] > 0.0:
        floor(t, y, at, system, moving, dy)
    if system.law.shape[0] > 0:
        written(t, y, at, system, scratch, (dy[S.VX] - before_x, dy[S.VY] - before_y, dy[S.SPIN] - before_spin), dy)


@inlined
def floor(t: float, y: Floats, at: Floats, system: System, moving: bool, dy: Floats) -> None:
    """Add the floor's friction to ``dy``: on the NES at its geometric centre, back on a movable Host."""
    p, k, drive, table = system.p, system.k, system.drive, system.table
    mass = p[P.MASS]
    load = p[P.FLOOR_LOAD]
    vx, vy, spin = at[S.VX], at[S.VY], y[S.SPIN]
    floor_vx, floor_vy, floor_spin = 0.0, 0.0, 0.0
    if not k[P.ON_GROUND]:
        floor_vx = at[S.HOST_VX] - at[S.HOST_SPIN] * (at[S.Y] - at[S.HOST_Y])
        floor_vy = at[S.HOST_VY] + at[S.HOST_SPIN] * (at[S.X] - at[S.HOST_X])
        floor_spin = at[S.HOST_SPIN]
        load = max(load + vertical_acceleration(t, k, drive, table), 0.0)
    strength = max(p[P.FLOOR_FRICTION] * (1.0 + p[P.DRIFT_PER_S] * t), 0.0) * load
    if p[P.ROCKING] != 0.0:
        strength *= 1.0 + p[P.ROCKING] * math.exp(-(t - p[P.LAST_IMPACT]) / p[P.ROCKING_S])
    ax, ay, torque = floor_friction(
        vx - floor_vx, vy - floor_vy, spin - floor_spin, p[P.RADIUS], strength, p[P.REGULARISATION], p[P.COUPLING]
    )
    dy[S.VX] += ax
    dy[S.VY] += ay
    dy[S.SPIN] += (torque - at[S.OFF_X] * ay + at[S.OFF_Y] * ax) * mass / p[P.INERTIA]
    size = k[P.STATE_SIZE]
    if size > 6:
        dy[P.LOST_SLIDING] -= mass * (ax * (vx - floor_vx) + ay * (vy - floor_vy))
        dy[P.LOST_SPINNING] -= mass * torque * (spin - floor_spin)
        if not moving:
            dy[P.WORK] += mass * (ax * floor_vx + ay * floor_vy + torque * floor_spin)
    if moving and not k[P.ON_GROUND]:
        dy[P.HOST + S.VX] -= ax * mass * p[P.INVERSE_HOST_MASS]
        dy[P.HOST + S.VY] -= ay * mass * p[P.INVERSE_HOST_MASS]
        arm = (at[S.X] - at[S.HOST_X]) * ay - (at[S.Y] - at[S.HOST_Y]) * ax
        dy[P.HOST + S.SPIN] -= (torque + arm) * mass * p[P.INVERSE_HOST_INERTIA]


@making_arrays
def written(
    t: float,
    y: Floats,
    at: Floats,
    system: System,
    scratch: Floats,
    friction: tuple[float, float, float],
    dy: Floats,
) -> None:
    """Add the terms of written laws to ``dy``, beside what the floor's ``friction`` gives (x, y, spin); their power
    counts as drag.  They act on the disk alone.
    """
    p, k, law = system.p, system.k, system.law
    known, out = known_of(t, y, at, scratch, p, k), np.zeros(3)
    known[W.FX], known[W.FY], known[W.FT] = friction
    for j in range(law.shape[0]):
        push_law(law[j], 1.0, known, out)
    dy[S.VX] += out[0]
    dy[S.VY] += out[1]
    dy[S.SPIN] += out[2]
    if k[P.STATE_SIZE] > 6:
        dy[P.LOST_DRAG] -= p[P.MASS] * (out[0] * y[S.VX] + out[1] * y[S.VY]) + p[P.INERTIA] * out[2] * y[S.SPIN]


@compiled
def springs(t: float, y: Floats, system: System, scratch: Floats, dy: Floats) -> None:
    """Suspension of a sprung Host on the moving ground, with the powers of dampers and ground."""
    p, k, drive, table = system.p, system.k, system.drive, system.table
    base_motion(t, k, drive, table, scratch)
    for axis in range(3):
        at, rate = rows_of(axis)
        at, rate = P.HOST + at, P.HOST + rate
        stiffness, damping = p[P.STIFFNESS_X + axis], p[P.DAMPING_X + axis]
        stretch, stretching = y[at] - scratch[axis], y[rate] - scratch[S.RATES + axis]
        inverse = p[P.INVERSE_HOST_INERTIA] if axis == ROTATION else p[P.INVERSE_HOST_MASS]
        force = -stiffness * stretch - damping * stretching
        dy[rate] += force * inverse
        dy[P.LOST_DAMPING] += damping * stretching * stretching
        dy[P.WORK] += force * scratch[S.RATES + axis]


@compiled
def contact_bias(
    y: Floats, at: Floats, face: Face, dy: Floats, p: Floats, k: Ints, scratch: Floats
) -> tuple[float, float]:
    """Relative acceleration of the contact without wall force: towards the wall along it, and of the slip.

    The first is the second derivative of the penetration seen by the Host, so that it is what a wall force must
    cancel; the path's curvature is in it.  Follows from differentiating the gap twice in the Host's frame.
    """
    nx, ny = face.x, face.y
    x, yy = at[S.X] - at[S.HOST_X], at[S.Y] - at[S.HOST_Y]
    ax, ay, turn = relative_acceleration(y, at, dy, k, scratch)
    spin = at[S.HOST_SPIN]
    slip_acceleration = (
        ay * nx - ax * ny + p[P.RADIUS] * (dy[S.SPIN] - turn) - turn * (x * nx + yy * ny)
        + spin * spin * (yy * nx - x * ny)
    )  # fmt: skip
    vx, vy = at[S.VX] - at[S.HOST_VX] + spin * yy, at[S.VY] - at[S.HOST_VY] - spin * x
    ax += turn * yy + spin * spin * x + 2.0 * spin * vy
    ay += -turn * x + spin * spin * yy - 2.0 * spin * vx
    along = vy * nx - vx * ny
    return ax * nx + ay * ny + face.curvature * along * along, slip_acceleration


@compiled
def push(at: Floats, face: Face, normal: float, tangential: float, p: Floats, k: Ints, out: Floats) -> None:
    """Add a contact force on the NES (normal towards the wall, tangent) and its reaction on the Host to accelerations
    ``out``, or an impulse to the velocities of a state, and the driver's power or work.
    """
    fx, fy = normal * face.x - tangential * face.y, normal * face.y + tangential * face.x
    nes_n, nes_t, host_n, host_t = levers(face, at, p)
    out[S.VX] += fx / p[P.MASS]
    out[S.VY] += fy / p[P.MASS]
    out[S.SPIN] += (nes_n * tangential - nes_t * normal) / p[P.INERTIA]
    size = k[P.STATE_SIZE]
    if size > P.HOST:
        out[P.HOST + S.VX] -= fx * p[P.INVERSE_HOST_MASS]
        out[P.HOST + S.VY] -= fy * p[P.INVERSE_HOST_MASS]
        out[P.HOST + S.SPIN] -= (host_n * tangential - host_t * normal) * p[P.INVERSE_HOST_INERTIA]
    elif size > 6:  # force on the NES times the wall's velocity there
        out[P.WORK] += (
            fx * at[S.HOST_VX] + fy * at[S.HOST_VY] + at[S.HOST_SPIN] * (host_n * tangential - host_t * normal)
        )


@making_arrays
def corner_forces(y: Floats, pair: int, side: float, system: System, scratch: Floats, at: Floats, dy: Floats) -> None:
    """Add the forces of two walls at once: both normal accelerations vanish, both contacts slip to ``side``.

    The 2 x 2 system is built by trying a unit force at each wall, so it holds for every kind of Host.
    """
    p, k, polygon = system.p, system.k, system.polygon
    walls = (pair % P.PAIR, pair // P.PAIR)
    tried = dy.copy()
    friction = p[P.WALL_FRICTION] * side
    matrix, bias = np.zeros((2, 2)), np.zeros(2)
    for j in range(2):
        face = normal_here(walls[j], at, p, k, polygon)
        bias[j] = contact_bias(y, at, face, dy, p, k, scratch)[0]
    for j in range(2):
        face = normal_here(walls[j], at, p, k, polygon)
        tried[:] = dy
        push(at, face, -1.0, -friction, p, k, tried)
        for i in range(2):
            other = normal_here(walls[i], at, p, k, polygon)
            matrix[i, j] = contact_bias(y, at, other, tried, p, k, scratch)[0] - bias[i]
    determinant = matrix[0, 0] * matrix[1, 1] - matrix[0, 1] * matrix[1, 0]
    first = (-bias[0] * matrix[1, 1] + bias[1] * matrix[0, 1]) / determinant
    second = (-bias[1] * matrix[0, 0] + bias[0] * matrix[1, 0]) / determinant
    slip = 0.0
    for j in range(2):
        force = first if j == 0 else second
        face = normal_here(walls[j], at, p, k, polygon)
        slip = contact_velocity(face, y[S.SPIN], at, p)[1]
        push(at, face, -force, -friction * force, p, k, dy)
        if k[P.STATE_SIZE] > 6:
            dy[P.LOST_TANGENT] += friction * force * slip
    scratch[PUSH], scratch[RUB], scratch[SLIP] = min(first, second), 0.0, slip
    scratch[NEED] = walls[0] if first > second else walls[1]  # the wall that holds longer


def _derivatives(
    t: float,
    y: Floats,
    contact: Contact,
    system: System,
    scratch: Floats,
    at: Floats,
    dy: Floats,
) -> None:
    """Right-hand side in a mode: flight, sliding (``side`` = sign of the slip) or rolling along ``wall``."""
    p, k, polygon = system.p, system.k, system.polygon
    mode, wall, side = contact.mode, contact.wall, contact.side
    place(t, y, system, scratch, at)
    free_accelerations(t, y, at, system, scratch, dy)
    if mode == P.FLIGHT:
        return
    if mode == P.CORNER:
        corner_forces(y, wall, side, system, scratch, at, dy)
        return
    face = normal_here(wall, at, p, k, polygon)
    bias_n, bias_t = contact_bias(y, at, face, dy, p, k, scratch)
    k_nn, k_nt, k_tt = inverse_mass(face, at, p)
    slip = contact_velocity(face, y[S.SPIN], at, p)[1]
    determinant = k_nn * k_tt - k_nt * k_nt
    force_n = -(k_tt * bias_n - k_nt * bias_t) / determinant
    force_t = -(k_nn * bias_t - k_nt * bias_n) / determinant
    need = force_t
    if mode == P.SLIDE:
        friction = p[P.WALL_FRICTION]
        force_n = -bias_n / (k_nn + side * friction * k_nt)
        force_t = side * friction * force_n
        if k[P.STATE_SIZE] > 6:
            dy[P.LOST_TANGENT] -= force_t * slip
    push(at, face, force_n, force_t, p, k, dy)
    scratch[PUSH], scratch[RUB], scratch[NEED], scratch[SLIP] = -force_n, force_t, need, slip


derivatives = compiled(_derivatives)
derivatives_inlined = inlined(_derivatives)  # for the stepper's inner loop only: each use costs seconds of compiling
