"""Sizes of effects in ``[model.effect_parameters]``: read, refused, held by the flights, and contradicted by data."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analysis.blind.recording.files import write_series
from analysis.blind.series import make_series
from analysis.comparison.simulated_rig import host_motion_of, nominal_scenario
from analysis.flights.stated_terms import DRIFT_OF_RUN, share_at_start, stated_sizes, stated_terms
from analysis.gap.series import Series
from analysis.identify import identify_series
from analysis.motion.rig_frame import RigFrame
from ovines.__main__ import main
from ovines.errors import InputError
from ovines.pipeline.series.diagnosis import load_series
from ovines.recording import Recording, read_series
from ovines.recording_schema import Nominal

G = 9.81


def frame(turn_rad: float = 0.0, length: float = 1.0) -> RigFrame:
    return RigFrame(np.zeros(2), turn_rad, (0.0, 0.0, 0.0), length)


def test_a_tilt_is_turned_into_the_rigs_frame():
    model = Nominal(effects=("table_tilt",), effect_parameters={"table_tilt": {"tilt_rad": 0.01, "direction_rad": 0.7}})
    terms = stated_terms(model, frame(0.2), [-0.5] * 3)
    assert np.hypot(terms["tilt_x"], terms["tilt_y"]) == pytest.approx(0.01 * G, rel=1e-12)
    assert np.arctan2(terms["tilt_y"], terms["tilt_x"]) == pytest.approx(0.5, abs=1e-12)


def test_terms_scale_with_the_rigs_own_units():
    """Lengths four times as long, times twice: accelerations are the same, rates per second twice, per metre four
    times."""
    sizes = {"viscous_drag": {"rate_per_s": 0.3}, "air_drag": {"rate_per_m": 0.1}, "table_tilt": {"tilt_rad": 0.01}}
    model = Nominal(effects=tuple(sizes), effect_parameters=sizes)
    plain, large = stated_terms(model, frame(), [-0.5]), stated_terms(model, frame(length=4.0), [-0.25])
    ratio = {name: large[name] / plain[name] for name in ("viscous", "air", "tilt_x")}
    assert ratio == pytest.approx({"viscous": 2.0, "air": 4.0, "tilt_x": 1.0}, rel=1e-12)


def test_drift_about_the_start_is_the_same_about_the_middle():
    sizes = {"friction_drift": {"relative_per_s": 0.4, "relative_per_run": 0.1}}
    starts_s = [-0.6] * 3
    terms = stated_terms(Nominal(effects=("friction_drift",), effect_parameters=sizes), frame(), starts_s)
    start = share_at_start(terms, starts_s)
    for run in range(3):
        for time_s in (0.0, 0.3, 1.2):
            drifted = (1 + 0.4 * time_s) * (1 + 0.1 * run)
            fitted = (1 + terms["drift"] * (time_s - 0.6)) * (1 + terms[DRIFT_OF_RUN] * (run - 1))
            assert fitted / start == pytest.approx(drifted, rel=1e-12)


@pytest.mark.parametrize(
    ("effect", "sizes", "said"),
    [
        ("table_tilt", {"tilt": 0.01}, "tilt"),
        ("table_tilt", {"tilt_rad": 3.0}, "tilt_rad"),
        ("table_tilt", {"direction_rad": 0.1}, "without tilt_rad"),
        ("table_til", {"tilt_rad": 0.01}, "table_til"),
    ],
)
def test_sizes_that_cannot_be_are_refused(effect, sizes, said):
    with pytest.raises(InputError, match=said):
        stated_sizes(Nominal(effects=(effect,), effect_parameters={effect: sizes}))


def test_sizes_of_an_effect_that_is_not_named_end_with_2(tmp_path, capsys):
    write_series(make_series("none", 1.0, np.random.default_rng(3), runs=2, noise="white"), tmp_path / "series")
    path = tmp_path / "series" / "run-01" / "recording.toml"
    path.write_text(path.read_text() + "\n[model.effect_parameters.table_tilt]\ntilt_rad = 0.01\n")
    assert main(["check", str(tmp_path / "series" / "run-01")]) == 2
    said = "".join(capsys.readouterr())
    assert "sizes of table_tilt" in said and "table_tilt in effects" in said


@pytest.fixture(scope="module")
def tilted(tmp_path_factory) -> tuple[Series, dict[str, float]]:
    folder = tmp_path_factory.mktemp("tilted")
    made = make_series("table_tilt", 1.0, np.random.default_rng(8), runs=3, noise="white")
    write_series(made, folder)
    loaded, _ = load_series(read_series(folder), folder / "results")
    return loaded, made.truth["plant"]


def stating(series: Series, **sizes: float) -> list[Recording]:
    model = Nominal(
        effects=("floor_friction", "spin_coupling", "table_tilt"),
        effect_parameters={"table_tilt": sizes} if sizes else {},
    )
    return [replace(one, settings=one.settings.model_copy(update={"model": model})) for one in series.recordings]


def with_scale(recording: Recording) -> Recording:
    """Beside what ``[model]`` states, lengths that are off."""
    known = recording.settings.model
    sizes = {**known.effect_parameters, "length_scale_error": {"scale": 1.01}}
    model = known.model_copy(update={"effects": (*known.effects, "length_scale_error"), "effect_parameters": sizes})
    return replace(recording, settings=recording.settings.model_copy(update={"model": model}))


def values(joint) -> dict[str, float]:
    return dict(zip(joint["parameter"], joint["value"], strict=True))


@pytest.mark.further
def test_a_stated_size_is_held_and_a_wrong_one_is_reported(tilted):
    series, _ = tilted
    motions = series.motions
    fitted = values(identify_series(motions, stating(series))[0])
    pull = np.array([fitted["table_tilt_x_m_per_s2"], fitted["table_tilt_y_m_per_s2"]])
    right = {"tilt_rad": float(np.hypot(*pull)) / G, "direction_rad": float(np.arctan2(pull[1], pull[0]))}
    held, one = identify_series(motions, stating(series, **right))
    assert "table_tilt_x_m_per_s2" not in values(held)
    assert values(held)["floor_friction"] == pytest.approx(fitted["floor_friction"], rel=1e-4)
    scaled = [with_scale(r) for r in stating(series, tilt_rad=2 * right["tilt_rad"], direction_rad=0.0)]
    wrong, one = identify_series(motions, scaled)
    # An error of the measurement is the diagnosis' to take out, and identification says so.
    assert any("states length_scale_error" in note for note in one[0].notes)
    assert any("another size of table_tilt than [model] states" in note for note in one[0].notes)
    identified = values(wrong)
    assert [identified["table_tilt_x_m_per_s2"], identified["table_tilt_y_m_per_s2"]] == pytest.approx(pull, abs=2e-3)


def test_a_comparison_simulates_the_stated_sizes(tilted):
    series, _ = tilted
    (recording, *_), motion = stating(series, tilt_rad=0.012, direction_rad=-0.3), series.motions[0]
    law = {"restitution": 0.7, "wall_friction": 0.1, "tangential_restitution": 0.5, "floor_friction": 0.2}
    model = recording.settings.model.model_copy(update=law)
    recording = replace(recording, settings=recording.settings.model_copy(update={"model": model}))
    scenario = nominal_scenario(None, recording, host_motion_of(motion, recording), 0.5)
    assert scenario.effects == {"table_tilt": {"tilt_rad": 0.012, "direction_rad": -0.3}}
