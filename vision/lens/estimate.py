"""The lens fields of a pair of cameras, estimated jointly over the runs of a series, and whether to use them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from operator import add

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ovines.camera import Camera
from ovines.recording import Recording
from vision.lens.lattice import Lattice, lattice_over
from vision.lens.open_terms import OPEN_TERMS, open_terms
from vision.lens.prior import AMPLITUDES_PX, LENGTHS_PX, calibration_part, smooth_covariance
from vision.lens.residuals import N_SHARED, NormalEquations, Sightings, accumulate, linear_parts, sightings_of

Array = NDArray[np.float64]

FEWEST_FRAMES = 200  # with Host and NES in both views, over all runs
SURE_SD = 5.0  # a field that predicts the other halves of the runs by less than this is not used
# Prior sds of what is free beside the fields: a marker's place along its body's x, y, z [m], ...
_MARKER_SD_M = (1e-3, 1e-3, 1e-4)
# ... and a tilted plane (x, y) [rad], a late camera [s], a window elsewhere (u, v) [px].
_SHARED_SD = (0.1, 0.1, 1e-2, 100.0, 100.0)
_SEEN = 1e-6  # smallest eigenvalue of scaled normal equations over the largest that still counts
_NODES_PER_SITE = 2  # of the table, so that a cubic spline through its values is the field


@dataclass(frozen=True, eq=False)
class LensEstimate:
    """Tables ``lens_field`` (None where no field is used) and ``lens_terms``; ``note`` says what was found."""

    field: pd.DataFrame | None
    terms: pd.DataFrame
    note: str


@dataclass(frozen=True, eq=False)
class Posterior:
    """The splines of all fields: ``mean`` (P,) and ``covariance`` (P, P) [px], averaged over amplitudes and lengths by
    how well each explains the data; ``amplitude_px``, ``length_px`` the likeliest; ``expected`` (P, P) its prior.
    """

    mean: Array
    covariance: Array
    amplitude_px: float
    length_px: float
    expected: Array


def learn_lens_field(
    tracks: Sequence[pd.DataFrame],
    recordings: Sequence[Recording],
    cameras: Sequence[Camera],
    covariance: pd.DataFrame | None = None,
) -> LensEstimate:
    """What the lens models of two cameras leave over, from all runs filmed with them.

    Parameters
    ----------
    tracks : table ``tracks`` of each run (window pixels)
    recordings : the runs they belong to
    cameras : as calibrated; the two that the tracks name are used
    covariance : table ``calibration_covariance``, where there is one

    Returns
    -------
    A field per camera where one lowers the misfit of the halves of the runs that it was not learnt from by more than
    chance; else none, and ``lens_terms`` says why.
    """
    named = set().union(*(set(one["camera"]) for one in tracks)) if tracks else set()
    pair = sorted((camera for camera in cameras if camera.name in named), key=lambda camera: camera.name)
    if len(pair) != 2:
        return _nothing(0, "not two cameras")
    found = [sightings_of(one, pair, recording) for one, recording in zip(tracks, recordings, strict=True)]
    runs = [one for one in found if one is not None and len(one.frame)]
    if len({tuple(one.body) for one in runs}) != 1:
        return _nothing(0, "Host and NES with their layouts are not in all runs" if not runs else "runs differ")
    frames = sum(len(one.frame) for one in runs)
    if frames < FEWEST_FRAMES:
        return _nothing(frames, f"{frames} frames with both bodies in both views")
    pixels = np.concatenate([one.uv_px.reshape(-1, 2, 2) for one in runs])
    lattices = [lattice_over(pixels[:, c]) for c in range(2)]
    halves = [_half(runs, pair, lattices, late) for late in (False, True)]
    noise = _noise_variance([one for half in halves for one in half])
    blocks = [_fields_only(reduce(add, half), noise) for half in halves]
    height_m = float(np.nanmedian(runs[0].points_m[:, runs[0].body >= 0, 2]))
    calibration = calibration_part(lattices, pair, covariance, height_m)
    whole = (blocks[0][0] + blocks[1][0], blocks[0][1] + blocks[1][1])
    posterior = _posterior(whole, lattices, calibration)
    sureness, gain = _held_out(blocks, posterior.expected)
    used = sureness > SURE_SD and gain > 0
    terms = _terms_table(posterior, lattices, pair, runs, used, sureness, gain, noise, frames)
    words = (
        f"lens field of {posterior.amplitude_px:.2g} px over {posterior.length_px:.0f} px"
        if used
        else "no lens field is used"
    )
    note = f"{words}: it predicts the other halves of the runs by {sureness:.1f} sd ({frames} frames)"
    return LensEstimate(field_table(posterior, lattices, pair) if used else None, terms, note)


def _nothing(frames: int, why: str) -> LensEstimate:
    terms = pd.DataFrame([("used", 0.0, np.nan), ("frames", float(frames), np.nan)], columns=["term", "value", "sd"])
    return LensEstimate(None, terms, f"no lens field: {why}")


def _half(
    runs: Sequence[Sightings], cameras: Sequence[Camera], lattices: Sequence[Lattice], late: bool
) -> list[NormalEquations]:
    """Normal equations of the first or second half of each run."""
    out = []
    for run in runs:
        middle = len(run.frame) // 2
        half = run.between(middle, len(run.frame)) if late else run.between(0, middle)
        parts = [accumulate(one) for one in linear_parts(half, cameras, lattices)]
        if parts:
            out.append(reduce(add, parts))
    return out


def _noise_variance(parts: Sequence[NormalEquations]) -> float:
    """Variance of whitened residuals as the parts' disagreement shows it: that of a frame, times what its correlation
    from frame to frame makes of a mean.

    Each part fitted by itself leaves less than all parts together, by the noise in each number that it fits.
    """
    gains, ranks = zip(*(_explained(one) for one in parts), strict=True)
    gain, rank = _explained(reduce(add, parts))
    return max((sum(gains) - gain) / max(sum(ranks) - rank, 1), 1e-6)


def _explained(part: NormalEquations) -> tuple[float, int]:
    """What a free fit takes off the squares, and by how many numbers."""
    size = np.sqrt(np.maximum(np.diag(part.matrix), 1e-300))
    values, vectors = np.linalg.eigh(part.matrix / np.outer(size, size))
    seen = values > _SEEN * values[-1]
    along = vectors[:, seen].T @ (part.right / size)
    return float(np.sum(along**2 / values[seen])), int(seen.sum())


def _fields_only(part: NormalEquations, noise: float) -> tuple[Array, Array]:
    """Information (P, P) and right side (P,) of the fields alone, all else integrated out, in units of the noise."""
    n_field = part.n_field
    others = slice(n_field, None)
    markers = (len(part.right) - n_field - N_SHARED) // 3
    prior = np.concatenate([np.tile(_MARKER_SD_M, markers), _SHARED_SD]) ** -2.0
    matrix, right = part.matrix / noise, part.right / noise
    solved = np.linalg.solve(
        matrix[others, others] + np.diag(prior), np.column_stack([matrix[others, :n_field], right[others]])
    )
    information = matrix[:n_field, :n_field] - matrix[:n_field, others] @ solved[:, :-1]
    return 0.5 * (information + information.T), right[:n_field] - matrix[:n_field, others] @ solved[:, -1]


def _posterior(data: tuple[Array, Array], lattices: Sequence[Lattice], calibration: Array) -> Posterior:
    information, right = data
    found = []
    for length in LENGTHS_PX:
        smooth = smooth_covariance(lattices, length)
        for amplitude in AMPLITUDES_PX:
            prior = amplitude**2 * smooth + calibration
            evidence, covariance = _solve(information, right, prior)
            found.append((evidence, amplitude, length, covariance))
    best = max(found, key=lambda one: one[0])
    weights = np.exp([one[0] - best[0] for one in found])
    likely = [(w, one[3], one[3] @ right) for w, one in zip(weights / weights.sum(), found, strict=True) if w > 1e-3]
    mean = np.sum([w * m for w, _, m in likely], 0)
    covariance = np.sum([w * (c + np.outer(m - mean, m - mean)) for w, c, m in likely], 0)
    prior = best[1] ** 2 * smooth_covariance(lattices, best[2]) + calibration
    return Posterior(mean, covariance, best[1], best[2], prior)


def _solve(information: Array, right: Array, prior: Array) -> tuple[float, Array]:
    """Log evidence, but for a constant, and the posterior covariance."""
    root = np.linalg.cholesky(prior)
    system = np.eye(len(prior)) + root.T @ information @ root
    factor = np.linalg.cholesky(system)
    half = np.linalg.solve(factor, root.T)
    covariance = half.T @ half
    along = half @ right
    return float(0.5 * along @ along - np.log(np.diag(factor)).sum()), covariance


def _held_out(blocks: Sequence[tuple[Array, Array]], prior: Array) -> tuple[float, float]:
    """By how many sds fields learnt from each half of the runs explain the other half, and what they take off its
    squares.
    """
    along = square = 0.0
    for (information, right), other in ((blocks[0], blocks[1]), (blocks[1], blocks[0])):
        learnt = _solve(*other, prior)[1] @ other[1]
        along += float(right @ learnt)
        square += float(learnt @ information @ learnt)
    return along / float(np.sqrt(max(square, 1e-12))), 2 * along - square


def field_table(posterior: Posterior, lattices: Sequence[Lattice], cameras: Sequence[Camera]) -> pd.DataFrame:
    """Table ``lens_field`` at the nodes of a grid twice as fine as the lattice."""
    tables, at = [], 0
    for lattice, camera in zip(lattices, cameras, strict=True):
        nodes = lattice.nodes_px(_NODES_PER_SITE)
        basis = lattice.basis(nodes)
        columns = {"camera": camera.name, "u_px": nodes[:, 0], "v_px": nodes[:, 1]}
        for axis in "uv":
            own = slice(at, at + lattice.size)
            columns[f"d{axis}_px"] = basis @ posterior.mean[own]
            variance = np.sum((basis @ posterior.covariance[own, own]) * basis, 1)
            columns[f"d{axis}_sd_px"] = np.sqrt(variance)
            at += lattice.size
        tables.append(pd.DataFrame(columns))
    return pd.concat(tables, ignore_index=True)


def _terms_table(
    posterior: Posterior,
    lattices: Sequence[Lattice],
    cameras: Sequence[Camera],
    runs: Sequence[Sightings],
    used: bool,
    sureness: float,
    gain: float,
    noise: float,
    frames: int,
) -> pd.DataFrame:
    by_field = open_terms(lattices, cameras, runs)
    rows = [
        ("used", float(used), np.nan),
        ("frames", float(frames), np.nan),
        ("held_out_sds", sureness, 1.0),
        ("held_out_squares", gain, np.nan),
        ("noise_over_sd", float(np.sqrt(noise)), np.nan),
        ("amplitude_px", posterior.amplitude_px, np.nan),
        ("length_px", posterior.length_px, np.nan),
    ]
    for term, along in zip(OPEN_TERMS, by_field, strict=True):
        rows.append((term, float(along @ posterior.mean), float(np.sqrt(along @ posterior.covariance @ along))))
        rows.append((f"{term}_before", 0.0, float(np.sqrt(along @ posterior.expected @ along))))
    return pd.DataFrame(rows, columns=["term", "value", "sd"])
