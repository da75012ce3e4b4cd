"""The likeliest wall friction and tangential restitution, compiled: one likelihood, followed downhill from several
starts.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.compiled import compiled, making_arrays

Array = NDArray[np.float64]
# Nelder and Mead's simplex: how far beyond the worst corner's mirror image, how far towards it, and the shrinkage.
EXPANSION, CONTRACTION, SHRINKAGE = 2.0, 0.5, 0.5
# It rests where its corners agree to these: in friction, restitution and the logarithm of the scatter, and in -2 log L.
# After so many moves for each unknown it ends anyway.
CORNERS_AGREE, VALUES_AGREE, MOST_MOVES = 1e-5, 1e-3, 400


class Impulses(NamedTuple):
    """What the K impacts say: ``slip`` (m/s), ``normal`` and ``tangential`` impulses per mass (m/s), ``mobility`` and
    ``coupling`` of the contact point, ``variance`` of the tangential impulse and what an outlier adds to it
    (m^2/s^2), the share of ``outliers``, and the ``design`` (K, P) that wall friction is linear in.
    """

    slip: Array
    normal: Array
    tangential: Array
    mobility: Array
    coupling: Array
    variance: Array
    broad: Array
    outliers: float
    design: Array


@compiled
def misfit(theta: Array, impulses: Impulses) -> float:
    """-2 log L of friction's coefficients (P,), tangential restitution and the logarithm of the scatter, in one row."""
    count, p = impulses.design.shape
    beta, scatter, share = theta[p], np.exp(theta[p + 1]), impulses.outliers
    follows, strays = np.log1p(-share), np.log(share) if share > 0.0 else 0.0
    total = 0.0
    for i in range(count):
        friction = 0.0
        for j in range(p):
            friction += impulses.design[i, j] * theta[j]
        normal = impulses.normal[i]
        stick = -((1.0 + beta) * impulses.slip[i] + impulses.coupling[i] * normal) / impulses.mobility[i]
        predicted = np.sign(stick) * min(abs(stick), friction * normal)
        variance, r2 = impulses.variance[i] + (scatter * normal) ** 2, (impulses.tangential[i] - predicted) ** 2
        density = follows - 0.5 * (r2 / variance + np.log(variance))
        if share > 0.0:
            broad = variance + impulses.broad[i]
            outlier = strays - 0.5 * (r2 / broad + np.log(broad))
            high, low = max(density, outlier), min(density, outlier)
            density = high + np.log1p(np.exp(low - high))
        total += density
    return -2.0 * total


@compiled
def _ordered(simplex: Array, value: Array) -> None:
    """Corners by their values, equal ones as they stand; no number comes last."""
    for i in range(1, len(value)):
        j = i
        while j > 0 and (value[j] < value[j - 1] or (np.isnan(value[j - 1]) and not np.isnan(value[j]))):
            value[j - 1], value[j] = value[j], value[j - 1]
            for k in range(simplex.shape[1]):
                simplex[j - 1, k], simplex[j, k] = simplex[j, k], simplex[j - 1, k]
            j -= 1


@compiled
def _rests(simplex: Array, value: Array) -> bool:
    """Whether all corners agree with the best one."""
    for i in range(1, len(value)):
        if not abs(value[i] - value[0]) <= VALUES_AGREE:
            return False
        for j in range(simplex.shape[1]):
            if not abs(simplex[i, j] - simplex[0, j]) <= CORNERS_AGREE:
                return False
    return True


@compiled
def _tried(simplex: Array, value: Array, beyond: float, impulses: Impulses, room: Array) -> float:
    """:func:`misfit` as far beyond the middle of the other corners, in units of its distance, as the worst is before
    it: the place in ``room``.
    """
    worst = len(value) - 1
    for j in range(len(room)):
        middle = 0.0
        for i in range(worst):
            middle += simplex[i, j]
        middle /= worst
        room[j] = (1.0 + beyond) * middle - beyond * simplex[worst, j]
    return misfit(room, impulses)


@making_arrays
def _moved(simplex: Array, value: Array, impulses: Impulses, room: Array) -> None:
    """One move of Nelder and Mead's: the worst corner of the ordered simplex replaced, or all drawn to the best; room
    (2, P + 2).
    """
    worst, taken = len(value) - 1, 0
    mirrored = _tried(simplex, value, 1.0, impulses, room[0])
    found = mirrored
    if mirrored < value[0] or not mirrored < value[worst - 1]:
        outside = mirrored < value[worst]
        beyond = EXPANSION if mirrored < value[0] else (CONTRACTION if outside else -CONTRACTION)
        tried = _tried(simplex, value, beyond, impulses, room[1])
        if mirrored < value[0]:
            taken = 1 if tried < mirrored else 0
        else:
            taken = 1 if (tried <= mirrored if outside else tried < value[worst]) else -1
        found = tried if taken == 1 else mirrored
    if taken >= 0:
        value[worst] = found
        simplex[worst] = room[taken]
        return
    for i in range(1, worst + 1):
        for j in range(simplex.shape[1]):
            simplex[i, j] = simplex[0, j] + SHRINKAGE * (simplex[i, j] - simplex[0, j])
        value[i] = misfit(simplex[i], impulses)


@making_arrays
def likeliest(starts: Array, steps: Array, followed: int, impulses: Impulses, best: Array) -> float:
    """Least :func:`misfit` that Nelder and Mead's search finds from the ``followed`` likeliest of the ``starts`` (S, P
    + 2), its unknowns in ``best`` (P + 2,); ``steps`` (P + 2,): the first simplex' from each start.
    """
    size = starts.shape[1]
    score, value = np.empty(len(starts)), np.empty(size + 1)
    simplex, room = np.empty((size + 1, size)), np.empty((2, size))
    for i in range(len(starts)):
        score[i] = misfit(starts[i], impulses)
    least = np.inf
    best[:] = starts[0]
    for _ in range(min(followed, len(starts))):
        first = 0
        for i in range(1, len(starts)):
            if score[i] < score[first]:
                first = i
        for i in range(size + 1):
            simplex[i] = starts[first]
            if i > 0:
                simplex[i, i - 1] += steps[i - 1]
            value[i] = misfit(simplex[i], impulses)
        score[first] = np.inf
        _ordered(simplex, value)
        for _move in range(1, MOST_MOVES * size):
            if _rests(simplex, value):
                break
            _moved(simplex, value, impulses, room)
            _ordered(simplex, value)
        if value[0] < least:
            least = value[0]
            best[:] = simplex[0]
    return least
