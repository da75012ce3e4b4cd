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
import gc
import importlib
import os
import random
import resource
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

for variable in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(variable, "1")
ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

import cv2
import pandas as pd
import pyarrow as pa
from fuzz_damage import damage, damage_line
from fuzz_lines import LINES, Line, write_shelf

from ovines.__main__ import build, command_names
from tests.house.damage.test_fuzz_commands import parsers
from tests.processes import LOADED

MOST_CPU_S, MOST_WALL_S = 60.0, 150
MOST_BYTES, NEVER_BYTES = 4 << 30, 12 << 30  # a failure; what the process is not given at all
SHARE_OF_FILES, SHARE_OF_OPTIONS = 0.7, 0.45  # inputs whose files, whose options are damaged; at least one of the two
WARMED = 0.4  # lines that are drawn less often are not run once beforehand


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
    output = place.parent / "said"
    began = time.monotonic()
    child = os.fork()
    if child == 0:
        _child(words, place, output)
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
    said = output.read_text("utf-8", "replace") if output.exists() else ""
    return Ended(
        os.waitstatus_to_exitcode(status), said, usage.ru_utime + usage.ru_stime, time.monotonic() - began,
        usage.ru_maxrss << 10,
    )  # fmt: skip


def _child(words: list[str], place: Path, output: Path) -> None:
    status = 1
    try:
        file = os.open(output, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
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
