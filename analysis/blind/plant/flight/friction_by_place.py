"""What the floor's coefficient of friction is multiplied by at a place of the floor."""

import numpy as np

from analysis.blind.plant.compiled import Floats, inlined
from analysis.blind.plant.flight.instant import Instant
from analysis.blind.plant.host import HOST_M_PER_S2
from analysis.blind.plant.parameters import PlantParameters
from analysis.blind.plant.state import COUNT, HERE_X, HERE_Y, THERE_X, THERE_Y, TRODDEN, TRODDEN_SIDE

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
SCREWS_AT_M = 0.022  # from the Host's centre to its floor's four screws
SCREW_M = 0.008  # from a screw's middle to where the disk, which is wider, misses three fifths as much of the floor
DRYING_M = 0.016  # from a wet spot's middle to where it is three fifths as wet: somewhat wider than the disk
PUDDLE_M = 0.012  # from a puddle's middle to where it wets three fifths as well: it is wider than the disk
SWASH_M = 0.022  # from the Host's centre to where a puddle is thrown at `HOST_M_PER_S2`


@inlined
def by_place(at: Instant, p: PlantParameters) -> float:
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
