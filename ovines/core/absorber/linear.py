"""A sprung Host without NES, with the disk stuck to it, and with an optimal tuned mass damper: closed forms."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ovines.core.absorber.sprung import suspension_of
from ovines.core.orbits.period import harmonics
from ovines.core.system.model import Scenario

AXES = ("x", "y")


def ground_amplitude_m(scenario: Scenario) -> np.ndarray:
    """Amplitude of the ground along x and y (2,): each axis' sines added as if in phase."""
    size = [sum(abs(sine.amplitude) for sine in harmonics(scenario) if sine.axis == axis) for axis in AXES]
    return np.array(size, dtype=float)


def bare_gain(scenario: Scenario, frequency_hz: np.ndarray, added_kg: float = 0.0) -> np.ndarray:
    """Host's amplitude over the ground's along x and y, (n, 2): |(k + i c w)/(k - m w^2 + i c w)|.

    ``added_kg``: mass that moves with the Host, as a disk that sticks to its floor.
    """
    suspension, mass = suspension_of(scenario)
    w = 2.0 * np.pi * np.asarray(frequency_hz, dtype=float)[:, None]
    k, c = np.array(suspension.stiffness[:2]), np.array(suspension.damping[:2])
    return np.abs((k + 1j * c * w) / (k - (mass + added_kg) * w**2 + 1j * c * w))


def tuned_gain(
    scenario: Scenario, axis: int, mass_kg: float, spring: np.ndarray, frequency_hz: np.ndarray
) -> np.ndarray:
    """Host's amplitude over the ground's along one axis (n,) with ``mass_kg`` hung on ``spring`` (N/m, N s/m)."""
    suspension, mass = suspension_of(scenario)
    w = 2.0 * np.pi * np.asarray(frequency_hz, dtype=float)
    k, c = suspension.stiffness[axis], suspension.damping[axis]
    between = spring[0] + 1j * spring[1] * w
    moved = between / (between - mass_kg * w**2)  # the damper's mass over the Host
    return np.abs((k + 1j * c * w) / (k - mass * w**2 + 1j * c * w - moved * mass_kg * w**2))


@dataclass(frozen=True)
class TunedMassDamper:
    """An optimal damper on one axis: mass, spring, damper, and the largest ``gain`` that it leaves."""

    mass_kg: float
    stiffness_n_per_m: float
    damping_n_s_per_m: float
    gain: float


def tuned_mass_damper(scenario: Scenario, axis: int, mass_kg: float, frequency_hz: np.ndarray) -> TunedMassDamper:
    """The damper that makes the largest gain over ``frequency_hz`` smallest; Den Hartog's is where the search begins.

    Source: Den Hartog, Mechanical Vibrations (1956), sections 3.2-3.3.
    """
    from scipy.optimize import minimize

    suspension, mass = suspension_of(scenario)
    ratio = mass_kg / mass
    tuned = mass_kg * suspension.stiffness[axis] / mass / (1.0 + ratio) ** 2
    damped = 2.0 * np.sqrt(3.0 * ratio / (8.0 * (1.0 + ratio))) * np.sqrt(tuned * mass_kg)
    start = np.array([tuned, damped])

    def worst(logs: np.ndarray) -> float:
        return float(np.max(tuned_gain(scenario, axis, mass_kg, start * np.exp(logs), frequency_hz)))

    found = minimize(worst, np.zeros(2), method="Nelder-Mead", options={"xatol": 1e-6, "fatol": 1e-9})
    spring = start * np.exp(found.x)
    return TunedMassDamper(mass_kg, float(spring[0]), float(spring[1]), float(found.fun))
