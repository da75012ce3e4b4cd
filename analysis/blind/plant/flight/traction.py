"""The floor's traction on the disk: friction per unit of mu N, a force (x, y) along the slip and a torque / R, and what
turns it aside."""

import numpy as np

from analysis.blind.plant.compiled import Floats, compiled, inlined
from analysis.blind.plant.flight.friction_by_place import dusty
from analysis.blind.plant.flight.instant import Instant
from analysis.blind.plant.parameters import PlantParameters
from analysis.blind.plant.state import ANGLE, APPROACH, COUNT, IMPACT_S, LEANT_X, LEANT_Y, NORMAL

RIM_POINTS = 24  # around a burr: the friction of their mean is within 1 % of a circle's
EDGED_M_PER_S = 0.5  # approach of a blow that tips a disk half as far as any could onto its edge
EDGED_S = 0.04  # in which it lies flat again: most of a flight
FEET_AT_M = 0.009  # from the disk's middle to three feet of it, of its 10 mm
GRAIN_AT_M = 0.007  # from the disk's middle, of its 10 mm
SHIVERS = 12  # instants of one shiver of the floor that the mean of its friction is over
LEANT_M = 0.01  # way on which a felt's fibres turn to a new direction by two thirds: a part of a flight
MIDDLE_M = 0.002  # from the Host's centre, within which marks around it have no direction

Traction = tuple[float, float, float]


@inlined
def traction(at: Instant, p: PlantParameters, table: Floats) -> Traction:
    """Of a disk that may stand on its inner part, on a burr, on feet, on a grain or on its edge, with what turns the
    force or weighs it by its direction.

    A cloth's nap leads a disk that spins aside, to one side as it goes along the nap and to the other as it comes back:
    across the slip, by `swerve` cos(the slip's direction - `swerve_rad`) in place of `curling`.
    """
    flat = _on_a_burr(_shivered(at, p, table), at, p)
    if p.feet != 0.0:
        flat = _on_feet(flat, at, p)
    force_x, force_y, turn = _on_its_edge(_on_a_grain(flat, at, p), at, p)
    if p.anisotropy != 0.0:  # along one direction of the room
        force_x, force_y = _weighed(force_x, force_y, p.anisotropy_phase_rad, p.anisotropy)
    if p.canted_rad != 0.0:
        c, s = np.cos(p.canted_rad), np.sin(p.canted_rad)
        force_x, force_y = c * force_x - s * force_y, s * force_x + c * force_y
    if p.curling != 0.0:
        rim = p.disk_radius_m * at.turning
        share = 2.0 * p.curling * rim / (at.slip_x**2 + at.slip_y**2 + rim**2 + p.smoothing_m_per_s**2)
        force_x, force_y = force_x - share * at.slip_y, force_y + share * at.slip_x
    if p.swerve != 0.0:
        rim, speed = p.disk_radius_m * at.turning, np.sqrt(at.slip_x**2 + at.slip_y**2) + p.smoothing_m_per_s
        along = (at.slip_x * np.cos(p.swerve_rad) + at.slip_y * np.sin(p.swerve_rad)) / speed
        share = 2.0 * p.swerve * along * rim / (speed**2 + rim**2)
        force_x, force_y = force_x - share * at.slip_y, force_y + share * at.slip_x
    if p.warped != 0.0:  # along one line of the disk
        force_x, force_y = _weighed(force_x, force_y, at.state[ANGLE] + p.warped_rad, p.warped)
    force_x, force_y = _on_circles(force_x, force_y, at, p)
    return force_x, force_y, turn + _on_drifts(at, p)


@inlined
def _shivered(at: Instant, p: PlantParameters, table: Floats) -> Traction:
    """Of a flat disk on a floor that shivers along the room's x, many times between two frames: the mean over one
    shiver, of the slip and `shiver_m_per_s` sin(phase) along x.

    What slips along x at less than the floor shivers is held by 2 / pi asin(slip / `shiver_m_per_s`) of the friction,
    what slips faster by all of it; what slips across is held less the slower it is.
    """
    if p.shiver_m_per_s == 0.0:
        return floor_traction(at.slip_x, at.slip_y, at.turning, p, table)
    force_x, force_y, turn = 0.0, 0.0, 0.0
    for k in range(SHIVERS):
        moves = p.shiver_m_per_s * np.sin(np.pi * ((k + 0.5) / SHIVERS - 0.5))
        one = floor_traction(at.slip_x + moves, at.slip_y, at.turning, p, table)
        force_x, force_y, turn = force_x + one[0], force_y + one[1], turn + one[2]
    return force_x / SHIVERS, force_y / SHIVERS, turn / SHIVERS


@inlined
def floor_traction(slip_x: float, slip_y: float, spin: float, p: PlantParameters, table: Floats) -> Traction:
    """Of a flat disk, smoothed by one tanh of the overall rim speed; `table`: `disk_friction_table`."""
    speed = np.sqrt(slip_x**2 + slip_y**2)
    stands = 1.0 - p.dome  # share of its radius within which the disk touches the floor
    rim = p.disk_radius_m * stands * abs(spin)
    place = np.arctan2(rim, speed) / (0.5 * np.pi) * (table.shape[0] - 1)
    low = min(int(place), table.shape[0] - 2)
    share = place - low
    force = table[low, 0] * (1.0 - share) + table[low + 1, 0] * share
    torque = table[low, 1] * (1.0 - share) + table[low + 1, 1] * share
    both = np.tanh(np.sqrt(speed**2 + rim**2) / p.smoothing_m_per_s)
    plain = np.tanh(speed / p.smoothing_m_per_s)
    size = p.spin_share * force * both + (1.0 - p.spin_share) * plain
    sign = 1.0 if spin > 0.0 else (-1.0 if spin < 0.0 else 0.0)
    turn = p.spin_share * torque * both * sign * stands
    if speed < 1e-12:
        return 0.0, 0.0, turn
    return size * slip_x / speed, size * slip_y / speed, turn


@inlined
def _on_a_burr(flat: Traction, at: Instant, p: PlantParameters) -> Traction:
    """Of a disk that stands with a share of its weight on a burr around its rim."""
    if p.burr == 0.0:
        return flat
    share, along_x, along_y, turn = min(p.burr, 1.0), 0.0, 0.0, 0.0
    for k in range(RIM_POINTS):
        c, s = np.cos(2.0 * np.pi * k / RIM_POINTS), np.sin(2.0 * np.pi * k / RIM_POINTS)
        ux, uy = at.slip_x - p.disk_radius_m * at.turning * s, at.slip_y + p.disk_radius_m * at.turning * c
        speed = np.sqrt(ux * ux + uy * uy) + 1e-300
        held = np.tanh(speed / p.smoothing_m_per_s) / speed / RIM_POINTS
        along_x, along_y, turn = along_x + held * ux, along_y + held * uy, turn + held * (c * uy - s * ux)
    rest = 1.0 - share
    return rest * flat[0] + share * along_x, rest * flat[1] + share * along_y, rest * flat[2] + share * turn


@compiled
def _on_feet(flat: Traction, at: Instant, p: PlantParameters) -> Traction:
    """Of a disk that stands with a share of its weight, `feet`, on three drops of glue below it, `FEET_AT_M` from its
    middle and a third of a turn from each other: each is held against its own way over the floor."""
    share, along_x, along_y, turn = min(p.feet, 1.0), 0.0, 0.0, 0.0
    for k in range(3):
        angle = at.state[ANGLE] + p.feet_rad + 2.0 * np.pi * k / 3.0
        arm_x, arm_y = FEET_AT_M * np.cos(angle), FEET_AT_M * np.sin(angle)
        ux, uy = at.slip_x - at.turning * arm_y, at.slip_y + at.turning * arm_x
        speed = np.sqrt(ux * ux + uy * uy) + 1e-300
        held = np.tanh(speed / p.smoothing_m_per_s) / speed / 3.0
        along_x, along_y = along_x + held * ux, along_y + held * uy
        turn += held * (arm_x * uy - arm_y * ux) / p.disk_radius_m
    rest = 1.0 - share
    return rest * flat[0] + share * along_x, rest * flat[1] + share * along_y, rest * flat[2] + share * turn


@inlined
def _on_a_grain(flat: Traction, at: Instant, p: PlantParameters) -> Traction:
    """Of a disk that stands with a share of its weight on one grain."""
    if p.grain == 0.0:
        return flat
    angle = at.state[ANGLE] + p.grain_rad
    arm_x, arm_y = GRAIN_AT_M * np.cos(angle), GRAIN_AT_M * np.sin(angle)
    return _with_a_point(flat, arm_x, arm_y, p.grain, at, p)


@inlined
def _on_its_edge(flat: Traction, at: Instant, p: PlantParameters) -> Traction:
    """Of a disk that a blow tips like a coin onto the edge that was struck, until it lies flat again.

    There stands of its weight `edged` v / (v + `EDGED_M_PER_S`) exp(-since / `EDGED_S`), v the last blow's approach, on
    one point of the rim towards the blow's normal.
    """
    late = at.time - at.state[IMPACT_S]
    if p.edged == 0.0 or at.state[COUNT] < 0.5 or late < 0.0:
        return flat
    hard = at.state[APPROACH] / (at.state[APPROACH] + EDGED_M_PER_S)
    arm_x, arm_y = p.disk_radius_m * np.cos(at.state[NORMAL]), p.disk_radius_m * np.sin(at.state[NORMAL])
    return _with_a_point(flat, arm_x, arm_y, min(p.edged * hard * np.exp(-late / EDGED_S), 1.0), at, p)


@inlined
def _with_a_point(
    flat: Traction, arm_x: float, arm_y: float, share: float, at: Instant, p: PlantParameters
) -> Traction:
    """Of a disk that stands with a share of its weight on one point, an arm (m) from its middle."""
    ux, uy = at.slip_x - at.turning * arm_y, at.slip_y + at.turning * arm_x
    speed = np.sqrt(ux * ux + uy * uy) + 1e-300
    held = np.tanh(speed / p.smoothing_m_per_s) / speed
    ux, uy = held * ux, held * uy
    rest = 1.0 - share
    return (
        rest * flat[0] + share * ux,
        rest * flat[1] + share * uy,
        rest * flat[2] + share * (arm_x * uy - arm_y * ux) / p.disk_radius_m,
    )


@compiled
def add_leaning_fibres(
    force_x: float, force_y: float, at: Instant, p: PlantParameters, out: Floats
) -> tuple[float, float]:
    """Traction (x, y) of a floor of felt, with what its fibres have of the slip's direction into `out`.

    They lean over as the disk slides, and turn to a new direction only along the way, over `LEANT_M`; until then the
    share `leant` of the friction still has the old one.  What they give back as they stand up they have taken before.
    """
    speed = np.sqrt(at.slip_x**2 + at.slip_y**2)
    x, y = at.state[LEANT_X], at.state[LEANT_Y]
    out[LEANT_X], out[LEANT_Y] = (at.slip_x - speed * x) / LEANT_M, (at.slip_y - speed * y) / LEANT_M
    share, straight = min(p.leant, 1.0), np.tanh(speed / p.smoothing_m_per_s) / (speed + 1e-300)
    return force_x + share * (x - straight * at.slip_x), force_y + share * (y - straight * at.slip_y)


@inlined
def ring_torque(p: PlantParameters) -> float:
    """What the floor's torque is multiplied by: a washer that rests on a ring, near its rim, is braked harder as it
    spins, by 1 + `ring_foot`; a pure ring's would be 1.5 at slow sliding."""
    return 1.0 + p.ring_foot


@inlined
def _weighed(force_x: float, force_y: float, line_rad: float, share: float) -> tuple[float, float]:
    """A force, more by `share` along a line and less by it across."""
    a, b = np.cos(line_rad), np.sin(line_rad)
    along, across = force_x * a + force_y * b, -force_x * b + force_y * a
    along, across = along * (1.0 + share), across * (1.0 - share)
    return along * a - across * b, along * b + across * a


@inlined
def _on_circles(force_x: float, force_y: float, at: Instant, p: PlantParameters) -> tuple[float, float]:
    """On a floor faced on a lathe: its marks are circles around the Host's centre.

    What slides across them, along the radius, is held by 1 + `rings` of the friction, what slides along them by 1 -
    `rings`.
    """
    radius = np.sqrt(at.x * at.x + at.y * at.y)
    if p.rings == 0.0 or radius < 1e-9:
        return force_x, force_y
    share = p.rings * radius / (radius + MIDDLE_M)
    a, b = at.x / radius, at.y / radius
    out, round_ = force_x * a + force_y * b, -force_x * b + force_y * a
    out, round_ = out * (1.0 + share), round_ * (1.0 - share)
    return out * a - round_ * b, out * b + round_ * a


@inlined
def _on_drifts(at: Instant, p: PlantParameters) -> float:
    """Torque / R of dust that a draught has blown to one side: the disk's half that lies in more of it is held more.

    Of a disk that only slides it is R / (4 `contact_radius_m`) `drifted` times the sine from `drifted_rad` to the slip,
    in units of the friction where there is no more dust than on the mean; less as the rim goes round faster than that.
    """
    if p.drifted == 0.0:
        return 0.0
    rim = p.disk_radius_m * at.turning
    speed = np.sqrt(at.slip_x**2 + at.slip_y**2 + rim**2) + p.smoothing_m_per_s
    across = (np.cos(p.drifted_rad) * at.slip_y - np.sin(p.drifted_rad) * at.slip_x) / speed
    return 0.25 * p.drifted * p.disk_radius_m / p.contact_radius_m * across / dusty(at, p)
