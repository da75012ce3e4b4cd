"""docs/chain.md from the declaration of the stages: ``python -m ovines.documentation.stages_page``."""

from __future__ import annotations

from pathlib import Path

import ovines
from ovines.io.atomic_write import write_text_whole
from ovines.pipeline.stages import STAGES
from ovines.tables import TABLES

PAGE = Path(ovines.__file__).resolve().parent.parent / "docs" / "chain.md"


def chain_page() -> str:
    """The page: stages with what they read and write, then every table with its columns."""
    lines = [
        "# The chain",
        "",
        "Made by `python -m ovines.documentation.stages_page` from `ovines/pipeline/stages.py` and "
        "`ovines/tables/declared.py`; a test compares.",
        "",
        "| command | what | reads | writes | runs again when these sections of recording.toml change |",
        "|---|---|---|---|---|",
    ]
    for one in STAGES:
        reads = ", ".join(one.reads) + (f"; where there: {', '.join(one.may_read)}" if one.may_read else "")
        lines.append(
            f"| `ovines {one.name}` | {one.help} | {reads} | {', '.join(one.writes)} | {', '.join(one.sections)} |"
        )
    lines += [
        "",
        "A stage also runs again when the bytes of what it reads, or the code it runs, have changed, or an output is "
        "missing.",
        "",
        "## The tables",
        "",
        "Parquet, SI units, a missing value is null. *optional*: the column may be absent; *or null*: the value may "
        "be missing.",
    ]
    for table in TABLES.values():
        lines += [
            "",
            f"### {table.name}.parquet",
            "",
            f"One row per {table.row}.",
            "",
            "| column | type | unit | meaning |",
        ]
        lines.append("|---|---|---|---|")
        for column in table.columns:
            kind = column.type + (", or null" if column.nullable else "") + ("" if column.required else ", optional")
            lines.append(f"| `{column.name}` | {kind} | {column.unit} | {column.meaning} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    write_text_whole(chain_page(), PAGE)
