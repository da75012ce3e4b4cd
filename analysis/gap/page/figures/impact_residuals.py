"""Residuals of the impacts and what they may go with."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from analysis.contact.held_laws import since_before
from analysis.contact.law import fit_restitution
from analysis.contact.restitution import restitution_design
from analysis.gap.selection.impacts.fit import ImpactFit

Array = NDArray[np.float64]

DEGREES = 180 / np.pi
# Below this tangential impulse per mass its share of the law is mostly noise.
WEAK_M_PER_S = 0.02


def covariate_of(fitted: ImpactFit, name: str) -> Array:
    """A covariate (K,) of the usable impacts; angles in degrees from -180 to 180."""
    d = fitted.data
    angles = {
        "azimuth in the room": d.at.azimuth_rad,
        "azimuth in the Host": d.at.azimuth_rad - d.at.host_angle_rad,
        "azimuth in the disk": fitted.wall.impacts.body_rad[d.at.index],
        "drive phase": d.at.drive_rad,
        "clock of the drive": d.at.drive_rad - d.at.drive_start_rad,
    }
    if name in angles:
        return np.asarray(DEGREES * np.angle(np.exp(1j * angles[name])), float)
    plain: dict[str, Array] = {
        "approach speed": d.before,
        "slip": d.slip,
        "tangential impulse": d.tangential_impulse,
        "spin before": d.at.spin,
        "time in the run": d.at.time_s,
        "run": d.at.run.astype(float) + 1,
        "time since the impact before": 1e3 * since_before(d),
    }
    return plain[name]


def residual_of(fitted: ImpactFit, restitution_terms: Sequence[str], residual: str, put_back: str = "") -> Array:
    """One residual (K,) per usable impact; ``put_back`` names a centre whose offset the nominal wall has taken up
    already.
    """
    d = fitted.data
    if residual == "restitution":
        design = restitution_design(d, restitution_terms)
        return np.asarray(d.after / d.before - design @ fit_restitution(d, design)[0], float)
    if residual == "distance":
        r = fitted.wall.residual_m[d.at.index]
        if put_back in ("wall_centre_offset", "mass_centre_offset"):
            # The layout's wall, not the recalibrated one, is what the effect is an error of.
            impacts, wall = fitted.wall.impacts, fitted.wall.wall
            if put_back == "wall_centre_offset":
                off, seen = wall.centre_m, impacts.normal_rad - impacts.junctions.host[:, 3]
            else:
                off, seen = -wall.disk_m, impacts.body_rad
            r = r + (np.cos(seen) * off[0] + np.sin(seen) * off[1])[d.at.index]
        return 1e6 * r
    if residual == "angular":
        return 1e3 * d.angular
    law = np.abs(fitted.tangential_impulse(d))
    return np.asarray(
        np.where(law > WEAK_M_PER_S, 100 * (np.abs(d.tangential_impulse) / np.maximum(law, 1e-9) - 1), np.nan), float
    )
