"""A contact that lasts: a spring-dashpot along the normal, or Hertz' law, and a spring with a Coulomb limit along the
wall."""

import numpy as np

from analysis.blind.plant.compiled import Floats, compiled, copy_into
from analysis.blind.plant.flight.accelerations import rate_into
from analysis.blind.plant.parameters import PlantParameters
from analysis.blind.plant.state import SPIN, STATES, STEP_S, STRETCH, VX, VY
from analysis.blind.plant.wall.contact import contact_velocity, wall_gap

ROUND_M_PER_S = 1.0  # approach of the blow that lasts as long as a round contact's cause says
DEPTHS = 2.9432  # duration of a round contact that loses nothing, in depths over the approach


@compiled
def lasts_s(p: PlantParameters) -> float:
    """How long a blow lasts, about; 0 where it takes no time."""
    return max(p.contact_time_s, p.hertz_contact_s)


@compiled
def spring_dashpot(p: PlantParameters) -> tuple[float, float, float]:
    """Stiffness and damping of the normal, stiffness of the tangential spring, per unit mass.

    The contact's duration is the damped half period, the restitution its loss in one; the wall never pulls.
    The tangential spring is a share of the normal one (Mindlin, J. Appl. Mech. 16, 259 (1949): 0.82 for
    steel on steel).

    Of a round contact they are those of the depth's powers 3/2 and 1/4 (Hertz; Tsuji, Tanaka and Ishida, Powder
    Technology 71, 239 (1992)).  It gives back as much at every approach: the damping is sqrt(5) times the linear ratio
    (Antypov and Elliott, EPL 94, 50004 (2011)), and lasts with its power -1/5: from (5 v^2 / (4 stiffness))^(2/5), the
    greatest depth at an approach v, comes the stiffness.  The tangential spring is that of the linear one.
    """
    loss = -np.log(p.restitution) / np.pi
    ratio = loss / np.sqrt(1.0 + loss * loss)
    natural = np.pi / lasts_s(p) / np.sqrt(1.0 - ratio * ratio)
    if p.hertz_contact_s > 0.0:
        deepest = p.hertz_contact_s * ROUND_M_PER_S / DEPTHS
        stiffness = 1.25 * ROUND_M_PER_S**2 / deepest**2.5
        return stiffness, np.sqrt(5.0 * stiffness) * ratio, p.contact_shear_share * natural**2
    return natural**2, 2.0 * ratio * natural, p.contact_shear_share * natural**2


@compiled
def compliant_step(
    time: float,
    state: Floats,
    p: PlantParameters,
    host: Floats,
    table: Floats,
    spring: tuple[float, float, float],
    rates: Floats,
    new: Floats,
) -> None:
    """Advance by `STEP_S` into `new`, in contact through a Kelvin-Voigt normal and a tangential spring with a Coulomb
    limit; `rates` (2 or more, STATES): room to work in.

    `new[STRETCH]` is the stretch of the tangential spring. Midpoint steps of a four-hundredth of the contact's
    duration.
    """
    count = int(np.ceil(STEP_S / lasts_s(p) * 400.0))
    h = STEP_S / count
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
    if p.hertz_contact_s > 0.0:
        stiffness, damping = stiffness * np.sqrt(-gap), damping * np.sqrt(np.sqrt(-gap))
    force = max(-stiffness * gap + damping * approach, 0.0)
    limit = p.wall_friction * force
    shear = min(max(-tangential * state[STRETCH], -limit), limit)
    fx, fy = -force * nx - shear * ny, -force * ny + shear * nx
    out[VX] += fx
    out[VY] += fy
    out[SPIN] += (arm_x * fy - arm_y * fx) / (p.inertia_factor * p.disk_radius_m**2)
    out[STRETCH] = slip
    return force
