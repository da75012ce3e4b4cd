"""The next test: settings of the rig simulated with what was found, and how well each separates it from its nearest
rival: a named effect from another one, or a law from another formula.

A setting is judged by the Fisher information of its simulated recordings, cut into flights and impacts as measured ones
are and seen with the measured noise: the size that was found, over the sd that it would have there with the rival and
all nominal parameters unknown.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from analysis.gap.cause import Cause
from analysis.gap.ladder import Ladder
from analysis.gap.laws.found_law import LawFound, law_file
from analysis.gap.next_test.effects import SIMULATED, effect_information, rival_of
from analysis.gap.next_test.laws import STAGES, OpenForm, law_information, open_form
from analysis.gap.next_test.recording import AS_RECORDED, SETTINGS, Recorded, Rig, Setting, record, starts
from analysis.gap.next_test.separation import Information, Separation, separation_of
from ovines.core.effects import EFFECTS
from ovines.core.laws.formula import as_text
from ovines.core.refusal import ScenarioError
from ovines.workers.threads import in_threads

LONGEST_S = 0.6
SURELY = 2.0  # standard errors by which a setting must be better than today's to be worth the trouble
STARTS = 8  # of measured flights: error bars to a quarter of themselves (1 / sqrt(2 (n - 1)))
# Standard deviations below which one recording tells nothing, and from which on it settles the question (chance is as
# far off once in 370).
LEAST_SEPARATION, SETTLES = 2.0, 3.0
# Smaller separations have no digits: sums of squares leave as much.
LEAST_WRITTEN = 0.1


@dataclass(frozen=True)
class NextTests:
    """How well one recording of ``duration_s`` separates ``effect`` from ``rival``, per setting, best first; from
    ``starts`` beginnings.  ``law``: the file of the law whose formula ``effect`` is; None of a named effect.
    """

    effect: str
    rival: str
    duration_s: float
    starts: int
    settings: tuple[Separation, ...]
    law: str | None = None

    @property
    def today(self) -> Separation | None:
        """The drive as recorded, where it was simulated."""
        return next((s for s in self.settings if s.setting == AS_RECORDED), None)

    @property
    def recommended(self) -> str:
        """The best setting, or the drive as recorded where none is surely better."""
        best, today = self.settings[0], self.today
        if today is None or not SURELY * np.hypot(best.error, today.error) > best.sd - today.sd:
            return best.setting
        return AS_RECORDED

    def words(self) -> str:
        """The recommended setting, and how much better it is than today's."""
        best, today = self.settings[0], self.today
        shown = today if self.recommended == AS_RECORDED and today is not None else best
        both = f"{self._effect} from {self._rival}"
        if best.sd < LEAST_SEPARATION:
            most = f"{best.sd:.1g}" if best.sd >= LEAST_WRITTEN else f"less than {LEAST_WRITTEN:g}"
            return (
                f"No setting of the drive tells {both}: in {self.duration_s:.1f} s they are at most {most} times as "
                "far apart as noise moves the answer."
            )
        rival = ", its nearest rival," if self.law is None else ""
        separates = (
            f"one recording of {self.duration_s:.1f} s tells {both}{rival} by {_with_error(shown)} times what noise "
            "moves the answer"
        )
        if self.recommended == AS_RECORDED:
            return f"More recordings as these serve as well as any other setting ({self._how}): {separates}."
        return f"Record with {best.setting}: {self._how}, {separates}" + (
            "." if today is None else f" (as recorded: {_with_error(today)})."
        )

    @property
    def _effect(self) -> str:
        return self.effect.replace("_", " ") if self.law is None else f"the formula of {self.law}"

    @property
    def _rival(self) -> str:
        return self.rival.replace("_", " ") if self.law is None else "the nearest other formula"

    @property
    def _how(self) -> str:
        return f"simulated with the {'size' if self.law is None else 'formula'} found"

    def entry(self) -> dict[str, object]:
        """What diagnosis.json says of it."""
        return {
            "effect": self.effect,
            "rival": self.rival,
            "law": self.law,
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


def _with_error(one: Separation) -> str:
    value = f"{one.sd:.2g}" if one.sd < 100 else f"{one.sd:.0f}"
    if not np.isfinite(one.error):
        return value
    return f"{value} ± {one.error:.1g}" if one.error < 9.5 else f"{value} ± {one.error:.0f}"


def next_tests(ladder: Ladder, causes: Sequence[Cause], laws: Sequence[LawFound] = ()) -> NextTests | None:
    """Settings ranked for what is open first: a named cause that others explain as well, a law that has other formulas,
    any other named cause.  None where no setting of the drive would tell, or nothing was found."""
    with_rival = [(cause, rival) for cause in causes if (rival := rival_of(ladder, cause, causes)) is not None]
    form = open_form(laws)
    equivalent = next((both for both in with_rival if both[1] in both[0].rivals), None)
    tests: NextTests | None = None
    if equivalent is None and form is not None:
        tests = law_tests(ladder, causes, laws, form)
        if tests is not None and tests.settings[0].sd >= LEAST_SEPARATION:
            return tests
    named = equivalent or next(iter(with_rival), None)
    return tests if named is None else effect_tests(ladder, causes, *named)


def effect_tests(ladder: Ladder, causes: Sequence[Cause], cause: Cause, rival: str) -> NextTests | None:
    """Settings ranked by how well each separates a named ``cause`` from a ``rival``."""
    rig = Rig(ladder, ladder.flights.fitted, _simulated(causes))
    (settings,), count = _ranked(rig, lambda recorded: [effect_information(rig, recorded, cause, rival)], 1)
    return NextTests(cause.effect, rival, duration_of(rig), count, settings) if settings else None


def law_tests(ladder: Ladder, causes: Sequence[Cause], laws: Sequence[LawFound], form: OpenForm) -> NextTests | None:
    """Settings ranked by how well each separates a law from another formula; None where the simulator does not take
    it.

    Of the formulas, the one that the law is hardest to tell apart from where it can be: one that holds the law in it is
    as good in every setting."""
    rig = rig_with_laws(ladder, causes, laws)
    ranked, count = _ranked(rig, lambda recorded: law_information(rig, recorded, form), len(form.others))
    if not ranked[0]:
        return None
    best = [settings[0].sd for settings in ranked]
    chosen = min(range(len(best)), key=lambda k: (best[k] < LEAST_SEPARATION, form.others[k].told_apart, best[k]))
    formula, other = as_text(form.law.law), as_text(form.others[chosen].law)
    return NextTests(formula, other, duration_of(rig), count, ranked[chosen], law_file(form.number))


def law_in(file: str | None, laws: Sequence[LawFound]) -> LawFound | None:
    """The law of a series that stands in a file; None where none does."""
    return next((one for number, one in enumerate(laws, 1) if law_file(number) == file), None)


def rig_with_laws(ladder: Ladder, causes: Sequence[Cause], laws: Sequence[LawFound]) -> Rig:
    """The rig with the ``laws`` found, its flights those that hold one."""
    flights = next((law.fitted[1] for law in laws if law.fitted is not None), ladder.flights.named)
    found = tuple(law.rig_law for law in laws if law.law.stage in STAGES)
    return Rig(ladder, flights, _simulated(causes), found)


def _simulated(causes: Sequence[Cause]) -> tuple[Cause, ...]:
    """Those that a simulated recording has: effects that it was made for, and those that act as laws."""
    return tuple(
        one for one in causes if one.effect in SIMULATED or (one.effect in EFFECTS and EFFECTS[one.effect].forms)
    )


def duration_of(rig: Rig) -> float:
    """How long a simulated recording is (s)."""
    return float(min(rig.like.time_s[-1] - rig.like.time_s[0], LONGEST_S))


def _ranked(
    rig: Rig, judge: Callable[[Sequence[Recorded]], Sequence[Information | None]], rivals: int
) -> tuple[list[tuple[Separation, ...]], int]:
    """The settings that the simulator takes, best first, for each of so many ``rivals``, and from how many beginnings;
    ``judge`` says what recordings tell of each."""
    begun, duration_s = starts(rig.flights, STARTS), duration_of(rig)

    def separations(setting: Setting) -> list[Separation]:
        try:
            judged = judge([record(rig, start, setting, duration_s) for start in begun])
        except (ScenarioError, np.linalg.LinAlgError):  # or a law runs away where nobody has recorded
            return []
        return [Separation(setting.words, *separation_of(one, len(begun))) for one in judged]

    driven = rig.like.host.omega_rad_per_s != 0
    settings = [one for one in SETTINGS if begun and (driven or one.launch is not None)]
    found = [one for one in in_threads(separations, [(one,) for one in settings]) if one]
    ranked = [tuple(sorted((one[k] for one in found), key=lambda one: -one.sd)) for k in range(rivals)]
    return ranked, len(begun)
