"""Whether flights believe a law of a camera: how they fit without what it says, and without something of its size."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from analysis.flights.fit import FlightFits
from analysis.gap.ladder import stated_effects
from analysis.gap.laws.found_law import LawFound
from analysis.gap.laws.frames.corrected import given, without_frame_laws
from analysis.gap.laws.frames.evidence.known import known_frames
from analysis.gap.selection.flight_steps import first_flights
from analysis.gap.series import Series
from ovines.core.laws.terms import Term, WrittenLaw


def interpolated_misfit(series: Series, laws: Sequence[LawFound]) -> float:
    """:func:`middle_misfit` where a camera is late by as much as ``laws`` say at the most, always: that moves no
    flight, so that it shows what taking values between the frames alone makes of their noise and beside impacts.  0
    without such laws."""
    late = [term for law in laws for term in law.law.terms if term.target == "camera_delay"]
    if not late:
        return 0.0
    knowns = [known_frames(run.data.time_s, run.data, run.flights) for run in series.runs]
    most_s = max(float(np.abs(given(late, known)).max()) for known in knowns)
    always = Term("camera_delay", min(most_s, 0.5 * series.period_s), x=late[0].x)
    moved = without_frame_laws(series, [WrittenLaw((always,))])
    return middle_misfit(first_flights(moved, stated_effects(moved)).fits)


def typical_misfit(series: Series) -> float:
    """What flights of a series, as it came, leave per freedom in the frames' stated sds: the geometric mean, which a
    few flights under a clock that jumps move as well as all under one that swings."""
    fits = first_flights(series, stated_effects(series)).fits
    ratio = np.concatenate([fit.misfit[fit.freedom > 0] / fit.freedom[fit.freedom > 0] for fit in fits])
    return float(np.exp(np.mean(np.log(ratio)))) if len(ratio) else 0.0


def middle_misfit(fits: Sequence[FlightFits]) -> float:
    """What the middle flight leaves per freedom in the frames' stated sds; 0 without any."""
    ratio = np.concatenate([fit.misfit[fit.freedom > 0] / fit.freedom[fit.freedom > 0] for fit in fits])
    return float(np.median(ratio)) if len(ratio) else 0.0


def fall_of_misfit(before: Sequence[FlightFits], after: Sequence[FlightFits]) -> float:
    """By how much -2 log L falls of the flights that a series, measured one way and another, has of the same frames,
    each flight's noise unknown: one that nothing fits weighs no more than the others."""
    old, new = (_by_frames(fits) for fits in (before, after))
    return sum(freedom * np.log(old[frames][1] / misfit) for frames, (freedom, misfit) in new.items() if frames in old)


def _by_frames(fits: Sequence[FlightFits]) -> dict[tuple[int, int, int], tuple[float, float]]:
    """Freedoms, and what is left per freedom, of each flight by its run, first and last frame."""
    out = {}
    for number, fit in enumerate(fits):
        for flight, freedom, misfit in zip(fit.flights, fit.freedom, fit.misfit, strict=True):
            if freedom > 0 and misfit > 0:
                out[number, flight.first, flight.last] = (float(freedom), float(misfit / freedom))
    return out
