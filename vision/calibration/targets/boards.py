"""Calibration boards: what is printed on them and where their points lie.

A board's own frame is OpenCV's: origin at the outer corner of the first square (of a dot grid: at its
first dot, of tags at the first one's outer corner), x along the columns, y down the rows, z into the paper.
The world that one view of it
defines is that frame turned to look at the cameras: ``X_world = diag(1, -1, -1) X_board``.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from ovines.errors import InputError

Array = NDArray[np.float64]
FOLDER = Path(__file__).resolve().parents[3] / "calibration_boards"
KINDS = ("charuco", "chessboard", "dots", "circles", "asymmetric circles", "aprilgrid", "tags")
DICTIONARIES = tuple(sorted(name for name in dir(cv2.aruco) if re.fullmatch(r"DICT_\w+", name)))
MOST_SQUARES, MOST_M = 1000, 100.0  # per side, and lengths: more is a slip
WORLD_FROM_BOARD = np.diag([1.0, -1.0, -1.0])


@dataclass(frozen=True)
class Board:
    """A flat calibration board.

    ``squares``: (columns, rows) of squares, dots or tags; ``square_size_m``: edge of a square, or pitch of dots and
    tags.  Of asymmetric circles, OpenCV's: a row's circles lie two pitches apart, every second row one pitch further.
    ``marker_size_m``, ``dictionary``: ChArUco and tags; ``legacy_pattern``: ChArUco.  ``inverted``: printed white for
    black.
    ``rings``: dots only, the three ring-shaped dots as (column, row), rows counted downwards, in any order.
    """

    name: str
    squares: tuple[int, int]
    square_size_m: float
    marker_size_m: float = 0.0
    dictionary: str = ""
    legacy_pattern: bool = False
    inverted: bool = False
    kind: str = "charuco"
    rings: tuple[tuple[int, int], ...] = ()

    @property
    def size_m(self) -> tuple[float, float]:
        """Width and height of all squares [m]; of tags from the first one's outer corner to the last one's."""
        less = self.square_size_m - self.marker_size_m if self.of_tags else 0.0
        wide = 2 if self.kind == "asymmetric circles" else 1
        return wide * self.squares[0] * self.square_size_m - less, self.squares[1] * self.square_size_m - less

    @property
    def of_dots(self) -> bool:
        """Whether its points are centres of dots."""
        return self.kind in ("dots", "circles", "asymmetric circles")

    @property
    def of_tags(self) -> bool:
        """Whether its points are corners of tags that stand apart."""
        return self.kind in ("aprilgrid", "tags")

    @property
    def border_bits(self) -> int:
        """Width of a tag's black frame, in bits: Kalibr's is twice as wide."""
        return 2 if self.kind == "aprilgrid" else 1

    @property
    def ends_alike(self) -> bool:
        """Whether the board looks the same turned by half: nothing on it then shows which corner is the first."""
        if self.kind == "asymmetric circles":
            return self.squares[1] % 2 == 0
        return self.kind == "circles" or (self.kind == "chessboard" and sum(self.squares) % 2 == 0)

    def points_m(self) -> Array:
        """Every point a view can give, in its own numbering, (N, 3): inner corners or dots, row by row; of tags, four
        each, clockwise from the top left.
        """
        columns, rows = self.squares
        if self.of_tags:
            x, y = np.meshgrid(np.arange(columns), np.arange(rows))
            corner = self.square_size_m * np.stack([x.ravel(), y.ravel()], -1)[:, None]
            tag = self.marker_size_m * np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
            flat = (corner + tag).reshape(-1, 2)
            return np.column_stack([flat, np.zeros(len(flat))])
        if self.kind == "asymmetric circles":
            x, y = np.meshgrid(np.arange(columns), np.arange(rows))
            flat = self.square_size_m * np.stack([(2 * x + y % 2).ravel(), y.ravel()], -1)
            return np.column_stack([flat, np.zeros(len(flat))])
        first = 0 if self.of_dots else 1
        x, y = np.meshgrid(np.arange(first, columns), np.arange(first, rows))
        return self.square_size_m * np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], -1).astype(float)

    def opencv(self) -> cv2.aruco.CharucoBoard:
        """The same ChArUco board for OpenCV (lengths in metres)."""
        dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, self.dictionary))
        board = cv2.aruco.CharucoBoard(self.squares, self.square_size_m, self.marker_size_m, dictionary)
        board.setLegacyPattern(self.legacy_pattern)
        return board

    def opencv_layout(self) -> dict[int, Array]:
        """Corners (4, 2) of each ChArUco marker on the board, by its number; squares of 1, whatever the dictionary
        holds.
        """
        largest = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_1000)  # only the places are used
        board = cv2.aruco.CharucoBoard(self.squares, 1.0, self.marker_size_m / self.square_size_m, largest)
        board.setLegacyPattern(self.legacy_pattern)
        return {
            int(number): np.asarray(corners, float)[:, :2]
            for number, corners in zip(np.ravel(board.getIds()), board.getObjPoints(), strict=True)
        }

    def altered(self, **changes: Any) -> Board:
        """The same board with some fields changed."""
        return replace(self, **changes)


def find_board(name_or_path: str, base: Path | None = None) -> Board:
    """The board of ``calibration_boards/NAME.toml``, or of a TOML file (a path from ``base``)."""
    return read_board(board_file(name_or_path, base))


def board_file(name_or_path: str, base: Path | None = None) -> Path:
    """Where `find_board` finds the board: beside the recording first, then among the boards that come along."""
    candidates = [
        Path(name_or_path),
        FOLDER / f"{name_or_path}.toml",
        Path("calibration_boards") / f"{name_or_path}.toml",
    ]
    if base is not None:
        candidates.insert(0, Path(base) / name_or_path)
    for path in candidates:
        if path.is_file():
            return path
    known = sorted(p.stem for p in FOLDER.glob("*.toml"))
    raise InputError(
        f"board {name_or_path!r}: no such board and no such file",
        f"one of {', '.join(known)}, or a board TOML",
        "correct [calibration] board, or write the board with `ovines board`",
    )


def read_board(path: Path) -> Board:
    """A board TOML, checked; ``legacy_pattern`` and ``inverted`` may be left out (false)."""
    try:
        content = tomllib.loads(Path(path).read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise InputError(f"{path}: {error}", "a board TOML", "see calibration_boards/ for examples") from None
    content.pop("format", None)
    return board_from(content, Path(path).stem, str(path))


def board_from(content: Mapping[str, Any], name: str, where: str) -> Board:
    """A board from the keys of its TOML; every wrong one refused by name."""
    known = {
        "name",
        "kind",
        "squares",
        "square_size_m",
        "marker_size_m",
        "dictionary",
        "legacy_pattern",
        "inverted",
        "rings",
    }
    for key in content:
        if key not in known:
            raise InputError(f"{where}: unknown key {key!r}", f"of {', '.join(sorted(known))}", "correct or remove it")
    kind = content.get("kind", "charuco")

    def check(good: bool, key: str, expected: str) -> None:
        if not good:
            raise InputError(f"{where}: {key} = {content.get(key)!r}", expected, "correct it")

    check(kind in KINDS, "kind", f"one of {', '.join(KINDS)}")
    squares: Any = content.get("squares")
    square: Any = content.get("square_size_m")
    check(
        isinstance(squares, list)
        and len(squares) == 2
        and all(type(n) is int and 2 <= n <= MOST_SQUARES for n in squares),
        "squares",
        "[columns, rows], whole numbers of at least 2",
    )
    check(_positive(square), "square_size_m", "a length in metres above 0")
    for flag in ("legacy_pattern", "inverted"):
        check(isinstance(content.get(flag, False), bool), flag, "true or false")
    rings = content.get("rings", [])
    if kind in ("charuco", "aprilgrid", "tags"):
        marker: Any = content.get("marker_size_m")
        check(
            _positive(marker) and marker < square, "marker_size_m", f"a length in metres below square_size_m = {square}"
        )
        check(content.get("dictionary") in DICTIONARIES, "dictionary", f"one of {', '.join(DICTIONARIES)}")
        needed = squares[0] * squares[1] // (2 if kind == "charuco" else 1)
        held = len(cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, content["dictionary"])).bytesList)
        check(
            needed <= held,
            "dictionary",
            f"one with at least {needed} markers for this board ({content['dictionary']} has {held})",
        )
    if kind == "dots":
        on_grid = (
            isinstance(rings, list)
            and len(rings) == 3
            and all(
                isinstance(r, list) and len(r) == 2 and 0 <= r[0] < squares[0] and 0 <= r[1] < squares[1] for r in rings
            )
        )
        check(on_grid, "rings", "[column, row] of the three ring-shaped dots, rows counted downwards")
    return Board(
        str(content.get("name", name)),
        tuple(squares),
        float(square),
        float(content.get("marker_size_m", 0.0)),
        content.get("dictionary", ""),
        content.get("legacy_pattern", False),
        content.get("inverted", False),
        kind,
        tuple(tuple(r) for r in rings),
    )


def _positive(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and 0 < value < MOST_M


def printed_rectangles(board: Board) -> tuple[Any, Any, Any]:
    """A board of squares as a grid of unequal lines: x (I,), y (J,) in metres and which cells are black (J-1, I-1)."""
    if board.kind == "charuco":
        return charuco_rectangles(board)
    if board.kind == "chessboard":
        x, y = (board.square_size_m * np.arange(n + 1) for n in board.squares)
        return x, y, (np.add.outer(np.arange(len(y) - 1), np.arange(len(x) - 1)) % 2 == 0) != board.inverted
    if not board.of_tags:
        raise InputError(f"a board of kind {board.kind}", "squares or tags", "draw its circles instead")
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board.dictionary))
    bits = dictionary.markerSize + 2 * board.border_bits
    gap = board.square_size_m - board.marker_size_m
    within = board.marker_size_m * np.arange(bits + 1) / bits
    columns, rows = board.squares
    x, y = (np.concatenate([[-gap], (board.square_size_m * np.arange(n)[:, None] + within).ravel(),
                            [n * board.square_size_m]]) for n in board.squares)  # fmt: skip
    black = np.zeros((rows * (bits + 1) + 1, columns * (bits + 1) + 1), bool)
    if board.kind == "aprilgrid":  # small squares between the tags' corners, and around
        black[:: bits + 1, :: bits + 1] = True
    for row in range(rows):
        for column in range(columns):
            number = (rows - 1 - row if board.kind == "aprilgrid" else row) * columns + column
            image = cv2.aruco.generateImageMarker(dictionary, number, bits, borderBits=board.border_bits)
            at = row * (bits + 1) + 1, column * (bits + 1) + 1
            black[at[0] : at[0] + bits, at[1] : at[1] + bits] = image == 0
    return x, y, black != board.inverted


def charuco_rectangles(board: Board) -> tuple[Array, Array, Array]:
    """A ChArUco board as a grid of unequal lines: x (I,), y (J,) in metres and which cells are black (J-1, I-1).

    Squares that hold a marker are white, the others black; where each marker lies is OpenCV's, so that
    legacy and present patterns both come out as its detector expects them.  ``inverted`` swaps the colours.
    """
    cv_board = board.opencv()
    dictionary = cv_board.getDictionary()
    bits = dictionary.markerSize + 2
    square, marker = board.square_size_m, board.marker_size_m
    margin = 0.5 * (square - marker)
    within = np.concatenate([[0.0], margin + marker * np.arange(bits + 1) / bits])
    x, y = (np.append((square * np.arange(n)[:, None] + within).ravel(), n * square) for n in board.squares)
    cells = bits + 2  # per square and axis: margin, bits, margin
    black = np.ones((board.squares[1] * cells, board.squares[0] * cells), bool)
    for number, corners in zip(np.ravel(cv_board.getIds()), cv_board.getObjPoints(), strict=True):
        column, row = np.floor(np.asarray(corners)[:, :2].mean(0) / square).astype(int)
        image = cv2.aruco.generateImageMarker(dictionary, int(number), bits)
        tile = np.zeros((cells, cells), bool)
        tile[1:-1, 1:-1] = image == 0
        black[row * cells : (row + 1) * cells, column * cells : (column + 1) * cells] = tile
    return x, y, black != board.inverted
