"""`ovines export`: each format read back, by another program where there is one, and held against the tables."""

import math
import re
import shutil

import numpy as np
import pandas as pd
import pytest

from ovines.__main__ import main
from ovines.exporters.latex import numbers, words
from ovines.exporters.units import chosen_units, displayed
from ovines.importers.formats.trc import read_trc
from ovines.tables import read_table, write_table
from tests.conftest import HOST_LAYOUT_M, bouncing_motion, moved

FRAMES = 40
HIDDEN = (7, "H2")


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Results of a recording: points with a marker hidden once and a frame dropped, motion, impacts, parameters."""
    folder = tmp_path_factory.mktemp("export") / "results"
    motion = bouncing_motion(FRAMES, 800.0)
    write_table(motion, "motion", folder / "motion.parquet", {"key": "a"})
    places = moved(HOST_LAYOUT_M, *(motion[f"host_{one}"].to_numpy() for one in ("x_m", "y_m", "angle_rad")))
    points = pd.concat(
        [
            motion[["frame", "time_s"]].assign(
                marker=f"H{i + 1}", **{f"{axis}_m": places[:, i, k] + 1e-3 * k for k, axis in enumerate("xyz")},
                x_sd_m=1e-5, y_sd_m=1e-5, z_sd_m=2e-5, reprojection_px=0.1,
            )
            for i in range(4)
        ]
    )  # fmt: skip
    gone = (points["frame"] == 20) | ((points["frame"] == HIDDEN[0]) & (points["marker"] == HIDDEN[1]))
    write_table(points[~gone], "points", folder / "points.parquet", {"key": "a"})
    parameters = pd.DataFrame(
        {
            "parameter": ["restitution", "wall_friction", "contact_radius_m"],
            "value": [0.7199, np.nan, 0.04], "sd": [0.0004, np.nan, 1e-6],
            "low": [0.7191, 0.0348, 0.039998], "high": [0.7205, np.nan, 0.040002],
            "n_impacts": [12, 0, 12],
        }
    )  # fmt: skip
    write_table(parameters, "identification", folder / "identification.parquet", {})
    return folder


@pytest.fixture
def results(made, tmp_path):
    return shutil.copytree(made, tmp_path / "results")


def export(results, to, *options):
    assert main(["export", str(results), "--to", to, *map(str, options)]) == 0
    return results / "export"


def test_csv_has_every_digit_and_says_its_units(results):
    out = export(results, "csv")
    assert {path.name for path in out.iterdir()} == {"motion.csv", "points.csv", "identification.csv"}
    back, stored = pd.read_csv(out / "motion.csv"), read_table(results / "motion.parquet", "motion")
    for name in back.columns:
        np.testing.assert_array_equal(back[name], stored[name])
    shown = pd.read_csv(export(results, "csv", "--units", "mm, ms,deg", "--force", "--tables", "motion") / "motion.csv")
    np.testing.assert_allclose(shown["nes_x_mm"], 1e3 * stored["nes_x_m"], rtol=1e-15)
    np.testing.assert_allclose(shown["time_ms"], 1e3 * stored["time_s"], rtol=1e-15)
    np.testing.assert_allclose(shown["nes_angle_deg"], np.degrees(stored["nes_angle_rad"]), rtol=1e-15)
    assert not [name for name in shown.columns if name.endswith(("_m", "_s", "_rad"))]


def test_units_follow_names_in_rows_too():
    table = pd.DataFrame({"parameter": ["contact_radius_m", "restitution", "slope_s_per_m"], "value": [0.04, 0.7, 1.0],
                          "n_impacts": [3, 3, 3]})  # fmt: skip
    shown = displayed(table, chosen_units("mm"))
    assert shown["parameter"].tolist() == ["contact_radius_mm", "restitution", "slope_s_per_m"]
    assert shown["value"].tolist() == [40.0, 0.7, 1.0] and shown["n_impacts"].tolist() == [3, 3, 3]
    speeds = displayed(
        pd.DataFrame({"v_m_per_s": [1.0], "a_m_per_s2": [2.0], "spin_rad_per_s": [3.0]}), chosen_units("mm,ms,deg")
    )
    assert speeds.columns.tolist() == ["v_m_per_s", "a_m_per_s2", "spin_rad_per_s"]  # SI, as the names say


def test_matlab_reads_columns_and_meanings(results):
    from scipy.io import loadmat

    content = loadmat(export(results, "mat") / "results.mat", simplify_cells=True)
    stored = read_table(results / "points.parquet", "points")
    np.testing.assert_array_equal(content["points"]["x_m"], stored["x_m"])
    assert content["points"]["marker"].tolist() == stored["marker"].tolist()
    assert math.isnan(
        content["identification"]["value"][list(content["identification"]["parameter"]).index("wall_friction")]
    )
    assert "world frame" in content["meaning"]["points"]["x_m"] and '"key": "a"' in content["provenance"]


def places(results):
    """Time and places (frame, marker) -> m of the exported recording, missing ones left out."""
    table = read_table(results / "points.parquet", "points")
    return table.set_index(["frame", "marker"]).sort_index()


def test_trc_comes_back_through_the_importer(results):
    rows, unit = read_trc(export(results, "trc") / "markers.trc")
    stored, back = places(results), rows.set_index(["frame", "marker"]).sort_index()
    assert unit == "mm" and back.index.equals(stored.index)
    np.testing.assert_allclose(1e-3 * back[["x", "y", "z"]], stored[["x_m", "y_m", "z_m"]], rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(back["time_s"], stored["time_s"], atol=1e-9)


def test_c3d_is_read_with_its_gaps(results):
    ezc3d = pytest.importorskip("ezc3d")
    content = ezc3d.c3d(str(export(results, "c3d") / "markers.c3d"))
    points, stored = content["data"]["points"], places(results)
    assert content["parameters"]["POINT"]["RATE"]["value"][0] == pytest.approx(800.0)
    assert content["parameters"]["POINT"]["UNITS"]["value"] == ["mm"] and points.shape == (4, 4, FRAMES)
    for i, name in enumerate(content["parameters"]["POINT"]["LABELS"]["value"]):
        seen = np.isfinite(points[0, i])
        assert ((content["data"]["meta_points"]["residuals"][0, i] < 0) == ~seen).all()
        assert seen.tolist() == [(frame, name) in stored.index for frame in range(FRAMES)]
        np.testing.assert_allclose(
            1e-3 * points[:3, i, seen].T, stored.xs(name, level=1)[["x_m", "y_m", "z_m"]], rtol=1e-6, atol=1e-9
        )


def test_netcdf_has_movement_s_layout(results):
    xarray = pytest.importorskip("xarray")
    with xarray.open_dataset(export(results, "netcdf") / "markers.nc") as data:
        assert data["position"].dims == ("time", "space", "keypoints", "individuals")
        assert data["confidence"].dims == ("time", "keypoints", "individuals")
        assert data.attrs["ds_type"] == "poses" and data.attrs["fps"] == pytest.approx(800.0)
        assert data["space"].values.tolist() == ["x", "y", "z"]
        stored = places(results)
        for name in data["keypoints"].values:
            path = data["position"].sel(keypoints=name, individuals="rig").values
            seen = np.isfinite(path).all(1)
            np.testing.assert_array_equal(path[seen], stored.xs(name, level=1)[["x_m", "y_m", "z_m"]])


def test_latex_says_the_parameters(results):
    text = (export(results, "latex") / "parameters.tex").read_text()
    assert r"Restitution & $\varepsilon$ & $0.7199 \pm 0.0004$" in text
    assert r"$\mu_c$" in text and r"\ge 0.0348" in text and r"\mathrm{mm}" in text
    assert text.count("{") == text.count("}") and text.isascii()
    assert (
        words("a_b & 5 %") == r"a\_b \& 5 \%"
        and numbers("(1.2 ± 0.3) × 10⁻⁵ m") == r"$(1.2 \pm 0.3) \times 10^{-5} \,\mathrm{m}$"
    )
    assert numbers("not determined") == "not determined"


def test_a_series_is_a_folder_per_recording_and_a_table_of_tests(results, tmp_path):
    for name in ("run-1", "run_2"):
        shutil.copytree(results, tmp_path / "day" / name)
        (tmp_path / "day" / name / "source.json").write_text("{}")
    out = export(tmp_path / "day", "latex")
    text = (out / "tests.tex").read_text()
    assert (out / "run-1" / "parameters.tex").is_file() and re.search(r"run\\_2 & \$0.7199\(4\)\$", text)


def test_motion_alone_gives_the_bodies_centres(results):
    (results / "points.parquet").unlink()
    rows, _ = read_trc(export(results, "trc") / "bodies.trc")
    stored = read_table(results / "motion.parquet", "motion")
    np.testing.assert_allclose(1e-3 * rows.loc[rows["marker"] == "nes", "x"], stored["nes_x_m"], rtol=1e-6, atol=1e-12)


def test_what_was_not_determined_is_said(results):
    """A column without any value is a column all the same: parameters that nothing informs, a Host never seen."""
    table = read_table(results / "identification.parquet", "identification")
    nothing = table.assign(value=np.nan, sd=np.nan, low=np.nan, high=np.nan)
    write_table(nothing, "identification", results / "identification.parquet", {})
    assert "not determined" in (export(results, "latex") / "parameters.tex").read_text()
    (results / "points.parquet").unlink()
    motion = read_table(results / "motion.parquet", "motion")
    gone = motion.assign(host_x_m=np.nan, host_y_m=np.nan, host_z_m=np.nan)
    write_table(gone, "motion", results / "motion.parquet", {})
    rows, _ = read_trc(export(results, "trc") / "bodies.trc")
    assert set(rows["marker"]) == {"nes"}


def test_nothing_is_written_over(results, capsys):
    mine = results / "export" / "points.csv"
    mine.parent.mkdir()
    mine.write_text("mine")
    assert main(["export", str(results), "--to", "csv"]) == 2
    assert mine.read_text() == "mine" and [*mine.parent.iterdir()] == [mine] and "--force" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--to", "trc", "--units", "mm"], "--units with csv or mat"),
        (["--to", "csv", "--units", "mm,m"], "one unit of each kind"),
        (["--to", "csv", "--units", "miles"], "'miles'"),
        (["--to", "csv", "--tables", "nonsense"], "nonsense"),
    ],
)
def test_what_cannot_be_exported(arguments, words, results, capsys):
    assert main(["export", str(results), *arguments]) == 2
    assert words in capsys.readouterr().err and not (results / "export").exists()


def test_an_empty_folder_holds_nothing(tmp_path, capsys):
    for to in ("csv", "latex", "c3d"):
        assert main(["export", str(tmp_path), "--to", to]) == 2
        assert "found:" in capsys.readouterr().err


@pytest.mark.parametrize(("to", "module"), [("c3d", "ezc3d"), ("netcdf", "xarray")])
def test_a_missing_extra_is_named(to, module, results, monkeypatch, capsys):
    import sys

    monkeypatch.setitem(sys.modules, module, None)
    assert main(["export", str(results), "--to", to]) == 2
    assert "extra 'export'" in capsys.readouterr().err
