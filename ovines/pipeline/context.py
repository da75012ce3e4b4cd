"""What a stage's function is given."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from ovines.recording import Recording

Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class StageContext:
    """What a stage's function is given: the recording, its input files, a progress callback (done, total).

    ``notes`` takes what the user should know (a picture that could not be read, a frame without a partner): it is
    printed, and stands in the provenance of the outputs.  ``in_series``: a page of the series stands above ``out``.
    """

    recording: Recording
    inputs: Mapping[str, list[Path]]
    out: Path
    progress: Progress
    notes: list[str] = field(default_factory=list)
    in_series: bool = False

    def path(self, artifact: str) -> Path:
        """The one file of an artifact that has one."""
        return self.inputs[artifact][0]
