"""Friction of a uniformly loaded disk that slides and spins, by direct integration over its area.

The simulator uses elliptic integrals; the plant sums the Coulomb traction of small area elements. Both
describe Farkas et al., Phys. Rev. Lett. 90, 248302 (2003).
"""

from functools import lru_cache

import numpy as np

RADIAL_NODES = 96
AZIMUTH_NODES = 240
TABLE_SIZE = 1025


@lru_cache(maxsize=1)
def disk_friction_table() -> np.ndarray:
    """Force and torque of the disk's friction against the mixture of sliding and spinning.

    Returns an array (TABLE_SIZE, 2). Row i belongs to atan2(R |spin|, speed) = i / (TABLE_SIZE - 1) * pi/2:
    force in units of mu N, torque in units of mu N R. Pure sliding gives (1, 0), pure spinning (0, 2/3).
    """
    node, weight = np.polynomial.legendre.leggauss(RADIAL_NODES)
    radius = 0.5 * (node + 1.0)
    radial_weight = 0.5 * weight * 2.0 * radius  # area element of the unit disk, normalised to one
    azimuth = (np.arange(AZIMUTH_NODES) + 0.5) * np.pi / AZIMUTH_NODES - 0.5 * np.pi
    sine = np.sin(azimuth)[None, :]
    angle = np.linspace(0.0, 0.5 * np.pi, TABLE_SIZE)
    table = np.empty((TABLE_SIZE, 2))
    for i, mix in enumerate(angle):
        slide, spin = np.cos(mix), np.sin(mix) * radius[:, None]
        # Velocity of the element at (r, azimuth): slide along x plus spin x r; the mirror half adds the same.
        along = slide - spin * sine
        size = np.sqrt(slide**2 + spin**2 - 2.0 * slide * spin * sine) + 1e-300
        torque = radius[:, None] * (spin - slide * sine) / size
        table[i, 0] = radial_weight @ (along / size).mean(axis=1)
        table[i, 1] = radial_weight @ torque.mean(axis=1)
    return table
