"""`ovines simulate`: run a scenario file or a named scenario; write its motion, impacts, contacts and energies, draw
it, and run scattered copies of it."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from ovines.commands.options import whole_number
from ovines.core import EnsembleResult, simulate
from ovines.core.system.named import NAMED
from ovines.errors import InputError
from ovines.io.provenance import provenance
from ovines.pipeline.ownership import FIGURES, refuse_theirs, refuse_to_replace
from ovines.simulations.many import (
    RUN_BYTES,
    client_of,
    compile_engine,
    copies_cost_s,
    refuse_costly,
    run_copies,
    share,
)
from ovines.simulations.results import (
    ENSEMBLE,
    WRITES,
    ensemble_summary,
    ensemble_table,
    find,
    summary,
    write_result,
)
from ovines.tables import write_table
from ovines.workers.budget import Budget, add_yes, refuse_cost

NAME = "simulate"
HELP = "Run the simulator on a scenario.toml or a named scenario."


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Scenario or name, output folder, the list of names, the validation figures."""
    parser.description = HELP
    parser.add_argument("scenario", nargs="?", help="a scenario.toml, or a name of --list")
    parser.add_argument("--out", type=Path, help="folder for the tables (default: results/ beside the scenario)")
    parser.add_argument("--list", action="store_true", help="show the named scenarios (tests of Part I) and stop")
    parser.add_argument(
        "--figures",
        type=Path,
        nargs="?",
        const=Path(),
        metavar="DIR",
        help="draw the run as PNG and SVG (default: figures/ beside its tables); without a scenario: draw the figures "
        "of docs/validation/simulator.md in DIR",
    )
    parser.add_argument("--seed", type=whole_number, default=0, help="seed for effects that scatter (default: 0)")
    parser.add_argument(
        "--runs", type=whole_number, default=0, metavar="N", help="also run N scattered copies: ensemble.parquet"
    )
    parser.add_argument("--spread", type=share, default=1e-4, help="sd of their start, share of the contact radius")
    parser.add_argument("--cluster", metavar="ADDRESS", help="run the copies on this Dask scheduler")
    add_yes(parser)


def run(args: argparse.Namespace) -> int:
    """Do what was asked; wrong input is an `InputError`."""
    if args.list:
        for entry in NAMED.values():
            print(f"{entry.name:<18} {entry.meaning}")
        return 0
    if args.scenario is None and args.figures is not None:
        return draw_validation(args.figures, args.out)
    if args.scenario is None:
        raise InputError("no scenario", "a scenario.toml or a name", "see ovines simulate --list")
    scenario, source, out = find(args.scenario, args.out)
    refuse_theirs(out, [f"{name}.parquet" for name in (*WRITES, *((ENSEMBLE,) if args.runs else ()))])
    pictures = None if args.figures is None else (out / FIGURES if args.figures == Path() else args.figures)
    if pictures is not None:
        from analysis.simulations.run_figures import make_run_figures, names  # matplotlib: only when it is wanted

        refuse_theirs(pictures, names())
    refuse_costly(scenario, args.runs, args.yes)
    client = client_of(args.cluster) if args.cluster and args.runs else None
    compile_engine()
    budget = Budget(args.yes)
    result = budget.within(
        lambda: simulate(scenario, np.random.default_rng(args.seed), with_energies=True),
        f"the simulation of {scenario.name}",
    )
    copies: EnsembleResult | None = None
    if args.runs > 0:
        what = f"{scenario.name} and {args.runs} copies"
        copies_s = 0.0 if client else copies_cost_s(args.runs, budget.spent_s)
        refuse_cost(what, budget.spent_s + copies_s, args.runs * RUN_BYTES, args.yes)
        copies = budget.within(lambda: run_copies(scenario, args.runs, args.spread, args.seed, client), what)
    record = provenance(NAME, {"scenario": scenario.name, "seed": args.seed}, source)
    write_result(result, out, record)
    print(summary(result, out))
    if copies is not None:
        settings = {"scenario": scenario.name, "seed": args.seed, "runs": args.runs, "spread": args.spread}
        write_table(ensemble_table(copies), ENSEMBLE, out / f"{ENSEMBLE}.parquet", provenance(NAME, settings, source))
        print(ensemble_summary(copies))
    if pictures is not None:
        print(f"{len(make_run_figures(result, pictures))} figures in {pictures}")
    return 0


def draw_validation(folder: Path, out: Path | None) -> int:
    """The figures of docs/validation/simulator.md into ``folder``."""
    if out is not None or folder == Path() or folder.name in NAMED or folder.suffix == ".toml":
        raise InputError(
            f"--figures {folder} without a scenario",
            "SCENARIO --figures [DIR] for the figures of a run, or --figures DIR for those of the validation",
            "put the scenario first, or name a folder",
        )
    for path in sorted(folder.glob("*.png")):
        refuse_to_replace(path, "--figures")
    from analysis.figures.part_one import make_figures

    for path in make_figures(folder):
        print(path)
    return 0
