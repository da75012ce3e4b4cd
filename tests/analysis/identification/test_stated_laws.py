"""Laws that ``[model] laws`` states: held by identification and comparison, by truth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from analysis.blind.recording.files import write_series
from analysis.blind.series import make_series
from analysis.compare import compare
from analysis.flights.stated_terms import held_laws
from analysis.identify import FORCE_SAID, identify_series
from analysis.motion.rig_frame import RigFrame
from analysis.walls.lobes import LobedWall
from analysis.walls.outlines import Ring
from analysis.walls.wall import Wall
from ovines.core import simulate
from ovines.core.laws.terms import Factor, Term, WrittenLaw, rows_of
from ovines.errors import InputError
from ovines.law_file import law_text
from ovines.pipeline.series.diagnosis import load_series
from ovines.pipeline.stages import parameters_of, stage
from ovines.recording import read_recording, read_series
from ovines.simulations.results import impact_table, motion_table
from ovines.tables import TABLES
from tests.analysis.identification.test_compare import SCENARIO, TOML, identified

LATE_S = 3.7  # of the recording's clock at its first frame
FLIGHT = WrittenLaw(
    (
        Term("fixed_direction", 3.0, (Factor("time", "cosine", 1.0, 0.08),), x=0.7),
        Term("floor_friction", -0.6, (Factor("since", "exponential", 1.0, 0.02),)),
        Term("fixed_direction", 1.5, (Factor("phase", "cosine", 1.0, x=0.4),), x=-1.0),
    )
)
IMPACT = WrittenLaw(
    (
        Term("restitution", -0.05, (Factor("approach"),)),
        Term("wall_friction", 0.05, (Factor("azimuth", "cosine", 2.0, x=0.3),)),
        Term("spin_kept", -0.1),
        Term("contact_normal", 0.04, (Factor("slip", "tanh", 1.0, 0.3),)),
    )
)
WALL = WrittenLaw((Term("contact_radius", 2e-4, (Factor("azimuth", "cosine", 3.0, x=0.3),)),))


def recording(folder, laws):
    for number, law in enumerate(laws, 1):
        (folder / f"law-{number}.toml").write_text(law_text(law, "a law"))
    names = ", ".join(f'"law-{number}.toml"' for number in range(1, len(laws) + 1))
    (folder / "recording.toml").write_text(TOML.format(model=f"laws = [{names}]" if laws else ""))
    return read_recording(folder)


def test_a_comparison_simulates_the_stated_laws(tmp_path):
    """Laws of time, drive phase and time since an impact, on a clock of the recording's own; of impacts; the wall's."""
    result = simulate(replace(SCENARIO, laws=(FLIGHT, IMPACT, WALL)))
    motion, impacts = motion_table(result), impact_table(result)
    motion["time_s"] += LATE_S
    impacts["time_s"] += LATE_S
    impacts = impacts.assign(normal_rad=result.impacts["normal_rad"])  # as identification tells it
    measured = impacts[[name for name in TABLES["impacts"].names if name in impacts]]
    contacts = [(a + LATE_S, b + LATE_S) for a, b in result.contacts]

    def found(folder, laws):
        folder.mkdir()
        rng = np.random.default_rng(0)
        return compare(motion, measured, identified(), recording(folder, laws), rng, 0, contacts)

    held, plain = found(tmp_path / "held", (FLIGHT, IMPACT, WALL)), found(tmp_path / "plain", ())
    assert len(held.flights) >= 5
    assert held.flights["rms_m"].max() < 1e-7
    assert plain.flights["rms_m"].max() > 1e-4
    for name in ("normal_speed_after_m_per_s", "tangential_speed_after_m_per_s", "spin_after_rad_per_s"):
        np.testing.assert_allclose(held.impacts[f"simulated_{name}"], held.impacts[name], atol=1e-5)
        assert np.nanmax(np.abs(plain.impacts[f"simulated_{name}"] - plain.impacts[name])) > 1e-3


@pytest.mark.parametrize("turn_rad", [0.3, -0.3])
def test_blows_that_are_turned_far_are_compared_as_they_are_simulated(tmp_path, turn_rad):
    """Also where the disk does not come into the turned wall, and where the blow is turned into the wall."""
    law = WrittenLaw((Term("contact_normal", turn_rad),))
    result = simulate(replace(SCENARIO, laws=(law,)))
    impacts = impact_table(result).assign(normal_rad=result.impacts["normal_rad"])
    measured = impacts[[name for name in TABLES["impacts"].names if name in impacts]]
    contacts = [tuple(span) for span in result.contacts]
    found = compare(motion_table(result), measured, identified(), recording(tmp_path, (law,)),
                    np.random.default_rng(0), 0, contacts)  # fmt: skip
    assert len(found.impacts) >= 3
    for name in ("normal_speed_after_m_per_s", "tangential_speed_after_m_per_s", "spin_after_rad_per_s"):
        np.testing.assert_allclose(found.impacts[f"simulated_{name}"], found.impacts[name], rtol=0, atol=1e-9)
    normal, slip, spin = (
        measured[f"{name}_before_{unit}"].to_numpy()
        for name, unit in (("normal_speed", "m_per_s"), ("tangential_speed", "m_per_s"), ("spin", "rad_per_s"))
    )
    comes = np.cos(turn_rad) * normal + np.sin(turn_rad) * (slip - SCENARIO.nes.radius_m * spin)
    assert np.any(np.abs(measured["normal_speed_after_m_per_s"]) < 1e-9) and np.any(comes <= 0) == (turn_rad > 0)


@pytest.fixture(scope="module")
def swirl(tmp_path_factory):
    """Two runs in which the disk is swirled about, the law that does it, and the plant."""
    folder = tmp_path_factory.mktemp("swirl") / "series"
    made = make_series("unknown_swirl", 1.0, np.random.default_rng(6), runs=2, noise="white")
    write_series(made, folder)
    law = WrittenLaw((Term("swirl", made.truth["parameters"]["unknown_swirl"]["swirl_per_s2"], (Factor("radius"),)),))
    return folder, law, made.truth["plant"]


def stating(folder, law):
    for one in sorted(folder.glob("run-*")):
        (one / "law-1.toml").write_text(law_text(law, "swirl"))
        path = one / "recording.toml"
        text = path.read_text()
        if "laws" not in text:
            path.write_text(text.replace("[model]\n", '[model]\nlaws = ["law-1.toml"]\n'))
    return read_series(folder)


def values(joint: pd.DataFrame) -> dict[str, tuple[float, float]]:
    return {row.parameter: (row.value, row.sd) for row in joint.itertuples()}


@pytest.mark.further
def test_identification_holds_a_law_of_the_flights(swirl):
    """With it nothing unknown is left in the flights, and the floor's friction is the plant's."""
    folder, law, plant = swirl
    series, _ = load_series(read_series(folder), folder / "results")
    plain = identify_series(series.motions, series.recordings)[1][0]
    joint, (held, *_) = identify_series(series.motions, stating(folder, law))
    assert any(note.startswith(FORCE_SAID) for note in plain.notes)
    assert not any(note.startswith(FORCE_SAID) for note in held.notes)
    value, sd = values(joint)["floor_friction"]
    assert abs(value - plant["floor_friction"]) < 4 * sd
    assert sd < values(plain.identification)["floor_friction"][1]


def test_a_law_belongs_to_what_results_depend_on(swirl):
    """Another size of it is another model: the stage is stale."""
    folder, law, _ = swirl
    (first, *_) = stating(folder, law)
    before = parameters_of(stage("identify"), first)
    (other,) = law.terms
    (again, *_) = stating(folder, WrittenLaw((replace(other, coefficient=2 * other.coefficient),)))
    assert parameters_of(stage("identify"), again) != before


@pytest.mark.parametrize("turn_rad", [0.0, 0.7])
def test_a_ring_holds_a_law_of_its_radius(turn_rad):
    """Gap and normal are those of lobes of the same size, in metres and in the rig's own unit; where the frame turns,
    the law does."""
    lobes = LobedWall(Ring(0.04), order=3, lobes=5e-3 * np.array([np.cos(0.9), np.sin(0.9)]))
    term = Term("contact_radius", 2e-4, (Factor("azimuth", "cosine", 3.0, x=0.3 + turn_rad),))
    frame = RigFrame(np.zeros(2), turn_rad, (0.0,), 0.04)
    rows = rows_of(frame.law(WrittenLaw((term,))).terms)
    azimuth = np.linspace(0.0, 2 * np.pi, 50)
    places, angle = np.column_stack([np.cos(azimuth), np.sin(azimuth)]), np.zeros(50)
    first = np.zeros(50, np.int64)
    held = Wall.ring(1.0).holding(rows).moved({"centre_x": 0.01}).seen(first, places, angle, 0.2)
    alike = lobes.over(0.04).moved({"centre_x": 0.01}).seen(first, places, angle, 0.2)
    np.testing.assert_allclose(held, alike, atol=5e-6)
    assert np.ptp(held[:, 1] - held[:, 2]) > 0.02
    turned = replace(frame, length=1.0).law(WrittenLaw((term,)))
    in_metres = Wall.ring(0.04).holding(rows_of(turned.terms))
    np.testing.assert_allclose(in_metres.over(0.04).outline.law, rows, rtol=1e-12)


@pytest.mark.parametrize(
    ("factors", "polygon", "said"),
    [
        ((Factor("time"),), False, "follows more than the azimuth"),
        ((Factor("azimuth", "cosine", 3.0), Factor("approach")), False, "follows more than the azimuth"),
        ((Factor("azimuth", "cosine", 3.0),), True, "flat walls"),
    ],
)
def test_a_law_of_a_wall_that_does_not_stand_still_or_is_not_round_is_refused(swirl, factors, polygon, said):
    folder, _, _ = swirl
    recordings = stating(folder, WrittenLaw((Term("contact_radius", 1e-4, factors),)))
    if polygon:
        square = tuple((0.04 * x, 0.04 * y) for x, y in ((1, -1), (1, 1), (-1, 1), (-1, -1)))
        bodies = recordings[0].settings.bodies
        host = bodies.host.model_copy(update={"inner_radius_m": None, "polygon_m": square})
        bodies = bodies.model_copy(update={"host": host})
        settings = recordings[0].settings.model_copy(update={"bodies": bodies})
        recordings = [replace(one, settings=settings) for one in recordings]
    with pytest.raises(InputError, match=said):
        held_laws(recordings)
