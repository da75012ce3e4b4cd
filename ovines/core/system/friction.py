"""Sliding and spinning friction of a disk on a floor: Farkas' functions, regularised (thesis Eq. 45-54, ERRATA)."""

from __future__ import annotations

import math

import numpy as np

from ovines.core.compiled import compiled, inlined


@inlined
def bulirsch(k2: float, kc2: float) -> tuple[float, float, float, float]:
    """Complete elliptic integrals K, B, C, D of modulus squared ``k2`` < 1, ``kc2 = 1 - k2``, by one mean."""
    b = math.sqrt(kc2)
    a = 0.5 * (1.0 + b)
    b = math.sqrt(b)
    u = 0.25 / a
    power = 1.0
    total = u * u
    for _ in range(40):
        if k2 * u < 1e-9 * a:  # the next c is below 1e-18 a
            break
        a_next = 0.5 * (a + b)
        b = math.sqrt(a * b)
        a = a_next
        u = k2 * u * u / (4.0 * a)
        power *= 2.0
        total += power * u * u
    first_kind = math.pi / (a + b)
    return first_kind, first_kind * (0.5 - k2 * total), 2.0 * first_kind * total, first_kind * (0.5 + k2 * total)


@inlined
def smooth_parts(
    k2: float, kc2: float, integrals: tuple[float, float, float, float]
) -> tuple[float, float, float, float, float]:
    """What Farkas' functions are made of, smooth down to modulus k = 0: the force over k below a ratio of 1, and itself
    above; the torque below, and over k above; the force's slope below, and over k^3 above.

    One arithmetic-geometric mean gives Bulirsch's B, C, D (ERRATA), with ``c_n = k^2 u_n`` so that nothing cancels: the
    thesis' form (48)-(49) is off by 240 % at a ratio of 1e4.
    """
    first, b, c, d = integrals
    second = b + kc2 * d
    unit = 4.0 / (3.0 * math.pi)
    slow = unit / 3.0 * ((4.0 - 2.0 * k2) * second - kc2 * first)
    return unit * (b + second), slow, unit / 3.0 * (c + 3.0 * b - d), unit * (2.0 * second - b), unit * (d - c)


CELLS, TABULATED, DEGREE = 64, 58, 7  # of a unit of the modulus; the first 58, up to 0.906, where the logarithm is far


def tabulate() -> np.ndarray:
    """Coefficients (58 cells, 5 parts, 8) of the parts over each cell, its middle at 0 and its ends at -1 and 1.

    By the first terms of Chebyshev's series from three times as many points, so that rounding averages out: as right
    as the mean itself, in a third of its time.
    """
    order, nodes = np.arange(DEGREE + 1), 24
    turns = math.pi * (np.arange(nodes) + 0.5) / nodes
    to_series = np.cos(np.outer(order, turns)) * np.where(order > 0, 2.0, 1.0)[:, None] / nodes
    to_powers = np.zeros((DEGREE + 1, DEGREE + 1))
    for one in order:
        to_powers[: one + 1, one] = np.polynomial.chebyshev.cheb2poly(np.eye(DEGREE + 1)[one, : one + 1])
    parts_of, mean = (getattr(one, "py_func", one) for one in (smooth_parts, bulirsch))  # Python's own: not to compile
    table = np.empty((TABULATED, 5, DEGREE + 1))
    for cell in range(TABULATED):
        moduli = [(cell + 0.5 + 0.5 * math.cos(turn)) / CELLS for turn in turns]
        squares = [(k * k, (1.0 - k) * (1.0 + k)) for k in moduli]
        parts = np.array([parts_of(*both, mean(*both)) for both in squares])
        table[cell] = (to_powers @ (to_series @ parts)).T
    return table


TABLE = tabulate()


@inlined
def tabulated(cell: int, part: int, t: float) -> float:
    """A part at ``t`` between the ends (-1, 1) of a cell, in short chains of products."""
    square = t * t
    low = TABLE[cell, part, 0] + TABLE[cell, part, 1] * t + square * (TABLE[cell, part, 2] + TABLE[cell, part, 3] * t)
    high = TABLE[cell, part, 4] + TABLE[cell, part, 5] * t + square * (TABLE[cell, part, 6] + TABLE[cell, part, 7] * t)
    return low + square * square * high


@compiled
def farkas(ratio: float) -> tuple[float, float]:
    """Force and torque functions F, T of the velocity ratio ``|v| / (R |omega|)``, from 0 to infinity (F = 1, T = 0).

    F(0) = 0, F(1) = 8/(3 pi), T(0) = 2/3, T(1) = 8/(9 pi); by table, near 1 by :func:`smooth_parts`.
    Source: Farkas et al., Phys. Rev. Lett. 90, 248302 (2003); Bulirsch, Numer. Math. 7, 78 (1965).
    """
    k = ratio if ratio <= 1.0 else 1.0 / ratio
    if k == 0.0:
        return (0.0, 2.0 / 3.0) if ratio <= 1.0 else (1.0, 0.0)
    place = CELLS * k
    if place < TABULATED:
        cell = int(place)
        t = 2.0 * (place - cell) - 1.0
        force = tabulated(cell, 0, t)
        if ratio <= 1.0:
            return k * force, tabulated(cell, 1, t)
        return force, k * tabulated(cell, 2, t)
    kc2 = (1.0 - k) * (1.0 + k)
    if kc2 < 1e-30:
        return 8.0 / (3.0 * math.pi), 8.0 / (9.0 * math.pi)
    force, slow, fast, _below, _above = smooth_parts(k * k, kc2, bulirsch(k * k, kc2))
    return (k * force, slow) if ratio <= 1.0 else (force, k * fast)


@compiled
def farkas_slope(ratio: float) -> tuple[float, float, float]:
    """Farkas' F and T and the slope F' over the ratio; T' = -ratio F' (both forces have one potential)."""
    k = ratio if ratio <= 1.0 else 1.0 / ratio
    place = CELLS * k
    if place < TABULATED:
        cell = int(place)
        t = 2.0 * (place - cell) - 1.0
        force = tabulated(cell, 0, t)
        if ratio <= 1.0:
            return k * force, tabulated(cell, 1, t), tabulated(cell, 3, t)
        return force, k * tabulated(cell, 2, t), k * k * k * tabulated(cell, 4, t)
    kc2 = (1.0 - k) * (1.0 + k)
    if kc2 < 1e-30:
        return 8.0 / (3.0 * math.pi), 8.0 / (9.0 * math.pi), 4.0 / (3.0 * math.pi)
    force, slow, fast, below, above = smooth_parts(k * k, kc2, bulirsch(k * k, kc2))
    return (k * force, slow, below) if ratio <= 1.0 else (force, k * fast, k * k * k * above)


@compiled
def floor_friction(
    vx: float, vy: float, spin: float, radius: float, strength: float, regularisation: float, coupling: float
) -> tuple[float, float, float]:
    """Acceleration (x, y) and torque per mass (N m / kg) that the floor exerts on a sliding, spinning disk.

    ``vx, vy, spin`` are relative to the floor; ``strength`` is coefficient times load (m/s^2).
    ``coupling`` 1 is Farkas, 0 plain Coulomb (no torque), between them a linear mixture.  Coulomb is
    regularised by tanh(v/v_d) (Eq. 22); Farkas by the single tanh(sqrt(v^2 + R^2 omega^2)/v_d) for both
    force and torque: a factor each as in (52)-(53) would damp twice (ERRATA).
    """
    square = vx * vx + vy * vy
    speed = math.sqrt(square)
    rim = radius * abs(spin)
    force = 0.0
    torque = 0.0
    if coupling > 0.0 and speed + rim > 0.0:
        f_ratio, t_ratio = 1.0, 0.0
        if rim > 0.0:
            f_ratio, t_ratio = farkas(speed / rim)
        smooth = coupling * smooth_step(math.sqrt(square + rim * rim) / regularisation)
        force = f_ratio * smooth
        torque = -strength * radius * t_ratio * smooth * (1.0 if spin > 0.0 else -1.0)
    if coupling < 1.0:
        force += (1.0 - coupling) * smooth_step(speed / regularisation)
    if speed == 0.0:
        return 0.0, 0.0, torque
    scale = -strength * force / speed
    return scale * vx, scale * vy, torque


@compiled
def smooth_step(ratio: float) -> float:
    """tanh of a ratio >= 0; from 20 on it is 1 to the last digit and costs nothing."""
    return math.tanh(ratio) if ratio < 20.0 else 1.0
