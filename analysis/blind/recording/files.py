"""A plant's series as files, in the layout of docs/chain.md."""

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from analysis.blind.recording.drive import ASKED
from analysis.blind.recording.markers import Poses
from analysis.blind.recording.place import HOME, WALLS, Place
from analysis.blind.recording.views import HOST_M, NES_M, SENSOR_PX, View
from ovines.io.provenance import provenance
from ovines.tables import write_table


@dataclass(frozen=True)
class Series:
    """A series with its truth.

    `truth` goes into the sealed file; `recordings` holds (recording.toml, tracks) per run; `calibration`
    is calibration.json; `states` has per run stateNN (x, y, vx, vy of the centre of mass, angle, spin,
    held, at each frame of the first camera), impNN (time, normal and tangential approach speed), heldNN,
    HNN (harmonics). `poses` has per run what
    either camera sees; `motions` the plant's own of a series that is remembered, in the plant's units.
    """

    truth: dict[str, Any]
    recordings: list[tuple[str, pd.DataFrame]]
    calibration: dict[str, Any]
    states: dict[str, np.ndarray]
    poses: list[list[Poses]]
    motions: list[Any] = field(default_factory=list)


WALL_M = 0.05  # from the Host's centre to a round or the middle of a flat wall
CYLINDER_M = 0.008


def wall_text(place: Place) -> str:
    """The lines of `[bodies.host]` that say what the wall is."""
    plant = WALLS[place.wall]
    sides = int(plant.get("wall_sides", 0))
    if not sides:
        text = f"inner_radius_m = {place.in_units('_m', WALL_M)}\n"
        return text + (f"obstacle_radius_m = {place.in_units('_m', CYLINDER_M)}\n" if "obstacle_m" in plant else "")
    angle = plant["wall_turn_rad"] + 2.0 * np.pi * (np.arange(sides) + 0.5) / sides
    corners = place.in_units("_m", WALL_M) / np.cos(np.pi / sides) * np.column_stack([np.cos(angle), np.sin(angle)])
    return f"polygon_m = {corners.round(9).tolist()}\n"


def recording_text(
    name: str,
    level_g: float,
    views: list[View],
    model: dict[str, Any],
    host_m: np.ndarray = HOST_M,
    frames: str = "",
    place: Place = HOME,
) -> str:
    """`recording.toml` of one run, as an experimenter writes it. `frames`: glob of a filmed case's images,
    {camera} standing for the camera's name; empty where tracks.parquet is given."""
    camera = ""
    for view in views:
        camera += f'[[cameras]]\nname = "{view.name}"\n'
        if frames:
            camera += f'frames = "{frames.format(camera=view.name)}"\n'
        camera += f"sensor_size_px = {list(SENSOR_PX)}\nwindow_offset_px = {list(view.window_offset_px)}\n"
        camera += f"window_size_px = {list(view.window_size_px)}\n\n"
    layouts = [(layout * place.scale).round(6 if place.scale == 1.0 else 9).tolist() for layout in (host_m, NES_M)]
    asked = ""
    if place.drive in ASKED:
        hz = place.in_units("_hz", place.drive_hz)
        asked = f'[excitation]\nfrequency_hz = {hz}\nacceleration_g = {level_g}\naxis = "x"\n\n'
    lines = "".join(f"{key} = {json.dumps(value)}\n" for key, value in model.items())
    return f"""format = 1
name = "{name}"

[time]
frame_rate_hz = {place.in_units("_hz", place.frame_rate_hz)}

{camera}[calibration]
file = "../calibration.json"

[bodies.ground]
markers = ["G1", "G2", "G3"]

[bodies.host]
markers = ["H1", "H2", "H3", "H4"]
{wall_text(place)}layout_m = {layouts[0]}
layout_sd_m = {place.in_units("_m", 3e-5)}

[bodies.nes]
markers = ["N1", "N2", "N3", "N4", "N5"]
centre_marker = "N1"
radius_m = {place.in_units("_m", 0.01)}
mass_kg = {place.in_units("_kg", 0.0246)}
inertia_factor = 0.5
layout_m = {layouts[1]}
layout_sd_m = {place.in_units("_m", 3e-5)}

{asked}[model]
{lines}"""


def calibration_of(views: list[View]) -> dict[str, Any]:
    """`calibration.json` of the two cameras, free of error but for what the lens residual of the noise
    adds."""
    return {
        "format": 1,
        "world": "board",
        "cameras": [
            {
                "name": v.name,
                "sensor_size_px": list(SENSOR_PX),
                "matrix": [
                    [v.focal_px[0], 0.0, v.centre_px[0]],
                    [0.0, v.focal_px[1], v.centre_px[1]],
                    [0.0, 0.0, 1.0],
                ],
                "distortion": v.distortion.tolist(),
                "rotation": v.rotation.tolist(),
                "translation_m": v.translation_m.tolist(),
                "rms_px": 0.1,
            }
            for v in views
        ],
    }


def write_series(series: Series, folder: Path) -> None:
    """Write a series in the layout of docs/chain.md: `calibration.json`, `run-NN/recording.toml`, `run-
    NN/tracks.parquet`.
    The truth is not written here."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "calibration.json").write_text(json.dumps(series.calibration, indent=1))
    for index, (text, tracks) in enumerate(series.recordings):
        write_run(folder, index + 1, text, tracks)


def write_run(folder: Path, number: int, text: str, tracks: pd.DataFrame) -> None:
    """Write one run of a series: its recording.toml and its tracks."""
    run = folder / f"run-{number:02d}"
    run.mkdir(exist_ok=True)
    (run / "recording.toml").write_text(text)
    write_table(tracks, "tracks", run / "tracks.parquet", provenance("blind make", {}, {}))
