"""A Host that moves as it was measured: a table of times and places in place of harmonics."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from ovines.__main__ import main
from ovines.core import MeasuredMotion, simulate
from ovines.core.refusal import ScenarioError
from ovines.core.system.named import named_scenario
from ovines.tables import TABLES, write_table


def as_table(drive, rate_hz, duration_s):
    """The drive's path at ``rate_hz``, by its definition: a sum of a sin(2 pi f t + phase)."""
    time_s = np.arange(-0.01, duration_s + 0.01, 1 / rate_hz)
    place = {
        axis: sum(
            (h.amplitude * np.sin(2 * np.pi * h.frequency_hz * time_s + h.phase_rad) for h in drive if h.axis == axis),
            np.zeros_like(time_s),
        )
        for axis in ("x", "y", "rotation", "z")
    }
    return MeasuredMotion(time_s, place["x"], place["y"], place["rotation"], place["z"])


@pytest.mark.parametrize("name", ["rig", "table-15-case-2"])
def test_a_measured_path_moves_the_disk_as_its_harmonics_do(name):
    """To 1e-8 m before errors grow over impacts: a spline through samples 50 us apart misses a path of 11 Hz by far
    less (its fourth derivative times h^4/384 is 1e-13 m), and its acceleration by h^2/12 of the fourth, 4e-6 m/s^2."""
    duration_s = 0.1
    harmonic = named_scenario(name, duration_s=duration_s, sample_rate_hz=800.0)
    table = as_table(harmonic.host.drive, 20_000.0, duration_s)
    measured = replace(harmonic, host=replace(harmonic.host, drive=(), table=table))
    by_drive, by_table = simulate(harmonic), simulate(measured)
    assert len(by_drive.impacts) == len(by_table.impacts) > 0
    first = by_drive.impacts["time_s"][0]
    assert abs(by_table.impacts["time_s"][0] - first) < 1e-8
    for body in ("nes", "host"):
        for axis in "xy":
            before = by_drive.time_s <= first
            gone = np.abs(by_table.motion[f"{body}_{axis}_m"] - by_drive.motion[f"{body}_{axis}_m"])
            assert gone[before].max() < 1e-8
            assert gone.max() < 1e-5  # each impact takes an error by about three
    # it does move: without its drive the disk meets the wall elsewhere
    still = replace(harmonic, host=replace(harmonic.host, drive=(), motion="fixed"))
    assert np.abs(simulate(still).motion["nes_x_m"] - by_drive.motion["nes_x_m"]).max() > 1e-4


FILE = """
format = 1
name = "as measured"
[nes]
radius_m = 0.01
mass_kg = 0.0246
[host]
radius_m = 0.05
motion = "driven"
[host.drive]
table = "motion.parquet"
[impact]
restitution = 0.72
wall_friction = 0.13
tangential_restitution = 0.49
[run]
duration_s = 0.1
"""


@pytest.mark.parametrize(
    ("first_s", "last_s", "do"),
    [
        (0.0, 0.1, None),
        (0.0, 0.0995, None),  # n frames last n steps
        (-1.0, 1.0, None),
        (0.0, 0.099, "set run.duration_s = 0.099 or less"),
        (0.0, 0.03, "set run.duration_s = 0.03 or less"),
        (0.05, 0.2, "count the table's time_s from the start of the run"),
    ],
)
def test_a_table_that_does_not_cover_the_run_is_refused(first_s, last_s, do, tmp_path, capsys):
    """It went on by its last cubic without a word: from 0.03 s to 57 mm at 0.1 s, of a Host that moves by 16 mm."""
    time_s = np.arange(round(2000 * first_s), round(2000 * last_s) + 1) / 2000
    shaken_m = 0.0164 * np.sin(2 * np.pi * 11.0 * time_s)
    motion = empty_motion(len(time_s)).assign(time_s=time_s, host_x_m=shaken_m, host_y_m=0.0)
    write_table(motion, "motion", tmp_path / "motion.parquet", {})
    (tmp_path / "scenario.toml").write_text(FILE)
    status = main(["simulate", str(tmp_path / "scenario.toml"), "--out", str(tmp_path / "out")])
    if do is None:
        assert status == 0
        return
    said = " ".join("".join(capsys.readouterr()).split())
    assert status == 2 and not (tmp_path / "out").exists()
    assert f"a Host table from {first_s:g} to {last_s:g} s for a run of 0.1 s from 0" in said and do in said


@pytest.mark.parametrize(
    ("missing", "first_s", "noise_m", "refused"),
    [
        (1, 0.03, 0.0, False),  # 1 ms of 91 ms: a spline carries it to some um
        (40, 0.03, 0.0, True),  # a quarter of a period
        (120, 0.12, 0.0, False),  # after the run
        (10, 0.03, 2e-4, False),  # what is missed is noise
        (170, 0.02, 0.0, True),  # nowhere are as many in a row
    ],
)
def test_a_gap_that_a_spline_cannot_carry_is_refused(missing, first_s, noise_m, refused):
    """It was splined over without a word, at 40 frames by millimetres."""
    time_s = np.arange(600) / 2000
    shaken_m = 0.0164 * np.sin(2 * np.pi * 11.0 * time_s) + noise_m * np.random.default_rng(0).standard_normal(600)
    kept = np.ones(600, dtype=bool)
    kept[round(2000 * first_s) : round(2000 * first_s) + missing] = False
    if missing > 150:
        kept[330:] = False
    still = np.zeros(kept.sum())
    table = MeasuredMotion(time_s[kept], shaken_m[kept], still, still, still)
    rig = named_scenario("rig", duration_s=0.1)
    host = replace(rig.host, drive=(), table=table)
    if not refused:
        assert len(simulate(replace(rig, host=host)).impacts) > 0
        return
    with pytest.raises(ScenarioError, match=rf"gap of .* s \({missing} frames\) at 0\.0"):
        replace(rig, host=host)


def empty_motion(rows):
    """Table motion of nothing seen."""
    columns = {column.name: column for column in TABLES["motion"].columns}
    return pd.DataFrame({name: np.full(rows, np.nan) for name in columns}).assign(frame=np.arange(rows))
