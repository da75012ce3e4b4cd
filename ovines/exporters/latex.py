"""LaTeX tables of the identified parameters, for a thesis or a paper (package booktabs)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd

from analysis.report.numbers import value_with_digits
from analysis.report.parameters import PRINCIPAL, as_text, parameter_rows, quantity
from ovines.io.atomic_write import write_text_whole

SYMBOLS = {"ε": r"\varepsilon", "μ_c": r"\mu_c", "μ_s": r"\mu_s", "β₀": r"\beta_0", "σ(ε)": r"\sigma(\varepsilon)",
           "dε/dv": r"\mathrm{d}\varepsilon/\mathrm{d}v", "R_c": "R_c", "f": "f"}  # fmt: skip
SIGNS = {"±": r"\pm", "≥": r"\ge", "≤": r"\le", "−": "-", "×": r"\times", "µ": r"\mathrm{\mu}", "²": "^2"}
POWERS = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
SPECIAL = {one: f"\\{one}" for one in "&%$#_{}"} | {
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
}


def write_parameters(identification: pd.DataFrame, path: Path) -> None:
    """A row per parameter: name, symbol, value with sd, 90 % interval, number of impacts."""
    rows = [
        (words(title), symbol(sign), numbers(value), numbers(ends), numbers(impacts))
        for title, sign, value, ends, impacts, *_ in parameter_rows(identification, None)
    ]
    write_text_whole(
        _table("llrrr", ("parameter", "symbol", "value $\\pm$ sd", "90\\,\\% interval", "impacts"), rows), path
    )


def write_tests(tests: Mapping[str, pd.DataFrame], path: Path) -> None:
    """A row per recording with the principal parameters, the sd of the last digits in parentheses."""
    rows = []
    for name, table in tests.items():
        by_name = {row["parameter"]: row for _, row in table.iterrows()}
        cells = ["--" if one not in by_name else _cell(by_name[one]) for one in PRINCIPAL]
        rows.append((words(name), *cells))
    head = ("test", *(symbol(quantity(one).symbol) for one in PRINCIPAL))
    write_text_whole(_table("l" + "r" * len(PRINCIPAL), head, rows), path)


def _cell(row: pd.Series) -> str:
    if pd.isna(row["value"]):
        return numbers(as_text(row).removesuffix(" (bound)"))
    return numbers(value_with_digits(float(row["value"]), float(row["sd"])))


def words(text: str) -> str:
    """Plain text, its special signs escaped."""
    return "".join(SPECIAL.get(sign, sign) for sign in text)


def symbol(text: str) -> str:
    """A symbol of the reports as mathematics."""
    return f"${SYMBOLS[text]}$" if text in SYMBOLS else words(text)


def numbers(text: str) -> str:
    """A number of the reports with its sd and unit as mathematics; words stay words."""
    if not any(sign.isdigit() for sign in text):
        return words(text.replace("–", "--"))
    parts = []
    for part in text.replace(" (bound)", "").split(" "):
        raised = part.rstrip("⁻⁰¹²³⁴⁵⁶⁷⁸⁹") if part.startswith("10") else part
        if raised != part:
            parts.append(f"{raised}^{{{part[len(raised) :].translate(POWERS)}}}")
        elif part == "to":
            parts.append(r"\ldots")
        elif part[:1].isalpha() or part[:1] == "µ":
            unit = "".join(SIGNS.get(sign, sign) for sign in part)
            parts.append(rf"\,\mathrm{{{unit}}}")
        else:
            parts.append("".join(SIGNS.get(sign, sign) for sign in part))
    return f"${' '.join(parts)}$"


def _table(columns: str, head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [" & ".join(row) + r" \\" for row in rows]
    return "\n".join(
        [
            "% \\usepackage{booktabs}",
            f"\\begin{{tabular}}{{{columns}}}",
            "\\toprule",
            " & ".join(head) + r" \\",
            "\\midrule",
            *lines,
            "\\bottomrule",
            "\\end{tabular}",
            "",
        ]
    )
