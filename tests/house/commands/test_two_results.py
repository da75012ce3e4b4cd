"""`ovines compare RESULTS RESULTS`: what was done differently is named, and what it changed is counted."""

import shutil

import numpy as np
import pandas as pd
import pytest

from ovines.__main__ import main
from ovines.tables import read_provenance, read_table, write_table
from ovines.two_results import parameters_side_by_side
from tests.conftest import write_small_recording
from tests.house.commands.test_commands import change_toml


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A recording analysed twice, the second time with a camera's window 3 px elsewhere; parameters put beside."""
    day = tmp_path_factory.mktemp("two")
    recording = write_small_recording(day / "run-1", frames=40).folder
    assert main(["analyse", str(recording), "--out", str(day / "first")]) == 0
    change_toml(recording, "window_offset_px = [0, 900]", "window_offset_px = [0, 903]")
    assert main(["analyse", str(recording), "--out", str(day / "second")]) == 0
    for name, value in (("first", 0.72), ("second", 0.725)):
        table = pd.DataFrame({"parameter": ["restitution", "wall_friction"], "value": [value, np.nan],
                              "sd": [0.002, np.nan], "low": [0.7, np.nan], "high": [0.73, np.nan],
                              "n_impacts": [9, 0]})  # fmt: skip
        write_table(table, "identification", day / name / "identification.parquet", {"key": name})
    return day


@pytest.mark.further
def test_settings_and_their_effect_are_reported(made, capsys):
    assert main(["compare", str(made / "first"), str(made / "second")]) == 0
    said = capsys.readouterr().out
    assert "triangulate: cameras.VW2.window_offset_px [0, 900] -> [0, 903]" in said
    assert "analyse: read other points.parquet or motion.parquet" in said and "motion, 40 frames of both: NES" in said
    assert "Restitution: 0.7200 ± 0.0020 -> 0.7250 ± 0.0020  (2.5 sd)" in said and "Wall friction: – -> –" in said
    one, two = (read_table(made / name / "motion.parquet", "motion") for name in ("first", "second"))
    rms_mm = 1e3 * np.sqrt(np.mean((one["nes_x_m"] - two["nes_x_m"]) ** 2 + (one["nes_y_m"] - two["nes_y_m"]) ** 2))
    assert f"NES {rms_mm:.2g} mm" in said or f"NES {1e3 * rms_mm:.0f} µm" in said


def test_the_same_results_are_alike(made, tmp_path, capsys):
    shutil.copytree(made / "first", tmp_path / "copy")
    assert main(["compare", str(made / "first"), str(tmp_path / "copy")]) == 0
    said = capsys.readouterr().out
    assert "done alike" in said and "0.7200 ± 0.0020 -> 0.7200 ± 0.0020  (same)" in said


def test_a_stage_that_only_one_has_and_another_version(made, tmp_path, capsys):
    shutil.copytree(made / "first", tmp_path / "other")
    (tmp_path / "other" / "points.parquet").unlink()
    path = tmp_path / "other" / "motion.parquet"
    write_table(
        read_table(path, "motion"), "motion", path, {**read_provenance(path), "version": "0.0.9", "code": "old"}
    )
    assert main(["compare", str(tmp_path / "other"), str(made / "first")]) == 0
    said = capsys.readouterr().out
    assert f"triangulate: in {made / 'first'} only" in said and "analyse: version 0.0.9 -> 0.1.0" in said
    assert "analyse: code old ->" in said


def test_parameters_of_one_only_stand_alone(made, tmp_path):
    shutil.copytree(made / "first", tmp_path / "other")
    (tmp_path / "other" / "identification.parquet").unlink()
    table = parameters_side_by_side(made / "first", tmp_path / "other")
    assert set(table["parameter"]) == {"restitution", "wall_friction"} and table["sds"].isna().all()


def test_two_recordings_are_no_two_results(made, tmp_path, capsys):
    other = write_small_recording(tmp_path / "day" / "run-2", frames=40, seed=2).folder
    assert main(["analyse", str(other), "--out", str(tmp_path / "other")]) == 0
    capsys.readouterr()
    assert main(["compare", str(made / "first"), str(tmp_path / "other")]) == 2
    assert "two results of one recording" in capsys.readouterr().err
    assert main(["compare", str(made / "first"), str(tmp_path)]) == 2
    assert "holds no results" in capsys.readouterr().err
