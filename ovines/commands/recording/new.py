"""`ovines new DIR`: a commented recording.toml to fill in, from options or from questions; it is valid as it stands."""

from __future__ import annotations

import argparse
import glob
import os
import re
import sys
from collections.abc import Collection
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from ovines.errors import InputError
from ovines.io.atomic_write import write_text_whole
from ovines.new.questions import Terminal, ask
from ovines.new.recording import PROTOTYPES, Rig, recording_text
from ovines.recording import FILE, read_recording

NAME = "new"
HELP = "a new recording's folder with a commented recording.toml; at a terminal, asks for the options that are left out"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """``DIR --cameras VW1 VW2 --sensor W H --rate-hz ... --force``: what is left out is asked for, or is the thesis'
    rig.
    """
    parser.add_argument("folder", type=Path, metavar="DIR", help="the recording's folder; made when it is not there")
    parser.add_argument(
        "--prototype", choices=tuple(PROTOTYPES), help="a rig of the thesis whose drive and bodies are the defaults"
    )
    parser.add_argument("--name", help="title of the recording (default: the folder's name)")
    parser.add_argument("--cameras", nargs="+", metavar="NAME", help="names of the cameras (usual: VW1 VW2)")
    parser.add_argument(
        "--sensor",
        nargs=2,
        type=int,
        metavar=("WIDTH", "HEIGHT"),
        dest="sensor_px",
        help="sensor in pixels (usual: 4096 3072)",
    )
    parser.add_argument("--rate-hz", type=float, metavar="HZ", help="frames per second (usual: 800)")
    parser.add_argument("--images", metavar="ENDING", help="ending of the images or of the video (usual: png)")
    parser.add_argument(
        "--calibration", metavar="FILE", help="a solved calibration.json (usual: solve from board images)"
    )
    parser.add_argument(
        "--board", metavar="BOARD", help="board of the calibration images, or its TOML file (usual: charuco_5x7_8mm)"
    )
    parser.add_argument(
        "--frames",
        metavar="PATTERN",
        help="where the cameras' pictures lie, seen from here: a glob or a video in which {camera} stands for the name",
    )
    parser.add_argument(
        "--intrinsic",
        metavar="PATTERN",
        help="where the board images lie, seen from here, likewise; without --frames the recording only calibrates",
    )
    parser.add_argument(
        "--extrinsic", metavar="PATTERN", help="the view of the board in the world position (of a film: a frame of it)"
    )
    parser.add_argument("--host-radius-mm", type=float, metavar="MM", help="inner radius of the Host (usual: 50)")
    parser.add_argument("--nes-radius-mm", type=float, metavar="MM", help="radius of the NES (usual: 10)")
    parser.add_argument("--nes-mass-g", type=float, metavar="G", help="mass of the NES (usual: 24.6)")
    parser.add_argument("--frequency-hz", type=float, metavar="HZ", help="what the shaker is asked for")
    parser.add_argument("--acceleration-g", type=float, metavar="G", help="what the shaker is asked for")
    parser.add_argument(
        "--usual", action="store_true", help="ask nothing: what is left out is as usual, the thesis' rig"
    )
    parser.add_argument("--force", action="store_true", help="write over an existing recording.toml")


def run(args: argparse.Namespace) -> int:
    """Write the file, read it back, say what to do next."""
    path: Path = args.folder / FILE
    if path.exists() and not args.force:
        raise InputError(f"{path} is there already", "a new folder", "name another, or write over it with --force")
    if args.folder.is_file():
        raise InputError(f"{args.folder} is a file", "a folder", "name another")
    name = args.name or args.folder.resolve().name
    given: dict[str, Any] = {
        field: value for field in Rig.__dataclass_fields__ if (value := getattr(args, field)) is not None
    }
    given = {field: tuple(value) if isinstance(value, list) else value for field, value in given.items()}
    given |= _foreign(args, given)
    rig = replace(PROTOTYPES.get(args.prototype, Rig()), **given)
    try:
        _check(rig, name)
    except InputError as error:
        raise InputError(
            f"the options give no valid {FILE}: {error.found}", error.expected, "correct the option"
        ) from None
    if sys.stdin.isatty() and not (args.intrinsic or args.frames) and sys.stdout.isatty() and not args.usual:
        rig = _asked(rig, given, name)
    write_text_whole(recording_text(rig, name), path)
    if rig.of_board_alone:
        print(f"{path}\nnext: ovines calibrate {args.folder}")
        return 0
    print(f"{path}\nNow put the images there, correct the lines marked <-, then: ovines check {args.folder}")
    return 0


def _foreign(args: argparse.Namespace, given: dict[str, Any]) -> dict[str, Any]:
    """Patterns and the board's file as seen from the recording's folder, and the sensor as the pictures have it."""
    found: dict[str, Any] = {}
    if (args.intrinsic is None) != (args.extrinsic is None):
        raise InputError(
            "--intrinsic and --extrinsic go together",
            "the board tilted and turned, and one view of it in the world position (a film may be both)",
            "name both",
        )
    cameras = given.get("cameras", Rig().cameras)
    for option in ("frames", "intrinsic", "extrinsic"):
        pattern = getattr(args, option)
        if pattern is None:
            continue
        for camera in cameras:
            files = sorted(glob.glob(pattern.replace("{camera}", camera)))
            if not files:
                raise InputError(
                    f"--{option} {pattern}: no file of camera {camera}",
                    "a path seen from here, {camera} standing for each name of --cameras",
                    "correct it, and quote it",
                )
            found.setdefault("sensor_px", _size_of(Path(files[0])))
        found[option] = _from(args.folder, pattern)
    if args.board is not None and Path(args.board).is_file():
        found["board"] = _from(args.folder, args.board)
    return found | ({"sensor_px": given["sensor_px"]} if "sensor_px" in given else {})


def _from(folder: Path, path: str) -> str:
    """A path (or pattern) seen from here, as it is seen from ``folder``."""
    return os.path.relpath(Path.cwd() / path, Path.cwd() / folder)


def _size_of(path: Path) -> tuple[int, int]:
    """Width and height of a picture, or of a film's."""
    import cv2

    from vision.video import VIDEO_SUFFIXES, open_video

    if path.suffix.lower() in VIDEO_SUFFIXES:
        image = open_video(path).read()[1]
    else:
        image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED | cv2.IMREAD_IGNORE_ORIENTATION)  # type: ignore[assignment]
    if image is None:
        raise InputError(f"{path} cannot be read", "a picture, or a video that OpenCV reads", "check the file")
    return int(image.shape[1]), int(image.shape[0])


def _asked(rig: Rig, given: Collection[str], name: str) -> Rig:
    print("Enter takes what stands in brackets.")
    try:
        return ask(rig, given, lambda trial: _check(trial, name), Terminal())
    except EOFError:
        raise InputError(
            "the input ended before the last question", "an answer to each", "run it again, or add --usual"
        ) from None


def _check(rig: Rig, name: str) -> None:
    """Refuse what no recording.toml may hold, by the reader itself and elsewhere: it leaves nothing behind."""
    with TemporaryDirectory() as elsewhere:
        trial = Path(elsewhere) / FILE
        trial.write_text(recording_text(rig, name), encoding="utf-8")
        try:
            read_recording(trial)
        except InputError as error:  # neither that file nor its lines mean anything to the user
            found = re.sub(r"^[\s,:]*(line \d+:)?\s*", "", error.found.removeprefix(str(trial)))
            raise InputError(found, error.expected, error.do) from None
