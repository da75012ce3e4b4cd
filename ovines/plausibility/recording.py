"""What of a recording cannot be, or is doubtful: each with the value found, why, and the line of recording.toml to
change.

`contradictions` are refused, by `ovines run` as by `ovines check`; `plausibility_warnings` are said
by `check`, and by the run whose result they concern.  Every rule compares what the recording says in two places; none
knows one rig's sizes.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import pandas as pd

from ovines.plausibility.host_signal import drive_warnings, sd_warnings
from ovines.plausibility.settings import (
    RADIUS_FACTOR_DOUBTFUL,
    RADIUS_FACTOR_MOST,
    exposures,
    masses,
    radii,
    windows,
)
from ovines.plausibility.times import RATE_DOUBTFUL, RATE_MOST, exact_sds, paces, pauses, rates
from ovines.plausibility.warning import PlausibilityWarning
from ovines.recording import Recording

__all__ = ["contradictions", "drive_warnings", "plausibility_warnings", "refuse_contradictions", "sd_warnings"]


def refuse_contradictions(recording: Recording, table: pd.DataFrame | None = None) -> None:
    """`InputError` for the first thing that cannot be; ``table``: the one by which the recording enters, where there is
    one.
    """
    for warning in contradictions(recording, table):
        raise warning.error(recording)


def contradictions(recording: Recording, table: pd.DataFrame | None = None) -> Iterator[PlausibilityWarning]:
    """What cannot be as it stands."""
    yield from exposures(recording)
    yield from exact_sds(recording, table)
    for warning, factor in radii(recording):
        if factor > RADIUS_FACTOR_MOST:
            yield warning
    for warning, ratio in rates(recording, table):
        if not 1 / RATE_MOST < ratio < RATE_MOST:
            yield warning
    yield from pauses(recording, table)
    yield from paces(recording, table)


def plausibility_warnings(recording: Recording, table: pd.DataFrame | None = None) -> list[str]:
    """What may be wrong, in sentences."""
    found = [*masses(recording), *windows(recording)]
    found += [warning for warning, factor in radii(recording) if RADIUS_FACTOR_DOUBTFUL < factor <= RADIUS_FACTOR_MOST]
    found += [
        warning
        for warning, ratio in rates(recording, table)
        if 1 / RATE_MOST < ratio < RATE_MOST and abs(math.log(ratio)) > RATE_DOUBTFUL
    ]
    return [warning.text(recording) for warning in found]
