"""A series of recordings as the diagnosis takes it, whatever its recordings enter with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import pandas as pd

from ovines.camera import Camera, with_fields
from ovines.errors import InputError
from ovines.pipeline.runner import run_stages
from ovines.pipeline.series.lens import learn_together
from ovines.pipeline.stages import location
from ovines.plausibility.calibration import calibrated, refuse_camera_count
from ovines.plausibility.motion import host_at_rest, refuse_uninformative
from ovines.plausibility.recording import refuse_contradictions
from ovines.recording import Recording
from ovines.tables import read_table

if TYPE_CHECKING:
    from analysis.gap.series import Series
    from ovines.core.laws.terms import WrittenLaw
    from vision.lens.estimate import LensEstimate

TESTED = 2  # cameras whose clocks, windows and plane the diagnosis tests against each other
ORDER = ("frames", "tracks", "points", "motion")


def load_impacts(recordings: Sequence[Recording]) -> tuple[list[pd.DataFrame], dict[str, Path]]:
    """Tables ``given_impacts`` of recordings that bring nothing else, and the files they were read from by name."""
    paths = [recording.folder / "impacts.parquet" for recording in recordings]
    sources = {f"{path.parent.resolve().name}/{path.name}": path for path in paths}
    return [read_table(path, "given_impacts") for path in paths], sources


def load_series(
    recordings: Sequence[Recording], out: Path, laws: Sequence[Path] = ()
) -> tuple[Series, dict[str, Path]]:
    """The series at its entry, and the files it was read from by name; all recordings enter at the latest of their
    entries.  ``laws``: files of written laws that the nominal model holds beside those of ``[model]``.
    """
    from analysis.flights.stated_terms import held_laws, measurement_laws
    from analysis.gap.laws.frames.corrected import changing, without_frame_laws
    from analysis.gap.series import from_motions, from_points
    from analysis.motion.bodies import motion_from_points

    held = held_laws(recordings, laws)
    entries = [recording.entry() for recording in recordings]
    _refuse_what_does_not_move(recordings, entries)
    entry = max(entries, key=ORDER.index)
    of_measurement = measurement_laws(recordings, laws)
    brought = _brought(recordings, entries, out, of_measurement)
    cameras: list[Camera] | None = None
    tracks: list[pd.DataFrame] = []
    points: list[pd.DataFrame] = []
    motions: list[pd.DataFrame] = []
    for recording, kind, table, seen in zip(recordings, entries, brought.tables, brought.cameras, strict=True):
        if seen is not None:
            cameras = with_fields(seen, {} if brought.lens is None else brought.lens.fields)
            tracks.append(table)
            table = triangulate_again(table, cameras, recording, (0.0, 0.0))
            kind = "points"
        points.append(table) if kind == "points" else motions.append(host_at_rest(table))
        if kind == "points" and entry == "motion":
            motions.append(motion_from_points(table, recording))
    if entry == "motion":
        series = from_motions(recordings, motions, held)
    else:
        whole = len(tracks) == len(recordings) and all(len(recording.cameras) == TESTED for recording in recordings)
        series = from_points(
            recordings,
            points,
            cameras if whole else None,
            tracks if whole else None,
            triangulate_again,
            held,
        )
    if brought.lens is not None:
        lens = brought.lens
        series = replace(
            series, picture_changes=lens.changes, picture_bends_px=lens.bends_px, lens_sds=lens.held_out_sds
        )
    bent_back = series.tracks is not None  # else they are refused, like all that needs tracks
    series = without_frame_laws(series, changing(of_measurement) if bent_back else of_measurement)
    refuse_uninformative(series.motions, recordings)
    return series, brought.sources


def _refuse_what_does_not_move(recordings: Sequence[Recording], entries: Sequence[str]) -> None:
    if "impacts" in entries:
        raise InputError(
            f"{recordings[entries.index('impacts')].folder} brings impacts alone, others of the series bring motion",
            "recordings of one kind",
            "diagnose them apart",
        )
    if "boards" in entries:
        raise InputError(
            f"{recordings[entries.index('boards')].folder} brings board images alone",
            "recordings of a disk that moves",
            "leave it out of the series; its calibration.json serves them as [calibration] file",
        )


class _Brought(NamedTuple):
    """What the recordings enter with: a table each, the cameras of those that have tracks, what all of these teach of
    the lenses, and the files that were read by name."""

    tables: list[pd.DataFrame]
    cameras: list[list[Camera] | None]
    lens: LensEstimate | None
    sources: dict[str, Path]


def _brought(
    recordings: Sequence[Recording], entries: Sequence[str], out: Path, laws: Sequence[WrittenLaw]
) -> _Brought:
    """Tables of all recordings; frames are tracked first, into ``out``.  What ``laws`` say of the cameras' pictures is
    taken out before the lenses are learnt."""
    from analysis.gap.laws.frames.corrected import without_lasting_bends

    tables: list[pd.DataFrame] = []
    seen_by: list[list[Camera] | None] = []
    sources: dict[str, Path] = {}
    for recording, kind in zip(recordings, entries, strict=True):
        folder = out / "recordings" / recording.folder.resolve().name
        path = recording.folder / f"{kind}.parquet"
        if kind == "frames":
            run_stages(recording, folder, only="track")
            path = folder / "tracks.parquet"
        sources[f"{recording.folder.resolve().name}/{path.name}"] = path
        table = read_table(path, path.stem)
        refuse_contradictions(recording, table)
        seen = _cameras_of(recording, folder) if kind in ("frames", "tracks") else None
        tables.append(table if seen is None else without_lasting_bends(table, seen, recording, laws))
        seen_by.append(seen)
    filmed = [number for number, cameras in enumerate(seen_by) if cameras is not None]
    found = learn_together(
        [tables[k] for k in filmed],
        [recordings[k] for k in filmed],
        [seen_by[k] or [] for k in filmed],
        location("calibration_covariance.parquet", recordings[0], out / "recordings" / recordings[0].folder.name),
    )
    return _Brought(tables, seen_by, found, sources)


def triangulate_again(
    tracks: pd.DataFrame, cameras: Sequence[Camera], recording: Recording, shift_px: tuple[float, float]
) -> pd.DataFrame:
    """Points of the tracks with the second camera's window moved by ``shift_px``: what the diagnosis calls after a
    correction.
    """
    from vision.one_view import one_view_heights
    from vision.triangulate import triangulate

    refuse_camera_count(recording)
    offsets: dict[str, list[float]] = {name: list(offset) for name, offset in recording.window_offset_px.items()}
    second = cameras[1].name if len(recording.cameras) > 1 else None
    if second in offsets:
        offsets[second] = [offsets[second][0] + shift_px[0], offsets[second][1] + shift_px[1]]
    return triangulate(tracks, cameras, offsets, one_view_heights(recording))


def _cameras_of(recording: Recording, folder: Path) -> list[Camera]:
    """The recording's cameras, from the calibration that it brings or that was solved into ``folder``."""
    (found,) = location("calibration.json", recording, folder)[:1] or (_no_calibration(recording),)
    return calibrated(found, recording)


def _no_calibration(recording: Recording) -> Path:
    raise InputError(
        f"{recording.folder}: no calibration for its tracks",
        "calibration.json, or board images to solve it from",
        "give [calibration] in recording.toml",
    )
