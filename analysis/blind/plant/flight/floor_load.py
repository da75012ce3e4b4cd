"""The floor's load per unit mass (m/s^2): of a Host that moves up and down, under a disk that a blow has lifted."""

import numpy as np

from analysis.blind.plant.compiled import inlined
from analysis.blind.plant.flight.instant import Instant
from analysis.blind.plant.host import HOST_M_PER_S2
from analysis.blind.plant.parameters import PlantParameters
from analysis.blind.plant.state import APPROACH, COUNT, IMPACT_S

DRUM_S = 0.03  # in which a floor plate's drumming dies out: half of a flight


@inlined
def floor_load(at: Instant, p: PlantParameters) -> float:
    """Never negative.

    A Host on leaf springs is led along an arc of the curvature `arc_per_m`.
    A thin floor plate, held all around, bends as the drive shakes it, the most in its middle: less by
    `thin_floor_m_per_s2` (1 - (r / `contact_radius_m`)^2) (the Host's acceleration along x / `HOST_M_PER_S2`), r the
    way from the Host's centre.
    A guide with play chatters twice in a period of the drive, too fast to be seen in the Host's height: times 1 +
    `galloping` (cos(`galloping_rad`) (a^2 - u^2) + sin(`galloping_rad`) 2 a u) / `HOST_M_PER_S2`^2, a the Host's
    acceleration along x and u its velocity times the drive's angular frequency: under a sine a sine twice as fast.
    A blow tosses the disk up at the share `toss` of its approach: no load in its flight, as long again twice as much
    where it lands.
    A disk that hops has none for `hop_s` after an impact.
    A blow makes the floor plate drum: a time t after it the load is times 1 + `drum` exp(-t / `DRUM_S`)
    sin(`drum_rad_per_s` t).
    """
    load = p.load_m_per_s2 + at.host_acceleration[3]
    if p.arc_per_m != 0.0:
        load += p.arc_per_m * (at.host_velocity[0] ** 2 + at.host_position[0] * at.host_acceleration[0])
    if p.thin_floor_m_per_s2 != 0.0:
        inside = 1.0 - (at.x * at.x + at.y * at.y) / p.contact_radius_m**2
        load -= p.thin_floor_m_per_s2 * inside * at.host_acceleration[0] / HOST_M_PER_S2
    load = max(load, 0.0)
    if p.galloping != 0.0:
        pull, speed = at.host_acceleration[0], p.drive_rad_per_s * at.host_velocity[0]
        twice = np.cos(p.galloping_rad) * (pull**2 - speed**2) + np.sin(p.galloping_rad) * 2.0 * pull * speed
        load *= max(1.0 + p.galloping * twice / HOST_M_PER_S2**2, 0.0)
    late = at.time - at.state[IMPACT_S]
    if p.toss > 0.0:
        up_s = 2.0 * p.toss * at.state[APPROACH] / p.load_m_per_s2
        if 0.0 <= late < 2.0 * up_s:
            load *= 0.0 if late < up_s else 2.0
    if p.hop_s > 0.0 and 0.0 <= late < p.hop_s:
        load = 0.0
    if p.drum != 0.0 and at.state[COUNT] > 0.5 and late >= 0.0:
        load *= max(1.0 + p.drum * np.exp(-late / DRUM_S) * np.sin(p.drum_rad_per_s * late), 0.0)
    return load
