"""Lines of a motion: sines of any frequency, fitted together, and whether what they leave is more than noise."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ovines.robust import middle, spread

Array = NDArray[np.float64]

# A place this far (sd) off the lines is a gross error: of 600 frames none by chance.
GROSS_SD = 5.0
# ... and in a spectrum, which a single one would fill, this far.
CLIP_SD = 4.0
# Correlations from frame to frame that cameras' noise may have (sealed series: up to 0.7).
CORRELATIONS = np.linspace(0.0, 0.8, 33)
# What is slower than this share of the highest frequency may be motion; the noise shows above it, in so many bands.
NOISE_FROM, NOISE_BANDS = 0.25, 8
# Of a median's logarithm in a band of m neighbours in a windowed spectrum: variance 2.08 / (0.67 m).
MEDIAN_VARIANCE = 3.1
# Below this (m, rad) rounding and splines of a simulation's tables count as noise.
FINEST = 1e-9
# How far the correlation may be off: fall of -2 log L.
UNSURE = 9.0
# Chance that noise alone shows a line, or more in a band than it should, in a run.
BY_CHANCE = 1e-7
# Lines closer to another one, or to the zero, than this over the run's duration are no lines of their own.
APART = 1.2
# ... and lines that stand out only together, closer than this, are the comb of a transient.
NO_COMB = 3.0
# Fewer frames tell nothing about a spectrum.
FEWEST_FRAMES = 24
# A line is there by itself when it takes this share of what is left along its axis.
OWN_SHARE = 0.5
MOST_LINES = 10
FIT_ROUNDS = 12


def basis(time_s: Array, omegas: Array, derivative: int = 0) -> Array:
    """One, and cos and sin of each frequency (L,) at ``time_s`` (N,), or their derivative: (N, 1 + 2 L)."""
    columns = [np.ones_like(time_s) if derivative == 0 else np.zeros_like(time_s)]
    for w in omegas:
        turn = derivative * np.pi / 2
        columns += [w**derivative * np.cos(w * time_s + turn), w**derivative * np.sin(w * time_s + turn)]
    return np.stack(columns, -1)


@dataclass(frozen=True, eq=False)
class LineFit:
    """``overtones`` harmonics of the first of ``frequencies`` (F,) (rad/s, with their ``sd``), and the others' lines:
    ``coefficients`` (4, 1 + 2 L) of :func:`basis` at :attr:`omegas`, ``residual`` (N, 4), ``keep`` (N, 4) what was
    fitted, ``inverse`` (4, P, P) of each axis' normal matrix, ``held`` the numbers of frequencies that were known.
    """

    frequencies: Array
    sd: Array
    overtones: int
    coefficients: Array
    residual: Array
    keep: NDArray[np.bool_]
    inverse: Array
    held: tuple[int, ...] = ()

    @property
    def omegas(self) -> Array:
        """Every line's frequency (L,) (rad/s)."""
        return all_lines(self.frequencies, self.overtones)


def all_lines(frequencies: Array, overtones: int) -> Array:
    """The harmonics of the first frequency, then the others (L,); without ``overtones`` just the frequencies."""
    if not overtones:
        return frequencies
    harmonics = frequencies[:1] * np.arange(1, overtones + 1)
    return np.concatenate([harmonics, frequencies[1:]])


def fit_lines(
    time_s: Array, position: Array, sd: Array, frequencies: Array, overtones: int, held: tuple[int, ...] = ()
) -> LineFit:
    """Lines by weighted least squares, with their frequencies (F,) as unknowns (variable projection, Golub and Pereyra
    1973); gross errors are cut at :data:`GROSS_SD` robust sds.

    ``overtones`` 0: all ``frequencies`` are single lines (F may be 0); those of the numbers ``held`` stay as they are.
    """
    frequencies = np.array(frequencies, float)
    keep = np.isfinite(position) & np.isfinite(sd)
    first = min(overtones, 1)  # the first frequency has its overtones with it
    count = len(frequencies)
    errors = np.full(count, np.inf)
    size = 1 + 2 * (overtones + count - first)
    coefficients, normals = np.zeros((4, size)), np.zeros((4, size, size))
    residual = np.full_like(position, np.nan)
    duration = float(np.ptp(time_s)) if len(time_s) else 1.0
    for rounds in range(FIT_ROUNDS):
        omegas = all_lines(frequencies, overtones)
        columns, slopes = basis(time_s, omegas), _slopes(time_s, frequencies, overtones)
        normal, right = np.zeros((count, count)), np.zeros(count)
        residual = np.full_like(position, np.nan)
        for axis in range(4):
            m = keep[:, axis]
            if m.sum() < size + 2:
                coefficients[axis] = 0.0
                coefficients[axis, 0] = np.nanmean(position[:, axis]) if m.any() else 0.0
                continue
            weight = 1 / sd[m, axis]
            rows = columns[m] * weight[:, None]
            coefficients[axis] = np.linalg.lstsq(rows, position[m, axis] * weight, rcond=None)[0]
            normals[axis] = columns[m].T @ columns[m]
            residual[:, axis] = position[:, axis] - columns @ coefficients[axis]
            if not count:
                continue
            directions = np.stack([(slope[m] @ coefficients[axis]) * weight for slope in slopes], -1)
            directions -= rows @ np.linalg.lstsq(rows, directions, rcond=None)[0]
            normal += directions.T @ directions
            right += directions.T @ (residual[m, axis] * weight)
        limit = GROSS_SD * np.maximum(robust_sd(residual), 1e-12)
        kept, keep = keep, np.isfinite(residual) & (np.abs(residual) < limit)
        if not count:
            if np.array_equal(keep, kept):
                break
            continue
        open_ = (np.diag(normal) > 0) & ~np.isin(np.arange(count), held)
        step = np.zeros(count)
        errors = np.full(count, np.inf)
        if open_.any():
            covariance = np.linalg.pinv(normal[np.ix_(open_, open_)], hermitian=True)
            step[open_] = covariance @ right[open_]
            errors[open_] = np.sqrt(np.diag(covariance))
        # A first guess is within a line's width; the main one's may be what a label says.
        most = np.full(count, np.pi / (2 * max(duration, 1e-300)))
        if first:
            most[0] = 0.02 * frequencies[0]
        rests = bool(np.all(np.abs(step) < 1e-3 * errors))
        if not rests and rounds == FIT_ROUNDS - 1:
            break  # the coefficients are those of these frequencies
        frequencies = frequencies + np.clip(step, -most, most)
        if rests:
            break
    inverse = np.array([np.linalg.pinv(one, hermitian=True) for one in normals])
    return LineFit(frequencies, errors, overtones, coefficients, residual, keep, inverse, held)


def _slopes(time_s: Array, frequencies: Array, overtones: int) -> list[Array]:
    """Derivatives of :func:`basis` with respect to each frequency."""
    omegas = all_lines(frequencies, overtones)
    slopes = []
    for j in range(len(frequencies)):
        columns = np.zeros((len(time_s), 1 + 2 * len(omegas)))
        own = range(overtones) if overtones and j == 0 else [j + max(overtones - 1, 0)]
        for k in own:
            ratio = k + 1 if overtones and j == 0 else 1
            w = omegas[k]
            columns[:, 1 + 2 * k] = -ratio * time_s * np.sin(w * time_s)
            columns[:, 2 + 2 * k] = ratio * time_s * np.cos(w * time_s)
        slopes.append(columns)
    return slopes


def robust_sd(residual: Array) -> Array:
    """Robust spread of each column."""
    return np.array([spread(column) for column in residual.T])


@dataclass(frozen=True)
class Excess:
    """What one axis shows above its noise: ``there`` at all; ``omega_rad_per_s`` of the strongest line, and its
    ``power`` over the noise's there."""

    there: bool
    omega_rad_per_s: float
    power: float


def excess(time_s: Array, residual: Array) -> list[Excess]:
    """Whether each column of ``residual`` (N, C), NaN where unknown, holds more than noise: a line, or a band that is
    too strong.

    The noise is taken for AR(1), as the fast end of the spectra shows it.  The same cameras see all columns: their
    noises may differ in size, not in their correlation, which one column of a short run leaves open.
    """
    telling = [k for k, column in enumerate(residual.T) if _tells(column)]
    out = [Excess(False, 0.0, 0.0)] * residual.shape[1]
    if not telling:
        return out
    spectra = {k: _periodogram(residual[:, k]) for k in telling}
    sized = {k: _noise_costs(*spectra[k]) for k in telling}
    together = np.sum([costs for _, costs in sized.values()], 0)
    most = int(np.flatnonzero(together < together.min() + UNSURE)[-1])
    for k in telling:
        spectrum, turn = spectra[k]
        level = np.exp(sized[k][0][most]) * _spectrum(float(CORRELATIONS[most]), turn)
        over = spectrum / np.maximum(level, FINEST**2)
        over[0] = 0.0
        peak = int(np.argmax(over))
        line = over[peak] > np.log(len(over) / BY_CHANCE)
        out[k] = Excess(bool(line or _band_exceeds(over)), _peak(spectrum, peak, time_s), float(over[peak]))
    return out


def noise_correlation(residual: Array) -> float:
    """AR(1) correlation of the noise from frame to frame in ``residual`` (N, C), NaN where unknown, which holds nothing
    but noise or what is slow and of its size: median over its columns."""
    costs = [_noise_costs(*_periodogram(column))[1] for column in residual.T if _tells(column)]
    return float(np.median([CORRELATIONS[int(np.argmin(one))] for one in costs])) if costs else 0.0


def _tells(residual: Array) -> bool:
    known = residual[np.isfinite(residual)]
    return len(known) >= FEWEST_FRAMES and bool(np.any(known))


def _periodogram(residual: Array) -> tuple[Array, Array]:
    """Power of ``residual`` (N,) without its gross errors at angles per frame (both (N // 2 + 1,)); white noise has its
    variance everywhere."""
    known = np.isfinite(residual)
    limit = CLIP_SD * spread(residual)
    window = np.hanning(len(residual))
    values = np.where(known, np.clip(residual, -limit, limit), 0.0) * window
    spectrum = np.abs(np.fft.rfft(values)) ** 2 / float(np.sum((window * known) ** 2))
    return spectrum, np.asarray(np.arange(len(spectrum)) * (2 * np.pi / len(values)), float)


def _noise_costs(spectrum: Array, turn: Array) -> tuple[Array, Array]:
    """Logarithms of the size that AR(1) noise of each of :data:`CORRELATIONS` would have, as the fast end of a
    spectrum shows it, and how badly it explains that end (-2 log L)."""
    bands, shapes = _shapes(len(turn), float(turn[1]))
    weight = np.array([len(band) for band in bands]) / MEDIAN_VARIANCE
    seen = np.array([np.log(max(middle(spectrum[band]), 1e-300) / np.log(2)) for band in bands])
    sizes = (seen - shapes) @ weight / np.sum(weight)
    return sizes, (seen - shapes - sizes[:, None]) ** 2 @ weight


@lru_cache(maxsize=64)
def _shapes(count: int, step: float) -> tuple[list[NDArray[np.int64]], Array]:
    """Places of the bands in a spectrum of ``count`` angles ``step`` apart, and mean logarithms of AR(1) noise there:
    (correlations, bands)."""
    turn: Array = np.asarray(step * np.arange(count), float)
    bands = np.array_split(np.flatnonzero(turn > NOISE_FROM * np.pi), NOISE_BANDS)
    logs = [np.log(_spectrum(float(one), turn)) for one in CORRELATIONS]
    return bands, np.array([[np.mean(log[band]) for band in bands] for log in logs])


def _spectrum(correlation: float, turn: Array) -> Array:
    """Power of AR(1) noise of unit variance at angles ``turn`` per frame."""
    return (1 - correlation**2) / (1 - 2 * correlation * np.cos(turn) + correlation**2)


def _band_exceeds(over: Array) -> bool:
    """Whether a band from zero on, of any octave's width, is too strong.  Neighbours go together in a windowed
    spectrum: half as many are independent."""
    width = 4
    while width < len(over):
        free = 0.5 * (width - 1)
        if np.mean(over[1:width]) > 1 + np.sqrt(2 * np.log(1 / BY_CHANCE) / free) + np.log(1 / BY_CHANCE) / free:
            return True
        width *= 2
    return False


def _peak(spectrum: Array, peak: int, time_s: Array) -> float:
    """Angular frequency of a peak, by a parabola through the logarithms of it and its neighbours."""
    step = 2 * np.pi / (len(time_s) * float(np.median(np.diff(time_s))))
    shift = 0.0
    if 0 < peak < len(spectrum) - 1:
        a, b, c = np.log(np.maximum(spectrum[peak - 1 : peak + 2], 1e-300))
        bend = a - 2 * b + c
        shift = float(np.clip(0.5 * (a - c) / bend, -0.5, 0.5)) if bend < 0 else 0.0
    return (peak + shift) * step
