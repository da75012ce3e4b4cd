"""What no accepted term explains in the flights: missing acceleration against covariates that nobody chose by hand.

Every component of the missing acceleration is held against every covariate: means over its bins, learnt on the other
runs, predict the pieces of a run.  How much the best pair may gain by chance is given by the same data with each
flight's accelerations turned about at random, which keeps their sizes and what goes on within a flight.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.flights.cutting.runs import Run
from analysis.gap.cause import Structure
from analysis.gap.selection.flight_candidates import Units
from analysis.gap.selection.flights.fit import FlightFit
from analysis.gap.selection.flights.missing_acceleration import (
    CIRCULAR,
    COMPONENTS,
    LONG,
    SHORT,
    missing_acceleration,
    residual_frames,
)
from analysis.gap.selection.null_distribution import by_chance
from ovines.robust import residual_sd

Array = NDArray[np.float64]
# Bins of a covariate, drawn turns, and pieces that are enough to ask.
BINS, TURNS, FEWEST_PIECES = 8, 300, 40
# One series in a hundred over four stages.
LEVEL = 0.01 / 4
# What an effect leaves of its own by an imperfect law or a lens residual, as a share of its size.
SHARE_OF_NAMED = 0.1
# A piece counts as if it were no farther from zero than so many robust sds.
CUT_SD = 4.0


def left_in_flights(
    runs: Sequence[Run], fitted: FlightFit, units: Units, rng: np.random.Generator, named: float = 0.0
) -> tuple[Structure | None, float]:
    """The pair of component and covariate in which held-out runs show most that the model lacks (None where chance
    shows as much, or where it is negligible), and how often chance shows as much (1 where it is negligible).

    ``named``: size (m/s^2) of the strongest effect that has a name; a tenth of it may stay where its law is
    imperfect."""
    frames = residual_frames(runs, fitted, without_lens=True)
    best: tuple[float, float, float, str, str] | None = None
    for length in (LONG, SHORT):
        pieces = missing_acceleration(frames, length)
        if len(pieces) < FEWEST_PIECES or pieces["run"].nunique() < 2:
            continue
        gain, p, size, component, covariate = _best_pair(pieces, rng)
        if best is None or p < best[1]:
            best = gain, p, size, component, covariate
    if best is None:
        return None, 1.0
    gain, p, size, component, covariate = best
    p = min(2 * p, 1.0)
    if component == "spin":
        size *= runs[0].data.radius_m * runs[0].data.inertia_factor
    if size < units.negligible_m_per_s2 + SHARE_OF_NAMED * named:
        return None, 1.0
    if p > LEVEL:
        return None, p
    found = Structure(
        "flight",
        "free flight",
        {"y": "y", "spin": "angle"}.get(component, "x"),
        f"the {covariate} (acceleration {component})",
        size / units.negligible_m_per_s2,
        gain,
        size,
        "m/s^2",
        p,
    )
    return found, p


def _best_pair(pieces: pd.DataFrame, rng: np.random.Generator) -> tuple[float, float, float, str, str]:
    """Gain, probability by chance, size, component and covariate of the best pair."""
    components = [c for c in COMPONENTS if pieces[c].notna().mean() > 0.5]
    covariates = [  # some that nobody measured in any piece tell nothing
        c for c in pieces if c not in (*COMPONENTS, "number", "weight", "run") and pieces[c].notna().any()
    ]
    weight = pieces["weight"].to_numpy(float)
    values = np.stack([_standard(pieces[c].to_numpy(float), weight) for c in components])
    run = np.unique(pieces["run"], return_inverse=True)[1]
    flight = np.unique(pieces["number"], return_inverse=True)[1]
    bins = {c: _bins(pieces[c].to_numpy(float), c in CIRCULAR) for c in covariates}
    turns = np.vstack([np.ones((1, flight.max() + 1)), rng.choice([-1.0, 1.0], (TURNS, flight.max() + 1))])[:, flight]
    gains = np.stack([_held_out(values, turns, one, run) for one in bins.values()])  # (covariates, turns, components)
    at = np.unravel_index(int(np.argmax(gains[:, 0])), gains[:, 0].shape)
    covariate, component = list(bins)[at[0]], components[at[1]]
    null = gains[:, 1:].max((0, 2))
    one = bins[covariate]
    acceleration = pieces[component].to_numpy(float)
    ok = (one >= 0) & np.isfinite(acceleration)
    total = np.bincount(one[ok], weight[ok], BINS)
    mean = np.bincount(one[ok], weight[ok] * acceleration[ok], BINS) / np.maximum(total, 1e-300)
    size = float(np.sqrt(np.sum(total * mean**2) / total.sum()))
    gain = float(gains[at[0], 0, at[1]])
    return gain, by_chance(null, gain), size, component, covariate


def _standard(acceleration: Array, weight: Array) -> Array:
    """Accelerations over their scatter, drawn in where far off; 0 where unknown."""
    z = acceleration * np.sqrt(weight)
    known = np.isfinite(z)
    scale = max(residual_sd(z[known]), 1e-300) if known.any() else 1.0
    return np.where(known, np.clip(np.nan_to_num(z) / scale, -CUT_SD, CUT_SD), 0.0)


def _bins(values: Array, circular: bool) -> NDArray[np.int64]:
    """Bin of each piece: equal parts of a circle, else equal numbers; -1 where the covariate is unknown."""
    known = np.isfinite(values)
    if circular:
        at = np.floor((values + 180.0) / 360.0 * BINS)
    else:
        at = np.searchsorted(np.quantile(values[known], np.linspace(0, 1, BINS + 1)[1:-1]), values, side="right")
    return np.where(known, np.clip(np.nan_to_num(at), 0, BINS - 1), -1).astype(np.int64)


def _held_out(values: Array, turns: Array, bins: NDArray[np.int64], run: NDArray[np.int64]) -> Array:
    """Fall of the sum of squares (turns, components) when each run is predicted by the others' means over the bins."""
    known = bins >= 0
    cell = (run * BINS + bins)[known]
    cells = (run.max() + 1) * BINS
    member = np.zeros((known.sum(), cells))
    member[np.arange(known.sum()), cell] = 1.0
    count = member.sum(0)
    turned = turns[:, None, known] * values[None, :, known]
    sums = (turned.reshape(-1, known.sum()) @ member).reshape(*turned.shape[:2], -1, BINS)
    count = count.reshape(-1, BINS)
    others = (sums.sum(2, keepdims=True) - sums) / np.maximum(count.sum(0) - count, 1.0)
    # A mean of n pieces is as uncertain as one piece over n: it is drawn to zero by what it would gain without effect.
    return np.asarray(np.sum(2 * others * sums - others**2 * count, (2, 3)))
