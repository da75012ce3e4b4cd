"""How fast two cameras of 4096 x 688 pixels with 12 markers are tracked, against decoding alone; and how much memory.

    python benchmarks/tracking/track.py [--frames 2000] [--long 20000] [--distinct 24] [--times 3]
                                         [--formats tif png jpg]

A rendered recording of the thesis' rig (bouncing NES); its ``--distinct`` pictures are played to and fro, by hard
links, to make
``--frames`` pictures per camera, so that the page cache holds them: the figures are those of computing, not of a disk.
Each figure is taken in a process of its own.  ``start``: what the first 20 frames cost (loading, first search), and
``walls``: the 16 instants at which the rims are fitted, once per recording however long.  Both are taken off the other
figures.  ``pictures/s`` counts those of both cameras; ``track/decode`` compares the clock with that of decoding alone;
``cpu`` is computing per frame of both cameras;
``share`` the processors' use while tracking; ``whole``: pictures/s of all there is, start and walls included.  Of
``--times`` runs the fastest counts: on a machine that others share the clock tells of them too.  ``--long 0`` leaves
the memory out.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np

import vision.track
from ovines.camera import read_calibration
from ovines.recording import Recording, read_recording
from vision.frames.sources import open_sources, stream
from vision.rendering.motion import bouncing
from vision.rendering.recording import Files, render_recording, thesis_setup
from vision.track import track
from vision.walls.table import rims_at

RECORDED_PER_S = 1600.0


def film(folder: Path, distinct: int) -> None:
    """Pictures of both cameras as uncompressed TIFF, PNG and JPEG."""
    rng = np.random.default_rng(1)
    setup = thesis_setup(rng)
    render_recording(folder, setup, bouncing(distinct / setup.frame_rate_hz), distinct, rng, Files(views=0))
    for path in sorted(folder.glob("VW*/frame_*.png")):
        image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
        assert image is not None
        cv2.imwrite(str(path.with_suffix(".tif")), image, [cv2.IMWRITE_TIFF_COMPRESSION, 1])
        cv2.imwrite(str(path.with_suffix(".jpg")), image, [cv2.IMWRITE_JPEG_QUALITY, 93])


def played(source: Path, folder: Path, suffix: str, frames: int, distinct: int) -> None:
    """A recording of `frames` pictures per camera: the distinct ones to and fro."""
    order = [*range(distinct), *range(distinct - 2, 0, -1)]
    for camera in ("VW1", "VW2"):
        (folder / camera).mkdir(parents=True)
        for frame in range(frames):
            os.link(
                source / camera / f"frame_{order[frame % len(order)]:05d}.{suffix}",
                folder / camera / f"frame_{frame:05d}.{suffix}",
            )
    text = (source / "recording.toml").read_text(encoding="utf-8")
    head, tail = text.split("[calibration]", 1)
    text = head + '[calibration]\nfile = "calibration.json"\n\n' + tail[tail.index("[bodies") :]
    (folder / "recording.toml").write_text(text.replace("/*.png", f"/*.{suffix}"), encoding="utf-8")
    (folder / "calibration.json").write_bytes((source / "true_calibration.json").read_bytes())


def decode_only(recording: Recording) -> None:
    """All pictures of both cameras through the same reader, each touched once."""
    sources, notes = open_sources(recording)
    for _, images in stream(sources, notes):
        for image in images:
            if image is not None:
                int(image[::64, ::64].sum())


def timed(folder: Path, what: str) -> None:
    """Print seconds of the clock and of computing, the walls' own, and the peak of memory in MB: one job of a
    process.
    """
    recording = read_recording(folder)
    cameras = read_calibration(folder / "calibration.json")
    walls = [0.0, 0.0]

    def rims_timed(*args: Any) -> Any:
        wall, cpu = time.perf_counter(), time.thread_time()
        rows = rims_at(*args)
        walls[0] += time.perf_counter() - wall
        walls[1] += time.thread_time() - cpu
        return rows

    vision.track.rims_at = rims_timed  # type: ignore[attr-defined,assignment]
    job: Callable[[], object] = (
        (lambda: decode_only(recording)) if what == "decode" else (lambda: track(recording, cameras))
    )
    wall, cpu = time.perf_counter(), time.process_time()
    job()
    print(time.perf_counter() - wall, time.process_time() - cpu, *walls, peak_mb())


def peak_mb() -> float:
    """Most memory this process has held.  Not getrusage's maximum, which begins with that of the process that started
    this one.
    """
    status = Path("/proc/self/status").read_text(encoding="ascii")
    return int(status[status.index("VmHWM:") :].split()[1]) / 1024


class Cost(NamedTuple):
    """Seconds of the clock and of computing without the walls, the walls' own, memory held at most."""

    wall_s: float
    cpu_s: float
    walls_wall_s: float
    walls_cpu_s: float
    peak_mb: float


def measured(folder: Path, what: str, times: int = 1) -> Cost:
    """The fastest of so many runs, each in a process of its own."""
    costs = []
    for _ in range(times):
        done = subprocess.run(
            [sys.executable, __file__, "--job", what, str(folder)], capture_output=True, text=True, check=True
        )
        wall, cpu, walls_wall, walls_cpu, peak = map(float, done.stdout.split())
        costs.append(Cost(wall - walls_wall, cpu - walls_cpu, walls_wall, walls_cpu, peak))
    return min(costs)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--frames", type=int, default=2000)
    parser.add_argument("--long", type=int, default=20_000, help="frames of the memory test; 0: none")
    parser.add_argument("--distinct", type=int, default=24)
    parser.add_argument("--times", type=int, default=3, help="runs, of which the fastest counts")
    parser.add_argument("--formats", nargs="+", default=["tif", "png", "jpg"])
    parser.add_argument("--job", nargs=2, metavar=("WHAT", "FOLDER"), help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.job:
        return timed(Path(args.job[1]), args.job[0])
    with tempfile.TemporaryDirectory() as name:
        root = Path(name)
        film(root / "film", args.distinct)
        played(root / "film", root / "warm", args.formats[0], 20, args.distinct)
        measured(root / "warm", "track")  # compiles what is not compiled yet
        start, begun = measured(root / "warm", "track", args.times), measured(root / "warm", "decode", args.times)
        print(f"start {start.wall_s:.1f} s, walls {start.walls_wall_s:.1f} s")
        print("format  pictures/s  of 1600  track/decode  cpu ms/frame  decode cpu ms/frame  share  whole  peak MB")
        more = args.frames - 20
        for suffix in args.formats:
            played(root / "film", root / suffix, suffix, args.frames, args.distinct)
            decode, whole = (measured(root / suffix, what, args.times) for what in ("decode", "track"))
            wall, cpu = max(whole.wall_s - start.wall_s, 1e-9), whole.cpu_s - start.cpu_s
            alone = decode.wall_s - begun.wall_s, decode.cpu_s - begun.cpu_s
            print(
                f"{suffix:6s} {2 * more / wall:11.0f} {2 * more / wall / RECORDED_PER_S:8.2f} {wall / alone[0]:13.2f} "
                f"{1e3 * cpu / more:13.2f}"
                f" {1e3 * alone[1] / more:20.2f} {cpu / wall:6.2f} "
                f"{2 * args.frames / (whole.wall_s + whole.walls_wall_s):6.0f}"
                f" {whole.peak_mb:8.0f}",
                flush=True,
            )
        if args.long:
            for frames in (200, args.long):
                played(root / "film", root / f"long{frames}", "tif", frames, args.distinct)
                whole = measured(root / f"long{frames}", "track")
                print(
                    f"memory: {frames} frames, peak {whole.peak_mb:.0f} MB, "
                    f"{2 * frames / (whole.wall_s + whole.walls_wall_s):.0f} pictures/s "
                    "with start and walls",
                    flush=True,
                )


if __name__ == "__main__":
    main()
