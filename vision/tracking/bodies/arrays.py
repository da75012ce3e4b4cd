"""What one camera's tracker holds of the bodies, as arrays that compiled code changes in place."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vision.markers.row import N_FIT

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class ViewGeometry(NamedTuple):
    """What stays: ``camera`` (`planar_pose.packed`), ``first`` (b + 1,) first marker of each body, ``tolerance_m`` (b,)
    by which its markers may lie off the layout, ``rig_m`` radius of the rig.
    """

    camera: Floats
    first: Ints
    tolerance_m: Floats
    rig_m: float


class BodyStates(NamedTuple):
    """Bodies when last seen: ``pose`` (b, 3), ``velocity``, ``velocity_change`` and ``acceleration`` per frame (b, 3);
    ``step_m`` (b,) largest step from one frame to the next, ``scatter_m`` (b,) usual rms of its markers, ``last_frame``
    (b,), ``n_learned`` (b,) frames learned from.
    """

    pose: Floats
    velocity: Floats
    velocity_change: Floats
    acceleration: Floats
    step_m: Floats
    scatter_m: Floats
    last_frame: Ints
    n_learned: Ints


class BodyMeasurements(NamedTuple):
    """Bodies in this frame: ``predicted`` and measured ``pose`` (b, 3), ``rms_m`` (b,) and number (b,) of the markers
    behind it.
    """

    predicted: Floats
    pose: Floats
    rms_m: Floats
    n_markers: Ints


class MarkerStates(NamedTuple):
    """Markers when last seen: ``place_m`` (n, 3) in the body's frame, as this camera sees it, ``disc`` (n, 20) columns
    of `vision.markers.row`, ``radius_m`` (n,); ``n_sized``, ``n_placed`` (n,) frames behind radius and place.
    """

    place_m: Floats
    disc: Floats
    radius_m: Floats
    n_sized: Ints
    n_placed: Ints


class MarkerDetections(NamedTuple):
    """Markers in this frame: ``disc`` (n, 20), ``xy_m`` (n, 2) in the world, ``radius_m`` (n,), ``used`` (n,) 0/1."""

    disc: Floats
    xy_m: Floats
    radius_m: Floats
    used: Ints


class TrackState(NamedTuple):
    """What a camera's tracker knows.  Poses are (x, y, angle) of each body on its plane; b bodies, n markers.

    ``floats``, ``ints``: the memory in which all arrays but the geometry's lie; a copy of it is a way back.
    """

    geometry: ViewGeometry
    bodies: BodyStates
    measured: BodyMeasurements
    markers: MarkerStates
    detections: MarkerDetections
    floats: Floats
    ints: Ints


def new_state(camera: Floats, first: Ints, tolerance_m: Floats, rig_m: float) -> TrackState:
    """A state of nothing seen; see `ViewGeometry`."""
    b, n = len(first) - 1, int(first[-1])
    poses = 6 * 3 * b
    floats = np.zeros(poses + 3 * b + n * (3 + 2 * N_FIT + 2 + 2))
    ints = np.zeros(3 * b + 3 * n, np.int64)
    free_floats, free_ints = floats, ints

    def some(*shape: int) -> Floats:
        nonlocal free_floats
        own, free_floats = np.split(free_floats, [math.prod(shape)])
        return own.reshape(shape)

    def counts(size: int) -> Ints:
        nonlocal free_ints
        own, free_ints = np.split(free_ints, [size])
        return own

    return TrackState(
        ViewGeometry(camera, first, tolerance_m, rig_m),
        BodyStates(some(b, 3), some(b, 3), some(b, 3), some(b, 3), some(b), some(b), counts(b), counts(b)),
        BodyMeasurements(some(b, 3), some(b, 3), some(b), counts(b)),
        MarkerStates(some(n, 3), some(n, N_FIT), some(n), counts(n), counts(n)),
        MarkerDetections(some(n, N_FIT), some(n, 2), some(n), counts(n)),
        floats,
        ints,
    )
