"""How the plant is seen: two cameras with their errors, noise, gaps and outliers, down to the tracks."""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from analysis.blind.recording.noise import Noise, draw_errors
from analysis.blind.recording.unexpected import shaded
from analysis.blind.recording.unforeseen import glared
from analysis.blind.recording.unimagined import through_lid
from analysis.blind.recording.unsuspected import glinted, trailed, twisted
from analysis.blind.recording.untold import blocked
from analysis.blind.recording.views import GROUND_M, HOST_M, MARKERS, NES_M, WINDOW_PX, View, ViewErrors


@dataclass(frozen=True)
class Marks:
    """Where the markers really sit: design layouts and placement errors, in each body's frame (n, 3)."""

    host_m: np.ndarray
    nes_m: np.ndarray


def draw_marks(centre_offset_m: tuple[float, float], rng: np.random.Generator, placement_sd_m: float = 3e-5) -> Marks:
    """Markers glued with 0.03 mm; the centre marker is where it should be, but for its own offset."""
    host, nes = HOST_M.copy(), NES_M.copy()
    host[:, :2] += rng.normal(0.0, placement_sd_m, (4, 2))
    nes[1:, :2] += rng.normal(0.0, placement_sd_m, (4, 2))
    nes[0, :2] += centre_offset_m
    return Marks(host, nes)


def _turned(layout_m: np.ndarray, angle_rad: np.ndarray, centre_m: np.ndarray) -> np.ndarray:
    cosine, sine = np.cos(angle_rad)[:, None], np.sin(angle_rad)[:, None]
    x, y = layout_m[:, 0], layout_m[:, 1]
    return np.stack(
        [
            centre_m[:, :1] + cosine * x - sine * y,
            centre_m[:, 1:2] + sine * x + cosine * y,
            np.broadcast_to(centre_m[:, 2:3] + layout_m[:, 2], (len(angle_rad), len(layout_m))),
        ],
        axis=-1,
    )


def world_points(
    nes: np.ndarray, host: np.ndarray, marks: Marks, errors: ViewErrors, bent_m: np.ndarray | float = 0.0
) -> np.ndarray:
    """Points (frames, 12, 3) in the calibration's world. `nes` (n, 4): middle x, y, z and angle; `host` (n,
    4): x, y, rotation, z; `bent_m` (n, 2): how far the Host's marker on a tab is off."""
    frames = len(nes)
    ground = np.broadcast_to(GROUND_M, (frames, 3, 3))
    host_points = _turned(marks.host_m, host[:, 2], host[:, [0, 1, 3]])
    host_points[:, errors.tab_marker, :2] += bent_m
    nes_points = _turned(marks.nes_m, nes[:, 3], nes[:, :3])
    if errors.slipped_m != (0.0, 0.0):
        elsewhere = marks.nes_m.copy()
        elsewhere[2, :2] += errors.slipped_m
        later = np.arange(frames) >= frames // 2
        nes_points[later] = _turned(elsewhere, nes[:, 3], nes[:, :3])[later]
    points = np.concatenate([ground, host_points, nes_points], axis=1)
    a, b = errors.plane_rad
    about_x = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    about_y = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
    return errors.scale * points @ (about_y @ about_x).T


def _shown(frames: int, share: float) -> np.ndarray:
    """Which frame a camera shows in place of each (frames,), where a share of them repeats the one before; a generator
    of its own leaves all other chances as they are."""
    repeats = np.random.default_rng(frames).random(frames) < share
    repeats[0] = False
    return np.maximum.accumulate(np.where(repeats, 0, np.arange(frames)))


def tracks_of(
    points_m: list[np.ndarray],
    true_time_s: list[np.ndarray],
    frame_rate_hz: float,
    views: list[View],
    errors: ViewErrors,
    noise: Noise,
    rng: np.random.Generator,
    shake_px: np.ndarray | float = 0.0,
    twist_rad: np.ndarray | None = None,
    tripod_px: np.ndarray | None = None,
) -> pd.DataFrame:
    """`tracks` of one run. `points_m` and `true_time_s`: per camera (frames, 12, 3) and (frames,); `shake_px` (frames,)
    of the first camera along u, `twist_rad` (frames,) about its axis, `tripod_px` (frames, 2) along u and v."""
    parts = []
    for index, view in enumerate(views):
        pixels = glared(view.pixels(points_m[index]), index, view, errors)
        pixels = through_lid(pixels, index, view, errors)
        pixels = glinted(trailed(pixels, frame_rate_hz, errors), points_m[index], index, errors)
        pixels = shaded(pixels, points_m[index], view, errors)
        frames = len(pixels)
        if noise.kind == "warp":
            u, v = pixels[..., 0] / noise.warp_length_px[0], pixels[..., 1] / noise.warp_length_px[1]
            phase = noise.warp_phase_rad[index]
            pixels = pixels + noise.warp_px * np.stack([np.sin(u + q[0]) * np.sin(v + q[1]) for q in phase], axis=-1)
        if index == 0 and twist_rad is not None:
            pixels = twisted(pixels, twist_rad, view)
        if index == 0 and tripod_px is not None:
            pixels = pixels + tripod_px[:, None]
        if index == 0:
            pixels[..., 0] += np.reshape(shake_px, (-1, 1))
            pixels[..., 0] += errors.wobble_px * np.sin(2 * np.pi * errors.wobble_hz * true_time_s[0])[:, None]
            swing = errors.zoom_swing * np.sin(2 * np.pi * errors.zoom_swing_hz * true_time_s[0])
            pixels = pixels + (pixels - view.centre_px) * swing[:, None, None]
        if index == 1:
            pixels[..., 0] += errors.creep_px * np.linspace(0.0, 1.0, frames)[:, None]
            grown = errors.zoom * np.linspace(0.0, 1.0, frames)
            pixels = pixels + (pixels - view.centre_px) * grown[:, None, None]
            if errors.lost_frame_share > 0.0:
                late = np.arange(frames) >= errors.lost_frame_share * frames
                pixels = np.where(late[:, None, None], np.roll(pixels, -1, axis=0), pixels)[: frames - 1]
                frames -= 1
        if errors.stretched != 0.0:
            pixels[..., 1] += errors.stretched * (pixels[..., 1] - view.centre_px[1])
        if errors.shutter_s > 0.0:
            late_s = errors.shutter_s * (pixels[..., 1:] - view.window_offset_px[1]) / WINDOW_PX[1]
            pixels = pixels + np.gradient(pixels, axis=0) * frame_rate_hz * late_s
        pixels = pixels + draw_errors(pixels.shape, noise, rng)
        stray = rng.random(pixels.shape[:2]) < noise.outliers
        pixels[..., 0] += stray * rng.normal(0.0, noise.outlier_px, stray.shape)
        if index == 0 and errors.stutter_share > 0.0:
            pixels = pixels[_shown(frames, errors.stutter_share)]
        pixels -= view.window_offset_px
        if errors.window_camera == index:
            pixels -= errors.window_px
        pixels = blocked(pixels, errors)
        seen = rng.random(pixels.shape[:2]) > noise.missing
        seen &= np.all((pixels > 0) & (pixels < np.array(WINDOW_PX) - 1), axis=-1)
        for _ in range(rng.poisson(0.5 * noise.gaps_per_run)):
            start = rng.integers(frames)
            seen[start : start + rng.integers(5, 41), rng.integers(len(MARKERS))] = False
        frame, marker = np.nonzero(seen)
        parts.append(
            pd.DataFrame(
                {
                    "camera": view.name,
                    "frame": frame.astype(np.int32),
                    "time_s": frame / frame_rate_hz,
                    "marker": np.array(MARKERS, dtype=object)[marker],
                    "u_px": pixels[frame, marker, 0],
                    "v_px": pixels[frame, marker, 1],
                    "sd_px": noise.sd_px,
                }
            )
        )
    return pd.concat(parts, ignore_index=True).sort_values(["frame", "camera", "marker"], ignore_index=True)
