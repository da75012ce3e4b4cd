"""Times of frames from trigger.csv, however it counts them."""

import numpy as np
import pytest

from ovines.recording import read_recording
from vision.frames.times import frame_times

TOML = """format = 1
[time]
frame_rate_hz = 800.0
trigger = "trigger.csv"
""" + "".join(
    f'[[cameras]]\nname = "{name}"\nframes = "{name}/*.png"\nsensor_size_px = [64, 64]\nwindow_offset_px = [0, '
    f"0]\nwindow_size_px = [64, 64]\n"
    for name in ("a", "b")
)


def recording(folder, first_file, numbers):
    (folder / "recording.toml").write_text(TOML)
    for name in ("a", "b"):
        (folder / name).mkdir()
        for k in range(10):
            (folder / name / f"frame_{first_file + k:04d}.png").write_bytes(b"")
    times = 0.5 + np.cumsum(np.random.default_rng(1).uniform(1e-3, 2e-3, len(numbers)))
    (folder / "trigger.csv").write_text(
        "frame,time_s\n" + "".join(f"{n},{t:.9f}\n" for n, t in zip(numbers, times, strict=True))
    )
    return read_recording(folder), times.round(9)


@pytest.mark.parametrize(("first_file", "first_row"), [(0, 0), (1, 0), (1, 1), (250, 250), (250, 0)])
def test_a_trigger_counts_from_nought_or_as_the_pictures_names_do(tmp_path, first_file, first_row):
    rec, times = recording(tmp_path, first_file, list(range(first_row, first_row + 10)))
    found, notes = frame_times(rec, np.arange(10))
    np.testing.assert_allclose(found, times, atol=1e-12)
    assert bool(notes) == (first_row > 0) and all("as the pictures' names do" in note for note in notes)


def test_missed_pulses_are_filled_in_and_noted(tmp_path):
    rec, times = recording(tmp_path, 0, [0, 1, 2, 4, 5, 6, 7, 8, 9])
    found, notes = frame_times(rec, np.arange(10))
    assert found[3] == pytest.approx(0.5 * (times[2] + times[3])) and "no time for 1 frames (3)" in notes[0]


def test_a_missed_first_pulse_is_no_other_count(tmp_path):
    rec, times = recording(tmp_path, 1, list(range(1, 10)))  # ten pictures, nine pulses: the first is missing
    found, notes = frame_times(rec, np.arange(10))
    np.testing.assert_allclose(found[1:], times, atol=1e-12)
    assert "no time for 1 frames (0)" in notes[0]
