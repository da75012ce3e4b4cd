"""The code that a stage runs, found by following imports: results are stale when that code has changed, and only
then.
"""

from __future__ import annotations

import ast
import hashlib
import re
from collections.abc import Iterable
from functools import cache
from pathlib import Path

import ovines
from ovines.io.provenance import sha256_of

ROOT = Path(ovines.__file__).resolve().parent.parent
FUNCTIONS = "ovines.pipeline.functions"
IMPORT = re.compile(r"^[ \t]*from ((?:vision|analysis|ovines)[\w.]*) import (\([^)]*\)|[^\n#]*)", re.MULTILINE)
BESIDE = (".j2", ".css")  # what a page is made with lies beside its code


@cache
def code_digest(stage: str) -> str:
    """Short hash of the code of a stage."""
    digest = hashlib.sha256()
    for path in code_of(stage):
        digest.update(_line_of(path))
    return digest.hexdigest()[:16]


@cache
def _line_of(path: Path) -> bytes:
    """A file's name and hash: most files are part of several stages."""
    return f"{path.relative_to(ROOT).as_posix()}:{sha256_of(path)}\n".encode()


@cache
def code_of(stage: str) -> tuple[Path, ...]:
    """Files that the function of a stage (:mod:`ovines.pipeline.functions`) stands in or imports, however far away."""
    tree = ast.parse(file_of(FUNCTIONS).read_text(encoding="utf-8"))
    functions = {one.name: one for one in tree.body if isinstance(one, ast.FunctionDef)}
    bodies: list[ast.stmt] = [one for one in tree.body if not isinstance(one, ast.FunctionDef)]
    called, done = [stage], set()
    while called:
        name = called.pop()
        done.add(name)
        bodies.append(functions[name])
        names = {node.id for node in ast.walk(functions[name]) if isinstance(node, ast.Name)}
        called += [one for one in names & functions.keys() if one not in done and one not in called]
    modules, seen = [FUNCTIONS, *_imported("\n".join(ast.unparse(one) for one in bodies))], {FUNCTIONS}
    while modules:
        module = modules.pop()
        if module not in seen:
            seen.add(module)
            modules += _imports(module)
    files = {file_of(module) for module in seen}
    return tuple(sorted(files | {path for file in files for path in file.parent.iterdir() if path.suffix in BESIDE}))


@cache
def file_of(module: str) -> Path:
    """A module's file, or its package's ``__init__.py``."""
    path = ROOT.joinpath(*module.split("."))
    return path / "__init__.py" if path.is_dir() else path.with_suffix(".py")


@cache
def _is_module(name: str) -> bool:
    return file_of(name).is_file()


@cache
def _imports(module: str) -> tuple[str, ...]:
    return tuple(_imported(file_of(module).read_text(encoding="utf-8")))


def _imported(source: str) -> Iterable[str]:
    """Modules that a text imports: ``from package import module`` names the module, and every package above runs
    too.
    """
    for package, names in IMPORT.findall(source):
        parts = package.split(".")
        yield from (".".join(parts[: n + 1]) for n in range(len(parts)))
        for name in re.findall(r"(\w+)(?: as \w+)?", names):
            if _is_module(f"{package}.{name}"):
                yield f"{package}.{name}"
