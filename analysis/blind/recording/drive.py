"""What the shaker does to the Host: a sine, and what is none."""

import math

import numpy as np

from analysis.blind.plant.compiled import Floats

DRIVES = ("sine", "start_up", "two_axes", "two_lines", "chirp", "random")
ASKED = ("sine", "start_up")  # those that `[excitation]` can say
RISE_S = 0.15  # the time in which a drive starts up
SWEEP = 0.3  # share of its frequency by which a chirp rises in a run
NOISE_LINES = 9


def _line(axis: int, amplitude_m: float, omega: float, phase: float, sweep: float = 0.0) -> list[float]:
    return [axis, amplitude_m, omega, phase, 0.0, 0.0, sweep]


def draw_drive(
    kind: str, sine: tuple[float, float, float], start_s: float, duration_s: float, rng: np.random.Generator
) -> Floats:
    """Lines (n, 7) of the Host's path (rows of the plant's `host_pose`) for one run: a `sine` (amplitude in m, rad/s,
    phase) along x, or what stands for it and is about as strong. `start_s`: when the run begins."""
    amplitude_m, omega, phase = sine
    steady = _line(0, amplitude_m, omega, phase)
    if kind == "sine":
        return np.array([steady])
    if kind == "start_up":
        return np.array([steady, [0, -amplitude_m, omega, phase + omega * start_s, start_s, 1.0 / RISE_S, 0.0]])
    if kind == "chirp":
        begins = omega * (1 - 0.5 * SWEEP)
        return np.array([_line(0, amplitude_m * (omega / begins) ** 2, begins, phase, SWEEP * omega / duration_s)])

    def beside(axis: int, share: float, ratio: float) -> list[float]:
        """A line of that share of the sine's acceleration, at so many times its frequency."""
        return _line(axis, share * amplitude_m / ratio**2, ratio * omega, rng.uniform(0.0, 2.0 * math.pi))

    if kind == "random":
        share = 1.0 / math.sqrt(NOISE_LINES)
        return np.array([beside(0, share, ratio) for ratio in np.sort(rng.uniform(0.75, 1.3, NOISE_LINES))])
    axis, share, ratios = (1, 0.6, (0.75, 1.3)) if kind == "two_axes" else (0, 0.5, (1.3, 1.9))
    return np.array([_line(0, 0.8 * amplitude_m, omega, phase), beside(axis, share, rng.uniform(*ratios))])
