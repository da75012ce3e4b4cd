"""One lens field for all runs of a series: learnt from their tracks together, before any is triangulated."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import pandas as pd

from ovines.camera import Camera, calibration_json
from ovines.errors import InputError
from ovines.io.provenance import provenance, sha256_of
from ovines.pipeline.code import code_digest
from ovines.pipeline.stages import SERIES_LENS, is_fresh, location, parameters_of, stage
from ovines.plausibility.calibration import calibrated
from ovines.plausibility.recording import refuse_contradictions
from ovines.recording import Recording
from ovines.tables import read_table, write_table

if TYPE_CHECKING:
    from vision.lens.estimate import LensEstimate

FEWEST_RUNS = 2  # one learns by itself


def write_series_lens(out: Path, recordings: Sequence[Recording], force: bool) -> tuple[str, list[str]]:
    """Bring ``lens_terms.parquet`` and ``lens_field.parquet`` in ``out`` up to date; what ran, and the notes.

    ``recordings`` are those whose tracks stand in their folders or in ``out / name of their folder``.  Where they were
    not all filmed with the same cameras there are no joint tables, and each recording learns by itself.  Call it under
    the lock of ``out``.
    """
    lens = stage("lens")
    inputs: dict[str, Path] = {}
    for recording in recordings:
        for artifact in ("tracks.parquet", "calibration.json", "calibration_covariance.parquet"):
            for path in location(artifact, recording, out / recording.folder.name):
                inputs[f"{recording.folder.name}/{artifact}"] = path
    state = provenance(
        SERIES_LENS,
        {recording.folder.name: parameters_of(lens, recording) for recording in recordings},
        {name: sha256_of(path) for name, path in inputs.items()},
    )
    state["code"] = code_digest(lens.name)
    key = hashlib.sha256(json.dumps(state, sort_keys=True).encode()).hexdigest()
    if not force and is_fresh(lens, out, key):
        return "up to date", []
    for name in lens.writes:
        (out / name).unlink(missing_ok=True)
    read = [one for recording in recordings if (one := _readable(recording, inputs)) is not None]
    covariance = [path for name, path in inputs.items() if name.endswith("/calibration_covariance.parquet")][:1]
    tracks, filmed, cameras = [one[0] for one in read], [one[1] for one in read], [one[2] for one in read]
    found = learn_together(tracks, filmed, cameras, covariance) if len(read) >= FEWEST_RUNS else None
    if found is None:
        few = len(read) < FEWEST_RUNS
        return "each by itself", [] if few else ["no joint lens field: the runs were not filmed with the same cameras"]
    written = {"lens_terms": found.terms} | ({} if found.field is None else {"lens_field": found.field})
    notes = [found.note] if found.field is not None or found.loose else []  # that there is none stands in the table
    marked = {**state, "key": key, "notes": notes, "outputs": [f"{name}.parquet" for name in written]}
    for name in reversed(written):  # the first one last: it is the one that vouches for the other
        write_table(written[name], name, out / f"{name}.parquet", marked)
    return "run", notes


def _readable(recording: Recording, inputs: dict[str, Path]) -> tuple[pd.DataFrame, Recording, Sequence[Camera]] | None:
    """Tracks, recording and cameras; None for a recording that is refused, which its own stages say."""
    name = recording.folder.name
    try:
        tracks = read_table(inputs[f"{name}/tracks.parquet"], "tracks")
        refuse_contradictions(recording, tracks)
        return tracks, recording, calibrated(inputs[f"{name}/calibration.json"], recording)
    except (InputError, KeyError):
        return None


def learn_together(
    tracks: Sequence[pd.DataFrame],
    recordings: Sequence[Recording],
    cameras: Sequence[Sequence[Camera]],
    covariance: Sequence[Path],
) -> LensEstimate | None:
    """What the recordings tell together; None where there are none, or not all of the same cameras."""
    from vision.lens.estimate import learn_lens_field

    as_files = [calibration_json(each) for each in cameras]
    if not as_files or any(other != as_files[0] for other in as_files):
        return None
    table = read_table(covariance[0], "calibration_covariance") if covariance else None
    return learn_lens_field(tracks, recordings, cameras[0], table)
