"""Where an output comes from: version, command, parameters, hash of what was read.

No clock, no host, no absolute path: the same input must give the same bytes.
"""

from __future__ import annotations

import hashlib
import os
import subprocess
from collections.abc import Mapping
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Any

from ovines import __version__

ROOT = Path(__file__).resolve().parents[2]


def provenance(command: str, parameters: Mapping[str, Any], inputs: Mapping[str, str]) -> dict[str, Any]:
    """The record that goes into an output: ``inputs`` maps a name to its sha256, ``parameters`` is plain JSON."""
    return {
        "version": __version__,
        "command": command,
        "parameters": dict(parameters),
        "inputs": dict(inputs),
    }


def sha256_of(path: str | Path) -> str:
    """sha256 of a file's bytes, read in pieces."""
    with open(path, "rb") as handle:
        return hashlib.file_digest(handle, "sha256").hexdigest()


@cache
def commit() -> str | None:
    """Commit of the checkout that the program runs from, with "-changed" where files differ from it; None elsewhere."""
    if not (ROOT / ".git").exists():  # else a checkout further up, which is not ours, would answer
        return None
    command = ["git", "describe", "--always", "--exclude=*", "--abbrev=10", "--dirty=-changed"]
    try:
        found = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=10, check=True)
    except (OSError, subprocess.SubprocessError):
        return None
    return found.stdout.strip() or None


def program() -> str:
    """Name, version and commit of the program."""
    return f"ovines {__version__}" + (f", commit {commit()}" if commit() else "")


def today() -> str:
    """The day, for pages, as 2026-11-22; by ``SOURCE_DATE_EPOCH`` (s since 1970, UTC) where that is set."""
    epoch = os.environ.get("SOURCE_DATE_EPOCH", "")
    if epoch.isdecimal() and len(epoch) < 12:
        return datetime.fromtimestamp(int(epoch), tz=UTC).date().isoformat()
    return datetime.now().astimezone().date().isoformat()
