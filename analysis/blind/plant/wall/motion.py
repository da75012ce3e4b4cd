"""Where the wall lies in the Host and how it moves there: set aside, slipping, trailing, swinging, squashed,
leaking, turning, humming."""

import numpy as np

from analysis.blind.plant.compiled import Floats, compiled, inlined
from analysis.blind.plant.host import HOST_M, HOST_M_PER_S, HOST_M_PER_S2, Four, jerk_of
from analysis.blind.plant.parameters import PlantParameters
from analysis.blind.plant.state import (
    BLOWS,
    COUNT,
    IMPACT_S,
    NOD_VX,
    NOD_VY,
    NOD_X,
    NOD_Y,
    NORMAL,
    SLEEVE,
    TIRED,
    WALK_X,
    WALK_Y,
)

SLEEVE_S = 0.06  # in which a sleeve comes to rest: about the time from blow to blow
TIRED_S = 0.12  # in which a liner recovers: two or three blows
PLAY_M_PER_S2 = 20.0  # acceleration of the Host that throws a ring to three quarters of its play: two g
NOD_S = 0.05  # in which a wall's swing dies out: about a flight
JERK_WITHIN_S = 5e-3  # in which a ring that slips at once has gone three quarters of its way
DRAG_M_PER_S = 0.2  # speed of the Host that leaves a ring which drags in its seat at three quarters of its play
HUM_M_PER_S = 0.2  # approach from which on a blow meets a humming wall as it just moves: a slower one lasts longer
RECEDING_BLOWS = 8.0  # after which a wall that recedes lies where it does on the mean of a run
LEAK_M2_PER_S2 = 3.0  # squared approaches that press half of its air out of a liner

Vector = tuple[float, float]


@inlined
def wall_offset(
    time: float, state: Floats, position: Four, velocity: Four, acceleration: Four, p: PlantParameters
) -> tuple[float, float]:
    """How far the wall is off its place (x, y in m), beside what it is mounted off: refitted, crept, bolted on anew, on
    springs, with play, on one screw, pushed by the last blow, slipping, jerked, tugged, trailing, dragging, rolling
    round, swinging; of the Host's `position`, `velocity` and `acceleration`.

    A ring whose screws slip goes a step of `walked_m` along the normal with each blow that is no mere touch, and stays
    there; before each run it is put back.
    """
    x, y = p.refit_x_m + p.crept_x_m, p.refit_y_m + p.crept_y_m
    x, y = x + p.rebolted_x_m, y + p.rebolted_y_m
    if p.springy_m != 0.0:
        x -= p.springy_m * acceleration[0] / HOST_M_PER_S2
        y -= p.springy_m * acceleration[1] / HOST_M_PER_S2
    if p.play_m != 0.0:
        x += _thrown(acceleration, p)
    if p.hinged_m != 0.0:
        off_x, off_y = _hinged(acceleration, p)
        x, y = x + off_x, y + off_y
    if p.loose_ring_m != 0.0 and state[COUNT] > 0.5:  # there was an impact before
        x, y = x + p.loose_ring_m * np.cos(state[NORMAL]), y + p.loose_ring_m * np.sin(state[NORMAL])
    if p.walked_m != 0.0:
        x, y = x + p.walked_m * state[WALK_X], y + p.walked_m * state[WALK_Y]
    if p.slipping_m != 0.0:
        off_x, off_y = _slipped(time, p)
        x, y = x + off_x, y + off_y
    if p.jerked_m != 0.0:
        way = p.jerked_m * np.tanh(_after_jerk(time, p))
        x, y = x + way * np.cos(p.jerked_rad), y + way * np.sin(p.jerked_rad)
    if p.dragging_m != 0.0:
        x += _dragged(velocity, p)
    if p.tugged_m != 0.0:
        off_x, off_y = _tugged(position, p)
        x, y = x + off_x, y + off_y
    if p.trailing_m != 0.0:
        off_x, off_y = _trailing(velocity, p)
        x, y = x + off_x, y + off_y
    if p.orbit_m != 0.0:
        off_x, off_y = _orbit(time, p)
        x, y = x + off_x, y + off_y
    if p.nodding != 0.0:
        off_x, off_y, _, _ = swing(time, state, p)
        x, y = x + p.nodding * off_x, y + p.nodding * off_y
    return x, y


@compiled
def wall_velocity(
    time: float, state: Floats, velocity: Four, acceleration: Four, p: PlantParameters, host: Floats
) -> tuple[float, float]:
    """How fast the wall moves in the Host (x, y in m/s): the rate of `wall_offset` between two blows."""
    x, y = 0.0, 0.0
    if p.springy_m != 0.0:
        jerk = jerk_of(time, host)
        x -= p.springy_m * jerk[0] / HOST_M_PER_S2
        y -= p.springy_m * jerk[1] / HOST_M_PER_S2
    if p.play_m != 0.0:
        left = 1.0 - (_thrown(acceleration, p) / p.play_m) ** 2
        x -= p.play_m * left * jerk_of(time, host)[0] / PLAY_M_PER_S2
    if p.hinged_m != 0.0:
        moves_x, moves_y = _hinged(jerk_of(time, host), p)
        x, y = x + moves_x, y + moves_y
    if p.slipping_m != 0.0:
        speed = 2.0 * p.slipping_m / p.duration_s
        x, y = x + speed * np.cos(p.slipping_rad), y + speed * np.sin(p.slipping_rad)
    if p.jerked_m != 0.0:
        speed = p.jerked_m / JERK_WITHIN_S * (1.0 - np.tanh(_after_jerk(time, p)) ** 2)
        x, y = x + speed * np.cos(p.jerked_rad), y + speed * np.sin(p.jerked_rad)
    if p.dragging_m != 0.0:
        left = 1.0 - (_dragged(velocity, p) / p.dragging_m) ** 2
        x -= p.dragging_m * left * acceleration[0] / DRAG_M_PER_S
    if p.tugged_m != 0.0:
        moves_x, moves_y = _tugged(velocity, p)
        x, y = x + moves_x, y + moves_y
    if p.trailing_m != 0.0:
        moves_x, moves_y = _trailing(acceleration, p)
        x, y = x + moves_x, y + moves_y
    if p.orbit_m != 0.0:
        off_x, off_y = _orbit(time, p)
        x, y = x - p.orbit_rad_per_s * off_y, y + p.orbit_rad_per_s * off_x
    if p.nodding != 0.0:
        _, _, moves_x, moves_y = swing(time, state, p)
        x, y = x + p.nodding * moves_x, y + p.nodding * moves_y
    return x, y


@inlined
def _thrown(acceleration: Four, p: PlantParameters) -> float:
    """How far a ring is off along x that has play in its seat there, between two stops: it is thrown to the one that
    the Host's acceleration leaves it at, by -`play_m` tanh(acceleration along x / `PLAY_M_PER_S2`)."""
    return -p.play_m * np.tanh(acceleration[0] / PLAY_M_PER_S2)


@inlined
def _hinged(rate: Four, p: PlantParameters) -> Vector:
    """How far a ring is off that is screwed down at one side only, and gives about that screw: along `hinged_rad`, by
    `hinged_m` at `HOST_M_PER_S2` of the Host's acceleration along it.  Of its jerk it is the ring's own speed."""
    c, s = np.cos(p.hinged_rad), np.sin(p.hinged_rad)
    back = -p.hinged_m * (rate[0] * c + rate[1] * s) / HOST_M_PER_S2
    return back * c, back * s


@inlined
def _slipped(time: float, p: PlantParameters) -> Vector:
    """How far a ring has slipped in its clamps: from one side of its place to the other in a run."""
    way = p.slipping_m * (2.0 * time / p.duration_s - 1.0)
    return way * np.cos(p.slipping_rad), way * np.sin(p.slipping_rad)


@inlined
def _after_jerk(time: float, p: PlantParameters) -> float:
    """How long ago (in `JERK_WITHIN_S`) a ring has slipped all at once, from `jerked_m` to one side of its place to as
    far to the other: after the share `jerked_share` of the run; before the next it is put back."""
    return (time - p.jerked_share * p.duration_s) / JERK_WITHIN_S


@inlined
def _tugged(rate: Four, p: PlantParameters) -> Vector:
    """How far a ring on soft screws is off that a cable to the room pulls back like a spring: by `tugged_m` at `HOST_M`
    of the Host's way from its middle, against it.  Of the Host's velocity it is the ring's own speed."""
    return -p.tugged_m * rate[0] / HOST_M, -p.tugged_m * rate[1] / HOST_M


@inlined
def _trailing(rate: Four, p: PlantParameters) -> Vector:
    """How far a ring on thick soft tape is off: it trails behind the Host's velocity, by `trailing_m` at
    `HOST_M_PER_S`.  Of the Host's acceleration, in place of its velocity, it is the ring's own speed."""
    return -p.trailing_m * rate[0] / HOST_M_PER_S, -p.trailing_m * rate[1] / HOST_M_PER_S


@inlined
def _dragged(velocity: Four, p: PlantParameters) -> float:
    """How far a ring is off along x that has play in its seat there and that something in the room drags back: it lies
    on the side that the Host comes from, by -`dragging_m` tanh(velocity along x / `DRAG_M_PER_S`)."""
    return -p.dragging_m * np.tanh(velocity[0] / DRAG_M_PER_S)


@inlined
def _orbit(time: float, p: PlantParameters) -> Vector:
    """How far a ring is off that rolls round in a seat too wide for it, as the drive shakes it: by `orbit_m` towards
    `orbit_rad` + `orbit_rad_per_s` times the time in the run."""
    at = p.orbit_rad + p.orbit_rad_per_s * time
    return p.orbit_m * np.cos(at), p.orbit_m * np.sin(at)


@inlined
def swing(time: float, state: Floats, p: PlantParameters) -> tuple[float, float, float, float]:
    """How far a ring on rubber feet has swung (x, y in m) and how fast it does (m/s) if it is as heavy as the disk.

    Each blow gives it the opposite of what the disk gets; it swings at `nodding_rad_per_s` and dies out within `NOD_S`.
    """
    late = max(time - state[IMPACT_S], 0.0)
    rate, omega = 1.0 / NOD_S, p.nodding_rad_per_s
    left = np.exp(-rate * late)
    c, s = left * np.cos(omega * late), left * np.sin(omega * late) / omega
    stiff = omega**2 + rate**2
    return (
        c * state[NOD_X] + s * (state[NOD_VX] + rate * state[NOD_X]),
        c * state[NOD_Y] + s * (state[NOD_VY] + rate * state[NOD_Y]),
        c * state[NOD_VX] - s * (stiff * state[NOD_X] + rate * state[NOD_VX]),
        c * state[NOD_VY] - s * (stiff * state[NOD_Y] + rate * state[NOD_VY]),
    )


@inlined
def squashed(azimuth: float, acceleration: Four, p: PlantParameters) -> Vector:
    """How much farther the disk's middle gets along `azimuth` in a ring that the Host's `acceleration` squashes, and
    the slope of that (m, m per rad); of the Host's jerk the first is the wall's own speed."""
    start = acceleration[0] * np.cos(p.squash_rad) + acceleration[1] * np.sin(p.squash_rad)
    size, turned = p.squash_m * start / HOST_M_PER_S2, 2.0 * (azimuth - p.squash_rad)
    return size * np.cos(turned), -2.0 * size * np.sin(turned)


@inlined
def leaked(time: float, state: Floats, p: PlantParameters) -> float:
    """How much farther the disk's middle gets (m) in a ring with a liner full of air, which blows press out through a
    narrow hole and a pump brings back: `leaking_m` (w - `LEAK_M2_PER_S2`) / (w + `LEAK_M2_PER_S2`), w the sum of the
    squared approaches of the blows before, each as it is left (`tiredness`)."""
    if p.leaking_m == 0.0:
        return 0.0
    pressed = tiredness(time, state)
    return p.leaking_m * (pressed - LEAK_M2_PER_S2) / (pressed + LEAK_M2_PER_S2)


@inlined
def receded(state: Floats, p: PlantParameters) -> float:
    """How much farther the disk's middle gets (m) in a ring of which each blow takes off as much: `receding_m`
    (n - `RECEDING_BLOWS`), n the blows before."""
    return p.receding_m * (state[BLOWS] - RECEDING_BLOWS)


@inlined
def tiredness(time: float, state: Floats) -> float:
    """Of a liner that has not recovered from the blows before: the sum of their squared speeds, each as it is left."""
    return state[TIRED] * np.exp(-max(time - state[IMPACT_S], 0.0) / TIRED_S)


@inlined
def sleeve_speed(time: float, state: Floats, p: PlantParameters) -> float:
    """How fast the surface of a loose sleeve still goes round after the blow before (m/s, counterclockwise)."""
    return 0.0 if p.sleeve == 0.0 else state[SLEEVE] * np.exp(-max(time - state[IMPACT_S], 0.0) / SLEEVE_S)


@inlined
def swinging_speed(host_velocity: Four, p: PlantParameters) -> float:
    """How fast the surface of a ring goes round (m/s, counterclockwise) that is heavier at one side and can turn in its
    seat: it swings with the Host, by `swinging_m_per_s` at `HOST_M_PER_S` along `swinging_rad`."""
    along = host_velocity[0] * np.cos(p.swinging_rad) + host_velocity[1] * np.sin(p.swinging_rad)
    return p.swinging_m_per_s * along / HOST_M_PER_S


@inlined
def humming(time: float, approach: float, normal_rad: float, p: PlantParameters) -> Vector:
    """How fast the wall of a ring that hums, as a bearing's race does, moves along a blow's normal and along its
    tangent (m/s).

    Along `hum_rad` at `hum_m_per_s` sin(`hum_rad_per_s` t + `hum_phase_rad`), t the time in the run, for blows well
    above `HUM_M_PER_S`; its way, of about a tenth of a millimetre, is left out.
    """
    if p.hum_m_per_s == 0.0:
        return 0.0, 0.0
    speed = p.hum_m_per_s * np.sin(p.hum_rad_per_s * time + p.hum_phase_rad) * np.tanh(approach / HUM_M_PER_S)
    return speed * np.cos(p.hum_rad - normal_rad), speed * np.sin(p.hum_rad - normal_rad)
