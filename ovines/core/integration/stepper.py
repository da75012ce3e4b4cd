"""One step of the order-8 pair, and the step size that keeps its error below the tolerance."""

from __future__ import annotations

import math

from ovines.core import state as S
from ovines.core.compiled import Floats, Ints, compiled, inlined
from ovines.core.integration.dop853 import ERROR_3, ERROR_5, NODES, STAGES, WEIGHTS
from ovines.core.system import parameters as P
from ovines.core.system.dynamics import derivatives_inlined
from ovines.core.system.packed import Contact, System

#: steps in a row, and the share of a crossing of the length that they must take the run on by: below it has no end (a
#: force that holds the disk where its sign changes; a usual crossing takes 20 to 200 steps)
STEPS_WATCHED, LEAST_CROSSED = 100_000, 0.1


@compiled
def step(
    t: float,
    y: Floats,
    h: float,
    contact: Contact,
    system: System,
    work: Floats,
    out: Floats,
) -> float:
    """Advance ``y`` by ``h`` into ``out``; ``work[0]`` holds the derivative at ``t`` on entry.

    ``work`` (16 rows of 19): rows 0-11 stages, 12 a trial state, 13 scratch, 14 place.  Returns the error over
    the tolerance (accept below 1), Hairer's blend of the third- and fifth-order estimates.
    """
    p, k = system.p, system.k
    n = k[P.STATE_SIZE]
    trial = work[P.TRIAL]
    for i in range(1, 12):
        for j in range(n):
            total = 0.0
            for m in range(i):
                total += STAGES[i, m] * work[m, j]
            trial[j] = y[j] + h * total
        derivatives_inlined(t + NODES[i] * h, trial, contact, system, work[P.SCRATCH], work[P.PLACE], work[i])
    return finish_step(y, h, p, k, work, out)


@compiled
def finish_step(y: Floats, h: float, p: Floats, k: Ints, work: Floats, out: Floats) -> float:
    """The new state from the twelve stages in ``work``, and its error over the tolerance."""
    n = k[P.STATE_SIZE]
    error_5, error_3 = 0.0, 0.0
    for j in range(n):
        slope = work[0, j]
        total, e5, e3 = WEIGHTS[0] * slope, ERROR_5[0] * slope, ERROR_3[0] * slope
        for m in range(5, 12):  # the second to the fifth weigh nothing
            slope = work[m, j]
            total += WEIGHTS[m] * slope
            e5 += ERROR_5[m] * slope
            e3 += ERROR_3[m] * slope
        out[j] = y[j] + h * total
        scale = p[P.TOLERANCE] * state_scale(j, max(abs(y[j]), abs(out[j])), p)
        error_5 += (e5 / scale) ** 2
        error_3 += (e3 / scale) ** 2
    if error_5 == 0.0:
        return 0.0
    return abs(h) * error_5 / math.sqrt((error_5 + 0.01 * error_3) * n)


@compiled
def state_scale(j: int, size: float, p: Floats) -> float:
    """Size that the tolerance of state ``j`` refers to: the scenario's own length, speed, energy, or the value."""
    length, speed = p[P.LENGTH], p[P.SPEED]
    if P.ENERGIES <= j < P.HOST:
        return p[P.MASS] * speed * speed + size
    i = j if j < P.HOST else j - P.HOST
    if i < 2:
        return length
    if i < 4:
        return speed + size
    if i == 4:
        return 1.0
    return speed / p[P.RADIUS] + size


@inlined
def stands_still(passed: float, y: Floats, p: Floats) -> bool:
    """Whether ``passed`` (s) is too little for :data:`STEPS_WATCHED` steps."""
    return passed * (p[P.SPEED] + math.hypot(y[S.VX], y[S.VY])) < LEAST_CROSSED * p[P.LENGTH]


@compiled
def next_size(h: float, error: float) -> float:
    """Step size after a step with this scaled error."""
    if error <= 1e-12:
        return 10.0 * h
    return h * min(10.0, max(0.2, 0.9 * error ** (-0.125)))
