"""`ovines blind`: sealed cases made by an independent plant, answered by the diagnosis, then scored."""

from __future__ import annotations

import argparse
import json
import os
import shutil
import sys
import time
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from joblib import Parallel, delayed

from analysis.blind import trial
from analysis.blind.scoring import report, score
from analysis.blind.scoring.intervals import Figure
from analysis.blind.scoring.oracle import in_flights, oracle_share
from analysis.blind.scoring.probabilities import probability_figures, reliability
from analysis.blind.scoring.withheld import Withheld, judge_withheld, to_withhold, withheld_markdown
from analysis.blind.series import Outline, run_outline
from ovines import __version__
from ovines.blind_film import film_series
from ovines.commands.options import jobs, whole_number
from ovines.errors import InputError
from ovines.io.atomic_write import write_text_whole
from ovines.law_file import read_law
from ovines.pipeline.series.closed_loop import MOST_RUNS, WAYS, Course, is_open, settle
from ovines.pipeline.series.closed_loop import markdown as loop_markdown
from ovines.tables import read_table
from ovines.workers.budget import add_yes, refuse_cost
from ovines.workers.orphans import die_with

if TYPE_CHECKING:
    from ovines.pipeline.series.law_oracle import LawShare

NAME = "blind"
# What is said of a case whose diagnosis ended in an error.
NO_ANSWER = "no answer"
HELP = "Make sealed cases with a plant of their own, answer them, and score the answers."


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Sub-commands make, answer, withhold, loop, score."""
    parser.description = HELP
    steps = parser.add_subparsers(dest="step", required=True)
    make = steps.add_parser("make", help="write cases; the hash of every truth is written first")
    make.add_argument("folder", type=Path)
    make.add_argument("--cases", type=whole_number, default=80, help="how many series (default: 80)")
    make.add_argument("--seed", type=whole_number, required=True, help="the same seed gives the same cases")
    make.add_argument(
        "--kinds",
        default="",
        help="only these, separated by commas: none, listed, pair, triple (of listed causes), unknown, later, latest, "
        "newest, unforeseen, unimagined, undreamt, unsuspected, unexpected, untold, plausible, overlooked, reported, "
        "suspected, refereed, witnessed, foreseen, borrowed, likely, expected, supposed, probable, presumed, surmised, "
        "conjectured, envisaged, imaginable, thinkable (of causes in nobody's list, by when they were written), beside "
        "(one of each), causes by name, several joined by +",
    )
    make.add_argument(
        "--sizes", default="", help="severities of the causes, in turn; 1 is large (default: any from 0.3 to 1.2)"
    )
    make.add_argument("--runs", type=whole_number, default=12, help="recordings per series (default: 12)")
    make.add_argument(
        "--seal", action="store_true", help="keep the truths out of the folder; scoring then needs the seed"
    )
    make.add_argument(
        "--rendered",
        type=whole_number,
        default=0,
        metavar="K",
        help="further cases given as images of three runs each (minutes and about 1 GB per case)",
    )
    _add_jobs(make)
    answer = steps.add_parser("answer", help="run the diagnosis on every case that has no answer yet")
    answer.add_argument("folder", type=Path)
    _add_jobs(answer)
    without = steps.add_parser(
        "withhold", help="answer every case without its cause in the library: withheld.md says what came back"
    )
    without.add_argument("folder", type=Path)
    without.add_argument("--seed", type=whole_number, default=None, help="the seed of a sealed trial")
    without.add_argument("--most", type=whole_number, default=None, metavar="N", help="the first N such cases only")
    _add_jobs(without)
    loop = steps.add_parser(
        "loop", help="have the plant make the runs that `next_test` asks for, until the cause stands alone: loop.md"
    )
    loop.add_argument("folder", type=Path)
    loop.add_argument("--seed", type=whole_number, required=True, help="the seed that the trial was made with")
    loop.add_argument("--most", type=whole_number, default=None, metavar="N", help="the first N open cases only")
    _add_jobs(loop)
    marks = steps.add_parser(
        "score", help="compare answers with truths: score.json, score.md, confusion.png, reliability.png"
    )
    marks.add_argument("folder", type=Path)
    marks.add_argument("--seed", type=whole_number, default=None, help="the seed of a sealed trial")
    marks.add_argument("--partial", action="store_true", help="score the cases answered so far")
    marks.add_argument(
        "--laws", action="store_true", help="hold written laws against the plant's own, too: minutes a case"
    )
    _add_jobs(marks)


def _add_jobs(step: argparse.ArgumentParser) -> None:
    step.add_argument("--jobs", type=jobs, default=1, help="cases at a time, each in a process; 0: one per processor "
        "(default: 1)")  # fmt: skip
    add_yes(step)


# Of one processor: making a run, filming a case, diagnosing one (docs/reference/durations.md).  A trial is asked for by
# its number of cases: what it costs is said, and stops above a day.
RUN_S, FILM_S, ANSWER_S, LONGEST_S = 0.2, 180.0, 30.0, 86400.0


def _refuse_costly(what: str, seconds: float, args: argparse.Namespace) -> None:
    refuse_cost(what, seconds / _processes(args), 0.0, args.yes, LONGEST_S)


def _processes(args: argparse.Namespace) -> int:
    return args.jobs or os.cpu_count() or 1


def run(args: argparse.Namespace) -> int:
    """Dispatch to the step; 0 when it is done."""
    steps = {"make": _make, "answer": _answer, "withhold": _withhold, "loop": _loop, "score": _score}
    return steps[args.step](args)


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def _make(args: argparse.Namespace) -> int:
    if args.cases < 1 or args.runs < 1:
        raise InputError(f"{args.cases} cases of {args.runs} runs", "at least one of each", "give larger numbers")
    kinds = tuple(kind.strip() for kind in args.kinds.split(",") if kind.strip())
    try:
        sizes = tuple(float(size) for size in args.sizes.split(",") if args.sizes)
        wrong = bool(sizes) and min(sizes) <= 0
    except ValueError:
        sizes, wrong = (), True
    if wrong:
        raise InputError(f"--sizes {args.sizes}", "positive numbers separated by commas", "for example --sizes 1,0.35")
    cost_s = args.cases * args.runs * RUN_S + args.rendered * FILM_S
    _refuse_costly(f"{args.cases} cases of {args.runs} runs and {args.rendered} films", cost_s, args)
    if (args.folder / "manifest.json").exists():
        with _well_formed(args.folder):
            [_plain(entry["case"]) for entry in trial.read_manifest(args.folder)["cases"]]
    plan = trial.TrialPlan(args.cases, args.seed, kinds, args.runs, args.rendered, sizes)
    trial.make_trial(args.folder, plan, args.seal, film_series, _say, _processes(args))
    return 0


def _diagnose(series: Path, out: Path, withheld: tuple[str, ...] = ()) -> None:
    """`ovines diagnose` on one series, in this process so that compiled code is compiled once."""
    from ovines.commands.diagnosis import diagnose

    parser = argparse.ArgumentParser()
    diagnose.add_arguments(parser)
    options = [word for effect in withheld for word in ("--withhold", effect)]
    diagnose.run(parser.parse_args([str(series), "--out", str(out), *options]))


def _answer_case(folder: Path, case: str, parent: int = 0) -> tuple[str, str]:
    die_with(parent)
    out = folder / "answers" / case
    start = time.monotonic()
    try:
        _diagnose(folder / "cases" / case, out)
    except Exception as error:  # whatever it is: the other cases have their answers
        out.mkdir(parents=True, exist_ok=True)
        write_text_whole(traceback.format_exc(), out / "failed.txt")
        return case, f"{NO_ANSWER} ({type(error).__name__}: {error}; see failed.txt)".replace("\n", " ")
    (out / "failed.txt").unlink(missing_ok=True)
    write_text_whole(json.dumps(time.monotonic() - start), out / "seconds.json")
    verdict = json.loads((out / "diagnosis.json").read_text())
    return case, ", ".join(verdict["effects"]) or verdict["verdict"]


@contextmanager
def _well_formed(folder: Path) -> Iterator[None]:
    """Turn what a damaged manifest, truth or answer does to its reader into an `InputError`."""
    try:
        yield
    except (ValueError, KeyError, TypeError, AttributeError, IndexError, RecursionError, FileNotFoundError) as error:
        said = f"{type(error).__name__}: {error}".split("\n")[0][:200]
        raise InputError(
            f"{folder}: a manifest, truth or answer that cannot be used ({said})",
            "the files as `ovines blind` wrote them",
            "make the trial again",
        ) from None


def _answer(args: argparse.Namespace) -> int:
    with _well_formed(args.folder):
        cases = [_plain(entry["case"]) for entry in trial.read_manifest(args.folder)["cases"]]
    left = [case for case in cases if not (args.folder / "answers" / case / "seconds.json").exists()]
    _refuse_costly(f"{len(left)} answers", len(left) * ANSWER_S, args)
    answered = Parallel(n_jobs=_processes(args), return_as="generator_unordered")(
        delayed(_answer_case)(args.folder, case, os.getpid()) for case in left
    )
    failed = []
    for done, (case, answer) in enumerate(answered, len(cases) - len(left) + 1):
        _say(f"{done}/{len(cases)} {case}: {answer}")
        failed += [case] if answer.startswith(NO_ANSWER) else []
    if failed:
        _say(f"without an answer, for an error: {', '.join(sorted(failed))}; the others are answered")
    return int(bool(failed))


def _plain(case: Any) -> str:
    """A case's name, which becomes a folder's."""
    if not isinstance(case, str) or not case or case in (".", "..") or "/" in case or "\0" in case:
        raise ValueError(f"case {case!r}")
    return case


def _withhold_case(folder: Path, truth: dict[str, Any], effects: tuple[str, ...], parent: int = 0) -> Withheld:
    die_with(parent)
    out = folder / "withheld" / truth["case"]
    if not (out / "diagnosis.json").exists():
        _diagnose(folder / "cases" / truth["case"], out, effects)
    answer = json.loads((out / "diagnosis.json").read_text())
    laws = [read_law(out / entry["file"]) for entry in answer.get("laws") or []]
    return judge_withheld(truth, answer, laws)


def _withhold(args: argparse.Namespace) -> int:
    with _well_formed(args.folder):
        truths = trial.read_truths(args.folder, args.seed)
        chosen = [(truth, to_withhold(truth)) for truth in truths.values() if to_withhold(truth)][: args.most]
    if not chosen:
        raise InputError(
            f"no case with a single listed cause in {args.folder}", "at least one", "make one with --kinds listed"
        )
    _refuse_costly(f"{len(chosen)} answers", len(chosen) * ANSWER_S, args)
    answered = Parallel(n_jobs=_processes(args), return_as="generator_unordered")(
        delayed(_withhold_case)(args.folder, truth, effects, os.getpid()) for truth, effects in chosen
    )
    rows = []
    for row in answered:
        rows.append(row)
        _say(f"{len(rows)}/{len(chosen)} {row.case} without {row.kind}: {', '.join(row.named) or row.verdict}")
    told = f"Made by `ovines blind withhold {args.folder.name}` on {len(rows)} cases, `ovines {__version__}`."
    text = withheld_markdown(rows, told)
    write_text_whole(text, args.folder / "withheld.md")
    print(text)
    return 0


def _answered_again(series: Path, out: Path) -> dict[str, Any]:
    _diagnose(series, out)
    answer: dict[str, Any] = json.loads((out / "diagnosis.json").read_text())
    return answer


def _settle_case(folder: Path, outline: Outline, way: str, seed: list[int], parent: int = 0) -> Course:
    die_with(parent)
    case = outline.truth["case"]
    series = folder / "loop" / f"{case}-{way}"
    shutil.rmtree(series, ignore_errors=True)
    shutil.copytree(folder / "cases" / case, series)
    answer = json.loads((folder / "answers" / case / "diagnosis.json").read_text())
    return settle(outline, series, answer, way, _answered_again, np.random.default_rng(seed))


def _loop(args: argparse.Namespace) -> int:
    with _well_formed(args.folder):
        truths = trial.read_truths(args.folder, args.seed)
        answers = {case: args.folder / "answers" / case / "diagnosis.json" for case in truths}
        given = {case: json.loads(path.read_text()) for case, path in answers.items() if path.exists()}
        manifest = trial.read_manifest(args.folder)
        plan = trial.plan_of(manifest, args.seed)
    open_cases = [case for case, answer in given.items() if is_open(truths[case], answer)][: args.most]
    if not open_cases:
        raise InputError(
            f"no open case in {args.folder}",
            "answers in which the true cause stands beside others under `equivalent`",
            "make a trial of few runs and small sizes: --kinds listed --runs 3 --sizes 0.3",
        )
    _refuse_costly(f"{len(open_cases)} open cases", 2 * MOST_RUNS * len(open_cases) * ANSWER_S, args)
    asked = [(i, o, way) for i, o in enumerate(trial.outlines(plan)) if o.truth["case"] in open_cases for way in WAYS]
    done = Parallel(n_jobs=_processes(args), return_as="generator_unordered")(
        delayed(_settle_case)(args.folder, outline, way, [args.seed, i, WAYS.index(way)], os.getpid())
        for i, outline, way in asked
    )
    courses: list[Course] = []
    for course in done:
        courses.append(course)
        end = "not settled" if course.settled is None else f"settled after {course.settled}"
        _say(f"{len(courses)}/{len(asked)} {course.case}, {course.way}: {end}")
    courses.sort(key=lambda c: (c.case, WAYS.index(c.way)))
    text = loop_markdown(courses)
    write_text_whole(text, args.folder / "loop.md")
    write_text_whole(json.dumps([asdict(c) for c in courses], indent=1), args.folder / "loop.json")
    print(text)
    return 0


def _marked(args: argparse.Namespace, truths: dict[str, Any]) -> tuple[list[Any], dict[str, Any]]:
    """Each answered case beside its truth, and the answers by case."""
    rows: list[Any] = []
    answers: dict[str, Any] = {}
    for case, truth in truths.items():
        out = args.folder / "answers" / case
        if not (out / "diagnosis.json").exists():
            if args.partial:
                continue
            raise InputError(
                f"{case} has no answer",
                "an answer to every case",
                "run `ovines blind answer` to the end, or score with --partial",
            )
        answers[case] = json.loads((out / "diagnosis.json").read_text())
        clock = out / "seconds.json"
        rows.append(score.mark(truth, answers[case], json.loads(clock.read_text()) if clock.exists() else None))
    return rows, answers


def _oracle_case(folder: Path, outline: Outline, seed: list[int], parent: int = 0) -> float | None:
    die_with(parent)
    predictions = read_table(folder / "answers" / outline.truth["case"] / "predictions.parquet", "predictions")
    return oracle_share(predictions, run_outline(outline, np.random.default_rng(seed)).states, outline.place)


def _law_case(folder: Path, outline: Outline, seed: list[int], parent: int = 0) -> list[LawShare]:
    from ovines.pipeline.series.law_oracle import shares_of_case

    die_with(parent)
    return shares_of_case(folder, outline, seed)


def _answered_outlines(args: argparse.Namespace, answered: set[str]) -> list[tuple[Outline, list[int]]]:
    """Outlines of the answered cases, each with the seed of its runs."""
    plan = trial.plan_of(trial.read_manifest(args.folder), args.seed)
    every = enumerate(trial.outlines(plan), 1)
    return [(outline, [args.seed, i, 1]) for i, outline in every if outline.truth["case"] in answered]


def _oracle(args: argparse.Namespace, answered: set[str]) -> list[float]:
    """What the answers close of what an oracle closes, of the cases whose causes all lie in the flights; the plant runs
    again for it."""
    if args.seed is None:
        return []
    asked = [
        delayed(_oracle_case)(args.folder, outline, seed, os.getpid())
        for outline, seed in _answered_outlines(args, answered)
        if in_flights(outline.truth)
    ]
    return [share for share in Parallel(n_jobs=_processes(args))(asked) if share is not None]


def _laws(args: argparse.Namespace, answered: set[str]) -> list[LawShare]:
    """What written laws close of what the plant's own close, where that is asked for."""
    if not args.laws:
        return []
    if args.seed is None:
        raise InputError("--laws without the seed", "the seed that the trial was made with", "give --seed")
    cases = _answered_outlines(args, answered)
    _refuse_costly(f"laws of {len(cases)} cases", len(cases) * ANSWER_S, args)
    asked = (delayed(_law_case)(args.folder, outline, seed, os.getpid()) for outline, seed in cases)
    return [share for shares in Parallel(n_jobs=_processes(args))(asked) for share in shares]


def _add_laws(laws: list[LawShare], figures: list[Figure]) -> str:
    """The figure of the laws to the others; their table for score.md."""
    from ovines.pipeline.series.law_oracle import law_figure, law_markdown

    figures.append(law_figure(laws))
    return law_markdown(laws)


def _score(args: argparse.Namespace) -> int:
    with _well_formed(args.folder):
        truths = trial.read_truths(args.folder, args.seed)
        rows, answers = _marked(args, truths)
    if not rows:
        raise InputError(f"no answers in {args.folder}", "at least one", "run `ovines blind answer` first")
    rng = np.random.default_rng(0)
    figures = score.figures_of(rows, rng) + probability_figures(rows, rng)
    figures.append(score.oracle_figure(_oracle(args, set(answers)), rng))
    laws = _laws(args, set(answers))
    law_table = _add_laws(laws, figures) if args.laws else ""
    bands = reliability(rows)
    causes = score.per_cause(rows, answers)
    result = {
        "format": 1,
        "figures": [asdict(f) for f in figures],
        "reliability": bands,
        "causes": causes,
        "cases": [asdict(r) for r in rows],
    }
    result |= {"laws": [asdict(one) for one in laws]} if args.laws else {}
    write_text_whole(json.dumps(result, indent=1), args.folder / "score.json")
    told = f"ovines blind score {args.folder.name}` on {len(rows)} of {len(truths)} cases, `ovines {__version__}"
    text = report.markdown(figures, causes, rows, bands, told) + law_table
    write_text_whole(text, args.folder / "score.md")
    report.confusion_picture(rows, args.folder / "confusion.png")
    report.reliability_picture(bands, args.folder / "reliability.png")
    print(text)
    return 0
