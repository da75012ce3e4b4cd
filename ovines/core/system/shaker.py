"""Shaker figures: amplitude of a given acceleration, best amplitude, radii within a limit (thesis Eq. 108, 124-127).

ERRATA: the thesis' (125) has two sides that differ by 0.8, and its 4.536 cm takes the 0.8 twice; here once or not.
"""

from __future__ import annotations

import math

from ovines.core.system.model import require_range

STANDARD_GRAVITY = 9.81  # m/s^2, as the thesis


def amplitude_of(acceleration_g: float, frequency_hz: float) -> float:
    """Amplitude (m) of a harmonic with this peak acceleration in g: a g / (2 pi f)^2 (Eq. 124)."""
    require_range("acceleration_g", acceleration_g, 0.0, math.inf)
    require_range("frequency_hz", frequency_hz, 0.0, math.inf, above=True)
    return acceleration_g * STANDARD_GRAVITY / (2.0 * math.pi * frequency_hz) ** 2


def clearance(host_radius_m: float, nes_radius_m: float) -> float:
    """L_g = 2 R_H - 2 R_N (m)."""
    require_range("nes_radius_m", nes_radius_m, 0.0, host_radius_m, above=True)
    return 2.0 * (host_radius_m - nes_radius_m)


def best_amplitude(host_radius_m: float, nes_radius_m: float) -> float:
    """Best excitation amplitude of a one-dimensional vibro-impact sink, L_g/pi (m; Eq. 108)."""
    return clearance(host_radius_m, nes_radius_m) / math.pi


def host_radius_for(amplitude_m: float, radius_ratio: float = 0.2, share: float = 1.0) -> float:
    """Host radius (m) whose best amplitude times ``share`` is ``amplitude_m``, with R_N = ratio R_H.

    A = share * 2 R_H (1 - ratio)/pi.  The thesis' A = 1.848 cm gives 3.629 cm at share 1, and 4.536 cm at 0.8.
    """
    require_range("amplitude_m", amplitude_m, 0.0, math.inf, above=True)
    require_range("radius_ratio", radius_ratio, 0.0, 1.0)
    require_range("share", share, 0.0, 1.0, above=True)
    return math.pi * amplitude_m / (2.0 * share * (1.0 - radius_ratio))


def within_shaker(acceleration_g: float, frequency_hz: float, limits: tuple[float, float, float]) -> bool:
    """Whether a harmonic is below a shaker's limits: peak displacement (m), velocity (m/s), acceleration (g)."""
    omega = 2.0 * math.pi * frequency_hz
    amplitude = amplitude_of(acceleration_g, frequency_hz)
    return amplitude <= limits[0] and amplitude * omega <= limits[1] and acceleration_g <= limits[2]
