"""A marker that moves on its body as the body moves: with the Host's acceleration or velocity, or with the disk's spin.

What markers do against each other is what no rigid motion explains.  The pose has taken a part of a loose marker's
motion and spread it over the others; seen along what no pose reaches, one marker's motion explains all of it, and that
of no other marker does.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space

from analysis.flights.cutting.run_data import NO_ANGLE_SD_RAD, RunData
from analysis.gap.cause import Structure, two_sided
from analysis.gap.measurement.body_residuals import (
    FEWEST_FRAMES,
    SHARE_OF_CLOCK,
    SURE_SD,
    loose_m,
    marker_residuals,
    on_body,
    over_runs,
)
from analysis.gap.series import Series
from ovines.robust import residual_sd

Array = NDArray[np.float64]
ACCELERATION, VELOCITY, SPIN = "with the Host's acceleration", "with the Host's velocity", "with the disk's spin"
#: what a marker of a body may go with
GOES_WITH = {"host": (ACCELERATION, VELOCITY), "nes": (SPIN,)}
# A lens may imitate so much of it: where it stretches the picture by a share, a marker moves by this share of its way.
# Fields of smooth residuals of 0.14 to 0.45 px stretched by 0.0018 at the most (eight series of the blind plant).
LENS_SHEAR = 0.003
# One marker's motion explains this share of all that goes with the body's, or it is no marker's: rows that are read one
# after the other, or a lens, move all of them.
ONE_MARKERS_SHARE = 0.8
# A pose takes three numbers of a frame: of two markers one is left, which is neither's own.
FEWEST_MARKERS = 3
# Gross errors count as so many sds.
CLIP_SD = 5.0


@dataclass(frozen=True, eq=False)
class Apart:
    """What the markers of a body do in the ``frames`` (N,) of a run that show all of them, beyond any rigid motion:
    ``values`` (N, Q; m) along the orthonormal ``basis`` (2 M, Q) of what no pose reaches; its rows are the markers one
    after the other, x and y of the room (Host) or of the body (NES)."""

    run: int
    frames: NDArray[np.int64]
    basis: Array
    values: Array


@dataclass(frozen=True, eq=False)
class Loose:
    """A marker of a body by its number, ``with_what`` it moves, and what is reported of it."""

    body: str
    marker: int
    with_what: str
    structure: Structure


def loose_marker(series: Series, body: str, marker: int, with_what: str, size: tuple[float, float]) -> Loose:
    """A marker that moves by a size (m) of a known sd."""
    name, (size_m, sd_m) = series.recordings[0].bodies[body].markers[marker], size
    sure = size_m / sd_m
    goes_with = f"marker {name}, which moves on its body {with_what}"
    structure = Structure(
        "measurement", "all", "x", goes_with, size_m / loose_m(series), sure**2, size_m, "m", two_sided(sure)
    )  # fmt: skip
    return Loose(body, marker, with_what, structure)


def apart(series: Series, body: str) -> Iterator[Apart]:
    """Run by run; nothing of a run with too few such frames."""
    assert series.layouts is not None
    layout = series.layouts[body][:, :2]
    if len(layout) < FEWEST_MARKERS:
        return
    for number, angle, world in marker_residuals(series, body):
        frames = np.flatnonzero(np.isfinite(world).all((1, 2)) & np.isfinite(angle))
        if len(frames) < FEWEST_FRAMES or len(world) != len(series.runs[number].data.time_s):
            continue
        # The Host keeps its angle.
        turn = float(np.median(angle[frames])) if body == "host" else 0.0
        off = (world if body == "host" else on_body(angle, world))[frames]
        c, s = np.cos(turn), np.sin(turn)
        places = layout @ np.array([[c, s], [-s, c]])
        basis = null_space(_rigid(places).T)
        yield Apart(number, frames, basis, off.reshape(len(off), -1) @ basis)


def _rigid(places: Array) -> Array:
    """What a shift along x and y and a turn do to markers at ``places`` (M, 2): (2 M, 3)."""
    out = np.zeros((len(places), 2, 3))
    out[:, 0, 0] = out[:, 1, 1] = 1.0
    out[:, 0, 2], out[:, 1, 2] = -places[:, 1], places[:, 0]
    return out.reshape(-1, 3)


def spin_at(data: RunData) -> Array:
    """Spin of the disk (N,) in the frames of a run; zero where it was hardly seen."""
    seen = np.flatnonzero(np.isfinite(data.angle_rad))
    if len(seen) < FEWEST_FRAMES:
        return np.zeros(len(data.time_s))
    rate = np.gradient(np.unwrap(data.angle_rad[seen]), data.time_s[seen])
    return np.interp(data.time_s, data.time_s[seen], rate)


def angle_at(data: RunData) -> Array:
    """Angle of the disk (N,; rad, going on) in the frames of a run; zero where it was hardly seen."""
    seen = np.flatnonzero(np.isfinite(data.angle_rad) & (data.angle_sd_rad < NO_ANGLE_SD_RAD))
    if len(seen) < FEWEST_FRAMES:
        return np.zeros(len(data.time_s))
    return np.interp(data.time_s, data.time_s[seen], np.unwrap(data.angle_rad[seen]))


def _followed(data: RunData, with_what: str) -> Array:
    """What a marker may go with, in each frame of a run (N, B)."""
    if with_what == SPIN:
        spin = spin_at(data)
        return np.column_stack([spin, spin**2])
    return data.host.at(data.time_s, 2 if with_what == ACCELERATION else 1)[:, :2]


def with_its_body(series: Series, body: str, clock_s: float = 0.0) -> list[Loose]:
    """The marker whose motion on its body follows the body's own most surely, where one does: by more than a lens, or a
    camera that is late by ``clock_s``, may imitate."""
    runs = list(apart(series, body))
    out = []
    for with_what in GOES_WITH[body] if runs else ():
        followed = [_followed(series.runs[one.run].data, with_what)[one.frames] for one in runs]
        found = _one_marker(runs, followed)
        if found is None:
            continue
        marker, size_m, sd_m = found
        spurious_m = 0.0
        if body == "host":
            data = [series.runs[one.run].data for one in runs]
            order, share = (0, LENS_SHEAR) if with_what == ACCELERATION else (1, SHARE_OF_CLOCK * abs(clock_s))
            spurious_m = share * _rms(np.concatenate([one.host.at(one.time_s, order)[:, :2] for one in data]))
        if size_m > max(loose_m(series), spurious_m) and size_m > SURE_SD * sd_m:
            out.append(loose_marker(series, body, marker, with_what, (size_m, sd_m)))
    return sorted(out, key=lambda one: -one.structure.gain)[:1]


def _rms(vectors: Array) -> float:
    return float(np.sqrt(np.mean(np.sum((vectors - vectors.mean(0)) ** 2, 1))))


def _one_marker(runs: list[Apart], followed: list[Array]) -> tuple[int, float, float] | None:
    """The marker whose motion along with ``followed`` (N, B) explains most of what all do so, with the RMS of that
    motion and its sd over runs (m); None where no single one does."""
    scale = np.sqrt(np.mean(np.concatenate(followed) ** 2))
    if not scale > 0:
        return None
    parts = [_Part.of(one, follows / scale) for one, follows in zip(runs, followed, strict=True)]
    markers = len(runs[0].basis) // 2
    explained = [_fit(parts, m)[1] for m in range(markers)]
    marker = int(np.argmax(explained))
    if explained[marker] < ONE_MARKERS_SHARE * _fit(parts, None)[1]:
        return None
    given = _fit(parts, marker)[0]
    size = np.sqrt(sum(_inner(given, part.follows, given) for part in parts) / sum(part.count for part in parts))
    sizes, sds = [], []
    for part in parts:  # each run's own motion over the common one
        own, _, covariance = _fit([part], marker)
        whole = max(_inner(given, part.follows, given), 1e-300)
        along = (part.follows @ given).T.reshape(-1)
        sizes.append(np.array([size * _inner(own, part.follows, given) / whole]))
        sds.append(np.array([size * part.noise * np.sqrt(max(float(along @ covariance @ along), 1e-300)) / whole]))
    mean, sd = over_runs(sizes, sds)
    return marker, float(mean[0]), float(sd[0])


def _inner(one: Array, follows: Array, other: Array) -> float:
    """Sum over frames of the product of two motions (B, 2)."""
    return float(np.sum((one.T @ follows) * other.T))


@dataclass(frozen=True, eq=False)
class _Part:
    """A run's sums: ``follows`` (B, B) of what is followed, ``weighted`` (B, 2 M) of that times what the markers do,
    their ``basis`` (2 M, Q), the ``count`` of frames and the ``noise`` (m) of a value."""

    follows: Array
    weighted: Array
    basis: Array
    count: int
    noise: float

    @classmethod
    def of(cls, one: Apart, follows: Array) -> _Part:
        follows = follows - follows.mean(0)
        values = one.values - one.values.mean(0)
        bent = np.linalg.lstsq(follows, values, rcond=None)[0]
        left = values - follows @ bent
        noise = float(np.median([residual_sd(column) for column in left.T]))
        limit = CLIP_SD * np.array([residual_sd(column) for column in left.T])
        values = follows @ bent + np.clip(left, -limit, limit)
        return cls(follows.T @ follows, follows.T @ values @ one.basis.T, one.basis, len(follows), noise)


def _fit(parts: list[_Part], marker: int | None) -> tuple[Array, float, Array]:
    """How one marker (None: all) moves with a unit of what is followed (B, 2), by how much that lowers the sum of
    squares, and the covariance of those numbers, flat and marker's axis first, for noise of 1."""
    own = slice(None) if marker is None else slice(2 * marker, 2 * marker + 2)
    matrix = sum(np.kron(part.basis[own] @ part.basis[own].T, part.follows) for part in parts)
    right = sum(part.weighted[:, own].T.reshape(-1) for part in parts)
    inverse = np.linalg.pinv(matrix, hermitian=True)
    given = inverse @ right
    return given.reshape(-1, len(parts[0].follows)).T, float(given @ right), inverse
