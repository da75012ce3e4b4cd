"""`ovines simulate`, `sweep` and `shaker`: tables, figures, and refusals of what cannot be."""

import numpy as np
import pytest

from ovines.__main__ import main
from ovines.tables import read_table
from tests.conftest import draw_nothing


def test_a_run_with_figures_and_copies(tmp_path, capsys, monkeypatch):
    command = ["simulate", "table-15-case-2", "--out", str(tmp_path), "--figures", "--runs", "20"]
    assert main(command) == 0
    draw_nothing(monkeypatch)
    assert main(command) == 0  # ours are replaced
    said = capsys.readouterr().out
    assert "sliding on the floor" in said and "20 copies" in said
    energies = read_table(tmp_path / "energies.parquet", "energies")
    assert np.abs(energies["residual_j"]).max() < 1e-12 and len(energies) == 801
    impacts = read_table(tmp_path / "simulated_impacts.parquet", "simulated_impacts")
    assert {"restitution_loss_j", "wall_friction_loss_j", "work_j"} <= set(impacts)
    assert len(read_table(tmp_path / "ensemble.parquet", "ensemble")) == 20
    drawn = {path.stem for path in (tmp_path / "figures").glob("*.png")}
    assert drawn == {"paths", "coordinates", "velocities", "energies", "impacts", "floor_friction"}


def test_a_drop_shows_its_rebound_heights(tmp_path, monkeypatch):
    draw_nothing(monkeypatch)
    assert main(["simulate", "table-3", "--out", str(tmp_path), "--figures", str(tmp_path / "drawn")]) == 0
    assert (tmp_path / "drawn" / "rebound_heights.png").is_file()


@pytest.mark.further
def test_a_sweep_over_two_parameters(tmp_path, capsys):
    over = ["--over", "restitution=0.6:0.8:2", "--over", "nes_radius_m=0.008:0.012:3"]
    assert main(["sweep", "rig", *over, "--runs", "3", "--out", str(tmp_path)]) == 0
    table = read_table(tmp_path / "sweep.parquet", "sweep")
    assert len(table) == 6 and set(table["other_parameter"]) == {"nes_radius_m"} and (table["runs"] == 3).all()
    assert (tmp_path / "sweep.png").is_file() and "most impacts" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--over", "colour=0:1:2"], "restitution"),
        (["--over", "restitution=0:1"], "LOW:HIGH:COUNT"),
        (["--over", "restitution=0.5:0.5:3"], "differ"),
        (["--over", "restitution=0.5:0.6:2", "--over", "restitution=0:1:2"], "each once"),
        (["--over", "restitution=0.5:0.6:2", "--runs", "0"], "at least one"),
        (["--over", "host_radius_m=0.005:0.006:2"], "host_radius_m"),
    ],
)
def test_sweeps_that_cannot_be(options, said, tmp_path, capsys):
    assert main(["sweep", "rig", "--out", str(tmp_path), *options]) == 2
    assert said in capsys.readouterr().err and not list(tmp_path.iterdir())


@pytest.mark.further
def test_the_shaker_of_the_thesis(tmp_path, capsys):
    asked = ["shaker", "--frequency-hz", "11", "--acceleration-g", "9"]
    assert main([*asked, "--travel-m", "0.0254", "--out", str(tmp_path)]) == 0
    said = capsys.readouterr().out
    assert "18.48 mm" in said and "36.29 mm" in said and "within the shaker" in said
    assert (tmp_path / "shaker.png").is_file()
    assert main([*asked, "--travel-m", "0.0127"]) == 0
    assert "BEYOND" in capsys.readouterr().out  # one inch from peak to peak (ERRATA)
    assert main(["shaker", "--frequency-hz", "0", "--acceleration-g", "9"]) == 2
    assert main([*asked, "--nes-radius-m", "1"]) == 2


@pytest.mark.parametrize(
    "options",
    ["--frequency-hz 1e-300", "--frequency-hz 1e300", "--acceleration-g 1e-300", "--acceleration-g inf", "--ratio 1",
     "--ratio nan", "--nes-radius-m 0.04 --host-radius-m 0.04", "--host-radius-m 1e-300", "--host-radius-m 1e300",
     "--travel-m 1e-300", "--velocity-m-per-s nan"],
)  # fmt: skip
def test_shakers_that_cannot_be(options, tmp_path, capsys):
    asked = ["shaker", "--frequency-hz", "11", "--acceleration-g", "9", "--out", str(tmp_path / "out")]
    assert main([*asked, *options.split()]) == 2, capsys.readouterr()
    assert "expected:" in capsys.readouterr().err
