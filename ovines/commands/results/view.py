"""`ovines view`: scrub through the frames with what was found on them, the scene in space, the time curves."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

import pandas as pd

from ovines.camera import Camera, read_calibration
from ovines.commands.options import results_folder
from ovines.errors import InputError
from ovines.io.atomic_write import written_whole
from ovines.pipeline.ownership import refuse_strange_results, refuse_to_replace
from ovines.recording import Recording, read_recording
from ovines.tables import read_provenance, read_table

if TYPE_CHECKING:
    from analysis.report.results import Results
    from analysis.view.stream import Shown

NAME = "view"
HELP = "look at a recording's results: frames with tracks and bodies, scene, time curves (extra 'view')"
MOST_DOUBTFUL, SAID = 20, 3  # things to look at in the viewer, and on the terminal
MOST_FRAMES = 1000  # of which pictures are shown unless --every says otherwise


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Recording, its results, which frames, where to."""
    parser.add_argument("recording", type=Path, metavar="RECORDING", help="folder with recording.toml")
    parser.add_argument(
        "--results", type=Path, metavar="DIR", help="results of `ovines run` (default: results/ inside the recording)"
    )
    parser.add_argument(
        "--save", type=Path, metavar="FILE.rrd", help="write a file for the viewer instead of opening it"
    )
    parser.add_argument(
        "--frames",
        nargs=2,
        type=_count,
        default=(0, 2**62),
        metavar=("FIRST", "LAST"),
        help="pictures of these frames only",
    )
    parser.add_argument(
        "--every",
        type=_positive,
        metavar="N",
        help=f"picture of every N-th frame (default: of all, of {MOST_FRAMES} where there are more)",
    )
    parser.add_argument(
        "--simulation",
        type=Path,
        metavar="FILE",
        help="a simulation.parquet to show beside (default: each flight simulated from the impact before it)",
    )


def run(args: argparse.Namespace) -> int:
    """Open the viewer, or write the file and say what is in it."""
    rerun = _rerun()
    from analysis.view.layout import layout
    from analysis.view.stream import write
    from analysis.view.viewer import start_viewer
    from vision.frames.previews import Selection, jpegs, number_of_frames

    if args.save is not None and args.save.suffix != ".rrd":
        raise InputError(f"--save {args.save}", "a name that ends in .rrd", "change --save")
    if args.save is not None:
        refuse_to_replace(args.save, "--save")
    recording = read_recording(args.recording)
    results = args.results or results_folder(args.recording, None)
    refuse_strange_results(results, recording)
    shown, notes = _shown(recording, results, args.simulation)
    for one in shown.doubtful[:SAID]:
        print(f"look at frame {one.frame}: {one.text} ({one.kind})")
    if len(shown.doubtful) > SAID:
        print(f"and at {len(shown.doubtful) - SAID} more, in the viewer's list")
    pictures: Iterator[tuple[int, dict[str, bytes]]] = iter(())
    if any(recording.frame_files(camera.name) for camera in recording.cameras):
        last = min(args.frames[1], number_of_frames(recording) - 1)
        every = args.every or max(1, -(-(last - args.frames[0] + 1) // MOST_FRAMES))
        pictures = jpegs(recording, Selection(args.frames[0], last, every), notes)
    if args.save is None:
        _ready_to_show()
    stream = rerun.RecordingStream("ovines " + recording.name)
    if args.save is None:
        try:
            stream.connect_grpc(start_viewer(), default_blueprint=layout(shown))
        except RuntimeError as error:
            raise _no_viewer(str(error).split("\n")[0][:200]) from None
        count = write(stream, shown, pictures)
        stream.flush()
        print(f"{count} frames with pictures sent to the viewer")
        return 0
    with written_whole(args.save) as temporary:
        stream.save(temporary, default_blueprint=layout(shown))
        count = write(stream, shown, pictures)
        stream.flush()
        stream.disconnect()
    print(f"{count} frames with pictures, {args.save.stat().st_size / 1e6:.1f} MB -> {args.save}")
    print(f"to look at it: rerun {args.save}")
    return 0


def _ready_to_show() -> None:
    """The viewer's program found from any environment, and a screen to show it on."""
    beside = str(Path(sys.executable).parent)  # where pip put it, also when that environment was not activated
    if beside not in os.environ.get("PATH", "").split(os.pathsep):
        os.environ["PATH"] = os.pathsep.join(filter(None, (beside, os.environ.get("PATH", ""))))
    if sys.platform.startswith("linux") and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise _no_viewer("no screen (neither DISPLAY nor WAYLAND_DISPLAY is set)")


def _no_viewer(found: str) -> InputError:
    return InputError(
        f"the viewer cannot be opened here: {found}",
        "a screen, and the viewer of the extra 'view'",
        "write a file with --save FILE.rrd and open that where there is a screen: rerun FILE.rrd",
    )


def _rerun() -> ModuleType:
    try:
        import rerun
    except ImportError:
        raise InputError(
            "the viewer is not installed (package rerun-sdk)",
            "the optional extra 'view'",
            "in the checkout: pip install -e '.[view]'; or look at report.html and `ovines animate`",
        ) from None
    return rerun


def _shown(recording: Recording, results: Path, simulation: Path | None) -> tuple[Shown, list[str]]:
    """What the results hold, and what tracking noted (it tells which frames were renumbered)."""
    from analysis.report.results import read_results
    from analysis.view.doubtful_frames import doubtful_frames
    from analysis.view.stream import Shown

    found = read_results(results, recording)
    if found.get("motion") is None and found.get("tracks") is None:
        raise InputError(
            f"{results}: no motion.parquet and no tracks.parquet", "the results of `ovines run`",
            f"run `ovines run {recording.folder}` first",
        )  # fmt: skip
    notes = [note for name in ("tracks", "identification") for note in _notes(results / f"{name}.parquet")]
    simulated, why_not = _simulation(found, simulation)
    doubtful = doubtful_frames(recording, found.get("points"), found.get("motion"), found.get("impacts"))[
        :MOST_DOUBTFUL
    ]
    shown = Shown(
        recording,
        found.get("motion"),
        simulated,
        _cameras(recording, results),
        found.get("tracks"),
        found.get("points"),
        found.get("impacts"),
        (f"# {recording.name}", *notes, *why_not),
        doubtful,
    )
    return shown, notes


def _notes(path: Path) -> list[str]:
    return list((read_provenance(path) or {}).get("notes", ()))


def _cameras(recording: Recording, results: Path) -> list[Camera]:
    """The recording's cameras as calibrated, where they are; none for one that enters at points or motion."""
    path = recording.calibration_file or results / "calibration.json"
    if not recording.cameras or not path.is_file():
        return []
    calibrated = {camera.name: camera for camera in read_calibration(path)}
    return [calibrated[one.name] for one in recording.cameras if one.name in calibrated]


def _simulation(found: Results, path: Path | None) -> tuple[pd.DataFrame | None, list[str]]:
    """The file asked for, else each flight from the impact before it where the results allow."""
    from analysis.view.simulated_motion import simulated_beside

    if path is not None:
        return read_table(path, "simulation"), [f"simulated: {path.name}"]
    return simulated_beside(found)


def _count(text: str) -> int:
    value = int(text)
    if value < 0:
        raise argparse.ArgumentTypeError("a frame number from 0")
    return value


def _positive(text: str) -> int:
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError("a number from 1")
    return value
