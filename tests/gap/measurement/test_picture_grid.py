"""Centres that follow a grid of the picture are found, and which: pixels, or the blocks of a compressed film."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analysis.gap.diagnose import verdict_of
from analysis.gap.ladder import run_ladder
from analysis.gap.measurement.picture_grid import PERIODS_PX, _waves, picture_grid


@pytest.mark.further
def test_blocks_of_a_compressed_film_are_unknown(loaded):
    """Every eight pixels of both views: no name, and nothing of the disk or the wall."""
    _, series = loaded("unknown_coded_blocks", 0.8, 7, runs=2)
    ladder = run_ladder(series, np.random.default_rng(0))
    assert (verdict_of(ladder), ladder.structure[0].stage, ladder.causes) == ("unknown", "measurement", ())
    assert "the place in the picture, once in 8 pixels" in {left.goes_with for left in ladder.structure}


@pytest.mark.others_further
@pytest.mark.parametrize("noise", ["ar1", "warp"])
def test_a_series_without_a_grid_has_none(loaded, noise):
    """Until its lines are off by a wave of the place, once in as many pixels as that has."""
    _, series = loaded("none", 1.0, 8, noise, 2)
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
        (grid,) = picture_grid(replace(series, points=tuple(points)))
        assert grid.goes_with == f"the place in the picture, once in {words}"
        assert grid.size == pytest.approx(0.2, rel=0.2)


def test_markers_that_cross_less_than_two_waves_tell_nothing_of_them(loaded):
    """Of Hosts that move along the pictures' u only, waves of v: a lens bent what passed for one."""
    _, series = loaded("none", 1.0, 8, "warp", 2)
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
