"""Films of a known motion."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from PIL import Image

from analysis.view.film import Film, animate
from ovines.errors import InputError
from ovines.io.provenance import provenance
from ovines.recording import read_recording
from ovines.tables import write_table

NES_BLUE = (0, 114, 178)


def scene(folder, wall="inner_radius_m = 0.05"):
    folder.mkdir(exist_ok=True)
    (folder / "recording.toml").write_text(
        f"format = 1\n[time]\nframe_rate_hz = 800.0\n[bodies.host]\n{wall}\n[bodies.nes]\nradius_m = 0.01\n"
    )
    t = np.arange(161) / 800
    motion = pd.DataFrame(
        {
            "frame": np.arange(161),
            "time_s": t,
            "nes_x_m": np.linspace(-0.035, 0.035, 161),
            "nes_y_m": 0.0,
            "nes_z_m": 0.0,
            "nes_angle_rad": 20 * t,
            "host_x_m": 0.0,
            "host_y_m": 0.0,
            "host_z_m": 0.0,
            "host_angle_rad": 0.0,
        }
    )
    return read_recording(folder), motion


def disk_place_px(picture) -> float:
    """Mean column of the disk's blended blue in the left half."""
    rgb = np.asarray(picture.convert("RGB")).astype(int)[:, :400]
    blended = np.array([255, 255, 255]) * 0.45 + np.array(NES_BLUE) * 0.55
    near = np.abs(rgb - blended).max(-1) < 30
    assert near.sum() > 200
    return float(np.nonzero(near)[1].mean())


@pytest.mark.parametrize(
    "wall",
    ["inner_radius_m = 0.05", "polygon_m = [[-0.05, -0.05], [0.05, -0.05], [0.05, 0.05], [-0.05, 0.05]]"],
)
def test_the_disk_moves_across(tmp_path, wall):
    recording, motion = scene(tmp_path / "rec", wall)
    path = tmp_path / "film.gif"
    assert animate(motion, recording, path, Film(slower=10)) == 40
    with Image.open(path) as film:
        assert film.n_frames == 40
        assert film.size == (800, 400)
        places = []
        for n in (1, 20, 38):
            film.seek(n)
            places.append(disk_place_px(film))
    assert places[1] - places[0] > 50
    assert places[2] - places[1] > 50
    assert places[1] - places[0] == pytest.approx((places[2] - places[1]) * 19 / 18, rel=0.1)  # steady motion


def test_a_lost_disk_is_not_drawn(tmp_path):
    recording, motion = scene(tmp_path / "rec")
    motion[["nes_x_m", "nes_y_m"]] = np.nan
    animate(motion, recording, tmp_path / "film.gif", Film(slower=10), simulation=None)
    with Image.open(tmp_path / "film.gif") as film, pytest.raises(AssertionError):
        disk_place_px(film)


def test_what_cannot_be_filmed_is_refused(tmp_path):
    recording, motion = scene(tmp_path / "rec")
    for path, film in (
        ("film.avi", Film()),
        ("film.gif", Film(slower=1000)),
        ("film.gif", Film(start_s=5.0)),
    ):
        with pytest.raises(InputError):
            animate(motion, recording, tmp_path / path, film)
    assert not list(tmp_path.glob("film*"))


def test_the_command(tmp_path, ovines):
    _, motion = scene(tmp_path / "rec")
    write_table(motion, "motion", tmp_path / "rec" / "motion.parquet", provenance("test", {}, {}))
    command = "animate", tmp_path / "rec", "--end", "0.05"
    done = ovines(*command, "--out", tmp_path / "film.mp4")
    assert done.returncode == 0, done.stderr
    import cv2

    film = cv2.VideoCapture(str(tmp_path / "film.mp4"))
    assert int(film.get(cv2.CAP_PROP_FRAME_COUNT)) == 20
    assert film.read()[1].shape == (400, 800, 3)
    assert [p.name for p in tmp_path.iterdir() if "film" in p.name] == ["film.mp4"]
    (tmp_path / "rec" / "motion.parquet").unlink()
    refused = ovines(*command)
    assert refused.returncode == 2
    assert "motion.parquet" in refused.stderr
