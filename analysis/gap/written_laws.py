"""The laws of a diagnosis: one for each stage in which something is left.  A law that is an effect of the library is
told by its name, and the ladder holds it like any other effect."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from analysis.gap.cause import Cause, Structure
from analysis.gap.ladder import Ladder, run_ladder
from analysis.gap.laws.flight_law import find_flight_law
from analysis.gap.laws.found_law import LawFound
from analysis.gap.laws.frames.law import find_clock_law, find_frame_laws
from analysis.gap.laws.impact_law import find_impact_law, find_wall_law
from analysis.gap.selection.flight_candidates import gains
from analysis.gap.selection.flight_steps import sized_beside
from analysis.gap.selection.left_in_flights import left_in_flights
from analysis.gap.thresholds import DISTANCE_NEGLIGIBLE, LAW_LEAST_CLOSED, NEGLIGIBLE_FRAMES
from ovines.core.laws.terms import WrittenLaw

#: effects that are found by the search of laws
NAMED_BY_LAW = ("nes_rocking",)
# A friction law counts as the disk's rocking where it takes no more than the friction that there is.
MOST_OF_FRICTION = -1.0
# A camera's law that makes the flights fit worse than this is none of a camera.
WORSE = 1.01


def write_laws(
    ladder: Ladder, rng: np.random.Generator, withheld: frozenset[str] = frozenset()
) -> tuple[tuple[LawFound, ...], Ladder]:
    """Laws for what is left in the measurement, in flights, impacts and the wall's shape, in this order, none where
    nothing is left or chance would find as much; and the ladder without the named effects that had imitated a part of a
    law, and with the effect that a law is, unless it is ``withheld``.

    A law comes on top of what the named effects explain, and is asked of the same runs; one of the measurement is taken
    out first, and everything asked again."""
    measured, ladder = _measurement_laws(ladder, rng, withheld)
    left = {one.stage for one in ladder.structure}
    runs, frame, impacts = ladder.series.runs, ladder.series.frame, ladder.impacts.fitted
    fits = ladder.flights.fitted.fits
    laws: list[LawFound | None] = []
    if "flight" in left:
        law, steps = find_flight_law(runs, ladder.flights, frame, rng)
        if law is not None and not law.closed > LAW_LEAST_CLOSED:
            law, steps = None, ladder.flights  # nor does it change the names beside it, or their sizes
        gone = {c.effect for c in ladder.flights.causes} - {c.effect for c in steps.causes}
        if law is not None and law.fitted is not None:
            steps = sized_beside(law.fitted[1], steps, ladder.series)
        sized = {c.effect: c for c in steps.causes}
        causes = tuple(sized.get(c.effect, c) for c in ladder.causes if c.effect not in gone)
        ladder = replace(ladder, flights=steps, causes=causes)
        named = None if law is None or withheld & set(NAMED_BY_LAW) else with_named_law(ladder, law, rng)
        ladder = named or ladder
        laws.append(None if named else law)
    if impacts is not None and "impact" in left:
        laws.append(find_impact_law(impacts, fits, ladder.impacts.restitution_terms, frame, rng))
    if impacts is not None and "geometry" in left:
        laws.append(find_wall_law(impacts, fits, frame, DISTANCE_NEGLIGIBLE * ladder.series.contact_radius_m, rng))
    return (*measured, *(one for one in laws if one is not None and one.closed > LAW_LEAST_CLOSED)), ladder


def _measurement_laws(
    ladder: Ladder, rng: np.random.Generator, withheld: frozenset[str]
) -> tuple[tuple[LawFound, ...], Ladder]:
    """Laws of cameras and clocks where something is left in the measurement or beside the drive, and the ladder of the
    series without what they say, in which what is left of the measurement stays told."""
    told = [one for one in ladder.structure if one.stage == "measurement"]
    laws, series, best = tuple[LawFound, ...](), ladder.measured, ladder
    if told:
        found, corrected = find_frame_laws(series, rng)
        if found:
            again = run_ladder(corrected, rng, withheld)
            if _misfit(again) <= WORSE * _misfit(ladder):
                laws, series, best = found, corrected, again
    # A clock that all cameras share leaves nothing between them: it passes for a sway, a force, or nothing.  A drive
    # that sweeps passes for a clock: the disk's flights are asked, too.
    clock, corrected = find_clock_law(series, rng)
    if clock is not None:
        again = run_ladder(corrected, rng, withheld)
        if _misfit(again) < _misfit(best):
            laws, best = (*laws, clock), again
            told = told or [_clock_structure(clock, ladder)]
    if not laws:
        return (), ladder
    others = [one for one in best.structure if one.stage != "measurement"]
    structure = tuple(sorted([*told, *others], key=lambda one: -one.strength))
    return laws, replace(best, measured=ladder.measured, structure=structure)


def _misfit(ladder: Ladder) -> float:
    """What the nominal model's flights leave, per number: effects named may have imitated a clock."""
    nominal = ladder.flights.nominal
    return nominal.misfit / max(nominal.count, 1)


def _clock_structure(law: LawFound, ladder: Ladder) -> Structure:
    """A clock that no effect of the library is: what its law leaves, in the smallest scatter of times that counts."""
    factor = law.law.terms[0].factors[0]
    gain = float(np.sum(law.before - law.after))
    size_s = law.size
    least_s = NEGLIGIBLE_FRAMES["trigger_jitter"] * ladder.series.period_s
    goes_with = f"the {factor.quantity} of a run: all cameras are late by a time that changes"
    return Structure("measurement", "all", "x", goes_with, size_s / least_s, gain, size_s, "s", law.p)


def named_effect(law: LawFound) -> tuple[str, dict[str, tuple[float, float]]] | None:
    """The effect of the library that a law of the flights is, with its parameters and their sds; None where it is none.

    Friction that is less by a share which dies out exponentially after each impact is ``nes_rocking``."""
    if not _is_rocking(law.rig_law):
        return None
    (relative, relative_sd, _), (decay_s, decay_sd_s, _) = (
        law.numbers[name] for name in ("coefficient", "since_scale_s")
    )
    return NAMED_BY_LAW[0], {"relative": (relative, relative_sd), "decay_s": (decay_s, decay_sd_s)}


def _is_rocking(law: WrittenLaw) -> bool:
    if len(law.terms) != 1 or law.terms[0].target != "floor_friction" or len(law.terms[0].factors) != 1:
        return False
    factor = law.terms[0].factors[0]
    return (
        factor.quantity == "since"
        and factor.function == "exponential"
        and MOST_OF_FRICTION <= law.terms[0].coefficient < 0.0
    )


def with_named_law(ladder: Ladder, law: LawFound, rng: np.random.Generator) -> Ladder | None:
    """The ladder in whose flights a named law acts, and in which only what is left beside it is structure; None where
    the law has no name."""
    named = named_effect(law)
    if named is None or law.fitted is None:
        return None
    effect, parameters = named
    runs, fit = law.fitted
    told = max((s for s in ladder.structure if s.stage == "flight"), key=lambda s: s.strength)
    cause = Cause(effect, "flight", parameters, told.strength, told.gain, told.coordinate, told.phase)
    strongest = max([cause.strength, *(c.strength for c in ladder.flights.causes)])
    units = ladder.flights.units
    left, left_p = left_in_flights(runs, fit, units, rng, strongest * units.negligible_m_per_s2)
    structure = [] if left is None else [left]
    names = {c.effect for c in ladder.flights.causes}
    asked = gains(fit, [g.term for g in (*ladder.flights.kept, *ladder.flights.left)], units)
    steps = replace(
        ladder.flights,
        fitted=fit,
        named=fit,
        causes=(*ladder.flights.causes, cause),
        structure=tuple(structure),
        left=tuple(g for g in asked if g.term.name not in names),
        kept=tuple(g for g in asked if g.term.name in names),
        left_p=left_p,
    )
    structure += [s for s in ladder.structure if s.stage != "flight"]
    return replace(
        ladder,
        series=replace(ladder.series, runs=runs),
        flights=steps,
        causes=tuple(sorted((*ladder.causes, cause), key=lambda c: -c.strength)),
        structure=tuple(sorted(structure, key=lambda s: -s.strength)),
    )
