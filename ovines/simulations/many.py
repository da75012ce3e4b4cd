"""Many runs of one scenario: what they cost, where they run, scattered copies and sweeps."""

from __future__ import annotations

import math
import os
from argparse import ArgumentTypeError
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from ovines.core import EnsembleResult, Scenario, ScenarioError, Workers, simulate, simulate_ensemble
from ovines.core.ensemble import CHUNK
from ovines.core.packing import contact_radius, pack
from ovines.core.sweep import SWEPT, sweep
from ovines.core.system import parameters as P
from ovines.core.system.named import NAMED
from ovines.errors import InputError
from ovines.io.run_log import bars_disabled
from ovines.pipeline.series.cluster import connect
from ovines.workers.budget import refuse_cost

# Measured on one core of a 2.5 GHz processor, rounded up: a step of the integrator, a row of samples with its height,
# and what a row of the tables and a run of an ensemble take while they are made.
STEP_S, ROW_S = 3e-6, 6e-6
ENSEMBLE_SHARE = 2 / 3  # of a plain run's time: an ensemble's tolerance is wider (`simulate_ensemble`)
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


def copies_cost_s(runs: int, plain_s: float) -> float:
    """Time of ``runs`` copies of a scenario whose plain run took ``plain_s``, on this machine's cores."""
    at_once = min(os.cpu_count() or 1, math.ceil(runs / CHUNK))
    return ENSEMBLE_SHARE * plain_s * runs / at_once


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


def share(text: str) -> float:
    """A number from 0 to 1, of the command line."""
    value = float(text)
    if not 0.0 <= value <= 1.0:
        raise ArgumentTypeError("a number from 0 to 1")
    return value


def start_spread(scenario: Scenario, share: float) -> dict[str, float]:
    """Standard deviations (m) of a start that scatters by ``share`` of the contact radius."""
    length = contact_radius(scenario)
    return {"nes_x_m": share * length, "nes_y_m": share * length}


def run_copies(scenario: Scenario, runs: int, share: float, seed: int, client: Any = None) -> EnsembleResult:
    """``runs`` copies whose start scatters by ``share`` of the contact radius, energies with them."""
    from tqdm import tqdm

    rng = np.random.default_rng(seed)
    try:
        with tqdm(total=runs, disable=bars_disabled(), unit="run") as bar:
            return simulate_ensemble(
                scenario,
                runs,
                start_spread(scenario, share),
                rng,
                with_energies=True,
                workers=Workers(client=client, progress=bar.update),
            )
    except ScenarioError as error:
        raise InputError(f"--spread {share:g}: {error.found}", error.expected, error.do) from None


def run_sweep(
    scenario: Scenario,
    over: Mapping[str, Sequence[float]],
    runs: int,
    share: float,
    seed: int,
    client: Any = None,
) -> pd.DataFrame:
    """``sweep.parquet``: ``runs`` scattered copies at every combination of the one or two parameters ``over``."""
    from tqdm import tqdm

    points = int(np.prod([len(values) for values in over.values()]))
    spread = {name: sd for name, sd in start_spread(scenario, share).items() if name not in over}
    try:
        with tqdm(total=runs * points, disable=bars_disabled(), unit="run") as bar:
            workers = Workers(client=client, progress=bar.update)
            rows = sweep(scenario, over, runs, spread, np.random.default_rng(seed), workers)
    except ScenarioError as error:
        raise InputError(f"{' and '.join(over)} in {scenario.name}: {error.found}", error.expected, error.do) from None
    first, other = (*over, None)[:2]
    table = pd.DataFrame(rows)
    placed = {
        "parameter": first,
        "value": table[first],
        "other_parameter": pd.Series([other] * len(table), dtype=object),
        "other_value": table[other] if other is not None else np.nan,
        "runs": runs,
    }
    return pd.DataFrame(placed).join(table.drop(columns=list(over)))


def parse_range(text: str, known: Sequence[str] = SWEPT) -> tuple[str, list[float]]:
    """Name, one of ``known``, and values of ``NAME=LOW:HIGH:COUNT`` (evenly spaced, ends included)."""
    name, equals, numbers = text.partition("=")
    try:
        low, high, count = numbers.split(":")
        values = np.linspace(float(low), float(high), int(count))
    except ValueError:
        values = np.zeros(0)
    if not equals or not len(values) or not np.isfinite(values).all():
        raise InputError(
            f"--over {text}", "NAME=LOW:HIGH:COUNT with finite numbers, as restitution=0.5:0.9:9", "correct the range"
        )
    if name not in known:
        raise InputError(f"--over {text}", "a name out of " + ", ".join(known), "correct the name")
    if len(np.unique(values)) != len(values):
        raise InputError(f"--over {text}", "values that differ", "widen the range, or ask for one value")
    return name, [float(value) for value in values]
