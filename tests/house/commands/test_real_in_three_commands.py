"""docs/how-to/import.md: each set of real board images is calibrated by the three commands that stand there."""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from ovines.__main__ import main
from ovines.camera import read_calibration
from ovines.tables import read_table

ROOT = Path(__file__).parents[3]
REAL = ROOT.parent / "shared" / "real"
BLOCKS = [
    block.strip().splitlines()
    for block in re.findall(r"```\n(.*?)```", (ROOT / "docs" / "how-to" / "import.md").read_text(), re.DOTALL)
    if "--intrinsic" in block
]
PAINTED = "stereo_chessboard"  # whose page is drawn with its pictures; the others' have the same
CHESS = ROOT / "sample_data" / "real_chessboard"  # the same pictures, in every checkout


class Known(NamedTuple):
    """Focal length of the first camera [px] and the distance of the cameras [m], with how well (relative); the rms that
    both reach [px] and how many views are used, where something else tells them.
    """

    focal_px: float
    focal_share: float
    apart_m: float
    apart_share: float
    rms_px: float = np.inf
    used: int = 0


# The sets' own files, and of the webcams the solve that their README mentions (frames up to 36 ms apart).  OpenCV's own
# joint solve reaches 0.215 px on the chessboards, 3.33 squares apart; one with ellipse centres 0.0075 px on the dots.
KNOWN = {
    "stereo_chessboard": Known(535.9, 0.01, 3.33 * 0.025, 0.02 / 3.33, 0.215, 26),
    "charuco_two_webcams": Known(900.0, 0.03, 1.14, 0.03),
    "stereo_dots": Known(6673.32, 5 / 6673, 0.1235, 2e-4 / 0.1235, 0.0075),
}


def test_each_set_has_its_commands():
    assert sorted(KNOWN) == sorted(next(name for name in KNOWN if name in " ".join(block)) for block in BLOCKS)
    assert all(len(block) <= 3 for block in BLOCKS)


@pytest.mark.others_further
@pytest.mark.parametrize("name", KNOWN)
def test_the_commands_calibrate_it(name, request, tmp_path, monkeypatch):
    if name != PAINTED:
        request.getfixturevalue("unpainted")
    pictures = CHESS if name == "stereo_chessboard" else REAL / name
    if not pictures.is_dir():
        pytest.skip("no real images beside the checkout")
    (tmp_path / name).symlink_to(pictures)
    monkeypatch.chdir(tmp_path)
    block = next(block for block in BLOCKS if name in " ".join(block))
    for line in block:
        words = shlex.split(line)
        assert words[0] == "ovines" and main(words[1:]) == 0
    out, known = Path(words[-1]), KNOWN[name]
    cameras = read_calibration(out / "calibration.json")
    first, second = cameras
    assert first.matrix[0, 0] == pytest.approx(known.focal_px, rel=known.focal_share)
    assert np.linalg.norm(first.centre_m - second.centre_m) == pytest.approx(known.apart_m, rel=known.apart_share)
    assert np.sqrt(np.mean([camera.rms_px**2 for camera in cameras])) < known.rms_px
    views = read_table(out / "calibration_views.parquet", "calibration_views")
    assert views["used"].sum() >= known.used
