"""Along the wall: its coefficient of friction in a blow, and how much of the slip comes back."""

import numpy as np

from analysis.blind.plant.compiled import Floats, inlined
from analysis.blind.plant.host import HOST_M_PER_S, HOST_M_PER_S2
from analysis.blind.plant.parameters import PlantParameters
from analysis.blind.plant.state import APPROACH, COUNT, DENTS, SLIPPED, SPIN, STRUCK, WAY, WAY_BEFORE
from analysis.blind.plant.wall.blow import Blow
from analysis.blind.plant.wall.restitution import struck_sector

TACKY_RAD = 0.35  # of the wall's azimuth
SCALE_M_PER_S = 0.3  # slip from which on a blow lifts scales or lays them over
PILE_M_PER_S = 0.3  # slip from which on a pile is laid over the whole way
SQUEEZED_M_PER_S = 0.8  # approach from which on most of the grease is squeezed out
PICKED_UP_M = 0.03  # way on which a rim picks up most of the oil that it can hold
OIL_RAD_PER_S = 40.0  # spin that draws half of a washer's oil out onto its rim
FLASH_M2_PER_S2 = 0.3  # approach times slip at which most of what may melt has melted
WIPED_S = 0.025  # in which oil creeps back onto a rim that a blow has wiped
THICK_M_PER_S = 0.4  # slip at which a wall's grease that thickens holds what it does on the mean
RATE_M_PER_S, SLOWEST_M_PER_S = 0.4, 0.02  # slip at which a wall's friction is what it is; below which it rises no more
BURNISHED_BLOWS = 1.0  # at one place of the wall, after which it is smooth there by two thirds
WORKED_BLOWS = 3.0  # after which rubber is worked soft by two thirds
HERTZ_M_PER_S = 0.4  # approach at which a wall's friction is what it is
HERTZ_MOST = 2.0  # third root of how much lighter a blow may be and still change it
SINTER_M_PER_S = 0.7  # approach of a blow that presses half of the oil out of a sintered wall
SHEAR_M_PER_S = 0.1  # slip from which on a blow leaves rubber set the whole way, or meets it so
RUN_IN_BLOWS = 6.0  # after which a wall is run in by two thirds
GLANCE = 0.25  # slip over approach at which half of the return is lost
GRAZE = 0.5  # slip over approach at which a disk skims half
LEAST_FRICTION = 0.02  # share of the wall's friction that is always left
SKIN_M_PER_S = 0.3  # slip at which the return is divided by 1 + `skin`
GEL_S = 0.08  # in which a gel that was sheared comes back: a flight or two
GROUND_RAD = 1.1  # of the disk's rim, from where it was ground the most to where three fifths as much
LAY_M_PER_S = 0.1  # slip from which on a wall's lay bites or gives
MOST_RETURN = 0.95  # of the slip
LINER_EDGE = 0.3  # of the cosine around the wall, within which a glued half goes over into the loose one
TAPE_EDGE = 0.2  # of the cosine around the rim, within which one half of it goes over into the other


@inlined
def wall_friction(blow: Blow, state: Floats, p: PlantParameters) -> float:
    """The coefficient with every cause that acts on it; `state`: the disk's as the blow begins."""
    return p.wall_friction * _by_place(blow, state, p) * _by_the_way_it_slips(blow, state, p) * _by_time(blow, state, p)


@inlined
def _by_place(blow: Blow, state: Floats, p: PlantParameters) -> float:
    """By the place on the wall, with a tacky spot, and on the disk's rim.

    The markers' glue has run over one side of the rim: 1 + `glued` cos(rim - `glued_rad`).
    Each blow wipes the oil off the rim where it strikes, and squeezes it round to the other side: 1 + `bared` cos(rim -
    the last one).
    A wall ground from one side to the other has scales that all lie towards there, clockwise along one half of it and
    counterclockwise along the other: 1 + `scaly` tanh(slip / `SCALE_M_PER_S`) sin(`scaly_rad` - the normal's
    direction).
    Grease lies along one sector of the wall: times 1 - `sector` within `sector_half_rad` of `sector_rad`.
    A washer's burr was ground off at one place of its rim: 1 - `ground`, less and less to either side of `ground_rad`
    like a bell of `GROUND_RAD`.
    Each blow of a run burnishes the wall where it strikes, which is roughened before the next run: 1 - `burnished` (1 -
    exp(-n / `BURNISHED_BLOWS`)), n the harder blows before in the wall's sector.
    Years of blows have worn the wall smooth at both ends of the drive's axis, x: 1 - `worn_ends` cos 2 azimuth.
    """
    share = 1.0 + p.wall_friction_amplitude * np.cos(p.wall_friction_lobes * (blow.azimuth - p.wall_friction_phase_rad))
    away = np.arctan2(np.sin(blow.azimuth - p.tacky_rad), np.cos(blow.azimuth - p.tacky_rad))
    share *= 1.0 + p.tacky * np.exp(-0.5 * (away / TACKY_RAD) ** 2)
    if p.glued != 0.0:
        share *= max(1.0 + p.glued * np.cos(blow.rim_rad - p.glued_rad), LEAST_FRICTION)
    if p.bared != 0.0 and state[COUNT] > 0.5:  # there was an impact before
        share *= max(1.0 + p.bared * np.cos(blow.rim_rad - state[STRUCK]), LEAST_FRICTION)
    if p.scaly != 0.0:
        towards = np.tanh(blow.slip / SCALE_M_PER_S) * np.sin(p.scaly_rad - blow.normal_rad)
        share *= max(1.0 + p.scaly * towards, LEAST_FRICTION)
    if p.sector != 0.0:
        off = blow.azimuth - p.sector_rad
        if abs(np.arctan2(np.sin(off), np.cos(off))) < p.sector_half_rad:
            share *= max(1.0 - p.sector, LEAST_FRICTION)
    if p.ground != 0.0:
        off = blow.rim_rad - p.ground_rad
        smooth = p.ground * np.exp(-0.5 * (np.arctan2(np.sin(off), np.cos(off)) / GROUND_RAD) ** 2)
        share *= max(1.0 - smooth, LEAST_FRICTION)
    if p.burnished != 0.0:
        blows = state[DENTS + struck_sector(blow.azimuth)]
        share *= max(1.0 - p.burnished * (1.0 - np.exp(-blows / BURNISHED_BLOWS)), LEAST_FRICTION)
    if p.worn_ends != 0.0:
        share *= max(1.0 - p.worn_ends * np.cos(2.0 * blow.azimuth), LEAST_FRICTION)
    return share


@inlined
def _by_the_way_it_slips(blow: Blow, state: Floats, p: PlantParameters) -> float:
    """By the sense of the slip, its speed and the blow's: grease carries a fast slip, and a hard blow squeezes it out.

    A fast slip in a hard blow melts the plastic's surface: of the friction is lost `flash` (1 - exp(-approach |slip| /
    `FLASH_M2_PER_S2`)).
    A wall of velvet has a pile that each blow lays over: 1 - `combed` tanh(slip / `PILE_M_PER_S`) tanh(the last blow's
    slip / `PILE_M_PER_S`), less along the pile and more against it.
    A wall holds the less the faster the disk slips: 1 / (1 + `rubbed_s_per_m` |slip|).
    Grease on the wall thickens as it is sheared: 1 + `thickened_s_per_m` (|slip| - `THICK_M_PER_S`).
    Junctions that have less time to grow hold less: 1 - `rate_weakened` log((|slip| + `SLOWEST_M_PER_S`) /
    `RATE_M_PER_S`).
    A layer on the wall creeps under a slow slip before it is sheared: tanh(|slip| / `creep_m_per_s`).
    A soft metal smears in hard blows and holds less: 1 - `smeared_s_per_m` approach.
    Of a round contact the area grows less than the load: 1 + `hertz` ((`HERTZ_M_PER_S` / approach)^(1/3) - 1), the
    root `HERTZ_MOST` at most.
    A grazing blow only skims along the wall's asperities: 1 - `skimmed` r^2 / (r^2 + `GRAZE`^2), r the
    slip's size over the approach.
    A wall that is not clean holds otherwise at each blow: e to `contaminated` z - `contaminated`^2 / 2, z standard
    normal; its mean is 1.
    """
    share = 1.0 + p.handed * (1.0 if blow.slip > 0.0 else -1.0)
    share *= 1.0 - p.greased * (1.0 - np.exp(-abs(blow.slip) / p.greased_m_per_s))
    share /= 1.0 + p.rubbed_s_per_m * abs(blow.slip)
    share *= 1.0 + p.squeezed * (1.0 - np.exp(-blow.approach / SQUEEZED_M_PER_S))
    if p.thickened_s_per_m != 0.0:
        share *= max(1.0 + p.thickened_s_per_m * (abs(blow.slip) - THICK_M_PER_S), LEAST_FRICTION)
    if p.rate_weakened != 0.0:
        faster = np.log((abs(blow.slip) + SLOWEST_M_PER_S) / RATE_M_PER_S)
        share *= max(1.0 - p.rate_weakened * faster, LEAST_FRICTION)
    if p.creep_m_per_s != 0.0:
        share *= max(np.tanh(abs(blow.slip) / p.creep_m_per_s), LEAST_FRICTION)
    if p.smeared_s_per_m != 0.0:
        share *= max(1.0 - p.smeared_s_per_m * blow.approach, LEAST_FRICTION)
    if p.hertz != 0.0:
        root = min((HERTZ_M_PER_S / (blow.approach + 1e-300)) ** (1.0 / 3.0), HERTZ_MOST)
        share *= max(1.0 + p.hertz * (root - 1.0), LEAST_FRICTION)
    if p.skimmed != 0.0:
        grazes = blow.slip**2 / (blow.slip**2 + (GRAZE * blow.approach) ** 2 + 1e-300)
        share *= max(1.0 - p.skimmed * grazes, LEAST_FRICTION)
    share = _by_spin_and_host(share, blow, state, p)
    if p.contaminated != 0.0:
        share *= np.exp(p.contaminated * blow.other_chance - 0.5 * p.contaminated**2)
    if p.flash != 0.0:
        melted = 1.0 - np.exp(-blow.approach * abs(blow.slip) / FLASH_M2_PER_S2)
        share *= max(1.0 - p.flash * melted, LEAST_FRICTION)
    if p.combed != 0.0:
        laid = np.tanh(state[SLIPPED] / PILE_M_PER_S)
        share *= max(1.0 - p.combed * np.tanh(blow.slip / PILE_M_PER_S) * laid, LEAST_FRICTION)
    return share


@inlined
def _by_spin_and_host(share: float, blow: Blow, state: Floats, p: PlantParameters) -> float:
    """`share` times what the disk's spin and the Host's motion make of it.

    A washer's hole is full of oil, and the spin draws it out onto the rim: 1 - `flung_oil` w^2 / (w^2 +
    `OIL_RAD_PER_S`^2), w the spin as the blow begins.
    A rim that spins draws air and dust in between: 1 - `spun_s` |w|, w the spin as the blow begins.
    Oil lies in the corner of floor and wall, and stays back as the Host is accelerated: 1 + `sloshing` (the
    acceleration along the normal / `HOST_M_PER_S2`), less where it piles up and more opposite.
    A cushion holds a disk more that comes with check side, its rim going round with its way along the wall, and less
    one with running side: 1 + `side` 2 t w / (t^2 + w^2), t the speed of its middle along the wall, w that of its rim.
    Powder on the wall is shaken up as the Host is accelerated, whichever way, and carries the disk like a fluid: 1 -
    `shaken` (the size of the Host's acceleration / `HOST_M_PER_S2`).
    The balls of its guide rattle the faster the Host moves, and what is rattled slips more easily: 1 - `dithered` (its
    speed / `HOST_M_PER_S`).
    """
    if p.flung_oil != 0.0:
        oiled = state[SPIN] ** 2 / (state[SPIN] ** 2 + OIL_RAD_PER_S**2)
        share *= max(1.0 - p.flung_oil * oiled, LEAST_FRICTION)
    if p.spun_s != 0.0:
        share *= max(1.0 - p.spun_s * abs(state[SPIN]), LEAST_FRICTION)
    if p.sloshing != 0.0:
        along = blow.host_acceleration[0] * blow.nx + blow.host_acceleration[1] * blow.ny
        share *= max(1.0 + p.sloshing * along / HOST_M_PER_S2, LEAST_FRICTION)
    if p.side != 0.0:
        rim = p.disk_radius_m * (state[SPIN] - blow.host_velocity[2])
        along = blow.slip_host - rim
        together = 2.0 * along * rim / (along**2 + rim**2 + 1e-300)
        share *= max(1.0 + p.side * together, LEAST_FRICTION)
    if p.shaken != 0.0:
        size = np.sqrt(blow.host_acceleration[0] ** 2 + blow.host_acceleration[1] ** 2) / HOST_M_PER_S2
        share *= max(1.0 - p.shaken * size, LEAST_FRICTION)
    if p.dithered != 0.0:
        speed = np.sqrt(blow.host_velocity[0] ** 2 + blow.host_velocity[1] ** 2) / HOST_M_PER_S
        share *= max(1.0 - p.dithered * speed, LEAST_FRICTION)
    return share


@inlined
def _by_time(blow: Blow, state: Floats, p: PlantParameters) -> float:
    """By the time in the run, in which the wall is polished, since the last blow, the way since then, and from run to
    run.

    A blow wipes the oil off the rim, and it creeps back: at a blow `since` seconds after the one before is lost
    `creeping` (1 - exp(-since / `WIPED_S`)); none before: oil all over.
    A rim picks up the oil of the floor as it slides, and each blow wipes it off: 1 - `picked_up` (1 - exp(-s /
    `PICKED_UP_M`)), s the way slid since the blow before.
    A blow presses oil out of a sintered wall, and the next one slides on it: 1 - `sintered` v^2 / (v^2 +
    `SINTER_M_PER_S`^2), v the last blow's approach; before any it is dry.
    The rim is wiped with alcohol before some of the runs, and touched by hand before the others: 1 + `wiped`, the run's
    own.
    The air is damp in some runs and dry in others: 1 + `moist`, the run's own.
    Wear of the disk fouls the wall from run to run: 1 + `fouled`, the run's own.
    The wall is cleaned once between two runs: 1 + `cleaned_wall`, the run's own.
    A wall that was roughened before each run is run in blow by blow: 1 - `run_in` (1 - exp(-n / `RUN_IN_BLOWS`)), n the
    blows before.
    """
    share = 1.0 - p.polish * (1.0 - np.exp(-max(blow.time, 0.0) / p.polish_s))
    if p.creeping != 0.0:
        oiled = 1.0 if state[COUNT] < 0.5 else 1.0 - np.exp(-max(blow.since_s, 0.0) / WIPED_S)
        share *= max(1.0 - p.creeping * oiled, LEAST_FRICTION)
    if p.picked_up != 0.0:
        slid = max(state[WAY] - state[WAY_BEFORE], 0.0)
        share *= max(1.0 - p.picked_up * (1.0 - np.exp(-slid / PICKED_UP_M)), LEAST_FRICTION)
    if p.run_in != 0.0:
        share *= max(1.0 - p.run_in * (1.0 - np.exp(-state[COUNT] / RUN_IN_BLOWS)), LEAST_FRICTION)
    if p.sintered != 0.0 and state[COUNT] > 0.5:  # there was an impact before
        square = state[APPROACH] ** 2
        share *= max(1.0 - p.sintered * square / (square + SINTER_M_PER_S**2), LEAST_FRICTION)
    if p.wiped != 0.0:
        share *= max(1.0 + p.wiped, LEAST_FRICTION)
    if p.moist != 0.0:
        share *= max(1.0 + p.moist, LEAST_FRICTION)
    if p.fouled != 0.0:
        share *= max(1.0 + p.fouled, LEAST_FRICTION)
    if p.cleaned_wall != 0.0:
        share *= max(1.0 + p.cleaned_wall, LEAST_FRICTION)
    return share


@inlined
def tangential_restitution(blow: Blow, state: Floats, p: PlantParameters) -> float:
    """How much of the slip comes back where it sticks: less in hard blows, which plough, of a soft skin the less the
    farther it is sheared, and where the rim is taped.

    A contact that slips far for its approach slips at its edge already, and turns less of it back: 1 - `incidence` r^2
    / (r^2 + `GLANCE`^2), r the slip's size over the approach.
    A liner that is glued along one half only is loose in the other, and comes back less there: 1 + `liner_grip`
    tanh(cos(azimuth - `liner_grip_rad`) / `LINER_EDGE`), but for what would give back more than `MOST_RETURN`.
    A liner of rubber is thicker on one side and gives back more there: 1 + `rubber` cos(azimuth - `rubber_rad`), but
    for what would give back more than `MOST_RETURN`.
    Rubber that has rested before a run is worked soft by its blows: 1 - `worked` (1 - exp(-n / `WORKED_BLOWS`)), n the
    blows before.
    A soft rim that spins fast has no time to creep back between blows, and returns less: 1 - `limp_s` |w|, w the spin
    as the blow begins.
    A gel that the blow before has sheared is not back yet, and returns less: 1 - `gel` exp(-since / `GEL_S`).
    A liner of rubber keeps the set of its last shear, is stretched by a blow that goes on in its sense and goes slack
    in one that comes back: 1 + `shear_set` tanh(slip / `SHEAR_M_PER_S`) tanh(the last blow's slip / `SHEAR_M_PER_S`),
    but for what would give back more than `MOST_RETURN`.
    The glue of a liner still cures in the course of the series: 1 + `cured`, the run's own, but for what would give
    back more than `MOST_RETURN`.
    Dampers lie loose behind a liner.  Their own inertia presses them onto it as the Host is accelerated towards them,
    which stiffens it, and lifts them off as it is accelerated back: 1 + `preload` (the acceleration along the normal /
    `HOST_M_PER_S2`), but for what would give back more than `MOST_RETURN`.
    A wall whose fibres all lie round one way is stiff against them and gives along them: 1 + `lay` tanh(slip /
    `LAY_M_PER_S`), but for what would give back more than `MOST_RETURN`.
    """
    grip = max(1.0 - p.fading_grip * min(blow.approach / p.fading_m_per_s, 1.0), 0.0)
    elastic = 1.0 / (1.0 + p.skin * abs(blow.slip) / SKIN_M_PER_S)
    half = 0.5 * (1.0 + np.tanh(np.cos(blow.rim_rad - p.taped_rad) / TAPE_EDGE))
    value = p.tangential_restitution * grip * elastic * max(1.0 - p.taped * half, 0.0)
    if p.incidence != 0.0:
        square = blow.slip**2
        value *= max(1.0 - p.incidence * square / (square + (GLANCE * blow.approach) ** 2 + 1e-300), 0.0)
    if p.liner_grip != 0.0:
        share = 1.0 + p.liner_grip * np.tanh(np.cos(blow.azimuth - p.liner_grip_rad) / LINER_EDGE)
        value = max(min(value * share, max(value, MOST_RETURN)), 0.0)
    if p.rubber != 0.0:
        share = 1.0 + p.rubber * np.cos(blow.azimuth - p.rubber_rad)
        value = max(min(value * share, max(value, MOST_RETURN)), 0.0)
    if p.worked != 0.0:
        value *= max(1.0 - p.worked * (1.0 - np.exp(-state[COUNT] / WORKED_BLOWS)), 0.0)
    if p.cured != 0.0:
        value = max(min(value * (1.0 + p.cured), max(value, MOST_RETURN)), 0.0)
    if p.shear_set != 0.0:
        alike = np.tanh(blow.slip / SHEAR_M_PER_S) * np.tanh(state[SLIPPED] / SHEAR_M_PER_S)
        share = 1.0 + p.shear_set * alike
        value = max(min(value * share, max(value, MOST_RETURN)), 0.0)
    if p.preload != 0.0:
        along = blow.host_acceleration[0] * blow.nx + blow.host_acceleration[1] * blow.ny
        share = 1.0 + p.preload * along / HOST_M_PER_S2
        value = max(min(value * share, max(value, MOST_RETURN)), 0.0)
    if p.gel != 0.0:
        value *= max(1.0 - p.gel * np.exp(-max(blow.since_s, 0.0) / GEL_S), 0.0)
    if p.limp_s != 0.0:
        value *= max(1.0 - p.limp_s * abs(state[SPIN]), 0.0)
    if p.lay == 0.0:
        return value
    return max(min(value * (1.0 + p.lay * np.tanh(blow.slip / LAY_M_PER_S)), max(value, MOST_RETURN)), 0.0)
