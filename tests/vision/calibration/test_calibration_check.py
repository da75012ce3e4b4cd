"""A calibration that is not this recording's is refused by name, from one picture per camera or from the tracks."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ovines.camera import read_calibration
from ovines.errors import InputError
from ovines.recording import read_recording
from ovines.tables import read_table
from vision.calibration_check import length_notes, refuse_foreign_tracks, refuse_mistaken, scaled
from vision.triangulate import triangulate

SAMPLES = Path(__file__).resolve().parents[3] / "sample_data"


@pytest.fixture(scope="module")
def rendered(tmp_path_factory):
    """The rendered sample's first frame, and its true cameras."""
    folder = tmp_path_factory.mktemp("run")
    for name in ("recording.toml", "VW1/frame_00000.png", "VW2/frame_00000.png"):
        (folder / name).parent.mkdir(exist_ok=True)
        shutil.copy(SAMPLES / "rendered" / name, folder / name)
    return read_recording(folder), read_calibration(SAMPLES / "rendered" / "true_calibration.json")


def test_true_calibration_is_not_doubted(rendered):
    recording, cameras = rendered
    refuse_mistaken(recording, cameras)
    refuse_mistaken(recording, [scaled(camera, 1.004) for camera in cameras])  # half a percent is the diagnosis' affair


@pytest.mark.further
@pytest.mark.parametrize("factor", [1.25, 1000.0])
def test_the_layout_shows_a_wrong_square_size(rendered, factor):
    """The true board is charuco_9x13_20mm; a calibration with squares ``factor`` times too large gives lengths that
    much too large.
    """
    recording, cameras = rendered
    with pytest.raises(InputError, match="every length of the calibration") as refused:
        refuse_mistaken(recording, [scaled(camera, factor) for camera in cameras])
    suggested = float(refused.value.found.rpartition("times ")[2])
    assert suggested * factor == pytest.approx(1, abs=3e-3)
    assert f"square_size_m = {suggested * 0.02:.2g}"[:19] in refused.value.do


def test_exchanged_cameras_are_named(rendered):
    recording, cameras = rendered
    names = [camera.name for camera in cameras]
    crossed = [replace(camera, name=name) for camera, name in zip(cameras, names[::-1], strict=True)]
    with pytest.raises(InputError, match="VW1 fit the calibration of VW2"):
        refuse_mistaken(recording, crossed)


@pytest.fixture(scope="module")
def tracked():
    run = read_recording(SAMPLES / "series_tilted" / "run-01")
    tracks = read_table(run.path("tracks.parquet"), "tracks")
    return run, tracks[tracks["frame"] < 60], read_calibration(SAMPLES / "series_tilted" / "calibration.json")


def test_tracks_of_exchanged_cameras_are_named(tracked):
    run, tracks, cameras = tracked
    refuse_foreign_tracks(tracks, triangulate(tracks, cameras, run.window_offset_px), cameras, run.window_offset_px)
    crossed = tracks.assign(camera=tracks["camera"].map({"VW1": "VW2", "VW2": "VW1"}))
    points = triangulate(crossed, cameras, run.window_offset_px)
    with pytest.raises(InputError, match="the other way round"):
        refuse_foreign_tracks(crossed, points, cameras, run.window_offset_px)


def test_other_misfits_are_not_called_an_exchange(tracked):
    """A window 40 px off misfits both ways: exchanging the cameras would not help."""
    run, tracks, cameras = tracked
    lower = tracks.assign(v_px=tracks["v_px"] + 40 * (tracks["camera"] == "VW2"))
    points = triangulate(lower, cameras, run.window_offset_px)
    assert np.nanmedian(np.abs(points["epipolar_px"])) > 5
    refuse_foreign_tracks(lower, points, cameras, run.window_offset_px)


@pytest.mark.parametrize(("factor", "noted"), [(1.0, False), (1.03, True), (0.97, True)])
def test_lengths_that_differ_from_the_layout_are_noted(tracked, factor, noted):
    run, tracks, cameras = tracked
    notes = length_notes(triangulate(tracks, [scaled(camera, factor) for camera in cameras], run.window_offset_px), run)
    assert bool(notes) == noted
    assert not noted or float(notes[0].split(" times")[0].rpartition(" ")[2]) == pytest.approx(factor, abs=2e-3)
