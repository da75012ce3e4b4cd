"""The laws of the measurement that a diagnosis writes: each is taken out of the series, and all is asked again."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from analysis.gap.cause import BESIDE, CLOCKS, OWN_WAY, Structure
from analysis.gap.ladder import Ladder, run_ladder
from analysis.gap.laws.belief import UNPROMPTED_CLOSED, believed, structure_of_clock, structure_of_law
from analysis.gap.laws.flight_law import force_gain
from analysis.gap.laws.found_law import LawFound
from analysis.gap.laws.frames.believed import interpolated_misfit, middle_misfit, typical_misfit
from analysis.gap.laws.frames.bodies.at_blows import find_blow_law
from analysis.gap.laws.frames.bodies.card import find_card_law
from analysis.gap.laws.frames.bodies.own_way import find_way_law
from analysis.gap.laws.frames.bodies.seen_disk import find_seen_disk_law
from analysis.gap.laws.frames.changed_pictures import changed_picture_laws
from analysis.gap.laws.frames.corrected import without_frame_laws
from analysis.gap.laws.frames.delay import TARGET as DELAY
from analysis.gap.laws.frames.delay import delay_follows, least_delay_s
from analysis.gap.laws.frames.drifting_clock import drifting_clock_law
from analysis.gap.laws.frames.law import find_clock_law, find_disk_picture_laws, find_frame_laws, find_marker_laws
from analysis.gap.measurement.body_residuals import LOOSE_M
from analysis.gap.measurement.fixed_markers import STILL_SHARE
from analysis.gap.series import Series

# A force that gains this share of what a law of where the disk is seen gains is reported in its place.
MOST_BY_A_FORCE = 0.9
# A camera's law that makes the flights fit worse than this is none of a camera.
WORSE = 1.01
# A clock's law is one that flights bear out or know nothing of.  Without their clock's law, as they came, flights of
# five series left 0.4 % (half a frame, slowly) to 40-fold more (every other frame late by a fifth); without a wave in
# place of the step that it was, 17 % less than with it.
HARDLY_WORSE = 1.0005
#: the effect that cuts corners, too
LASTS = "finite_contact_time"


def measurement_laws(
    ladder: Ladder, rng: np.random.Generator, withheld: frozenset[str]
) -> tuple[tuple[LawFound, ...], Ladder]:
    """Laws of cameras, markers and clocks where something is left in the measurement or beside the drive, or where they
    are believed by themselves, and the ladder of the series without what they say, in which what is left of the
    measurement stays reported."""
    laws, series, best = changed_picture_laws(ladder.measured), ladder.measured, ladder
    # A tracker that stays behind moves every marker: first, for delays, forces and walls have it in them.
    way, again = _way_law(ladder, rng, withheld)
    if way is not None:
        laws, series, best = (*laws, way), again.measured, again
    # Tracks that were smoothed cut the corner at every blow, which passes for a force beside the wall.
    beside, again = _blow_law(best, rng, withheld)
    if beside is not None:
        laws, series, best = (*laws, beside), again.measured, again
    begun = best
    measured = [one for one in best.structure if one.stage == "measurement"]
    bent, reported = ([one for one in measured if one.is_taken_out is is_bent] for is_bent in (True, False))
    asked = bool(reported)
    drifting = drifting_clock_law(series, begun.drive)
    if drifting is not None:
        series = without_frame_laws(series, [drifting[0].law])
        laws, best = (*laws, drifting[0]), run_ladder(series, rng, withheld)
    if reported or delay_follows(series):
        found, corrected = find_frame_laws(series, rng)
        if not reported:  # what nothing else asked for is believed by itself only
            found = tuple(one for one in found if believed(one, 1.0, 0.0) is not None)
            corrected = without_frame_laws(series, [one.law for one in found])
        if found:
            again = run_ladder(corrected, rng, withheld)
            misfit = _misfit(again) / WORSE
            if misfit <= _misfit(best) or misfit <= interpolated_misfit(begun.measured, found):
                laws, series, best = (*laws, *found), corrected, again
                reported = _without_spurious_delay(reported, found, begun, again)
                reported = reported or [_delay_structure(one, ladder) for one in found]
    if asked:
        # The disk alone in one view: the two say how they miss each other, flights which of them is off.
        seen = [(law, run_ladder(without, rng, withheld)) for law, without in find_disk_picture_laws(series, rng)]
        law, again = min(seen, key=lambda one: _misfit(one[1]), default=(None, begun))
        if law is not None and _misfit(again) <= WORSE * _misfit(best):
            laws, series, best = (*laws, law), again.measured, again
    # Markers of a body against each other: flights know nothing of them.
    found, corrected = find_marker_laws(series, rng)
    if found:
        laws, series, best = (*laws, *found), corrected, run_ladder(corrected, rng, withheld)
        reported = reported or [_marker_structure(one) for one in found]
    # A clock that all cameras share leaves nothing between them: it passes for a sway, a force, scattered frames, or
    # nothing.  A drive that sweeps passes for a clock: the disk's flights are asked, too, before anything is named, for
    # what is named may have taken the clock with it.
    clock, corrected = find_clock_law(series, rng)
    if clock is not None and believed(clock, 1.0, 0.0) is not None:
        again = run_ladder(corrected, rng, withheld)
        most = 1 / WORSE if _found(again) > _found(best) else HARDLY_WORSE
        if typical_misfit(corrected) < most * typical_misfit(series):
            laws, series, best = (*laws, clock), corrected, again
            reported = reported or [structure_of_clock(clock, ladder.series.period_s)]
    # How the card with the disk's markers lies on it: what stays from blow to blow no probe tells.
    card, again = _card_law(series, best, rng, withheld)
    if card is not None:
        laws, best, reported = (*laws, card), again, [*reported, _card_structure(card)]
    if drifting is not None:
        reported = [*reported, drifting[1]]
    if way is not None:
        reported = [*reported, _way_structure(way, ladder)]
    if beside is not None:
        reported = [*reported, _blow_structure(beside, ladder)]
    if not laws:
        return (), ladder
    others = [one for one in best.structure if one.stage != "measurement"]
    structure = tuple(sorted([*reported, *bent, *others], key=lambda one: -one.strength))
    return laws, replace(best, measured=ladder.measured, structure=structure)


def _without_spurious_delay(
    reported: list[Structure], found: tuple[LawFound, ...], ladder: Ladder, again: Ladder
) -> list[Structure]:
    """``reported`` but for a delay that changes, where it is gone ``again`` without what laws of pictures say, and none
    was found of a delay: a picture that lies elsewhere in some runs moves points as a late camera does."""
    changed, delayed = ladder.measurement.clock_change, [t for one in found for t in one.law.terms if t.target == DELAY]
    if delayed or again.measurement.clock_change is not None:
        return reported
    return [one for one in reported if one is not changed]


def _way_law(ladder: Ladder, rng: np.random.Generator, withheld: frozenset[str]) -> tuple[LawFound | None, Ladder]:
    """The law of how far every marker stays behind on its own way, and the ladder of the series without it.  Bodies
    tell how far, and both halves of the runs alike; flights, which know nothing of it, must fit better without."""
    law = find_way_law(ladder.measured, rng)
    if law is None or law.size <= _still_m(ladder) or law.halves is None:
        return None, ladder
    if not (law.halves.agree and law.halves.both_show_it):
        return None, ladder
    again = run_ladder(without_frame_laws(ladder.measured, [law.law]), rng, withheld)
    return (law, again) if WORSE * _misfit(again) < _misfit(ladder) else (None, ladder)


def _blow_law(ladder: Ladder, rng: np.random.Generator, withheld: frozenset[str]) -> tuple[LawFound | None, Ladder]:
    """The law of what every place holds of the frames beside it, and the ladder of the series without it.  Less must be
    named and left then, or as much, and flights fit better.  A contact that lasts cuts corners, too: where it explains
    everything, it is reported."""
    law = find_blow_law(ladder.measured, rng)
    if law is None or law.size <= _still_m(ladder) or law.halves is None or not law.halves.both_show_it:
        return None, ladder
    again = run_ladder(without_frame_laws(ladder.measured, [law.law]), rng, withheld)
    lasts = any(cause.effect == LASTS for cause in ladder.causes)
    if lasts and not any(cause.effect == LASTS for cause in again.causes) and not ladder.structure:
        return None, ladder
    less = _found(ladder) - _found(again)
    fits = WORSE * _misfit(again) < _misfit(ladder)
    return (law, again) if less > 0 or (less == 0 and fits) else (None, ladder)


def _still_m(ladder: Ladder) -> float:
    """What moves a marker or the disk by less counts as still (m)."""
    return STILL_SHARE * ladder.measured.contact_radius_m


def _card_law(
    series: Series, ladder: Ladder, rng: np.random.Generator, withheld: frozenset[str]
) -> tuple[LawFound | None, Ladder]:
    """The law of how the card with the disk's markers lies on it, and the ladder of the ``series``, which is that of
    ``ladder`` before its corrections, without it."""
    law = find_card_law(ladder.flights.named, ladder.series, rng)
    if law is None or believed(law, law.size, LOOSE_M) is None:
        return None, ladder
    again = run_ladder(without_frame_laws(series, [law.law]), rng, withheld)
    return (None, ladder) if _misfit(again) > WORSE * _misfit(ladder) else (law, again)


def seen_disk_law(
    ladder: Ladder, rng: np.random.Generator, withheld: frozenset[str]
) -> tuple[tuple[LawFound, ...], Ladder]:
    """The law of where the disk is seen beside where it is, and the ladder of the series without it.

    Only where flights have something left, and nothing of them, the impacts or the wall has without it: a force that
    bends paths leaves them bent wherever their pictures are moved to.  And only where no force says nearly as much: a
    floor that leans with the Host's place moves the disk as a picture that is stretched along one direction does, and
    leaves the wall round."""
    left = {one.stage for one in ladder.structure if not one.is_taken_out}
    if "flight" not in left or left & {"measurement", "drive"} or ladder.series.points is None:
        return (), ladder
    law, seen_gain = find_seen_disk_law(ladder.flights.named, ladder.series.frame, rng)
    least_m = _still_m(ladder)
    if law is None or law.size <= least_m or law.closed <= UNPROMPTED_CLOSED:
        return (), ladder
    again = run_ladder(without_frame_laws(ladder.measured, [law.law]), rng, withheld)
    if not all(one.is_taken_out for one in again.structure) or _misfit(again) > _misfit(ladder):
        return (), ladder
    if force_gain(ladder.series.runs, ladder.flights.named, rng) > MOST_BY_A_FORCE * seen_gain:
        return (), ladder
    structure = _structure(law, least_m, "{}: the disk is seen beside where it is")
    # A shape of the wall that shows only once the picture is moved is what the law, read off flights, misses there.
    named = {cause.effect for cause in ladder.causes}
    causes = tuple(c for c in again.causes if c.stage != "geometry" or c.effect in named)
    return (law,), replace(again, measured=ladder.measured, structure=(structure,), causes=causes)


def _misfit(ladder: Ladder) -> float:
    """What the nominal model's flights leave per freedom in the frames' stated sds, in the middle flight: effects named
    may have imitated a clock, and so may the noise that flights show."""
    return middle_misfit(ladder.flights.nominal.fits)


def _found(ladder: Ladder) -> int:
    """How much a ladder names and leaves: a clock that is not wrong, once it is "mended", has paths bent that were
    straight."""
    return len(ladder.causes) + len(ladder.structure)


def _delay_structure(law: LawFound, ladder: Ladder) -> Structure:
    """What a law of a camera's delay leaves that no mean over a part of the runs has shown."""
    return _structure(law, least_delay_s(ladder.series), "{}: " + CLOCKS[1], "s")


def _marker_structure(law: LawFound) -> Structure:
    """What a law of a marker leaves that no mean over a part of the runs has shown."""
    return _structure(law, LOOSE_M, "{}: a marker moves on its body")


def _way_structure(law: LawFound, ladder: Ladder) -> Structure:
    """What a law of every marker along its own way leaves, which no probe tells."""
    follows = ", by a length that follows its speed" if law.law.terms[0].factors else ""
    return _structure(law, _still_m(ladder), f"{OWN_WAY}{follows}")


def _blow_structure(law: LawFound, ladder: Ladder) -> Structure:
    """What a law of the frames beside each leaves, which no probe tells."""
    when = "before" if all(term.x < 0 for term in law.law.terms) else "before and after"
    return _structure(law, _still_m(ladder), f"{BESIDE}: at a blow, places hold a share of those {when}")


def _card_structure(law: LawFound) -> Structure:
    """What a law of the card leaves, which no probe tells."""
    return _structure(law, LOOSE_M, "{}: the markers' card moves on the NES")


def _structure(law: LawFound, least: float, words: str, unit: str = "m") -> Structure:
    """What a law of the measurement leaves in all frames, in ``words`` with what its first term follows in them; by
    less than ``least`` (in ``unit``) it counts as nothing."""
    one = structure_of_law(law, "measurement", "x", law.size, least)
    return replace(one, phase="all", unit=unit, goes_with=words.format(one.goes_with))
