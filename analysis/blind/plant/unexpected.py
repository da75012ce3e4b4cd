"""What the causes of `causes.unexpected` do to the plant's equations."""

import numpy as np

from analysis.blind.plant.compiled import Floats, compiled
from analysis.blind.plant.state import PlantParameters
from analysis.blind.plant.unimagined import BEST_REBOUND

HOST_M_PER_S = 1.136  # the Host's full speed at 8 g and 11 Hz: what goes with its speed is stated for that
DROP_M = 0.01  # from a drop's middle to where it wets half as well: it is as wide as the disk
SOAK_S = 0.01  # in which a disk over the middle of a drop is wetted
WIPE_M = 0.06  # way on which it loses what it has taken up: most of a flight
CHARGE_M = 0.03  # way on which most of the charge that a disk can hold has gathered
WOBBLE_S = 0.04  # in which a wobble dies out: most of a flight
SHINGLE_M_PER_S = 0.4  # slip from which on a blow meets the edges of shingles squarely
PILE_M_PER_S = 0.3  # slip from which on a pile is laid over the whole way
LEAST_FRICTION = 0.02  # share of the wall's friction that is always left


@compiled
def unexpected_friction(
    slip: tuple[float, float], spin: float, state: Floats, host_velocity: Floats, p: PlantParameters
) -> float:
    """What the floor's friction is multiplied by; `slip` (m/s) and `spin` (rad/s) over the floor.

    A disk that has been through a drop of oil carries some of it, `state[22]` of what it can hold: it loses `drop` of
    its friction times that.
    An edge bevelled at one side lifts over the floor where it leads and ploughs where it trails: 1 + `bevel` cos(the
    slip's direction - the disk's angle - `bevel_rad`), less as the rim goes round faster than the disk slides.
    Worn bearings of the Host's guide rumble and shake the load off the floor: 1 - `rumble` (its speed /
    `HOST_M_PER_S`)^2.
    """
    share = max(1.0 - p.drop * state[22], 0.0)
    if p.bevel != 0.0:
        rim = p.disk_radius_m * spin
        speed = np.sqrt(slip[0] ** 2 + slip[1] ** 2 + rim**2) + p.smoothing_m_per_s
        leads = slip[0] * np.cos(state[4] + p.bevel_rad) + slip[1] * np.sin(state[4] + p.bevel_rad)
        share *= max(1.0 + p.bevel * leads / speed, 0.0)
    if p.rumble != 0.0:
        share *= max(1.0 - p.rumble * (host_velocity[0] ** 2 + host_velocity[1] ** 2) / HOST_M_PER_S**2, 0.0)
    return share


@compiled
def add_oil(x: float, y: float, slip: tuple[float, float], state: Floats, p: PlantParameters, out: Floats) -> None:
    """What a disk carries of a drop (0 to 1): over it, by a bell of `DROP_M` around (`drop_x_m`, `drop_y_m`) of the
    Host's floor, it takes up what it lacks within `SOAK_S`; it loses it along the way slid, over `WIPE_M`."""
    if p.drop != 0.0:
        far = ((x - p.drop_x_m) ** 2 + (y - p.drop_y_m) ** 2) / DROP_M**2
        out[22] = np.exp(-0.5 * far) * (1.0 - state[22]) / SOAK_S
        out[22] -= np.sqrt(slip[0] ** 2 + slip[1] ** 2) * state[22] / WIPE_M


@compiled
def add_charge(x: float, y: float, state: Floats, p: PlantParameters, out: Floats) -> None:
    """Sliding charges a disk, and the metal ring draws it outwards; a blow discharges it: `charged_per_s2` (x, y)
    (1 - exp(-s / `CHARGE_M`)), s the way slid since the last blow."""
    if p.charged_per_s2 != 0.0:
        pull = p.charged_per_s2 * (1.0 - np.exp(-max(state[8] - state[20], 0.0) / CHARGE_M))
        out[2] += pull * x
        out[3] += pull * y


@compiled
def add_wobble(time: float, state: Floats, p: PlantParameters, out: Floats) -> None:
    """A blow makes a washer wobble like a coin: where it stands goes round, and it is pushed towards there.

    A time t after a blow with the approach v it is pushed by `wobble_per_s` v exp(-t / `WOBBLE_S`), at first along the
    blow's normal, then turned from it by `wobble_rad_per_s` t.
    """
    late = time - state[6]
    if p.wobble_per_s != 0.0 and state[13] > 0.5 and late >= 0.0:
        push = p.wobble_per_s * state[15] * np.exp(-late / WOBBLE_S)
        turned = state[14] + p.wobble_rad_per_s * late
        out[2] += push * np.cos(turned)
        out[3] += push * np.sin(turned)


@compiled
def add_unexpected_forces(
    time: float, x: float, y: float, slip: tuple[float, float], state: Floats, p: PlantParameters, out: Floats
) -> None:
    """All that comes on top of the floor's friction; x, y (m) from the Host's centre, `slip` (m/s) over the floor.

    A face turned on a lathe has a spiral groove, which turns the disk like a screw as it slides: `spiral_rad_per_s2`
    (slip / 1 m/s), whatever the slip's direction.
    """
    add_oil(x, y, slip, state, p, out)
    add_charge(x, y, state, p, out)
    add_wobble(time, state, p, out)
    out[5] += p.spiral_rad_per_s2 * np.sqrt(slip[0] ** 2 + slip[1] ** 2)


@compiled
def unexpected_rebound(rebound: float, slip: float, normal_rad: float, state: Floats, p: PlantParameters) -> float:
    """Restitution of this impact, which was `rebound`; nothing here raises it above `BEST_REBOUND`.

    A liner wound with overlaps lies like shingles: a blow that runs against their edges loses what one that runs with
    them wins, `shingled` tanh(slip / `SHINGLE_M_PER_S`).
    A weight rattles in the washer's hole and lies where the last blow has left it.  From the same side a blow meets it
    at once, from the opposite one it comes late and deadens the rebound: `rattling` cos(this normal - the last one's).
    """
    gain = -p.shingled * np.tanh(slip / SHINGLE_M_PER_S)
    if p.rattling != 0.0 and state[13] > 0.5:
        gain += p.rattling * np.cos(normal_rad - state[14])
    return min(rebound + gain, max(rebound, BEST_REBOUND))


@compiled
def unexpected_slide(rim_rad: float, slip: float, state: Floats, p: PlantParameters) -> float:
    """What the wall's friction is multiplied by; `rim_rad`: the struck place, in the disk.

    A wall of velvet has a pile that each blow lays over: 1 - `combed` tanh(slip / `PILE_M_PER_S`) tanh(the last blow's
    slip / `PILE_M_PER_S`), less along the pile and more against it.
    The markers' glue has run over one side of the rim: 1 + `glued` cos(`rim_rad` - `glued_rad`).
    """
    share = 1.0
    if p.combed != 0.0:
        laid = np.tanh(state[23] / PILE_M_PER_S)
        share *= max(1.0 - p.combed * np.tanh(slip / PILE_M_PER_S) * laid, LEAST_FRICTION)
    if p.glued != 0.0:
        share *= max(1.0 + p.glued * np.cos(rim_rad - p.glued_rad), LEAST_FRICTION)
    return share


@compiled
def swinging_speed(host_velocity: Floats, p: PlantParameters) -> float:
    """How fast the wall's surface goes round (m/s, counterclockwise): a ring that is heavier at one side and can turn
    in its seat swings with the Host, by `swinging_m_per_s` at `HOST_M_PER_S` along `swinging_rad`."""
    along = host_velocity[0] * np.cos(p.swinging_rad) + host_velocity[1] * np.sin(p.swinging_rad)
    return p.swinging_m_per_s * along / HOST_M_PER_S


@compiled
def orbit(time: float, p: PlantParameters) -> tuple[float, float]:
    """How far a ring is off (x, y) that rolls round in a seat too wide for it, as the drive shakes it: by `orbit_m`
    towards `orbit_rad` + `orbit_rad_per_s` times the time in the run."""
    at = p.orbit_rad + p.orbit_rad_per_s * time
    return p.orbit_m * np.cos(at), p.orbit_m * np.sin(at)


@compiled
def orbiting(time: float, p: PlantParameters) -> tuple[float, float]:
    """How fast it does so (x, y)."""
    x, y = orbit(time, p)
    return -p.orbit_rad_per_s * y, p.orbit_rad_per_s * x
