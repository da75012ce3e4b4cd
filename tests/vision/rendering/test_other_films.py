"""Recordings that another renderer drew, from boards to points: what `vision.rendering.images` takes for granted is not
taken for granted here.
"""

from dataclasses import replace

import numpy as np
import pytest

from ovines.errors import InputError
from ovines.recording import read_recording
from tests.vision.rendering.judge_films import judged, run
from tests.vision.rendering.other_films import BOARDS, KINDS, drawn
from vision.calibrate import calibrate_recording
from vision.track import track
from vision.triangulate import triangulate

SMALL = replace(KINDS["plain"], sensor=(1200, 860), window=(900, 640), px_per_mm=4.4, distance_m=0.9, views=8)
# where only the board is recognised: half the pixels, three views
BOARDS_ALONE = replace(SMALL, sensor=(840, 600), window=(640, 450), px_per_mm=3.1, views=3)


def followed(folder, kind, frames=4):
    truth = drawn(folder, kind, frames, 3)
    recording = read_recording(folder)
    cameras = calibrate_recording(recording).cameras
    found = track(recording, cameras)
    return truth, found, triangulate(found.tracks, cameras, recording.window_offset_px)


@pytest.mark.parametrize(
    "kind",
    [
        replace(SMALL, paper=235.0, sticker_m={"ground": 0.002, "host": 0.002, "nes": 0.0012}),
        replace(
            SMALL,
            bodies=KINDS["500 rad/s, 8 close, holed"].bodies,
            nes_centre=False,
            nes_deg=(0, 83, 150, 262),
            grey=20.0,
            layout=False,
        ),
    ],
    ids=["markers on small papers", "beside a hole, no layout"],
)
def test_another_renderers_film_is_followed_to_a_hundredth_of_a_pixel(tmp_path, kind):
    truth, found, points = followed(tmp_path, kind)
    both = truth.merge(found.tracks, on=["camera", "frame"], suffixes=("_true", ""))
    both["off"] = np.hypot(both.u_px - both.u_px_true, both.v_px - both.v_px_true)
    near = both[both.off < 0.3]
    assert len(near) >= 0.97 * len(truth) and len(near) == len(
        found.tracks
    )  # none lost but by a covered edge, none where nothing is
    assert (near.groupby("marker").marker_true.nunique() == 1).all()  # under one name each
    if kind.layout:
        assert (near.marker == near.marker_true).all()
    assert near.off.median() < 0.02 and near.off.max() < 0.07
    space = points.merge(truth[truth.camera == "left"], on="frame", suffixes=("", "_true"))
    off = space[["x_m", "y_m", "z_m"]].to_numpy() - space[["x_m_true", "y_m_true", "z_m_true"]].to_numpy()
    error = np.linalg.norm(off, axis=1)
    error = error[error < 5e-4]
    assert len(error) >= 0.47 * len(truth) and np.sqrt(np.mean(error**2)) < 4e-5  # with a calibration of eight views


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"printed": lambda picture: np.ascontiguousarray(picture[:, ::-1])}, "mirror"),
        ({"toml": lambda text: text.replace("charuco_7x10_15mm", "other.toml")}, "squares"),
        ({"toml": lambda text: text.replace("charuco_7x10_15mm", "charuco_9x13_20mm")}, "DICT_5X5"),
        (
            {"toml": lambda text: text.replace("boards/{camera}/world.png", "boards/{camera}/lens/nothing.png")},
            "nothing.png",
        ),
    ],
    ids=["mirrored", "other squares", "another board", "no such file"],
)
def test_mistakes_on_anothers_boards_are_named(tmp_path, change, said):
    drawn(tmp_path, replace(BOARDS_ALONE, **change), 0, 3)
    columns, rows, square, marker, dictionary = BOARDS["charuco_7x10_15mm"]
    (tmp_path / "other.toml").write_text(
        f"squares = [{rows}, {columns}]\nsquare_size_m = {square}\nmarker_size_m = {marker}\ndictionary = "
        f'"{dictionary}"\n'
    )
    with pytest.raises(InputError) as refused:
        calibrate_recording(read_recording(tmp_path))
    assert said in str(refused.value)


@pytest.mark.parametrize("print_of", [{"legacy": True}, {"inverted": True}], ids=["legacy", "inverted"])
def test_another_print_of_anothers_board_is_recognised(tmp_path, print_of):
    drawn(tmp_path, replace(BOARDS_ALONE, print_of=print_of), 0, 3)
    found = calibrate_recording(read_recording(tmp_path))
    assert any(next(iter(print_of)) in note for note in found.advice)


@pytest.mark.long
@pytest.mark.parametrize("name", list(KINDS))
def test_every_kind_of_film_goes_from_boards_to_motion(tmp_path, name):
    truth = drawn(tmp_path, KINDS[name], 12, 1)
    status, said, _ = run(tmp_path)
    assert status == 0, said
    row = judged(tmp_path, truth, KINDS[name])
    seen, swaps = row.split("|")[0].split()
    assert float(seen[:-1]) > 97.0 and (swaps == "0" or name == "no layout"), row
