"""The disk's accelerations between contacts: floor friction, air, slopes, fields, torques."""

import numpy as np

from analysis.blind.plant.compiled import Floats, inlined, making_arrays
from analysis.blind.plant.flight.air import add_air, drag_rate
from analysis.blind.plant.flight.fields import add_fields
from analysis.blind.plant.flight.floor_friction import floor_friction
from analysis.blind.plant.flight.floor_load import floor_load
from analysis.blind.plant.flight.friction_by_history import add_age, add_beads, add_charge, add_float, add_oil
from analysis.blind.plant.flight.friction_by_place import add_tread
from analysis.blind.plant.flight.instant import Instant, instant_of
from analysis.blind.plant.flight.slopes import add_slopes
from analysis.blind.plant.flight.torques import add_torques
from analysis.blind.plant.flight.traction import add_leaning_fibres, ring_torque, traction
from analysis.blind.plant.flight.under_the_disk import add_dust, add_films, add_hunting, add_mat, add_wobble
from analysis.blind.plant.parameters import PlantParameters
from analysis.blind.plant.state import ANGLE, LAG_X, LAG_Y, SPIN, STATES, VX, VY, WAY, X, Y


@making_arrays
def derivative(time: float, state: Floats, p: PlantParameters, host: Floats, table: Floats) -> Floats:
    """`rate_into` a new array, for Python."""
    out = np.empty(STATES)
    rate_into(time, state, p, host, table, out)
    return out


@inlined
def rate_into(time: float, state: Floats, p: PlantParameters, host: Floats, table: Floats, out: Floats) -> None:
    """Rate of the state (its numbers: `plant.state`) in flight; `host`: lines of its path (`pose_of`), `table`:
    `disk_friction_table`."""
    for i in range(STATES):
        out[i] = 0.0
    at = instant_of(time, state, p, host)
    force_x, force_y, turn = _floor(at, p, table, out)
    drag = drag_rate(state[VX], state[VY], p)
    out[X], out[Y], out[ANGLE] = state[VX], state[VY], state[SPIN]
    out[VX] = force_x - drag * state[VX]
    out[VY] = force_y - drag * state[VY]
    torque = at.arm_x * force_y - at.arm_y * force_x + p.disk_radius_m * turn
    out[SPIN] = torque / (p.inertia_factor * p.disk_radius_m**2)
    add_slopes(at, p, out)
    add_air(at, p, out)
    add_fields(at, p, out)
    add_torques(at, p, out)
    add_mat(at, p, out)
    add_dust(at, p, out)
    add_wobble(at, p, out)
    add_films(at, p, out)
    add_hunting(at, p, out)


@inlined
def _floor(at: Instant, p: PlantParameters, table: Floats, out: Floats) -> tuple[float, float, float]:
    """The floor's friction per unit mass: force (x, y) and torque / R; into `out` the way slid and what lags."""
    along_x, along_y, turn = traction(at, p, table)
    if p.leant != 0.0:
        along_x, along_y = add_leaning_fibres(along_x, along_y, at, p, out)
    held, load = floor_friction(at, p), floor_load(at, p)
    force_x, force_y, turn = -held * load * along_x, -held * load * along_y, -held * load * turn * ring_torque(p)
    if p.lag_s > 0.0:
        out[LAG_X], out[LAG_Y] = (force_x - at.state[LAG_X]) / p.lag_s, (force_y - at.state[LAG_Y]) / p.lag_s
        force_x, force_y = at.state[LAG_X], at.state[LAG_Y]
    out[WAY] = np.sqrt(at.slip_x**2 + at.slip_y**2)
    add_oil(at, p, out)
    add_charge(at, p, out)
    add_age(at, p, out)
    add_beads(at, p, out)
    add_float(at, p, out)
    add_tread(at, p, out)
    return force_x, force_y, turn
