"""How the plant is seen: two cameras with their errors, noise, gaps and outliers, down to `tracks.parquet`."""
from dataclasses import dataclass

import numpy as np
import pandas as pd

SENSOR_PX = (4096, 3072)
WINDOW_PX = (4096, 688)
GROUND_M = np.array([[-0.100, 0.035, 0.0], [0.110, 0.030, 0.0], [0.100, -0.040, 0.0]])
HOST_M = np.array([[0.046359, 0.01873, 0.01], [-0.023474, 0.044147, 0.01], [-0.045315, -0.021131, 0.01],
                   [0.031466, -0.038857, 0.01]])
NES_M = np.array([[0.0, 0.0, 0.01], [0.0061, 0.0003, 0.01], [-0.0008, 0.006, 0.01], [-0.0058, -0.0017, 0.01],
                  [0.0024, -0.0056, 0.01]])
MARKERS = ["G1", "G2", "G3", "H1", "H2", "H3", "H4", "N1", "N2", "N3", "N4", "N5"]


@dataclass(frozen=True)
class View:
    """A pinhole camera with radial (k1, k2) and tangential (p1, p2) distortion; points map as OpenCV's do."""
    name: str
    focal_px: np.ndarray
    centre_px: np.ndarray
    distortion: np.ndarray
    rotation: np.ndarray
    translation_m: np.ndarray
    window_offset_px: tuple[int, int]

    def pixels(self, points_m: np.ndarray) -> np.ndarray:
        """Full-sensor pixels (..., 2) of world points (..., 3)."""
        seen = points_m @ self.rotation.T + self.translation_m
        x, y = seen[..., 0] / seen[..., 2], seen[..., 1] / seen[..., 2]
        k1, k2, p1, p2, k3 = self.distortion
        r2 = x * x + y * y
        radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
        bent = np.stack([x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
                         y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y], axis=-1)
        return bent * self.focal_px + self.centre_px


def draw_views(rng: np.random.Generator) -> list[View]:
    """Two cameras 0.45 m to either side and 1.155 m above the rig, aimed within some millimetres of its middle."""
    views = []
    for name, side in (("VW1", -1.0), ("VW2", 1.0)):
        place = np.array([side * 0.452, 0.0, 1.155]) + rng.normal(0.0, [0.010, 0.018, 0.018])
        forward = rng.normal(0.0, [0.003, 0.003, 0.0]) - place
        forward /= np.linalg.norm(forward)
        right = np.cross(forward, [0.0, 1.0, 0.0])
        right /= np.linalg.norm(right)
        rotation = np.stack([right, np.cross(forward, right), forward])
        focal = rng.normal(6365.0, 9.0)
        views.append(View(name, np.array([focal, focal + rng.normal(0.0, 1.0)]), rng.normal([2046.0, 1535.0], [7.0, 8.0]),
                          np.array([rng.normal(-0.058, 0.009), 0.1, *rng.normal(0.0, 2.3e-4, 2), 0.0]), rotation,
                          -rotation @ place, (0, int(rng.normal(1192.0, 20.0)))))
    return views


@dataclass(frozen=True)
class ViewErrors:
    """Systematic errors of the measurement; the defaults are none."""
    clock_s: float = 0.0                                  # the second camera sees the world this much later
    window_px: tuple[float, float] = (0.0, 0.0)           # the window was this far from where it is said to be ...
    window_camera: int = 0                                # ... in this camera
    scale: float = 1.0                                    # lengths come out this much too long
    rate_ratio: float = 1.0                               # true frame rate over the nominal one
    plane_rad: tuple[float, float] = (0.0, 0.0)           # sliding plane turned about the world's x, then y
    jitter_s: float = 0.0
    centre_marker_offset_m: tuple[float, float] = (0.0, 0.0)
    wobble_px: float = 0.0                                # the first camera sways along u
    wobble_hz: float = 0.0


@dataclass(frozen=True)
class Noise:
    """Marker noise. `kind`: "white", "ar1" (correlated from frame to frame) or "warp" (a lens residual besides white noise)."""
    kind: str
    sd_px: float
    correlation: float
    warp_px: float
    warp_length_px: np.ndarray       # (2,)
    warp_phase_rad: np.ndarray       # camera, coordinate, axis
    missing: float = 0.008
    gaps_per_run: float = 5.0
    outliers: float = 0.001
    outlier_px: float = 3.0


def draw_noise(kind: str, rng: np.random.Generator) -> Noise:
    """Noise of the practice series: 0.05 to 0.36 px, most near 0.11."""
    sd = float(np.clip(0.11 * np.exp(rng.normal(0.0, 0.5)), 0.05, 0.36))
    return Noise(kind, sd, rng.uniform(0.5, 0.7) if kind == "ar1" else 0.0, rng.uniform(0.2, 0.3) if kind == "warp" else 0.0,
                 rng.uniform([170.0, 135.0], [230.0, 185.0]), rng.uniform(0.0, 2.0 * np.pi, (2, 2, 2)))


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
    return np.stack([centre_m[:, :1] + cosine * x - sine * y, centre_m[:, 1:2] + sine * x + cosine * y,
                     np.broadcast_to(centre_m[:, 2:3] + layout_m[:, 2], (len(angle_rad), len(layout_m)))], axis=-1)


def world_points(nes: np.ndarray, host: np.ndarray, marks: Marks, errors: ViewErrors) -> np.ndarray:
    """Points (frames, 12, 3) in the calibration's world. `nes` (n, 4): middle x, y, z and angle; `host` (n, 4): x, y, rotation, z."""
    frames = len(nes)
    ground = np.broadcast_to(GROUND_M, (frames, 3, 3))
    host_points = _turned(marks.host_m, host[:, 2], host[:, [0, 1, 3]])
    nes_points = _turned(marks.nes_m, nes[:, 3], nes[:, :3])
    points = np.concatenate([ground, host_points, nes_points], axis=1)
    a, b = errors.plane_rad
    about_x = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    about_y = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
    return errors.scale * points @ (about_y @ about_x).T


def _noise(shape: tuple[int, ...], noise: Noise, rng: np.random.Generator) -> np.ndarray:
    fresh = rng.normal(0.0, noise.sd_px, shape)
    if noise.kind == "ar1":
        for i in range(1, shape[0]):
            fresh[i] = noise.correlation * fresh[i - 1] + np.sqrt(1.0 - noise.correlation**2) * fresh[i]
    return fresh


def tracks_of(points_m: list[np.ndarray], true_time_s: list[np.ndarray], frame_rate_hz: float, views: list[View],
              errors: ViewErrors, noise: Noise, rng: np.random.Generator) -> pd.DataFrame:
    """`tracks` of one run. `points_m` and `true_time_s`: per camera (frames, 12, 3) and (frames,)."""
    parts = []
    for index, view in enumerate(views):
        pixels = view.pixels(points_m[index])
        frames = len(pixels)
        if noise.kind == "warp":
            u, v = pixels[..., 0] / noise.warp_length_px[0], pixels[..., 1] / noise.warp_length_px[1]
            phase = noise.warp_phase_rad[index]
            pixels = pixels + noise.warp_px * np.stack([np.sin(u + q[0]) * np.sin(v + q[1]) for q in phase], axis=-1)
        if index == 0:
            pixels[..., 0] += errors.wobble_px * np.sin(2 * np.pi * errors.wobble_hz * true_time_s[0])[:, None]
        pixels = pixels + _noise(pixels.shape, noise, rng)
        stray = rng.random(pixels.shape[:2]) < noise.outliers
        pixels[..., 0] += stray * rng.normal(0.0, noise.outlier_px, stray.shape)
        pixels -= view.window_offset_px
        if errors.window_camera == index:
            pixels -= errors.window_px
        seen = rng.random(pixels.shape[:2]) > noise.missing
        seen &= np.all((pixels > 0) & (pixels < np.array(WINDOW_PX) - 1), axis=-1)
        for _ in range(rng.poisson(0.5 * noise.gaps_per_run)):
            start = rng.integers(frames)
            seen[start: start + rng.integers(5, 41), rng.integers(len(MARKERS))] = False
        frame, marker = np.nonzero(seen)
        parts.append(pd.DataFrame({
            "camera": view.name, "frame": frame.astype(np.int32), "time_s": frame / frame_rate_hz,
            "marker": np.array(MARKERS, dtype=object)[marker], "u_px": pixels[frame, marker, 0],
            "v_px": pixels[frame, marker, 1], "sd_px": noise.sd_px}))
    return pd.concat(parts, ignore_index=True).sort_values(["frame", "camera", "marker"], ignore_index=True)
