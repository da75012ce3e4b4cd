"""Causes and structure among the swings and lines of the Host's path."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from analysis.gap.cause import Cause, Structure
from analysis.gap.drive.findings import NEGLIGIBLE_SHARE, DriveSteps, is_sure, rms_m
from analysis.gap.drive.lines import Line
from analysis.gap.drive.measured_path import MeasuredPath
from analysis.gap.drive.swinging_wall import Contacts, borne_out
from analysis.gap.drive.swings import SWINGS, Swing, best_swing
from analysis.gap.drive.terms import chance, is_there, left_of
from analysis.gap.series import Series
from analysis.gap.thresholds import EQUIVALENT, IMPROVED

Array = NDArray[np.float64]

# Slower than this share of the drive's frequency a line is no drive but a sway.
SLOW_SHARE = 0.5
# A line is there in a run that alone would show it once in a thousand.
SURE_IN_RUN = float(chdtri(4, 1e-3))
# ... and says something of it where its size is so many sds; more than this share of the runs must.
SHOWS_SD, FEWEST_SHARE = 5.0, 0.5
# Standard errors over the runs by which one swing must explain more than another.
SURELY = 2.0
# [model] states a size that is off by less than this share: it is the same.
SAME_SHARE = 0.1


def judged(
    steps: DriveSteps, series: Series, contacts: Contacts, withheld: frozenset[str], ground_moves: bool
) -> DriveSteps:
    """Causes and structure among the terms, and their errors."""
    least = NEGLIGIBLE_SHARE * series.runs[0].data.contact_radius_m
    causes: list[Cause] = []
    structure: list[Structure] = []
    by_effect: dict[str, Array] = {}
    runs = len(series.runs)
    for swing in steps.swings:
        if not is_sure(swing, steps, series):
            continue
        size = rms_m(steps, swing)
        by_effect[swing.effect] = _by_run(steps.paths, swing.held_out, runs)
        if swing.effect in withheld:
            words = f"the impacts before (it swings at {swing.frequency_hz:.3g} Hz)"
            structure.append(_structure(words, size, least, swing.gain, chance(swing, steps.paths)))
        else:
            causes.append(replace(_swing_cause(swing, size / least, series), rivals=_rivals(swing, steps, contacts)))
    tell = np.array([path.tells_lines for path in steps.paths])
    # Where the drive of most runs is random, slow lines of the others are the drive's, too.
    tells_sway = int(np.sum(tell)) >= IMPROVED * runs and not ground_moves
    for line in steps.lines if tells_sway else ():
        size = rms_m(steps, line)
        drive_hz = float(np.median([path.drive_hz for path in steps.paths if path.tells_lines]))
        if line.frequency_hz >= SLOW_SHARE * drive_hz or size < least:
            continue
        seen = tell & would_show(line)
        if np.sum(seen) <= FEWEST_SHARE * np.sum(tell) or float(np.mean(line.each[seen] > SURE_IN_RUN)) < IMPROVED:
            continue
        by_effect["host_sway"] = by_effect.get("host_sway", np.zeros(runs)) + _by_run(steps.paths, line.each, runs)
        if "host_sway" in withheld or "host_sway" in {c.effect for c in causes}:
            words = f"time, at {line.frequency_hz:.3g} Hz beside the drive"
            structure.append(_structure(words, size, least, line.gain, chance(line, steps.paths)))
        else:
            causes.append(_sway_cause(line, size / least, series, steps.paths))
    named = {c.effect for c in causes}
    taken = np.sum([gain for effect, gain in by_effect.items() if effect in named] or [np.zeros(runs)], 0)
    left = left_of([*steps.swings, *steps.lines], steps.paths, steps.pushes)
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
        tells_sway=tells_sway and _drives_of_lines(steps.paths),
    )


def _drives_of_lines(paths: Sequence[MeasuredPath]) -> bool:
    """Whether most drives hold no band, within which a slow line would be theirs."""
    return float(np.mean([path.fastest_hz == path.drive_hz for path in paths])) >= IMPROVED


def would_show(line: Line) -> NDArray[np.bool_]:
    """Runs (P,) in which a line of this size would be seen: what a short run's drive is fitted by holds slow ones."""
    size_m = np.linalg.norm(line.amplitude, axis=1)
    sure = size_m > SHOWS_SD * line.sd
    usual_m = float(np.median(size_m[sure])) if sure.any() else 0.0
    return np.asarray(SHOWS_SD * line.sd < usual_m, bool)


def _rivals(swing: Swing, steps: DriveSteps, contacts: Contacts) -> tuple[str, ...]:
    """The other kind of swing, where it would have explained path and contacts as well."""
    terms: list[Swing | Line] = [*steps.swings, *steps.lines]
    left = left_of(terms, steps.paths, steps.pushes, terms.index(swing))
    others = [one for one in SWINGS if one not in {s.effect for s in steps.swings}]
    tried = [best_swing(effect, steps.paths, steps.pushes, left) for effect in others]
    there = [one for one in tried if is_there(one, steps.paths)]
    borne = borne_out(swing, steps.paths, steps.pushes, contacts)
    more = [borne - borne_out(one, steps.paths, steps.pushes, contacts) for one in there]
    return tuple(one.effect for one, by_wall in zip(there, more, strict=True) if _says_no_more(swing, one, by_wall))


def _says_no_more(swing: Swing, other: Swing, by_wall: Array) -> bool:
    """Whether a swing explains the path no better than another, by what runs held out say of each - a lens residual
    leaves either hundreds - and by how much more (P,) the wall says for it."""
    more = swing.held_out - other.held_out + by_wall
    by_chance = SURELY * float(np.std(more)) * np.sqrt(len(more))
    return swing.gain - other.gain + float(by_wall.sum()) < EQUIVALENT or float(more.sum()) < by_chance


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
