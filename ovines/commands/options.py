"""Options that commands of several rooms take."""

from __future__ import annotations

import argparse
from pathlib import Path


def results_folder(recording: Path, out: Path | None) -> Path:
    """``--out``, or the folder results/ inside the recording or series."""
    if out is not None:
        return out
    return (recording.parent if recording.is_file() else recording) / "results"


def whole_number(text: str) -> int:
    """An option that counts or seeds."""
    value = int(text) if text.strip().isdecimal() and len(text) < 13 else -1
    if value < 0:
        raise argparse.ArgumentTypeError("a whole number from 0")
    return value


def jobs(text: str) -> int:
    """``--jobs``: how many at a time; 0 is one per processor."""
    count = int(text) if text.strip().isdecimal() and len(text) < 13 else -1
    if not 0 <= count <= 1024:
        raise argparse.ArgumentTypeError("a number from 0 to 1024")
    return count
