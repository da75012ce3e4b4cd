"""`ovines new DIR`: a commented recording.toml to fill in, from options; it is valid as it stands."""

from __future__ import annotations

import argparse
from pathlib import Path
from tempfile import TemporaryDirectory

from ovines.errors import InputError
from ovines.new_recording import Rig, recording_text
from ovines.recording import FILE, read_recording
from ovines.written_whole import write_text_whole

NAME = "new"
HELP = "a new recording's folder with a commented recording.toml"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """``DIR --cameras VW1 VW2 --sensor W H --rate-hz ... --force``: what is left out is the thesis' rig."""
    rig = Rig()
    parser.add_argument("folder", type=Path, metavar="DIR", help="the recording's folder; made when it is not there")
    parser.add_argument("--name", help="title of the recording (default: the folder's name)")
    parser.add_argument("--cameras", nargs="+", default=rig.cameras, metavar="NAME", help="names of the cameras (default: VW1 VW2)")
    parser.add_argument("--sensor", nargs=2, type=int, default=rig.sensor_px, metavar=("WIDTH", "HEIGHT"), help="sensor in pixels")
    parser.add_argument("--rate-hz", type=float, default=rig.rate_hz, metavar="HZ", help="frames per second (default: 800)")
    parser.add_argument("--images", default=rig.images, metavar="ENDING", help="ending of the images or of the video (default: png)")
    parser.add_argument("--calibration", default=rig.calibration, metavar="FILE", help="a solved calibration.json (default: solve from board images)")
    parser.add_argument("--board", default=rig.board, metavar="BOARD", help="board of the calibration images (default: charuco_5x7_8mm)")
    parser.add_argument("--host-radius-mm", type=float, default=rig.host_radius_mm, metavar="MM", help="inner radius of the Host (default: 50)")
    parser.add_argument("--nes-radius-mm", type=float, default=rig.nes_radius_mm, metavar="MM", help="radius of the NES (default: 10)")
    parser.add_argument("--nes-mass-g", type=float, default=rig.nes_mass_g, metavar="G", help="mass of the NES (default: 24.6)")
    parser.add_argument("--frequency-hz", type=float, metavar="HZ", help="what the shaker is asked for")
    parser.add_argument("--acceleration-g", type=float, metavar="G", help="what the shaker is asked for")
    parser.add_argument("--force", action="store_true", help="write over an existing recording.toml")


def run(args: argparse.Namespace) -> int:
    """Write the file, read it back, say what to do next."""
    path: Path = args.folder / FILE
    if path.exists() and not args.force:
        raise InputError(f"{path} is there already", "a new folder", "name another, or write over it with --force")
    if args.folder.is_file():
        raise InputError(f"{args.folder} is a file", "a folder", "name another")
    text = recording_text(
        Rig(
            tuple(args.cameras), tuple(args.sensor), args.rate_hz, args.images, args.calibration, args.board,
            args.host_radius_mm, args.nes_radius_mm, args.nes_mass_g, args.frequency_hz, args.acceleration_g,
        ),
        args.name or args.folder.resolve().name,
    )  # fmt: skip
    with TemporaryDirectory() as elsewhere:  # options that the file may not hold leave nothing behind
        trial = Path(elsewhere) / FILE
        trial.write_text(text, encoding="utf-8")
        try:
            read_recording(trial)
        except InputError as error:
            raise InputError(
                f"the options give no valid recording.toml: {error.found.removeprefix(str(trial)).lstrip(', :')}",
                error.expected,
                "correct the option",
            ) from None
    write_text_whole(text, path)
    print(f"{path}\nNow put the images there, correct the lines marked <-, then: ovines check {args.folder}")
    return 0
