"""The first run on a machine compiles the inner loops: in two processes, and telling the user.

The kernels that a run calls are listed here in its order, each with arguments of the types it is called with.  A second
process compiles the list from its end while the run compiles what it comes to, so that they meet in the middle; a lock
for each kernel keeps them apart (:mod:`ovines.core.kernel`).  Imports stand inside the functions: a run loads only
what its stages need.
"""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
from filelock import FileLock, Timeout
from numba import typeof, types

from ovines.core.kernel import Guard, Kernel
from ovines.workers.orphans import die_with

Called = tuple[Any, tuple[Any, ...]]  # the kernel: what is decorated is typed as a function


def calls(stages: Sequence[str]) -> list[Called]:
    """What these stages call, with arguments of the right types, in the order of a run."""
    stage_calls = {"calibrate": _calibration_calls, "track": _tracking_calls, "identify": _identification_calls}
    return [call for stage, listed in stage_calls.items() if stage in stages for call in listed()]


def _calibration_calls() -> list[Called]:
    from vision.pinhole import fill

    line, places, blocks = np.zeros(2), np.zeros((2, 2)), np.zeros((2, 2, 2))
    return [
        *_marker_calls(),
        (fill, (places, line, places, blocks, blocks)),
    ]


def _marker_calls() -> list[Called]:
    from vision.markers.fit import fit_discs
    from vision.markers.sector_fit import fit_by_sectors

    image, line, places = np.zeros((2, 2), np.uint8), np.zeros(2), np.zeros((2, 2))
    return [(fit_discs, (image, places, 1, 1.0)), (fit_by_sectors, (image, line, True))]


def _tracking_calls() -> list[Called]:
    from ovines.camera import Camera
    from vision.frames.dropped import _rare_changes
    from vision.identity.layouts import Layout
    from vision.tracking.bodies.gates import status
    from vision.tracking.camera_tracker import CameraTracker
    from vision.tracking.measure import INDEPENDENT_FRAMES, Progress, follow
    from vision.tracking.state import update
    from vision.walls.edges import slopes

    image, places, known = np.zeros((2, 2), np.uint8), np.zeros((2, 2)), np.zeros(2, np.int64)
    camera = Camera("", (2, 2), np.eye(3), np.zeros(5), np.eye(3), np.ones(3))
    layout = Layout(("",), ("",), np.zeros((1, 3)), np.array([0, 1]), np.zeros(1), np.ones(1, bool), 1.0)
    state = CameraTracker(camera, (0, 0), layout).state
    progress = Progress(places, np.zeros((2, 2), np.int64), np.zeros((2, 1, 3)), places, known)
    return [
        # Holds the fits of `_marker_calls`, which the run itself has just lowered: the second process would begin anew.
        (follow, (1, (image,) * INDEPENDENT_FRAMES, known, state, known, progress)),
        *_marker_calls(),
        (status, (state, 1, 1)),
        (update, (1, state, known, 1, places, 1)),
        (slopes, (image, places, places, 1.0)),
        (_rare_changes, (places, 1)),
    ]


def _identification_calls() -> list[Called]:
    from analysis.bounces.contact import BounceRig
    from analysis.bounces.model import BounceFrames, bounce_residual
    from analysis.contact.tangential.search import Impulses, likeliest
    from analysis.flights.cutting.flight_rig import FlightRig
    from analysis.flights.cutting.kinks import find_kinks
    from analysis.flights.evidence import _without_states
    from analysis.flights.single_flight import WhiteFrames, fit_single, fly_with_derivatives, start_state, whiten
    from analysis.identification.contact_law.deviance import _tangential, best_scatter, scatter_deviance
    from analysis.motion.host_table import HostTable
    from analysis.walls.surfaces import surfaces_seen

    line, places, blocks, known = np.zeros(2), np.zeros((2, 2)), np.zeros((2, 2, 2)), np.zeros(2, np.int64)
    fixed, column = np.zeros(2), places[:, 0]
    fixed.flags.writeable = False
    rig = _filled(FlightRig, host=_filled(HostTable, pieces=blocks), law=places, way=places)
    bounce_rig = _filled(BounceRig, flight=rig, parameters=line, surfaces=places)
    bounce_frames = BounceFrames(0.0, line, places, places, line)
    return [
        (surfaces_seen, (places, known, places, fixed, 1.0, places)),
        (find_kinks, (line, line, line, line, 1, 1, 1.0, 1)),
        (start_state, (fixed, column, column, line, 1, 1, 1.0, line)),
        (fit_single, (line, 1.0, WhiteFrames(line, places, places, places), line, line, rig, places)),
        (fly_with_derivatives, (line, 1.0, line, line, known, rig, places, blocks)),
        (whiten, (blocks, places, places, places)),
        (_without_states, (blocks, places, places, line, line)),
        (likeliest, (places, line, 1, Impulses(*(line,) * 7, 1.0, places), line)),
        (_tangential, (column, line, line, line, line, line, 1.0, 1.0)),
        (bounce_residual, (line, line, bounce_frames, bounce_rig, blocks, places, places)),
        (best_scatter, (line, line, column, 1.0)),
        (scatter_deviance, (1.0, line, line, line, 1.0)),
    ]


def _filled(kind: Any, **given: Any) -> Any:
    return kind(**{name: given.get(name, 0.0) for name in kind._fields})


def signature(kernel: Any, arguments: tuple[Any, ...]) -> tuple[Any, ...]:
    """The types with which such a call asks for the kernel."""
    left = kernel.py_func.__code__.co_argcount - len(arguments)
    omitted = (kernel.py_func.__defaults__ or ())[-left:] if left else ()
    return (*map(typeof, arguments), *map(types.Omitted, omitted))


@contextmanager
def compiling(stages: Sequence[str], say: Callable[[str, float], None]) -> Iterator[None]:
    """Compile what these stages call with a second process, from the moment where something is not on the disk.

    ``say`` gets what to show while this process cannot go on for it, then "" and how long that took in seconds.
    """
    guard = _FirstRun(stages, say)
    before, Kernel.guard = Kernel.guard, guard
    try:
        yield
    finally:
        Kernel.guard = before
        guard.stop()


class _FirstRun(Guard):
    def __init__(self, stages: Sequence[str], say: Callable[[str, float], None]) -> None:
        self._stages, self._say = stages, say
        self._beside: subprocess.Popen[str] | None = None
        self._listed: set[str] = set()
        self._ready: set[str] = set()
        self._said = False

    @contextmanager
    def alone(self, kernel: Kernel) -> Iterator[None]:
        lock, began, self._said = _lock(kernel), time.monotonic(), False
        if lock is None:
            yield
            return
        try:
            lock.acquire(timeout=0)
        except Timeout:
            self._tell()
            lock.acquire()
        try:
            yield
        finally:
            lock.release()
            self._ready.add(_name(kernel))
            if self._said:
                self._say("", time.monotonic() - began)

    def begins(self, kernel: Kernel) -> None:
        if self._beside is None and (os.cpu_count() or 1) > 1:
            self._listed = {_name(one) for one, _ in calls(self._stages)}
            self._start()
        self._tell()

    def stop(self) -> None:
        """End the second process: what it compiles just now is compiled when it is wanted."""
        if self._beside is not None:
            self._beside.kill()
            self._beside.wait()

    def _tell(self) -> None:
        self._said = True
        ready = len(self._ready & self._listed)
        self._say(
            f"compiling, once: {ready} of {len(self._listed)} kernels" if self._listed else "compiling, once", 0.0
        )

    def _start(self) -> None:
        self._beside = subprocess.Popen(
            [sys.executable, "-m", "ovines.first_run", str(os.getpid()), *self._stages],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        )
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self) -> None:
        assert self._beside is not None and self._beside.stdout is not None
        for line in self._beside.stdout:
            self._ready.add(line.strip())


def _name(kernel: Kernel) -> str:
    return f"{kernel.__module__}.{kernel.__qualname__}"


def _lock(kernel: Kernel) -> FileLock | None:
    """The lock that every process takes to compile the kernel (`ovines.core.kernel`), here without waiting."""
    if kernel.index is None:
        return None
    Path(kernel.index).parent.mkdir(parents=True, exist_ok=True)
    return FileLock(f"{kernel.index}.lock")


class _Held(Guard):
    """Of a process that holds a kernel's lock itself: taken a second time it would wait for itself."""

    @contextmanager
    def alone(self, kernel: Kernel) -> Iterator[None]:
        yield


def compile_beside(parent: int, stages: Sequence[str]) -> None:
    """Compile for the process ``parent``, the last first; print the name of each kernel that is on the disk."""
    die_with(parent)
    Kernel.guard = _Held()
    for kernel, arguments in reversed(calls(stages)):
        lock = _lock(kernel)
        if lock is not None:
            with suppress(Timeout), lock.acquire(timeout=0):  # what the other is at, it does itself
                kernel.compile(signature(kernel, arguments))
                print(_name(kernel), flush=True)


if __name__ == "__main__":
    compile_beside(int(sys.argv[1]), sys.argv[2:])
