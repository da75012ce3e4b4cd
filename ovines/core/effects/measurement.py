"""Effects of the measurement: clocks, windows, scale, plane.  They change what is reported, not the motion.

On centres in the world, the camera's clock and window act through triangulation only (two views that disagree);
they are declared here and act where images are made (`observe` None); the others act on the sampled motion.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ovines.core.effects.effect import Effect, EffectParameter, Measurement, Values, Words

INF = math.inf
_POSITIONS, _VELOCITIES = (0, 1, 6, 7), (2, 3, 8, 9)


def _scale(shown: Measurement, values: Values, rng: np.random.Generator) -> Measurement:
    seen = shown.samples.copy()
    seen[:, _POSITIONS + _VELOCITIES] *= values["scale"]
    return replace(shown, samples=seen)


def _frame_rate(shown: Measurement, values: Values, rng: np.random.Generator) -> Measurement:
    seen = shown.samples.copy()
    seen[:, (2, 3, 5, 8, 9, 11)] /= values["ratio"]
    return replace(shown, times=shown.times * values["ratio"], samples=seen)


def _plane(shown: Measurement, values: Values, rng: np.random.Generator) -> Measurement:
    seen = shown.samples.copy()
    seen[:, (0, 2, 6, 8)] *= math.cos(values["y_rad"])
    seen[:, (1, 3, 7, 9)] *= math.cos(values["x_rad"])
    return replace(shown, samples=seen)


def _jitter(shown: Measurement, values: Values, rng: np.random.Generator) -> Measurement:
    seen = shown.samples.copy()
    samples = shown.samples
    late = rng.normal(0.0, values["sd_s"], len(seen))
    for position, velocity in ((0, 2), (1, 3), (4, 5), (6, 8), (7, 9), (10, 11)):
        seen[:, position] += samples[:, velocity] * late
    return replace(shown, samples=seen)


def _blur(shown: Measurement, values: Values, rng: np.random.Generator) -> Measurement:
    seen = shown.samples.copy()
    for first in (0, 6):  # each body by its own errors
        speed = np.hypot(seen[:, first + 2], seen[:, first + 3])
        seen[:, first : first + 2] += values["sd_s"] * speed[:, None] * rng.standard_normal((len(seen), 2))
        seen[:, first + 4] += values["sd_s"] * np.abs(seen[:, first + 5]) * rng.standard_normal(len(seen))
    return replace(shown, samples=seen)


MEASUREMENT_EFFECTS = (
    Effect(
        "camera_clock_offset",
        "measurement",
        (EffectParameter("offset_s", "s", -INF, INF),),
        "The second camera sees the world later by a constant: an epipolar error that grows with speed.",
        Words(
            "Clock offset between the cameras",
            "the second camera sees the world later or earlier",
            "Film a flashing diode with both cameras: the frame in which it lights up tells the delay.",
        ),
    ),
    Effect(
        "sensor_window_offset",
        "measurement",
        (
            EffectParameter("u_px", "px", -INF, INF, 0.0),
            EffectParameter("v_px", "px", -INF, INF, 0.0),
        ),
        "A camera's window was elsewhere than window_offset_px says: a constant epipolar error. (u, v) is how far the "
        "second view's pixels stand off the first's: the first window was off by (u, v) or the second by the opposite.",
        Words(
            "Window offset of a camera",
            "a sensor window is elsewhere than the recording says",
            "Record the extrinsic board once in the recording's window and once on the full sensor.",
        ),
    ),
    Effect(
        "length_scale_error",
        "measurement",
        (EffectParameter("scale", "1", 0.1, 10.0),),
        "Reported lengths are the true ones times scale (a board printed in another size).",
        Words(
            "Length scale",
            "the calibration's unit is off",
            "Measure the distance of two Host markers (or the board's ten squares) with calipers.",
        ),
        observe=_scale,
    ),
    Effect(
        "frame_rate_error",
        "measurement",
        (EffectParameter("ratio", "1", 0.1, 10.0),),
        "Reported times are the true ones times ratio (true rate over nominal rate).",
        Words(
            "Frame rate",
            "the true frame rate is not the nominal one",
            "Record the trigger on the acquisition card and give it as trigger.csv.",
        ),
        observe=_frame_rate,
    ),
    Effect(
        "plane_tilt",
        "measurement",
        (
            EffectParameter("x_rad", "rad", -1.0, 1.0, 0.0),
            EffectParameter("y_rad", "rad", -1.0, 1.0, 0.0),
        ),
        "The world's z is not the plane's normal: turned about x and y, plane lengths shorten by the cosines and z "
        "follows x, y.",
        Words(
            "Tilted world plane",
            "the world's z is not the sliding plane's normal",
            "Lay the board flat on the sliding floor for the extrinsic view.",
        ),
        observe=_plane,
    ),
    Effect(
        "trigger_jitter",
        "measurement",
        (EffectParameter("sd_s", "s", 0.0, INF),),
        "Frame times scatter (normal, sd): positions err by velocity times the lateness, to first order.",
        Words(
            "Trigger jitter",
            "the frames' times scatter",
            "Record the trigger on the acquisition card and give it as trigger.csv.",
        ),
        observe=_jitter,
    ),
    Effect(
        "motion_blur",
        "measurement",
        (EffectParameter("sd_s", "s", 0.0, INF),),
        "Places scatter by this time's way, in any direction (normal, sd times speed; angles by sd times spin), each "
        "body by its own: markers smeared over the exposure are found less well the faster they are.",
        Words(
            "Motion blur",
            "markers are found less well the faster they move",
            "Halve the exposure (and double the light) in one run: what is smeared halves, frame times that scatter "
            "do not care.",
        ),
        observe=_blur,
    ),
)
