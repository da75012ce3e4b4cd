"""Walls of every kind: what the seam says of them, and identification inside them against the independent plant."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analysis.checks.recording import check_run
from analysis.identify import identify_series
from analysis.walls.drawn import motion_gaps, stated_wall
from analysis.walls.outlines import Cylinder, Ring, Sides
from analysis.walls.wall import Wall
from ovines.errors import InputError
from ovines.recording import read_recording, read_series
from ovines.tables import read_table
from tests.plants import Spec, make_series, write_series
from tests.plants.scoring import NAMES, impact_scores, parameter_scores

SQUARE = np.array([0.0, 0.5, 1.0, 1.5]) * np.pi + 0.3
WALLS = {
    "ring": Wall(Ring(0.04, np.array([1e-3, -2e-3]), np.array([0.01, 0.02])), None, np.array([1e-4, 2e-4])),
    "square": Wall(Sides(SQUARE, np.full(4, 0.04), np.full(4, 0.04), 0.1)),
    "ring and cylinder": Wall(Ring(0.04), Cylinder(0.02, np.array([1e-3, 2e-3]))),
}


@pytest.mark.parametrize("kind", WALLS)
def test_the_normal_is_the_direction_in_which_the_gap_grows(kind):
    wall, rng = WALLS[kind], np.random.default_rng(1)
    places, turn, h = rng.uniform(-0.03, 0.03, (50, 2)), rng.uniform(-1, 1, 50), 1e-7
    gaps, normals = wall.gaps(places, turn)
    for k in range(len(wall.names)):
        slope = [(wall.gaps(places + step, turn)[0][:, k] - gaps[:, k]) / h for step in h * np.eye(2)]
        # to first order in the ellipse, and where the wall is: inside it the ellipse's normal turns faster
        away = 0.05 if kind == "ring" else 1e-5
        at_wall = np.hypot(*places.T) > (0.025 if kind == "ring" else 0.0)
        assert np.allclose(slope[0][at_wall], np.cos(normals[at_wall, k]), atol=away)
        assert np.allclose(slope[1][at_wall], np.sin(normals[at_wall, k]), atol=away)


def test_a_square_turns_with_its_host_and_its_corners_are_where_its_sides_meet():
    wall = WALLS["square"]
    corners = wall.outline.corners_m()
    assert np.allclose(np.hypot(*corners.T), 0.04 * np.sqrt(2), rtol=1e-5, atol=1e-8)
    c, s = np.cos(0.7), np.sin(0.7)
    turned = corners @ np.array([[c, s], [-s, c]])
    assert np.allclose(np.sort(wall.gaps(turned, np.full(4, 0.7))[0], axis=1)[:, -2:], 0.0, atol=1e-12)
    grown = wall.grown(1e-3)
    assert np.allclose(grown.outline.centre_m, 0.0, atol=1e-12)
    assert wall.size_m == pytest.approx(0.08 / np.sqrt(np.pi))


def test_the_side_hit_in_a_corner_is_known_by_the_impulse():
    wall = Wall(Sides(SQUARE - 0.3, np.full(4, 0.04), np.full(4, 0.04)))
    corner = np.full((2, 2), 0.0399)
    assert wall.hit(corner, np.zeros(2), np.array([[-1.0, 0.2], [0.2, -1.0]])).tolist() == [0, 1]


def test_a_stated_wall_that_nothing_fits_in_is_refused_in_words(tmp_path):
    text = """format = 1
[time]
frame_rate_hz = 100.0
[bodies.host]
markers = []
polygon_m = {}
[bodies.nes]
markers = []
radius_m = 0.01
"""
    for corners in ([[0.1, -0.1], [0.1, 0.1], [0.0, 0.005], [-0.1, 0.1]], [[0.1, -0.1], [0.1, 0.1], [0.005, 0.0]]):
        (tmp_path / "recording.toml").write_text(text.format(corners))
        with pytest.raises(InputError, match="polygon_m"):
            stated_wall(read_recording(tmp_path))


# The floor's friction knows nothing of the wall; of three errors one is beyond 3 sd once in a hundred draws.
MOST_SDS = dict.fromkeys(NAMES.values(), 2.5) | {"mu_s": 3.0}
PLANTS = {
    "square": {"sides": 4.0, "sides_rad": 0.4},
    "triangle": {"sides": 3.0, "sides_rad": -0.2},
    "cylinder": {"cylinder_m": 0.02, "radius_m": 0.008},
}


@pytest.fixture(
    scope="module",
    params=["square", *(pytest.param(one, marks=pytest.mark.further) for one in ("triangle", "cylinder"))],
)
def inside(request, tmp_path_factory):
    """Two runs of a plant inside a wall: what was made, its recordings, and what identification says."""
    spec = Spec(
        noise="white",
        reach_m=0.04,
        noise_share=1e-4,
        frames_per_flight=20.0,
        most_frames=800,
        physics={**PLANTS[request.param], "restitution_scatter": 0.01},
    )
    made = make_series(spec, np.random.default_rng([3, list(PLANTS).index(request.param)]), 2)
    series = read_series(write_series(made, tmp_path_factory.mktemp(request.param) / "series"))
    motions = [read_table(one.folder / "motion.parquet", "motion") for one in series]
    return made, series, motions, *identify_series(motions, series)


@pytest.mark.further
def test_every_impact_is_found_on_its_surface_and_none_is_invented(inside):
    made, _, _, _, identified = inside
    for run, found in zip(made, identified, strict=True):
        scores = impact_scores(found.impacts, run)
        assert scores["impacts"] >= 5
        assert (scores["missed"], scores["false"]) == (0, 0)
        assert np.sqrt(np.mean(np.square(scores["errors"]))) < 0.1  # frames
        true = run.truth["impacts"]
        for _, one in found.impacts.iterrows():
            near = true.iloc[int(np.argmin(np.abs(true["time_s"] - one["time_s"])))]
            assert abs(np.angle(np.exp(1j * (one["azimuth_rad"] - near["azimuth_rad"])))) < 0.02
            towards = np.cos(one["normal_rad"] - one["azimuth_rad"])
            assert towards < -0.999 if one["surface"] == "cylinder" else towards > 0.4


def test_the_law_comes_out_within_its_sds(inside):
    made, _, _, joint, _ = inside
    scores = parameter_scores(joint, made)
    far = {short: scores[f"{short}_z"] for short in NAMES.values() if abs(scores[f"{short}_z"]) > MOST_SDS[short]}
    assert far == {}


def test_the_wall_is_where_it_was_stated_and_a_millimetre_off_is_reported(inside):
    _, series, motions, _, identified = inside
    found = identified[0]
    nothing = dict.fromkeys(("thesis", "points"))
    checks = check_run(found.rig, 0, motions[0], series[0], found.impacts, found.flights, **nothing)
    row = checks.set_index("check").loc["wall at the impacts against the stated one"]
    assert row["state"] == "holds"
    assert checks.set_index("check").loc["approaches to the wall explained", "state"] == "holds"
    assert abs(motion_gaps(motions[0], stated_wall(series[0])).max()) < 3e-4
    rig = found.rig
    length = next(t for t in rig.wall.terms if Wall.is_length(t))
    k = rig.wall.terms.index(length)
    moved = rig.wall.estimate.copy()
    moved[k] += 1e-3 * rig.runs[0].data.wall.size_m / stated_wall(series[0]).size_m
    off = check_run(
        replace(rig, wall=replace(rig.wall, estimate=moved)),
        0,
        motions[0],
        series[0],
        found.impacts,
        found.flights,
        **nothing,
    )
    row = off.set_index("check").loc["wall at the impacts against the stated one"]
    assert row["state"] == "fails" and row["value"] == pytest.approx(1e-3 / stated_wall(series[0]).size_m, rel=0.05)
