"""What to look at first: swaps and slips put into tracks stand at the top of the list, clean tracks have none."""

import numpy as np
import pytest

from analysis.view.doubtful_frames import doubtful_frames
from ovines.recording import read_recording
from ovines.tables import read_table
from tests.conftest import OFFSET_PX, bouncing_motion, two_cameras, write_small_recording
from tests.plants.mistakes import with_mistakes
from vision.triangulate import triangulate

FRAMES, EACH, RECORDINGS, FIRST = 200, 10, 10, 20
NES = ("N1", "N2", "N3", "N4", "N5")


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    return read_recording(write_small_recording(tmp_path_factory.mktemp("doubtful") / "run", FRAMES).folder)


def test_swaps_and_slips_stand_at_the_top(recording):
    tracks = read_table(recording.folder / "tracks.parquet", "tracks")
    seen = named = 0
    for seed in range(RECORDINGS):
        wrong, put = with_mistakes(tracks, NES, EACH, np.random.default_rng(seed))
        first = doubtful_frames(recording, triangulate(wrong, two_cameras(), OFFSET_PX))[:FIRST]
        for start, length, kind in put:
            hits = [one for one in first if start <= one.frame < start + length]
            seen += bool(hits)
            named += any(one.kind == kind for one in hits)
    print(f"{seen} of {RECORDINGS * EACH} among the first {FIRST}, {named} by their kind")
    assert seen >= 0.95 * RECORDINGS * EACH
    assert named >= 0.6 * RECORDINGS * EACH


def test_clean_tracks_raise_no_doubt(recording):
    tracks = read_table(recording.folder / "tracks.parquet", "tracks")
    assert doubtful_frames(recording, triangulate(tracks, two_cameras(), OFFSET_PX)) == []


def test_hidden_markers_and_approaches_without_impact(recording):
    import pandas as pd

    motion = bouncing_motion(FRAMES, 800.0).assign(nes_markers=5, host_markers=4)
    motion.loc[50:54, "nes_markers"] = 2
    radius_m = np.hypot(motion["nes_x_m"], motion["nes_y_m"])
    bounce = int(radius_m.to_numpy()[:60].argmax())
    none = pd.DataFrame({"time_s": []})
    found = doubtful_frames(recording, motion=motion, impacts=none)
    assert {one.kind for one in found} == {"occlusion", "approach"}
    assert next(one.frame for one in found if one.kind == "occlusion") in range(50, 55)
    assert bounce in [one.frame for one in found if one.kind == "approach"]
    hits = [one.time_s for one in found if one.kind == "approach"]
    found = doubtful_frames(recording, motion=motion, impacts=pd.DataFrame({"time_s": hits}))
    assert {one.kind for one in found} == {"occlusion"}
    assert doubtful_frames(recording) == []
