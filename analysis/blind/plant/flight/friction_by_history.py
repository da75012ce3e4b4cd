"""What the floor's coefficient of friction is multiplied by after what went before: ways, blows, time and runs."""

import numpy as np

from analysis.blind.plant.compiled import Floats, compiled, inlined
from analysis.blind.plant.flight.instant import Instant
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
    IMPACT_S,
    LEFT,
    OILED,
    WAY,
    WAY_BEFORE,
)

DROP_M = 0.01  # from a drop's middle to where it wets half as well: it is as wide as the disk
SOAK_S = 0.01  # in which a disk over the middle of a drop is wetted
WIPE_M = 0.06  # way on which it loses what it has taken up: most of a flight
CLING_M = 0.08  # way on which most of the charge that a disk can hold would gather
CLING_S = 0.08  # in which it leaks off: one or two flights
RATTLED_S = 0.03  # in which a disk comes to rest that a blow has set rattling on its floor: half a flight
SPECK_S = 3e-3  # within which a speck gets under the disk: no step for the integrator
DEBRIS_M = 0.03  # way on which most of what a blow has knocked loose is left behind
AGE_S = 0.05  # in which contacts of a disk at rest would gain most of their strength: a flight
AGE_M = 0.02  # way on which they are broken and made anew
BEADS_M = 0.03  # way on which beads turn to the disk's new direction: half of a flight
FLOATS_M_PER_S, SINKS_M_PER_S = 1.4, 0.7  # slip that raises a film below the disk; slip at which it breaks down
FLOAT_S = 2e-3  # in which either happens: no step for the integrator
ROLLING_S = 0.03  # of a stretch in which a grain may roll under the disk: half a flight
ROLLING_EDGE = 0.1  # of a stretch, within which a grain gets in or out: no step for the integrator
ROLLING_SHARE = 0.3  # of the stretches of a run
PRIMED_M_PER_S = 0.9  # speed after a blow with which a disk raises as much of a film as on the mean
SPUN_OUT_RAD = 3.0  # turn of a disk that throws two thirds of its dust out


@inlined
def by_history(at: Instant, p: PlantParameters) -> float:
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
    Beads of wax roll along with the disk until it goes another way: 1 + `beads` (1 - the share of the way just slid
    that had the slip's direction (`add_beads`)) / 2.
    Debris gathers under the disk and breaks off each time it has gone `clogged_m`: 1 + `clogged` (2 q - 1), q the
    share of that way since then.
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
    share = _of_the_run(share, at, p)
    if p.glazed != 0.0:
        share *= np.exp(-p.glazed * state[BLOWS])
    if p.strewn != 0.0:
        share *= 1.0 + p.strewn * state[BLOWS]
    return share * (1.0 + p.clinging * state[CHARGE]) * (1.0 + p.aged * state[AGED])


@inlined
def _of_the_run(share: float, at: Instant, p: PlantParameters) -> float:
    """`share` times what each run has of its own.

    The floor is cleaned with alcohol before one of the runs, and rubs more from then on: 1 + `cleaned`.
    The washer is put in by hand before each run, its ground face down or its rolled one: 1 + `turned`.
    The air of the room is more and less humid in the course of a day: 1 + `humid`.
    The washer's face is damp as a run begins, and rubs itself dry: 1 + `damp` exp(-t / `damp_s`), t the run's time.
    Dust settles until somebody wipes it off: 1 + `dusted`.
    The bench warms in the course of a day: 1 + `bench`.
    """
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
    return share


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
