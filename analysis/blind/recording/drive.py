"""What the shaker does to the Host: a sine, and what is none."""

import math

import numpy as np

from analysis.blind.plant.compiled import Floats

GRAVITY_M_PER_S2 = 9.81
DRIVES = ("sine", "start_up", "two_axes", "two_lines", "chirp", "random")
ASKED = ("sine", "start_up")  # those that `[excitation]` can say
RISE_S = 0.15  # the time in which a drive starts up
SWEEP = 0.3  # share of its frequency by which a chirp rises in a run
NOISE_LINES = 9


def _line(axis: int, acceleration: float, omega: float, phase: float, sweep: float = 0.0) -> list[float]:
    return [axis, acceleration / omega**2, omega, phase, 0.0, 0.0, sweep]


def draw_drive(
    kind: str, level_g: float, drive_hz: float, start_s: float, duration_s: float, rng: np.random.Generator
) -> Floats:
    """Lines (n, 7) of the Host's path (rows of the plant's `host_pose`) for one run, strongest first: `level_g` is the
    peak acceleration of a sine; others are about as strong. `start_s`: when the run begins."""
    full, omega = level_g * GRAVITY_M_PER_S2 * (1 + rng.normal(0.0, 1e-3)), 2.0 * math.pi * drive_hz
    phase = rng.uniform(0.0, 2.0 * math.pi, 2)
    if kind == "two_axes":
        other = omega * rng.uniform(0.75, 1.3)
        return np.array([_line(0, 0.8 * full, omega, phase[0]), _line(1, 0.6 * full, other, phase[1])])
    if kind == "two_lines":
        other = omega * rng.uniform(1.3, 1.9)
        return np.array([_line(0, 0.8 * full, omega, phase[0]), _line(0, 0.5 * full, other, phase[1])])
    if kind == "chirp":
        sweep = SWEEP * omega / duration_s
        return np.array([_line(0, full, omega * (1 - 0.5 * SWEEP), phase[0], sweep)])
    if kind == "random":
        lines = omega * np.sort(rng.uniform(0.75, 1.3, NOISE_LINES))
        share = full / math.sqrt(NOISE_LINES)
        return np.array([_line(0, share, one, rng.uniform(0.0, 2.0 * math.pi)) for one in lines])
    steady = _line(0, full, omega, phase[0])
    if kind == "sine":
        return np.array([steady])
    at_start = phase[0] + omega * start_s
    return np.array([steady, [0, -steady[1], omega, at_start, start_s, 1.0 / RISE_S, 0.0]])
