"""Errors of the frames of a flight: noise, and a force that no law describes.

Noise is what no law of flight can touch: the residual of a flight's frames when a polynomial through a few of them is
taken out.  Its size (against the sds given) and its correlation from frame to frame come from that alone.  What the
flights miss beyond it is model error: an acceleration of unknown form that stays alike for a while, whose size and
memory the data give (restricted likelihood), and which widens what depends on it - the end of a flight that a law
predicts from its start most of all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky, solve_triangular
from scipy.linalg.lapack import dtrtri
from scipy.special import gammaincinv

from ovines.robust import middle

Array = NDArray[np.float64]

# Beyond it noise is a drift, which no flight tells from motion.
MOST_CORRELATION = 0.98
CORRELATIONS = np.concatenate([np.linspace(0.0, 0.8, 17), np.linspace(0.825, MOST_CORRELATION, 8)])
# Frames of a piece out of which a polynomial is taken: as long as a drive or a friction that turns leaves a polynomial
# of this degree (rig units: 20 ms), short ones with what they have.
PIECE_S, FEWEST_IN_PIECE, MOST_IN_PIECE, DEGREE = 0.02, 6, 24, 4
# A piece above this quantile of chi-square, against the median, holds a wrong point or a kink: it is left out.
TRIMMED = 0.999
# Fall of -2 log L from which noise counts as correlated: below, one series in twenty without would.
CORRELATED = 3.84
# How far the sds given may be off before the data say more (logarithm): noise that stays alike for a piece or longer
# shows its changes only, and larger noise that stays alike for longer would do as well.
LOG_SCALE_SD = 0.3
# Whitened residuals beyond this count linearly (Huber) where a flight's state is fitted: of 600 frames x 3 none by
# chance, even where the noise is larger than stated by a third.
CLIP_SD = 5.0
# ... and beyond this as if they were this large where flights speak of what all share: clipped whole, rows and all, so
# later, where no fitted frame gets by chance.
GROSS_SD = 6.0

# An unknown force below this share of what turns the disk, at its rim, is not worth a word beside it.
SPIN_ALONE = 0.1

# Flights whose whitening is kept (a series of twelve runs has six hundred), and frames of one up to which it is: of the
# usual 25 frames 10 kB each.
FLIGHTS_KEPT, MOST_KEPT = 2048, 64


@dataclass(frozen=True)
class FlightNoise:
    """Errors of one series' frames.

    ``scale``, ``angle_scale``: noise over the sds given; ``correlation`` from frame to frame (AR(1));
    ``acceleration_m_per_s2``, ``spin_rad_per_s2``: sd of an unknown acceleration of the disk (per axis), and of its
    spin; ``memory_s``: time within which it stays alike; ``sure``: probability that there is such a force.
    """

    correlation: float = 0.0
    scale: float = 1.0
    angle_scale: float = 1.0
    acceleration_m_per_s2: float = 0.0
    spin_rad_per_s2: float = 0.0
    memory_s: float = 1.0
    sure: float = 0.0

    @property
    def forced(self) -> bool:
        """Whether there is an unknown force."""
        return self.acceleration_m_per_s2 > 0 or self.spin_rad_per_s2 > 0

    def without_force(self) -> FlightNoise:
        """The noise of the frames alone."""
        return replace(self, acceleration_m_per_s2=0.0, spin_rad_per_s2=0.0, sure=0.0)

    def force_in_words(self, radius_m: float) -> str:
        """The unknown force's size for a reader, of a disk of ``radius_m``."""
        rim = self.spin_rad_per_s2 * radius_m
        if self.acceleration_m_per_s2 < SPIN_ALONE * rim:
            return f"accelerations of about {rim:.2g} m/s² of its rim, by its spin alone,"
        return f"accelerations of about {self.acceleration_m_per_s2:.2g} m/s²"

    def covariance(self, index: NDArray[np.int64], sd: Array, angle_sd: Array) -> tuple[Array, Array]:
        """Noise of places (one axis) and angles of frames ``index`` (N,): (N, N) each."""
        together = correlated(index, self.correlation)
        return together * np.outer(sd, sd) * self.scale**2, together * np.outer(
            angle_sd, angle_sd
        ) * self.angle_scale**2

    def whitening(self, index: NDArray[np.int64], time_s: Array, sd: Array, angle_sd: Array) -> tuple[Array, Array]:
        """Lower triangles (N, N) that turn errors of places (one axis) and of angles into independent ones of unit
        variance.
        """
        if self.correlation == 0 and not self.forced:
            return np.diag(1 / (self.scale * sd)), np.diag(1 / (self.angle_scale * angle_sd))
        if len(index) > MOST_KEPT:
            return self._whitening(index, time_s, sd, angle_sd)
        return _kept_whitening(self, *(np.asarray(one).tobytes() for one in (index, time_s, sd, angle_sd)))

    def _whitening(self, index: NDArray[np.int64], time_s: Array, sd: Array, angle_sd: Array) -> tuple[Array, Array]:
        if not self.forced:
            white = white_frames(index, self.correlation)
            return white / (self.scale * sd), white / (self.angle_scale * angle_sd)
        place, angle = self.covariance(index, sd, angle_sd)
        moved = displacement(time_s, self.memory_s)
        place, angle = place + self.acceleration_m_per_s2**2 * moved, angle + self.spin_rad_per_s2**2 * moved
        return _inverse_root(place), _inverse_root(angle)


PLAIN = FlightNoise()


@lru_cache(maxsize=FLIGHTS_KEPT)
def _kept_whitening(noise: FlightNoise, index: bytes, *times_and_sds: bytes) -> tuple[Array, Array]:
    """A fit, its force's path and what it says of the shared unknowns ask for the same; nobody writes into it."""
    return noise._whitening(np.frombuffer(index, np.int64), *(np.frombuffer(one) for one in times_and_sds))


def correlated(index: NDArray[np.int64], correlation: float) -> Array:
    """Correlation (N, N) of the noise of frames ``index`` (N,), from frame to frame ``correlation``."""
    return np.asarray(correlation ** np.abs(np.subtract.outer(index, index)), float)


def white_frames(index: NDArray[np.int64], correlation: float) -> Array:
    """Lower triangle (N, N) that turns noise of unit variance, of this ``correlation`` from frame to frame, in frames
    ``index`` (N,) into independent one: each frame less what the one before tells of it."""
    out = np.eye(len(index))
    if correlation == 0.0 or len(index) < 2:
        return out
    predicted = correlation ** np.diff(index)
    own = np.sqrt(1 - predicted**2)
    later = np.arange(1, len(index))
    out[later, later], out[later, later - 1] = 1 / own, -predicted / own
    return out


def _inverse_root(covariance: Array) -> Array:
    size = np.sqrt(np.diag(covariance))
    inverse, singular = dtrtri(np.linalg.cholesky(covariance / np.outer(size, size)).T, lower=0)
    if singular:
        raise np.linalg.LinAlgError("frames whose errors go together entirely")
    return np.ascontiguousarray(inverse.T) / size


def response(times_s: Array, zero_s: float, edges_s: Array) -> tuple[Array, Array]:
    """Displacement and velocity (N, C) at ``times_s`` of a disk at rest at ``zero_s``, per unit of acceleration in each
    cell of time.

    ``edges_s`` (C + 1,) of the cells; ``zero_s`` is one of them.  Times before it count backwards."""
    t = times_s[:, None]
    after = [
        np.clip(t - edge, 0.0, None) for edge in (np.maximum(edges_s[:-1], zero_s), np.maximum(edges_s[1:], zero_s))
    ]
    before = [
        np.clip(edge - t, 0.0, None) for edge in (np.minimum(edges_s[1:], zero_s), np.minimum(edges_s[:-1], zero_s))
    ]
    place = 0.5 * (after[0] ** 2 - after[1] ** 2 + before[0] ** 2 - before[1] ** 2)
    return place, (after[0] - after[1]) - (before[0] - before[1])


def cells(times_s: Array, memory_s: float, others_s: Array | None = None) -> Array:
    """Edges (C + 1,) of cells that cover a flight's ``times_s`` (and ``others_s``), one of them at its first: as fine
    as its frames, finer where the memory is shorter."""
    zero = float(times_s[0])
    step = min(middle(np.diff(times_s)) if len(times_s) > 1 else memory_s, 0.5 * memory_s)
    every = times_s if others_s is None else np.concatenate([times_s, others_s])
    return np.asarray(
        zero
        + step
        * np.arange(-np.ceil((zero - every.min()) / step - 1e-9), np.ceil((every.max() - zero) / step - 1e-9) + 1),
        float,
    )


def alike(edges_s: Array, memory_s: float) -> Array:
    """Correlation (C, C) of the unknown acceleration between cells: it is forgotten within ``memory_s``
    (Ornstein-Uhlenbeck).
    """
    middle = 0.5 * (edges_s[1:] + edges_s[:-1])
    return np.asarray(np.exp(-np.abs(np.subtract.outer(middle, middle)) / memory_s), float)


def displacement(times_s: Array, memory_s: float) -> Array:
    """Covariance (N, N) of the displacements that an unknown acceleration of unit sd makes since the first of
    ``times_s``.
    """
    if len(times_s) < 2:
        return np.zeros((len(times_s), len(times_s)))
    edges = cells(times_s, memory_s)
    place, _ = response(times_s, float(times_s[0]), edges)
    return np.asarray(place @ alike(edges, memory_s) @ place.T, float)


@dataclass(frozen=True, eq=False)
class StandardResiduals:
    """Of one flight: frames' numbers ``index`` (N,) and ``residual`` (N, 3: x, y, angle) over the sds given."""

    index: NDArray[np.int64]
    residual: Array


def frame_noise(flights: Sequence[StandardResiduals], period_s: float, angle: bool) -> FlightNoise:
    """Scale and correlation of the noise from pieces of the flights, a polynomial taken out of each; ``period_s`` from
    frame to frame in the rig's own seconds.

    ``angle``: whether the angles are measured.

    Examples
    --------
    Ten flights of noise half as large again as stated, of which a share of 0.6 stays from frame to frame.

    >>> import numpy as np
    >>> from scipy.signal import lfilter
    >>> from analysis.flights.noise import StandardResiduals, frame_noise
    >>> rng = np.random.default_rng(0)
    >>> noise = [1.5 * lfilter([0.8], [1.0, -0.6], rng.normal(size=(200, 3)), axis=0) for _ in range(10)]
    >>> found = frame_noise([StandardResiduals(np.arange(200), one) for one in noise], 1 / 800, angle=True)
    >>> round(found.scale, 1), round(found.correlation, 1)
    (1.5, 0.6)
    """
    length = int(np.clip(round(PIECE_S / period_s), FEWEST_IN_PIECE + 2, MOST_IN_PIECE))
    pieces: dict[int, list[Array]] = {}
    for flight in flights:
        for run in np.split(np.arange(len(flight.index)), np.flatnonzero(np.diff(flight.index) != 1) + 1):
            for part in np.array_split(run, max(len(run) // length, 1)):
                if len(part) >= FEWEST_IN_PIECE:
                    pieces.setdefault(len(part), []).append(flight.residual[part])
    if not pieces:
        return PLAIN
    stacks = {n: np.array(parts) for n, parts in pieces.items()}
    best = None
    for correlation in CORRELATIONS:
        cost, scales = _likelihood(stacks, float(correlation), angle)
        if correlation == 0:
            cost -= CORRELATED
        if best is None or cost < best[0]:
            best = cost, float(correlation), scales
    assert best is not None
    return FlightNoise(best[1], *best[2])


@lru_cache(maxsize=4096)
def _contrasts(count: int, correlation: float) -> tuple[Array, float]:
    """Whitened contrasts (M, N) of ``count`` frames without their polynomial, and the logarithm of the whitening's
    determinant.
    """
    degree = min(DEGREE, count - 3)
    basis = np.linalg.qr(np.vander(np.linspace(-1, 1, count), degree + 1), mode="complete")[0][:, degree + 1 :]
    errors = (
        correlation ** np.abs(np.subtract.outer(np.arange(count), np.arange(count))) if correlation else np.eye(count)
    )
    root = cholesky(basis.T @ errors @ basis, lower=True)
    return solve_triangular(root, basis.T, lower=True), float(np.sum(np.log(np.diag(root))))


def _likelihood(stacks: dict[int, Array], correlation: float, angle: bool) -> tuple[float, tuple[float, float]]:
    """-2 log L of a correlation at its best scales of places and angles; pieces far above the others are left out of
    both.
    """
    cost, scales = 0.0, [1.0, 1.0]
    for which, columns in enumerate((slice(0, 2), slice(2, 3)) if angle else (slice(0, 2),)):
        squares, freedom, volume = [], [], []
        for n, stack in stacks.items():
            contrasts, log_root = _contrasts(n, correlation)
            white = np.einsum("mn,pnc->pmc", contrasts, stack[:, :, columns])
            squares.append(np.sum(white**2, 1).ravel())
            freedom.append(np.full(squares[-1].size, len(contrasts)))
            volume.append(np.full(squares[-1].size, 2 * log_root))
        square, free, log = (np.concatenate(parts) for parts in (squares, freedom, volume))
        known = np.isfinite(square)
        square, free, log = square[known], free[known], log[known]
        if not len(square):
            continue
        usual = float(np.median(square / _chi_square(0.5, free)))
        # A piece's bound does not depend on the correlation tried by more than its own square does.
        kept = square < usual * _chi_square(TRIMMED, free)
        variance = float(square[kept].sum() / max(free[kept].sum(), 1))
        cost += float(free.sum() * np.log(max(variance, 1e-12)) + log.sum())
        scales[which] = float(np.sqrt(max(variance, 1e-12)))
        cost += (np.log(scales[which]) / LOG_SCALE_SD) ** 2
    return cost, (scales[0], scales[1])


def _chi_square(share: float, freedom: NDArray[np.int64]) -> Array:
    """Below which value (N,) a ``share`` of chi-squares of these degrees of ``freedom`` lies."""
    kinds, which = np.unique(freedom, return_inverse=True)
    return np.asarray(2 * gammaincinv(0.5 * kinds, share))[which]


def at_least(noise: FlightNoise, scale: float, angle_scale: float) -> FlightNoise:
    """``noise`` with scales of at least these (what no camera shows: the model's own finest errors)."""
    return replace(noise, scale=max(noise.scale, scale), angle_scale=max(noise.angle_scale, angle_scale))
