"""What two views lack of meeting, against the full triangulation."""

import warnings

import numpy as np
import pandas as pd
import pytest

from ovines.camera import epipolar_residual_px, triangulate_points
from vision.frames.dropped import find_dropped_frames, renumbered, true_numbers
from vision.frames.dropped_by_both import as_dropped, find_common_gaps
from vision.rendering.recording import thesis_setup


@pytest.mark.parametrize("error_px", [0.1, 1.0])
def test_epipolar_residual_is_that_of_the_triangulation(error_px):
    rng = np.random.default_rng(3)
    cameras = thesis_setup(rng).cameras
    points = np.column_stack([rng.uniform(-0.05, 0.05, (300, 2)), rng.uniform(0.0, 0.02, 300)])
    uv = [camera.project(points) + error_px * rng.standard_normal((300, 2)) for camera in cameras]
    full = triangulate_points(cameras, uv, [np.full(300, error_px)] * 2).epipolar_px
    quick = epipolar_residual_px(cameras, *(camera.normalise(own) for camera, own in zip(cameras, uv, strict=True)))
    assert np.abs(np.abs(quick) - np.abs(full)).max() < 0.01 * error_px
    assert abs(np.corrcoef(quick, full)[0, 1]) > 0.999  # one sign for all


def test_points_that_meet_leave_nothing():
    cameras = thesis_setup(np.random.default_rng(4)).cameras
    points = np.array([[0.01, -0.02, 0.004], [0.0, 0.0, 0.0]])
    assert np.abs(epipolar_residual_px(cameras, *(c.normalise(c.project(points)) for c in cameras))).max() < 1e-8


@pytest.mark.parametrize("shared", [True, False])
def test_views_that_say_nothing_of_each_other_tell_of_no_drop(shared):
    """Markers seen by one camera only, or frames too few to be shifted: no evidence, and no warning."""
    cameras = thesis_setup(np.random.default_rng(5)).cameras
    rows = [
        {
            "camera": camera.name,
            "frame": frame,
            "marker": "G1" if shared else f"G{k}",
            "u_px": 500.0 + frame,
            "v_px": 300.0,
        }
        for k, camera in enumerate(cameras)
        for frame in range(3 if shared else 40)
    ]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert find_dropped_frames(pd.DataFrame(rows), cameras, {camera.name: (0, 0) for camera in cameras}) == []


HOST = np.array([[0.05, 0.02, 0.012], [-0.03, 0.045, 0.012], [-0.05, -0.02, 0.012], [0.035, -0.04, 0.012]])
NES = np.array([[0.0, 0.0, 0.01], [0.0061, 0.0003, 0.01], [-0.0008, 0.006, 0.01]])
HEIGHTS = {**{f"H{i}": 0.012 for i in range(4)}, **{f"N{i}": 0.01 for i in range(3)}}
FRAMES, RATE_HZ = 120, 800.0


def filmed(dropped, along="x", seed=0, clock_s=0.0):
    """Tracks of a Host shaken at 11 Hz with 8 g and a NES that turns and meets its wall, without the instants that each
    camera `dropped`.
    """
    rng = np.random.default_rng(seed)
    cameras = thesis_setup(rng).cameras
    tables = []
    for camera, lost in zip(cameras, dropped, strict=True):
        t = np.setdiff1d(np.arange(FRAMES), lost) / RATE_HZ
        late = t + (clock_s if camera is cameras[1] else 0.0)
        swing = 0.0164 * np.sin(69.1 * late + 0.3)[:, None]
        host = swing * (np.array([1.0, 0.0]) if along == "x" else np.array([0.0, 1.0]))
        there = np.abs((1.3 * late[:, None] * [1.0, 0.7] / 0.03 + 0.3) % 2 - 1) * 0.03  # straight between walls
        for name, at in [(f"H{i}", host + own[:2]) for i, own in enumerate(HOST)] + [
            (f"N{i}", host + there + turned(NES[i], 60 * late)) for i in range(3)
        ]:
            uv = camera.project(np.column_stack([at, np.full(len(t), HEIGHTS[name])])) + 0.01 * rng.standard_normal(
                (len(t), 2)
            )
            tables.append(
                pd.DataFrame(
                    {
                        "camera": camera.name,
                        "frame": np.arange(len(t)),
                        "time_s": np.arange(len(t)) / RATE_HZ,
                        "marker": name,
                        "u_px": uv[:, 0],
                        "v_px": uv[:, 1],
                    }
                )
            )
    return pd.concat(tables, ignore_index=True), cameras, {camera.name: (0, 0) for camera in cameras}


def turned(place, angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([c * place[0] - s * place[1], s * place[0] + c * place[1]], -1)


@pytest.mark.parametrize("along", ["x", "y"])
@pytest.mark.parametrize(
    "dropped",
    [
        ((), ()),
        ((), (60,)),
        ((30,), ()),
        ((), (5,)),
        ((), (114,)),
        ((40,), (80,)),
        ((), (50, 51, 52)),
        ((20, 90), (55,)),
        ((), tuple(range(30, 36))),
        ((0,), ()),
        ((0,), (119,)),
        ((), (20, 50, 80)),
        ((60, 61), ()),
        ((), (70, 75)),
    ],
)
def test_every_drop_is_found_at_its_frame(dropped, along):
    """Whatever camera, early or late, several in a row: each picture gets the number of the instant that it shows, to a
    frame at the drop itself.
    """
    tracks, cameras, offsets = filmed(dropped, along)
    found = find_dropped_frames(tracks, cameras, offsets, HEIGHTS)
    for camera, lost in zip(cameras, dropped, strict=True):
        truth = np.setdiff1d(np.arange(FRAMES), lost)
        assert (true_numbers(np.arange(len(truth)), found, camera.name) == truth).mean() > 0.98
        assert sum(drop.n for drop in found if drop.camera == camera.name) == sum(n < FRAMES - 1 for n in lost)


def test_motion_across_the_epipolar_lines_needs_no_heights():
    tracks, cameras, offsets = filmed(((30,), (80,)), "y")
    assert [(drop.camera, drop.from_frame, drop.n) for drop in find_dropped_frames(tracks, cameras, offsets)] == [
        ("VW1", 30, 1),
        ("VW2", 80, 1),
    ]


def test_a_clock_that_is_late_by_part_of_a_frame_is_no_dropped_frame():
    for part in (0.2, 0.4, 0.6):
        tracks, cameras, offsets = filmed(((), ()), "y", clock_s=part / RATE_HZ)
        assert find_dropped_frames(tracks, cameras, offsets, HEIGHTS) == []


@pytest.mark.parametrize("dropped", [((), ()), ((60,), (60,)), ((20, 21, 80), (20, 21, 80)), ((10,), (13,))])
def test_what_both_cameras_dropped_shows_in_the_path_of_the_host(dropped):
    """Nearly at once as well, where too few frames lie between for the cameras to miss each other."""
    tracks, cameras, offsets = filmed(dropped)
    first = find_dropped_frames(tracks, cameras, offsets, HEIGHTS) if dropped != ((10,), (13,)) else []
    gaps = find_common_gaps(renumbered(tracks, first), cameras, offsets, HEIGHTS, [f"H{i}" for i in range(4)])
    found = first + as_dropped(gaps, first, tracks)
    for camera, lost in zip(cameras, dropped, strict=True):
        truth = np.setdiff1d(np.arange(FRAMES), lost)
        assert (true_numbers(np.arange(len(truth)), found, camera.name) == truth).all()


def test_a_pause_in_the_trigger_is_no_dropped_frame():
    tracks, cameras, offsets = filmed(((60,), (60,)))
    tracks["time_s"] += (tracks["frame"] >= 60) / RATE_HZ
    assert find_common_gaps(tracks, cameras, offsets, HEIGHTS, [f"H{i}" for i in range(4)]) == {"VW1": [], "VW2": []}
