"""The disk's moment of inertia against the stated one: tangential impulses against the spins that they make.

An impulse j at the rim turns the disk by ``j / (q m R)`` whatever the contact's law, stick or slide, so that an error
of q is told apart from any tangential restitution wherever the disk's angle is seen; without it the two are one.  A
disk's radius (or unit of length) that is off by as much looks alike.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.contact.impacts import intersect
from analysis.contact.law import LawData, law_data
from analysis.contact.wall_fit import fit_wall
from analysis.flights.stated_terms import stated_sizes
from analysis.gap.cause import Cause, Structure, two_sided
from analysis.gap.selection.flight_candidates import FlightFit
from analysis.gap.selection.impact_candidates import wall_prior
from analysis.gap.series import Series
from analysis.gap.thresholds import IMPACT_GAIN, IMPROVED, SIGNIFICANCE
from analysis.statistics.gain import CUT_SD, regress

Array = NDArray[np.float64]
# An inertia computed from a drawing is right to this share: holes, rims and markers make more.
NEGLIGIBLE = 0.02
# Errors of an impulse beyond the flights' covariance, as a share of the normal one, as the angular probes have it.
SHARE_OF_NORMAL = 0.002
# Spins known worse than this (m/s at the rim) tell nothing: a motion without angles.
KNOWN_SPIN_M_PER_S = 1.0
FEWEST_IMPACTS = 15


@dataclass(frozen=True, eq=False)
class InertiaStep:
    """``ratio`` of the true inertia to the one in use, with its ``sd`` (None: not told by these data), whether it is
    ``found``; ``impulse`` and ``angular`` (K,; m/s) that it is told by, ``held_out`` (R,): what the other runs' ratio
    takes of each run's sum of squares over the variance."""

    ratio: float = 1.0
    sd: float = float("inf")
    gain: float = 0.0
    found: bool = False
    stated: float = 1.0
    impulse: Array | None = None
    angular: Array | None = None
    held_out: Array | None = None

    def cause(self, series: Series) -> list[Cause]:
        """It as a cause; nothing where it is not found."""
        if not self.found:
            return []
        rivals = () if series.layouts is not None else ("length_scale_error",)
        parameters = {"ratio": (self.stated * self.ratio, self.stated * self.sd)}
        strength = abs(self.ratio - 1) / NEGLIGIBLE
        return [Cause("inertia_error", "geometry", parameters, strength, self.gain, "spin", "impact", rivals)]

    def structure(self) -> list[Structure]:
        """It where it has no name."""
        size = abs(self.ratio - 1)
        p = two_sided((self.ratio - 1) / self.sd)
        what = "the tangential impulse"
        return [Structure("geometry", "impact", "spin", what, size / NEGLIGIBLE, self.gain, size, "1", p)]


def with_inertia(series: Series, ratio: float) -> Series:
    """The disk's inertia factor times ``ratio``."""
    runs = [replace(run, data=replace(run.data, inertia_factor=ratio * run.data.inertia_factor)) for run in series.runs]
    return replace(series, runs=tuple(runs))


def stated_ratio(series: Series) -> float:
    """The ratio that ``[model.effect_parameters]`` gives; 1 where it gives none."""
    return stated_sizes(series.recordings[0].model).get("inertia_error", {}).get("ratio", 1.0)


def inertia_step(flights: FlightFit, inertia_factor: float, stated: float) -> InertiaStep:
    """The inertia that the impacts between ``flights`` show, against ``inertia_factor``.

    A force that the flights lack bends their ends, and with them the impulses: only flights that hold what acts on them
    tell an inertia."""
    run = flights.fits[0].run
    junctions = intersect(flights.fits)
    if len(junctions) < FEWEST_IMPACTS:
        return InertiaStep(stated=stated)
    wall = fit_wall(junctions, run.wall, run.wall.nominal_terms, wall_prior(run.wall))
    data = law_data(wall.impacts, wall.used, run.radius_m, inertia_factor)
    if len(data) < FEWEST_IMPACTS or not np.median(data.angular_sd) < KNOWN_SPIN_M_PER_S:
        return InertiaStep(stated=stated)
    sd = np.sqrt(data.angular_sd**2 + (SHARE_OF_NORMAL * data.normal_impulse) ** 2)
    columns = np.column_stack([np.ones(len(data)), data.tangential_impulse])
    gain, (slope,), (slope_sd,), _, significance = regress(columns, data.angular, sd)
    # angular / j = (q - q_true) / (1 + q_true), j being computed with q.
    q = inertia_factor
    ratio = (q - slope) / (1 + slope) / q
    ratio_sd = float(slope_sd) * (1 + q) / (1 + slope) ** 2 / q
    held_out = _held_out(data, columns, sd, len(flights.fits))
    hit = np.unique(data.run)
    found = (
        gain > IMPACT_GAIN
        and significance > SIGNIFICANCE
        and abs(ratio - 1) > NEGLIGIBLE
        and float(np.mean(held_out[hit] > 0)) >= IMPROVED
    )
    return InertiaStep(
        float(ratio), ratio_sd, gain, bool(found), stated, data.tangential_impulse, data.angular, held_out
    )


def _held_out(data: LawData, columns: Array, sd: Array, runs: int) -> Array:
    """Fall of the sum of squares (R,) of each run by the other runs' slope; single errors are cut."""
    out = np.zeros(runs)
    for run in np.unique(data.run):
        here = data.run == run
        rest = ~here if np.count_nonzero(~here) >= FEWEST_IMPACTS else np.ones(len(data), bool)
        slope = regress(columns[rest], data.angular[rest], sd[rest])[1][0]
        before, after = (data.angular[here] - k * data.tangential_impulse[here] for k in (0.0, slope))
        cut = [np.sum(np.minimum((one / sd[here]) ** 2, (4 * CUT_SD) ** 2)) for one in (before, after)]
        out[run] = cut[0] - cut[1]
    return out
