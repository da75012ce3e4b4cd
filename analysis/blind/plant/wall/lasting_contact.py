"""A contact that lasts: a spring-dashpot along the normal, a spring with a Coulomb limit along the wall."""

import numpy as np

from analysis.blind.plant.compiled import Floats, compiled, copy_into
from analysis.blind.plant.flight.accelerations import rate_into
from analysis.blind.plant.parameters import PlantParameters
from analysis.blind.plant.state import SPIN, STATES, STRETCH, VX, VY
from analysis.blind.plant.wall.contact import contact_velocity, wall_gap


@compiled
def spring_dashpot(p: PlantParameters) -> tuple[float, float, float]:
    """Stiffness and damping of the normal, stiffness of the tangential spring, per unit mass.

    The contact's duration is the damped half period, the restitution its loss in one; the wall never pulls.
    The tangential spring is a share of the normal one (Mindlin, J. Appl. Mech. 16, 259 (1949): 0.82 for
    steel on steel).
    """
    loss = -np.log(p.restitution) / np.pi
    ratio = loss / np.sqrt(1.0 + loss * loss)
    natural = np.pi / p.contact_time_s / np.sqrt(1.0 - ratio * ratio)
    return natural**2, 2.0 * ratio * natural, p.contact_shear_share * natural**2


@compiled
def compliant_step(
    time: float,
    state: Floats,
    step: float,
    p: PlantParameters,
    host: Floats,
    table: Floats,
    spring: tuple[float, float, float],
    rates: Floats,
    new: Floats,
) -> None:
    """Advance by `step` into `new`, in contact through a Kelvin-Voigt normal and a tangential spring with a Coulomb
    limit; `rates` (2 or more, STATES): room to work in.

    `new[STRETCH]` is the stretch of the tangential spring. Midpoint steps of a four-hundredth of the contact's
    duration.
    """
    count = int(np.ceil(step / p.contact_time_s * 400.0))
    h = step / count
    copy_into(new, state)
    rate, middle = rates[0], rates[1]
    for _ in range(count):
        _pushed(time, new, p, host, table, spring, rate)
        for i in range(STATES):
            middle[i] = new[i] + 0.5 * h * rate[i]
        force = _pushed(time + 0.5 * h, middle, p, host, table, spring, rate)
        for i in range(STATES):
            new[i] += h * rate[i]
        limit = p.wall_friction * force / spring[2]
        new[STRETCH] = min(max(new[STRETCH], -limit), limit)
        time += h


@compiled
def _pushed(
    time: float,
    state: Floats,
    p: PlantParameters,
    host: Floats,
    table: Floats,
    spring: tuple[float, float, float],
    out: Floats,
) -> float:
    """Rate of the state into `out`, and the wall's normal force per unit mass (never pulling)."""
    stiffness, damping, tangential = spring
    rate_into(time, state, p, host, table, out)
    gap, nx, ny = wall_gap(time, state, p, host)
    if gap >= 0.0:
        return 0.0
    approach, slip, arm_x, arm_y = contact_velocity(time, state, p, host, nx, ny)
    force = max(-stiffness * gap + damping * approach, 0.0)
    limit = p.wall_friction * force
    shear = min(max(-tangential * state[STRETCH], -limit), limit)
    fx, fy = -force * nx - shear * ny, -force * ny + shear * nx
    out[VX] += fx
    out[VY] += fy
    out[SPIN] += (arm_x * fy - arm_y * fx) / (p.inertia_factor * p.disk_radius_m**2)
    out[STRETCH] = slip
    return force
