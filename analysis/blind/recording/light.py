"""What light does to the markers' centres in a picture: a reflection, a pane, a lid, tails, glints, other markers,
shade and shadow."""

import numpy as np

from analysis.blind.plant.compiled import Floats
from analysis.blind.recording.errors import ViewErrors
from analysis.blind.recording.views import DISK, HOST, View

GLARE_M = 0.008  # from a lamp's reflection to where it displaces markers most
BLOOM_PX = 45.0  # from one of the Host's markers to where it displaces the disk's most: 9 mm
SHADE_FROM_M = 0.012  # towards the lamp from the Host's middle, where the wall's shade begins
SHADE_M = 0.02  # from there to where it is full
RING_M = 0.05  # radius of the ring, whose wall throws a shadow
SHADOW_M = 0.01  # from the wall, within which it reaches


def lit(
    pixels: np.ndarray, points_m: np.ndarray, index: int, view: View, frame_rate_hz: float, errors: ViewErrors
) -> np.ndarray:
    """Pixels (frames, markers, 2) of camera `index` with all of it; `points_m` (frames, markers, 3)."""
    pixels = through_lid(glared(pixels, index, view, errors), index, view, errors)
    pixels = glinted(trailed(pixels, frame_rate_hz, errors), points_m, index, errors)
    return bloomed(shaded(pixels, points_m, view, errors), errors)


def glared(pixels: np.ndarray, index: int, view: View, errors: ViewErrors) -> np.ndarray:
    """Pixels (frames, markers, 2) of one camera, those near a lamp's reflection drawn towards it, by `glare_px` at most
    (`GLARE_M` from it)."""
    if errors.glare_px == 0.0 or errors.glare_camera != index:
        return pixels
    at = np.array([*errors.glare_m, 0.01])  # as high as the markers
    spot, beside = view.pixels(np.array([at, at + [GLARE_M, 0.0, 0.0]]))
    away = (pixels - spot) / np.hypot(*(beside - spot))
    pull = np.exp(0.5 - 0.5 * np.sum(away**2, axis=-1, keepdims=True))
    return pixels - errors.glare_px * pull * away


def through_lid(pixels: np.ndarray, index: int, view: View, errors: ViewErrors) -> np.ndarray:
    """Pixels (frames, markers, 2) of one camera, those beyond the edge of a pane displaced across that edge."""
    if errors.lid_px == 0.0 or errors.lid_camera != index:
        return pixels
    at = np.array([*errors.lid_m, 0.01])  # as high as the markers
    across = 0.01 * np.array([np.cos(errors.lid_rad), np.sin(errors.lid_rad), 0.0])
    edge, beyond = view.pixels(np.array([at, at + across]))
    normal = (beyond - edge) / np.hypot(*(beyond - edge))
    covered = (pixels - edge) @ normal > 0.0
    return pixels + errors.lid_px * covered[..., None] * normal


def trailed(pixels: np.ndarray, frame_rate_hz: float, errors: ViewErrors) -> np.ndarray:
    """Pixels (frames, markers, 2) in which the disk's markers, bright on bare steel, draw tails: they are found where
    they were `comet_s` before, along their own way in the picture."""
    if errors.comet_s == 0.0:
        return pixels
    out = pixels.copy()
    out[:, DISK] -= np.gradient(pixels[:, DISK], axis=0) * frame_rate_hz * errors.comet_s
    return out


def glinted(pixels: np.ndarray, points_m: np.ndarray, index: int, errors: ViewErrors) -> np.ndarray:
    """Pixels (frames, markers, 2) of one camera in which the disk's stickers glint.

    They are of foil and stand up at one edge: as the disk turns, that edge lights up towards the lamp and goes dark
    again, and their centres move to and fro towards it by `glint_px` times the cosine of the disk's angle from
    `glint_rad`.  `points_m` (frames, markers, 3) tells the angle: of the line from N2 to N4.
    """
    if errors.glint_px == 0.0 or errors.glint_camera != index:
        return pixels
    x, y = (points_m[:, DISK[3], i] - points_m[:, DISK[1], i] for i in (0, 1))
    bright = errors.glint_px * np.cos(np.arctan2(y, x) - errors.glint_rad)
    out = pixels.copy()
    out[:, DISK] += bright[:, None, None] * np.array([np.cos(errors.lamp_rad), np.sin(errors.lamp_rad)])
    return out


def shaded(pixels: np.ndarray, points_m: np.ndarray, view: View, errors: ViewErrors) -> np.ndarray:
    """Pixels (frames, markers, 2) of one camera where a low lamp at `shade_rad` leaves a part of the floor in the
    ring's own shade.

    The disk's markers go dark there from the lamp's side on, and their centres move away from it in both cameras: by
    `shade_px` times how deep in the shade they are, from 0 at `SHADE_FROM_M` of the Host's middle to 1 `SHADE_M`
    farther.  `points_m` (frames, markers, 3) tells that; the Host's middle is the mean of its markers.
    """
    if errors.shade_px == 0.0:
        return pixels
    lamp = np.array([np.cos(errors.shade_rad), np.sin(errors.shade_rad)])
    near = (points_m[:, DISK, :2] - points_m[:, HOST, :2].mean(axis=1, keepdims=True)) @ lamp
    deep = np.clip((near - SHADE_FROM_M) / SHADE_M, 0.0, 1.0)
    middle, beside = view.pixels(np.array([[0.0, 0.0, 0.01], [*(-0.01 * lamp), 0.01]]))
    out = pixels.copy()
    out[:, DISK] += errors.shade_px * deep[..., None] * (beside - middle) / np.hypot(*(beside - middle))
    return out


def bloomed(pixels: Floats, errors: ViewErrors) -> Floats:
    """Pixels (frames, markers, 2) of a picture that is exposed too much: the Host's markers bloom, and draw those of
    the disk that come near in the picture, each by at most `bloom_px`, `BLOOM_PX` from it."""
    if errors.bloom_px == 0.0:
        return pixels
    out = pixels.copy()
    for marker in HOST:
        away = (pixels[:, DISK] - pixels[:, marker, None]) / BLOOM_PX
        out[:, DISK] -= errors.bloom_px * np.exp(0.5 - 0.5 * np.sum(away**2, axis=-1, keepdims=True)) * away
    return out


def bulged(points_m: Floats, host: Floats, errors: ViewErrors) -> Floats:
    """Points (n, 12, 3) where the disk's markers are found through a lid on the ring that bulges, and so acts like a
    weak lens: farther from the Host's middle (x, y of `host` (n, 4)) by the share `lid_bulge`."""
    if errors.lid_bulge == 0.0:
        return points_m
    out = points_m.copy()
    out[:, DISK, :2] += errors.lid_bulge * (points_m[:, DISK, :2] - host[:, None, :2])
    return out


def shadowed(points_m: Floats, host: Floats, errors: ViewErrors) -> Floats:
    """Points (n, 12, 3) where the disk's markers are found: near the wall a part of each lies in its shadow, and its
    middle is found too far inwards.

    Towards the Host's centre (x, y of `host` (n, 4)) by `shadow_m` (1 - gap / `SHADOW_M`), gap its way to the wall.
    """
    if errors.shadow_m == 0.0:
        return points_m
    out = points_m.copy()
    away = points_m[:, DISK, :2] - host[:, None, :2]
    radius = np.maximum(np.hypot(away[..., 0], away[..., 1]), 1e-9)
    hidden = np.clip(1.0 - (RING_M - radius) / SHADOW_M, 0.0, 1.0)
    out[:, DISK, :2] -= errors.shadow_m * (hidden / radius)[..., None] * away
    return out
