"""`ovines plan`: before the test day, which parameters its settings will determine, how surely, and what would help."""

from __future__ import annotations

import argparse
import math
from functools import partial
from pathlib import Path

from tqdm import tqdm

from ovines.camera import Camera, read_calibration
from ovines.commands.options import whole_number
from ovines.core import ScenarioError
from ovines.errors import InputError
from ovines.io.provenance import provenance, sha256_of
from ovines.io.run_log import bars_disabled
from ovines.pipeline.ownership import refuse_folder, refuse_theirs
from ovines.recording import FILE, Recording, read_recording
from ovines.tables import write_table
from ovines.workers.budget import add_yes, refuse_cost, within_budget

NAME = "plan"
HELP = (
    "Before the test day: which parameters the settings of a recording.toml will determine, how surely, and which "
    "setting would help most."
)
NOISE_PX = 0.05  # sd of a marker's centre in the practice recordings, where nothing better is known
RUNS, DURATION_S, DAYS, SCATTER = 3, 1.0, 2, 0.01
MOST_WAIT_S = 600.0  # by the clock, where the cost was stated as less than a minute of processor
LEAST_FRAMES = 10  # of a run: fewer hold no flight
MOST_RUNS, MOST_DAYS, FRAME_BYTES = 1000, 100, 2e3
TABLE, PAGE = "plan", "plan.html"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Recording, what recording.toml does not say of a day, how much to simulate."""
    parser.add_argument("recording", type=Path, metavar="RECORDING.toml", help="recording.toml of the day (or its "
        "folder): rig, drive, frame rate, markers; no pictures needed")  # fmt: skip
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder (default: plan/ beside recording.toml)")
    parser.add_argument("--runs", type=_runs, default=RUNS, metavar="N", help=f"runs of the day (default: {RUNS})")
    parser.add_argument("--duration-s", type=_positive, default=DURATION_S, metavar="S", help="filmed time of a run "
        f"(default: {DURATION_S:g})")  # fmt: skip
    noise = parser.add_mutually_exclusive_group()
    noise.add_argument("--noise-px", type=_positive, metavar="PX", help="standard deviation of a marker's centre "
        f"(default: {NOISE_PX})")  # fmt: skip
    noise.add_argument("--marker-px", type=_positive, metavar="PX", help="radius of the markers in the picture, which "
        "gives the noise in even light")  # fmt: skip
    parser.add_argument("--px-per-mm", type=_positive, metavar="PX", help="scale, where no calibration is given")
    parser.add_argument("--restitution-scatter", type=_share, default=SCATTER, metavar="SD", help="standard deviation "
        f"of the restitution from impact to impact (default: {SCATTER})")  # fmt: skip
    parser.add_argument("--days", type=_days, default=DAYS, metavar="N", help="simulated days for each setting "
        f"(default: {DAYS})")  # fmt: skip
    parser.add_argument("--as-stated", action="store_true", help="the stated settings alone, no others beside them")
    parser.add_argument("--seed", type=whole_number, default=0, help="seed of starts and noise (default: 0)")
    parser.add_argument("--figures", action="store_true", help="save the figure as SVG and PDF too")
    add_yes(parser)


def run(args: argparse.Namespace) -> int:
    """Write plan.parquet and plan.html, print what they say; wrong input is an `InputError`."""
    if args.recording.is_file() and args.recording.name != FILE:
        raise InputError(f"{args.recording}", f"a file named {FILE}, or its folder", "rename it")
    recording = read_recording(args.recording)
    out = args.out if args.out is not None else recording.folder / "plan"
    refuse_folder(out)
    refuse_theirs(out, [f"{TABLE}.parquet", PAGE], args.figures)
    from analysis.plan.day import Settings, law_of, refuse_no_drive
    from analysis.plan.noise import noise_of_marker_px, pose_noise
    from analysis.plan.page import plan_lines, plan_page, settings_in_words, write_plan
    from analysis.plan.predict import changes, cost_s, predict

    refuse_no_drive(recording)
    drive, rate = recording.excitation, recording.frame_rate_hz
    assert drive is not None and drive.acceleration_g is not None and rate is not None
    noise_px = args.noise_px or (noise_of_marker_px(args.marker_px) if args.marker_px else NOISE_PX)
    noise, guessed = pose_noise(
        recording, _cameras(recording), noise_px, None if args.px_per_mm is None else 1e3 * args.px_per_mm
    )
    assumed = [*_not_said(args, noise_px), *guessed, *law_of(recording)[1]]
    settings = Settings(
        drive.acceleration_g, drive.frequency_hz, rate, args.runs, args.duration_s, noise, args.restitution_scatter
    )
    asked = changes(settings)[: 1 if args.as_stated else None]
    most = max(one.settings.frames for one in asked)
    if settings.frames < LEAST_FRAMES * settings.runs:
        raise InputError(
            f"runs of {args.duration_s:g} s at {rate:g} frames/s: {settings.frames / settings.runs:.3g} frames",
            f"at least {LEAST_FRAMES} frames a run",
            "correct --duration-s or frame_rate_hz",
        )
    refuse_cost(
        f"{len(asked) * args.days} simulated days, {settings.frames:.0f} frames each as stated",
        cost_s(asked, args.days),
        most * FRAME_BYTES,
        args.yes,
    )
    with tqdm(total=len(asked) * args.days, desc="plan", unit="day", disable=bars_disabled()) as bar:
        try:
            work = partial(predict, recording, asked, args.days, args.seed, bar.update)
            plan = within_budget(work, f"the plan of {recording.name}", args.yes, MOST_WAIT_S)
        except ScenarioError as error:
            raise InputError(f"{recording.name}: {error.found}", error.expected, error.do) from None
    stated = {name: getattr(args, name) for name in ("runs", "duration_s", "days", "seed", "restitution_scatter")}
    record = provenance(NAME, {**stated, "noise_px": noise_px}, {FILE: sha256_of(recording.folder / FILE)})
    out.mkdir(parents=True, exist_ok=True)
    write_table(plan, TABLE, out / f"{TABLE}.parquet", record)
    page = plan_page(recording.name, settings, plan, args.days, assumed)
    written = write_plan(page, out, recording.folder, args.figures)
    for title, value in settings_in_words(settings):
        print(f"{title}: {value}")
    for one in assumed:
        print(f"  assumed: {one}")
    for line in (*plan_lines(plan), f"page: {written}"):
        print(line)
    return 0


def _cameras(recording: Recording) -> list[Camera] | None:
    """The solved calibration's cameras, where there is one already."""
    path = recording.calibration_file
    if path is None:
        return None
    known = {camera.name for camera in recording.cameras}
    cameras = [one for one in read_calibration(path) if not known or one.name in known]
    if not cameras:
        raise InputError(f"{path}: none of the cameras {', '.join(sorted(known))}", "each of them", "name them alike")
    return cameras


def _not_said(args: argparse.Namespace, noise_px: float) -> list[str]:
    """Defaults that were taken, in words."""
    sentences = []
    if args.noise_px is None:
        how = f"markers of {args.marker_px:g} px radius in even light" if args.marker_px else "as in practice"
        sentences.append(f"a marker's centre is known to {noise_px:.2g} px ({how}; --noise-px)")
    for name, usual in (("runs", RUNS), ("duration_s", DURATION_S), ("restitution_scatter", SCATTER)):
        if getattr(args, name) == usual:
            option = "--" + name.replace("_", "-")
            sentences.append(f"{name.removesuffix('_s').replace('_', ' ')} {usual:g} ({option})")
    return sentences


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan


def _positive(text: str) -> float:
    value = _number(text)
    if not 1e-9 <= value <= 1e9:
        raise argparse.ArgumentTypeError("a number above 0")
    return value


def _share(text: str) -> float:
    value = _number(text)
    if not 0.0 <= value <= 0.3:
        raise argparse.ArgumentTypeError("a number from 0 to 0.3")
    return value


def _count(text: str, most: int) -> int:
    value = int(text) if text.strip().isdecimal() and len(text) < 13 else 0
    if not 1 <= value <= most:
        raise argparse.ArgumentTypeError(f"a whole number from 1 to {most}")
    return value


def _runs(text: str) -> int:
    return _count(text, MOST_RUNS)


def _days(text: str) -> int:
    return _count(text, MOST_DAYS)
