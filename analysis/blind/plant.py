"""A sealed series: twelve runs of the plant under the two cameras, with its truth."""
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from analysis.blind.accelerations import host_pose
from analysis.blind.causes import CAUSES, Draft, draft_series, physics_of_run, view_of
from analysis.blind.dynamics import Motion, run_plant, state_at
from analysis.blind.observe import (
    HOST_M,
    NES_M,
    SENSOR_PX,
    WINDOW_PX,
    Marks,
    Noise,
    View,
    ViewErrors,
    draw_marks,
    draw_noise,
    draw_views,
    tracks_of,
    world_points,
)

FRAME_RATE_HZ = 800.0
DRIVE_HZ = 11.0
LONGEST_S = 1.2
SHORTEST_S = 0.4                # a run cut earlier by sustained contact tells little and is started anew
COUNTED_SPEED_M_PER_S = 0.2     # impacts faster than this are counted in the truth, as the practice truths do
NOISE_KINDS = ("white", "ar1", "warp")


@dataclass(frozen=True)
class Series:
    """`truth` for the sealed file, `recordings` as (recording.toml, tracks) per run, the calibration as in calibration.json,
    and `states` per run: arrays by the names of the practice truths (stateNN, impNN, heldNN, HNN)."""
    truth: dict
    recordings: list[tuple[str, pd.DataFrame]]
    calibration: dict
    states: dict[str, np.ndarray]


def draw_host(acceleration_g: float, vertical_m: float, vertical_phase_rad: float, rng: np.random.Generator) -> np.ndarray:
    """Host harmonics (4, 4) of one run: the drive along x, its overtone, a crosswise share, and the vertical motion."""
    drive = 2.0 * np.pi * DRIVE_HZ
    phase = rng.uniform(0.0, 2.0 * np.pi, 3)
    return np.array([[0, acceleration_g * 9.81 / drive**2 * (1 + rng.normal(0.0, 1e-3)), drive, phase[0]],
                     [0, rng.uniform(0.05, 0.21) * 1e-3, 2 * drive, phase[1]],
                     [1, rng.uniform(0.03, 0.16) * 1e-3, drive, phase[2]],
                     [3, vertical_m, drive, vertical_phase_rad]])


def draw_start(rng: np.random.Generator) -> np.ndarray:
    """Initial x, y (from the Host), vx, vy, angle, spin as the practice series have them."""
    radius, azimuth = 0.022 + 0.017 * rng.random() ** 0.6, rng.uniform(0.0, 2.0 * np.pi)
    return np.array([radius * np.cos(azimuth), radius * np.sin(azimuth), *rng.normal(0.0, 0.86, 2),
                     rng.uniform(0.0, 2.0 * np.pi), rng.normal(0.0, 32.0)])


def _pose(motion: Motion, draft: Draft, harmonics: np.ndarray, time_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Middle of the disk (n, 4: x, y, z, angle) and Host (n, 4) at `time_s`."""
    state = state_at(motion, time_s)
    host = np.array([host_pose(t, harmonics)[0] for t in time_s])
    angle = state[:, 4]
    x, y = draft.plant.get("mass_x_m", 0.0), draft.plant.get("mass_y_m", 0.0)
    middle = np.column_stack([state[:, 0] - np.cos(angle) * x + np.sin(angle) * y,
                              state[:, 1] - np.sin(angle) * x - np.cos(angle) * y, host[:, 3], angle])
    return middle, host


def _one_run(draft: Draft, run: int, level_g: float, views: list[View], marks: Marks, errors: ViewErrors, noise: Noise,
             vertical_phase_rad: float, rng: np.random.Generator) -> tuple[pd.DataFrame, dict[str, np.ndarray]]:
    harmonics = draw_host(level_g, draft.vertical_amplitude_m, vertical_phase_rad, rng)
    physics = physics_of_run(draft, run, 2.0 * np.pi * DRIVE_HZ, LONGEST_S)
    for _ in range(200):
        motion = run_plant(physics, harmonics, draw_start(rng), LONGEST_S + 2e-3, rng)
        if motion.nodes[-1, 0] > SHORTEST_S:
            break
    rate = FRAME_RATE_HZ * errors.rate_ratio
    frames = min(int((motion.nodes[-1, 0] - abs(errors.clock_s) - 5 * errors.jitter_s) * rate), int(LONGEST_S * FRAME_RATE_HZ))
    first = np.maximum(np.arange(frames) / rate + rng.normal(0.0, 1.0, frames) * errors.jitter_s, -1.9e-3)
    times = [first, first + errors.clock_s]
    points = [world_points(*_pose(motion, draft, harmonics, t), marks, errors) for t in times]
    tracks = tracks_of(points, times, FRAME_RATE_HZ, views, errors, noise, rng)
    number = f"{run + 1:02d}"
    return tracks, {f"state{number}": state_at(motion, first), f"imp{number}": motion.impacts, f"held{number}": motion.held,
                    f"H{number}": harmonics}


def recording_text(name: str, level_g: float, views: list[View], model: dict) -> str:
    """`recording.toml` of one run, as an experimenter writes it."""
    camera = "".join(
        f'[[cameras]]\nname = "{v.name}"\nsensor_size_px = {list(SENSOR_PX)}\nwindow_offset_px = {list(v.window_offset_px)}\n'
        f"window_size_px = {list(WINDOW_PX)}\n\n" for v in views)
    layout_host, layout_nes = HOST_M.tolist(), NES_M.tolist()
    lines = "".join(f"{key} = {json.dumps(value)}\n" for key, value in model.items())
    return f"""format = 1
name = "{name}"

[time]
frame_rate_hz = {FRAME_RATE_HZ}

{camera}[calibration]
file = "../calibration.json"

[bodies.ground]
markers = ["G1", "G2", "G3"]

[bodies.host]
markers = ["H1", "H2", "H3", "H4"]
inner_radius_m = 0.05
layout_m = {layout_host}
layout_sd_m = 3e-5

[bodies.nes]
markers = ["N1", "N2", "N3", "N4", "N5"]
centre_marker = "N1"
radius_m = 0.01
mass_kg = 0.0246
inertia_factor = 0.5
layout_m = {layout_nes}
layout_sd_m = 3e-5

[excitation]
frequency_hz = {DRIVE_HZ}
acceleration_g = {level_g}
axis = "x"

[model]
{lines}"""


def calibration_of(views: list[View]) -> dict:
    """`calibration.json` of the two cameras, free of error but for what the lens residual of the noise adds."""
    return {"format": 1, "world": "board", "cameras": [{
        "name": v.name, "sensor_size_px": list(SENSOR_PX),
        "matrix": [[v.focal_px[0], 0.0, v.centre_px[0]], [0.0, v.focal_px[1], v.centre_px[1]], [0.0, 0.0, 1.0]],
        "distortion": v.distortion.tolist(), "rotation": v.rotation.tolist(), "translation_m": v.translation_m.tolist(),
        "rms_px": 0.1} for v in views]}


def _model_table(draft: Draft, told: bool, rng: np.random.Generator) -> dict:
    """`[model]`: what the nominal simulator contains; with `told` also its parameters, each off by about 3 %."""
    table: dict = {"effects": list(draft.model_effects)}
    names = ["restitution", "wall_friction", "tangential_restitution"]
    if draft.model_effects:
        names.append("floor_friction")
    if told:
        table |= {name: round(float(draft.plant[name] * (1 + rng.normal(0.0, 0.03))), 4) for name in names}
    return table


def make_series(kind: str, size: float, rng: np.random.Generator, runs: int = 12, noise: str | None = None,
                name: str = "sealed", tell_model: bool = False) -> Series:
    """A series of `runs` short recordings with the cause `kind` at `size`.

    `kind`: "none", a name of `causes.CAUSES`, or two joined by "+". `noise`: "white", "ar1", "warp", or None to draw one.
    Needs about 0.5 s for 12 runs once compiled.
    """
    noise_kind = noise or str(rng.choice(NOISE_KINDS))
    draft = draft_series(kind, size, rng, runs)
    errors = view_of(draft)
    views, marks, seen = draw_views(rng), draw_marks(errors.centre_marker_offset_m, rng), draw_noise(noise_kind, rng)
    model = _model_table(draft, tell_model, rng)
    vertical_phase = float(rng.uniform(0.0, 2.0 * np.pi))
    recordings, states = [], {}
    for run in range(runs):
        level = float(rng.choice([6.0, 7.0, 8.0, 9.0], p=[0.17, 0.18, 0.48, 0.17]))
        tracks, arrays = _one_run(draft, run, level, views, marks, errors, seen, vertical_phase, rng)
        recordings.append((recording_text(f"{name} run {run + 1}", level, views, model), tracks))
        states |= arrays
    causes = [] if kind == "none" else kind.split("+")
    listed = [c for c in causes if CAUSES[c].listed]
    count = sum(int((states[f"imp{r + 1:02d}"][:, 1] > COUNTED_SPEED_M_PER_S).sum()) for r in range(runs))
    truth = {"case": name, "effect": kind, "size": size, "verdict": "none" if not causes else "effect" if listed else "unknown",
             "effects": listed, "stages": [CAUSES[c].stage for c in causes], "parameters": draft.parameters,
             "plant": {key: float(value) for key, value in draft.plant.items()}, "measurement": dict(draft.view),
             "vertical_amplitude_m": draft.vertical_amplitude_m, "model_effects": list(draft.model_effects),
             "run_friction": None if draft.run_friction is None else draft.run_friction.tolist(),
             "noise": noise_kind, "sd_px": seen.sd_px, "n_impacts": count, "runs": runs}
    return Series(truth, recordings, calibration_of(views), states)


def write_series(series: Series, folder: Path) -> None:
    """Write a series in the layout of FORMATS.md: `calibration.json`, `run-NN/recording.toml`, `run-NN/tracks.parquet`.
    The truth is not written here."""
    from ovines.tables import write_table
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "calibration.json").write_text(json.dumps(series.calibration, indent=1))
    for index, (text, tracks) in enumerate(series.recordings):
        run = folder / f"run-{index + 1:02d}"
        run.mkdir(exist_ok=True)
        (run / "recording.toml").write_text(text)
        write_table(tracks, "tracks", run / "tracks.parquet", {})
