"""A value of a recording that contradicts another one: what was found, why it is doubtful, and the line to change."""

from __future__ import annotations

from dataclasses import dataclass

from ovines.errors import InputError
from ovines.io.toml_input import line_of
from ovines.recording import FILE, Recording

Key = tuple[int | str, ...]
G_M_PER_S2 = 9.81
FEWEST = 20  # samples below which nothing is said of a clock, a spectrum or a scatter


@dataclass(frozen=True)
class PlausibilityWarning:
    """What was found, what makes it doubtful, what to do, and the key of recording.toml that says it."""

    found: str
    reason: str
    do: str
    key: Key = ()

    def text(self, recording: Recording) -> str:
        """One sentence with the line to change."""
        return f"{self.found}: {self.reason}; {self.do}{self._line(recording)}"

    def error(self, recording: Recording) -> InputError:
        """The warning as a refusal: found, expected, and the line to change."""
        return InputError(
            f"{recording.folder / FILE}: {self.found}" if self.key else f"{recording.folder}: {self.found}",
            self.reason,
            f"{self.do}{self._line(recording)}",
        )

    def _line(self, recording: Recording) -> str:
        try:
            line = line_of((recording.folder / FILE).read_text(encoding="utf-8-sig"), self.key) if self.key else None
        except (OSError, ValueError):
            line = None
        return f" ({FILE}, line {line})" if line is not None else ""
