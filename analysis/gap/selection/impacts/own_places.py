"""Whether the wall lies elsewhere in each run, in no order: a ring that is bolted on anew before it.

A place of each run's own is no formula, for nothing says where the next one will lie; but the runs say where they
do."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from analysis.contact.wall_fit import WallFit
from analysis.gap.cause import SMALLEST_P, RunPlace
from analysis.gap.selection.impacts.covariates import FEWEST_RUNS
from ovines.robust import residual_sd

Array = NDArray[np.float64]
# Impacts of a run that tell its place, and robust sds beyond which one counts no more; rounds in which that is found.
FEWEST_IMPACTS, CUT_SD, ROUNDS = 6, 4.0, 3
# Less likely by chance than this.
BY_CHANCE = 1e-6
# What goes with the run - evenly, or at once - explains less than this share of where the runs lie.
IN_ORDER = 0.7


def own_places(wall: WallFit) -> tuple[tuple[RunPlace, ...], float, float, float]:
    """Where the wall lies in each run, off its mean place; how far that moves contact distances (m, RMS), the fall of
    -2 log L, and how often chance makes as much of it.  Nothing where runs do not differ surely, or in order."""
    nothing = ((), 0.0, 0.0, 1.0)
    run, normal = wall.impacts.junctions.run, wall.impacts.normal_rad
    numbers = [int(r) for r in np.unique(run[wall.used]) if np.count_nonzero(wall.used & (run == r)) >= FEWEST_IMPACTS]
    if len(numbers) < FEWEST_RUNS:
        return nothing
    use = wall.used & np.isin(run, numbers)
    which, residual = np.searchsorted(numbers, run[use]), wall.residual_m[use]
    along = np.column_stack([np.cos(normal[use]), np.sin(normal[use])])
    count = len(numbers)
    # A constant and a place of all runs are the wall's own, which have been fitted.
    columns = np.zeros((len(residual), 2 * count))
    for k in range(count):
        columns[which == k, 2 * k : 2 * k + 2] = along[which == k]
    every = np.column_stack([columns, np.ones(len(residual))])
    weight, sd = np.ones(len(residual)), residual_sd(residual)
    before = residual_sd(residual)
    for _ in range(ROUNDS):
        fit = np.linalg.lstsq(every * weight[:, None], residual * weight, rcond=None)[0]
        left = residual - every @ fit
        sd = max(residual_sd(left), 1e-12)
        weight = np.sqrt(np.minimum(1.0, CUT_SD * sd / np.maximum(np.abs(left), 1e-300)))
    free = max(len(residual) - 2 * count - 1, 1)
    # Of what a fit leaves the noise is larger, by what the fit has taken.
    sd *= float(np.sqrt(len(residual) / free))
    limit = CUT_SD * sd
    moved = columns @ fit[: 2 * count]
    wide, narrow = (np.sum(np.clip(one, -limit, limit) ** 2) for one in (residual, residual - every @ fit))
    gain = float(wide - narrow) / sd**2
    # The mean of all runs is free in the wall.
    p = max(float(chdtrc(2 * count - 2, max(gain, 0.0))), SMALLEST_P)
    places = fit[: 2 * count].reshape(count, 2)
    places = places - places.mean(0)
    if p > BY_CHANCE or before <= sd or _in_order(np.array(numbers, float), places) > IN_ORDER:
        return nothing
    information = [columns[which == k, 2 * k : 2 * k + 2] for k in range(count)]
    sds = [sd * float(np.sqrt(0.5 * np.trace(np.linalg.pinv(one.T @ one)))) for one in information]
    run_places = tuple(RunPlace(n, float(x), float(y), s) for n, (x, y), s in zip(numbers, places, sds, strict=True))
    return run_places, float(np.std(moved)), gain, p


def _in_order(number: Array, places: Array) -> float:
    """The share of where the runs lie (R, 2) that a line over them explains, or a step between any two."""
    whole = float(np.sum(places**2))
    forms = [number, *(number > number[k] for k in range(len(number) - 1))]
    shares = []
    for form in forms:
        one = form - np.mean(form)
        shares.append(float(np.sum((one @ places) ** 2)) / float(one @ one) / max(whole, 1e-300))
    # Of few runs a step explains much by chance: each has used a freedom.
    return 1 - (1 - max(shares)) * (len(number) - 1) / max(len(number) - 2, 1)
