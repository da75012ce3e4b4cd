"""Series without what laws of cameras, markers and clocks say: pictures and markers moved back, delays taken out, times
corrected."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.interpolate import Akima1DInterpolator

from analysis.flights.cutting.runs import Run
from analysis.gap.laws.frames.bodies.card import without_card
from analysis.gap.laws.frames.bodies.markers import BODIES, without_markers
from analysis.gap.laws.frames.bodies.own_way import without_way
from analysis.gap.laws.frames.bodies.seen_disk import without_seen_disk
from analysis.gap.laws.frames.bodies.seen_host import without_seen_host
from analysis.gap.laws.frames.bodies.sharpened import without_neighbours
from analysis.gap.laws.frames.bodies.tilt import without_tilt
from analysis.gap.laws.frames.evidence.known import known_frames
from analysis.gap.laws.frames.evidence.rows import key_of, size_of
from analysis.gap.series import Series, with_times, with_tracks
from ovines.camera import Camera, midpoints
from ovines.camera.bends import BENDS, bend_px
from ovines.camera.boards import board_bend_px
from ovines.core.laws.targets import (
    BOARDS,
    CLOCK,
    HOST_PLACE,
    HOST_TILT,
    MARKER_NEIGHBOUR,
    MARKER_WAY,
    NES_CARD,
    NES_PICTURE,
    NES_PLACE,
)
from ovines.core.laws.terms import Term, WrittenLaw
from ovines.errors import InputError
from ovines.recording import Recording

Array = NDArray[np.float64]
# A path is not interpolated over a longer gap (periods), nor from fewer frames: Akima's curve needs five.
LONGEST_GAP, FEWEST = 2.5, 5
# Rounds in which the place is found that was seen bent: a bend changes by some thousandths over its own size.
BENT_BACK = 3
# What moves markers, and what moves them back, in this order.
_MOVED: tuple[tuple[Sequence[str], Callable[[Series, Sequence[Term]], Series]], ...] = (
    ((MARKER_WAY,), without_way),
    ((MARKER_NEIGHBOUR,), without_neighbours),
    (tuple(BODIES), without_markers),
    (NES_PLACE, without_seen_disk),
    (NES_CARD, without_card),
    ((HOST_PLACE,), without_seen_host),
    ((HOST_TILT,), without_tilt),
)


def without_frame_laws(series: Series, laws: Sequence[WrittenLaw]) -> Series:
    """``series`` measured again without what ``laws`` of the measurement, in the world, do to its frames; `InputError`
    where a camera or a marker is named that the series does not bring."""
    terms = [term for law in laws for term in series.frame.law(law).terms]
    if not terms:
        return series
    moved = [target for targets, _ in _MOVED for target in targets]
    of_cameras = [term for term in terms if term.target not in (CLOCK, *moved)]
    if of_cameras:
        series = _without_cameras(series, of_cameras)
    for targets, without in _MOVED:
        own = [term for term in terms if term.target in targets]
        if own:
            series = without(series, own)
    late = [term for term in terms if term.target == CLOCK]
    if not late:
        return series

    return with_times(series, lambda time_s, run: _true_times(late, time_s, run))


def true_times(series: Series, law: WrittenLaw) -> list[Array]:
    """Times (N,) of each run's frames by a law of the clock, in whatever order they are then."""
    return [_true_times(law.terms, run.data.time_s, run) for run in series.runs]


def _true_times(late: Sequence[Term], time_s: Array, run: Run) -> Array:
    return time_s + given(late, known_frames(time_s, run.data, run.flights))


def given(terms: Sequence[Term], known: Array) -> Array:
    """Sum (N,) of the terms in each frame."""
    return np.asarray(size_of(terms, known).sum(1), float)


def _without_cameras(series: Series, terms: Sequence[Term]) -> Series:
    if series.tracks is None or series.cameras is None or series.triangulate is None:
        raise InputError(
            "a law of a camera, and a series without tracks of two cameras",
            "tracks.parquet or frames in every recording",
            "leave the law away, or bring the tracks",
        )
    _refuse_strange(terms, len(series.cameras))
    tracks = tuple(_corrected(one, run, series, terms) for one, run in zip(series.tracks, series.runs, strict=True))
    return with_tracks(series, tracks)


def _refuse_strange(terms: Sequence[Term], cameras: int) -> None:
    strange = max((int(term.x) for term in terms), default=-1)
    if strange >= cameras:
        raise InputError(f"a law of camera {strange + 1}", f"one of the {cameras} cameras", "correct x of its terms")


def _corrected(tracks: pd.DataFrame, run: Run, series: Series, terms: Sequence[Term]) -> pd.DataFrame:
    assert series.cameras is not None
    parts = []
    for number, camera in enumerate(series.cameras):
        own = tracks[tracks["camera"] == camera.name]
        late = [t for t in terms if key_of(t) == ("camera_delay", number)]
        known = known_frames(own["time_s"].to_numpy(float), run.data, run.flights)
        bent = [t for t in terms if t.target in BENDS and int(t.x) == number]
        if bent:
            own = _bent_back(own, camera, series.recordings[0], bent, size_of(bent, known))
        turning = [[t for t in terms if key_of(t) == (name, number)] for name in NES_PICTURE]
        if any(turning):
            disk = own["marker"].isin(list(series.recordings[0].bodies["nes"].markers)).to_numpy(float)
            u_px, v_px = (disk * given(one, known) if one else 0.0 for one in turning)
            own = own.assign(u_px=own["u_px"] - u_px, v_px=own["v_px"] - v_px)
        if late:
            own = _on_time(own, given(late, known), LONGEST_GAP * run.data.period_s)
        parts.append(own)
    rest = tracks[~tracks["camera"].isin([camera.name for camera in series.cameras])]
    return pd.concat([*parts, rest]).sort_values(["frame", "camera", "marker"], ignore_index=True)


def _bent_back(
    own: pd.DataFrame, camera: Camera, recording: Recording, bent: Sequence[Term], amount: Array
) -> pd.DataFrame:
    """Tracks of one camera without what ``bent`` terms do to its picture, by their ``amount`` (N, T) at each row."""
    offset = np.asarray(recording.window_offset_px.get(camera.name, (0, 0)), float)
    seen_px = own[["u_px", "v_px"]].to_numpy(float) + offset - camera.matrix[:2, 2]
    moved_px = np.zeros_like(seen_px)
    for _ in range(BENT_BACK):
        place_px = seen_px - moved_px
        moved_px = sum(
            (size[:, None] * bend_px(t.target, t.y, place_px) for t, size in zip(bent, amount.T, strict=True)),
            np.zeros_like(seen_px),
        )
    return own.assign(u_px=own["u_px"] - moved_px[:, 0], v_px=own["v_px"] - moved_px[:, 1])


def without_lasting_bends(
    tracks: pd.DataFrame, cameras: Sequence[Camera], recording: Recording, laws: Sequence[WrittenLaw]
) -> pd.DataFrame:
    """``tracks`` of one recording without what ``laws`` say of its cameras' pictures, or of the boards that these were
    calibrated on, in all frames alike; cameras are numbered as the recording has them."""
    terms = [term for law in laws for term in law.terms if lasts(term)]
    by_boards = [term for term in terms if term.target in BOARDS]
    terms = [term for term in terms if term.target in BENDS]
    _refuse_strange(terms, len(cameras))
    if by_boards:
        tracks = _without_boards(tracks, cameras, recording, by_boards)
    parts = [tracks[~tracks["camera"].isin([camera.name for camera in cameras])]]
    for number, camera in enumerate(cameras):
        own, bent = tracks[tracks["camera"] == camera.name], [t for t in terms if int(t.x) == number]
        amount = np.tile([t.coefficient for t in bent], (len(own), 1))
        parts.append(_bent_back(own, camera, recording, bent, amount) if bent else own)
    return pd.concat(parts).sort_index() if terms else tracks


def _without_boards(
    tracks: pd.DataFrame, cameras: Sequence[Camera], recording: Recording, terms: Sequence[Term]
) -> pd.DataFrame:
    """``tracks`` without what boards that were not true do to every camera; at the markers' height."""
    height_m = _markers_height_m(tracks, cameras, recording)
    out = tracks.copy()
    for camera in cameras:
        own = (tracks["camera"] == camera.name).to_numpy()
        offset = np.asarray(recording.window_offset_px.get(camera.name, (0, 0)), float)
        seen_px = tracks.loc[own, ["u_px", "v_px"]].to_numpy(float) + offset
        moved_px = np.zeros_like(seen_px)
        for _ in range(BENT_BACK):
            moved_px = sum(
                (
                    t.coefficient * board_bend_px(t.target, t.x, t.y, camera, height_m, seen_px - moved_px)
                    for t in terms
                ),
                np.zeros_like(seen_px),
            )
        out.loc[own, ["u_px", "v_px"]] = seen_px - moved_px - offset
    return out


def _markers_height_m(tracks: pd.DataFrame, cameras: Sequence[Camera], recording: Recording) -> float:
    """Median height of the moving bodies' markers that the first two cameras both see."""
    moving = [m for name in BODIES.values() if name in recording.bodies for m in recording.bodies[name].markers]
    views = []
    for camera in cameras[:2]:
        own = tracks[(tracks["camera"] == camera.name) & tracks["marker"].isin(moving)]
        offset = np.asarray(recording.window_offset_px.get(camera.name, (0, 0)), float)
        views.append(own.set_index(["frame", "marker"])[["u_px", "v_px"]] + offset)
    both = pd.concat(views, axis=1, join="inner").to_numpy(float)
    if len(views) < 2 or len(both) == 0:
        raise InputError(
            "a law of calibration boards, and no marker that two cameras see",
            "tracks of two cameras",
            "leave the law away, or bring the tracks",
        )
    return float(np.nanmedian(midpoints(cameras[:2], [both[:, :2], both[:, 2:]])[:, 2]))


def lasts(term: Term) -> bool:
    """Whether a term bends a camera's picture, or those of all, in all frames alike."""
    return term.target in (*BENDS, *BOARDS) and not term.factors


def changing(laws: Sequence[WrittenLaw]) -> list[WrittenLaw]:
    """``laws`` without their terms that bend a picture in all frames alike."""
    left = [tuple(term for term in law.terms if not lasts(term)) for law in laws]
    return [WrittenLaw(terms) for terms in left if terms]


def _on_time(tracks: pd.DataFrame, late_s: Array, longest_s: float) -> pd.DataFrame:
    """Tracks of a camera whose frames were taken ``late_s`` (N,) after their times, at their times: between the frames
    about each, where the marker was seen there."""
    out = []
    for _, own in tracks.assign(late_s=late_s).groupby("marker", sort=False):
        own = own.sort_values("frame")
        time_s = own["time_s"].to_numpy(float)
        taken_s = time_s + own["late_s"].to_numpy(float)
        apart = np.flatnonzero((np.diff(taken_s) > longest_s) | (np.diff(taken_s) <= 0))
        pixels = own[["u_px", "v_px"]].to_numpy(float)
        moved = np.full_like(pixels, np.nan)
        for part in np.split(np.arange(len(own)), apart + 1):
            if len(part) >= FEWEST:
                inside = (time_s >= taken_s[part[0]]) & (time_s <= taken_s[part[-1]])
                moved[inside] = Akima1DInterpolator(taken_s[part], pixels[part])(time_s[inside])
        own = own.assign(u_px=moved[:, 0], v_px=moved[:, 1])
        out.append(own[np.isfinite(moved[:, 0])])
    return pd.concat(out).drop(columns="late_s") if out else tracks
