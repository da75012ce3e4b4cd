"""Swaps and slips put into the tracks of a rendered recording: how many stand among the first twenty things to look at.

python benchmarks/tracking/doubtful_frames.py RECORDING RESULTS

RESULTS are those of `ovines run RECORDING`, e.g. of sample_data/rendered.
"""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from analysis.view.doubtful_frames import doubtful_frames
from ovines.camera import read_calibration
from ovines.recording import read_recording
from ovines.tables import read_table
from tests.plants.mistakes import with_mistakes
from vision.triangulate import triangulate

COPIES, EACH, FIRST = 20, 5, 20

if __name__ == "__main__":
    recording, results = read_recording(sys.argv[1]), Path(sys.argv[2])
    cameras = read_calibration(results / "calibration.json")
    tracks = read_table(results / "tracks.parquet", "tracks")
    clean = doubtful_frames(recording, triangulate(tracks, cameras, recording.window_offset_px))
    print(f"as tracked: {len(clean)} to look at")
    put_in = seen = named = 0
    for seed in range(COPIES):
        wrong, put = with_mistakes(tracks, recording.bodies["nes"].markers, EACH, np.random.default_rng(seed))
        first = doubtful_frames(recording, triangulate(wrong, cameras, recording.window_offset_px))[:FIRST]
        for start, length, kind in put:
            hits = [one for one in first if start <= one.frame < start + length]
            put_in, seen, named = put_in + 1, seen + bool(hits), named + any(one.kind == kind for one in hits)
    print(f"{seen} of {put_in} among the first {FIRST}, {named} named by their kind")
