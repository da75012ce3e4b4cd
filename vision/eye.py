"""What one camera knows of the bodies from frame to frame: where they were, what their markers look like."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ovines.camera import Camera
from vision.centre import M11, N_FIT, OUTLIERS, S11, STRUCTURED, U, V
from vision.circle_centre import on_plane
from vision.detect import find_discs
from vision.follow import empty_fits, follow, packed
from vision.identity import Match, match_layout, place, wrapped

_JUMP_M, _JUMP_RAD = 0.006, 0.8  # a body does not move further from its prediction, impacts included
_NEAR_M = 0.0004  # a single marker is believed this near to its prediction only
_NEAR_RAD = 0.1
_SHAPE_EVERY = 4  # shape and blur change slowly: frames between two fits of them
_LEARN_EVERY = 16
_SIZED = 5  # frames with no other edge near, after which a marker's size counts as known
_SETTLED = 30  # frames after which a body's own scatter sets the gate


def layout_tolerance(extent_m: float, sd_m: float) -> float:
    """How far a marker may lie from its place [m]: calibration, placing, and a plane that leans by 6 mrad."""
    return 1.5e-4 + 3 * sd_m + 0.006 * extent_m


@dataclass(frozen=True, eq=False)
class Layout:
    """All markers of all bodies in a row: names, positions (n, 3) [m] in the bodies' frames.

    `first` (bodies + 1,): first marker of each body; `tolerance_m` (bodies,): how far a marker may lie from its
    design place; `known` (bodies,): False while a body's positions are still to be found (ground without layout).
    """

    bodies: tuple[str, ...]
    markers: tuple[str, ...]
    position_m: np.ndarray
    first: np.ndarray
    tolerance_m: np.ndarray
    known: np.ndarray

    def of(self, body: int) -> slice:
        return slice(int(self.first[body]), int(self.first[body + 1]))


class Eye:
    """A camera following the bodies.  Poses are (x, y, angle) of each body on its plane, as this camera sees it.

    Each camera keeps its own poses and its own view of the layouts: an error of calibration, clock or window then
    shows as a difference between the cameras, and does not break the following.
    """

    def __init__(self, camera: Camera, window_offset_px: tuple[int, int], layout: Layout) -> None:
        bodies, n = len(layout.bodies), len(layout.markers)
        self.camera, self.offset, self.layout = camera, window_offset_px, layout
        self.packed = packed(camera, window_offset_px)
        self.place_m = layout.position_m.copy()
        self.pose, self.velocity = np.zeros((bodies, 3)), np.zeros((bodies, 3))
        self.last = np.full(bodies, -10**9)
        self.seen_times, self.scatter_m = np.zeros(bodies, int), layout.tolerance_m.copy()
        self.learned = np.zeros(n, int)
        self.starts, self.fits = empty_fits(n), empty_fits(n)
        self.xy, self.use = np.zeros((n, 2)), np.zeros(n, np.int64)
        self.radius_m, self.seen_m, self.sized = np.zeros(n), np.zeros(n), np.zeros(n, int)
        self.n_seen, self.rms_m = np.zeros(bodies, np.int64), np.zeros(bodies)
        self.hold_shape = False
        self.expected, self.found = np.zeros((bodies, 3)), np.zeros((bodies, 3))

    def lost(self, body: int, frame: int) -> int:
        """Frames since the body was last seen, 0 when it was seen in the frame before."""
        return int(min(frame - self.last[body] - 1, 10**6))

    def gate_m(self) -> np.ndarray:
        tight = np.clip(5 * self.scatter_m, 6e-5, self.layout.tolerance_m)
        return np.where(self.seen_times > _SETTLED, tight, self.layout.tolerance_m)

    def predict(self, frame: int) -> None:
        """Expect every body where its last motion carries it."""
        self.hold_shape = frame % _SHAPE_EVERY != 0
        ahead = np.minimum(frame - self.last, 4)
        self.expected = np.where((ahead > 0)[:, None], self.pose + self.velocity * ahead[:, None], self.pose)

    def look(self, image: np.ndarray, active: np.ndarray, pose: np.ndarray | None = None) -> None:
        """Follow the active bodies from `pose` (default: the prediction); a second look where the first was off."""
        self.found[active > 0] = (self.expected if pose is None else pose)[active > 0]
        before = self.found.copy()
        self._follow(image, active)
        again = np.zeros_like(active)
        for b in map(int, np.flatnonzero(active)):
            part = self.layout.of(b)
            moved = np.hypot(*(self.found[b, :2] - before[b, :2])) > 2e-4 or abs(self.found[b, 2] - before[b, 2]) > 0.02
            again[b] = self.n_seen[b] >= 2 and moved and self.n_seen[b] < (self.starts[part, 2] > 0).sum()
        if again.any():
            self._follow(image, again)

    def _follow(self, image: np.ndarray, active: np.ndarray) -> None:
        follow(image, self.packed, self.place_m, self.layout.first, active, self.found, self.gate_m(), self.starts,
               self.hold_shape, np.where(self.sized >= _SIZED, self.radius_m, 0.0), self.fits, self.xy, self.use, self.n_seen,
               self.rms_m, self.seen_m)

    def good(self, body: int, frame: int) -> bool:
        """Whether what was found is the body, where it can be."""
        off = np.hypot(*(self.found[body, :2] - self.expected[body, :2]))
        if self.n_seen[body] >= 2:
            free = self.lost(body, frame) > 3
            turned = abs(wrapped(self.found[body, 2] - self.expected[body, 2]))
            return free or (off < _JUMP_M * (1 + self.lost(body, frame)) and turned < _JUMP_RAD)
        return bool(self.n_seen[body] == 1 and off < _NEAR_M and self.lost(body, frame) < 5)

    def near(self, body: int) -> bool:
        """Whether the body is where its last motion carries it, so that few markers suffice to name them."""
        off = np.hypot(*(self.found[body, :2] - self.expected[body, :2]))
        return bool(off < _NEAR_M and abs(wrapped(self.found[body, 2] - self.expected[body, 2])) < _NEAR_RAD)

    def snapshot(self, part: slice, body: int) -> tuple[Any, ...]:
        """What was found of a body in this frame, for `restore`."""
        return (self.use[part].copy(), self.fits[part].copy(), self.xy[part].copy(), self.found[body].copy(),
                self.n_seen[body], self.rms_m[body])

    def restore(self, part: slice, body: int, state: tuple[Any, ...]) -> None:
        """Go back to what `snapshot` kept."""
        (self.use[part], self.fits[part], self.xy[part], self.found[body], self.n_seen[body], self.rms_m[body]) = state

    def discs(self, image: np.ndarray, region: tuple[int, int, int, int] | None) -> np.ndarray:
        return find_discs(image, region)

    def matches(self, discs: np.ndarray, body: int, prior: np.ndarray | None,
                prior_sd: tuple[float, float] = (0.006, 0.35)) -> list[Match]:
        """Ways to see the body in these discs."""
        part = self.layout.of(body)
        if len(discs) < 2 or not self.layout.known[body]:
            return []
        heights = self.place_m[part, 2]
        levels, which = np.unique(heights, return_inverse=True)
        sensor = discs[:, [U, V]] + self.offset
        seen = np.stack([on_plane(self.camera, sensor, level)[:, :2] for level in levels], 1)[:, which]
        return match_layout(seen, self.place_m[part, :2], self.gate_m()[body] * 0.7, prior, prior_sd)

    def adopt(self, image: np.ndarray, body: int, match: Match, discs: np.ndarray) -> bool:
        """Take a match as the body's place in this frame; False when a second look does not bear it out."""
        part = self.layout.of(body)
        for marker, disc in zip(range(part.start, part.stop), match.disc, strict=True):
            if disc >= 0:
                self.starts[marker] = discs[disc]
        seen = self.starts[part, 2] > 0
        model = np.median(self.starts[part][seen], axis=0) if seen.any() else np.zeros(N_FIT)
        for marker in range(part.start, part.stop):  # a marker not yet seen is looked for as its neighbours look
            if self.starts[marker, 2] <= 0:
                self.starts[marker] = model
        active = np.zeros(len(self.layout.bodies), np.int64)
        active[body] = 1
        pose = self.found.copy()
        pose[body] = match.pose
        self.look(image, active, pose)
        return bool(self.n_seen[body] >= 2)

    def box(self, points_m: np.ndarray, margin_px: float) -> tuple[int, int, int, int]:
        """Window rectangle around world points."""
        uv = self.camera.project(points_m) - np.asarray(self.offset)
        low, high = np.nanmin(uv, 0) - margin_px, np.nanmax(uv, 0) + margin_px
        return int(low[0]), int(low[1]), int(high[0]) + 1, int(high[1]) + 1

    def body_points(self, body: int, pose: np.ndarray) -> np.ndarray:
        part = self.layout.of(body)
        return np.column_stack([place(pose, self.place_m[part, :2]), self.place_m[part, 2]])

    def accept(self, body: int, frame: int) -> None:
        """Make what was found the body's state, and learn how this camera sees its layout."""
        part = self.layout.of(body)
        gap = frame - self.last[body]
        pose = self.found[body].copy()
        if self.n_seen[body] >= 2:
            if gap <= 3:
                self.velocity[body] = (pose - self.pose[body]) / gap
            else:
                self.velocity[body] = 0.0
        self.pose[body], self.last[body] = pose, frame
        use = self.use[part] > 0
        self._remember(np.arange(part.start, part.stop)[use])
        enough = self.n_seen[body] >= min(3, part.stop - part.start)
        if enough and (self.seen_times[body] < 100 or frame % _LEARN_EVERY == 0):
            self._learn(body, part, use)

    def _remember(self, markers: np.ndarray) -> None:
        """How these markers look now; a shape through which other edges ran is not taken over from a marker of known size."""
        held = markers[(self.sized[markers] >= _SIZED) & (self.fits[markers, OUTLIERS] >= STRUCTURED)]
        shape = self.starts[held, M11:S11].copy()
        self.starts[markers] = self.fits[markers]
        self.starts[held, M11:S11] = shape
        clear = markers[self.seen_m[markers] > 0]
        self.sized[clear] += 1
        self.radius_m[clear] += (self.seen_m[clear] - self.radius_m[clear]) / np.minimum(self.sized[clear], 50)

    def _learn(self, body: int, part: slice, use: np.ndarray) -> None:
        c, s = np.cos(self.pose[body, 2]), np.sin(self.pose[body, 2])
        off = self.xy[part] - self.pose[body, :2]
        own = np.column_stack([c * off[:, 0] + s * off[:, 1], -s * off[:, 0] + c * off[:, 1]])
        markers = np.arange(part.start, part.stop)[use]
        gain = 1 / np.minimum(self.learned[markers] + 2, 200)
        self.place_m[markers, :2] += gain[:, None] * (own[use] - self.place_m[markers, :2])
        self.learned[markers] += 1
        self.seen_times[body] += 1
        self.scatter_m[body] += (self.rms_m[body] - self.scatter_m[body]) / min(self.seen_times[body], 50)


def predicted_apart(eyes: Sequence[Eye], body: int) -> np.ndarray:
    """Difference of the cameras' last poses of a body: what one's pose says of where the other sees it."""
    return eyes[0].pose[body] - eyes[1].pose[body]
