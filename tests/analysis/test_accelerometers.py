"""A record of accelerometers with known offset, clock, noise and gain beside a Host of known motion."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from analysis.accelerometers.compare import compare_accelerometers
from analysis.accelerometers.record import read_record
from ovines.__main__ import main
from ovines.errors import InputError
from ovines.recording import read_recording
from ovines.tables import read_table, write_table

FRAMES_HZ, RATE_HZ, CAMERAS_SD_M, RECORD_SD_M_PER_S2 = 800.0, 10_000.0, 3e-5, 0.3
OFFSET_S, SCALE = 0.7312, 1 + 8e-5  # the cameras' time of the record's 0, and their seconds in one of its
DIRECTION_RAD, GAINS = 0.2, (0.98, 1.03)  # of the shaker; what the channels read of what is there
AMPLITUDE_M, FREQUENCY_HZ, GRAVITY = 0.0164, 11.0, 9.80665
TOML = """format = 1
[bodies.host]
inner_radius_m = 0.05
[bodies.nes]
radius_m = 0.01
[accelerometers]
file = "record.csv"
{start}
[[accelerometers.channels]]
column = "channel 2"
direction = "x"
unit = "V"
sensitivity_mv_per_g = 10.4
[[accelerometers.channels]]
column = "channel 3"
direction = {direction}
body = "table"
"""


def steady(time_s):
    """Displacement and acceleration of a sine."""
    omega = 2 * np.pi * FREQUENCY_HZ
    place = AMPLITUDE_M * np.sin(omega * time_s + 0.3)
    return place, -(omega**2) * place


def started(time_s):
    """The same, coming up from rest at 1 s: a (1 - exp(-s/T))^2 sin(omega s), differentiated by hand."""
    since, omega, rise = np.clip(time_s - 1.0, 0.0, None), 2 * np.pi * FREQUENCY_HZ, 0.15
    e = np.exp(-since / rise)
    u, du, ddu = (1 - e) ** 2, 2 * (1 - e) * e / rise, 2 * e * (2 * e - 1) / rise**2
    sine, cosine = np.sin(omega * since), np.cos(omega * since)
    acceleration = ddu * sine + 2 * du * omega * cosine - u * omega**2 * sine
    return AMPLITUDE_M * u * sine, AMPLITUDE_M * acceleration


def write_run(folder, path, rng, start="", direction='"y"', seconds=3.0):
    """A recording of a Host on ``path`` by cameras and accelerometers; the disk lies still beside its wall."""
    folder.mkdir(parents=True, exist_ok=True)
    time_s = np.arange(0, seconds, 1 / FRAMES_HZ)
    along = np.array([np.cos(DIRECTION_RAD), np.sin(DIRECTION_RAD)])
    host = np.array([0.3, -0.1]) + path(time_s)[0][:, None] * along
    noise = CAMERAS_SD_M * rng.standard_normal((len(time_s), 3))
    columns = {"frame": np.arange(len(time_s)), "time_s": time_s}
    columns |= {"host_x_m": host[:, 0] + noise[:, 0], "host_y_m": host[:, 1] + noise[:, 1], "host_z_m": noise[:, 2]}
    columns |= {"host_angle_rad": 1e-4 * rng.standard_normal(len(time_s))}
    columns |= {"nes_x_m": columns["host_x_m"] + 0.02, "nes_y_m": columns["host_y_m"], "nes_z_m": noise[:, 2]}
    motion = pd.DataFrame(columns | {"nes_angle_rad": np.nan})
    write_table(motion, "motion", folder / "motion.parquet", {})
    own_s = np.arange(0, seconds - 0.5, 1 / RATE_HZ)
    seen = path(OFFSET_S + SCALE * own_s)[1][:, None] * along * GAINS
    seen += 0.3 + RECORD_SD_M_PER_S2 * rng.standard_normal(seen.shape)  # a bias, too
    record = pd.DataFrame({"time_s": own_s, "channel 2": seen[:, 0] / GRAVITY * 10.4e-3, "channel 3": seen[:, 1]})
    record.to_csv(folder / "record.csv", index=False)
    (folder / "recording.toml").write_text(TOML.format(start=start, direction=direction), encoding="utf-8")
    return motion, record


def compared(folder):
    recording = read_recording(folder)
    return compare_accelerometers(read_table(folder / "motion.parquet", "motion"), read_record(recording), FREQUENCY_HZ)


@pytest.mark.others_further
@pytest.mark.parametrize("seed", [1, 2])
def test_offset_scale_and_gains_of_a_drive_that_starts(tmp_path, seed):
    """Errors within 4 standard deviations, and these as small as they should be: a phase of noise over amplitude."""
    write_run(tmp_path, started, np.random.default_rng(seed))
    found = compared(tmp_path)
    assert not found.notes
    x, y = (row for _, row in found.channels.iterrows())
    assert np.isnan(x["other_offset_s"])  # the start tells the period
    assert abs(x["offset_s"] - OFFSET_S) < 4 * x["offset_sd_s"]
    assert abs(x["time_scale"] - SCALE) < 4 * x["time_scale_sd"]
    # noise over speed over the root of the frames: 0.5 um of phase; the middle of the run is known to microseconds
    least = CAMERAS_SD_M / (AMPLITUDE_M * 2 * np.pi * FREQUENCY_HZ) / np.sqrt(x["frames"])
    assert 0.3 * least < x["middle_sd_s"] < 6 * least
    for row, gain in ((x, GAINS[0]), (y, GAINS[1])):
        assert abs(row["gain"] - 1 / gain) < 4 * row["gain_sd"] < 4e-3
        # noise over amplitude over the root of the frames is 0.3 mrad along y, which moves a fifth of x
        assert abs(row["phase_rad"]) < (1e-3 if row is x else 5e-3)
        # both lose the noise of a record's mean over a frame's interval, and of the path
        assert row["error_with_gain_m"] == pytest.approx(CAMERAS_SD_M, rel=0.1)
    assert x["sensitivity_mv_per_g"] == pytest.approx(10.4 * GAINS[0], rel=1e-3)
    assert np.isnan(y["sensitivity_mv_per_g"])


def test_a_steady_drive_repeats_itself_and_the_start_tells_the_period(tmp_path):
    period_s = 1 / FREQUENCY_HZ
    for start_s in (OFFSET_S, OFFSET_S + 2 * period_s):
        write_run(tmp_path, steady, np.random.default_rng(4), f"start_s = {start_s}")
        found = compared(tmp_path)
        row = found.channels.iloc[0]
        assert abs(row["offset_s"] - start_s) < 2e-5 and "repeats itself" in " ".join(found.notes)
        assert abs(row["other_offset_s"] - row["offset_s"]) == pytest.approx(period_s, rel=1e-3)
        omega_squared = (2 * np.pi * FREQUENCY_HZ) ** 2
        truth = AMPLITUDE_M * np.cos(DIRECTION_RAD) * omega_squared
        assert row["cameras_amplitude_m_per_s2"] == pytest.approx(truth, rel=2e-4)
        assert row["record_amplitude_m_per_s2"] == pytest.approx(GAINS[0] * truth, rel=2e-4)
        assert row["cameras_frequency_hz"] == pytest.approx(FREQUENCY_HZ, rel=1e-5)
        assert row["record_frequency_hz"] == pytest.approx(FREQUENCY_HZ * SCALE, rel=1e-5)
        # what the stated gain leaves of the main line, and the noise of 12.5 samples
        left = np.hypot((1 - GAINS[0]) * truth / np.sqrt(2), RECORD_SD_M_PER_S2 / np.sqrt(RATE_HZ / FRAMES_HZ))
        assert row["error_m_per_s2"] == pytest.approx(left, rel=0.05)
        assert row["error_with_gain_m_per_s2"] < 0.15


@pytest.mark.further
def test_a_record_without_a_clock_and_in_parquet_gives_the_same(tmp_path):
    _, record = write_run(tmp_path, started, np.random.default_rng(5))
    first = compared(tmp_path).channels
    text = (tmp_path / "recording.toml").read_text().replace('"record.csv"', f'"record.parquet"\nrate_hz = {RATE_HZ}')
    (tmp_path / "recording.toml").write_text(text)
    record.drop(columns="time_s").to_parquet(tmp_path / "record.parquet")
    again = compared(tmp_path).channels
    assert np.abs(again["offset_s"] - first["offset_s"]).max() < 1e-9  # the CSV's digits
    assert np.allclose(again["gain"], first["gain"], rtol=1e-9, atol=0)


@pytest.mark.further
def test_a_turned_sensor_and_another_runs_record_are_reported(tmp_path):
    motion, record = write_run(tmp_path, started, np.random.default_rng(6))
    turned = record.assign(**{name: -record[name] for name in ("channel 2", "channel 3")})
    turned.to_csv(tmp_path / "record.csv", index=False)
    found = compared(tmp_path)
    assert found.channels is None and "turned round" in found.notes[0]
    noise = np.random.default_rng(7).standard_normal((len(record), 2))
    record.assign(**{"channel 2": noise[:, 0], "channel 3": noise[:, 1]}).to_csv(tmp_path / "record.csv", index=False)
    found = compared(tmp_path)
    assert found.channels is None and "no offset" in found.notes[0]
    still = motion.assign(host_x_m=0.0, host_y_m=0.0, host_z_m=0.0, host_angle_rad=0.0)
    found = compare_accelerometers(still, read_record(read_recording(tmp_path)), None)
    assert found.channels is None and "stands still" in found.notes[0]


def test_a_sensor_beyond_its_range_is_reported(tmp_path):
    _, record = write_run(tmp_path, steady, np.random.default_rng(8))
    record["channel 3"] = record["channel 3"].clip(upper=10.0)
    record.to_csv(tmp_path / "record.csv", index=False)
    assert read_record(read_recording(tmp_path)).clipped == (False, True)
    assert any("beyond its range" in note for note in compared(tmp_path).notes)


FAULTS = {
    "no such file": (lambda table: None, "is not there"),
    "no such column": (lambda table: table.rename(columns={"channel 3": "channel 4"}), "channel 3"),
    "no times": (lambda table: table.drop(columns="time_s"), "rate_hz"),
    "times back": (lambda table: table.assign(time_s=-table["time_s"]), "increas"),
    "a gap": (lambda table: table.assign(**{"channel 2": table["channel 2"].where(table.index != 5)}), "sample 5"),
    "unplugged": (lambda table: table.assign(**{"channel 2": 0.0}), "throughout"),
    "words": (lambda table: table.astype(object).replace(0.0, "start"), "numbers"),
}


@pytest.mark.others_further
@pytest.mark.parametrize("name", FAULTS)
def test_check_and_run_refuse_the_same(tmp_path, capsys, name):
    _, record = write_run(tmp_path / "run", steady, np.random.default_rng(9), seconds=1.5)
    spoil, word = FAULTS[name]
    (tmp_path / "run" / "record.csv").unlink()
    if (spoiled := spoil(record)) is not None:
        spoiled.to_csv(tmp_path / "run" / "record.csv", index=False)
    with pytest.raises(InputError, match=word):
        read_record(read_recording(tmp_path / "run"))
    assert main(["check", str(tmp_path / "run")]) == 2
    said = capsys.readouterr().out
    assert word in said and "recording.toml" in said
    assert main(["analyse", str(tmp_path / "run"), "--out", str(tmp_path / "out")]) == 2
    assert word in capsys.readouterr().err


@pytest.mark.parametrize(
    ("old", "new", "word"),
    [
        ('unit = "V"\n', "", "sensitivity_mv_per_g"),
        ("sensitivity_mv_per_g = 10.4\n", "", "sensitivity_mv_per_g"),
        ('column = "channel 3"', 'column = "channel 2"', "each column once"),
        ('direction = "x"', "direction = [0.0, 0.0, 0.0]", "no length"),
        ('direction = "x"', 'direction = "w"', "direction"),
        ('body = "table"', 'body = "nes"', "body"),
    ],
)
def test_a_wrong_section_is_refused_with_its_line(tmp_path, old, new, word):
    text = TOML.format(start="", direction='"y"')
    assert old in text
    (tmp_path / "recording.toml").write_text(text.replace(old, new, 1))
    with pytest.raises(InputError, match=r"recording.toml, line \d+") as caught:
        read_recording(tmp_path)
    assert word in str(caught.value)


@pytest.mark.further
def test_tables_and_the_page(tmp_path, capsys):
    write_run(tmp_path / "run", started, np.random.default_rng(10), direction="[0.0, 2.0, 0.0]")
    assert main(["check", str(tmp_path / "run")]) == 0
    assert "10000 samples per second" in capsys.readouterr().out
    out = tmp_path / "out"
    assert main(["analyse", str(tmp_path / "run"), "--out", str(out)]) == 0
    assert main(["report", str(tmp_path / "run"), "--out", str(out)]) == 0
    channels = read_table(out / "accelerometers.parquet", "accelerometers")
    over_time = read_table(out / "accelerations.parquet", "accelerations")
    assert list(channels["channel"]) == ["channel 2", "channel 3"] and len(over_time) == channels["frames"].sum()
    left = over_time["record_m_per_s2"] - over_time["cameras_m_per_s2"]
    rms = np.sqrt((left**2).groupby(over_time["channel"]).mean())
    assert np.allclose(rms, channels["error_m_per_s2"], rtol=1e-9, atol=0)
    page = (out / "report.html").read_text(encoding="utf-8")
    assert 'id="accelerometers"' in page and "channel 2" in page
