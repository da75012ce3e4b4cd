"""Tangents as compiled code holds them: rows of a tangent of the state, and what is needed on the way."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ovines.core.compiled import Floats, making_arrays

#: rows of a tangent of the state: the NES's six as in :mod:`ovines.core.state`, then the Host's in the same order
HOST_X, HOST_Y, HOST_VX, HOST_VY, HOST_ANGLE, HOST_SPIN = range(6, 12)
N_ROWS = 12
#: rows of what the contact's geometry does: turn of the normal, gap, relative velocity (x, y; normal; slip), the Host's
#: lever arms, the inverse masses
TURN, GAP, RVX, RVY, NORMAL, SLIPS, LEVER_N, LEVER_T, K_NN, K_NT, K_TT = range(11)
N_GEOMETRY = 11


class Room(NamedTuple):
    """Room for ``m`` columns.

    Slopes of the base's motion over the drive's numbers (9, 3) and the tangents of its accelerations (3, m); a sprung
    Host's steady response over them at a flight's start and end (6, 3); what they do to the floor's velocity and load
    (9,); the floor's friction and its slopes (15,); the contact's geometry (11, m + 1; the last column is the flow's),
    its two forces (2,) and their tangents (2, m); rates in a mode (12,).
    """

    base: Floats
    turning: Floats
    response: Floats
    response_after: Floats
    shaken: Floats
    friction: Floats
    geometry: Floats
    forces: Floats
    d_forces: Floats
    flow: Floats


class Columns(NamedTuple):
    """Tangents of the state (12, m; a column more where the flow is among them) and the numbers (13, m), and room."""

    s: Floats
    q: Floats
    room: Room


@making_arrays
def empty_room(m: int) -> Room:
    """For ``m`` columns."""
    return Room(
        np.zeros((9, 3)), np.zeros((3, m)), np.zeros((6, 3)), np.zeros((6, 3)), np.zeros(9), np.zeros(15),
        np.zeros((N_GEOMETRY, m + 1)), np.zeros(2), np.zeros((2, m)), np.zeros(N_ROWS),
    )  # fmt: skip
