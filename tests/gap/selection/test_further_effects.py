"""Effects that the library has beside FORMATS.md's: found in the plant at a third of what one notices, of the right
size, and nothing else with them."""

from __future__ import annotations

import shutil
import tomllib
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from analysis.blind.recording.place import draw_place
from analysis.blind.series import make_series
from analysis.contact.restitution import RESTITUTION_EFFECTS
from analysis.flights.equation.parameters import INDEX
from analysis.gap.answer import model_section, model_values
from analysis.gap.diagnose import diagnose, verdict_of
from analysis.gap.drive.findings import DriveSteps
from analysis.gap.drive.pushes import Pushes, answers
from analysis.gap.estimates import estimated, improved
from analysis.gap.ladder import run_ladder
from analysis.gap.page.figures.drive import drive_figure
from analysis.gap.page.gap_page import gap_page
from analysis.gap.prediction.held_out_errors import held_out_errors
from analysis.identify import identify_series
from analysis.walls.lobes import LobedWall, best_order, lobe_columns
from analysis.walls.wall import Wall
from ovines.core.effects import EFFECTS
from ovines.pipeline.series.diagnosis import load_series
from ovines.recording import read_series
from tests.gap.conftest import brought, laws_and_ladder

NOTHING = frozenset[str]()
RUNS = 8
#: kinds and seed of series that show what is asked in so many runs, in less than half of the time
SHOWN_BY_FEWER = {
    ("motion_blur+wall_lobes+host_recoil", 13): 3,
    ("restitution_drift", 34): 3,
    ("nes_rocking", 21): 3,
    ("none", 21): 2,
}
# Of a size: what four sds of it may be at most where fewer runs tell it; wide intervals would hold everything.
MOST_UNSURE = 0.5
#: effects of one series, their stages, noise, seed
FAST = [
    ("motion_blur+wall_lobes+host_recoil", ("measurement", "geometry", "drive"), "warp", 13),
    ("restitution_drift", ("impact",), "white", 34),
    ("nes_rocking", ("flight",), "white", 21),
]
SLOW = [
    ("host_ringing", ("drive",), "white", 15),
    ("host_sway", ("drive",), "warp", 16),
    ("inertia_error", ("geometry",), "ar1", 17),
    ("wall_lobes", ("geometry",), "warp", 18),
    ("restitution_drift", ("impact",), "warp", 19),
    ("host_ringing", ("drive",), "ar1", 20),
]
#: parameters that are the same after a part of a turn, or that the runs do not share
PERIODIC = ("direction_rad", "phase_rad")


@pytest.fixture(scope="module")
def diagnosed(tmp_path_factory, without_next_test):
    """Function (kind, size, seed, noise, withheld) -> (folder, diagnosis, truth): a few runs of the plant, of the
    usual rig anywhere in the world; made once for each arguments.
    """

    @cache
    def made(kind: str, size: float, seed: int, noise: str, withheld: frozenset[str] = NOTHING):
        folder = tmp_path_factory.mktemp(kind) / "series"
        runs = SHOWN_BY_FEWER.get((kind, seed), RUNS)
        place = draw_place(np.random.default_rng(seed + 1000), runs, other_rigs=False)
        series = make_series(kind, size, np.random.default_rng(seed), runs=runs, noise=noise, place=place)
        loaded = brought(series, folder)
        return folder, diagnose(loaded, np.random.default_rng(0), withheld), series.truth

    return made


@pytest.mark.further
@pytest.mark.parametrize(
    ("kinds", "stages", "noise", "seed"), [*FAST, *(pytest.param(*one, marks=pytest.mark.long) for one in SLOW)]
)
def test_a_small_effect_is_named_with_its_size(diagnosed, request, kinds, stages, noise, seed):
    """Three of different stages, too, each with its size, and nothing else."""
    _, found, truth = diagnosed(kinds, 0.35, seed, noise)
    summary, effects = found.summary, kinds.split("+")
    assert (summary["verdict"], set(summary["effects"])) == ("effect", set(effects))
    stage_of = dict(zip(effects, stages, strict=True))
    assert summary["stage"] == stage_of[summary["effects"][0]]
    assert {cause.effect: cause.stage for cause in found.ladder.causes} == stage_of
    assert summary["gap"]["shrinkage"] > 0.6
    for effect in effects:
        assert summary["probabilities"][effect] > 0.4
        same_sizes(effect, summary["parameters"][effect], truth["parameters"][effect], (kinds, seed) in SHOWN_BY_FEWER)
    if len(effects) == 1:  # the page of all three is painted
        request.getfixturevalue("unpainted")
    evidence = next(s for s in gap_page(found, "a series").sections if s.anchor == "evidence")
    assert len(evidence.figures) >= len(effects)


def same_sizes(effect, parameters, truth, fewer):
    """Each reported parameter is the true one within four sds, which are small where ``fewer`` runs tell it."""
    for name, true in truth.items():
        value, sd = parameters[name]["value"], (parameters[name]["high"] - parameters[name]["low"]) / (2 * 1.645)
        off = abs(value - true)
        if fewer and name not in PERIODIC:
            assert 4 * sd < MOST_UNSURE * abs(true), (name, true, sd)
        if name in PERIODIC:
            turn = 2 * np.pi / truth.get("order", 2 if effect == "host_sway" else 1)
            off = abs((value - true + 0.5 * turn) % turn - 0.5 * turn)
        # Linearised fits: their sds are good to a third; a hundredth is a model's own error.
        assert off < 4 * sd + 0.01 * abs(true), (name, value, true, sd)


@pytest.mark.further
def test_nothing_of_it_is_in_a_series_without_effect(diagnosed):
    _, found, _ = diagnosed("none", 1.0, 21, "warp")
    summary, drive = found.summary, found.ladder.drive
    assert (summary["verdict"], summary["effects"], summary["left"]) == ("none", [], [])
    assert summary["stage"] is None
    assert summary["drive"]["beside"] == [] and not any(f["found"] for f in summary["drive"]["findings"])
    assert {f["kind"] for f in summary["drive"]["findings"]} >= {"frequency", "level", "direction", "crosswise"}
    assert drive.paths and drive_figure(drive) is not None and drive_figure(DriveSteps()) is None
    assert set(summary["detectable"]) >= {
        "table_tilt",
        "air_drag",
        "wall_ellipticity",
        "camera_clock_offset",
        "wall_lobes",
        "restitution_drift",
        "motion_blur",
        "host_sway",
        "inertia_error",
    }


@pytest.mark.further
def test_without_a_finding_the_diagnosis_tells_what_identification_tells(loaded):
    """Nothing named, nothing corrected: both models are one, and their parameters those of `ovines identify`."""
    _, series = loaded("none", 1.0, 21, "warp", 2)
    estimates, ladder = estimated(run_ladder(series, np.random.default_rng(0)), [])
    assert not ladder.causes and ladder.series.motions is series.motions is ladder.measured.motions
    table = identify_series(series.motions, series.recordings)[0].set_index("parameter")["value"]
    for name, values in estimates.nominal(series.recordings[0].model).items():
        assert values["recalibrated"] == values["with_effect"] == pytest.approx(table[name], rel=1e-6), name


@pytest.mark.long
@pytest.mark.parametrize(
    ("effect", "stage", "word"),
    [
        # Of host_recoil: test_diagnose, beside two others.
        ("wall_lobes", "geometry", "times the azimuth"),
        ("inertia_error", "geometry", "tangential impulse"),
        ("restitution_drift", "impact", "run"),
        ("host_sway", "drive", "beside the drive"),
        ("nes_rocking", "flight", "since the impact"),
    ],
)
def test_withheld_it_is_unknown_where_it_lies(diagnosed, without_laws, effect, stage, word):
    _, found, _ = diagnosed(effect, 1.0, 22, "white", frozenset({effect}))
    summary = found.summary
    # An inertia that is off shows in the flights as well, whose floor turns the disk.
    assert summary["verdict"] == "unknown" and effect not in summary["effects"]
    assert any(left["stage"] == stage and word in left["goes_with"] for left in summary["left"])


@pytest.mark.further
@pytest.mark.parametrize(
    ("effect", "size", "seed"),
    [
        ("restitution_drift", 0.35, 34),
        ("nes_rocking", 0.35, 21),
        *(
            pytest.param(one, 1.0, 23, marks=pytest.mark.long)
            for one in ("wall_lobes", "inertia_error", "host_recoil", "host_ringing", "host_sway", "motion_blur")
        ),
    ],
)
def test_the_model_that_is_written_leaves_nothing(diagnosed, request, tmp_path, effect, size, seed):
    folder, found, _ = diagnosed(effect, size, seed, "white")
    if effect in RESTITUTION_EFFECTS:  # flights that nothing acted on in the first place
        request.getfixturevalue("without_flight_laws")
    folder = Path(shutil.copytree(folder, tmp_path / "series"))
    assert found.summary["effects"] == [effect]
    section = model_section(
        found.summary, found.ladder.series.recordings[0].model, model_values(found.ladder, found.estimates)
    )
    assert f"[model.effect_parameters.{effect}]" in section
    for recording in folder.glob("run-*/recording.toml"):
        text = recording.read_text()
        recording.write_text(text[: text.index("[model]")] + section)
    loaded, _ = load_series(read_series(folder), folder / "again")
    _, then = laws_and_ladder(loaded)
    assert (verdict_of(then), then.causes) == ("none", ())
    as_given = held_out_errors(then, ())[0]["as_given"].rms()
    for quantity, error in found.summary["gap"]["with_effect"].items():
        assert as_given[quantity] == pytest.approx(error, rel=0.05)


def test_a_mass_on_a_damped_spring_answers_as_the_closed_form():
    time_s = np.linspace(0.0, 0.5, 401)
    step = np.array([[0.3, -0.2], [0.1, 0.4]])
    pushes, hz, ratio = Pushes(np.array([0.05, 0.21]), step), 7.0, 0.2
    omega = 2 * np.pi * hz
    swing = omega * np.sqrt(1 - ratio**2)
    expected = np.zeros((401, 2))
    for t0, v in zip(pushes.time_s, step, strict=True):
        late = np.maximum(time_s - t0, 0.0)[:, None]
        expected += v * np.exp(-ratio * omega * late) * np.sin(swing * late) / swing
    seen = answers(pushes, time_s, np.array([hz, 3.0]), np.array([ratio, 0.1]))
    assert seen.shape == (401, 2, 2)
    assert seen[..., 0] == pytest.approx(expected, abs=1e-12)


def test_a_lobed_wall_is_where_its_formula_says():
    wall = LobedWall.of(Wall.ring(0.04), 5).moved({"lobe_c": 3e-3, "lobe_s": -2e-3, "radius": 1e-4})
    azimuth, turned = np.linspace(-3, 3, 50), 0.2
    psi = azimuth - turned
    reach = 0.0401 * (1 + 3e-3 * np.cos(5 * psi) - 2e-3 * np.sin(5 * psi))
    places = reach[:, None] * np.column_stack([np.cos(azimuth), np.sin(azimuth)])
    one = np.zeros(50, np.int64)
    seen = wall.seen(one, places, np.full(50, turned), 0.01)
    assert np.abs(seen[:, 0]).max() < 1e-12
    # The normal is at right angles to the curve, to first order in the lobes.
    along = np.gradient(places, azimuth, axis=0)[2:-2]
    normal = np.column_stack([np.cos(seen[2:-2, 1]), np.sin(seen[2:-2, 1])])
    across = np.sum(along * normal, 1) / np.linalg.norm(along, axis=1)
    assert np.abs(across).max() < 2e-3 < 5 * 3e-3
    assert wall.nominal_terms == Wall.ring(0.04).nominal_terms and wall.values()["lobe_s"] == -2e-3


def test_the_order_of_lobes_is_that_of_the_residual():
    rng = np.random.default_rng(2)
    azimuth, design = rng.uniform(-np.pi, np.pi, 120), np.ones((120, 1))
    for order in (3, 7, 12):
        residual = 1e-5 * (lobe_columns(azimuth, order) @ [1.0, 0.5]) + 5e-6 * rng.standard_normal(120)
        assert best_order(azimuth, design, residual) == order
        assert best_order(azimuth, design, residual, without=order) != order
    assert best_order(azimuth[:8], design[:8], residual[:8]) == 0


def test_an_estimate_beyond_a_bound_by_its_error_is_taken_at_the_bound():
    """A coupling measured as 1.006 is one: the diagnosis goes on with it, and writes a model that is read again."""
    assert EFFECTS["spin_coupling"].nearest({"coupling": 1.0063}) == {"coupling": 1.0}
    assert EFFECTS["nes_rocking"].nearest({"relative": -1.02, "decay_s": np.nan}) == {"relative": -1.0}
    sizes = {"coupling": {"value": 1.0063, "low": 0.99, "high": 1.02}}
    summary = {"verdict": "effect", "effects": ["spin_coupling"], "parameters": {"spin_coupling": sizes}}
    given = tomllib.loads(model_section(summary, None, {}))["model"]["effect_parameters"]["spin_coupling"]
    assert EFFECTS["spin_coupling"].complete(given) == {"coupling": 1.0}


@pytest.mark.further
def test_a_coupling_beyond_one_stops_no_diagnosis(tmp_path):
    """Without friction in ``[model]`` its coupling is measured, and held by the estimator of the sizes."""
    made = make_series("floor_friction", 1.0, np.random.default_rng(3), runs=2, noise="white")
    series = brought(made, tmp_path / "s")
    ladder = run_ladder(series, np.random.default_rng(0))
    model = ladder.flights.fitted.model
    parameters = model.parameters.copy()
    parameters[INDEX["coupling"]] = 1.0063
    fitted = replace(ladder.flights.fitted, model=replace(model, parameters=parameters))
    held = improved(replace(ladder, flights=replace(ladder.flights, fitted=fitted)), series.recordings[0].model)
    assert "floor_friction" in [cause.effect for cause in ladder.causes]
    assert held.effect_parameters["spin_coupling"] == {"coupling": 1.0}
