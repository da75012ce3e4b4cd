"""Effects of the library in table ``identification``: which rows tell the size of each, and the sizes that they tell.

``ovines identify`` writes the rows, ``compare`` simulates and ``diagnose`` tells what they say: one set of numbers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from ovines.core.effects import EFFECTS
from ovines.core.effects.effect import VectorRows

#: effect of a wall in which the disk is for a while
CONTACT_TIME = "finite_contact_time"
Sized = dict[str, tuple[float, float]]
# Of a direction nothing is known where its vector is as small as this (of its unit).
NO_DIRECTION = 1e-12


def reported_effects(table: pd.DataFrame, names: Sequence[str]) -> dict[str, Sized]:
    """Parameters (value, sd) of the effects ``names`` as table ``identification`` tells them, in the world; without
    those of which it has no row with a value."""
    rows = {str(row.parameter): (float(row.value), float(row.sd)) for row in table.itertuples()}
    found: dict[str, Sized] = {}
    for name in names:
        effect = EFFECTS.get(name)
        if effect is None:
            continue
        if effect.rows is not None:
            size, direction = (one.name for one in effect.parameters)
            sizes = _vector(rows, (size, direction), effect.rows)
        else:
            estimates = {p: (*rows.get(p.row, (np.nan, np.nan)), p.times) for p in effect.parameters if p.row}
            sizes = {p.name: (times * value, sd) for p, (value, sd, times) in estimates.items() if np.isfinite(value)}
        if sizes:
            found[name] = sizes
    return found


def _vector(rows: dict[str, tuple[float, float]], names: tuple[str, str], vector: VectorRows) -> Sized:
    if not set(vector.rows) <= set(rows):
        return {}
    (x, x_sd), (y, y_sd) = (rows[name] for name in vector.rows)
    length = max(float(np.hypot(x, y)), NO_DIRECTION)
    sd, turned = float(np.hypot(x * x_sd, y * y_sd)) / length, float(np.hypot(y * x_sd, x * y_sd)) / length
    return {
        names[0]: (length / vector.unit, sd / vector.unit),
        names[1]: (float(np.arctan2(y, x)) / vector.turns, turned / length / vector.turns),
    }
