"""What is left in flights, closed on runs held out: the law search against baselines and an oracle, on the same rows.

``python benchmarks/gap/law_baselines.py [--kinds a,b] [--runs 8] [--seed 5201] [--size 0.8] [--impacts] [--frames]
[--law-only]``

Causes in nobody's list, drawn by the blind plant.  Every method is given the same regression (residuals of the nominal
fit, each flight's start and the nominal parameters projected out) and is judged by what it takes of the squared error
of runs that it was not fitted to, as a share of what the oracle takes: the plant's own force where the disk really
was, its size fitted like any other.  The baselines: `benchmarks/gap/baselines.py`; those of a whole trial, impacts and
wall among them: `benchmarks/gap/trial_baselines.py`.

With ``--impacts`` causes of the impacts and of the wall's shape instead: the law found, and how far it closes what is
above the noise on runs held out (1: all of it).  With ``--frames`` causes of cameras and clocks, four series each
(severity 0.35 and 0.8 in turn; white, correlated, lens noise, white).  With ``--law-only`` none of the baselines.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np

from analysis.blind.causes.groups import GROUPS
from analysis.blind.causes.named import CAUSES
from analysis.blind.recording.files import write_series
from analysis.blind.series import make_series, outline_series, run_outline
from analysis.gap.laws.choice.search import LEVEL
from analysis.gap.laws.dictionary.candidate import with_coefficients
from analysis.gap.laws.flight_search import FlightSearch
from analysis.gap.laws.frames.law import find_frame_laws
from analysis.gap.laws.impact_law import find_impact_law, find_wall_law
from analysis.gap.selection.flight_steps import first_flights
from analysis.gap.selection.impacts.fit import fit_impacts
from analysis.gap.thresholds import DISTANCE_NEGLIGIBLE
from benchmarks.gap.baselines import columns_of_terms, flight_features, squares_of
from ovines.core.laws.formula import as_text
from ovines.core.laws.terms import WrittenLaw
from ovines.pipeline.blind.law_oracle import PlantsRuns, flight_columns, held_out
from ovines.pipeline.series.diagnosis import load_series
from ovines.recording import read_series

EFFECTS = ("floor_friction", "spin_coupling")
NOT_ASKED = ("unknown_warming_floor",)  # follows the way slid, which no frame shows


def _named(groups, stages):
    """Causes of these groups and stages, joined by commas."""
    return ",".join(name for group in groups for name in GROUPS[group] if CAUSES[name].stage in stages)


def one_case(kind, options, rng):
    """Mean squares of a row held out: as it is, and of each method; and the law found."""
    outline = outline_series(kind, options.size, rng, options.runs, "white")
    made = run_outline(outline, rng, remembered=True)
    with tempfile.TemporaryDirectory() as folder:
        write_series(made, Path(folder) / "series")
        series, _ = load_series(read_series(Path(folder) / "series"), Path(folder) / "results")
    search = FlightSearch.of(series.runs, first_flights(series, EFFECTS), np.random.default_rng(2))
    assert search is not None, "too few flights"
    rows, problem = search.rows, search.rows.problem
    found, _ = search.find(np.random.default_rng(0), LEVEL)
    oracle = flight_columns(rows, series.frame, PlantsRuns.of(outline, made.motions, kind))
    squares = {
        "oracle": held_out(problem, oracle),
        "law": held_out(problem, columns_of_terms(rows, () if found is None else found.terms)),
    }
    if not options.law_only:
        squares |= squares_of(rows, search.listed, flight_features(rows, np.random.default_rng(1)))
    before = held_out(problem, oracle[:, :0])
    taken = {name: before - one for name, one in squares.items()}
    words = "none"
    if found is not None:
        words = as_text(WrittenLaw(with_coefficients(found.terms, found.coefficients, found.covariance)))
    return before, taken, words


def impact_case(kind, options, rng):
    """The law of impacts or of the wall that is found, and how far it closes the gap; None where none is."""
    made = make_series(kind, options.size, rng, options.runs, "white")
    with tempfile.TemporaryDirectory() as folder:
        write_series(made, Path(folder) / "series")
        series, _ = load_series(read_series(Path(folder) / "series"), Path(folder) / "results")
    fits = first_flights(series, EFFECTS).fits
    impacts, draws = fit_impacts(fits), np.random.default_rng(0)
    least_m = DISTANCE_NEGLIGIBLE * series.contact_radius_m
    law = find_impact_law(impacts, fits, (), series.frame, draws)
    shape = find_wall_law(impacts, fits, series.frame, least_m, draws)
    return [(as_text(one.law), one.shrinkage(draws)) for one in (law, shape) if one is not None]


def tell_impacts(options):
    print("| cause | law | closes | interval |", flush=True)
    kinds = options.kinds or _named(("later",), ("impact", "geometry"))
    for number, kind in enumerate(kinds.split(",")):
        found = impact_case(kind, options, np.random.default_rng([options.seed, 100 + number]))
        for words, (value, low, high) in found or [("none", (0.0, 0.0, 0.0))]:
            print(f"| {kind} | {words} | {value:.2f} | {low:.2f} to {high:.2f} |", flush=True)


def tell_frames(options):
    print("| cause | severity | noise | laws | closes | halves agree |", flush=True)
    kinds = options.kinds or _named(("unlisted", "later", "latest"), ("measurement",))
    for kind in kinds.split(","):
        for number, noise in enumerate(("white", "ar1", "warp", "white")):
            size = (0.35, 0.8)[number % 2]
            made = make_series(kind, size, np.random.default_rng([options.seed, number]), options.runs, noise)
            with tempfile.TemporaryDirectory() as folder:
                write_series(made, Path(folder) / "series")
                series, _ = load_series(read_series(Path(folder) / "series"), Path(folder) / "results")
                laws, _ = find_frame_laws(series, np.random.default_rng(0))
            said = "; ".join(as_text(one.law) for one in laws) or "none"
            closes = ", ".join(f"{one.closed:.2f}" for one in laws)
            agree = ", ".join("-" if one.halves is None else str(one.halves.agree) for one in laws)
            print(f"| {kind} | {size} | {noise} | {said} | {closes} | {agree} |", flush=True)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--kinds", default="")
    parser.add_argument("--impacts", action="store_true")
    parser.add_argument("--frames", action="store_true")
    parser.add_argument("--law-only", action="store_true")
    parser.add_argument("--runs", type=int, default=8)
    parser.add_argument("--seed", type=int, default=5201)
    parser.add_argument("--size", type=float, default=0.8)
    options = parser.parse_args()
    if options.frames:
        tell_frames(options)
        return
    if options.impacts:
        tell_impacts(options)
        return
    kinds = options.kinds or _named(("later",), ("flight",))
    names = ("law",) if options.law_only else ("law", "library", "sparse", "Gaussian process")
    shares = {name: [] for name in names}
    print("| cause | squares over noise | oracle takes | " + " | ".join(names) + " | law |", flush=True)
    for number, kind in enumerate(one for one in kinds.split(",") if one not in NOT_ASKED):
        before, taken, words = one_case(kind, options, np.random.default_rng([options.seed, number]))
        share_of = {name: taken[name] / taken["oracle"] for name in names}
        for name in names:
            shares[name].append(share_of[name])
        cells = " | ".join(f"{share_of[name]:.2f}" for name in names)
        print(f"| {kind} | {before:.2f} | {taken['oracle']:.3g} | {cells} | {words} |", flush=True)
    middle = " | ".join(f"{np.median(shares[name]):.2f}" for name in names)
    least = " | ".join(f"{np.mean(np.array(shares[name]) >= 0.8):.2f}" for name in names)
    print(f"| median | | | {middle} | |\n| at least 0.8 | | | {least} | |")


if __name__ == "__main__":
    main()
