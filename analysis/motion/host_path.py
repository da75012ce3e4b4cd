"""The Host's motion as harmonics of the drive: fundamental and overtones in x, y, z and rotation, frequency
estimated.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ovines.robust import spread

Array = NDArray[np.float64]
AXES = ("x", "y", "z", "angle")
# Harmonics beside the mean: the fundamental and two overtones.
OVERTONES = 3
# A place this far (sd) off the harmonics is a gross error: of 600 frames none by chance.
GROSS_SD = 5.0


@dataclass(frozen=True, eq=False)
class HostMotion:
    """Harmonics of one run.

    ``harmonics`` (4, 1 + 2 K): per axis x, y, z (m), angle (rad): mean, cos and sin of k omega t; ``omega_rad_per_s``
    of the fundamental (0 when the Host stands still) with its sd; ``residual_sd`` (4,): robust spread of what is left
    per frame;
    ``phase_rad``: the drive's phase at ``zero_s``, of a sine along the axis that moves most; ``zero_s``: the time t
    from which the phases count (0 in the rig's frame).
    """

    harmonics: Array
    omega_rad_per_s: float
    omega_sd_rad_per_s: float
    residual_sd: Array
    phase_rad: float
    residual: Array
    zero_s: float = 0.0

    @property
    def frequency_hz(self) -> float:
        """Of the fundamental."""
        return self.omega_rad_per_s / (2 * np.pi)

    @property
    def amplitude_m(self) -> float:
        """Of the fundamental along the axis that moves most."""
        if self.harmonics.shape[1] < 3:
            return 0.0
        return float(np.hypot(self.harmonics[:2, 1], self.harmonics[:2, 2]).max())

    def at(self, time_s: Array, derivative: int = 0) -> Array:
        """Position, velocity or acceleration (len(time_s), 4) of x, y, z, angle."""
        time_s = np.asarray(time_s, float) - self.zero_s
        return _basis(time_s, self.omega_rad_per_s, (self.harmonics.shape[1] - 1) // 2, derivative) @ self.harmonics.T


def _basis(time_s: Array, omega: float, overtones: int, derivative: int = 0) -> Array:
    columns = [np.ones_like(time_s) if derivative == 0 else np.zeros_like(time_s)]
    for k in range(1, overtones + 1):
        w = k * omega
        turn = derivative * np.pi / 2
        columns += [w**derivative * np.cos(w * time_s + turn), w**derivative * np.sin(w * time_s + turn)]
    return np.stack(columns, -1)


def fit_host_motion(
    time_s: Array,
    position: Array,
    sd: Array,
    frequency_hz: float | None,
    overtones: int = OVERTONES,
    zero_s: float = 0.0,
) -> HostMotion:
    """Harmonics by weighted least squares, with the frequency as an unknown (variable projection, Golub and Pereyra
    1973).

    Parameters
    ----------
    time_s : (N,)
    position, sd : (N, 4) x, y, z in m and angle in rad; NaN where unknown
    frequency_hz : what the shaker was asked for, or None: the highest line of the spectrum is taken as the start
    zero_s : time from which phases count; the middle of a run keeps the frequency's error from them

    A Host that moves less than its noise gets means only.  Gross errors are cut at :data:`GROSS_SD` robust sds and the
    fit repeated.
    """
    moving = _moves(position, sd)
    if not moving:
        return _standing(position, sd, zero_s)
    time_s = time_s - zero_s
    omega = 2 * np.pi * (frequency_hz or _spectral_peak(time_s, position))
    keep = np.isfinite(position) & np.isfinite(sd)
    coefficients = np.zeros((4, 1 + 2 * overtones))
    sd_omega = np.inf
    for _ in range(12):
        basis = _basis(time_s, omega, overtones)
        slope = _basis_slope(time_s, omega, overtones)
        numerator = denominator = 0.0
        residual = np.full_like(position, np.nan)
        for axis in range(4):
            m = keep[:, axis]
            if m.sum() < basis.shape[1] + 2:
                coefficients[axis] = 0.0
                coefficients[axis, 0] = np.nanmean(position[:, axis]) if m.any() else 0.0
                continue
            weight = 1 / sd[m, axis]
            coefficients[axis] = np.linalg.lstsq(basis[m] * weight[:, None], position[m, axis] * weight, rcond=None)[0]
            residual[:, axis] = position[:, axis] - basis @ coefficients[axis]
            direction = (slope[m] @ coefficients[axis]) * weight
            direction -= (basis[m] * weight[:, None]) @ np.linalg.lstsq(
                basis[m] * weight[:, None], direction, rcond=None
            )[0]
            numerator += direction @ (residual[m, axis] * weight)
            denominator += direction @ direction
        step = numerator / denominator if denominator > 0 else 0.0
        sd_omega = 1 / np.sqrt(denominator) if denominator > 0 else np.inf
        omega += float(np.clip(step, -0.02 * omega, 0.02 * omega))
        limit = GROSS_SD * np.maximum(_robust_sd(residual), 1e-12)
        keep = np.isfinite(residual) & (np.abs(residual) < limit)
        if abs(step) < 1e-3 * sd_omega:
            break
    main = int(np.argmax(np.hypot(coefficients[:2, 1], coefficients[:2, 2])))
    phase = float(np.arctan2(coefficients[main, 1], coefficients[main, 2]))
    return HostMotion(coefficients, float(omega), float(sd_omega), _robust_sd(residual), phase, residual, zero_s)


def _basis_slope(time_s: Array, omega: float, overtones: int) -> Array:
    """Derivative of the basis with respect to omega."""
    columns = [np.zeros_like(time_s)]
    for k in range(1, overtones + 1):
        columns += [-k * time_s * np.sin(k * omega * time_s), k * time_s * np.cos(k * omega * time_s)]
    return np.stack(columns, -1)


def _robust_sd(residual: Array) -> Array:
    return np.array([spread(column) for column in residual.T])


def _moves(position: Array, sd: Array) -> bool:
    for axis in range(2):
        known = np.isfinite(position[:, axis]) & np.isfinite(sd[:, axis])
        if known.sum() > 1 and np.std(position[known, axis]) > max(10 * float(np.median(sd[known, axis])), 2e-5):
            return True
    return False


def _standing(position: Array, sd: Array, zero_s: float) -> HostMotion:
    known = np.isfinite(position)
    mean = np.array([np.mean(position[known[:, a], a]) if known[:, a].any() else 0.0 for a in range(4)])
    residual = position - mean
    return HostMotion(mean[:, None], 0.0, 0.0, _robust_sd(residual), 0.0, residual, zero_s)


def _spectral_peak(time_s: Array, position: Array) -> float:
    axis = int(
        np.argmax(
            [np.std(column[np.isfinite(column)]) if np.isfinite(column).any() else 0.0 for column in position[:, :2].T]
        )
    )
    seen = np.isfinite(position[:, axis])
    uniform = np.linspace(time_s[0], time_s[-1], len(time_s))
    signal = np.interp(uniform, time_s[seen], position[seen, axis])
    signal = (signal - signal.mean()) * np.hanning(len(signal))
    size = 8 * len(signal)
    spectrum = np.abs(np.fft.rfft(signal, size))
    return float(np.fft.rfftfreq(size, uniform[1] - uniform[0])[np.argmax(spectrum)])
