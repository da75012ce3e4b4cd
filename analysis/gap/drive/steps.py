"""The drive's step: asked against measured, then what the Host does beside its drive, named or not.

Swings after the disk's pushes and slow lines compete for the same path; the one that explains most is added and the
search goes on in what it leaves.  What has a name is stage "drive".
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from analysis.flights.fit import FlightFits
from analysis.flights.runs import Run
from analysis.flights.stated_terms import stated_sizes
from analysis.gap.cause import Cause, Structure
from analysis.gap.drive.measured_path import MeasuredPath, measured_path, with_noise_of
from analysis.gap.drive.pushes import RunPushes, pushes_of
from analysis.gap.drive.swings import CELLS, LINES_TO, SWINGS, Line, Swing, best_line, best_swing
from analysis.gap.selection.null_distribution import chance_of_largest
from analysis.gap.series import Series, with_host_moved
from analysis.gap.thresholds import EQUIVALENT, IMPACT_GAIN, IMPROVED, SIGNIFICANCE
from analysis.motion.drive import BY_CHANCE, DriveFinding, drive_findings

Array = NDArray[np.float64]
# The Host is off its drive by less than this share of the contact radius (RMS over the runs): 2 um on the sample rig.
NEGLIGIBLE_SHARE = 5e-5
# Slower than this share of the drive's frequency a line is no drive but a sway.
SLOW_SHARE = 0.5
# One series in a hundred over four stages, two kinds of candidates here.
LEVEL = 0.01 / 8
# A line is there in a run that alone would show it once in a thousand.
SURE_IN_RUN = float(chdtri(4, 1e-3))
MOST_TERMS = 4
# Lines that a run's drive may have of its own beside the main one.
MOST_OWN_LINES = 3
# [model] states a size that is off by less than this share: it is the same.
SAME_SHARE = 0.1
NORMAL_90 = 1.645


@dataclass(frozen=True, eq=False)
class DriveSteps:
    """``findings``: asked against measured; ``swings`` and ``lines`` that the Host's path holds beside the drive, with
    the ``paths`` and ``pushes`` they are of; ``causes`` and ``structure`` among them, ``error`` by step (R,): sums of
    squares of the path over its noise's variance, ``by_effect`` (R,) what each named one takes of it; ``tells_sway``:
    whether a slow line would be known for one, the drives being lines and the cameras still."""

    findings: tuple[DriveFinding, ...] = ()
    paths: tuple[MeasuredPath, ...] = ()
    pushes: tuple[RunPushes, ...] = ()
    swings: tuple[Swing, ...] = ()
    lines: tuple[Line, ...] = ()
    causes: tuple[Cause, ...] = ()
    structure: tuple[Structure, ...] = ()
    error: dict[str, Array] = field(default_factory=dict)
    by_effect: dict[str, Array] = field(default_factory=dict)
    tells_sway: bool = False

    def places(self, path: int) -> Array:
        """What swings and lines do to the Host (N, 2; m) in one of the ``paths``."""
        one = self.paths[path]
        out = np.zeros((len(one.time_s), 2))
        for swing in self.swings:
            out += swing.places(self.pushes, one.run, one.time_s)
        for line in self.lines:
            out += line.places(path, one.time_s)
        return out

    def entry(self, names: Sequence[str]) -> dict[str, Any]:
        """``drive`` of diagnosis.json; ``names`` of the runs."""
        return {
            "false_alarms": {"findings": BY_CHANCE, "beside": LEVEL},
            "findings": [
                {"stage": "drive", "run": names[f.run], "kind": f.kind, "size": f.size, "unit": f.unit}
                | {"low": f.size - NORMAL_90 * f.sd, "high": f.size + NORMAL_90 * f.sd}
                | {"p": f.p, "at": f.at, "found": f.found, "words": f.words}
                for f in self.findings
            ],
            "beside": [
                {"kind": s.effect, "frequency_hz": s.frequency_hz, "rms_m": rms_m(self, s), "gain": s.gain}
                | {"held_out_gain": float(s.held_out.sum()), "p": chance(s, self.paths)}
                for s in self.swings
            ]
            + [
                {"kind": "line", "frequency_hz": one.frequency_hz, "rms_m": rms_m(self, one), "gain": one.gain}
                | {"held_out_gain": None, "p": chance(one, self.paths)}
                for one in self.lines
            ],
        }


def drive_steps(
    series: Series, fits: Sequence[FlightFits], withheld: frozenset[str], ground_moves: bool
) -> tuple[DriveSteps, Series]:
    """The drive of a series, and the series without what rings with the Host's markers alone.

    ``fits``: first fits of the flights, by which impacts are known.  ``ground_moves``: the ground markers move too, a
    sway is then the cameras'."""
    asked = [recording.excitation for recording in series.recordings]
    findings = drive_findings([(run.data.time_s, run.data.host) for run in series.runs], asked, series.frame)
    pushes = pushes_of(fits)
    paths = [path for path in map(measured_path, series.runs, range(len(series.runs))) if path is not None]
    steps = DriveSteps(tuple(findings), tuple(paths), tuple(pushes))
    if not paths:
        return steps, series
    swings, lines = _found(paths, pushes, series.runs)
    steps = replace(steps, paths=tuple(paths), swings=tuple(swings), lines=tuple(lines))
    steps = _judged(steps, series, withheld, ground_moves)
    ringing = next((one for one in swings if one.effect == "host_ringing" and _surely(one, steps, series)), None)
    if ringing is not None:
        moved = [ringing.places(pushes, number, run.data.time_s) for number, run in enumerate(series.runs)]
        series = with_host_moved(series, [-one for one in moved])
    return steps, series


def _found(
    paths: list[MeasuredPath], pushes: Sequence[RunPushes], runs: Sequence[Run]
) -> tuple[list[Swing], list[Line]]:
    """Swings and lines by forward selection, each fitted again beside the others, on the noise that they leave."""
    terms: list[Swing | Line] = []
    below = LINES_TO / float(np.median([np.median(np.diff(path.time_s)) for path in paths]))
    asks_for_lines = any(not runs[path.run].data.host.harmonic for path in paths)
    # A line whose level changes has none beside it.
    if any(len(runs[path.run].data.host.lines_rad_per_s) or not path.tells_lines for path in paths) and len(paths) > 1:
        paths[:] = _with_own_lines(paths, pushes, below)
    for _ in range(MOST_TERMS):
        left = _left(terms, paths, pushes)
        kinds = [effect for effect in SWINGS if effect not in {t.effect for t in terms if isinstance(t, Swing)}]
        tried: list[Swing | Line] = [best_swing(effect, paths, pushes, left) for effect in kinds]
        if asks_for_lines:
            tried.append(best_line(paths, left, below))
        tried = [one for one in tried if _there(one, paths)]
        if not tried:
            break
        terms.append(max(tried, key=lambda one: _beyond_chance(one, paths)))
        if len(terms) > 1:
            terms = _again(terms, paths, pushes, below)
    paths[:] = with_noise_of(paths, _left(terms, paths, pushes))
    terms = _again(terms, paths, pushes, below)
    return [t for t in terms if isinstance(t, Swing)], [t for t in terms if isinstance(t, Line)]


def _with_own_lines(paths: Sequence[MeasuredPath], pushes: Sequence[RunPushes], below_hz: float) -> list[MeasuredPath]:
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
        shared: list[Swing | Line] = [best_swing(effect, paths, pushes, left) for effect in SWINGS]
        shared.append(best_line(paths, left, below_hz))
        if not min(chances) < LEVEL or taken < max(_beyond_chance(one, paths) for one in shared):
            break
        paths = [
            path.with_line(one.frequency_hz) if p < LEVEL else path
            for path, one, p in zip(paths, own, chances, strict=True)
        ]
    return paths


def _left(
    terms: Sequence[Swing | Line], paths: Sequence[MeasuredPath], pushes: Sequence[RunPushes], but: int = -1
) -> list[Array]:
    """The measured places (N, 2) of each path without the terms, but for one."""
    left = [path.place.copy() for path in paths]
    for number, term in enumerate(terms):
        if number == but:
            continue
        for k, path in enumerate(paths):
            left[k] -= _places(term, k, path, pushes)
    return left


def _places(term: Swing | Line, number: int, path: MeasuredPath, pushes: Sequence[RunPushes]) -> Array:
    """What a term does to the Host (N, 2; m) in the ``path`` of this number."""
    if isinstance(term, Line):
        return term.places(number, path.time_s)
    return term.places(pushes, path.run, path.time_s)


def _again(
    terms: Sequence[Swing | Line], paths: Sequence[MeasuredPath], pushes: Sequence[RunPushes], below_hz: float
) -> list[Swing | Line]:
    """Each term fitted beside the others; what is no longer more than chance leaves."""
    terms = list(terms)
    for number, term in enumerate(terms):
        left = _left(terms, paths, pushes, number)
        terms[number] = (
            best_line(paths, left, below_hz) if isinstance(term, Line) else best_swing(term.effect, paths, pushes, left)
        )
    return [one for one in terms if _there(one, paths)]


def _there(one: Swing | Line, paths: Sequence[MeasuredPath]) -> bool:
    """Whether it is more than chance, and a swing one that a blow may have set going.  Markers follow a drive only
    where what carries them is faster than it: a slower swing is the Host's."""
    if chance(one, paths) >= LEVEL:
        return False
    if isinstance(one, Line):
        return True
    carried = one.effect == "host_ringing"
    return one.dies_out and not (carried and one.frequency_hz < float(np.median([path.drive_hz for path in paths])))


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


def _surely(one: Swing, steps: DriveSteps, series: Series) -> bool:
    return (
        one.gain > IMPACT_GAIN
        and float(one.held_out.sum()) > IMPACT_GAIN / 2
        and float(np.mean(one.held_out > 0)) >= IMPROVED
        and one.share > SIGNIFICANCE * float(np.sqrt(one.covariance[0, 0]))
        and rms_m(steps, one) > NEGLIGIBLE_SHARE * series.runs[0].data.contact_radius_m
    )


def rms_m(steps: DriveSteps, one: Swing | Line) -> float:
    """RMS (m) of what a term does to the Host."""
    squares = [np.sum(_places(one, k, path, steps.pushes) ** 2, 1) for k, path in enumerate(steps.paths)]
    return float(np.sqrt(np.mean(np.concatenate(squares))))


def _judged(steps: DriveSteps, series: Series, withheld: frozenset[str], ground_moves: bool) -> DriveSteps:
    """Causes and structure among the terms, and their errors."""
    least = NEGLIGIBLE_SHARE * series.runs[0].data.contact_radius_m
    causes: list[Cause] = []
    structure: list[Structure] = []
    by_effect: dict[str, Array] = {}
    runs = len(series.runs)
    for swing in steps.swings:
        if not _surely(swing, steps, series):
            continue
        size = rms_m(steps, swing)
        by_effect[swing.effect] = _by_run(steps.paths, swing.held_out, runs)
        if swing.effect in withheld:
            words = f"the impacts before (it swings at {swing.frequency_hz:.3g} Hz)"
            structure.append(_structure(words, size, least, swing.gain, chance(swing, steps.paths)))
        else:
            causes.append(replace(_swing_cause(swing, size / least, series), rivals=_rivals(swing, steps)))
    tell = np.array([path.tells_lines for path in steps.paths])
    # Where the drive of most runs is random, slow lines of the others are the drive's, too.
    tells_sway = int(np.sum(tell)) >= IMPROVED * runs and not ground_moves
    for line in steps.lines if tells_sway else ():
        size = rms_m(steps, line)
        drive_hz = float(np.median([path.drive_hz for path in steps.paths if path.tells_lines]))
        if line.frequency_hz >= SLOW_SHARE * drive_hz or size < least:
            continue
        if float(np.mean(line.each[tell] > SURE_IN_RUN)) < IMPROVED:
            continue
        by_effect["host_sway"] = by_effect.get("host_sway", np.zeros(runs)) + _by_run(steps.paths, line.each, runs)
        if "host_sway" in withheld or "host_sway" in {c.effect for c in causes}:
            words = f"time, at {line.frequency_hz:.3g} Hz beside the drive"
            structure.append(_structure(words, size, least, line.gain, chance(line, steps.paths)))
        else:
            causes.append(_sway_cause(line, size / least, series, steps.paths))
    named = {c.effect for c in causes}
    taken = np.sum([gain for effect, gain in by_effect.items() if effect in named] or [np.zeros(runs)], 0)
    left = _left([*steps.swings, *steps.lines], steps.paths, steps.pushes)
    floor = _by_run(
        steps.paths, [float(np.sum(p.white(one) ** 2)) for p, one in zip(steps.paths, left, strict=True)], runs
    )
    error = {"recalibrated": floor + taken, "with_effect": floor, "noise_floor": floor}
    return replace(
        steps,
        causes=tuple(causes),
        structure=tuple(structure),
        error=error,
        by_effect={effect: gain for effect, gain in by_effect.items() if effect in named},
        tells_sway=tells_sway,
    )


def _rivals(swing: Swing, steps: DriveSteps) -> tuple[str, ...]:
    """The other kind of swing, where it would have explained the path as well."""
    terms: list[Swing | Line] = [*steps.swings, *steps.lines]
    left = _left(terms, steps.paths, steps.pushes, terms.index(swing))
    others = [one for one in SWINGS if one not in {s.effect for s in steps.swings}]
    tried = [best_swing(effect, steps.paths, steps.pushes, left) for effect in others]
    there = [one for one in tried if _there(one, steps.paths)]
    return tuple(one.effect for one in there if swing.gain - one.gain < EQUIVALENT)


def _by_run(paths: Sequence[MeasuredPath], values: Sequence[float] | Array, runs: int) -> Array:
    out = np.zeros(runs)
    out[[path.run for path in paths]] = values
    return out


def _structure(words: str, size: float, least: float, gain: float, p: float) -> Structure:
    return Structure("drive", "all", "x", words, size / least, gain, size, "m", p)


def _swing_cause(swing: Swing, strength: float, series: Series) -> Cause:
    nes = series.recordings[0].settings.bodies.nes
    sd = np.sqrt(np.diag(swing.covariance))
    parameters = {"frequency_hz": (swing.frequency_hz, float(sd[1])), "damping_ratio": (swing.damping, float(sd[2]))}
    if nes is not None and nes.mass_kg is not None:
        mass = nes.mass_kg / swing.share
        parameters = {"mass_kg": (mass, mass * float(sd[0]) / swing.share)} | parameters
    return Cause(swing.effect, "drive", parameters, strength, swing.gain, "x", "after impacts")


def _sway_cause(line: Line, strength: float, series: Series, paths: Sequence[MeasuredPath]) -> Cause:
    """Amplitude and direction of all runs together; the phase of the first (at its first frame) where the others
    agree."""
    here = [number for number, path in enumerate(paths) if path.tells_lines]
    amplitude, paths = line.amplitude[here], [paths[number] for number in here]
    tensor = np.real(np.einsum("ri,rj->ij", amplitude, amplitude.conj()))
    direction = 0.5 * float(np.arctan2(2 * tensor[0, 1], tensor[0, 0] - tensor[1, 1]))
    along = amplitude @ np.array([np.cos(direction), np.sin(direction)])
    across = amplitude @ np.array([-np.sin(direction), np.cos(direction)])
    weight = 1 / line.sd[here] ** 2
    size = float(np.sum(weight * np.abs(along)) / weight.sum())
    scatter = np.abs(along) - size
    runs = len(along)
    sd = float(np.sqrt(max(1 / weight.sum(), np.sum(weight * scatter**2) / weight.sum() / max(runs - 1, 1))))
    tilt = float(np.sqrt(np.mean(np.abs(across) ** 2) / runs)) / size
    # Re(A exp(-i w t)) = |A| sin(w t + phase) with phase = pi/2 - arg A, from the run's first frame on.
    starts = np.array([series.runs[p.run].data.start_s for p in paths])
    phase = 0.5 * np.pi - np.angle(along) + 2 * np.pi * line.frequency_hz * starts
    parameters = {
        "amplitude_m": (size, sd),
        "frequency_hz": (line.frequency_hz, line.frequency_sd_hz),
        "direction_rad": (direction, float(max(tilt, sd / size))),
    }
    together = np.mean(np.exp(1j * phase))
    if abs(together) > 1 - SAME_SHARE:
        parameters["phase_rad"] = (float(np.angle(together)), float(sd / size))
    return Cause("host_sway", "drive", parameters, strength, line.gain, "x", "all")


def beyond_stated_drive(series: Series, causes: Sequence[Cause]) -> list[Cause]:
    """Those of the drive's ``causes`` that ``[model]`` does not name, or names with another size."""
    model = series.recordings[0].model
    sizes, named = stated_sizes(model), set(model.effects if model else ())

    def known(cause: Cause) -> bool:
        if cause.effect not in sizes:
            return cause.effect in named
        stated = sizes[cause.effect]
        name, (value, sd) = next(iter(cause.parameters.items()))
        return abs(value - stated[name]) < max(SIGNIFICANCE * sd, SAME_SHARE * abs(value))

    return [cause for cause in causes if not known(cause)]
