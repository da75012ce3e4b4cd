"""The two cameras of the plant, and the markers that they see."""

from dataclasses import dataclass

import numpy as np

SENSOR_PX = (4096, 3072)
WINDOW_PX = (4096, 688)
GROUND_M = np.array([[-0.100, 0.035, 0.0], [0.110, 0.030, 0.0], [0.100, -0.040, 0.0]])
HOST_M = np.array(
    [
        [0.046359, 0.01873, 0.01],
        [-0.023474, 0.044147, 0.01],
        [-0.045315, -0.021131, 0.01],
        [0.031466, -0.038857, 0.01],
    ]
)
NES_M = np.array(
    [
        [0.0, 0.0, 0.01],
        [0.0061, 0.0003, 0.01],
        [-0.0008, 0.006, 0.01],
        [-0.0058, -0.0017, 0.01],
        [0.0024, -0.0056, 0.01],
    ]
)
MARKERS = ["G1", "G2", "G3", "H1", "H2", "H3", "H4", "N1", "N2", "N3", "N4", "N5"]
HOST = [i for i, marker in enumerate(MARKERS) if marker.startswith("H")]
DISK = [i for i, marker in enumerate(MARKERS) if marker.startswith("N")]


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
    window_size_px: tuple[int, int] = WINDOW_PX

    def pixels(self, points_m: np.ndarray) -> np.ndarray:
        """Full-sensor pixels (..., 2) of world points (..., 3)."""
        seen = points_m @ self.rotation.T + self.translation_m
        x, y = seen[..., 0] / seen[..., 2], seen[..., 1] / seen[..., 2]
        k1, k2, p1, p2, k3 = self.distortion
        r2 = x * x + y * y
        radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
        bent = np.stack(
            [
                x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
                y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y,
            ],
            axis=-1,
        )
        return bent * self.focal_px + self.centre_px


def draw_views(rng: np.random.Generator) -> list[View]:
    """Two cameras 0.45 m to either side and 1.155 m above the rig, aimed within some millimetres of its
    middle."""
    views = []
    for name, side in (("VW1", -1.0), ("VW2", 1.0)):
        place = np.array([side * 0.452, 0.0, 1.155]) + rng.normal(0.0, [0.010, 0.018, 0.018])
        forward = rng.normal(0.0, [0.003, 0.003, 0.0]) - place
        forward /= np.linalg.norm(forward)
        right = np.cross(forward, [0.0, 1.0, 0.0])
        right /= np.linalg.norm(right)
        rotation = np.stack([right, np.cross(forward, right), forward])
        focal = rng.normal(6365.0, 9.0)
        views.append(
            View(
                name,
                np.array([focal, focal + rng.normal(0.0, 1.0)]),
                rng.normal([2046.0, 1535.0], [7.0, 8.0]),
                np.array([rng.normal(-0.058, 0.009), 0.1, *rng.normal(0.0, 2.3e-4, 2), 0.0]),
                rotation,
                -rotation @ place,
                (0, int(rng.normal(1192.0, 20.0))),
            )
        )
    return views
