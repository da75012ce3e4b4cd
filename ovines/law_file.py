"""law-1.toml <-> `ovines.core.laws`: a written law as a file that the simulator and the diagnosis read."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

from pydantic import Field

from ovines.core.laws.formula import as_text
from ovines.core.laws.terms import Factor, Term, WrittenLaw
from ovines.core.refusal import ScenarioError
from ovines.errors import InputError
from ovines.io.toml_input import Section, read_toml

MARK = "# law written by ovines"  # whose file it is


class FactorEntry(Section):
    """A function of a quantity: `power` q^n, `absolute_power` |q|^n, `cosine` cos(n q / s), `sine`, `exponential`
    exp(-q / s), `gaussian` exp(-(q / s)^2 / 2), `below` (1 where q < s), `sign`, `pulses` (a Gaussian of width n about
    every multiple of the period s), `gates` (1 over a width n about every multiple of the period s), `above`
    max(q - s, 0)^n, `tanh` tanh(q / s), `decay` exp(-|q| / s), `rational` 1 / (1 + |q / s|^n), `within` (1 where
    |q| < s), `sawtooth` (of an angle n q: sign / 2 - n q / (2 pi), a step at 0; of others at every multiple of s),
    `rising` 1 - exp(-|q| / s), `beyond` (1 where q >= s)."""

    quantity: str
    """What it follows ([quantities](#quantities)). Example: `"radius"`."""
    function: str = "power"
    """Which function of it. Example: `"exponential"`."""
    order: float = 1.0
    """n: power, multiple of an angle, or width of pulses and gates. Example: `2.0`."""
    scale: float = 1.0
    """s, in the quantity's unit; period of pulses and gates, threshold of `below`, `beyond` and `above`.
    Example: `0.004`."""
    x: float = 0.0
    """Place (m), wind (m/s), angle (rad), instant (s) or value from which q counts. Example: `0.0`."""
    y: float = 0.0
    """Second coordinate of a place (m) or a wind (m/s); direction of a line (rad). Example: `0.0`."""


class TermEntry(Section):
    """``[[terms]]``: a coefficient times factors, in a direction or on a number of the contact law."""

    target: str
    """What it acts on ([targets](#targets)). Example: `"outwards"`."""
    coefficient: float
    """Size. Example: `-13.3`."""
    coefficient_sd: float | None = None
    """Its standard deviation; used by nothing. Example: `0.2`."""
    unit: str | None = None
    """Unit of the coefficient; checked. Example: `"1/s^2"`."""
    x: float = 0.0
    """The target's own angle (rad), place (m), wind (m/s), or number of a camera or a marker. Example: `0.0`."""
    y: float = 0.0
    """Second coordinate of the place (m) or the wind (m/s); direction of a marker (rad). Example: `0.0`."""
    factors: tuple[FactorEntry, ...] = ()
    """Tables of the keys above. Example: `[{quantity = "radius"}]`."""


class LawFile(Section):
    """The whole file."""

    format: Literal[1]
    """Version of this format, always 1. Example: `1`."""
    name: str = "law"
    """What pages call it. Example: `"law 1 of series-a"`."""
    formula: str | None = None
    """The law in a line, for people; the terms count. Example: `"acceleration += -13.3 1/s^2 * radius * outwards"`."""
    terms: tuple[TermEntry, ...] = Field(min_length=1)


def read_law(path: str | Path) -> WrittenLaw:
    """Read and check ``path``; `InputError` for what is no law, and for a unit that the formula does not have."""
    path = Path(path)
    content = read_toml(path, LawFile)
    try:
        law = WrittenLaw(tuple(_term(entry) for entry in content.terms))
    except ScenarioError as error:
        raise InputError(f"{path}: {error.found}", error.expected, error.do) from None
    for number, (entry, term) in enumerate(zip(content.terms, law.terms, strict=True), 1):
        if entry.unit is not None and entry.unit != term.unit:
            raise InputError(
                f"{path}: unit {entry.unit!r} of term {number}",
                f"{term.unit!r}, which makes the product one of {term.target}",
                "correct the unit, or the factors",
            )
    return law


def _term(entry: TermEntry) -> Term:
    factors = tuple(Factor(one.quantity, one.function, one.order, one.scale, one.x, one.y) for one in entry.factors)
    sd = math.nan if entry.coefficient_sd is None else entry.coefficient_sd
    return Term(entry.target, entry.coefficient, factors, entry.x, entry.y, sd)


def law_text(law: WrittenLaw, name: str, said: Sequence[str] = ()) -> str:
    """The file of a law; ``said``: lines of comment."""
    lines = [MARK, *(f"# {line}" for line in said), "format = 1", f"name = {json.dumps(name)}"]
    lines.append(f"formula = {json.dumps(as_text(law))}")
    for term in law.terms:
        lines += ["", "[[terms]]", f'target = "{term.target}"', f"coefficient = {term.coefficient:.8g}"]
        if math.isfinite(term.sd):
            lines.append(f"coefficient_sd = {term.sd:.3g}")
        lines.append(f'unit = "{term.unit}"')
        lines += [f"{name} = {value:.8g}" for name, value in (("x", term.x), ("y", term.y)) if value]
        if term.factors:
            lines.append("factors = [" + ", ".join(_factor_text(one) for one in term.factors) + "]")
    return "\n".join(_as_floats(line) for line in lines) + "\n"


def _factor_text(one: Factor) -> str:
    parts = [f'quantity = "{one.quantity}"']
    if one.function != "power":
        parts.append(f'function = "{one.function}"')
    for name, usual in (("order", 1.0), ("scale", 1.0), ("x", 0.0), ("y", 0.0)):
        value = getattr(one, name)
        if value != usual:
            parts.append(f"{name} = {_float(value)}")
    return "{" + ", ".join(parts) + "}"


def _float(value: float) -> str:
    """A number that TOML reads as a float."""
    said = f"{value:.8g}"
    return said if any(c in said for c in ".en") else said + ".0"


def _as_floats(line: str) -> str:
    key, _, value = line.partition(" = ")
    if key in ("coefficient", "coefficient_sd", "x", "y"):
        return f"{key} = {_float(float(value))}"
    return line
