"""Recordings on the workers of an existing Dask cluster (optional extra ``cluster``).

Every worker must see the recordings and the results folder under the same paths, and have this version of ovines.
A worker that dies costs nothing: its recording is given to another, which continues from the finished stages.
"""

from __future__ import annotations

import socket
from concurrent.futures import CancelledError
from pathlib import Path
from typing import Any

from tqdm import tqdm

from ovines.errors import InputError
from ovines.io.run_log import bars_disabled
from ovines.pipeline.one_recording import Outcome, run_one

PATIENCE_S = 10
SCHEMES = ("tcp", "tls", "ws", "wss", "ucx")  # a scheduler elsewhere; inproc:// is this process alone
RETRIES = 2  # a recording whose worker fell out is tried again before it is given up


def run_on_cluster(
    tasks: list[tuple[Path, Path]], only: str | None, force: bool, figures: bool, address: str, bars: bool
) -> list[Outcome]:
    """Run each (recording, results folder) of ``tasks`` on the scheduler at ``address``; outcomes in their order."""
    client = connect(address)
    outcomes: list[Outcome] = []
    try:
        _run_all(client, tasks, only, force, figures, address, bars, outcomes)
    except LOST as error:
        if not outcomes:
            raise _nobody(address, error) from None
    done = {one.folder for one in outcomes}
    return outcomes + [
        Outcome(one, out, "refused", message=str(_gone(address))) for one, out in tasks if one not in done
    ]


LOST = (
    CancelledError,
    OSError,
    RuntimeError,
)  # what comes back where a scheduler goes away: distributed has many names for it


def _run_all(
    client: Any,
    tasks: list[tuple[Path, Path]],
    only: str | None,
    force: bool,
    figures: bool,
    address: str,
    bars: bool,
    outcomes: list[Outcome],
) -> None:
    """Fill ``outcomes``, in the order of ``tasks``; `LOST` leaves where the scheduler goes away."""
    from distributed.scheduler import KilledWorker

    with client:
        if not client.scheduler_info()["workers"]:
            raise InputError(f"--cluster {address}: no worker", "a scheduler with workers", "start `dask worker`")
        futures = [
            client.submit(
                run_one,
                one.resolve(),
                out.resolve(),
                only,
                force,
                False,
                figures,
                True,
                pure=False,
                retries=RETRIES,
            )
            for one, out in tasks
        ]
        for (one, out), future in tqdm(
            list(zip(tasks, futures, strict=True)), desc="recordings", unit="", disable=bars_disabled(bars)
        ):
            try:
                outcomes.append(future.result())
            except KilledWorker:
                message = f"the workers that worked on {one} were killed one after another (memory?)"
                outcomes.append(Outcome(one, out, "failed", message=message))


def connect(address: str) -> Any:
    """A client of the Dask scheduler at ``address``; `InputError` where there is none, or no Dask here."""
    try:
        import distributed
        from distributed.comm.addressing import parse_address
        from distributed.comm.registry import get_backend
    except ImportError:
        raise InputError(
            "--cluster without dask.distributed",
            "the optional extra 'cluster'",
            "in the checkout: pip install -e '.[cluster]'",
        ) from None
    try:
        scheme, place = parse_address(address)
        get_backend(scheme)  # before a client stands half made: it would complain when it goes
        if scheme not in SCHEMES:
            raise ValueError(f"a scheduler by {scheme}://")
        _refuse_silent(scheme, place)
        return distributed.Client(address, timeout=PATIENCE_S, set_as_default=False)
    except Exception as error:
        raise _nobody(address, error) from None


def _refuse_silent(scheme: str, place: str) -> None:
    """Open the connection once by hand: a client that never connects complains again when it goes."""
    from distributed.comm.addressing import get_address_host_port

    host, port = get_address_host_port(f"{scheme}://{place}", strict=True)
    with socket.create_connection((host, port), timeout=PATIENCE_S):
        pass


def _nobody(address: str, error: Exception) -> InputError:
    said = (str(error) or type(error).__name__).split("\n")[0][:200]
    return InputError(
        f"--cluster {address}: {said}",
        "the address of a running Dask scheduler (tcp://host:8786)",
        "start it, or leave --cluster away",
    )


def _gone(address: str) -> InputError:
    return InputError(
        f"--cluster {address}: the scheduler went away while this recording was worked on",
        "a scheduler that runs to the end",
        "start it and run again: finished stages are kept",
    )
