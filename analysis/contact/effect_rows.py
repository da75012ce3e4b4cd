"""Effects of the library in table ``identification``: which rows tell the size of each, and the sizes that they tell.

``ovines identify`` writes the rows, ``compare`` simulates and ``diagnose`` tells what they say: one set of numbers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from analysis.contact.restitution import DIRECTION, DRIFT, SPEED
from analysis.flights.equation.model import GRAVITY_M_PER_S2

#: effect of a wall in which the disk is for a while
CONTACT_TIME = "finite_contact_time"
Sized = dict[str, tuple[float, float]]
#: effect -> parameter -> (row, factor)
ROWS: dict[str, dict[str, tuple[str, float]]] = {
    "floor_friction": {"coefficient": ("floor_friction", 1.0)},
    "viscous_drag": {"rate_per_s": ("viscous_drag_per_s", 1.0)},
    "air_drag": {"rate_per_m": ("air_drag_per_m", 1.0)},
    SPEED: {
        "restitution_fast": ("restitution_fast", 1.0),
        "speed_scale_m_per_s": ("restitution_speed_scale_m_per_s", 1.0),
    },
    DIRECTION: {
        "amplitude": ("restitution_direction_amplitude", 1.0),
        "direction_rad": ("restitution_direction_rad", 1.0),
    },
    DRIFT: {
        "relative_per_s": ("restitution_drift_per_s", 1.0),
        "relative_per_run": ("restitution_drift_per_run", 1.0),
    },
    "inertia_error": {"ratio": ("inertia_ratio", 1.0)},
    CONTACT_TIME: {"duration_s": ("contact_duration_s", 1.0)},
    "wall_centre_offset": {"x_m": ("wall_centre_x_m", 1.0), "y_m": ("wall_centre_y_m", 1.0)},
    "mass_centre_offset": {"x_m": ("disk_centre_x_m", -1.0), "y_m": ("disk_centre_y_m", -1.0)},
    "wall_lobes": {
        "amplitude": ("wall_lobe_amplitude", 1.0),
        "order": ("wall_lobe_order", 1.0),
        "direction_rad": ("wall_lobe_direction_rad", 1.0),
    },
}
#: effect -> names of its size and direction, rows of its two components, what a component is divided by, and how many
#: times the direction turns when the components turn once
VECTORS: dict[str, tuple[str, tuple[str, str], float, int]] = {
    "table_tilt": ("tilt_rad", ("table_tilt_x_m_per_s2", "table_tilt_y_m_per_s2"), GRAVITY_M_PER_S2, 1),
    "wall_ellipticity": ("ellipticity", ("wall_ellipticity_cos", "wall_ellipticity_sin"), 1.0, 2),
}
# Of a direction nothing is known where its vector is as small as this (of its unit).
NO_DIRECTION = 1e-12


def told_effects(table: pd.DataFrame, names: Sequence[str]) -> dict[str, Sized]:
    """Parameters (value, sd) of the effects ``names`` as table ``identification`` tells them, in the world; without
    those of which it has no row with a value."""
    rows = {str(row.parameter): (float(row.value), float(row.sd)) for row in table.itertuples()}
    found: dict[str, Sized] = {}
    for name in names:
        if name in VECTORS:
            sizes = _vector(rows, *VECTORS[name])
        else:
            told = {p: (*rows.get(row, (np.nan, np.nan)), factor) for p, (row, factor) in ROWS.get(name, {}).items()}
            sizes = {p: (factor * value, sd) for p, (value, sd, factor) in told.items() if np.isfinite(value)}
        if sizes:
            found[name] = sizes
    return found


def _vector(rows: dict[str, tuple[float, float]], size: str, pair: tuple[str, str], unit: float, turns: int) -> Sized:
    if not set(pair) <= set(rows):
        return {}
    (x, x_sd), (y, y_sd) = (rows[name] for name in pair)
    length = max(float(np.hypot(x, y)), NO_DIRECTION)
    sd, turned = float(np.hypot(x * x_sd, y * y_sd)) / length, float(np.hypot(y * x_sd, x * y_sd)) / length
    return {
        size: (length / unit, sd / unit),
        "direction_rad": (float(np.arctan2(y, x)) / turns, turned / length / turns),
    }
