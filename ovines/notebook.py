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
    "lens",
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
    """Board images to cameras.

    Parameters
    ----------
    recording
        With board, intrinsic and extrinsic images in ``[calibration]``.
    progress
        Called with images done and images in all.

    Returns
    -------
    Calibration
        ``cameras``, tables ``views`` and ``parameters``, ``advice`` in words.

    Raises
    ------
    InputError
        No board images, or none in which the board is found.

    Examples
    --------
    >>> from ovines.notebook import calibrate, read_recording
    >>> solved = calibrate(read_recording("sample_data/rendered"))
    >>> [(camera.name, round(camera.matrix[0, 0])) for camera in solved.cameras]
    [('VW1', 3196), ('VW2', 3182)]
    >>> solved.advice[0]
    'VW1: 9 usable intrinsic views; take at least 10, better 15 to 20.'
    """
    from vision.calibrate import calibrate_recording

    return calibrate_recording(recording, progress)


def track(
    recording: Recording, cameras: Sequence[Camera], names: pd.DataFrame | None = None, progress: Progress | None = None
) -> Tracks:
    """Frames to markers in window pixels.

    Parameters
    ----------
    recording
        With frames of two cameras.
    cameras
        From `calibrate` or `read_calibration`.
    names
        Table of camera, marker, u_px, v_px in the first frame, where no layout is known; None: by geometry.
    progress
        Called with frames done and frames in all.

    Returns
    -------
    Tracks
        Table ``tracks``, ``notes`` in words, table ``walls``.

    Raises
    ------
    InputError
        No frames, pictures that cannot be read, or markers that cannot be named.

    Examples
    --------
    >>> from ovines.notebook import read_calibration, read_recording, track
    >>> recording = read_recording("sample_data/rendered")
    >>> found = track(recording, read_calibration("sample_data/rendered/true_calibration.json"))
    >>> sorted(found.tracks["marker"].unique())[:4], found.tracks["frame"].nunique()
    (['G1', 'G2', 'G3', 'H1'], 90)
    """
    from vision.track import track as track_markers

    return track_markers(recording, cameras, names, progress)


def lens(
    tracks: Sequence[pd.DataFrame], recordings: Sequence[Recording], cameras: Sequence[Camera]
) -> tuple[list[Camera], pd.DataFrame]:
    """What the lens models of two cameras leave over, from all runs filmed with them.

    Parameters
    ----------
    tracks
        Table ``tracks`` of each run.
    recordings
        The runs, with the bodies' layouts.
    cameras
        The two cameras of all runs.

    Returns
    -------
    list of Camera, pandas.DataFrame
        The cameras with the residual's field where one is sure, else as they were; and table ``lens_terms``, what stays
        open.

    Examples
    --------
    >>> from ovines.notebook import lens, read_calibration, read_series, read_table
    >>> recordings = read_series("sample_data/series_tilted")[:2]
    >>> tracks = [read_table(one.folder / "tracks.parquet", "tracks") for one in recordings]
    >>> cameras, terms = lens(tracks, recordings, read_calibration(recordings[0].calibration_file))
    >>> [camera.name for camera in cameras], len(terms) > 0
    (['VW1', 'VW2'], True)
    """
    from ovines.camera import with_fields
    from vision.lens.estimate import learn_lens_field

    found = learn_lens_field(tracks, recordings, cameras)
    return list(with_fields(cameras, found.fields)), found.terms


def triangulate(tracks: pd.DataFrame, cameras: Sequence[Camera], recording: Recording) -> pd.DataFrame:
    """Markers of two cameras to points in space.

    Parameters
    ----------
    tracks
        Table ``tracks``: window pixels of both cameras.
    cameras
        The two cameras.
    recording
        Says where the window lies on each sensor.

    Returns
    -------
    pandas.DataFrame
        Table ``points``: positions in metres in the world, with standard deviations and reprojection error.

    Examples
    --------
    >>> from ovines.notebook import read_calibration, read_recording, read_table, triangulate
    >>> recording = read_recording("sample_data/series_tilted/run-01")
    >>> cameras = read_calibration(recording.calibration_file)
    >>> tracks = read_table(recording.folder / "tracks.parquet", "tracks")
    >>> points = triangulate(tracks, cameras, recording)
    >>> points.loc[points["marker"] == "G1", ["x_m", "y_m"]].median().round(3).tolist()
    [-0.1, 0.035]
    """
    from vision.triangulate import triangulate as triangulate_tracks

    return triangulate_tracks(tracks, cameras, recording.window_offset_px)


def analyse(points: pd.DataFrame, recording: Recording) -> pd.DataFrame:
    """Points to the motion of NES and Host.

    Parameters
    ----------
    points
        Table ``points``.
    recording
        Says which marker is on which body, and where.

    Returns
    -------
    pandas.DataFrame
        Table ``motion``: a row per frame; what was not seen is missing, never filled in.

    Raises
    ------
    InputError
        A body that is never seen.

    Examples
    --------
    >>> from ovines.notebook import analyse, read_calibration, read_recording, read_table, triangulate
    >>> recording = read_recording("sample_data/series_tilted/run-01")
    >>> cameras = read_calibration(recording.calibration_file)
    >>> tracks = read_table(recording.folder / "tracks.parquet", "tracks")
    >>> motion = analyse(triangulate(tracks, cameras, recording), recording)
    >>> motion[["time_s", "nes_x_m", "nes_y_m"]].iloc[::400].round(3).values.tolist()
    [[0.0, 0.035, 0.021], [0.5, 0.017, 0.011], [1.0, -0.011, 0.002]]
    """
    from analysis.motion.bodies import motion_from_points

    return motion_from_points(points, recording)


def identify(motion: pd.DataFrame, recording: Recording) -> Identified:
    """Motion to impacts and parameters.

    Parameters
    ----------
    motion
        Table ``motion``.
    recording
        Gives sizes and masses of the bodies, and the nominal model.

    Returns
    -------
    Identified
        Tables ``identification``, ``impacts``, ``flights``, and ``notes`` in words. What the data do not determine
        is a bound (one of ``low``, ``high``) or null, never a guess.

    Examples
    --------
    >>> from ovines.notebook import analyse, identify, read_calibration, read_recording, read_table, triangulate
    >>> recording = read_recording("sample_data/series_tilted/run-01")
    >>> cameras = read_calibration(recording.calibration_file)
    >>> tracks = read_table(recording.folder / "tracks.parquet", "tracks")
    >>> motion = analyse(triangulate(tracks, cameras, recording), recording)
    >>> identified = identify(motion[motion["time_s"] < 0.6], recording)
    >>> identified.impacts["restitution"].round(2).dropna().unique().tolist()
    [0.71]
    """
    from analysis.identify import identify as identify_parameters

    return identify_parameters(motion, recording)


def compare(
    motion: pd.DataFrame, found: Identified, recording: Recording, rng: np.random.Generator, runs: int = 40
) -> Comparison:
    """Measured against simulated, one flight and one impact ahead, and whole runs as distributions.

    Parameters
    ----------
    motion
        Table ``motion``.
    found
        What `identify` gave for it.
    recording
        The same recording.
    rng
        Draws the starts of whole runs.
    runs
        How many whole runs are simulated; they take most of the time.

    Returns
    -------
    Comparison
        Tables ``flights``, ``impacts`` and ``statistics``, and the ``scenario`` that was simulated.

    Examples
    --------
    >>> import numpy as np
    >>> from ovines.notebook import analyse, compare, identify
    >>> from ovines.notebook import read_calibration, read_recording, read_table, triangulate
    >>> recording = read_recording("sample_data/series_tilted/run-01")
    >>> cameras = read_calibration(recording.calibration_file)
    >>> tracks = read_table(recording.folder / "tracks.parquet", "tracks")
    >>> motion = analyse(triangulate(tracks, cameras, recording), recording)
    >>> motion = motion[motion["time_s"] < 0.6]
    >>> compared = compare(motion, identify(motion, recording), recording, np.random.default_rng(0), runs=0)
    >>> bool((compared.flights["rms_m"] < 1e-3).all())
    True
    """
    from analysis.compare import compare as compare_runs

    held = found.flights[found.flights["kind"] == "contact"]
    contacts_s = list(zip(held["start_s"], held["end_s"], strict=True))
    return compare_runs(motion, found.impacts, found.identification, recording, rng, runs, contacts_s)


def diagnose(motions: Sequence[pd.DataFrame], recordings: Sequence[Recording], rng: np.random.Generator) -> Diagnosis:
    """Motions of a series to the cause of its sim-to-real gap.

    Motion tells nothing of the cameras; where recordings bring frames, tracks or points, see `diagnose_recordings`.

    Parameters
    ----------
    motions
        A table ``motion`` for each run.
    recordings
        The runs, in the same order.
    rng
        Draws the bootstrap.

    Returns
    -------
    Diagnosis
        ``summary`` (what diagnosis.json holds) and table ``predictions`` on held-out runs.

    Raises
    ------
    InputError
        Data that say nothing: a disk that does not move, or lies outside its ring.

    Examples
    --------
    >>> import numpy as np
    >>> from ovines.notebook import analyse, diagnose, read_calibration, read_series, read_table, triangulate
    >>> runs = read_series("sample_data/series_tilted")[:2]
    >>> cameras = read_calibration(runs[0].calibration_file)
    >>> tracks = [read_table(run.folder / "tracks.parquet", "tracks") for run in runs]
    >>> points = [triangulate(one, cameras, run) for one, run in zip(tracks, runs)]
    >>> motions = [analyse(one, run).query("time_s < 0.6") for one, run in zip(points, runs)]
    >>> diagnose(motions, runs, np.random.default_rng(0)).summary["effects"]
    ['table_tilt']
    """
    from analysis.gap.diagnose import diagnose as diagnose_series
    from analysis.gap.series import from_motions

    return diagnose_series(from_motions(recordings, motions), rng)


def diagnose_recordings(recordings: Sequence[Recording], out: str | Path, rng: np.random.Generator) -> Diagnosis:
    """The same from the recordings' own entries, as `ovines diagnose` does it.

    Parameters
    ----------
    recordings
        The runs; each enters where its files allow.
    out
        Folder in which tracks of frames are kept.
    rng
        Draws the bootstrap.

    Returns
    -------
    Diagnosis
        As `diagnose` gives it; causes in cameras and clocks are looked for, too.

    Examples
    --------
    >>> import numpy as np, tempfile
    >>> from ovines.notebook import diagnose_recordings, read_series
    >>> runs = read_series("sample_data/series_tilted")[:2]
    >>> with tempfile.TemporaryDirectory() as out:
    ...     summary = diagnose_recordings(runs, out, np.random.default_rng(0)).summary
    >>> summary["verdict"], summary["effects"], summary["stage"]
    ('effect', ['table_tilt'], 'flight')
    """
    from analysis.gap.diagnose import diagnose as diagnose_series
    from ovines.pipeline.series.diagnosis import load_series

    series, _ = load_series(recordings, Path(out))
    return diagnose_series(series, rng)


def simulate(scenario: Scenario, rng: np.random.Generator | None = None) -> SimulationResult:
    """Scenario to samples, impacts and contacts.

    Parameters
    ----------
    scenario
        From `read_scenario`, or an `ovines.core.Scenario` made in Python.
    rng
        For effects that scatter; others need none.

    Returns
    -------
    SimulationResult
        ``time_s`` (n,), ``motion`` (a column (n,) each), ``impacts``, ``contacts`` (m, 2) in seconds, ``energy``.

    Examples
    --------
    A ball dropped into the ring with restitution 0.9 rises to 0.81 of its height each time.

    >>> from ovines.notebook import read_scenario, simulate
    >>> impacts = simulate(read_scenario("table-3")).impacts
    >>> heights_m = impacts["normal_speed_before_m_per_s"] ** 2 / (2 * 9.81)
    >>> (heights_m[1:4] / heights_m[:3]).round(6).tolist()
    [0.81, 0.81, 0.81]
    """
    from ovines.core import simulate as simulate_scenario

    return simulate_scenario(scenario, rng)


def read_scenario(path: str | Path) -> Scenario:
    """A scenario.toml, or a name of `ovines simulate --list`.

    Parameters
    ----------
    path
        File or name.

    Raises
    ------
    InputError
        A file that is no scenario, or one that cannot run.

    Examples
    --------
    >>> from ovines.notebook import read_scenario
    >>> read_scenario("table-3").impact
    ImpactLaw(restitution=0.9, wall_friction=0.0, tangential_restitution=0.0)
    """
    from ovines.core.system.named import NAMED
    from ovines.scenario import read_scenario as read_file

    return NAMED[str(path)].make() if str(path) in NAMED else read_file(Path(path))
