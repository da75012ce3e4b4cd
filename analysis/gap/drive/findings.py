"""What the drive's step found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.flights.cutting.runs import Run
from analysis.gap.cause import Cause, Structure
from analysis.gap.drive.lines import Line
from analysis.gap.drive.measured_path import MeasuredPath
from analysis.gap.drive.pushes import RunPushes
from analysis.gap.drive.swings import Swing
from analysis.gap.drive.terms import LEVEL, chance, places_of
from analysis.gap.series import Series
from analysis.gap.thresholds import IMPACT_GAIN, IMPROVED, SIGNIFICANCE
from analysis.motion.drive import BY_CHANCE, DriveFinding
from analysis.statistics.student import NORMAL_90

Array = NDArray[np.float64]

# The Host is off its drive by less than this share of the contact radius (RMS over the runs): 2 um on the sample rig.
NEGLIGIBLE_SHARE = 5e-5


@dataclass(frozen=True, eq=False)
class DriveSteps:
    """``findings``: asked against measured; ``swings`` and ``lines`` that the Host's path holds beside the drive, with
    the ``paths`` and ``pushes`` they are of; ``causes`` and ``structure`` among them, ``error`` by step (R,): sums of
    squares of the path over its noise's variance, ``by_effect`` (R,) what each named one takes of it; ``tells_sway``:
    whether any slow line would be known for one, the drives being lines and the cameras still."""

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

    def moves(self, runs: Sequence[Run]) -> list[Array]:
        """What swings and lines do to the Host in every frame (N, 2; m) of each of the series' ``runs``; lines only
        where the Host's path was followed."""
        number = {path.run: k for k, path in enumerate(self.paths)}
        out = []
        for run, one in enumerate(runs):
            moved = np.zeros((len(one.data.time_s), 2))
            for swing in self.swings:
                moved += swing.places(self.pushes, run, one.data.time_s)
            for line in self.lines if run in number else ():
                moved += line.places(number[run], one.data.time_s)
            out.append(moved)
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


def is_sure(one: Swing, steps: DriveSteps, series: Series) -> bool:
    """Whether a swing is beyond doubt, on runs held out too, and large enough to matter."""
    return (
        one.gain > IMPACT_GAIN
        and float(one.held_out.sum()) > IMPACT_GAIN / 2
        and float(np.mean(one.held_out > 0)) >= IMPROVED
        and one.share > SIGNIFICANCE * float(np.sqrt(one.covariance[0, 0]))
        and rms_m(steps, one) > NEGLIGIBLE_SHARE * series.runs[0].data.contact_radius_m
    )


def rms_m(steps: DriveSteps, one: Swing | Line) -> float:
    """RMS (m) of what a term does to the Host."""
    squares = [np.sum(places_of(one, k, path, steps.pushes) ** 2, 1) for k, path in enumerate(steps.paths)]
    return float(np.sqrt(np.mean(np.concatenate(squares))))
