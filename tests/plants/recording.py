"""One run of a rig as the table `motion` and recording.toml, with what really happened."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.signal import lfilter

from tests.plants.kernel import GRAVITY_M_PER_S2, LINE_COLUMNS, Physics, host_at, middle_of, run, sliding_table
from tests.plants.rig import FRAME_RATE_HZ, LAST_FRAME, LATEST_S, Rig, Spec, draw_rig

FAST_M_PER_S = 0.15
MOST_IMPACTS = 3000
# A run ends once the wall has held the disk this long; one with fewer fast impacts or shorter than this is started
# anew.
LONGEST_HOLD_PERIODS, ENOUGH_IMPACTS, SHORTEST_PERIODS, MOST_TRIES = 0.4, 10, 3.0, 30
SPIN_UP_PERIODS = 0.5  # simulated before the first frame, so that no film starts with what was drawn
SEVERAL = 3  # fewest fast impacts from which the length of a flight is read
_TABLE = sliding_table()
IMPACT_COLUMNS = (
    "time_s",
    "normal_speed_before_m_per_s",
    "tangential_speed_before_m_per_s",
    "restitution",
    "azimuth_rad",
    "normal_speed_after_m_per_s",
    "tangential_speed_after_m_per_s",
    "slides",
)


@dataclass(frozen=True)
class Run:
    """``toml``, ``motion`` as files want them; ``truth``: "impacts" (DataFrame, azimuth in the world, times on the
    film's clock), "held" (n, 2), "states" (DataFrame per frame without noise, world), "parameters", "place", "start_s",
    "rate_hz", "law"."""

    toml: str
    motion: pd.DataFrame
    truth: dict[str, Any] = field(repr=False)


def _harmonic(rig: Rig, rng: np.random.Generator) -> np.ndarray:
    omega, phase = 2 * np.pi * rig.drive_hz, rng.uniform(0, 2 * np.pi, 5)
    size = rig.amplitude_m
    still = np.array([1.0, 0.0 if rig.spec.still else 1.0, 1.0, 1.0])
    return _rows(np.array([
        [0, size, omega, phase[0]], [0, size * rng.uniform(0.003, 0.02), 2 * omega, phase[1]],
        [1, size * rng.uniform(0.002, 0.015), omega, phase[2]], [2, 1e-4 * rng.uniform(0.2, 1), omega, phase[3]],
        [3, (rig.vertical_g + 0.002) * GRAVITY_M_PER_S2 / omega**2, omega, phase[4]],
    ]) * still)  # fmt: skip


def _rows(lines: np.ndarray) -> np.ndarray:
    """Lines for ever (n, 4) as the kernel takes them."""
    rows = np.zeros((len(lines), LINE_COLUMNS))
    rows[:, :4], rows[:, 5] = lines, -np.inf
    return rows


def _more(rig: Rig, *lines: tuple[float, ...]) -> np.ndarray:
    """Rows of lines given by axis, amplitude and frequency over the drive's, and phase."""
    unit = np.array([1.0, rig.amplitude_m, 2 * np.pi * rig.drive_hz, 1.0])
    return _rows(np.array(lines) * unit)


def _two_lines(rig: Rig, rng: np.random.Generator) -> np.ndarray:
    return np.vstack([_harmonic(rig, rng), _more(rig, (0, 0.2, 17.3 / 11, rng.uniform(0, 6.28)))])


def _two_axes(rig: Rig, rng: np.random.Generator) -> np.ndarray:
    return np.vstack([_harmonic(rig, rng), _more(rig, (1, 0.6, 13 / 11, rng.uniform(0, 6.28)))])


def _small_line(rig: Rig, rng: np.random.Generator) -> np.ndarray:
    return np.vstack([_harmonic(rig, rng), _more(rig, (0, 0.006, 47 / 11, rng.uniform(0, 6.28)))])


def _chirp(rig: Rig, rng: np.random.Generator) -> np.ndarray:
    """From 0.6 to 1.4 of the drive's frequency over the run."""
    rows = _more(rig, (0, 1.0, 0.6, rng.uniform(0, 6.28)))
    omega = 2 * np.pi * rig.drive_hz
    rows[:, 4] = 0.8 * omega / ((rig.spec.periods + SPIN_UP_PERIODS) / rig.drive_hz)
    return rows


def _random(rig: Rig, rng: np.random.Generator) -> np.ndarray:
    """Forty lines between 0.4 and 1.6 of the drive's frequency."""
    return _more(rig, *((0, 0.2 / f, f, rng.uniform(0, 6.28)) for f in rng.uniform(0.4, 1.6, 40)))


def _start_up(rig: Rig, rng: np.random.Generator) -> np.ndarray:
    """From rest on, within a period and a half."""
    rows = _harmonic(rig, rng)
    rows[:, 5], rows[:, 6] = 0.0, 1.5 / rig.drive_hz
    return rows


#: name -> lines of the drive
DRIVES = {
    "harmonic": _harmonic,
    "two lines": _two_lines,
    "two axes": _two_axes,
    "small line": _small_line,
    "chirp": _chirp,
    "random": _random,
    "start-up": _start_up,
}


def _later(rows: np.ndarray, late_s: float) -> np.ndarray:
    """The same motion with time from ``late_s`` on."""
    rows = rows.copy()
    ringing = rows[:, 7] > 0  # their phase counts from their own begin
    rows[:, 3] += np.where(ringing, 0.0, rows[:, 2] * late_s + 0.5 * rows[:, 4] * late_s**2)
    rows[:, 2] += rows[:, 4] * late_s
    rows[:, 5] -= late_s
    return rows


def _gust(rig: Rig, duration_s: float, rng: np.random.Generator) -> np.ndarray:
    """Times and accelerations (n, 3): noise through two equal low passes, so that it is smooth; (0, 3) where the air is
    still.
    """
    rms, tau = rig.gust
    if rms == 0.0:
        return np.zeros((0, 3))
    step = tau / 40
    time = np.arange(0.0, duration_s + 2 * step, step)
    values, keep = rng.normal(size=(len(time) + 400, 2)), np.exp(-step / tau)
    for _ in range(2):
        values = lfilter([1 - keep], [1.0, -keep], values, axis=0)
    values = values[400:]
    # of two equal low passes the stationary variance is known: so gusts of a short run are not scaled up to a full size
    a = 1 - keep
    variance = a**4 * (1 + keep**2) / (1 - keep**2) ** 3
    return np.column_stack([time, rms * values / np.sqrt(variance)])


def moved(rig: Rig, rng: np.random.Generator) -> tuple[np.ndarray, pd.DataFrame, np.ndarray, np.ndarray]:
    """Nodes, impacts, held and harmonics of one run in the rig's frame, time from the first frame on.

    A disk that soon rolls along the wall for good, or comes to rest out of the wall's way, is started anew; of all
    tries the one with most impacts stands.
    """
    best = None
    for _ in range(MOST_TRIES):
        one = _moved_once(rig, rng)
        fast = int((one[1]["normal_speed_before_m_per_s"] > FAST_M_PER_S).sum())
        if best is None or fast > best[0]:
            best = (fast, one)
        if rig.spec.still and fast >= SEVERAL:
            break
        if fast >= ENOUGH_IMPACTS and one[0][-1, 0] * rig.drive_hz > SHORTEST_PERIODS:
            break
    return best[1]


def _moved_once(rig: Rig, rng: np.random.Generator) -> tuple[np.ndarray, pd.DataFrame, np.ndarray, np.ndarray]:
    period = 1 / rig.drive_hz
    duration = (rig.spec.periods + SPIN_UP_PERIODS) * period
    harmonics, p = DRIVES[rig.spec.drive](rig, rng), rig.physics
    if p.recoil_share:
        none = np.zeros((2 * MOST_IMPACTS, LINE_COLUMNS))
        none[:, 0] = -1.0
        harmonics = np.vstack([harmonics, none])
    far, azimuth = p.reach_m * 0.9 * np.sqrt(rng.random()), rng.uniform(0, 2 * np.pi)
    far = p.cylinder_m + (1 - p.cylinder_m / p.reach_m) * far
    start = np.zeros(8)
    start[:2] = host_at(0.0, harmonics)[0][:2]
    start[:2] += far * np.cos(azimuth), far * np.sin(azimuth)
    start[2], start[5] = rng.uniform(0, 2 * np.pi), rng.normal(0, 0.4 * rig.top_speed_m_per_s / p.radius_m)
    start[3:5] = rng.normal(0, (1.5 if rig.spec.still else 0.6) * rig.top_speed_m_per_s, 2)
    start[7] = -1.0
    start[:2] -= middle_of(start, p)  # the state is the centre of mass's
    gust, drawn = _gust(rig, duration, rng), rng.normal(size=(MOST_IMPACTS, 2))
    nodes, impacts, held = run(
        duration, np.inf if rig.spec.still else LONGEST_HOLD_PERIODS * period, start, p, harmonics, gust, _TABLE, drawn
    )
    late = SPIN_UP_PERIODS * period
    harmonics = _later(harmonics[harmonics[:, 0] >= 0], late)
    nodes[:, 0] -= late
    impacts[:, 0] -= late
    kept = impacts[(impacts[:, 0] > 0) & (impacts[:, 1] > 0)]
    held = held - late
    return nodes, pd.DataFrame(kept, columns=list(IMPACT_COLUMNS)), held[held[:, 1] > 0], harmonics


def at_times(nodes: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    """States (n, 6) between nodes by cubics through places and velocities, so an impact between two frames stays
    sharp.
    """
    after = np.clip(np.searchsorted(nodes[:, 0], time_s, side="right"), 1, len(nodes) - 1)
    a, b = nodes[after - 1], nodes[after]
    h = (b[:, 0] - a[:, 0])[:, None]
    s = np.clip((time_s - a[:, 0])[:, None] / np.maximum(h, 1e-300), 0.0, 1.0)
    place = (
        a[:, 1:4] * (1 + 2 * s) * (1 - s) ** 2
        + b[:, 1:4] * s**2 * (3 - 2 * s)
        + h * (a[:, 4:7] * s * (1 - s) ** 2 - b[:, 4:7] * s**2 * (1 - s))
    )
    return np.hstack([place, a[:, 4:7] + s * (b[:, 4:7] - a[:, 4:7])])


def _host(lines: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    return np.array([host_at(t, lines)[0] for t in time_s])


def _frame_rate(rig: Rig, impacts: pd.DataFrame) -> float:
    """Frames a second that give the rig's frames per typical flight; the law's own where it has one."""
    if rig.law.frame_rate_hz is not None:
        return rig.law.frame_rate_hz
    fast = impacts.loc[impacts["normal_speed_before_m_per_s"] > 0.2 * rig.top_speed_m_per_s, "time_s"].to_numpy()
    flight = float(np.median(np.diff(fast))) if len(fast) > SEVERAL else 0.5 / rig.drive_hz
    return float(np.clip(rig.frames_per_flight / flight, *FRAME_RATE_HZ))


def _errors(rig: Rig, places: np.ndarray, columns: int, rng: np.random.Generator) -> np.ndarray:
    """Noise (n, columns) of sd 1, correlated from frame to frame where the rig's is."""
    noise = rng.normal(size=(len(places), columns))
    noise[1:] *= np.sqrt(1 - rig.correlation**2)
    return lfilter([1.0], [1.0, -rig.correlation], noise, axis=0)


def _lens(rig: Rig, xy: np.ndarray) -> np.ndarray:
    """The calibration's residual (n, 2) at places of the rig: it turns with the rig, as the cameras do."""
    u, v = (xy / (rig.physics.reach_m + rig.amplitude_m)).T
    terms = np.column_stack([u, v, u * u - 0.5, u * v, v * v - 0.5, u**3, u * u * v, u * v * v, v**3])
    return terms @ rig.lens.T


def make_run(rig: Rig, rng: np.random.Generator, name: str = "run 1", rate_hz: float | None = None) -> Run:
    """One run of ``rig``; ``rate_hz`` fixes the frame rate, which else follows from this run's flights."""
    nodes, impacts, held, harmonics = moved(rig, rng)
    rate = rate_hz or _frame_rate(rig, impacts)
    frames = min(int(nodes[-1, 0] * rate), rig.spec.most_frames)
    time = np.arange(frames) / rate
    state, host, p = at_times(nodes, time), _host(harmonics, time), rig.physics
    c, s = np.cos(state[:, 2]), np.sin(state[:, 2])
    middle = state[:, :2] - np.column_stack([c * p.mass_x_m - s * p.mass_y_m, s * p.mass_x_m + c * p.mass_y_m])
    start_s, first = (
        (0.0, 0) if rig.spec.at_origin else (float(rng.uniform(0, LATEST_S)), int(rng.integers(LAST_FRAME)))
    )
    clean = pd.DataFrame(
        {
            "frame": np.arange(frames) + first,
            "time_s": time + start_s,
            **dict(zip(("nes_x_m", "nes_y_m"), _world(rig, middle).T, strict=True)),
            "nes_z_m": 0.0,
            "nes_angle_rad": state[:, 2] + rig.place[2],
            **dict(zip(("host_x_m", "host_y_m"), _world(rig, host[:, :2]).T, strict=True)),
            "host_z_m": 0.0,
            "host_angle_rad": host[:, 2] + rig.place[2],
        }
    )
    motion = _seen(rig, clean, middle, host[:, :2], rng)
    impacts["time_s"] += start_s
    azimuth = impacts["azimuth_rad"] + rig.place[2]
    impacts["azimuth_rad"] = np.arctan2(np.sin(azimuth), np.cos(azimuth))
    impacts = impacts[impacts["time_s"] < motion["time_s"].iloc[-1]]
    truth = {
        "law": rig.spec.law,
        "rig": rig,
        "rate_hz": rate,
        "start_s": start_s,
        "place": rig.place,
        "noise": rig.noise,
        "impacts": impacts,
        "held": held + start_s,
        "states": clean,
        "harmonics": harmonics,
        "parameters": {**p._asdict(), "drive_hz": rig.drive_hz},
        "nodes": nodes,
    }
    return Run(recording_text(rig, name, rate), motion, truth)


def _world(rig: Rig, xy: np.ndarray) -> np.ndarray:
    x, y, turn = rig.place
    c, s = np.cos(turn), np.sin(turn)
    return xy @ np.array([[c, s], [-s, c]]) + (x, y)


def _seen(rig: Rig, clean: pd.DataFrame, nes: np.ndarray, host: np.ndarray, rng: np.random.Generator) -> pd.DataFrame:
    """``clean`` with the cameras' errors and their sds.  A marker 0.7 radii out tells the angle as well as the
    place.
    """
    p, spec, motion = rig.physics, rig.spec, clean.copy()
    turn = rig.place[2]
    to_world = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    for body, places, radius in (("nes", nes, p.radius_m), ("host", host, p.reach_m + p.radius_m)):
        sds = rig.sd_m * np.array([1.0, 1.0, 2.0, 1.0 / (0.7 * radius)])
        noise = _errors(rig, places, 4, rng) * sds
        noise[:, :2] = (noise[:, :2] + _lens(rig, places)) @ to_world
        for k, (axis, unit) in enumerate((("x", "m"), ("y", "m"), ("z", "m"), ("angle", "rad"))):
            motion[f"{body}_{axis}_{unit}"] += noise[:, k]
            if spec.with_sd:
                motion[f"{body}_{axis}_sd_{unit}"] = sds[k]
    if not spec.with_angle:
        motion = motion.drop(columns=[c for c in motion if c.startswith("nes_angle")])
        motion["nes_angle_rad"] = np.nan
    return motion


def recording_text(rig: Rig, name: str, rate_hz: float) -> str:
    """recording.toml as an experimenter writes it who believes in our law."""
    p, excitation = rig.physics, ""
    if not rig.spec.still:
        excitation = f'[excitation]\nfrequency_hz = {rig.drive_hz!r}\nacceleration_g = {rig.level_g!r}\naxis = "x"\n\n'
    return f"""format = 1
name = "{name}"

[time]
frame_rate_hz = {rate_hz!r}

[bodies.host]
markers = []
{wall_text(p)}

[bodies.nes]
markers = []
radius_m = {p.radius_m!r}
mass_kg = {rig.mass_kg!r}
inertia_factor = {p.inertia_factor!r}

{excitation}[model]
effects = ["floor_friction", "spin_coupling"]
"""


def wall_text(p: Physics) -> str:
    """The Host's wall as recording.toml has it."""
    inner = p.reach_m + p.radius_m
    text = f"inner_radius_m = {inner!r}"
    if p.sides:
        corner = p.sides_rad + np.pi / p.sides * (2 * np.arange(int(p.sides)) - 1)
        far = inner / np.cos(np.pi / p.sides)
        text = f"polygon_m = {(far * np.column_stack([np.cos(corner), np.sin(corner)])).tolist()}"
    return text + (f"\nobstacle_radius_m = {p.cylinder_m - p.radius_m!r}" if p.cylinder_m else "")


def make_recording(spec: Spec, rng: np.random.Generator) -> tuple[str, pd.DataFrame, dict[str, Any]]:
    """(recording.toml, table motion, truth) of one run of a rig drawn after ``spec``."""
    one = make_run(draw_rig(spec, rng), rng)
    return one.toml, one.motion, one.truth


def make_series(spec: Spec, rng: np.random.Generator, runs: int = 3) -> list[Run]:
    """Runs of one rig, all at the frame rate that the first one's flights ask for."""
    rig = draw_rig(spec, rng)
    made = [make_run(rig, rng, "run 1")]
    for number in range(2, runs + 1):
        made.append(make_run(rig, rng, f"run {number}", made[0].truth["rate_hz"]))
    return made


def write_series(runs: list[Run], folder: Path) -> Path:
    """The folder of a series as `ovines` reads it; the truth is not written."""
    for number, one in enumerate(runs, 1):
        place = folder / f"run-{number:02d}"
        place.mkdir(parents=True, exist_ok=True)
        (place / "recording.toml").write_text(one.toml, encoding="utf-8")
        one.motion.to_parquet(place / "motion.parquet", index=False)
    return folder
