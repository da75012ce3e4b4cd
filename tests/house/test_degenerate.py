"""Poor data that a rig really gives: the run ends with a named gap or a refusal, never with a traceback."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
import pytest

from ovines.__main__ import main
from ovines.tables import read_table, write_table
from tests.conftest import bouncing_motion, tracks_of, two_cameras, write_small_recording

Spoil = Callable[[pd.DataFrame], pd.DataFrame]


def only(*markers: str) -> Spoil:
    return lambda t: t[t["marker"].isin(markers)]


def lost(first: int, last: int, marker: str = "") -> Spoil:
    return lambda t: t[~(t["frame"].between(first, last) & t["marker"].str.startswith(marker))]


TRACKS: dict[str, tuple[Spoil, int, str]] = {
    "two markers of the NES": (only("H1", "H2", "H3", "H4", "N2", "N3"), 0, ""),
    "one marker of the NES": (only("H1", "H2", "H3", "H4", "N1"), 0, ""),
    "two markers of the Host": (only("H1", "H2", "N1", "N2", "N3"), 0, ""),
    "two markers in all": (only("H1", "N1"), 0, ""),
    "no marker of the NES": (only("H1", "H2", "H3", "H4"), 0, ""),
    "no marker of the Host": (only("N1", "N2", "N3", "N4", "N5"), 0, ""),
    "one camera": (lambda t: t[t["camera"] == "VW1"], 2, "camera"),
    "one camera for half of the run": (lambda t: t[(t["camera"] == "VW1") | (t["frame"] < 100)], 0, ""),
    "all lost for 100 ms": (lost(60, 139), 0, ""),
    "NES lost for 100 ms": (lost(60, 139, "N"), 0, ""),
    "Host lost for 100 ms": (lost(60, 139, "H"), 0, ""),
    "every second frame lost": (lambda t: t[t["frame"] % 2 == 0], 0, ""),
    "one frame": (lambda t: t[t["frame"] == 0], 0, ""),
    "three frames": (lambda t: t[t["frame"] < 3], 0, ""),
    "unknown markers too": (lambda t: pd.concat([t, t[t["marker"] == "N1"].assign(marker="Q7")]), 0, ""),
    "only unknown markers": (lambda t: t.assign(marker="Q" + t["marker"]), 2, "marker"),
    "nothing moves": (lambda t: t.assign(**{c: t.groupby(["camera", "marker"])[c].transform("first") for c in ("u_px", "v_px")}), 0, ""),
    "duplicate frames": (lambda t: t.assign(frame=t["frame"] // 2), 2, "frame"),
    "negative times": (lambda t: t.assign(time_s=t["time_s"] - 5.0), 0, ""),
    "repeated times": (lambda t: t.assign(time_s=np.floor(t["time_s"] * 400) / 400), 2, "time"),
    "times a million seconds late": (lambda t: t.assign(time_s=t["time_s"] + 1e6), 0, ""),
    "NaN": (lambda t: t.assign(u_px=t["u_px"].where(t["frame"] != 5)), 2, "u_px"),
    "infinite": (lambda t: t.assign(v_px=t["v_px"].where(t["frame"] != 5, np.inf)), 2, "v_px"),
    "markers far off": (lambda t: t.assign(u_px=t["u_px"] * 1e6), 0, ""),
    "markers on one spot": (lambda t: t.assign(u_px=500.0, v_px=300.0), 0, ""),
    "sd of zero": (lambda t: t.assign(sd_px=0.0), 0, ""),
    "sd unknown": (lambda t: t.assign(sd_px=np.nan), 0, ""),
}  # fmt: skip


def write_tracks(path: Path, frame: pd.DataFrame) -> None:
    """As another program might write them: unchecked."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    pq.write_table(pa.Table.from_pandas(frame, preserve_index=False), path)


QUICK = {
    "two markers of the NES", "one camera", "all lost for 100 ms", "one frame", "only unknown markers", "duplicate frames", "negative times",
    "repeated times", "NaN", "infinite", "no impacts, at rest", "NES never seen", "times backwards", "black", "the same noise in every frame",
    "wrong size",
}  # fmt: skip


def cases(names: Iterable[str]) -> list:
    """The quick ones with the other tests, all of them with ``-m "long or not long"``."""
    return [name if name in QUICK else pytest.param(name, marks=pytest.mark.long) for name in names]


def ended_well(status: int, error: str, expected: int, word: str) -> None:
    assert "Traceback" not in error, error
    assert status in (0, 2) if expected == 0 else status == expected, error
    if status == 2:
        assert "found:" in error and "expected:" in error and "do:" in error, error
        assert word in error, error


@pytest.mark.parametrize("case", cases(TRACKS))
def test_run_of_poor_tracks(case, tmp_path, capsys):
    spoil, expected, word = TRACKS[case]
    folder = write_small_recording(tmp_path / "run", frames=200).folder
    write_tracks(folder / "tracks.parquet", spoil(pd.DataFrame(read_table(folder / "tracks.parquet", "tracks"))))
    status = main(["run", str(folder), "--out", str(tmp_path / "out")])
    ended_well(status, capsys.readouterr().err, expected, word)
    assert (status == 0) == (tmp_path / "out" / "report.html").exists()
    if case == "all lost for 100 ms":
        motion = read_table(tmp_path / "out" / "motion.parquet", "motion")
        gap = motion[motion["frame"].between(60, 139)]
        assert gap["nes_x_m"].isna().all(), "nobody saw the disk: nothing may stand there"


def still(motion: pd.DataFrame) -> pd.DataFrame:
    return motion.assign(nes_x_m=0.01, nes_y_m=0.0, nes_angle_rad=0.0)


MOTION: dict[str, tuple[Spoil, int, str]] = {
    "no impacts, at rest": (still, 0, ""),
    "no impacts, one flight": (lambda m: m[m["frame"] < 12], 0, ""),
    "NES never seen": (lambda m: m.assign(nes_x_m=np.nan, nes_y_m=np.nan, nes_angle_rad=np.nan), 0, ""),
    "Host never seen": (lambda m: m.assign(host_x_m=np.nan, host_y_m=np.nan, host_angle_rad=np.nan), 0, ""),
    "no angle": (lambda m: m.assign(nes_angle_rad=np.nan), 0, ""),
    "NES outside the Host": (lambda m: m.assign(nes_x_m=m["nes_x_m"] + 1.0), 0, ""),
    "frames 1000 apart": (lambda m: m.assign(frame=m["frame"] * 1000), 0, ""),
    "huge": (lambda m: m.assign(nes_x_m=m["nes_x_m"] * 1e150), 0, ""),
    "noise only": (lambda m: m.assign(nes_x_m=np.random.default_rng(1).normal(0, 0.01, len(m))), 0, ""),
    "repeated times": (lambda m: m.assign(time_s=0.0), 2, "time"),
    "times backwards": (lambda m: m.assign(time_s=-m["time_s"]), 2, "time"),
}  # fmt: skip
BODIES = "[bodies.host]\ninner_radius_m = 0.05\n[bodies.nes]\nradius_m = 0.01\ninertia_factor = 0.5\nmass_kg = 0.02\n"


def write_motion(folder: Path, motion: pd.DataFrame) -> None:
    folder.mkdir(parents=True)
    write_tracks(folder / "motion.parquet", motion)
    (folder / "recording.toml").write_text(f"format = 1\n[time]\nframe_rate_hz = 800.0\n{BODIES}")


@pytest.mark.parametrize("case", cases(MOTION))
def test_run_and_diagnose_of_poor_motion(case, tmp_path, capsys):
    spoil, expected, word = MOTION[case]
    motion = spoil(bouncing_motion(200, 800.0))
    for name in ("a", "b"):
        write_motion(tmp_path / "series" / name, motion)
    status = main(["run", str(tmp_path / "series" / "a"), "--out", str(tmp_path / "out")])
    ended_well(status, capsys.readouterr().err, expected, word)
    status = main(["diagnose", str(tmp_path / "series"), "--out", str(tmp_path / "gap")])
    ended_well(status, capsys.readouterr().err, expected, word)
    assert (status == 0) == (tmp_path / "gap" / "diagnosis.json").exists()


def write_frames(folder: Path, images: list[np.ndarray]) -> None:
    """A recording that enters at frames: the small one, 400 x 300 windows, its images given."""
    cameras = two_cameras()
    write_small_recording(folder, frames=2)
    (folder / "tracks.parquet").unlink()
    text = (folder / "recording.toml").read_text()
    for camera in cameras:
        (folder / camera.name).mkdir()
        text = text.replace(f'name = "{camera.name}"\n', f'name = "{camera.name}"\nframes = "{camera.name}/*.png"\n')
        for i, image in enumerate(images):
            cv2.imwrite(str(folder / camera.name / f"{i:03d}.png"), image)
    text = text.replace("window_size_px = [4096, 688]", "window_size_px = [400, 300]")
    (folder / "recording.toml").write_text(text)


NOISE = np.random.default_rng(2).integers(0, 255, (300, 400)).astype(np.uint8)
IMAGES = {
    "black": [np.zeros((300, 400), np.uint8)] * 6,
    "white": [np.full((300, 400), 255, np.uint8)] * 6,
    "the same noise in every frame": [NOISE] * 3,
    "one frame": [np.zeros((300, 400), np.uint8)],
    "16 bit": [np.full((300, 400), 40000, np.uint16)] * 3,
    "colour": [np.full((300, 400, 3), (10, 200, 30), np.uint8)] * 3,
    "wrong size": [np.zeros((100, 100), np.uint8)] * 3,
}


@pytest.mark.parametrize("case", cases(IMAGES))
def test_run_of_images_that_show_nothing(case, tmp_path, capsys):
    write_frames(tmp_path / "run", IMAGES[case])
    status = main(["run", str(tmp_path / "run"), "--out", str(tmp_path / "out")])
    ended_well(status, capsys.readouterr().err, 2 if case == "wrong size" else 0, "")


@pytest.mark.long
def test_tracks_of_half_a_series_do_not_cost_the_other_half(tmp_path, capsys):
    """One run of a series with nothing to see: the page over the series is written and names it."""
    for name in ("a", "b"):
        write_small_recording(tmp_path / "series" / name, frames=200)
    cameras = two_cameras()
    poor = tracks_of(bouncing_motion(3, 800.0), cameras, 0.02, np.random.default_rng(0))
    write_table(poor, "tracks", tmp_path / "series" / "b" / "tracks.parquet", {})
    status = main(["run", str(tmp_path / "series"), "--out", str(tmp_path / "out")])
    ended_well(status, capsys.readouterr().err, 0, "")
    assert (tmp_path / "out" / "report.html").exists() and (tmp_path / "out" / "a" / "report.html").exists()
