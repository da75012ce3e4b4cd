"""Whether a calibration is this recording's: cameras exchanged, or lengths wrong, found before the tracking fails
for no given reason.

The known lengths are those of `layout_m`.  One picture per camera decides which of several calibrations lays the
bodies' markers over the discs that are there.  Nothing is said where the calibration as given explains them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ovines.camera import Camera
from ovines.errors import InputError
from ovines.recording import Recording
from vision.calibration.targets.boards import find_board
from vision.frames.sources import open_sources, stream
from vision.identity.layouts import Layout, layout_of
from vision.identity.matching import Match, match_in_all
from vision.markers.detect import find_discs
from vision.markers.perspective import on_plane
from vision.markers.row import U, V
from vision.tracking.bodies.gates import SEARCH_RADIUS
from vision.tracking.camera_tracker import CameraTracker

Array = NDArray[np.float64]
Offsets = Sequence[tuple[int, int]]
# Share of the markers of a picture that a right calibration explains: some are hidden or blurred.
ENOUGH = 0.6
CLEARLY_MORE = 4  # markers that another calibration must explain beyond those of the given one
# The layout is matched within about 2 % (`vision.identity.layouts.layout_tolerance`), so steps of 2 % miss no
# factor.
FACTORS = np.concatenate(
    [np.exp(np.arange(np.log(0.4), np.log(2.5), 0.02)), [1e-3, 1e-2, 0.1, 1 / 25.4, 10.0, 25.4, 1e2, 1e3]]
)
# Epipolar misfit beyond which two cameras' tracks are not of one calibration, and how much better exchanged ones have
# to be.
FOREIGN_PX, BETTER = 5.0, 0.2
# A window that is taken from the other camera is near the own one, not at it (8 px off: 5.7 px of misfit instead of
# 837): this share of the misfit may stay.
NEAR = 0.01
# Relative error of lengths between markers that is noted: many of them in many frames, so that it is half of what
# `vision.calibration.advice` allows a single known length.
WRONG_LENGTH = 0.01
FEWEST_LENGTHS = 3  # that say so
FRAMES_TRIED = 10  # until one can be read in both cameras


def refuse_mistaken(recording: Recording, cameras: Sequence[Camera], names: pd.DataFrame | None = None) -> None:
    """`InputError` when the first pictures fit the layouts with the cameras exchanged, or with all lengths scaled.

    Parameters
    ----------
    recording : with frames of two cameras, and `layout_m` of one body at least (else nothing is known, and nothing
    said)
    cameras : the calibration to check
    names : markers named in the first frame, for bodies without a layout
    """
    by_name = {camera.name: camera for camera in cameras}
    if len(recording.cameras) != 2 or any(camera.name not in by_name for camera in recording.cameras):
        return
    layout = layout_of(recording, names, names_needed=False)
    bodies = [
        b for b in range(len(layout.bodies)) if layout.known[b] and np.ptp(layout.position_m[layout.of(b)], 0).any()
    ]
    images = _first_pictures(recording)
    if not bodies or images is None:
        return
    discs = [find_discs(image) for image in images]
    pair = [by_name[camera.name] for camera in recording.cameras]
    offsets = [camera.window_offset_px for camera in recording.cameras]
    possible = 2 * sum(layout.of(b).stop - layout.of(b).start for b in bodies)
    given = explained(pair, offsets, discs, layout, bodies)
    if given >= ENOUGH * possible:
        return
    wanted = max(ENOUGH * possible, given + CLEARLY_MORE)
    if max(explained(pair[::-1], own, discs, layout, bodies) for own in (offsets, offsets[::-1])) >= wanted:
        raise exchanged(pair)
    for meant, other in _other_windows(recording):
        if explained(pair, other, discs, layout, bodies) >= wanted:
            raise _wrong_window(meant, other, recording)
    counts = [
        explained([scaled(camera, factor) for camera in pair], offsets, discs, layout, bodies) for factor in FACTORS
    ]
    best = int(np.argmax(counts))
    if counts[best] >= wanted:
        raise _wrong_lengths(_refined(float(FACTORS[best]), pair, offsets, discs, layout, bodies), recording)


def _other_windows(recording: Recording) -> list[tuple[str, Offsets]]:
    """Windows that the cameras may really have had: exchanged, both as one of them, or one in the sensor's corner or
    middle.
    """
    first, second = recording.cameras
    a, b = first.window_offset_px, second.window_offset_px
    middle = [
        ((one.sensor_size_px[0] - one.window_px[0]) // 2, (one.sensor_size_px[1] - one.window_px[1]) // 2)
        for one in (first, second)
    ]
    return [
        ("exchanged", (b, a)),
        (second.name, (a, a)),
        (first.name, (b, b)),
        (first.name, ((0, 0), b)),
        (second.name, (a, (0, 0))),
        (first.name, (middle[0], b)),
        (second.name, (a, middle[1])),
    ]


def _wrong_window(meant: str, offsets: Offsets, recording: Recording) -> InputError:
    names = [camera.name for camera in recording.cameras]
    given = ", ".join(f"{camera.name} {list(camera.window_offset_px)}" for camera in recording.cameras)
    fits = ", ".join(f"{name} {list(offset)}" for name, offset in zip(names, offsets, strict=True))
    which = "the two exchanged" if meant == "exchanged" else f"another one of {meant}"
    return InputError(
        f"window_offset_px {given}: the markers fit layout_m only with {which} ({fits})",
        "each camera's own window_offset_px",
        "write it in recording.toml as the camera's software says it",
    )


def explained(
    pair: Sequence[Camera], offsets: Offsets, discs: Sequence[Array], layout: Layout, bodies: Sequence[int]
) -> int:
    """Markers, of both cameras together, that have a disc where the bodies' layouts want one."""
    found = 0
    for body, matches in _matches(pair, offsets, discs, layout, bodies):
        best = match_in_all(matches, layout.of(body).stop - layout.of(body).start, SEARCH_RADIUS * layout.rig_m)
        found += sum(match.n_found for match in best if match is not None)
    return found


def _matches(
    pair: Sequence[Camera], offsets: Offsets, discs: Sequence[Array], layout: Layout, bodies: Sequence[int]
) -> Iterator[tuple[int, list[list[Match]]]]:
    cameras = [CameraTracker(camera, offset, layout) for camera, offset in zip(pair, offsets, strict=True)]
    for body in bodies:
        yield body, [camera.matches(seen, body, None) for camera, seen in zip(cameras, discs, strict=True)]


def scaled(camera: Camera, factor: float) -> Camera:
    """The camera of a world whose lengths are all ``factor`` times as long; it sees the same picture."""
    return replace(camera, translation_m=factor * camera.translation_m)


def _refined(
    factor: float,
    pair: Sequence[Camera],
    offsets: Offsets,
    discs: Sequence[Array],
    layout: Layout,
    bodies: Sequence[int],
) -> float:
    """The factor by the distances between the matched discs, against those of the layout."""
    pair = [scaled(camera, factor) for camera in pair]
    own, known = [], []
    for body, matches in _matches(pair, offsets, discs, layout, bodies):
        place = layout.position_m[layout.of(body)]
        for camera, offset, seen, match in zip(
            pair, offsets, discs, match_in_all(matches, len(place), SEARCH_RADIUS * layout.rig_m), strict=True
        ):
            if match is None:
                continue
            marker = np.flatnonzero(match.disc >= 0)
            at = on_plane(camera, seen[match.disc[marker]][:, [U, V]] + offset, place[marker, 2])[:, :2]
            first, second = np.triu_indices(len(marker), 1)
            own.append(np.linalg.norm(at[first] - at[second], axis=1))
            known.append(np.linalg.norm(place[marker[first], :2] - place[marker[second], :2], axis=1))
    lengths, true = np.concatenate(own), np.concatenate(known)
    return factor * float(lengths @ true / (lengths @ lengths))


def _wrong_lengths(factor: float, recording: Recording) -> InputError:
    return InputError(
        f"the markers fit layout_m only with every length of the calibration times {factor:.4g}",
        "distances between markers as layout_m has them",
        _remedy(factor, recording),
    )


def _remedy(factor: float, recording: Recording) -> str:
    if recording.board is None:
        return "calibrate again with the board's measured square size, or correct layout_m (metres)"
    board = find_board(recording.board, recording.folder)
    return (
        f"measure the printed board: square_size_m = {factor * board.square_size_m:.4g} would fit, {board.name} says "
        f"{board.square_size_m:.4g}; or correct layout_m (metres)"
    )


def exchanged(pair: Sequence[Camera]) -> InputError:
    """The refusal of two cameras whose images fit each other's calibration."""
    first, second = (camera.name for camera in pair)
    return InputError(
        f"the images of {first} fit the calibration of {second}, and the other way round",
        "each camera's own calibration",
        f"exchange the calibration folders of {first} and {second}, or their frames",
    )


def _first_pictures(recording: Recording) -> list[NDArray[np.uint8]] | None:
    """The first frame of which both cameras have a picture; None where there is none."""
    sources, notes = open_sources(recording)
    for frame in sorted(set.intersection(*(set(source.numbers()) for source in sources)))[:FRAMES_TRIED]:
        few = [
            source if source.video is not None else replace(source, files={frame: source.files[frame]})
            for source in sources
        ]
        try:
            for _, images in stream(few, notes):
                if all(image is not None for image in images):
                    return [image for image in images if image is not None]
        except InputError as error:
            if "can be read" not in error.found:  # a damaged picture is a gap: the next frame is tried
                raise
    return None


def refuse_foreign_tracks(
    tracks: pd.DataFrame,
    points: pd.DataFrame,
    cameras: Sequence[Camera],
    window_offset_px: Mapping[str, tuple[int, int]],
) -> None:
    """`InputError` when tracks whose rays hardly intersect do so once the two cameras, or their windows, are
    exchanged.
    """
    from vision.triangulate import triangulate

    filmed = set(tracks["camera"].unique())
    names = [camera.name for camera in cameras if camera.name in filmed]
    if len(names) != 2:
        return
    misfit = float(np.nanmedian(np.abs(points["epipolar_px"]))) if len(points) else np.inf
    if misfit < FOREIGN_PX:
        return
    other = dict(zip(names, names[::-1], strict=True))
    turned = [replace(camera, name=other.get(camera.name, camera.name)) for camera in cameras]
    for offsets in (window_offset_px, {name: window_offset_px.get(other.get(name, name), (0, 0)) for name in names}):
        crossed = triangulate(tracks, turned, offsets)
        if len(crossed) and float(np.nanmedian(np.abs(crossed["epipolar_px"]))) < min(FOREIGN_PX, BETTER * misfit):
            raise exchanged([camera for camera in cameras if camera.name in names])
    a, b = (window_offset_px.get(name, (0, 0)) for name in names)
    tried = []
    for windows in ((b, a), (a, a), (b, b), ((0, 0), b), (a, (0, 0))):
        moved = triangulate(tracks, cameras, dict(zip(names, windows, strict=True)))
        tried.append((float(np.nanmedian(np.abs(moved["epipolar_px"]))) if len(moved) else np.inf, windows))
    best, (other_a, other_b) = min(tried, key=lambda one: one[0])
    if best < min(max(FOREIGN_PX, NEAR * misfit), BETTER * misfit):
        raise InputError(
            f"window_offset_px {names[0]} {list(a)}, {names[1]} {list(b)}: the two cameras' rays intersect only with "
            f"{names[0]} {list(other_a)}, {names[1]} {list(other_b)}",
            "each camera's own window_offset_px",
            "write it in recording.toml as the camera's software says it",
        )


def misfit_notes(points: pd.DataFrame) -> list[str]:
    """A note where the two cameras' rays hardly intersect and nothing simple explains it."""
    residual = points["epipolar_px" if points["epipolar_px"].notna().any() else "reprojection_px"].dropna()
    misfit = float(np.median(np.abs(residual))) if len(residual) else 0.0
    if misfit < FOREIGN_PX:
        return []
    return [
        f"the cameras' tracks miss each other by {misfit:.3g} px (median): check window_offset_px of all "
        f"cameras, and that the calibration is theirs"
    ]


def length_notes(points: pd.DataFrame, recording: Recording) -> list[str]:
    """A note for lengths of the points that differ from `layout_m` by more than WRONG_LENGTH, all bodies together."""
    own, known = [], []
    flat = points["z_m"].isna().all()  # of one camera: lengths as seen from above
    points = points.assign(z_m=0.0) if flat else points
    for body in recording.bodies.values():
        if body.layout_m is None:
            continue
        place = dict(zip(body.markers, np.array(body.layout_m, float) * [1, 1, not flat], strict=True))
        rows = points[points["marker"].isin(body.markers)]
        wide = rows.pivot(index="frame", columns="marker", values=["x_m", "y_m", "z_m"])
        there = set(rows["marker"].unique())
        seen = [marker for marker in body.markers if marker in there]
        found_m = {marker: wide.xs(marker, axis=1, level="marker").to_numpy(float) for marker in seen}
        for i, first in enumerate(seen):
            for second in seen[i + 1 :]:
                length = np.linalg.norm(found_m[first] - found_m[second], axis=1)
                if np.isfinite(length).any():
                    own.append(float(np.nanmedian(length)))
                    known.append(float(np.linalg.norm(place[first] - place[second])))
    if len(own) < FEWEST_LENGTHS or not any(own):  # all markers on one spot: the next stage says so
        return []
    lengths, true = np.array(own), np.array(known)
    factor = float(lengths @ true / (lengths @ lengths))
    if abs(factor - 1) < WRONG_LENGTH:
        return []
    return [f"lengths between markers come out {1 / factor:.4g} times those of layout_m: {_remedy(factor, recording)}"]
