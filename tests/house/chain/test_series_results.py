"""What a series has as a whole, and what stands beside the pages: joint identification, figures, calibration page."""

import numpy as np
import pandas as pd
import pytest

from ovines.pipeline.one_recording import run_one
from ovines.pipeline.pages import FIGURES
from ovines.pipeline.series.recordings import Workers, run_series
from ovines.pipeline.series.results import write_series_results
from ovines.recording import read_recording
from ovines.tables import read_table
from tests.conftest import draw_nothing, two_cameras, write_small_recording


@pytest.fixture(scope="module")
def run_of_two(tmp_path_factory):
    """Two runs of one rig whose restitution is 0.72, with figures."""
    folder = tmp_path_factory.mktemp("two") / "series"
    for number in (1, 2):
        write_small_recording(folder / f"run-{number:02d}", seed=number)
    # Pages' pictures are painted in test_sample_data, figures' files in test_report: here nothing is drawn into them.
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("analysis.report.page.data_uri", lambda figure, image: "")
        draw_nothing(patched)
        outcomes = run_series(folder, folder.parent / "out", workers=Workers(bars=False), figures=True)
    assert [one.status for one in outcomes] == ["done"] * 3, [one.message for one in outcomes]
    return folder, folder.parent / "out", outcomes


def test_the_joint_identification_knows_more_than_one_run(run_of_two):
    _, out, outcomes = run_of_two
    assert outcomes[-1].whole_series and outcomes[-1].stages == {"identify": "run", "report": "run"}
    joint = read_table(out / "identification.parquet", "identification").set_index("parameter")
    one = read_table(out / "run-01" / "identification.parquet", "identification").set_index("parameter")
    assert joint.loc["restitution", "n_impacts"] > one.loc["restitution", "n_impacts"]
    low, high = joint.loc["restitution", ["low", "high"]]
    assert low - 0.01 < 0.72 < high + 0.01 and np.isfinite([low, high]).all()


def test_pages_of_a_series_lead_to_each_other_and_say_where_they_come_from(run_of_two):
    _, out, _ = run_of_two
    whole, one = ((out / name / "report.html").read_text(encoding="utf-8") for name in (".", "run-01"))
    assert 'href="run-01/report.html"' in whole and 'href="run-02/report.html"' in whole
    assert 'href="../report.html"' in one
    assert " from ../series by ovines" in whole and " from ../../series/run-01 by ovines" in one


def test_the_joint_identification_runs_again_only_when_a_run_changed(run_of_two):
    folder, out, _ = run_of_two
    recordings = [read_recording(folder / name) for name in ("run-01", "run-02")]
    before = (out / "identification.parquet").read_bytes()
    assert write_series_results(out, recordings, "s", "identify", False, False)[0] == {"identify": "up to date"}
    assert write_series_results(out, recordings[:1], "s", "identify", False, False)[0] == {"identify": "run"}
    assert (out / "identification.parquet").read_bytes() != before
    assert write_series_results(out, recordings, "s", "identify", False, False)[0] == {"identify": "run"}
    assert (out / "identification.parquet").read_bytes() == before


def test_runs_of_two_rigs_get_no_joint_table_and_a_reason(run_of_two, tmp_path):
    folder, out, _ = run_of_two
    other = write_small_recording(tmp_path / "run-02", seed=2).folder / "recording.toml"
    other.write_text(other.read_text().replace("inner_radius_m = 0.05", "inner_radius_m = 0.06"))
    recordings = [read_recording(folder / "run-01"), read_recording(tmp_path / "run-02")]
    stages, notes = write_series_results(out, recordings, "s", "identify", False, False)
    assert stages == {"identify": "not possible"} and "inner_radius_m of run-02 differs" in notes[0]
    assert not (out / "identification.parquet").exists()


@pytest.mark.usefixtures("unpainted")
def test_figures_are_files_and_those_of_an_earlier_page_go(run_of_two):
    folder, out, _ = run_of_two
    for place in (out, out / "run-01"):
        names = {path.suffix for path in (place / FIGURES).iterdir()}
        assert names == {".svg", ".pdf"}
    (out / "run-01" / FIGURES / "mine.txt").write_text("kept")
    run_series(folder, out, "report", force=True, workers=Workers(bars=False))
    assert [path.name for path in (out / "run-01" / FIGURES).iterdir()] == ["mine.txt"]
    assert not (out / FIGURES).exists()


def test_a_solved_calibration_gets_its_page(small_recording, tmp_path, monkeypatch):
    """A stage that gives known cameras in place of half a minute of board images; an old page goes before it runs."""
    folder, out = small_recording.folder, tmp_path / "out"
    text = (folder / "recording.toml").read_text()
    images = 'board = "charuco_5x7_8mm"\nintrinsic = "{camera}.png"\nextrinsic = "{camera}.png"'
    (folder / "recording.toml").write_text(text.replace('file = "../calibration.json"', images))
    for camera in ("VW1", "VW2"):
        (folder / f"{camera}.png").write_bytes(b"x")
    out.mkdir()
    (out / "calibration.html").write_text('<meta name="generator" content="ovines"> an old page')
    seen = []

    class Solved:
        cameras, advice = two_cameras(), ()
        views = pd.DataFrame(
            {"camera": ["VW1"], "view": ["a"], "points": [24], "used": [True], "rms_px": [0.1], "reason": [None]}
        )
        parameters = pd.DataFrame({"camera": ["VW1"], "parameter": ["fx"], "value": [3000.0], "sd": [2.0]})
        covariance, labels, tables = np.array([[4.0]]), [("VW1", "fx")], {}

    def solve(recording, progress):
        seen.append((out / "calibration.html").exists())
        return Solved()

    monkeypatch.setattr("vision.calibrate.calibrate_recording", solve)
    done = run_one(folder, out, "calibrate", False, False, figures=True)
    assert done.status == "done" and seen == [False], done.message
    page = (out / "calibration.html").read_text(encoding="utf-8")
    assert "Calibration report" in page and "3000" in page
    assert list((out / FIGURES).glob("*.svg"))


def test_runs_of_a_series_share_one_lens_field(tmp_path):
    """That it is the same with any number of jobs stands in test_always_true."""
    folder, out = tmp_path / "series", tmp_path / "out"
    for number in (1, 2):
        write_small_recording(folder / f"run-{number:02d}", seed=number)
    outcomes = run_series(folder, out, only="lens", workers=Workers(bars=False))
    assert [one.status for one in outcomes] == ["done"] * 2, [one.message for one in outcomes]
    tables = [read_table(out / name / "lens_terms.parquet", "lens_terms") for name in (".", "run-01", "run-02")]
    assert tables[0].equals(tables[1]) and tables[0].equals(tables[2])
    assert tables[0].set_index("term").loc["frames", "value"] > 390  # of both runs
    again = run_series(folder, out, only="lens", workers=Workers(bars=False))
    assert [one.stages["lens"] for one in again] == ["up to date"] * 2
