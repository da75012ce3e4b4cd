"""The disk's geometric centre seen from its centre of mass, as the impacts show it: there the floor's friction acts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from analysis.contact.wall_fit import WallFit
from analysis.flights.cutting.runs import Run
from analysis.walls.outlines import DISK_TERMS

# Of the contact radius: what turning and gluing leave of the mass centre (0.05 mm of 40 mm).
MASS_CENTRE_NEGLIGIBLE = 1.25e-3
# An offset counts from so many of its sds on.
SURE_SD = 5.0


def middle_of_disk(wall: WallFit) -> tuple[float, float]:
    """The geometric centre (m, in the disk's frame) from the centre of mass; (0, 0) where the two may be one."""
    terms = list(wall.terms)
    if not set(DISK_TERMS) <= set(terms):
        return 0.0, 0.0
    x_m, y_m = map(float, wall.wall.disk_m)
    sd_m = max(float(np.sqrt(wall.covariance[terms.index(term), terms.index(term)])) for term in DISK_TERMS)
    size_m = float(np.hypot(x_m, y_m))
    sure = size_m > max(MASS_CENTRE_NEGLIGIBLE * wall.wall.size_m, SURE_SD * sd_m)
    return (x_m, y_m) if sure else (0.0, 0.0)


def same_middle(one: tuple[float, float], other: tuple[float, float], size_m: float) -> bool:
    """Whether two geometric centres differ by no more than is negligible in a wall of ``size_m``."""
    return bool(np.hypot(one[0] - other[0], one[1] - other[1]) < MASS_CENTRE_NEGLIGIBLE * size_m)


def with_middle(runs: Sequence[Run], middle_m: tuple[float, float]) -> list[Run]:
    """``runs`` of a disk whose geometric centre is at ``middle_m``."""
    return [replace(run, data=replace(run.data, middle_m=middle_m)) for run in runs]
