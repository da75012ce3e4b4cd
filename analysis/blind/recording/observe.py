"""How the plant is seen: two cameras with their errors, noise, gaps and outliers, down to the tracks."""

import numpy as np
import pandas as pd

from analysis.blind.recording.errors import ViewErrors
from analysis.blind.recording.light import lit
from analysis.blind.recording.noise import Noise, draw_errors, draw_missing, draw_outliers, lens_residual
from analysis.blind.recording.picture import (
    STEADY,
    Shaking,
    by_the_first_camera,
    by_the_second_camera,
    hazed,
    read_out,
    stuttered,
    unfocused,
)
from analysis.blind.recording.tracker import (
    blocked,
    bridged,
    dragged,
    ghosted,
    guessed,
    hopped,
    missed,
    rounded,
    smoothed,
    wandered_off_px,
)
from analysis.blind.recording.views import MARKERS, View


def tracks_of(
    points_m: list[np.ndarray],
    true_time_s: list[np.ndarray],
    frame_rate_hz: float,
    views: list[View],
    errors: ViewErrors,
    noise: Noise,
    rng: np.random.Generator,
    shaking: Shaking = STEADY,
) -> pd.DataFrame:
    """`tracks` of one run. `points_m` and `true_time_s`: per camera (frames, 12, 3) and (frames,)."""
    parts = []
    for index, view in enumerate(views):
        pixels = lit(view.pixels(points_m[index]), points_m[index], index, view, frame_rate_hz, errors)
        pixels = lens_residual(hazed(pixels, true_time_s[index], index, view, errors), index, noise)
        if index == 0:
            pixels = by_the_first_camera(pixels, true_time_s[0], view, shaking, errors)
        if index == 1:
            pixels = by_the_second_camera(pixels, view, errors, shaking)
        pixels = ghosted(read_out(pixels, view, frame_rate_hz, errors), errors)
        pixels = smoothed(missed(pixels, errors), errors)
        pixels = dragged(guessed(pixels, points_m[index], errors), errors)
        if shaking.bridged_draw is not None:
            pixels = bridged(pixels, index, shaking.bridged_draw, errors)
        if shaking.wander_draw is not None:
            pixels = pixels + wandered_off_px(len(pixels), shaking.wander_draw, errors)[index]
        if index == 1 and shaking.hops_from is not None:
            pixels = hopped(pixels, shaking.hops_from, frame_rate_hz, errors)
        if shaking.clicked_px is not None:
            pixels = pixels + shaking.clicked_px[index]
        pixels = unfocused(pixels, view, errors, rng)
        pixels = pixels + draw_errors(pixels.shape, noise, rng)
        pixels[..., 0] += draw_outliers(pixels.shape[:2], noise, rng)
        if index == 0 and errors.stutter_share > 0.0:
            pixels = stuttered(pixels, errors.stutter_share)
        pixels -= view.window_offset_px
        if errors.window_camera == index:
            pixels -= errors.window_px
        pixels = rounded(blocked(pixels, errors), errors)
        parts.append(_table(pixels, draw_missing(pixels, noise, rng), frame_rate_hz, view, noise))
    return pd.concat(parts, ignore_index=True).sort_values(["frame", "camera", "marker"], ignore_index=True)


def _table(pixels: np.ndarray, seen: np.ndarray, frame_rate_hz: float, view: View, noise: Noise) -> pd.DataFrame:
    """Rows of one camera's markers that were `seen` (frames, markers)."""
    frame, marker = np.nonzero(seen)
    return pd.DataFrame(
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
