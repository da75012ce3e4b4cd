"""`ovines orbits` and `ovines design`: tables, figures, and refusals of what cannot be."""

import numpy as np
import pytest

from ovines.__main__ import main
from ovines.tables import read_table

LINE = ["--states", "host_x_m,host_vx_m_per_s"]
QUESTIONS = {
    "lyapunov": ("lyapunov", ["impact-oscillator", *LINE]),
    "section": ("section", ["impact-oscillator", *LINE, "--transient", "50", "--periods", "20"]),
    "bifurcation": (
        "section",
        ["impact-oscillator", *LINE, "--over", "drive_frequency_factor=0.9:1.1:5", "--periods", "10"],
    ),
    "follow": ("orbits", ["impact-oscillator", *LINE, "--over", "restitution=0.75:0.85:6"]),
    "basins": (
        "basins",
        [
            "impact-oscillator",
            *LINE,
            "--over",
            "host_x_m=-1:0.5:6",
            "--over",
            "host_vx_m_per_s=-1:1:4",
            "--periods",
            "3",
        ],
    ),
}


@pytest.mark.others_further
@pytest.mark.parametrize("question", list(QUESTIONS))
def test_questions_write_a_table_and_a_figure(question, tmp_path, capsys):
    name, rest = QUESTIONS[question]
    assert main(["orbits", question, *rest, "--out", str(tmp_path)]) == 0
    table = read_table(tmp_path / f"{name}.parquet", name)
    assert len(table) and (tmp_path / f"{question}.png").is_file() and (tmp_path / f"{question}.svg").is_file()
    assert str(tmp_path) in capsys.readouterr().out
    if question == "basins":
        assert (table["attractor"].isna() == (table["value"] > 0)).all()
    if question == "follow":
        assert table["value"].min() < 0.77 and table["value"].max() > 0.83 and table["stable"].all()


def test_sensitivities_in_a_table(tmp_path, capsys):
    asked = ["orbits", "sensitivities", "table-3", "--by", "nes_y_m,restitution", "--out", str(tmp_path)]
    assert main(asked) == 0
    table = read_table(tmp_path / "sensitivities.parquet", "sensitivities")
    first = table[(table["of"] == "impact_time_s") & (table["by"] == "nes_y_m")].iloc[0]
    assert first["derivative"] == pytest.approx(1 / np.sqrt(2 * 9.81 * 9), rel=1e-12)
    assert "per unit of restitution" in capsys.readouterr().out


@pytest.mark.further
def test_a_design(tmp_path, capsys):
    asked = ["design", "sprung-host", "--band", "0.95:1.05:3", "--over", "clearance_m=0.03:0.08", "--candidates", "4"]
    few = ["--keep", "2", "--runs", "4", "--transient", "20", "--periods", "10", "--out", str(tmp_path)]
    assert main([*asked, *few]) == 0
    said = capsys.readouterr().out
    assert "best NES" in said and "tuned mass damper" in said and "pumped into the NES" in said
    for name in ("energy_taken", "response", "design"):
        assert len(read_table(tmp_path / f"{name}.parquet", name))
        assert (tmp_path / f"{name}.png").is_file()


@pytest.mark.parametrize(
    ("asked", "word"),
    [
        (["orbits", "follow", "impact-oscillator", *LINE], "--over"),
        (["orbits", "bifurcation", "impact-oscillator", *LINE, "--over", "colour=0:1:3"], "colour"),
        (["orbits", "section", "impact-oscillator", "--states", "colour"], "colour"),
        (["orbits", "lyapunov", "table-3"], "periodic drive"),
        (["orbits", "sensitivities", "rig", "--by", "colour"], "colour"),
        (["design", "rig"], "sprung"),
        (["design", "sprung-host", "--band", "1:2"], "--band"),
        (["design", "sprung-host", "--over", "colour=0:1"], "colour"),
        (["design", "sprung-host", "--over", "mass_ratio=1:0"], "mass_ratio"),
    ],
)
def test_questions_that_cannot_be_answered(asked, word, tmp_path, capsys):
    assert main([*asked, "--out", str(tmp_path)]) == 2
    assert word in capsys.readouterr().err
