"""Recordings on the workers of an existing Dask cluster (optional extra ``cluster``).

Every worker must see the recordings and the results folder under the same paths, and have this version of ovines.
A worker that dies costs nothing: its recording is given to another, which continues from the finished stages.
"""

from __future__ import annotations

from pathlib import Path

from tqdm import tqdm

from ovines.errors import InputError
from ovines.one_recording import Outcome, run_one

PATIENCE_S = 10
RETRIES = 2  # a recording whose worker fell out is tried again before it is given up


def run_on_cluster(
    tasks: list[tuple[Path, Path]], only: str | None, force: bool, figures: bool, address: str, bars: bool
) -> list[Outcome]:
    """Run each (recording, results folder) of ``tasks`` on the scheduler at ``address``; outcomes in their order."""
    try:
        from distributed import Client
        from distributed.comm.addressing import parse_address
        from distributed.comm.registry import get_backend
        from distributed.scheduler import KilledWorker
    except ImportError:
        raise InputError(
            "--cluster without dask.distributed", "the optional extra 'cluster'", "in the checkout: pip install -e '.[cluster]'"
        ) from None
    try:
        get_backend(parse_address(address)[0])  # before a client stands half made: it would complain when it goes
        client = Client(address, timeout=PATIENCE_S, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        raise InputError(
            f"--cluster {address}: {error or type(error).__name__}",
            "the address of a running Dask scheduler (tcp://host:8786)",
            "start it, or leave --cluster away",
        ) from None
    outcomes = []
    with client:
        if not client.scheduler_info()["workers"]:
            raise InputError(f"--cluster {address}: no worker", "a scheduler with workers", "start `dask worker`")
        futures = [
            client.submit(
                run_one, one.resolve(), out.resolve(), only, force, False, figures, pure=False, retries=RETRIES
            )
            for one, out in tasks
        ]
        for (one, out), future in tqdm(
            list(zip(tasks, futures, strict=True)), desc="recordings", unit="", disable=None if bars else True
        ):
            try:
                outcomes.append(future.result())
            except KilledWorker:
                message = f"the workers that worked on {one} were killed one after another (memory?)"
                outcomes.append(Outcome(one, out, "failed", message=message))
    return outcomes
