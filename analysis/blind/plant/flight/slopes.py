"""Forces of a floor that is not level, or not at rest: slopes fixed in the Host, a line that takes energy, a table that
leans, sways or is struck, a Host that tilts as it moves."""

import numpy as np

from analysis.blind.plant.compiled import Floats, inlined
from analysis.blind.plant.flight.instant import Instant
from analysis.blind.plant.host import HOST_M_PER_S2
from analysis.blind.plant.parameters import PlantParameters
from analysis.blind.plant.state import VX, VY

PLATES_M = 0.005  # from the joint of two plates, within which the disk climbs from one to the other: half its radius
KINK_M = 0.006  # from a kink's line, within which the disk leans from one half of the sheet to the other
NODES_M = 0.02  # from one nodal circle of a floor to the next
NODES_EDGE_M = 0.003  # from the Host's centre, within which circles around it have no direction
CONE_M = 0.002  # from the Host's centre, within which a cone is rounded off
CROSSED_M = 0.004  # from a line of dried glue, within which the disk's edge scrapes over it
CROSSED_M_PER_S = 0.05  # speed across it from which on it holds back the whole way: no step for the integrator
RIDGE_M = 0.004  # from a ridge's line to where it is steepest
UNCLAMPED_M_PER_S2 = 20.0  # acceleration of the Host that takes a loose floor three quarters of its way: two g
GUIDE_M_PER_S = 0.1  # speed of the Host from which on its carriage leans the whole way


@inlined
def add_slopes(at: Instant, p: PlantParameters, out: Floats) -> None:
    """All of them; a steady tilt of the table first, and that of the run."""
    out[VX] += p.tilt_x_m_per_s2
    out[VY] += p.tilt_y_m_per_s2
    out[VX] += p.feet_x_m_per_s2
    out[VY] += p.feet_y_m_per_s2
    out[VX] += p.levelled_x_m_per_s2
    out[VY] += p.levelled_y_m_per_s2
    _add_shape(at, p, out)
    _add_line(at, p, out)
    _add_table(at.time, p, out)
    _add_tilting_host(at, p, out)


@inlined
def _add_shape(at: Instant, p: PlantParameters, out: Floats) -> None:
    """A floor that is not flat: a dish, a saddle, a bowl that is steep at the wall only, a dome, a gutter, a kink, a
    ridge or a step along a line.

    A floor plate sags between its screws, like a dish of curvature `dished_per_m`: the disk slides down to its middle,
    by the load times that times its place.
    A floor plate of plastic that the shaker warms bulges from run to run, from a dish to a dome or back: the disk is
    pushed outwards by `doming_per_s2`, the run's own, times its place.
    A floor that is a flat cone slopes by as much everywhere: `cone_m_per_s2` (x, y) / sqrt(x^2 + y^2 + `CONE_M`^2),
    outwards or inwards.
    A floor of sheet that came off a roll is bowed along one direction and straight across: `bowed_per_s2` times the
    place along `bowed_rad` from the Host's centre, outwards or inwards.
    A floor of sheet that was once bent along a line slopes either way from there: `kink_m_per_s2` tanh((s - `kink_m`) /
    `KINK_M`) along `kink_rad`, s the place along that direction from the Host's centre.
    A floor of sheet that was bent up at one end is level up to a line, and ever steeper beyond it: -`flap_per_s2` (s -
    `flap_m`) along `flap_rad` where s, the place along that, is more than `flap_m`.
    Of two floor plates one stands higher, and the disk climbs onto it or slides down: -`plates_m_per_s2` exp(-(s -
    `plates_m`)^2 / (2 `PLATES_M`^2)) along `plates_rad`.
    """
    x, y = at.x, at.y
    out[VX] -= p.central_per_s2 * x
    out[VY] -= p.central_per_s2 * y
    if p.dished_per_m != 0.0:
        out[VX] -= p.load_m_per_s2 * p.dished_per_m * x
        out[VY] -= p.load_m_per_s2 * p.dished_per_m * y
    if p.doming_per_s2 != 0.0:
        out[VX] += p.doming_per_s2 * x
        out[VY] += p.doming_per_s2 * y
    if p.cone_m_per_s2 != 0.0:
        push = p.cone_m_per_s2 / np.sqrt(x * x + y * y + CONE_M**2)
        out[VX] += push * x
        out[VY] += push * y
    if p.bowed_per_s2 != 0.0:
        _add_along(p.bowed_per_s2 * (np.cos(p.bowed_rad) * x + np.sin(p.bowed_rad) * y), p.bowed_rad, out)
    if p.kink_m_per_s2 != 0.0:
        off = (np.cos(p.kink_rad) * x + np.sin(p.kink_rad) * y - p.kink_m) / KINK_M
        _add_along(p.kink_m_per_s2 * np.tanh(off), p.kink_rad, out)
    if p.flap_per_s2 != 0.0:
        beyond = np.cos(p.flap_rad) * x + np.sin(p.flap_rad) * y - p.flap_m
        _add_along(-p.flap_per_s2 * max(beyond, 0.0), p.flap_rad, out)
    if p.plates_m_per_s2 != 0.0:
        off = (np.cos(p.plates_rad) * x + np.sin(p.plates_rad) * y - p.plates_m) / PLATES_M
        _add_along(-p.plates_m_per_s2 * np.exp(-0.5 * off**2), p.plates_rad, out)
    if p.saddle_per_s2 != 0.0:
        a, b = np.cos(2.0 * p.saddle_rad), np.sin(2.0 * p.saddle_rad)
        out[VX] += p.saddle_per_s2 * (a * x + b * y)
        out[VY] += p.saddle_per_s2 * (b * x - a * y)
    if p.bowl_m_per_s2 != 0.0:
        share = (x * x + y * y) / p.contact_radius_m**2
        out[VX] -= p.bowl_m_per_s2 * share**2.5 * x / p.contact_radius_m
        out[VY] -= p.bowl_m_per_s2 * share**2.5 * y / p.contact_radius_m
    if p.ridge_m_per_s2 != 0.0:
        a, b = np.cos(p.ridge_rad), np.sin(p.ridge_rad)
        across = (a * x + b * y - p.ridge_m) / RIDGE_M
        _add_along(p.ridge_m_per_s2 * across * np.exp(0.5 - 0.5 * across**2), p.ridge_rad, out)


@inlined
def _add_line(at: Instant, p: PlantParameters, out: Floats) -> None:
    """A line of dried glue takes the same energy of every crossing, whichever way and however fast.

    Against the speed u across it acts `crossed_m_per_s2` exp(-(s - `crossed_m`)^2 / (2 `CROSSED_M`^2)) tanh(u /
    `CROSSED_M_PER_S`), s the place along `crossed_rad` from the Host's centre and u its rate: sqrt(2 pi) `CROSSED_M`
    times as much per unit mass is lost.
    """
    if p.crossed_m_per_s2 != 0.0:
        a, b = np.cos(p.crossed_rad), np.sin(p.crossed_rad)
        off, across = (a * at.x + b * at.y - p.crossed_m) / CROSSED_M, a * at.rate_x + b * at.rate_y
        held = p.crossed_m_per_s2 * np.exp(-0.5 * off**2) * np.tanh(across / CROSSED_M_PER_S)
        _add_along(-held, p.crossed_rad, out)


@inlined
def _add_table(time: float, p: PlantParameters, out: Floats) -> None:
    """A table that sways, that sags in a run, or that a blow against the room's floor has set swinging."""
    if p.sway_m_per_s2 != 0.0:
        _add_along(p.sway_m_per_s2 * np.sin(p.sway_rad_per_s * time), p.sway_rad, out)
    if p.sag_m_per_s2 != 0.0:
        _add_along(p.sag_m_per_s2 * (2.0 * time / p.duration_s - 1.0), p.sag_rad, out)
    late = time - p.slam_s
    if p.slam_m_per_s2 != 0.0 and late > 0.0:
        push = p.slam_m_per_s2 * np.exp(-late / p.slam_decay_s) * np.sin(p.slam_rad_per_s * late)
        _add_along(push, p.slam_rad, out)


@inlined
def _add_tilting_host(at: Instant, p: PlantParameters, out: Floats) -> None:
    """A Host that rocks with its own acceleration.

    Its carriage has play in its guide: it leans to one side on the way there and to the other on the way back, and the
    floor with it, by `lean_m_per_s2` tanh(the Host's speed along x / `GUIDE_M_PER_S`).
    Its guide is bent, and the floor leans with its place on it, by `guide_per_s2` times its way along x.
    The frame that carries the rig rocks at the drive's rate, not in step with it: along x by `frame_m_per_s2`
    (cos(`frame_rad`) a + sin(`frame_rad`) u) / `HOST_M_PER_S2`, a the Host's acceleration along x and u its velocity
    times the drive's angular frequency.
    A floor plate that is not clamped tips from one stop to the other as the Host's acceleration turns round, by
    `unclamped_m_per_s2` tanh(acceleration along x / `UNCLAMPED_M_PER_S2`) along `unclamped_rad`.
    A floor plate that the drive sets vibrating has nodal circles: `_add_nodes`.
    A thin floor sheet, held at one end, buckles up as the Host is accelerated along x and sags as it is accelerated
    back: the disk slides down to all sides, or to the middle, by `buckled_per_s2` (x, y) (acceleration /
    `HOST_M_PER_S2`).
    """
    out[VX] += p.rocking * at.host_acceleration[0]
    out[VY] += p.rocking * at.host_acceleration[1]
    if p.lean_m_per_s2 != 0.0:
        _add_along(p.lean_m_per_s2 * np.tanh(at.host_velocity[0] / GUIDE_M_PER_S), p.lean_rad, out)
    if p.guide_per_s2 != 0.0:
        _add_along(p.guide_per_s2 * at.host_position[0], p.guide_rad, out)
    if p.frame_m_per_s2 != 0.0:
        pull, speed = at.host_acceleration[0], p.drive_rad_per_s * at.host_velocity[0]
        out[VX] += p.frame_m_per_s2 * (np.cos(p.frame_rad) * pull + np.sin(p.frame_rad) * speed) / HOST_M_PER_S2
    if p.unclamped_m_per_s2 != 0.0:
        side = np.tanh(at.host_acceleration[0] / UNCLAMPED_M_PER_S2)
        _add_along(p.unclamped_m_per_s2 * side, p.unclamped_rad, out)
    if p.nodal_m_per_s2 != 0.0:
        _add_nodes(at, p, out)
    if p.buckled_per_s2 != 0.0:
        push = p.buckled_per_s2 * at.host_acceleration[0] / HOST_M_PER_S2
        out[VX] += push * at.x
        out[VY] += push * at.y


@inlined
def _add_nodes(at: Instant, p: PlantParameters, out: Floats) -> None:
    """A floor plate that vibrates in circles, as Chladni's do, drives the disk to where it is at rest.

    Along the radius r by -`nodal_m_per_s2` (the Host's acceleration / `HOST_M_PER_S2`)^2 sin(2 pi (r - `nodal_m`) /
    `NODES_M`), less and less within `NODES_EDGE_M` of the Host's centre.
    """
    acceleration, radius = at.host_acceleration, np.sqrt(at.x * at.x + at.y * at.y)
    shaken = (acceleration[0] ** 2 + acceleration[1] ** 2) / HOST_M_PER_S2**2
    push = -p.nodal_m_per_s2 * shaken * np.sin(2.0 * np.pi * (radius - p.nodal_m) / NODES_M)
    out[VX] += push * at.x / (radius + NODES_EDGE_M)
    out[VY] += push * at.y / (radius + NODES_EDGE_M)


@inlined
def _add_along(push: float, direction_rad: float, out: Floats) -> None:
    """A push in one direction."""
    out[VX] += push * np.cos(direction_rad)
    out[VY] += push * np.sin(direction_rad)
