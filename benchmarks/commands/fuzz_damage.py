"""``fuzz_campaign.py``: damage to a file by what it is, and to the options of a command line."""

from __future__ import annotations

import argparse
import copy
import json
import math
import random
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from tests.house.damage.test_fuzz import ODD, damaged_bytes, damaged_text
from tests.house.damage.test_fuzz_commands import LEFT_OUT, NUMBERS, PLACES, WORDS

FACTORS = (1e3, 1e-3, -1.0, 0.0, 1e6, 1e-9, 1e300, 0.1, 10.0)
OTHERS = (float("nan"), float("inf"), -1, 0, 1, 2**63, 10**400, "", "x" * 300, "ä<b>\n", [], {}, True, [[[]]], "../x",
          [1, "a"], "\0", [float("nan")] * 3)  # fmt: skip


def leaves(tree: Any) -> list[tuple[Any, Any]]:
    """Every (container, key) below a tree of dicts and lists."""
    found: list[tuple[Any, Any]] = []
    pairs = tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ()
    for key, value in pairs:
        found += [(tree, key), *leaves(value)]
    return found


def damaged_tree(tree: Any, draw: random.Random) -> Any:
    """One value or key replaced, scaled, lost, doubled or added."""
    tree = copy.deepcopy(tree)
    places = leaves(tree)
    if not places:
        return tree
    holder, key = draw.choice(places)
    value, kind = holder[key], draw.randrange(5)
    if kind == 0 and isinstance(value, int | float) and not isinstance(value, bool):
        holder[key] = value * draw.choice(FACTORS)
    elif kind == 1:
        del holder[key]
    elif kind == 2 and isinstance(holder, list):
        holder.insert(key, copy.deepcopy(value))
    elif kind == 2:
        holder[f"{key}_2"] = copy.deepcopy(value)
    elif kind == 3:
        other, its = draw.choice(places)
        holder[key] = copy.deepcopy(other[its]) if not isinstance(other[its], dict | list) else draw.choice(OTHERS)
    else:
        holder[key] = draw.choice(OTHERS)
    return tree


def toml_of(value: Any) -> str:
    """A value in TOML, tables inline."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return "nan" if math.isnan(value) else repr(value)
    if isinstance(value, int):
        return str(value)
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(str(k))} = {toml_of(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml_of, value)) + "]"
    return json.dumps(str(value))


def damage(path: Path, draw: random.Random) -> None:
    """One file, by what it is."""
    content = path.read_bytes()
    if path.suffix == ".parquet" and draw.random() < 0.8:
        return damage_table(path, draw)
    text = None
    if path.suffix not in (".parquet", ".png", ".gif", ".svg"):
        text = content.decode("utf-8", "replace")
    try:
        if path.suffix == ".toml" and draw.random() < 0.6:
            tree = damaged_tree(tomllib.loads(text), draw)
            path.write_text("".join(f"{json.dumps(k)} = {toml_of(v)}\n" for k, v in tree.items()), "utf-8")
            return None
        if path.suffix == ".json" and draw.random() < 0.6:
            path.write_text(json.dumps(damaged_tree(json.loads(text), draw)), "utf-8")
            return None
    except (ValueError, TypeError, OverflowError, RecursionError):
        pass  # a number that no such file can hold
    if text is not None and path.suffix == ".csv" and draw.random() < 0.6:
        rows = [line.split(",") for line in text.split("\n")]
        for _ in range(draw.choice((1, 1, 3))):
            row = draw.choice(rows)
            row[draw.randrange(len(row))] = draw.choice((*ODD, *NUMBERS, "1e5", "2e18", "-3"))
        path.write_text("\n".join(map(",".join, rows)), "utf-8")
    elif text is not None:
        edits = [
            (draw.choice(("cut", "insert", "double", "value", "line")), draw.random(), draw.choice((*ODD, *NUMBERS)))
            for _ in range(draw.choice((1, 1, 2)))
        ]
        text = damaged_text(text, edits)
        if draw.random() < 0.05:
            at = draw.randrange(len(text) + 1)
            text = text[:at] + draw.choice(("[", '{"a":', "<a>", "a.", " ")) * draw.choice((100, 20_000)) + text[at:]
        path.write_text(text, "utf-8", "surrogatepass")
    else:
        edits = [
            (draw.choice(("set", "cut", "insert", "end", "zero")), draw.random(), draw.randbytes(draw.randrange(1, 9)))
            for _ in range(draw.choice((1, 2, 3)))
        ]
        path.write_bytes(damaged_bytes(content, edits))
    return None


def damage_table(path: Path, draw: random.Random) -> None:
    """Columns and rows of a table; its own metadata stay or go."""
    kept = pq.read_table(path)
    table = kept.to_pandas()
    for _ in range(draw.choice((1, 1, 2))):
        kind, column = draw.randrange(7), draw.choice(list(table.columns) or ["x"])
        row = draw.randrange(len(table)) if len(table) else 0
        if kind == 0 and pd.api.types.is_numeric_dtype(table[column]):
            with np.errstate(all="ignore"):
                table[column] = table[column].astype(float) * draw.choice(FACTORS)
        elif kind == 1 and pd.api.types.is_numeric_dtype(table[column]):
            table[column] = table[column].astype(float) + draw.choice((1e6, 1.7e9, 1e10, -1e3, 1e300))
        elif kind == 2 and len(table):
            table[column] = table[column].astype(object)
            table.loc[row, column] = draw.choice((None, float("nan"), float("inf"), 1e6, 1e8, 2e18, -1.0, 0.0, 1e300))
            if column in kept.column_names and pd.api.types.is_numeric_dtype(kept.column(column).to_pandas()):
                table[column] = pd.to_numeric(table[column])
        elif kind == 3:
            table = table.drop(columns=column)
        elif kind == 4:
            table = table.iloc[: draw.choice((0, 1, 2, 3, len(table) // 2))].reset_index(drop=True)
        elif kind == 5:
            table = pd.concat([table, table.iloc[row : row + draw.choice((1, 50))]], ignore_index=True)
        else:
            table[column] = draw.choice((0.0, 1.0, float("nan"), "a", None, True, 5))
        if not len(table.columns):
            break
    try:
        made = pa.Table.from_pandas(table, preserve_index=False)
    except (pa.ArrowInvalid, pa.ArrowTypeError, OverflowError):
        return
    if draw.random() < 0.3:
        made = made.replace_schema_metadata(kept.schema.metadata)
    pq.write_table(made, path)


def damage_line(words: list[str], parser: argparse.ArgumentParser, draw: random.Random) -> list[str]:
    """Options added, or a value replaced."""
    words = list(words)
    actions = [a for a in parser._actions if a.option_strings and not set(a.option_strings) & set(LEFT_OUT)]
    for _ in range(draw.choice((1, 1, 2))):
        if draw.random() < 0.3 and len(words) > 1:
            words[draw.randrange(1, len(words))] = draw.choice(PLACES + NUMBERS + WORDS)
        elif actions:
            action = draw.choice(actions)
            pool = PLACES if getattr(action.type, "__name__", "") == "Path" else WORDS + NUMBERS
            pool = (*map(str, action.choices), *pool[:3]) if action.choices else pool
            count = 0 if action.nargs == 0 else action.nargs if isinstance(action.nargs, int) else 1
            words += [draw.choice(action.option_strings), *(draw.choice(pool) for _ in range(count))]
    return words
