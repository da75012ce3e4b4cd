"""The documentation says what is so: examples run, commands parse, made pages are fresh, the site builds without
network.
"""

from __future__ import annotations

import ast
import contextlib
import doctest
import functools
import importlib
import io
import itertools
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from decimal import Decimal
from pathlib import Path

import pandas as pd
import pytest
from pydantic import ValidationError

from ovines.__main__ import main, parse
from ovines.documentation.drawn import DRAWN
from ovines.documentation.house_picture import PICTURE, house
from ovines.documentation.reference_pages import FOLDER, PAGES
from ovines.documentation.schema_pages import BOARD_KEYS, examples, keys, models_of, sections
from ovines.recording_schema import RecordingFile
from ovines.scenario import ScenarioFile
from tests.sources import PACKAGES, ROOT, trees

TEXTS = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
SAMPLE = ROOT / "sample_data" / "series_tilted"
NUMBER = re.compile(r"\d+\.\d+")  # counts are equal to the digit
LAST_PLACE = 2


def fences(path: Path) -> list[tuple[str, str]]:
    """(language, content) of every fenced block."""
    return re.findall(r"^```(\w*)\n(.*?)^```", path.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)


@pytest.mark.parametrize("name", PAGES)
def test_the_reference_is_made_from_the_code(name):
    assert (FOLDER / name).read_text(encoding="utf-8") == PAGES[name](), (
        "run python -m ovines.documentation.reference_pages"
    )


@pytest.mark.parametrize("model", [RecordingFile, ScenarioFile])
def test_every_key_of_a_file_has_a_valid_example(model):
    """The examples of the schema's reference, each read as the schema reads a file."""
    for _, section in sections(model):
        listed = keys(section)
        for name, field in section.model_fields.items():
            assert name in {key.name for key in listed} or models_of(field.annotation), f"{section}: describe {name}"
        for name, value in examples(listed).items():
            try:
                section.model_validate({name: as_tuples(value)})
            except ValidationError as error:
                assert not [one for one in error.errors() if one["loc"][:1] == (name,)], error


def test_the_picture_of_the_house_is_made_from_its_rows():
    assert PICTURE.read_text(encoding="utf-8") == house(), "run python -m ovines.documentation.house_picture"


def drawing_functions() -> set[str]:
    """Every public function that gives a matplotlib figure; `Drawing` is what a page takes, drawn or to be drawn."""
    found = set()
    drawing = ("from matplotlib.figure import Figure",)
    for path, tree in (one for package in PACKAGES for one in trees(package, drawing).items()):
        module = ".".join(path.relative_to(ROOT).with_suffix("").parts)
        for node in tree.body:
            if not isinstance(node, ast.FunctionDef) or node.returns is None or node.name.startswith("_"):
                continue
            given = {ast.unparse(one.annotation) for one in node.args.args if one.annotation is not None}
            if ast.unparse(node.returns) in ("Figure", "Figure | None") and "Drawing" not in given:
                found.add(f"{module}.{node.name}")
    return found


def test_the_gallery_shows_every_figure():
    """By the functions that draw; those of pages also by the alternative text that the pages give them.  Pictures that
    nobody shows are not kept.
    """
    page = (ROOT / "docs" / "reference" / "gallery.md").read_text(encoding="utf-8")
    functions = drawing_functions()
    assert len(functions) > 60 and functions == set(DRAWN)
    shown = re.findall(r"!\[[^]]*\]\(\.\./figures/([^)]+)\)", page)
    assert set(DRAWN.values()) <= set(shown) and all(f"`{name}`" in page for name in functions)
    named = [
        call.args[3].value
        for tree in trees("analysis", ("add_figure",)).values()
        for call in ast.walk(tree)
        if isinstance(call, ast.Call) and getattr(call.func, "attr", "") == "add_figure"
        if len(call.args) > 3 and isinstance(call.args[3], ast.Constant)
    ]
    assert len(named) >= 30 and not [alt for alt in named if f"![{alt}" not in page]
    kept = sorted(path.name for path in (ROOT / "docs" / "figures" / "gallery").iterdir())
    assert kept == sorted(name.removeprefix("gallery/") for name in shown if name.startswith("gallery/"))


def as_tuples(value):
    return tuple(map(as_tuples, value)) if isinstance(value, list) else value


def test_every_page_is_in_the_navigation():
    listed = set(re.findall(r": ([\w/-]+\.md)$", (ROOT / "mkdocs.yml").read_text(encoding="utf-8"), re.MULTILINE))
    assert listed == {path.relative_to(ROOT / "docs").as_posix() for path in (ROOT / "docs").rglob("*.md")}


def test_every_key_of_a_board_has_a_valid_example():
    """The keys of the page are the board's, and its examples, by kind of board, are read."""
    from vision.calibration.targets.boards import KINDS, Board, board_from

    assert {key.name for key in BOARD_KEYS} == set(Board.__dataclass_fields__)
    given = examples(BOARD_KEYS)
    for kind in KINDS:
        size = {"squares": [9, 7]} if kind == "dots" else {}
        assert board_from({**given, **size, "kind": kind}, "page", "board-toml.md").kind == kind


def offered() -> list[tuple[str, str]]:
    """(module, name) of every function of docs/reference/python.md."""
    listed = []
    for block in (ROOT / "docs" / "reference" / "python.md").read_text(encoding="utf-8").split("\n::: ")[1:]:
        path, members = block.split()[0], re.search(r"members: \[(.*)\]", block)
        listed += [f"{path}.{name}" for name in members[1].split(", ")] if members else [path]
    return [
        (module, name) for module, _, name in (path.rpartition(".") for path in listed) if f"{module}{name}".islower()
    ]


def test_every_function_between_the_rooms_is_in_the_reference():
    """By their names in the table of docs/architecture.md: functions, and methods as ``Class.method``."""
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    table = text.split("## The functions between the rooms")[1].split("\n\n")[2]
    named = {
        re.sub(r"\(.*", "", code)
        for row in table.splitlines()[2:]
        for code in re.findall(r"`([^`]+)`", row.split("|")[2])
    }
    blocks = (ROOT / "docs" / "reference" / "python.md").read_text(encoding="utf-8").split("\n::: ")[1:]
    methods = {
        f"{block.split()[0].rpartition('.')[2]}.{name}"
        for block in blocks
        for name in (re.search(r"members: \[(.*)\]", block) or ["", ""])[1].split(", ")
    }
    assert len(named) >= 30 and not named - {name for _, name in offered()} - methods


@pytest.fixture(scope="module")
def calibrated_once() -> Iterator[None]:
    """The notebook and the example of `calibrate` calibrate the same pictures: once does."""
    from ovines import notebook

    whole, solved = notebook.calibrate, {}

    @functools.wraps(whole)
    def calibrate(recording, *more):
        key = recording.folder.resolve()
        if key not in solved:
            solved[key] = whole(recording, *more)
        return solved[key]

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(notebook, "calibrate", calibrate)
        yield


@pytest.fixture(scope="module")
def identified_once() -> Iterator[None]:
    """The example of `compare` begins with that of `identify`."""
    from ovines import notebook

    whole, known = notebook.identify, {}

    @functools.wraps(whole)
    def identify(motion, recording, *more):
        key = recording.folder.resolve(), pd.util.hash_pandas_object(motion).to_numpy().tobytes(), *more
        if key not in known:
            known[key] = whole(motion, recording, *more)
        return known[key]

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(notebook, "identify", identify)
        yield


@pytest.mark.usefixtures("calibrated_once", "identified_once", "without_laws")
@pytest.mark.parametrize(("module", "name"), offered())
def test_every_function_of_the_reference_has_an_example_that_runs(module, name, monkeypatch):
    monkeypatch.chdir(ROOT)
    # What a diagnosis advises next is in no example, and takes a fifth of its time.
    monkeypatch.setattr("analysis.gap.diagnose.next_tests", lambda *_: None)
    function = getattr(importlib.import_module(module), name)
    (example,) = doctest.DocTestFinder(recurse=False).find(function, name, globs={})
    printed: list[str] = []
    result = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE).run(example, out=printed.append)
    assert result.attempted >= 2 and result.failed == 0, "".join(printed)


def test_the_reference_offers_the_notebook():
    from ovines import notebook

    assert set(notebook.__all__) <= {name for _, name in offered()}


def test_the_files_of_the_reference_are_read(tmp_path):
    """calibration.json, trigger.csv and names.csv as docs/reference/files.md shows them."""
    from ovines.camera import read_calibration
    from ovines.recording import read_trigger
    from vision.tracking.manual_names import check_names

    shown = [content for _, content in fences(ROOT / "docs" / "reference" / "files.md")]
    paths = [tmp_path / name for name in ("calibration.json", "trigger.csv", "names.csv")]
    for path, content in zip(paths, shown, strict=True):
        path.write_text(content, encoding="utf-8")
    assert read_calibration(paths[0])[0].name == "VW1"
    assert read_trigger(paths[1])[1][2] == 0.0025 and len(check_names(pd.read_csv(paths[2]))) == 2


def test_python_examples_print_what_the_page_shows():
    blocks = fences(ROOT / "docs" / "how-to" / "python.md")
    shown = [(code, after[1]) for (kind, code), after in itertools.pairwise(blocks) if kind == "python"]
    assert len(shown) >= 2
    for code, expected in shown:
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile(code, "python.md", "exec"), {})
        assert printed.getvalue() == expected


def documented_commands() -> list[tuple[str, str]]:
    found = []
    for path in TEXTS:
        for kind, content in fences(path):
            if kind in ("", "sh"):
                lines = re.findall(r"^(?:.*&& )?(?:\$ |\.venv/bin/)?(ovines [a-z].*)$", content, re.MULTILINE)
                found += [(path.name, line.split("  #")[0].strip()) for line in lines]
    return found


def test_every_command_in_the_documentation_parses():
    lines = documented_commands()
    assert len(lines) >= 8
    for page, line in lines:
        try:
            parse(shlex.split(line)[1:])
        except SystemExit as end:
            pytest.fail(f"{page}: {line}: exit status {end.code}")


@pytest.mark.parametrize("path", TEXTS, ids=lambda path: path.name)
def test_every_link_leads_somewhere(path):
    for target in re.findall(r"\]\(([^)#\s]+)", path.read_text(encoding="utf-8")):
        assert target.startswith("http") or (path.parent / target).exists(), target


def test_the_site_builds_and_asks_nobody(tmp_path):
    pytest.importorskip("mkdocs")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(tmp_path / "site")]
    result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=120, check=False)
    assert result.returncode == 0, result.stdout + result.stderr
    pages = list((tmp_path / "site").rglob("*.html"))
    assert len(pages) > 15
    for page in pages:
        text = page.read_text(encoding="utf-8")
        asked = re.findall(
            r"<(?:script|img|iframe|source)[^>]+src=\"(?:https?:)?//[^\"]+|<link[^>]+href=\"(?:https?:)?//[^\"]+", text
        )
        assert not [one for one in asked if "canonical" not in one], page
    for sheet in (tmp_path / "site").rglob("*.css"):
        assert not re.search(r"url\([\"']?(https?:)?//|@import", sheet.read_text(encoding="utf-8")), sheet


def test_the_command_makes_the_figures_of_the_validation_page(tmp_path):
    """`ovines simulate --figures` draws those pictures that the simulator's page shows, of the kept ones' size."""
    from PIL import Image

    assert main(["simulate", "--figures", str(tmp_path)]) == 0
    shown = re.findall(
        r"!\[[^]]*\]\(../figures/([^)]+)\)", (ROOT / "docs" / "validation" / "simulator.md").read_text(encoding="utf-8")
    )
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(shown)
    for name in shown:
        with Image.open(tmp_path / name) as made, Image.open(ROOT / "docs" / "figures" / name) as kept:
            assert made.size == kept.size and len(made.convert("L").getcolors() or range(256)) > 20, name  # not blank


@pytest.mark.usefixtures("unpainted")
@pytest.mark.skipif(not SAMPLE.is_dir(), reason="no sample series")
def test_the_tutorial_prints_what_it_shows(tmp_path, monkeypatch, capsys):
    """Each `$ ovines ...` of the tutorial run in turn; the lines below it are what it prints.  The last place of a
    number may differ by ``LAST_PLACE``: another machine's linear algebra rounds otherwise.
    """
    (tmp_path / "sample_data").symlink_to(ROOT / "sample_data")
    monkeypatch.chdir(tmp_path)
    blocks = [content for _, content in fences(ROOT / "docs" / "tutorial.md") if content.startswith("$ ovines")]
    assert len(blocks) >= 3
    for block in blocks:
        command, _, expected = block.partition("\n")
        status, said = main(shlex.split(command)[2:]), capsys.readouterr()
        assert status == 0, said.err
        printed, shown = said.out.strip(), expected.strip()
        assert NUMBER.sub("#", printed) == NUMBER.sub("#", shown), printed
        for one, other in zip(NUMBER.findall(printed), NUMBER.findall(shown), strict=True):
            assert abs(Decimal(one) - Decimal(other)) <= LAST_PLACE * 10 ** Decimal(other).as_tuple().exponent, printed


@pytest.mark.usefixtures("calibrated_once")
@pytest.mark.skipif(not SAMPLE.is_dir(), reason="no sample recording")
def test_the_notebook_prints_what_it_shows(tmp_path, monkeypatch):
    """The cells of docs/notebook.md in one session, from top to bottom."""
    (tmp_path / "sample_data").symlink_to(ROOT / "sample_data")
    monkeypatch.chdir(tmp_path)
    blocks = fences(ROOT / "docs" / "notebook.md")
    cells = [(code, after[1]) for (kind, code), after in itertools.pairwise(blocks) if kind == "python"]
    assert len(cells) >= 6
    space: dict[str, object] = {}
    for code, expected in cells:
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile(code, "notebook.md", "exec"), space)
        assert printed.getvalue() == expected, code
    assert (tmp_path / "notebook_path.png").stat().st_size > 10_000


def test_the_notebook_names_every_stage():
    """`ovines.notebook` has a function for each command that computes."""
    from ovines import notebook
    from ovines.pipeline.stages import STAGES

    for name in ({one.name for one in STAGES} - {"report"}) | {"compare", "diagnose", "simulate"}:
        assert callable(getattr(notebook, name)) and name in notebook.__all__
