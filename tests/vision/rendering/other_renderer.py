"""A second renderer, which shares no code with `vision.rendering.images`: one ray per subpixel, cast at solid bodies.

`vision.rendering.images` draws each edge already blurred, layer on layer; here nothing is known of edges.  Every
pixel's ray is followed to the first surface it meets (table, ring, washer with its hole, stickers), pixels in whose
neighbourhood surfaces or shadows change are asked at many places, and the picture is blurred and made noisy afterwards.
A mistake of one renderer is not the other's.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import cv2
import numba
import numpy as np

# Paints: what a ray may meet.
TABLE, RING, WALL, OUTSIDE, FLOOR, WASHER, SIDE, HOLE, CHAMFER, STICKERS = range(10)
GREYS = {
    "table": 95.0,
    "ring": 150.0,
    "wall": 70.0,
    "outside": 60.0,
    "floor": 125.0,
    "washer": 190.0,
    "side": 80.0,
    "hole": 45.0,
    "chamfer": 215.0,
}
_R2 = (
    np.stack([(0.5 + 0.7548776662466927 * np.arange(96)) % 1, (0.5 + 0.5698402909980532 * np.arange(96)) % 1], -1) - 0.5
)
PLACES = np.stack([_R2, -_R2], 1).reshape(-1, 2)  # in pairs about the middle: any even part of them has its mean there


@dataclass(frozen=True)
class Lens:
    """A camera by its own equations: K, (k1, k2, p1, p2, k3), X_camera = turn X + shift; pixel (0, 0) is the top-left
    one's centre.
    """

    name: str
    size: tuple[int, int]
    focal: tuple[float, float]
    centre: tuple[float, float]
    bend: tuple[float, float, float, float, float]
    turn: np.ndarray
    shift: np.ndarray

    def bent(self, x, y):
        k1, k2, p1, p2, k3 = self.bend
        r = x * x + y * y
        radial = 1 + r * (k1 + r * (k2 + r * k3))
        return x * radial + 2 * p1 * x * y + p2 * (r + 2 * x * x), y * radial + p1 * (r + 2 * y * y) + 2 * p2 * x * y

    def pixels(self, points):
        """World points (..., 3) to sensor pixels (..., 2)."""
        seen = points @ self.turn.T + self.shift
        x, y = self.bent(seen[..., 0] / seen[..., 2], seen[..., 1] / seen[..., 2])
        return np.stack([self.focal[0] * x + self.centre[0], self.focal[1] * y + self.centre[1]], -1)

    def rays(self, left, top, width, height):
        """Directions (h, w, 3) of the pixels of a window, not of unit length, in the camera's frame."""
        u, v = np.meshgrid(np.arange(left, left + width, dtype=float), np.arange(top, top + height, dtype=float))
        u, v = (u - self.centre[0]) / self.focal[0], (v - self.centre[1]) / self.focal[1]
        x, y = u.copy(), v.copy()
        for _ in range(6):  # each gains two digits: far below 1e-9
            a, b = self.bent(x, y)
            x, y = x + u - a, y + v - b
        return np.stack([x, y, np.ones_like(x)], -1)

    @property
    def eye(self):
        return -self.turn.T @ self.shift


@dataclass(frozen=True)
class Bodies:
    """What stands on the table, at one instant.  Lengths in metres; ``stickers`` (n, 7): x, y, z, radius, grey, outer
    radius, its grey.
    """

    ring_at: tuple[float, float]
    washer_at: tuple[float, float]
    stickers: np.ndarray
    inner: float = 0.05
    outer: float = 0.06
    wall: float = 0.012
    washer: float = 0.01
    hole: float = 0.0
    washer_height: float = 0.01
    chamfer: float = 0.0
    table: float = 0.0
    light: tuple[float, float, float] = (0.0, 0.0, 1.0)
    shade: float = 1.0
    greys: dict[str, float] = field(default_factory=dict)

    def numbers(self):
        return np.array(
            [
                *self.ring_at,
                *self.washer_at,
                self.inner,
                self.outer,
                self.wall,
                self.washer,
                self.hole,
                self.washer_height,
                self.chamfer,
                self.table,
                *self.light,
            ]
        )


@numba.njit(cache=True, inline="always")
def _enters(ox, oy, dx, dy, r, near):
    """Parameter at which a line (from the circle's middle) crosses a circle: the nearer or the farther time; -1:
    never.
    """
    a, b, c = dx * dx + dy * dy, ox * dx + oy * dy, ox * ox + oy * oy - r * r
    root = b * b - a * c
    if root <= 0 or a == 0:
        return -1.0
    return (-b - math.sqrt(root)) / a if near else (-b + math.sqrt(root)) / a


@numba.njit(cache=True, inline="always")
def _standing(ex, ey, ez, dx, dy, dz, x, y, r, low, high, near, best):
    """Where a ray meets a standing cylinder between two heights, if before `best`; else -1."""
    t = _enters(ex - x, ey - y, dx, dy, r, near)
    return t if 0 < t < best and low <= ez + t * dz <= high else -1.0


@numba.njit(cache=True)
def meet(ex, ey, ez, dx, dy, dz, b, stickers):
    """Number of the paint that a ray from an eye meets first; + 1000 in a shadow."""
    hx, hy, nx, ny, inner, outer, wall, washer, hole, top, chamfer, table = b[:12]
    best, paint = (table - ez) / dz, TABLE
    t = (0.0 - ez) / dz  # the Host's floor, a plate as wide as the ring
    if t <= best:
        x, y = ex + t * dx, ey + t * dy
        if (x - hx) ** 2 + (y - hy) ** 2 < outer * outer:
            best, paint = t, FLOOR
    t = (wall - ez) / dz
    r = (ex + t * dx - hx) ** 2 + (ey + t * dy - hy) ** 2
    if inner * inner < r < outer * outer and t < best:
        best, paint = t, RING
    t = _standing(ex, ey, ez, dx, dy, dz, hx, hy, inner, 0.0, wall, False, best)
    if t > 0:
        best, paint = t, WALL
    t = _standing(ex, ey, ez, dx, dy, dz, hx, hy, outer, table, wall, True, best)
    if t > 0:
        best, paint = t, OUTSIDE
    t = (top - ez) / dz
    r = (ex + t * dx - nx) ** 2 + (ey + t * dy - ny) ** 2
    if hole * hole < r < washer * washer and t < best:
        best, paint = t, CHAMFER if r > (washer - chamfer) ** 2 else WASHER
    t = _standing(ex, ey, ez, dx, dy, dz, nx, ny, washer, 0.0, top, True, best)
    if t > 0:
        best, paint = t, SIDE
    if hole > 0:
        t = _standing(ex, ey, ez, dx, dy, dz, nx, ny, hole, 0.0, top, False, best)
        if t > 0 and (ex + (top - ez) / dz * dx - nx) ** 2 + (ey + (top - ez) / dz * dy - ny) ** 2 < hole * hole:
            best, paint = t, HOLE
    for i in range(len(stickers)):
        t = (stickers[i, 2] + 1e-6 - ez) / dz
        if t < best:
            r = (ex + t * dx - stickers[i, 0]) ** 2 + (ey + t * dy - stickers[i, 1]) ** 2
            if r < stickers[i, 5] ** 2:
                best, paint = t, STICKERS + 2 * i + (r >= stickers[i, 3] ** 2)
    x, y, z = ex + best * dx, ey + best * dy, ez + best * dz
    lx, ly = b[12] / b[14], b[13] / b[14]
    if lx == 0.0 and ly == 0.0:
        return paint
    far = wall - z
    if far > 1e-5:
        px, py = x - hx, y - hy
        inside = px * px + py * py < (inner + 1e-6) ** 2
        if inside and (px + far * lx) ** 2 + (py + far * ly) ** 2 > inner * inner:
            return paint + 1000
        t = _enters(px, py, lx, ly, outer, True)
        if not inside and 0 < t < far:
            return paint + 1000
    far = top - z
    if far > 1e-5 and paint != SIDE and paint != HOLE:
        t = _enters(x - nx, y - ny, lx, ly, washer, True)
        if 0 < t < far:
            return paint + 1000
    return paint


@numba.njit(cache=True)
def _cast(rays, across, down, eye, b, stickers, paints, shade, places):
    height, width = rays.shape[:2]
    ex, ey, ez = eye
    met = np.empty((height, width), np.int64)
    for i in range(height):
        for j in range(width):
            met[i, j] = meet(ex, ey, ez, rays[i, j, 0], rays[i, j, 1], rays[i, j, 2], b, stickers)
    out = np.empty((height, width), np.float64)
    for i in range(height):
        for j in range(width):
            first, same, marked = met[i, j], True, False
            for y in range(max(i - 1, 0), min(i + 2, height)):
                for x in range(max(j - 1, 0), min(j + 2, width)):
                    same = same and met[y, x] == first
                    marked = marked or met[y, x] % 1000 >= STICKERS
            if same:
                out[i, j] = paints[first % 1000] * (shade if first >= 1000 else 1.0)
                continue
            total, asked = 0.0, len(places) if marked else min(len(places), 32)
            for k in range(asked):
                p, q = places[k, 0], places[k, 1]
                m = meet(
                    ex,
                    ey,
                    ez,
                    rays[i, j, 0] + p * across[i, j, 0] + q * down[i, j, 0],
                    rays[i, j, 1] + p * across[i, j, 1] + q * down[i, j, 1],
                    rays[i, j, 2] + p * across[i, j, 2] + q * down[i, j, 2],
                    b,
                    stickers,
                )
                total += paints[m % 1000] * (shade if m >= 1000 else 1.0)
            out[i, j] = total / asked
    return out


@numba.njit(cache=True, inline="always")
def _on_paper(dx, dy, dz, back_turn, shift, per_m, edge, paper, back):
    """Grey of a sheet where a ray from the camera meets it."""
    nx, ny, nz = back_turn[2, 0], back_turn[2, 1], back_turn[2, 2]
    t = (nx * shift[0] + ny * shift[1] + nz * shift[2]) / (nx * dx + ny * dy + nz * dz)
    px, py, pz = t * dx - shift[0], t * dy - shift[1], t * dz - shift[2]
    j = math.floor((back_turn[0, 0] * px + back_turn[0, 1] * py + back_turn[0, 2] * pz) * per_m) + edge
    i = math.floor((back_turn[1, 0] * px + back_turn[1, 1] * py + back_turn[1, 2] * pz) * per_m) + edge
    return paper[i, j] if 0 <= i < paper.shape[0] and 0 <= j < paper.shape[1] else back


@numba.njit(cache=True)
def _paper(rays, across, down, back_turn, shift, per_m, edge, paper, back, places):
    height, width = rays.shape[:2]
    plain = np.empty((height, width))
    for i in range(height):
        for j in range(width):
            plain[i, j] = _on_paper(
                rays[i, j, 0], rays[i, j, 1], rays[i, j, 2], back_turn, shift, per_m, edge, paper, back
            )
    out = plain.copy()
    for i in range(1, height - 1):
        for j in range(1, width - 1):
            c = plain[i, j]
            if (
                plain[i - 1, j] != c
                or plain[i + 1, j] != c
                or plain[i, j - 1] != c
                or plain[i, j + 1] != c
                or plain[i - 1, j - 1] != c
                or plain[i + 1, j + 1] != c
                or plain[i - 1, j + 1] != c
                or plain[i + 1, j - 1] != c
            ):
                total = 0.0
                for k in range(len(places)):
                    p, q = places[k, 0], places[k, 1]
                    total += _on_paper(
                        rays[i, j, 0] + p * across[i, j, 0] + q * down[i, j, 0],
                        rays[i, j, 1] + p * across[i, j, 1] + q * down[i, j, 1],
                        rays[i, j, 2] + p * across[i, j, 2] + q * down[i, j, 2],
                        back_turn,
                        shift,
                        per_m,
                        edge,
                        paper,
                        back,
                    )
                out[i, j] = total / len(places)
    return out


class Window:
    """A window of a camera's sensor: its rays, computed once."""

    def __init__(self, lens: Lens, left: int, top: int, width: int, height: int) -> None:
        self.lens, self.left, self.top, self.size = lens, left, top, (width, height)
        self.rays = lens.rays(left, top, width, height) @ lens.turn  # in the world's directions
        self.across, self.down = np.gradient(self.rays, axis=1), np.gradient(self.rays, axis=0)

    def bodies(
        self, b: Bodies, box: tuple[int, int, int, int] | None = None, places: np.ndarray = PLACES
    ) -> np.ndarray:
        """Light (h, w) that comes from the bodies, in box (x0, y0, x1, y1) of the window or the whole of it."""
        x0, y0, x1, y1 = box or (0, 0, *self.size)
        greys = GREYS | b.greys
        paints = np.array([*greys.values(), *b.stickers[:, [4, 6]].ravel()])
        part = np.s_[y0:y1, x0:x1]
        return _cast(
            np.ascontiguousarray(self.rays[part]),
            np.ascontiguousarray(self.across[part]),
            np.ascontiguousarray(self.down[part]),
            tuple(self.lens.eye),
            b.numbers(),
            b.stickers,
            paints,
            b.shade,
            places,
        )

    def share_seen(self, b: Bodies, i: int) -> float:
        """How much of sticker `i` this window shows (0 to 1)."""
        x, y, z, radius = b.stickers[i, :4]
        turn, out = np.arange(200) * 2.399963, np.sqrt((np.arange(200) + 0.5) / 200)
        points = np.stack(
            [x + radius * out * np.cos(turn), y + radius * out * np.sin(turn), np.full(200, z + 1e-6)], -1
        )
        uv = self.lens.pixels(points) - (self.left, self.top)
        inside = ((uv > 2) & (uv < np.array(self.size) - 3)).all(1)
        eye, numbers = self.lens.eye, b.numbers()
        met = [meet(*eye, *(p - eye), numbers, b.stickers) % 1000 == STICKERS + 2 * i for p in points]
        return float(np.mean(inside & met))

    def board(self, size, square, cells, black, turn, shift, light=(25.0, 215.0), back=90.0) -> np.ndarray:
        """Light from a flat board of (columns, rows) squares; ``cells`` per square; ``black`` (rows cells, columns
        cells); X_camera = turn X + shift.
        """
        turn, shift = self.lens.turn.T @ turn, self.lens.turn.T @ shift  # the rays are in the world's directions
        paper = np.full((black.shape[0] + cells, black.shape[1] + cells), light[1])
        edge = cells // 2
        paper[edge : edge + black.shape[0], edge : edge + black.shape[1]] = np.where(black, light[0], light[1])
        return _paper(
            self.rays,
            self.across,
            self.down,
            np.ascontiguousarray(turn.T),
            shift,
            cells / square,
            edge,
            paper,
            back,
            PLACES[:96],
        )


def exposed(
    light: np.ndarray,
    rng: np.random.Generator,
    blur: float = 0.8,
    noise: float = 2.0,
    photons: float = 0.0,
    bits: int = 8,
    shading: np.ndarray | float = 1.0,
    extra: np.ndarray | float = 0.0,
) -> np.ndarray:
    """A picture of that light (grey levels of 8 bit): lens blur [px sd], shading, noise [grey], ``photons`` (variance
    per grey), rounding.
    """
    seen = cv2.GaussianBlur(light, (0, 0), blur, borderType=cv2.BORDER_REPLICATE) * shading + extra
    seen = seen + rng.normal(0, 1, seen.shape) * np.sqrt(noise**2 + photons * np.maximum(seen, 0))
    scale = {8: 1.0, 12: 16.0, 16: 256.0}[bits]
    return np.clip(np.rint(seen * scale), 0, (1 << bits) - 1).astype(np.uint8 if bits == 8 else np.uint16)
