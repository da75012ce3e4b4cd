"""A wall in which the disk is for a while: runs of the house simulator with effect ``finite_contact_time``, identified
and compared."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from analysis.compare import compare
from analysis.contact.tangential.lasting import stiffness_of
from analysis.flights.cutting.runs import cut_again, outside_the_wall, with_frames_in_wall
from analysis.identify import Identified, identify_series
from ovines.core import FloorFriction, Harmonic, Host, ImpactLaw, Nes, Scenario, simulate
from ovines.recording import Recording, read_recording
from ovines.simulations.results import motion_table

LAW, FLOOR, DURATION_S, NOISE_M = ImpactLaw(0.78, 0.16, 0.45), 0.24, 9e-4, 1.5e-5
STARTS = ((-0.01, 0.02, -1.2, 0.3, 1.0, 40.0), (0.0, 0.02, 1.0, 1.0, 2.0, 15.0))
TOML = """format = 1
[time]
frame_rate_hz = 1600.0
[bodies.host]
inner_radius_m = 0.05
[bodies.nes]
radius_m = 0.01
mass_kg = 0.0246
inertia_factor = 0.5
[model]
effects = ["floor_friction", "spin_coupling"{named}]
"""


def filmed(start, seed: int) -> pd.DataFrame:
    """A motion with the cameras' noise."""
    scenario = Scenario(
        "soft wall",
        Nes(0.01, 0.0246, 0.5),
        Host(radius_m=0.05, motion="driven", drive=(Harmonic("x", 0.0164, 11.0, 0.3),)),
        LAW,
        0.7,
        FloorFriction(FLOOR),
        initial_nes=start,
        sample_rate_hz=1600.0,
        effects={"finite_contact_time": {"duration_s": DURATION_S}},
    )
    rng, motion = np.random.default_rng(seed), motion_table(simulate(scenario)).copy()
    for body in ("nes", "host"):
        for axis in "xy":
            motion[f"{body}_{axis}_m"] += NOISE_M * rng.standard_normal(len(motion))
            motion[f"{body}_{axis}_sd_m"] = NOISE_M
        motion[f"{body}_angle_rad"] += 2e-3 * rng.standard_normal(len(motion))
        motion[f"{body}_angle_sd_rad"] = 2e-3
    return motion


def recording(folder, named: bool = True) -> Recording:
    folder.mkdir(exist_ok=True)
    (folder / "recording.toml").write_text(TOML.format(named=', "finite_contact_time"' if named else ""))
    return read_recording(folder)


@pytest.fixture(scope="module")
def soft(tmp_path_factory) -> tuple[list[pd.DataFrame], Recording, pd.DataFrame, list[Identified]]:
    motions = [filmed(start, seed) for seed, start in enumerate(STARTS)]
    one = recording(tmp_path_factory.mktemp("soft"))
    return motions, one, *identify_series(motions, [one] * len(motions))


@pytest.mark.further
def test_the_law_of_the_scenario_comes_back(soft):
    """With frames in the wall among the flights' and the law of an instant wall friction was 0.147 and the tangential
    restitution 0.34."""
    identified = soft[2].set_index("parameter")["value"]
    assert identified["wall_friction"] == pytest.approx(LAW.wall_friction, abs=1e-3)
    assert identified["tangential_restitution"] == pytest.approx(LAW.tangential_restitution, abs=0.06)
    # Of a disk the spring moves the contact point three times as easily as the mass.
    stiffness = stiffness_of(LAW.tangential_restitution, LAW.restitution) / 3
    assert identified["contact_stiffness_ratio"] == pytest.approx(stiffness, rel=0.05)
    assert identified["contact_duration_s"] == pytest.approx(DURATION_S, rel=0.02)
    assert identified["restitution"] == pytest.approx(LAW.restitution, abs=0.015)
    assert identified["floor_friction"] == pytest.approx(FLOOR, abs=1.5e-3)


def test_a_comparison_flies_from_where_the_paths_meet_and_turns_as_the_simulator_does(soft):
    """Flights had begun with the speeds of where paths meet at the touch before, and held the frames in the wall: they
    were 0.1 to 0.35 mm off (median), speeds along the wall 0.055 m/s and more."""
    motions, one, table, found = soft
    after = "tangential_speed_after_m_per_s"
    for motion, own in zip(motions, found, strict=True):
        ahead = compare(motion, own.impacts, table, one, np.random.default_rng(0), runs=0)
        assert len(ahead.flights) > 10 and ahead.flights["rms_m"].median() < 2 * NOISE_M
        assert (ahead.impacts[f"simulated_{after}"] - ahead.impacts[after]).std() < 0.03


@pytest.mark.further
def test_contacts_that_no_model_names_have_their_frames_left_out_and_the_law_of_an_instant(soft, tmp_path):
    """As the simulator then has it."""
    motions, *_, found = soft
    table, plain = identify_series(motions, [recording(tmp_path, named=False)] * len(motions))
    identified = table.set_index("parameter")["value"]
    assert any("the contact lasts" in note for note in plain[0].notes) and "contact_stiffness_ratio" not in identified
    for own, named in zip(plain[0].rig.runs, found[0].rig.runs, strict=True):
        np.testing.assert_array_equal(own.in_wall_m, named.in_wall_m)
        assert np.isfinite(own.in_wall_m).any()
    assert identified["wall_friction"] < 0.155 and identified["tangential_restitution"] < 0.4


def test_frames_in_the_wall_come_back(soft):
    """Where other ones are hidden next, or the run is cut anew."""
    run = soft[3][0].rig.runs[0]
    hidden = np.isfinite(run.in_wall_m[:, 0])
    every = outside_the_wall(run, np.zeros(0), 0.0, 0.0)
    assert hidden.any() and not np.isfinite(run.data.xy_m[hidden]).any()
    assert np.isfinite(every.data.xy_m[hidden]).all() and len(every.flights) >= len(run.flights)
    np.testing.assert_array_equal(every.data.xy_m, with_frames_in_wall(run, run.data).xy_m)
    later_s = run.data.time_s[hidden][:1]
    again = outside_the_wall(run, later_s, 1e-5, 1e-5)
    assert np.flatnonzero(np.isfinite(again.in_wall_m[:, 0])).tolist() == [int(np.flatnonzero(hidden)[0])]
    assert outside_the_wall(again, later_s, 1e-5, 1e-5) is again
    np.testing.assert_array_equal(cut_again([run], np.zeros(2))[0].data.xy_m, every.data.xy_m)
