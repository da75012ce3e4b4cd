"""A board of squares or tags true to scale on a page, as SVG and PDF, with a ruler to check the print.

Both are lists of rectangles and a few words, so they are written here and need no drawing library.  Lengths in mm.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vision.calibration.targets.boards import Board, printed_rectangles

PAGES_MM = {
    "A4": (210.0, 297.0),
    "A3": (297.0, 420.0),
    "A2": (420.0, 594.0),
    "A1": (594.0, 841.0),
    "A0": (841.0, 1189.0),
}
BORDER_MM, RULER_MM, POINTS_PER_MM = 12.0, 20.0, 72 / 25.4
LONGEST_RULER_MM = 200
DIGIT_EM = 0.556  # width of a Helvetica digit, in sizes of the type


@dataclass(frozen=True)
class Drawing:
    """Black rectangles (x, y, width, height) and words (x, y, size, text), y downwards from the page's top left
    corner.
    """

    page_mm: tuple[float, float]
    rectangles: list[tuple[float, float, float, float]]
    words: list[tuple[float, float, float, str]]


def draw(board: Board) -> Drawing:
    """The board on the smallest A-page that holds it, or on a page of its own size when none does."""
    x, y, _ = printed_rectangles(board)
    width, height = 1e3 * np.ptp(x), 1e3 * np.ptp(y)
    need = width + 2 * BORDER_MM, height + 2 * BORDER_MM + RULER_MM
    page = next((size for size in PAGES_MM.values() if need[0] <= size[0] and need[1] <= size[1]), need)
    left, top = 0.5 * (page[0] - width), BORDER_MM
    ruler_mm = int(min(LONGEST_RULER_MM, (page[0] - 2 * BORDER_MM) // 10 * 10))
    ruler_left, ruler_top = 0.5 * (page[0] - ruler_mm), page[1] - BORDER_MM - 8
    rectangles = _black(board, left, top) + _ruler(ruler_left, ruler_top, ruler_mm)
    words = [
        (ruler_left + 10 * n - 0.5 * DIGIT_EM * 2.5 * len(str(10 * n)), ruler_top + 7.0, 2.5, str(10 * n))
        for n in range(ruler_mm // 10 + 1)
    ]
    words.append((ruler_left, ruler_top + 11.0, 2.8, _caption(board, ruler_mm)))
    return Drawing(page, rectangles, words)


def _caption(board: Board, ruler_mm: int) -> str:
    prints = [word for word, said in (("legacy pattern", board.legacy_pattern), ("inverted", board.inverted)) if said]
    each = "pitch" if board.of_tags else "square"
    said = [f"{board.squares[0]} x {board.squares[1]}", f"{each} {1e3 * board.square_size_m:g} mm"]
    if board.kind != "chessboard":
        said += [f"marker {1e3 * board.marker_size_m:g} mm", board.dictionary]
    return f"{board.name}: {', '.join(said + prints)}. Print at 100 %: the ruler is {ruler_mm} mm."


def _black(board: Board, left: float, top: float) -> list[tuple[float, float, float, float]]:
    """Runs of black cells, one rectangle a run; runs below each other of one width become one."""
    x, y, black = printed_rectangles(board)
    x, y = left + 1e3 * (x - x[0]), top + 1e3 * (y - y[0])
    found: list[tuple[float, float, float, float]] = []
    open_runs: dict[tuple[int, int], int] = {}
    for row in range(len(black) + 1):
        edges = (
            np.flatnonzero(np.diff(np.concatenate([[False], black[row], [False]]).astype(int)))
            if row < len(black)
            else np.array([], int)
        )
        runs = {(int(a), int(b)) for a, b in edges.reshape(-1, 2)}
        for run in [run for run in open_runs if run not in runs]:
            first = open_runs.pop(run)
            found.append((x[run[0]], y[first], x[run[1]] - x[run[0]], y[row] - y[first]))
        for run in runs:
            open_runs.setdefault(run, row)
    return found


def _ruler(left: float, top: float, length_mm: int) -> list[tuple[float, float, float, float]]:
    line = 0.15
    ticks = [
        (left + mm - line / 2, top, line, 4.0 if mm % 10 == 0 else 3.0 if mm % 5 == 0 else 2.0)
        for mm in range(length_mm + 1)
    ]
    return [(left, top - line / 2, float(length_mm), line), *ticks]


def as_svg(drawing: Drawing) -> str:
    """SVG in millimetres."""
    width, height = drawing.page_mm
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:g}mm" height="{height:g}mm" viewBox="0 0 {width:g} '
        f'{height:g}">',
        f'<rect width="{width:g}" height="{height:g}" fill="white"/>',
        '<g fill="black" shape-rendering="crispEdges">',
    ]
    lines += [f'<rect x="{x:.5f}" y="{y:.5f}" width="{w:.5f}" height="{h:.5f}"/>' for x, y, w, h in drawing.rectangles]
    lines += [
        f'<text x="{x:.3f}" y="{y:.3f}" font-family="Helvetica, Arial, sans-serif" '
        f'font-size="{size:g}">{_escaped(text)}</text>'
        for x, y, size, text in drawing.words
    ]
    return "\n".join([*lines, "</g>", "</svg>", ""])


def _escaped(text: str) -> str:
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")


def as_pdf(drawing: Drawing) -> bytes:
    """One page of PDF 1.4; a unit is 1/72 inch and y goes upwards there, so the page's own matrix turns it into mm."""
    width, height = drawing.page_mm
    # print scaling "None" asks viewers not to fit the page
    scale = f"{POINTS_PER_MM:.8f} 0 0 {POINTS_PER_MM:.8f} 0 0 cm"
    drawn = [f"{x:.5f} {height - y - h:.5f} {w:.5f} {h:.5f} re" for x, y, w, h in drawing.rectangles]
    said = [
        f"BT /F1 {size:g} Tf {x:.3f} {height - y:.3f} Td ({_pdf_text(text)}) Tj ET"
        for x, y, size, text in drawing.words
    ]
    content = "\n".join([scale, "0 g", *drawn, "f", *said]).encode("latin-1", "replace")
    box = f"0 0 {width * POINTS_PER_MM:.4f} {height * POINTS_PER_MM:.4f}"
    objects = [
        b"<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>",
        b"<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
        f"<< /Type /Page /Parent 2 0 R /MediaBox [{box}] /Contents 4 0 R ".encode()
        + b"/Resources << /Font << /F1 5 0 R >> >> >>",
        b"<< /Length %d >>\nstream\n%s\nendstream" % (len(content), content),
        b"<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica >>",
    ]
    out, places = b"%PDF-1.4\n", []
    for number, body in enumerate(objects, 1):
        places.append(len(out))
        out += b"%d 0 obj\n%s\nendobj\n" % (number, body)
    start = len(out)
    out += b"xref\n0 %d\n0000000000 65535 f \n" % (len(objects) + 1) + b"".join(
        b"%010d 00000 n \n" % place for place in places
    )
    return out + b"trailer\n<< /Size %d /Root 1 0 R >>\nstartxref\n%d\n%%%%EOF\n" % (len(objects) + 1, start)


def _pdf_text(text: str) -> str:
    return text.replace("\\", "\\\\").replace("(", "\\(").replace(")", "\\)")


def as_toml(board: Board) -> str:
    """The board's TOML, as :func:`vision.calibration.targets.boards.read_board` takes it."""
    lines = [
        f'kind = "{board.kind}"',
        f"squares = [{board.squares[0]}, {board.squares[1]}]",
        f"square_size_m = {board.square_size_m:g}",
    ]
    if board.dictionary:
        lines += [f"marker_size_m = {board.marker_size_m:g}", f'dictionary = "{board.dictionary}"']
    if board.kind == "charuco":
        lines.append(f"legacy_pattern = {str(board.legacy_pattern).lower()}")
    if board.rings:
        lines.append(f"rings = {[list(ring) for ring in board.rings]}")
    return "\n".join([*lines, f"inverted = {str(board.inverted).lower()}", ""])
