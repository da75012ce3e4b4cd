"""`ovines sweep`: one or two parameters of a scenario over ranges, an ensemble at each point; a table and a figure."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from ovines.commands.options import whole_number
from ovines.core.sweep import SWEPT
from ovines.errors import InputError
from ovines.io.provenance import provenance
from ovines.pipeline.ownership import refuse_theirs
from ovines.simulations.many import client_of, compile_engine, parse_range, refuse_costly, run_sweep, share
from ovines.simulations.results import find
from ovines.tables import write_table
from ovines.workers.budget import add_yes, within_budget

NAME = "sweep"
HELP = "Run a scenario over ranges of one or two of its parameters, an ensemble at each point."
TABLE, PICTURES = "sweep.parquet", ("sweep.png", "sweep.svg")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Scenario or name, ranges, runs at each point, output folder."""
    parser.description = HELP
    parser.add_argument("scenario", help="a scenario.toml, or a name of `ovines simulate --list`")
    parser.add_argument(
        "--over",
        action="append",
        required=True,
        metavar="NAME=LOW:HIGH:COUNT",
        help="what varies and over which values, once or twice; names: " + ", ".join(SWEPT),
    )
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder (default: results/ beside the scenario)")
    parser.add_argument("--runs", type=whole_number, default=50, metavar="N", help="runs at each point (default: 50)")
    parser.add_argument("--spread", type=share, default=1e-3, help="sd of their start, share of the contact radius")
    parser.add_argument("--seed", type=whole_number, default=0, help="seed of the scattered starts (default: 0)")
    parser.add_argument("--cluster", metavar="ADDRESS", help="run on this Dask scheduler")
    add_yes(parser)


def run(args: argparse.Namespace) -> int:
    """Write ``sweep.parquet`` and its figure, say where the outcome is largest; wrong input is an `InputError`."""
    over = dict(parse_range(text) for text in args.over)
    if not len(args.over) == len(over) <= 2:
        raise InputError(f"--over {' --over '.join(args.over)}", "one or two parameters, each once", "leave out some")
    if args.runs < 1:
        raise InputError(f"--runs {args.runs}", "at least one run at each point", "raise --runs")
    scenario, source, out = find(args.scenario, args.out)
    refuse_theirs(out, [TABLE, *PICTURES])
    runs = args.runs * int(np.prod([len(values) for values in over.values()]))
    refuse_costly(scenario, runs, args.yes)
    client = client_of(args.cluster) if args.cluster else None
    compile_engine()
    table = within_budget(
        lambda: run_sweep(scenario, over, args.runs, args.spread, args.seed, client), f"{runs} runs", args.yes
    )
    settings = {"scenario": scenario.name, "over": args.over, "runs": args.runs, "spread": args.spread}
    write_table(table, NAME, out / TABLE, provenance(NAME, settings | {"seed": args.seed}, source))
    from analysis.figures.style import save_figure
    from analysis.simulations.sweep_figure import sweep_figure

    figure = sweep_figure(table)
    for name in PICTURES:
        save_figure(figure, out / name)
    least, most = (table.loc[getattr(table["impacts_per_s_mean"], which)()] for which in ("idxmin", "idxmax"))
    for word, row in (("fewest", least), ("most", most)):
        at = ", ".join(f"{name} {row[place]:.4g}" for name, place in zip(over, ("value", "other_value"), strict=False))
        print(f"{word} impacts: {row['impacts_per_s_mean']:.4g} per second at {at}")
    print(out)
    return 0
