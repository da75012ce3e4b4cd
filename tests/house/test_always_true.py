"""What holds for any input, tried on drawn ones: inverses, walls, energy, mirrors, units, and a chain that repeats
itself.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from analysis.identify import identify
from analysis.motion.bodies import motion_from_points
from ovines.__main__ import main
from ovines.camera import Camera, triangulate_points
from ovines.core import FloorFriction, Harmonic, Host, ImpactLaw, Nes, Scenario, SimulationResult, simulate
from ovines.recording import Recording, read_recording
from tests.conftest import (
    HOST_LAYOUT_M,
    NES_LAYOUT_M,
    bouncing_motion,
    drawn,
    moved,
    recording_toml,
    two_cameras,
    write_small_recording,
)

SOME = drawn(25)
PLACES_M = st.tuples(st.floats(-0.06, 0.06), st.floats(-0.06, 0.06), st.floats(-0.02, 0.04))
SHARE = st.floats(0, 1)


@st.composite
def cameras(draw: st.DrawFn) -> list[Camera]:
    """The two of the tests, each turned and moved a little, with lenses of its own."""
    made = []
    for camera in two_cameras():
        turn = np.array([draw(st.floats(-0.05, 0.05)) for _ in range(3)])
        angle = max(float(np.linalg.norm(turn)), 1e-12)
        k = np.array([[0, -turn[2], turn[1]], [turn[2], 0, -turn[0]], [-turn[1], turn[0], 0]]) / angle
        rotation = camera.rotation @ (np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k)
        lens = np.array(
            [
                draw(st.floats(-0.2, 0.2)),
                draw(st.floats(-0.1, 0.1)),
                draw(st.floats(-2e-3, 2e-3)),
                draw(st.floats(-2e-3, 2e-3)),
                0.0,
            ]
        )
        made.append(replace(camera, rotation=rotation, distortion=lens))
    return made


@SOME
@given(cameras(), st.lists(PLACES_M, min_size=1, max_size=5))
def test_triangulation_undoes_projection(pair, places):
    points = np.array(places)
    pixels = [camera.project(points) for camera in pair]
    found = triangulate_points(pair, pixels, [np.full(len(points), 0.1)] * 2)
    assert np.abs(found.points_m - points).max() < 1e-9  # 1 nm at half a metre: 2e-9 of the distance
    assert np.abs(found.epipolar_px).max() < 1e-6 and found.reprojection_px.max() < 1e-6


@SOME
@given(cameras(), PLACES_M)
def test_a_ray_goes_through_what_it_shows(pair, place):
    for camera in pair:
        centre = -camera.rotation.T @ camera.translation_m
        ray = camera.rays(camera.project(np.array(place)))
        towards = np.array(place) - centre
        assert ray @ towards > 0 and np.linalg.norm(np.cross(ray, towards)) < 1e-10


@st.composite
def scenarios(draw: st.DrawFn, driven: bool = False) -> Scenario:
    """A disk of 10 mm in a ring of 50 mm, at rest or shaken, with any impact law and floor friction."""
    radius, angle = 0.038 * draw(SHARE), draw(st.floats(0, 6.28))
    speed, direction = draw(st.floats(0.05, 3)), draw(st.floats(0, 6.28))
    start = (
        radius * np.cos(angle),
        radius * np.sin(angle),
        speed * np.cos(direction),
        speed * np.sin(direction),
        0.0,
        draw(st.floats(-100, 100)),
    )
    drive = (Harmonic("x", draw(st.floats(1e-3, 0.01)), draw(st.floats(5, 15))),) if driven else ()
    host = Host(radius_m=0.05, motion="driven" if driven else "fixed", mass_kg=0.1 if driven else None, drive=drive)
    law = ImpactLaw(draw(SHARE), draw(SHARE), draw(st.floats(-1, 1)))
    friction = (
        FloorFriction(draw(st.floats(0, 0.4)), draw(st.sampled_from(["farkas", "coulomb"])))
        if draw(st.booleans())
        else None
    )
    return Scenario("drawn", Nes(0.01, 0.0246), host, law, 0.15, friction, start)


def kinetic_j(result: SimulationResult, scenario: Scenario) -> np.ndarray:
    m, nes = result.motion, scenario.nes
    moment = nes.inertia_factor * nes.mass_kg * nes.radius_m**2
    return (
        0.5 * nes.mass_kg * (m["nes_vx_m_per_s"] ** 2 + m["nes_vy_m_per_s"] ** 2)
        + 0.5 * moment * m["nes_spin_rad_per_s"] ** 2
    )


@SOME
@given(scenarios())
def test_energy_is_never_created(scenario):
    """In a ring at rest nothing but losses: the kinetic energy falls from sample to sample, and at every impact."""
    result = simulate(scenario)
    energy = kinetic_j(result, scenario)
    assert np.diff(energy).max() <= 1e-12 * energy[0]
    assert (result.impacts["energy_lost_j"] >= -1e-12 * energy[0]).all()
    assert abs(result.energy.relative_residual) < 1e-9


@SOME
@given(scenarios(driven=True))
def test_no_wall_is_passed(scenario):
    m = simulate(scenario).motion
    distance = np.hypot(m["nes_x_m"] - m["host_x_m"], m["nes_y_m"] - m["host_y_m"])
    assert np.max(distance) <= 0.04 * (1 + 1e-14)


def agree(one: SimulationResult, other: SimulationResult, columns: dict[str, float]) -> None:
    """Equal up to the third impact: further on a billiard multiplies a rounding error tenfold at each."""
    impacts = one.impacts["time_s"]
    until_s = impacts[3] - 1e-6 if len(impacts) > 3 else np.inf
    rows = one.time_s < until_s
    for column, factor in columns.items():
        a, b = one.motion[column][rows] * factor, other.motion[column][rows]
        scale = max(float(np.abs(a).max(initial=0)), 1e-3)
        assert np.abs(a - b).max(initial=0) < 1e-7 * scale, column


@SOME
@given(scenarios(driven=True))
def test_a_mirror_changes_nothing(scenario):
    """y -> -y: the same motion with y, angle and spin turned over."""
    x, y, vx, vy, angle, spin = scenario.initial_nes
    mirrored = simulate(replace(scenario, initial_nes=(x, -y, vx, -vy, -angle, -spin)))
    agree(
        simulate(scenario),
        mirrored,
        {"nes_x_m": 1, "nes_y_m": -1, "nes_angle_rad": -1, "nes_vx_m_per_s": 1, "nes_spin_rad_per_s": -1},
    )


@SOME
@given(scenarios(), st.sampled_from([1e-3, 0.25, 3.0, 1e3]))
def test_units_change_nothing(scenario, k):
    """Lengths in another unit (speeds and the floor's load along): the same numbers times k."""
    x, y, vx, vy, angle, spin = scenario.initial_nes
    friction = scenario.friction
    if friction is not None:
        friction = replace(
            friction,
            load_m_per_s2=k * friction.load_m_per_s2,
            regularisation_m_per_s=k * friction.regularisation_m_per_s,
        )
    other = replace(
        scenario,
        nes=replace(scenario.nes, radius_m=k * 0.01),
        host=replace(scenario.host, radius_m=k * 0.05),
        friction=friction,
        initial_nes=(k * x, k * y, k * vx, k * vy, angle, spin),
    )
    agree(
        simulate(scenario),
        simulate(other),
        {"nes_x_m": k, "nes_vy_m_per_s": k, "nes_angle_rad": 1, "nes_spin_rad_per_s": 1},
    )


def points_of(motion: pd.DataFrame, mirror: int = 1, turn_rad: float = 0.0) -> pd.DataFrame:
    """Table points of a motion, the world mirrored (y -> -y) and turned about z."""
    c, s = np.cos(turn_rad), np.sin(turn_rad)
    parts = []
    for prefix, body, layout in (("H", "host", HOST_LAYOUT_M), ("N", "nes", NES_LAYOUT_M)):
        points = moved(layout, *(motion[f"{body}_{name}"].to_numpy() for name in ("x_m", "y_m", "angle_rad")))
        x, y = points[..., 0], mirror * points[..., 1]
        for i in range(len(layout)):
            columns = {"x_m": c * x[:, i] - s * y[:, i], "y_m": s * x[:, i] + c * y[:, i], "z_m": points[:, i, 2]}
            sd = dict.fromkeys(("x_sd_m", "y_sd_m", "z_sd_m", "reprojection_px"), 1e-5)
            parts.append(
                pd.DataFrame(
                    {
                        "frame": motion["frame"],
                        "time_s": motion["time_s"],
                        "marker": f"{prefix}{i + 1}",
                        **columns,
                        **sd,
                    }
                )
            )
    return pd.concat(parts, ignore_index=True)


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    folder = tmp_path_factory.mktemp("plain")
    (folder / "recording.toml").write_text(recording_toml())
    return read_recording(folder)


@SOME
@given(st.sampled_from([1, -1]), st.floats(-3.1, 3.1), st.floats(-30, 30))
def test_motion_turns_and_mirrors_with_the_points(recording, mirror, turn_rad, spin):
    """The measured motion of a turned or mirrored world is the turned or mirrored motion; speeds stay."""
    assume(abs(spin) > 0.1)
    motion = bouncing_motion(40, 800.0).assign(nes_angle_rad=lambda m: spin * m["time_s"])
    plain = motion_from_points(points_of(motion), recording)
    bodies = recording.settings.bodies
    layouts = {"nes": NES_LAYOUT_M * [1, mirror, 1], "host": HOST_LAYOUT_M * [1, mirror, 1]}
    assert bodies.nes is not None
    other = motion_from_points(points_of(motion, mirror, turn_rad), recording, layouts)
    c, s = np.cos(turn_rad), np.sin(turn_rad)
    x, y = plain["nes_x_m"], mirror * plain["nes_y_m"]
    assert np.abs(other["nes_x_m"] - (c * x - s * y)).max() < 1e-9
    assert np.abs(other["nes_y_m"] - (s * x + c * y)).max() < 1e-9
    turned = np.diff(other["nes_angle_rad"]) - mirror * np.diff(plain["nes_angle_rad"])
    assert np.abs(turned).max() < 1e-8


def test_restitution_is_the_same_in_a_mirror(recording):
    """Parameters of the rig do not depend on which way the world is turned: 0.72 in both, to a hundredth of its sd."""
    rng = np.random.default_rng(5)
    motion = bouncing_motion(240, 800.0)
    noisy = motion.assign(**{c: motion[c] + rng.normal(0, 5e-6, len(motion)) for c in ("nes_x_m", "nes_y_m")})
    sd = {f"{body}_{q}": 5e-6 for body in ("nes", "host") for q in ("x_sd_m", "y_sd_m")}
    found = []
    for sign in (1, -1):
        world = noisy.assign(nes_y_m=sign * noisy["nes_y_m"], nes_angle_rad=sign * noisy["nes_angle_rad"], **sd)
        table = identify(world, recording).identification.set_index("parameter")
        found.append(table.loc["restitution", ["value", "sd"]].to_numpy(float))
    assert abs(found[0][0] - 0.72) < 4 * found[0][1] + 1e-3
    assert abs(found[0][0] - found[1][0]) < 0.01 * found[0][1] + 1e-9


def tables_in(out) -> dict[str, bytes]:
    return {str(path.relative_to(out)): path.read_bytes() for path in sorted(out.rglob("*.parquet"))}


@pytest.mark.others_further
@pytest.mark.parametrize("jobs", [("2",), ("1", "2")], ids=" then ".join)
def test_same_input_same_bytes(tmp_path, capsys, jobs):
    """Two recordings and their joint identification: by any number of jobs, again, and forced with one; every table the
    same bytes.
    """
    for number in (1, 2):
        write_small_recording(tmp_path / "series" / f"run-{number:02d}", frames=100, seed=number)
    series, out = str(tmp_path / "series"), tmp_path / "out"
    made = []
    for count in jobs:
        assert main(["identify", series, "--out", f"{out}{count}", "--jobs", count]) == 0, capsys.readouterr().err
        made.append(tables_in(tmp_path / f"out{count}"))
        # Of each recording, and of both together: the parameters and what the lens models leave over.
        assert len(made[-1]) == 2 * 10 + 2
    assert all(one == made[0] for one in made)
    capsys.readouterr()
    assert main(["identify", series, "--out", f"{out}{jobs[0]}"]) == 0
    assert capsys.readouterr().out.count("up to date") == 3 and tables_in(tmp_path / f"out{jobs[0]}") == made[0]
    assert main(["identify", series, "--out", f"{out}{count}", "--force"]) == 0
    assert tables_in(tmp_path / f"out{count}") == made[0]
