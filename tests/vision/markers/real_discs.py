"""Discs with what real pictures have and clean renderings lack: paper, rough print, JPEG, sharpening, uneven light,
other edges.

Drawn on a finer grid and averaged over pixels; not a line of it is the estimator's model.
"""

from __future__ import annotations

from functools import cache

import cv2
import numpy as np
from scipy.ndimage import gaussian_filter, gaussian_filter1d

FINE = 6


@cache
def blurring(size, fine, blur_px, truncate):
    """(size fine, size fine): what blurs a row of a grid of ``fine`` places a pixel."""
    return gaussian_filter1d(np.eye(size * fine), blur_px * fine, axis=0, truncate=truncate)


@cache
def pixels(size, fine, blur_px, truncate):
    """(size, size fine): what blurs a row of that grid and averages it over pixels."""
    return blurring(size, fine, blur_px, truncate).reshape(size, fine, -1).mean(1)


def outline(rng, angle, rough_px, arc_px, radius):
    """How far a print's edge lies outside a circle, correlated over an arc."""
    many = 1024
    deviation = gaussian_filter1d(rng.normal(size=many), arc_px / (2 * np.pi * radius) * many, mode="wrap")
    return np.interp(
        angle,
        np.linspace(-np.pi, np.pi, many, endpoint=False),
        rough_px * deviation / deviation.std(),
        period=2 * np.pi,
    )


def picture(
    rng,
    radius=9.0,
    blur=0.85,
    level=190.0,
    contrast=-140.0,
    noise=2.0,
    texture=0.0,
    grain_px=1.5,
    rough=0.0,
    arc_px=2.0,
    light=0.0,
    jpeg=0,
    sharpen=0.0,
    corners=0,
    kind="disc",
    shadow=0.0,
    neighbour_px=0.0,
    motion_px=0.0,
    turn_rad=None,
):
    """A picture uint8, and the disc's centre in it [px].  `corners`: a polygon; `kind`: "disc", "square" or "half";
    `neighbour_px`: gap to another disc; `turn_rad`: of polygon and light, drawn where None.
    """
    size = 2 * int(np.ceil(radius + 12)) + 1
    centre = (size - 1) / 2 + rng.uniform(-0.5, 0.5, 2)
    fine = (np.arange(size * FINE) + 0.5) / FINE - 0.5
    x, y = np.meshgrid(fine - centre[0], fine - centre[1])
    turn = rng.uniform(0, 2 * np.pi) if turn_rad is None else turn_rad
    along, across = x * np.cos(turn) + y * np.sin(turn), y * np.cos(turn) - x * np.sin(turn)
    angle, away, edge = np.arctan2(y, x), np.hypot(x, y), radius
    if corners:
        edge = radius * np.cos(np.pi / corners) / np.cos((angle + turn) % (2 * np.pi / corners) - np.pi / corners)
    if rough:
        edge = edge + outline(rng, angle, rough, arc_px, radius)
    if kind == "square":
        away = np.maximum(np.abs(along), np.abs(across))
    mask = np.clip((edge - away) * FINE + 0.5, 0, 1) * (along > 0 if kind == "half" else 1.0)
    if neighbour_px:
        far = 2 * radius + neighbour_px
        mask = np.maximum(mask, np.clip((radius - np.hypot(along - far, across)) * FINE + 0.5, 0, 1))
    grey = (level + contrast * mask) * (1 + light * along)
    if shadow:
        grey = grey * (1 - shadow / (1 + np.exp(-(across - rng.uniform(-1, 1) * radius) / 0.7)))
    if motion_px:
        grey = blurring(size, FINE, blur, 4) @ grey @ blurring(size, FINE, blur, 4).T
        taps = int(motion_px * FINE) // 2 * 2 + 1
        grey = cv2.filter2D(grey, -1, np.ones((1, taps)) / taps, borderType=cv2.BORDER_REPLICATE)
        grey = grey.reshape(size, FINE, size, FINE).mean((1, 3))
    else:
        seen = pixels(size, FINE, blur, 4)
        grey = seen @ grey @ seen.T
    if texture:
        paper = gaussian_filter(rng.normal(size=grey.shape), grain_px)
        grey = grey + texture * paper / paper.std()
    grey = grey + rng.normal(0, noise, grey.shape)
    if sharpen:
        grey = grey + sharpen * (grey - gaussian_filter(grey, 1.0))
    image = np.clip(np.rint(grey), 0, 255).astype(np.uint8)
    if jpeg:
        image = cv2.imdecode(cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, jpeg])[1], cv2.IMREAD_GRAYSCALE)
    return image, centre
