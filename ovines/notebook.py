"""The stages as functions of tables and arrays, with the names of the commands: for notebooks and scripts.

Each hands over to the package that does the work; nothing is written, no folder is needed beyond the recording's own.
Imports stand inside the functions, so that a notebook loads only what it uses.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from ovines.camera import Camera, read_calibration
from ovines.recording import Recording, read_recording, read_series
from ovines.tables import read_table

if TYPE_CHECKING:
    from analysis.compare import Comparison
    from analysis.gap.diagnose import Diagnosis
    from analysis.identify import Identified
    from ovines.core import Scenario, SimulationResult
    from vision.calibrate import Calibration
    from vision.track import Tracks

__all__ = [
    "analyse",
    "calibrate",
    "compare",
    "diagnose",
    "diagnose_recordings",
    "identify",
    "read_calibration",
    "read_recording",
    "read_scenario",
    "read_series",
    "read_table",
    "simulate",
    "track",
    "triangulate",
]
Progress = Callable[[int, int], None]


def calibrate(recording: Recording, progress: Progress | None = None) -> Calibration:
    """Board images -> ``cameras``, tables ``views`` and ``parameters``, ``advice`` in words."""
    from vision.calibrate import calibrate_recording

    return calibrate_recording(recording, progress)


def track(
    recording: Recording, cameras: Sequence[Camera], names: pd.DataFrame | None = None, progress: Progress | None = None
) -> Tracks:
    """Frames -> table ``tracks`` and ``notes``; ``names`` (camera, marker, u_px, v_px of the first frame) where no
    layout is known.
    """
    from vision.track import track as track_markers

    return track_markers(recording, cameras, names, progress)


def triangulate(tracks: pd.DataFrame, cameras: Sequence[Camera], recording: Recording) -> pd.DataFrame:
    """Table ``tracks`` -> table ``points`` in metres."""
    from vision.triangulate import triangulate as triangulate_tracks

    return triangulate_tracks(tracks, cameras, recording.window_offset_px)


def analyse(points: pd.DataFrame, recording: Recording) -> pd.DataFrame:
    """Table ``points`` -> table ``motion`` of NES and Host."""
    from analysis.motion.bodies import motion_from_points

    return motion_from_points(points, recording)


def identify(motion: pd.DataFrame, recording: Recording) -> Identified:
    """Table ``motion`` -> tables ``identification``, ``impacts``, ``flights`` and ``notes``."""
    from analysis.identify import identify as identify_parameters

    return identify_parameters(motion, recording)


def compare(
    motion: pd.DataFrame, found: Identified, recording: Recording, rng: np.random.Generator, runs: int = 40
) -> Comparison:
    """Measured against simulated: one flight and one impact ahead, and ``runs`` whole runs as distributions."""
    from analysis.compare import compare as compare_runs

    held = found.flights[found.flights["kind"] == "contact"]
    contacts_s = list(zip(held["start_s"], held["end_s"], strict=True))
    return compare_runs(motion, found.impacts, found.identification, recording, rng, runs, contacts_s)


def diagnose(motions: Sequence[pd.DataFrame], recordings: Sequence[Recording], rng: np.random.Generator) -> Diagnosis:
    """Tables ``motion`` of a series -> ``summary`` (as diagnosis.json) and ``predictions`` on held-out runs.

    Motion tells nothing of the cameras; where recordings bring frames, tracks or points, see `diagnose_recordings`.
    """
    from analysis.gap.diagnose import diagnose as diagnose_series
    from analysis.gap.series import from_motions

    return diagnose_series(from_motions(recordings, motions), rng)


def diagnose_recordings(recordings: Sequence[Recording], out: str | Path, rng: np.random.Generator) -> Diagnosis:
    """The same from the recordings' own entries, as `ovines diagnose` does it; tracks of frames are kept in ``out``."""
    from analysis.gap.diagnose import diagnose as diagnose_series
    from ovines.pipeline.diagnosis import load_series

    series, _ = load_series(recordings, Path(out))
    return diagnose_series(series, rng)


def simulate(scenario: Scenario, rng: np.random.Generator | None = None) -> SimulationResult:
    """Scenario -> samples, impacts and contacts; ``rng`` for effects that scatter."""
    from ovines.core import simulate as simulate_scenario

    return simulate_scenario(scenario, rng)


def read_scenario(path: str | Path) -> Scenario:
    """A scenario.toml, or a name of `ovines simulate --list`."""
    from ovines.core.system.named import NAMED
    from ovines.scenario import read_scenario as read_file

    return NAMED[str(path)].make() if str(path) in NAMED else read_file(Path(path))
