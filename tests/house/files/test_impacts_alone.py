"""Impacts by themselves are a recording, motion by itself from any CSV too: imported, identified, diagnosed."""

import json

import numpy as np
import pandas as pd
import pytest

from analysis.identification.given_impacts import identify_impacts
from ovines.__main__ import main
from ovines.recording import read_series
from ovines.tables import read_table

RIG = """format = 1
[bodies.nes]
radius_m = 0.01
mass_kg = 0.0246
inertia_factor = 0.5
"""
TRUE = {"restitution": 0.72, "wall_friction": 0.13, "tangential_restitution": 0.49}


def impacts(rng, count=120, levers=False, slope=0.0):
    """Impacts of Luding's law on a body of that inertia; `levers`: the contact lies beside the centre of mass."""
    gyration2 = 0.5 * 0.01**2
    normal_m = rng.uniform(0.006, 0.012, count) if levers else np.full(count, 0.01)
    along_m = rng.uniform(-0.006, 0.006, count) if levers else np.zeros(count)
    before = rng.uniform(0.3, 3.0, count)
    slip = before * rng.uniform(-2, 2, count)
    restitution = TRUE["restitution"] + slope * np.exp(-before) + 0.01 * rng.standard_normal(count)
    rows = []
    for n, t, v, s, e in zip(normal_m, along_m, before, slip, restitution, strict=True):
        # Change of the contact's velocity (outward, along) by impulses per mass: identity and what the turn adds.
        inverse_mass = np.array(
            [[1 + t * t / gyration2, -n * t / gyration2], [-n * t / gyration2, 1 + n * n / gyration2]]
        )
        stick = np.linalg.solve(inverse_mass, [-(1 + e) * v, -(1 + TRUE["tangential_restitution"]) * s])
        impulse = stick
        if abs(stick[1]) > -TRUE["wall_friction"] * stick[0]:  # slides: friction against the slip it has
            sign = np.sign(stick[1])
            outward = -(1 + e) * v / (inverse_mass[0, 0] - inverse_mass[0, 1] * sign * TRUE["wall_friction"])
            impulse = np.array([outward, -sign * TRUE["wall_friction"] * outward])
        change = inverse_mass @ impulse
        turn = (n * impulse[1] - t * impulse[0]) / gyration2
        rows.append((v, -(v + change[0]), s, s + change[1], 5.0, 5.0 + turn, n, t))
    names = ["normal_speed_before_m_per_s", "normal_speed_after_m_per_s", "tangential_speed_before_m_per_s",
             "tangential_speed_after_m_per_s", "spin_before_rad_per_s", "spin_after_rad_per_s", "lever_normal_m",
             "lever_tangential_m"]  # fmt: skip
    table = pd.DataFrame(rows, columns=names)
    table[names[1:4]] += 2e-3 * rng.standard_normal((count, 3))
    return table if levers else table.drop(columns=names[6:])


def recording(folder, table):
    folder.mkdir(parents=True)
    (folder / "recording.toml").write_text(RIG)
    table.to_csv(folder / "measured.csv", index=False)
    assert main(["import", str(folder), "--impacts", str(folder / "measured.csv")]) == 0
    return folder


@pytest.mark.further
@pytest.mark.parametrize("levers", [False, True])
def test_imported_impacts_are_identified(tmp_path, levers, capsys):
    folder = recording(tmp_path / "run", impacts(np.random.default_rng(1), levers=levers))
    assert main(["check", str(folder)]) == 0
    assert main(["run", str(folder)]) == 0
    found = read_table(folder / "results" / "identification.parquet", "identification").set_index("parameter")
    for name, value in TRUE.items():
        row = found.loc[name]
        assert abs(row["value"] - value) < 3.5 * row["sd"] and row["sd"] < 0.02, (name, row)
    each = read_table(folder / "results" / "impacts.parquet", "impacts")
    assert len(each) == 120 and set(each["regime"]) == {"stick", "slide"} and each["time_s"].isna().all()
    assert "Restitution" in capsys.readouterr().out
    assert (folder / "results" / "report.html").is_file()


@pytest.mark.further
def test_their_law_is_diagnosed(tmp_path):
    """A restitution that falls with the speed is named, one that does not is not."""
    for name, slope in (("plain", 0.0), ("falling", 0.35)):
        rng = np.random.default_rng(2)
        for run in (1, 2, 3):
            recording(tmp_path / name / f"run-{run}", impacts(rng, 80, slope=slope))
        model = tmp_path / f"{name}.toml"
        out = ["--out", str(tmp_path / f"{name}-out"), "--write-model", str(model)]
        assert main(["diagnose", str(tmp_path / name), *out]) == 0
        answer = json.loads((tmp_path / f"{name}-out" / "diagnosis.json").read_text())
        assert answer["effects"] == ([] if name == "plain" else ["speed_dependent_restitution"]), answer["left"]
        assert answer["verdict"] == ("none" if name == "plain" else "effect")
        assert answer["stage"] == (None if name == "plain" else "impact")
        assert answer["gap"]["recalibrated"]["flight_m"] is None
    assert answer["gap"]["shrinkage"] > 0.7
    # What identification finds with the written model is what the diagnosis found: one estimator.
    for run in (1, 2, 3):
        toml = tmp_path / "falling" / f"run-{run}" / "recording.toml"
        toml.write_text(toml.read_text() + "\n" + model.read_text())
    recordings = read_series(tmp_path / "falling")
    tables = [read_table(one.folder / "impacts.parquet", "given_impacts") for one in recordings]
    found = identify_impacts(tables, recordings).identification.set_index("parameter")
    assert "restitution_fast" not in found.index  # stated, so held
    for name, one in answer["nominal"].items():
        assert abs(found.loc[name, "value"] - one["with_effect"]) < 1e-3 * found.loc[name, "sd"], name


def test_speeds_alone_give_the_restitution(tmp_path):
    table = impacts(np.random.default_rng(3)).iloc[:, :2]
    folder = recording(tmp_path / "run", table)
    assert main(["run", str(folder)]) == 0
    found = read_table(folder / "results" / "identification.parquet", "identification").set_index("parameter")
    assert abs(found.loc["restitution", "value"] - 0.72) < 0.005
    assert np.isnan(found.loc["wall_friction", ["value", "low", "high"]].astype(float)).all()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("impact,speed\n0,1\n", "no column normal_speed_before_m_per_s"),
        ("normal_speed_before_m_per_s,normal_speed_after_m_per_s\n1.0,fast\n", "line 2"),
        ("normal_speed_before_m_per_s,normal_speed_after_m_per_s\n1.0,\n", "is missing"),
    ],
)
def test_wrong_impacts_are_refused(tmp_path, text, said, capsys):
    (tmp_path / "recording.toml").write_text(RIG)
    (tmp_path / "a.csv").write_text(text)
    assert main(["import", str(tmp_path), "--impacts", str(tmp_path / "a.csv")]) == 2
    assert said in "".join(capsys.readouterr()) and not (tmp_path / "impacts.parquet").exists()


BOX = """format = 1
[time]
frame_rate_hz = 500.0
[bodies.host]
polygon_m = [[-0.2, -0.1], [0.2, -0.1], [0.2, 0.1], [-0.2, 0.1]]
[bodies.nes]
radius_m = 0.02
mass_kg = 0.03
inertia_factor = 0.5
[model]
effects = []
"""


def bouncing(count=1500, rate_hz=500.0):
    """A puck without friction between flat walls, restitution 0.8 and no friction: place in mm, against the middle."""
    place, speed, rows = np.array([0.03, -0.02]), np.array([1.3, 0.9]), []
    for frame in range(count):
        rows.append((frame / rate_hz, *(1e3 * place)))
        place = place + speed / rate_hz
        for axis, limit in enumerate((0.18, 0.08)):
            if abs(place[axis]) > limit:
                beyond = abs(place[axis]) - limit
                place[axis] = np.sign(place[axis]) * (limit - 0.8 * beyond)
                speed[axis] *= -0.8
    noise = 0.02 * np.random.default_rng(4).standard_normal((count, 2))
    return pd.DataFrame(rows, columns=["seconds", "px", "py"]) + np.column_stack([np.zeros(count), noise])


@pytest.mark.further
def test_motion_of_any_csv_is_a_recording(tmp_path):
    (tmp_path / "recording.toml").write_text(BOX)
    bouncing().to_csv(tmp_path / "puck.csv", index=False)
    where = ["import", str(tmp_path), "--motion", str(tmp_path / "puck.csv"), "--unit", "mm"]
    assert main([*where, "--columns", "x=px,y=py,t=seconds"]) == 0
    motion = read_table(tmp_path / "motion.parquet", "motion")
    assert motion["nes_x_m"].abs().max() < 0.19 and motion["nes_angle_rad"].isna().all()
    assert main(["run", str(tmp_path)]) == 0
    found = read_table(tmp_path / "results" / "identification.parquet", "identification").set_index("parameter")
    assert abs(found.loc["restitution", "value"] - 0.8) < 0.01
    surfaces = set(read_table(tmp_path / "results" / "impacts.parquet", "impacts")["surface"])
    assert surfaces == {"side 1", "side 2", "side 3", "side 4"}


@pytest.mark.parametrize(
    ("columns", "said"),
    [("x=px", "no y"), ("x=px,y=qy", "no column qy"), ("x=px,y=py,up=seconds", "NAME=COLUMN"), (None, "no x and no y")],
)
def test_columns_that_do_not_fit_are_refused(tmp_path, columns, said, capsys):
    (tmp_path / "recording.toml").write_text(BOX)
    bouncing(20).to_csv(tmp_path / "puck.csv", index=False)
    where = ["import", str(tmp_path), "--motion", str(tmp_path / "puck.csv"), "--unit", "mm"]
    assert main(where + (["--columns", columns] if columns else [])) == 2
    assert said in "".join(capsys.readouterr())


@pytest.mark.others_further
@pytest.mark.parametrize("factor", [1e300, 1e7, 1e5, 1e-9])
def test_speeds_of_no_impact_end_soon(factor, tmp_path, capsys):
    """Refused, or identified for what they are; 1e300 m/s once had no end."""
    folder = recording(tmp_path / "run", impacts(np.random.default_rng(1), 30))
    table = pd.read_parquet(folder / "impacts.parquet")
    table["normal_speed_before_m_per_s"] *= factor
    table.to_parquet(folder / "impacts.parquet", index=False)
    status = main(["identify", str(folder), "--out", str(tmp_path / "out")])
    assert status == (2 if factor > 1e6 else 0)
    assert status == 0 or "normal_speed_before_m_per_s" in capsys.readouterr().err


def test_a_lever_of_no_disk_is_refused(tmp_path, capsys):
    folder = recording(tmp_path / "run", impacts(np.random.default_rng(1), 30))
    table = pd.read_parquet(folder / "impacts.parquet")
    table["lever_normal_m"] = np.where(np.arange(30) == 3, 1e300, 0.01)
    table.to_parquet(folder / "impacts.parquet", index=False)
    assert main(["identify", str(folder), "--out", str(tmp_path / "out")]) == 2
    assert "lever_normal_m is 1e+300 in row 3" in capsys.readouterr().err


@pytest.mark.others_further
@pytest.mark.parametrize("speed_m_per_s", [100.0, 1e6])
def test_an_impact_that_leaves_like_a_bullet_is_left_out(speed_m_per_s, tmp_path, capsys):
    """One such row once kept the fit busy without end."""
    folder = recording(tmp_path / "run", impacts(np.random.default_rng(1), 60))
    table = pd.read_parquet(folder / "impacts.parquet")
    table.loc[3, "normal_speed_after_m_per_s"] = speed_m_per_s
    table.to_parquet(folder / "impacts.parquet", index=False)
    assert main(["identify", str(folder), "--out", str(tmp_path / "out")]) == 0
    assert "1 of 60 impacts do not approach the wall" in capsys.readouterr().out
    found = read_table(tmp_path / "out" / "identification.parquet", "identification").set_index("parameter")
    assert abs(found.loc["restitution", "value"] - TRUE["restitution"]) < 0.01
