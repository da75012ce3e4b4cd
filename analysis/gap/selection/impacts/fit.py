"""Impacts of a series as the ladder fits them: where flights meet, the wall and its shape, the nominal law."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from analysis.contact.held_laws import without_laws
from analysis.contact.impacts import Junctions, intersect, measure
from analysis.contact.law import (
    Law,
    LawData,
    fit_law,
    fit_tangential,
    impulses_of,
    lasting_law,
    law_data,
    outlier_count,
    predicted_tangential,
    stick_impulse,
)
from analysis.contact.restitution import RESTITUTION_EFFECTS, restitution_design
from analysis.contact.tangential.lasting import LastingContact, refit_lasting
from analysis.contact.wall_fit import WallFit, fit_wall, lobe_order, outside_the_wall
from analysis.flights.cutting.runs import Run
from analysis.flights.fit import FlightFits
from analysis.walls.lobes import LOBE_TERMS, LobedWall
from analysis.walls.wall import Wall

Array = NDArray[np.float64]
# Strays of restitution that are still chance: so many, and this share (1 % is expected).
MANY_OUTLIERS, MANY_OUTLIERS_SHARE, FEWEST_FOR_STRUCTURE = 4.0, 0.03, 20
# Impacts that a law is fitted to, and those of other runs that a run's law along the wall is fitted to.
FEWEST_FOR_LAW, FEWEST_HELD_OUT = 4, 8
#: law of a series with too few impacts to fit one
NO_LAW = Law(*[float("nan")] * 7)


@dataclass(frozen=True)
class Shape:
    """What the wall has beside its nominal terms: an ``ellipse``, contacts that last (``finite``), lobes of an
    ``order`` (0: none)."""

    ellipse: bool = False
    finite: bool = False
    order: int = 0

    def wall(self, plain: Wall) -> Wall:
        """``plain`` with the lobes, nil so far."""
        return LobedWall.of(plain, self.order) if self.order else plain

    def terms(self, plain: Wall) -> tuple[str, ...]:
        """Free terms."""
        ellipse = plain.ellipse_terms if self.ellipse else ()
        return (*plain.nominal_terms, *ellipse, *(LOBE_TERMS if self.order else ()))


@dataclass(frozen=True, eq=False)
class ImpactFit:
    """Junctions of a series' flights, the wall and the law fitted to them, and which terms the model holds; ``start_s``
    (R,): times of the runs' first frames, from which the law counts; ``lasting``: the tangential law of contacts that
    last, where it is the likelier one."""

    junctions: Junctions
    wall: WallFit
    data: LawData
    law: Law
    contact_slope_s: float
    contact_slope_sd_s: float
    start_s: Array
    lasting: LastingContact | None = None

    @property
    def lasts(self) -> bool:
        """Whether contacts have a duration."""
        return bool(np.isfinite(self.contact_slope_sd_s))

    def tangential_impulse(self, data: LawData) -> Array:
        """Tangential impulse per mass (K,), m/s, of the fitted law with the normal impulses of ``data``."""
        if self.lasting is not None:
            return self.lasting.impulse(stick_impulse(data, 0.0), data.normal_impulse)
        return predicted_tangential(data, self.law.wall_friction, self.law.tangential_restitution)

    def without(self, run: int) -> ImpactFit:
        """The same with the law along the wall of the other runs; with its own where those are too few."""
        return self._held_out.get(int(run), self)

    @cached_property
    def _held_out(self) -> dict[int, ImpactFit]:
        """:meth:`without` each run whose impacts are known."""
        if not np.isfinite(self.law.wall_friction):
            return {}
        others = {int(run): self.data.at.run != run for run in np.unique(self.data.at.run)}
        return {
            run: self._along_the_wall(self.data.part(those))
            for run, those in others.items()
            if np.count_nonzero(those) >= FEWEST_HELD_OUT
        }

    def _along_the_wall(self, data: LawData) -> ImpactFit:
        """The same with the law along the wall that is likeliest for ``data``, sought from where it stands."""
        start = self.law.wall_friction, self.law.tangential_restitution
        (friction,), beta, scatter, misfit = fit_tangential(data, start=start)
        law = replace(
            self.law,
            wall_friction=float(friction),
            tangential_restitution=beta,
            tangential_misfit=misfit,
            tangential_scatter=scatter,
        )
        return replace(self, law=law, lasting=self.lasting and refit_lasting(impulses_of(data), self.lasting, scatter))

    def outside_the_wall(self, runs: Sequence[Run]) -> list[Run]:
        """``runs`` without the frames in which the disk is in the wall."""
        delay_s = self.contact_slope_s if np.isfinite(self.law.restitution) else 0.0
        return outside_the_wall(runs, self.junctions, delay_s, self.law.restitution)


PLAIN_SHAPE = Shape()


def fit_impacts(fits: Sequence[FlightFits], shape: Shape = PLAIN_SHAPE) -> ImpactFit:
    """Wall (centre, radius, disk centre, and what its ``shape`` has besides) and nominal law."""
    junctions = intersect(fits)
    run = fits[0].run
    # Placement of the markers: a wall centre or disk centre within 0.1 mm belongs to the recalibrated nominal
    # model.
    start, terms = shape.wall(run.wall), shape.terms(run.wall)
    extra = None
    if shape.finite and len(junctions):
        first = fit_wall(junctions, start, terms, wall_prior(run.wall))
        extra = np.maximum(first.impacts.of("normal_before"), 0)[:, None]
    wall = fit_wall(junctions, start, terms, wall_prior(run.wall), extra)
    start_s = np.array([fit.run.start_s for fit in fits])
    data = without_laws(law_data(wall.impacts, wall.used, run.radius_m, run.inertia_factor), junctions, fits)
    data = _from_start(data, start_s)
    law = fit_law(data) if len(data) >= FEWEST_FOR_LAW else NO_LAW
    slope, slope_sd = (
        (float(wall.estimate[-1]), float(np.sqrt(wall.covariance[-1, -1]))) if extra is not None else (0.0, np.inf)
    )
    lasting = lasting_law(data, law) if shape.finite else None
    return ImpactFit(junctions, wall, data, law, slope, slope_sd, start_s, lasting)


def with_leaning_wall(
    impacts: ImpactFit, fits: Sequence[FlightFits], reach_m: Array, lean_rad: Array, out_m_per_s: Array
) -> ImpactFit:
    """The same impacts at a wall that a law of its shape moves outwards by ``reach_m`` (J,), turns by ``lean_rad`` (J,)
    and lets go on outwards with ``out_m_per_s`` (J,) at each junction: the wall and the disk's own centre beside the
    law, what is normal and what is tangential of the velocities against it, and the nominal law."""
    junctions = replace(impacts.junctions, lean_rad=lean_rad, wall_out_m_per_s=out_m_per_s)
    run = fits[0].run
    first = measure(junctions, impacts.wall.wall)
    finite = [np.maximum(first.of("normal_before"), 0)] if impacts.lasts else []
    beside = np.column_stack([reach_m, *finite])
    wall = fit_wall(junctions, impacts.wall.wall, impacts.wall.terms, wall_prior(run.wall), beside)
    data = without_laws(law_data(wall.impacts, wall.used, run.radius_m, run.inertia_factor), junctions, fits)
    data = _from_start(data, impacts.start_s)
    law = fit_law(data) if len(data) >= FEWEST_FOR_LAW else NO_LAW
    return replace(
        impacts, junctions=junctions, wall=wall, data=data, law=law, lasting=lasting_law(data, law) if finite else None
    )


def _from_start(data: LawData, start_s: Array) -> LawData:
    """Impacts as the law takes them, their times counted from the starts (R,) of their runs."""
    return _with_structure(data.from_starts(start_s))


def wall_prior(wall: Wall) -> dict[str, float]:
    """Prior sd of the terms of which some surfaces tell little.

    Beside a real error of scale or centre a tight prior would bend the others: a ring's own terms are free."""
    return {term: wall.prior_sd(term) for term in wall.nominal_terms if term.startswith(("side", "turn", "cylinder"))}


def law_of(wall: WallFit, impacts: ImpactFit) -> LawData:
    """The contact law's view of a wall fit, with disk and inertia of ``impacts``."""
    data = law_data(wall.impacts, wall.used, impacts.junctions.radius_m, impacts.data.inertia_factor)
    return _from_start(data, impacts.start_s)


def _with_structure(data: LawData) -> LawData:
    """Impacts off the law are outliers only as long as they are few: more, and they are structure (a soft spot), which
    a fit must not leave out.
    """
    if len(data) < FEWEST_FOR_STRUCTURE:
        return data
    few = max(MANY_OUTLIERS, MANY_OUTLIERS_SHARE * len(data))
    return (
        data
        if outlier_count(data, restitution_design(data, RESTITUTION_EFFECTS)) <= few
        else replace(data, outliers=0.0)
    )


def with_lobes(base: ImpactFit, shape: Shape) -> Shape:
    """``shape`` with the lobes that the contact distances ask for, however small."""
    return replace(shape, order=lobe_order(base.wall, shape.order))
