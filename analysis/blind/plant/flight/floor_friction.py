"""The floor's coefficient of friction: by the place on the floor, the speed, the direction of sliding, what went before
and how the Host moves."""

import numpy as np

from analysis.blind.plant.compiled import Floats, compiled, inlined
from analysis.blind.plant.flight.instant import Instant
from analysis.blind.plant.host import HOST_M_PER_S, HOST_M_PER_S2
from analysis.blind.plant.parameters import PlantParameters
from analysis.blind.plant.state import (
    AFLOAT,
    AGED,
    ANGLE,
    ANGLE_BEFORE,
    APPROACH,
    AZIMUTH,
    BEAD_X,
    BEAD_Y,
    BLOWS,
    CHARGE,
    COUNT,
    HERE_X,
    HERE_Y,
    IMPACT_S,
    LEFT,
    OILED,
    SPIN,
    THERE_X,
    THERE_Y,
    TRODDEN,
    TRODDEN_SIDE,
    VX,
    VY,
    WAY,
    WAY_BEFORE,
)

TRACK_M = 0.007  # half the width of a polished track, in which the disk's 20 mm meet it
LANE_M = 0.01  # half the width of a polished lane: the disk's own
WORN_M = 0.015  # from the Host's centre to where its floor is worn three fifths as much
POWDER_BLOWS = 10.0  # after which two thirds of the powder that blows shed in a run lie at the wall
PATH_M = 0.01  # half the width of the path that a flight clears: the disk's own
TRODDEN_AT_M = 0.02  # from one place of a floor that is trodden to the next
TRODDEN_M = 0.15  # way slid near one of them that polishes it by two thirds: a run's share of each
RIM_EDGE = 0.03  # of the contact radius, within which a dusty rim begins
BEAD_AT_M = 0.02  # from the Host's centre to a bead of oil that goes round it
BEAD_M = 0.01  # from a bead's middle to where it wets half as well: it is as wide as the disk
CHATTER_M_PER_S = 0.2  # width of the band of sliding speeds in which a disk chatters
DROP_M = 0.01  # from a drop's middle to where it wets half as well: it is as wide as the disk
SOAK_S = 0.01  # in which a disk over the middle of a drop is wetted
WIPE_M = 0.06  # way on which it loses what it has taken up: most of a flight
SCREWS_AT_M = 0.022  # from the Host's centre to its floor's four screws
SCREW_M = 0.008  # from a screw's middle to where the disk, which is wider, misses three fifths as much of the floor
DRYING_M = 0.016  # from a wet spot's middle to where it is three fifths as wet: somewhat wider than the disk
FACED_M = 0.003  # from the Host's centre, within which a lathe's marks have no direction
BENEATH_M = 0.02  # along x in the room, on which a magnet at one side draws the disk down by what its cause says
CLING_M = 0.08  # way on which most of the charge that a disk can hold would gather
CLING_S = 0.08  # in which it leaks off: one or two flights
RATTLED_S = 0.03  # in which a disk comes to rest that a blow has set rattling on its floor: half a flight
SPECK_S = 3e-3  # within which a speck gets under the disk: no step for the integrator
DEBRIS_M = 0.03  # way on which most of what a blow has knocked loose is left behind
AGE_S = 0.05  # in which contacts of a disk at rest would gain most of their strength: a flight
AGE_M = 0.02  # way on which they are broken and made anew
BEADS_M = 0.03  # way on which beads turn to the disk's new direction: half of a flight
SUCTION_M_PER_S = 0.3  # slip at which half of a wet film's suction is left
BREAK_M_PER_S = 0.1  # of the slip's speed, within which a disk breaks away: no step for the integrator
STRONGER_M_PER_S, CREEP_M_PER_S = 0.7, 0.05  # speed at which friction is what it is; below which it falls no more
FLOATS_M_PER_S, SINKS_M_PER_S = 1.4, 0.7  # slip that raises a film below the disk; slip at which it breaks down
FLOAT_S = 2e-3  # in which either happens: no step for the integrator
PUDDLE_M = 0.012  # from a puddle's middle to where it wets three fifths as well: it is wider than the disk
SWASH_M = 0.022  # from the Host's centre to where a puddle is thrown at `HOST_M_PER_S2`
ROLLING_S = 0.03  # of a stretch in which a grain may roll under the disk: half a flight
ROLLING_EDGE = 0.1  # of a stretch, within which a grain gets in or out: no step for the integrator
ROLLING_SHARE = 0.3  # of the stretches of a run
PRIMED_M_PER_S = 0.9  # speed after a blow with which a disk raises as much of a film as on the mean
SPUN_OUT_RAD = 3.0  # turn of a disk that throws two thirds of its dust out
LEAST_RIDING = 0.1  # share of the friction that a disk keeps however fast it spins


@inlined
def floor_friction(at: Instant, p: PlantParameters) -> float:
    """The coefficient with every cause that acts on it."""
    mu = p.floor_friction * (1.0 + p.friction_change_per_s * (at.time - 0.5 * p.duration_s))
    mu *= 1.0 + p.weakening * np.exp(-np.sqrt(at.slip_x**2 + at.slip_y**2) / p.weakening_m_per_s)
    if p.settling != 0.0 and at.time > at.state[IMPACT_S] >= 0.0:
        mu *= 1.0 - p.settling * np.exp(-(at.time - at.state[IMPACT_S]) / p.settling_s)
    mu *= _by_place(at, p)
    mu *= _by_speed(at, p)
    mu *= _by_direction(at, p)
    mu *= _by_what_went_before(at, p)
    return mu * _by_the_host(at, p)


@inlined
def _by_place(at: Instant, p: PlantParameters) -> float:
    """What the coefficient is multiplied by at a place of the Host's floor: a patch, a seam, grooves, dust at the wall.

    Months of use have polished a track around the centre: there it is less by `track`, falling off to either side of
    the radius `track_m` like a bell of `TRACK_M`.
    So has a lane through the centre, along which the drive has mostly sent the disk: less by `lane`, falling off to
    either side of the line along `lane_rad` like a bell of `LANE_M`.
    A bead of oil is shaken round the floor, `BEAD_AT_M` from its middle and at `bead_rad` + `bead_rad_per_s` times the
    time in the run: over it the disk loses `bead` of its friction, falling off like a bell of `BEAD_M`.
    A floor is worn in its middle: 1 + `worn` exp(-r^2 / (2 `WORN_M`^2)), r from the Host's centre; one that wears in
    the course of the series has `wearing`, the run's own, in its place.
    Blows shed powder, which gathers along the wall and is brushed off between the runs: `_in_powder`.
    Four countersunk screws, `SCREWS_AT_M` from the middle and a quarter turn from each other, leave the disk less of
    the floor: over each it loses `screws` of its friction, falling off like a bell of `SCREW_M`.
    A floor is wiped in its middle, and less and less towards the wall: 1 + `unswept` (r / `contact_radius_m`)^2, r from
    the Host's centre.
    A draught has blown the dust to one side, evenly from one wall to the other: `dusty`.
    A wet spot dries: `_where_it_dries`; ribs hold the floor from below: `_over_ribs`.
    The disk clears its way of frost, which comes back: `_on_the_path`.
    It polishes a floor that was dusted before the run wherever it slides: `_where_trodden`.
    A puddle of oil stays back as the Host is accelerated, by `SWASH_M` at `HOST_M_PER_S2` from its centre: over it the
    disk loses `puddle` of its friction, falling off like a bell of `PUDDLE_M`.
    """
    share, radius = 1.0, np.sqrt(at.x * at.x + at.y * at.y)
    if p.patch_amplitude != 0.0:
        far = ((at.x - p.patch_x_m) ** 2 + (at.y - p.patch_y_m) ** 2) / p.patch_width_m**2
        share *= 1.0 + p.patch_amplitude * np.exp(-0.5 * far)
    if p.seam != 0.0 and np.cos(p.seam_rad) * at.x + np.sin(p.seam_rad) * at.y > p.seam_m:
        share *= 1.0 + p.seam
    if p.groove != 0.0:
        along = np.cos(p.groove_rad) * at.x + np.sin(p.groove_rad) * at.y
        share *= 1.0 + p.groove * np.cos(2.0 * np.pi * along / p.groove_m + p.groove_phase_rad)
    if p.rim != 0.0:
        late = (radius / p.contact_radius_m - p.rim_share) / RIM_EDGE
        share *= 1.0 + p.rim * 0.5 * (1.0 + np.tanh(late))
    if p.track != 0.0:
        off = (radius - p.track_m) / TRACK_M
        share *= max(1.0 - p.track * np.exp(-0.5 * off**2), 0.0)
    if p.lane != 0.0:
        off = (at.y * np.cos(p.lane_rad) - at.x * np.sin(p.lane_rad)) / LANE_M
        share *= max(1.0 - p.lane * np.exp(-0.5 * off**2), 0.0)
    if p.bead != 0.0:
        azimuth = p.bead_rad + p.bead_rad_per_s * at.time
        far = (at.x - BEAD_AT_M * np.cos(azimuth)) ** 2 + (at.y - BEAD_AT_M * np.sin(azimuth)) ** 2
        share *= max(1.0 - p.bead * np.exp(-0.5 * far / BEAD_M**2), 0.0)
    if p.worn != 0.0 or p.wearing != 0.0:
        share *= max(1.0 + (p.worn + p.wearing) * np.exp(-0.5 * (at.x**2 + at.y**2) / WORN_M**2), 0.0)
    if p.unswept != 0.0:
        share *= max(1.0 + p.unswept * (radius / p.contact_radius_m) ** 2, 0.0)
    if p.powder != 0.0:
        share *= _in_powder(at, p)
    if p.path != 0.0 and at.state[COUNT] > 1.5:  # there was a flight between two impacts
        share *= _on_the_path(at, p)
    if p.trodden != 0.0:
        share *= _where_trodden(at, p)
    if p.puddle != 0.0:
        swash = SWASH_M / HOST_M_PER_S2
        far = (at.x + swash * at.host_acceleration[0]) ** 2 + (at.y + swash * at.host_acceleration[1]) ** 2
        share *= max(1.0 - p.puddle * np.exp(-0.5 * far / PUDDLE_M**2), 0.0)
    if p.screws != 0.0:
        share *= _over_screws(at, p)
    if p.drying != 0.0:
        share *= _where_it_dries(at, p)
    if p.ribs != 0.0:
        share *= _over_ribs(at, p)
    return share * dusty(at, p)


@inlined
def _in_powder(at: Instant, p: PlantParameters) -> float:
    """What the powder of n blows multiplies the friction by: 1 + `powder` (r / `contact_radius_m`)^4 (1 - exp(-n /
    `POWDER_BLOWS`)), r the way from the Host's centre."""
    near = (at.x * at.x + at.y * at.y) ** 2 / p.contact_radius_m**4
    return 1.0 + p.powder * near * (1.0 - np.exp(-at.state[COUNT] / POWDER_BLOWS))


@inlined
def _on_the_path(at: Instant, p: PlantParameters) -> float:
    """What frost that the flight before has cleared away leaves of the friction: 1 - `path` on the straight line
    between its two impacts, falling off to either side like a bell of `PATH_M`."""
    from_x, from_y = at.state[THERE_X], at.state[THERE_Y]
    along_x, along_y = at.state[HERE_X] - from_x, at.state[HERE_Y] - from_y
    passed = (at.x - from_x) * along_x + (at.y - from_y) * along_y
    passed = min(max(passed / (along_x**2 + along_y**2 + 1e-300), 0.0), 1.0)
    off_x, off_y = at.x - from_x - passed * along_x, at.y - from_y - passed * along_y
    return max(1.0 - p.path * np.exp(-0.5 * (off_x**2 + off_y**2) / PATH_M**2), 0.0)


@inlined
def _where_trodden(at: Instant, p: PlantParameters) -> float:
    """What the disk has left of the friction where it has slid in the run: 1 - `trodden` (1 - exp(-s / `TRODDEN_M`)), s
    the way slid at each of nine places, `TRODDEN_AT_M` from each other; between them in proportion to how near."""
    (low_x, share_x), (low_y, share_y) = _between(at.x), _between(at.y)
    lost = 0.0
    for i in range(2):
        for k in range(2):
            near = (share_x if i == 1 else 1.0 - share_x) * (share_y if k == 1 else 1.0 - share_y)
            way = at.state[TRODDEN + TRODDEN_SIDE * (low_y + k) + low_x + i]
            lost += near * (1.0 - np.exp(-way / TRODDEN_M))
    return max(1.0 - p.trodden * lost, 0.0)


@inlined
def _between(place_m: float) -> tuple[int, float]:
    """The number of the last place of a trodden floor's three in a row before `place_m`, and the share of the way from
    there to the next; beyond the last ones all counts as theirs."""
    passed = min(max(place_m / TRODDEN_AT_M + 1.0, 0.0), TRODDEN_SIDE - 1.0)
    low = min(int(passed), TRODDEN_SIDE - 2)
    return low, passed - low


@inlined
def add_tread(at: Instant, p: PlantParameters, out: Floats) -> None:
    """The way slid so far at each of a trodden floor's places, as near as the disk is to it."""
    if p.trodden != 0.0:
        speed = np.sqrt(at.slip_x**2 + at.slip_y**2)
        (low_x, share_x), (low_y, share_y) = _between(at.x), _between(at.y)
        for i in range(2):
            for k in range(2):
                near = (share_x if i == 1 else 1.0 - share_x) * (share_y if k == 1 else 1.0 - share_y)
                out[TRODDEN + TRODDEN_SIDE * (low_y + k) + low_x + i] = near * speed


@inlined
def _over_screws(at: Instant, p: PlantParameters) -> float:
    """What four screws leave of the friction."""
    lost = 0.0
    for k in range(4):
        turned = p.screws_rad + 0.5 * np.pi * k
        far = (at.x - SCREWS_AT_M * np.cos(turned)) ** 2 + (at.y - SCREWS_AT_M * np.sin(turned)) ** 2
        lost += np.exp(-0.5 * far / SCREW_M**2)
    return max(1.0 - p.screws * lost, 0.0)


@inlined
def _where_it_dries(at: Instant, p: PlantParameters) -> float:
    """What a spot of cleaning fluid leaves of the friction: it is put down anew before each run and dries in the course
    of it.  Over its middle `drying` is lost as the run begins, falling off to its sides like a bell of `DRYING_M` and
    with the time in the run, within `drying_s`."""
    far = ((at.x - p.drying_x_m) ** 2 + (at.y - p.drying_y_m) ** 2) / DRYING_M**2
    return max(1.0 - p.drying * np.exp(-0.5 * far - max(at.time, 0.0) / p.drying_s), 0.0)


@inlined
def _over_ribs(at: Instant, p: PlantParameters) -> float:
    """What three ribs below a thin floor multiply the friction by: over them it is firm, and between them it gives, the
    more the farther from the middle: 1 + `ribs` (r / `contact_radius_m`) cos 3(azimuth - `ribs_rad`), r and azimuth the
    disk's place in the Host."""
    radius = np.sqrt(at.x * at.x + at.y * at.y)
    thrice = np.cos(3.0 * (np.arctan2(at.y, at.x) - p.ribs_rad))
    return max(1.0 + p.ribs * radius / p.contact_radius_m * thrice, 0.0)


@inlined
def dusty(at: Instant, p: PlantParameters) -> float:
    """What dust that a draught has blown to `drifted_rad` multiplies the friction by: 1 + `drifted` s /
    `contact_radius_m`, s the place along that direction from the Host's centre."""
    if p.drifted == 0.0:
        return 1.0
    along = at.x * np.cos(p.drifted_rad) + at.y * np.sin(p.drifted_rad)
    return max(1.0 + p.drifted * along / p.contact_radius_m, 0.05)


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
def _by_what_went_before(at: Instant, p: PlantParameters) -> float:
    """What it is multiplied by after a way slid, so many impacts, a drop of oil: a disk that has been through the drop
    carries `state[OILED]` of what it can hold, and loses `drop` of its friction times that.

    A blow lifts the disk off the floor, onto which it settles: 1 - `lifted` exp(-the time since then / `lifted_s`).
    A blow sets a disk rattling on its floor, the more the harder it is: 1 - `rattled_s_per_m` times its approach
    exp(-the time since then / `RATTLED_S`).
    In each run a speck gets under the disk and stays there: 1 + `specked` from the share `specked_share` of it on.
    A disk that is charged as it slides clings to the floor: 1 + `clinging` times the charge (`add_charge`).
    Contacts that rest grow stronger: 1 + `aged` times what they have of their strength (`add_age`).
    A blow knocks dust off the wall, which lies under the disk until it has left it behind: 1 + `debris_s_per_m` times
    the blow's approach exp(-s / `DEBRIS_M`), s the way slid since.
    Dirt lies along one side of the wall, and a blow there leaves some of it under the disk, until the next: 1 +
    `dirty_side` cos(the last blow's azimuth - `dirty_rad`); before any it is clean on the mean.
    A disk throws the dust out from below itself as it turns, and a blow lets it in again: 1 + `spun_out` (1 - exp(-the
    turn since then / `SPUN_OUT_RAD`)), either way.
    A grain rolls under the disk now and then, and the disk on it: 1 - `rolling` in a share `ROLLING_SHARE` of the
    stretches of `ROLLING_S`, which ones `rolling_draw` says (`rolls`).
    The faster a blow lets the disk go the thicker a film of oil it draws below itself, which lasts until the next: 1 -
    `primed` (u^2 - `PRIMED_M_PER_S`^2) / (u^2 + `PRIMED_M_PER_S`^2), u its speed over the floor after the last blow.
    The floor is cleaned with alcohol before one of the runs, and rubs more from then on: 1 + `cleaned`, the run's own.
    Beads of wax roll along with the disk until it goes another way: 1 + `beads` (1 - the share of the way just slid
    that had the slip's direction (`add_beads`)) / 2.
    Debris gathers under the disk and breaks off each time it has gone `clogged_m`: 1 + `clogged` (2 q - 1), q the
    share of that way since then.
    The washer is put in by hand before each run, its ground face down or its rolled one: 1 + `turned`, the run's own.
    The air of the room is more and less humid in the course of a day: 1 + `humid`, the run's own.
    The washer's face is damp as a run begins, and rubs itself dry: 1 + `damp` exp(-t / `damp_s`), t the run's time.
    The bench warms in the course of a day: 1 + `bench`, the run's own.
    Dust settles until somebody wipes it off: 1 + `dusted`, the run's own.
    Blows glaze what slides, and the floor holds it less and less: exp(-`glazed` n), n the blows before; or they strew
    grit, and it is held more and more: 1 + `strewn` n.
    The compressor below an air table pulsates: 1 + `pulsing` sin(`pulsing_rad_per_s` t + `pulsing_rad`), t the time in
    the run.
    """
    state = at.state
    share = friction_of_flight(state[COUNT], p) * max(1.0 - p.drop * state[OILED], 0.0)
    if p.warming != 0.0:
        share *= 1.0 - p.warming * (1.0 - np.exp(-state[WAY] / p.warming_m))
    if p.lifted != 0.0 and at.time >= state[IMPACT_S] >= 0.0:
        share *= max(1.0 - p.lifted * np.exp(-(at.time - state[IMPACT_S]) / p.lifted_s), 0.0)
    if p.rattled_s_per_m != 0.0 and state[COUNT] > 0.5 and at.time >= state[IMPACT_S]:
        lost = p.rattled_s_per_m * state[APPROACH] * np.exp(-(at.time - state[IMPACT_S]) / RATTLED_S)
        share *= max(1.0 - lost, 0.0)
    if p.specked != 0.0:
        late = (at.time - p.specked_share * p.duration_s) / SPECK_S
        share *= 1.0 + p.specked * 0.5 * (1.0 + np.tanh(late))
    if p.pulsing != 0.0:
        share *= 1.0 + p.pulsing * np.sin(p.pulsing_rad_per_s * at.time + p.pulsing_rad)
    if p.debris_s_per_m != 0.0 and state[COUNT] > 0.5:
        slid = max(state[WAY] - state[WAY_BEFORE], 0.0)
        share *= 1.0 + p.debris_s_per_m * state[APPROACH] * np.exp(-slid / DEBRIS_M)
    if p.dirty_side != 0.0 and state[COUNT] > 0.5:
        share *= max(1.0 + p.dirty_side * np.cos(state[AZIMUTH] - p.dirty_rad), 0.0)
    if p.rolling != 0.0:
        share *= max(1.0 - p.rolling * rolls(at.time, p), 0.0)
    if p.primed != 0.0 and state[LEFT] > 0.0:
        square = state[LEFT] ** 2
        share *= max(1.0 - p.primed * (square - PRIMED_M_PER_S**2) / (square + PRIMED_M_PER_S**2), 0.0)
    if p.spun_out != 0.0:
        turned = abs(state[ANGLE] - state[ANGLE_BEFORE])
        share *= 1.0 + p.spun_out * (1.0 - np.exp(-turned / SPUN_OUT_RAD))
    if p.beads != 0.0:
        along = at.slip_x * state[BEAD_X] + at.slip_y * state[BEAD_Y]
        along /= np.sqrt(at.slip_x**2 + at.slip_y**2) + p.smoothing_m_per_s
        share *= 1.0 + p.beads * 0.5 * (1.0 - along)
    if p.clogged != 0.0:
        gone = state[WAY] / p.clogged_m + p.clogged_share
        share *= max(1.0 + p.clogged * (2.0 * (gone - np.floor(gone)) - 1.0), 0.0)
    share *= 1.0 + p.cleaned
    share *= 1.0 + p.turned
    if p.humid != 0.0:
        share *= max(1.0 + p.humid, 0.0)
    if p.damp != 0.0:
        share *= max(1.0 + p.damp * np.exp(-max(at.time, 0.0) / p.damp_s), 0.0)
    if p.dusted != 0.0:
        share *= max(1.0 + p.dusted, 0.0)
    if p.bench != 0.0:
        share *= max(1.0 + p.bench, 0.0)
    if p.glazed != 0.0:
        share *= np.exp(-p.glazed * state[BLOWS])
    if p.strewn != 0.0:
        share *= 1.0 + p.strewn * state[BLOWS]
    return share * (1.0 + p.clinging * state[CHARGE]) * (1.0 + p.aged * state[AGED])


@compiled
def rolls(time: float, p: PlantParameters) -> float:
    """How far a disk rolls on a grain at `time` of the run (0 to 1)."""
    passed = time / ROLLING_S
    here = np.floor(passed)
    share = min((passed - here) / ROLLING_EDGE, 1.0)
    before, now = _rolls_in(here - 1.0, p), _rolls_in(here, p)
    return before + (now - before) * share**2 * (3.0 - 2.0 * share)


@inlined
def _rolls_in(stretch: float, p: PlantParameters) -> float:
    """Whether it does in one stretch (0 or 1)."""
    drawn = np.sin(12.9898 * (stretch + 7.0) + 78.233 * p.rolling_draw) * 43758.5453
    return 1.0 if drawn - np.floor(drawn) < ROLLING_SHARE else 0.0


@inlined
def friction_of_flight(count: float, p: PlantParameters) -> float:
    """What it is multiplied by in the flight after so many impacts: drawn evenly, of mean 1 and standard deviation
    `grit`, anew after each; `grit_draw` (0 to 1) is the run's own."""
    if p.grit == 0.0:
        return 1.0
    drawn = np.sin(12.9898 * (count + 1.0) + 78.233 * p.grit_draw) * 43758.5453
    return max(1.0 + p.grit * np.sqrt(3.0) * (2.0 * (drawn - np.floor(drawn)) - 1.0), 0.05)


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


@inlined
def add_oil(at: Instant, p: PlantParameters, out: Floats) -> None:
    """What a disk carries of a drop (0 to 1): over it, by a bell of `DROP_M` around (`drop_x_m`, `drop_y_m`) of the
    Host's floor, it takes up what it lacks within `SOAK_S`; it loses it along the way slid, over `WIPE_M`."""
    if p.drop != 0.0:
        far = ((at.x - p.drop_x_m) ** 2 + (at.y - p.drop_y_m) ** 2) / DROP_M**2
        out[OILED] = np.exp(-0.5 * far) * (1.0 - at.state[OILED]) / SOAK_S
        out[OILED] -= np.sqrt(at.slip_x**2 + at.slip_y**2) * at.state[OILED] / WIPE_M


@inlined
def add_charge(at: Instant, p: PlantParameters, out: Floats) -> None:
    """What a disk holds of the charge that it can (0 to 1): it gathers what it lacks along the way slid, over
    `CLING_M`, and loses it within `CLING_S`; the ring is lined and takes none."""
    if p.clinging != 0.0:
        speed = np.sqrt(at.slip_x**2 + at.slip_y**2)
        out[CHARGE] = speed * (1.0 - at.state[CHARGE]) / CLING_M - at.state[CHARGE] / CLING_S


@inlined
def add_age(at: Instant, p: PlantParameters, out: Floats) -> None:
    """What the contacts under a disk have of their strength (0 to 1): they gain what they lack within `AGE_S`, and lose
    it along the way slid, over `AGE_M`."""
    if p.aged != 0.0:
        speed = np.sqrt(at.slip_x**2 + at.slip_y**2)
        out[AGED] = (1.0 - at.state[AGED]) / AGE_S - speed * at.state[AGED] / AGE_M


@inlined
def add_float(at: Instant, p: PlantParameters, out: Floats) -> None:
    """How far a disk floats on a film (0 to 1): it rises within `FLOAT_S` where it slips faster than `FLOATS_M_PER_S`
    and sinks where it is slower than `SINKS_M_PER_S`; between them it goes on as it did."""
    if p.afloat != 0.0:
        square, now = at.slip_x**2 + at.slip_y**2, at.state[AFLOAT]
        rises = square > FLOATS_M_PER_S**2 or (now > 0.5 and square > SINKS_M_PER_S**2)
        out[AFLOAT] = ((1.0 if rises else 0.0) - now) / FLOAT_S


@inlined
def add_beads(at: Instant, p: PlantParameters, out: Floats) -> None:
    """The mean direction of the slip over the way just slid: beads of wax turn to the disk's own along `BEADS_M`."""
    if p.beads != 0.0:
        speed = np.sqrt(at.slip_x**2 + at.slip_y**2)
        out[BEAD_X] = (at.slip_x - speed * at.state[BEAD_X]) / BEADS_M
        out[BEAD_Y] = (at.slip_y - speed * at.state[BEAD_Y]) / BEADS_M
