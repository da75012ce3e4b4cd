"""The Host's motion fitted: harmonics of the drive where they explain it to the noise, else further lines, and a smooth
path for what no line explains.

Harmonics (fundamental and overtones in x, y, z and rotation, frequency estimated) are by far the most precise.  What
they leave is held against the noise, axis by axis; a second line, a drive that sweeps, starts or is random, and a table
that steps back at impacts all leave something, and get a path of their own.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from analysis.motion.host_lines import (
    APART,
    MOST_LINES,
    NO_COMB,
    OWN_SHARE,
    LineFit,
    all_lines,
    excess,
    fit_lines,
    noise_correlation,
    robust_sd,
)
from analysis.motion.host_path import HostMotion
from analysis.motion.smooth_path import SmoothPath, smooth_path
from analysis.motion.starting_drive import AS_GOOD, GROSS_SD, InPhase, in_phase
from analysis.statistics.correlation import slow_mean
from ovines.robust import spread

Array = NDArray[np.float64]
# Harmonics beside the mean: the fundamental and two overtones.
OVERTONES = 3
# Overtones beyond this share of the highest frequency that frames can tell are left out.
HIGHEST_SHARE = 0.9
# A main line that leaves more than this share of the Host's variance is none.
MAIN_SHARE = 0.3
# Fall of -2 log L by which one line must follow the Host's height, or its way across the drive, better than the drive's
# own do: three unknowns gain 16 once in a thousand runs.
BETTER_LINE = 20.0
# Slower than this share of the drive's strongest line, the way across it is no part of the drive.
SLOWEST_SHARE = 0.5
# A Host whose place spreads by more than this many sds, and than the least that cameras show (m), moves.
MOVING_SD, LEAST_MOTION_M = 10.0, 2e-5
# A line of fewer periods than this in a run has no frequency to keep.
FEWEST_PERIODS = 2.0
# The same by which an axis goes along with the one that no line explains, of so many frames at the least: one unknown
# gains 11 once in a thousand runs.
SURELY_ALONG, FEWEST_ALONG = 15.0, 12


def fit_host_motion(
    time_s: Array,
    position: Array,
    sd: Array,
    frequency_hz: float | None,
    overtones: int = OVERTONES,
    zero_s: float = 0.0,
) -> HostMotion:
    """Harmonics, with the frequency as an unknown; further lines and a smooth path where they leave more than noise.

    Parameters
    ----------
    time_s : (N,)
    position, sd : (N, 4) x, y, z in m and angle in rad; NaN where unknown
    frequency_hz : what the shaker was asked for, or None: the highest line of the spectrum is taken as the start
    zero_s : time from which phases count; the middle of a run keeps the frequency's error from them

    A Host that moves less than its noise gets means only.
    """
    time_s = time_s - zero_s
    fit, overtones = _main_line(time_s, position, sd, frequency_hz, overtones)
    fit = _with_further_lines(time_s, position, sd, fit)
    left = [one.there for one in excess(time_s, fit.residual)]
    if any(left) and overtones and _left_share(position, fit) > MAIN_SHARE:
        # No line of it is the drive: a sweep, a random drive.
        fit, overtones = fit_lines(time_s, position, sd, np.zeros(0), 0), 0
    fit, smooth, residual = _followed(time_s, position, sd, fit)
    starts = _starting(time_s, position, residual, smooth, fit) if overtones else None
    if starts is not None:
        fit = fit_lines(time_s, position, sd, np.array([starts.omega_rad_per_s]), overtones, held=(0,))
        fit, smooth, residual = _followed(time_s, position, sd, fit)
    kept = 1 + 2 * overtones
    omega_sd = float(fit.sd[0]) if overtones else 0.0
    if starts is not None:
        omega_sd = starts.sd_rad_per_s
    elif overtones and any(smooth):  # a line that wanders is known to its width alone
        omega_sd = float(np.hypot(omega_sd, 2 * np.pi * np.sqrt(_left_share(position, fit)) / np.ptp(time_s)))
    omega = float(fit.frequencies[0]) if overtones else 0.0
    phase = 0.0
    if overtones:
        main = int(np.argmax(np.hypot(fit.coefficients[:2, 1], fit.coefficients[:2, 2])))
        phase = float(np.arctan2(fit.coefficients[main, 1], fit.coefficients[main, 2]))
    return HostMotion(
        fit.coefficients[:, :kept],
        omega,
        omega_sd,
        robust_sd(residual),
        phase,
        residual,
        zero_s,
        fit.frequencies[min(overtones, 1) :],
        fit.coefficients[:, kept:],
        smooth,
        _widened(residual)[:, None, None] * fit.inverse,
    )


def _followed(
    time_s: Array, position: Array, sd: Array, fit: LineFit
) -> tuple[LineFit, tuple[SmoothPath | None, ...], Array]:
    """``fit`` with the lines that the height and the way across the drive are, the paths of what no line explains, and
    what they leave (N, 4)."""
    left = [one.there for one in excess(time_s, fit.residual)]
    if any(left):
        crosswise = int(np.nanstd(position[:, 0]) >= np.nanstd(position[:, 1]))
        few = 2 * np.pi * FEWEST_PERIODS / float(np.ptp(time_s))
        slowest = SLOWEST_SHARE * 2 * np.pi * spectral_peak(time_s, position)
        for axis, least in ((crosswise, max(slowest, few)), (2, few)):
            fit = _with_own_line(time_s, position, sd, fit, axis, least)
        left = [one.there for one in excess(time_s, fit.residual)]
    return fit, *_smooth_paths(time_s, fit.residual, np.array(left))


def _starting(
    time_s: Array, position: Array, residual: Array, smooth: tuple[SmoothPath | None, ...], fit: LineFit
) -> InPhase | None:
    """The sine that a drive is whose size alone changes; None where its line is steady, or no sine leaves as little as
    the path that follows every frame does (``residual``)."""
    axis = int(np.nanstd(position[:, 1]) > np.nanstd(position[:, 0]))
    if smooth[axis] is None:
        return None
    noise_m = spread(residual[:, axis])
    way = np.where(np.abs(residual[:, axis]) < GROSS_SD * noise_m, position[:, axis], np.nan)
    found = in_phase(time_s, way, float(fit.frequencies[0]), fit.overtones)
    return found if found is not None and found.left_m < AS_GOOD * noise_m else None


def _main_line(
    time_s: Array, position: Array, sd: Array, frequency_hz: float | None, overtones: int
) -> tuple[LineFit, int]:
    """The harmonics of a Host that moves, and how many; of what it was asked for, or of the strongest line of its
    spectrum where that one leaves less."""
    if not _moves(position, sd):
        return fit_lines(time_s, position, sd, np.zeros(0), 0), 0
    peak = 2 * np.pi * spectral_peak(time_s, position)
    fastest = HIGHEST_SHARE * np.pi / float(np.median(np.diff(time_s)))
    overtones = int(np.clip(fastest / max(peak, 1e-300), 1, overtones))
    asked = 2 * np.pi * frequency_hz if frequency_hz else peak
    fit = fit_lines(time_s, position, sd, np.array([asked]), overtones)
    if abs(fit.frequencies[0] - peak) * np.ptp(time_s) > 2 * np.pi:
        other = fit_lines(time_s, position, sd, np.array([peak]), overtones)
        if _left_share(position, other) < OWN_SHARE * _left_share(position, fit):
            return other, overtones
    return fit, overtones


def _with_further_lines(time_s: Array, position: Array, sd: Array, fit: LineFit) -> LineFit:
    """``fit`` and lines beside it: all that the noise is reached with, if they are no comb that draws a transient; else
    those only that stand out by themselves."""
    stands = True  # whether each line so far took most of what was there
    own, duration = fit, float(np.ptp(time_s)) if len(time_s) else 0.0
    for _ in range(MOST_LINES):
        found = excess(time_s, fit.residual)
        above = [axis for axis, one in enumerate(found) if one.there]
        if not above:
            return fit if stands or _spaced(fit, duration) else own
        axis = max(above, key=lambda one: found[one].power)
        omega = found[axis].omega_rad_per_s
        near = np.concatenate([[0.0], fit.omegas])
        if np.min(np.abs(near - omega)) * duration < 2 * np.pi * APART:
            break
        more = fit_lines(time_s, position, sd, np.append(fit.frequencies, omega), fit.overtones)
        before, after = (float(np.nanmean(one.residual[:, axis] ** 2)) for one in (fit, more))
        # Lines that run into each other as they are fitted draw a transient as their difference.
        if not after < before or _closest(more) * duration < 2 * np.pi * APART:
            break
        fit = more
        stands = stands and after < OWN_SHARE * before
        own = fit if stands else own
    return own


def _with_own_line(
    time_s: Array, position: Array, sd: Array, fit: LineFit, axis: int, slowest_rad_per_s: float
) -> LineFit:
    """``fit`` and the one line that the Host's way along ``axis`` is, where it is one, whatever happens along others: a
    path that only follows its frames is a poor load of the floor when it is differentiated twice, and a drive that
    starts or sweeps has no frequency that another axis would keep.  Slower than ``slowest_rad_per_s`` it is none."""
    alone = np.where(np.arange(4) == axis, position, np.nan)
    level = fit_lines(time_s, alone, sd, np.zeros(0), 0)
    found = excess(time_s, level.residual)[axis]
    near = np.abs(fit.omegas - found.omega_rad_per_s) * np.ptp(time_s) < 2 * np.pi * APART
    if not found.there or found.omega_rad_per_s < slowest_rad_per_s or np.count_nonzero(near) > 1:
        return fit
    line = fit_lines(time_s, alone, sd, np.array([found.omega_rad_per_s]), 0)
    before, after, now = (float(np.nanmean(one.residual[:, axis] ** 2)) for one in (level, line, fit))
    if not after < OWN_SHARE**2 * before:
        return fit
    seen = np.isfinite(line.residual[:, axis])
    gain = np.count_nonzero(seen) * np.log(now / max(after, 1e-300)) / slow_mean(line.residual[seen, axis]) ** 2
    # Beside the drive's own line, what is left there may be anything else: two lines that close would draw it together.
    asks = not near.any() and excess(time_s, fit.residual)[axis].there
    if not (asks or gain > BETTER_LINE):
        return fit
    frequencies, own = np.append(fit.frequencies, line.frequencies), len(fit.frequencies)
    more = fit_lines(time_s, position, sd, frequencies, fit.overtones, (*fit.held, own))
    least = 2 * np.pi * APART / float(np.ptp(time_s))
    if _closest(fit, fit.held) < least or _closest(more, more.held) > least:
        return more
    # Lines that the drive already had ran into each other: they stay where they were.
    return fit_lines(time_s, position, sd, frequencies, fit.overtones, tuple(range(own + 1)))


def _spaced(fit: LineFit, duration_s: float) -> bool:
    """Whether lines lie too far apart from each other and from zero to draw a transient together."""
    return _closest(fit) * duration_s > 2 * np.pi * NO_COMB


def _closest(fit: LineFit, without: Sequence[int] = ()) -> float:
    """How far (rad/s) the two nearest lines are apart, or the slowest is from zero, ``without`` those of some numbers;
    infinite without lines."""
    frequencies = np.delete(fit.frequencies, list(without))
    omegas = all_lines(frequencies, fit.overtones if 0 not in without else 0)
    return float(np.min(np.diff(np.sort(np.concatenate([[0.0], omegas]))), initial=np.inf))


def _smooth_paths(
    time_s: Array, residual: Array, there: NDArray[np.bool_]
) -> tuple[tuple[SmoothPath | None, ...], Array]:
    """Smooth paths of the axes where more than noise is ``there`` (4,), and what they leave (N, 4).  The correlation of
    the noise is that of the other axes, which the same cameras see; where all move, that of what paths leave."""
    paths: list[SmoothPath | None] = [None] * 4
    if not there.any():
        return tuple(paths), residual
    together, left = noise_correlation(residual[:, ~there]), residual
    for _ in range(2 if there.all() else 1):
        left = residual.copy()
        for axis in np.flatnonzero(there):
            path = paths[axis] = smooth_path(time_s, residual[:, axis], together)
            if path is not None:
                left[:, axis] -= path.at(time_s)
        together = noise_correlation(left)
    main = max(np.flatnonzero(there), key=lambda axis: np.nanstd(residual[:, axis] - left[:, axis]))
    if (path := paths[main]) is not None:
        for axis in np.flatnonzero(~there):
            share = _share_of(path.at(time_s), left[:, axis])
            if share:
                paths[axis] = path.times(share)
                left[:, axis] -= share * path.at(time_s)
    return tuple(paths), left


def _share_of(path: Array, residual: Array) -> float:
    """What share of another axis' ``path`` (N,) a ``residual`` (N,) goes along with, as a drive does that is turned a
    little; 0 where it surely does not.

    Lines left the same of both axes, but for their size."""
    seen = np.isfinite(residual)
    if np.count_nonzero(seen) < FEWEST_ALONG or not residual[seen].any():
        return 0.0
    share = float(path[seen] @ residual[seen] / max(float(path[seen] @ path[seen]), 1e-300))
    rest = residual[seen] - share * path[seen]
    gain = len(rest) * np.log(float(residual[seen] @ residual[seen]) / max(float(rest @ rest), 1e-300))
    return share if gain > SURELY_ALONG * slow_mean(rest) ** 2 else 0.0


def _left_share(position: Array, fit: LineFit) -> float:
    """Share of the variance in the plane that lines leave."""
    known = np.isfinite(position[:, :2]) & fit.keep[:, :2]
    total = left = 0.0
    for axis in range(2):
        m = known[:, axis]
        if m.any():
            total += float(np.sum((position[m, axis] - np.mean(position[m, axis])) ** 2))
            left += float(np.sum(fit.residual[m, axis] ** 2))
    return left / total if total > 0 else 0.0


def _widened(residual: Array) -> Array:
    """Variance (4,) of each axis' noise where it is taken for white: that of its frames, widened for their
    correlation."""
    found = np.zeros(4)
    for axis, column in enumerate(residual.T):
        r = column[np.isfinite(column)]
        if len(r) > 2:
            near = np.clip(r, -3 * np.std(r), 3 * np.std(r))
            found[axis] = np.mean(near**2) * slow_mean(r) ** 2
    return found


def _moves(position: Array, sd: Array) -> bool:
    for axis in range(2):
        known = np.isfinite(position[:, axis]) & np.isfinite(sd[:, axis])
        if known.sum() > 1 and np.std(position[known, axis]) > max(
            MOVING_SD * float(np.median(sd[known, axis])), LEAST_MOTION_M
        ):
            return True
    return False


def spectral_peak(time_s: Array, position: Array) -> float:
    """Frequency (Hz) of the strongest line of ``position`` (N, 2 or more) along whichever of x and y moves more."""
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
