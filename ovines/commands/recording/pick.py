"""`ovines pick`: name the markers of a recording without layout by clicking, with names suggested from geometry."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ovines.camera import Camera
from ovines.commands.options import results_folder
from ovines.errors import InputError
from ovines.io.atomic_write import write_text_whole
from ovines.pipeline.ownership import refuse_to_replace
from ovines.pipeline.runner import run_stages
from ovines.plausibility.calibration import calibrated, refuse_camera_count
from ovines.plausibility.names import HEADER, read_names
from ovines.recording import Recording, read_recording

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from vision.identity.naming_session import Naming
    from vision.identity.picker import PickWindow

NAME = "pick"
HELP = "name the markers by clicking in the first frame of each camera, for bodies without layout_m"
FILE = "names.csv"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Recording, which markers, with or without a window."""
    parser.add_argument("recording", type=Path, metavar="RECORDING", help="folder with recording.toml")
    parser.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help="folder of the results, for the calibration (default: results/ inside the recording)",
    )
    parser.add_argument(
        "--names",
        type=Path,
        metavar="FILE",
        help=f"where to write them (default: {FILE} beside recording.toml, where `ovines track` finds it)",
    )
    parser.add_argument("--all", action="store_true", help="also markers of bodies that have a layout_m")
    parser.add_argument("--blank", action="store_true", help="begin without suggested names")
    parser.add_argument("--accept", action="store_true", help="write the suggested names without a window")
    parser.add_argument("--picture", type=Path, metavar="FILE.png", help="also save what the window shows")
    parser.add_argument("--force", action="store_true", help="write over names that are there (--accept, --blank)")


def run(args: argparse.Namespace) -> int:
    """Show the window (or take the suggestion) and write the names when they are complete."""
    recording = read_recording(args.recording)
    if recording.entry() != "frames":
        raise InputError(
            f"{recording.folder} enters at {recording.entry()}.parquet",
            "a recording with frames",
            "nothing needs to be named",
        )
    markers = wanted_markers(recording, args.all)
    out = results_folder(args.recording, args.out)
    path = args.names or recording.folder / FILE
    if args.accept or args.blank:  # a window begins with the names that are there
        refuse_to_replace(path, "--names", "", args.force)
    if args.picture is not None:
        if args.picture.suffix != ".png":
            raise InputError(f"--picture {args.picture}", "a name that ends in .png", "change --picture")
        refuse_to_replace(args.picture, "--picture")
    naming, window = prepare(
        recording, _cameras(recording, out), markers, args.blank, path if path.is_file() else None, args.accept
    )
    if args.picture is not None:
        window.figure.savefig(args.picture, dpi=110, metadata={"Software": "ovines"})
    if not args.accept:
        _show()
        if not window.saved:
            print("left without saving")
            return 0
    elif naming.missing:
        camera, marker = naming.missing[0]
        raise InputError(
            f"geometry suggests no disc for {marker} in {camera}, nor for {len(naming.missing) - 1} more",
            "every marker seen by both cameras in the first frame", "name them in the window: run `ovines pick` "
                "without --accept",
        )  # fmt: skip
    lines = [",".join(HEADER)] + [f"{camera},{marker},{u:.2f},{v:.2f}" for camera, marker, u, v in naming.rows()]
    write_text_whole("\n".join(lines) + "\n", path)
    print(f"{len(lines) - 1} names -> {path}\nnext: ovines run {args.recording}")
    if path == recording.folder / FILE and (out / FILE).is_file():
        print(f"note: {out / FILE} is there too and wins; remove it to use the new names")
    return 0


def wanted_markers(recording: Recording, every: bool) -> list[str]:
    """Markers of the bodies without layout, NES first; `InputError` where there is nothing to name."""
    bodies = [recording.bodies[name] for name in ("nes", "host", "ground") if name in recording.bodies]
    markers = [marker for body in bodies if every or body.layout_m is None for marker in body.markers]
    if not markers:
        raise InputError(
            "no marker to name: every body has its layout_m"
            if any(body.markers for body in bodies)
            else "no markers in [bodies]",
            "a body with markers and without layout_m",
            "run `ovines run`; or name all of them with --all",
        )
    return markers


def _cameras(recording: Recording, out: Path) -> list[Camera]:
    """The recording's cameras; solved now where the recording brings board images and no calibration."""
    refuse_camera_count(recording)
    if len(recording.cameras) == 1:
        raise InputError(
            f"one camera in {recording.folder}",
            "two cameras: places in both name a marker that has no layout_m",
            "give layout_m, or name the markers in a names.csv (columns camera,marker,u_px,v_px)",
        )
    path = recording.calibration_file or out / "calibration.json"
    if recording.calibration_file is None:
        run_stages(recording, out, "calibrate")
    by_name = {camera.name: camera for camera in calibrated(path, recording)}
    return [by_name[one.name] for one in recording.cameras[:2]]  # further ones find what these two have named


def prepare(
    recording: Recording,
    cameras: Sequence[Camera],
    markers: Sequence[str],
    blank: bool,
    earlier: Path | None,
    hidden: bool,
) -> tuple[Naming, PickWindow]:
    """The naming, with the names of an earlier file or the suggested ones, and its window."""
    from vision.identity.geometric_names import as_rows, pair_discs, suggest_names
    from vision.identity.layouts import rig_radius
    from vision.identity.naming_session import Naming
    from vision.identity.picker import Frame, PickWindow, centres
    from vision.markers.detect import find_discs

    images = _first_images(recording)[: len(cameras)]
    fits = [find_discs(image) for image in images]
    offsets = [recording.camera(camera.name).window_offset_px for camera in cameras]
    names = [camera.name for camera in cameras]
    suggested: list[tuple[str, str, float, float]] = []
    if earlier is not None and not blank and not hidden:
        suggested = list(read_names(earlier, recording).itertuples(index=False, name=None))
    elif not blank:
        pairs = pair_discs(cameras, offsets, fits, rig_radius(recording, cameras))
        suggested = as_rows(suggest_names(pairs, recording), pairs, names, fits)
    naming = Naming(names, markers, suggested)
    frames = [Frame(*one) for one in zip(cameras, offsets, images, map(centres, fits), strict=True)]
    bodies = {marker: name for name, body in recording.bodies.items() for marker in body.markers}
    return naming, PickWindow(_figure(hidden), frames, naming, bodies)


def _first_images(recording: Recording) -> list[np.ndarray]:
    """The first picture of each camera, the one in which `ovines track` takes the names."""
    from vision.frames.sources import open_sources, stream

    sources, notes = open_sources(recording)
    frame, images = next(iter(stream(sources, notes)))
    for source, image in zip(sources, images, strict=True):
        if image is None:
            raise InputError(
                f"{source.camera.name} has no picture of frame {frame}",
                "the first frame in both cameras",
                "remove the first frame of the other camera",
            )
    return [image for image in images if image is not None]


def _figure(hidden: bool) -> Figure:
    """A figure of a window, or without one."""
    import matplotlib

    size = (13.0, 5.6)
    if hidden:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure as Plain

        figure = Plain(figsize=size)
        FigureCanvasAgg(figure)
        return figure
    import matplotlib.pyplot as plt

    if matplotlib.get_backend().lower() == "agg":
        raise InputError(
            "no window can be opened here (matplotlib has no display)", "a screen, or the suggested names as they are",
            "run it where there is a screen, or use --accept --picture names.png and check the picture",
        )  # fmt: skip
    matplotlib.rcParams["keymap.back"] = []  # holds "c", which is ours
    return plt.figure("ovines pick", figsize=size)


def _show() -> None:
    import matplotlib.pyplot as plt

    plt.show()
