"""What the causes of `causes.newest` do to the plant's equations."""

import numpy as np

from analysis.blind.plant.compiled import Floats, compiled
from analysis.blind.plant.state import PlantParameters

RATCHET_EDGE_RAD_PER_S = 5.0  # spin within which a one-sided brake comes in: no step for the integrator
BRUISE_WIDTH_RAD = 0.4  # of the wall's azimuth, as wide as a soft spot
CHIP_WIDTH_RAD = 0.35  # of the disk's rim: 3.5 mm
SPRINGY_AT_M_PER_S2 = 78.5  # 8 g of the Host, where a liner on springs is off by `springy_m`
UNLUCKY_SD = 1.0  # a standard normal chance is above it in one impact of six


@compiled
def newest_traction(
    force_x: float, force_y: float, slip_x: float, slip_y: float, spin: float, angle: float, p: PlantParameters
) -> tuple[float, float]:
    """The floor's traction (in units of mu N, along the slip) with what turns or weighs it; `spin` against the floor,
    `angle` the disk's."""
    if p.canted_rad != 0.0:
        c, s = np.cos(p.canted_rad), np.sin(p.canted_rad)
        force_x, force_y = c * force_x - s * force_y, s * force_x + c * force_y
    if p.curling != 0.0:
        rim = p.disk_radius_m * spin
        share = 2.0 * p.curling * rim / (slip_x**2 + slip_y**2 + rim**2 + p.smoothing_m_per_s**2)
        force_x, force_y = force_x - share * slip_y, force_y + share * slip_x
    if p.warped != 0.0:
        a, b = np.cos(angle + p.warped_rad), np.sin(angle + p.warped_rad)
        along, across = force_x * a + force_y * b, -force_x * b + force_y * a
        along, across = along * (1.0 + p.warped), across * (1.0 - p.warped)
        force_x, force_y = along * a - across * b, along * b + across * a
    return force_x, force_y


@compiled
def add_newest_forces(
    x: float, y: float, slip_x: float, slip_y: float, acceleration: Floats, p: PlantParameters, out: Floats
) -> None:
    """Forces and torques that come on top; x, y and slip against the Host, `acceleration` the Host's."""
    out[2] += p.rocking * acceleration[0]
    out[3] += p.rocking * acceleration[1]
    if p.eddy_per_s != 0.0:
        far = ((x - p.eddy_x_m) ** 2 + (y - p.eddy_y_m) ** 2) / p.eddy_width_m**2
        rate = p.eddy_per_s * np.exp(-0.5 * far)
        out[2] -= rate * slip_x
        out[3] -= rate * slip_y
    if p.ratchet_rad_per_s2 != 0.0:
        brake = abs(p.ratchet_rad_per_s2)
        sense = 1.0 if p.ratchet_rad_per_s2 > 0.0 else -1.0
        out[5] -= sense * brake * max(np.tanh(sense * out[4] / RATCHET_EDGE_RAD_PER_S), 0.0)


@compiled
def newest_losses(azimuth: float, state: Floats, chance: float, p: PlantParameters) -> float:
    """Restitution lost in this impact where the wall was hit the last time, and where a chip comes between."""
    lost = p.loose_chip if chance > UNLUCKY_SD else 0.0
    if p.bruise != 0.0 and state[6] > -0.5:  # there was an impact before
        away = np.arctan2(np.sin(azimuth - state[12]), np.cos(azimuth - state[12])) / BRUISE_WIDTH_RAD
        lost += p.bruise * np.exp(-0.5 * away**2)
    return lost


@compiled
def newest_grip(approach: float, slip: float, p: PlantParameters) -> tuple[float, float]:
    """Factors of the tangential restitution and of the wall's friction in this impact."""
    back = max(1.0 - p.fading_grip * min(approach / p.fading_m_per_s, 1.0), 0.0)
    return back, 1.0 - p.greased * (1.0 - np.exp(-abs(slip) / p.greased_m_per_s))


@compiled
def chip_reach(azimuth: float, disk_angle: float, p: PlantParameters) -> tuple[float, float]:
    """How much farther a chipped rim lets the disk along `azimuth`, and the slope of that (m, m per rad)."""
    off = azimuth - disk_angle - p.chip_rad
    away = np.arctan2(np.sin(off), np.cos(off)) / CHIP_WIDTH_RAD
    chip = p.chip_m * np.exp(-0.5 * away**2)
    return chip, -chip * away / CHIP_WIDTH_RAD


@compiled
def newest_reach(time: float, azimuth: float, disk_angle: float, p: PlantParameters) -> tuple[float, float]:
    """How much farther the disk's middle gets along `azimuth`, and the slope of that (m, m per rad)."""
    turning = 2.0 * (azimuth - p.liner_rad - p.liner_rad_per_s * time)
    chip, slope = chip_reach(azimuth, disk_angle, p)
    more = p.contact_radius_m * p.liner * np.cos(turning) + chip
    return more, -2.0 * p.contact_radius_m * p.liner * np.sin(turning) + slope
