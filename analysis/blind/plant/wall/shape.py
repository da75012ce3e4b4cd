"""The wall's and the disk's shape: how far the disk's middle gets along an azimuth, and the slope of that (m, m per
rad)."""

import numpy as np

from analysis.blind.plant.compiled import Floats, compiled, inlined
from analysis.blind.plant.parameters import PlantParameters
from analysis.blind.plant.state import ANGLE, APPROACH, COUNT, DENTS, IMPACT_S, LEFT, NORMAL, RIM_DENTS, SECTORS, SPIN

STEP_EDGE = 0.1  # rad within which one half of a stepped wall goes over into the other
JOINT_RAD = 0.08  # of the wall's azimuth, over which a strip's ends overlap: 3 mm
BEAD_RAD = 0.25  # of the wall, from a bead's top to where it stands in three fifths as far
POCKET_RAD = 0.4  # of the wall, from the middle of a worn pocket to where it is three fifths as deep
HEATING_S = 0.4  # in which a ring has widened by two thirds as it warms in a run
SPLIT_RAD = 0.1  # of the wall's azimuth, over which a split ring's halves go over into each other: 4 mm
CHIP_WIDTH_RAD = 0.35  # of the disk's rim: 3.5 mm
CHAMFER_RAD = 1.2  # of the disk's rim, from the middle of a chamfered side to its ends: a third of the rim
CHAMFER_EDGE_RAD = 0.5  # of the rim, over which a chamfer runs out: 5 mm, or the disk would rattle on its ends
LAP_RAD = 0.6  # of the disk's rim, over which a tape's end is ironed down: 6 mm to either side
PEEL_RAD = 0.7  # of the disk's rim, from a peeling end's top to where it stands out three fifths as far
FLAT_BLOWS = 5.0  # near one place of a soft rim, after which it is flattened there by two thirds
PEEL_BLOWS = 8.0  # after which it has peeled off by two thirds
SPOOL_RAD = 25.0  # turned on which a tape's loose end is wound up by three quarters: four turns
PLANING_M_PER_S = 0.9  # speed over the floor after a blow, at which a disk that planes is as wide as on the mean
TIPPED_S = 0.04  # in which a disk that a blow has tipped lies flat again: most of a flight
TIPPED_M_PER_S = 0.7  # approach of a blow that tips it half as far as any could
THROWN_RAD_PER_S = 40.0  # spin that throws a heavy tyre out half the way
QUIVER_S = 0.12  # in which a thin ring that a blow has sprung comes to rest: two flights
QUIVER_M_PER_S = 0.8  # approach of a blow that springs it half as far as any could
COVED_M_PER_S = 1.0  # speed towards a coved wall at which the disk gets as far up as on the mean
SWOLLEN_RAD_PER_S = 40.0  # spin at which a band is as wide as on the mean

Reach = tuple[float, float]


@inlined
def reach(time: float, azimuth: float, disk_angle: float, p: PlantParameters) -> Reach:
    """Along `azimuth` of a round wall with its ellipse and lobes, of a disk that is oval or has three lobes; and what
    either shape has in metres."""
    ellipse = 2.0 * (azimuth - p.ellipticity_phase_rad)
    lobe = p.lobe_order * (azimuth - p.lobe_phase_rad)
    oval = 2.0 * (azimuth - disk_angle - p.oval_rad)
    share = 1.0 + p.ellipticity * np.cos(ellipse) + p.lobes * np.cos(lobe) - p.oval * np.cos(oval)
    rise = -2.0 * p.ellipticity * np.sin(ellipse) - p.lobe_order * p.lobes * np.sin(lobe) + 2.0 * p.oval * np.sin(oval)
    trilobe = 3.0 * (azimuth - disk_angle - p.trilobe_rad)
    share, rise = share - p.trilobe * np.cos(trilobe), rise + 3.0 * p.trilobe * np.sin(trilobe)
    more, steeper = _wall_reach(time, azimuth, p)
    chip, flank = rim_reach(azimuth, disk_angle, p)
    return p.contact_radius_m * share + (more + chip), p.contact_radius_m * rise + (steeper + flank)


@inlined
def _wall_reach(time: float, azimuth: float, p: PlantParameters) -> Reach:
    """How much farther a wall lets the disk that is dented, flat at one place, stepped, jointed, split, chucked, worn
    or has a bead, or that changes in a run: by an oval liner that turns, a radius that grows, an oval that relaxes."""
    away = np.arctan2(np.sin(azimuth - p.dent_rad), np.cos(azimuth - p.dent_rad)) / p.dent_width_rad
    dent = p.dent_m * np.exp(-0.5 * away**2)
    edge = np.tanh(np.sin(azimuth - p.step_rad) / STEP_EDGE)
    step = 0.5 * p.step_m * edge
    rise = 0.5 * p.step_m * (1.0 - edge**2) * np.cos(azimuth - p.step_rad) / STEP_EDGE
    turning = 2.0 * (azimuth - p.liner_rad - p.liner_rad_per_s * time)
    liner = p.contact_radius_m * p.liner * np.cos(turning)
    round_ = -2.0 * p.contact_radius_m * p.liner * np.sin(turning)
    joint, along = joint_reach(azimuth, p)
    split, askew = split_reach(azimuth, p)
    sprung, steeper = sprung_reach(azimuth, p)
    wider = p.breathing_m * (2.0 * time / p.duration_s - 1.0) + p.packed_m
    worn, flank = worn_reach(azimuth, p)
    rise = rise + round_ + along + askew + steeper + flank
    flat, steeper = flat_reach(azimuth, p)
    wider, rise = wider + flat + heated(time, p), rise + steeper
    if p.relaxing_m != 0.0:
        oval, steeper = relaxed(azimuth, 2.0 * time / p.duration_s - 1.0, p)
        worn, rise = worn + oval, rise + steeper
    return step + liner + joint + split + sprung + wider + worn - dent, rise + dent * away / p.dent_width_rad


@inlined
def flat_reach(azimuth: float, p: PlantParameters) -> Reach:
    """How much farther the disk's middle gets in a ring with a flat spot: not past a chord, which is `flat_m` nearer at
    its middle, at `flat_rad`."""
    if p.flat_m == 0.0:
        return 0.0, 0.0
    c, s = np.cos(azimuth - p.flat_rad), np.sin(azimuth - p.flat_rad)
    chord = p.contact_radius_m - p.flat_m
    if c * p.contact_radius_m <= chord:
        return 0.0, 0.0
    return chord / c - p.contact_radius_m, chord * s / c**2


@inlined
def heated(time: float, p: PlantParameters) -> float:
    """How much farther the disk's middle gets (m) in a ring that warms in the course of a run and has cooled before the
    next: `heating_m` (1 - exp(-t / `HEATING_S`)), less its mean over the run, t the time in it."""
    if p.heating_m == 0.0:
        return 0.0
    share = HEATING_S / p.duration_s
    cold_on_the_mean = share * (1.0 - np.exp(-1.0 / share))
    return p.heating_m * (cold_on_the_mean - np.exp(-max(time, 0.0) / HEATING_S))


@inlined
def heating_speed(time: float, p: PlantParameters) -> float:
    """How fast it widens (m/s), all around."""
    return p.heating_m / HEATING_S * np.exp(-time / HEATING_S) if time > 0.0 else 0.0


@compiled
def relaxed(azimuth: float, course: float, p: PlantParameters) -> Reach:
    """How much farther the disk's middle gets in a ring that was sprung into its seat, and that the drive shakes round
    in the course of a run and beyond: `relaxing_m` cos 2(azimuth - `relaxing_rad`) times `course`, which goes from -1
    to 1.  Of the rate of that, in its place, the first is the wall's own speed."""
    size, twice = p.relaxing_m * course, 2.0 * (azimuth - p.relaxing_rad)
    return size * np.cos(twice), -2.0 * size * np.sin(twice)


@inlined
def pressed(azimuth: float, state: Floats, p: PlantParameters) -> Reach:
    """How much farther the disk's middle gets in a thin ring that each blow leaves oval, held so by its seat, until the
    next: `pressed_m` cos 2(azimuth - the last blow's normal); before any it is round."""
    if p.pressed_m == 0.0 or state[COUNT] < 0.5:
        return 0.0, 0.0
    twice = 2.0 * (azimuth - state[NORMAL])
    return p.pressed_m * np.cos(twice), -2.0 * p.pressed_m * np.sin(twice)


@inlined
def quivered(time: float, azimuth: float, state: Floats, p: PlantParameters) -> Reach:
    """How much farther the disk's middle gets in a thin ring that a blow has sprung oval and that quivers.

    By `quiver_m` v / (v + `QUIVER_M_PER_S`) exp(-since / `QUIVER_S`) cos(`quiver_rad_per_s` since) cos 2(azimuth - the
    blow's normal), v the last blow's approach; before any it is round.
    """
    size, twice = _quiver(time, state, p)[0], 2.0 * (azimuth - state[NORMAL])
    return size * np.cos(twice), -2.0 * size * np.sin(twice)


@inlined
def quiver_speed(time: float, azimuth: float, state: Floats, p: PlantParameters) -> float:
    """How fast it widens there (m/s)."""
    return _quiver(time, state, p)[1] * np.cos(2.0 * (azimuth - state[NORMAL]))


@inlined
def _quiver(time: float, state: Floats, p: PlantParameters) -> tuple[float, float]:
    """How far it stands out where it was struck (m), and the rate of that (m/s)."""
    if state[IMPACT_S] < -0.5:  # there was no impact before
        return 0.0, 0.0
    since, omega = max(time - state[IMPACT_S], 0.0), p.quiver_rad_per_s
    size = p.quiver_m * state[APPROACH] / (state[APPROACH] + QUIVER_M_PER_S) * np.exp(-since / QUIVER_S)
    c, s = np.cos(omega * since), np.sin(omega * since)
    return size * c, -size * (c / QUIVER_S + omega * s)


@inlined
def kneaded(azimuth: float, state: Floats, p: PlantParameters) -> Reach:
    """How much farther the disk's middle gets in a ring lined with clay, which is smoothed before each run: `clay_m` n,
    n the harder blows before in the wall's sector there; from the middle of one of `SECTORS` to that of the next it
    goes over like f^2 (3 - 2 f), f the share of the way."""
    wide = 2.0 * np.pi / SECTORS
    place = azimuth / wide - 0.5
    low = np.floor(place)
    share = place - low
    here, next_ = state[DENTS + int(low) % SECTORS], state[DENTS + int(low + 1.0) % SECTORS]
    eased, slope = share**2 * (3.0 - 2.0 * share), 6.0 * share * (1.0 - share) / wide
    return p.clay_m * (here + (next_ - here) * eased), p.clay_m * (next_ - here) * slope


@compiled
def flattened(azimuth: float, state: Floats, p: PlantParameters) -> Reach:
    """How much farther a rim lets the disk that is soft, and that blows flatten where they strike: by `flattened_m` (1
    - exp(-n / `FLAT_BLOWS`)), n the harder blows before near there: those of each of the rim's `SECTORS` sectors count
    with the square of the cosine of the way from its middle, none a quarter of the rim off."""
    blows, slope = 0.0, 0.0
    for sector in range(SECTORS):
        away = azimuth - state[ANGLE] - (sector + 0.5) * 2.0 * np.pi / SECTORS
        if np.cos(away) > 0.0:
            blows += state[RIM_DENTS + sector] * np.cos(away) ** 2
            slope -= state[RIM_DENTS + sector] * np.sin(2.0 * away)
    left = p.flattened_m * np.exp(-blows / FLAT_BLOWS)
    return p.flattened_m - left, left * slope / FLAT_BLOWS


@inlined
def joint_reach(azimuth: float, p: PlantParameters) -> Reach:
    """How much farther the disk's middle gets in a ring bent of a strip whose ends overlap."""
    away = np.arctan2(np.sin(azimuth - p.joint_rad), np.cos(azimuth - p.joint_rad))
    edge = np.tanh(away / JOINT_RAD)
    return (
        p.joint_m * (0.5 * edge - away / (2.0 * np.pi)),
        p.joint_m * (0.5 * (1.0 - edge**2) / JOINT_RAD - 1.0 / (2.0 * np.pi)),
    )


@inlined
def split_reach(azimuth: float, p: PlantParameters) -> Reach:
    """How much farther the disk's middle gets in a ring made of two halves that were put together askew.

    Along their joint, at `split_rad`, one half lies half of `split_m` this way and the other half of it that way.
    """
    if p.split_m == 0.0:
        return 0.0, 0.0
    c, s = np.cos(azimuth - p.split_rad), np.sin(azimuth - p.split_rad)
    half = np.tanh(s / SPLIT_RAD)
    return 0.5 * p.split_m * c * half, 0.5 * p.split_m * (c * c * (1.0 - half**2) / SPLIT_RAD - s * half)


@inlined
def sprung_reach(azimuth: float, p: PlantParameters) -> Reach:
    """How much farther the disk's middle gets in a ring as it was made.

    Turned in a chuck of three jaws it springs into three lobes: `chucked_m` cos 3(azimuth - `chucked_rad`).
    A Host that is not of metal warps from run to run, and its ring goes oval: `warping_m`, the run's own, cos 2(azimuth
    - `warping_rad`).
    A rough casting is uneven in short waves: `uneven_m` sqrt(2 / 5) times the sum of cos(n azimuth - its phase), n from
    8 to 12.
    A bead of glue at its seam stands in: -`seam_bead_m` exp(-(azimuth - `seam_bead_rad`)^2 / (2 `BEAD_RAD`^2)).
    """
    more, steeper = 0.0, 0.0
    if p.chucked_m != 0.0:
        lobe = 3.0 * (azimuth - p.chucked_rad)
        more += p.chucked_m * np.cos(lobe)
        steeper -= 3.0 * p.chucked_m * np.sin(lobe)
    if p.warping_m != 0.0:
        twice = 2.0 * (azimuth - p.warping_rad)
        more += p.warping_m * np.cos(twice)
        steeper -= 2.0 * p.warping_m * np.sin(twice)
    if p.uneven_m != 0.0:
        size = p.uneven_m * np.sqrt(2.0 / 5.0)
        phases = (p.uneven_8_rad, p.uneven_9_rad, p.uneven_10_rad, p.uneven_11_rad, p.uneven_12_rad)
        for wave in range(5):
            order = 8.0 + wave
            more += size * np.cos(order * azimuth - phases[wave])
            steeper -= size * order * np.sin(order * azimuth - phases[wave])
    if p.seam_bead_m != 0.0:
        away = np.arctan2(np.sin(azimuth - p.seam_bead_rad), np.cos(azimuth - p.seam_bead_rad)) / BEAD_RAD
        bead = p.seam_bead_m * np.exp(-0.5 * away**2)
        more -= bead
        steeper += bead * away / BEAD_RAD
    return more, steeper


@inlined
def worn_reach(azimuth: float, p: PlantParameters) -> Reach:
    """How much farther the disk's middle gets in a ring whose blows have worn a pocket at either end of the drive's
    axis, x: `pockets_m`, falling off like a bell of `POCKET_RAD`."""
    if p.pockets_m == 0.0:
        return 0.0, 0.0
    away = 0.5 * np.arctan2(np.sin(2.0 * azimuth), np.cos(2.0 * azimuth)) / POCKET_RAD
    pocket = p.pockets_m * np.exp(-0.5 * away**2)
    return pocket, -pocket * away / POCKET_RAD


@inlined
def chip_reach(azimuth: float, disk_angle: float, p: PlantParameters) -> Reach:
    """How much farther a chipped rim lets the disk."""
    off = azimuth - disk_angle - p.chip_rad
    away = np.arctan2(np.sin(off), np.cos(off)) / CHIP_WIDTH_RAD
    chip = p.chip_m * np.exp(-0.5 * away**2)
    return chip, -chip * away / CHIP_WIDTH_RAD


@inlined
def chamfer_reach(azimuth: float, disk_angle: float, p: PlantParameters) -> Reach:
    """How much farther a rim lets the disk whose one side is chamfered: by `chamfer_m` within `CHAMFER_RAD` of
    `chamfer_rad`, running out at both ends over `CHAMFER_EDGE_RAD`."""
    off = azimuth - disk_angle - p.chamfer_rad
    away = np.arctan2(np.sin(off), np.cos(off))
    begins, ends = np.tanh((away + CHAMFER_RAD) / CHAMFER_EDGE_RAD), np.tanh((away - CHAMFER_RAD) / CHAMFER_EDGE_RAD)
    slope = 0.5 * p.chamfer_m * (ends**2 - begins**2) / CHAMFER_EDGE_RAD
    return 0.5 * p.chamfer_m * (begins - ends), slope


@inlined
def rim_reach(azimuth: float, disk_angle: float, p: PlantParameters) -> Reach:
    """How much farther a rim lets the disk that is chipped, chamfered along one side, or that has tape around it.

    The tape's beginning lies below its end: its radius rises evenly once around, and falls by `lap_m` at `lap_rad`.
    """
    chip, flank = chip_reach(azimuth, disk_angle, p)
    if p.chamfer_m != 0.0:
        side, steeper = chamfer_reach(azimuth, disk_angle, p)
        chip, flank = chip + side, flank + steeper
    if p.lap_m == 0.0:
        return chip, flank
    off = azimuth - disk_angle - p.lap_rad
    away = np.arctan2(np.sin(off), np.cos(off))
    edge = np.tanh(away / LAP_RAD)
    more = p.lap_m * (0.5 * edge - away / (2.0 * np.pi))
    return chip + more, flank + p.lap_m * (0.5 * (1.0 - edge**2) / LAP_RAD - 1.0 / (2.0 * np.pi))


@inlined
def peeled(azimuth: float, state: Floats, p: PlantParameters) -> Reach:
    """How much farther the disk's middle gets with tape around its rim whose end is pressed on before each run, and
    that blows peel off.

    At `peeling_rad` of the rim it stands out by `peeling_m` (1 - exp(-n / `PEEL_BLOWS`)), n the blows before, falling
    off to either side like a bell of `PEEL_RAD`.
    """
    off = azimuth - state[ANGLE] - p.peeling_rad
    away = np.arctan2(np.sin(off), np.cos(off)) / PEEL_RAD
    end = p.peeling_m * (1.0 - np.exp(-state[COUNT] / PEEL_BLOWS)) * np.exp(-0.5 * away**2)
    return -end, end * away / PEEL_RAD


@inlined
def flat_gap(x: float, y: float, host_angle: float, p: PlantParameters) -> tuple[float, float, float]:
    """Distance of the disk's middle, x, y from the wall's (m), from the nearest side of a polygon, and that side's
    outward normal."""
    gap, nx, ny = 1e300, 1.0, 0.0
    for side in range(int(p.wall_sides)):
        angle = host_angle + p.wall_turn_rad + 2.0 * np.pi * side / p.wall_sides
        ax, ay = np.cos(angle), np.sin(angle)
        if p.contact_radius_m - ax * x - ay * y < gap:
            gap, nx, ny = p.contact_radius_m - ax * x - ay * y, ax, ay
    return gap, nx, ny


@inlined
def rim_middle(angle: float, spin: float, p: PlantParameters) -> tuple[float, float]:
    """From the disk's middle to that of its rim (x, y in m), which a tyre thicker at one side has; `angle` and `spin`
    the disk's.

    A slack tyre that is heavier at one side, `thrown_rad` of the disk, is thrown out there by the spin w: by `thrown_m`
    w^2 / (w^2 + `THROWN_RAD_PER_S`^2).
    """
    x, y = 0.0, 0.0
    if p.tyre_m != 0.0:
        x, y = p.tyre_m * np.cos(angle + p.tyre_rad), p.tyre_m * np.sin(angle + p.tyre_rad)
    if p.thrown_m != 0.0:
        out = p.thrown_m * spin**2 / (spin**2 + THROWN_RAD_PER_S**2)
        x, y = x + out * np.cos(angle + p.thrown_rad), y + out * np.sin(angle + p.thrown_rad)
    return x, y


@inlined
def swollen(spin: float, p: PlantParameters) -> float:
    """How much wider the disk's radius is (m) with a slack rubber band around it, which the spin draws wide:
    `swollen_m` (w^2 - `SWOLLEN_RAD_PER_S`^2) / (w^2 + `SWOLLEN_RAD_PER_S`^2)."""
    if p.swollen_m == 0.0:
        return 0.0
    return p.swollen_m * (spin**2 - SWOLLEN_RAD_PER_S**2) / (spin**2 + SWOLLEN_RAD_PER_S**2)


@inlined
def climbed(outward: float, p: PlantParameters) -> float:
    """How much farther the disk's middle gets (m) at a wall that is hollowed out at its foot, up which a disk with a
    rounded edge climbs with its energy: `coved_m` (v^4 - `COVED_M_PER_S`^4) / (v^4 + `COVED_M_PER_S`^4), v its speed
    outwards against the Host, none where it goes inwards; a slow one does not get onto it."""
    fourth = max(outward, 0.0) ** 4
    return p.coved_m * (fourth - COVED_M_PER_S**4) / (fourth + COVED_M_PER_S**4)


@inlined
def spooled(angle: float, p: PlantParameters) -> float:
    """How much wider the disk's radius is (m) with a tape around it whose end is loose, and which it winds up as it
    turns and sheds as it turns back: `spool_m` tanh((angle - `spool_rad`) / `SPOOL_RAD`), every turn counted."""
    return 0.0 if p.spool_m == 0.0 else p.spool_m * np.tanh((angle - p.spool_rad) / SPOOL_RAD)


@inlined
def planed(state: Floats, p: PlantParameters) -> float:
    """How much wider the disk's radius is (m) where a blow has left it fast, so that it rises on its film of air and
    meets the wall with a lower edge of its bevelled rim: `planing_m` (u^2 - `PLANING_M_PER_S`^2) / (u^2 +
    `PLANING_M_PER_S`^2), u its speed over the floor after the last blow; before any it is what it is."""
    if p.planing_m == 0.0 or state[LEFT] == 0.0:
        return 0.0
    square = state[LEFT] ** 2
    return p.planing_m * (square - PLANING_M_PER_S**2) / (square + PLANING_M_PER_S**2)


@inlined
def tipped(time: float, state: Floats, p: PlantParameters) -> float:
    """How much less the disk's radius is (m) where a blow has tipped it, so that its edges do not stand above each
    other: `tipped_m` v^2 / (v^2 + `TIPPED_M_PER_S`^2) exp(-since / `TIPPED_S`), v the last blow's approach."""
    if p.tipped_m == 0.0 or state[COUNT] < 0.5:
        return 0.0
    square = state[APPROACH] ** 2
    since = max(time - state[IMPACT_S], 0.0)
    return p.tipped_m * square / (square + TIPPED_M_PER_S**2) * np.exp(-since / TIPPED_S)


@inlined
def widening(time: float, state: Floats, p: PlantParameters) -> float:
    """How fast the radius of a disk grows that a blow has tipped, or that winds up a tape (m/s)."""
    rate = tipped(time, state, p) / TIPPED_S
    if p.spool_m != 0.0:
        left = 1.0 - (spooled(state[ANGLE], p) / p.spool_m) ** 2
        rate += p.spool_m * left * state[SPIN] / SPOOL_RAD
    return rate
