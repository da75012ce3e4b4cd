"""What the causes of `causes.undreamt` do to the plant's equations."""

import numpy as np

from analysis.blind.plant.compiled import Floats, compiled
from analysis.blind.plant.state import PlantParameters

HOST_M_PER_S2 = 78.5  # 8 g of the Host: what goes with its acceleration is stated for that
MAT_S = 0.04  # in which a soft floor forgets where the disk stood: most of a flight
SLEEVE_S = 0.06  # in which a sleeve comes to rest: about the time from blow to blow
TIRED_S = 0.12  # in which a liner recovers: two or three blows
RIM_POINTS = 24  # around a burr: the friction of their mean is within 1 % of a circle's
LEANING_PARTS = 8  # in which the floor takes its share of one blow: its friction turns with the slip


@compiled
def rim_traction(
    traction: tuple[float, float, float], slip_x: float, slip_y: float, spin: float, p: PlantParameters
) -> tuple[float, float, float]:
    """The floor's traction (force in units of mu N along the slip, torque / R) of a disk that stands with a share of
    its weight on a burr around its rim; `spin` against the floor."""
    if p.burr == 0.0:
        return traction
    share, along_x, along_y, turn = min(p.burr, 1.0), 0.0, 0.0, 0.0
    for k in range(RIM_POINTS):
        c, s = np.cos(2.0 * np.pi * k / RIM_POINTS), np.sin(2.0 * np.pi * k / RIM_POINTS)
        ux, uy = slip_x - p.disk_radius_m * spin * s, slip_y + p.disk_radius_m * spin * c
        speed = np.sqrt(ux * ux + uy * uy) + 1e-300
        held = np.tanh(speed / p.smoothing_m_per_s) / speed / RIM_POINTS
        along_x, along_y, turn = along_x + held * ux, along_y + held * uy, turn + held * (c * uy - s * ux)
    rest = 1.0 - share
    return (
        rest * traction[0] + share * along_x,
        rest * traction[1] + share * along_y,
        rest * traction[2] + share * turn,
    )


@compiled
def undreamt_load(
    time: float, state: Floats, position: Floats, velocity: Floats, acceleration: Floats, p: PlantParameters
) -> float:
    """The floor's load per unit mass, not negative: of a Host whose springs lead it along an arc, and under a disk that
    the last blow has tossed up, as long again twice as much where it lands."""
    load = p.load_m_per_s2 + acceleration[3]
    if p.arc_per_m != 0.0:
        load += p.arc_per_m * (velocity[0] ** 2 + position[0] * acceleration[0])
    load = max(load, 0.0)
    if p.toss > 0.0:
        late, up_s = time - state[6], 2.0 * p.toss * state[15] / p.load_m_per_s2
        if 0.0 <= late < 2.0 * up_s:
            load *= 0.0 if late < up_s else 2.0
    return load


@compiled
def undreamt_friction(angle: float, p: PlantParameters) -> float:
    """What the floor's friction is multiplied by at this `angle` of the disk."""
    return 1.0 + p.brushed * np.cos(2.0 * (angle - p.brushed_rad))


@compiled
def add_undreamt_forces(
    x: float, y: float, slip: tuple[float, float], state: Floats, acceleration: Floats, p: PlantParameters, out: Floats
) -> None:
    """Forces and torques that come on top; x, y and slip against the Host, `acceleration` the Host's."""
    if p.enclosed_per_m != 0.0:
        rate = p.enclosed_per_m * np.sqrt(slip[0] ** 2 + slip[1] ** 2)
        out[2] -= rate * slip[0]
        out[3] -= rate * slip[1]
    if p.alternating_rad_per_s2 != 0.0:
        current = acceleration[0] / HOST_M_PER_S2
        out[5] += p.alternating_rad_per_s2 * current * np.sin(p.alternating_rad - state[4])
    if p.mat_per_s2 != 0.0:
        behind_x, behind_y = x - state[18], y - state[19]
        out[2] -= p.mat_per_s2 * behind_x
        out[3] -= p.mat_per_s2 * behind_y
        out[18], out[19] = behind_x / MAT_S, behind_y / MAT_S


@compiled
def tiredness(time: float, state: Floats) -> float:
    """Of a liner that has not recovered from the blows before: the sum of their squared speeds, each as it is left."""
    return state[16] * np.exp(-max(time - state[6], 0.0) / TIRED_S)


@compiled
def sleeve_speed(time: float, state: Floats, p: PlantParameters) -> float:
    """How fast the surface of a loose sleeve still goes round (m/s, counterclockwise)."""
    return 0.0 if p.sleeve == 0.0 else state[17] * np.exp(-max(time - state[6], 0.0) / SLEEVE_S)


@compiled
def mount_gives(nx: float, ny: float, p: PlantParameters) -> tuple[float, float, float]:
    """What a mount that gives along one line adds to the contact's compliance: normal, tangential, between them."""
    c, s = np.cos(p.mount_rad), np.sin(p.mount_rad)
    along_n, along_t = c * nx + s * ny, -c * ny + s * nx
    return p.mount * along_n**2, p.mount * along_t**2, p.mount * along_n * along_t


@compiled
def band_slips(
    push_n: float, push_t: float, change_n: float, w_nn: float, w_nt: float, p: PlantParameters
) -> tuple[float, float]:
    """Both impulses where a band around the disk's rim slips on it: beyond `band_m_per_s` it hands on no more."""
    if p.band_m_per_s == 0.0 or abs(push_t) <= p.band_m_per_s:
        return push_n, push_t
    most = p.band_m_per_s if push_t > 0.0 else -p.band_m_per_s
    return (change_n - w_nt * most) / w_nn, most


@compiled
def press_down(new: Floats, push_n: float, arm: tuple[float, float], host_velocity: Floats, p: PlantParameters) -> None:
    """A wall that leans over the disk presses it down where it strikes: there, at `arm` from its centre of mass, the
    floor's friction takes its share of the blow `push_n` (m/s) from the slip that the blow has left."""
    part = p.leaning * p.floor_friction * abs(push_n) / LEANING_PARTS
    for _ in range(LEANING_PARTS):
        ux = new[2] - new[5] * arm[1] - host_velocity[0]
        uy = new[3] + new[5] * arm[0] - host_velocity[1]
        speed = np.sqrt(ux * ux + uy * uy) + 1e-300
        held = min(part / speed, 1.0 / 3.0)  # along the tangent a point of the rim has a third of the mass: no reversal
        new[2] -= held * ux
        new[3] -= held * uy
        new[5] -= held * (arm[0] * uy - arm[1] * ux) / (p.inertia_factor * p.disk_radius_m**2)


@compiled
def tyre_at(angle: float, p: PlantParameters) -> tuple[float, float]:
    """From the disk's middle to that of its rim (x, y), `angle` the disk's."""
    return p.tyre_m * np.cos(angle + p.tyre_rad), p.tyre_m * np.sin(angle + p.tyre_rad)
