"""What of a recording cannot be, or is doubtful: each with the value found, why, and the line of recording.toml to
change.

`contradictions` are refused, by `ovines run` as by `ovines check`; `doubts` are said by `check`, and by the run whose
result they concern.  Every rule compares what the recording says in two places; none knows one rig's sizes.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import pandas as pd

from ovines.plausibility.doubt import Doubt
from ovines.plausibility.host_signal import drive_doubts, sd_doubts
from ovines.plausibility.settings import (
    RADIUS_FACTOR_DOUBTFUL,
    RADIUS_FACTOR_MOST,
    exposures,
    masses,
    radii,
    windows,
)
from ovines.plausibility.times import RATE_DOUBTFUL, RATE_MOST, exact_sds, paces, pauses, rates
from ovines.recording import Recording

__all__ = ["contradictions", "doubts", "drive_doubts", "refuse_contradictions", "sd_doubts"]


def refuse_contradictions(recording: Recording, table: pd.DataFrame | None = None) -> None:
    """`InputError` for the first thing that cannot be; ``table``: the one by which the recording enters, where there is
    one.
    """
    for doubt in contradictions(recording, table):
        raise doubt.error(recording)


def contradictions(recording: Recording, table: pd.DataFrame | None = None) -> Iterator[Doubt]:
    """What cannot be as it stands."""
    yield from exposures(recording)
    yield from exact_sds(recording, table)
    for doubt, factor in radii(recording):
        if factor > RADIUS_FACTOR_MOST:
            yield doubt
    for doubt, ratio in rates(recording, table):
        if not 1 / RATE_MOST < ratio < RATE_MOST:
            yield doubt
    yield from pauses(recording, table)
    yield from paces(recording, table)


def doubts(recording: Recording, table: pd.DataFrame | None = None) -> list[str]:
    """What may be wrong, in sentences."""
    found = [*masses(recording), *windows(recording)]
    found += [doubt for doubt, factor in radii(recording) if RADIUS_FACTOR_DOUBTFUL < factor <= RADIUS_FACTOR_MOST]
    found += [
        doubt
        for doubt, ratio in rates(recording, table)
        if 1 / RATE_MOST < ratio < RATE_MOST and abs(math.log(ratio)) > RATE_DOUBTFUL
    ]
    return [doubt.text(recording) for doubt in found]
