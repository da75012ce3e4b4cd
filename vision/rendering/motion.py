"""A motion to render: a driven Host and a NES that bounces in it, from the project's own simulator."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from ovines.core import FloorFriction, Harmonic, Host, ImpactLaw, Nes, Scenario, SimulationResult, simulate
from vision.rendering.scene import Pose

# Of the samples that are interpolated between: at 2 m/s a straight line over 25 us misses a corner by 50 um at most,
# and only in the one sub-step in which an impact falls.
SAMPLE_RATE_HZ = 40_000.0
WALL_M, NES_M = 0.05, 0.01
LEAD_S = 1e-3


def thesis_run(duration_s: float) -> SimulationResult:
    """11 Hz, 8 g, as in the thesis' OVINES3 tests; restitution 0.72, floor friction 0.2 with Farkas' law."""
    amplitude_m = 8 * 9.81 / (2 * np.pi * 11.0) ** 2
    host = Host(radius_m=WALL_M, motion="driven", drive=(Harmonic("x", amplitude_m, 11.0, 0.3),))
    start_x = amplitude_m * np.sin(0.3)
    scenario = Scenario(
        "rendered",
        Nes(NES_M, 0.0246, 0.5),
        host,
        ImpactLaw(0.72, 0.13, 0.49),
        duration_s,
        FloorFriction(0.2),
        (start_x + 0.02, -0.012, 0.3, 0.9, 0.2, 25.0),
        sample_rate_hz=SAMPLE_RATE_HZ,
    )
    return simulate(scenario)


def bouncing(
    duration_s: float, centre_m: tuple[float, float] = (0.02, -0.028)
) -> Callable[[float], Mapping[str, Pose]]:
    """Poses over time, Host swinging about ``centre_m``; times outside the run take its first or last pose.

    Time 0 is LEAD_S into the run: the first frame's exposure begins before it.
    """
    result = thesis_run(duration_s + 0.01)
    time_s, motion = result.time_s, result.motion

    def at(t: float) -> Mapping[str, Pose]:
        x, y, angle, host_x, host_y = (
            float(np.interp(t + LEAD_S, time_s, motion[key]))
            for key in ("nes_x_m", "nes_y_m", "nes_angle_rad", "host_x_m", "host_y_m")
        )
        return {
            "host": Pose(centre_m[0] + host_x, centre_m[1] + host_y),
            "nes": Pose(centre_m[0] + x, centre_m[1] + y, 0.0, angle),
        }

    return at
