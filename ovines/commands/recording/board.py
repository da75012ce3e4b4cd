"""`ovines board`: a board of squares or tags true to scale, as PDF and SVG with a ruler, and its TOML."""

from __future__ import annotations

import argparse
from pathlib import Path

from ovines.errors import InputError
from ovines.io.atomic_write import write_text_whole, written_whole

NAME = "board"
HELP = "calibration boards to print, true to scale with a ruler, and their TOML"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """A known board by name, or a new one by its measures."""
    parser.add_argument(
        "name", nargs="?", metavar="NAME", help="a board of calibration_boards/, or the new board's name"
    )
    parser.add_argument("--list", action="store_true", help="show the known boards and stop")
    parser.add_argument(
        "--kind",
        choices=("charuco", "chessboard", "aprilgrid", "tags", "dots", "circles", "asymmetric circles"),
        default="charuco",
        help="a new board: aprilgrid is Kalibr's, tags are plain ones of any dictionary; of dots and circles, which "
        "come printed, only the TOML is written (default: charuco)",
    )
    parser.add_argument(
        "--squares", nargs=2, type=int, metavar=("COLUMNS", "ROWS"), help="a new board: its squares, or tags"
    )
    parser.add_argument("--square-mm", type=float, metavar="MM", help="a new board: edge of a square, or pitch of tags")
    parser.add_argument(
        "--marker-mm", type=float, metavar="MM", help="a new board: edge of a marker (default: 3/4 of the square)"
    )
    parser.add_argument(
        "--dictionary", help="a new board: its markers (default: DICT_5X5_100, of tags DICT_APRILTAG_36h11)"
    )
    parser.add_argument(
        "--rings", nargs=3, metavar="COLUMN,ROW", help="a new board of dots: the three that are rings, rows downwards"
    )
    parser.add_argument("--legacy", action="store_true", help="a new board: pattern of OpenCV before 4.6")
    parser.add_argument("--inverted", action="store_true", help="a new board: white for black")
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("calibration_boards"),
        metavar="DIR",
        help="folder (default: calibration_boards)",
    )
    parser.add_argument("--force", action="store_true", help="write over files that are there")


def run(args: argparse.Namespace) -> int:
    """Write NAME.pdf, NAME.svg and NAME.toml; wrong input is an `InputError`."""
    from vision.calibration.targets.board_print import as_pdf, as_svg, as_toml, draw
    from vision.calibration.targets.boards import FOLDER, board_from, find_board, read_board

    if args.list:
        for path in sorted(FOLDER.glob("*.toml")):
            board = read_board(path)
            print(
                f"{path.stem:<20} {board.kind}, {board.squares[0]} x {board.squares[1]}, "
                f"{1e3 * board.square_size_m:g} mm"
            )
        return 0
    if args.name is None:
        raise InputError("no board", "a name, or --list", "e.g. ovines board charuco_5x7_8mm")
    if args.squares is None:
        board = find_board(args.name)
    else:
        if args.square_mm is None:
            raise InputError("--squares without --square-mm", "the edge of a square", "add --square-mm 15")
        if Path(args.name).name != args.name or args.name.startswith("."):
            raise InputError(f"name {args.name!r}", "a plain name without folders", "give the folder by --out")
        board = board_from(_content(args), args.name, "the command line")
    if board.of_dots and args.squares is not None:
        toml = args.out / f"{board.name}.toml"
        if toml.exists() and not args.force:
            raise InputError(f"{toml} is there already", "a new name", "choose another, or write over it with --force")
        write_text_whole(as_toml(board), toml)
        print(toml)
        return 0
    if board.of_dots:
        raise InputError(
            f"{board.name} is a board of kind {board.kind}",
            "a board of squares or tags",
            "print circles from their maker's file",
        )
    drawing = draw(board)
    wanted = {"pdf": as_pdf(drawing), "svg": as_svg(drawing).encode()}
    toml = args.out / f"{board.name}.toml"
    clash = [args.out / f"{board.name}.{ending}" for ending in wanted] + ([toml] if args.squares else [])
    present = [path for path in clash if path.exists()]
    if present and not args.force:
        raise InputError(
            f"{present[0]} is there already", "a new name or folder", "choose another, or write over it with --force"
        )
    for ending, content in wanted.items():
        path = args.out / f"{board.name}.{ending}"
        with written_whole(path) as temporary:
            temporary.write_bytes(content)
        print(path)
    if args.squares or not toml.exists():
        write_text_whole(as_toml(board), toml)
        print(toml)
    width, height = drawing.page_mm
    print(f"page {width:g} x {height:g} mm; print at 100 % and check the ruler")
    return 0


def _content(args: argparse.Namespace) -> dict[str, object]:
    """What a new board's TOML would say."""
    content: dict[str, object] = {
        "kind": args.kind,
        "squares": list(args.squares),
        "square_size_m": round(1e-3 * args.square_mm, 9),
        "inverted": args.inverted,
    }
    if args.kind == "dots":
        try:
            content["rings"] = [[int(part) for part in ring.split(",")] for ring in args.rings or ()]
        except ValueError:
            raise InputError(f"--rings {' '.join(args.rings)}", "three of COLUMN,ROW", "correct it") from None
    if args.kind in ("charuco", "aprilgrid", "tags"):
        marker_mm = args.marker_mm if args.marker_mm is not None else 0.75 * args.square_mm
        usual = "DICT_5X5_100" if args.kind == "charuco" else "DICT_APRILTAG_36h11"
        content |= {"marker_size_m": round(1e-3 * marker_mm, 9), "dictionary": args.dictionary or usual}
    if args.kind == "charuco":
        content["legacy_pattern"] = args.legacy
    return content
