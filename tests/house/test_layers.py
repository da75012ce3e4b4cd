"""Which package may import which; what the repository says about itself."""

import ast
import sys
import tomllib
from functools import cache
from pathlib import Path

import pytest

from tests.sources import ROOT, tree_of

# The house from the ground up: a room imports from rows below its own, never from its own row or above.  Files that
# stand at the top of vision, analysis, ovines, or of a room that holds rooms, count each as a room.
# docs/architecture.md shows the same list.
ROWS = """
ovines.core.kernel
ovines.errors ovines.robust ovines.core.state ovines.core.compiled ovines.core.refusal ovines.core.limits \
    analysis.gap.thresholds
ovines.io ovines.lens_field ovines.workers ovines.new ovines.system_library ovines.core.laws vision.compiled \
    vision.smooth_field \
    analysis.compiled analysis.statistics \
    analysis.blind.plant.compiled analysis.blind.plant.parameters analysis.blind.plant.state
ovines.core.system analysis.blind.plant.host analysis.gap.by_run
ovines.tables ovines.camera ovines.recording_schema ovines.core.integration ovines.core.effects \
    analysis.blind.plant.flight analysis.gap.cause analysis.gap.finding
ovines.law_file ovines.recording ovines.importers.reading ovines.core.contact ovines.core.packing vision.markers \
    vision.video vision.pinhole analysis.blind.plant.wall analysis.blind.recording analysis.gap.tests_by_hand
ovines.importers.formats vision.one_view analysis.blind.plant.dynamics analysis.blind.cause vision.calibration.bundle \
    vision.calibration.targets vision.tracking.bodies
ovines.importers ovines.core.engine ovines.core.energies vision.frames vision.calibration vision.triangulate \
    analysis.motion analysis.walls analysis.thesis analysis.blind.causes
analysis.flights.cutting
analysis.flights.equation
ovines.plausibility ovines.core.simulate ovines.core.ensemble vision.identity vision.validation vision.lens \
    vision.known_points analysis.flights analysis.contact.tangential analysis.blind.series analysis.blind.scoring
ovines.core ovines.core.sweep ovines.core.sensitivity vision.calibrate vision.tracking vision.walls \
    analysis.contact analysis.bounces \
    analysis.gap.series analysis.blind.draw
analysis.identification.contact_law
analysis.identification.floor
ovines.scenario ovines.core.orbits vision.track vision.calibration_check vision.rendering analysis.identification \
    analysis.comparison analysis.gap.measurement analysis.blind.trial
analysis.gap.selection.flights analysis.gap.selection.impacts
ovines.core.absorber ovines.blind_film ovines.first_run analysis.identify analysis.compare analysis.figures \
    analysis.gap.selection
analysis.gap.drive
analysis.checks analysis.gap.ladder analysis.simulations analysis.accelerometers
analysis.report analysis.dynamics analysis.gap.prediction analysis.gap.estimates \
    analysis.gap.laws.dictionary analysis.gap.laws.regression
analysis.gap.laws.dictionary.flights analysis.gap.laws.dictionary.impacts analysis.gap.laws.frames.forms \
    analysis.gap.laws.frames.evidence
analysis.gap.laws.choice
analysis.gap.laws analysis.gap.answer analysis.report.pages
analysis.gap.laws.frames.bodies
analysis.gap.laws.frames analysis.gap.laws.instead
analysis.gap.named_laws
analysis.gap.written_laws analysis.gap.next_test
analysis.view analysis.plan analysis.gap.diagnose analysis.gap.impacts_alone ovines.exporters
analysis.gap.page.figures
analysis.gap.page ovines.pipeline
ovines.pipeline.series
ovines.pipeline.blind
ovines.two_results ovines.simulations ovines.commands ovines.commands.options
ovines.commands.recording ovines.commands.chain ovines.commands.results ovines.commands.diagnosis \
    ovines.commands.simulator ovines.notebook
ovines.__main__
ovines.documentation
"""
ROOMS = [row.split() for row in ROWS.strip().splitlines()]
OPEN = (  # hold rooms, and files
    *("vision", "analysis", "ovines"),
    *("analysis.gap", "analysis.blind", "analysis.blind.plant", "ovines.core", "ovines.commands"),
)
MOST_FILES = 13  # of a room: about a dozen
FOUNDATIONS = (
    "ovines.errors",
    "ovines.io",
    "ovines.tables",
    "ovines.camera",
    "ovines.lens_field",
    "ovines.recording_schema",
    "ovines.recording",
)


@cache
def imports_of(path: Path) -> set[str]:
    """Every module that a file imports, wherever in the file."""
    found = set()
    for node in ast.walk(tree_of(path)):
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
            assert not under(module, forbidden, "ovines.commands", "ovines.pipeline"), path


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
            assert top != "ovines" or under(module, "ovines.core", "ovines.errors"), f"{path} imports {module}"


def modules() -> dict[str, Path]:
    """Every module of the application by its dotted name."""
    names = {}
    for package in ("ovines", "vision", "analysis"):
        for path in sources(package):
            names[".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")] = path
    return names


def room_of(module: str, path: Path) -> str:
    """A package is its own room; a file's is its folder, or itself where the folder holds rooms."""
    folder = module.rpartition(".")[0]
    return module if path.name == "__init__.py" or folder in OPEN else folder


def test_arrows_between_rooms_point_down():
    every, level = modules(), {room: n for n, row in enumerate(ROOMS) for room in row}
    rooms = {room_of(module, path) for module, path in every.items()} - {
        "ovines",
        "vision",
        "analysis",
        "analysis.gap",
        "analysis.blind",
        "analysis.blind.plant",
    }
    assert rooms == level.keys()
    up = []
    for module, path in every.items():
        if module in OPEN[:3]:
            continue
        for name in imports_of(path):
            name = name if name in every else name.rpartition(".")[0]
            if name in every and name not in OPEN[:3]:
                here, there = room_of(module, path), room_of(name, every[name])
                if here != there and level[there] >= level[here]:
                    up.append(f"{module} -> {name}")
    assert up == []


def test_the_core_imports_nothing_of_the_application():
    """It refuses with errors of its own, which commands tell: `ovines.errors` is not below it."""
    strange = {
        f"{path.relative_to(ROOT)}: {name}"
        for path in (ROOT / "ovines" / "core").rglob("*.py")
        for name in imports_of(path)
        if name.split(".")[0] in ("ovines", "vision", "analysis") and not name.startswith("ovines.core")
    }
    assert not strange


def test_a_room_holds_about_a_dozen_files():
    for package in ("ovines", "vision", "analysis"):
        for folder in [ROOT / package, *(path for path in (ROOT / package).rglob("*") if path.is_dir())]:
            files = [path for path in folder.glob("*.py") if path.name != "__init__.py"]
            room = ".".join(folder.relative_to(ROOT).parts)
            assert len(files) <= MOST_FILES, room


def test_the_foundations_import_nothing_above():
    for module, path in modules().items():
        if not under(module, *FOUNDATIONS):
            continue
        for name in imports_of(path):
            assert not under(name, "vision", "analysis"), path
            assert not under(name, "ovines") or name == "ovines.__version__" or under(name, *FOUNDATIONS), (
                f"{path} imports {name}"
            )


def test_parquet_is_touched_in_one_place():
    for package in ("ovines", "vision", "analysis"):
        for path in sources(package):
            touched = any(under(module, "pyarrow") for module in imports_of(path))
            touched |= any(word in path.read_text(encoding="utf-8") for word in (".to_parquet(", "pd.read_parquet("))
            assert not touched or path.parent.name == "tables", path


def test_every_stage_has_its_command_and_its_function():
    import ovines.pipeline.functions
    from ovines.__main__ import command, command_names
    from ovines.pipeline.stages import STAGES

    names = command_names()
    for one in STAGES:
        assert one.name in names and callable(getattr(ovines.pipeline.functions, one.name))
    for name in names:
        module = command(name)
        assert name == module.NAME and module.HELP and callable(module.add_arguments) and callable(module.run)


def test_the_page_of_the_chain_is_the_declaration():
    from ovines.documentation.stages_page import PAGE, chain_page

    assert PAGE.read_text(encoding="utf-8") == chain_page(), "run python -m ovines.documentation.stages_page"


def test_every_dependency_has_its_reason():
    reasons = (ROOT / "docs" / "decisions.md").read_text(encoding="utf-8")
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    for requirement in project["dependencies"]:
        name = requirement.split(">")[0].split("=")[0].strip()
        assert name in reasons, f"{name}: no reason in docs/decisions.md"
