"""`ovines import`: other programs' tracks, points and calibrations, put where the chain finds them."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ovines.errors import InputError
from ovines.io.atomic_write import write_text_whole

if TYPE_CHECKING:  # the command line is parsed without loading pandas
    import pandas as pd

    from ovines.camera import Camera
    from ovines.importers.formats.opencv_cameras import Found
    from ovines.recording import Recording

NAME = "import"
TRIGGER_PICTURES = ("trigger_signal.png", "trigger_signal.svg")
HELP = "tracks, points or a calibration of another program (VibrationTracker, TRC, CSV, OpenCV, Kalibr, mrcal, ...)"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """``RECORDING``, what to import, and what the foreign files do not say themselves."""
    parser.add_argument(
        "recording", type=Path, metavar="RECORDING", help="folder with recording.toml (write one with `ovines new`)"
    )
    _add_what(parser.add_argument_group("what to import"))
    _add_unsaid(parser.add_argument_group("what the files do not say"))
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder to write into (default: the recording's own)")
    parser.add_argument("--force", action="store_true", help="write over files that are there")


def _add_what(what: argparse._ArgumentGroup) -> None:
    what.add_argument(
        "--tracks", nargs="+", metavar="CAMERA=FILE", help="pixels: TrackResults.json of VibrationTracker, or CSV"
    )
    what.add_argument(
        "--points",
        type=Path,
        metavar="FILE",
        help="positions: displacementResults.json of VibrationTracker, TRC, or CSV",
    )
    what.add_argument(
        "--calibration",
        nargs="+",
        metavar="CAMERA=FILE,FILE",
        help="cameras: OpenCV YAML or XML, VibrationTracker's calibrationResults.json,poseEstimationResults.json, "
        "mrcal's .cameramodel, Kalibr's camchain, or a TOML of "
        "caliscope or Anipose (CAMERA=FILE#SECTION, or FILE alone where it has the cameras' names)",
    )
    what.add_argument(
        "--plane",
        nargs="+",
        metavar="CAMERA=FILE",
        help="a camera from four or more known points: CSV of u_px, v_px, x_mm, y_mm (z_mm, sd_px)",
    )
    what.add_argument(
        "--trigger-signal",
        type=Path,
        metavar="FILE",
        help="the cameras' trigger as sampled: CSV of time_s and the signal, to trigger.csv",
    )
    what.add_argument(
        "--impacts", type=Path, metavar="FILE", help="impacts by themselves: CSV with the columns of impacts.parquet"
    )
    what.add_argument("--motion", type=Path, metavar="FILE", help="the disk's path by itself: CSV, see --columns")


def _add_unsaid(unsaid: argparse._ArgumentGroup) -> None:
    unsaid.add_argument(
        "--pulse",
        choices=("middle", "rise"),
        default="middle",
        help="where a frame's time is: middle of a pulse as long as the exposure (default), or its rise",
    )
    unsaid.add_argument(
        "--columns",
        metavar="NAME=COLUMN,...",
        help="which columns the motion stands in: x=...,y=...,t=...,angle=...,frame=..., and host_x=... and on where "
        "the Host moves; x and y are needed",
    )
    unsaid.add_argument(
        "--unit", choices=("m", "cm", "mm", "um", "in"), help="unit of length of points and calibration"
    )
    unsaid.add_argument(
        "--axes",
        metavar="X,Y,Z",
        help="the file's axes that are the world's x, y, z, e.g. x,-z,y; z is up, towards the cameras",
    )
    unsaid.add_argument(
        "--markers", metavar="NAME,NAME", help="names of the points in the file's order; - leaves one out"
    )
    unsaid.add_argument(
        "--images",
        choices=("raw", "undistorted"),
        help="what VibrationTracker tracked: the camera's images, or undistorted ones",
    )
    unsaid.add_argument(
        "--calibrated-on",
        choices=("sensor", "window"),
        help="images of the calibration, where its file does not say their size",
    )
    unsaid.add_argument("--zeros", choices=("missing", "points"), help="what coordinates of exactly 0 mean")
    unsaid.add_argument(
        "--world",
        type=Path,
        metavar="FILE",
        help="rvec and tvec of the first camera, for a stereo calibration without a world",
    )


def run(args: argparse.Namespace) -> int:
    """Read everything before anything is written; then tracks.parquet, points.parquet, calibration.json."""
    from ovines.importers import convert
    from ovines.importers.formats import impacts_csv, motion_csv
    from ovines.importers.formats.opencv_cameras import read_cameras
    from ovines.recording import read_recording

    files = args.tracks or args.points or args.calibration or args.impacts or args.motion or args.plane
    if args.trigger_signal is not None:
        write_trigger(args, read_recording(args.recording))
        if not files:
            return 0
    if not files:
        raise InputError(
            "nothing to import",
            "--tracks, --points, --motion, --impacts, --calibration, --plane or --trigger-signal",
            "name the files; see ovines import --help",
        )
    recording = read_recording(args.recording)
    names = [camera.name for camera in recording.cameras]
    markers = [name.strip() for name in args.markers.split(",")] if args.markers else None
    found = read_cameras(args.calibration, names, args.world) if args.calibration else {}
    cameras, notes = (
        convert.cameras_in_world(found, recording, args.unit, args.axes, args.calibrated_on) if found else ([], [])
    )
    tables: dict[str, pd.DataFrame] = {}
    if args.plane:
        if found:
            raise InputError("--plane and --calibration", "one of the two", "leave one out")
        cameras, tables["calibration_covariance"], notes = _from_points(args.plane, recording, args.unit)
    if args.tracks:
        files = _by_camera(args.tracks, names)
        tables["tracks"], said = convert.tracks_table(
            files, recording, markers, args.zeros, _lenses(args, files, found)
        )
        notes += said
    if args.points:
        tables["points"], said = convert.points_table(args.points, recording, markers, args.unit, args.axes, args.zeros)
        notes += said
    if args.motion:
        tables["motion"], said = motion_csv.read_motion(args.motion, args.columns, args.unit, recording)
        notes += said
    if args.impacts:
        tables["given_impacts"], said = impacts_csv.read_impacts(args.impacts)
        notes += said
    out = args.out or recording.folder
    _write(tables, cameras, out, args)
    for note in notes + _what_next([*tables], bool(cameras), recording, out):
        print(f"  note: {note}")
    print(f"next: ovines check {args.recording}")
    return 0


def write_trigger(args: argparse.Namespace, recording: Recording) -> None:
    """``trigger.csv`` from the sampled signal, a picture of it, and what it says of the frames."""
    import numpy as np

    from analysis.accelerometers.trigger_figure import trigger_figure
    from analysis.figures.style import save_figure
    from ovines.importers.formats.trigger_signal import frame_times_s, read_signal
    from ovines.pipeline.ownership import refuse_theirs

    out = args.out or recording.folder
    path = out / "trigger.csv"
    if path.exists() and not args.force:
        raise InputError(f"{path} is there already", "a folder without it", "write over it with --force")
    refuse_theirs(out, TRIGGER_PICTURES)
    signal = read_signal(args.trigger_signal)
    times_s = frame_times_s(*signal, args.pulse)
    lines = [f"{frame},{time_s:.9f}" for frame, time_s in enumerate(times_s)]
    write_text_whole("\n".join(["frame,time_s", *lines]) + "\n", path)
    figure = trigger_figure(*signal, times_s, recording.frame_rate_hz, args.pulse)
    for name in TRIGGER_PICTURES:
        save_figure(figure, out / name)
    apart = np.diff(times_s)
    print(
        f"{path}: {len(times_s)} frames, {1 / apart.mean():.6g} per second, intervals scatter by "
        f'{1e6 * apart.std():.2g} us\n  note: add trigger = "trigger.csv" to [time] of recording.toml'
    )


def _by_camera(specs: Sequence[str], names: Sequence[str], option: str = "--tracks") -> dict[str, Path]:
    files = {}
    for spec in specs:
        camera, equals, path = spec.partition("=")
        if not equals or camera not in names:
            raise InputError(
                f"{option} {spec}",
                f"CAMERA=FILE with one of the recording's cameras: {', '.join(names) or 'none'}",
                "say which camera's file it is",
            )
        files[camera] = Path(path)
    return files


def _from_points(
    specs: Sequence[str], recording: Recording, unit: str | None
) -> tuple[list[Camera], pd.DataFrame, list[str]]:
    """Cameras of ``--plane``, their covariance, and how well they are known."""
    import pandas as pd

    from ovines.importers.formats.plane_points import read_plane_points
    from vision.calibration.uncertainty import covariance_table
    from vision.known_points import camera_of_known_points

    cameras, tables, notes = [], [], []
    files = _by_camera(specs, [camera.name for camera in recording.cameras], "--plane")
    for settings in recording.cameras:
        if settings.name not in files:
            continue
        seen = read_plane_points(files[settings.name], unit, settings.window_offset_px)
        found = camera_of_known_points(settings.name, settings.sensor_size_px, *seen)
        cameras.append(found.camera)
        tables.append(covariance_table(found.covariance, found.labels))
        notes.append(
            f"{settings.name}: {len(seen[0])} known points, missed by {found.rms_px:.2g} px rms; focal length "
            f"{found.camera.matrix[0, 0]:.4g} px, known to {100 * found.focal_sd:.2g} %: places at the points' own "
            f"height do not need it, those of markers above or below them do (x_calibration_sd_m)"
        )
    return cameras, pd.concat(tables, ignore_index=True), notes


def _lenses(
    args: argparse.Namespace, files: Mapping[str, Path], found: Mapping[str, Found]
) -> Mapping[str, Found] | None:
    """The lenses to bend undistorted pixels back by; None for pixels of the camera's own images."""
    if any(path.suffix.lower() == ".json" for path in files.values()) and args.images is None:
        raise InputError(
            "VibrationTracker's tracks do not say whether the images were undistorted",
            "--images raw, or --images undistorted (a calibration was connected to Track Target)",
            "add the one that is so",
        )
    if args.images != "undistorted":
        return None
    missing = [camera for camera in files if camera not in found]
    if missing:
        raise InputError(
            f"--images undistorted without the lens of {', '.join(missing)}",
            "the calibration by which they were undistorted",
            "add --calibration CAMERA=calibrationResults.json,poseEstimationResults.json",
        )
    return found


def _write(tables: Mapping[str, pd.DataFrame], cameras: Sequence[Camera], out: Path, args: argparse.Namespace) -> None:
    """All tables are checked before the first file is written."""
    from ovines.camera import write_calibration
    from ovines.io.provenance import provenance, sha256_of
    from ovines.tables import checked, write_table

    wanted = [_file(name) for name in tables] + (["calibration.json"] if cameras else [])
    present = [out / name for name in wanted if (out / name).exists()]
    if present and not args.force:
        raise InputError(
            f"{present[0]} is there already",
            "a folder without it",
            "name another by --out, or write over it with --force",
        )
    if out.is_file():
        raise InputError(f"--out {out} is a file", "a folder", "name another")
    sources = [
        Path(part.partition("#")[0])
        for spec in (args.tracks or []) + (args.calibration or []) + (args.plane or [])
        for part in spec.rpartition("=")[2].split(",")
    ] + [path for path in (args.points, args.motion, args.impacts, args.world) if path]
    said = {
        key: value
        for key in ("unit", "axes", "markers", "images", "calibrated_on", "zeros", "columns")
        if (value := getattr(args, key)) is not None
    }
    origin = provenance("import", said, {f"{i}: {path.name}": sha256_of(path) for i, path in enumerate(sources)})
    whole = {name: checked(table, name, _file(name)) for name, table in tables.items()}
    for name, table in whole.items():
        path = out / _file(name)
        write_table(table, name, path, origin)
        if "marker" not in table:
            print(f"{path}: {len(table)} rows")
            continue
        frames, markers = table["frame"].nunique(), table["marker"].nunique()
        full = frames * markers * (table["camera"].nunique() if "camera" in table else 1)
        print(f"{path}: {frames} frames, {markers} markers, {len(table)} rows; {full - len(table)} not seen")
    if cameras:
        write_calibration(cameras, out / "calibration.json", provenance=origin)
        print(f"{out / 'calibration.json'}: {', '.join(camera.name for camera in cameras)}")


def _file(table: str) -> str:
    return "impacts.parquet" if table == "given_impacts" else f"{table}.parquet"


def _what_next(tables: Sequence[str], calibrated: bool, recording: Recording, out: Path) -> list[str]:
    """What keeps the chain from starting at what was imported."""
    notes = []
    known = recording.calibration_file
    if calibrated and (known is None or known.resolve() != (out / "calibration.json").resolve()):
        notes.append(
            f"recording.toml names {'no calibration' if known is None else known}: set [calibration] file = "
            f'"calibration.json"'
        )
    order = ("motion", "points", "tracks", "impacts")
    first = next((name for name in order if (out / f"{name}.parquet").is_file()), None)
    brought = ["impacts" if name == "given_impacts" else name for name in tables]
    entry = next((name for name in order if name in brought), None)
    if entry == "impacts" and any(camera.frames for camera in recording.cameras):
        notes.append("the recording enters at its frames; leave them out of recording.toml to enter at impacts.parquet")
    elif entry is not None and first != entry:
        notes.append(
            f"the recording enters the chain at {first}.parquet, which is there too; remove it to enter at "
            f"{entry}.parquet"
        )
    return notes
