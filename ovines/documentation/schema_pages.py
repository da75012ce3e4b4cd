"""Reference of the files that people write, from their schema: every key with meaning, unit, default and example.

A key's meaning and example stand as a docstring below it in the schema; ``python -m
ovines.documentation.reference_pages`` writes the pages.
"""

from __future__ import annotations

import ast
import inspect
import re
import textwrap
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import ovines
from ovines.core.laws.targets import TARGETS
from ovines.core.laws.words import QUANTITIES
from ovines.io.toml_input import Section
from ovines.law_file import LawFile
from ovines.recording_schema import RecordingFile
from ovines.scenario import ScenarioFile
from ovines.tables.column import UNITS

ROOT = Path(ovines.__file__).resolve().parent.parent
BEYOND_SUFFIX = {"acceleration_g": "g"}  # units that a key's end does not tell
HEADER = ("| key | meaning | type | unit | default | example |", "|---|---|---|---|---|---|")


class Key(NamedTuple):
    """One key of a file: ``kind`` is its type and bounds in words, ``default`` and ``example`` TOML."""

    name: str
    meaning: str
    kind: str
    default: str
    example: str

    def row(self) -> str:
        """Its line of the table."""
        plain = "1" if self.kind.startswith("number") else ""
        unit = BEYOND_SUFFIX.get(self.name, next((u for end, u in UNITS.items() if self.name.endswith(end)), plain))
        cells = (f"`{self.name}`", self.meaning, self.kind, unit, self.default, f"`{self.example}`")
        return f"| {' | '.join(cells)} |"


def recording_page() -> str:
    """docs/reference/recording-toml.md."""
    whole = (ROOT / "sample_data" / "rendered" / "recording.toml").read_text(encoding="utf-8")
    return _page(
        "recording.toml",
        "One recording: a folder with this file. `ovines new` writes one to fill in, `ovines check` names the line "
        "that is wrong. Paths start at the file's folder; an unknown key is refused. A key without default has to be "
        "given where its section is; a section may be left out where nothing asks for it (a recording that enters at "
        "`motion.parquet` needs no cameras).",
        whole,
        "sample_data/rendered",
        RecordingFile,
    )


def scenario_page() -> str:
    """docs/reference/scenario-toml.md."""
    return _page(
        "scenario.toml",
        "What `ovines simulate` is to simulate. `ovines simulate --list` names the scenarios that come along; "
        "an unknown key is refused.",
        SCENARIO,
        "a shaken Host with floor friction",
        ScenarioFile,
    )


def law_page() -> str:
    """docs/reference/law-toml.md."""
    page = _page(
        "law.toml",
        "A written law: a formula for what no effect of the library has. `ovines diagnose` writes `law-1.toml` where "
        "it finds one; `laws` in [scenario.toml](scenario-toml.md) gives it to the simulator, `laws` in `[model]` of "
        "[recording.toml](recording-toml.md) to identification, comparison and diagnosis, and `ovines diagnose --law "
        "FILE` to the diagnosis, which then hold it. Its terms are added up, each a coefficient times factors.",
        LAW,
        "a force across the path that grows with speed and spin",
        LawFile,
    )
    lines = [page.rstrip(), "", "## Targets", "", "| target | unit of a term | acts on | stage | `x`, `y` |"]
    lines.append("|---|---|---|---|---|")
    own = {"": "", "angle": "angle (rad)", "axis": "axis of the mirror (rad)", "room": "place (m)", "host": "place (m)"}
    own |= {"body": "angle from the disk's own axis (rad)", "wind": "velocity of the air in the room (m/s)"}
    own |= {
        "time": "time to that frame in `x` (s; below 0: before)",
        "line": "offset (m), direction (rad)",
        "room_line": "offset (m), direction (rad)",
        "turning": "zero (rad), rate (rad/s)",
        "fading": "fading time (s) in `y`",
        "trailing": "fading length (m) in `y`",
        "swinging": "rate (rad/s) in `x`, fading time (s) in `y`",
        "spreading": "fading time (s; 0: never) in `x`, width (rad) in `y`",
        "camera": "number of the camera, from 0",
        "camera_axis": "number of the camera, from 0; direction in its picture, from u to v (rad)",
        "camera_angle": "number of the camera, from 0; direction in its picture, from u to v (rad)",
    }
    own |= {"marker": "number of the marker on its body, from 0; angle (rad)"}
    own |= {"body_marker": "number of the marker on its body, from 0; angle from the disk's own axis (rad)"}
    for name, target in TARGETS.items():
        lines.append(f"| `{name}` | {target.unit} | {target.meaning} | {target.stage} | {own[target.own]} |")
    lines += ["", "## Quantities", "", "| quantity | unit | meaning | `x`, `y` |", "|---|---|---|---|"]
    for name, quantity in QUANTITIES.items():
        place = own[quantity.own]
        lines.append(f"| `{name}` | {quantity.unit} | {quantity.meaning} | {place} |")
    return "\n".join(lines) + "\n"


LAW = """format = 1
name = "law 1 of a series"

[[terms]]
target = "across_velocity"
coefficient = 0.0226
unit = "1"
factors = [{quantity = "speed"}, {quantity = "spin"}]
"""


SCENARIO = """format = 1
name = "shaken Host with floor friction"

[nes]
radius_m = 0.01
mass_kg = 0.0246

[host]
radius_m = 0.05
motion = "driven"

[host.drive]
x = [{amplitude_m = 0.0164, frequency_hz = 11.0}]

[impact]
restitution = 0.72
wall_friction = 0.13
tangential_restitution = 0.49

[friction]
coefficient = 0.2

[initial]
nes = [0.03, -0.01, 0.1, 0.0, 0.0, 0.0]

[run]
duration_s = 1.0
"""


def _page(name: str, intro: str, example: str, of: str, model: type[Section]) -> str:
    lines = [
        f"# {name}",
        "",
        "Made by `python -m ovines.documentation.reference_pages` from the schema; a test compares.",
        "",
        intro,
    ]
    lines += ["", f"A whole file, {of}:", "", "```toml", example.rstrip(), "```"]
    for heading, section in sections(model):
        shown = [key.row() for key in keys(section)]
        if shown:
            said = re.sub(r"^`\[.*?\]`: ", "", _words(section.__doc__ or ""))
            said = "" if section is model else said[:1].upper() + said[1:]
            lines += ["", f"## {heading}", *(["", said] if said else []), "", *HEADER, *shown]
    return "\n".join(lines) + "\n"


def sections(
    model: type[Section], path: str = "", seen: set[type] | None = None
) -> Iterator[tuple[str, type[Section]]]:
    """Heading and model of each section, the file's own keys first, each model once."""
    seen = set() if seen is None else seen
    if model in seen:
        return
    seen.add(model)
    yield path or "At the top", model
    for name, field in model.model_fields.items():
        plain = path.strip("[]")
        for inner in models_of(field.annotation):
            below = f"{plain}.{name}" if plain else name
            yield from sections(inner, f"[[{below}]]" if "tuple" in str(field.annotation) else f"[{below}]", seen)


def models_of(annotation: Any) -> list[type[Section]]:
    """The sections that a field of this annotation holds."""
    if isinstance(annotation, type) and issubclass(annotation, Section):
        return [annotation]
    return [model for inner in getattr(annotation, "__args__", ()) for model in models_of(inner)]


def keys(model: type[Section]) -> list[Key]:
    """The keys of a section that hold values; sections below it have a heading of their own."""
    documented = docstrings(model)
    schema = model.model_json_schema()
    found = []
    for name, field in model.model_fields.items():
        if name not in documented:
            continue
        text = _words(documented[name])
        example = re.search(r" Example: `([^`]*)`\.$", text)
        if example is None:
            raise ValueError(f"{model.__name__}.{name}: no example at the end of its docstring")
        default = (
            ""
            if field.is_required()
            else "none"
            if field.default is None
            else _toml(field.get_default(call_default_factory=True))
        )
        kind = _kind(schema["properties"][name], schema.get("$defs", {}))
        found.append(Key(name, text[: example.start()].rstrip("."), kind, default, example[1]))
    return found


def docstrings(model: type) -> dict[str, str]:
    """The docstring below each of a class' fields, inherited ones included."""
    found: dict[str, str] = {}
    for one in reversed(model.__mro__):
        if one.__module__ in ("builtins", Section.__module__) or one.__module__.startswith("pydantic"):
            continue
        body = ast.parse(textwrap.dedent(inspect.getsource(one))).body[0]
        assert isinstance(body, ast.ClassDef)
        for field, after in zip(body.body, body.body[1:], strict=False):
            if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name) and isinstance(after, ast.Expr):
                found[field.target.id] = str(ast.literal_eval(after.value))
    return found


def _kind(schema: dict[str, Any], below: dict[str, Any]) -> str:
    """A JSON schema in words."""
    if "$ref" in schema:
        return "table"
    if "anyOf" in schema:
        return " or ".join(_kind(one, below) for one in schema["anyOf"] if one.get("type") != "null")
    if "const" in schema:
        return f"always {schema['const']}"
    if "enum" in schema:
        return ", ".join(f'`"{value}"`' for value in schema["enum"])
    if "prefixItems" in schema:
        kinds = [_kind(one, below) for one in schema["prefixItems"]]
        return f"{len(kinds)} × {kinds[0]}" if len(set(kinds)) == 1 else f"[{', '.join(kinds)}]"
    if schema["type"] == "array":
        return f"list of {_kind(schema['items'], below)}"
    word = {
        "number": "number",
        "integer": "whole number",
        "string": "text",
        "object": "tables",
        "boolean": "true or false",
    }[schema["type"]]
    bounds = {"exclusiveMinimum": "above", "minimum": "at least", "maximum": "at most"}
    said = [f"{words} {schema[bound]:g}" for bound, words in bounds.items() if bound in schema]
    return f"{word} {', '.join(said)}" if said else word


def _toml(value: Any) -> str:
    if isinstance(value, tuple):
        return f"`[{', '.join(_toml(one).strip('`') for one in value)}]`"
    return f"`{'{}' if value == {} else repr(value) if not isinstance(value, str) else chr(34) + value + chr(34)}`"


def _words(text: str) -> str:
    return " ".join(text.split()).replace("|", "/").replace("``", "`")


def board_page() -> str:
    """docs/reference/board-toml.md."""
    lines = [
        "# Board files",
        "",
        "Made by `python -m ovines.documentation.reference_pages`; a test holds it against the program.",
        "",
        "A calibration board: `[calibration] board` of [recording.toml](recording-toml.md) names one, by the name of "
        "a file in `calibration_boards/` or by a path. `ovines board` writes the file with the board to print "
        "([how to calibrate](../how-to/calibrate.md)). `calibration_boards/charuco_5x7_8mm.toml`:",
        "",
        "```toml",
        (ROOT / "calibration_boards" / "charuco_5x7_8mm.toml").read_text(encoding="utf-8").rstrip(),
        "```",
        "",
        *HEADER,
        *(key.row() for key in BOARD_KEYS),
        "",
        "One of each kind lies in `calibration_boards/`: "
        + ", ".join(f"`{path.name}`" for path in sorted((ROOT / "calibration_boards").glob("*.toml")))
        + ".",
        "",
        "A board that looks the same turned by half (a chessboard of two even or two odd counts, symmetric circles, "
        "asymmetric circles of an even number of rows) calibrates one camera; several are refused. Circle grids have "
        "to be seen whole, of ChArUco, ringed dots and tags a part serves.",
    ]
    return "\n".join(lines) + "\n"


BOARD_KEYS = (
    Key("name", "What messages call the board", "text", "the file's name", '"charuco_5x7_8mm"'),
    Key(
        "kind",
        "ChArUco board, chessboard, dots with three rings, OpenCV's circle grids, Kalibr's AprilGrid, or plain tags",
        '`"charuco"`, `"chessboard"`, `"dots"`, `"circles"`, `"asymmetric circles"`, `"aprilgrid"`, `"tags"`',
        '`"charuco"`',
        '"charuco"',
    ),
    Key("squares", "Columns and rows of squares, dots or tags", "2 × whole number at least 2", "", "[5, 7]"),
    Key(
        "square_size_m",
        "Edge of a square, or pitch of dots and tags (edge and gap); of asymmetric circles half the distance of two in "
        "a row; measure it on the print",
        "number above 0",
        "",
        "0.008",
    ),
    Key(
        "marker_size_m",
        "ChArUco and tags: edge of a marker, less than `square_size_m`",
        "number above 0",
        "ChArUco, tags: none",
        "0.006",
    ),
    Key(
        "dictionary",
        "ChArUco and tags: OpenCV's name of the markers' dictionary",
        "text",
        "ChArUco, tags: none",
        '"DICT_5X5_50"',
    ),
    Key("legacy_pattern", "ChArUco: printed in the pattern of OpenCV before 4.6", "true or false", "`false`", "false"),
    Key("inverted", "Printed white for black", "true or false", "`false`", "false"),
    Key(
        "rings",
        "Dots: the three ring-shaped ones as [column, row], rows counted downwards",
        "3 × [column, row]",
        "dots: none",
        "[[3, 2], [6, 2], [4, 4]]",
    ),
)


def examples(listed: tuple[Key, ...] | list[Key]) -> dict[str, Any]:
    """Each key's example as TOML reads it."""
    return {key.name: tomllib.loads(f"value = {key.example}")["value"] for key in listed}
