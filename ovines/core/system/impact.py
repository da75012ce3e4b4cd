"""The impact law: Luding's normal and tangential restitution with a Coulomb limit (thesis Eq. 88-107)."""

from __future__ import annotations

import math

from ovines.core.compiled import Floats, compiled
from ovines.core.system import parameters as P


@compiled
def luding(
    normal: float,
    tangential: float,
    restitution: float,
    wall_friction: float,
    tangential_restitution: float,
    inverse_inertia_factor: float,
) -> tuple[float, float, bool]:
    """Contact-point velocity after an impact, and whether it stuck.

    ``normal`` > 0 approaches the wall; both are the NES relative to the wall (m/s).
    ``inverse_inertia_factor`` is 1/q_NH of (96); 1/q_N for a massive Host.  After: ``-eps v_n`` and
    ``-beta v_t``, ``beta = min(beta_0, beta_1)`` with beta_1 of (95); beta = -1 smooth, +1 full reversal.
    """
    slip = abs(tangential)
    limit = wall_friction * (1.0 + restitution) * (1.0 + inverse_inertia_factor) * abs(normal)
    if (1.0 + tangential_restitution) * slip <= limit:
        return -restitution * normal, -tangential_restitution * tangential, True
    return -restitution * normal, tangential * (1.0 - limit / slip), False


@compiled
def effective_restitution(speed: float, azimuth: float, time: float, p: Floats) -> float:
    """Restitution at a normal approach speed, world azimuth and time: the constant, or its effects, within 0..1."""
    value = p[P.RESTITUTION]
    if p[P.RESTITUTION_SPEED] > 0.0:
        fast = p[P.RESTITUTION_FAST]
        value = fast + (value - fast) * math.exp(-speed / p[P.RESTITUTION_SPEED])
    if p[P.RESTITUTION_SWING] != 0.0:
        value += p[P.RESTITUTION_SWING] * math.cos(azimuth - p[P.RESTITUTION_DIRECTION])
    value *= (1.0 + p[P.RESTITUTION_PER_S] * time) * (1.0 + p[P.RESTITUTION_OF_RUN])
    return min(max(value, 0.0), 1.0)


@compiled
def impulses(
    normal: float, tangential: float, k_nn: float, k_nt: float, k_tt: float,
    restitution: float, wall_friction: float, tangential_restitution: float,
) -> tuple[float, float, bool]:  # fmt: skip
    """Normal and tangential impulse on the NES (N s), normal axis towards the wall, and whether it stuck.

    ``k`` is the contact's inverse mass matrix (1/kg).  With k_nt = 0 (round Host, centred mass) this is
    :func:`luding`; off-centre masses and polygons on a moving Host couple both directions.
    """
    want_n = -(1.0 + restitution) * normal
    want_t = -(1.0 + tangential_restitution) * tangential
    determinant = k_nn * k_tt - k_nt * k_nt
    p_n = (k_tt * want_n - k_nt * want_t) / determinant
    p_t = (k_nn * want_t - k_nt * want_n) / determinant
    if abs(p_t) <= wall_friction * abs(p_n):
        return p_n, p_t, True
    sign = 1.0 if tangential > 0.0 else -1.0
    p_n = want_n / (k_nn + sign * wall_friction * k_nt)
    return p_n, sign * wall_friction * p_n, False
