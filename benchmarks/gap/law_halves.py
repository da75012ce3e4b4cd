"""Does a law that is found on half of the runs predict the other half, and does a series without a law stay without?

``python benchmarks/gap/law_halves.py [--kinds a,b] [--runs 8] [--seed 5301] [--size 0.8]``
``python benchmarks/gap/law_halves.py --none 20 [--runs 4] [--seed 7301]``

Causes in nobody's list, drawn by the blind plant.  The form is chosen, its numbers searched and its coefficients fitted
on the first, third, ... run alone; then one size of the whole law, 1 being the one stated, is fitted to the other runs.
It holds where 1 lies within the 90 % interval that the law's own sd and that of the other runs make together.  Stated
too: the share of what the law closes in the other half that the same form closes there with coefficients of its own.
The search is called directly, without the rest of the diagnosis.  With ``--none`` series without effect, white,
correlated and lens noise in turn: each law that is found is a false one.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np

from analysis.blind.causes.named import CAUSES
from analysis.blind.recording.files import write_series
from analysis.blind.series import make_series
from analysis.gap.laws.choice.search import find_law
from analysis.gap.laws.dictionary.candidate import with_coefficients
from analysis.gap.laws.dictionary.flights import flight_candidates
from analysis.gap.laws.dictionary.impacts.law import law_candidates
from analysis.gap.laws.dictionary.impacts.walls import wall_candidates
from analysis.gap.laws.dictionary.parts import RigScales
from analysis.gap.laws.dictionary.products import of_flights, of_impacts
from analysis.gap.laws.flight_rows import flight_regression
from analysis.gap.laws.impact_law import of_rates
from analysis.gap.laws.impact_rows import distance_regression, law_regression
from analysis.gap.laws.pulses import pulse_candidates
from analysis.gap.laws.regression.halves import NORMAL_90, scatter_of_runs, second_half
from analysis.gap.laws.regression.problem import Profile, part_of
from analysis.gap.selection.flight_steps import first_flights
from analysis.gap.selection.impacts.fit import fit_impacts
from analysis.gap.thresholds import DISTANCE_NEGLIGIBLE
from ovines.core.laws.formula import as_text
from ovines.core.laws.terms import WrittenLaw
from ovines.pipeline.series.diagnosis import load_series
from ovines.recording import read_series

EFFECTS = ("floor_friction", "spin_coupling")
NOT_ASKED = ("unknown_warming_floor", "unknown_slam", "unknown_rough_wall")  # no frame or impact shows what they follow
NOISES = ("white", "ar1", "warp")


def flights_of(kind, size, rng, runs, noise):
    """Made series' flights with nominal effects, and the series."""
    made = make_series(kind, size, rng, runs, noise)
    with tempfile.TemporaryDirectory() as folder:
        write_series(made, Path(folder) / "series")
        series, _ = load_series(read_series(Path(folder) / "series"), Path(folder) / "results")
    return first_flights(series, EFFECTS), series


def problems(stage, fitted, series):
    """(rows, candidates, what they may be multiplied by) of the stages that are asked."""
    if stage in ("flight", "none"):
        rows = flight_regression(fitted)
        scales = RigScales.of(rows.known, float(series.runs[0].data.host.omega_rad_per_s))
        more = pulse_candidates(rows, scales.run_s, np.random.default_rng(2))
        yield "flight", rows, ([*flight_candidates(scales), *more], of_flights(scales))
    if stage in ("impact", "none"):
        impacts = fit_impacts(fitted.fits)
        rows = law_regression(impacts, fitted.fits, ())
        candidates = [*law_candidates(rows.known), *of_rates(rows, impacts, fitted.fits, np.random.default_rng(3))]
        yield "impact", rows, (candidates, of_impacts(rows.known))
    if stage in ("geometry", "none"):
        impacts = fit_impacts(fitted.fits)
        rows = distance_regression(impacts, fitted.fits)
        candidates = [*wall_candidates(rows.known), *of_rates(rows, impacts, fitted.fits, np.random.default_rng(3))]
        yield "geometry", rows, (candidates, of_impacts(rows.known))


def one_half(rows, candidates, multipliers):
    """The law of the first half, its sd, and size and sd that the other half asks for, and the share closed there."""
    problem = rows.problem
    other = second_half(problem)
    first, rest = part_of(problem, ~other), part_of(problem, other)
    rng = np.random.default_rng(0)
    found, _ = find_law(first, lambda terms: rows.columns(terms)[~other], candidates, rng, multipliers=multipliers)
    if found is None:
        return None
    columns = rows.columns(found.terms)
    moved = columns @ found.coefficients
    sizes = []
    for part, own in ((first, ~other), (rest, other)):
        _, size, covariance = Profile.of(part).gain(moved[own][:, None])
        scatter = max(part.excess, scatter_of_runs(part, moved[own]) ** 2)
        sizes.append((float(size[0]), float(np.sqrt(covariance[0, 0] * scatter))))
    profile = Profile.of(rest)
    # What the law's own covariance, numbers inside left free, makes of its size in the other half.
    left = np.vstack([columns[other], np.zeros((len(profile.residual) - int(other.sum()), columns.shape[1]))])
    left = left - profile.basis @ (profile.basis.T @ left)
    weight = left.T @ (left @ found.coefficients)
    weight = weight / float(found.coefficients @ weight)
    scatter = max(1.0, scatter_of_runs(first, moved[~other]))
    sizes[0] = 1.0, max(sizes[0][1], scatter * float(np.sqrt(weight @ found.covariance @ weight)))
    own_best = profile.gain(columns[other])[0]
    at_one = 2 * float(profile.residual[: int(other.sum())] @ moved[other]) - _square(profile, moved[other])
    law = as_text(WrittenLaw(with_coefficients(found.terms, found.coefficients, found.covariance)))
    return law, sizes, at_one / own_best if own_best > 0 else 0.0


def _square(profile, moved):
    """Square of what a law does to the rows, without what the nuisances take of it."""
    more = np.concatenate([moved, np.zeros(len(profile.residual) - len(moved))])
    left = more - profile.basis @ (profile.basis.T @ more)
    return float(left @ left)


def tell_halves(options):
    print("| cause | size that the other half asks for | interval | holds | closed there | law |", flush=True)
    wanted = options.kinds.split(",") if options.kinds else [
        c.name for c in CAUSES.values() if not c.listed and c.stage != "measurement" and c.name not in NOT_ASKED
    ]  # fmt: skip
    held = []
    for number, kind in enumerate(wanted):
        fitted, series = flights_of(
            kind, options.size, np.random.default_rng([options.seed, number]), options.runs, "white"
        )
        for _, rows, asked in problems(CAUSES[kind].stage, fitted, series):
            answer = one_half(rows, *asked)
            if answer is None:
                print(f"| {kind} | - | - | - | - | none |", flush=True)
                continue
            law, ((_, own_sd), (size, sd)), share = answer
            reach = NORMAL_90 * float(np.hypot(own_sd, sd))
            held.append(abs(size - 1) <= reach)
            print(f"| {kind} | {size:.3f} | +- {reach:.3f} | {held[-1]} | {share:.3f} | {law} |", flush=True)
    print(f"holds in {sum(held)} of {len(held)}")


def tell_none(options):
    false, least = 0, DISTANCE_NEGLIGIBLE
    for number in range(options.none):
        noise = NOISES[number % len(NOISES)]
        fitted, series = flights_of("none", 1.0, np.random.default_rng([options.seed, number]), options.runs, noise)
        said = []
        for stage, rows, (candidates, multipliers) in problems("none", fitted, series):
            rng = np.random.default_rng(0)
            found, p = find_law(rows.problem, rows.columns, candidates, rng, multipliers=multipliers)
            name = "none" if found is None else " and ".join(one.name for one in found.parts)
            if found is not None and stage == "geometry":  # as the diagnosis asks of a wall
                moved = rows.columns(found.terms) @ found.coefficients / rows.answers["contact_radius"]
                small = float(np.sqrt(np.mean(moved**2))) <= least * series.contact_radius_m
                name += " (negligible)" if small else ""
                found = None if small else found
            said.append((stage, name, p, found is not None))
        false += any(one[-1] for one in said)
        print(f"{number} {noise}: " + "; ".join(f"{s} {n} p {p:.2g}" for s, n, p, _ in said), flush=True)
    print(f"a law in {false} of {options.none} series without effect")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--kinds", default="")
    parser.add_argument("--runs", type=int, default=8)
    parser.add_argument("--seed", type=int, default=5301)
    parser.add_argument("--size", type=float, default=0.8)
    parser.add_argument("--none", type=int, default=0)
    options = parser.parse_args()
    if options.none:
        tell_none(options)
    else:
        tell_halves(options)


if __name__ == "__main__":
    main()
