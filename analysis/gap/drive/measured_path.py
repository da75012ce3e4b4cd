"""The measured Host path of each run beside the harmonics of its drive, as whitened rows for linear fits."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.flights.runs import Run
from analysis.motion.host_lines import noise_correlation
from ovines.robust import residual_sd

Array = NDArray[np.float64]
# Overtones of the drive that a shaker and a lens residual make: they say nothing of impacts or ground.
OVERTONES = 6
# Frames farther off (robust sd) are gross errors.
GROSS_SD = 5.0
FEWEST_FRAMES = 60
# Noise of markers that is correlated from frame to frame by more than this is none of cameras.
MOST_CORRELATED = 0.95
# What no line explains is less than this share of the drive: else it starts, stops or sweeps.
MOST_BESIDE = 0.2


@dataclass(frozen=True, eq=False)
class MeasuredPath:
    """One run's Host beside its drive: ``time_s`` (N,) of the frames used, ``place`` (N, 2) as measured, ``run`` its
    number; ``sd`` (2,) of a frame, ``correlation`` from frame to frame, ``held`` (M, Q) orthonormal columns of the
    drive, whitened, and ``plain`` (N, Q) as they are."""

    run: int
    time_s: Array
    place: Array
    sd: Array
    correlation: float
    held: Array
    plain: Array

    def beside_drive(self, places: Array) -> Array:
        """Places (N, 2; m) without what the drive explains."""
        return np.asarray(places - self.plain @ (self.plain.T @ places))

    def with_line(self, frequency_hz: float) -> MeasuredPath:
        """The path whose drive holds one more line of its own."""
        turn = 2 * np.pi * frequency_hz * self.time_s
        drive = np.column_stack([self.plain, *_line_columns(self.time_s, turn)])
        held, _ = np.linalg.qr(_whitened(drive, self.correlation))
        return replace(self, held=held, plain=np.linalg.qr(drive)[0])

    def white(self, columns: Array) -> Array:
        """``columns`` (N, 2, ...) as independent rows of unit variance without what the drive explains (M, 2, ...)."""
        rows = _whitened(columns, self.correlation) / self.sd.reshape(1, 2, *[1] * (columns.ndim - 2))
        flat = rows.reshape(len(rows), -1)
        return np.asarray((flat - self.held @ (self.held.T @ flat)).reshape(rows.shape))


def _whitened(columns: Array, correlation: float) -> Array:
    return np.asarray((columns[1:] - correlation * columns[:-1]) / np.sqrt(1 - correlation**2))


def measured_path(run: Run, number: int) -> MeasuredPath | None:
    """The path of a run whose Host follows harmonics of a drive; None of any other (a sweep, a random drive, a start,
    a Host at rest, too few frames)."""
    host, time_s = run.data.host, run.data.time_s
    if not host.omega_rad_per_s or len(host.residual) != len(time_s):
        return None
    residual = host.residual[:, :2]
    sd = np.array([residual_sd(column[np.isfinite(column)]) for column in residual.T])
    use = np.isfinite(residual).all(1) & (np.abs(residual) < GROSS_SD * sd).all(1)
    if np.count_nonzero(use) < FEWEST_FRAMES:
        return None
    beside = [float(np.std(one.at(time_s - host.zero_s))) for one in host.smooth[:2] if one is not None]
    if max(beside, default=0.0) > MOST_BESIDE * host.amplitude_m:
        return None
    place = host.at(time_s)[:, :2] + residual
    t, place = time_s[use], place[use]
    correlation = noise_correlation(residual)
    turn = host.omega_rad_per_s * t
    columns = [np.ones_like(t)]
    for k in range(1, OVERTONES + 1):
        columns += [np.cos(k * turn), np.sin(k * turn)]
    drive = np.column_stack([*columns, *_line_columns(t, turn)[2:]])
    held, _ = np.linalg.qr(_whitened(drive, correlation))
    return MeasuredPath(number, t, place, sd, correlation, held, np.linalg.qr(drive)[0])


def _line_columns(t: Array, turn: Array) -> list[Array]:
    """A line, and what a frequency that is a little off or a level that drifts makes of it."""
    return [np.cos(turn), np.sin(turn), t * np.cos(turn), t * np.sin(turn)]


def with_noise_of(path: MeasuredPath, left: Array) -> MeasuredPath:
    """``path`` with the correlation from frame to frame that what is ``left`` (N, 2; m) of it beside the drive shows,
    and the sds of that.

    A path that follows the Host's swings leaves residuals without slow noise, which is what swings are told from."""
    beside = path.beside_drive(left)
    own = np.sum(beside[1:] * beside[:-1], 0) / np.maximum(np.sum(beside[1:] ** 2, 0), 1e-300)
    correlation = float(np.clip(np.mean(own), path.correlation, MOST_CORRELATED))
    held, _ = np.linalg.qr(_whitened(path.plain, correlation))
    path = replace(path, correlation=correlation, held=held)
    free = path.white(left)
    return replace(path, sd=path.sd * np.array([residual_sd(column) for column in free.T]))
