"""The next test: settings of the rig simulated with the effect as found, and how well each tells it from its nearest
rival.

A setting is judged by the Fisher information of its simulated recordings, cut into flights and impacts as measured ones
are and seen with the measured noise: the size that was found, over the sd that it would have there with the rival and
all nominal parameters unknown.  Effects of the measurement and of centres are told apart on the bench, not by another
excitation: for them :mod:`analysis.gap.tests_by_hand` has the test.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.contact.law import fit_restitution
from analysis.contact.restitution import best_speed_scale, restitution_design
from analysis.flights.cutting.run_data import LENS_TERMS
from analysis.flights.cutting.runs import Run
from analysis.flights.equation.parameters import INDEX
from analysis.flights.fit import ORIGIN
from analysis.gap.cause import Cause
from analysis.gap.ladder import Ladder
from analysis.gap.next_test.recording import AS_RECORDED, SETTINGS, Recorded, Setting, record, starts
from analysis.gap.selection.flights.fit import fit, information_of, prior_of
from analysis.gap.selection.flights.terms import EFFECT_TERMS
from analysis.gap.selection.impact_steps import LEAST_IMPACTS
from analysis.statistics.robust import covariance_of
from ovines.workers.threads import in_threads

Array = NDArray[np.float64]
LONGEST_S = 0.6
SURELY = 2.0  # standard errors by which a setting must be better than today's to be worth the trouble
STARTS = 6  # of measured flights: enough for an error bar to half of itself
# Standard deviations below which one recording tells nothing.
LEAST_SEPARATION = 2.0
# Slower impacts are neither found nor used.
SLOWEST_M_PER_S = 0.1
# What differs from run to run is nothing that one recording shows.
TERMS = {t.name: t for t in EFFECT_TERMS if t.name != "friction_drift"}
SHAPES = ("wall_ellipticity", "finite_contact_time")
RESTITUTION_EFFECTS = ("speed_dependent_restitution", "direction_dependent_restitution")
SIMULATED = frozenset((*TERMS, "friction_drift", "restitution_drift", "wall_lobes", *SHAPES, *RESTITUTION_EFFECTS))


class Told(NamedTuple):
    """What one simulated recording in a setting tells: ``sd``, by how many standard deviations, and the standard error
    of that over where recordings begin (NaN of a single one).
    """

    setting: str
    sd: float
    error: float


@dataclass(frozen=True)
class NextTests:
    """How well one recording of ``duration_s`` tells ``effect`` from ``rival``, per setting, best first; from
    ``starts`` beginnings.
    """

    effect: str
    rival: str
    duration_s: float
    starts: int
    settings: tuple[Told, ...]

    @property
    def recommended(self) -> str:
        """The best setting, or the drive as recorded where none is surely better."""
        best = self.settings[0]
        today = next((s for s in self.settings if s.setting == AS_RECORDED), None)
        if today is None or not SURELY * np.hypot(best.error, today.error) > best.sd - today.sd:
            return best.setting
        return AS_RECORDED

    def words(self) -> str:
        """The recommended setting, and how much better it is than today's."""
        best, today = self.settings[0], next((s for s in self.settings if s.setting == AS_RECORDED), None)
        shown = today if self.recommended == AS_RECORDED and today is not None else best
        told = (
            f"one recording of {self.duration_s:.1f} s tells {_plain(self.effect)} from {_plain(self.rival)}, its "
            f"nearest rival, by {_said(shown)} standard deviations"
        )
        if best.sd < LEAST_SEPARATION:
            return (
                f"No setting of the drive tells {_plain(self.effect)} from {_plain(self.rival)}: {best.sd:.1g} "
                f"standard deviations at most in {self.duration_s:.1f} s."
            )
        if self.recommended == AS_RECORDED:
            return (
                f"More recordings as these serve as well as any other setting (simulated with the size found): {told}."
            )
        return f"Record with {best.setting}: simulated with the size found, {told}" + (
            "." if today is None else f" (as recorded: {_said(today)})."
        )

    def entry(self) -> dict[str, object]:
        """What diagnosis.json says of it."""
        return {
            "effect": self.effect,
            "rival": self.rival,
            "duration_s": self.duration_s,
            "starts": self.starts,
            "recommended": self.recommended,
            "settings": [
                {
                    "setting": one.setting,
                    "separation_sd": one.sd,
                    "standard_error": one.error if np.isfinite(one.error) else None,
                }
                for one in self.settings
            ],
        }


def _said(told: Told) -> str:
    value = f"{told.sd:.2g}" if told.sd < 100 else f"{told.sd:.0f}"
    if not np.isfinite(told.error):
        return value
    return f"{value} ± {told.error:.1g}" if told.error < 9.5 else f"{value} ± {told.error:.0f}"


def _plain(effect: str) -> str:
    return effect.replace("_", " ")


def next_tests(ladder: Ladder, causes: tuple[Cause, ...]) -> NextTests | None:
    """Settings ranked for the first named cause; None where no setting of the drive would tell (see above) or nothing
    was named.
    """
    rival = rival_of(ladder, causes)
    if rival is None:
        return None
    cause, data = causes[0], _typical(ladder).data
    duration = float(min(data.time_s[-1] - data.time_s[0], LONGEST_S))
    judge = _flight_information if cause.stage == "flight" else _impact_information
    begun = starts(ladder, STARTS)

    def told(setting: Setting) -> Told:
        recorded = [record(ladder, causes, start, setting, duration, SIMULATED) for start in begun]
        return Told(setting.words, *_separation(judge(ladder, recorded, cause.effect, rival), len(begun)))

    driven = data.host.omega_rad_per_s != 0
    settings = [one for one in SETTINGS if begun and (driven or one.launch is not None)]
    found = in_threads(told, [(one,) for one in settings])
    ranked = tuple(sorted(found, key=lambda told: -told.sd))
    return NextTests(cause.effect, rival, duration, len(begun), ranked) if ranked else None


class _Information(NamedTuple):
    """``size`` (K,) of the effect, and what each recording tells of it and of everything unknown beside it: (M, M),
    the effect's parameters first; ``prior`` (M, M)."""

    size: Array
    forms: list[Array]
    prior: Array

    def separation(self, forms: Sequence[Array], recordings: int) -> float:
        """Size over its sd in one recording of these."""
        own, told = len(self.size), np.sum(forms, 0) + self.prior
        if np.any(np.diag(told)[:own] <= 0):
            return 0.0
        return _in_sd(self.size, covariance_of(told)[:own, :own]) / float(np.sqrt(recordings))


def _separation(told: _Information | None, recordings: int) -> tuple[float, float]:
    """Standard deviations in one recording, and their standard error by leaving beginnings out in turn."""
    if told is None or not told.forms:
        return 0.0, float("nan")
    value, n = told.separation(told.forms, recordings), len(told.forms)
    if n < 2 or n < recordings:  # some recordings told nothing at all: how often that is nobody knows from so few
        return value, float("nan")
    left_out = [told.separation(told.forms[:i] + told.forms[i + 1 :], n - 1) for i in range(n)]
    return value, float(np.sqrt((n - 1) / n * np.sum((np.array(left_out) - np.mean(left_out)) ** 2)))


def rival_of(ladder: Ladder, causes: tuple[Cause, ...]) -> str | None:
    """What the first cause is most easily taken for, among effects that another setting may tell from it."""
    if not causes:
        return None
    named, first = {c.effect for c in causes}, causes[0]
    for names in (TERMS, SHAPES, RESTITUTION_EFFECTS):
        if first.effect in names:
            ranked = [
                *first.rivals,
                *(g.term.name for g in sorted(ladder.flights.gains, key=lambda g: -g.held_out)),
                *names,
            ]
            return next((n for n in ranked if n in names and n not in named), None)
    return None


def _typical(ladder: Ladder) -> Run:
    """The run of median length."""
    runs = sorted(ladder.series.runs, key=lambda r: len(r.data.time_s))
    return runs[len(runs) // 2]


def _flight_information(ladder: Ladder, recorded: Sequence[Recorded], effect: str, rival: str) -> _Information | None:
    """Where the rival, the nominal parameters and the lens are unknowns too."""
    data, model = _typical(ladder).data, ladder.flights.fitted.model
    runs = [run for run in (one.run(ladder, data) for one in recorded) if run.flights]
    if not runs:
        return None
    columns = TERMS[effect].columns
    asked = tuple(dict.fromkeys(("friction", *model.free, *columns, *TERMS[rival].columns)))
    model = replace(model, drift_per_run=0.0, free=asked)
    evidence = fit(runs, model, rounds=0, every_column=False, noise=ladder.flights.fitted.noise).evidence
    others = [
        n
        for n in dict.fromkeys([*ladder.flights.fitted.model.free, *ORIGIN, *LENS_TERMS, *TERMS[rival].columns])
        if n not in (*columns, "drift_run")
    ]
    forms = [f for f in (information_of(e, [*columns, *others]) for e in evidence) if f is not None]
    prior = np.diag(prior_of([*columns, *others], data.contact_radius_m))
    return _Information(model.parameters[[INDEX[c] for c in columns]], forms, prior)


def _in_sd(size: Array, covariance: Array) -> float:
    return float(np.sqrt(max(float(size @ np.linalg.pinv(covariance, hermitian=True) @ size), 0.0)))


def _impact_information(ladder: Ladder, recorded: Sequence[Recorded], effect: str, rival: str) -> _Information | None:
    """What the effect does to restitution or contact distance at the simulated impacts, the rival unknown."""
    assert ladder.impacts.fitted is not None
    fast = [one.result.impacts for one in recorded]
    fast = [one[one["normal_speed_before_m_per_s"] > SLOWEST_M_PER_S] for one in fast]
    if sum(len(one) for one in fast) < LEAST_IMPACTS:
        return None
    rows = [_impact_rows(ladder, one, effect, rival) for one in fast]
    size = rows[0][0]
    return _Information(size, [weighted.T @ weighted for _, weighted in rows], np.zeros((rows[0][1].shape[1],) * 2))


def _impact_rows(ladder: Ladder, impacts: NDArray[np.void], effect: str, rival: str) -> tuple[Array, Array]:
    """Size (K,) of the effect and the weighted rows (I, M) of it, of what is unknown in any case, and of the rival."""
    assert ladder.impacts.fitted is not None
    speed, azimuth = impacts["normal_speed_before_m_per_s"], impacts["azimuth_rad"]
    data, wall = ladder.impacts.fitted.data, ladder.impacts.fitted.wall
    around, twice = _turning(azimuth), _turning(2 * azimuth)
    if effect in SHAPES:
        # A lasting contact goes with the speed of approach, an ellipse with twice the azimuth; radius and centre are
        # unknowns in any case.
        design = {"finite_contact_time": speed[:, None], "wall_ellipticity": twice * wall.wall.size_m}
        size = (
            np.array([ladder.impacts.fitted.contact_slope_s]) if effect == "finite_contact_time" else wall.wall.ellipse
        )
        always, sd = np.column_stack([np.ones(len(impacts)), around]), np.full(len(impacts), wall.scatter_m)
    else:
        terms = list(ladder.impacts.restitution_terms)
        scale = best_speed_scale(data) if "speed_dependent_restitution" in terms else 1.0
        design = {
            "speed_dependent_restitution": np.exp(-speed / scale)[:, None],
            "direction_dependent_restitution": around,
        }
        fitted = fit_restitution(data, restitution_design(data, terms))
        at = 1 + (effect == "direction_dependent_restitution" and "speed_dependent_restitution" in terms)
        size = fitted[0][at : at + design[effect].shape[1]]
        always = np.ones((len(impacts), 1))
        sd = np.hypot(max(fitted[2], 1e-3), float(np.median(data.normal_sd)) / speed)
    return np.asarray(size, float), np.column_stack([design[effect], always, design[rival]]) / sd[:, None]


def _turning(angle: Array) -> Array:
    return np.column_stack([np.cos(angle), np.sin(angle)])
