"""The stages, declared once: what each reads and writes, and which of them a recording needs.

Commands, `ovines check` and docs/chain.md all come from ``STAGES``.  To add a stage, add an entry here and its
function in `ovines.pipeline.functions`.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import ovines
from ovines.errors import InputError
from ovines.io.provenance import sha256_of
from ovines.pipeline.code import code_digest
from ovines.recording import Recording
from ovines.tables import read_provenance

ENTRY_STAGE = {
    "frames": "track",
    "tracks": "lens",
    "points": "analyse",
    "motion": "analyse",
    "impacts": "identify",
    "boards": "calibrate",
}
MOTION_OR_IMPACTS = "motion.parquet or impacts.parquet"
CALIBRATION_PAGE = "calibration.html"  # beside the stage's own files, made from them
HTML_MARK = "<!-- ovines "
SERIES_LENS = "lens of the series"  # the command in the provenance of a field that all runs of a series share


@dataclass(frozen=True)
class Stage:
    """One stage = one command = one function of `ovines.pipeline.functions`.

    reads : what it is made from: results of earlier stages, or files that the recording brings
    may_read : the same, where it may be absent
    writes : its files, the first always, the others where the recording allows
    sections : the parts of recording.toml that it depends on
    """

    name: str
    help: str
    reads: tuple[str, ...]
    writes: tuple[str, ...]
    sections: tuple[str, ...]
    may_read: tuple[str, ...] = ()


STAGES: tuple[Stage, ...] = (
    Stage(
        "calibrate",
        "board images -> cameras with standard deviations",
        reads=("board", "intrinsic images", "extrinsic images"),
        writes=(
            "calibration.json",
            "calibration_views.parquet",
            "calibration_parameters.parquet",
            "calibration_covariance.parquet",
            "calibration_lens.parquet",
            "calibration_spline.parquet",
            "calibration_corners.parquet",
            "calibration_boards.parquet",
            "calibration_image.parquet",
            "calibration_plane.parquet",
            "calibration_world.parquet",
            "calibration_next.parquet",
        ),
        sections=("cameras", "calibration"),
    ),
    Stage(
        "track",
        "images -> markers in window pixels, walls from their edges",
        reads=("frames", "calibration.json"),
        may_read=("names.csv", "trigger.csv"),
        writes=("tracks.parquet", "walls.parquet"),
        sections=("time", "cameras", "bodies"),
    ),
    Stage(
        "lens",
        "markers of rigid bodies in both views -> what the lens models leave over",
        reads=("tracks.parquet", "calibration.json"),
        may_read=("calibration_covariance.parquet", "lens of the series"),
        writes=("lens_terms.parquet", "lens_field.parquet"),
        sections=("cameras", "bodies"),
    ),
    Stage(
        "triangulate",
        "markers of the cameras -> points in metres",
        reads=("tracks.parquet", "calibration.json"),
        may_read=("calibration_covariance.parquet", "lens_terms.parquet", "lens_field.parquet"),
        writes=("points.parquet",),
        sections=("cameras",),
    ),
    Stage(
        "analyse",
        "points -> motion of NES and Host, Host circle, angle, impacts as the thesis finds them",
        reads=("points.parquet or motion.parquet",),
        may_read=("accelerometers' record",),
        writes=(
            "motion.parquet",
            "host_circle.parquet",
            "rotation.parquet",
            "thesis_impacts.parquet",
            "accelerometers.parquet",
            "accelerations.parquet",
        ),
        sections=("time", "bodies", "excitation", "model", "thesis_method", "accelerometers"),
    ),
    Stage(
        "identify",
        "motion (or impacts by themselves) -> impacts with their parameters, and the parameters of the rig",
        reads=(MOTION_OR_IMPACTS,),
        may_read=("points.parquet", "thesis_impacts.parquet"),
        writes=("identification.parquet", "impacts.parquet", "flights.parquet", "checks.parquet"),
        sections=("time", "cameras", "bodies", "excitation", "model"),
    ),
    Stage(
        "report",
        "everything above -> one self-contained page",
        reads=(MOTION_OR_IMPACTS,),
        may_read=(
            "calibration.json",
            "calibration_views.parquet",
            "calibration_parameters.parquet",
            "first frames",
            "tracks.parquet",
            "walls.parquet",
            "lens_terms.parquet",
            "lens_field.parquet",
            "points.parquet",
            "host_circle.parquet",
            "rotation.parquet",
            "thesis_impacts.parquet",
            "accelerometers.parquet",
            "accelerations.parquet",
            "impacts.parquet",
            "flights.parquet",
            "identification.parquet",
            "checks.parquet",
        ),
        writes=("report.html",),
        sections=("name", "time", "cameras", "bodies", "excitation", "model", "thesis_method", "accelerometers", "log"),
    ),
)


def stage(name: str) -> Stage:
    """The stage of that name."""
    return next(one for one in STAGES if one.name == name)


def stages_of(recording: Recording) -> tuple[Stage, ...]:
    """The stages that a recording needs: from where it enters to the report."""
    entry = recording.entry()
    if entry == "boards":
        return STAGES[:1]
    names = [one.name for one in STAGES]
    chosen = STAGES[names.index(ENTRY_STAGE[entry]) :]
    if entry in ("frames", "tracks") and recording.calibration_file is None:
        return (STAGES[0], *chosen)
    return chosen


def written_from(first: Stage) -> list[str]:
    """Files that are written or removed where ``first`` and the stages after it run."""
    later = [name for one in STAGES[STAGES.index(first) :] for name in one.writes]
    return [*later, CALIBRATION_PAGE] if first.name == "calibrate" else later


def location(artifact: str, recording: Recording, out: Path) -> list[Path]:
    """Where the files of an artifact that a stage reads lie; [] when there are none."""
    if artifact == "points.parquet or motion.parquet":
        artifact = "motion.parquet" if recording.entry() == "motion" else "points.parquet"
        if recording.entry() == "motion":
            return [recording.folder / artifact]
    if artifact == MOTION_OR_IMPACTS:
        artifact = "impacts.parquet" if recording.entry() == "impacts" else "motion.parquet"
    match artifact:
        case "frames":
            return [path for one in recording.cameras for path in _matching(recording, one.name, one.frames)]
        case "first frames":
            return [path for one in recording.cameras for path in _matching(recording, one.name, one.frames)[:1]]
        case "intrinsic images" | "extrinsic images":
            pattern = getattr(recording.settings.calibration, artifact.split()[0], None)
            return [path for one in recording.cameras for path in _matching(recording, one.name, pattern)]
        case "board":
            from vision.calibration.targets.boards import board_file  # only this one path is vision's to know

            return [board_file(recording.board, recording.folder)] if recording.board else []
        case "trigger.csv":
            trigger = recording.settings.time.trigger
            return [recording.path(trigger)] if trigger else []
        case "accelerometers' record":
            record = recording.settings.accelerometers
            return [recording.path(record.file)] if record is not None else []
        case "calibration.json" if recording.calibration_file is not None:
            return [recording.calibration_file]
        case "calibration_covariance.parquet" if recording.calibration_file is not None:
            candidates = [recording.calibration_file.parent / artifact]
        case "lens of the series":
            shared = [out.parent / name for name in stage("lens").writes]
            joint = (read_provenance(shared[0]) or {}).get("command") == SERIES_LENS
            return [path for path in shared if path.is_file()] if joint else []
        case "names.csv":
            candidates = [out / artifact, recording.folder / artifact]
        case _:
            entry = recording.entry()  # a motion that was brought is handed on by `analyse`, and read from there
            brought = [recording.folder / artifact] if artifact == f"{entry}.parquet" != "motion.parquet" else []
            candidates = [*brought, out / artifact]
    return [path for path in candidates if path.is_file()][:1]


def _matching(recording: Recording, camera: str, pattern: str | None) -> list[Path]:
    """The files of a camera, or the pattern itself where nothing matches: its path is then said to be missing."""
    if pattern is None:
        return []
    pattern = pattern.replace("{camera}", camera)
    return recording.matching(pattern) or [recording.path(pattern)]


def inputs_of(one: Stage, recording: Recording, out: Path) -> dict[str, list[Path]]:
    """Per artifact the files that ``one`` reads; `InputError` for a missing one."""
    found = {}
    for artifact in (*one.reads, *one.may_read):
        paths = location(artifact, recording, out)
        absent = [path for path in paths if not path.is_file()]
        missing = bool(absent) or not paths
        if missing and artifact in one.reads:
            raise InputError(
                f"{one.name}: no {artifact} for {recording.folder}"
                + (f" ({absent[0]} is not there)" if absent else ""),
                f"{artifact} to read",
                _remedy(artifact),
            )
        if not missing:
            found[artifact] = paths
    return found


def _remedy(artifact: str) -> str:
    if artifact == "calibration.json":
        return "name it in [calibration] file, or give the board images to solve it from"
    made = any(name in artifact for one in STAGES for name in one.writes)
    return "run `ovines run` first" if made else "check the paths in recording.toml"


def parameters_of(one: Stage, recording: Recording) -> dict[str, Any]:
    """The sections of recording.toml that the stage depends on, as plain JSON."""
    settings = recording.settings.model_dump(mode="json", exclude_none=True)
    found = {section: settings[section] for section in one.sections if section in settings}
    if "model" in found and recording.model is not None and recording.model.laws:
        # A law is as much a part of the model as the numbers beside it.
        paths = {name: recording.folder / name for name in recording.model.laws}
        found["laws"] = {name: sha256_of(path) if path.is_file() else None for name, path in paths.items()}
    return found


def state_of(one: Stage, recording: Recording, hashes: Mapping[str, str]) -> dict[str, Any]:
    """What the stage's outputs depend on, and ``key``, the hash of it all."""
    depends = {
        "version": ovines.__version__,
        "command": one.name,
        "parameters": parameters_of(one, recording),
        "inputs": dict(hashes),
        "code": code_digest(one.name),
    }
    text = json.dumps(depends, sort_keys=True, ensure_ascii=True)
    return {**depends, "key": hashlib.sha256(text.encode()).hexdigest()}


@dataclass(frozen=True)
class Stored:
    """What an output says of itself: the state it was made in, and whether its content is still the one written
    then.
    """

    state: dict[str, Any]
    as_written: bool


CONTENT = "content"  # in the provenance of a page or a calibration.json: the hash of all the rest


def with_content(provenance: Mapping[str, Any], content: str) -> dict[str, Any]:
    """``provenance`` with the hash of the text that it stands in."""
    return {**provenance, CONTENT: hashlib.sha256(content.encode("utf-8", "surrogatepass")).hexdigest()}


def read_stored(path: Path) -> Stored | None:
    """What stands in an output that is JSON or a page with a mark; None where nothing does."""
    try:
        text = path.read_text(encoding="utf-8")
        if path.suffix == ".json":
            whole = json.loads(text)
            state = whole.pop("provenance")
            content = json.dumps(whole, sort_keys=True)
        else:
            at = text.rindex(HTML_MARK)
            state = json.loads(text[at + len(HTML_MARK) : text.index(" -->", at)])
            content = text[: at - 1]
        written = state.pop(CONTENT, None)
        return Stored(state, written in (None, with_content({}, content)[CONTENT]))
    except (OSError, ValueError, KeyError, AttributeError, TypeError, RecursionError):
        return None


def stored_state(path: Path) -> dict[str, Any] | None:
    """The state that stands in an output, whatever its format; None where there is none."""
    if path.suffix == ".parquet":
        return read_provenance(path)
    stored = read_stored(path)
    return None if stored is None else stored.state


def is_fresh(one: Stage, out: Path, key: str) -> bool:
    """Whether every output that belongs to the state ``key`` is there, whole, and no other is."""
    first = stored_state(out / one.writes[0])
    if not first or first.get("key") != key:
        return False
    expected = set(first.get("outputs", ()))
    for name in one.writes:
        state = stored_state(out / name)
        if (name in expected) != (out / name).exists() or (name in expected and (state or {}).get("key") != key):
            return False
    return True
