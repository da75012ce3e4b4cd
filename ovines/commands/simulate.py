"""`ovines simulate`: run a scenario file or a named scenario; write its motion, impacts and contacts."""

from __future__ import annotations

import argparse
import os
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ovines.commands.stage_command import whole_number
from ovines.core import Scenario, ScenarioError, simulate
from ovines.core.packing import pack
from ovines.core.system import parameters as P
from ovines.core.system.named import NAMED
from ovines.errors import InputError
from ovines.io.provenance import provenance
from ovines.io.run_log import bars_disabled
from ovines.pipeline.cluster import connect
from ovines.pipeline.ownership import refuse_theirs, refuse_to_replace
from ovines.pipeline.simulation import WRITES, find, summary, write_result
from ovines.workers.budget import add_yes, refuse_cost, within_budget

NAME = "simulate"
HELP = "Run the simulator on a scenario.toml or a named scenario."


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Scenario or name, output folder, the list of names, the validation figures."""
    parser.description = HELP
    parser.add_argument("scenario", nargs="?", help="a scenario.toml, or a name of --list")
    parser.add_argument("--out", type=Path, help="folder for the tables (default: results/ beside the scenario)")
    parser.add_argument("--list", action="store_true", help="show the named scenarios (tests of Part I) and stop")
    parser.add_argument(
        "--figures", type=Path, metavar="DIR", help="make every figure of docs/validation/simulator.md there"
    )
    parser.add_argument("--seed", type=whole_number, default=0, help="seed for effects that scatter (default: 0)")
    parser.add_argument(
        "--runs", type=whole_number, default=0, metavar="N", help="also run N scattered copies (ensemble)"
    )
    parser.add_argument("--spread", type=_share, default=1e-4, help="sd of their start, share of the contact radius")
    parser.add_argument("--cluster", metavar="ADDRESS", help="run the copies on this Dask scheduler")
    add_yes(parser)


def run(args: argparse.Namespace) -> int:
    """Do what was asked; wrong input is an `InputError`."""
    if args.list:
        for entry in NAMED.values():
            print(f"{entry.name:<18} {entry.meaning}")
        return 0
    if args.figures is not None:
        if args.scenario is not None or args.out is not None:
            raise InputError(
                f"--figures {args.figures} beside a scenario or --out",
                "either a simulation (SCENARIO --out DIR), or the figures of the validation alone (--figures DIR)",
                "call the command twice",
            )
        for path in sorted(args.figures.glob("*.png")):
            refuse_to_replace(path, "--figures")
        from analysis.figures.part_one import make_figures  # matplotlib: only when figures are wanted

        for path in make_figures(args.figures):
            print(path)
        return 0
    if args.scenario is None:
        raise InputError("no scenario", "a scenario.toml or a name", "see ovines simulate --list")
    scenario, source, out = find(args.scenario, args.out)
    refuse_theirs(out, [f"{name}.parquet" for name in WRITES])
    refuse_costly(scenario, args.runs, args.yes)
    client = client_of(args.cluster) if args.cluster and args.runs else None
    compile_engine()
    began = time.monotonic()
    result = within_budget(
        lambda: simulate(scenario, np.random.default_rng(args.seed)), f"the simulation of {scenario.name}", args.yes
    )
    copies = ""
    if args.runs > 0:
        each_s = time.monotonic() - began
        cores = os.cpu_count() or 1
        refuse_cost(
            f"{args.runs} runs of {scenario.name}",
            0.0 if client else args.runs * each_s / cores,
            args.runs * RUN_BYTES,
            args.yes,
        )
        copies = within_budget(
            lambda: run_copies(scenario, args, client), f"{args.runs} runs of {scenario.name}", args.yes
        )
    record = provenance(NAME, {"scenario": scenario.name, "seed": args.seed}, source)
    write_result(result, out, record)
    print("\n".join(filter(None, (summary(result, out), copies))))
    return 0


# Measured on one core of a 2.5 GHz processor, rounded up: a step of the integrator, a row of samples with its height,
# and what a row of the tables and a run of an ensemble take while they are made.
STEP_S, ROW_S = 3e-6, 6e-6
ROW_BYTES, RUN_BYTES = 700.0, 600.0


def refuse_costly(scenario: Scenario, runs: int, yes: bool) -> None:
    """`InputError` for a scenario whose own numbers ask for more than the budget: rows of samples, steps of its fastest
    drive.
    """
    packed = pack(scenario)
    rows = scenario.duration_s * scenario.sample_rate_hz
    steps = scenario.duration_s / float(packed.p[P.MAX_STEP]) if float(packed.p[P.MAX_STEP]) > 0 else 0.0
    refuse_cost(
        f"{rows:.3g} rows ({scenario.duration_s:g} s at {scenario.sample_rate_hz:g} Hz)",
        rows * ROW_S,
        rows * ROW_BYTES,
        yes,
    )
    refuse_cost(f"{steps:.3g} steps (a quarter period of the fastest drive or spring each)", steps * STEP_S, 0.0, yes)
    refuse_cost(f"{runs} runs", runs * max(steps, 1.0) * STEP_S, runs * RUN_BYTES, yes)


def compile_engine() -> None:
    """A moment of a known scenario, so that what is timed afterwards is simulation and no compiling."""
    for name in ("table-3", "rig"):
        simulate(replace(NAMED[name].make(), duration_s=1e-3))


def client_of(address: str) -> Any:
    """A client of the Dask scheduler at ``address``."""
    try:
        import distributed  # noqa: F401
    except ImportError:
        raise InputError(
            "--cluster without dask.distributed",
            "the optional extra 'cluster'",
            "in the checkout: pip install -e '.[cluster]'",
        ) from None
    return connect(address)


def run_copies(scenario: Scenario, args: argparse.Namespace, client: Any) -> str:
    """An ensemble of copies whose start scatters, in one line."""
    from tqdm import tqdm

    from ovines.core import simulate_ensemble
    from ovines.core.packing import contact_radius

    length = contact_radius(scenario)
    spread = {"nes_x_m": args.spread * length, "nes_y_m": args.spread * length}
    try:
        with tqdm(total=args.runs, disable=bars_disabled(), unit="run") as bar:
            ensemble = simulate_ensemble(
                scenario, args.runs, spread, np.random.default_rng(args.seed), client=client, progress=bar.update
            )
    except ScenarioError as error:
        raise InputError(f"--spread {args.spread:g}: {error.found}", error.expected, error.do) from None
    low, middle, high = np.percentile(ensemble.n_impacts, [5, 50, 95])
    return (
        f"{args.runs} copies: {middle:.0f} impacts ({low:.0f}..{high:.0f}, 5-95 %), "
        f"{float(np.mean(ensemble.contact_s)):.3g} s in sustained contact"
    )


def _share(text: str) -> float:
    value = float(text)
    if not 0.0 <= value <= 1.0:
        raise argparse.ArgumentTypeError("a number from 0 to 1")
    return value
