"""`ovines plan`: what it writes and says, and what it refuses."""

import pytest

from ovines.__main__ import main
from ovines.tables import read_table
from tests.conftest import recording_toml

DRIVE = "[excitation]\nfrequency_hz = 11.0\nacceleration_g = 6.0\n"
SMALL = ("--days", "1", "--runs", "1", "--duration-s", "0.4", "--noise-px", "0.1", "--px-per-mm", "5.3")


@pytest.fixture
def day(tmp_path):
    text = recording_toml("a day").replace('[calibration]\nfile = "../calibration.json"\n', "")
    (tmp_path / "day").mkdir()
    (tmp_path / "day/recording.toml").write_text(text + DRIVE)
    return tmp_path / "day"


@pytest.mark.further
def test_a_plan_says_what_will_be_known(day, tmp_path, capsys):
    assert main(["plan", str(day / "recording.toml"), *SMALL, "--as-stated"]) == 0
    said = capsys.readouterr().out
    assert "Drive: 6 g at 11 Hz" in said and "Restitution" in said and "assumed: wall_friction 0.15" in said
    table = read_table(day / "plan/plan.parquet", "plan")
    assert set(table["setting"]) == {"as stated"} and {"restitution", "floor_friction"} <= set(table["parameter"])
    page = (day / "plan/plan.html").read_text()
    assert "Will this day determine the rig?" in page and "What would help" not in page
    first = (day / "plan/plan.parquet").read_bytes()
    assert main(["plan", str(day), *SMALL, "--as-stated", "--quiet"]) == 0  # the folder serves as well; same bytes
    assert (day / "plan/plan.parquet").read_bytes() == first


@pytest.mark.further
def test_a_plan_ranks_settings(day, capsys):
    assert main(["plan", str(day), *SMALL, "--yes"]) == 0
    said = capsys.readouterr().out
    assert "what would help" in said and "twice the runs" in said and "half the noise" in said
    table = read_table(day / "plan/plan.parquet", "plan")
    assert table["setting"].nunique() == 9
    assert "svg" in (day / "plan/plan.html").read_text()


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("acceleration_g = 6.0", "", "no [excitation] with frequency_hz and acceleration_g"),
        ("frame_rate_hz = 800.0", "", "frame_rate_hz"),
        ("acceleration_g = 6.0", 'acceleration_g = 6.0\naxis = "z"', "along z"),
        ("inner_radius_m = 0.05\n", "", "neither inner_radius_m nor polygon_m"),
    ],
)
def test_what_no_day_can_be_planned_from(day, old, new, words, capsys):
    path = day / "recording.toml"
    path.write_text(path.read_text().replace(old, new))
    assert main(["plan", str(day), *SMALL]) == 2
    assert words in capsys.readouterr().err and not (day / "plan").exists()


@pytest.mark.parametrize(
    "options",
    [["--runs", "900"], ["--days", "100"], ["--duration-s", "1e6"], ["--duration-s", "1e-9", "--as-stated"],
     ["--runs", "0"], ["--noise-px", "nan"], ["--marker-px", "1"], ["--restitution-scatter", "-1"],
     ["--noise-px", "1", "--marker-px", "9"], ["--px-per-mm", "x"]],
)  # fmt: skip
def test_numbers_of_no_day(day, options, capsys):
    try:
        status = main(["plan", str(day), *options])
    except SystemExit as end:
        status = end.code
    assert status == 2, capsys.readouterr()
    assert not (day / "plan").exists()


@pytest.mark.others_further
@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("frequency_hz = 11.0", "frequency_hz = 1e7"),
        ("frame_rate_hz = 800.0", "frame_rate_hz = 1e9"),
        ("frequency_hz = 11.0", "frequency_hz = 1e-3"),
        ("acceleration_g = 6.0", "acceleration_g = 1e6"),
        ("acceleration_g = 6.0", "acceleration_g = 1e300"),
        ("frequency_hz = 11.0", "frequency_hz = 1e-300"),
        ("inner_radius_m = 0.05", "polygon_m = [[-0.05, -0.05], [0.05, -0.05], [0.0, 0.06]]"),
        ("inner_radius_m = 0.05", "inner_radius_m = 0.05\nobstacle_radius_m = 0.01"),
    ],
)
def test_rigs_at_the_edge(day, old, new, capsys):
    """Planned or refused, in seconds; never a traceback."""
    path = day / "recording.toml"
    path.write_text(path.read_text().replace(old, new))
    status = main(["plan", str(day), *SMALL, "--as-stated"])
    said = capsys.readouterr()
    assert (status == 0 and "page:" in said.out) or (status == 2 and "found:" in said.err), said


def test_another_file_is_no_plan(day, capsys):
    (day / "other.toml").write_text("format = 1")
    assert main(["plan", str(day / "other.toml")]) == 2
    assert "recording.toml" in capsys.readouterr().err
