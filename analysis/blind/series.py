"""A sealed series: twelve runs of the plant under the two cameras, with its truth."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd

from analysis.blind.cause import Draft
from analysis.blind.causes.named import CAUSES, draft_series, physics_of_run, view_of
from analysis.blind.plant.dynamics import START_S, Motion, host_at, run_plant, state_at
from analysis.blind.plant.host import host_rise
from analysis.blind.plant.parameters import PlantParameters
from analysis.blind.recording.clock import exposed_s, frame_times, latest_s, of_the_second_camera
from analysis.blind.recording.drive import draw_drive
from analysis.blind.recording.errors import ViewErrors
from analysis.blind.recording.files import Series, calibration_of, recording_text
from analysis.blind.recording.light import bulged, shadowed
from analysis.blind.recording.markers import (
    Marks,
    Poses,
    bent_m,
    blurred,
    carded,
    crept,
    draw_marks,
    flung,
    lifted,
    misread,
    on_the_board,
    padded,
    papered,
    pitched,
    played,
    printed,
    risen,
    sheared,
    slid,
    smeared,
    world_points,
)
from analysis.blind.recording.noise import Noise, draw_noise
from analysis.blind.recording.observe import tracks_of
from analysis.blind.recording.picture import shaking_of
from analysis.blind.recording.place import HOME, Place
from analysis.blind.recording.views import View, draw_views

LONGEST_S = 1.2
SHORTEST_S = 0.4  # a run cut earlier by sustained contact tells little and is started anew
COUNTED_SPEED_M_PER_S = 0.2  # impacts faster than this are counted in the truth, as the practice truths do
NOISE_KINDS = ("white", "ar1", "warp")
LEVELS_G, LEVEL_SHARES = (6.0, 7.0, 8.0, 9.0), (0.17, 0.18, 0.48, 0.17)


@dataclass(frozen=True)
class Outline:
    """All that is drawn before a run is simulated; `truth` is complete but for the count of impacts."""

    truth: dict[str, Any]
    draft: Draft
    views: list[View]
    marks: Marks
    noise: Noise
    model: dict[str, Any]
    vertical_phase_rad: float
    place: Place = HOME


def draw_host(
    place: Place, acceleration_g: float, vertical_m: float, vertical_phase_rad: float, rng: np.random.Generator
) -> np.ndarray:
    """Host lines (n, 7) of one run: the drive, chiefly along x, an overtone, a crosswise share, and the vertical
    motion."""
    drive = 2.0 * np.pi * place.drive_hz
    phase = rng.uniform(0.0, 2.0 * np.pi, 3)
    amplitude_m = acceleration_g * 9.81 / drive**2 * (1 + rng.normal(0.0, 1e-3))
    beside = np.zeros((3, 7))
    beside[:, :4] = [
        [0, rng.uniform(0.05, 0.21) * 1e-3, 2 * drive, phase[1]],
        [1, rng.uniform(0.03, 0.16) * 1e-3, drive, phase[2]],
        [3, vertical_m, drive, vertical_phase_rad],
    ]
    sine = (amplitude_m, drive, float(phase[0]))
    lines = np.vstack([draw_drive(place.drive, sine, START_S, LONGEST_S, rng), beside])
    if acceleration_g == 0.0:
        lines[:, 1] = 0.0
    return lines


@dataclass(frozen=True)
class Wish:
    """How a further run is made: ``level`` and ``frequency`` of the drive against the series' own; or ``launch`` by
    hand (speed in m/s, spin in rad/s) over a Host at rest."""

    level: float = 1.0
    frequency: float = 1.0
    launch: tuple[float, float] | None = None


AS_BEFORE = Wish()


def _launched(launch: tuple[float, float], plant: dict[str, float], rng: np.random.Generator) -> np.ndarray:
    """Initial state of a launch in a random direction: from the Host's centre, or beside its cylinder."""
    speed, spin = launch
    azimuth = rng.uniform(0.0, 2.0 * np.pi)
    along = np.array([np.cos(azimuth), np.sin(azimuth)])
    obstacle = plant.get("obstacle_m", 0.0)
    radius = 0.5 * (obstacle + PlantParameters().contact_radius_m) if obstacle else 0.0
    return np.array([*(radius * along), *(speed * along), rng.uniform(0.0, 2.0 * np.pi), spin])


def draw_start(rng: np.random.Generator) -> np.ndarray:
    """Initial x, y (from the Host), vx, vy, angle, spin as the practice series have them."""
    radius, azimuth = 0.022 + 0.017 * rng.random() ** 0.6, rng.uniform(0.0, 2.0 * np.pi)
    return np.array(
        [
            radius * np.cos(azimuth),
            radius * np.sin(azimuth),
            *rng.normal(0.0, 0.86, 2),
            rng.uniform(0.0, 2.0 * np.pi),
            rng.normal(0.0, 32.0),
        ]
    )


def _with_sway(harmonics: np.ndarray, sway: tuple[float, float, float], phase_rad: float) -> np.ndarray:
    """A run's harmonics and a slow line beside them, along its own direction."""
    amplitude, hz, direction = sway
    along = ((0, np.cos(direction)), (1, np.sin(direction)))
    omega = 2.0 * np.pi * hz
    return np.vstack([harmonics, *([[axis, amplitude * c, omega, phase_rad, 0.0, 0.0, 0.0]] for axis, c in along)])


def _marker_swing(motion: Motion, draft: Draft, time_s: np.ndarray) -> np.ndarray:
    """What the Host's markers do beside the Host (n, 2): after each impact they swing along the wall's normal, by the
    impulse along it."""
    out = np.zeros((len(time_s), 2))
    if draft.ringing is None:
        return out
    mass, hz, damping = draft.ringing
    omega = 2.0 * np.pi * hz
    swing = omega * np.sqrt(1.0 - damping**2)
    for (instant, *_), kick, normal in zip(motion.impacts, motion.kicks, motion.normals, strict=True):
        away = np.array([np.cos(normal), np.sin(normal)])
        late = np.maximum(time_s - instant, 0.0)
        start = -PlantParameters().mass_kg * (kick @ away) / mass
        out += (start / swing * np.exp(-damping * omega * late) * np.sin(swing * late))[:, None] * away
    return out


def _blows(motion: Motion) -> np.ndarray:
    """Times and changes of spin of a run's blows (k, 2)."""
    instant = motion.impacts[:, 0]
    before, after = (state_at(motion, instant - early)[:, 5] for early in (1e-12, 0.0))
    return np.column_stack([instant, after - before])


def _poses(motion: Motion, draft: Draft, time_s: np.ndarray) -> Poses:
    """Where the disk's middle and the Host are at `time_s`."""
    state = state_at(motion, time_s)
    host = host_at(motion, time_s)
    host[:, 3] += host_rise(host[:, 0], draft.plant.get("arc_per_m", 0.0))
    host[:, :2] += _marker_swing(motion, draft, time_s)
    angle = state[:, 4]
    x, y = draft.plant.get("mass_x_m", 0.0), draft.plant.get("mass_y_m", 0.0)
    middle = np.column_stack(
        [
            state[:, 0] - np.cos(angle) * x + np.sin(angle) * y,
            state[:, 1] - np.sin(angle) * x - np.cos(angle) * y,
            host[:, 3],
            angle,
        ]
    )
    return Poses(middle, host)


def _times(motion: Motion, run: int, place: Place, errors: ViewErrors, rng: np.random.Generator) -> list[np.ndarray]:
    """When either camera takes its frames (n,) in `run`, as many as the motion has for both."""
    rate = place.frame_rate_hz * errors.rate_ratio
    if errors.oscillator:
        rate *= 1.0 + errors.oscillator[run]
    frames = min(
        int((motion.nodes[-1, 0] - latest_s(errors, LONGEST_S)) * rate),
        int(LONGEST_S * place.frame_rate_hz),
    )
    first = frame_times(frames, rate, errors, rng)
    second = of_the_second_camera(first, motion.lines, motion.impacts[:, 0], motion.kicks, run, rate, errors)
    if errors.exposure_s != 0.0:
        second = second + exposed_s(state_at(motion, first)[:, :2] - host_at(motion, first)[:, :2], errors)
    return [first, second]


def _points(
    motion: Motion, poses: list[Poses], times: list[np.ndarray], marks: Marks, errors: ViewErrors
) -> list[np.ndarray]:
    """Where the markers are (frames, 12, 3) as either camera takes its frames."""
    blows, out = _blows(motion), []
    for pose, time_s in zip(poses, times, strict=True):
        card = played(carded(pose.nes, time_s, blows, errors), time_s, blows, errors)
        card = sheared(card, time_s, motion.impacts[:, 0], motion.kicks, errors)
        card = risen(card, time_s, motion.impacts[:, 0], motion.kicks, errors)
        card = lifted(misread(card, errors), time_s, errors)
        points = world_points(card, pose.host, marks, errors, bent_m(time_s, motion.lines, errors))
        points = pitched(padded(points, time_s, motion.lines, errors), pose.host, time_s, motion.lines, errors)
        points = crept(points, pose.nes[:, 3], time_s, motion.impacts, errors)
        points = slid(points, pose.nes[:, 3], time_s, errors)
        points = shadowed(flung(points, pose.nes[:, 3], time_s, errors), pose.host, errors)
        points = smeared(points, time_s, errors)
        out.append(on_the_board(bulged(points, pose.host, errors), errors))
    return out


def _one_run(
    outline: Outline,
    run: int,
    level_g: float,
    rng: np.random.Generator,
    wish: Wish = AS_BEFORE,
    remembered: bool = False,
) -> tuple[pd.DataFrame, dict[str, np.ndarray], list[Poses], Motion]:
    draft, errors, place = outline.draft, view_of(outline.draft), outline.place
    place = replace(place, drive_hz=wish.frequency * place.drive_hz)
    launch = None
    if wish.launch is not None:  # asked for in this rig's units, flown in the plant's
        launch = (wish.launch[0] / place.slower, wish.launch[1] * place.slower)
    harmonics = draw_host(place, level_g, draft.vertical_amplitude_m, outline.vertical_phase_rad, rng)
    if draft.sway is not None:
        harmonics = _with_sway(harmonics, draft.sway, rng.uniform(0.0, 2.0 * np.pi))
    physics = physics_of_run(draft, run, 2.0 * np.pi * place.drive_hz, LONGEST_S)
    for _ in range(200):
        start = draw_start(rng) if launch is None else _launched(launch, draft.plant, rng)
        motion = run_plant(physics, harmonics, start, LONGEST_S + 2e-3, rng, remembered)
        if motion.nodes[-1, 0] > SHORTEST_S:
            break
    times = _times(motion, run, place, errors, rng)
    poses = [_poses(motion, draft, t) for t in times]
    if errors.blur_s > 0.0:
        smeared = int(rng.integers(2**63))
        poses = [
            blurred(p, t, errors.blur_s, np.random.default_rng(smeared)) for p, t in zip(poses, times, strict=True)
        ]
    marks = printed(papered(outline.marks, run, errors), errors)
    points = _points(motion, poses, times, marks, errors)
    shaking = shaking_of(times[0], motion.lines, motion.impacts[:, 0], motion.kicks, run, errors)
    tracks = tracks_of(points, times, place.frame_rate_hz, outline.views, errors, outline.noise, rng, shaking)
    tracks["time_s"] *= place.slower
    if place.start_s:
        tracks = tracks.assign(
            time_s=tracks["time_s"] + place.start_s[run], frame=tracks["frame"] + place.first_frame[run]
        )
    number = f"{run + 1:02d}"
    states = {
        f"state{number}": state_at(motion, times[0]),
        f"imp{number}": motion.impacts,
        f"held{number}": motion.held,
        f"H{number}": harmonics,
    }
    return tracks, place.states(states), poses, motion


def _model_table(draft: Draft, with_parameters: bool, rng: np.random.Generator) -> dict[str, Any]:
    """`[model]`: what the nominal simulator contains; `with_parameters` also its parameters,
    each off by about 3 %."""
    table: dict[str, Any] = {"effects": list(draft.model_effects)}
    names = ["restitution", "wall_friction", "tangential_restitution"]
    if draft.model_effects:
        names.append("floor_friction")
    if with_parameters:
        table |= {name: round(float(draft.plant[name] * (1 + rng.normal(0.0, 0.03))), 4) for name in names}
    return table


def outline_series(
    kind: str,
    size: float | tuple[float, ...],
    rng: np.random.Generator,
    runs: int = 12,
    noise: str | None = None,
    name: str = "sealed",
    tell_model: bool = False,
    place: Place = HOME,
) -> Outline:
    """Draw a series; the arguments are those of `make_series`."""
    noise_kind = noise or str(rng.choice(NOISE_KINDS))
    draft = draft_series(kind, size, rng, runs, place.wall)
    views = draw_views(rng)
    marks = draw_marks(view_of(draft).centre_marker_offset_m, rng)
    seen = draw_noise(noise_kind, rng)
    model = _model_table(draft, tell_model, rng)
    causes = [] if kind == "none" else kind.split("+")
    listed = [c for c in causes if CAUSES[c].listed]
    truth = {
        "case": name,
        "effect": kind,
        "size": size if isinstance(size, float) else max(size, default=1.0),
        "sizes": dict.fromkeys(causes, size) if isinstance(size, float) else dict(zip(causes, size, strict=True)),
        "verdict": "none" if not causes else "effect" if len(listed) == len(causes) else "unknown",
        "effects": listed,
        "stages": [CAUSES[c].stage for c in causes],
        "parameters": {cause: place.world_parameters(cause, sizes) for cause, sizes in draft.parameters.items()},
        "plant": {key: float(place.in_units(key, value)) for key, value in draft.plant.items()},
        "measurement": {key: place.in_units(key, value) for key, value in draft.view.items()},
        "vertical_amplitude_m": place.in_units("_m", draft.vertical_amplitude_m),
        "model": model,
        "run_friction": None if draft.run_friction is None else draft.run_friction.tolist(),
        "noise": noise_kind,
        "sd_px": seen.sd_px,
        "runs": runs,
        "world": place.truth(),
    }
    return Outline(truth, draft, views, marks, seen, model, float(rng.uniform(0.0, 2.0 * np.pi)), place)


def run_outline(
    outline: Outline, rng: np.random.Generator, level_g: float | None = None, remembered: bool = False
) -> Series:
    """Simulate and film an outlined series; `level_g` drives every run as strongly, 0 not at all.  `remembered`: the
    series keeps its motions with all that disk, floor and wall remember (17 MB a run)."""
    recordings, poses, motions, count = [], [], [], 0
    states: dict[str, np.ndarray] = {}
    name = outline.truth["case"]
    for run in range(outline.truth["runs"]):
        level = float(rng.choice(LEVELS_G, p=LEVEL_SHARES))
        level = level if level_g is None else level_g
        tracks, arrays, seen, motion = _one_run(outline, run, level, rng, remembered=remembered)
        text = recording_text(f"{name} run {run + 1}", level, outline.views, outline.model, place=outline.place)
        recordings.append((text, tracks))
        states |= arrays
        poses.append(seen)
        motions += [motion] if remembered else []
        counted = COUNTED_SPEED_M_PER_S * outline.place.slower
        count += int((arrays[f"imp{run + 1:02d}"][:, 1] > counted).sum())
    truth = dict(outline.truth, n_impacts=count)
    return Series(truth, recordings, outline.place.cameras(calibration_of(outline.views)), states, poses, motions)


def further_run(outline: Outline, wish: Wish, rng: np.random.Generator) -> tuple[str, pd.DataFrame]:
    """recording.toml and tracks of one more run of an outlined series, made as wished."""
    run = int(rng.integers(outline.truth["runs"]))  # what differs from run to run is as in one of those there are
    level = 0.0 if wish.launch is not None else wish.level * float(rng.choice(LEVELS_G, p=LEVEL_SHARES))
    tracks, *_ = _one_run(outline, run, level, rng, wish)
    place = replace(outline.place, drive_hz=wish.frequency * outline.place.drive_hz)
    if wish.launch is not None:
        place = replace(place, drive="none")
    name = f"{outline.truth['case']}, a further run"
    return recording_text(name, level, outline.views, outline.model, place=place), tracks


def make_series(
    kind: str,
    size: float | tuple[float, ...],
    rng: np.random.Generator,
    runs: int = 12,
    noise: str | None = None,
    name: str = "sealed",
    tell_model: bool = False,
    place: Place = HOME,
) -> Series:
    """A series of `runs` short recordings with the cause `kind` at `size`.

    `kind`: "none", or names of `causes.CAUSES` joined by "+"; `size`: one for all or one each. `noise`: "white", "ar1",
    "warp", or None to draw one. `tell_model` writes nominal parameters, each off by about 3 %, into `[model]`. `place`:
    where the rig stands, its size, wall, drive and clock (`draw_place`); the usual rig at the world's origin. About a
    second for 12 runs once compiled.
    """
    return run_outline(outline_series(kind, size, rng, runs, noise, name, tell_model, place), rng)
