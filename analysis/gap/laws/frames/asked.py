"""The laws of the measurement that a diagnosis writes: each is taken out of the series, and all is asked again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.gap.cause import BESIDE, CLOCKS, OWN_WAY, SEEN_HOST, TILTING_HOST, Structure
from analysis.gap.ladder import Ladder, run_ladder
from analysis.gap.laws.belief import UNPROMPTED_CLOSED, believed, structure_of_clock, structure_of_law
from analysis.gap.laws.flight_law import force_gain
from analysis.gap.laws.found_law import LawFound
from analysis.gap.laws.frames.believed import (
    fall_of_misfit,
    interpolated_misfit,
    middle_misfit,
    typical_misfit,
)
from analysis.gap.laws.frames.bodies.at_blows import find_blow_law
from analysis.gap.laws.frames.bodies.card import find_card_law
from analysis.gap.laws.frames.bodies.own_way import find_way_law
from analysis.gap.laws.frames.bodies.seen_disk import find_seen_disk_law
from analysis.gap.laws.frames.bodies.seen_host import find_seen_host_law
from analysis.gap.laws.frames.bodies.tilt import LEAST_TILT, find_tilt_law
from analysis.gap.laws.frames.changed_pictures import changed_picture_laws
from analysis.gap.laws.frames.corrected import without_frame_laws
from analysis.gap.laws.frames.delay import TARGET as DELAY
from analysis.gap.laws.frames.delay import delay_follows, least_delay_s
from analysis.gap.laws.frames.drifting_clock import drifting_clock_law
from analysis.gap.laws.frames.law import find_clock_law, find_disk_picture_laws, find_frame_laws, find_marker_laws
from analysis.gap.measurement.body_residuals import loose_m
from analysis.gap.measurement.fixed_markers import STILL_SHARE
from analysis.gap.series import Series
from analysis.gap.thresholds import EQUIVALENT

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
LATE = "camera_clock_offset"


@dataclass(frozen=True, eq=False)
class _Now:
    """What has been found: ``laws``, the ``series`` without what they say and its ``ladder``; the ladder that was
    ``begun`` with, what its probes ``reported`` of the measurement, and what laws leave that no probe tells,
    ``untold``."""

    laws: tuple[LawFound, ...]
    series: Series
    ladder: Ladder
    begun: Ladder
    reported: tuple[Structure, ...] = ()
    untold: tuple[Structure, ...] = ()

    def with_laws(self, laws: Sequence[LawFound], ladder: Ladder, untold: Sequence[Structure] = ()) -> _Now:
        """With further laws, and the ladder of the series without them."""
        return replace(
            self,
            laws=(*self.laws, *laws),
            series=ladder.measured,
            ladder=ladder,
            untold=(*self.untold, *untold),
        )

    def reported_or(self, structure: Sequence[Structure]) -> _Now:
        """With ``structure`` where no probe has reported anything."""
        return replace(self, reported=self.reported or tuple(structure))


def measurement_laws(
    ladder: Ladder, rng: np.random.Generator, withheld: frozenset[str]
) -> tuple[tuple[LawFound, ...], Ladder]:
    """Laws of cameras, markers and clocks where something is left in the measurement or beside the drive, or where they
    are believed by themselves, and the ladder of the series without what they say, in which what is left of the
    measurement stays reported."""
    now = _Now(changed_picture_laws(ladder.measured), ladder.measured, ladder, ladder)
    # A tracker that stays behind moves every marker: first, for delays, forces and walls have it in them.  Tracks that
    # were smoothed cut the corner at every blow, which passes for a force beside the wall.
    for step in (_way_law, _blow_law):
        now = step(now, rng, withheld)
    measured = [one for one in now.ladder.structure if one.stage == "measurement"]
    bent, reported = ([one for one in measured if one.is_taken_out is is_bent] for is_bent in (True, False))
    now = replace(now, begun=now.ladder, reported=tuple(reported))
    now = _frame_laws(_drifting_clock(now, rng, withheld), rng, withheld)
    if reported:
        now = _disk_picture_law(now, rng, withheld)
    for step in (_marker_laws, _tilt_law, _clock_law, _card_law):
        now = step(now, rng, withheld)
    if not now.laws:
        return (), ladder
    others = [one for one in now.ladder.structure if one.stage != "measurement"]
    structure = sorted([*now.reported, *now.untold, *bent, *others], key=lambda one: -one.weight)
    return now.laws, replace(now.ladder, measured=ladder.measured, structure=tuple(structure))


def _drifting_clock(now: _Now, rng: np.random.Generator, withheld: frozenset[str]) -> _Now:
    """With the law of a clock whose rate goes from run to run, where there is one."""
    drifting = drifting_clock_law(now.series, now.ladder.drive)
    if drifting is None:
        return now
    law, structure = drifting
    again = run_ladder(without_frame_laws(now.series, [law.law]), rng, withheld)
    return now.with_laws([law], again, [structure])


def _frame_laws(now: _Now, rng: np.random.Generator, withheld: frozenset[str]) -> _Now:
    """With laws of the cameras' pictures and of a delay between them, where flights do not fit worse without them."""
    if not (now.reported or delay_follows(now.series)):
        return now
    found, corrected = find_frame_laws(now.series, rng)
    if not now.reported:  # what nothing else asked for is believed by itself only
        found = tuple(one for one in found if believed(one, 1.0, 0.0) is not None)
        corrected = without_frame_laws(now.series, [one.law for one in found])
    if not found:
        return now
    again = run_ladder(corrected, rng, withheld)
    misfit = _misfit(again) / WORSE
    if misfit > _misfit(now.ladder) and misfit > interpolated_misfit(now.begun.measured, found):
        return now
    reported = _without_spurious_delay(now.reported, found, now.begun, again)
    if not reported:
        reported = [delay_structure(one, now.series) for one in found]
    return replace(now.with_laws(found, again), reported=tuple(reported))


def _disk_picture_law(now: _Now, rng: np.random.Generator, withheld: frozenset[str]) -> _Now:
    """With the law of what a camera's picture does to the disk alone, of the camera whose flights fit best without it:
    the two views say how they miss each other, flights which of them is off."""
    found = find_disk_picture_laws(now.series, rng)
    seen = [(law, run_ladder(without, rng, withheld)) for law, without in found]
    law, again = min(seen, key=lambda one: _misfit(one[1]), default=(None, now.ladder))
    return now if law is None or _misfit(again) > WORSE * _misfit(now.ladder) else now.with_laws([law], again)


def _marker_laws(now: _Now, rng: np.random.Generator, withheld: frozenset[str]) -> _Now:
    """With laws of markers of a body against each other: flights know nothing of them."""
    found, corrected = find_marker_laws(now.series, rng)
    if not found:
        return now
    moves = [_structure(one, loose_m(now.series), "{}: a marker moves on its body") for one in found]
    return now.with_laws(found, run_ladder(corrected, rng, withheld)).reported_or(moves)


def _tilt_law(now: _Now, rng: np.random.Generator, withheld: frozenset[str]) -> _Now:
    """With the law by which the Host's markers tilt: flights and places hardly know of it."""
    law = find_tilt_law(now.series, rng.spawn(1)[0])  # what is found after it hangs on no law that is not
    if law is None or believed(law, law.size, LEAST_TILT) is None:
        return now
    again = run_ladder(without_frame_laws(now.series, [law.law]), rng, withheld)
    return now.with_laws([law], again, [_structure(law, LEAST_TILT, "{}: " + TILTING_HOST, "1")])


def _clock_law(now: _Now, rng: np.random.Generator, withheld: frozenset[str]) -> _Now:
    """With the law of a clock that all cameras share, which leaves nothing between them: it passes for a sway, a force,
    scattered frames, or nothing.

    A drive that sweeps passes for a clock: the disk's flights are asked, too, before anything is named, for what is
    named may have taken the clock with it."""
    clock, corrected = find_clock_law(now.series, rng)
    if clock is None or believed(clock, 1.0, 0.0) is None:
        return now
    again = run_ladder(corrected, rng, withheld)
    most = 1 / WORSE if _found(again) > _found(now.ladder) else HARDLY_WORSE
    if typical_misfit(corrected) >= most * typical_misfit(now.series):
        return now
    return now.with_laws([clock], again).reported_or([structure_of_clock(clock, now.series.period_s)])


def _without_spurious_delay(
    reported: Sequence[Structure], found: Sequence[LawFound], ladder: Ladder, again: Ladder
) -> Sequence[Structure]:
    """``reported`` but for a delay that changes, where it is gone ``again`` without what laws of pictures say, and none
    was found of a delay: a picture that lies elsewhere in some runs moves points as a late camera does."""
    changed, delayed = ladder.measurement.clock_change, [t for one in found for t in one.law.terms if t.target == DELAY]
    if delayed or again.measurement.clock_change is not None:
        return reported
    return [one for one in reported if one is not changed]


def _way_law(now: _Now, rng: np.random.Generator, withheld: frozenset[str]) -> _Now:
    """With the law of how far every marker stays behind on its own way.  Bodies tell how far, and both halves of the
    runs alike; flights, which know nothing of it, must fit better without."""
    law = find_way_law(now.series, rng)
    if law is None or law.size <= _still_m(now.ladder) or law.halves is None:
        return now
    if not (law.halves.agree and law.halves.both_show_it):
        return now
    again = run_ladder(without_frame_laws(now.series, [law.law]), rng, withheld)
    if WORSE * _misfit(again) >= _misfit(now.ladder):
        return now
    return now.with_laws([law], again, [_way_structure(law, now.ladder)])


def _blow_law(now: _Now, rng: np.random.Generator, withheld: frozenset[str]) -> _Now:
    """With the law of what every place holds of the frames beside it.  Flights must not fit worse then, and less must
    be named and left, or as much, and flights fit better.  A contact that lasts cuts corners, too: where it explains
    everything, it is reported.  And so does a late camera, whose picture is taken on the other side of a blow: then
    places must cut them without these frames, too."""
    ladder = now.ladder
    late = any(cause.effect == LATE for cause in ladder.causes)
    if late and find_blow_law(ladder.series, rng.spawn(1)[0]) is None:
        return now
    law = find_blow_law(now.series, rng)
    if law is None or law.size <= _still_m(ladder) or law.halves is None or not law.halves.both_show_it:
        return now
    corrected = without_frame_laws(now.series, [law.law])
    if typical_misfit(corrected) > WORSE * typical_misfit(now.series):
        return now
    again = run_ladder(corrected, rng, withheld)
    lasts = any(cause.effect == LASTS for cause in ladder.causes)
    if lasts and not any(cause.effect == LASTS for cause in again.causes) and not ladder.structure:
        return now
    less = _found(ladder) - _found(again)
    if less < 0 or (less == 0 and WORSE * _misfit(again) >= _misfit(ladder)):
        return now
    return now.with_laws([law], again, [_blow_structure(law, ladder)])


def _card_law(now: _Now, rng: np.random.Generator, withheld: frozenset[str]) -> _Now:
    """With the law of how the card with the disk's markers lies on it: what stays from blow to blow no probe tells."""
    law = find_card_law(now.ladder.flights.named, now.ladder.series, rng)
    if law is None or believed(law, law.size, loose_m(now.series)) is None:
        return now
    again = run_ladder(without_frame_laws(now.series, [law.law]), rng, withheld)
    if _misfit(again) > WORSE * _misfit(now.ladder):
        return now
    return now.with_laws([law], again, [_card_structure(law, now.ladder)])


def _still_m(ladder: Ladder) -> float:
    """What moves a marker or the disk by less counts as still (m)."""
    return STILL_SHARE * ladder.measured.contact_radius_m


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


def seen_host_law(
    ladder: Ladder, rng: np.random.Generator, withheld: frozenset[str]
) -> tuple[tuple[LawFound, ...], Ladder]:
    """The law of where the Host is seen beside where it is, and the ladder of the series without it.

    Contact distances tell how far, and say the same of a ring that moves on the Host.  That leaves the floor where it
    is seen, so that flights tell which it is."""
    rng = rng.spawn(1)[0]  # what is found after it hangs on no law that is not
    impacts, left = ladder.impacts.fitted, {one.stage for one in ladder.structure if not one.is_taken_out}
    if impacts is None or ladder.series.points is None or left & {"measurement", "drive"}:
        return (), ladder
    law = find_seen_host_law(impacts, ladder.flights.named.fits, ladder.series.frame, rng)
    least_m = _still_m(ladder)
    if law is None or believed(law, law.size, least_m) is None:
        return (), ladder
    again = run_ladder(without_frame_laws(ladder.measured, [law.law]), rng, withheld)
    if fall_of_misfit(ladder.flights.nominal.fits, again.flights.nominal.fits) < EQUIVALENT:
        return (), ladder
    structure = _structure(law, least_m, "{}: " + SEEN_HOST)
    return (law,), replace(again, measured=ladder.measured, structure=(structure, *again.structure))


def _misfit(ladder: Ladder) -> float:
    """What the nominal model's flights leave per freedom in the frames' stated sds, in the middle flight: effects named
    may have imitated a clock, and so may the noise that flights show."""
    return middle_misfit(ladder.flights.nominal.fits)


def _found(ladder: Ladder) -> int:
    """How much a ladder names and leaves: a clock that is not wrong, once it is "mended", has paths bent that were
    straight."""
    return len(ladder.causes) + len(ladder.structure)


def delay_structure(law: LawFound, series: Series) -> Structure:
    """What a law of a camera's delay leaves that no mean over a part of the runs has shown."""
    return _structure(law, least_delay_s(series), "{}: " + CLOCKS[1], "s")


def _way_structure(law: LawFound, ladder: Ladder) -> Structure:
    """What a law of every marker along its own way leaves, which no probe tells."""
    follows = ", by a length that follows its speed" if law.law.terms[0].factors else ""
    return _structure(law, _still_m(ladder), f"{OWN_WAY}{follows}")


def _blow_structure(law: LawFound, ladder: Ladder) -> Structure:
    """What a law of the frames beside each leaves, which no probe tells."""
    when = "before" if all(term.x < 0 for term in law.law.terms) else "before and after"
    return _structure(law, _still_m(ladder), f"{BESIDE}: at a blow, places hold a share of those {when}")


def _card_structure(law: LawFound, ladder: Ladder) -> Structure:
    """What a law of the card leaves, which no probe tells."""
    return _structure(law, loose_m(ladder.measured), "{}: the markers' card moves on the NES")


def _structure(law: LawFound, least: float, words: str, unit: str = "m") -> Structure:
    """What a law of the measurement leaves in all frames, in ``words`` with what its first term follows in them; by
    less than ``least`` (in ``unit``) it counts as nothing."""
    one = structure_of_law(law, "measurement", "x", law.size, least)
    return replace(one, phase="all", unit=unit, goes_with=words.format(one.goes_with))
