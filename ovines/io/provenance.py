"""Where an output comes from: version, command, parameters, hash of what was read.

No clock, no host, no absolute path: the same input must give the same bytes.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ovines import __version__


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
