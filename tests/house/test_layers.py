"""Which package may import which; what the repository says about itself."""

import ast
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
FOUNDATIONS = {
    "errors",
    "camera",
    "tables",
    "recording",
    "recording_schema",
    "toml_input",
    "written_whole",
    "provenance",
}


def imports_of(path: Path) -> set[str]:
    """Every module that a file imports, wherever in the file."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative imports hide where the arrow points"
            found |= {f"{node.module}.{alias.name}" for alias in node.names}
    return found


def sources(package: str) -> list[Path]:
    return sorted((ROOT / package).rglob("*.py"))


def under(module: str, *packages: str) -> bool:
    return any(module == package or module.startswith(package + ".") for package in packages)


@pytest.mark.parametrize(("package", "forbidden"), [("vision", "analysis"), ("analysis", "vision")])
def test_vision_and_analysis_do_not_know_each_other(package, forbidden):
    assert sources(package)
    for path in sources(package):
        for module in imports_of(path):
            assert not under(
                module, forbidden, "ovines.commands", "ovines.chain", "ovines.stages", "ovines.running"
            ), path


def test_the_core_stands_alone():
    allowed = {
        "numpy",
        "scipy",
        "numba",
        "ovines",
        "distributed",
    }  # the last: ensembles on a cluster, optional extra
    for path in sources("ovines/core"):
        for module in imports_of(path):
            top = module.split(".")[0]
            assert top in allowed or top in sys.stdlib_module_names, f"{path} imports {module}"
            assert top != "ovines" or under(module, "ovines.core", "ovines.errors"), (
                f"{path} imports {module}"
            )


def test_the_foundations_import_nothing_above():
    for path in [*(ROOT / "ovines").glob("*.py"), *sources("ovines/tables")]:
        if path.stem not in FOUNDATIONS and path.parent.name != "tables":
            continue
        for module in imports_of(path):
            assert not under(
                module, "vision", "analysis", "ovines.core", "ovines.commands", "ovines.chain"
            ), path
            if under(module, "ovines") and module != "ovines.__version__":
                assert module.split(".")[1] in FOUNDATIONS, f"{path} imports {module}"


def test_parquet_is_touched_in_one_place():
    for package in ("ovines", "vision", "analysis"):
        for path in sources(package):
            touched = any(under(module, "pyarrow") for module in imports_of(path))
            touched |= any(
                word in path.read_text(encoding="utf-8") for word in (".to_parquet(", "pd.read_parquet(")
            )
            assert not touched or path.parent.name == "tables", path


def test_every_stage_has_its_command_and_its_function():
    import ovines.stages
    from ovines.__main__ import command, command_names
    from ovines.chain import STAGES

    names = command_names()
    for one in STAGES:
        assert one.name in names and callable(getattr(ovines.stages, one.name))
    for name in names:
        module = command(name)
        assert module.NAME == name and module.HELP and callable(module.add_arguments) and callable(module.run)


def test_the_page_of_the_chain_is_the_declaration():
    from ovines.chain_page import PAGE, chain_page

    assert PAGE.read_text(encoding="utf-8") == chain_page(), "run python -m ovines.chain_page"


def test_every_dependency_has_its_reason():
    reasons = (ROOT / "docs" / "decisions.md").read_text(encoding="utf-8")
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    for requirement in project["dependencies"]:
        name = requirement.split(">")[0].split("=")[0].strip()
        assert name in reasons, f"{name}: no reason in docs/decisions.md"
