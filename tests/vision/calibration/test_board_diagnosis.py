"""Mistakes with the board, each on a rendered picture: named, with what to change."""

from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from ovines.camera import Camera
from ovines.errors import InputError
from vision.calibration.images import _board_that_fits
from vision.calibration.targets.board_diagnosis import alternatives
from vision.calibration.targets.boards import Board
from vision.calibration.targets.detection import detect
from vision.rendering.board import render_board
from vision.rendering.images import Look
from vision.rendering.images import View as Window


@pytest.fixture(scope="module")
def pictures():
    """One rendered view of each print; the camera is small, the board near."""
    camera = Camera(
        "A",
        (640, 640),
        np.array([[6000.0, 0, 319.5], [0, 6000, 319.5], [0, 0, 1]]),
        np.zeros(5),
        np.eye(3),
        np.zeros(3),
    )
    turn = cv2.Rodrigues(np.array([0.2, -0.3, 0.4]))[0]

    def take(board):
        return render_board(
            Window(camera), board, turn, np.array([-0.01, -0.03, 1.1]), Look(0.8, 1.0), np.random.default_rng(0)
        )[0]

    return take


def thesis(**changes):
    return Board("b", (5, 8), 0.008, 0.006, "DICT_5X5_50").altered(**changes)  # rows even: the legacy pattern differs


@pytest.mark.further
@pytest.mark.parametrize(
    "truth", [{"inverted": True}, {"legacy_pattern": True}, {"inverted": True, "legacy_pattern": True}]
)
def test_other_print_is_found_and_noted(pictures, truth):
    image = pictures(thesis(**truth))
    assert len(detect(image, thesis()).points) == 0
    board, said = alternatives([image], thesis())
    assert board == thesis(**truth) and all(f"{key} = true" in said for key in truth)


def test_mirrored_images_and_wrong_dictionary_are_refused_by_name(pictures):
    image = pictures(thesis())
    with pytest.raises(InputError, match="mirrored"):
        alternatives([np.ascontiguousarray(image[:, ::-1])], thesis())
    with pytest.raises(InputError, match="DICT_5X5"):
        alternatives([image], thesis(dictionary="DICT_6X6_50"))
    with pytest.raises(InputError, match="none of 1 images"):
        alternatives([np.full((300, 300), 128, np.uint8)], thesis())


@pytest.mark.others_further
@pytest.mark.parametrize("wrong", [(8, 5), (4, 6), (6, 9)])
def test_wrong_number_of_squares_is_refused(pictures, wrong):
    with pytest.raises(InputError, match=r"5 columns and 8 rows") as refused:
        alternatives([pictures(thesis())], thesis(squares=wrong))
    assert "squares = [5, 8]" in refused.value.do


def test_one_camera_mirrored_is_named(pictures, tmp_path):
    image = pictures(thesis())
    files = []
    for name, shown in (("VW1", image), ("VW2", image[:, ::-1])):
        cv2.imwrite(str(tmp_path / f"{name}.png"), shown)
        camera = SimpleNamespace(name=name, sensor_size_px=(640, 640), window_size_px=None)
        files.append((tmp_path / f"{name}.png", camera))
    with pytest.raises(InputError, match="VW2: the board b fits only when the images are mirrored"):
        _board_that_fits(thesis(), files)
    assert _board_that_fits(thesis(), files[:1]) == (thesis(), [])
