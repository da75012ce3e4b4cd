"""The renderer's inner loop: flat shapes at known heights, seen along each pixel's own ray.

A scene is a painter's list of layers, far to near.  Each edge is drawn already blurred: the
convolution of a half plane with a Gaussian is a normal distribution of the distance to the edge,
a disc's curvature adds s^2/(2 r) to that distance (mean radial shift of a point moved by an
isotropic normal), and the pixel's own area is integrated by Gauss' two-point rule in one or more cells
per axis (it has the pixel's own variance; equal steps would make every edge too sharp).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from vision.compiled import compiled

Array = NDArray[np.float64]

DISC, CYLINDER, POLYGON = 0, 1, 2
# columns of a layer's row
KIND, BODY, X, Y, TOP, BOTTOM, RADIUS, GREY, CLIP, FIRST_VERTEX, VERTICES, ON = range(12)
COLUMNS = 12
FAR_PX = 1e9
TILE = 8


@compiled
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
    if distance < 1e-12:
        return 0.0, 1.0, 0.0
    sign = -1.0 if inside else 1.0
    return sign * distance, sign * nx / distance, sign * ny / distance


@compiled
def _edge_px(
    layers: Array,
    k: int,
    vertices: Array,
    origins: Array,
    turns: Array,
    xn: float,
    yn: float,
    pixel_x: float,
    pixel_y: float,
    blur_px: float,
) -> float:
    """Distance in pixels from a ray to layer k's edge, negative inside (scalar indexing: array views cost more than the
    sums).
    """
    body = int(layers[k, BODY])
    dx = turns[body, 0, 0] * xn + turns[body, 0, 1] * yn + turns[body, 0, 2]
    dy = turns[body, 1, 0] * xn + turns[body, 1, 1] * yn + turns[body, 1, 2]
    dz = turns[body, 2, 0] * xn + turns[body, 2, 1] * yn + turns[body, 2, 2]
    t = (layers[k, TOP] - origins[body, 2]) / dz
    px, py = origins[body, 0] + t * dx - layers[k, X], origins[body, 1] + t * dy - layers[k, Y]
    curvature = 0.0
    if layers[k, KIND] == POLYGON:
        distance, nx, ny = _to_polygon(px, py, vertices, int(layers[k, FIRST_VERTEX]), int(layers[k, VERTICES]))
    else:
        if layers[k, KIND] == CYLINDER:  # the ray's path between the two heights, seen from above, is a segment
            t_bottom = (layers[k, BOTTOM] - origins[body, 2]) / dz
            ex, ey = (t_bottom - t) * dx, (t_bottom - t) * dy
            length = ex * ex + ey * ey
            along = 0.0 if length == 0.0 else min(1.0, max(0.0, -(px * ex + py * ey) / length))
            px, py, t = px + along * ex, py + along * ey, t + along * (t_bottom - t)
        r = math.sqrt(px * px + py * py)
        distance = r - layers[k, RADIUS]
        nx, ny = (px / r, py / r) if r > 1e-12 else (1.0, 0.0)
        curvature = 1.0 / max(r, 0.5 * layers[k, RADIUS])
    gx = (
        t
        * (
            nx * (turns[body, 0, 0] - dx * turns[body, 2, 0] / dz)
            + ny * (turns[body, 1, 0] - dy * turns[body, 2, 0] / dz)
        )
        * pixel_x
    )
    gy = (
        t
        * (
            nx * (turns[body, 0, 1] - dx * turns[body, 2, 1] / dz)
            + ny * (turns[body, 1, 1] - dy * turns[body, 2, 1] / dz)
        )
        * pixel_y
    )
    metres_per_px = math.sqrt(gx * gx + gy * gy)
    return distance / metres_per_px + 0.5 * blur_px * blur_px * curvature * metres_per_px


@compiled
def _coverage(edge_px: float, blur_px: float) -> float:
    scaled = edge_px / blur_px
    if scaled > 6.0:
        return 0.0
    if scaled < -6.0:
        return 1.0
    return 0.5 * math.erfc(scaled * 0.7071067811865476)


@compiled
def _colour(
    layers: Array,
    used: NDArray[np.int64],
    vertices: Array,
    origins: Array,
    turns: Array,
    xn: float,
    yn: float,
    pixel_x: float,
    pixel_y: float,
    blur_px: float,
    background: float,
    edges: Array,
    opening: int,
) -> float:
    """Grey along one ray.  Outlines that coincide are not blended twice: what lies in the opening is painted apart and
    put under it once, and a layer ON another replaces that one's grey by as much as it covers."""
    for k in range(len(used)):
        if used[k]:
            edges[k] = _edge_px(layers, k, vertices, origins, turns, xn, yn, pixel_x, pixel_y, blur_px)
        else:
            edges[k] = FAR_PX
    outer, inner, open_share = background, background, 0.0
    for k in range(len(used)):
        if k == opening:
            inner, open_share = layers[k, GREY], _coverage(edges[k], blur_px)
        elif used[k]:
            alpha, grey, parent = _coverage(edges[k], blur_px), layers[k, GREY], int(layers[k, ON])
            below = layers[parent, GREY] if parent >= 0 else 0.0
            if layers[k, CLIP] < 0.0:
                painted = parent >= 0 and layers[parent, CLIP] < 0.0
                outer += alpha * (grey - (below if painted else outer))
            inner += alpha * (grey - (below if parent >= 0 else inner))
    return outer + open_share * (inner - outer)


@compiled
def _place(k: int, samples: int) -> float:
    """Where sub-sample k of an even number lies in the pixel (-0.5..0.5): Gauss' two points in each of samples / 2
    cells.
    """
    cell = k // 2 + 0.5 + (0.28867513459481287 if k % 2 else -0.28867513459481287)
    return 2.0 * cell / samples - 0.5


@compiled
def _pixel(
    layers: Array,
    used: NDArray[np.int64],
    vertices: Array,
    origins: Array,
    turns: Array,
    xn: float,
    yn: float,
    pixel_x: float,
    pixel_y: float,
    blur_px: float,
    background: float,
    edges: Array,
    opening: int,
    samples: int,
) -> float:
    """Mean over the pixel's area; one ray is enough where no edge is near."""
    grey = _colour(
        layers, used, vertices, origins, turns, xn, yn, pixel_x, pixel_y, blur_px, background, edges, opening
    )
    nearest = FAR_PX
    for k in range(len(used)):
        nearest = min(nearest, abs(edges[k]))
    if nearest > 6.0 * blur_px + 0.75:
        return grey
    grey = 0.0
    for a in range(samples):
        for b in range(samples):
            grey += _colour(
                layers,
                used,
                vertices,
                origins,
                turns,
                xn + _place(b, samples) * pixel_x,
                yn + _place(a, samples) * pixel_y,
                pixel_x,
                pixel_y,
                blur_px,
                background,
                edges,
                opening,
            )
    return grey / (samples * samples)


@compiled
def shade(
    xn: Array,
    yn: Array,
    pixel_x: float,
    pixel_y: float,
    first_column: int,
    first_row: int,
    layers: Array,
    bounds_px: NDArray[np.int64],
    vertices: Array,
    origins: Array,
    turns: Array,
    background: float,
    blur_px: float,
    samples: int,
) -> Array:
    """Grey values of one rectangle of the window.

    Parameters
    ----------
    xn, yn : (rows, columns) undistorted image coordinates of the pixels' centres
    pixel_x, pixel_y : size of a pixel in those coordinates
    first_column, first_row : where the rectangle lies in the window
    layers : (L, COLUMNS), far to near; CLIP: the layer through which this one is seen (one opening for all), ON: the
    layer whose
        outline this one shares in part and lies on, each -1 for none
    bounds_px : (L, 4) first and last column and row (window) outside which a layer covers nothing
    origins, turns : (B, 3), (B, 3, 3) the camera's centre and the map (xn, yn, 1) -> ray, in each body's frame
    samples : sub-samples per pixel and axis where an edge is near, an even number
    """
    rows, columns = xn.shape
    opening = -1
    for k in range(len(layers)):
        opening = max(opening, int(layers[k, CLIP]))
    out = np.empty((rows, columns))
    used, edges = np.zeros(len(layers), np.int64), np.empty(len(layers))
    for top in range(0, rows, TILE):
        for left in range(0, columns, TILE):
            bottom, right = min(rows, top + TILE) - 1, min(columns, left + TILE) - 1
            for k in range(len(layers)):
                used[k] = (
                    bounds_px[k, 0] <= first_column + right
                    and first_column + left <= bounds_px[k, 1]
                    and bounds_px[k, 2] <= first_row + bottom
                    and first_row + top <= bounds_px[k, 3]
                )
            i, j = (top + bottom) // 2, (left + right) // 2
            flat = _colour(
                layers,
                used,
                vertices,
                origins,
                turns,
                xn[i, j],
                yn[i, j],
                pixel_x,
                pixel_y,
                blur_px,
                background,
                edges,
                opening,
            )
            nearest = FAR_PX
            for k in range(len(layers)):
                nearest = min(nearest, abs(edges[k]))
            if nearest > 6.0 * blur_px + 1.5 * TILE:  # no edge reaches into this tile
                out[top : bottom + 1, left : right + 1] = flat
                continue
            for i in range(top, bottom + 1):
                for j in range(left, right + 1):
                    out[i, j] = _pixel(
                        layers,
                        used,
                        vertices,
                        origins,
                        turns,
                        xn[i, j],
                        yn[i, j],
                        pixel_x,
                        pixel_y,
                        blur_px,
                        background,
                        edges,
                        opening,
                        samples,
                    )
    return out
