"""What the adjustment knows and seeks: observations of boards, the state, what is free and believed of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ovines.camera import Camera
from ovines.lens_field import LensField
from vision.pinhole import N_INTRINSICS, lens_of

Array = NDArray[np.float64]
Places = NDArray[np.intp]
POSE = ("rx", "ry", "rz", "tx", "ty", "tz")  # r: a rotation vector applied after the camera's own rotation
N_POSE = len(POSE)
N_ROTATION = 3  # of a pose's unknowns, then the translation
N_CAMERA = N_INTRINSICS + N_POSE  # unknowns of a camera
FIXED = -1  # number of the pose of the board that defines the world


@dataclass
class Observation:
    """A board's points in one image: ``points_m`` (n, 3), ``uv_px`` (n, 2), seen by ``camera``, the board at ``pose``.

    ``pose`` FIXED: the board defines the world.  ``in_world``: the pose is board -> world, else board -> camera.
    ``share``: sd of this image's points over that of all the camera's, found by `adjust`: a tilted board's are less
    sharp.
    """

    camera: int
    pose: int
    in_world: bool
    points_m: Array
    uv_px: Array
    share: float = 1.0


@dataclass
class State:
    """``intrinsics`` (C, N_INTRINSICS); camera poses and board poses as rotation matrices and translations; each
    camera's spline, or none of any.
    """

    intrinsics: Array
    camera_rotation: Array
    camera_translation: Array
    rotation: Array
    translation: Array
    splines: tuple[LensField | None, ...] = ()

    def __post_init__(self) -> None:
        if not self.splines:
            self.splines = (None,) * len(self.intrinsics)

    def copy(self) -> State:
        """A state with arrays of its own."""
        own = {name: np.array(value) for name, value in vars(self).items() if name != "splines"}
        return State(**own, splines=self.splines)

    def lens(self, c: int) -> Camera:
        """Camera ``c``, by itself: its pose is the world's."""
        return Camera("", (0, 0), *lens_of(self.intrinsics[c]), np.eye(3), np.zeros(3), spline=self.splines[c])


@dataclass(frozen=True, eq=False)
class SplinePrior:
    """What is believed of a spline's numbers beforehand: ``mean_px`` (F,) and ``precision`` (F, F) [1/px^2]."""

    mean_px: Array
    precision: Array


@dataclass
class Setting:
    """What is free (C, N_INTRINSICS), priors (as many) means and sd, sd of fy/fx - 1, the defining board's pose; priors
    of the cameras' splines (one for each camera that has a spline, or none of any).
    """

    free: NDArray[np.bool_]
    prior: Array
    prior_sd: Array
    aspect_sd: float
    world_from_board: Array
    camera_poses_free: bool = True
    # the misfit of tied views is neither camera's: without this one takes all the weight and the other all the misfit
    one_sigma: bool = False
    sigma_px: Array = field(default_factory=lambda: np.ones(0))
    spline_priors: tuple[SplinePrior | None, ...] = ()

    def lens_free(self, state: State, c: int) -> NDArray[np.bool_]:
        """Which of a lens' numbers are free: the intrinsics, then the spline (N_INTRINSICS + F,)."""
        return np.concatenate([self.free[c], np.ones(len(spline_places(state.splines, c)), bool)])


@dataclass
class Adjusted:
    """The state found, sd of a pixel coordinate per camera, residuals (measured - projected) per observation, and the
    covariance.

    ``covariance`` is over ``labels``: (camera, parameter) for intrinsics and camera poses, in that order, then for the
    cameras' splines.
    """

    state: State
    sigma_px: Array
    residuals_px: list[Array]
    camera_of: list[int]
    covariance: Array
    chi2: float
    labels: list[tuple[int, str]]

    def lens_covariance(self, c: int) -> Array:
        """Of camera ``c``'s intrinsics and spline, (N_INTRINSICS + F,) squared; NaN for what was held."""
        own = lens_places(self.state.splines, c)
        return self.covariance[np.ix_(own, own)]


def n_parameters(splines: Sequence[LensField | None]) -> int:
    """Of all cameras with these splines: N_CAMERA for each, then the splines' numbers."""
    return N_CAMERA * len(splines) + sum(0 if one is None else one.size for one in splines)


def spline_places(splines: Sequence[LensField | None], c: int) -> Places:
    """Where the numbers of camera ``c``'s spline stand among all cameras' parameters; empty where it has none."""
    first = N_CAMERA * len(splines) + n_parameters(splines[:c]) - N_CAMERA * c
    own = splines[c]
    return np.arange(first, first + (0 if own is None else own.size))


def lens_places(splines: Sequence[LensField | None], c: int) -> Places:
    """Where camera ``c``'s intrinsics and the numbers of its spline stand among all cameras' parameters."""
    return np.concatenate([np.arange(N_CAMERA * c, N_CAMERA * c + N_INTRINSICS), spline_places(splines, c)])


def camera_places(splines: Sequence[LensField | None], c: int) -> Places:
    """Where the numbers of camera ``c`` stand among all cameras': intrinsics, pose, spline."""
    return np.concatenate([np.arange(N_CAMERA * c, N_CAMERA * (c + 1)), spline_places(splines, c)])
