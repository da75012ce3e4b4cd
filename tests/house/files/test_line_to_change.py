"""Every fault of a recording.toml is answered with the number of the line to change."""

from __future__ import annotations

import re

import pytest

from ovines.__main__ import main
from ovines.errors import InputError
from ovines.recording import read_recording
from tests.conftest import recording_toml, write_small_recording

TEXT = (
    recording_toml()
    + '\n[excitation]\nfrequency_hz = 11.0\naxis = "x"\n\n[model]\neffects = ["floor_friction"]\nrestitution = 0.72\n'
)

# what is replaced by what; the line that must be named is the first one that holds the third text
FAULTS = {
    "unknown key": ("frame_rate_hz = 800.0", "frame_rate = 800.0", "frame_rate ="),
    "unknown section": ("[excitation]", "[shaker]", "[shaker]"),
    "format of the future": ("format = 1", "format = 2", "format ="),
    "text for a number": ("frame_rate_hz = 800.0", 'frame_rate_hz = "800"', "frame_rate_hz"),
    "rate of zero": ("frame_rate_hz = 800.0", "frame_rate_hz = 0.0", "frame_rate_hz"),
    "rate that is no number": ("frame_rate_hz = 800.0", "frame_rate_hz = nan", "frame_rate_hz"),
    "three sizes": ("sensor_size_px = [4096, 3072]", "sensor_size_px = [4096, 3072, 1]", "sensor_size_px"),
    "fraction of a pixel": (
        "window_offset_px = [0, 1192]",
        "window_offset_px = [0.5, 1192]",
        "window_offset_px = [0.5",
    ),
    "negative window": ("window_offset_px = [0, 900]", "window_offset_px = [0, -900]", "window_offset_px = [0, -900"),
    "path for a name": ('name = "VW2"', 'name = "../VW2"', 'name = "../VW2"'),
    "marker without a place": (
        'markers = ["H1", "H2", "H3", "H4"]',
        'markers = ["H1", "H2", "H3", "H4", "H5"]',
        "layout_m",
    ),
    "marker twice": ('"N4", "N5"', '"N4", "N4"', '"N4", "N4"'),
    "marker on two bodies": ('"N4", "N5"', '"N4", "H1"', '"N4", "H1"'),
    "wall of no size": ("inner_radius_m = 0.05", "inner_radius_m = -0.05", "inner_radius_m"),
    "wall in millimetres": ("inner_radius_m = 0.05", "inner_radius_mm = 50", "inner_radius_mm"),
    "two corners": ("inner_radius_m = 0.05", "polygon_m = [[0, 0], [1, 1]]", "polygon_m"),
    "clockwise": ("inner_radius_m = 0.05", "polygon_m = [[0, 0], [0, 1], [1, 1], [1, 0]]", "polygon_m"),
    "no wall": ("inner_radius_m = 0.05\n", "", "[bodies.host]"),
    "disk without a radius": ("radius_m = 0.01\nmass", "mass", "[bodies.nes]"),
    "disk larger than the ring": ("radius_m = 0.01\nmass", "radius_m = 0.06\nmass", "radius_m = 0.06"),
    "place of two numbers": ("layout_m = [[0.046359, 0.01873, 0.01]", "layout_m = [[0.046359, 0.01873]", "layout_m"),
    "unknown centre marker": ('centre_marker = "N1"', 'centre_marker = "X"', "centre_marker"),
    "heavy inertia": ("inertia_factor = 0.5", "inertia_factor = 5", "inertia_factor"),
    "unknown axis": ('axis = "x"', 'axis = "w"', "axis"),
    "frequency missing": ("frequency_hz = 11.0\n", "", "[excitation]"),
    "restitution above one": ("restitution = 0.72", "restitution = 1.2", "restitution"),
    "unknown effect": ('effects = ["floor_friction"]', 'effects = ["flor_friction"]', "effects"),
    "effects that are no list": ('effects = ["floor_friction"]', 'effects = "floor_friction"', "effects"),
    "camera twice": ('name = "VW2"', 'name = "VW1" # again', "# again"),
    "calibration nowhere": ('file = "../calibration.json"', 'file = "../none.json"', "file ="),
    "calibration of two kinds": (
        'file = "../calibration.json"',
        'file = "../calibration.json"\nboard = "b"',
        "[calibration]",
    ),
    "trigger nowhere": ("frame_rate_hz = 800.0", 'trigger = "none.csv"', "trigger ="),
    "bracket left open": ("[time]", "[time", "[time"),
    "key twice": ("frame_rate_hz = 800.0", "frame_rate_hz = 800.0\nframe_rate_hz = 800.0", None),
    "comma for a point": ("frame_rate_hz = 800.0", "frame_rate_hz = 800,0", "frame_rate_hz"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_the_line_is_named(fault, tmp_path, capsys):
    folder = write_small_recording(tmp_path / "run-01", frames=20).folder
    old, new, holds = FAULTS[fault]
    assert old in TEXT
    path = folder / "recording.toml"
    path.write_text(TEXT.replace(old, new, 1), encoding="utf-8")
    assert main(["check", str(folder)]) == 2
    printed = capsys.readouterr().out
    line = re.search(r"line (\d+)", printed)
    assert line, printed
    lines = path.read_text().splitlines()
    at = int(line[1])
    if holds is None:
        assert 1 <= at <= len(lines) + 1
    else:
        assert holds in lines[at - 1], f"line {at} ({lines[at - 1]!r}) of:\n{printed}"


def test_the_text_without_a_fault_passes(tmp_path):
    folder = write_small_recording(tmp_path / "run-01", frames=20).folder
    (folder / "recording.toml").write_text(TEXT, encoding="utf-8")
    assert main(["check", str(folder)]) == 0


def test_the_run_says_the_same(tmp_path):
    folder = write_small_recording(tmp_path / "run-01", frames=20).folder
    (folder / "recording.toml").write_text(TEXT.replace("inertia_factor = 0.5", "inertia_factor = 5"))
    with pytest.raises(InputError, match=r"line \d+.*inertia_factor"):
        read_recording(folder)
