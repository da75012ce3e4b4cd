"""The code as it is written, for tests that ask about its form: each file is parsed once, and only where its words say
that there may be something to find.
"""

from __future__ import annotations

import ast
from collections.abc import Sequence
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("ovines", "vision", "analysis")


@cache
def tree_of(path: Path) -> ast.Module:
    """What a file says, parsed; nobody may change it."""
    return ast.parse(path.read_text(encoding="utf-8"))


def trees(top: str, words: Sequence[str] = ("",)) -> dict[Path, ast.Module]:
    """Every file below a folder of the checkout that holds one of the words, as :func:`tree_of`."""
    paths = sorted((ROOT / top).rglob("*.py"))
    return {path: tree_of(path) for path in paths if any(word in path.read_text(encoding="utf-8") for word in words)}
