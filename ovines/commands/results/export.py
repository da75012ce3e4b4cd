"""`ovines export`: results in the formats of other programs."""

from __future__ import annotations

import argparse
import shlex
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from ovines.errors import InputError

if TYPE_CHECKING:  # the command line is parsed without loading pandas
    import pandas as pd

NAME = "export"
HELP = (
    "results as CSV, MATLAB, TRC, C3D, NetCDF (movement's layout), LaTeX tables of the parameters, or the report's "
    "figures in a paper's width and font; a calibration for OpenCV, Kalibr, mrcal, caliscope or Anipose"
)
CALIBRATIONS = ("opencv", "kalibr", "mrcal", "caliscope", "anipose")
FORMATS = ("csv", "mat", "trc", "c3d", "netcdf", "latex", "figures", *CALIBRATIONS)
PICTURES = ("svg", "pdf", "png")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """``RESULTS --to FORMAT --out DIR --tables NAME,NAME --units mm,ms,deg --force``."""
    parser.add_argument("results", type=Path, metavar="RESULTS", help="results of `ovines run` (of a recording, or of "
        "a series), one table, or a calibration.json")  # fmt: skip
    parser.add_argument("--to", choices=FORMATS, required=True, help="the format")
    parser.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help="folder for the files (default: export/ inside RESULTS; a calibration: beside it)",
    )
    parser.add_argument("--tables", metavar="NAME,NAME", help="csv and mat: these tables only (default: all)")
    parser.add_argument("--units", default="", metavar="mm,ms,deg", help="csv and mat: lengths, times and angles in "
        "these units (default: SI); the columns' names say so")  # fmt: skip
    parser.add_argument("--width", type=_size(20, 1000), metavar="MM", help="figures: their width (default: 193)")
    parser.add_argument("--font", type=_size(3, 40), metavar="PT", help="figures: size of the font (default: 9)")
    parser.add_argument("--family", metavar="NAME", help="figures: the font's family, e.g. serif (default: sans-serif)")
    parser.add_argument("--picture", choices=PICTURES, nargs="+", default=("svg", "pdf"), help="figures: formats of "
        "their files (default: svg pdf)")  # fmt: skip
    parser.add_argument("--force", action="store_true", help="write over files that are there")


def run(args: argparse.Namespace) -> int:
    """Write the files; a line for each, and what the format cannot hold."""
    from ovines.exporters.units import chosen_units

    units = chosen_units(args.units)
    if units and args.to not in ("csv", "mat"):
        raise InputError(f"--units {args.units} --to {args.to}", "--units with csv or mat", "leave --units out")
    if args.to in CALIBRATIONS:
        return _calibration(args)
    if args.to == "figures":
        return _figures(args)
    root = args.results.parent if args.results.is_file() else args.results
    folders = [
        root,
        *sorted({path.parent for path in root.glob("*/*.parquet") if (path.parent / "source.json").is_file()}),
    ]
    read = {folder: _tables(folder, _wanted(args)) for folder in folders}
    read = {folder: tables for folder, tables in read.items() if tables}
    if not read:
        raise InputError(f"{args.results}: no table" + (f" of {args.tables}" if args.tables else ""),
                         "results of `ovines run`, or a table", "run `ovines run`, or name its --out")  # fmt: skip
    out = args.out or root / "export"
    jobs: list[tuple[Path, Callable[[Path], None]]] = []
    notes: list[str] = []
    for folder, tables in read.items():
        jobs += _files(args.to, folder, out / folder.relative_to(root), tables, units, notes)
    if args.to == "latex":
        jobs += _series(root, out, read)
    if not jobs:
        raise InputError(f"{args.results}: nothing that {args.to} holds", "points or motion (trc, c3d, netcdf), or an "
                         "identification (latex)", "run `ovines run` first")  # fmt: skip
    _refuse_present([path for path, _ in jobs], args.force)
    for path, write in jobs:
        write(path)
        print(path)
    for note in notes:
        print(f"  note: {note}")
    return 0


def _refuse_present(paths: list[Path], force: bool) -> None:
    present = [path for path in paths if path.exists()]
    if present and not force:
        raise InputError(f"{present[0]} is there already", "a folder without that file", "name another --out, or write "
                         "over it with --force")  # fmt: skip


def _calibration(args: argparse.Namespace) -> int:
    """A solved calibration as another program reads it: all files are made before the first is written."""
    from ovines.camera import read_calibration
    from ovines.exporters.calibrations import FORMATS as PROGRAMS
    from ovines.exporters.calibrations import export
    from ovines.io.atomic_write import write_text_whole

    path: Path = args.results / "calibration.json" if args.results.is_dir() else args.results
    cameras = read_calibration(path)
    if not cameras:
        raise InputError(f"{path}: no camera", "at least one", "calibrate first: ovines calibrate")
    files = export(cameras, args.to)
    out: Path = args.out or path.parent
    if out.is_file():
        raise InputError(f"--out {out} is a file", "a folder", "name another")
    _refuse_present([out / name for name in files], args.force)
    out.mkdir(parents=True, exist_ok=True)
    for name, text in files.items():
        write_text_whole(text, out / name)
        print(out / name)
    reads = PROGRAMS[args.to].reads
    named = cameras if "{camera}" in reads else cameras[:1]
    said = [shlex.quote(word.format(camera=camera.name, out=out)) for camera in named for word in reads.split()]
    print(f"read back: ovines import RECORDING --unit m --calibration {' '.join(said)}")
    return 0


def _figures(args: argparse.Namespace) -> int:
    """Every figure of a recording's report, drawn again."""
    from analysis.figures.print_size import PrintSize, fit_to_print
    from analysis.figures.style import save_figure
    from analysis.report.page import figure_of
    from analysis.report.pages.recording_report import recording_page
    from analysis.report.results import read_results
    from ovines.pipeline.functions import first_frames
    from ovines.pipeline.ownership import SOURCE, read_source, refuse_strange_results
    from ovines.recording import read_recording

    named = read_source(args.results).get("recording")
    if not isinstance(named, str):
        raise InputError(f"{args.results}: no {SOURCE} of a recording", "the results of one recording",
                         "name the folder of one run")  # fmt: skip
    recording = read_recording(args.results / named)
    refuse_strange_results(args.results, recording)
    out = args.out or args.results / "export"
    page = recording_page(read_results(args.results, recording, first_frames(recording)))
    figures = {name: figure_of(name, figure) for section in page.sections for name, figure in section.figures.items()}
    paths = {out / f"{name}.{ending}": figure for name, figure in figures.items() for ending in args.picture}
    _refuse_present(list(paths), args.force)
    for figure in figures.values():
        fit_to_print(figure, PrintSize(args.width, args.font, args.family))
    out.mkdir(parents=True, exist_ok=True)
    for path, figure in paths.items():
        print(save_figure(figure, path))
    return 0


def _size(low: float, high: float) -> Callable[[str], float]:
    def size(text: str) -> float:
        value = float(text)
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"a number from {low:g} to {high:g}")
        return value

    return size


def _wanted(args: argparse.Namespace) -> list[str]:
    from ovines.tables import TABLES

    if args.results.is_file():
        if args.results.stem not in TABLES or args.results.suffix != ".parquet":
            raise InputError(f"{args.results}", "a table by its name, as motion.parquet", "name the results folder")
        return [args.results.stem]
    names = [name.strip() for name in args.tables.split(",")] if args.tables else list(TABLES)
    for name in names:
        if name not in TABLES:
            raise InputError(f"--tables {name}", "of " + ", ".join(TABLES), "correct the name")
    return names


def _tables(folder: Path, names: list[str]) -> dict[str, pd.DataFrame]:
    """The tables that are there."""
    from ovines.tables import read_table

    found = {}
    for name in names:
        path = folder / f"{name}.parquet"
        if path.is_file():
            found[name] = read_table(path, name)
    return found


def _files(
    to: str, folder: Path, out: Path, tables: dict[str, pd.DataFrame], units: dict[str, str], notes: list[str]
) -> list[tuple[Path, Callable[[Path], None]]]:
    """What one folder of results becomes: path and how to write it."""
    from ovines.exporters import latex, motion_capture, tables_as
    from ovines.exporters.marker_paths import marker_paths
    from ovines.tables import read_provenance

    if to in ("csv", "mat"):  # columns that are missing throughout say nothing
        tables = {name: one.dropna(axis="columns", how="all") for name, one in tables.items()}
    if to == "csv":
        return [(out / f"{name}.csv", partial(tables_as.write_csv, one, units=units)) for name, one in tables.items()]
    if to == "mat":
        made = {name: read_provenance(folder / f"{name}.parquet") for name in tables}
        return [(out / "results.mat", lambda path: tables_as.write_mat(tables, made, path, units))]
    if to == "latex":
        known = tables.get("identification")
        return [] if known is None else [(out / "parameters.tex", lambda path: latex.write_parameters(known, path))]
    if "points" not in tables and "motion" not in tables:
        return []
    paths = marker_paths(tables, folder)
    if to in ("trc", "c3d") and paths.off_clock_s > 1e-6:
        notes.append(f"{folder}: times lie up to {1e6 * paths.off_clock_s:.3g} us off the even clock of "
                     f"{paths.rate_hz:.6g} Hz" + (", and C3D keeps the clock only" if to == "c3d" else ""))  # fmt: skip
    name = "markers" if "points" in tables else "bodies"
    write: dict[str, Callable[[Path], None]] = {
        "trc": lambda path: motion_capture.write_trc(paths, path),
        "c3d": lambda path: motion_capture.write_c3d(paths, path),
        "netcdf": lambda path: tables_as.write_netcdf(paths, path, folder.resolve().name),
    }
    return [(out / f"{name}.{'nc' if to == 'netcdf' else to}", write[to])]


def _series(
    root: Path, out: Path, read: dict[Path, dict[str, pd.DataFrame]]
) -> list[tuple[Path, Callable[[Path], None]]]:
    from ovines.exporters.latex import write_tests

    tests = {folder.name: tables["identification"] for folder, tables in read.items()
             if folder != root and "identification" in tables}  # fmt: skip
    return [(out / "tests.tex", lambda path: write_tests(tests, path))] if tests else []
