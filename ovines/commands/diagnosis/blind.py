"""`ovines blind`: sealed cases made by an independent plant, answered by the diagnosis, then scored."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

from analysis.blind import trial
from analysis.blind.scoring.withheld import withheld_markdown
from ovines import __version__
from ovines.blind_film import film_series
from ovines.commands.options import jobs, whole_number
from ovines.errors import InputError
from ovines.io.atomic_write import write_text_whole
from ovines.pipeline.blind.answers import answer_cases, answer_withheld, case_names, cases_to_withhold, unanswered
from ovines.pipeline.blind.closed_loop import MOST_RUNS, write_courses
from ovines.pipeline.blind.open_cases import open_cases, settle_cases
from ovines.pipeline.blind.processes import well_formed
from ovines.pipeline.blind.scored_trial import mark_trial, write_score
from ovines.workers.budget import add_yes, refuse_cost

NAME = "blind"
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
        with well_formed(args.folder):
            case_names(args.folder)
    plan = trial.TrialPlan(args.cases, args.seed, kinds, args.runs, args.rendered, sizes)
    trial.make_trial(args.folder, plan, args.seal, film_series, _say, _processes(args))
    return 0


def _answer(args: argparse.Namespace) -> int:
    asked = unanswered(args.folder)
    _refuse_costly(f"{len(asked.left)} answers", len(asked.left) * ANSWER_S, args)
    failed = answer_cases(args.folder, asked, _processes(args), _say)
    if failed:
        _say(f"without an answer, for an error: {', '.join(failed)}; the others are answered")
    return int(bool(failed))


def _withhold(args: argparse.Namespace) -> int:
    truths = cases_to_withhold(args.folder, args.seed, args.most)
    _refuse_costly(f"{len(truths)} answers", len(truths) * ANSWER_S, args)
    rows = answer_withheld(args.folder, truths, _processes(args), _say)
    made = f"Made by `ovines blind withhold {args.folder.name}` on {len(rows)} cases, `ovines {__version__}`."
    text = withheld_markdown(rows, made)
    write_text_whole(text, args.folder / "withheld.md")
    print(text)
    return 0


def _loop(args: argparse.Namespace) -> int:
    cases = open_cases(args.folder, args.seed, args.most)
    _refuse_costly(f"{len(cases)} open cases", 2 * MOST_RUNS * len(cases) * ANSWER_S, args)
    print(write_courses(settle_cases(args.folder, cases, args.seed, _processes(args), _say), args.folder))
    return 0


def _score(args: argparse.Namespace) -> int:
    if args.laws and args.seed is None:
        raise InputError("--laws without the seed", "the seed that the trial was made with", "give --seed")
    marked = mark_trial(args.folder, args.seed, args.partial)
    if args.laws:
        _refuse_costly(f"laws of {len(marked.rows)} cases", len(marked.rows) * ANSWER_S, args)
    print(write_score(marked, _processes(args), args.laws))
    return 0
