"""What the fork server has ready when a command is forked: every command's modules, those that commands load on their
way, and of the compiled code of an identification what the disk has.
"""

from __future__ import annotations

import gc
import importlib
from contextlib import suppress

from ovines.__main__ import command, command_names
from ovines.core.kernel import Guard, Kernel
from ovines.first_run import calls, signature

ON_THE_WAY = (
    "analysis.checks.series",
    "analysis.gap.diagnose",
    "analysis.gap.page.gap_page",
    "analysis.identification.given_impacts",
    "analysis.report.terminal",
    "matplotlib.backends.backend_agg",
    "matplotlib.backends.backend_svg",
    "ovines.pipeline.series.diagnosis",
    "pyarrow.dataset",
    "vision.calibration_check",
)


class _NotOnTheDisk(LookupError):
    """A kernel would have to be compiled: the command that needs it does that."""


class _OnlyFromTheDisk(Guard):
    def begins(self, kernel: Kernel) -> None:
        raise _NotOnTheDisk


def _load() -> None:
    for name in command_names():
        command(name)
    for module in ON_THE_WAY:
        importlib.import_module(module)
    usual, Kernel.guard = Kernel.guard, _OnlyFromTheDisk()
    try:
        for kernel, arguments in calls(["identify"]):
            with suppress(_NotOnTheDisk):
                kernel.compile(signature(kernel, arguments))
    finally:
        Kernel.guard = usual

    gc.freeze()  # no process looks through it for circles, which would copy all of it page by page


_load()
