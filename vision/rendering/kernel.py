"""The renderer's inner loop: flat shapes at known heights, seen along each pixel's own ray.

A scene is a painter's list of layers, far to near.  Each edge is drawn already blurred: the
convolution of a half plane with a Gaussian is a normal distribution of the distance to the edge,
a disc's curvature adds s^2/(2 r) to that distance (mean radial shift of a point moved by an
isotropic normal), and the pixel's own area is integrated by Gauss' two-point rule in one or more cells
per axis (it has the pixel's own variance; equal steps would make every edge too sharp).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vision.compiled import compiled, uncounted

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

DISC, CYLINDER, POLYGON = 0, 1, 2
# Columns of a layer: its kind and body; centre, top and bottom, radius [m] and grey; CLIP: the layer through which it
# is seen (one opening for all), ON: the layer whose outline it shares in part and lies on, each -1 for none; its
# vertices.
KIND, BODY, X, Y, TOP, BOTTOM, RADIUS, GREY, CLIP, FIRST_VERTEX, VERTICES, ON = range(12)
COLUMNS = 12
FIRST_COLUMN, LAST_COLUMN, FIRST_ROW, LAST_ROW = range(4)  # of a layer's bounds
FAR_PX = 1e9  # of an edge that is not there
ABSENT, EDGE, WHOLE = 0, 1, 2  # a layer in a tile: nowhere, perhaps with its edge, everywhere
TILE = 4  # side [px] of the squares in which nothing is drawn anew where no edge is near
_SIGMAS = 6.0  # of the blur beyond which an edge is not seen: 1e-9 of the contrast
_PIXEL_PX = 0.75  # half a pixel's diagonal and a little
_TILE_REACH = 1.5  # sides of a tile between its middle and whatever may matter in it
_GAUSS = 0.28867513459481287  # Gauss' two points: 1 / sqrt(12) from a cell's middle
_LEAST_RADIUS = 0.5  # radii from a disc's centre within which its curvature is held: it has no edge there
_POINT_M = 1e-12  # distance that is none


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
    """Of each layer what it is in a tile (``used``) and in one of its pixels (``near``), (L,): ABSENT, EDGE or WHOLE;
    the distance of its edge (L,) [px]; number of the layer that is the opening, -1 for none.
    """

    used: Ints
    near: Ints
    edges: Array
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


@uncounted
def _edge_px(scene: Scene, optics: Optics, k: int, xn: float, yn: float) -> float:
    """Distance in pixels from a ray to layer k's edge, negative inside (scalar indexing: array views cost more than the
    sums).
    """
    layers, turns, origins, blur_px = scene.layers, scene.turns, scene.origins, optics.blur_px
    body = int(layers[k, BODY])
    dx = turns[body, 0, 0] * xn + turns[body, 0, 1] * yn + turns[body, 0, 2]
    dy = turns[body, 1, 0] * xn + turns[body, 1, 1] * yn + turns[body, 1, 2]
    dz = turns[body, 2, 0] * xn + turns[body, 2, 1] * yn + turns[body, 2, 2]
    t = (layers[k, TOP] - origins[body, 2]) / dz
    px, py = origins[body, 0] + t * dx - layers[k, X], origins[body, 1] + t * dy - layers[k, Y]
    curvature = 0.0
    if layers[k, KIND] == POLYGON:
        distance, nx, ny = _to_polygon(px, py, scene.vertices, int(layers[k, FIRST_VERTEX]), int(layers[k, VERTICES]))
    else:
        if layers[k, KIND] == CYLINDER:  # the ray's path between the two heights, seen from above, is a segment
            t_bottom = (layers[k, BOTTOM] - origins[body, 2]) / dz
            ex, ey = (t_bottom - t) * dx, (t_bottom - t) * dy
            length = ex * ex + ey * ey
            along = 0.0 if length == 0.0 else min(1.0, max(0.0, -(px * ex + py * ey) / length))
            px, py, t = px + along * ex, py + along * ey, t + along * (t_bottom - t)
        r = math.sqrt(px * px + py * py)
        distance = r - layers[k, RADIUS]
        nx, ny = (px / r, py / r) if r > _POINT_M else (1.0, 0.0)
        curvature = 1.0 / max(r, _LEAST_RADIUS * layers[k, RADIUS])
    gx = (
        t
        * (
            nx * (turns[body, 0, 0] - dx * turns[body, 2, 0] / dz)
            + ny * (turns[body, 1, 0] - dy * turns[body, 2, 0] / dz)
        )
        * optics.pixel_x
    )
    gy = (
        t
        * (
            nx * (turns[body, 0, 1] - dx * turns[body, 2, 1] / dz)
            + ny * (turns[body, 1, 1] - dy * turns[body, 2, 1] / dz)
        )
        * optics.pixel_y
    )
    metres_per_px = math.sqrt(gx * gx + gy * gy)
    return distance / metres_per_px + 0.5 * blur_px * blur_px * curvature * metres_per_px


@uncounted
def _coverage(edge_px: float, blur_px: float) -> float:
    scaled = edge_px / blur_px
    if scaled > _SIGMAS:
        return 0.0
    if scaled < -_SIGMAS:
        return 1.0
    return 0.5 * math.erfc(scaled * 0.7071067811865476)


@uncounted
def _colour(scene: Scene, optics: Optics, work: Work, used: Ints, xn: float, yn: float) -> float:
    """Grey along one ray, where each layer is what ``used`` says.  Outlines that coincide are not blended twice: what
    lies in the opening is painted apart and put under it once, and a layer ON another replaces that one's grey by as
    much as it covers."""
    layers, background, blur_px = scene.layers, scene.background, optics.blur_px
    edges, opening = work.edges, work.opening
    for k in range(len(used)):
        if used[k] == EDGE:
            edges[k] = _edge_px(scene, optics, k, xn, yn)
        else:
            edges[k] = FAR_PX if used[k] == ABSENT else -FAR_PX
    outer, inner, open_share = background, background, 0.0
    for k in range(len(used)):
        if k == opening:
            inner, open_share = layers[k, GREY], _coverage(edges[k], blur_px)
        elif used[k] != ABSENT:
            alpha, grey, parent = _coverage(edges[k], blur_px), layers[k, GREY], int(layers[k, ON])
            below = layers[parent, GREY] if parent >= 0 else 0.0
            if layers[k, CLIP] < 0.0:
                painted = parent >= 0 and layers[parent, CLIP] < 0.0
                outer += alpha * (grey - (below if painted else outer))
            inner += alpha * (grey - (below if parent >= 0 else inner))
    return outer + open_share * (inner - outer)


@uncounted
def _place(k: int, samples: int) -> float:
    """Where sub-sample k of an even number lies in the pixel (-0.5..0.5): Gauss' two points in each of samples / 2
    cells.
    """
    cell = k // 2 + 0.5 + (_GAUSS if k % 2 else -_GAUSS)
    return 2.0 * cell / samples - 0.5


@uncounted
def _narrowed(work: Work, reach_px: float, into: Ints) -> bool:
    """Write what each layer is where no edge farther than ``reach_px`` from the last ray matters; whether one does."""
    some = False
    for k in range(len(into)):
        edge = work.edges[k]
        if abs(edge) > reach_px:
            into[k] = ABSENT if edge > 0.0 else WHOLE
        else:
            into[k], some = EDGE, True
    return some


@uncounted
def _pixel(scene: Scene, optics: Optics, work: Work, xn: float, yn: float) -> float:
    """Mean over the pixel's area; one ray is enough where no edge is near, and elsewhere the edges that are."""
    grey, samples = _colour(scene, optics, work, work.used, xn, yn), optics.samples
    if not _narrowed(work, _SIGMAS * optics.blur_px + _PIXEL_PX, work.near):
        return grey
    grey = 0.0
    for a in range(samples):
        for b in range(samples):
            x, y = xn + _place(b, samples) * optics.pixel_x, yn + _place(a, samples) * optics.pixel_y
            grey += _colour(scene, optics, work, work.near, x, y)
    return grey / (samples * samples)


@compiled
def shade(scene: Scene, optics: Optics, patch: Patch) -> Array:
    """Grey values (rows, columns) of one rectangle of the window."""
    layers, bounds_px, xn, yn = scene.layers, scene.bounds_px, patch.xn, patch.yn
    rows, columns = xn.shape
    opening = -1
    for k in range(len(layers)):
        opening = max(opening, int(layers[k, CLIP]))
    out, reach_px = np.empty((rows, columns)), _SIGMAS * optics.blur_px + _TILE_REACH * TILE
    known = np.zeros((2, len(layers)), np.int64)
    work = Work(known[0], known[1], np.empty(len(layers)), opening)
    for top in range(0, rows, TILE):
        for left in range(0, columns, TILE):
            bottom, right = min(rows, top + TILE) - 1, min(columns, left + TILE) - 1
            for k in range(len(layers)):
                within = (
                    bounds_px[k, FIRST_COLUMN] <= patch.first_column + right
                    and patch.first_column + left <= bounds_px[k, LAST_COLUMN]
                    and bounds_px[k, FIRST_ROW] <= patch.first_row + bottom
                    and patch.first_row + top <= bounds_px[k, LAST_ROW]
                )
                work.used[k] = EDGE if within else ABSENT
            i, j = (top + bottom) // 2, (left + right) // 2
            flat = _colour(scene, optics, work, work.used, xn[i, j], yn[i, j])
            if not _narrowed(work, reach_px, work.used):  # no edge reaches into this tile
                out[top : bottom + 1, left : right + 1] = flat
                continue
            for i in range(top, bottom + 1):
                for j in range(left, right + 1):
                    out[i, j] = _pixel(scene, optics, work, xn[i, j], yn[i, j])
    return out
