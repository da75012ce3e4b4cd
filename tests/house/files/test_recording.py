"""recording.toml, trigger.csv and series: read as written, refused with file, line and key."""

import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ovines.errors import InputError
from ovines.recording import read_recording, read_series, series_folders
from tests.conftest import drawn, recording_toml


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "recording.toml").write_text(recording_toml())
    return tmp_path


def change(folder, old, new):
    text = (folder / "recording.toml").read_text()
    assert old in text
    (folder / "recording.toml").write_text(text.replace(old, new, 1), encoding="utf-8")


def test_a_recording_is_what_its_file_says(folder):
    recording = read_recording(folder)
    assert recording.name == "small" and recording.frame_rate_hz == 800.0
    assert recording.window_offset_px["VW2"] == (0, 900)
    assert recording.bodies["nes"].radius_m == 0.01 and recording.bodies["host"].inner_radius_m == 0.05
    assert "ground" not in recording.bodies
    assert recording.markers == ("H1", "H2", "H3", "H4", "N1", "N2", "N3", "N4", "N5")
    assert recording.calibration_file.resolve() == (folder.parent / "calibration.json").resolve()
    np.testing.assert_allclose(recording.times_s([0, 8]), [0.0, 0.01], rtol=1e-7)
    assert pickle.loads(pickle.dumps(recording)).settings == recording.settings


def test_the_practice_series_are_read(shared):
    series = read_series(shared / "practice" / "practice-16")
    assert [recording.folder.name for recording in series] == [f"run-{i:02d}" for i in range(1, 13)]
    assert {recording.entry() for recording in series} == {"tracks"}
    assert series[0].model.effects


REFUSED = {
    "unknown key": ("frame_rate_hz", "frame_rat_hz", ("line 5", "unknown key 'time.frame_rat_hz'", "'frame_rate_hz'?")),
    "unknown section": ("[calibration]", "[calibratoin]", ("unknown key 'calibratoin'", "did you mean 'calibration'?")),
    "no name of a camera": ('name = "VW2"\n', "", ("no key 'cameras[1].name'",)),
    "text for a number": ("radius_m = 0.01", 'radius_m = "0.01"', ("'bodies.nes.radius_m' is '0.01'",)),
    "NaN": ("= 800.0", "= nan", ("'time.frame_rate_hz' is nan", "finite")),
    "negative": ("= 800.0", "= -800.0", ("greater than 0",)),
    "another format": ("format = 1", "format = 2", ("line 1", "'format' is 2")),
    "window off the sensor": ("[4096, 688]", "[4096, 2688]", ("window of VW1 ends at 3880 px",)),
    "marker on two bodies": ('"N5"', '"H4"', ("marker 'H4' is on host and on nes",)),
    "layout of another length": ('"N4", "N5"]', '"N4"]', ("5 positions in layout_m", "4 markers")),
    "unknown centre marker": ('centre_marker = "N1"', 'centre_marker = "N9"', ("centre_marker 'N9'",)),
    "no wall": ("inner_radius_m = 0.05\n", "", ("neither inner_radius_m nor polygon_m",)),
    "clockwise polygon": (
        "inner_radius_m = 0.05", "polygon_m = [[0, 0], [0, 0.1], [0.1, 0]]", ("polygon_m runs clockwise",),
    ),
    "NES too large": ("radius_m = 0.01\n", "radius_m = 0.06\n", ("has no room",)),
    "a path for a name": ('name = "VW1"', 'name = "../VW1"', ("without slashes",)),
    "same camera twice": ('name = "VW2"', 'name = "VW1"', ("each camera name once",)),
    "half a calibration": ('file = "../calibration.json"', 'board = "b"', ("no intrinsic, extrinsic",)),
    "broken TOML": ("[time]", "[time", ("line 4",)),
    "huge number": ("0.0246", "1" + "0" * 5000, ("recording.toml",)),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_wrong_settings_are_refused(case, folder):
    old, new, words = REFUSED[case]
    change(folder, old, new)
    with pytest.raises(InputError) as refusal:
        read_recording(folder)
    for word in ("recording.toml", *words):
        assert word in str(refusal.value)


def test_not_utf8_and_not_there(tmp_path):
    with pytest.raises(InputError, match="is not there"):
        read_recording(tmp_path / "none")
    with pytest.raises(InputError, match="is not there"):
        read_recording(tmp_path)
    (tmp_path / "recording.toml").write_bytes(b'name = "\xff\xfe"')
    with pytest.raises(InputError, match="UTF-8"):
        read_recording(tmp_path)


@drawn(150)
@given(data=st.data())
def test_a_mangled_file_is_read_or_refused(folder, data):
    """Lines dropped, doubled, cut or replaced by any text: a Recording or InputError."""
    lines = recording_toml().splitlines()
    for _ in range(data.draw(st.integers(1, 3))):
        i = data.draw(st.integers(0, len(lines) - 1))
        lines[i] = data.draw(
            st.one_of(
                st.just(""),
                st.just(lines[i] + "\n" + lines[i]),
                st.text(max_size=40),
                st.just(lines[i][: len(lines[i]) // 2]),
            )
        )
    (folder / "recording.toml").write_text("\n".join(lines), encoding="utf-8", errors="surrogatepass")
    try:
        read_recording(folder)
    except InputError as error:
        assert error.found and error.expected and error.do


def test_entry_is_the_furthest_table(folder):
    with pytest.raises(InputError, match="no frames in"):
        read_recording(folder).entry()
    for name in ("tracks", "points", "motion"):
        (folder / f"{name}.parquet").touch()
        assert read_recording(folder).entry() == name


def test_frames_in_natural_order_and_names_with_anything(tmp_path):
    folder = tmp_path / "Prüfstand [3] ä b"
    (folder / "VW 1").mkdir(parents=True)
    (folder / "recording.toml").write_text(
        recording_toml().replace('name = "VW1"', 'name = "VW1"\nframes = "VW 1/*.png"'), encoding="utf-8"
    )
    for number in (10, 9, 1, 100):
        (folder / "VW 1" / f"bild_{number}.png").touch()
    (folder / "VW 1" / ".hidden.png").touch()
    names = [path.name for path in read_recording(folder).frame_files("VW1")]
    assert names == ["bild_1.png", "bild_9.png", "bild_10.png", "bild_100.png"]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("frame,time_s\n0,0.0\n1,0.0\n", "frame 1 at 0.0 s after frame 0"),
        ("frame,time_s\n0,0.0\n0,0.1\n", "frame 0 at 0.1 s after frame 0"),
        ("frame,time_s\n0,nan\n", "nan"),
        ("frame,time_s\n-1,0\n", "frame -1"),
        ("frame,time_s\n0\n", "line 2"),
        ("frame,time_s\n", "no rows"),
        ("frame;time_s\n0;0\n", "header"),
        ("", "header"),
    ],
)
def test_wrong_triggers_are_refused(folder, text, reason):
    change(folder, "frame_rate_hz = 800.0", 'frame_rate_hz = 800.0\ntrigger = "trigger.csv"')
    (folder / "trigger.csv").write_text(text)
    with pytest.raises(InputError) as refusal:
        read_recording(folder).times_s([0])
    assert reason in refusal.value.found and "trigger.csv" in refusal.value.found


def test_the_trigger_wins_over_the_frame_rate(folder):
    change(folder, "frame_rate_hz = 800.0", 'frame_rate_hz = 800.0\ntrigger = "trigger.csv"')
    (folder / "trigger.csv").write_text("frame,time_s\n0,-0.001\n1,0.0003\n3,0.9\n")
    recording = read_recording(folder)
    np.testing.assert_array_equal(recording.times_s([3, 0]), [0.9, -0.001])
    with pytest.raises(InputError, match="no time for frame 2"):
        recording.times_s([0, 2])


def test_series_are_sorted_and_one_level_deep(tmp_path):
    for name in ("run-10", "run-02", "run-01/deeper"):
        (tmp_path / name).mkdir(parents=True)
        (tmp_path / name / "recording.toml").write_text(recording_toml())
    (tmp_path / "run-01" / "up").symlink_to(tmp_path)
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    assert [path.name for path in series_folders(tmp_path)] == ["run-02", "run-10"]
    assert series_folders(tmp_path / "run-02") == [tmp_path / "run-02"]
    empty = tmp_path / "empty"
    empty.mkdir()
    with pytest.raises(InputError, match=r"no recording\.toml"):
        series_folders(empty)
