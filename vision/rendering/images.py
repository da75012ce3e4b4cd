"""Camera frames of the rig with known truth: the images the project tests itself on.

Perspective and lens distortion are exact (each pixel looks along its own ray), edges are blurred and
integrated over the pixel (``vision.rendering.kernel``), motion blur is the mean over poses within the
exposure.  Everything random comes from the generator that is handed in.

    view = View(camera, window_offset_px=(0, 1192), window_size_px=(4096, 688))
    image, truth = render_frame(view, rig, [{"host": Pose(), "nes": Pose(0.02, 0.01)}], rng=rng)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.interpolate import RectBivariateSpline

from ovines.camera import Camera
from ovines.errors import InputError
from vision.rendering import kernel
from vision.rendering.scene import BODIES, Greys, Markers, Pose, Rig, layers_of, visible_share

__all__ = ["Band", "Glare", "Greys", "Look", "Markers", "Pose", "Rig", "View", "render_frame", "truth_of"]
Array = NDArray[np.float64]
SPLINE_PX = 16  # between a lens' spline's knots: it is smooth (error < 1e-9)
_LEAST_KNOTS = 8  # per axis
_CELL_BLURS, _MOST_CELLS = 0.5, 4  # cells of a pixel: no wider than two blurs, and at most so many per axis
# Room about a layer for its blurred edge: blurs, and pixels.
_MARGIN_BLURS, _MARGIN_PX = 7, 2
_STEEPEST = 50  # exponent beyond which a band's edge is flat


@dataclass(frozen=True)
class Band:
    """A shadow across the window: the light falls by ``depth`` (0..1) within ``width_px`` about a line.

    The line stands ``position_px`` from the window's top-left pixel along the direction ``angle_rad`` (0: a
    vertical shadow at that column); its edges are logistic with ``softness_px``.
    """

    position_px: float
    width_px: float
    depth: float
    angle_rad: float = 0.0
    softness_px: float = 10.0


@dataclass(frozen=True)
class Glare:
    """A Gaussian highlight added at a window pixel: ``level`` greys at its peak, sd ``radius_px``."""

    u_px: float
    v_px: float
    radius_px: float
    level: float


@dataclass(frozen=True)
class Look:
    """Optics, light and noise.

    ``blur_px``: sd of the lens' Gaussian blur, before the pixel's own area; ``gradient``: relative change of the
    light from one side of the window to the other (x, y); ``noise_grey``: sd per pixel.
    """

    blur_px: float = 0.8
    noise_grey: float = 2.0
    gain: float = 1.0
    gradient: tuple[float, float] = (0.0, 0.0)
    bands: tuple[Band, ...] = ()
    glares: tuple[Glare, ...] = ()


@dataclass(frozen=True, eq=False)
class View:
    """A camera and the window of its sensor that is kept; remembers each pixel's ray."""

    camera: Camera
    window_offset_px: tuple[int, int] = (0, 0)
    window_size_px: tuple[int, int] | None = None

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height of the window [px]."""
        return self.window_size_px or self.camera.sensor_size_px

    @cached_property
    def _splines(self) -> tuple[RectBivariateSpline, RectBivariateSpline]:
        """x/z and y/z over the window.  Cubic splines through every SPLINE_PX-th pixel."""
        width, height = self.size_px
        u, v = (np.linspace(-SPLINE_PX, n + SPLINE_PX, max(_LEAST_KNOTS, n // SPLINE_PX + 3)) for n in (width, height))
        grid = np.stack(np.meshgrid(u, v), -1) + self.window_offset_px
        xy = self.camera.normalise(grid)
        if not np.isfinite(xy).all():
            raise InputError(
                f"camera {self.camera.name}: distortion cannot be undone everywhere in the window",
                "a distortion polynomial that rises monotonically over the window",
                "use weaker distortion",
            )
        return RectBivariateSpline(v, u, xy[..., 0]), RectBivariateSpline(v, u, xy[..., 1])

    def normalised(self, columns: tuple[int, int], rows: tuple[int, int]) -> tuple[Array, Array]:
        """Undistorted x/z, y/z of a rectangle's pixel centres (last ones included), each (rows, columns)."""
        u, v = np.arange(columns[0], columns[1] + 1.0), np.arange(rows[0], rows[1] + 1.0)
        x, y = self._splines
        return np.ascontiguousarray(x(v, u)), np.ascontiguousarray(y(v, u))


def render_frame(
    view: View,
    rig: Rig,
    poses: Sequence[Mapping[str, Pose]],
    look: Look = Look(),
    rng: np.random.Generator | None = None,
) -> tuple[NDArray[np.uint8], pd.DataFrame]:
    """One frame and where its markers truly are.

    Parameters
    ----------
    view : camera and window
    rig : bodies and markers
    poses : one mapping body -> Pose, or several at equal steps through the exposure (motion blur is their mean;
        steps below one blur width leave no trace).  Missing bodies stand at the origin.
    look : blur, light, noise
    rng : None leaves the noise out

    Returns
    -------
    image : (height, width) uint8, window pixels
    truth : :func:`truth_of` at the middle of the exposure
    """
    instants = [_complete(each) for each in poses]
    width, height = view.size_px
    image = np.full((height, width), rig.greys.background)
    scenes = [_scene(view, rig, each, look.blur_px) for each in instants]
    for columns, rows in _regions(scenes[0].layers, [scene.bounds_px for scene in scenes], (width, height)):
        patch = kernel.Patch(*view.normalised(columns, rows), columns[0], rows[0])
        total = np.zeros(patch.xn.shape)
        for scene in scenes:
            total += _shade(scene, look.blur_px, patch, view.camera)
        image[rows[0] : rows[1] + 1, columns[0] : columns[1] + 1] = total / len(scenes)
    return finish(image, look, rng), truth_of(view, rig, _middle(instants))


def finish(image: Array, look: Look, rng: np.random.Generator | None) -> NDArray[np.uint8]:
    """Light, glare, noise and rounding to eight bits."""
    rows, columns = image.shape
    light, added = light_field(look, columns, rows)
    image = image * light
    image += added
    if rng is not None and look.noise_grey > 0:
        noise = rng.standard_normal(image.shape, dtype=np.float32)
        noise *= look.noise_grey
        image += noise
    np.clip(np.rint(image, out=image), 0, 255, out=image)
    return image.astype(np.uint8)


def light_field(look: Look, columns: int, rows: int) -> tuple[Array, Array]:
    """What multiplies each pixel and what is added to it, broadcastable to (rows, columns)."""
    u, v = np.arange(columns)[None, :], np.arange(rows)[:, None]
    light = np.ones((1, 1))
    for change, along in zip(look.gradient, (u / columns - 0.5, v / rows - 0.5), strict=True):
        if change:  # even light stays one number
            light = light + change * along
    light = look.gain * light
    for band in look.bands:
        along = u * np.cos(band.angle_rad) + v * np.sin(band.angle_rad) - band.position_px
        beyond = (np.abs(along) - 0.5 * band.width_px) / band.softness_px
        light = light * (1 - band.depth / (1 + np.exp(np.clip(beyond, -_STEEPEST, _STEEPEST))))
    added = np.zeros((1, 1))
    for glare in look.glares:
        added = added + glare.level * np.exp(
            -0.5 * ((u - glare.u_px) ** 2 + (v - glare.v_px) ** 2) / glare.radius_px**2
        )
    return light, added


def truth_of(view: View, rig: Rig, poses: Mapping[str, Pose]) -> pd.DataFrame:
    """True centres of all markers: ``body``, ``marker``, ``u_px``, ``v_px`` (window), ``x_m``, ``y_m``, ``z_m``,
    ``visible``.

    ``visible`` is the share of the disc in the window that the Host's wall does not hide, 0 to 1.
    """
    rows = []
    width, height = view.size_px
    for body, markers in rig.markers.items():
        world = poses[body].place(markers.layout_m)
        for i, (name, point) in enumerate(zip(markers.names, world, strict=True)):
            u, v = view.camera.project(point) - view.window_offset_px
            within = -0.5 <= u <= width - 0.5 and -0.5 <= v <= height - 0.5
            rows.append((body, name, u, v, *point, visible_share(view.camera, rig, poses, body, i) if within else 0.0))
    return pd.DataFrame(rows, columns=["body", "marker", "u_px", "v_px", "x_m", "y_m", "z_m", "visible"])


def _complete(poses: Mapping[str, Pose]) -> dict[str, Pose]:
    unknown = set(poses) - set(BODIES)
    if unknown:
        raise ValueError(f"unknown bodies {sorted(unknown)}; known: {BODIES}")
    return {body: poses.get(body, Pose()) for body in BODIES}


def _middle(scenes: Sequence[Mapping[str, Pose]]) -> Mapping[str, Pose]:
    """The pose at mid-exposure: the middle one, or the mean of the two about it."""
    if len(scenes) % 2:
        return scenes[len(scenes) // 2]
    before, after = scenes[len(scenes) // 2 - 1], scenes[len(scenes) // 2]
    fields = Pose.__dataclass_fields__
    return {
        body: Pose(**{name: 0.5 * (getattr(before[body], name) + getattr(after[body], name)) for name in fields})
        for body in BODIES
    }


def _bounds(view: View, outlines: Sequence[Array], blur_px: float) -> NDArray[np.int64]:
    """Window rectangle (kernel.FIRST_COLUMN...) of each layer with room for its blurred edge, (L, 4)."""
    margin = np.ceil(_MARGIN_BLURS * blur_px + _MARGIN_PX)
    rectangles = []
    for outline in outlines:
        uv = view.camera.project(outline) - view.window_offset_px
        low, high = np.floor(uv.min(0) - margin), np.ceil(uv.max(0) + margin)
        rectangles.append((low[0], high[0], low[1], high[1]))
    return np.asarray(rectangles).reshape(-1, 4).astype(np.int64)


def _regions(layers: Array, bounds: Sequence[NDArray[np.int64]], size_px: tuple[int, int]) -> list[Any]:
    """Rectangles to draw: one for each ground marker, one for Host and NES together; clipped to the window."""
    every = np.stack(bounds)
    firsts, lasts = every.min(0), every.max(0)
    spans = np.where(np.isin(np.arange(4), (kernel.FIRST_COLUMN, kernel.FIRST_ROW)), firsts, lasts)
    ground = layers[:, kernel.BODY] == BODIES.index("ground")
    groups = [spans[[k]] for k in np.flatnonzero(ground)] + ([spans[~ground]] if (~ground).any() else [])
    regions = []
    for group in groups:
        columns = (
            max(0, int(group[:, kernel.FIRST_COLUMN].min())),
            min(size_px[0] - 1, int(group[:, kernel.LAST_COLUMN].max())),
        )
        rows = max(0, int(group[:, kernel.FIRST_ROW].min())), min(size_px[1] - 1, int(group[:, kernel.LAST_ROW].max()))
        if columns[0] <= columns[1] and rows[0] <= rows[1]:
            regions.append((columns, rows))
    return regions


def _shade(scene: kernel.Scene, blur_px: float, patch: kernel.Patch, camera: Camera) -> Array:
    """Grey values of one rectangle; the pixel's size in image coordinates is its mean there."""
    xn, yn = patch.xn, patch.yn
    pixel_x = abs(float(xn[:, -1].mean() - xn[:, 0].mean())) / max(1, xn.shape[1] - 1) or 1 / camera.matrix[0, 0]
    pixel_y = abs(float(yn[-1].mean() - yn[0].mean())) / max(1, yn.shape[0] - 1) or 1 / camera.matrix[1, 1]
    samples = 2 * int(np.clip(np.ceil(_CELL_BLURS / blur_px), 1, _MOST_CELLS))
    return kernel.shade(scene, kernel.Optics(pixel_x, pixel_y, blur_px, samples), patch)


def _scene(view: View, rig: Rig, poses: Mapping[str, Pose], blur_px: float) -> kernel.Scene:
    """What the camera sees of the rig in these poses."""
    layers, vertices, outlines = layers_of(rig, poses)
    camera = view.camera
    turns = np.stack([poses[body].rotation.T @ camera.rotation.T for body in BODIES])
    origins = np.stack([(camera.centre_m - poses[body].position_m) @ poses[body].rotation for body in BODIES])
    return kernel.Scene(layers, _bounds(view, outlines, blur_px), vertices, origins, turns, rig.greys.background)
