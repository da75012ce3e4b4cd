"""Hashes of a stage's inputs: their bytes, not their dates, so that a copy of a recording is the same recording."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from ovines.errors import InputError
from ovines.io.provenance import sha256_of

# (path, size, mtime) -> sha256, within one process: six stages ask for the same files
_known: dict[tuple[str, int, int], str] = {}


def hash_inputs(inputs: Mapping[str, list[Path]], folder: Path) -> dict[str, str]:
    """One sha256 per artifact, over names (relative to ``folder``) and contents of its files."""
    with ThreadPoolExecutor(max_workers=2) as pool:  # hashlib lets go of the interpreter: reading and hashing overlap
        return {artifact: _together(paths, list(pool.map(_hash, paths)), folder) for artifact, paths in inputs.items()}


def _together(paths: list[Path], hashes: list[str], folder: Path) -> str:
    if len(paths) == 1:
        return hashes[0]
    names = [os.path.relpath(path, folder).replace(os.sep, "/") for path in paths]
    listing = "\n".join(f"{name}:{one}" for name, one in zip(names, hashes, strict=True))
    return hashlib.sha256(listing.encode("utf-8", "surrogateescape")).hexdigest()


def _hash(path: Path) -> str:
    try:
        status = path.stat()
        mark = (str(path.resolve()), status.st_size, status.st_mtime_ns)
        if mark not in _known:
            _known[mark] = sha256_of(path)
        return _known[mark]
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}", "a readable file", "check the path and its permissions") from None
