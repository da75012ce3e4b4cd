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

import numpy as np
from numpy.typing import NDArray

from analysis.contact.law import fit_restitution
from analysis.flights.evidence import covariance_of
from analysis.flights.fit import LENS_TERMS, ORIGIN
from analysis.flights.parameters import INDEX
from analysis.flights.runs import Run
from analysis.gap.cause import Cause
from analysis.gap.ladder import Ladder
from analysis.gap.next_test.recording import AS_RECORDED, SETTINGS, Recorded, record
from analysis.gap.selection.flight_candidates import fit, information_of, prior_of
from analysis.gap.selection.flight_terms import EFFECT_TERMS
from analysis.gap.selection.impact_candidates import best_speed_scale, restitution_design
from analysis.gap.selection.impact_steps import LEAST_IMPACTS

Array = NDArray[np.float64]
LONGEST_S, RECORDINGS = 0.6, 3
# Standard deviations below which one recording tells nothing.
LEAST_SEPARATION = 2.0
# Slower impacts are neither found nor used.
SLOWEST_M_PER_S = 0.1
TERMS = {t.name: t for t in EFFECT_TERMS if t.name != "friction_drift"}
SHAPES = ("wall_ellipticity", "finite_contact_time")
RESTITUTION_EFFECTS = ("speed_dependent_restitution", "direction_dependent_restitution")
SIMULATED = frozenset((*TERMS, "friction_drift", "restitution_drift", "wall_lobes", *SHAPES, *RESTITUTION_EFFECTS))


@dataclass(frozen=True)
class NextTests:
    """``separation_sd``: standard deviations by which one recording of ``duration_s`` tells ``effect`` from ``rival``,
    per setting, best first.
    """

    effect: str
    rival: str
    duration_s: float
    separation_sd: tuple[tuple[str, float], ...]

    def words(self) -> str:
        """The best setting, and how much better it is than today's."""
        (best, separation), today = self.separation_sd[0], dict(self.separation_sd).get(AS_RECORDED)
        told = (
            f"one recording of {self.duration_s:.1f} s tells {_plain(self.effect)} from {_plain(self.rival)}, its "
            f"nearest rival, by "
            f"{f'{separation:.2g}' if separation < 100 else f'{separation:.0f}'} standard deviations"
        )
        if separation < LEAST_SEPARATION:
            return (
                f"No setting of the drive tells {_plain(self.effect)} from {_plain(self.rival)}: {separation:.1g} "
                f"standard deviations at most in {self.duration_s:.1f} s."
            )
        if best == AS_RECORDED:
            return f"More recordings as these serve best (simulated with the size found): {told}."
        return f"Record with {best}: simulated with the size found, {told}" + (
            "." if today is None else f" (as recorded: {today:.2g})."
        )

    def entry(self) -> dict[str, object]:
        """What diagnosis.json says of it."""
        return {
            "effect": self.effect,
            "rival": self.rival,
            "duration_s": self.duration_s,
            "settings": [{"setting": words, "separation_sd": sd} for words, sd in self.separation_sd],
        }


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
    judge = _flight_separation if cause.stage == "flight" else _impact_separation
    fits = [f for f in ladder.flights.fitted.fits if len(f.states) and np.isfinite(f.states[0]).all()][:RECORDINGS]
    found = []
    for setting in SETTINGS if fits else ():
        if setting.launch is None and data.host.omega_rad_per_s == 0:
            continue
        recorded = [record(ladder, causes, f, setting, duration, SIMULATED) for f in fits]
        found.append((setting.words, judge(ladder, recorded, cause.effect, rival) / float(np.sqrt(len(recorded)))))
    return NextTests(cause.effect, rival, duration, tuple(sorted(found, key=lambda s: -s[1]))) if found else None


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


def _flight_separation(ladder: Ladder, recorded: Sequence[Recorded], effect: str, rival: str) -> float:
    """Size of the effect over its sd where the rival, the nominal parameters and the lens are unknowns too."""
    data, model = _typical(ladder).data, ladder.flights.fitted.model
    runs = [run for run in (one.run(ladder, data) for one in recorded) if run.flights]
    if not runs:
        return 0.0
    evidence = fit(runs, replace(model, drift_per_run=0.0), rounds=0, noise=ladder.flights.fitted.noise).evidence
    columns = TERMS[effect].columns
    others = [
        n
        for n in dict.fromkeys([*model.free, *ORIGIN, *LENS_TERMS, *TERMS[rival].columns])
        if n not in (*columns, "drift_run")
    ]
    forms = [f for f in (information_of(e, [*columns, *others]) for e in evidence) if f is not None]
    told = np.sum(forms, 0) + np.diag(prior_of([*columns, *others], data.contact_radius_m))
    own = len(columns)
    if not forms or np.any(np.diag(told)[:own] <= 0):
        return 0.0
    size = model.parameters[[INDEX[c] for c in columns]]
    return _in_sd(size, covariance_of(told)[:own, :own])


def _in_sd(size: Array, covariance: Array) -> float:
    return float(np.sqrt(max(float(size @ np.linalg.pinv(covariance, hermitian=True) @ size), 0.0)))


def _impact_separation(ladder: Ladder, recorded: Sequence[Recorded], effect: str, rival: str) -> float:
    """What the effect does to restitution or contact distance at the simulated impacts and the rival cannot, over its
    sd.
    """
    assert ladder.impacts.fitted is not None
    impacts = np.concatenate([one.result.impacts for one in recorded])
    fast = impacts[impacts["normal_speed_before_m_per_s"] > SLOWEST_M_PER_S]
    if len(fast) < LEAST_IMPACTS:
        return 0.0
    speed, azimuth = fast["normal_speed_before_m_per_s"], fast["azimuth_rad"]
    data, wall = ladder.impacts.fitted.data, ladder.impacts.fitted.wall
    around, twice = _turning(azimuth), _turning(2 * azimuth)
    if effect in SHAPES:
        # A lasting contact goes with the speed of approach, an ellipse with twice the azimuth; radius and centre are
        # unknowns in any case.
        design = {"finite_contact_time": speed[:, None], "wall_ellipticity": twice * wall.wall.size_m}
        size = (
            np.array([ladder.impacts.fitted.contact_slope_s]) if effect == "finite_contact_time" else wall.wall.ellipse
        )
        always, sd = np.column_stack([np.ones(len(fast)), around]), np.full(len(fast), wall.scatter_m)
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
        always = np.ones((len(fast), 1))
        sd = np.hypot(max(fitted[2], 1e-3), float(np.median(data.normal_sd)) / speed)
    own = design[effect].shape[1]
    weighted = np.column_stack([design[effect], always, design[rival]]) / sd[:, None]
    return _in_sd(size, np.linalg.pinv(weighted.T @ weighted, hermitian=True)[:own, :own])


def _turning(angle: Array) -> Array:
    return np.column_stack([np.cos(angle), np.sin(angle)])
