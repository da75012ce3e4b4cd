"""Reading a foreign file's text or values, refused with reasons; no format is recognised by its name alone."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np

from ovines.errors import InputError
from ovines.io.nesting import refuse_deep, refuse_deep_toml

MOST_BYTES = 2_000_000_000
MOST_PARAMETER_BYTES = 20_000_000  # a camera's file has some kilobytes, one with every view of its board some megabytes


def read_text(path: Path, expected: str, most_bytes: int = MOST_BYTES) -> str:
    """The file as UTF-8 (a byte order mark is dropped), or as Latin-1 where it is no UTF-8."""
    try:
        if path.stat().st_size > most_bytes:
            raise InputError(
                f"{path} has {path.stat().st_size} bytes",
                f"{expected} below {most_bytes / 1e6:g} MB",
                "check the path, or split the recording",
            )
        content = path.read_bytes()
    except FileNotFoundError:
        raise InputError(f"{path} is not there", expected, "check the path") from None
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}", expected, "check the path") from None
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("latin-1")


def read_json(path: Path, expected: str) -> dict[str, Any]:
    """A JSON object; NaN is taken as Python and VibrationTracker write it."""
    text = read_text(path, expected)
    refuse_deep(text[:MOST_PARAMETER_BYTES], path, expected)
    try:
        content = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: {str(error)[:200]}", expected, "write the file again") from None
    if not isinstance(content, dict):
        raise InputError(f"{path} holds a {type(content).__name__}", expected, "name the right file")
    return content


def read_values(path: Path) -> dict[str, Any]:
    """Names and values of a JSON, TOML, or OpenCV YAML or XML file; matrices of the last two are arrays."""
    expected = "a JSON, TOML, or OpenCV YAML or XML file of camera parameters"
    text = read_text(path, expected, MOST_PARAMETER_BYTES)
    if path.suffix.lower() == ".toml":
        refuse_deep_toml(text, path)
    else:
        refuse_deep(text, path, expected)
    start = text.lstrip()[:1]
    if path.suffix.lower() == ".toml":
        try:
            return tomllib.loads(text)
        except (ValueError, RecursionError) as error:
            raise InputError(f"{path}: {str(error)[:200]}", expected, "write the file again") from None
    if start == "{" and not text.lstrip().startswith("{%"):
        return {name: _matrix(value) for name, value in read_json(path, expected).items()}
    return _opencv_storage(path, text, expected)


def _matrix(value: Any) -> Any:
    """OpenCV's matrices are maps of rows and cols, or sizes, and data; whatever else is left as it is."""
    if not isinstance(value, dict) or "data" not in value:
        return value
    shape = [value["rows"], value["cols"]] if {"rows", "cols"} <= set(value) else value.get("sizes", -1)
    try:
        return np.asarray(value["data"], float).reshape(np.asarray(shape, int))
    except (TypeError, ValueError, OverflowError):
        return value


def _opencv_storage(path: Path, text: str, expected: str) -> dict[str, Any]:
    import cv2

    if not text.lstrip().startswith(("%YAML", "<?xml", "---")):
        # plain YAML lacks the line by which OpenCV knows its own, and may not indent a list, which OpenCV wants
        text = "%YAML:1.0\n---\n" + re.sub(r"(?m)^( *)- ", r"\1  - ", text)
    level = cv2.utils.logging.getLogLevel()
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)  # its complaint stands in ours
    try:
        storage = cv2.FileStorage(text, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
        root = storage.root()
        found = {name: _value(root.getNode(name)) for name in root.keys()}  # noqa: SIM118  (no dictionary)
        storage.release()
    except (cv2.error, SystemError, RecursionError, ValueError, UnicodeError) as error:
        reason = str(error).strip().split("\n")[0][:200]
        raise InputError(f"{path}: {reason}", expected, "write the file again, e.g. with cv2.FileStorage") from None
    finally:
        cv2.utils.logging.setLogLevel(level)
    return found


def _value(node: Any) -> Any:
    if node.isMap():
        return _matrix({name: _value(node.getNode(name)) for name in node.keys()})  # noqa: SIM118
    if node.isSeq():
        return [_value(node.at(i)) for i in range(node.size())]
    return node.string() if node.isString() else node.real()
