"""What is left in flights, closed on runs held out: the law search against baselines and an oracle, on the same rows.

``python benchmarks/gap/law_baselines.py [--kinds a,b] [--runs 8] [--seed 5201] [--size 0.8] [--impacts] [--frames]
[--law-only]``

Causes in nobody's list, drawn by the blind plant.  Every method is given the same regression (residuals of the nominal
fit, each flight's start and the nominal parameters projected out) and is judged by what it takes of the squared error
of runs that it was not fitted to, as a share of what the oracle takes: the plant's own force along the measured path,
its size fitted like any other.

- library: candidates added by squared error of all runs, at the price of a Bayesian information criterion; no run is
  held out and no number inside is searched.
- sparse: all candidates together, small ones thrown out again and again (sequentially thresholded ridge regression, as
  SINDy does; Brunton, Proctor and Kutz 2016).
- Gaussian process: acceleration and torque as smooth functions of place, velocity and spin (random Fourier features;
  Rahimi and Recht 2007), length and size by the likelihood.  It predicts, and names nothing.

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
from analysis.blind.plant.flight.accelerations import derivative
from analysis.blind.plant.flight.disk_friction import disk_friction_table
from analysis.blind.plant.parameters import PlantParameters
from analysis.blind.plant.state import IMPACT_S, STATES
from analysis.blind.recording.files import write_series
from analysis.blind.series import make_series
from analysis.gap.laws.choice.listed import columns_of
from analysis.gap.laws.choice.search import find_law
from analysis.gap.laws.dictionary.candidate import with_coefficients
from analysis.gap.laws.dictionary.flights import flight_candidates
from analysis.gap.laws.dictionary.parts import RigScales
from analysis.gap.laws.flight_rows import _columns, flight_regression
from analysis.gap.laws.frames.law import find_frame_laws
from analysis.gap.laws.impact_law import find_impact_law, find_wall_law
from analysis.gap.laws.pulses import pulse_candidates
from analysis.gap.laws.regression.problem import Profile, Regression, held_out_squares
from analysis.gap.selection.flight_steps import first_flights
from analysis.gap.selection.impacts.fit import fit_impacts
from analysis.gap.thresholds import DISTANCE_NEGLIGIBLE
from ovines.core.laws import words as W
from ovines.core.laws.formula import as_text
from ovines.core.laws.terms import WrittenLaw
from ovines.pipeline.series.diagnosis import load_series
from ovines.recording import read_series

EFFECTS = ("floor_friction", "spin_coupling")
NOT_ASKED = ("unknown_warming_floor",)  # follows the way slid, which no frame shows
MOST_PARTS = 10
SMALL, RIDGE, ROUNDS = (0.05, 0.1, 0.2, 0.4, 0.7), 0.05, 20
FEATURES, LENGTHS, SIZES = 120, (0.5, 1.0, 2.0), (0.1, 0.4, 1.6)


def oracle_columns(regression, made, series):
    """Rows (M, 1) of the plant's own force along the flights' measured path."""
    plant = {k: v for k, v in made.truth["plant"].items() if k in PlantParameters._fields}
    whole = PlantParameters(**plant)
    cause = made.truth["parameters"][made.truth["effect"]]
    off = {k: 0.0 for k in plant if k in cause and _switches(k)}
    without, table = whole._replace(**off), disk_friction_table()
    turn = series.frame.turn_rad
    c, s = np.cos(turn), np.sin(turn)
    back = np.array([[c, -s], [s, c]])
    rows, run = [], _runs_of(regression)
    for flight, number in zip(regression.flights, run, strict=True):
        host = made.states[f"H{number + 1:02d}"]
        given = np.zeros((len(flight.times), 3, 1))
        for i, known in enumerate(flight.know):
            place = back @ known[[W.X, W.Y]] + series.frame.origin_m
            speed = back @ known[[W.VX, W.VY]]
            since = known[W.TIME] - known[W.SINCE] if known[W.SINCE] < 0.5 * W.LONG_AGO_S else -1.0
            state = np.zeros(STATES)
            state[:IMPACT_S] = *place, *speed, known[W.ANGLE] + turn, known[W.SPIN]
            state[IMPACT_S] = since
            more = derivative(known[W.TIME], state, whole, host, table) - derivative(
                known[W.TIME], state, without, host, table
            )
            given[i, :2, 0], given[i, 2, 0] = back.T @ more[2:4], more[5]
        rows.append(_columns(flight, given))
    return np.vstack(rows)


def _named(groups, stages):
    """Causes of these groups and stages, joined by commas."""
    return ",".join(name for group in groups for name in GROUPS[group] if CAUSES[name].stage in stages)


def _switches(name):
    """Sizes switch a cause off at 0; angles, places and scales do not."""
    return not name.endswith(("_rad", "_m", "_width_m"))


def _runs_of(regression):
    """The run's number of each flight."""
    problem = regression.problem
    return [int(problem.run[np.flatnonzero(problem.block == k)[0]]) for k in range(len(regression.flights))]


def library(problem, table, groups):
    """Columns chosen by the squared error of all runs, each group at the price of a Bayesian information criterion."""
    chosen: list[int] = []
    price = np.log(len(problem.residual)) * problem.excess
    for _ in range(MOST_PARTS):
        profile = Profile.of(problem.with_columns(table[:, chosen]))
        gains = [profile.gain(table[:, g])[0] - price * len(g) if not set(g) & set(chosen) else -1.0 for g in groups]
        best = int(np.argmax(gains))
        if gains[best] <= 0:
            break
        chosen += groups[best]
    return table[:, chosen]


def sparse(problem, table):
    """Columns (of ``table``, of unit length) that sequentially thresholded ridge regression keeps, at the threshold
    whose choice a Bayesian information criterion likes best."""
    profile = Profile.of(problem)
    count = len(problem.residual)
    left = table - profile.basis[:count] @ (profile.basis[:count].T @ table)
    price, best = np.log(count) * problem.excess, (0.0, np.zeros(0, np.int64))
    for small in SMALL:
        keep = np.arange(table.shape[1])
        for _ in range(ROUNDS):
            information = left[:, keep].T @ left[:, keep] + RIDGE * np.eye(len(keep))
            size = np.abs(np.linalg.solve(information, left[:, keep].T @ profile.residual[:count]))
            large = size >= small * size.max()
            if large.all():
                break
            keep = keep[large]
        gain = profile.gain(table[:, keep])[0] - price * len(keep)
        if gain > best[0]:
            best = gain, keep
    return table[:, best[1]]


def process(regression, rng):
    """The regression with random features of a Gaussian process among what is fitted, at the size and length of scale
    that are most likely."""
    known = regression.known
    inputs = [W.HX, W.HY, W.VX, W.VY, W.SPIN]
    middle, scale = known[:, inputs].mean(0), known[:, inputs].std(0)
    usual = np.array([0.5, 0.5, 50.0])
    waves, phases = rng.standard_normal((len(inputs), FEATURES)), rng.uniform(0, 2 * np.pi, FEATURES)
    problem, best = regression.problem, None
    for length in LENGTHS:
        rows = []
        for flight in regression.flights:
            z = (flight.know[:, inputs] - middle) / scale / length
            feature = np.sqrt(2 / FEATURES) * np.cos(z @ waves + phases)
            given = np.zeros((len(z), 3, 3 * FEATURES))
            for way in range(3):
                given[:, way, way * FEATURES : (way + 1) * FEATURES] = usual[way] * feature
            rows.append(_columns(flight, given))
        columns = np.vstack(rows)
        for size in SIZES:
            prior = np.concatenate([problem.prior, np.full(columns.shape[1], 1 / size**2)])
            every = np.column_stack([problem.nuisances, columns])
            told = Regression(problem.residual, every, prior, problem.block, problem.run)
            # Log evidence of a linear model with Gaussian priors, up to a constant.
            information = every.T @ every + np.diag(np.maximum(prior, 1e-12))
            score = every.T @ problem.residual
            fitted = np.linalg.solve(information, score)
            evidence = float(score @ fitted) - np.linalg.slogdet(information)[1] - 2 * columns.shape[1] * np.log(size)
            if best is None or evidence > best[0]:
                best = evidence, told
    return best[1]


def one_case(kind, options, rng):
    """Squared errors held out: as it is, and of each method; and the law found."""
    made = make_series(kind, options.size, rng, options.runs, "white")
    with tempfile.TemporaryDirectory() as folder:
        write_series(made, Path(folder) / "series")
        series, _ = load_series(read_series(Path(folder) / "series"), Path(folder) / "results")
    regression = flight_regression(first_flights(series, EFFECTS))
    problem = regression.problem
    scales = RigScales.of(regression.known, float(series.runs[0].data.host.omega_rad_per_s))
    candidates = [*flight_candidates(scales), *pulse_candidates(regression, scales.run_s, np.random.default_rng(2))]
    table, groups = columns_of(candidates, regression.columns, problem.block)
    nothing = table[:, :0]
    found, _ = find_law(problem, regression.columns, candidates, np.random.default_rng(0))
    law = nothing if found is None else regression.columns(found.terms)
    squares = {
        "oracle": held_out_squares(problem, oracle_columns(regression, made, series)),
        "law": held_out_squares(problem, law),
    }
    if not options.law_only:
        squares |= {
            "library": held_out_squares(problem, library(problem, table, groups)),
            "sparse": held_out_squares(problem, sparse(problem, table)),
            "Gaussian process": held_out_squares(process(regression, np.random.default_rng(1)), nothing),
        }
    before = float(held_out_squares(problem, nothing).sum())
    taken = {name: before - float(one.sum()) for name, one in squares.items()}
    words = "none"
    if found is not None:
        words = as_text(WrittenLaw(with_coefficients(found.terms, found.coefficients, found.covariance)))
    return before / len(problem.residual), taken, words


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
        told = {name: taken[name] / taken["oracle"] for name in names}
        for name in names:
            shares[name].append(told[name])
        cells = " | ".join(f"{told[name]:.2f}" for name in names)
        print(f"| {kind} | {before:.2f} | {taken['oracle']:.0f} | {cells} | {words} |", flush=True)
    middle = " | ".join(f"{np.median(shares[name]):.2f}" for name in names)
    least = " | ".join(f"{np.mean(np.array(shares[name]) >= 0.8):.2f}" for name in names)
    print(f"| median | | | {middle} | |\n| at least 0.8 | | | {least} | |")


if __name__ == "__main__":
    main()
