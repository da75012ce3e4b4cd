"""The sample recording through the whole chain: truth recovered from images alone."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import numpy as np
import pytest

from ovines.camera import read_calibration
from ovines.first_run import calls, signature
from ovines.pipeline.pages import write_calibration_page
from ovines.pipeline.runner import run_stages
from ovines.recording import read_recording
from ovines.tables import read_table

SAMPLE = Path(__file__).resolve().parents[3] / "sample_data" / "rendered"


@pytest.fixture(scope="module")
def results(tmp_path_factory) -> Path:
    out = tmp_path_factory.mktemp("sample")
    run_stages(read_recording(SAMPLE), out)
    return out


def test_markers_within_a_hundredth_of_a_pixel(results):
    tracks, truth = read_table(results / "tracks.parquet", "tracks"), read_table(SAMPLE / "truth.parquet", "truth")
    both = tracks.merge(truth, on=["camera", "frame", "marker"], suffixes=("", "_true"))
    # Every marker but G1, which lies at the edge of a window, in every frame but for those that an impact smears.
    assert len(both) == len(tracks) and len(tracks) > 0.98 * len(truth)
    error = np.hypot(both["u_px"] - both["u_px_true"], both["v_px"] - both["v_px_true"])
    assert error.median() < 0.01
    # A swapped or lost marker would be tens of pixels off.
    assert error.max() < 1.0


def test_poses_within_micrometres(results):
    motion = read_table(results / "motion.parquet", "motion").set_index("frame")
    truth = read_table(SAMPLE / "truth.parquet", "truth").drop_duplicates("frame").set_index("frame")
    for body in ("nes", "host"):
        error = np.hypot(motion[f"{body}_x_m"] - truth[f"{body}_x_m"], motion[f"{body}_y_m"] - truth[f"{body}_y_m"])
        # The calibration from nine views places the world to some micrometres; the frames themselves scatter by one.
        assert error.median() < 1e-5
    assert np.abs(motion["nes_angle_rad"] - truth["nes_angle_rad"]).median() < 1e-3


def test_cameras_near_the_true_ones(results):
    found, true = read_calibration(results / "calibration.json"), read_calibration(SAMPLE / "true_calibration.json")
    for camera, real in zip(found, true, strict=True):
        assert camera.matrix[0, 0] == pytest.approx(real.matrix[0, 0], rel=5e-3)
        assert camera.rms_px < 0.2


def test_both_impacts_with_the_simulated_restitution(results):
    impacts = read_table(results / "impacts.parquet", "impacts")
    assert len(impacts) == 2
    # 0.72 was simulated; flights of 30 frames with a micrometre of noise know each restitution to some 1e-4.
    assert np.abs(impacts["restitution"] - 0.72).max() < 0.002
    assert np.abs(impacts["tangential_restitution"] - 0.49).max() < 0.02
    assert (results / "report.html").stat().st_size > 100_000


def test_what_the_first_run_compiles_beside_is_what_it_calls(results):
    """Other types would be compiled for nothing.  What only a dropped frame or a body lost from sight calls has no
    types here, unless it was compiled as part of its callers.
    """
    listed = [(kernel, signature(kernel, arguments)) for kernel, arguments in calls(["calibrate", "track", "identify"])]
    called = [(kernel, types) for kernel, types in listed if kernel.overloads]
    assert len(called) > 0.7 * len(listed)
    for kernel, types in called:
        assert types in kernel.overloads, kernel


@pytest.mark.further
@pytest.mark.skipif(sys.platform != "linux" or os.cpu_count() == 1, reason="a second process draws it on Linux only")
def test_the_calibrations_page_drawn_beside_the_report_is_the_one_drawn_alone(results):
    page = results / "calibration.html"
    beside = page.read_bytes()
    page.unlink()
    write_calibration_page(read_recording(SAMPLE), results, figures=False)
    assert page.read_bytes() == beside
