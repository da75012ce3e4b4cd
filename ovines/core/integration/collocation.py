"""Lobatto's collocation with seven nodes, both ends of a step among them: order 12.

The slopes of a step are those of a polynomial through the nodes that meets the equations there (Hairer, Wanner, Solving
Ordinary Differential Equations II, IV.5: Lobatto IIIA).  Where they hardly depend on what they lead to, as with
friction, repeating "slopes, then velocities" settles within a few sweeps, whose nodes wait for nobody.
"""

from __future__ import annotations

import numpy as np

from ovines.core.compiled import Floats, inlined

N_NODES = 7
_legendre = np.polynomial.legendre
_points = np.array([-1.0, *np.sort(np.real(_legendre.Legendre.basis(N_NODES - 1).deriv().roots())), 1.0])
_primitives = np.array([_legendre.legval(_points, _legendre.legint(row, lbnd=-1)) for row in np.eye(N_NODES)])


def upper_factor(matrix: np.ndarray) -> np.ndarray:
    """U of a matrix L U, where L has ones on its diagonal (no rows are exchanged)."""
    upper = matrix.copy()
    for column in range(len(upper)):
        for row in range(column + 1, len(upper)):
            upper[row] -= upper[row, column] / upper[column, column] * upper[column]
    return upper


#: Nodes (7,) of a step, 0 to 1.
NODES = 0.5 * (_points + 1.0)
#: Legendre coefficients (7, 7) of a polynomial from its values at the nodes.
MODES = np.linalg.inv(_legendre.legvander(_points, N_NODES - 1))
#: What the value at node j gives to the integral up to node i: [j, i], in steps.
INTEGRALS = np.ascontiguousarray(0.5 * (_primitives.T @ MODES).T)
#: The same, [i, j].
TO_NODES = np.ascontiguousarray(INTEGRALS.T)
#: A lower triangular matrix [i, j] in place of the integrals, from the second node on, whose steps settle stiff slopes:
#: the transposed upper factor of the integrals' own (Weiser, BIT Numer. Math. 55, 1219 (2015)).
LOWER = np.zeros((N_NODES, N_NODES))
LOWER[1:, 1:] = upper_factor(INTEGRALS[1:, 1:]).T
#: Integral over the whole step (7,).
WEIGHTS = np.ascontiguousarray(INTEGRALS[:, -1])
#: The last four coefficients' rows, what the error is read from.
TAIL = np.ascontiguousarray(MODES[-4:])


@inlined
def integrate(rows: Floats, slopes: int, start: float, h: float, out: int) -> None:
    """Row ``out`` of ``rows`` (n, 7 or more): values at the nodes from the slopes there, the row ``slopes``.

    Rows are numbers here and below: a slice handed over costs more than what is done with it.
    """
    for i in range(N_NODES):
        rows[out, i] = 0.0
    for j in range(N_NODES):
        slope = h * rows[slopes, j]
        for i in range(1, N_NODES):
            rows[out, i] += INTEGRALS[j, i] * slope
    for i in range(N_NODES):
        rows[out, i] += start


@inlined
def settle(rows: Floats, slopes: int, start: float, h: float, values: int, damping: int, room: int) -> None:
    """The same for slopes that fall with the values at the rates of the row ``damping`` (1/s): what is lacking to the
    integrals is put on the values only as far as the slopes do not take it back.
    """
    integrate(rows, slopes, start, h, room)
    for i in range(1, N_NODES):
        lacking = rows[room, i] - rows[values, i]
        for j in range(1, i):
            lacking -= h * LOWER[i, j] * rows[damping, j] * rows[room, j]
        rows[room, i] = lacking / (1.0 + h * LOWER[i, i] * rows[damping, i])
        rows[values, i] += rows[room, i]


@inlined
def tail(rows: Floats, row: int) -> tuple[float, float]:
    """Size of the last two Legendre coefficients of a row's values at the nodes, and of the two before."""
    a, b, c, d = 0.0, 0.0, 0.0, 0.0
    for i in range(N_NODES):
        value = rows[row, i]
        a += TAIL[0, i] * value
        b += TAIL[1, i] * value
        c += TAIL[2, i] * value
        d += TAIL[3, i] * value
    return max(abs(c), abs(d)), max(abs(a), abs(b))


@inlined
def left_over(h: float, last: float, before: float) -> float:
    """Error of an integral over ``h`` from the sizes of :func:`tail`: the coefficients, which fall at the pace that
    these show, are known up to the seventh and enter from the thirteenth on.
    """
    pace = min(last / before, 1.0) if before > 0.0 else 1.0
    return h * last * pace * pace * pace


@inlined
def stretch(rows: Floats, row: int, factor: float, room: int) -> None:
    """A row's values at the nodes of a step ``factor`` times as long, of the same polynomial, in place; another row is
    room.
    """
    for m in range(N_NODES):
        total = 0.0
        for i in range(N_NODES):
            total += MODES[m, i] * rows[row, i]
        rows[room, m] = total
    for i in range(1, N_NODES):
        x = 2.0 * factor * NODES[i] - 1.0
        before, now, total = 1.0, x, rows[room, 0] + rows[room, 1] * x
        for m in range(2, N_NODES):
            before, now = now, ((2 * m - 1) * x * now - (m - 1) * before) / m
            total += rows[room, m] * now
        rows[row, i] = total
