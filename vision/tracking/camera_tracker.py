"""One camera's tracker: where the bodies were, what their markers look like, where they are now."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ovines.camera import Camera
from vision.identity.layouts import Layout
from vision.identity.matching import Match, match_layout, place
from vision.markers.detect import find_discs
from vision.markers.perspective import on_plane
from vision.markers.row import M11, N_FIT, OK, OUTLIERS, STRUCTURED, U, V, radius_px
from vision.tracking.bodies.arrays import new_state
from vision.tracking.bodies.gates import BodyStatus, status
from vision.tracking.bodies.planar_pose import packed
from vision.tracking.measure import AT_POSE, INDEPENDENT_FRAMES, PREDICTED, THROUGH, Progress, follow
from vision.tracking.state import ACCEPT, N_RECORD, PREDICT, RECORD, update

_EDGE_PX = 4.0  # about a disc, of its blur and its surroundings
_DISC_RADII = 2.0  # about a body's markers, that its largest disc be in the box with its surroundings
_MATCH_GATE = 0.7  # of the gate, as one unit of a match's cost, which counts misfits up to 3 of it
_NEVER = -(10**9)  # frame last seen of a body not yet seen


class Measured(NamedTuple):
    """What was measured of one body in a frame, for `CameraTracker.restore`."""

    used: np.ndarray
    disc: np.ndarray
    xy_m: np.ndarray
    pose: np.ndarray
    n_markers: int
    rms_m: float


class CameraTracker:
    """Tracks the bodies in one camera; what it holds is its `TrackState`, whose records are also its attributes.

    Each camera keeps its own poses and its own view of the layouts: an error of calibration, clock or window then
    shows as a difference between the cameras, and does not break the tracking.
    """

    def __init__(self, camera: Camera, window_offset_px: tuple[int, int], layout: Layout) -> None:
        self.camera, self.offset, self.layout = camera, window_offset_px, layout
        self.state = new_state(
            packed(camera, window_offset_px),
            np.asarray(layout.first, np.int64),
            np.asarray(layout.tolerance_m, float),
            float(layout.rig_m),
        )
        self.bodies, self.measured = self.state.bodies, self.state.measured
        self.markers, self.detections = self.state.markers, self.state.detections
        self.markers.place_m[:], self.bodies.scatter_m[:] = layout.position_m, layout.tolerance_m
        self.bodies.last_frame[:] = _NEVER
        self._before = (
            np.empty((INDEPENDENT_FRAMES, self.state.floats.size)),
            np.empty((INDEPENDENT_FRAMES, self.state.ints.size), np.int64),
        )
        self._no_rows = np.empty((0, N_RECORD))
        self._nothing = Progress(
            *self._before, np.empty((0, *self.measured.pose.shape)), self._no_rows, np.zeros(1, int)
        )
        self.frame = 0

    def _only(self, body: int) -> np.ndarray:
        return (np.arange(len(self.layout.bodies)) == body).astype(np.int64)

    def _follow_one(self, job: int, image: np.ndarray, bodies: np.ndarray) -> None:
        follow(job, (image,) * INDEPENDENT_FRAMES, np.array([self.frame]), self.state, bodies, self._nothing)

    def predict_and_measure(self, image: np.ndarray | None, known: np.ndarray, frame: int) -> None:
        """Measure the known bodies (b,) in one more frame, where their motion carries them; no picture: nothing is
        seen.
        """
        self.frame = frame
        if image is None:
            update(PREDICT, self.state, known, frame, self._no_rows, 0)
        else:
            self._follow_one(PREDICTED, image, known)

    def track_independently(
        self, images: list[Any], frames: list[int], known: np.ndarray, rows: np.ndarray, filled: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Track the known bodies through frames, INDEPENDENT_FRAMES at most, while this camera alone is locked on them.

        Poses (f, bodies, 3) of the frames so tracked; how many of `rows` were filled after each, (f + 1,), from
        `filled` on.
        """
        poses = np.empty((len(frames), *self.measured.pose.shape))
        progress = Progress(*self._before, poses, rows, np.full(len(frames) + 1, filled))
        # Always as many pictures: code is compiled for their number.
        pictures = tuple(images + images[-1:] * (INDEPENDENT_FRAMES - len(images)))
        done = follow(THROUGH, pictures, np.array(frames), self.state, known, progress)
        return poses[:done], progress.n_rows[: done + 1]

    def go_back(self, frames: int) -> None:
        """To the state after so many frames of the last `track_independently`, less than it ran."""
        self.state.floats[:], self.state.ints[:] = self._before[0][frames], self._before[1][frames]

    def status(self, body: int) -> BodyStatus:
        """How this camera stands with the body in this frame."""
        return status(self.state, body, self.frame)

    def fastest_step_m(self) -> float:
        """The largest step from one frame to the next that any body has made so far."""
        return float(self.bodies.step_m.max())

    def accept(self, body: int) -> None:
        """Make what was measured the body's state, and learn how this camera sees its layout."""
        update(ACCEPT, self.state, self._only(body), self.frame, self._no_rows, 0)

    def record(self, rows: np.ndarray, filled: int) -> int:
        """Append the markers seen to `rows` (enough, N_RECORD), of which `filled` are; how many are now."""
        return int(update(RECORD, self.state, self._only(0), self.frame, rows, filled))

    def discard(self, body: int) -> None:
        """Count the body as not seen in this frame."""
        self.detections.used[self.layout.of(body)] = 0
        self.measured.n_markers[body] = 0

    def snapshot(self, body: int) -> Measured:
        """What was measured of a body in this frame, for `restore`."""
        part, seen = self.layout.of(body), self.detections
        return Measured(
            seen.used[part].copy(),
            seen.disc[part].copy(),
            seen.xy_m[part].copy(),
            self.measured.pose[body].copy(),
            self.measured.n_markers[body],
            self.measured.rms_m[body],
        )

    def restore(self, body: int, measured: Measured) -> None:
        """Go back to what `snapshot` kept."""
        part, seen = self.layout.of(body), self.detections
        seen.used[part], seen.disc[part], seen.xy_m[part] = measured.used, measured.disc, measured.xy_m
        self.measured.pose[body] = measured.pose
        self.measured.n_markers[body], self.measured.rms_m[body] = measured.n_markers, measured.rms_m

    def find_discs(
        self, image: np.ndarray, region: tuple[int, int, int, int] | None, like: int | None = None
    ) -> np.ndarray:
        """Discs in a region; `like`: only those that look as the markers of this body did."""
        if like is None:
            return find_discs(image, region)
        seen = self.markers.disc[self.layout.of(like)]
        seen = seen[(seen[:, OK] > 0) & (seen[:, OUTLIERS] < STRUCTURED)]
        return find_discs(image, region, seen) if len(seen) else np.empty((0, N_FIT))

    def matches(
        self,
        discs: np.ndarray,
        body: int,
        prior: np.ndarray | None = None,
        prior_sd: tuple[float, float] = (np.inf, np.inf),
    ) -> list[Match]:
        """Ways to match the body to these discs, about a pose expected with these sd (position [m], angle [rad])."""
        part = self.layout.of(body)
        if len(discs) < 2 or not self.layout.known[body]:
            return []
        heights = self.markers.place_m[part, 2]
        levels, which = np.unique(heights, return_inverse=True)
        sensor = discs[:, [U, V]] + self.offset
        seen = np.stack([on_plane(self.camera, sensor, level)[:, :2] for level in levels], 1)[:, which]
        return match_layout(
            seen, self.markers.place_m[part, :2], self.status(body).gate_m * _MATCH_GATE, prior, prior_sd
        )

    def adopt(self, image: np.ndarray, body: int, match: Match, discs: np.ndarray) -> bool:
        """Take a match as the body's place in this frame; False when measuring there does not bear it out."""
        part = self.layout.of(body)
        known = self.markers.disc[part]  # a view: what is written here is the state
        before = known.copy()
        known[match.disc >= 0] = discs[match.disc[match.disc >= 0]]
        seen = known[:, M11] > 0
        # A marker not yet seen is looked for as its neighbours look.
        known[~seen] = np.median(known[seen], axis=0) if seen.any() else np.zeros(N_FIT)
        if self.measure_at(image, body, match.pose, 2):
            return True
        known[:] = before
        return False

    def measure_at(self, image: np.ndarray, body: int, pose: np.ndarray, least: int) -> bool:
        """Measure the body at `pose`; with fewer than `least` of its markers there it counts as not seen."""
        self.measured.pose[body] = pose
        self._follow_one(AT_POSE, image, self._only(body))
        if self.measured.n_markers[body] >= least:
            return True
        self.discard(body)
        return False

    def box(self, points_m: np.ndarray, body: int, margin_m: float = 0.0) -> tuple[int, int, int, int]:
        """Window rectangle that holds the body's discs about world points (n, 3), and within a margin around them."""
        uv, jacobian = self.camera.project_with_jacobian(points_m)
        px_per_m = float(np.sqrt(np.abs(np.linalg.det(jacobian[..., :2])).max()))
        seen = self.markers.disc[self.layout.of(body)]
        seen = seen[seen[:, M11] > 0]
        margin_px = margin_m * px_per_m + (_DISC_RADII * float(radius_px(seen).max()) if len(seen) else 0.0) + _EDGE_PX
        low, high = (np.nanmin(uv, 0) - self.offset - margin_px, np.nanmax(uv, 0) - self.offset + margin_px)
        return int(low[0]), int(low[1]), int(high[0]) + 1, int(high[1]) + 1

    def body_points(self, body: int, pose: np.ndarray) -> np.ndarray:
        """World points (n, 3) of the body's markers under a plane pose (3,)."""
        part = self.layout.of(body)
        return np.column_stack([place(pose, self.markers.place_m[part, :2]), self.markers.place_m[part, 2]])
