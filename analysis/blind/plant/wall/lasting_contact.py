"""A contact that lasts: a spring-dashpot along the normal, a spring with a Coulomb limit along the wall."""

import numpy as np

from analysis.blind.plant.compiled import Floats, compiled
from analysis.blind.plant.flight.accelerations import derivative
from analysis.blind.plant.parameters import PlantParameters
from analysis.blind.plant.state import SPIN, STRETCH, VX, VY
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
) -> Floats:
    """Advance by `step` in contact through a Kelvin-Voigt normal and a tangential spring with a Coulomb
    limit.

    `state[STRETCH]` is the stretch of the tangential spring. Midpoint steps of a four-hundredth of the contact's
    duration.
    """
    count = int(np.ceil(step / p.contact_time_s * 400.0))
    h = step / count
    for _ in range(count):
        first = _pushed(time, state, p, host, table, spring)[0]
        middle, force = _pushed(time + 0.5 * h, state + 0.5 * h * first, p, host, table, spring)
        state = state + h * middle
        limit = p.wall_friction * force / spring[2]
        state[STRETCH] = min(max(state[STRETCH], -limit), limit)
        time += h
    return state


@compiled
def _pushed(
    time: float, state: Floats, p: PlantParameters, host: Floats, table: Floats, spring: tuple[float, float, float]
) -> tuple[Floats, float]:
    """Rate of the state and the wall's normal force per unit mass (never pulling)."""
    stiffness, damping, tangential = spring
    out = derivative(time, state, p, host, table)
    gap, nx, ny = wall_gap(time, state, p, host)
    if gap >= 0.0:
        return out, 0.0
    approach, slip, arm_x, arm_y = contact_velocity(time, state, p, host, nx, ny)
    force = max(-stiffness * gap + damping * approach, 0.0)
    limit = p.wall_friction * force
    shear = min(max(-tangential * state[STRETCH], -limit), limit)
    fx, fy = -force * nx - shear * ny, -force * ny + shear * nx
    out[VX] += fx
    out[VY] += fy
    out[SPIN] += (arm_x * fy - arm_y * fx) / (p.inertia_factor * p.disk_radius_m**2)
    out[STRETCH] = slip
    return out, force
