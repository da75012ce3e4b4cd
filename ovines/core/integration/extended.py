"""The last digits of closed-form flights: contact, state and impact in pairs of doubles (round wall, instant impacts).

A chaotic path loses a digit every second impact; a state of 32 digits is followed twice as far as one of 16.  The
engine finds every contact in doubles as always; here it is sharpened, and the low words are carried to the next one.
"""

from __future__ import annotations

from ovines.core import state as S
from ovines.core.compiled import Floats, Ints, compiled
from ovines.core.integration.double_double import (
    Pair,
    add,
    divide,
    exponential,
    multiply,
    negative,
    root,
    sine_cosine,
)
from ovines.core.system import parameters as P
from ovines.core.system.host import ROTATION
from ovines.core.system.packed import System

# places among the low words of the state, where energies have none: the time's, and whether the contact was sharpened
LOW_TIME, SHARP = P.ENERGIES, P.ENERGIES + 1


@compiled
def response(time: Pair, axis: int, stiffness: Pair, damping: Pair, sprung: bool, drive: Floats) -> tuple[Pair, Pair]:
    """Driven motion of an axis, or a sprung Host's steady answer to it: displacement and rate."""
    q, rate = (0.0, 0.0), (0.0, 0.0)
    for row in range(drive.shape[0]):
        if int(drive[row, P.AXIS]) != axis:
            continue
        amplitude, omega = (drive[row, P.AMPLITUDE], 0.0), (drive[row, P.OMEGA], 0.0)
        sine, cosine = sine_cosine(add(multiply(omega, time), (drive[row, P.PHASE], 0.0)))
        if drive[row, P.OMEGA] == 0.0:
            sine, cosine = (1.0, 0.0), (0.0, 0.0)
        if sprung:
            real, imaginary = add(stiffness, negative(multiply(omega, omega))), multiply(damping, omega)
            square = multiply(imaginary, imaginary)
            size = add(multiply(real, real), square)
            gain = divide(add(multiply(stiffness, real), square), size)
            lag = divide(multiply(imaginary, add(real, negative(stiffness))), size)
            turned = add(multiply(gain, sine), multiply(lag, cosine))
            cosine = add(multiply(gain, cosine), negative(multiply(lag, sine)))
            sine = turned
        q = add(q, multiply(amplitude, sine))
        rate = add(rate, multiply(multiply(amplitude, omega), cosine))
    return q, rate


@compiled
def host_axis(
    time: Pair, s: Pair, axis: int, q0: Pair, v0: Pair, p: Floats, k: Ints, drive: Floats
) -> tuple[Pair, Pair]:
    """Host's displacement and rate of one axis, ``s`` after (q0, v0) at ``time``."""
    kind = k[P.HOST_KIND]
    none = (0.0, 0.0)
    if kind == P.FIXED:
        return none, none
    if kind == P.FREE:
        return add(q0, multiply(s, v0)), v0
    if kind == P.DRIVEN:
        return response(add(time, s), axis, none, none, False, drive)
    # the mass is what was given; its inverse in the vector is rounded
    mass = (1.0 / (p[P.INVERSE_HOST_INERTIA] if axis == ROTATION else p[P.INVERSE_HOST_MASS]), 0.0)
    stiffness, damping = divide((p[P.STIFFNESS_X + axis], 0.0), mass), divide((p[P.DAMPING_X + axis], 0.0), mass)
    half = multiply((0.5, 0.0), damping)
    turning = root(add(stiffness, negative(multiply(half, half))))
    q, rate = response(time, axis, stiffness, damping, True, drive)
    q0, v0 = add(q0, negative(q)), add(v0, negative(rate))
    sine, cosine = sine_cosine(multiply(turning, s))
    envelope = exponential(negative(multiply(half, s)))
    sine, cosine = divide(multiply(envelope, sine), turning), multiply(envelope, cosine)
    q, rate = response(add(time, s), axis, stiffness, damping, True, drive)
    q = add(q, add(multiply(q0, add(cosine, multiply(half, sine))), multiply(v0, sine)))
    slowed = multiply(v0, add(cosine, negative(multiply(half, sine))))
    return q, add(rate, add(slowed, negative(multiply(multiply(stiffness, q0), sine))))


@compiled
def glide_extended(t: float, s: Pair, y: Floats, low: Floats, system: System, out: Floats, out_low: Floats) -> None:
    """State ``s`` (a pair) after (``y``, ``low``): what :func:`ovines.core.integration.flight.glide` gives, to 30
    digits.
    """
    p, k, drive = system.p, system.k, system.drive
    time = (t, low[LOW_TIME])
    half = multiply((0.5, 0.0), s)
    for axis in range(2):
        pull = p[P.GRAVITY_X + axis], 0.0
        v = (y[2 + axis], low[2 + axis])
        x = add((y[axis], low[axis]), multiply(s, add(v, multiply(half, pull))))
        v = add(v, multiply(s, pull))
        out[axis], out_low[axis] = x
        out[2 + axis], out_low[2 + axis] = v
    spin = (y[S.SPIN], low[S.SPIN])
    out[S.ANGLE], out_low[S.ANGLE] = add((y[S.ANGLE], low[S.ANGLE]), multiply(s, spin))
    out[S.SPIN], out_low[S.SPIN] = spin
    for axis in range(3):
        at = P.HOST + (4 if axis == ROTATION else axis)
        rate_at = P.HOST + (5 if axis == ROTATION else 2 + axis)
        q, rate = host_axis(time, s, axis, (y[at], low[at]), (y[rate_at], low[rate_at]), p, k, drive)
        out[at], out_low[at] = q
        out[rate_at], out_low[rate_at] = rate


@compiled
def from_host(y: Floats, low: Floats, axis: int) -> tuple[Pair, Pair]:
    """Disk less Host along an axis: place and velocity."""
    x = add((y[axis], low[axis]), (-y[P.HOST + axis], -low[P.HOST + axis]))
    v = add((y[2 + axis], low[2 + axis]), (-y[P.HOST + S.VX + axis], -low[P.HOST + S.VX + axis]))
    return x, v


@compiled
def sharpen(
    t: float, s: float, y: Floats, low: Floats, system: System, out: Floats, out_low: Floats
) -> tuple[float, bool]:
    """Contact near ``s``, with the state there in ``out`` and ``out_low``: (time, whether Newton's method agreed).

    Both steps start from a contact known to rounding, so each doubles the digits; a graze, where the rate is too small
    for that, is left to the doubles.
    """
    p = system.p
    exact = (s, 0.0)
    radius = (p[P.CONTACT_RADIUS], 0.0)
    for _ in range(3):
        glide_extended(t, exact, y, low, system, out, out_low)
        x, vx = from_host(out, out_low, 0)
        yy, vy = from_host(out, out_low, 1)
        square = add(multiply(x, x), multiply(yy, yy))
        over = add(square, negative(multiply(radius, radius)))[0]
        rate = 2.0 * (x[0] * vx[0] + yy[0] * vy[0])
        if rate <= 0.0 or abs(over) > 1e-9 * rate * s:
            return t + s, False
        exact = add(exact, (-over / rate, 0.0))
    glide_extended(t, exact, y, low, system, out, out_low)
    for i in range(P.ENERGIES, P.HOST):
        out[i] = y[i]
    time, out_low[LOW_TIME] = add((t, low[LOW_TIME]), exact)
    out_low[SHARP] = 1.0
    return time, True


@compiled
def strike_extended(y: Floats, low: Floats, restitution: float, p: Floats, k: Ints) -> None:
    """Luding's law on the round wall, in place (see :func:`ovines.core.system.impact.impulses`, here uncoupled)."""
    x, vx = from_host(y, low, 0)
    yy, vy = from_host(y, low, 1)
    distance = root(add(multiply(x, x), multiply(yy, yy)))
    nx, ny = divide(x, distance), divide(yy, distance)
    radius, one = (p[P.RADIUS], 0.0), (1.0, 0.0)
    reach = add(distance, radius)
    spin, host_spin = (y[S.SPIN], low[S.SPIN]), (y[P.HOST + S.SPIN], low[P.HOST + S.SPIN])
    normal = add(multiply(vx, nx), multiply(vy, ny))
    slip = add(multiply(vy, nx), negative(multiply(vx, ny)))
    slip = add(slip, add(multiply(radius, spin), negative(multiply(reach, host_spin))))
    nes, nes_turn = divide(one, (p[P.MASS], 0.0)), divide(radius, (p[P.INERTIA], 0.0))
    host, host_turn = (0.0, 0.0), (0.0, 0.0)
    if p[P.INVERSE_HOST_MASS] > 0.0:
        host = divide(one, (1.0 / p[P.INVERSE_HOST_MASS], 0.0))
        host_turn = divide(reach, (1.0 / p[P.INVERSE_HOST_INERTIA], 0.0))
    k_nn = add(nes, host)
    k_tt = add(k_nn, add(multiply(radius, nes_turn), multiply(reach, host_turn)))
    p_n = divide(multiply(add(one, (restitution, 0.0)), normal), negative(k_nn))
    p_t = divide(multiply(add(one, (p[P.TANGENTIAL_RESTITUTION], 0.0)), slip), negative(k_tt))
    if abs(p_t[0]) > p[P.WALL_FRICTION] * abs(p_n[0]):
        p_t = multiply((p[P.WALL_FRICTION] if slip[0] > 0.0 else -p[P.WALL_FRICTION], 0.0), p_n)
    push_x = add(multiply(p_n, nx), negative(multiply(p_t, ny)))
    push_y = add(multiply(p_n, ny), multiply(p_t, nx))
    give(y, low, 2, multiply(push_x, nes))
    give(y, low, 3, multiply(push_y, nes))
    give(y, low, 5, multiply(p_t, nes_turn))
    if p[P.INVERSE_HOST_MASS] > 0.0:
        give(y, low, P.HOST + S.VX, negative(multiply(push_x, host)))
        give(y, low, P.HOST + S.VY, negative(multiply(push_y, host)))
        give(y, low, P.HOST + S.SPIN, negative(multiply(p_t, host_turn)))


@compiled
def give(y: Floats, low: Floats, place: int, change: Pair) -> None:
    """Add to one number of the state."""
    y[place], low[place] = add((y[place], low[place]), change)
