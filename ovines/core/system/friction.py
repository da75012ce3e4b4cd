"""Sliding and spinning friction of a disk on a floor: Farkas' functions, regularised (thesis Eq. 45-54, ERRATA)."""

from __future__ import annotations

import math

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


@compiled
def farkas(ratio: float) -> tuple[float, float]:
    """Force and torque functions F, T of the velocity ratio ``|v| / (R |omega|)``.

    One arithmetic-geometric mean gives Bulirsch's B, C, D (ERRATA), with ``c_n = k^2 u_n`` so that
    nothing cancels: the thesis' form (48)-(49) is off by 240 % at a ratio of 1e4.  ``ratio`` from 0 to
    infinity (infinity: F = 1, T = 0).  F(0) = 0, F(1) = 8/(3 pi), T(0) = 2/3, T(1) = 8/(9 pi).
    Source: Farkas et al., Phys. Rev. Lett. 90, 248302 (2003); Bulirsch, Numer. Math. 7, 78 (1965).
    """
    k = ratio if ratio <= 1.0 else 1.0 / ratio
    k2 = k * k
    kc2 = (1.0 - k) * (1.0 + k)
    if kc2 < 1e-30:
        return 8.0 / (3.0 * math.pi), 8.0 / (9.0 * math.pi)
    first_kind, b_bulirsch, c_bulirsch, d_bulirsch = bulirsch(k2, kc2)
    second_kind = b_bulirsch + kc2 * d_bulirsch
    if ratio <= 1.0:
        force = 4.0 * k / (3.0 * math.pi) * (b_bulirsch + second_kind)
        return force, 4.0 / (9.0 * math.pi) * ((4.0 - 2.0 * k2) * second_kind - kc2 * first_kind)
    force = 4.0 / (3.0 * math.pi) * (second_kind + b_bulirsch)
    return force, 4.0 * k / (9.0 * math.pi) * (c_bulirsch + 3.0 * b_bulirsch - d_bulirsch)


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
