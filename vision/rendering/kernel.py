"""The renderer's inner loop: flat shapes at known heights, seen along each pixel's own ray.

A scene is a painter's list of layers, far to near.  Each edge is drawn already blurred: the
convolution of a half plane with a Gaussian is a normal distribution of the distance to the edge,
a disc's curvature adds s^2/(2 r) to that distance (mean radial shift of a point moved by an
isotropic normal), and the pixel's own area is integrated by Gauss' two-point rule in one or more cells
per axis (it has the pixel's own variance; equal steps would make every edge too sharp).

The window is drawn in small tiles.  One ray through its middle tells which layers a tile lacks, which
cover it and which have an edge there; only for the last is anything computed along more rays, layer by layer for all
rays of the tile, in loops that a processor does several steps of at once.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vision.compiled import compiled, compiled_fast, uncounted

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

DISC, CYLINDER, POLYGON = 0, 1, 2
# Columns of a layer: its kind and body; centre, top and bottom, radius [m] and grey; CLIP: the layer through which it
# is seen (one opening for all), ON: the layer whose outline it shares in part and lies on, each -1 for none; its
# vertices.
KIND, BODY, X, Y, TOP, BOTTOM, RADIUS, GREY, CLIP, FIRST_VERTEX, VERTICES, ON = range(12)
COLUMNS = 12
FIRST_COLUMN, LAST_COLUMN, FIRST_ROW, LAST_ROW = range(4)  # of a layer's bounds
ABSENT, EDGE, WHOLE = 0, 1, 2  # a layer along the rays at hand: nowhere, perhaps with its edge, everywhere
# Rows of the rays (xn, yn, 1): where each goes per metre of height in a body's frame, what a pixel's step right or down
# adds to that; the grey outside the opening and in it, and how much of it the opening lets through.
XN, YN, ACROSS, ALONG, ACROSS_RIGHT, ALONG_RIGHT, ACROSS_DOWN, ALONG_DOWN, OUTER, INNER, OPEN = range(11)
RAYS = 11
TILE = 4  # side [px]
_SIGMAS = 5.0  # of the blur beyond which an edge is not seen: 3e-7 of the contrast
_TILE_REACH = 1.15  # sides of a tile between its middle and whatever may matter in it
_GAUSS = 0.28867513459481287  # Gauss' two points: 1 / sqrt(12) from a cell's middle
_LEAST_RADIUS = 0.5  # radii from a disc's centre within which its curvature is held: it has no edge there
_POINT_M = 1e-12  # distance that is none
_NOTHING = 1e-300  # keeps a division from nothing by nothing
_STEPS = 32  # per sd, of the table of the normal distribution


def _normal_table() -> tuple[Array, Array]:
    """The normal distribution's upper tail and density at every step from -_SIGMAS on; beyond both ends it is flat."""
    x = np.arange(-_SIGMAS * _STEPS, _SIGMAS * _STEPS + 1) / _STEPS
    tail = np.array([0.5 * math.erfc(each / math.sqrt(2.0)) for each in x])
    density = np.exp(-0.5 * x**2) / math.sqrt(2.0 * math.pi)
    tail[0], tail[-1], density[0], density[-1] = 1.0, 0.0, 0.0, 0.0
    return tail, density


_TAIL, _DENSITY = _normal_table()


class Scene(NamedTuple):
    """What is drawn: ``layers`` (L, COLUMNS), far to near; ``bounds_px`` (L, 4) of the window outside which each covers
    nothing; ``vertices`` (V, 2) of polygons; ``origins`` (B, 3), ``turns`` (B, 3, 3): the camera's centre and the map
    (xn, yn, 1) -> ray in each body's frame; ``background`` grey.
    """

    layers: Array
    bounds_px: Ints
    vertices: Array
    origins: Array
    turns: Array
    background: float


class Patch(NamedTuple):
    """A rectangle of the window: undistorted image coordinates ``xn``, ``yn`` (rows, columns) of its pixels' centres,
    and where it lies in the window.
    """

    xn: Array
    yn: Array
    first_column: int
    first_row: int


class Optics(NamedTuple):
    """Size of a pixel in undistorted image coordinates, sd of the blur, sub-samples per pixel and axis where an edge is
    near (an even number).
    """

    pixel_x: float
    pixel_y: float
    blur_px: float
    samples: int


class Work(NamedTuple):
    """What N rays need: ``rays`` (RAYS, N), ``edges`` (L, N) distance of each layer's edge [px], ``share`` (N,) that
    the layer at hand covers, ``state`` (L,) of each layer: ABSENT, EDGE or WHOLE; number of the layer that is the
    opening, -1 for none.
    """

    rays: Array
    edges: Array
    share: Array
    state: Ints
    opening: int


@uncounted
def _to_polygon(px: float, py: float, vertices: Array, first: int, count: int) -> tuple[float, float, float]:
    """Signed distance (negative inside) to a polygon and the outward unit direction of its growth."""
    best, nx, ny, inside = 1e300, 1.0, 0.0, False
    for i in range(count):
        ax, ay = vertices[first + i, 0], vertices[first + i, 1]
        j = first + (i + 1) % count
        bx, by = vertices[j, 0], vertices[j, 1]
        ex, ey, wx, wy = bx - ax, by - ay, px - ax, py - ay
        along = min(1.0, max(0.0, (wx * ex + wy * ey) / (ex * ex + ey * ey)))
        qx, qy = wx - along * ex, wy - along * ey
        squared = qx * qx + qy * qy
        if squared < best:
            best, nx, ny = squared, qx, qy
        if (ay > py) != (by > py) and px < ax + (py - ay) / (by - ay) * ex:
            inside = not inside
    distance = math.sqrt(best)
    if distance < _POINT_M:
        return 0.0, 1.0, 0.0
    sign = -1.0 if inside else 1.0
    return sign * distance, sign * nx / distance, sign * ny / distance


@compiled_fast
def _look(scene: Scene, optics: Optics, body: int, rays: Array, count: int) -> None:
    """Write where the first ``count`` rays go in that body's frame."""
    a, b, c = scene.turns[body, 0, 0], scene.turns[body, 0, 1], scene.turns[body, 0, 2]
    d, e, f = scene.turns[body, 1, 0], scene.turns[body, 1, 1], scene.turns[body, 1, 2]
    g, h, i = scene.turns[body, 2, 0], scene.turns[body, 2, 1], scene.turns[body, 2, 2]
    pixel_x, pixel_y = optics.pixel_x, optics.pixel_y
    for n in range(count):
        x, y = rays[XN, n], rays[YN, n]
        fall = 1.0 / (g * x + h * y + i)
        across, along = (a * x + b * y + c) * fall, (d * x + e * y + f) * fall
        rays[ACROSS, n], rays[ALONG, n] = across, along
        right, down = fall * pixel_x, fall * pixel_y
        rays[ACROSS_RIGHT, n], rays[ALONG_RIGHT, n] = (a - across * g) * right, (d - along * g) * right
        rays[ACROSS_DOWN, n], rays[ALONG_DOWN, n] = (b - across * h) * down, (e - along * h) * down


@compiled_fast
def _find_edges(scene: Scene, k: int, blur_px: float, rays: Array, edges: Array, count: int) -> None:
    """Write the first ``count`` rays' distances in pixels to layer k's edge, negative inside."""
    layers, body = scene.layers, int(scene.layers[k, BODY])
    top, radius = layers[k, TOP] - scene.origins[body, 2], layers[k, RADIUS]
    x, y = scene.origins[body, 0] - layers[k, X], scene.origins[body, 1] - layers[k, Y]
    if layers[k, KIND] == POLYGON:
        first, vertices = int(layers[k, FIRST_VERTEX]), int(layers[k, VERTICES])
        for n in range(count):
            px, py = x + top * rays[ACROSS, n], y + top * rays[ALONG, n]
            distance, nx, ny = _to_polygon(px, py, scene.vertices, first, vertices)
            gx = nx * rays[ACROSS_RIGHT, n] + ny * rays[ALONG_RIGHT, n]
            gy = nx * rays[ACROSS_DOWN, n] + ny * rays[ALONG_DOWN, n]
            edges[k, n] = distance / (abs(top) * math.sqrt(gx * gx + gy * gy))
        return
    tall = layers[k, BOTTOM] - layers[k, TOP] if layers[k, KIND] == CYLINDER else 0.0
    held, bend = _LEAST_RADIUS * radius, 0.5 * blur_px * blur_px
    for n in range(count):
        # A cylinder's two heights make a segment of the ray, seen from above; a disc's is a point.
        ex, ey = tall * rays[ACROSS, n], tall * rays[ALONG, n]
        px, py = x + top * rays[ACROSS, n], y + top * rays[ALONG, n]
        part = min(1.0, max(0.0, -(px * ex + py * ey) / (ex * ex + ey * ey + _NOTHING)))
        px, py, height = px + part * ex, py + part * ey, top + part * tall
        r = math.sqrt(px * px + py * py) + _NOTHING
        gx = px * rays[ACROSS_RIGHT, n] + py * rays[ALONG_RIGHT, n]
        gy = px * rays[ACROSS_DOWN, n] + py * rays[ALONG_DOWN, n]
        metres_per_px = abs(height) * math.sqrt(gx * gx + gy * gy) / r + _NOTHING
        edges[k, n] = (r - radius) / metres_per_px + bend * metres_per_px / max(r, held)


@compiled_fast
def _cover(edges: Array, k: int, blur_px: float, share: Array, count: int) -> None:
    """Write how much layer k covers: three terms about the table's nearest place, which leave 2e-9."""
    per_px = 1.0 / blur_px  # sd per pixel
    for n in range(count):
        x = min(_SIGMAS, max(-_SIGMAS, edges[k, n] * per_px))
        at = int((x + _SIGMAS) * _STEPS + 0.5)
        near = at / _STEPS - _SIGMAS
        d = x - near
        share[n] = _TAIL[at] - _DENSITY[at] * d * (1.0 - d * (0.5 * near - d * (near * near - 1.0) / 6.0))


@compiled_fast
def _paint(scene: Scene, optics: Optics, work: Work, count: int) -> None:
    """Write the first ``count`` rays' greys, where each layer is in the state that ``work`` says.  Outlines that
    coincide are not blended twice: what lies in the opening is painted apart and put under it once, and a layer ON
    another replaces that one's grey by as much as it covers.
    """
    layers, rays, share, background = scene.layers, work.rays, work.share, scene.background
    seen_by = -1
    for n in range(count):
        rays[OUTER, n], rays[INNER, n], rays[OPEN, n] = background, background, 0.0
    for k in range(len(layers)):
        if work.state[k] == ABSENT:
            continue
        if work.state[k] == EDGE:
            if layers[k, BODY] != seen_by:
                seen_by = int(layers[k, BODY])
                _look(scene, optics, seen_by, rays, count)
            _find_edges(scene, k, optics.blur_px, rays, work.edges, count)
            _cover(work.edges, k, optics.blur_px, share, count)
        else:
            share[:count] = 1.0
        grey, parent = layers[k, GREY], int(layers[k, ON])
        if k == work.opening:
            for n in range(count):
                rays[INNER, n], rays[OPEN, n] = grey, share[n]
            continue
        if layers[k, CLIP] < 0.0:
            if parent >= 0 and layers[parent, CLIP] < 0.0:
                for n in range(count):
                    rays[OUTER, n] += share[n] * (grey - layers[parent, GREY])
            else:
                for n in range(count):
                    rays[OUTER, n] += share[n] * (grey - rays[OUTER, n])
        if parent >= 0:
            for n in range(count):
                rays[INNER, n] += share[n] * (grey - layers[parent, GREY])
        else:
            for n in range(count):
                rays[INNER, n] += share[n] * (grey - rays[INNER, n])
    for n in range(count):
        rays[OUTER, n] += rays[OPEN, n] * (rays[INNER, n] - rays[OUTER, n])


@uncounted
def _place(k: int, samples: int) -> float:
    """Where sub-sample k of an even number lies in the pixel (-0.5..0.5): Gauss' two points in each of samples / 2
    cells.
    """
    cell = k // 2 + 0.5 + (_GAUSS if k % 2 else -_GAUSS)
    return 2.0 * cell / samples - 0.5


@compiled
def _fill_tile(optics: Optics, work: Work, xn: Array, yn: Array) -> int:
    """Write the rays of all sub-samples of pixels whose centres lie on the rays (xn, yn, 1); how many these are."""
    count = 0
    for i in range(xn.shape[0]):
        for j in range(xn.shape[1]):
            for a in range(optics.samples):
                for b in range(optics.samples):
                    work.rays[XN, count] = xn[i, j] + _place(b, optics.samples) * optics.pixel_x
                    work.rays[YN, count] = yn[i, j] + _place(a, optics.samples) * optics.pixel_y
                    count += 1
    return count


@compiled
def _take_means(work: Work, samples: int, out: Array) -> None:
    """Write each pixel's mean over the sub-samples of its area."""
    count, each = 0, samples * samples
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            grey = 0.0
            for n in range(count, count + each):
                grey += work.rays[OUTER, n]
            out[i, j] = grey / each
            count += each


@compiled
def _work(layers: int, rays: int, opening: int) -> Work:
    return Work(np.empty((RAYS, rays)), np.empty((layers, rays)), np.empty(rays), np.empty(layers, np.int64), opening)


@compiled
def shade(scene: Scene, optics: Optics, patch: Patch) -> Array:
    """Grey values (rows, columns) of one rectangle of the window."""
    bounds_px, xn, yn, layers = scene.bounds_px, patch.xn, patch.yn, len(scene.layers)
    rows, columns = xn.shape
    opening = -1
    for k in range(layers):
        opening = max(opening, int(scene.layers[k, CLIP]))
    tiles, reach_px = (columns + TILE - 1) // TILE, _SIGMAS * optics.blur_px + _TILE_REACH * TILE
    middles, tile = _work(layers, tiles, opening), _work(layers, (TILE * optics.samples) ** 2, opening)
    out = np.empty((rows, columns))
    for top in range(0, rows, TILE):
        bottom = min(rows, top + TILE)
        above, below = patch.first_row + top, patch.first_row + bottom - 1
        for k in range(layers):
            within = bounds_px[k, FIRST_ROW] <= below and above <= bounds_px[k, LAST_ROW]
            middles.state[k] = EDGE if within else ABSENT
        for m in range(tiles):
            i, j = (top + bottom) // 2, (m * TILE + min(columns, (m + 1) * TILE)) // 2
            middles.rays[XN, m], middles.rays[YN, m] = xn[i, j], yn[i, j]
        _paint(scene, optics, middles, tiles)
        for m in range(tiles):
            left, right, some = m * TILE, min(columns, (m + 1) * TILE), False
            for k in range(layers):
                edge = middles.edges[k, m]
                if middles.state[k] == ABSENT or edge > reach_px:
                    tile.state[k] = ABSENT
                elif edge < -reach_px:
                    tile.state[k] = WHOLE
                else:
                    tile.state[k], some = EDGE, True
            if some:
                count = _fill_tile(optics, tile, xn[top:bottom, left:right], yn[top:bottom, left:right])
                _paint(scene, optics, tile, count)
                _take_means(tile, optics.samples, out[top:bottom, left:right])
            else:  # no edge reaches into this tile
                out[top:bottom, left:right] = middles.rays[OUTER, m]
    return out
