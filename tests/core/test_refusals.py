"""What cannot be is refused with found, expected, do: in Python, in a file, by the command."""

import math
import subprocess
import sys
from dataclasses import replace

import pytest

from ovines.core import Harmonic, Host, ImpactLaw, Nes, Scenario, ScenarioError, Suspension, simulate
from ovines.errors import InputError
from ovines.scenario import read_scenario

GOOD = Scenario("good", Nes(0.01, 0.02), Host(0.05), ImpactLaw(0.7, 0.1, 0.5), 0.01)
TRIANGLE = ((-0.1, -0.1), (0.1, -0.1), (0.0, 0.1))


@pytest.mark.parametrize(
    ("make", "word"),
    [
        (lambda: Nes(-0.01, 0.02), "radius_m"),
        (lambda: Nes(0.01, 0.0), "mass_kg"),
        (lambda: Nes(math.nan, 0.02), "radius_m"),
        (lambda: Host(-1.0), "radius_m"),
        (lambda: Host(), "exactly one"),
        (lambda: Host(0.05, polygon_m=TRIANGLE), "exactly one"),
        (lambda: Host(polygon_m=TRIANGLE[::-1]), "counter-clockwise"),
        (lambda: Host(polygon_m=((0, 0), (1, 0), (0.2, 0.2), (0, 1))), "convex"),
        (lambda: Host(0.05, motion="shaken"), "host.motion"),
        (lambda: Host(0.05, motion="driven"), "drive"),
        (lambda: Host(0.05, motion="free"), "mass"),
        (lambda: Host(0.05, motion="sprung", mass_kg=1.0), "suspension"),
        (lambda: Suspension((1.0, -1.0, 1.0), (0.0, 0.0, 0.0)), "stiffness"),
        (lambda: Harmonic("w", 1.0, 1.0), "axis"),
        (lambda: ImpactLaw(1.1, 0.1, 0.5), "restitution"),
        (lambda: ImpactLaw(0.7, -0.1, 0.5), "wall_friction"),
        (lambda: ImpactLaw(0.7, 0.1, -1.5), "tangential_restitution"),
        (lambda: replace(GOOD, duration_s=math.inf), "duration_s"),
        (lambda: replace(GOOD, initial_nes=(math.nan,) + (0.0,) * 5), "initial_nes"),
        (lambda: simulate(replace(GOOD, nes=Nes(0.06, 0.02))), "smaller than the Host"),
        (lambda: simulate(replace(GOOD, nes=Nes(0.2, 0.02), host=Host(polygon_m=TRIANGLE))), "smaller"),
        (lambda: simulate(replace(GOOD, host=Host(0.05, obstacle_radius_m=0.035))), "obstacle"),
        (lambda: simulate(replace(GOOD, host=Host(0.05, obstacle_radius_m=0.01))), "outside"),
        (lambda: simulate(replace(GOOD, initial_nes=(0.0401, 0, 0, 0, 0, 0))), "outside a wall"),
    ],
)
def test_refused(make, word):
    with pytest.raises(ScenarioError) as caught:
        make()
    assert word in str(caught.value)
    assert all((caught.value.found, caught.value.expected, caught.value.do))


FILE = """
format = 1
name = "shaken host with floor friction"
[nes]
radius_m = 0.01
mass_kg = 0.0246
[host]
radius_m = 0.05
motion = "driven"
[host.drive]
x = [{amplitude_m = 0.0164, frequency_hz = 11.0, phase_rad = 0.3}]
z = [{amplitude_m = 0.0008, frequency_hz = 11.0, phase_rad = 1.0}]
[impact]
restitution = 0.72
wall_friction = 0.13
tangential_restitution = 0.49
[friction]
coefficient = 0.2
[initial]
nes = [0.03, -0.01, 0.1, 0.0, 0.0, 0.0]
[run]
duration_s = 0.2
[effects.table_tilt]
tilt_rad = 0.01
"""


@pytest.mark.parametrize(
    ("old", "new", "word"),
    [
        ("radius_m = 0.05", "radius_m = -0.05", "radius_m"),
        ("restitution = 0.72", "restitution = 1.72", "restitution"),
        ("radius_m = 0.05", "radius_m = 0.005", "smaller than the Host"),
        ("nes = [0.03,", "nes = [0.3,", "outside"),
        ("table_tilt", "table_tlit", "table_tlit"),
        ("duration_s", "duration", "duration"),
        ("amplitude_m = 0.0164, ", "", "amplitude"),
        ("[nes]", "[nes", "TOML"),
    ],
)
def test_wrong_files(tmp_path, old, new, word):
    assert old in FILE
    (tmp_path / "s.toml").write_text(FILE.replace(old, new, 1))
    with pytest.raises(InputError) as caught:
        read_scenario(tmp_path / "s.toml")
    assert word in str(caught.value)


def test_the_file_gives_the_scenario(tmp_path):
    (tmp_path / "s.toml").write_text(FILE)
    scenario = read_scenario(tmp_path / "s.toml")
    assert scenario.host.drive[1].axis == "z"
    assert scenario.friction.support == "host"
    assert scenario.effects["table_tilt"]["tilt_rad"] == 0.01


def test_the_command_writes_checked_tables(tmp_path):
    from ovines.tables import read_table

    (tmp_path / "s.toml").write_text(FILE)
    code = "import argparse,sys; from ovines.commands.simulator import simulate as c; p=argparse.ArgumentParser(); " \
           "c.add_arguments(p); sys.exit(c.run(p.parse_args()))"  # fmt: skip
    done = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path / "s.toml"), "--out", str(tmp_path / "out")],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    motion = read_table(tmp_path / "out" / "simulation.parquet", "simulation")
    impacts = read_table(tmp_path / "out" / "simulated_impacts.parquet", "simulated_impacts")
    read_table(tmp_path / "out" / "contact.parquet", "contact")
    assert len(motion) == 161
    assert len(impacts) > 2
    assert set(impacts["regime"]) <= {"stick", "slide"}
    assert (impacts["restitution"] - 0.72).abs().max() < 1e-9
