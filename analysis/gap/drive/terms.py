"""Swings and lines that the Host's paths hold beside the drive, found one after the other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from analysis.flights.cutting.runs import Run
from analysis.gap.drive.lines import LINES_TO, Line, best_line
from analysis.gap.drive.measured_path import MeasuredPath, with_noise_of
from analysis.gap.drive.pushes import RunPushes
from analysis.gap.drive.swinging_wall import Contacts, borne_out
from analysis.gap.drive.swings import CELLS, SWINGS, Swing, TriedSwings, best_swing
from analysis.gap.selection.null_distribution import chance_of_largest

Array = NDArray[np.float64]

# One series in a hundred over four stages, two kinds of candidates here.
LEVEL = 0.01 / 8
MOST_TERMS = 4
# Lines that a run's drive may have of its own beside the main one.
MOST_OWN_LINES = 3


def found_terms(
    paths: list[MeasuredPath], pushes: Sequence[RunPushes], runs: Sequence[Run], contacts: Contacts
) -> tuple[list[Swing], list[Line]]:
    """Swings and lines by forward selection, each fitted again beside the others, on the noise that they leave; of two
    swings the one that path and ``contacts`` together ask for."""
    terms: list[Swing | Line] = []
    below = LINES_TO / float(np.median([np.median(np.diff(path.time_s)) for path in paths]))
    asks_for_lines = any(not runs[path.run].data.host.harmonic for path in paths)
    tried_swings = TriedSwings()
    # A line whose level changes has none beside it.
    if any(len(runs[path.run].data.host.lines_rad_per_s) or not path.tells_lines for path in paths) and len(paths) > 1:
        paths[:] = _with_own_lines(paths, pushes, below, tried_swings)
    for _ in range(MOST_TERMS):
        left = left_of(terms, paths, pushes)
        kinds = [effect for effect in SWINGS if effect not in {t.effect for t in terms if isinstance(t, Swing)}]
        swings = [best_swing(effect, paths, pushes, left, tried_swings) for effect in kinds]
        swings = [one for one in swings if is_there(one, paths)]
        borne = [float(borne_out(one, paths, pushes, contacts).sum()) for one in swings]
        tried: list[Swing | Line] = (
            [max(zip(swings, borne, strict=True), key=lambda one: one[0].gain + one[1])[0]] if swings else []
        )
        if asks_for_lines and is_there(line := best_line(paths, left, below), paths):
            tried.append(line)
        if not tried:
            break
        terms.append(max(tried, key=lambda one: _beyond_chance(one, paths)))
        if len(terms) > 1:
            terms = _again(terms, paths, pushes, below, tried_swings)
    paths[:] = with_noise_of(paths, left_of(terms, paths, pushes))
    terms = _again(terms, paths, pushes, below, tried_swings)
    return [t for t in terms if isinstance(t, Swing)], [t for t in terms if isinstance(t, Line)]


def _with_own_lines(
    paths: Sequence[MeasuredPath], pushes: Sequence[RunPushes], below_hz: float, tried: TriedSwings
) -> list[MeasuredPath]:
    """The paths whose drive holds lines of each run's own, as long as these take more than any swing or line that the
    runs share: a drive whose second line is set anew from run to run."""
    paths = list(paths)
    for _ in range(MOST_OWN_LINES):
        left = [path.place for path in paths]
        own = [best_line([path], [one], below_hz) for path, one in zip(paths, left, strict=True)]
        chances = [chance(one, [path]) for one, path in zip(own, paths, strict=True)]
        # Every run looks for a frequency of its own, which chance rewards.
        looks = np.log([LINES_TO / float(np.median(np.diff(p.time_s))) * float(np.ptp(p.time_s)) for p in paths])
        taken = float(sum(one.gain for one in own) - 4 * len(paths) - 2 * np.sum(np.maximum(looks, 0.0)))
        shared: list[Swing | Line] = [best_swing(effect, paths, pushes, left, tried) for effect in SWINGS]
        shared.append(best_line(paths, left, below_hz))
        if not min(chances) < LEVEL or taken < max(_beyond_chance(one, paths) for one in shared):
            break
        paths = [
            path.with_line(one.frequency_hz) if p < LEVEL else path
            for path, one, p in zip(paths, own, chances, strict=True)
        ]
    return paths


def left_of(
    terms: Sequence[Swing | Line], paths: Sequence[MeasuredPath], pushes: Sequence[RunPushes], but: int = -1
) -> list[Array]:
    """The measured places (N, 2) of each path without the terms, but for one."""
    left = [path.place.copy() for path in paths]
    for number, term in enumerate(terms):
        if number == but:
            continue
        for k, path in enumerate(paths):
            left[k] -= places_of(term, k, path, pushes)
    return left


def places_of(term: Swing | Line, number: int, path: MeasuredPath, pushes: Sequence[RunPushes]) -> Array:
    """What a term does to the Host (N, 2; m) in the ``path`` of this number."""
    if isinstance(term, Line):
        return term.places(number, path.time_s)
    return term.places(pushes, path.run, path.time_s)


def _again(
    terms: Sequence[Swing | Line],
    paths: Sequence[MeasuredPath],
    pushes: Sequence[RunPushes],
    below_hz: float,
    tried: TriedSwings,
) -> list[Swing | Line]:
    """Each term fitted beside the others; what is no longer more than chance leaves."""
    terms = list(terms)
    for number, term in enumerate(terms):
        left = left_of(terms, paths, pushes, number)
        terms[number] = (
            best_line(paths, left, below_hz)
            if isinstance(term, Line)
            else best_swing(term.effect, paths, pushes, left, tried)
        )
    return [one for one in terms if is_there(one, paths)]


def is_there(one: Swing | Line, paths: Sequence[MeasuredPath]) -> bool:
    """Whether it is more than chance, and a swing one that a blow may have set going.  Markers follow a drive only
    where what carries them is faster than it: a slower swing is the Host's."""
    if chance(one, paths) >= LEVEL:
        return False
    if isinstance(one, Line):
        return True
    carried, driven = one.effect == "host_ringing", [path.fastest_hz for path in paths if path.fastest_hz > 0]
    fastest_hz = float(np.median(driven)) if driven else 0.0
    return one.dies_out and not (carried and one.frequency_hz < fastest_hz)


def chance(one: Swing | Line, paths: Sequence[MeasuredPath]) -> float:
    """How often the best of all that was tried gains so much by chance."""
    if isinstance(one, Swing):
        return chance_of_largest(one.gain, 1, CELLS)
    longest = max(float(np.ptp(path.time_s)) for path in paths)
    tried = LINES_TO / float(np.median(np.diff(paths[0].time_s))) * longest
    return chance_of_largest(one.gain, 4 * len(paths), int(np.ceil(tried)))


def _beyond_chance(one: Swing | Line, paths: Sequence[MeasuredPath]) -> float:
    """The gain beyond that of as many free numbers."""
    return one.gain - (1 if isinstance(one, Swing) else 4 * len(paths))
