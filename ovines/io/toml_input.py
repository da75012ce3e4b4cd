"""A TOML file against its pydantic model; every disagreement with file, line and key."""

from __future__ import annotations

import difflib
import re
import tomllib
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

from ovines.errors import InputError
from ovines.io.nesting import refuse_deep_toml

MAX_BYTES = 10_000_000  # a settings file is some kilobytes; more is another kind of file


class Section(BaseModel):
    """Base of every TOML section: no unknown key, no silent conversion, no NaN, never changed."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)


Model = TypeVar("Model", bound=Section)


def read_toml(path: Path, model: type[Model]) -> Model:
    """Read ``path`` as ``model``; `InputError` names file, line and key of the first thing that is wrong."""
    text = _read_text(path)
    refuse_deep_toml(text, path)
    try:
        content = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, ValueError, RecursionError) as error:
        raise InputError(f"{path}: {_first_line(error)}", "a TOML file", "correct the file at that place") from None
    try:
        return model.model_validate(_tuples(content))
    except ValidationError as error:
        raise _as_input_error(error, model, text, path) from None
    except (OverflowError, RecursionError) as error:
        raise InputError(f"{path}: {_first_line(error)}", "numbers of usual size", "correct the number") from None


def _read_text(path: Path) -> str:
    try:
        if path.stat().st_size > MAX_BYTES:
            raise InputError(
                f"{path} has {path.stat().st_size} bytes", "a TOML file of some kilobytes", "check the path"
            )
        return path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise InputError(f"{path} is not there", f"a file {path.name}", "check the path, or write the file") from None
    except OSError as error:
        raise InputError(
            f"{path}: {error.strerror or error}", "a file that can be read", "check the path and its permissions"
        ) from None
    except ValueError as error:
        raise InputError(f"{path}: {_first_line(error)}", "a readable UTF-8 text file", "write it as UTF-8") from None


def _tuples(value: Any) -> Any:
    """Lists to tuples: the models are frozen through and through."""
    if isinstance(value, list):
        return tuple(_tuples(item) for item in value)
    if isinstance(value, dict):
        return {key: _tuples(item) for key, item in value.items()}
    return value


def _as_input_error(error: ValidationError, model: type[BaseModel], text: str, path: Path) -> InputError:
    """A model's own check says ``found | expected``, and ``| key`` (dotted, below its section) where one line is at
    fault.
    """
    first = error.errors()[0]
    location = first["loc"]
    key = _key(location)
    reason = str(first["msg"]).removeprefix("Value error, ").removeprefix("Input should be ")
    found, expected, at_fault = (*reason.split(" | "), "", "")[:3]
    below = tuple(int(part) if part.isdigit() else part for part in at_fault.split(".") if part)
    line = line_of(text, (*location, *below) if first["type"] == "value_error" else location)
    where = f"{path}{f', line {line}' if line else ''}"
    more = f" (and {error.error_count() - 1} more)" if error.error_count() > 1 else ""
    if first["type"] == "extra_forbidden":
        known = sorted(_fields(model, location[:-1]))
        near = difflib.get_close_matches(str(location[-1]), known, n=1, cutoff=0.5)
        do = f"did you mean '{near[0]}'?" if near else "remove the key"
        return InputError(f"{where}: unknown key '{key}'{more}", f"one of {', '.join(known)}", do)
    if first["type"] == "missing":
        return InputError(f"{where}: no key '{key}'{more}", f"a value for '{key}'", f"add '{location[-1]} = ...'")
    if first["type"] == "value_error":
        at = f" '{key}':" if key else ""
        return InputError(f"{where}:{at} {found}{more}", expected or "values that fit together", "correct the file")
    shown = repr(first["input"])
    shown = shown if len(shown) <= 80 else shown[:77] + "..."
    return InputError(f"{where}: '{key}' is {shown}{more}", f"{reason}", f"correct '{key}'")


def _key(location: tuple[int | str, ...]) -> str:
    parts = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in location)
    return parts.lstrip(".")


def _fields(model: type[BaseModel], location: tuple[int | str, ...]) -> set[str]:
    """Names that may stand at ``location``, found by walking the models' annotations."""
    found = [model]
    for part in location:
        if isinstance(part, str):
            found = [
                inner
                for one in found
                if part in one.model_fields
                for inner in _models(one.model_fields[part].annotation)
            ]
    return {name for one in found for name in one.model_fields}


def _models(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [model for inner in getattr(annotation, "__args__", ()) for model in _models(inner)]


def line_of(text: str, location: tuple[int | str, ...]) -> int | None:
    """Line (from 1) where the key at ``location`` is written, or the header of the section that lacks it."""
    header: tuple[int | str, ...] = ()
    counts: dict[str, int] = {}
    best: tuple[int, int] | None = None
    for number, line in enumerate(text.splitlines(), 1):
        if found := re.match(r"\s*\[\[\s*([^\]]+?)\s*\]\]", line):
            name = found[1]
            header = (*name.split("."), counts.get(name, 0))
            counts[name] = counts.get(name, 0) + 1
            here = header
        elif found := re.match(r"\s*\[\s*([\w.\"' -]+?)\s*\]\s*(#.*)?$", line):
            here = header = tuple(part.strip().strip("\"'") for part in found[1].split("."))
        elif found := re.match(r"\s*([\w\"'.-]+)\s*=", line):
            here = (*header, *(part.strip("\"'") for part in found[1].split(".")))
        else:
            continue
        if location[: len(here)] == here and (best is None or len(here) > best[0]):
            best = (len(here), number)
    return best[1] if best else None


def _first_line(error: Exception) -> str:
    return (str(error) or type(error).__name__).split("\n")[0][:200]
