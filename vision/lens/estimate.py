"""The lens fields of a pair of cameras, estimated jointly over the runs of a series, and whether to use them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial, reduce
from operator import add

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.linalg import block_diag, eigh

from ovines.camera import Camera
from ovines.camera.bends import PERIODS_RAD, PictureChange
from ovines.recording import Recording
from ovines.workers.threads import in_threads
from vision.lens.changes import Block, Changed, find_changes
from vision.lens.lattice import Lattice, lattice_over
from vision.lens.open_terms import MOST_PLACES, OPEN_TERMS, open_terms
from vision.lens.prior import FIRST_GUESS, LENGTHS_PX, calibration_part, smooth_prior
from vision.lens.residuals import NormalEquations, Sightings, accumulate, linear_parts, markers_of, sightings_of
from vision.lens.stretch import LEAST_STRETCH_SD, NOT_STRETCHED, ODDS_SD, SUSPECT, Stretched, most_stretched
from vision.smooth_field import AMPLITUDES_PX, Solved, likeliest, rooted

Array = NDArray[np.float64]

FEWEST_FRAMES = 200  # with Host and NES in both views, over all runs
SURE_SD = 5.0  # a field that predicts the other halves of the runs by less than this is not used
# Fields that the noise is looked for in: any that are smooth and larger than what may be there.
_NOISE_AMPLITUDE_PX, _NOISE_LENGTH_PX, _NOISE_WAYS = 0.5, 200.0, 80
_SEEN = 1e-6  # smallest eigenvalue of their normal equations over the largest that still counts
_LEAST_WEIGHT = 1e-3  # of an amplitude and length, over the likeliest
_LEAST_NOISE = 1e-6  # of an exact film: weights stay finite
_FEWEST_SITES = 5  # along u and v: a cubic spline needs four nodes
_NODES_PER_SITE = 2  # of the table, so that a cubic spline through its values is the field


@dataclass(frozen=True, eq=False)
class LensEstimate:
    """Tables ``lens_field`` (None where no field is used) and ``lens_terms``; ``note`` says what was found; ``loose``:
    markers that move on their bodies, of which nothing was learnt; ``changes`` of the cameras' pictures since their
    calibration that have a form, and are in the field."""

    field: pd.DataFrame | None
    terms: pd.DataFrame
    note: str
    loose: tuple[str, ...] = ()
    changes: tuple[PictureChange, ...] = ()


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


@dataclass(frozen=True, eq=False)
class _Learnt:
    """An estimate, the marker that its fields stretch most, and those fields, where they are used."""

    estimate: LensEstimate
    stretched: Stretched = NOT_STRETCHED
    posterior: Posterior | None = None


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
    named = set().union(*(one["camera"].unique() for one in tracks)) if tracks else set()
    pair = sorted((camera for camera in cameras if camera.name in named), key=lambda camera: camera.name)
    if len(pair) != 2:
        return _nothing(0, "not two cameras")
    sightings = [sightings_of(one, pair, recording) for one, recording in zip(tracks, recordings, strict=True)]
    runs = [one for one in sightings if one is not None and len(one.frame)]
    if len({tuple(one.body) for one in runs}) != 1:
        return _nothing(0, "Host and NES with their layouts are not in all runs" if not runs else "runs differ")
    pixels = np.concatenate([one.uv_px.reshape(-1, 2, 2) for one in runs])
    lattices = [lattice_over(pixels[:, c]) for c in range(2)] if np.isfinite(pixels).any() else []
    return _of_rigid_bodies(runs, markers_of(recordings[0]), partial(_learnt, pair, covariance, lattices))


def _of_rigid_bodies(
    runs: Sequence[Sightings], names: Sequence[str], learn: Callable[[Sequence[Sightings]], _Learnt]
) -> LensEstimate:
    """What ``learn`` makes of ``runs`` without markers that move on their bodies, the worst first left out: those that
    alone ask for a field, or for another one than all others, or for more than a lens does."""
    loose: list[str] = []
    learnt = learn(runs)
    while (stretched := learnt.stretched).over > SUSPECT:
        fewer = [left for one in runs if len((left := one.without(stretched.marker)).frame)]
        enough = _frames(fewer) >= FEWEST_FRAMES
        without = learn(fewer) if enough else None
        # A lens that has changed may stretch a picture more; it does so whichever markers show it.
        changed = without is not None and len(without.estimate.changes) > 0
        if (stretched.over <= 1 or changed) and not (without is not None and _at_odds(stretched, without)):
            break
        loose.append(names[stretched.marker])
        if without is None:
            why = f"{', '.join(loose)} move on their body, which has too few other markers"
            return replace(_nothing(_frames(fewer), why), loose=tuple(loose))
        runs, learnt = fewer, without
    found = learnt.estimate
    told = f"; nothing is learnt of {', '.join(loose)}, which moves on its body" if loose else ""
    return replace(found, note=found.note + told, loose=tuple(loose))


def _at_odds(stretched: Stretched, without: _Learnt) -> bool:
    """Whether the fields that were learnt without a marker do not stretch its way so."""
    if without.estimate.field is None or without.posterior is None:
        return True
    off = stretched.stretch - stretched.along @ without.posterior.mean
    covariance = stretched.along @ without.posterior.covariance @ stretched.along.T + LEAST_STRETCH_SD**2 * np.eye(2)
    return bool(off @ np.linalg.solve(covariance, off) > ODDS_SD**2)


def _frames(runs: Sequence[Sightings]) -> int:
    return sum(len(one.frame) for one in runs)


def _learnt(
    pair: Sequence[Camera], covariance: pd.DataFrame | None, lattices: Sequence[Lattice], runs: Sequence[Sightings]
) -> _Learnt:
    """What the runs tell."""
    frames = _frames(runs)
    if frames < FEWEST_FRAMES:
        return _Learnt(_nothing(frames, f"{frames} frames with both bodies in both views"))
    if min(min(one.n_u, one.n_v) for one in lattices) < _FEWEST_SITES:
        return _Learnt(_nothing(frames, "all markers within one spacing of the splines"))
    try:
        return _estimate(runs, pair, covariance, lattices)
    except np.linalg.LinAlgError:  # markers that lie on one spot, or never move
        return _Learnt(_nothing(frames, "the bodies leave the equations singular"))


def _estimate(
    runs: Sequence[Sightings], pair: Sequence[Camera], covariance: pd.DataFrame | None, lattices: Sequence[Lattice]
) -> _Learnt:
    frames = _frames(runs)
    halves = in_threads(_half, [(runs, pair, lattices, late) for late in (False, True)])
    if not all(np.isfinite(one.matrix).all() and np.isfinite(one.right).all() for half in halves for one in half):
        return _Learnt(_nothing(frames, "pixels that no camera can see"))
    noise = _noise_variance([one for half in halves for one in half], lattices)
    blocks = [_fields_only(reduce(add, half), noise) for half in halves]
    height_m = float(np.nanmedian(runs[0].points_m[:, runs[0].body >= 0, 2]))
    calibration = calibration_part(lattices, pair, covariance, height_m)
    whole = (blocks[0][0] + blocks[1][0], blocks[0][1] + blocks[1][1])
    posterior = _posterior(whole, lattices, calibration)
    changed = _changes(runs, pair, lattices, halves, noise, whole, calibration, posterior)
    if changed.changes:
        posterior = _posterior(whole, lattices, calibration + changed.prior)
    sureness, gain = _held_out(blocks, posterior.expected)
    used = sureness > SURE_SD and gain > 0
    quality = {
        "used": (float(used), np.nan),
        "frames": (float(frames), np.nan),
        "held_out_sds": (sureness, 1.0),
        "held_out_squares": (gain, np.nan),
        "noise_over_sd": (float(np.sqrt(noise)), np.nan),
    }
    terms = _terms_table(quality, posterior, open_terms(lattices, pair, runs), changed.changes if used else ())
    words = (
        f"lens field of {posterior.amplitude_px:.2g} px over {posterior.length_px:.0f} px"
        if used
        else "no lens field is used"
    )
    note = f"{words}: it predicts the other halves of the runs by {sureness:.1f} sd ({frames} frames)"
    if not used:
        return _Learnt(LensEstimate(None, terms, note))
    for one in changed.changes:
        note += f"; since its calibration the picture of {one.camera} has changed by {one.size_px:.2g} px ({one.words})"
    worst = most_stretched(runs, lattices, posterior.mean, calibration)
    found = LensEstimate(field_table(posterior, lattices, pair), terms, note, (), changed.changes)
    return _Learnt(found, worst, posterior)


def _changes(
    runs: Sequence[Sightings],
    pair: Sequence[Camera],
    lattices: Sequence[Lattice],
    halves: Sequence[Sequence[NormalEquations]],
    noise: float,
    whole: Block,
    calibration: Array,
    posterior: Posterior,
) -> Changed:
    """Changes of the pictures that have a form, beside a smooth field of the likeliest length."""
    smooth = smooth_prior(lattices, posterior.length_px)

    once = rooted(*whole, smooth) if not calibration.any() else None

    def solve(data: Block, amplitude_px: float) -> Solved:
        if calibration.any():
            return rooted(*data, amplitude_px**2 * smooth + calibration).solved()
        return (once if once is not None and data is whole else rooted(*data, smooth)).solved(amplitude_px)

    def by_run() -> list[Block]:
        return [_fields_only(first + second, noise) for first, second in zip(*halves, strict=True)]

    pixels = np.concatenate([one.uv_px[:, one.body >= 0].reshape(-1, 2, 2) for one in runs])
    pixels = pixels[np.isfinite(pixels).all((-1, -2))]
    pixels = pixels[:: max(1, len(pixels) // MOST_PLACES)]
    return find_changes(whole, by_run, solve, posterior.amplitude_px, lattices, pair, [pixels[:, 0], pixels[:, 1]])


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


def _noise_variance(parts: Sequence[NormalEquations], lattices: Sequence[Lattice]) -> float:
    """Variance of whitened residuals as the parts' disagreement shows it: that of a frame, times what its correlation
    from frame to frame makes of a mean.

    What one joint solution leaves in a part is fitted by smooth fields once more: noise alone gives each of their
    numbers the variance that is looked for.
    """
    whole = reduce(add, parts)
    smooth = smooth_prior(lattices, _NOISE_LENGTH_PX)
    prior = block_diag(np.linalg.inv(_NOISE_AMPLITUDE_PX**2 * smooth), np.diag(whole.prior))
    joint = np.linalg.solve(whole.matrix + prior, whole.right)
    n_ways = min(_NOISE_WAYS, whole.n_field)
    ways = np.zeros((len(joint), n_ways))
    ways[: whole.n_field] = eigh(smooth, subset_by_index=(whole.n_field - n_ways, whole.n_field - 1))[1]
    gains, ranks = zip(*(_explained(one, joint, ways) for one in parts), strict=True)
    return max(sum(gains) / max(sum(ranks) - n_ways, 1), _LEAST_NOISE)


def _explained(part: NormalEquations, joint: Array, ways: Array) -> tuple[float, int]:
    """What a fit of ``ways`` (P, W) takes off the squares that ``joint`` (P,) leaves, and by how many numbers."""
    values, vectors = np.linalg.eigh(ways.T @ part.matrix @ ways)
    seen = values > _SEEN * values[-1]
    along = vectors[:, seen].T @ (ways.T @ (part.right - part.matrix @ joint))
    return float(np.sum(along**2 / values[seen])), int(seen.sum())


def _fields_only(part: NormalEquations, noise: float) -> tuple[Array, Array]:
    """Information (P, P) and right side (P,) of the fields alone, all else integrated out, in units of the noise."""
    n_field = part.n_field
    others = slice(n_field, None)
    matrix, right = part.matrix / noise, part.right / noise
    solved = np.linalg.solve(
        matrix[others, others] + np.diag(part.prior),
        np.column_stack([matrix[others, :n_field], right[others]]),
    )
    information = matrix[:n_field, :n_field] - matrix[:n_field, others] @ solved[:, :-1]
    return 0.5 * (information + information.T), right[:n_field] - matrix[:n_field, others] @ solved[:, -1]


def _posterior(data: tuple[Array, Array], lattices: Sequence[Lattice], calibration: Array) -> Posterior:
    information, right = data
    smooth = cache(lambda length: smooth_prior(lattices, length))

    def prior_of(at: tuple[int, int]) -> Array:
        return np.asarray(AMPLITUDES_PX[at[0]] ** 2 * smooth(LENGTHS_PX[at[1]]) + calibration)

    by_length = cache(lambda number: rooted(information, right, smooth(LENGTHS_PX[number])))

    def solve(at: tuple[int, int]) -> Solved:
        if calibration.any():
            return rooted(information, right, prior_of(at)).solved()
        return by_length(at[1]).solved(AMPLITUDES_PX[at[0]])

    found = likeliest(solve, (len(AMPLITUDES_PX), len(LENGTHS_PX)), FIRST_GUESS)
    best, tried = found.best, found.tried
    weights = {at: np.exp(solved.evidence - tried[best].evidence) for at, solved in tried.items()}
    likely = [(w / sum(weights.values()), tried[at].covariance()) for at, w in weights.items() if w > _LEAST_WEIGHT]
    means = [covariance @ right for _, covariance in likely]
    mean = np.sum([w * m for (w, _), m in zip(likely, means, strict=True)], 0)
    spread = [w * (c + np.outer(m - mean, m - mean)) for (w, c), m in zip(likely, means, strict=True)]
    amplitude, length = AMPLITUDES_PX[best[0]], LENGTHS_PX[best[1]]
    return Posterior(mean, np.sum(spread, 0), amplitude, length, prior_of(best))


def _held_out(blocks: Sequence[tuple[Array, Array]], prior: Array) -> tuple[float, float]:
    """By how many sds fields learnt from each half of the runs explain the other half, and what they take off its
    squares.
    """
    along = square = 0.0
    for (information, right), other in ((blocks[0], blocks[1]), (blocks[1], blocks[0])):
        learnt = rooted(*other, prior).solved().mean(other[1])
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
    quality: dict[str, tuple[float, float]], posterior: Posterior, by_field: Array, changes: Sequence[PictureChange]
) -> pd.DataFrame:
    """Table ``lens_terms``: ``quality`` (value, sd), the prior found, the open terms, ``by_field`` along the
    field's coefficients, with and without the recordings, and the ``changes`` that are in the field."""
    rows = [
        *((term, *told) for term, told in quality.items()),
        ("amplitude_px", posterior.amplitude_px, np.nan),
        ("length_px", posterior.length_px, np.nan),
    ]
    for term, along in zip(OPEN_TERMS, by_field, strict=True):
        rows.append((term, float(along @ posterior.mean), float(np.sqrt(along @ posterior.covariance @ along))))
        rows.append((f"{term}_before", 0.0, float(np.sqrt(along @ posterior.expected @ along))))
    for one in changes:
        rows.append((f"{one.target}:{one.camera}", one.value, one.sd))
        if one.target in PERIODS_RAD:
            rows.append((f"{one.target}_direction_rad:{one.camera}", one.direction_rad, one.direction_sd_rad))
    return pd.DataFrame(rows, columns=["term", "value", "sd"])
