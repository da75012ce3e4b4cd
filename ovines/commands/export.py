"""`ovines export`: a solved calibration as another program reads it."""

from __future__ import annotations

import argparse
import shlex
from pathlib import Path

from ovines.errors import InputError

NAME = "export"
HELP = "write a calibration for OpenCV, Kalibr, mrcal, caliscope or Anipose"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """``CALIBRATION``, the format, where to."""
    parser.add_argument(
        "calibration", type=Path, metavar="CALIBRATION", help="a calibration.json, or a folder that holds one"
    )
    parser.add_argument(
        "--to", required=True, choices=("opencv", "kalibr", "mrcal", "caliscope", "anipose"), help="whose format"
    )
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder to write into (default: the calibration's own)")
    parser.add_argument("--force", action="store_true", help="write over files that are there")


def run(args: argparse.Namespace) -> int:
    """Everything is made before the first file is written; says how the files are read back."""
    from ovines.camera import read_calibration
    from ovines.exporters.calibrations import FORMATS, export
    from ovines.io.atomic_write import write_text_whole

    path: Path = args.calibration / "calibration.json" if args.calibration.is_dir() else args.calibration
    cameras = read_calibration(path)
    if not cameras:
        raise InputError(f"{path}: no camera", "at least one", "calibrate first: ovines calibrate")
    files = export(cameras, args.to)
    out: Path = args.out or path.parent
    if out.is_file():
        raise InputError(f"--out {out} is a file", "a folder", "name another")
    present = [out / name for name in files if (out / name).exists()]
    if present and not args.force:
        raise InputError(
            f"{present[0]} is there already",
            "a folder without it",
            "name another by --out, or write over it with --force",
        )
    out.mkdir(parents=True, exist_ok=True)
    for name, text in files.items():
        write_text_whole(text, out / name)
        print(out / name)
    reads = FORMATS[args.to].reads
    named = cameras if "{camera}" in reads else cameras[:1]
    said = [shlex.quote(word.format(camera=camera.name, out=out)) for camera in named for word in reads.split()]
    print(f"read back: ovines import RECORDING --unit m --calibration {' '.join(said)}")
    return 0
