"""The viewer's program, started so that it listens to this machine alone."""

from __future__ import annotations

import shutil
import socket
import subprocess
import time
from tempfile import TemporaryFile

LOOPBACK = "127.0.0.1"  # the viewer's own habit is every interface: anybody on the network could send it data
PATIENCE_S, LOOK_S = 20.0, 0.05


def start_viewer(name: str = "rerun") -> str:
    """Start the viewer and wait until it listens; its address.  `RuntimeError` where it is not found, ends or stays
    silent.
    """
    program = shutil.which(name)
    if program is None:
        raise RuntimeError(f"no program {name} in PATH")
    with socket.socket() as free:
        free.bind((LOOPBACK, 0))
        port = int(free.getsockname()[1])
    with TemporaryFile() as said:
        viewer = subprocess.Popen(
            [program, "--bind", LOOPBACK, "--port", str(port), "--expect-data-soon"],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=said,
            start_new_session=True,  # it stays open when the command has ended
        )
        end = time.monotonic() + PATIENCE_S
        while time.monotonic() < end:
            if viewer.poll() is not None:
                said.seek(0)
                lines = said.read().decode("utf-8", "replace").strip().splitlines()
                raise RuntimeError(lines[-1][:200] if lines else f"{name} ended with status {viewer.returncode}")
            try:
                with socket.create_connection((LOOPBACK, port), timeout=LOOK_S):
                    return f"rerun+http://{LOOPBACK}:{port}/proxy"
            except OSError:
                time.sleep(LOOK_S)
        viewer.terminate()
    raise RuntimeError(f"{name} does not listen after {PATIENCE_S:g} s")
