"""How brightness changes across an expected edge: smoothed derivatives of a picture along the normals of a curve."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vision.compiled import compiled

Floats = NDArray[np.float64]

STEP_PX = 0.5  # between two samples of a profile
SMOOTH_PX = 1.0  # sd of the derivative's Gaussian: about the edge's own width
_KERNEL_SDS = 4  # of the Gaussian that its kernel holds
_HALF = round(_KERNEL_SDS * SMOOTH_PX / STEP_PX)  # samples of its kernel to each side


@compiled
def _cubic(image: NDArray[Any], u: float, v: float) -> float:
    """Brightness between pixels, by cubic convolution (Keys 1981, a = -1/2); all sixteen neighbours must lie in the
    picture.
    """
    j, i = math.floor(u), math.floor(v)
    x, y = u - j, v - i
    total = 0.0
    for k in range(4):
        row = image[i - 1 + k]
        along = (
            row[j - 1] * (x * (-0.5 + x * (1.0 - 0.5 * x)))
            + row[j] * (1.0 + x * x * (-2.5 + 1.5 * x))
            + row[j + 1] * (x * (0.5 + x * (2.0 - 1.5 * x)))
            + row[j + 2] * (x * x * (-0.5 + 0.5 * x))
        )
        if k == 0:
            weight = y * (-0.5 + y * (1.0 - 0.5 * y))
        elif k == 1:
            weight = 1.0 + y * y * (-2.5 + 1.5 * y)
        elif k == 2:
            weight = y * (0.5 + y * (2.0 - 1.5 * y))
        else:
            weight = y * y * (-0.5 + 0.5 * y)
        total += weight * along
    return total


@compiled
def slopes(image: NDArray[Any], uv: Floats, normal: Floats, reach_px: float) -> tuple[Floats, Floats]:
    """Smoothed derivative of the brightness along normals, by ramps true to scale.

    Parameters
    ----------
    image : (h, w) uint8 or uint16;  uv, normal : (n, 2) window pixels, and unit vectors
    reach_px : how far to both sides

    Returns
    -------
    Offsets (m,) [px] and derivatives (n, m) [grey levels per px]; NaN along a normal whose profile leaves the picture.
    """
    side = math.ceil(reach_px / STEP_PX - 1e-9)
    many = 2 * (side + _HALF) + 1
    kernel = np.empty(2 * _HALF + 1)
    for k in range(2 * _HALF + 1):
        at = (k - _HALF) * STEP_PX
        kernel[k] = at * math.exp(-0.5 * (at / SMOOTH_PX) ** 2)
    scale = 0.0
    for k in range(2 * _HALF + 1):
        scale += kernel[k] * (k - _HALF) * STEP_PX
    kernel /= scale
    along = np.empty(2 * side + 1)
    for k in range(2 * side + 1):
        along[k] = (k - side) * STEP_PX
    out = np.empty((len(uv), 2 * side + 1))
    profile = np.empty(many)
    height, width = image.shape
    for n in range(len(uv)):
        inside = True
        for k in range(many):
            off = (k - side - _HALF) * STEP_PX
            u, v = uv[n, 0] + off * normal[n, 0], uv[n, 1] + off * normal[n, 1]
            inside = inside and 1.0 <= u < width - 2.0 and 1.0 <= v < height - 2.0
            profile[k] = _cubic(image, u, v) if inside else 0.0
        for k in range(2 * side + 1):
            total = 0.0
            for j in range(2 * _HALF + 1):
                total += kernel[j] * profile[k + j]
            out[n, k] = total if inside else np.nan
    return along, out
