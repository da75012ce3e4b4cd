"""The flights' side of the ladder: fits, and the gain of every candidate and probe, held out run by run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from analysis.flights.along_flights import unit_accelerations
from analysis.flights.equation.parameters import INDEX
from analysis.flights.stated_terms import DRIFT_OF_RUN
from analysis.gap.selection.flights.fit import FlightFit
from analysis.gap.selection.flights.model import value_of
from analysis.gap.selection.flights.terms import NEGLIGIBLE_BEND, FlightTerm
from analysis.gap.thresholds import GAIN, IMPROVED, SIGNIFICANCE

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Units:
    """The rig's own scale of accelerations: RMS (m/s^2) that a unit of each column makes along the flights, and the one
    below which nothing is named.
    """

    acceleration_m_per_s2: dict[str, float]
    negligible_m_per_s2: float

    def of(self, column: str) -> float:
        """RMS acceleration (m/s^2) of a unit of a column."""
        return self.acceleration_m_per_s2.get(column, 0.0)


def rig_units(fitted: FlightFit) -> Units:
    """Units of the rig that a fit's flights show."""
    units, speed = unit_accelerations(fitted.fits)
    runs = np.arange(len(fitted.fits)) - 0.5 * (len(fitted.fits) - 1)
    friction = fitted.model.parameters[INDEX["friction"]]
    units[DRIFT_OF_RUN] = float(units["friction"] * friction * np.sqrt(np.mean(runs**2)))
    radius = fitted.fits[0].run.contact_radius_m
    return Units(units, NEGLIGIBLE_BEND * speed**2 / radius)


@dataclass(frozen=True, eq=False)
class Gain:
    """What one term adds to a fit: fall of -2 log L in all and on held-out runs, estimate and sd per column, jackknife
    significance; whether a drag ``pushes``, which none does.
    """

    term: FlightTerm
    gain: float
    held_out: float
    estimate: Array
    sd: Array
    significance: float
    improved: float
    acceleration_m_per_s2: float
    per_run: Array = field(default_factory=lambda: np.zeros(0))
    pushes: bool = False


def gain_of(base: FlightFit, term: FlightTerm, units: Units) -> Gain:
    """What a term adds to the rest of a fit, whether the fit holds it or not; linearised there, each run held out.

    Without the term its columns stand at zero, or where ``[model]`` states them, not where the fit has moved them."""
    forms = base.forms
    columns = [c for c in term.columns if c in forms.names]
    # A column that no flight feels (drift of a friction that is nil) says nothing.
    columns = [c for c in columns if forms.total[forms.at([c])[0], forms.at([c])[0]] > 0]
    others = [c for c in base.columns if c not in term.columns]
    none = np.zeros(len(columns))
    if not columns:
        return Gain(term, 0.0, 0.0, none, np.full(len(term.columns), np.inf), 0.0, 0.0, 0.0)
    stated = np.array([base.model.stated.get(c, 0.0) for c in columns])
    value = np.array([value_of(base.model, c) for c in columns]) - stated
    with_term, without = forms.solved([*others, *columns]), forms.solved(others, columns, -value)
    estimate = value + with_term.step[len(others) :]
    sd = np.sqrt(np.diag(with_term.covariance))[len(others) :]
    per_run = without.held_out - with_term.held_out
    estimates = value + with_term.left_out[:, len(others) :]
    runs = len(per_run)
    if runs > 2:
        centred = estimates - estimates.mean(0)
        covariance = (runs - 1) / runs * centred.T @ centred + np.diag(0.25 * sd**2)
        significance = float(np.sqrt(max(float(estimate @ np.linalg.pinv(covariance, hermitian=True) @ estimate), 0.0)))
    else:
        # A column without sd has no information.
        significance = float(np.sqrt(np.nansum((estimate / np.where(sd > 0, sd, np.nan)) ** 2)))
    size = float(np.sqrt(np.sum((estimate * np.array([units.of(c) for c in columns])) ** 2)))
    return Gain(
        term,
        without.cost - with_term.cost,
        float(per_run.sum()),
        estimate,
        sd,
        significance,
        float(np.mean(per_run > 0)),
        size,
        per_run,
        term.drags and bool(np.any(estimate + stated < 0)),
    )


def gains(base: FlightFit, terms: Sequence[FlightTerm], units: Units) -> list[Gain]:
    """Gains of the given effects or probes, largest first."""
    return sorted((gain_of(base, t, units) for t in terms), key=lambda g: -g.gain)


def driving(named: Sequence[Gain]) -> list[Gain]:
    """Drags that push, as what they are then: probes, without a name."""
    return [replace(gain, term=gain.term.driving, pushes=False) for gain in named if gain.pushes]


def accepted(gain: Gain, least: float, units: Units) -> bool:
    """Whether flights ask for a term by its ``gain``; ``least``: held-out gain that chance does not reach.

    A drag that pushes is none (see :func:`driving`).  What has no name is reported as left only where it is surely more
    than negligible, by its own sd: what a named motion of the Host leaves by an imperfect law has no other name, and is
    about as large."""
    size = gain.acceleration_m_per_s2
    if not gain.term.named:
        size *= 1 - 1 / max(gain.significance, 1.0)
    return (
        not gain.pushes
        and gain.gain > GAIN
        and gain.held_out > least
        and gain.significance > SIGNIFICANCE
        and gain.improved >= IMPROVED
        and size > units.negligible_m_per_s2
    )
