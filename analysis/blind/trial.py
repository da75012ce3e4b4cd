"""The blind trial: cases nobody has seen, the hash of each truth written before any of them is answered.

A trial folder holds `manifest.json` (the hashes, written first), `cases/case-NNN/` (series as docs/chain.md
has them), `sealed/case-NNN.json` (the truths; left out when the trial is sealed) and later `answers/case-
NNN/diagnosis.json`. A sealed trial keeps its seed to itself: the truths are made again from it when the
answers are scored.
"""

import hashlib
import json
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from joblib import Parallel, delayed

from analysis.blind.draw import Case, draw_cases
from analysis.blind.recording.files import Series, write_series
from analysis.blind.recording.place import draw_place
from analysis.blind.series import Outline, outline_series, run_outline
from ovines.errors import InputError
from ovines.io.atomic_write import write_text_whole

Film = Callable[[Series, Outline, Path], None]

# Filmed cases: what shows in three runs and needs no camera other than the one that is calibrated.
FILMED = (
    "none",
    "table_tilt",
    "wall_ellipticity",
    "speed_dependent_restitution",
    "camera_clock_offset",
    "unknown_central",
)
FILMED_RUNS = 3


@dataclass(frozen=True)
class TrialPlan:
    """What a trial is made of: ``count`` cases of ``runs`` runs at most and ``filmed`` more with frames, of ``kinds``
    (none: all), of severities ``sizes`` (none: any); ``seed`` draws all of it."""

    count: int
    seed: int
    kinds: tuple[str, ...] = ()
    runs: int = 12
    filmed: int = 0
    sizes: tuple[float, ...] = ()


def outlines(of: TrialPlan) -> Iterator[Outline]:
    """What a trial consists of, case by case, the filmed cases last; the same plan gives the same outlines. Each
    truth carries a salt, so that its hash cannot be guessed from the few causes there are."""
    seed = of.seed
    plan = draw_cases(of.count, np.random.default_rng([seed, 0]), of.kinds, of.sizes, of.runs)
    film = np.random.default_rng([seed, 0, 1]).permutation(len(FILMED))
    for i in range(of.filmed):
        name = FILMED[film[i % len(FILMED)]]
        causes = () if name == "none" else (name,)
        plan.append(Case(causes, (1.0,) * len(causes), "image", FILMED_RUNS))
    for index, case in enumerate(plan):
        rng = np.random.default_rng([seed, index + 1, 0])
        salt, with_parameters = rng.bytes(16).hex(), bool(rng.random() < 0.15)
        place = draw_place(np.random.default_rng([seed, index + 1, 2]), case.runs)
        if case.noise == "image":  # frames carry numbers from 0 and no times
            place = replace(place, start_s=(), first_frame=())
        place = replace(place, wall=case.wall, drive=case.drive)
        name = f"case-{index + 1:03d}"
        outline = outline_series(case.kind, case.sizes, rng, case.runs, case.noise, name, with_parameters, place)
        outline.truth["salt"] = salt
        yield outline


def truth_text(truth: dict[str, Any]) -> str:
    """The truth as written and hashed. Floats carry nine digits: a repetition elsewhere may differ in the
    last bits."""

    def rounded(value: Any) -> Any:
        if isinstance(value, dict):
            return {key: rounded(item) for key, item in value.items()}
        if isinstance(value, (list, tuple)):
            return [rounded(item) for item in value]
        return float(f"{value:.9g}") if isinstance(value, float) else value

    return json.dumps(rounded(truth), indent=1, sort_keys=True)


def truth_hash(truth: dict[str, Any]) -> str:
    """sha256 of `truth_text`."""
    return hashlib.sha256(truth_text(truth).encode()).hexdigest()


def make_trial(
    folder: Path,
    plan: TrialPlan,
    sealed: bool = False,
    film: Film | None = None,
    progress: Callable[[str], None] = lambda _: None,
    jobs: int = 1,
) -> None:
    """Write the trial of `plan`; `film` writes the frames of its filmed cases in place of tracks.

    The manifest with every hash stands before the first series is written; a trial cut short goes on where it
    was, and `jobs` processes write at a time."""
    drawn = list(outlines(plan))
    cases = [{"case": outline.truth["case"], "truth_sha256": truth_hash(outline.truth)} for outline in drawn]
    if (folder / "manifest.json").exists() and read_manifest(folder)["cases"] != cases:
        raise InputError(f"{folder} already holds another trial", "an empty or new folder", "choose another folder")
    folder.mkdir(parents=True, exist_ok=True)
    manifest = {
        "format": 1,
        "cases": cases,
        "kinds": list(plan.kinds),
        "runs": plan.runs,
        "filmed": plan.filmed,
        "sealed": sealed,
        "sizes": list(plan.sizes),
    }
    write_text_whole(json.dumps(manifest, indent=1), folder / "manifest.json")
    if not sealed:
        (folder / "sealed").mkdir(exist_ok=True)
        for outline in drawn:
            write_text_whole(truth_text(outline.truth), folder / "sealed" / f"{outline.truth['case']}.json")
    missing = [i for i, o in enumerate(drawn) if not (folder / "cases" / o.truth["case"]).exists()]
    made = Parallel(n_jobs=jobs, return_as="generator_unordered")(
        delayed(_write_case)(drawn[i], [plan.seed, i + 1, 1], folder / "cases", film if i >= plan.count else None)
        for i in missing
    )
    for done, name in enumerate(made, len(drawn) - len(missing) + 1):
        progress(f"{done}/{len(drawn)} {name} written")


def _write_case(outline: Outline, seed: list[int], folder: Path, film: Film | None) -> str:
    """One case, under its own name only when it is whole."""
    name = outline.truth["case"]
    part = folder / f"{name}.part"
    shutil.rmtree(part, ignore_errors=True)
    series = run_outline(outline, np.random.default_rng(seed))
    if film is None:
        write_series(series, part)
    else:
        film(series, outline, part)
    part.rename(folder / name)
    return name


def read_manifest(folder: Path) -> dict[str, Any]:
    """`manifest.json` of a trial folder."""
    path = folder / "manifest.json"
    if not path.exists():
        raise InputError(
            f"{path} is missing", "a folder that `ovines blind make` wrote", "run `ovines blind make` first"
        )
    return json.loads(path.read_text())


def plan_of(manifest: dict[str, Any], seed: int) -> TrialPlan:
    """What a trial was made of, by its manifest and the seed that it keeps to itself."""
    filmed = manifest["filmed"]
    kinds, sizes = tuple(manifest["kinds"]), tuple(manifest["sizes"])
    return TrialPlan(len(manifest["cases"]) - filmed, seed, kinds, manifest["runs"], filmed, sizes)


def outlines_again(folder: Path, seed: int) -> list[Outline]:
    """What a trial consists of, made again from its manifest and its seed; `InputError` where that gives other truths
    than the trial was made with."""
    manifest = read_manifest(folder)
    drawn = list(outlines(plan_of(manifest, seed)))
    _refuse_others({outline.truth["case"]: outline.truth for outline in drawn}, manifest)
    return drawn


def read_truths(folder: Path, seed: int | None = None) -> dict[str, dict[str, Any]]:
    """Truths by case, each checked against the hash that was written first. A sealed trial needs its
    `seed`."""
    manifest = read_manifest(folder)
    if manifest["sealed"]:
        if seed is None:
            raise InputError("a sealed trial without its seed", "the seed it was made with", "give --seed")
        made = outlines(plan_of(manifest, seed))
        truths = {outline.truth["case"]: json.loads(truth_text(outline.truth)) for outline in made}
    else:
        truths = {
            c["case"]: json.loads((folder / "sealed" / f"{c['case']}.json").read_text()) for c in manifest["cases"]
        }
    _refuse_others(truths, manifest)
    return truths


def _refuse_others(truths: dict[str, dict[str, Any]], manifest: dict[str, Any]) -> None:
    for case in manifest["cases"]:
        if truth_hash(truths[case["case"]]) != case["truth_sha256"]:
            raise InputError(
                f"the truth of {case['case']} has another hash than the manifest",
                case["truth_sha256"],
                "use the seed or the truths the trial was made with",
            )
