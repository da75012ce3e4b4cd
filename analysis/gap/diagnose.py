"""From the ladder to the answer: verdict, equivalent set, parameters with intervals, how far the gap shrinks, what
would have been seen.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.gap.cause import Cause, Structure
from analysis.gap.estimates import Estimates, estimated
from analysis.gap.ladder import Ladder, run_ladder
from analysis.gap.laws.belief import followed_by
from analysis.gap.laws.found_law import LawFound, law_file
from analysis.gap.next_test.choice import NextTests, law_in, next_tests
from analysis.gap.next_test.laws import why_no_setting
from analysis.gap.prediction import predict
from analysis.gap.prediction.detectable import Entry, detectable_sizes
from analysis.gap.prediction.held_out_errors import held_out_errors
from analysis.gap.prediction.how_far import HowFar, how_far, shows_in
from analysis.gap.prediction.over_floor import with_flights_over_floor
from analysis.gap.prediction.power import share_seen
from analysis.gap.prediction.probabilities import probabilities
from analysis.gap.series import Series
from analysis.gap.tests_by_hand import NONE_TEST, test_by_hand, unknown_test
from analysis.gap.written_laws import write_laws
from analysis.statistics.student import NORMAL_90
from ovines.workers.beside import made_beside

Array = NDArray[np.float64]
# Shares of the excess below this are not reported.
LEAST_SHARE = 0.01


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """``summary`` is diagnosis.json; ``predictions`` the table; ``ladder`` and ``errors`` what the figures
    show, ``estimates`` of all parameters, ``far`` the squared errors that the shrinkage is a share of, ``laws`` the
    formulas written for what is left, ``actions`` what to do next, one test each."""

    summary: dict[str, Any]
    predictions: pd.DataFrame
    ladder: Ladder
    errors: dict[str, predict.Errors | None]
    estimates: Estimates
    far: HowFar
    laws: tuple[LawFound, ...] = ()
    actions: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class _Judged:
    """What a ladder comes to beside its laws: ``causes`` with their sizes, ``estimates`` of all parameters, held-out
    ``errors`` and ``predictions``, how ``far`` the gap shrinks and the ``gap``'s entry, the next ``tests``,
    ``detectable`` sizes, and the shares of what is unlisted that would have been ``seen``."""

    causes: tuple[Cause, ...]
    estimates: Estimates
    errors: dict[str, predict.Errors | None]
    predictions: pd.DataFrame
    far: HowFar
    gap: dict[str, Any]
    tests: NextTests | None
    detectable: dict[str, Entry]
    seen: dict[str, float]


def diagnose(series: Series, rng: np.random.Generator, withheld: frozenset[str] = frozenset()) -> Diagnosis:
    """Where the gap of a series lies, which effect causes it, how far it shrinks with it (see ``docs/gap.md``).

    ``withheld``: effects taken out of the library for a trial."""
    ladder, chance = with_flights_over_floor(run_ladder(series, rng, withheld)), rng.spawn(1)[0]
    with _judged_beside(ladder, chance) as without_laws:
        laws, last = write_laws(ladder, rng, withheld)
        last = last if last is ladder else with_flights_over_floor(last)
        judged = without_laws() if last is ladder and not laws else None
    judged = judged or _judged(last, laws, chance)
    ladder, estimates = replace(last, causes=judged.causes), judged.estimates
    causes, errors, tests, seen = judged.causes, judged.errors, judged.tests, judged.seen
    gap: dict[str, Any] = {name: (e.rms() if e is not None else None) for name, e in errors.items()}
    gap |= judged.gap | {"left_p": ladder.left_p}
    actions = _actions(ladder, tests, laws)
    found: list[Cause | Structure] = [*causes, *ladder.structure]
    strongest = max(found, key=lambda one: one.weight, default=None)
    summary = {
        "format": 2,
        "verdict": verdict_of(ladder),
        "effects": [c.effect for c in causes],
        "equivalent": _equivalent(causes),
        "stage": None if strongest is None else strongest.stage,
        "left": [_left(one, ladder.series) for one in ladder.structure],
        "laws": [law.entry(law_file(number), rng) for number, law in enumerate(laws, 1)],
        "probabilities": probabilities(
            ladder, causes, judged.detectable, float(np.mean(list(seen.values()))), [law.p for law in laws]
        ),
        "unlisted_seen": seen,
        "parameters": {
            c.effect: {n: _interval(v) for n, v in series.frame.world_parameters(c.effect, c.parameters).items()}
            for c in causes
        },
        "where": _where(ladder, judged.far.excess()),
        "gap": gap,
        "detectable": judged.detectable,
        "next_test": " ".join(actions),
        "next_tests": None if tests is None else tests.entry(),
        "drive": ladder.drive.entry(ladder.series.names),
        "nominal": estimates.nominal(series.recordings[0].model),
        "time": time_shares(ladder),
    }
    return Diagnosis(summary, judged.predictions, ladder, errors, estimates, judged.far, laws, actions)


def _judged(ladder: Ladder, laws: Sequence[LawFound], chance: np.random.Generator) -> _Judged:
    """What a ladder and its laws come to."""
    estimates, ladder = estimated(ladder, [law.law for law in laws])
    written = [law.rig_law for law in laws]
    errors, table = held_out_errors(ladder, ladder.causes, written)
    found = how_far(ladder, errors, ladder.causes, written)
    return _Judged(
        ladder.causes,
        estimates,
        errors,
        table,
        found,
        found.entry(chance),
        next_tests(ladder, ladder.causes, laws),
        detectable_sizes(ladder),
        share_seen(ladder, chance),
    )


@contextmanager
def _judged_beside(ladder: Ladder, chance: np.random.Generator) -> Iterator[Callable[[], _Judged | None]]:
    """What the ladder comes to without a law, judged by a second process while this one looks for laws; None where
    that cannot be. Only where nothing is left: there a law is seldom found, and no work is wasted."""
    if ladder.structure:
        yield lambda: None
        return
    with made_beside(lambda: _judged(ladder, (), chance)) as judged:
        yield judged


def verdict_of(ladder: Ladder) -> str:
    """ "unknown" as soon as something is surely left that nothing named explains, else "effect" or "none"."""
    if ladder.structure:
        return "unknown"
    return "effect" if ladder.causes else "none"


def _left(one: Structure, series: Series) -> dict[str, Any]:
    """It in ``left`` of diagnosis.json, and where each run lies, in the world, where each has a place of its own."""
    entry = one.entry()
    if one.places:
        off = np.array([[at.x_m, at.y_m, 0.0] for at in one.places])
        places = series.frame.world_places(off) - series.frame.world_places(np.zeros((1, 3)))
        entry["runs"] = [
            {
                "run": series.names[at.number],
                "x_m": float(x_m),
                "y_m": float(y_m),
                "sd_m": series.frame.factor("sd_m") * at.sd_m,
            }
            for at, (x_m, y_m, _) in zip(one.places, places, strict=True)
        ]
    return entry


def _interval(value_sd: tuple[float, float]) -> dict[str, float]:
    value, sd = value_sd
    return {"value": value, "low": value - NORMAL_90 * sd, "high": value + NORMAL_90 * sd}


def _equivalent(causes: Sequence[Cause]) -> list[str]:
    """The named causes and whatever would have explained the same residual as well."""
    return list(dict.fromkeys([*(c.effect for c in causes), *(r for c in causes for r in c.rivals)]))


def _where(ladder: Ladder, excess: Mapping[str, float]) -> list[dict[str, Any]]:
    """Shares of the recalibrated model's excess over the floor by stage, each at the coordinate that most of what was
    found there has; a share below a hundredth is not reported."""
    found: list[Cause | Structure] = [*ladder.causes, *ladder.structure]
    excess = {
        stage: value for stage, value in excess.items() if value > 0 and any(shows_in(one, stage) for one in found)
    }
    total = sum(excess.values())
    out = []
    for stage, value in sorted(excess.items(), key=lambda item: -item[1]):
        here = max((one for one in found if shows_in(one, stage)), key=lambda one: one.weight)
        if value > LEAST_SHARE * total:
            share = round(value / total, 4)
            out.append({"stage": here.stage, "phase": here.phase, "coordinate": here.coordinate, "excess": share})
    return out


def _actions(ladder: Ladder, tests: NextTests | None, laws: Sequence[LawFound]) -> tuple[str, ...]:
    """The next test of the strongest cause, of the one that settings were simulated for, and of what is left."""
    said = list[str]()
    named = tests.effect if tests is not None and tests.law is None else None
    if ladder.causes and ladder.causes[0].effect != named:
        said.append(test_by_hand(ladder.causes[0].effect))
    if tests is not None and named is not None:
        said.append(f"{tests.words()} By hand: {test_by_hand(named)}")
    if ladder.structure:
        left = ladder.structure[0]
        law = law_in(tests.law, laws) if tests is not None else None
        if tests is not None and law is not None:
            said.append(f"{tests.words()} By hand: {unknown_test(law.law.stage, followed_by(law))}")
        else:
            by_hand = unknown_test(left.stage, left.goes_with)
            said.append(" ".join((by_hand, why_no_setting(left, laws, named))).strip())
    return tuple(said) or (NONE_TEST,)


def time_shares(ladder: Ladder) -> dict[str, float]:
    """Seconds of the series in free flight, sustained contact and left out (too short, unseen, or a flight that nothing
    fits).
    """
    flight = contact = total = 0.0
    for run in ladder.series.runs:
        t = run.data.time_s
        period = float(np.median(np.diff(t))) if len(t) > 1 else 0.0
        total += t[-1] - t[0] + period
        flight += sum(t[f.last] - t[f.first] + period for f in run.flights)
        contact += sum(t[b] - t[a] + period for a, b in run.segments.contact)
    return {
        "free_flight_s": float(flight),
        "sustained_contact_s": float(contact),
        "left_out_s": float(max(total - flight - contact, 0.0)),
    }
