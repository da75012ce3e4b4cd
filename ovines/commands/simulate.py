"""`ovines simulate`: run a scenario file or a named scenario; write its motion, impacts and contacts."""

from __future__ import annotations

import argparse
import hashlib
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ovines.core import Scenario, SimulationResult, simulate
from ovines.core.named import NAMED
from ovines.errors import InputError
from ovines.provenance import provenance, sha256_of
from ovines.scenario import checked_scenario, read_scenario
from ovines.tables import write_table

NAME = "simulate"
HELP = "Run the simulator on a scenario.toml or a named scenario."
IMPACT_TEXT = ("stick", "slide")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Scenario or name, output folder, the list of names, the validation figures."""
    parser.description = HELP
    parser.add_argument("scenario", nargs="?", help="a scenario.toml, or a name of --list")
    parser.add_argument("--out", type=Path, help="folder for the tables (default: results/ beside the scenario)")
    parser.add_argument("--list", action="store_true", help="show the named scenarios (tests of Part I) and stop")
    parser.add_argument("--figures", type=Path, metavar="DIR", help="make every figure of docs/validation.md there")
    parser.add_argument("--seed", type=int, default=0, help="seed for effects that scatter (default: 0)")
    parser.add_argument("--runs", type=int, default=0, metavar="N", help="also run N scattered copies (ensemble)")
    parser.add_argument("--spread", type=float, default=1e-4, help="sd of their start, share of the contact radius")
    parser.add_argument("--cluster", metavar="ADDRESS", help="run the copies on this Dask scheduler")


def run(args: argparse.Namespace) -> int:
    """Do what was asked; wrong input is an `InputError`."""
    if args.list:
        for entry in NAMED.values():
            print(f"{entry.name:<18} {entry.meaning}")
        return 0
    if args.figures is not None:
        from analysis.validation_figures import make_figures  # matplotlib: only when figures are wanted

        for path in make_figures(args.figures):
            print(path)
        return 0
    if args.scenario is None:
        raise InputError("no scenario", "a scenario.toml or a name", "see ovines simulate --list")
    scenario, source, out = find(args.scenario, args.out)
    result = simulate(scenario, np.random.default_rng(args.seed))
    record = provenance(NAME, {"scenario": scenario.name, "seed": args.seed}, source)
    write_result(result, out, record)
    print(summary(result, out))
    if args.runs > 0:
        print(run_copies(scenario, args, out, record))
    return 0


def find(name: str, out: Path | None) -> tuple[Scenario, dict[str, str], Path]:
    """The scenario of a file or a name, the hash of its source, and the output folder."""
    if name in NAMED and not Path(name).is_file():
        scenario = checked_scenario(NAMED[name].make, name)
        digest = hashlib.sha256(repr(scenario).encode()).hexdigest()
        return scenario, {name: digest}, out or Path("results") / name
    path = Path(name)
    if path.suffix != ".toml" and not path.is_file():
        raise InputError(f"{name!r} is neither a file nor a known name", "a scenario.toml or a name of --list",
                         "see ovines simulate --list")  # fmt: skip
    scenario = read_scenario(path)
    return scenario, {path.name: sha256_of(path)}, out or path.parent / "results"


def write_result(result: SimulationResult, out: Path, record: dict[str, Any]) -> None:
    """``simulation.parquet``, ``simulated_impacts.parquet``, ``contact.parquet`` into ``out``."""
    write_table(motion_table(result), "simulation", out / "simulation.parquet", record)
    write_table(impact_table(result), "simulated_impacts", out / "simulated_impacts.parquet", record)
    contacts = pd.DataFrame(result.contacts, columns=["start_s", "end_s"])
    write_table(contacts, "contact", out / "contact.parquet", record)


def motion_table(result: SimulationResult) -> pd.DataFrame:
    """Samples in the columns of ``motion.parquet``; rows after a stopped run's end have times only."""
    frame = pd.DataFrame({"frame": np.arange(len(result.time_s)), "time_s": result.time_s})
    return pd.concat([frame, pd.DataFrame(result.motion)], axis=1)


def impact_table(result: SimulationResult) -> pd.DataFrame:
    """Exact impacts in the columns of ``impacts.parquet``: what an impact does not inform is missing."""
    impacts = result.impacts
    n = len(impacts)
    stuck = impacts["stuck"] > 0.5
    slip = impacts["tangential_speed_before_m_per_s"]
    turned = np.full(n, np.nan)
    ok = stuck & (np.abs(slip) > 0.0)
    turned[ok] = -impacts["tangential_speed_after_m_per_s"][ok] / slip[ok]
    same = [
        "time_s", "azimuth_rad", "normal_speed_before_m_per_s", "normal_speed_after_m_per_s",
        "tangential_speed_before_m_per_s", "tangential_speed_after_m_per_s", "spin_before_rad_per_s",
        "spin_after_rad_per_s",
    ]  # fmt: skip
    frame = pd.DataFrame({name: np.asarray(impacts[name], dtype=float) for name in same})
    # speeds are positive towards the wall inside the engine; the table has the size of the rebound
    frame["normal_speed_after_m_per_s"] = -frame["normal_speed_after_m_per_s"]
    frame.insert(0, "impact", np.arange(n))
    frame["time_sd_s"] = 0.0
    frame["restitution"] = frame["normal_speed_after_m_per_s"] / frame["normal_speed_before_m_per_s"]
    frame["restitution_sd"] = 0.0
    frame["tangential_restitution"] = turned
    frame["wall_friction"] = np.where(stuck, np.nan, result.scenario.impact.wall_friction)
    frame["regime"] = [IMPACT_TEXT[0] if value else IMPACT_TEXT[1] for value in stuck]
    return frame


def summary(result: SimulationResult, out: Path) -> str:
    """What a run gave, in one paragraph."""
    seconds = float(np.sum(result.contacts[:, 1] - result.contacts[:, 0]))
    return (
        f"{result.scenario.name}: {result.end_s:.6g} s, {len(result.impacts)} impacts, {len(result.contacts)} sustained "
        f"contacts ({seconds:.4g} s), energy adds up to {abs(result.energy.relative_residual):.1e}\n{out}"
    )


def run_copies(scenario: Scenario, args: argparse.Namespace, out: Path, record: dict[str, Any]) -> str:
    """An ensemble of copies whose start scatters; its table beside the run's, and a line about it."""
    from tqdm import tqdm

    from ovines.core import simulate_ensemble
    from ovines.core.packing import contact_radius

    length = contact_radius(scenario)
    spread = {"nes_x_m": args.spread * length, "nes_y_m": args.spread * length}
    client = None
    if args.cluster:
        try:
            from distributed import Client
        except ImportError:
            raise InputError("--cluster without dask.distributed", "the optional extra 'cluster'",
                             "in the checkout: pip install -e '.[cluster]'") from None  # fmt: skip
        try:
            client = Client(args.cluster, timeout=10)
        except (OSError, ValueError) as error:
            raise InputError(f"--cluster {args.cluster}: {error}", "a running Dask scheduler", "check it") from None
    with tqdm(total=args.runs, disable=None, unit="run") as bar:
        ensemble = simulate_ensemble(
            scenario, args.runs, spread, np.random.default_rng(args.seed), client=client, progress=bar.update
        )
    low, middle, high = np.percentile(ensemble.n_impacts, [5, 50, 95])
    return (
        f"{args.runs} copies: {middle:.0f} impacts ({low:.0f}..{high:.0f}, 5-95 %), "
        f"{float(np.mean(ensemble.contact_s)):.3g} s in sustained contact"
    )
