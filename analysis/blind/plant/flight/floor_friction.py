"""The floor's coefficient of friction: by the speed, the direction of sliding and how the Host moves, and with what
places and history make of it."""

import numpy as np

from analysis.blind.plant.compiled import inlined
from analysis.blind.plant.flight.friction_by_history import by_history
from analysis.blind.plant.flight.friction_by_place import by_place
from analysis.blind.plant.flight.instant import Instant
from analysis.blind.plant.host import HOST_M_PER_S, HOST_M_PER_S2
from analysis.blind.plant.parameters import PlantParameters
from analysis.blind.plant.state import AFLOAT, ANGLE, IMPACT_S, SPIN, VX, VY

CHATTER_M_PER_S = 0.2  # width of the band of sliding speeds in which a disk chatters
FACED_M = 0.003  # from the Host's centre, within which a lathe's marks have no direction
BENEATH_M = 0.02  # along x in the room, on which a magnet at one side draws the disk down by what its cause says
SUCTION_M_PER_S = 0.3  # slip at which half of a wet film's suction is left
BREAK_M_PER_S = 0.1  # of the slip's speed, within which a disk breaks away: no step for the integrator
STRONGER_M_PER_S, CREEP_M_PER_S = 0.7, 0.05  # speed at which friction is what it is; below which it falls no more
LEAST_RIDING = 0.1  # share of the friction that a disk keeps however fast it spins


@inlined
def floor_friction(at: Instant, p: PlantParameters) -> float:
    """The coefficient with every cause that acts on it."""
    mu = p.floor_friction * (1.0 + p.friction_change_per_s * (at.time - 0.5 * p.duration_s))
    mu *= 1.0 + p.weakening * np.exp(-np.sqrt(at.slip_x**2 + at.slip_y**2) / p.weakening_m_per_s)
    if p.settling != 0.0 and at.time > at.state[IMPACT_S] >= 0.0:
        mu *= 1.0 - p.settling * np.exp(-(at.time - at.state[IMPACT_S]) / p.settling_s)
    mu *= by_place(at, p)
    mu *= _by_speed(at, p)
    mu *= _by_direction(at, p)
    mu *= by_history(at, p)
    return mu * _by_the_host(at, p)


@inlined
def _by_speed(at: Instant, p: PlantParameters) -> float:
    """What it is multiplied by at a speed: lift with its square, a film below a fast spin, chatter in a band.

    Stribeck: what creeps is held more than what runs, 1 + `stribeck` exp(-speed / `stribeck_m_per_s`).
    A film of oil carries what runs, and what creeps touches through it: 1 + `mixed` exp(-(speed / `mixed_m_per_s`)^2).
    Friction of rest is more than of sliding: 1 + `breakaway` below `breakaway_m_per_s`.
    A wet film draws down what slides over it slowly: 1 + `suction` / (1 + speed / `SUCTION_M_PER_S`).
    Junctions that are sheared fast are stronger: 1 + `strengthening` log((speed + `CREEP_M_PER_S`) /
    `STRONGER_M_PER_S`).
    Grease stiffens as it is sheared: 1 + `stiffened_s_per_m` (speed - `STRONGER_M_PER_S`).
    Friction of a polymer goes with a power of the speed: ((speed + `CREEP_M_PER_S`) / `STRONGER_M_PER_S`)^`powered`.
    A disk that spins draws air below itself and rides on it: 1 - `riding_s` times its spin over the floor.
    What has slid fast floats on the film that it has raised, until it slides slowly: 1 - `afloat` times how far it
    floats (`add_float`).
    """
    share = 1.0
    if p.lift != 0.0:
        share *= 1.0 - p.lift * min((at.state[VX] ** 2 + at.state[VY] ** 2) / p.lift_m_per_s**2, 1.0)
    if p.film != 0.0:
        share *= 1.0 - p.film * (1.0 - np.exp(-abs(at.state[SPIN]) / p.film_rad_per_s))
    if p.chatter != 0.0:
        off = (np.sqrt(at.slip_x**2 + at.slip_y**2) - p.chatter_m_per_s) / CHATTER_M_PER_S
        share *= 1.0 - p.chatter * np.exp(-0.5 * off**2)
    if p.stribeck != 0.0:
        share *= 1.0 + p.stribeck * np.exp(-np.sqrt(at.slip_x**2 + at.slip_y**2) / p.stribeck_m_per_s)
    if p.mixed != 0.0:
        share *= 1.0 + p.mixed * np.exp(-(at.slip_x**2 + at.slip_y**2) / p.mixed_m_per_s**2)
    if p.breakaway != 0.0:
        off = (np.sqrt(at.slip_x**2 + at.slip_y**2) - p.breakaway_m_per_s) / BREAK_M_PER_S
        share *= 1.0 + p.breakaway * 0.5 * (1.0 - np.tanh(off))
    if p.suction != 0.0:
        share *= 1.0 + p.suction / (1.0 + np.sqrt(at.slip_x**2 + at.slip_y**2) / SUCTION_M_PER_S)
    if p.strengthening != 0.0:
        speed = np.sqrt(at.slip_x**2 + at.slip_y**2) + CREEP_M_PER_S
        share *= max(1.0 + p.strengthening * np.log(speed / STRONGER_M_PER_S), 0.0)
    if p.stiffened_s_per_m != 0.0:
        faster = np.sqrt(at.slip_x**2 + at.slip_y**2) - STRONGER_M_PER_S
        share *= max(1.0 + p.stiffened_s_per_m * faster, 0.0)
    if p.powered != 0.0:
        speed = np.sqrt(at.slip_x**2 + at.slip_y**2) + CREEP_M_PER_S
        share *= (speed / STRONGER_M_PER_S) ** p.powered
    if p.riding_s != 0.0:
        share *= max(1.0 - p.riding_s * abs(at.turning), LEAST_RIDING)
    if p.afloat != 0.0:
        share *= max(1.0 - p.afloat * at.state[AFLOAT], 0.0)
    return share


@inlined
def _by_direction(at: Instant, p: PlantParameters) -> float:
    """What it is multiplied by in a direction of sliding, less as the rim goes round faster than the disk slides: it
    then meets the floor from all sides (but for scratches and brushed faces).

    A nap holds what slides against it: 1 + `nap` cos(the slip's direction - `nap_rad`).
    An edge bevelled at one side lifts over the floor where it leads and ploughs where it trails: 1 + `bevel` cos(the
    slip's direction - the disk's angle - `bevel_rad`).
    The tips of bristles stay back as the Host is accelerated: 1 + `bristled` (the acceleration along the slip /
    `HOST_M_PER_S2`).
    Two brushed faces hold on to each other where their marks lie alike: 1 + `brushed` cos 2(the disk's angle -
    `brushed_rad`), however it slides.
    A floor scratched along one direction: 1 + `scratched` cos 2(the slip's direction - `scratched_rad`), with its mean
    where the disk rests.
    A floor that was wiped and brushed from its middle outwards: 1 + `outward` times the share of the slip that goes
    outwards, less and less within `FACED_M` of the middle.
    The washer's own face has scales round its middle, which bite in one sense of spin: 1 + `scaly_face` times the rim's
    share of the speed, counterclockwise more.
    A floor faced on a lathe has scales that all lie one way round its middle: 1 + `faced` times the share of the slip
    that goes round counterclockwise, less and less within `FACED_M` of the middle.
    """
    rim = p.disk_radius_m * at.turning
    speed = np.sqrt(at.slip_x**2 + at.slip_y**2 + rim**2) + p.smoothing_m_per_s
    share = 1.0 + p.brushed * np.cos(2.0 * (at.state[ANGLE] - p.brushed_rad))
    if p.nap != 0.0:
        share *= 1.0 + p.nap * (at.slip_x * np.cos(p.nap_rad) + at.slip_y * np.sin(p.nap_rad)) / speed
    if p.bevel != 0.0:
        leads = at.slip_x * np.cos(at.state[ANGLE] + p.bevel_rad) + at.slip_y * np.sin(at.state[ANGLE] + p.bevel_rad)
        share *= max(1.0 + p.bevel * leads / speed, 0.0)
    if p.bristled != 0.0:
        along = (at.slip_x * at.host_acceleration[0] + at.slip_y * at.host_acceleration[1]) / speed
        share *= max(1.0 + p.bristled * along / HOST_M_PER_S2, 0.0)
    if p.outward != 0.0:
        out_ = (at.x * at.slip_x + at.y * at.slip_y) / (np.sqrt(at.x * at.x + at.y * at.y) + FACED_M)
        share *= max(1.0 + p.outward * out_ / speed, 0.0)
    if p.scaly_face != 0.0:
        share *= max(1.0 + p.scaly_face * rim / speed, 0.0)
    if p.faced != 0.0:
        round_ = (at.x * at.slip_y - at.y * at.slip_x) / (np.sqrt(at.x * at.x + at.y * at.y) + FACED_M)
        share *= max(1.0 + p.faced * round_ / speed, 0.0)
    if p.scratched != 0.0:
        c, s = np.cos(2.0 * p.scratched_rad), np.sin(2.0 * p.scratched_rad)
        squared = at.slip_x**2 + at.slip_y**2 + p.smoothing_m_per_s**2
        twice = (c * (at.slip_x**2 - at.slip_y**2) + s * 2.0 * at.slip_x * at.slip_y) / squared
        share *= max(1.0 + p.scratched * twice, 0.0)
    return share


@inlined
def _by_the_host(at: Instant, p: PlantParameters) -> float:
    """What it is multiplied by as the Host moves.

    Its table pitches as it is accelerated: the side that it is accelerated to presses, the other gives way.
    The coil of its shaker draws a steel disk down, with the square of its current as of the Host's acceleration: 1 +
    `drawn_down` (acceleration / `HOST_M_PER_S2`)^2.
    Its shaker has a magnet at one side of the room, which draws a steel disk down the more the nearer it comes: 1 +
    `beneath` (x / `BENEATH_M`), x the disk's place in the room.
    Worn bearings of its guide rumble and shake the load off the floor: 1 - `rumble` (its speed / `HOST_M_PER_S`)^2.
    """
    share, velocity, acceleration = 1.0, at.host_velocity, at.host_acceleration
    if p.pitching != 0.0:
        lever = (at.x * acceleration[0] + at.y * acceleration[1]) / (p.contact_radius_m * HOST_M_PER_S2)
        share *= max(1.0 + p.pitching * lever, 0.0)
    if p.drawn_down != 0.0:
        share *= 1.0 + p.drawn_down * (acceleration[0] ** 2 + acceleration[1] ** 2) / HOST_M_PER_S2**2
    if p.beneath != 0.0:
        share *= max(1.0 + p.beneath * (at.x + at.host_position[0]) / BENEATH_M, 0.0)
    if p.rumble != 0.0:
        share *= max(1.0 - p.rumble * (velocity[0] ** 2 + velocity[1] ** 2) / HOST_M_PER_S**2, 0.0)
    return share
