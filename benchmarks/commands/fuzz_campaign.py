"""Inputs of every command, made from valid ones by grammar: each is done or refused, within its budget, nothing of the
user's touched.

    python benchmarks/commands/fuzz_campaign.py COUNT [FIRST] [--out DIR] [--only COMMAND]

Input number N (FIRST, FIRST + 1, ...) is drawn from N alone: a line out of `LINES`, which works as it stands, on a
shelf of small valid files; then files that the line reads are damaged (a value, key or column replaced, lost, doubled
or out of proportion; text and bytes cut, set, inserted, nested), or its options (values that fit and values that
cannot, from the parser itself), or both.  Each runs in a forked process of its own.

A failure is a traceback, a status other than 0 and 2, a refusal without a word of why, a library's warning, more than a
minute of processor time or 4 GB beyond the loaded program, or a file of the shelf that is no longer what it was.
Failures are kept in DIR with what was said: ``python benchmarks/commands/fuzz_campaign.py 1 N`` tries one again.  One
row per command: tried, done, refused, slowest, most memory, failures.
"""

from __future__ import annotations

import argparse
import copy
import gc
import importlib
import json
import math
import os
import random
import resource
import shutil
import signal
import sys
import tempfile
import time
import tomllib
import traceback
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

for variable in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(variable, "1")
ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

import cv2
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from ovines.__main__ import build, command_names
from tests.conftest import bouncing_motion, recording_toml, write_small_recording
from tests.house.damage.test_fuzz import (
    BOARD,
    CSV,
    LENSES,
    NAMES,
    ODD,
    SCENARIO,
    TRC,
    TRIGGER,
    damaged_bytes,
    damaged_text,
)
from tests.house.damage.test_fuzz_commands import LEFT_OUT, NUMBERS, PLACES, WORDS, parsers
from tests.house.files.test_impacts_alone import impacts
from tests.processes import LOADED

MOST_CPU_S, MOST_WALL_S = 60.0, 150
MOST_BYTES, NEVER_BYTES = 4 << 30, 12 << 30  # a failure; what the process is not given at all
SHARE_OF_FILES, SHARE_OF_OPTIONS = 0.7, 0.45  # inputs whose files, whose options are damaged; at least one of the two
FACTORS = (1e3, 1e-3, -1.0, 0.0, 1e6, 1e-9, 1e300, 0.1, 10.0)
OTHERS = (float("nan"), float("inf"), -1, 0, 1, 2**63, 10**400, "", "x" * 300, "ä<b>\n", [], {}, True, [[[]]], "../x",
          [1, "a"], "\0", [float("nan")] * 3)  # fmt: skip
WARMED = 0.4  # lines that are drawn less often are not run once beforehand
RING = "[bodies.host]\ninner_radius_m = 0.05\n[bodies.nes]\nradius_m = 0.01\nmass_kg = 0.0246\ninertia_factor = 0.5\n"
MODEL = """[model]
effects = ["floor_friction", "spin_coupling"]
restitution = 0.7
wall_friction = 0.13
tangential_restitution = 0.4
"""
DRIVE = "[excitation]\nfrequency_hz = 11.0\nacceleration_g = 8.0\n"
MOTION = f"format = 1\n[time]\nframe_rate_hz = 800.0\n{RING}{DRIVE}{MODEL}"
LAW = """format = 1
name = "a law"
[[terms]]
target = "across_velocity"
coefficient = 0.0226
unit = "1"
factors = [{quantity = "speed"}, {quantity = "spin"}]
"""


@dataclass(frozen=True)
class Line:
    """A command line that works; the files (globs of the shelf) that it reads; how often it is drawn."""

    words: str
    reads: tuple[str, ...] = ()
    weight: float = 1.0

    @property
    def command(self) -> str:
        """The command, with the step of one that has steps."""
        words = self.words.split()
        return " ".join(words[: 1 + (words[0] in ("blind", "orbits"))])


# A file per camera, or one of all of them
CALIBRATIONS = [(lens, lens if lens.endswith(".toml") else f"VW1={lens} VW2={lens}") for lens in LENSES]
RUN = ("run/recording.toml", "run/tracks.parquet", "calibration.json")
RESULTS = ("results/*",)
LINES = (
    Line("check run", RUN, 16),
    Line("check motion", ("motion/*",), 16),
    Line("check film", ("film/*", "film/VW1/*"), 10),
    Line("check day", ("day/*/*",), 5),
    Line("check impacts", ("impacts/*",), 5),
    Line("triangulate run --out made", RUN, 12),
    Line("analyse run --out made", RUN, 8),
    Line("lens run --out made", RUN, 4),
    Line("track film --names names.csv --out made", ("film/*", "film/VW1/*", "names.csv"), 4),
    Line("calibrate boards --out made", ("boards/*", "boards/VW1/*"), 0.3),
    Line("identify motion --out made", ("motion/*",), 1.5),
    Line("identify impacts --out made", ("impacts/*",), 4),
    Line("run impacts --out made", ("impacts/*",), 1),
    Line("run motion --out made", ("motion/*",), 1),
    Line("report results", RESULTS, 6),
    *(Line(f"export results --to {to} --out made", RESULTS, 3) for to in ("csv", "mat", "trc", "c3d", "netcdf")),
    Line("export results --to latex --out made", RESULTS, 3),
    Line("export results --to figures --out made --width 90", RESULTS, 0.3),
    *(
        Line(f"export calibration.json --to {to} --out made", ("calibration.json",), 2)
        for to in ("opencv", "kalibr", "mrcal", "caliscope", "anipose")
    ),
    Line("compare results again --out made", ("results/*", "again/*"), 2),
    Line("compare motion --out results --runs 1", ("motion/*", "results/*"), 1),
    Line("diagnose day --out made", ("day/*/*",), 0.4),
    Line("diagnose day --out made --law law.toml", ("law.toml",), 0.39),
    Line("simulate scenario.toml --out made", ("scenario.toml",), 14),
    Line("simulate laws.toml --out made", ("laws.toml", "law.toml"), 8),
    Line("simulate scenario.toml --out made --runs 3 --spread 0.01 --seed 1", ("scenario.toml",), 3),
    Line("simulate --list", (), 0.5),
    Line("sweep scenario.toml --over drive_amplitude_factor=0.9:1.1:2 --runs 2 --out made", ("scenario.toml",), 1),
    Line("design sprung-host --band 0.9:1.1:2 --runs 1 --transient 2 --periods 2 --out made", (), 1),
    Line("orbits lyapunov long.toml --periods 1 --transient 2 --out made", ("long.toml",), 1),
    Line("orbits section scenario.toml --periods 5 --transient 2 --out made", ("scenario.toml",), 1),
    Line("orbits sensitivities scenario.toml --out made", ("scenario.toml",), 0.3),
    Line("shaker --frequency-hz 11 --acceleration-g 8 --out made", (), 5),
    Line("import target --tracks VW1=a.csv VW2=a.csv --out made", ("a.csv", "target/recording.toml"), 6),
    Line("import target --points a.trc --out made", ("a.trc", "target/recording.toml"), 6),
    *(Line(f"import lens --calibration {given} --unit m --out made", (lens,), 4) for lens, given in CALIBRATIONS),
    Line("import target --plane VW1=plane.csv VW2=plane.csv --out made", ("plane.csv",), 4),
    Line("import target --motion motion.csv --unit m --out made", ("motion.csv",), 5),
    Line("import target --impacts impacts.csv --out made", ("impacts.csv",), 5),
    Line("board charuco_5x7_8mm --out made", (), 0.5),
    Line("board mine --kind chessboard --squares 10 7 --square-mm 25 --out made", (), 4),
    Line("new fresh --cameras a b --sensor 4096 3072 --rate-hz 800 --host-radius-mm 50 --nes-radius-mm 10", (), 7),
    Line("pick film --all --names made.csv --accept", ("film/*", "film/VW1/*"), 3),
    Line("animate motion --out made.gif --start 0 --end 0.02", ("motion/*",), 1),
    Line("view motion --save made.rrd", ("motion/*",), 2),
    Line("blind score answered", ("answered/*", "answered/answers/*/*"), 3),
    Line("blind answer sealed", ("sealed/*",), 0.3),
    Line("plan motion --as-stated --days 1 --runs 1 --duration-s 0.2 --px-per-mm 5 --out made", ("motion/*.toml",), 3),
)


def write_shelf(place: Path) -> None:
    """Small valid files of every kind."""
    write_small_recording(place / "run", frames=40)
    motion = bouncing_motion(160, 800.0)
    for folder in ("motion", "day/run-1", "day/run-2"):
        (place / folder).mkdir(parents=True)
        (place / folder / "recording.toml").write_text(MOTION)
        motion.to_parquet(place / folder / "motion.parquet", index=False)
    motion.rename(columns={"nes_x_m": "x", "nes_y_m": "y", "time_s": "t"})[["t", "x", "y"]].to_csv(
        place / "motion.csv", index=False
    )
    (place / "impacts").mkdir()
    (place / "impacts/recording.toml").write_text("format = 1\n" + RING)
    given = impacts(np.random.default_rng(1), 30)
    given.to_csv(place / "impacts.csv", index=False)
    grey = np.random.default_rng(0).integers(0, 255, (48, 64)).astype(np.uint8)
    film = recording_toml("film").replace("[4096, 688]", "[64, 48]")
    for camera, offset in (("VW1", "[0, 1192]"), ("VW2", "[0, 900]")):
        film = film.replace(f'name = "{camera}"\n', f'name = "{camera}"\nframes = "{camera}/*.png"\n')
        film = film.replace(offset, "[0, 0]")
        for folder in ("film", "boards"):
            (place / folder / camera).mkdir(parents=True)
            for number in range(3):
                cv2.imwrite(str(place / folder / camera / f"frame_{number}.png"), grey)
    (place / "film/recording.toml").write_text(film)
    boards = film.replace('file = "../calibration.json"', 'board = "charuco_5x7_8mm"\nintrinsic = "{camera}/*.png"\n'
                          'extrinsic = "{camera}/frame_0.png"')  # fmt: skip
    (place / "boards/recording.toml").write_text(boards)
    (place / "target").mkdir()
    (place / "lens").mkdir()
    (place / "lens/recording.toml").write_text(film.replace("[4096, 3072]", "[40, 30]").replace("[64, 48]", "[40, 30]"))
    (place / "target/recording.toml").write_text(
        recording_toml("target").split("[calibration]")[0]
        + RING.replace("inner_radius", 'markers = ["N1"]\ninner_radius').replace(
            "radius_m = 0.01", 'markers = ["N2"]\nradius_m = 0.01'
        )
    )
    texts = {
        "scenario.toml": SCENARIO, "laws.toml": SCENARIO.replace("[nes]", 'laws = ["law.toml"]\n[nes]', 1),
        "long.toml": SCENARIO.replace("duration_s = 1.0", "duration_s = 3.0"), "law.toml": LAW, "names.csv": NAMES,
        "trigger.csv": TRIGGER, "board.toml": BOARD, "a.csv": CSV, "a.trc": TRC,
        "plane.csv": "u_px,v_px,x_mm,y_mm\n1,44,-100,-80\n60,45,100,-80\n58,3,100,80\n3,2,-100,80\n30,22,0,0\n",
        "note.txt": "note", **LENSES,
    }  # fmt: skip
    second = (
        LENSES["lens.toml"].replace("cam_0", "cam_1").replace("VW1", "VW2").replace("[0.1, 0.0, 0.5]", "[-0.2, 0, 0.5]")
    )
    texts["lens.toml"] = LENSES["lens.toml"] + second
    for name, text in texts.items():
        (place / name).write_text(text)
    (place / "empty").mkdir()


def settle(place: Path) -> list[str]:
    """Results that other lines read, and each line once as it stands, so that the children need compile nothing; the
    lines that are refused as they stand.
    """
    before = Path.cwd()
    os.chdir(place)
    refused = []
    try:
        spoken(["import", "impacts", "--impacts", "impacts.csv"])
        spoken(["run", "motion", "--out", "results"])
        spoken(["run", "motion", "--out", "again"])
        print(
            spoken(["blind", "make", "sealed", "--cases", "1", "--runs", "2", "--kinds", "none", "--seed", "1"]),
            file=sys.stderr,
        )
        shutil.copytree("sealed", "answered")
        spoken(["blind", "answer", "answered"])
        for line in LINES:
            if "view" in line.words or line.weight < WARMED:
                continue  # the viewer's library starts threads, which no fork takes along
            began = time.process_time()
            compiles = line.command.split()[0] in ("orbits", "design", "sweep", "simulate")
            status, said = spoken([*line.words.split(), *(["--yes"] if compiles else [])])
            print(f"{time.process_time() - began:6.2f} s  {status}  {line.words}", file=sys.stderr, flush=True)
            if status != 0:
                refused.append(f"{line.words}: {said[-600:]}")
            for made in ("made", "made.gif", "made.csv", "made.rrd", "fresh", "mine"):
                shutil.rmtree(place / made, ignore_errors=True)
                (place / made).unlink(missing_ok=True)
    finally:
        os.chdir(before)
    return refused


def spoken(words: list[str]) -> tuple[int, str]:
    """Status and words of a command in this process."""
    import contextlib
    import io

    said = io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
        try:
            status = importlib.import_module("ovines.__main__").main(words)
        except SystemExit as end:
            status = int(end.code or 0)
        except Exception:
            return 1, said.getvalue() + traceback.format_exc()
    return status, said.getvalue()


# --- damage ---------------------------------------------------------------------------------------------------------


def leaves(tree: Any) -> list[tuple[Any, Any]]:
    """Every (container, key) below a tree of dicts and lists."""
    found: list[tuple[Any, Any]] = []
    pairs = tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ()
    for key, value in pairs:
        found += [(tree, key), *leaves(value)]
    return found


def damaged_tree(tree: Any, draw: random.Random) -> Any:
    """One value or key replaced, scaled, lost, doubled or added."""
    tree = copy.deepcopy(tree)
    places = leaves(tree)
    if not places:
        return tree
    holder, key = draw.choice(places)
    value, kind = holder[key], draw.randrange(5)
    if kind == 0 and isinstance(value, int | float) and not isinstance(value, bool):
        holder[key] = value * draw.choice(FACTORS)
    elif kind == 1:
        del holder[key]
    elif kind == 2 and isinstance(holder, list):
        holder.insert(key, copy.deepcopy(value))
    elif kind == 2:
        holder[f"{key}_2"] = copy.deepcopy(value)
    elif kind == 3:
        other, its = draw.choice(places)
        holder[key] = copy.deepcopy(other[its]) if not isinstance(other[its], dict | list) else draw.choice(OTHERS)
    else:
        holder[key] = draw.choice(OTHERS)
    return tree


def toml_of(value: Any) -> str:
    """A value in TOML, tables inline."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return "nan" if math.isnan(value) else repr(value)
    if isinstance(value, int):
        return str(value)
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(str(k))} = {toml_of(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml_of, value)) + "]"
    return json.dumps(str(value))


def damage(path: Path, draw: random.Random) -> None:
    """One file, by what it is."""
    content = path.read_bytes()
    if path.suffix == ".parquet" and draw.random() < 0.8:
        return damage_table(path, draw)
    text = None
    if path.suffix not in (".parquet", ".png", ".gif", ".svg"):
        text = content.decode("utf-8", "replace")
    try:
        if path.suffix == ".toml" and draw.random() < 0.6:
            tree = damaged_tree(tomllib.loads(text), draw)
            path.write_text("".join(f"{json.dumps(k)} = {toml_of(v)}\n" for k, v in tree.items()), "utf-8")
            return None
        if path.suffix == ".json" and draw.random() < 0.6:
            path.write_text(json.dumps(damaged_tree(json.loads(text), draw)), "utf-8")
            return None
    except (ValueError, TypeError, OverflowError, RecursionError):
        pass  # a number that no such file can hold
    if text is not None and path.suffix == ".csv" and draw.random() < 0.6:
        rows = [line.split(",") for line in text.split("\n")]
        for _ in range(draw.choice((1, 1, 3))):
            row = draw.choice(rows)
            row[draw.randrange(len(row))] = draw.choice((*ODD, *NUMBERS, "1e5", "2e18", "-3"))
        path.write_text("\n".join(map(",".join, rows)), "utf-8")
    elif text is not None:
        edits = [
            (draw.choice(("cut", "insert", "double", "value", "line")), draw.random(), draw.choice((*ODD, *NUMBERS)))
            for _ in range(draw.choice((1, 1, 2)))
        ]
        text = damaged_text(text, edits)
        if draw.random() < 0.05:
            at = draw.randrange(len(text) + 1)
            text = text[:at] + draw.choice(("[", '{"a":', "<a>", "a.", " ")) * draw.choice((100, 20_000)) + text[at:]
        path.write_text(text, "utf-8", "surrogatepass")
    else:
        edits = [
            (draw.choice(("set", "cut", "insert", "end", "zero")), draw.random(), draw.randbytes(draw.randrange(1, 9)))
            for _ in range(draw.choice((1, 2, 3)))
        ]
        path.write_bytes(damaged_bytes(content, edits))
    return None


def damage_table(path: Path, draw: random.Random) -> None:
    """Columns and rows of a table; its own metadata stay or go."""
    kept = pq.read_table(path)
    table = kept.to_pandas()
    for _ in range(draw.choice((1, 1, 2))):
        kind, column = draw.randrange(7), draw.choice(list(table.columns) or ["x"])
        row = draw.randrange(len(table)) if len(table) else 0
        if kind == 0 and pd.api.types.is_numeric_dtype(table[column]):
            with np.errstate(all="ignore"):
                table[column] = table[column].astype(float) * draw.choice(FACTORS)
        elif kind == 1 and pd.api.types.is_numeric_dtype(table[column]):
            table[column] = table[column].astype(float) + draw.choice((1e6, 1.7e9, 1e10, -1e3, 1e300))
        elif kind == 2 and len(table):
            table[column] = table[column].astype(object)
            table.loc[row, column] = draw.choice((None, float("nan"), float("inf"), 1e6, 1e8, 2e18, -1.0, 0.0, 1e300))
            if column in kept.column_names and pd.api.types.is_numeric_dtype(kept.column(column).to_pandas()):
                table[column] = pd.to_numeric(table[column])
        elif kind == 3:
            table = table.drop(columns=column)
        elif kind == 4:
            table = table.iloc[: draw.choice((0, 1, 2, 3, len(table) // 2))].reset_index(drop=True)
        elif kind == 5:
            table = pd.concat([table, table.iloc[row : row + draw.choice((1, 50))]], ignore_index=True)
        else:
            table[column] = draw.choice((0.0, 1.0, float("nan"), "a", None, True, 5))
        if not len(table.columns):
            break
    try:
        made = pa.Table.from_pandas(table, preserve_index=False)
    except (pa.ArrowInvalid, pa.ArrowTypeError, OverflowError):
        return
    if draw.random() < 0.3:
        made = made.replace_schema_metadata(kept.schema.metadata)
    pq.write_table(made, path)


def damage_line(words: list[str], parser: argparse.ArgumentParser, draw: random.Random) -> list[str]:
    """Options added, or a value replaced."""
    words = list(words)
    actions = [a for a in parser._actions if a.option_strings and not set(a.option_strings) & set(LEFT_OUT)]
    for _ in range(draw.choice((1, 1, 2))):
        if draw.random() < 0.3 and len(words) > 1:
            words[draw.randrange(1, len(words))] = draw.choice(PLACES + NUMBERS + WORDS)
        elif actions:
            action = draw.choice(actions)
            pool = PLACES if getattr(action.type, "__name__", "") == "Path" else WORDS + NUMBERS
            pool = (*map(str, action.choices), *pool[:3]) if action.choices else pool
            count = 0 if action.nargs == 0 else action.nargs if isinstance(action.nargs, int) else 1
            words += [draw.choice(action.option_strings), *(draw.choice(pool) for _ in range(count))]
    return words


# --- one input ------------------------------------------------------------------------------------------------------


@dataclass
class Ended:
    """How an input ended."""

    status: int
    said: str
    cpu_s: float
    wall_s: float
    bytes: int
    faults: list[str] = field(default_factory=list)


def run_forked(words: list[str], place: Path) -> Ended:
    """The command in a child of this process, in which all is loaded."""
    told = place.parent / "said"
    began = time.monotonic()
    child = os.fork()
    if child == 0:
        _child(words, place, told)
    status, usage = 0, None
    deadline = began + MOST_WALL_S
    while True:
        done, status, usage = os.wait4(child, os.WNOHANG)
        if done:
            break
        if time.monotonic() > deadline:
            os.kill(child, signal.SIGKILL)
            _, status, usage = os.wait4(child, 0)
            break
        time.sleep(0.002)
    said = told.read_text("utf-8", "replace") if told.exists() else ""
    return Ended(
        os.waitstatus_to_exitcode(status), said, usage.ru_utime + usage.ru_stime, time.monotonic() - began,
        usage.ru_maxrss << 10,
    )  # fmt: skip


def _child(words: list[str], place: Path, told: Path) -> None:
    status = 1
    try:
        file = os.open(told, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
        os.dup2(file, 1)
        os.dup2(file, 2)
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        sys.stdout = open(1, "w", encoding="utf-8", closefd=False)  # noqa: SIM115  to the process's end
        sys.stderr = open(2, "w", encoding="utf-8", closefd=False)  # noqa: SIM115
        os.chdir(place)
        sys.argv = ["ovines", *words]
        resource.setrlimit(resource.RLIMIT_AS, (NEVER_BYTES, NEVER_BYTES))
        resource.setrlimit(resource.RLIMIT_CPU, (int(1.5 * MOST_CPU_S), int(1.5 * MOST_CPU_S)))
        try:
            status = importlib.import_module("ovines.__main__").main()
        except SystemExit as end:
            status = end.code if isinstance(end.code, int) else 2 if end.code else 0
        except BaseException:
            traceback.print_exc()
        sys.stdout.flush()
        sys.stderr.flush()
    finally:
        os._exit(status)


def faults_of(ended: Ended, words: Sequence[str], touched: list[str], loaded_bytes: int) -> list[str]:
    """What must not be."""
    found = []
    if "Traceback" in ended.said:
        found.append("traceback")
    elif ended.status not in (0, 2):
        found.append(f"status {ended.status}")
    elif ended.status == 2 and not any(word in ended.said for word in ("found:", "error:", "wrong:")):
        found.append("refused without a word")
    if "Warning:" in ended.said or "Exception ignored" in ended.said:
        found.append("warning")
    if ended.cpu_s > MOST_CPU_S or ended.wall_s > MOST_WALL_S:
        found.append(f"over budget: {ended.cpu_s:.0f} s")
    if ended.bytes - loaded_bytes > MOST_BYTES:
        found.append(f"over budget: {ended.bytes / 1e9:.1f} GB")
    if touched and "--force" not in words:
        found.append("touched " + ", ".join(touched))
    return found


def contents(place: Path) -> dict[str, bytes]:
    """What the user holds; results are ours."""
    return {
        str(path.relative_to(place)): path.read_bytes()
        for path in sorted(place.rglob("*"))
        if path.is_file() and path.relative_to(place).parts[0] not in ("results", "again", "sealed", "answered")
    }


def attempt(number: int, shelf: Path, own: dict[str, argparse.ArgumentParser], lines: Sequence[Line], loaded: int,
            out: Path) -> tuple[Line, Ended]:  # fmt: skip
    """Input ``number``: made, run, judged, kept where it fails."""
    draw = random.Random(number)
    line = draw.choices(lines, [one.weight for one in lines])[0]
    with tempfile.TemporaryDirectory(prefix="fuzz") as folder:
        place = Path(folder) / "inside"
        shutil.copytree(shelf, place)
        words, damaged = line.words.split(), []
        files = sorted({path for glob in line.reads for path in place.glob(glob) if path.is_file()})
        by_files, by_options = draw.random() < SHARE_OF_FILES, draw.random() < SHARE_OF_OPTIONS
        if files and (by_files or not by_options):
            for path in draw.sample(files, min(len(files), draw.choice((1, 1, 2)))):
                damage(path, draw)
                damaged.append(str(path.relative_to(place)))
        if by_options or not damaged:
            words = damage_line(words, own[line.command], draw)
        before = contents(place)
        ended = run_forked(words, place)
        after = contents(place)
        touched = [name for name, content in before.items() if after.get(name) != content]
        if [path.name for path in Path(folder).iterdir() if path.name not in ("inside", "said")]:
            touched.append("outside")
        ended.faults = faults_of(ended, words, touched, loaded)
        if ended.faults:
            keep = out / str(number)
            shutil.rmtree(keep, ignore_errors=True)
            keep.mkdir(parents=True)
            for name in damaged:
                (keep / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(place / name, keep / name)
            (keep / "said.txt").write_text(
                f"{' '.join(ended.faults)}\novines {words}\ndamaged {damaged}\n{ended.cpu_s:.1f} s\n{ended.said}",
                "utf-8",
                "replace",
            )
    return line, ended


def main() -> None:
    """Try, tell, keep what fails."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("count", type=int)
    parser.add_argument("first", type=int, nargs="?", default=0)
    parser.add_argument("--out", type=Path, default=Path("fuzz_failures"))
    parser.add_argument("--only")
    arguments = parser.parse_args()
    for name in LOADED:
        importlib.import_module(name)
    cv2.setNumThreads(1)
    pa.set_cpu_count(1)
    pa.set_io_thread_count(1)
    importlib.import_module("ovines.pipeline.series.cluster").PATIENCE_S = 0.1
    lines = [line for line in LINES if arguments.only is None or line.command == arguments.only]
    parser_of = {" ".join(words): one for words, one in parsers(build(command_names()))}
    own = {line.command: parser_of.get(line.command) or parser_of[line.words.split()[0]] for line in LINES}
    rows: dict[str, dict[str, float]] = {}
    began = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        shelf = Path(folder) / "shelf"
        write_shelf(shelf)
        for text in settle(shelf):
            print("refused as it stands:", text, file=sys.stderr, flush=True)
        gc.freeze()  # what is loaded stays shared with the children
        loaded = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss << 10
        cpu_s = 0.0
        for number in range(arguments.first, arguments.first + arguments.count):
            line, ended = attempt(number, shelf, own, lines, loaded, arguments.out)
            row = rows.setdefault(
                line.command, dict.fromkeys(("tried", "done", "refused", "slowest", "MB", "fails"), 0)
            )
            row["tried"] += 1
            row["done"] += ended.status == 0
            row["refused"] += ended.status == 2
            row["slowest"] = max(row["slowest"], ended.cpu_s)
            row["MB"] = max(row["MB"], (ended.bytes - loaded) / 1e6)
            row["fails"] += bool(ended.faults)
            cpu_s += ended.cpu_s
            if ended.faults:
                print(number, ended.faults, line.words, file=sys.stderr, flush=True)
            if number % 500 == 499:
                print(f"{number + 1 - arguments.first} tried, {cpu_s:.0f} s", file=sys.stderr, flush=True)
    table = pd.DataFrame(rows).T.sort_index()
    table.loc["all"] = table[["tried", "done", "refused", "fails"]].sum()
    table.loc["all", ["slowest", "MB"]] = table[["slowest", "MB"]].max()
    print(table.round(1).to_string())
    print(f"processor time of the inputs {cpu_s:.0f} s, of making them {time.process_time() - began:.0f} s")


if __name__ == "__main__":
    main()
