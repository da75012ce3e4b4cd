"""One table of positions: the columns of a fitted disc, and the order of the unknowns that its fit solves for.

Compiled code holds these numbers (see `vision.compiled`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vision.compiled import inlined

Array = NDArray[np.float64]

# Columns of a disc: centre [px]; ellipse, x' M x = 1 on the edge [1/px^2]; squared blur [px^2]; level and contrast
# [grey levels] and their slopes [grey levels/px].  A fit begins from these 14.
U, V, M11, M12, M22, S11, S12, S22, LEVEL, LEVEL_U, LEVEL_V, CONTRAST, CONTRAST_U, CONTRAST_V = range(14)
# What the fit is worth: sd of the centre per axis [px]; rms of the flat pixels and of the edge pixels [grey levels];
# share of the window inside the picture; share of edge pixels clipped, plus the flags below; 1 where it is a disc.
SD, NOISE, MISFIT, COVERAGE, OUTLIERS, OK = range(14, 20)
N_FIT = 20
# Added to OUTLIERS, a share below 1: the residual is more than noise; the fit was made by sectors.
STRUCTURED = 1.0
BY_SECTORS = 2.0

# Steps of a fit: the even unknowns, which keep their sign under reflection about the centre, then the odd ones.
# fmt: off
(
    D_LEVEL, D_CONTRAST, D_M11, D_M12, D_M22, D_S11, D_S12, D_S22,
    D_U, D_V, D_LEVEL_U, D_LEVEL_V, D_CONTRAST_U, D_CONTRAST_V,
) = range(14)
# fmt: on
N_UNKNOWNS = 14
N_EVEN, N_EVEN_HELD = 8, 2  # even unknowns; those left where shape and blur are held
N_ODD, N_ODD_SHARED = 6, 4  # odd unknowns; those left where the contrast has no slope of its own
FIRST_ODD = D_U


@inlined
def determinant(disc: Array) -> float:
    """Determinant of the ellipse's matrix [1/px^4]."""
    return disc[M11] * disc[M22] - disc[M12] * disc[M12]


def disc_start(
    u_px: float, v_px: float, radius_px: float, level: float, contrast: float, blur_px: float = 0.9
) -> Array:
    """A starting row for `vision.markers.fit.fit_discs`: a circle of one brightness on one background."""
    row = np.zeros(N_FIT)
    row[[U, V, M11, M22, S11, S22]] = u_px, v_px, radius_px**-2, radius_px**-2, blur_px**2, blur_px**2
    row[LEVEL], row[CONTRAST] = level, contrast
    return row


def radius_px(fits: Array) -> Array:
    """Geometric mean radius [px] of fitted ellipses, shape (n, 20) -> (n,)."""
    return (fits[..., M11] * fits[..., M22] - fits[..., M12] ** 2) ** -0.25
