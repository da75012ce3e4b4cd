"""The lens fields of a pair of cameras, estimated jointly over the runs of a series, and whether to use them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from dataclasses import field as given
from functools import partial, reduce
from operator import add

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ovines.camera import Camera
from ovines.camera.changes import PictureChange
from ovines.lens_field import LensField, lens_fields
from ovines.recording import Recording
from ovines.workers.threads import in_threads
from vision.lens.changes import Block, Changed, find_changes
from vision.lens.forms import StereoCoverage
from vision.lens.lattice import Lattice, lattice_over
from vision.lens.open_terms import MOST_PLACES, open_terms
from vision.lens.posterior import Posterior, fields_only, held_out, noise_variance, posterior_of
from vision.lens.prior import calibration_part, smooth_prior
from vision.lens.residuals import (
    NormalEquations,
    StereoObservations,
    accumulate,
    layouts_scale,
    linear_parts,
    markers_of,
    observations_of,
)
from vision.lens.stretch import NOT_STRETCHED, ODDS_SD, SUSPECT, Stretched, most_stretched
from vision.lens.tables import field_table, terms_table
from vision.smooth_field import Solved, rooted

Array = NDArray[np.float64]

FEWEST_FRAMES = 200  # with Host and NES in both views, over all runs
FEWEST_OF_RUN = 2  # a run has two halves
SURE_SD = 5.0  # a field that predicts the other halves of the runs by less than this is not used
_FEWEST_SITES = 5  # along u and v: a cubic spline needs four nodes


@dataclass(frozen=True, eq=False)
class LensEstimate:
    """Tables ``lens_field`` (None where no field is used) and ``lens_terms``; ``note`` says what was found; ``loose``:
    markers that move on their bodies, of which nothing was learnt; ``changes`` of the cameras' pictures since their
    calibration that have a form, and are in the field; ``bends_px`` camera -> RMS of the rest of it where markers went,
    about its mean there; ``held_out_sds`` by which the field predicts the halves of runs it was not learnt from."""

    field: pd.DataFrame | None
    terms: pd.DataFrame
    note: str
    loose: tuple[str, ...] = ()
    changes: tuple[PictureChange, ...] = ()
    bends_px: Mapping[str, float] = given(default_factory=dict)
    held_out_sds: float = 0.0

    @property
    def fields(self) -> dict[str, LensField]:
        """The field of each camera, by its name; none where none is used."""
        return {} if self.field is None else lens_fields(self.field, self.terms)


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
    tracks
        Table ``tracks`` of each run (window pixels).
    recordings
        The runs they belong to.
    cameras
        As calibrated; the two that the tracks name are used.
    covariance
        Table ``calibration_covariance``, where there is one.

    Returns
    -------
    LensEstimate
        A field per camera where one lowers the misfit of the halves of the runs that it was not learnt from by more
        than chance; else none, and ``lens_terms`` says why.

    Examples
    --------
    Do two runs show anything that the lens models leave over?

    >>> from ovines.notebook import read_calibration, read_series, read_table
    >>> from vision.lens.estimate import learn_lens_field
    >>> recordings = read_series("sample_data/series_tilted")[:2]
    >>> tracks = [read_table(one.folder / "tracks.parquet", "tracks") for one in recordings]
    >>> learnt = learn_lens_field(tracks, recordings, read_calibration(recordings[0].calibration_file))
    >>> learnt.field is None, learnt.note.split(":")[0]
    (True, 'no lens field is used')
    """
    named = set().union(*(one["camera"].unique() for one in tracks)) if tracks else set()
    pair = sorted((camera for camera in cameras if camera.name in named), key=lambda camera: camera.name)
    if len(pair) != 2:
        return _nothing(0, "not two cameras")
    observations = [observations_of(one, pair, recording) for one, recording in zip(tracks, recordings, strict=True)]
    runs = [one for one in observations if one is not None and len(one.frame) >= FEWEST_OF_RUN]
    if len({tuple(one.body) for one in runs}) != 1:
        return _nothing(0, "Host and NES with their layouts are not in all runs" if not runs else "runs differ")
    pixels = np.concatenate([one.uv_px.reshape(-1, 2, 2) for one in runs])
    lattices = [lattice_over(pixels[:, c]) for c in range(2)] if np.isfinite(pixels).any() else []
    return _of_rigid_bodies(runs, markers_of(recordings[0]), partial(_learnt, pair, covariance, lattices))


def _of_rigid_bodies(
    runs: Sequence[StereoObservations], names: Sequence[str], learn: Callable[[Sequence[StereoObservations]], _Learnt]
) -> LensEstimate:
    """What ``learn`` makes of ``runs`` without markers that move on their bodies, the worst first left out: those that
    alone ask for a field, or for another one than all others, or for more than a lens does."""
    loose: list[str] = []
    learnt = learn(runs)
    while (stretched := learnt.stretched).over > SUSPECT:
        fewer = [left for one in runs if len((left := one.without(stretched.marker)).frame) >= FEWEST_OF_RUN]
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
    left_out = f"; nothing is learnt of {', '.join(loose)}, which moves on its body" if loose else ""
    return replace(found, note=found.note + left_out, loose=tuple(loose))


def _at_odds(stretched: Stretched, without: _Learnt) -> bool:
    """Whether the fields that were learnt without a marker do not stretch its way so."""
    if without.estimate.field is None or without.posterior is None:
        return True
    off = stretched.stretch - stretched.along @ without.posterior.mean
    covariance = stretched.along @ without.posterior.covariance @ stretched.along.T
    return bool(off @ np.linalg.solve(covariance, off) > ODDS_SD**2)


def _frames(runs: Sequence[StereoObservations]) -> int:
    return sum(len(one.frame) for one in runs)


def _learnt(
    pair: Sequence[Camera],
    covariance: pd.DataFrame | None,
    lattices: Sequence[Lattice],
    runs: Sequence[StereoObservations],
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
    runs: Sequence[StereoObservations],
    pair: Sequence[Camera],
    covariance: pd.DataFrame | None,
    lattices: Sequence[Lattice],
) -> _Learnt:
    frames = _frames(runs)
    halves = in_threads(_half, [(runs, pair, lattices, late) for late in (False, True)])
    if not all(np.isfinite(one.matrix).all() and np.isfinite(one.right).all() for half in halves for one in half):
        return _Learnt(_nothing(frames, "pixels that no camera can see"))
    noise = noise_variance([one for half in halves for one in half], lattices)
    blocks = [fields_only(reduce(add, half), noise) for half in halves]
    height_m = float(np.nanmedian(runs[0].points_m[:, runs[0].body >= 0, 2]))
    calibration = calibration_part(lattices, pair, covariance, height_m)
    whole = (blocks[0][0] + blocks[1][0], blocks[0][1] + blocks[1][1])
    posterior = posterior_of(whole, lattices, calibration)

    def of_each() -> list[Block]:  # of a single run its halves
        both = zip(*halves, strict=True)
        return blocks if len(runs) == 1 else [fields_only(one + other, noise) for one, other in both]

    changed = _changes(runs, pair, lattices, (whole, of_each), calibration, posterior)
    if changed.changes:
        posterior = posterior_of(whole, lattices, calibration + changed.prior)
    sureness, gain = held_out(blocks, posterior.expected)
    used = sureness > SURE_SD and gain > 0
    quality = {
        "used": (float(used), np.nan),
        "frames": (float(frames), np.nan),
        "held_out_sds": (sureness, 1.0),
        "held_out_squares": (gain, np.nan),
        "noise_over_sd": (float(np.sqrt(noise)), np.nan),
    }
    terms = terms_table(quality, posterior, open_terms(lattices, pair, runs), changed.changes if used else ())
    words = (
        f"lens field of {posterior.amplitude_px:.2g} px over {posterior.length_px:.0f} px"
        if used
        else "no lens field is used"
    )
    note = f"{words}: it predicts the other halves of the runs by {sureness:.1f} sd ({frames} frames)"
    if not used:
        return _Learnt(LensEstimate(None, terms, note))
    for one in changed.changes:
        what = f"since its calibration the picture of {one.camera} has changed" if one.camera else "the boards were off"
        note += f"; {what} by {one.size_px:.2g} px ({one.words})"
    worst = most_stretched(runs, lattices, posterior.mean, calibration)
    bends = _bends_px(runs, lattices, posterior.mean - changed.field)
    named = dict(zip((camera.name for camera in pair), bends, strict=True))
    found = LensEstimate(field_table(posterior, lattices, pair), terms, note, (), changed.changes, named, sureness)
    return _Learnt(found, worst, posterior)


def _changes(
    runs: Sequence[StereoObservations],
    pair: Sequence[Camera],
    lattices: Sequence[Lattice],
    data: tuple[Block, Callable[[], Sequence[Block]]],
    calibration: Array,
    posterior: Posterior,
) -> Changed:
    """Changes of the pictures that have a form, beside a smooth field of the likeliest length; ``data``: that of all
    runs, and of each."""
    smooth = smooth_prior(lattices, posterior.length_px)

    def solve(own: Block, amplitudes_px: Sequence[float]) -> list[Solved]:
        if calibration.any():
            return [rooted(*own, one**2 * smooth + calibration).solved() for one in amplitudes_px]
        scaled = rooted(*own, smooth)
        return [scaled.solved(one) for one in amplitudes_px]

    pixels, points = _places(runs)
    where = StereoCoverage(pair, lattices, [pixels[:, c] for c in range(2)], points, layouts_scale(runs))
    return find_changes(*data, solve, posterior.amplitude_px, where)


def _places(runs: Sequence[StereoObservations]) -> tuple[Array, Array]:
    """Some thousands of the places where markers of both bodies went: pixels (N, 2 cameras, 2) and points (N, 3)."""
    pixels = np.concatenate([one.uv_px[:, one.body >= 0].reshape(-1, 2, 2) for one in runs])
    points = np.concatenate([one.points_m[:, one.body >= 0].reshape(-1, 3) for one in runs])
    seen = np.flatnonzero(np.isfinite(pixels).all((-1, -2)) & np.isfinite(points).all(-1))
    seen = seen[:: max(1, len(seen) // MOST_PLACES)]
    return pixels[seen], points[seen]


def _bends_px(runs: Sequence[StereoObservations], lattices: Sequence[Lattice], mean: Array) -> list[float]:
    """RMS of the fields ``mean`` (P,) of both cameras where markers went, about their means there."""
    pixels, _ = _places(runs)
    out, first = [], 0
    for c, lattice in enumerate(lattices):
        own = mean[first : first + 2 * lattice.size].reshape(2, -1)
        moved = lattice.basis(pixels[:, c]) @ own.T
        out.append(float(np.sqrt(np.mean(np.sum((moved - moved.mean(0)) ** 2, 1)))))
        first += 2 * lattice.size
    return out


def _nothing(frames: int, why: str) -> LensEstimate:
    terms = pd.DataFrame([("used", 0.0, np.nan), ("frames", float(frames), np.nan)], columns=["term", "value", "sd"])
    return LensEstimate(None, terms, f"no lens field: {why}")


def _half(
    runs: Sequence[StereoObservations], cameras: Sequence[Camera], lattices: Sequence[Lattice], late: bool
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
