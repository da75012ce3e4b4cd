"""A packed law's terms, evaluated in compiled code: the same for the simulator, the flights' fits and the search."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ovines.core.compiled import Floats, compiled
from ovines.core.laws import words as W
from ovines.core.laws.quantities import (
    Q_FROM_CONTACT,
    Q_LAST_APPROACH,
    Q_LAST_AZIMUTH,
    Q_LAST_LEFT,
    Q_LAST_SLIP,
    Q_LAST_SPUN,
    Q_OFF_PATH,
    Q_RIM_TURN,
    Q_SINCE_BY_BLOW,
    Q_SLIDING_FROM_BLOW,
    Q_WAY_SINCE,
    SHORT,
    circular,
    quantity,
    remembers,
    remembers_two,
)

Numbers = NDArray[np.int64]
# What acts along the disk's velocity ends with it, as the floor's friction does (its default speed, m/s), and so
# evenly: a direction that a standing disk turns or turns round ever faster was followed for ever.  Beyond so many of
# these speeds tanh is 1 to the last digit.
AT_REST_M_PER_S, RESTS = 1e-3, 20.0
# As the targets and functions are numbered in `words`; a test holds them together.
(
    FIXED, OUTWARDS, SWIRL, ALONG_V, ACROSS_V, MIRRORED_V, ALONG_U, ACROSS_U, MIRRORED_R, FROM_ROOM, FROM_HOST,
    FRICTION, MIRRORED_FRICTION, ALONG_BODY, SPIN, FROM_CONTACT, ALONG_W, ALONG_A, POLAR_FRICTION,
    FLOOR_LEVER, FLOOR_TORQUE, ALONG_AIRSPEED,
) = range(22)  # fmt: skip
#: directions that are those of the disk's velocity
OF_MOTION = (ALONG_V, ACROSS_V, MIRRORED_V, ALONG_U, ACROSS_U, ALONG_AIRSPEED)
(
    POWER,
    ABSOLUTE,
    COSINE,
    SINE,
    EXPONENTIAL,
    GAUSSIAN,
    BELOW,
    SIGN,
    PULSES,
    GATES,
    ABOVE,
    TANH,
    DECAY,
    RATIONAL,
    WITHIN,
    SAWTOOTH,
    RISING,
    BEYOND,
) = range(18)


class SharedTerms(NamedTuple):
    """Packed terms of the flight by what many of them have in common: rows of their ``directions`` (D, ROW_SIZE),
    ``factors`` (F, FACTOR_SIZE), and of each term its direction (T,), factors (T, MOST_FACTORS; -1 none) and
    coefficient (T,)."""

    directions: Floats
    factors: Floats
    direction_of: Numbers
    factor_of: Numbers
    coefficient: Floats


def shared_terms(rows: Floats) -> SharedTerms:
    """Of ``rows`` (T, ROW_SIZE)."""
    heads = rows.copy()
    heads[:, W.COEFFICIENT], heads[:, W.FACTORS :] = 1.0, 0.0
    directions, direction_of = np.unique(heads, axis=0, return_inverse=True)
    every = rows[:, W.FIRST :].reshape(-1, W.FACTOR_SIZE)
    factors, factor_of = np.unique(every, axis=0, return_inverse=True)
    factor_of = factor_of.reshape(len(rows), W.MOST_FACTORS)
    factor_of = np.where(np.arange(W.MOST_FACTORS) < rows[:, W.FACTORS, None], factor_of, -1)
    return SharedTerms(
        directions, factors, direction_of.reshape(-1), np.ascontiguousarray(factor_of), rows[:, W.COEFFICIENT].copy()
    )


@compiled
def unknown(code: int, known: Floats) -> bool:
    """Whether a quantity goes with a contact before that nobody saw."""
    last = Q_FROM_CONTACT <= code <= Q_LAST_APPROACH or Q_RIM_TURN <= code <= Q_LAST_SLIP or code == Q_SINCE_BY_BLOW
    last = last or Q_LAST_SPUN <= code <= Q_LAST_LEFT or Q_SLIDING_FROM_BLOW <= code <= Q_OFF_PATH
    if (last or code == Q_LAST_AZIMUTH) and not remembers(known):
        return True
    return (code == Q_OFF_PATH and not remembers_two(known)) or (code == Q_WAY_SINCE and known[W.WAY_BEFORE] < 0.0)


@compiled
def factor(row: Floats, at: int, known: Floats) -> float:
    """Value of the factor whose numbers start at ``at``."""
    code = int(row[at + W.QUANTITY])
    if unknown(code, known):
        return 0.0
    q = quantity(code, row[at + W.QUANTITY_X], row[at + W.QUANTITY_Y], known)
    function, order, scale = int(row[at + W.FUNCTION]), row[at + W.ORDER], row[at + W.SCALE]
    if function == POWER:
        return q if order == 1.0 else q**order
    if function == ABSOLUTE:
        return abs(q) ** order
    if function == COSINE:
        return math.cos(order * q / scale)
    if function == SINE:
        return math.sin(order * q / scale)
    if function == EXPONENTIAL:
        return math.exp(-q / scale)
    if function == GAUSSIAN or function == WITHIN or function == SAWTOOTH:
        if circular(code):
            turns = order if function == SAWTOOTH else 1.0
            q = math.atan2(math.sin(turns * q), math.cos(turns * q))
        if function == SAWTOOTH:  # jumps up by 1 at 0 (as often as its order says), and falls in between: mean 0
            if not circular(code):
                return 0.5 - (q / scale - math.floor(q / scale))
            return (0.5 if q > 0.0 else -0.5) - 0.5 * q / math.pi
        if function == WITHIN:
            return 1.0 if abs(q) < scale else 0.0
        return math.exp(-0.5 * (q / scale) ** 2)
    if function == ABOVE:
        return (q - scale) ** order if q > scale else 0.0
    if function == TANH:
        return math.tanh(q / scale)
    if function == DECAY:
        return math.exp(-abs(q) / scale)
    if function == RISING:
        return -math.expm1(-abs(q) / scale)
    if function == RATIONAL:
        return 1.0 / (1.0 + abs(q / scale) ** order)
    if function == BELOW or function == BEYOND:
        return 1.0 if (q < scale) == (function == BELOW) else 0.0
    if function == PULSES or function == GATES:
        q -= scale * math.floor(q / scale + 0.5)
        if function == GATES:
            return 1.0 if abs(q) < 0.5 * order else 0.0
        return math.exp(-0.5 * (q / order) ** 2)
    return 1.0 if q > 0.0 else (-1.0 if q < 0.0 else 0.0)


@compiled
def size(row: Floats, known: Floats) -> float:
    """Coefficient times factors of a term."""
    value = row[W.COEFFICIENT]
    for i in range(int(row[W.FACTORS])):
        value *= factor(row, W.FIRST + W.FACTOR_SIZE * i, known)
    return value


@compiled
def of_friction(target: int, angle: float, value: float, known: Floats, out: Floats) -> None:
    """Add to ``out`` (3,) ``value`` times a part of the floor's friction; ``angle`` of its mirror or its lever."""
    if target == FRICTION:
        out[0] += value * known[W.FX]
        out[1] += value * known[W.FY]
        out[2] += value * known[W.FT]
        return
    if target == FLOOR_LEVER:
        c, s = math.cos(known[W.ANGLE] + angle), math.sin(known[W.ANGLE] + angle)
        out[2] += value * (c * known[W.FY] - s * known[W.FX])
        return
    if target == FLOOR_TORQUE:
        out[2] += value * known[W.FT]
        return
    if target == POLAR_FRICTION:
        length = math.hypot(known[W.HX], known[W.HY])
        if length > SHORT:
            c, s = known[W.HX] / length, known[W.HY] / length
            c, s = c * c - s * s, 2.0 * c * s
            out[0] += value * (c * known[W.FX] + s * known[W.FY])
            out[1] += value * (s * known[W.FX] - c * known[W.FY])
        return
    if target == MIRRORED_FRICTION:
        c, s = math.cos(2.0 * angle), math.sin(2.0 * angle)
        out[0] += value * (c * known[W.FX] + s * known[W.FY])
        out[1] += value * (s * known[W.FX] - c * known[W.FY])
        return


@compiled
def push(row: Floats, times: float, known: Floats, out: Floats) -> None:
    """Add ``times`` what a term of the flight gives to ``out`` (3,): acceleration along x and y, and of the spin."""
    value = times * size(row, known)
    target = int(row[W.TARGET])
    x, y = 0.0, 0.0
    if target == FIXED:
        out[0] += value * math.cos(row[W.TARGET_X])
        out[1] += value * math.sin(row[W.TARGET_X])
        return
    if target == SPIN:
        out[2] += value
        return
    if target == ALONG_BODY:
        out[0] += value * math.cos(known[W.ANGLE] + row[W.TARGET_X])
        out[1] += value * math.sin(known[W.ANGLE] + row[W.TARGET_X])
        return
    if FRICTION <= target <= MIRRORED_FRICTION or POLAR_FRICTION <= target <= FLOOR_TORQUE:
        of_friction(target, row[W.TARGET_X], value, known, out)
        return
    if target == OUTWARDS or target == SWIRL or target == MIRRORED_R:
        x, y = known[W.HX], known[W.HY]
    elif target == ALONG_V or target == ACROSS_V or target == MIRRORED_V:
        x, y = known[W.VX], known[W.VY]
    elif target == ALONG_AIRSPEED:
        x, y = known[W.VX] - row[W.TARGET_X], known[W.VY] - row[W.TARGET_Y]
    elif target == ALONG_U or target == ACROSS_U:
        x, y = known[W.UX], known[W.UY]
    elif target == ALONG_W:
        x, y = known[W.VX] - known[W.UX], known[W.VY] - known[W.UY]
    elif target == ALONG_A:
        x, y = known[W.HOST_AX], known[W.HOST_AY]
    elif target == FROM_CONTACT and remembers(known):
        x, y = known[W.HX] - known[W.LAST_X], known[W.HY] - known[W.LAST_Y]
    elif target == FROM_ROOM:
        x, y = known[W.X] - row[W.TARGET_X], known[W.Y] - row[W.TARGET_Y]
    elif target == FROM_HOST:
        x, y = known[W.HX] - row[W.TARGET_X], known[W.HY] - row[W.TARGET_Y]
    length = math.hypot(x, y)
    if length < SHORT:
        return
    if target in OF_MOTION and length < RESTS * AT_REST_M_PER_S:
        length /= math.tanh(length / AT_REST_M_PER_S)
    x, y = x / length, y / length
    if target == SWIRL or target == ACROSS_V or target == ACROSS_U:
        x, y = -y, x
    elif target == MIRRORED_V or target == MIRRORED_R:
        c, s = math.cos(2.0 * row[W.TARGET_X]), math.sin(2.0 * row[W.TARGET_X])
        x, y = c * x + s * y, s * x - c * y
    out[0] += value * x
    out[1] += value * y


@compiled
def pushes(rows: Floats, known: Floats, out: Floats) -> None:
    """Fill ``out`` (N, 3, T) with what each of ``rows`` (T, ROW_SIZE) gives in each of the states ``known``
    (N, KNOWN_SIZE)."""
    out[:] = 0.0
    for i in range(known.shape[0]):
        for j in range(rows.shape[0]):
            push(rows[j], 1.0, known[i], out[i, :, j])


@compiled
def shared_values(shared: SharedTerms, known: Floats, pushed: Floats, value: Floats) -> None:
    """Each direction ``pushed`` (N, D, 3) and the ``value`` (N, F) of each factor in each of the states ``known``, once
    for all the terms that have it."""
    pushed[:] = 0.0
    for i in range(known.shape[0]):
        for d in range(shared.directions.shape[0]):
            push(shared.directions[d], 1.0, known[i], pushed[i, d])
        for f in range(shared.factors.shape[0]):
            value[i, f] = factor(shared.factors[f], 0, known[i])


@compiled
def shared_pushes(shared: SharedTerms, first: int, pushed: Floats, value: Floats, out: Floats) -> None:
    """What :func:`pushes` gives of as many terms from the ``first`` on as ``out`` (N, 3, T) has place for, from
    :func:`shared_values`."""
    for i in range(out.shape[0]):
        for j in range(out.shape[2]):
            size = shared.coefficient[first + j]
            for k in range(shared.factor_of.shape[1]):
                if shared.factor_of[first + j, k] >= 0:
                    size *= value[i, shared.factor_of[first + j, k]]
            for m in range(3):
                out[i, m, j] = size * pushed[i, shared.direction_of[first + j], m]


@compiled
def sizes(rows: Floats, known: Floats, out: Floats) -> None:
    """Fill ``out`` (N, T) with coefficient times factors of each of ``rows`` in each of the states ``known``."""
    for i in range(known.shape[0]):
        for j in range(rows.shape[0]):
            out[i, j] = size(rows[j], known[i])


@compiled
def law_of(target: int, rows: Floats, known: Floats) -> float:
    """Sum of the terms that act on one number (restitution, ...)."""
    total = 0.0
    for j in range(rows.shape[0]):
        if int(rows[j, W.TARGET]) == target:
            total += size(rows[j], known)
    return total
