"""Shaker figures: amplitude of a given acceleration, best amplitude, radii within a limit (thesis Eq. 108, 124-127).

Erratum: the thesis' (125) has two sides that differ by 0.8, and its 4.536 cm takes the 0.8 twice; here once or not.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ovines.core.limits import FREQUENCIES_HZ, LENGTHS_M, MOST_G
from ovines.core.refusal import require, require_range

Array = NDArray[np.float64]

STANDARD_GRAVITY = 9.81  # m/s^2, as the thesis
LARGEST_RATIO = 0.999  # of radii: a disk that still moves


def amplitude_of(acceleration_g: float, frequency_hz: float) -> float:
    """Amplitude (m) of a harmonic with this peak acceleration in g: a g / (2 pi f)^2 (Eq. 124)."""
    require_range("acceleration_g", acceleration_g, 0.0, MOST_G)
    require_range("frequency_hz", frequency_hz, *FREQUENCIES_HZ)
    return acceleration_g * STANDARD_GRAVITY / (2.0 * math.pi * frequency_hz) ** 2


def clearance(host_radius_m: float, nes_radius_m: float) -> float:
    """L_g = 2 R_H - 2 R_N (m)."""
    require_range("host_radius_m", host_radius_m, *LENGTHS_M)
    require_range("nes_radius_m", nes_radius_m, 0.0, host_radius_m, above=True)
    gap = 2.0 * (host_radius_m - nes_radius_m)
    require(gap > 0.0, f"nes_radius_m = {nes_radius_m}", f"below host_radius_m = {host_radius_m:g}", "correct it")
    return gap


def acceleration_of(amplitude_m: float, frequency_hz: float) -> float:
    """Peak acceleration (g) of a harmonic with this amplitude: the inverse of :func:`amplitude_of`."""
    require_range("amplitude_m", amplitude_m, 0.0, math.inf)
    require_range("frequency_hz", frequency_hz, *FREQUENCIES_HZ)
    return amplitude_m * (2.0 * math.pi * frequency_hz) ** 2 / STANDARD_GRAVITY


def best_amplitude(host_radius_m: float, nes_radius_m: float) -> float:
    """Best excitation amplitude of a one-dimensional vibro-impact sink, L_g/pi (m; Eq. 108)."""
    return clearance(host_radius_m, nes_radius_m) / math.pi


def host_radius_for(amplitude_m: float, radius_ratio: float = 0.2, share: float = 1.0) -> float:
    """Host radius (m) whose best amplitude times ``share`` is ``amplitude_m``, with R_N = ratio R_H.

    A = share * 2 R_H (1 - ratio)/pi.  The thesis' A = 1.848 cm gives 3.629 cm at share 1, and 4.536 cm at 0.8.
    """
    require_range("amplitude_m", amplitude_m, 0.0, math.inf, above=True)
    require_range("radius_ratio", radius_ratio, 0.0, LARGEST_RATIO)
    require_range("share", share, 0.0, 1.0, above=True)
    return math.pi * amplitude_m / (2.0 * share * (1.0 - radius_ratio))


@dataclass(frozen=True)
class ShakerLimits:
    """What a shaker can do, all peak values: travel (m, from the middle), velocity (m/s), acceleration (g).

    ``inf`` where there is no limit.
    """

    travel_m: float = math.inf
    velocity_m_per_s: float = math.inf
    acceleration_g: float = math.inf

    def __post_init__(self) -> None:
        for name in ("travel_m", "velocity_m_per_s", "acceleration_g"):
            value = getattr(self, name)
            least = LENGTHS_M[0]
            require(value >= least, f"{name} = {value}", f"a number of at least {least:g}", f"correct {name}")

    def accelerations_g(self, frequency_hz: Array) -> dict[str, Array]:
        """Largest acceleration (g) that each limit leaves at each frequency (n,); Fig. 36 shows the three curves."""
        omega = 2.0 * math.pi * np.asarray(frequency_hz, dtype=float)
        return {
            "travel": self.travel_m * omega**2 / STANDARD_GRAVITY,
            "velocity": self.velocity_m_per_s * omega / STANDARD_GRAVITY,
            "acceleration": np.full_like(omega, self.acceleration_g),
        }

    def narrowest(self, frequency_hz: float) -> tuple[str, float]:
        """The limit that binds at a frequency, and the acceleration (g) that it leaves."""
        each = {name: float(curve[0]) for name, curve in self.accelerations_g(np.array([frequency_hz])).items()}
        return min(each.items(), key=lambda one: one[1])
