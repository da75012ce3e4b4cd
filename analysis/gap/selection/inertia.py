"""The disk's moment of inertia against the stated one, by its impacts (:mod:`analysis.contact.inertia`)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.contact.impacts import intersect
from analysis.contact.inertia import FEWEST_IMPACTS, fit_inertia
from analysis.contact.law import law_data
from analysis.contact.wall_fit import WallFit, fit_wall
from analysis.flights.stated_terms import stated_sizes
from analysis.gap.cause import Cause, Structure, two_sided
from analysis.gap.selection.flights.fit import FlightFit, fit
from analysis.gap.selection.impacts.fit import wall_prior
from analysis.gap.series import Series
from analysis.gap.thresholds import IMPACT_GAIN, IMPROVED, SIGNIFICANCE

Array = NDArray[np.float64]
# An inertia computed from a drawing is right to this share: holes, rims and markers make more.
NEGLIGIBLE = 0.02


@dataclass(frozen=True, eq=False)
class InertiaStep:
    """``ratio`` of the true inertia to the one in use, with its ``sd`` (None: not determined by these data), whether it
    is ``found``; ``impulse`` and ``angular`` (K,; m/s) that it is fitted to, ``held_out`` (R,): what the other runs'
    ratio takes of each run's sum of squares over the variance.  ``contradicted``: it is not found, for the flights'
    spins ask for the stated one: what its blows do to a spin is something else."""

    ratio: float = 1.0
    sd: float = float("inf")
    gain: float = 0.0
    found: bool = False
    stated: float = 1.0
    impulse: Array | None = None
    angular: Array | None = None
    held_out: Array | None = None
    contradicted: bool = False

    def cause(self, series: Series) -> list[Cause]:
        """It as a cause; nothing where it is not found."""
        if not self.found:
            return []
        rivals = () if series.layouts is not None else ("length_scale_error",)
        parameters = {"ratio": (self.stated * self.ratio, self.stated * self.sd)}
        strength = abs(self.ratio - 1) / NEGLIGIBLE
        return [Cause("inertia_error", "geometry", parameters, strength, self.gain, "spin", "impact", rivals)]

    def structure(self) -> list[Structure]:
        """It where it has no name: the disk's, or where flights contradict that, of the impacts."""
        size = abs(self.ratio - 1)
        p = two_sided((self.ratio - 1) / self.sd)
        what = "the tangential impulse"
        stage = "impact" if self.contradicted else "geometry"
        return [Structure(stage, "impact", "spin", what, size / NEGLIGIBLE, self.gain, size, "1", p)]


def with_inertia(series: Series, ratio: float) -> Series:
    """The disk's inertia factor times ``ratio``."""
    runs = [replace(run, data=replace(run.data, inertia_factor=ratio * run.data.inertia_factor)) for run in series.runs]
    return replace(series, runs=tuple(runs))


def stated_ratio(series: Series) -> float:
    """The ratio that ``[model.effect_parameters]`` gives; 1 where it gives none."""
    return stated_sizes(series.recordings[0].model).get("inertia_error", {}).get("ratio", 1.0)


def flights_contradict(flights: FlightFit, stated: Series) -> bool:
    """Whether ``flights`` of a disk that has the inertia that its impacts show lose their fit by it: the
    same model fits those of the disk as ``stated`` better.  The floor turns a disk by its friction over its inertia:
    impacts and flights of a wrong inertia agree on the right one."""
    as_stated = fit(stated.runs, flights.model, noise=flights.noise)
    worse = flights.misfit / max(flights.count, 1) - as_stated.misfit / max(as_stated.count, 1)
    return bool(worse * as_stated.count > IMPACT_GAIN)


def wall_between(flights: FlightFit) -> WallFit | None:
    """The plain wall on which ``flights`` meet; None where too few do."""
    run, junctions = flights.fits[0].run, intersect(flights.fits)
    if len(junctions) < FEWEST_IMPACTS:
        return None
    return fit_wall(junctions, run.wall, run.wall.nominal_terms, wall_prior(run.wall))


def inertia_step(wall: WallFit | None, flights: FlightFit, inertia_factor: float, stated: float) -> InertiaStep:
    """The inertia that the impacts between ``flights``, on their ``wall``, show, against ``inertia_factor``.

    A force that the flights lack bends their ends, and with them the impulses: only flights that hold what acts on them
    tell an inertia.  A blow that brings a torque of its own is none."""
    if wall is None:
        return InertiaStep(stated=stated)
    radius_m = flights.fits[0].run.radius_m
    data = law_data(wall.impacts, wall.used, radius_m, inertia_factor)
    fitted = fit_inertia(data, len(flights.fits), radius_m)
    if fitted is None:
        return InertiaStep(stated=stated)
    hit = np.unique(data.at.run)
    found = (
        min(fitted.gain, fitted.beside) > IMPACT_GAIN
        and fitted.significance > SIGNIFICANCE
        and abs(fitted.ratio - 1) > NEGLIGIBLE
        and float(np.mean(fitted.held_out[hit] > 0)) >= IMPROVED
    )
    return InertiaStep(
        fitted.ratio,
        fitted.sd,
        fitted.gain,
        bool(found),
        stated,
        data.tangential_impulse,
        data.angular,
        fitted.held_out,
    )
