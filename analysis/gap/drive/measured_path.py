"""The measured Host path of each run beside its drive, as whitened rows for linear fits.

A drive of lines is known by them.  Of any other (a sweep, a random drive) all that lies in its band is taken for the
drive: what swings beside the band after blows is distinguished from it, what swings in it is not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.flights.cutting.runs import Run
from analysis.motion.host_lines import noise_correlation
from analysis.statistics.correlation import frame_correlation
from ovines.robust import residual_sd

Array = NDArray[np.float64]
# Overtones of the drive that a shaker and a lens residual make: they say nothing of impacts or ground.
OVERTONES = 6
# Frames farther off (robust sd) are gross errors.
GROSS_SD = 5.0
FEWEST_FRAMES = 60
# Of a drive of lines so many are all there are beside its harmonics, and what they leave is less than this share of it
# (a recoil leaves 0.006, a sweep, a start or a random drive at least 0.026; 96 runs of the blind plant).
MOST_LINES, MOST_BESIDE = 3, 0.02
# One line whose level or frequency changes leaves less than this; what is slower than its band is none of it.
MOST_CHANGED = 0.2
# The band of a drive that is none of lines holds this share of its path's power.
IN_BAND = 0.999
# Columns beyond those of a band's width and duration (Slepian 1978): of 24 random, sweeping and starting drives of the
# blind plant a path was followed to 2e-4 of itself at worst, half of them to 3e-6.
BEYOND = 6
# A band leaves at least this share of the frames to tell by.
LEAST_FREE = 0.5
# A Host that nobody has asked to move, and that moves by less than this share of the contact radius (rms), rests but
# for what blows do to it: a drive of 2 g at 30 Hz moves one of 25 mm by 1.6 %, blows of 2 m/s one of 12 kg by 0.7 %.
AT_REST = 0.012


@dataclass(frozen=True, eq=False)
class MeasuredPath:
    """One run's Host beside its drive: ``time_s`` (N,) of the frames used, ``place`` (N, 2) as measured, ``run`` its
    number; ``sd`` (2,) of a frame, ``correlation`` from frame to frame, ``held`` (M, Q) orthonormal columns of the
    drive, whitened, and ``plain`` (N, Q) as they are; ``tells_lines``: whether a further line would be none of the
    drive; ``drive_hz``: its frequency, or the middle of its band; ``fastest_hz``: that, or the band's upper end; both 0
    of a Host at rest."""

    run: int
    time_s: Array
    place: Array
    sd: Array
    correlation: float
    held: Array
    plain: Array
    tells_lines: bool
    drive_hz: float
    fastest_hz: float

    def drive_of(self, places: Array) -> Array:
        """What the drive explains of places (N, 2; m)."""
        return np.asarray(self.plain @ (self.plain.T @ places))

    def beside_drive(self, places: Array) -> Array:
        """Places (N, 2; m) without what the drive explains."""
        return np.asarray(places - self.drive_of(places))

    def with_line(self, frequency_hz: float) -> MeasuredPath:
        """The path whose drive holds one more line of its own."""
        turn = 2 * np.pi * frequency_hz * self.time_s
        drive = np.column_stack([self.plain, *_line_columns(self.time_s, turn)])
        held, _ = np.linalg.qr(whitened(drive, self.correlation))
        return replace(self, held=held, plain=np.linalg.qr(drive)[0])

    def white(self, columns: Array) -> Array:
        """``columns`` (N, 2, ...) as independent rows of unit variance without what the drive explains (M, 2, ...)."""
        rows = whitened(columns, self.correlation)
        rows /= self.sd.reshape(1, 2, *[1] * (columns.ndim - 2))
        flat = rows.reshape(len(rows), -1)
        flat -= self.held @ (self.held.T @ flat)
        return rows


def whitened(columns: Array, correlation: float) -> Array:
    """Rows (N - 1, ...) of one size and independent where the errors of ``columns`` (N, ...) have this ``correlation``
    from frame to frame."""
    rows = correlation * columns[:-1]
    np.subtract(columns[1:], rows, out=rows)
    rows /= np.sqrt(1 - correlation**2)
    return rows


def measured_path(run: Run, number: int, asked: bool = True) -> MeasuredPath | None:
    """The path of a run; None of too few frames, and of a drive whose band leaves nothing to tell by.  ``asked``:
    whether anybody has asked for a drive."""
    host, time_s = run.data.host, run.data.time_s
    if len(host.residual) != len(time_s):
        return None
    residual = host.residual[:, :2]
    sd = np.array([residual_sd(column[np.isfinite(column)]) for column in residual.T])
    use = np.isfinite(residual).all(1) & (np.abs(residual) < GROSS_SD * sd).all(1)
    if np.count_nonzero(use) < FEWEST_FRAMES:
        return None
    place = (host.at(time_s)[:, :2] + residual)[use]
    if not sd.all():
        return None
    drive = _drive(run, time_s[use], place, asked)
    return None if drive is None else path_beside(drive, number, time_s[use], place, sd, noise_correlation(residual))


class Drive(NamedTuple):
    """Columns (N, Q) of all that a drive does; the rest as in :class:`MeasuredPath`."""

    columns: Array
    tells_lines: bool
    hz: float
    fastest_hz: float


def path_beside(drive: Drive, number: int, time_s: Array, place: Array, sd: Array, correlation: float) -> MeasuredPath:
    """A path of places (N, 2; m) beside its drive, whose frames have the ``sd`` (2,) and the ``correlation`` from one
    to the next."""
    held, _ = np.linalg.qr(whitened(drive.columns, correlation))
    plain = np.linalg.qr(drive.columns)[0]
    return MeasuredPath(
        number, time_s, place, sd, correlation, held, plain, drive.tells_lines, drive.hz, drive.fastest_hz
    )


def at_rest(t: Array) -> Drive:
    """None: the Host's place alone."""
    return Drive(_harmonics(t, 0.0), False, 0.0, 0.0)


def sine(t: Array, omega: float) -> Drive:
    """One line at ``omega`` (rad/s) with its overtones."""
    return Drive(_harmonics(t, omega), True, omega / (2 * np.pi), omega / (2 * np.pi))


def _drive(run: Run, t: Array, place: Array, asked: bool) -> Drive | None:
    """What moves the Host of a run at the times (N,) of its places (N, 2)."""
    host = run.data.host
    moved_m = float(np.sqrt(np.mean(np.sum((place - place.mean(0)) ** 2, 1))))
    if not host.moves or (not asked and moved_m < AT_REST * run.data.contact_radius_m):
        return at_rest(t)
    beside = [float(np.std(one.at(run.data.time_s - host.zero_s))) for one in host.smooth[:2] if one is not None]
    left = max(beside, default=0.0) / max(host.amplitude_m, 1e-300) if host.omega_rad_per_s else np.inf
    if left <= MOST_BESIDE and len(host.lines_rad_per_s) <= MOST_LINES:
        return sine(t, host.omega_rad_per_s)
    changes = left <= MOST_CHANGED and not len(host.lines_rad_per_s)
    middle_hz, half_hz = _band_of(t, place)
    if 4 * half_hz * np.ptp(t) > (1 - LEAST_FREE) * len(t):
        return None
    columns = np.hstack([_harmonics(t, host.omega_rad_per_s if changes else 0.0), _band(t, middle_hz, half_hz)])
    return Drive(columns, changes, middle_hz, middle_hz + half_hz)


def _harmonics(t: Array, omega: float) -> Array:
    """Columns (N, Q) of the mean and the drive's harmonics; of the mean alone for a drive without a frequency."""
    columns = [np.ones_like(t)]
    if not omega:
        return columns[0][:, None]
    for k in range(1, OVERTONES + 1):
        columns += [np.cos(k * omega * t), np.sin(k * omega * t)]
    return np.column_stack([*columns, *_line_columns(t, omega * t)[2:]])


def _band_of(t: Array, place: Array) -> tuple[float, float]:
    """Middle and half width (Hz) of the band that holds nearly all of a path (N, 2)."""
    even = np.linspace(t[0], t[-1], len(t))
    window = np.hanning(len(t))
    columns = [np.interp(even, t, column - np.mean(column)) * window for column in place.T]
    power = np.cumsum(np.sum(np.abs(np.fft.rfft(columns, axis=1)) ** 2, 0))
    outside = 0.5 * (1 - IN_BAND) * power[-1]
    low, high = (float(one) for one in np.searchsorted(power, [outside, power[-1] - outside]))
    duration = float(np.ptp(t))
    return 0.5 * (low + high) / duration, 0.5 * (high - low) / duration


def _band(t: Array, middle_hz: float, half_hz: float) -> Array:
    """Columns (N, Q) of all that lies in a band: a carrier times discrete prolate sequences."""
    from scipy.signal.windows import dpss  # takes long to load, and drives of lines do without

    turns = max(half_hz * float(np.ptp(t)), 1.0)
    tapers = dpss(len(t), turns, int(np.ceil(2 * turns)) + BEYOND)
    even = np.linspace(t[0], t[-1], len(t))
    level = np.column_stack([np.interp(t, even, taper) for taper in tapers])
    turn = 2 * np.pi * middle_hz * t[:, None]
    return np.hstack([level * np.cos(turn), level * np.sin(turn)])


def _line_columns(t: Array, turn: Array) -> list[Array]:
    """A line, and what a frequency that is a little off or a level that drifts makes of it."""
    return [np.cos(turn), np.sin(turn), t * np.cos(turn), t * np.sin(turn)]


def with_noise_of(paths: Sequence[MeasuredPath], left: Sequence[Array]) -> list[MeasuredPath]:
    """``paths`` with the noise that what is ``left`` (N, 2; m) of them beside the drive shows: one correlation from
    frame to frame, since the same cameras film all runs, and each run's own sds.

    A path that follows the Host's swings leaves residuals without slow noise, which is what swings are distinguished
    from."""
    beside = [path.beside_drive(one) for path, one in zip(paths, left, strict=True)]
    correlation = float(np.average([frame_correlation(one) for one in beside], weights=[len(one) for one in beside]))
    out = []
    for path, one in zip(paths, left, strict=True):
        held, _ = np.linalg.qr(whitened(path.plain, correlation))
        path = replace(path, correlation=correlation, held=held)
        free = path.white(one)
        out.append(replace(path, sd=path.sd * np.array([residual_sd(column) for column in free.T])))
    return out
