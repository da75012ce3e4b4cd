"""A sealed series looks like the practice series, and every cause changes what its name says."""

import json
import tempfile
import tomllib
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from analysis.blind.causes.groups import GROUPS
from analysis.blind.causes.named import CAUSES, draft_series, physics_of_run
from analysis.blind.plant.dynamics import run_plant, state_at
from analysis.blind.plant.host import host_pose
from analysis.blind.plant.parameters import PlantParameters
from analysis.blind.recording.files import calibration_of
from analysis.blind.recording.place import HOME, Place, draw_place, on_the_films_clock
from analysis.blind.recording.views import draw_views
from analysis.blind.series import NOISE_KINDS, draw_start, make_series, outline_series, run_outline
from ovines.camera import read_calibration, triangulate_points
from tests.gap.blind.plant.rig import short_runs

MEASUREMENT = {name for name, cause in CAUSES.items() if cause.stage == "measurement"} | {"centre_marker_offset"}
# In every series, or moving the Host.
ELSEWHERE = {"floor_friction", "spin_coupling", "host_ringing", "host_sway"}
MOVING = sorted(set(CAUSES) - MEASUREMENT - ELSEWHERE)


def first_by_default(names):
    """All causes as cases of a test: those listed and the first group of the unlisted ones run by default."""
    first = {name for name, one in CAUSES.items() if one.listed} | set(GROUPS["unlisted"])
    return [name if name in first else pytest.param(name, marks=pytest.mark.further) for name in names]


@pytest.fixture(scope="module")
def plain():
    return make_series("none", 1.0, np.random.default_rng(3), noise="white")


def test_series_is_like_the_practice_series(plain):
    """Practice: 201 to 268 impacts above 0.2 m/s, runs of 0.4 to 1.2 s, 98 % of markers seen, 6 to 9 g."""
    assert plain.truth["verdict"] == "none" and plain.truth["effects"] == []
    assert 150 < plain.truth["n_impacts"] < 320
    frames = [tracks.frame.max() + 1 for _, tracks in plain.recordings]
    assert min(frames) >= 318 and max(frames) <= 960
    seen = sum(len(t) for _, t in plain.recordings) / (24 * sum(frames))
    assert 0.96 < seen < 0.995
    held = [plain.states[f"held{run + 1:02d}"] for run in range(12)]
    assert all((h[:, 1] - h[:, 0] < 0.0501).all() for h in held)


@pytest.mark.parametrize("kind", NOISE_KINDS)
def test_noise_of_a_fixed_marker(kind):
    """Ground markers do not move: their scatter is the noise. Its sd is known to about 2 % from 12 runs."""
    series = make_series("none", 1.0, np.random.default_rng(5), noise=kind, runs=4)
    sd = series.truth["sd_px"]
    scatter, neighbour = [], []
    for _, tracks in series.recordings:
        for _, one in tracks[tracks.marker.str.startswith("G")].groupby(["camera", "marker"]):
            x = one.v_px.to_numpy() - one.v_px.median()
            x = x[np.abs(x) < 6 * sd]
            scatter.append(x.std())
            neighbour.append((x[1:] * x[:-1]).mean() / x.var())
    assert np.mean(scatter) == pytest.approx(sd, rel=0.06)
    assert (0.4 < np.mean(neighbour) < 0.75) if kind == "ar1" else abs(np.mean(neighbour)) < 0.1


def test_views_project_as_the_application_does():
    """Two pinhole models written apart agree to a millionth of a pixel."""
    views = draw_views(np.random.default_rng(8))
    points = np.random.default_rng(1).uniform(-0.08, 0.08, (50, 3))
    for view in views:
        theirs = _cameras(calibration_of([view]))[0]
        assert np.abs(theirs.project(points) - view.pixels(points)).max() < 1e-6


@pytest.mark.parametrize("name", first_by_default(sorted(CAUSES)))
def test_a_cause_changes_the_series_and_the_truth(name):
    """What the truth says of a cause: stage, verdict, parameters, and what the nominal model lacks.  Causes that move
    the disk are simulated below; of the others a run is made here.
    """
    make = outline_series if name in MOVING else make_series
    with short_runs():
        truth = make(name, 1.0, np.random.default_rng(11), runs=1, noise="white").truth
    cause = CAUSES[name]
    assert truth["stages"] == [cause.stage]
    assert truth["effects"] == ([name] if cause.listed else [])
    assert truth["verdict"] == ("effect" if cause.listed else "unknown")
    assert truth["parameters"][name] and all(np.isfinite(v) for v in truth["parameters"][name].values())
    if name in MEASUREMENT:
        assert truth["measurement"]
    expected = {"floor_friction": [], "spin_coupling": ["floor_friction"]}
    assert truth["model"]["effects"] == expected.get(name, ["floor_friction", "spin_coupling"])


def _paths(name, size, restitution=None):
    """Ten runs of 0.1 s from fixed starts with the cause at `size` (0: without it), one by one; of what differs from
    run to run the first."""
    drive, rng = 22.0 * np.pi, np.random.default_rng(9)
    draft = draft_series(name if size else "none", size, np.random.default_rng(1), 12)
    if draft.run_friction is not None:
        draft.plant["floor_friction"] *= draft.run_friction[0]
    if draft.run_restitution is not None:  # the first run is the one that they are counted from
        draft.plant["restitution"] *= draft.run_restitution[-1]
    draft.plant["restitution_scatter"] = 0.0
    if restitution is not None:
        draft.plant["restitution"] = restitution
    harmonics = np.array([[0, 0.0164, drive, 2.0], [3, draft.vertical_amplitude_m, drive, 1.0]])
    if "slam_s" in draft.run_numbers:  # a blow at any time of a run, in half of them
        draft.run_numbers["slam_s"][0] = 0.02
    for share in {"gust_share", "specked_share"} & set(draft.run_numbers):  # later in a run than the paths are long
        draft.run_numbers[share][0] = 0.0
    if "rolling_draw" in draft.run_numbers:  # in few of a run's stretches: in one early
        draft.run_numbers["rolling_draw"][0] = 0.3
    physics = physics_of_run(draft, 0, drive, 1.2)
    time = np.linspace(0.0, 0.1, 200)
    for _ in range(10):
        yield state_at(run_plant(physics, harmonics, draw_start(rng), 0.101, rng), time)


@cache
def _without(restitution):
    return list(_paths("none", 0.0, restitution))


@pytest.mark.parametrize("name", first_by_default(MOVING))
def test_a_physical_cause_moves_the_disk_elsewhere(name):
    """From one of the same starts the disk parts by more than the markers' noise (0.02 mm) at both sizes. Two of the
    causes left out are in every series: what makes them a gap is the nominal model that lacks them; two move the
    Host."""
    # One of them sets the restitution at low speed: it is compared with that.
    restitution = 0.86 if name == "speed_dependent_restitution" else None
    for size, least_m in ((0.35, 2e-5), (1.0, 6e-5)):
        runs = zip(_paths(name, size, restitution), _without(restitution), strict=True)
        assert any(np.abs(one - other)[:, :2].max() > least_m for one, other in runs)


def test_same_seed_same_series():
    a, b = (make_series("air_drag+wall_ellipticity", 0.35, np.random.default_rng(2), runs=1) for _ in range(2))
    assert a.truth == b.truth and a.recordings[0][0] == b.recordings[0][0]
    pd.testing.assert_frame_equal(a.recordings[0][1], b.recordings[0][1])
    assert a.truth["effects"] == ["air_drag", "wall_ellipticity"] and a.truth["stages"] == [
        "flight",
        "geometry",
    ]


def _points(series, body):
    """Markers of one body triangulated with the calibration as given, and the epipolar residual."""
    text, tracks = series.recordings[0]
    windows = [np.array(camera["window_offset_px"]) for camera in tomllib.loads(text)["cameras"]]
    tracks = tracks[tracks.marker.str.startswith(body)]
    one, two = (tracks[tracks.camera == camera].set_index(["frame", "marker"]) for camera in ("VW1", "VW2"))
    shared = one.index.intersection(two.index)
    uv = [t.loc[shared, ["u_px", "v_px"]].to_numpy() + w for t, w in zip((one, two), windows, strict=True)]
    solved = triangulate_points(_cameras(series.calibration), uv, [np.ones(len(shared))] * 2)
    marker = shared.get_level_values("marker")
    return {name: solved.points_m[marker == name] for name in set(marker)}, solved.epipolar_px


def _cameras(calibration):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "calibration.json"
        path.write_text(json.dumps(calibration))
        return read_calibration(path)


def _seen_with(name, body):
    series = make_series(name, 1.0, np.random.default_rng(4), runs=1, noise="white")
    return *_points(series, body), series.truth["parameters"].get(name)


def test_length_scale_shows_in_known_distances():
    points, _, true = _seen_with("length_scale_error", "G")
    base = np.linalg.norm(points["G2"].mean(0) - points["G1"].mean(0))
    assert base / np.hypot(0.21, 0.005) == pytest.approx(true["scale"], abs=2e-4)


def test_plane_tilt_shows_in_the_ground_markers():
    points, _, true = _seen_with("plane_tilt", "G")
    slope = (points["G2"].mean(0) - points["G1"].mean(0))[2] / 0.21
    assert slope == pytest.approx(-true["y_rad"], abs=3e-4)


def test_clock_offset_lifts_the_moving_host_and_nothing_else_does():
    """The Host moves along the baseline, so a late camera turns its velocity into height."""
    assert _seen_with("camera_clock_offset", "H")[0]["H1"][:, 2].std() > 3e-4
    assert _seen_with("none", "H")[0]["H1"][:, 2].std() < 1e-4


def test_window_offset_shows_in_the_epipolar_residual():
    assert abs(np.median(_seen_with("sensor_window_offset", "G")[1])) > 1.0
    assert abs(np.median(_seen_with("none", "G")[1])) < 0.05


FAR = Place((1.2, -0.7), 2.5, (5e4,), (1000,), 3.0)


@pytest.fixture(scope="module")
def two_places():
    """The same tilted series at home and elsewhere, three times as large."""
    return [
        make_series("table_tilt", 1.0, np.random.default_rng(21), runs=1, noise="white", place=place)
        for place in (HOME, FAR)
    ]


def test_another_place_has_the_same_pictures_and_tells_its_own_world(two_places):
    """Similar rigs send the same pixels; the calibration, the clock and the sizes in recording.toml tell them apart."""
    home, elsewhere = two_places
    tracks = [series.recordings[0][1] for series in two_places]
    pd.testing.assert_frame_equal(
        tracks[0][["camera", "marker", "u_px", "v_px"]], tracks[1][["camera", "marker", "u_px", "v_px"]]
    )
    assert np.allclose(tracks[1].time_s, tracks[0].time_s * np.sqrt(3) + 5e4, atol=1e-9)
    assert (tracks[1].frame - tracks[0].frame == 1000).all()
    here, _ = _points(home, "H")
    there, _ = _points(elsewhere, "H")
    c, s = np.cos(2.5), np.sin(2.5)
    for name, points in here.items():
        world = 3.0 * points @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) + (1.2, -0.7, 0.0)
        assert np.abs(there[name] - world).max() < 1e-8
    stated = tomllib.loads(elsewhere.recordings[0][0])
    assert stated["bodies"]["host"]["inner_radius_m"] == pytest.approx(0.15) and stated["bodies"]["nes"][
        "mass_kg"
    ] == pytest.approx(0.0246 * 27)
    assert stated["time"]["frame_rate_hz"] == pytest.approx(800 / np.sqrt(3)) and stated["excitation"][
        "frequency_hz"
    ] == pytest.approx(11 / np.sqrt(3))


def test_truths_of_another_place(two_places):
    home, elsewhere = two_places
    tilts = [series.truth["parameters"]["table_tilt"] for series in two_places]
    assert tilts[0]["tilt_rad"] == tilts[1]["tilt_rad"]  # gravity is the same
    assert np.cos(tilts[1]["direction_rad"] - tilts[0]["direction_rad"] - 2.5) == pytest.approx(1.0)
    assert home.truth["n_impacts"] == elsewhere.truth["n_impacts"] and elsewhere.truth["world"]["rig_at_m"] == [
        1.2,
        -0.7,
    ]
    one, other = home.states["state01"], elsewhere.states["state01"]
    assert np.allclose(other[:, :2], 3 * one[:, :2], rtol=1e-5, atol=1e-8) and np.allclose(
        other[:, 5], one[:, 5] / np.sqrt(3), rtol=1e-5, atol=1e-8
    )
    # what flies free of friction's torque for a moment moves with its own velocity: units and clock agree
    step = np.gradient(other[:, 0]) * 800 / np.sqrt(3)
    assert np.median(np.abs(step - other[:, 2])) < 0.02
    clocked = on_the_films_clock(elsewhere.states, FAR)["imp01"]
    assert np.allclose(clocked[:, 0], home.states["imp01"][:, 0] * np.sqrt(3) + 5e4, atol=1e-9)
    assert np.allclose(clocked[:, 1:], home.states["imp01"][:, 1:] * np.sqrt(3), rtol=1e-5, atol=1e-8)


def test_sizes_of_causes_in_another_rigs_units():
    small = Place(turned_rad=0.5, scale=0.25)
    assert small.world_parameters("air_drag", {"rate_per_m": 0.4}) == {"rate_per_m": pytest.approx(1.6)}
    assert small.world_parameters("viscous_drag", {"rate_per_s": 0.6}) == {"rate_per_s": pytest.approx(1.2)}
    assert small.world_parameters("finite_contact_time", {"duration_s": 8e-4}) == {"duration_s": pytest.approx(4e-4)}
    assert small.world_parameters("wall_centre_offset", {"x_m": 4e-4, "y_m": 0.0}) == {
        "x_m": pytest.approx(1e-4),
        "y_m": 0.0,
    }  # in the Host's frame
    assert small.world_parameters("mass_centre_offset", {"x_m": 0.0, "y_m": 2e-4}) == {
        "x_m": 0.0,
        "y_m": pytest.approx(5e-5),
    }  # in the disk's
    speeds = small.world_parameters(
        "speed_dependent_restitution", {"restitution_slow": 0.86, "speed_scale_m_per_s": 1.0}
    )
    assert speeds == {"restitution_slow": 0.86, "speed_scale_m_per_s": pytest.approx(0.5)}
    assert small.world_parameters("wall_ellipticity", {"ellipticity": 0.005, "direction_rad": 0.3})[
        "direction_rad"
    ] == pytest.approx(0.8)
    plane = small.world_parameters("plane_tilt", {"x_rad": 0.01, "y_rad": 0.0})
    assert (plane["x_rad"], plane["y_rad"]) == (pytest.approx(0.01 * np.cos(0.5)), pytest.approx(0.01 * np.sin(0.5)))


def test_places_are_drawn_over_the_whole_bench():
    places = [draw_place(np.random.default_rng(seed), 2) for seed in range(200)]
    far = np.array([np.hypot(*place.rig_at_m) for place in places])
    assert 1.7 < far.max() <= 2.0 and far.min() < 0.4
    assert np.ptp([place.turned_rad for place in places]) > 6.0
    assert 0.25 < np.mean([place.scale == 1.0 for place in places]) < 0.55
    assert {place.frame_rate_hz for place in places} == {400.0, 800.0, 1600.0}
    assert all(len(place.start_s) == len(place.first_frame) == 2 for place in places)


def test_the_plane_leans_the_same_way_in_a_turned_world():
    """The Host's markers triangulated in the world of recording.toml: their normal leans as the truth says."""
    place = Place((0.4, 0.9), -2.0)
    series = make_series("plane_tilt", 1.0, np.random.default_rng(4), runs=1, noise="white", place=place)
    points, _ = _points(series, "G")
    a, b, c = (points[name].mean(0) for name in ("G1", "G2", "G3"))
    normal = np.cross(c - a, b - a)
    normal /= np.linalg.norm(normal) * np.sign(normal[2])
    true = series.truth["parameters"]["plane_tilt"]
    # a turn by (x, y) about the horizontal axes leans the normal towards (y, -x)
    assert normal[:2] == pytest.approx([true["y_rad"], -true["x_rad"]], abs=5e-4)


def test_a_ringing_host_swings_along_the_struck_sides_normal():
    """In a triangle that is not the line from its middle to the disk; by the normal part of the first blow's impulse,
    until the second."""
    outline = outline_series("host_ringing", 1.0, np.random.default_rng(6), 1, "white", place=Place(wall="triangle"))
    series = run_outline(outline, np.random.default_rng(3))
    host, state = series.poses[0][0].host[:, :2], series.states["state01"]
    time_s = np.arange(len(host)) / 800.0
    middle = np.array([host_pose(t, series.states["H01"])[0][:2] for t in time_s])
    first, second = series.states["imp01"][:2, 0]
    between = np.flatnonzero((time_s > first) & (time_s < second))
    before, after = between[0] - 1, between[0]
    sides = 0.5 + 2.0 * np.pi * np.arange(3) / 3.0
    normals, line = np.column_stack([np.cos(sides), np.sin(sides)]), state[before, :2] - middle[before]
    normal = normals[np.argmax(normals @ line)]
    assert line @ normal < 0.9 * np.hypot(*line)
    kick = state[after, 2:4] - state[before, 2:4]  # and a frame of friction
    assert abs(kick @ [-normal[1], normal[0]]) > 0.1
    mass, hz, damping = outline.draft.ringing
    omega, late = 2.0 * np.pi * hz, time_s[between] - first
    rings = np.exp(-damping * omega * late) * np.sin(omega * np.sqrt(1.0 - damping**2) * late)
    most = PlantParameters().mass_kg * abs(kick @ normal) / mass / omega / np.sqrt(1.0 - damping**2)
    off = (host - middle)[between]
    assert len(between) > 5 and np.abs(off @ [-normal[1], normal[0]]).max() < 1e-12
    assert off @ normal == pytest.approx(most * rings, abs=0.02 * most)
    assert np.all((host - middle)[:after] == pytest.approx(0.0, abs=1e-15))


def test_a_drift_of_a_restitution_that_falls_with_the_speed_is_one_of_the_whole():
    """Fast impacts and slow ones alike: what the truth says is what the series holds."""
    kind = "restitution_drift+speed_dependent_restitution"
    drafts = [draft_series(kind, 1.0, np.random.default_rng(seed), 4) for seed in range(6)]
    draft = next(one for one in drafts if one.run_restitution is not None)
    first, last = (physics_of_run(draft, run, 69.0, 1.2) for run in (0, 3))
    share = 1.0 + 3 * draft.parameters["restitution_drift"]["relative_per_run"]
    assert last.restitution == pytest.approx(share * first.restitution, rel=1e-12)
    assert last.restitution_floor == pytest.approx(share * first.restitution_floor, rel=1e-12)
    assert abs(share - 1.0) > 0.1
