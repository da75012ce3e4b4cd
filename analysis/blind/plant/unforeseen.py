"""What the causes of `causes.unforeseen` do to the plant's equations."""

import numpy as np

from analysis.blind.plant.compiled import Floats, compiled
from analysis.blind.plant.state import PlantParameters

CUSHION_M = 0.008  # from the wall, within which the air between it and the disk falls off
COIL_AT_M_PER_S2 = 78.5  # 8 g of the Host, where the coil pulls by `coil_m_per_s2`
GRAIN_AT_M = 0.007  # from the disk's middle, of its 10 mm
THREAD_M, THREAD_S = 0.015, 0.03  # a thread of glue breaks at this length, and lets go by itself after this time
THREAD_EDGE_M = 5e-4  # length within which it becomes taut: no step for the integrator
EDGE = 0.2  # of the cosine around the rim, within which one half of it goes over into the other
JOINT_RAD = 0.08  # of the wall's azimuth, over which a strip's ends overlap: 3 mm


@compiled
def grain_traction(
    traction: tuple[float, float, float],
    slip_x: float,
    slip_y: float,
    spin: float,
    angle: float,
    p: PlantParameters,
) -> tuple[float, float, float]:
    """The floor's traction (force in units of mu N along the slip, torque / R) of a disk that stands with a share of
    its weight on one grain; `spin` against the floor, `angle` the disk's."""
    if p.grain == 0.0:
        return traction
    arm_x, arm_y = GRAIN_AT_M * np.cos(angle + p.grain_rad), GRAIN_AT_M * np.sin(angle + p.grain_rad)
    ux, uy = slip_x - spin * arm_y, slip_y + spin * arm_x
    speed = np.sqrt(ux * ux + uy * uy) + 1e-300
    held = np.tanh(speed / p.smoothing_m_per_s) / speed
    ux, uy = held * ux, held * uy
    rest = 1.0 - p.grain
    return (
        rest * traction[0] + p.grain * ux,
        rest * traction[1] + p.grain * uy,
        rest * traction[2] + p.grain * (arm_x * uy - arm_y * ux) / p.disk_radius_m,
    )


@compiled
def friction_of_flight(count: float, p: PlantParameters) -> float:
    """What the floor's friction is multiplied by in the flight after so many impacts: drawn evenly, of mean 1 and
    standard deviation `grit`, anew after each; `grit_draw` (0 to 1) is the run's own."""
    if p.grit == 0.0:
        return 1.0
    drawn = np.sin(12.9898 * (count + 1.0) + 78.233 * p.grit_draw) * 43758.5453
    return max(1.0 + p.grit * np.sqrt(3.0) * (2.0 * (drawn - np.floor(drawn)) - 1.0), 0.05)


@compiled
def add_unforeseen_forces(
    time: float, x: float, y: float, slip: tuple[float, float], state: Floats, p: PlantParameters, out: Floats
) -> None:
    """Forces near the wall; x, y and slip against the Host."""
    if p.cushion_per_s != 0.0:
        radius = np.sqrt(x * x + y * y) + 1e-12
        rate = p.cushion_per_s * np.exp((radius - p.contact_radius_m) / CUSHION_M)
        radial = rate * (slip[0] * x + slip[1] * y) / radius
        out[2] -= radial * x / radius
        out[3] -= radial * y / radius
    late = time - state[6]
    if p.thread_m_per_s2 != 0.0 and state[13] > 0.5 and 0.0 <= late < THREAD_S:
        back_x = p.contact_radius_m * np.cos(state[12]) - x
        back_y = p.contact_radius_m * np.sin(state[12]) - y
        length = np.sqrt(back_x**2 + back_y**2) + 1e-12
        if length < THREAD_M:
            pull = p.thread_m_per_s2 * np.tanh(length / THREAD_EDGE_M) / length
            out[2] += pull * back_x
            out[3] += pull * back_y


@compiled
def add_coil(acceleration: Floats, p: PlantParameters, out: Floats) -> None:
    """The shaker's coil draws a steel disk with the square of its current, as of the Host's `acceleration`."""
    if p.coil_m_per_s2 != 0.0:
        pull = p.coil_m_per_s2 * (acceleration[0] ** 2 + acceleration[1] ** 2) / COIL_AT_M_PER_S2**2
        out[2] += pull * np.cos(p.coil_rad)
        out[3] += pull * np.sin(p.coil_rad)


@compiled
def edge_gain(count: float, p: PlantParameters) -> float:
    """Restitution won in this impact: the upper edge strikes in turn with the lower one; `count` impacts before."""
    return p.two_edges if count % 2.0 < 0.5 else -p.two_edges


@compiled
def taped_grip(rim: float, p: PlantParameters) -> float:
    """Factor of the tangential restitution where `rim`, an azimuth in the disk, meets the wall."""
    half = 0.5 * (1.0 + np.tanh(np.cos(rim - p.taped_rad) / EDGE))
    return max(1.0 - p.taped * half, 0.0)


@compiled
def rolled(spin: float, push_n: float, host_spin: float, p: PlantParameters) -> float:
    """Spin after the wall's contact has resisted it, in proportion to the blow `push_n` (m/s) and at most to rest."""
    against = spin - host_spin
    most = p.rolling_arm_m * abs(push_n) / (p.inertia_factor * p.disk_radius_m**2)
    return host_spin + (max(against - most, 0.0) if against > 0.0 else min(against + most, 0.0))


@compiled
def joint_reach(azimuth: float, p: PlantParameters) -> tuple[float, float]:
    """How much farther the disk's middle gets along `azimuth` in a ring bent of a strip whose ends overlap, and the
    slope of that (m, m per rad)."""
    away = np.arctan2(np.sin(azimuth - p.joint_rad), np.cos(azimuth - p.joint_rad))
    edge = np.tanh(away / JOINT_RAD)
    return (
        p.joint_m * (0.5 * edge - away / (2.0 * np.pi)),
        p.joint_m * (0.5 * (1.0 - edge**2) / JOINT_RAD - 1.0 / (2.0 * np.pi)),
    )
