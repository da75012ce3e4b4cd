"""What a planned day is made of, against closed forms; what a plan says, against days of the plant made apart."""

import numpy as np
import pandas as pd
import pytest

from analysis.identify import identify_series
from analysis.plan.day import Settings, _scenario, as_planned, simulated_run
from analysis.plan.noise import PoseNoise, noise_of_marker_px, pose_noise
from analysis.plan.page import further_day_in_words
from analysis.plan.predict import AS_STATED, MAIN, UNDETERMINED_SD, changes, cost_s, predict, ranked, sds_of
from ovines.core import simulate
from ovines.errors import InputError
from ovines.recording import read_recording, read_series
from ovines.tables import read_table
from tests.conftest import HOST_LAYOUT_M, NES_LAYOUT_M, recording_toml, two_cameras
from tests.plants import Spec, make_series, write_series

DRIVE = '[excitation]\nfrequency_hz = 11.0\nacceleration_g = 6.0\naxis = "y"\n[model]\neffects = ["floor_friction"]\n'
QUIET = PoseNoise((2e-6, 3e-6), 4e-4, (1e-6, 1e-6), 1e-4)


def settings(**changed) -> Settings:
    fields = dict(level_g=6.0, frequency_hz=11.0, frame_rate_hz=800.0, runs=1, duration_s=0.5, noise=QUIET,
                  restitution_scatter=0.02)  # fmt: skip
    return Settings(**fields | changed)


@pytest.fixture
def recording(tmp_path):
    (tmp_path / "recording.toml").write_text(recording_toml() + DRIVE)
    return read_recording(tmp_path)


def test_noise_of_poses_is_that_of_bodies_fitted_to_noisy_markers(recording):
    """Against 4,000 poses fitted to projections with noise, each by its own linear algebra."""
    noise, assumed = pose_noise(recording, two_cameras(), 0.04, None)
    rng, found = np.random.default_rng(3), {}
    for name, layout in (("nes", NES_LAYOUT_M), ("host", HOST_LAYOUT_M)):
        flat = layout * (1, 1, 0)
        jacobian = np.stack([camera.project_with_jacobian(flat)[1] for camera in two_cameras()])  # camera, marker, 2, 3
        errors = np.zeros((4000, len(layout), 3))
        for n in range(len(layout)):
            rows = jacobian[:, n].reshape(4, 3)
            errors[:, n] = rng.normal(0, 0.04, (4000, 4)) @ np.linalg.pinv(rows).T
        about = layout[:, :2] - layout[:, :2].mean(axis=0)
        turn = (errors[..., 1] @ about[:, 0] - errors[..., 0] @ about[:, 1]) / np.sum(about**2)
        found[name] = (*errors.mean(axis=1).std(axis=0)[:2], turn.std())
    assert (*noise.nes_m, noise.nes_rad) == pytest.approx(found["nes"], rel=0.05)
    assert (*noise.host_m, noise.host_rad) == pytest.approx(found["host"], rel=0.1)  # its markers are seen off the axis
    assert not assumed


def test_without_a_calibration_the_window_tells_the_scale(recording):
    noise, assumed = pose_noise(recording, None, 0.1, 5000.0)
    assert noise.nes_m[1] == pytest.approx(0.1 / 5000 / np.sqrt(2) / np.sqrt(5))
    guessed, notes = pose_noise(recording, None, 0.1, None)
    assert guessed.nes_m[1] == pytest.approx(noise.nes_m[1] * 5000 / (688 / 0.13))
    assert len(notes) == len(assumed) + 1 and "px/mm" in notes[0]


def test_larger_markers_are_seen_better():
    assert noise_of_marker_px(4.0) == pytest.approx(0.0065, rel=0.3)  # docs/how-to/plan.md: measured
    assert noise_of_marker_px(13.0) == pytest.approx(0.0036, rel=0.3)
    with pytest.raises(InputError):
        noise_of_marker_px(1.0)


def test_a_run_moves_as_asked_and_is_seen_with_the_noise(recording):
    asked = settings(frame_rate_hz=2000.0)
    motion, starts = simulated_run(recording, asked, np.random.default_rng(1))
    quiet = settings(frame_rate_hz=2000.0, noise=QUIET.times(1e-9))
    clean, _ = simulated_run(recording, quiet, np.random.default_rng(1))
    assert 200 < len(motion) <= 1001 and starts >= 1
    amplitude = 6 * 9.81 / (2 * np.pi * 11) ** 2
    assert np.ptp(clean["host_y_m"]) == pytest.approx(2 * amplitude, rel=1e-3) and np.ptp(clean["host_x_m"]) < 1e-9
    for column, sd in (("nes_x_m", 2e-6), ("nes_y_m", 3e-6), ("nes_angle_rad", 4e-4), ("host_x_m", 1e-6)):
        assert (motion[column] - clean[column]).std() == pytest.approx(sd, rel=0.1), column


def test_the_restitution_scatters_as_stated(recording):
    """From impact to impact, without order."""
    rng, found = np.random.default_rng(0), []
    for _ in range(6):
        impacts = simulate(_scenario(recording, settings(duration_s=1.5), rng)).impacts
        fast = impacts[impacts["normal_speed_before_m_per_s"] > 0.2]
        found += list(-fast["normal_speed_after_m_per_s"] / fast["normal_speed_before_m_per_s"])
    assert len(found) > 60
    assert np.mean(found) == pytest.approx(0.7, abs=0.01) and np.std(found) == pytest.approx(0.02, rel=0.2)
    assert abs(np.corrcoef(found[:-1], found[1:])[0, 1]) < 0.3


def test_settings_are_ranked_by_what_they_gain():
    rows = [
        dict(setting=setting, parameter=name, sd=sd)
        for setting, sds in {
            AS_STATED: (0.02, 0.02, 0.02, np.nan),
            "none": (0.02, 0.02, 0.02, np.nan),
            "better": (0.01, 0.01, 0.01, np.nan),
            "newly determined": (0.02, 0.02, 0.02, UNDETERMINED_SD / 100),
            "worse": (0.04, 0.02, np.nan, np.nan),
        }.items()
        for name, sd in zip(MAIN, sds, strict=True)
    ]
    found = ranked(pd.DataFrame(rows))
    assert list(found.index) == ["newly determined", "better", "none", "worse"]
    assert found.loc["better", "gain"] == pytest.approx(2**0.75)
    assert found.loc["newly determined", "gain"] == pytest.approx(100**0.25)
    assert found.loc["better", "wall_friction"] == pytest.approx(2.0)


def test_costs_follow_what_is_asked():
    stated = settings(runs=3)
    asked = changes(stated)
    assert len({one.words for one in asked}) == len(asked) and asked[0].settings == stated
    assert cost_s(asked, 4) == pytest.approx(4 * cost_s(asked, 1)) and cost_s(asked[1:2], 1) == pytest.approx(
        2 * cost_s(asked[:1], 1)
    )


@pytest.mark.further
def test_a_plan_is_what_the_day_of_another_plant_then_gives(tmp_path):
    """One rig of tests/plants, its own laws in the plan; the twenty of its benchmark are in the docs."""
    made = make_series(Spec("ours", noise="white", frames_per_flight=25.0), np.random.default_rng([2308, 3]), 2)
    rig = made[0].truth["rig"]
    series = read_series(write_series(made, tmp_path / "series"))
    motions = [read_table(one.folder / "motion.parquet", "motion") for one in series]
    day = identify_series(motions, series)[0].set_index("parameter")
    law = {name: getattr(rig.physics, name) for name in MAIN[:3]} | {"floor_friction": rig.physics.friction}
    file = series[0].settings
    known = type(series[0])(series[0].folder, file.model_copy(update={"model": file.model.model_copy(update=law)}))
    sd, own = rig.sd_m, rig.physics
    noise = PoseNoise((sd, sd), sd / (0.7 * own.radius_m), (sd, sd), sd / (0.7 * (own.reach_m + own.radius_m)))
    length_s = min(rig.spec.periods / rig.drive_hz, rig.spec.most_frames / known.frame_rate_hz)
    stated = Settings(
        rig.level_g, rig.drive_hz, known.frame_rate_hz, 2, length_s, noise, own.restitution_scatter
    )  # fmt: skip
    plan = predict(known, changes(stated)[:1], 2, 0).set_index("parameter")
    for name in (*MAIN, "contact_radius_m"):
        assert 0.4 < plan.loc[name, "sd"] / sds_of([day], name)[0] < 2.5, name  # one day, two runs: chance is large


def test_another_drive_and_rate_reach_the_identification(recording):
    planned = as_planned(recording, settings(frequency_hz=8.0, level_g=3.0, frame_rate_hz=1600.0))
    assert (planned.excitation.frequency_hz, planned.excitation.acceleration_g) == (8.0, 3.0)
    assert planned.frame_rate_hz == 1600.0 and planned.excitation.axis == "y"


@pytest.mark.parametrize(("days", "share"), [(2, "33 %"), (10, "82 %")])
def test_how_often_the_range_of_days_holds_another(days, share):
    """Against days drawn from a skew law: the smallest and the largest of them, and one more."""
    drawn = np.random.default_rng(0).lognormal(0, 0.6, (20_000, days + 1))
    inside = (drawn[:, :-1].min(1) < drawn[:, -1]) & (drawn[:, -1] < drawn[:, :-1].max(1))
    assert inside.mean() == pytest.approx((days - 1) / (days + 1), abs=0.012)
    assert share in further_day_in_words(days)
    assert "cannot tell" in further_day_in_words(1)
