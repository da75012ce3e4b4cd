"""docs/figures/house.svg, the rooms of the code, from the rows that tests/house/test_layers.py declares.

``python -m ovines.documentation.house_picture`` draws it.
"""

from __future__ import annotations

import ast
from pathlib import Path

import ovines
from ovines.io.atomic_write import write_text_whole

ROOT = Path(ovines.__file__).resolve().parent.parent
DECLARED = ROOT / "tests" / "house" / "test_layers.py"
PICTURE = ROOT / "docs" / "figures" / "house.svg"
WINGS = {  # package: colour; the longest name that a room's begins with is its wing
    "vision": "#d7e8f7",
    "ovines": "#e6e6e6",
    "ovines.core": "#d9efdc",
    "analysis": "#fde5cc",
    "analysis.gap": "#f8d3d3",
    "analysis.blind": "#e8dcf3",
}
WIDTH_PX, BOX_PX, GAP_PX, HEAD_PX = 148, 20, 4, 34


def rooms() -> list[list[str]]:
    """The rooms row by row, from the ground up."""
    for node in ast.parse(DECLARED.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.Assign) and getattr(node.targets[0], "id", "") == "ROWS":
            return [row.split() for row in str(ast.literal_eval(node.value)).strip().splitlines()]
    raise ValueError(f"{DECLARED} declares no ROWS")


def wing(room: str) -> str:
    """The wing that a room is in."""
    return max((one for one in WINGS if room == one or room.startswith(f"{one}.")), key=len)


def house() -> str:
    """The picture as SVG: a column per wing, a line per row, the roof on top."""
    width, y = len(WINGS) * WIDTH_PX + GAP_PX, HEAD_PX
    drawn = [
        f'<text x="{(k + 0.5) * WIDTH_PX}" y="22" text-anchor="middle" font-weight="bold" font-size="14">{name}</text>'
        for k, name in enumerate(WINGS)
    ]
    for row in reversed(rooms()):
        cells = [[room for room in row if wing(room) == name] for name in WINGS]
        height = max(map(len, cells)) * (BOX_PX + GAP_PX) + GAP_PX
        drawn.append(f'<line x1="0" y1="{y}" x2="{width}" y2="{y}" stroke="#bbbbbb"/>')
        for k, (name, cell) in enumerate(zip(WINGS, cells, strict=True)):
            for n, room in enumerate(cell):
                x, top = k * WIDTH_PX + GAP_PX, y + GAP_PX + n * (BOX_PX + GAP_PX)
                drawn += [
                    f'<rect x="{x}" y="{top}" width="{WIDTH_PX - GAP_PX}" height="{BOX_PX}" rx="3" '
                    f'fill="{WINGS[name]}"/>',
                    f'<text x="{x + 6}" y="{top + 14}">{room.removeprefix(name).lstrip(".") or name}</text>',
                ]
        y += height
    return "\n".join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {y}" width="{width}" height="{y}" '
            'font-family="sans-serif" font-size="12" fill="#222222">',
            '<rect width="100%" height="100%" fill="white"/>',
            *drawn,
            "</svg>",
            "",
        ]
    )


if __name__ == "__main__":
    write_text_whole(house(), PICTURE)
