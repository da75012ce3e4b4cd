"""The two cameras of the plant and the systematic errors of what they see."""

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


@dataclass(frozen=True)
class ViewErrors:
    """Systematic errors of the measurement; the defaults are none."""

    clock_s: float = 0.0  # the second camera sees the world this much later
    window_px: tuple[float, float] = (0.0, 0.0)  # the window was this far from where it is said to be ...
    window_camera: int = 0  # ... in this camera
    scale: float = 1.0  # lengths come out this much too long
    rate_ratio: float = 1.0  # true frame rate over the nominal one
    plane_rad: tuple[float, float] = (0.0, 0.0)  # sliding plane turned about the world's x, then y
    jitter_s: float = 0.0
    blur_s: float = 0.0  # each body's place and angle scatter by the way (turn) of this time
    centre_marker_offset_m: tuple[float, float] = (0.0, 0.0)
    wobble_px: float = 0.0  # the first camera sways along u
    wobble_hz: float = 0.0
    shutter_s: float = 0.0  # both cameras read their rows one after the other, the window in this time
    creep_px: float = 0.0  # the second camera's picture moves this far along u within a run
    zoom: float = 0.0  # the second camera's picture grows by this share about its centre within a run
    zoom_swing: float = 0.0  # the first camera's picture grows and shrinks by this share about its centre ...
    zoom_swing_hz: float = 0.0  # ... so many times a second
    uneven_s: float = 0.0  # both cameras are late by this much half-way through a run, and on time at its ends
    skipped_frame_share: float = 0.0  # from here on (share of a run) both cameras' frames are numbered one early
    alternate_s: float = 0.0  # both cameras take every other frame this late
    stutter_share: float = 0.0  # of the first camera's frames show the one before once more
    stretched: float = 0.0  # both cameras' pictures are this much too tall, about their centres
    shaken_px: float = 0.0  # the first camera swings along u after each impact, for 1 m/s of the disk's change ...
    shaken_hz: float = 30.0  # ... so many times a second
    glare_px: float = 0.0  # markers near a lamp's reflection are drawn towards it, at most this far, ...
    glare_m: tuple[float, float] = (0.0, 0.0)  # ... where it lies over the rig ...
    glare_camera: int = 0  # ... in this camera's picture
    lid_px: float = 0.0  # markers beyond a pane's edge are displaced across it by this much, ...
    lid_m: tuple[float, float] = (0.0, 0.0)  # ... where the edge lies over the rig ...
    lid_rad: float = 0.0  # ... and looks to ...
    lid_camera: int = 0  # ... in this camera's picture
    grounded_s: float = 0.0  # the second camera is late by this much at 8 g of the Host along x
    free_running: float = 0.0  # the second camera's clock gains this share of the time, and agrees half-way
    tab_m: float = 0.0  # a marker of the Host stays back by this much at 8 g of it ...
    tab_marker: int = 0  # ... this one
    comet_s: float = 0.0  # the disk's markers are found where they were this long before
    glint_px: float = 0.0  # the disk's markers move to and fro by this much as it turns ...
    glint_rad: float = 0.0  # ... the farthest at this angle of it ...
    lamp_rad: float = 0.0  # ... in this direction ...
    glint_camera: int = 0  # ... of this camera's picture
    twisted_rad: float = 0.0  # the first camera is turned about its axis by this much at 8 g of the Host along x
    sync_s: float = 0.0  # the second camera gains this between two pulses that set it right ...
    sync_every_s: float = 0.3  # ... which are this far apart ...
    sync_late_s: float = 0.0  # ... and of which one comes here
    flung_m: float = 0.0  # a sticker of the disk is flung outwards by at most this ...
    flung_marker: int = 1  # ... this one, the middle one being 0
    shade_px: float = 0.0  # the disk's markers move away from a lamp by this much in the ring's full shade ...
    shade_rad: float = 0.0  # ... a lamp that stands there
    shocked_s: float = 0.0  # the second camera is late by this after a blow that changes the disk's velocity by 1 m/s
    blocked_px: float = 0.0  # markers are drawn to the middles of the picture's blocks by at most this
    card_s: float = 0.0  # the disk's markers swing about its middle after a blow, by its change of spin times this ...
    card_hz: float = 40.0  # ... so many times a second
    tripod_px: float = 0.0  # the first camera's picture moves by this much at 8 g of the Host along x ...
    tripod_rad: float = 0.0  # ... in this direction of it ...
    tripod_s: float = 0.0  # ... this much later
    dropped_from: tuple[float, ...] = ()  # of each run: from this share on the second camera's frames are one early
    shadow_m: float = 0.0  # the disk's markers are found this much too far inwards at the wall
    lost_frame_share: float = 0.0  # from here on (share of a run) the second camera's frames are numbered one early
    slipped_m: tuple[float, float] = (0.0, 0.0)  # a NES marker moves by this much half-way through each run
