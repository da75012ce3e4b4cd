"""Laws of a blind trial against baselines and the plant's own law, on the rows in which laws are searched.

``python benchmarks/gap/trial_baselines.py TRIAL --seed SEED [--cases 1,4] [--answers-only]``

Of each case with an unlisted cause in the flights, at the impacts or of the wall's shape the rows of that stage, beside
the listed effects that the ladder names: flights over their noise; restitution, impulse along the wall and spin of the
impacts; contact radii.  Each method's sizes are fitted to the other runs, run by run.  Its figure is the share of what
the oracle closes of the squared error of runs held out: the plant's own law, asked where the disk really was, with all
that disk, floor and wall remember (`ovines.pipeline.blind.law_oracle`).  Below 0 a prediction is worse than none.

- answered: the laws that stand in TRIAL/answers.  Blind, if the trial was when it was answered.
- today: what the search finds with today's code.  In view.
- library, sparse, Gaussian process: `benchmarks/gap/baselines.py`.

A cause that goes by chance has an oracle that knows what chance drew; no formula can.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np

from analysis.blind import trial
from analysis.blind.causes.named import CAUSES
from analysis.gap.ladder import run_ladder
from analysis.gap.laws.choice.listed import Listed
from analysis.gap.laws.dictionary.impacts.law import law_candidates
from analysis.gap.laws.dictionary.impacts.walls import wall_candidates
from analysis.gap.laws.flight_search import FlightSearch
from analysis.gap.laws.impact_law import of_rates
from analysis.gap.written_laws import write_laws
from benchmarks.gap.baselines import blow_features, flight_features, squares_of
from ovines.core.laws.formula import as_text
from ovines.law_file import read_law
from ovines.pipeline.blind.law_oracle import PlantsRuns, law_share, remembered_runs, rows_of, unlisted_asked
from ovines.pipeline.series.diagnosis import load_series
from ovines.recording import read_series

METHODS = ("answered", "today", "library", "library, chosen without the run", "sparse", "Gaussian process")
HEAD = "| case | cause (severity) | stage | before | oracle | size | " + " | ".join(METHODS) + " |"


def ladder_and_laws(series_folder, search=True):
    """The ladder of a case as `ovines diagnose` has it before laws are searched, and the laws in the world."""
    with tempfile.TemporaryDirectory() as folder:
        series, _ = load_series(read_series(series_folder), Path(folder))
    rng = np.random.default_rng(0)
    ladder = run_ladder(series, rng)
    rng.spawn(1)
    return ladder, [one.law for one in write_laws(ladder, rng)[0]] if search else []


def searched(ladder, stage):
    """The rows of a stage, its dictionary with columns, and what a Gaussian process may know of them."""
    rng = np.random.default_rng(1)
    if stage == "flight":
        search = FlightSearch.of(ladder.series.runs, ladder.flights.named, np.random.default_rng(0))
        assert search is not None, "too few flights"
        return search.rows, search.listed, flight_features(search.rows, rng)
    rows, fits = rows_of(ladder, stage), ladder.flights.fitted.fits
    candidates = (law_candidates if stage == "impact" else wall_candidates)(rows.known)
    candidates = [*candidates, *of_rates(rows, ladder.impacts.fitted, fits, np.random.default_rng(0))]
    return rows, Listed.of(candidates, rows.columns, rows.problem), blow_features(rows, rng)


def case_shares(folder, outline, seed, answers_only=False):
    """Of each unlisted cause of a case: its share, with what is answered, and those of all methods."""
    case = outline.truth["case"]
    motions = remembered_runs(outline, seed)
    ladder, today = ladder_and_laws(folder / "cases" / case, not answers_only)
    written = [read_law(path) for path in sorted((folder / "answers" / case).glob("law-*.toml"))]
    for cause in unlisted_asked(outline):
        plants = PlantsRuns.of(outline, motions, cause)
        share = law_share(case, cause, ladder, written, plants)
        shares = {"answered": share.law}
        if not answers_only:
            shares["today"] = law_share(case, cause, ladder, today, plants).law
            squares = squares_of(*searched(ladder, CAUSES[cause].stage))
            shares |= {name: (share.before - one) / (share.before - share.oracle) for name, one in squares.items()}
        yield share, shares, [as_text(law) for law in today if law.stage == share.stage]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("trial", type=Path)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--cases", default="", help="numbers, separated by commas (default: all)")
    parser.add_argument("--answers-only", action="store_true", help="neither today's search nor baselines")
    options = parser.parse_args()
    plan = trial.plan_of(trial.read_manifest(options.trial), options.seed)
    trial.read_truths(options.trial, options.seed)  # refuses another seed
    asked = {int(number) for number in options.cases.split(",") if number}
    every = {name: [] for name in METHODS}
    print(HEAD, flush=True)
    print("|" + "---|" * (HEAD.count("|") - 1))
    for i, outline in enumerate(trial.outlines(plan)):
        if (asked and i + 1 not in asked) or not unlisted_asked(outline):
            continue
        for share, shares, laws in case_shares(options.trial, outline, [options.seed, i + 1, 1], options.answers_only):
            for name, value in shares.items():
                every[name].append(value)
            cause = f"{share.cause.removeprefix('unknown_')} ({outline.truth['sizes'][share.cause]:.2f})"
            cells = " | ".join(f"{shares[name]:.2f}" if name in shares else "" for name in METHODS)
            numbers = f"{share.before:.3g} | {share.oracle:.3g} | {share.size:.2f}"
            print(f"| {i + 1} | {cause} | {share.stage} | {numbers} | {cells} |  {'; '.join(laws)}", flush=True)
    methods = [name for name in METHODS if every[name]]
    print("median: " + "; ".join(f"{name} {np.median(every[name]):.2f}" for name in methods))
    print("0.8 or more: " + "; ".join(
        f"{name} {np.sum(np.array(every[name]) >= 0.8)} of {len(every[name])}" for name in methods
    ))  # fmt: skip


if __name__ == "__main__":
    main()
