"""`ovines diagnose`: where simulator and experiment differ, which effect causes it, how far it shrinks."""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd
from tqdm import tqdm

from ovines.camera import Camera, read_calibration
from ovines.chain import location
from ovines.commands.stage_command import results_folder
from ovines.errors import InputError
from ovines.lock import locked
from ovines.provenance import provenance, sha256_of
from ovines.recording import Recording, read_series
from ovines.running import run_stages
from ovines.seen import refuse_uninformative
from ovines.tables import read_table, write_table
from ovines.written_whole import write_text_whole

if TYPE_CHECKING:
    from analysis.gap.series import Series

NAME = "diagnose"
HELP = "the sim-to-real gap of a series: where it lies, which effect causes it, how far it shrinks"
ORDER = ("frames", "tracks", "points", "motion")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """``SERIES --out DIR --write-model FILE --seed N``."""
    parser.add_argument("series", type=Path, metavar="SERIES", help="folder of recordings (or one recording)")
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder for the results (default: results/ inside the series)")
    parser.add_argument("--write-model", type=Path, metavar="FILE", help="write the nominal model with the effect added, as a [model] section")
    parser.add_argument("--withhold", action="append", default=[], metavar="EFFECT", help="take an effect out of the library for a trial: the answer must become unknown")
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="of the bootstrap of the shrinkage's interval (default: 0)")


def run(args: argparse.Namespace) -> int:
    """Diagnose, write diagnosis.json, predictions.parquet and gap.html, say the verdict."""
    import numpy as np

    from analysis.gap.diagnose import diagnose
    from analysis.gap.page import gap_page

    out = results_folder(args.series, args.out)
    recordings = read_series(args.series)
    with locked(out), tqdm(total=4, desc="diagnose", disable=None) as bar:
        series, sources = load(recordings, out)
        bar.update()
        bar.set_postfix_str("flights, impacts, candidates")
        diagnosis = diagnose(series, np.random.default_rng(args.seed), known_effects(args.withhold))
        bar.update()
        bar.set_postfix_str("report")
        made = provenance("diagnose", {"seed": args.seed}, {name: sha256_of(path) for name, path in sources.items()})
        write_table(diagnosis.predictions, "predictions", out / "predictions.parquet", made)
        # The answer first: the page is drawn from it.
        write_text_whole(json.dumps(plain({**diagnosis.summary, "provenance": made}), indent=1, allow_nan=False) + "\n", out / "diagnosis.json")
        write_text_whole(gap_page(diagnosis, args.series.resolve().name).render(), out / "gap.html")
        bar.update()
        if args.write_model is not None:
            write_text_whole(model_section(diagnosis.summary, recordings[0]), args.write_model)
        bar.update()
    print(say(diagnosis.summary))
    return 0


def plain(value: Any) -> Any:
    """JSON's own values: numpy numbers as Python's, and null where a number could not be determined (JSON knows no NaN)."""
    if isinstance(value, dict):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [plain(v) for v in value]
    if hasattr(value, "item"):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value


def known_effects(names: Sequence[str]) -> frozenset[str]:
    """The names given to --withhold, each an effect of the library."""
    from ovines.core.effects import EFFECTS

    for name in names:
        if name not in EFFECTS:
            raise InputError(f"--withhold {name}", "one of " + ", ".join(EFFECTS), "correct the name")
    return frozenset(names)


def load(recordings: Sequence[Recording], out: Path) -> tuple[Series, dict[str, Path]]:
    """The series at its entry, and the files it was read from by name; all recordings enter at the latest of their entries."""
    from analysis.gap.series import from_motions, from_points
    from analysis.motion import motion_from_points

    entries = [recording.entry() for recording in recordings]
    entry = max(entries, key=ORDER.index)
    cameras: list[Camera] | None = None
    tracks: list[pd.DataFrame] = []
    points: list[pd.DataFrame] = []
    motions: list[pd.DataFrame] = []
    sources: dict[str, Path] = {}
    for recording, kind in zip(recordings, entries, strict=True):
        folder = out / "recordings" / recording.folder.resolve().name
        path = recording.folder / f"{kind}.parquet"
        if kind == "frames":
            run_stages(recording, folder, only="track")
            path = folder / "tracks.parquet"
        sources[f"{recording.folder.resolve().name}/{path.name}"] = path
        table = read_table(path, path.stem)
        if kind in ("frames", "tracks"):
            (found,) = location("calibration.json", recording, folder)[:1] or (_no_calibration(recording),)
            cameras = read_calibration(found)
            tracks.append(table)
            table = triangulate_again(table, cameras, recording, (0.0, 0.0))
            kind = "points"
        points.append(table) if kind == "points" else motions.append(table)
        if kind == "points" and entry == "motion":
            motions.append(motion_from_points(table, recording))
    if entry == "motion":
        series = from_motions(recordings, motions)
    else:
        whole = len(tracks) == len(recordings)
        series = from_points(recordings, points, cameras if whole else None, tracks if whole else None, triangulate_again)
    refuse_uninformative(series.motions, recordings)
    return series, sources


def triangulate_again(tracks: pd.DataFrame, cameras: Sequence[Camera], recording: Recording, shift_px: tuple[float, float]) -> pd.DataFrame:
    """Points of the tracks with the second camera's window moved by ``shift_px``: what the diagnosis calls after a correction."""
    from vision.triangulate import triangulate

    offsets: dict[str, list[float]] = {name: list(offset) for name, offset in recording.window_offset_px.items()}
    second = cameras[1].name
    if second in offsets:
        offsets[second] = [offsets[second][0] + shift_px[0], offsets[second][1] + shift_px[1]]
    return triangulate(tracks, cameras, offsets)


def _no_calibration(recording: Recording) -> Path:
    raise InputError(f"{recording.folder}: no calibration for its tracks", "calibration.json, or board images to solve it from",
                     "give [calibration] in recording.toml")


def model_section(summary: dict[str, Any], recording: Recording) -> str:
    """The improved nominal model as the ``[model]`` section of recording.toml: known effects and the ones found, parameters refitted."""
    known = list(recording.model.effects) if recording.model else ["floor_friction", "spin_coupling"]
    added = [name for name in summary["effects"] if name not in known]
    if "floor_friction" in added and "spin_coupling" not in known:
        added.append("spin_coupling")
    lines = ["[model]", "# " + summary["verdict"] + (": " + ", ".join(summary["effects"]) if summary["effects"] else ""),
             f"effects = {json.dumps(known + added)}"]
    for name in ("restitution", "wall_friction", "tangential_restitution", "floor_friction"):
        value = summary["nominal"].get(name, {}).get("with_effect")
        if value is not None:
            lines.append(f"{name} = {value:.6g}")
    for effect, parameters in summary["parameters"].items():
        for parameter, interval in parameters.items():
            lines.append(f"# {effect}.{parameter} = {interval['value']:.6g}  (90 %: {interval['low']:.6g} .. {interval['high']:.6g})")
    return "\n".join(lines) + "\n"


def say(summary: dict[str, Any]) -> str:
    """The answer in a few lines for the terminal."""
    if summary["verdict"] == "none":
        return "none: the nominal model explains these data; the smallest sizes that would have been seen stand in diagnosis.json"
    if summary["verdict"] == "unknown":
        found = summary["goes_with"][0]
        return f"unknown: structure in the {found['stage']} ({found['coordinate']}) that goes with {found['goes_with']}"
    gap = summary["gap"]
    return (f"effect: {', '.join(summary['effects'])} ({summary['stage']}); gap shrinks by {100 * gap['shrinkage']:.0f} % "
            f"({100 * gap['shrinkage_low']:.0f}..{100 * gap['shrinkage_high']:.0f} %)")
