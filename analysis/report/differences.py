"""Why the thesis' method and the flight model differ on the data at hand, in numbers and in words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from analysis.figures.trajectory import column
from analysis.motion.host_fit import fit_host_motion
from analysis.report.numbers import percent, with_unit
from ovines.recording_schema import ThesisMethod

# An impact of both methods within so many frames is one: half the window of the thesis' smoothing.
MATCH_FRAMES = 3.0


@dataclass(frozen=True)
class Differences:
    """Both methods on one recording.

    ``pairs``: matched impacts, ``flight`` and ``thesis`` row numbers; the rest are counts, and what biases
    straight lines: ``host_acceleration_m_per_s2`` (its largest), ``lever_s`` (mean time from the contact to
    the points of a straight line), ``approach_m_per_s`` (median normal speed before).
    """

    pairs: pd.DataFrame
    n_flight: int
    n_thesis: int
    missed_median_speed_m_per_s: float
    host_acceleration_m_per_s2: float
    lever_s: float
    approach_m_per_s: float

    @property
    def velocity_bias_m_per_s(self) -> float:
        """Largest error of the Host's velocity at the contact, taken from a straight line beside it."""
        return self.host_acceleration_m_per_s2 * self.lever_s


def compare_methods(
    motion: pd.DataFrame, impacts: pd.DataFrame, thesis: pd.DataFrame, settings: ThesisMethod
) -> Differences:
    """Match impacts of both methods by time (within three frames, nearest first, each once)."""
    step_s = float(np.median(np.diff(motion["time_s"]))) if len(motion) > 1 else np.nan
    ours, theirs = impacts["time_s"].to_numpy(float), thesis["time_s"].to_numpy(float)
    distance = np.abs(ours[:, None] - theirs[None, :])
    pairs: list[tuple[int, int]] = []
    for flat in np.argsort(distance, axis=None, kind="stable"):
        i, j = np.unravel_index(flat, distance.shape)
        if distance[i, j] > MATCH_FRAMES * step_s:
            break
        if all(i != a and j != b for a, b in pairs):
            pairs.append((int(i), int(j)))
    matched = pd.DataFrame(sorted(pairs), columns=["flight", "thesis"])
    speed = impacts["normal_speed_before_m_per_s"].to_numpy(float)
    missed = np.delete(speed, matched["flight"].to_numpy(int))
    return Differences(
        matched,
        len(impacts),
        len(thesis),
        float(np.nanmedian(missed)) if np.isfinite(missed).any() else np.nan,
        host_acceleration(motion),
        (settings.points_left_out + (settings.points_each_side + 1) / 2) * step_s,
        float(np.nanmedian(speed)) if np.isfinite(speed).any() else np.nan,
    )


def host_acceleration(motion: pd.DataFrame) -> float:
    """Largest acceleration of the Host in the plane, m/s^2, from its fitted motion; 0 for a Host at rest,
    NaN with fewer than 20 frames of it.
    """
    time_s = motion["time_s"].to_numpy(float)
    position = np.column_stack([column(motion, f"host_{name}") for name in ("x_m", "y_m", "z_m", "angle_rad")])
    if np.isfinite(position[:, :2]).all(1).sum() < 20:
        return float("nan")
    fitted = fit_host_motion(time_s, position, np.full(position.shape, 2e-5), None, zero_s=float(time_s.mean()))
    return float(np.linalg.norm(fitted.at(time_s, 2)[:, :2], axis=1).max())


def in_words(
    difference: Differences,
    impacts: pd.DataFrame,
    thesis: pd.DataFrame,
    no_flight_s: Sequence[tuple[float, float]] = (),
) -> list[str]:
    """Paragraphs for the report: what both found, how far the restitutions differ, and what that comes from.

    ``no_flight_s``: stretches that are no flight, where the flight model looks for no impact.
    """
    found = (
        f"The flight model found {_count(difference.n_flight, 'impact')}, the acceleration peaks "
        f"{difference.n_thesis}; "
        f"{len(difference.pairs)} agree in time."
    )
    missed = difference.n_flight - len(difference.pairs)
    if missed > 0 and np.isfinite(difference.missed_median_speed_m_per_s):
        found += (
            f" The {missed} without a peak are mostly slow (median normal speed "
            f"{with_unit(difference.missed_median_speed_m_per_s, 'm/s', 2)})"
            f" against {with_unit(difference.approach_m_per_s, 'm/s', 2)} over all: a peak must stand out of "
            "the noise of a second derivative."
        )
    extra = difference.n_thesis - len(difference.pairs)
    if extra > 0:
        unmatched = np.delete(thesis["time_s"].to_numpy(float), difference.pairs["thesis"].to_numpy(int))
        held = sum(any(start <= time <= end for start, end in no_flight_s) for time in unmatched)
        found += f" {_count(extra, 'peak')} of the acceleration norm no two flights support"
        found += f", {held} of them in sustained contact or unresolved stretches." if held else "."
    paragraphs = [found]
    eps = impacts["restitution"].to_numpy(float)[difference.pairs["flight"].to_numpy(int)]
    line = thesis["restitution"].to_numpy(float)[difference.pairs["thesis"].to_numpy(int)]
    both = np.isfinite(eps) & np.isfinite(line)
    if both.sum() >= 2:
        gap = line[both] - eps[both]
        paragraphs.append(
            f"On the {both.sum()} impacts where both give a restitution, the straight lines read "
            f"{with_unit(float(np.mean(line[both])), digits=3)} on average with a scatter of "
            f"{with_unit(float(np.std(line[both], ddof=1)), digits=2)}, "
            f"the flight model {with_unit(float(np.mean(eps[both])), digits=3)} with a scatter of "
            f"{with_unit(float(np.std(eps[both], ddof=1)), digits=2)}; "
            f"single impacts differ by {with_unit(float(np.median(np.abs(gap))), digits=2)} (median) and up "
            f"to {with_unit(float(np.max(np.abs(gap))), digits=2)}."
        )
    if np.isfinite(difference.velocity_bias_m_per_s) and np.isfinite(difference.approach_m_per_s):
        share = difference.velocity_bias_m_per_s / max(difference.approach_m_per_s, 1e-9)
        paragraphs.append(
            "The reason: the Host accelerates at up to "
            f"{with_unit(difference.host_acceleration_m_per_s2, 'm/s²', 2)}, and the points of a straight "
            "line lie "
            f"{with_unit(1e3 * difference.lever_s, 'ms', 2)} from the contact on average. Its velocity at "
            "the contact can therefore be wrong by "
            f"{with_unit(difference.velocity_bias_m_per_s, 'm/s', 2)} on either side, "
            f"{percent(share) if share < 1 else with_unit(share, digits=2) + ' times'} "
            f"{'of ' if share < 1 else ''}the median normal speed. The error depends on the drive's phase at "
            "the contact: it does not average out, and more impacts do not help. "
            "The flight model carries the Host along its measured path and the NES with floor friction up to the "
            "contact instant itself."
        )
    return paragraphs


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"
