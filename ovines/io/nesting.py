"""How deep a text is nested, before a parser that recurses is let near it: some end the whole process at their stack's
end.
"""

from __future__ import annotations

import re
from pathlib import Path

from ovines.errors import InputError

DEEPEST = 64  # camera files and settings nest five deep
STRING = re.compile(r'"(?:[^"\\\n]|\\.)*"|\'[^\'\n]*\'')
TAG = re.compile(r"<(/?)[A-Za-z_][^<>]*?(/?)>")
BLOCK = re.compile(r"^[ \t]*(?:-[ \t]+)*", re.MULTILINE)  # YAML: what a line begins with says how deep it stands
BETWEEN_DOTS = re.compile(r"[=,{}\[\]#\n]")  # TOML: what stands between is a key with its dots, or one number


def refuse_deep(text: str, path: Path, expected: str) -> None:
    """`InputError` where ``text`` (JSON, TOML, YAML or XML) is nested deeper than `DEEPEST`."""
    depth = max(_brackets(text), _tags(text), _blocks(text))
    if depth > DEEPEST:
        raise _too_deep(path, depth, expected)


def refuse_deep_toml(text: str, path: Path) -> None:
    """`InputError` where a TOML file nests deeper than `DEEPEST`, by brackets or by dots in a key."""
    plain = STRING.sub('""', text)
    dots = max(piece.count(".") for piece in BETWEEN_DOTS.split(plain))
    depth = max(_brackets(text), dots)
    if depth > DEEPEST:
        raise _too_deep(path, depth, "a TOML file")


def _too_deep(path: Path, depth: int, expected: str) -> InputError:
    return InputError(
        f"{path} is nested {depth} deep",
        f"{expected}, at most {DEEPEST} deep",
        "check the path, or write the file again",
    )


def _brackets(text: str) -> int:
    deepest = depth = 0
    for sign in re.findall(r"[\[\]{}]", STRING.sub("", text)):
        depth += 1 if sign in "[{" else -1
        deepest, depth = max(deepest, depth), max(depth, 0)
    return deepest


def _tags(text: str) -> int:
    deepest = depth = 0
    for closing, single in TAG.findall(text):
        depth += -1 if closing else 0 if single else 1
        deepest, depth = max(deepest, depth), max(depth, 0)
    return deepest


def _blocks(text: str) -> int:
    """Deepest block of a YAML text: each level is indented by one column at least."""
    return max((len(start.expandtabs(8)) for start in BLOCK.findall(text)), default=0) // 2 if "\n" in text else 0
