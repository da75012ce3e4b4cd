"""Markers that have each other's name in one camera for a while are found, from their views alone."""

from __future__ import annotations

from functools import partial

import numpy as np
import pandas as pd
import pytest

from ovines.camera import read_calibration
from ovines.plausibility.exchanged import exchange_notes, exchanged_labels
from vision.triangulate import triangulate

FRAMES, NOISE_PX = np.arange(500, 700), 0.15
BODIES = {"nes": ("N1", "N2", "N3"), "host": ("H1", "H2")}
WINDOWS = {"VW1": (40.0, 12.0), "VW2": (8.0, 0.0)}


@pytest.fixture(scope="module")
def cameras():
    return read_calibration("sample_data/series_tilted/calibration.json")


def tracks_of(cameras, delay_frames: float = 0.0) -> pd.DataFrame:
    """Tracks in window pixels of a disk that spins and slides, and of a Host at rest; the second camera may be late."""
    rng, parts = np.random.default_rng(4), []
    names = [camera.name for camera in cameras]
    for number, camera in enumerate(cameras):
        at = FRAMES - FRAMES[0] - number * delay_frames
        for k, marker in enumerate(BODIES["nes"]):
            angle = 0.11 * at + 2.1 * k
            place = [5e-5 * at + 8e-3 * np.cos(angle), 8e-3 * np.sin(angle), 4e-3 + 0 * at]
            parts.append(rows(camera, number, marker, np.column_stack(place), rng))
        for k, marker in enumerate(BODIES["host"]):
            parts.append(rows(camera, number, marker, np.tile([0.05 - 0.1 * k, 0.01, 0.02], (len(FRAMES), 1)), rng))
    assert names == list(WINDOWS)
    return pd.concat(parts, ignore_index=True)


def points_of(cameras):
    return partial(triangulate, cameras=cameras, window_offset_px=WINDOWS)


def rows(camera, number, marker, places, rng) -> pd.DataFrame:
    uv = camera.project(places) + NOISE_PX * rng.standard_normal((len(FRAMES), 2)) - list(WINDOWS.values())[number]
    times = (FRAMES - 500) / 800
    return pd.DataFrame(
        {"camera": camera.name, "frame": FRAMES, "time_s": times, "marker": marker, "u_px": uv[:, 0], "v_px": uv[:, 1],
         "sd_px": NOISE_PX}
    )  # fmt: skip


def exchanged(tracks: pd.DataFrame, camera: str, first: int, last: int) -> pd.DataFrame:
    out = tracks.copy()
    here = (out["camera"] == camera) & out["frame"].between(first, last)
    out.loc[here, "marker"] = out.loc[here, "marker"].replace({"N1": "N3", "N3": "N1"})
    return out


@pytest.mark.parametrize("camera", ["VW1", "VW2"])
def test_an_exchange_is_reported_with_its_frames(cameras, camera):
    """In whichever camera; where the line between both runs along the epipolar lines they meet either way."""
    tracks = exchanged(tracks_of(cameras), camera, 560, 600)
    points = triangulate(tracks, cameras, WINDOWS)
    (one,) = exchanged_labels(points, tracks, cameras, BODIES, points_of(cameras))
    assert one.markers == ("N1", "N3")
    assert 560 <= one.first <= 564 and 596 <= one.last <= 600 and one.frames >= 30
    assert one.apart_px > 10.0
    (note,) = exchange_notes([one])
    assert note.startswith(
        f"N1 and N3 have each other's name in one of the cameras from frame {one.first} to {one.last}"
    )


@pytest.mark.parametrize("delay_frames", [0.0, 0.5])
def test_nothing_is_reported_of_right_names(cameras, delay_frames):
    """Nor of a late camera, whose views of fast markers miss each other by as much."""
    tracks = tracks_of(cameras, delay_frames)
    points = triangulate(tracks, cameras, WINDOWS)
    assert delay_frames == 0.0 or points["epipolar_px"].abs().max() > 8 * NOISE_PX
    assert exchanged_labels(points, tracks, cameras, BODIES, points_of(cameras)) == []
    assert exchanged_labels(points.drop(columns="epipolar_px"), tracks, cameras, BODIES, points_of(cameras)) == []
    assert exchanged_labels(points, tracks, cameras[:1], BODIES, points_of(cameras)) == []


def test_two_frames_are_no_stretch(cameras):
    tracks = exchanged(tracks_of(cameras), "VW2", 570, 571)
    points = triangulate(tracks, cameras, WINDOWS)
    assert exchanged_labels(points, tracks, cameras, BODIES, points_of(cameras)) == []
