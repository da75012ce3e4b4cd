"""`ovines design`: what a NES takes from a sprung Host, the Host's frequency response, and the best NES for it."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from ovines.commands.options import whole_number
from ovines.core import ScenarioError
from ovines.core.absorber.design import Search, design
from ovines.core.absorber.response import frequency_response
from ovines.core.absorber.sprung import DESIGNED
from ovines.core.absorber.taken import energy_taken
from ovines.core.ensemble import Workers
from ovines.errors import InputError
from ovines.io.provenance import provenance
from ovines.pipeline.ownership import refuse_theirs
from ovines.simulations.design_tables import design_lines, design_table, response_table, taken_lines, taken_table
from ovines.simulations.many import client_of
from ovines.simulations.results import find
from ovines.tables import write_table
from ovines.workers.budget import add_yes, refuse_cost, within_budget

NAME = "design"
HELP = "Design a NES for a sprung Host: energy taken, frequency response, the best clearance, mass, friction."
RUN_S = 2e-4  # s per period of the drive and run on one core; friction on the floor takes ten times that
TABLES = ("energy_taken", "response", "design")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Scenario, band of frequencies, ranges of the NES's numbers, ensembles."""
    parser.description = HELP
    parser.add_argument("scenario", help="a scenario.toml with a sprung Host, or a name of `ovines simulate --list`")
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder (default: results/ beside the scenario)")
    parser.add_argument(
        "--band",
        default="0.8:1.2:9",
        metavar="LOW:HIGH:COUNT",
        help="frequencies, in the scenario's own (default: 0.8:1.2:9)",
    )
    parser.add_argument(
        "--over", action="append", default=[], metavar="NAME=LOW:HIGH",
        help="search for the best NES over this range, as often as there are numbers: " + ", ".join(DESIGNED),
    )  # fmt: skip
    parser.add_argument("--candidates", type=whole_number, default=32, help="NES that are tried (default: 32)")
    parser.add_argument("--keep", type=whole_number, default=6, help="of them tried again with all runs (default: 6)")
    parser.add_argument("--runs", type=whole_number, default=24, help="runs at each frequency (default: 24)")
    parser.add_argument("--transient", type=whole_number, default=60, help="periods before measuring (default: 60)")
    parser.add_argument("--periods", type=whole_number, default=40, help="periods measured over (default: 40)")
    parser.add_argument("--seed", type=whole_number, default=0, help="seed of candidates and starts (default: 0)")
    parser.add_argument("--cluster", metavar="ADDRESS", help="run on this Dask scheduler")
    add_yes(parser)


def run(args: argparse.Namespace) -> int:
    """Write tables and figures, say the best; wrong input is an `InputError`."""
    scenario, source, out = find(args.scenario, args.out)
    over = dict(between(text) for text in args.over)
    factors = band(args.band)
    names = TABLES if over else TABLES[:2]
    pictures = {name: (f"{name}.png", f"{name}.svg") for name in names}
    refuse_theirs(out, [f"{name}.parquet" for name in names] + [one for both in pictures.values() for one in both])
    runs = args.runs + (args.runs // 4 * (args.candidates + 1) + args.runs * args.keep if over else 0)
    each = RUN_S * (args.transient + args.periods) * (10.0 if scenario.friction or "floor_friction" in over else 1.0)
    refuse_cost(f"{runs * len(factors)} runs", runs * len(factors) * each, 0.0, args.yes)
    workers = Workers(client=client_of(args.cluster) if args.cluster else None)
    rng = np.random.default_rng(args.seed)

    def ask():  # type: ignore[no-untyped-def]
        taken = energy_taken(scenario)
        response = frequency_response(scenario, factors, args.runs, rng, args.transient, args.periods, workers)
        found = None
        if over:
            search = Search(args.candidates, args.keep, args.runs, args.transient, args.periods)
            found = design(scenario, over, factors, rng, search, workers)
        return taken, response, found

    try:
        taken, response, found = within_budget(ask, f"the design of {scenario.name}", args.yes)
    except ScenarioError as error:
        raise InputError(f"{scenario.name}: {error.found}", error.expected, error.do) from None
    tables = {"energy_taken": taken_table(taken), "response": response_table(response, scenario, found)}
    if found is not None:
        tables["design"] = design_table(found)
    record = provenance(NAME, {k: v for k, v in vars(args).items() if k in ("band", "over", "runs", "seed")}, source)
    from analysis.dynamics.design_figures import design_figure, response_figure, taken_figure
    from analysis.figures.style import save_figure

    figures = {"energy_taken": taken_figure(taken), "response": response_figure(response, scenario, found)}
    if found is not None:
        figures["design"] = design_figure(found)
    for name in names:
        write_table(tables[name], name, out / f"{name}.parquet", record)
        for picture in pictures[name]:
            save_figure(figures[name], out / picture)
    for line in (*taken_lines(taken), *design_lines(response, found), str(out)):
        print(line)
    return 0


def band(text: str) -> np.ndarray:
    """Factors of ``LOW:HIGH:COUNT``."""
    try:
        low, high, count = text.split(":")
        values = np.linspace(float(low), float(high), int(count))
    except ValueError:
        values = np.zeros(0)
    if not len(values) or not np.isfinite(values).all() or values.min() <= 0.0:
        raise InputError(f"--band {text}", "LOW:HIGH:COUNT, above 0, as 0.8:1.2:9", "correct the band")
    return values


def between(text: str) -> tuple[str, tuple[float, float]]:
    """Name and range of ``NAME=LOW:HIGH``."""
    name, equals, numbers = text.partition("=")
    try:
        low, high = (float(one) for one in numbers.split(":"))
    except ValueError:
        low = high = np.nan
    if not equals or not low < high or name not in DESIGNED:
        raise InputError(f"--over {text}", "NAME=LOW:HIGH, the name out of " + ", ".join(DESIGNED), "correct the range")
    return name, (low, high)
