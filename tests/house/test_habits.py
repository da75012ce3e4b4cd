"""What a newcomer relies on: commands of CONTRIBUTING, pins, licence, citation, hooks."""

from __future__ import annotations

import re
import tomllib
from importlib import metadata
from pathlib import Path

import pytest
from packaging.specifiers import SpecifierSet

import ovines

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def plain(name: str) -> str:
    """A package's name as package indexes compare it."""
    return re.sub(r"[-_.]+", "-", re.split(r"[<>=\[; ]", name)[0]).lower()


def pins() -> dict[str, str]:
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    return {plain(line): line.split("==")[1] for line in lines if not line.startswith("#")}


@pytest.mark.parametrize("extra", ["", *PROJECT["optional-dependencies"]])
def test_every_package_is_pinned(extra):
    wanted = PROJECT["optional-dependencies"][extra] if extra else PROJECT["dependencies"]
    assert [name for name in wanted if plain(name) not in pins()] == []


def test_pins_are_exact_and_in_order():
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()[1:]
    assert all(re.fullmatch(r"[\w.-]+==[\w.]+", line) for line in lines)
    assert lines == sorted(lines, key=str.lower) and len(pins()) == len(lines)


def test_pins_are_for_the_first_python_that_the_project_allows():
    """A package of the documentation had asked for a later patch than Debian 12 has, and nothing could be installed."""
    first = SpecifierSet(PROJECT["requires-python"])
    (oldest,) = (f"{one.version}.0" for one in first if one.operator == ">=")
    installed = {plain(one.name): one for one in metadata.distributions()}
    asked = {
        name: installed[name].metadata.get("Requires-Python")
        for name, version in pins().items()
        if name in installed and installed[name].version == version
    }
    assert len(asked) > 20
    assert {name: one for name, one in asked.items() if one and oldest not in SpecifierSet(one)} == {}


def test_the_commands_of_contributing_are_there():
    """Each row's tool comes with the extras of its first row, and the hooks run the tools of the lint row."""
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    rows = dict(re.findall(r"^\| ([\w ]+) \| `([^`]+)`", text, re.MULTILINE))
    assert set(rows) == {"set up", "test", "test all cases", "lint", "documentation"}
    extras = re.search(r"\.\[([\w,]+)\]", rows["set up"])[1].split(",")
    packages = {plain(name) for extra in extras for name in PROJECT["optional-dependencies"][extra]}
    tools = set(re.findall(r"\.venv/bin/([\w-]+)", rows["lint"] + rows["documentation"] + text)) - {
        "pip",
        "python",
        "ovines",
    }
    assert {"ruff", "mypy", "pre-commit", "mkdocs"} <= tools <= packages
    hooks = re.findall(
        r"entry: sh -c '.*exec ([\w -]+?)(?: --force-exclude \"\$@\")?'",
        (ROOT / ".pre-commit-config.yaml").read_text(encoding="utf-8"),
    )
    lint = [command.strip().removeprefix(".venv/bin/") for command in rows["lint"].split("&&")]
    assert hooks == lint == ["ruff check", "ruff format --check", "mypy"]


def test_licence_and_citation_agree_with_the_package():
    assert (ROOT / "LICENSE").read_text(encoding="utf-8").startswith("BSD 3-Clause") and PROJECT[
        "license"
    ] == "BSD-3-Clause"
    yaml = pytest.importorskip("yaml")
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert {"cff-version", "message", "title", "authors", "version", "license"} <= set(citation)
    assert (citation["version"], citation["license"]) == (ovines.__version__, PROJECT["license"])
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert f"## {ovines.__version__}" in changes


def test_types_are_promised_and_shipped():
    """`py.typed` of each package, and in the wheel's package data."""
    data = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"]["package-data"]
    for package in ("ovines", "vision", "analysis"):
        assert (ROOT / package / "py.typed").is_file() and "py.typed" in data[package]
