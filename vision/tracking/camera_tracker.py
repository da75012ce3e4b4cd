"""What one camera knows of the bodies from frame to frame: where they were, what their markers look like."""

from __future__ import annotations

from math import prod
from typing import Any

import numpy as np

from ovines.camera import Camera
from vision.identity.layouts import Layout
from vision.identity.matching import Match, match_layout, place
from vision.markers.detect import find_discs
from vision.markers.fit import N_FIT, OK, OUTLIERS, STRUCTURED, U, V, radius_px
from vision.markers.perspective import on_plane
from vision.tracking.measure import apart_m, look, run_ahead, see
from vision.tracking.planar_pose import packed
from vision.tracking.state import Sight, accept, fastest_m, gate_m, good, lost, near, predict, stray_m, sure

AHEAD = 8  # frames that a camera goes on its own before the two compare
_EDGE_PX = 4.0  # about a disc, of its blur and its surroundings


def _in_one(kind: type, **shapes: tuple[int, ...]) -> dict[str, np.ndarray]:
    """Zeros of these shapes, side by side in the array "whole"."""
    whole: np.ndarray = np.zeros(sum(map(prod, shapes.values())), kind)
    parts = np.split(whole, np.cumsum([prod(shape) for shape in shapes.values()])[:-1])
    return {"whole": whole} | {
        name: part.reshape(shape) for (name, shape), part in zip(shapes.items(), parts, strict=True)
    }


class Eye:
    """A camera following the bodies; what it holds of them is its `Sight`, whose arrays are also its attributes.

    Each camera keeps its own poses and its own view of the layouts: an error of calibration, clock or window then
    shows as a difference between the cameras, and does not break the following.
    """

    def __init__(self, camera: Camera, window_offset_px: tuple[int, int], layout: Layout) -> None:
        bodies, n = len(layout.bodies), len(layout.markers)
        self.camera, self.offset, self.layout = camera, window_offset_px, layout
        floats = _in_one(
            np.float64,
            place_m=(n, 3),
            pose=(bodies, 3),
            velocity=(bodies, 3),
            change=(bodies, 3),
            bend=(bodies, 3),
            step_m=(bodies,),
            expected=(bodies, 3),
            found=(bodies, 3),
            scatter_m=(bodies,),
            rms_m=(bodies,),
            starts=(n, N_FIT),
            fits=(n, N_FIT),
            xy=(n, 2),
            radius_m=(n,),
            seen_m=(n,),
        )
        ints = _in_one(
            np.int64, last=(bodies,), seen_times=(bodies,), n_seen=(bodies,), use=(n,), sized=(n,), learned=(n,)
        )
        self.sight = Sight(
            cam=packed(camera, window_offset_px),
            first=np.asarray(layout.first, np.int64),
            tolerance_m=np.asarray(layout.tolerance_m, float),
            rig_m=float(layout.rig_m),
            floats=floats.pop("whole"),
            ints=ints.pop("whole"),
            **floats,
            **ints,
        )
        self.place_m, self.pose, self.expected, self.found = (
            self.sight.place_m,
            self.sight.pose,
            self.sight.expected,
            self.sight.found,
        )
        self.last, self.n_seen, self.rms_m = self.sight.last, self.sight.n_seen, self.sight.rms_m
        self.starts, self.fits, self.use = self.sight.starts, self.sight.fits, self.sight.use
        self.place_m[:], self.sight.scatter_m[:], self.last[:] = layout.position_m, layout.tolerance_m, -(10**9)
        self._before = np.empty((AHEAD, self.sight.floats.size)), np.empty((AHEAD, self.sight.ints.size), np.int64)
        self.frame = 0

    def look_ahead(self, image: np.ndarray | None, known: np.ndarray, frame: int) -> None:
        """Look for the known bodies (b,) in one more frame, where their motion carries them; no picture: nothing is
        seen.
        """
        self.frame = frame
        predict(self.sight, frame)
        if image is not None:
            see(image, self.sight, known, frame)

    def run_ahead(
        self, images: list[Any], frames: list[int], known: np.ndarray, rows: np.ndarray, filled: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Follow the known bodies through frames, AHEAD at most, while this camera alone is sure of them.

        Poses (f, bodies, 3) of the frames so followed; how many of `rows` were filled after each, (f + 1,), from
        `filled` on.
        """
        poses, n_rows = np.empty((len(frames), *self.found.shape)), np.full(len(frames) + 1, filled)
        pictures = tuple(
            images + images[-1:] * (AHEAD - len(images))
        )  # always as many: code is compiled for their number
        done = run_ahead(pictures, np.array(frames), self.sight, known, self._before, poses, rows, n_rows)
        return poses[:done], n_rows[: done + 1]

    def go_back(self, frames: int) -> None:
        """To the state after so many frames of the last `run_ahead`, less than it ran."""
        self.sight.floats[:], self.sight.ints[:] = self._before[0][frames], self._before[1][frames]

    def lost(self, body: int) -> int:
        """Frames since the body was last seen, 0 when it was seen in the frame before."""
        return int(lost(self.sight, body, self.frame))

    def gate_m(self, body: int) -> float:
        """How far from its prediction the body is looked for [m]."""
        return float(gate_m(self.sight, body))

    def stray_m(self, body: int) -> float:
        """How far the body may be from where its last motion carries it; see `sight.stray_m`."""
        return float(stray_m(self.sight)) * (1 + self.lost(body))

    def fastest_m(self) -> float:
        """The largest step from one frame to the next that any body has made so far."""
        return float(fastest_m(self.sight))

    def apart_m(self, body: int) -> float:
        """How far the other camera may differ about where the body is."""
        return float(apart_m(self.sight, body))

    def good(self, body: int) -> bool:
        """Whether what was found is the body, where it can be."""
        return bool(good(self.sight, body, self.frame))

    def near(self, body: int) -> bool:
        """Whether the body is where its last motion carries it, so that few markers suffice to name them."""
        return bool(near(self.sight, body))

    def sure(self, body: int) -> bool:
        """Whether the markers seen say which is which."""
        return bool(sure(self.sight, body))

    def accept(self, body: int) -> None:
        """Make what was found the body's state, and learn how this camera sees its layout."""
        accept(self.sight, body, self.frame)

    def forget(self, body: int) -> None:
        """Count the body as not seen in this frame."""
        self.use[self.layout.of(body)] = 0
        self.n_seen[body] = 0

    def snapshot(self, part: slice, body: int) -> tuple[Any, ...]:
        """What was found of a body in this frame, for `restore`."""
        return (
            self.use[part].copy(),
            self.fits[part].copy(),
            self.sight.xy[part].copy(),
            self.found[body].copy(),
            self.n_seen[body],
            self.rms_m[body],
        )

    def restore(self, part: slice, body: int, state: tuple[Any, ...]) -> None:
        """Go back to what `snapshot` kept."""
        (
            self.use[part],
            self.fits[part],
            self.sight.xy[part],
            self.found[body],
            self.n_seen[body],
            self.rms_m[body],
        ) = state

    def discs(self, image: np.ndarray, region: tuple[int, int, int, int] | None, like: int | None = None) -> np.ndarray:
        """Discs in a region; `like`: only those that look as the markers of this body did."""
        if like is None:
            return find_discs(image, region)
        seen = self.starts[self.layout.of(like)]
        seen = seen[(seen[:, OK] > 0) & (seen[:, OUTLIERS] < STRUCTURED)]
        return find_discs(image, region, seen) if len(seen) else np.empty((0, N_FIT))

    def matches(
        self,
        discs: np.ndarray,
        body: int,
        prior: np.ndarray | None = None,
        prior_sd: tuple[float, float] = (np.inf, np.inf),
    ) -> list[Match]:
        """Ways to see the body in these discs, about a pose expected with these sd (position [m], angle [rad])."""
        part = self.layout.of(body)
        if len(discs) < 2 or not self.layout.known[body]:
            return []
        heights = self.place_m[part, 2]
        levels, which = np.unique(heights, return_inverse=True)
        sensor = discs[:, [U, V]] + self.offset
        seen = np.stack([on_plane(self.camera, sensor, level)[:, :2] for level in levels], 1)[:, which]
        return match_layout(seen, self.place_m[part, :2], self.gate_m(body) * 0.7, prior, prior_sd)

    def adopt(self, image: np.ndarray, body: int, match: Match, discs: np.ndarray) -> bool:
        """Take a match as the body's place in this frame; False when a second look does not bear it out."""
        part = self.layout.of(body)
        before = self.starts[part].copy()
        for marker, disc in zip(range(part.start, part.stop), match.disc, strict=True):
            if disc >= 0:
                self.starts[marker] = discs[disc]
        seen = self.starts[part, 2] > 0
        model = np.median(self.starts[part][seen], axis=0) if seen.any() else np.zeros(N_FIT)
        for marker in range(part.start, part.stop):  # a marker not yet seen is looked for as its neighbours look
            if self.starts[marker, 2] <= 0:
                self.starts[marker] = model
        if self.look_at(image, body, match.pose, 2):
            return True
        self.starts[part] = before
        return False

    def look_at(self, image: np.ndarray, body: int, pose: np.ndarray, least: int) -> bool:
        """Look for the body at `pose`; with fewer than `least` of its markers there it counts as not seen."""
        self.found[body] = pose
        look(image, self.sight, body, self.frame)
        if self.n_seen[body] >= least:
            return True
        self.forget(body)
        return False

    def box(self, points_m: np.ndarray, body: int, margin_m: float = 0.0) -> tuple[int, int, int, int]:
        """Window rectangle that holds the body's discs about world points (n, 3), and within a margin around them."""
        uv, jacobian = self.camera.project_with_jacobian(points_m)
        px_per_m = float(np.sqrt(np.abs(np.linalg.det(jacobian[..., :2])).max()))
        seen = self.starts[self.layout.of(body)]
        seen = seen[seen[:, 2] > 0]
        margin_px = margin_m * px_per_m + (2.0 * float(radius_px(seen).max()) if len(seen) else 0.0) + _EDGE_PX
        low, high = (np.nanmin(uv, 0) - self.offset - margin_px, np.nanmax(uv, 0) - self.offset + margin_px)
        return int(low[0]), int(low[1]), int(high[0]) + 1, int(high[1]) + 1

    def body_points(self, body: int, pose: np.ndarray) -> np.ndarray:
        """World points (n, 3) of the body's markers under a plane pose (3,)."""
        part = self.layout.of(body)
        return np.column_stack([place(pose, self.place_m[part, :2]), self.place_m[part, 2]])
