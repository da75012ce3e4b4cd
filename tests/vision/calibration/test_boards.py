"""Boards: their files refused or read, their print found again at the right scale by OpenCV's detector."""

import re
import shutil
import subprocess

import cv2
import numpy as np
import pytest

from ovines.camera import Camera
from ovines.errors import InputError
from vision.calibration.targets import detection
from vision.calibration.targets.board_print import PAGES_MM, as_pdf, as_svg, as_toml, draw
from vision.calibration.targets.boards import FOLDER, Board, board_from, charuco_rectangles, find_board, read_board
from vision.calibration.targets.corners import refine_corners
from vision.calibration.targets.detection import detect
from vision.rendering.board import render_board
from vision.rendering.images import Look, View

THESIS = Board("thesis", (5, 7), 0.008, 0.006, "DICT_5X5_50")


def painted(board, px_per_mm=8.0):
    """The page's rectangles as an image: an independent way back from the drawing."""
    drawing = draw(board)
    size = [round(side * px_per_mm) for side in drawing.page_mm]
    image = np.full((size[1], size[0]), 255, np.uint8)
    for x, y, w, h in drawing.rectangles:
        left, top, right, bottom = (round(px_per_mm * value) for value in (x, y, x + w, y + h))
        image[top:bottom, left:right] = 0
    return image


@pytest.mark.parametrize("legacy", [False, True])
@pytest.mark.parametrize("inverted", [False, True])
@pytest.mark.parametrize("squares", [(5, 7), (6, 8)])
def test_printed_board_is_found_whole_and_to_scale(legacy, inverted, squares):
    board = THESIS.altered(squares=squares, legacy_pattern=legacy, inverted=inverted)
    seen = detect(painted(board), board)
    assert len(seen.points) == len(board.points_m())
    spread = np.linalg.norm(seen.uv_px[0] - seen.uv_px[-1])
    truth = 8e3 * np.linalg.norm(board.points_m()[0] - board.points_m()[-1])
    assert spread == pytest.approx(truth, abs=0.3)  # rectangles were rounded to whole pixels


def test_pattern_is_opencvs_own_picture():
    board = THESIS
    x, y, black = charuco_rectangles(board)
    drawn = board.opencv().generateImage((5 * 56, 7 * 56))
    middle_x, middle_y = (((np.diff(axis) / 2 + axis[:-1]) * 7000).astype(int) for axis in (x, y))
    assert ((drawn[np.ix_(middle_y, middle_x)] == 0) == black).all()


def test_own_toml_comes_back():
    board = THESIS.altered(inverted=True, legacy_pattern=True)
    import tomllib

    assert board_from(tomllib.loads(as_toml(board)), "thesis", "here") == board


def test_shipped_boards_are_valid_and_printed():
    paths = sorted(FOLDER.glob("charuco*.toml"))
    assert "charuco_5x7_8mm" in [path.stem for path in paths]
    for path in paths:
        assert find_board(path.stem) == read_board(path)
        assert path.with_suffix(".pdf").is_file() and path.with_suffix(".svg").is_file()


def test_svg_and_pdf_are_in_millimetres():
    drawing = draw(THESIS)
    assert drawing.page_mm == PAGES_MM["A4"]
    assert 'width="210mm" height="297mm"' in as_svg(drawing)
    pdf = as_pdf(drawing)
    box = re.search(rb"MediaBox \[0 0 ([\d.]+) ([\d.]+)\]", pdf)
    assert [float(side) / 72 * 25.4 for side in box.groups()] == pytest.approx([210, 297], abs=1e-3)
    start = int(re.search(rb"startxref\n(\d+)", pdf)[1])
    assert pdf[start : start + 4] == b"xref"


def rectangles_of_svg(text):
    """What the file draws in black, in the millimetres of its viewBox."""
    width = float(re.search(r'width="([\d.]+)mm"', text)[1])
    scale = width / float(re.search(r'viewBox="0 0 ([\d.]+)', text)[1])
    drawn = text[text.index("<g ") :]
    found = re.findall(r'<rect x="([-\d.]+)" y="([-\d.]+)" width="([\d.]+)" height="([\d.]+)"/>', drawn)
    return scale * np.array(found, float)


def rectangles_of_pdf(pdf):
    """What the page draws in black, in millimetres from its top left corner, by its own matrix and its media box."""
    scale = float(re.search(rb"([\d.]+) 0 0 [\d.]+ 0 0 cm", pdf)[1])
    height = float(re.search(rb"MediaBox \[0 0 [\d.]+ ([\d.]+)\]", pdf)[1])
    x, y, w, h = np.array(re.findall(rb"([-\d.]+) ([-\d.]+) ([-\d.]+) ([-\d.]+) re", pdf), float).T * scale
    return np.stack([x, height - y - h, w, h], -1) * 25.4 / 72


@pytest.mark.parametrize("name", sorted(path.stem for path in FOLDER.glob("charuco*.toml")))
@pytest.mark.parametrize("ending", ["svg", "pdf"])
def test_shipped_files_are_true_to_scale(name, ending):
    """The files' own rectangles, painted at 8 px/mm: OpenCV finds the whole board, and a millimetre is a millimetre."""
    board, path = find_board(name), FOLDER / f"{name}.{ending}"
    found = (
        rectangles_of_svg(path.read_text(encoding="utf-8")) if ending == "svg" else rectangles_of_pdf(path.read_bytes())
    )
    image = np.full(
        (int(8 * (found[:, 1] + found[:, 3]).max()) + 80, int(8 * (found[:, 0] + found[:, 2]).max()) + 80),
        255,
        np.uint8,
    )
    for left, top, right, bottom in np.round(8 * np.c_[found[:, :2], found[:, :2] + found[:, 2:]]).astype(int):
        image[top:bottom, left:right] = 0
    assert px_per_mm(image, board) == pytest.approx([8, 8], rel=2e-4)
    widest = found[np.argmax(found[:, 2])]
    assert widest[2] == pytest.approx(10 * round(widest[2] / 10), abs=1e-3) and widest[3] < 0.3  # the ruler's line


def px_per_mm(image, board):
    """Scale along the board's x and y, from a fit to every corner; all of them have to be there."""
    seen = detect(image, board)
    assert len(seen.points) == len(board.points_m())
    flat = np.c_[1e3 * board.points_m()[:, :2], np.ones(len(seen.points))]
    matrix = np.linalg.lstsq(flat, seen.uv_px[np.argsort(seen.points)], rcond=None)[0]
    return np.linalg.norm(matrix[:2], axis=1)


@pytest.mark.skipif(shutil.which("pdftoppm") is None, reason="needs pdftoppm, a renderer of PDF")
def test_rendered_pdf_measures_what_it_says(tmp_path):
    """A renderer that is not ours, at 254 dots per inch: 10 px are a millimetre."""
    subprocess.run(
        ["pdftoppm", "-r", "254", "-gray", "-png", FOLDER / "charuco_5x7_8mm.pdf", tmp_path / "page"],
        check=True,
        timeout=60,
    )
    image = cv2.imread(str(next(tmp_path.glob("page*.png"))), 0)
    assert image.shape == pytest.approx((2970, 2100), abs=2)
    assert px_per_mm(image, find_board("charuco_5x7_8mm")) == pytest.approx([10, 10], rel=1e-4)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("squares", [5]),
        ("squares", [5, 1]),
        ("squares", [5.5, 7]),
        ("square_size_m", 0),
        ("square_size_m", "8 mm"),
        ("marker_size_m", 0.008),
        ("dictionary", "DICT_9X9"),
        ("legacy_pattern", 1),
        ("kind", "rings"),
        ("colour", "red"),
        ("squares", [20, 20]),
    ],
)
def test_wrong_key_is_named(key, value):
    content = {
        "squares": [5, 7],
        "square_size_m": 0.008,
        "marker_size_m": 0.006,
        "dictionary": "DICT_5X5_50",
        key: value,
    }
    with pytest.raises(InputError) as refused:
        board_from(content, "b", "b.toml")
    assert "b.toml" in refused.value.found and (key in refused.value.found or "dictionary" in refused.value.found)


def test_a_board_is_found_by_name_from_any_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert find_board("charuco_5x7_8mm").squares == (5, 7)


def test_unknown_board_names_the_known_ones(tmp_path):
    with pytest.raises(InputError, match="charuco_5x7_8mm"):
        find_board("no_such_board", tmp_path)


def test_print_survives_the_detector_upside_down():
    image = cv2.rotate(painted(THESIS), cv2.ROTATE_180)
    assert len(detect(image, THESIS).points) == 24


def test_no_corners_neighbourhood_reaches_a_marker_however_askew_the_board(monkeypatch):
    """The fields of blunt angles bring their markers nearest: by where the print truly lies in the picture."""
    board = Board("webcams", (4, 5), 0.054, 0.75 * 0.054, "DICT_4X4_1000", inverted=True)
    camera = Camera("A", (400, 400), np.array([[760, 0, 199.5], [0, 760, 199.5], [0, 0, 1.0]]), np.zeros(5), np.eye(3),
                    np.zeros(3))  # fmt: skip
    gap = 0.5 * (board.square_size_m - board.marker_size_m)
    around = gap * np.array([[1, 1, 0], [1, -1, 0], [-1, 1, 0], [-1, -1, 0]])
    printed = np.concatenate(board.opencv().getObjPoints()).astype(float)
    asked = {}

    def spy(image, uv, reach):
        asked["uv"], asked["reach"] = uv, reach
        return refine_corners(image, uv, reach)

    monkeypatch.setattr(detection, "refine_corners", spy)
    shares = []
    for tilt in (0.0, 0.6, 0.9):
        turn = cv2.Rodrigues(tilt * np.array([0.75, 0.66, 0.0]))[0]
        shift = np.array([0, 0, 0.9]) - turn @ np.array([*np.array(board.size_m) / 2, 0])
        image, _ = render_board(View(camera), board, turn, shift, Look(blur_px=0.8), np.random.default_rng(1))
        found = detection.detect(image, board)
        assert len(found.points) > 8
        places = board.points_m()[found.points]
        true_uv = camera.project(places @ turn.T + shift)
        beside = [place + around for place in places]  # of them those where a marker's corner is printed
        for uv, four, reach in zip(true_uv, beside, asked["reach"], strict=True):
            own = four[[np.linalg.norm(printed - one, axis=-1).min() < 0.1 * gap for one in four]]
            assert len(own) == 2
            away = np.linalg.norm(camera.project(own @ turn.T + shift) - uv, axis=-1).min()
            shares.append(reach / away)
    assert max(shares) < 1.0 and min(shares) > 0.6
