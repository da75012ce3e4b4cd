"""Centres that follow a grid of the picture are told, and which: pixels, or the blocks of a compressed film."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analysis.blind.recording.files import write_series
from analysis.blind.series import make_series
from analysis.gap.diagnose import verdict_of
from analysis.gap.measurement.picture_grid import PERIODS_PX, _waves, picture_grid
from ovines.pipeline.series.diagnosis import load_series
from ovines.recording import read_series
from tests.gap.conftest import laws_and_ladder


def loaded(folder, kind, severity, noise, seed, runs=2):
    made = make_series(kind, severity, np.random.default_rng(seed), runs, noise)
    write_series(made, folder / "series")
    return load_series(read_series(folder / "series"), folder / "results")[0]


def test_blocks_of_a_compressed_film_are_unknown(tmp_path):
    """Every eight pixels of both views: no name, and nothing of the disk or the wall."""
    series = loaded(tmp_path, "unknown_coded_blocks", 0.8, "white", 7)
    _, ladder = laws_and_ladder(series)
    assert (verdict_of(ladder), ladder.structure[0].stage, ladder.causes) == ("unknown", "measurement", ())
    assert "the place in the picture, once in 8 pixels" in {left.goes_with for left in ladder.structure}


@pytest.mark.parametrize("noise", ["ar1", "warp"])
def test_a_series_without_a_grid_has_none(tmp_path, noise):
    """Until its lines are off by a wave of the place, once in as many pixels as that has."""
    series = loaded(tmp_path, "none", 1.0, noise, 8)
    assert picture_grid(series) == []
    assert picture_grid(replace(series, tracks=None)) == []
    second = series.cameras[1].name
    for period, words in ((1.0, "1 pixel"), (4.0, "4 pixels")):
        points = []
        for table, tracks in zip(series.points, series.tracks, strict=True):
            own = tracks[tracks["camera"] == second].set_index(["frame", "marker"])["v_px"]
            v = own.reindex(list(zip(table["frame"], table["marker"], strict=True))).to_numpy()
            wave = 0.2 * np.sin(2 * np.pi * v / period)
            points.append(table.assign(epipolar_px=table["epipolar_px"] + wave))
        (told,) = picture_grid(replace(series, points=tuple(points)))
        assert told.goes_with == f"the place in the picture, once in {words}"
        assert told.size == pytest.approx(0.2, rel=0.2)


def test_markers_that_cross_less_than_two_waves_tell_nothing_of_them(tmp_path):
    """Of Hosts that move along the pictures' u only, waves of v: a lens bent what passed for one."""
    series = loaded(tmp_path, "none", 1.0, "warp", 8, runs=1)
    names = [camera.name for camera in series.cameras]
    hosts = series.recordings[0].bodies["host"].markers
    seen = series.tracks[0][series.tracks[0]["marker"].isin(hosts)]
    way_px = seen.groupby(["camera", "marker"])[["u_px", "v_px"]].agg(np.ptp).max()
    assert way_px["u_px"] > 2 * max(PERIODS_PX) and way_px["v_px"] < 2 * 2.0, way_px
    wave, sd = (
        one.reshape(len(PERIODS_PX), len(names), 2, 2)
        for one in _waves(series.points[0], series.tracks[0], names, hosts)
    )
    assert np.all(sd[:, :, 0] < 0.1)
    assert np.all(np.isnan(wave[1:, :, 1])) and np.all(np.isinf(sd[1:, :, 1]))
