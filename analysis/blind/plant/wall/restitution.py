"""The normal restitution of a blow: of the wall itself, by the place on wall and rim, the way it strikes, the blows
before and the Host's motion."""

import numpy as np

from analysis.blind.plant.compiled import Floats, inlined
from analysis.blind.plant.host import HOST_M_PER_S2
from analysis.blind.plant.parameters import PlantParameters
from analysis.blind.plant.state import (
    APPROACH,
    AZIMUTH,
    COUNT,
    DENTS,
    HARDEST,
    HEAT,
    IMPACT_S,
    NORMAL,
    RIM_DENTS,
    SECTORS,
    SLIPPED,
    SPIN,
    STRUCK,
    WAY,
    WAY_BEFORE,
)
from analysis.blind.plant.wall.blow import Blow
from analysis.blind.plant.wall.motion import tiredness

LEAST, MOST = 0.05, 0.98  # that a wall gives back, scatter included
NICK_RAD = 0.5  # of the disk's rim
SHIM_RAD = 0.7  # of the wall's azimuth: a shim as wide as the disk and a half
BRUISE_WIDTH_RAD = 0.4  # of the wall's azimuth, as wide as a soft spot
RINGING_S = 0.06  # in which a wall's ringing dies out: about the time from blow to blow
SHINGLE_M_PER_S = 0.4  # slip from which on a blow meets the edges of shingles squarely
PAD_RAD, PAD_M_PER_S = 0.9, 1.0  # of the wall's azimuth; approach at which a pad is pressed flat by two thirds
BOLT_RAD = 0.3  # of the wall's azimuth, from a bolt to where it stiffens the ring three fifths as much
PLASTIC_M_PER_S = 0.9  # approach at which a rim that yields gives back what it does on the mean
STRAIGHT_M_PER_S = 1.5  # approach at which a restitution that falls evenly is what it is
FIFTH_M_PER_S = 1.2  # approach at which a restitution that falls with the fifth root is what it is
TOUCH_M_PER_S = 0.2  # approach of a touch, below which it rises no more: else the disk would hardly come to rest
DASHPOT_M_PER_S = 1.2  # and one that a dashpot beside the spring takes from
HEATED_M2_PER_S2 = 10.0  # energy per unit mass that blows take in a run, about: a disk is then well heated
YIELD_M_PER_S = 1.3  # approach of a blow that just makes metal yield
PLASTIC_MOST = 1.3  # fourth root of how much lighter a blow may be and still give back more
SWEPT_M = 0.04  # way on which most of the dust that a rim can gather has gathered before it
GLANCES_MOST = 2.0  # slip over the approach beyond which a blow's chance matters no more
HEELED_MOST = 2.0  # slip over the approach beyond which a disk heels over no more
SCREWS_BLOWS = 12.0  # after which screws have come loose by two thirds
DINT_M_PER_S = 1.1  # approach of a last blow after which a metal that hardens gives back what it does on the mean
SLACKENED_S = 0.02  # after which clamps that are tightened before a run begin to slacken evenly with its logarithm
UNLUCKY_SD = 1.0  # a standard normal chance is above it in one impact of six


@inlined
def restitution(blow: Blow, state: Floats, p: PlantParameters) -> float:
    """With every cause that acts on it; `state`: the disk's as the blow begins."""
    value = _of_the_wall(blow, state, p)
    value = _by_the_rim(value, blow, state, p)
    value = _by_the_azimuth(value, blow, state, p)
    value = _by_the_way_it_strikes(value, blow, p)
    value = _by_the_blows_before(value, blow, state, p)
    value = _by_the_host(value, blow, p)
    # The wall's plastic warms from run to run, and softens; its screws are tightened once between two runs.
    value = _times(value, 1.0 - p.warmed + p.retightened)
    if p.warmed_up != 0.0:  # as fast at first as it is then slow
        value = _times(value, 1.0 + p.warmed_up)
    if p.wetted_m_per_s != 0.0:  # a film on the wall takes this much of the approach
        value *= max(1.0 - p.wetted_m_per_s / blow.approach, 0.0)
    if p.adhesion_m_per_s != 0.0:  # the wall keeps the energy of this speed
        value = np.sqrt(max(value**2 - (p.adhesion_m_per_s / blow.approach) ** 2, 0.0))
    return max(value - (p.damage if state[HARDEST] > p.damage_m_per_s else 0.0), LEAST)


@inlined
def _raised(value: float, gain: float) -> float:
    """A restitution with a gain, or a loss, that does not raise it above `MOST`: no wall gives back all."""
    return min(value + gain, max(value, MOST))


@inlined
def _times(value: float, share: float) -> float:
    """A restitution multiplied by a share that does not raise it above `MOST` either."""
    return min(value * share, max(value, MOST))


@inlined
def _of_the_wall(blow: Blow, state: Floats, p: PlantParameters) -> float:
    """Of the wall as it ages and scatters: by speed, direction, a soft spot, the drive's phase, spin, slip and the time
    to rest."""
    value, approach, slip = p.restitution, blow.approach, blow.slip
    if p.restitution_speed_m_per_s > 0.0:
        value = p.restitution_floor + (value - p.restitution_floor) * np.exp(-approach / p.restitution_speed_m_per_s)
    value += p.direction_amplitude * np.cos(blow.azimuth - p.direction_phase_rad)
    value -= p.soft_amplitude * _bell(blow.azimuth - p.soft_azimuth_rad, p.soft_width_rad)
    value += p.phase_amplitude * np.sin(p.drive_rad_per_s * blow.time + p.phase_rad)
    value -= p.spin_restitution_s * abs(state[SPIN])
    value -= p.slip_restitution_s_per_m * abs(slip)
    if p.rest_amplitude != 0.0:
        value -= p.rest_amplitude * np.exp(-blow.since_s / p.rest_s)
    value -= p.glancing * slip**2 / (slip**2 + approach**2 + 1e-300)
    value *= 1.0 - p.ageing_per_s * blow.time
    if p.softened != 0.0:  # a liner that softens as a run warms it, ever more slowly
        value *= max(1.0 - p.softened * (1.0 - np.exp(-max(blow.time, 0.0) / p.softened_s)), 0.0)
    if p.slackened != 0.0:  # clamps that are tightened before each run creep, and hold the ring less
        value *= max(1.0 - p.slackened * np.log(1.0 + max(blow.time, 0.0) / SLACKENED_S), 0.0)
    return min(max(value + p.restitution_scatter * blow.chance, LEAST), MOST)


@inlined
def _bell(off_rad: float, width_rad: float) -> float:
    """1 at a place around a circle, falling off to either side."""
    return np.exp(-0.5 * (np.arctan2(np.sin(off_rad), np.cos(off_rad)) / width_rad) ** 2)


@inlined
def _by_the_rim(value: float, blow: Blow, state: Floats, p: PlantParameters) -> float:
    """By the place on the disk's rim: less at a nick.

    A washer punched of rolled sheet is harder along the sheet's grain than across: `sheet` cos 2(rim - `sheet_rad`).
    A washer that was quenched from one side is harder there than opposite: `hardened` cos(rim - `hardened_rad`).
    A loose rubber band around the rim is pushed to the other side of it by each blow: where it was struck the last time
    it is bare and hard, opposite the band lies double: `shifted` cos(rim - the last one).
    A soft rim is peened hard where it strikes: `peened` n is won, n the harder blows before at the struck one of the
    rim's `SECTORS` sectors.
    Wall and washer each have a high side, which mesh like two wheels: `meshed` cos(azimuth - `meshed_wall_rad`)
    cos(rim - `meshed_rim_rad`).
    """
    value -= p.nick * _bell(blow.rim_rad - p.nick_rad, NICK_RAD)
    value = _raised(value, p.sheet * np.cos(2.0 * (blow.rim_rad - p.sheet_rad)))
    if p.hardened != 0.0:
        value = _raised(value, p.hardened * np.cos(blow.rim_rad - p.hardened_rad))
    if p.peened != 0.0:
        value = _raised(value, p.peened * state[RIM_DENTS + struck_sector(blow.rim_rad)])
    if p.meshed != 0.0:
        of_the_wall, of_the_rim = np.cos(blow.azimuth - p.meshed_wall_rad), np.cos(blow.rim_rad - p.meshed_rim_rad)
        value = _raised(value, p.meshed * of_the_wall * of_the_rim)
    if p.shifted != 0.0 and state[COUNT] > 0.5:  # there was an impact before
        value = _raised(value, p.shifted * np.cos(blow.rim_rad - state[STRUCK]))
    return value


@inlined
def _by_the_azimuth(value: float, blow: Blow, state: Floats, p: PlantParameters) -> float:
    """By the place on the wall: more and less at three clamps, less where it was hit the last time.

    A shim behind the ring wanders round it as the drive shakes it, each run from `shim_rad` on at `shim_rad_per_s`:
    where it just is the blow loses `shim`, falling off like a bell of `SHIM_RAD`.
    A felt pad behind the wall takes light blows, and hard ones press it flat: `pad` exp(-approach / `PAD_M_PER_S`) is
    lost at `pad_rad`, falling off like a bell of `PAD_RAD`.
    A lamp that is switched on for each run warms one side of the wall: `lamp` (1 + cos(azimuth - `lamp_rad`)) / 2
    is lost times the share of the run that has passed.
    One of the ring's screws backs out from run to run, and the ring gives at its side: `backed`, the run's own, (1 +
    cos(azimuth - `backed_rad`)) / 2 is lost.
    A ring is backed along one half only, which returns more than the other: by `half_backed` where cos(azimuth -
    `half_backed_rad`) is above 0, as much less elsewhere.
    A ring is held by four bolts, and gives between them: at each it returns more by `bolts`, falling off like a bell of
    `BOLT_RAD`.
    """
    value += p.clamps * np.cos(3.0 * (blow.azimuth - p.clamps_rad))
    if p.bruise != 0.0 and state[IMPACT_S] > -0.5:  # there was an impact before
        value -= p.bruise * _bell(blow.azimuth - state[AZIMUTH], BRUISE_WIDTH_RAD)
    if p.shim != 0.0:
        value -= p.shim * _bell(blow.azimuth - p.shim_rad - p.shim_rad_per_s * blow.time, SHIM_RAD)
    if p.pad != 0.0:
        value -= p.pad * np.exp(-blow.approach / PAD_M_PER_S) * _bell(blow.azimuth - p.pad_rad, PAD_RAD)
    if p.lamp != 0.0:
        passed = min(max(blow.time, 0.0) / p.duration_s, 1.0)
        value -= p.lamp * passed * 0.5 * (1.0 + np.cos(blow.azimuth - p.lamp_rad))
    if p.backed != 0.0:
        value = _raised(value, -p.backed * 0.5 * (1.0 + np.cos(blow.azimuth - p.backed_rad)))
    if p.half_backed != 0.0:
        side = 1.0 if np.cos(blow.azimuth - p.half_backed_rad) > 0.0 else -1.0
        value = _raised(value, p.half_backed * side)
    if p.bolts != 0.0:
        value = _raised(value, p.bolts * _bell(4.0 * (blow.azimuth - p.bolts_rad), 4.0 * BOLT_RAD))
    return value


@inlined
def _by_the_way_it_strikes(value: float, blow: Blow, p: PlantParameters) -> float:
    """Less where a loose chip happens to lie between.

    A liner wound with overlaps lies like shingles: a blow that runs against their edges loses what one that runs with
    them wins, `shingled` tanh(slip / `SHINGLE_M_PER_S`).
    A wall returns the less the harder the blow, evenly: `straight_s_per_m` (approach - `STRAIGHT_M_PER_S`) is lost.
    What is viscoelastic loses with the fifth root of the approach: `viscoelastic` (approach^(1/5) -
    `FIFTH_M_PER_S`^(1/5)), of touches as at `TOUCH_M_PER_S`.
    Screws that give in hard blows: `giving_s_per_m` times what the approach has beyond `giving_m_per_s` is lost.
    A disk climbs up the wall in hard blows, and the share `climbing` of its rebound's energy goes upwards: times
    sqrt(1 - `climbing`) where the approach is above `climbing_m_per_s`.
    A wall of coarse grains gives back a head-on blow always alike and an oblique one by chance: by `glances` z r, z
    standard normal and r the slip's size over the approach, `GLANCES_MOST` at most.
    A sticky wall holds on to what comes slowly: times 1 - `caught` where the approach is below `caught_m_per_s`.
    A slip along the wall heels the disk over, and some of the blow goes into that: `heeled` times the slip's size over
    the approach is lost, `HEELED_MOST` times it at most.
    A spring with a dashpot that grows with its way returns 1 / (1 + a approach), a `dashpot_s_per_m`: over what it is
    at `DASHPOT_M_PER_S`.
    Beyond `YIELD_M_PER_S` metal yields: times (`YIELD_M_PER_S` / approach)^`yielded`, a quarter in the textbooks.
    An oblique blow shears the wall and returns less, or more: times 1 - `oblique` slip^2 / (slip^2 + approach^2).
    Metal yields at an edge, and the harder the blow the more is lost: times 1 + `plastic` ((`PLASTIC_M_PER_S` /
    approach)^(1/4) - 1), the root `PLASTIC_MOST` at most.
    """
    value -= p.loose_chip if blow.other_chance > UNLUCKY_SD else 0.0
    value = _raised(value, -p.shingled * np.tanh(blow.slip / SHINGLE_M_PER_S))
    if p.straight_s_per_m != 0.0:
        value = _raised(value, -p.straight_s_per_m * (blow.approach - STRAIGHT_M_PER_S))
    if p.viscoelastic != 0.0:
        root = max(blow.approach, TOUCH_M_PER_S) ** 0.2
        value = _raised(value, -p.viscoelastic * (root - FIFTH_M_PER_S**0.2))
    if p.giving_s_per_m != 0.0:
        value = _raised(value, -p.giving_s_per_m * max(blow.approach - p.giving_m_per_s, 0.0))
    if p.climbing != 0.0 and blow.approach > p.climbing_m_per_s:
        value *= np.sqrt(max(1.0 - p.climbing, 0.0))
    if p.caught != 0.0 and blow.approach < p.caught_m_per_s:
        value *= max(1.0 - p.caught, 0.0)
    if p.glances != 0.0:
        slope = min(abs(blow.slip) / (blow.approach + 1e-300), GLANCES_MOST)
        value = _raised(value, p.glances * blow.other_chance * slope)
    if p.heeled != 0.0:
        slope = min(abs(blow.slip) / (blow.approach + 1e-300), HEELED_MOST)
        value = _raised(value, -p.heeled * slope)
    if p.dashpot_s_per_m != 0.0:
        share = (1.0 + p.dashpot_s_per_m * DASHPOT_M_PER_S) / (1.0 + p.dashpot_s_per_m * blow.approach)
        value = _times(value, share)
    if p.yielded != 0.0 and blow.approach > YIELD_M_PER_S:
        value *= (YIELD_M_PER_S / blow.approach) ** p.yielded
    if p.plastic != 0.0:
        root = min((PLASTIC_M_PER_S / (blow.approach + 1e-300)) ** 0.25, PLASTIC_MOST)
        value = _times(value, max(1.0 + p.plastic * (root - 1.0), 0.0))
    return _times(value, 1.0 - p.oblique * blow.slip**2 / (blow.slip**2 + blow.approach**2 + 1e-300))


@inlined
def struck_sector(azimuth: float) -> int:
    """Which of the wall's `SECTORS` sectors lies at `azimuth`, counted from x on."""
    return min(int((azimuth % (2.0 * np.pi)) / (2.0 * np.pi) * SECTORS), SECTORS - 1)


@inlined
def _by_the_blows_before(value: float, blow: Blow, state: Floats, p: PlantParameters) -> float:
    """By how many there were, how hard and how long ago: the disk's two edges strike in turn, a liner tires.

    A wall still rings from the blow before: `ringing` exp(-since / `RINGING_S`) sin(`ringing_rad_per_s` since).
    A weight rattles in the washer's hole and lies where the last blow has left it.  From the same side a blow meets it
    at once, from the opposite one it comes late and deadens the rebound: `rattling` cos(this normal - the last one's).
    The ring's screws, tight as a run begins, come loose blow by blow: times 1 - `loosened` (1 - exp(-n /
    `SCREWS_BLOWS`)), n the blows before.
    A disk sweeps dust together as it slides, which cushions its next blow and is scattered by it: `swept` (1 - exp(-s /
    `SWEPT_M`)) is lost, s the way slid since the blow before.
    A soft liner, turned round before each run, is dented where it is struck: `hammered` n is lost, n the blows before
    in the same of `SECTORS` sectors of the wall.
    Soft metal hardens where a blow dints it, and the next blow loses less: `dinted_s_per_m` (v - `DINT_M_PER_S`) is
    won, v the last blow's approach.
    A blow that slips scuffs a soft rim, whose fuzz cushions the next one: `scuffed_s_per_m` times the size of the last
    blow's slip is lost.
    Blows heat a washer, which cools between the runs: times 1 - `heated` E / `HEATED_M2_PER_S2`, E the energy per unit
    mass that those of the run have taken so far.
    """
    value += p.two_edges if state[COUNT] % 2.0 < 0.5 else -p.two_edges
    if p.ringing != 0.0 and state[COUNT] > 0.5:
        swing = p.ringing * np.exp(-blow.since_s / RINGING_S) * np.sin(p.ringing_rad_per_s * blow.since_s)
        value = _raised(value, swing)
    if p.rattling != 0.0 and state[COUNT] > 0.5:
        value = _raised(value, p.rattling * np.cos(blow.normal_rad - state[NORMAL]))
    if p.swept != 0.0:
        slid = max(state[WAY] - state[WAY_BEFORE], 0.0)
        value = _raised(value, -p.swept * (1.0 - np.exp(-slid / SWEPT_M)))
    if p.hammered != 0.0:
        value = _raised(value, -p.hammered * state[DENTS + struck_sector(blow.azimuth)])
    if p.dinted_s_per_m != 0.0 and state[COUNT] > 0.5:
        value = _raised(value, p.dinted_s_per_m * (state[APPROACH] - DINT_M_PER_S))
    if p.scuffed_s_per_m != 0.0 and state[COUNT] > 0.5:
        value = _raised(value, -p.scuffed_s_per_m * abs(state[SLIPPED]))
    if p.heated != 0.0:
        value = _times(value, max(1.0 - p.heated * state[HEAT] / HEATED_M2_PER_S2, 0.0))
    value = value - p.tired * tiredness(blow.time, state)
    return _times(value, 1.0 - p.loosened * (1.0 - np.exp(-state[COUNT] / SCREWS_BLOWS)))


@inlined
def _by_the_host(value: float, blow: Blow, p: PlantParameters) -> float:
    """By the Host's motion: less where the wall gives way before the disk, more where its own inertia presses the ring
    into its seat.

    A hollow ring is filled with lead shot, which rattles as the Host is accelerated, whichever way, and takes up the
    blow: `shot` (the size of the Host's acceleration / `HOST_M_PER_S2`) is lost.
    A shaker's armature gives way along its axis, x, and stands firm across it: times 1 - `armature` times the squared
    cosine of the blow's direction.
    """
    velocity, acceleration = blow.host_velocity, blow.host_acceleration
    value += p.yielding_s_per_m * (velocity[0] * blow.nx + velocity[1] * blow.ny)
    if p.seated != 0.0:
        along = acceleration[0] * blow.nx + acceleration[1] * blow.ny
        value = _raised(value, p.seated * along / HOST_M_PER_S2)
    if p.shot != 0.0:
        value -= p.shot * np.sqrt(acceleration[0] ** 2 + acceleration[1] ** 2) / HOST_M_PER_S2
    return _times(value, 1.0 - p.armature * np.cos(blow.normal_rad) ** 2)
