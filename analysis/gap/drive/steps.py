"""The drive's step: asked against measured, then what the Host does beside its drive, named or not.

Swings after the disk's pushes and slow lines compete for the same path; the one that explains most is added and the
search goes on in what it leaves.  What has a name is stage "drive".
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from analysis.flights.fit import FlightFits
from analysis.flights.stated_terms import stated_sizes
from analysis.gap.cause import Cause
from analysis.gap.drive.causes import SAME_SHARE, judged
from analysis.gap.drive.findings import DriveSteps, is_sure
from analysis.gap.drive.measured_path import measured_path
from analysis.gap.drive.pushes import pushes_of
from analysis.gap.drive.swinging_wall import Contacts
from analysis.gap.drive.terms import found_terms
from analysis.gap.series import Series, with_host_moved
from analysis.gap.thresholds import SIGNIFICANCE
from analysis.motion.drive import drive_findings

Array = NDArray[np.float64]


def drive_steps(
    series: Series, fits: Sequence[FlightFits], withheld: frozenset[str], ground_moves: bool
) -> tuple[DriveSteps, Series]:
    """The drive of a series, and the series without what rings with the Host's markers alone.

    ``fits``: first fits of the flights, by which impacts are known.  ``ground_moves``: the ground markers move too, a
    sway is then the cameras'."""
    asked = [recording.excitation for recording in series.recordings]
    findings = drive_findings([(run.data.time_s, run.data.host) for run in series.runs], asked, series.frame)
    pushes = pushes_of(fits)
    tried = [measured_path(run, k, asked[k] is not None) for k, run in enumerate(series.runs)]
    paths = [path for path in tried if path is not None]
    steps = DriveSteps(tuple(findings), tuple(paths), tuple(pushes))
    if not paths:
        return steps, series
    contacts = Contacts.of(fits)
    if not all(np.array_equal(run.data.time_s, fit.run.time_s) for run, fit in zip(series.runs, fits, strict=True)):
        # Frames that the Host's path has put in their time are where its drive alone would have them: so is the disk.
        contacts = contacts.at(np.zeros(len(contacts.run), bool))
    swings, lines = found_terms(paths, pushes, series.runs, contacts)
    steps = replace(steps, paths=tuple(paths), swings=tuple(swings), lines=tuple(lines))
    steps = judged(steps, series, contacts, withheld, ground_moves)
    ringing = next((one for one in swings if one.effect == "host_ringing" and is_sure(one, steps, series)), None)
    if ringing is not None:
        moved = [ringing.places(pushes, number, run.data.time_s) for number, run in enumerate(series.runs)]
        series = with_host_moved(series, [-one for one in moved])
    return steps, series


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
