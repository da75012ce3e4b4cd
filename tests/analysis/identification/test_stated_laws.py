"""Laws that ``[model] laws`` states: held by identification and comparison, by truth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from analysis.blind.recording.files import write_series
from analysis.blind.series import make_series
from analysis.compare import compare
from analysis.identify import FORCE_SAID, identify_series
from ovines.core import simulate
from ovines.core.laws.terms import Factor, Term, WrittenLaw
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
    )
)


def recording(folder, laws):
    for number, law in enumerate(laws, 1):
        (folder / f"law-{number}.toml").write_text(law_text(law, "a law"))
    names = ", ".join(f'"law-{number}.toml"' for number in range(1, len(laws) + 1))
    (folder / "recording.toml").write_text(TOML.format(model=f"laws = [{names}]" if laws else ""))
    return read_recording(folder)


def test_a_comparison_simulates_the_stated_laws(tmp_path):
    """Laws of time, drive phase and time since an impact, on a clock of the recording's own; and laws of impacts."""
    result = simulate(replace(SCENARIO, laws=(FLIGHT, IMPACT)))
    motion, impacts = motion_table(result), impact_table(result)
    motion["time_s"] += LATE_S
    impacts["time_s"] += LATE_S
    measured = impacts[[name for name in TABLES["impacts"].names if name in impacts]]
    contacts = [(a + LATE_S, b + LATE_S) for a, b in result.contacts]

    def found(folder, laws):
        folder.mkdir()
        rng = np.random.default_rng(0)
        return compare(motion, measured, identified(), recording(folder, laws), rng, 0, contacts)

    held, plain = found(tmp_path / "held", (FLIGHT, IMPACT)), found(tmp_path / "plain", ())
    assert len(held.flights) >= 5
    assert held.flights["rms_m"].max() < 1e-7
    assert plain.flights["rms_m"].max() > 1e-4
    for name in ("normal_speed_after_m_per_s", "tangential_speed_after_m_per_s", "spin_after_rad_per_s"):
        np.testing.assert_allclose(held.impacts[f"simulated_{name}"], held.impacts[name], atol=1e-5)
        assert np.nanmax(np.abs(plain.impacts[f"simulated_{name}"] - plain.impacts[name])) > 1e-3


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


def test_a_law_of_the_wall_is_refused_by_identification(swirl):
    folder, _, _ = swirl
    series, _ = load_series(read_series(folder), folder / "results")
    wall = WrittenLaw((Term("contact_radius", 1e-4, (Factor("azimuth", "cosine", 3.0),)),))
    with pytest.raises(InputError, match="a law of the wall"):
        identify_series(series.motions, stating(folder, wall))
