"""`analysis.compare` on runs that the simulator itself made: nothing to find, and then something."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from analysis.compare import compare, one_impact_ahead
from analysis.comparison.simulated_rig import lines_from, nominal_scenario, states_after
from analysis.motion.host_fit import fit_host_motion
from analysis.walls.wall import Wall
from ovines.__main__ import main
from ovines.core import FloorFriction, Harmonic, Host, ImpactLaw, Nes, Scenario, simulate
from ovines.errors import InputError
from ovines.io.provenance import provenance
from ovines.recording import read_recording
from ovines.simulations.results import impact_table, motion_table
from ovines.tables import TABLES, read_table, write_table

TRUTH = {"restitution": 0.72, "wall_friction": 0.13, "tangential_restitution": 0.49, "floor_friction": 0.2}
SCENARIO = Scenario(
    "truth",
    Nes(0.01, 0.0246, 0.5),
    Host(
        radius_m=0.05,
        motion="driven",
        drive=(Harmonic("x", 0.0164, 11.0, 0.3), Harmonic("y", 0.0002, 22.0, 1.0)),
    ),
    ImpactLaw(0.72, 0.13, 0.49),
    1.0,
    FloorFriction(0.2),
    initial_nes=(0.03, -0.01, 0.4, 1.1, 0.0, 20.0),
    sample_rate_hz=800.0,
)
TOML = """format = 1
[time]
frame_rate_hz = 800.0
[bodies.host]
inner_radius_m = 0.05
[bodies.nes]
radius_m = 0.01
mass_kg = 0.0246
inertia_factor = 0.5
[excitation]
frequency_hz = 11.0
[model]
effects = ["floor_friction", "spin_coupling"]
{model}
"""


@pytest.fixture(scope="module")
def run():
    result = simulate(SCENARIO)
    impacts = impact_table(result)
    measured = impacts[[name for name in TABLES["impacts"].names if name in impacts]]  # no camera sees energies
    return motion_table(result), measured, [tuple(span) for span in result.contacts]


def recording(folder, model=""):
    (folder / "recording.toml").write_text(TOML.format(model=model))
    return read_recording(folder)


def identified(**change):
    values = TRUTH | change
    return pd.DataFrame(
        {
            "parameter": list(values),
            "value": list(values.values()),
            "sd": 0.01,
            "low": np.nan,
            "high": np.nan,
            "n_impacts": 9,
        }
    )


def test_the_simulators_own_run_is_predicted(tmp_path, run):
    motion, impacts, contacts = run
    assert (impacts["normal_speed_before_m_per_s"] > 0.1).sum() >= 8
    found = compare(
        motion,
        impacts,
        identified(),
        recording(tmp_path),
        np.random.default_rng(0),
        contacts_s=contacts,
        runs=30,
    )
    assert len(found.flights) >= 6
    assert found.flights["rms_m"].max() < 1e-8  # 1.8e-10 seen: what the straight lines between samples leave
    assert found.flights["angle_rms_rad"].max() < 1e-6
    for name in ("normal_speed_after_m_per_s", "tangential_speed_after_m_per_s", "spin_after_rad_per_s"):
        np.testing.assert_allclose(found.impacts[f"simulated_{name}"], found.impacts[name], atol=1e-6)
    statistics = found.statistics.set_index("quantity")
    assert set(statistics.index) == {"impact_rate_hz", "normal_speed_m_per_s", "energy_j", "azimuth_rad"}
    assert (statistics["p"] > 0.02).all()


def test_a_wrong_restitution_shows_one_impact_ahead_and_not_in_flight(tmp_path, run):
    motion, impacts, contacts = run
    found = compare(
        motion,
        impacts,
        identified(restitution=0.6),
        recording(tmp_path),
        np.random.default_rng(0),
        contacts_s=contacts,
        runs=0,
    )
    off = found.impacts["simulated_normal_speed_after_m_per_s"] / found.impacts["normal_speed_after_m_per_s"]
    np.testing.assert_allclose(off, 0.6 / 0.72, rtol=1e-6)
    assert found.flights["rms_m"].max() < 1e-8
    assert len(found.statistics) == 0


def test_a_wrong_floor_shows_in_flight_and_not_at_impacts(tmp_path, run):
    motion, impacts, contacts = run
    found = compare(
        motion,
        impacts,
        identified(floor_friction=0.4),
        recording(tmp_path),
        np.random.default_rng(0),
        contacts_s=contacts,
        runs=0,
    )
    assert found.flights["rms_m"].max() > 1e-4
    np.testing.assert_allclose(
        found.impacts["simulated_normal_speed_after_m_per_s"],
        found.impacts["normal_speed_after_m_per_s"],
        atol=1e-6,
    )


def test_statistics_notice_a_much_wrong_simulator(tmp_path, run):
    motion, impacts, contacts = run
    found = compare(
        motion,
        impacts,
        identified(restitution=0.95),
        recording(tmp_path),
        np.random.default_rng(0),
        contacts_s=contacts,
        runs=40,
    )
    assert found.statistics["p"].min() < 0.05


def test_measured_states_are_the_true_ones(run):
    """Speeds of the contact turned back into the NES's velocity: right before an impact, half a sample off at
    most.
    """
    motion, impacts, _ = run
    position = motion[["host_x_m", "host_y_m", "host_z_m", "host_angle_rad"]].to_numpy(float)
    host = fit_host_motion(motion["time_s"].to_numpy(float), position, np.full(position.shape, 1e-6), 11.0)
    states = states_after(impacts, host, 0.01, Wall.ring(0.04))
    close = replace(SCENARIO, duration_s=float(impacts["time_s"][0]) + 1e-7, sample_rate_hz=0.0)
    final = simulate(close).final_state
    np.testing.assert_allclose(states["after"][0][:2], final[2:4], atol=1e-4)
    assert states["after"][0][2] == pytest.approx(final[5], abs=1e-3)


def test_harmonics_keep_their_phase_from_any_start(run):
    motion, _, _ = run
    time_s = motion["time_s"].to_numpy(float)
    position = motion[["host_x_m", "host_y_m", "host_z_m", "host_angle_rad"]].to_numpy(float)
    host = fit_host_motion(time_s, position, np.full(position.shape, 1e-6), 11.0)
    later = lines_from(host, 0.123)
    x = sum(
        h.amplitude * np.sin(2 * np.pi * h.frequency_hz * (time_s - 0.123) + h.phase_rad)
        for h in later
        if h.axis == "x"
    )
    np.testing.assert_allclose(x, position[:, 0], atol=1e-9)


def test_parameters_come_from_the_data_then_from_the_model(tmp_path, run):
    motion, _, _ = run
    position = motion[["host_x_m", "host_y_m", "host_z_m", "host_angle_rad"]].to_numpy(float)
    host = fit_host_motion(motion["time_s"].to_numpy(float), position, np.full(position.shape, 1e-6), 11.0)
    bound = identified(tangential_restitution=np.nan)
    with pytest.raises(InputError, match="tangential_restitution"):
        nominal_scenario(bound, recording(tmp_path), host, 1.0)
    given = nominal_scenario(bound, recording(tmp_path, "tangential_restitution = 0.3\nrestitution = 0.1"), host, 1.0)
    assert given.impact == ImpactLaw(0.72, 0.13, 0.3)
    bound.loc[bound["parameter"] == "tangential_restitution", "low"] = 0.42
    assert nominal_scenario(bound, recording(tmp_path), host, 1.0).impact.tangential_restitution == 0.42
    assert nominal_scenario(identified(floor_friction=np.nan), recording(tmp_path), host, 1.0).friction is None


def test_missing_speeds_stay_missing(tmp_path, run):
    motion, impacts, contacts = run
    impacts = impacts.assign(tangential_speed_before_m_per_s=np.nan, tangential_speed_after_m_per_s=np.nan)
    found = compare(
        motion,
        impacts,
        identified(),
        recording(tmp_path),
        np.random.default_rng(0),
        contacts_s=contacts,
        runs=5,
    )
    assert len(found.flights) == 0
    assert found.impacts["simulated_tangential_speed_after_m_per_s"].isna().all()
    assert found.impacts["simulated_normal_speed_after_m_per_s"].notna().all()
    assert len(one_impact_ahead(impacts.iloc[:0], found.scenario)) == 0


def test_the_command(tmp_path, run, browse, ovines, capsys):
    motion, impacts, contacts = run
    folder = tmp_path / "rec"
    folder.mkdir()
    recording(folder)
    results = folder / "results"
    spans = pd.DataFrame(
        [(n, *span, "contact") for n, span in enumerate(contacts)],
        columns=["flight", "start_s", "end_s", "kind"],
    )
    for name, table in (
        ("motion", motion),
        ("impacts", impacts),
        ("identification", identified()),
        ("flights", spans),
    ):
        write_table(table, name, results / f"{name}.parquet", provenance("test", {}, {}))
    command = ["compare", str(folder), "--runs", "4"]
    assert main([*command, "--figures"]) == 0, capsys.readouterr().err
    assert "one flight" in capsys.readouterr().out
    for name in ("flights_ahead", "impacts_ahead", "run_statistics"):
        assert len(read_table(results / f"{name}.parquet", name)) > 0
    assert {"flights_ahead.pdf", "run_distributions.svg"} <= {p.name for p in (results / "figures").iterdir()}
    first = (results / "compare.html").read_text(encoding="utf-8")
    seen = browse(first)
    assert (seen.console, seen.fetched, seen.too_wide, len(seen.pictures)) == ([], [], 0, 3)
    assert main(command) == 0
    assert (results / "compare.html").read_text(encoding="utf-8") == first  # the seed is an argument, the clock is not
    (results / "impacts.parquet").unlink()
    refused = ovines(*command)
    assert refused.returncode == 2
    assert "no impacts.parquet" in refused.stderr
    assert "Traceback" not in refused.stderr
