"""Sliding and spinning friction of a disk on a floor: Farkas' functions, regularised (thesis Eq. 45-54;
its errata: docs/reference/thesis-errata.md)."""

from __future__ import annotations

import math

import numpy as np

from ovines.core.compiled import Floats, compiled, inlined


def bulirsch(k2: float, kc2: float) -> tuple[float, float, float, float]:
    """Complete elliptic integrals K, B, C, D of modulus squared ``k2`` < 1, ``kc2 = 1 - k2``, by one mean.

    ``c_n = k^2 u_n``, so that nothing cancels: the thesis' form (48)-(49) is off by 240 % at a ratio of 1e4.
    """
    b = math.sqrt(kc2)
    a = 0.5 * (1.0 + b)
    b = math.sqrt(b)
    u = 0.25 / a
    power = 1.0
    total = u * u
    while k2 * u >= 1e-9 * a:  # below, the next c is below 1e-18 a
        a, b = 0.5 * (a + b), math.sqrt(a * b)
        u = k2 * u * u / (4.0 * a)
        power *= 2.0
        total += power * u * u
    first_kind = math.pi / (a + b)
    return first_kind, first_kind * (0.5 - k2 * total), 2.0 * first_kind * total, first_kind * (0.5 + k2 * total)


def logarithms(k2: float, kc2: float) -> tuple[float, float, float, float]:
    """What multiplies ln(kc2) in the same integrals near ``k2`` = 1: smooth there, by the mean of the other modulus."""
    whole, b, _c, d = bulirsch(kc2, k2)
    first, second = -whole / math.pi, (b + k2 * d - whole) / math.pi  # of the first and second kind
    b, d = (second - kc2 * first) / k2, (first - second) / k2
    return first, b, (d - b) / k2, d


def smooth_parts(
    k2: float, kc2: float, integrals: tuple[float, float, float, float]
) -> tuple[float, float, float, float, float]:
    """What Farkas' functions are made of, smooth down to modulus k = 0: the force over k below a ratio of 1, and itself
    above; the torque below, and over k above; the force's slope below, and over k^3 above.

    Sums of Bulirsch's K, B, C, D, which keep their digits.
    """
    first, b, c, d = integrals
    second = b + kc2 * d
    unit = 4.0 / (3.0 * math.pi)
    slow = unit / 3.0 * ((4.0 - 2.0 * k2) * second - kc2 * first)
    return unit * (b + second), slow, unit / 3.0 * (c + 3.0 * b - d), unit * (2.0 * second - b), unit * (d - c)


CELLS, STEEP, DEGREE = 64, 58, 7  # cells of the modulus; from 0.906 on the parts' logarithm is taken out of them


def tabulate() -> tuple[np.ndarray, np.ndarray]:
    """Coefficients (64 cells, 5 parts, 8) of the parts over each cell, its middle at 0 and its ends at -1 and 1, and
    (6, 5, 8) of what multiplies the logarithm in the last cells.

    By the first terms of Chebyshev's series from three times as many points, so that rounding averages out: as right
    as the mean itself.
    """
    order, nodes = np.arange(DEGREE + 1), 24
    turns = math.pi * (np.arange(nodes) + 0.5) / nodes
    to_series = np.cos(np.outer(order, turns)) * np.where(order > 0, 2.0, 1.0)[:, None] / nodes
    to_powers = np.zeros((DEGREE + 1, DEGREE + 1))
    for one in order:
        to_powers[: one + 1, one] = np.polynomial.chebyshev.cheb2poly(np.eye(DEGREE + 1)[one, : one + 1])
    smooth, steep = np.empty((CELLS, 5, DEGREE + 1)), np.empty((CELLS - STEEP, 5, DEGREE + 1))
    for cell in range(CELLS):
        moduli = [(cell + 0.5 + 0.5 * math.cos(turn)) / CELLS for turn in turns]
        squares = [(k * k, (1.0 - k) * (1.0 + k)) for k in moduli]
        parts = np.array([smooth_parts(*both, bulirsch(*both)) for both in squares])
        if cell >= STEEP:
            logs = np.array([smooth_parts(*both, logarithms(*both)) for both in squares])
            parts -= logs * np.log([kc2 for _k2, kc2 in squares])[:, None]
            steep[cell - STEEP] = (to_powers @ (to_series @ logs)).T
        smooth[cell] = (to_powers @ (to_series @ parts)).T
    return smooth, steep


SMOOTH_TABLE, STEEP_TABLE = tabulate()


@inlined
def polynomial(table: Floats, cell: int, part: int, t: float) -> float:
    """A part at ``t`` between the ends (-1, 1) of a cell, in short chains of products."""
    square = t * t
    low = table[cell, part, 0] + table[cell, part, 1] * t + square * (table[cell, part, 2] + table[cell, part, 3] * t)
    high = table[cell, part, 4] + table[cell, part, 5] * t + square * (table[cell, part, 6] + table[cell, part, 7] * t)
    return low + square * square * high


@inlined
def cell_of(k: float) -> tuple[int, float, float]:
    """Cell of a modulus, place in it (-1 to 1), logarithm of 1 - k^2 where the cell's parts need it (at k = 1, where
    what multiplies it is 0: 0).
    """
    cell = min(int(CELLS * k), CELLS - 1)
    kc2 = (1.0 - k) * (1.0 + k)
    logarithm = math.log(kc2) if cell >= STEEP and kc2 > 1e-30 else 0.0
    return cell, 2.0 * (CELLS * k - cell) - 1.0, logarithm


@inlined
def tabulated(part: int, cell: int, t: float, logarithm: float) -> float:
    """A part at a place that :func:`cell_of` found."""
    value = polynomial(SMOOTH_TABLE, cell, part, t)
    if cell >= STEEP:
        value += logarithm * polynomial(STEEP_TABLE, cell - STEEP, part, t)
    return value


@compiled
def farkas(ratio: float) -> tuple[float, float]:
    """Force and torque functions F, T of the velocity ratio ``|v| / (R |omega|)``, from 0 to infinity (F = 1, T = 0).

    F(0) = 0, F(1) = 8/(3 pi), T(0) = 2/3, T(1) = 8/(9 pi); by table of :func:`smooth_parts`.
    Source: Farkas et al., Phys. Rev. Lett. 90, 248302 (2003); Bulirsch, Numer. Math. 7, 78 (1965).
    """
    k = ratio if ratio <= 1.0 else 1.0 / ratio
    if k == 0.0:
        return (0.0, 2.0 / 3.0) if ratio <= 1.0 else (1.0, 0.0)
    cell, t, logarithm = cell_of(k)
    force = tabulated(0, cell, t, logarithm)
    if ratio <= 1.0:
        return k * force, tabulated(1, cell, t, logarithm)
    return force, k * tabulated(2, cell, t, logarithm)


@compiled
def farkas_slope(ratio: float) -> tuple[float, float, float]:
    """Farkas' F and T and the slope F' over the ratio; T' = -ratio F' (both forces have one potential)."""
    k = ratio if ratio <= 1.0 else 1.0 / ratio
    cell, t, logarithm = cell_of(k)
    force = tabulated(0, cell, t, logarithm)
    if ratio <= 1.0:
        return k * force, tabulated(1, cell, t, logarithm), tabulated(3, cell, t, logarithm)
    return force, k * tabulated(2, cell, t, logarithm), k * k * k * tabulated(4, cell, t, logarithm)


@compiled
def floor_friction(
    vx: float, vy: float, spin: float, radius: float, strength: float, regularisation: float, coupling: float
) -> tuple[float, float, float]:
    """Acceleration (x, y) and torque per mass (N m / kg) that the floor exerts on a sliding, spinning disk.

    ``vx, vy, spin`` are relative to the floor; ``strength`` is coefficient times load (m/s^2).
    ``coupling`` 1 is Farkas, 0 plain Coulomb (no torque), between them a linear mixture.  Coulomb is
    regularised by tanh(v/v_d) (Eq. 22); Farkas by the single tanh(sqrt(v^2 + R^2 omega^2)/v_d) for both
    force and torque: a factor each as in (52)-(53) would damp twice.
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
        smooth = coupling
        both = square + rim * rim
        if both < (SATURATED * regularisation) ** 2:
            smooth *= math.tanh(math.sqrt(both) / regularisation)
        force = f_ratio * smooth
        torque = -strength * radius * t_ratio * smooth * (1.0 if spin > 0.0 else -1.0)
    if coupling < 1.0:
        force += (1.0 - coupling) * smooth_step(speed / regularisation)
    if speed == 0.0:
        return 0.0, 0.0, torque
    scale = -strength * force / speed
    return scale * vx, scale * vy, torque


SATURATED = 20.0  # from this ratio on tanh is 1 to the last digit


@compiled
def smooth_step(ratio: float) -> float:
    """tanh of a ratio >= 0."""
    return math.tanh(ratio) if ratio < SATURATED else 1.0
