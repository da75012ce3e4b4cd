"""docs/how-to/import.md: each set of real board images is calibrated by the three commands that stand there."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import numpy as np
import pytest

from ovines.__main__ import main
from ovines.camera import read_calibration

ROOT = Path(__file__).parents[2]
REAL = ROOT.parent / "shared" / "real"
BLOCKS = [
    block.strip().splitlines()
    for block in re.findall(r"```\n(.*?)```", (ROOT / "docs" / "how-to" / "import.md").read_text(), re.DOTALL)
    if "--intrinsic" in block
]
# Focal length of the first camera, px, and the distance of the cameras, m, with how well: the sets' own files, and of
# the webcams the solve that their README mentions (frames up to 36 ms apart).
KNOWN = {
    "stereo_chessboard": (535.9, 0.01, 3.33 * 0.025, 0.02),
    "charuco_two_webcams": (900.0, 0.03, 1.14, 0.03),
    "stereo_dots": (6673.32, 0.001, 0.1235, 0.002),
}


def test_each_set_has_its_commands():
    assert sorted(KNOWN) == sorted(next(name for name in KNOWN if name in " ".join(block)) for block in BLOCKS)
    assert all(len(block) <= 3 for block in BLOCKS)


@pytest.mark.parametrize("name", sorted(KNOWN))
def test_the_commands_calibrate_it(name, tmp_path, monkeypatch):
    if not (REAL / name).is_dir():
        pytest.skip("no real images beside the checkout")
    (tmp_path / name).symlink_to(REAL / name)
    monkeypatch.chdir(tmp_path)
    block = next(block for block in BLOCKS if name in " ".join(block))
    for line in block:
        words = shlex.split(line)
        assert words[0] == "ovines" and main(words[1:]) == 0
    first, second = read_calibration(Path(words[-1]) / "calibration.json")
    focal_px, focal_share, apart_m, apart_share = KNOWN[name]
    assert first.matrix[0, 0] == pytest.approx(focal_px, rel=focal_share)
    assert np.linalg.norm(first.centre_m - second.centre_m) == pytest.approx(apart_m, rel=apart_share)
