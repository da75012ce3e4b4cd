"""Views taken at once, the extrinsic view against them, chessboards' ends, and one common frame of extrinsic films."""

import re
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

import vision.calibrate as calibrate_module
from ovines.__main__ import main
from ovines.errors import InputError
from ovines.recording import read_recording
from tests.vision.calibration.test_calibrate import SIZES, rig_views
from vision.calibrate import calibrate
from vision.calibration.images import instant_of, one_instant
from vision.calibration.targets import chessboard as calibration_chessboard
from vision.calibration.targets.boards import Board, find_board
from vision.calibration.targets.chessboard import detect_chessboard, refuse_other_size
from vision.calibration.targets.detection import View

CHESS = Path(__file__).resolve().parents[3] / "sample_data" / "real_chessboard"
BOARD = Board("chessboard", (10, 7), 0.025, kind="chessboard")


def from_the_other_end(view, points):
    """The view as a finder that begins at the opposite corner has it."""
    return replace(view, uv_px=view.uv_px[::-1].copy(), points=np.arange(points))


def test_extrinsic_view_that_the_shared_views_contradict_is_named():
    setup, seen, extrinsic = rig_views(np.random.default_rng(2), together=True)
    extrinsic["VW2"] = from_the_other_end(extrinsic["VW2"], len(setup.board.points_m()))
    with pytest.raises(InputError, match="extrinsic view.* of VW1 and .* of VW2 put the cameras .* m apart .* 7 views"):
        calibrate(setup.board, seen, SIZES, extrinsic)


@pytest.mark.further
def test_one_view_numbered_from_the_other_end_unties_itself_only():
    setup, seen, extrinsic = rig_views(np.random.default_rng(3), together=True)
    seen["VW2"][4] = from_the_other_end(seen["VW2"][4], len(setup.board.points_m()))
    found = calibrate(setup.board, seen, SIZES, extrinsic)
    assert found.simultaneous
    true, own = (np.linalg.norm(a.centre_m - b.centre_m) for a, b in (setup.cameras, found.cameras))
    assert own == pytest.approx(true, rel=1e-3)


def test_names_that_differ_by_the_camera_are_one_instant():
    setup, seen, extrinsic = rig_views(np.random.default_rng(4), together=True)
    for name in seen:
        seen[name] = [
            replace(
                view,
                name=f"{name}_{view.name}",
                instant=instant_of(f"{name}_{view.name}", Path(f"{name}_{view.name}"), "boards/{camera}_*.png", name),
            )
            for view in seen[name]
        ]
    assert calibrate(setup.board, seen, SIZES, extrinsic).simultaneous
    assert instant_of("left01.jpg", Path("left01.jpg"), "{camera}??.jpg", "left") == "01.jpg"
    assert (
        instant_of("cam_0.mp4 frame_00012", Path("cam_0.mp4"), "calibration/cam_{camera}.mp4", "0")
        == "cam_.mp4 frame_00012"
    )
    assert instant_of("01.png", Path("01.png"), "{camera}/*.png", "VW1") == "01.png"


def test_extrinsic_films_give_one_common_frame():
    def seen(name, n):
        return View(name, np.arange(n), np.zeros((n, 2)), np.ones(n))

    films = {
        "A": [seen("frame_00000", 24), seen("frame_00005", 20), seen("frame_00010", 9)],
        "B": [seen("frame_00000", 0), seen("frame_00005", 18), seen("frame_00010", 24)],
    }
    chosen = one_instant(films)
    assert {name: view.name for name, view in chosen.items()} == {"A": "frame_00005", "B": "frame_00005"}
    with pytest.raises(InputError, match="A and B: no frame of their extrinsic films"):
        one_instant({"A": films["A"][:1], "B": films["B"][1:2]})


@pytest.mark.further
def test_both_of_opencvs_finders_number_a_chessboard_alike(monkeypatch):
    compared = 0
    for path in sorted(CHESS.glob("left0[2367].jpg")):
        image = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
        first = detect_chessboard(image, BOARD)
        with monkeypatch.context() as patched:
            patched.setattr(calibration_chessboard.cv2, "findChessboardCorners", lambda *_, **__: (False, None))
            second = detect_chessboard(image, BOARD)
        if second is not None:
            compared += 1
            assert np.abs(first[0] - second[0]).max() < 0.1  # 200 px, numbered from the other end
    assert compared >= 3


@pytest.mark.others_further
@pytest.mark.parametrize("turn", [0, 2])
def test_first_corner_is_that_of_the_dark_end_whichever_way_up(turn):
    image = cv2.imread(str(CHESS / "left03.jpg"), cv2.IMREAD_GRAYSCALE)
    upright, turned = (
        detect_chessboard(image, BOARD),
        detect_chessboard(np.ascontiguousarray(np.rot90(image, turn)), BOARD),
    )
    back = np.array(image.shape[::-1]) - 1 - turned[0] if turn else turned[0]
    assert np.abs(back - upright[0]).max() < 0.1


def test_board_with_two_like_ends_is_refused_for_several_cameras():
    alike = Board("alike", (8, 6), 0.03, kind="chessboard")
    view = View("a.png", np.arange(35), np.random.default_rng(0).uniform(0, 400, (35, 2)), np.ones(35))
    with pytest.raises(InputError, match="8 x 6 squares looks the same turned by half"):
        calibrate(alike, {"A": [view], "B": [view]}, {"A": (640, 480), "B": (640, 480)}, {"A": view, "B": view})
    assert not BOARD.ends_alike and not Board("charuco", (8, 6), 0.03, 0.02, "DICT_5X5_50").ends_alike


@pytest.mark.further
def test_other_number_of_squares_is_counted_and_said(monkeypatch):
    counted = calibration_chessboard.cv2.findChessboardCornersSBWithMeta
    counts = {}  # what OpenCV counts in a picture: the same whatever board is stated

    def count(image, *how):
        key = image.tobytes(), how
        if key not in counts:
            counts[key] = counted(image, *how)
        return counts[key]

    monkeypatch.setattr(calibration_chessboard.cv2, "findChessboardCornersSBWithMeta", count)
    images = [cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) for path in sorted(CHESS.glob("left0[1-6].jpg"))]
    for wrong in ((9, 7), (12, 9)):
        with pytest.raises(InputError, match="chessboard of 10 x 7 squares") as error:
            refuse_other_size(images, BOARD.altered(squares=wrong))
        assert "squares = [10, 7]" in error.value.do
    refuse_other_size(images, BOARD)
    refuse_other_size(images, BOARD.altered(squares=(7, 10)))
    assert len(counts) == len(images)


@pytest.mark.further
@pytest.mark.parametrize("wrong", [(9, 7), (5, 4)])
def test_a_part_of_a_chessboard_is_not_taken_for_the_whole(tmp_path, wrong, capsys):
    """OpenCV finds 9 x 7 squares in nearly all pictures of 10 x 7, from either end: some views failed, with the advice
    to take them again; 5 x 4 ended in a traceback.
    """
    assert main(["board", "b", "--kind", "chessboard", "--squares", *map(str, wrong), "--square-mm", "25",
                 "--out", str(tmp_path)]) == 0  # fmt: skip
    assert main(["new", str(tmp_path / "r"), "--cameras", "left", "right", "--board", str(tmp_path / "b.toml"),
                 "--intrinsic", f"{CHESS}/{{camera}}0*.jpg", "--extrinsic",
                 f"{CHESS}/{{camera}}01.jpg"]) == 0  # fmt: skip
    capsys.readouterr()
    assert main(["calibrate", str(tmp_path / "r"), "--out", str(tmp_path / "out")]) == 2
    said = "".join(capsys.readouterr())
    assert "a chessboard of 10 x 7 squares in 6 of 6 images" in said and "set squares = [10, 7]" in said


@pytest.mark.further
def test_shaken_extrinsic_view_is_said_to_be_the_world():
    setup, seen, extrinsic = rig_views(np.random.default_rng(5))
    assert not any("world" in sentence for sentence in calibrate(setup.board, seen, SIZES, extrinsic).advice)
    shaken = extrinsic["VW1"]
    extrinsic["VW1"] = replace(shaken, uv_px=shaken.uv_px + np.random.default_rng(1).normal(0, 0.5, shaken.uv_px.shape))
    said = [sentence for sentence in calibrate(setup.board, seen, SIZES, extrinsic).advice if "world" in sentence]
    assert len(said) == 1 and said[0].startswith("VW1: its extrinsic view is bad (reprojection 0.")


@pytest.mark.further
def test_board_printed_askew_is_distinguished_from_noise():
    """Residuals of 10 times the noise that stay with the board's points, and ones that do not."""
    setup, seen, extrinsic = rig_views(np.random.default_rng(6))
    assert not any("residuals" in sentence for sentence in calibrate(setup.board, seen, SIZES, extrinsic).advice)
    rng = np.random.default_rng(7)
    px_per_m = 6380 / 0.98  # of the thesis' rig, upright enough for a print's errors to be about alike in all views
    askew = 0.2 / px_per_m * rng.normal(size=(len(setup.board.points_m()), 2))
    for alike, expected in ((True, "points lie 0.0[23].* mm off"), (False, "differ from view to view")):
        shifted = {
            name: [
                replace(
                    view,
                    uv_px=view.uv_px
                    + px_per_m * (askew[view.points] @ _plane(view) if alike else rng.permutation(askew)[view.points]),
                )
                for view in views
            ]
            for name, views in seen.items()
        }
        said = [s for s in calibrate(setup.board, shifted, SIZES, extrinsic).advice if "residuals of" in s]
        assert len(said) == 2 and all(re.search(expected, sentence) for sentence in said), said


def _plane(view):
    """How the image moves with the board's x and y, over the mean scale: from the view itself (2, 2)."""
    board = find_board("charuco_5x7_8mm").points_m()[view.points][:, :2]
    slope = np.linalg.lstsq(np.c_[board, np.ones(len(board))], view.uv_px, rcond=None)[0][:2]
    return slope / np.sqrt(abs(np.linalg.det(slope)))


@pytest.mark.others_further
@pytest.mark.parametrize(("said", "together", "tied"), [(None, True, True), (False, True, False), (True, False, False)])
def test_whether_views_were_taken_at_once_can_be_said(tmp_path, monkeypatch, said, together, tied):
    """recording.toml has the last word; where nothing can be tied, that is said."""
    setup, seen, extrinsic = rig_views(np.random.default_rng(4), together=together)
    if not together:  # no name in common
        seen["VW2"] = [replace(view, name=f"b-{view.name}") for view in seen["VW2"]]
    cameras = "".join(f"[[cameras]]\nname = '{name}'\nsensor_size_px = [{w}, {h}]\n" for name, (w, h) in SIZES.items())
    line = "" if said is None else f"simultaneous = {str(said).lower()}\n"
    (tmp_path / "recording.toml").write_text(
        f"format = 1\n[time]\nframe_rate_hz = 800.0\n{cameras}[calibration]\nboard = 'charuco_9x13_20mm'\n"
        f"intrinsic = '{{camera}}/*.png'\nextrinsic = '{{camera}}.png'\n{line}",
        encoding="utf-8",
    )
    monkeypatch.setattr(calibrate_module, "read_views", lambda recording, progress: (setup.board, seen, extrinsic, []))
    found = calibrate_module.calibrate_recording(read_recording(tmp_path))
    assert found.simultaneous is tied
    assert any("simultaneous = true" in line for line in found.advice) is (said is True)
