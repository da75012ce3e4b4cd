"""From pixels to the sds of a body's pose: a marker's centre, its point in the plane, the body that carries it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ovines.camera import Camera
from ovines.errors import InputError
from ovines.recording import Recording
from ovines.recording_schema import Body

Array = NDArray[np.float64]
# A disc's centre: the Cramer-Rao bound 1.062 (sd of a grey level / contrast) sqrt(blur / radius), and by how much the
# tracker misses it (benchmarks/tracking/centre.py); grey levels, contrast and blur as in the films of
# docs/how-to/plan.md.
BOUND, OF_THE_BOUND = 1.062, 1.15
GREY_SD, CONTRAST, BLUR_PX = 2.0, 150.0, 1.0
SMALLEST_MARKER_PX, LARGEST_MARKER_PX = 2.5, 200.0  # below, centres are less exact than their sds (vision/markers)
# Two cameras without a calibration: on opposite sides, each leaning so far from the vertical; the window's shorter side
# sees the Host and what it moves to either side of its middle (the thesis' window: 1.3 of its Host).
LEAN_RAD, SEEN_OF_THE_HOST = np.deg2rad(40.0), 1.3
# Markers of a body that names none, or gives no places: as many as the advice has, at this share of its radius.
MARKERS, PLACED_AT = {"nes": 5, "host": 4}, 0.6


@dataclass(frozen=True)
class PoseNoise:
    """Sds of places (x, y; m) and angles (rad) of disk and Host in one frame."""

    nes_m: tuple[float, float]
    nes_rad: float
    host_m: tuple[float, float]
    host_rad: float

    def times(self, factor: float) -> PoseNoise:
        """The same, ``factor`` times as large."""
        nes, host = ((factor * x, factor * y) for x, y in (self.nes_m, self.host_m))
        return PoseNoise(nes, factor * self.nes_rad, host, factor * self.host_rad)


def noise_of_marker_px(radius_px: float) -> float:
    """Sd of a disc's centre (px) from its radius in the picture (px), in even light."""
    if not SMALLEST_MARKER_PX <= radius_px <= LARGEST_MARKER_PX:
        raise InputError(
            f"a marker of {radius_px:g} px radius",
            f"{SMALLEST_MARKER_PX} to {LARGEST_MARKER_PX:g} px in the picture",
            "take a larger marker or a closer view; or give --noise-px",
        )
    return float(OF_THE_BOUND * BOUND * GREY_SD / CONTRAST * np.sqrt(BLUR_PX / radius_px))


def pose_noise(
    recording: Recording, cameras: Sequence[Camera] | None, noise_px: float, px_per_m: float | None
) -> tuple[PoseNoise, list[str]]:
    """Sds of the poses, and what had to be assumed; ``px_per_m`` where no calibration says the scale."""
    assumed: list[str] = []
    if cameras is not None:
        marker = _seen_by(cameras, noise_px)
    else:
        if px_per_m is None:
            px_per_m = _guessed_scale(recording)
            assumed.append(
                f"scale {px_per_m / 1e3:.3g} px/mm: the window's shorter side sees {SEEN_OF_THE_HOST} of the Host"
            )
        assumed.append(f"two cameras that lean {np.rad2deg(LEAN_RAD):.0f} degrees to either side")
        one = noise_px / (px_per_m * np.sqrt(2.0))
        marker = (one / float(np.cos(LEAN_RAD)), one)
    found = {}
    for name in ("nes", "host"):
        body = recording.bodies[name]
        places, assumptions = _places(name, body, recording)
        assumed += assumptions
        about = places - places.mean(axis=0)
        spread = float(np.sum(about**2))
        mean = float(np.sqrt(np.mean(np.square(marker))))
        x, y = (sd / np.sqrt(len(places)) for sd in marker)
        found[name] = ((x, y), mean / np.sqrt(spread) if spread > 0.0 else np.nan)
    return PoseNoise(*found["nes"], *found["host"]), assumed


def _seen_by(cameras: Sequence[Camera], noise_px: float) -> tuple[float, float]:
    """Sds of a marker's x and y at the world's origin from all cameras together."""
    jacobians = [camera.project_with_jacobian(np.zeros(3))[1] for camera in cameras]
    rows = np.concatenate(jacobians)[:, : 3 if len(cameras) > 1 else 2]  # one camera alone knows the height
    if not np.isfinite(rows).all() or np.linalg.matrix_rank(rows) < rows.shape[1]:
        raise InputError(
            "cameras that do not see the world's origin",
            "a calibration in whose world the rig stands",
            "correct [calibration] file",
        )
    sd = noise_px * np.sqrt(np.diag(np.linalg.inv(rows.T @ rows)))
    return float(sd[0]), float(sd[1])


def _guessed_scale(recording: Recording) -> float:
    host = recording.settings.bodies.host
    assert host is not None  # a plan has a wall
    across = 2.0 * (host.inner_radius_m or max(np.hypot(*corner) for corner in host.polygon_m or ()))
    if not recording.cameras:
        raise InputError(
            "no [[cameras]] and no scale", "a window, a calibration, or --px-per-mm", "give --px-per-mm, or add cameras"
        )
    return min(min(camera.window_px) for camera in recording.cameras) / (SEEN_OF_THE_HOST * across)


def _places(name: str, body: Body, recording: Recording) -> tuple[Array, list[str]]:
    """Where a body's markers sit (n, 2), and what had to be assumed."""
    if body.layout_m:
        return np.asarray(body.layout_m, float)[:, :2], []
    bodies = recording.settings.bodies
    assert bodies.host is not None and bodies.nes is not None
    size = bodies.nes.radius_m
    if name == "host":
        size = bodies.host.inner_radius_m or min(float(np.hypot(*corner)) for corner in bodies.host.polygon_m or ())
    count = len(body.markers) or MARKERS[name]
    angle = 2.0 * np.pi * np.arange(count) / count
    title = {"nes": "NES", "host": "Host"}[name]
    assumption = f"{count} markers of the {title} at {PLACED_AT} of its radius"
    return PLACED_AT * size * np.column_stack([np.cos(angle), np.sin(angle)]), [assumption]
