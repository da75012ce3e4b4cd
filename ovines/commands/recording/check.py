"""`ovines check`: what is there, what is missing or wrong, what would run."""

import argparse
import mmap
import sys
from collections.abc import Mapping
from pathlib import Path

from ovines.commands.options import results_folder
from ovines.errors import InputError
from ovines.io.hashing import hash_inputs
from ovines.io.toml_input import line_of
from ovines.pipeline.ownership import refuse_folder, refuse_strange_results, refuse_theirs
from ovines.pipeline.series.recordings import is_recording
from ovines.pipeline.stages import (
    MOTION_OR_IMPACTS,
    STAGES,
    Stage,
    inputs_of,
    is_fresh,
    stage,
    stages_of,
    state_of,
    written_from,
)
from ovines.plausibility.calibration import calibrated, refuse_camera_count
from ovines.plausibility.frame_files import file_notes, refuse_strange_files, sizes
from ovines.plausibility.recording import drive_warnings, plausibility_warnings, refuse_contradictions, sd_warnings
from ovines.recording import FILE, Recording, read_recording, series_folders
from ovines.tables import read_table

NAME = "check"
HELP = "what is there, what is missing or wrong, and what would run"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """A recording or a series, and where its results lie."""
    parser.add_argument("recording", type=Path, metavar="RECORDING_OR_SERIES", help="folder with recording.toml, or a "
        "folder of such folders")  # fmt: skip
    parser.add_argument("--out", type=Path, metavar="DIR", help="where the results lie or will lie (default: results/ "
        "inside)")  # fmt: skip


def run(args: argparse.Namespace) -> int:
    """Print a paragraph per recording; 0 when everything could run, 2 when something is missing or wrong."""
    single = is_recording(args.recording)
    out = results_folder(args.recording, args.out)
    wrong = 0
    for folder in series_folders(args.recording):
        try:
            recording = read_recording(folder)
            problems = check_recording(recording, out if single else out / folder.name)
        except InputError as error:
            print(f"{folder}")
            problems = [error]
        for problem in problems:
            said = "  wrong:   " + str(problem).replace("\n", "\n           ")
            print(said, file=sys.stderr if args.quiet else sys.stdout)  # what is asked for, else an error like others
        wrong += bool(problems)
    return 2 if wrong else 0


def check_recording(recording: Recording, out: Path) -> list[InputError]:
    """Print what the recording holds and what each stage would do; return what is missing or wrong."""
    print(f"{recording.folder}: {recording.name}, enters at {recording.entry()}")
    problems = []
    try:
        refuse_folder(out)
        refuse_strange_results(out, recording)
        refuse_theirs(out, written_from(stages_of(recording)[0]))
    except InputError as error:
        problems.append(error)
    for look in (refuse_contradictions, _cameras, _calibration, _times, _table, _effects, _accelerometers):
        try:
            look(recording)
        except InputError as error:
            problems.append(error)
    earlier: str | None = None
    states: dict[str, str] = {}
    for one in stages_of(recording):
        what, problem = _would(one, recording, out, earlier)
        if problem is not None:
            problems.append(problem)
        if what != "up to date":
            earlier = earlier or one.name
        states[one.name] = what
    print(drawing(recording.entry(), states))
    by_text = {str(found): found for found in (_with_line(problem, recording) for problem in problems)}
    return list(by_text.values())  # settings that contradict each other are met again with the table


MARKS = {"up to date": "[x]", "would run": "[ ]", "cannot run": "[!]"}


def drawing(entry: str, states: Mapping[str, str]) -> str:
    """The chain as a line of boxes, and what each stage would do below it."""
    boxes = [f"{MARKS.get(what, '[ ]')} {name}" for name, what in states.items()]
    lines = ["  " + " -> ".join([entry, *boxes])]
    lines += [f"  {name + ':':<12} {what}" for name, what in states.items()]
    return "\n".join(lines)


# what a message speaks of -> the key of recording.toml that it is about
KEYS: tuple[tuple[str, tuple[int | str, ...]], ...] = (
    ("[model] effects", ("model", "effects")),
    ("no board", ("calibration", "board")),
    ("intrinsic images", ("calibration", "intrinsic")),
    ("extrinsic images", ("calibration", "extrinsic")),
    ("[calibration]", ("calibration",)),
    ("calibration", ("calibration", "file")),
    ("trigger", ("time", "trigger")),
    ("frame_rate_hz", ("time",)),
)


def _with_line(problem: InputError, recording: Recording) -> InputError:
    """The same message with the line of recording.toml to change, where it has one and does not say it yet."""
    if f"{FILE}, line" in problem.found + problem.do:
        return problem
    keys: list[tuple[str, tuple[int | str, ...]]] = [
        ("camera " + camera.name, ("cameras", i, "frames")) for i, camera in enumerate(recording.cameras)
    ]
    keys += [
        ("pictures of " + camera.name, ("cameras", i, "window_size_px")) for i, camera in enumerate(recording.cameras)
    ]
    keys += [
        ("sensor of " + camera.name, ("cameras", i, "sensor_size_px")) for i, camera in enumerate(recording.cameras)
    ]
    record = recording.settings.accelerometers
    keys += [] if record is None else [(str(recording.path(record.file)), ("accelerometers", "file"))]
    text = (recording.folder / FILE).read_text(encoding="utf-8-sig")
    for word, location in (*keys, *KEYS):
        line = line_of(text, location) if word in problem.found else None
        if line is not None:
            return InputError(problem.found, problem.expected, f"{problem.do} ({FILE}, line {line})")
    return problem


def _cameras(recording: Recording) -> None:
    for camera in recording.cameras:
        files = recording.frame_files(camera.name)
        if camera.frames:
            print(f"  {camera.name}: {len(files)} file{'s'[: len(files) != 1]} ({camera.frames})")
    refuse_strange_files(recording)
    for note in file_notes(recording):
        print(f"  caution: {note}")
    counts = {camera.name: len(recording.frame_files(camera.name)) for camera in recording.cameras if camera.frames}
    if recording.entry() != "frames":
        return
    _sizes(recording)
    for camera in recording.cameras:
        if not counts.get(camera.name):
            raise InputError(
                f"no frames of camera {camera.name}: {camera.frames or 'nothing given'}",
                "image files (a glob) or one video file",
                "correct 'frames' in recording.toml",
            )
    if len(set(counts.values())) > 1:
        print("  note: not as many images of each camera; those without a partner give no points")


def _sizes(recording: Recording) -> None:
    """Pictures of another size than the window, all of them counted (the run stops at the first)."""
    from vision.frames.image_header import ImageError, read_header

    def read_size(path: Path) -> tuple[int, int] | None:
        try:
            with open(path, "rb") as handle, mmap.mmap(handle.fileno(), 0, access=mmap.ACCESS_READ) as data:
                header = read_header(data, len(data))
        except (OSError, ValueError, ImageError):
            return None
        return None if header is None else (header.width, header.height)

    for camera in recording.cameras:
        found = sizes(recording.frame_files(camera.name), read_size)
        if set(found) - {camera.window_px}:
            counts = ", ".join(f"{count} of {width} x {height} px" for (width, height), count in found.most_common())
            raise InputError(
                f"pictures of {camera.name}: {counts}", f"window_size_px, {camera.window_px[0]} x "
                    f"{camera.window_px[1]} px, for every one",
                "correct window_size_px (and window_offset_px), or remove the others",
            )  # fmt: skip


def _calibration(recording: Recording) -> None:
    if recording.entry() not in ("frames", "tracks"):
        return
    if recording.calibration_file is not None:
        cameras = calibrated(recording.calibration_file, recording)
        print(
            f"  calibration: {recording.calibration_file.name}, cameras {', '.join(camera.name for camera in cameras)}"
        )
    elif recording.board is not None:
        for camera in recording.cameras:
            views = len(recording.calibration_images(camera.name, "intrinsic"))
            print(f"  calibration: {recording.board}, {camera.name} {views} views")
    else:
        raise InputError("no [calibration]", "a solved calibration (file) or board images", "add it to recording.toml")


def _times(recording: Recording) -> None:
    if recording.settings.time.trigger:
        recording.times_s([])
        print(f"  times: {recording.settings.time.trigger}")
    elif recording.entry() == "frames":
        if recording.frame_rate_hz is None and _filmed(recording):
            print("  times: those of the videos")
            return
        recording.times_s([0])
        print(f"  times: {recording.frame_rate_hz} frames per second")


def _filmed(recording: Recording) -> bool:
    """Whether every camera brings a video, which has times of its own."""
    from vision.video import VIDEO_SUFFIXES

    files = [recording.frame_files(camera.name) for camera in recording.cameras]
    return all(len(own) == 1 and own[0].suffix.lower() in VIDEO_SUFFIXES for own in files)


def _table(recording: Recording) -> None:
    entry = recording.entry()
    if entry == "boards":
        return
    if entry == "frames":
        for warning in plausibility_warnings(recording):
            print(f"  caution: {warning}")
        return
    if entry == "impacts":
        impacts = read_table(recording.folder / "impacts.parquet", "given_impacts")
        print(f"  impacts.parquet: {len(impacts)} impacts")
        return
    table = read_table(recording.folder / f"{entry}.parquet", entry)
    refuse_contradictions(recording, table)
    print(f"  {entry}.parquet: {len(table)} rows, {table['frame'].nunique()} frames")
    if len(table) == 0:
        raise InputError(f"{entry}.parquet has no rows", "at least one frame", "check how it was written")
    for warning in (
        plausibility_warnings(recording, table) + drive_warnings(table, recording) + sd_warnings(table, recording)
    ):
        print(f"  caution: {warning}")
    if "marker" in table:
        there = set(table["marker"].unique())
        strange = sorted(there - set(recording.markers))
        unseen = [marker for marker in recording.markers if marker not in there]
        if strange:
            print(f"  markers that recording.toml does not know, left out: {', '.join(strange)}")
        if unseen:
            print(f"  markers never seen: {', '.join(unseen)}")


def _effects(recording: Recording) -> None:
    if recording.model is None or not recording.model.effects:
        return
    from ovines.core.effects import EFFECTS

    for effect in recording.model.effects:
        if effect not in EFFECTS:
            raise InputError(
                f"[model] effects: {effect!r}",
                f"one of {', '.join(sorted(EFFECTS))}",
                "correct recording.toml",
            )
    if recording.model.effect_parameters:
        from analysis.flights.stated_terms import stated_sizes  # it loads what computes

        stated_sizes(recording.model)


def _accelerometers(recording: Recording) -> None:
    if recording.settings.accelerometers is None:
        return
    from analysis.accelerometers.record import read_record  # it loads what computes

    record = read_record(recording)
    assert record is not None
    lasts_s = float(record.time_s[-1] - record.time_s[0])
    rate_hz = (len(record.time_s) - 1) / lasts_s
    names = ", ".join(channel.column for channel in record.settings.channels)
    print(f"  accelerometers: {record.settings.file}, {names}, {rate_hz:.6g} samples per second for {lasts_s:.4g} s")
    for channel, clipped in zip(record.settings.channels, record.clipped, strict=True):
        if clipped:
            print(f"  caution: {channel.column!r} repeats its extreme: the sensor or the card was beyond its range")
    if recording.entry() in ("impacts", "boards"):
        print("  caution: accelerometers beside a recording without a Host's motion: nothing will be compared")


def _would(one: Stage, recording: Recording, out: Path, earlier: str | None) -> tuple[str, InputError | None]:
    """What a stage would do, and what it lacks; a stage after one that would run waits for it."""
    if one.name in ("track", "triangulate"):
        try:
            refuse_camera_count(recording)
        except InputError as error:
            return "cannot run", error
    if earlier is not None and any(artifact in _made_after(earlier) for artifact in (*one.reads, *one.may_read)):
        return f"would run after {earlier}", None
    try:
        inputs = inputs_of(one, recording, out)
    except InputError as error:
        return "cannot run", error
    state = state_of(one, recording, hash_inputs(inputs, recording.folder))
    return ("up to date" if is_fresh(one, out, state["key"]) else "would run"), None


def _made_after(name: str) -> set[str]:
    """Artifacts that ``name`` and the stages after it write."""
    later = STAGES[STAGES.index(stage(name)) :]
    made = {artifact for one in later for artifact in one.writes}
    made |= {"points.parquet or motion.parquet"} if "points.parquet" in made else set()
    return made | {MOTION_OR_IMPACTS} if made & {"motion.parquet", "impacts.parquet"} else made
