"""Motion to parameters: impacts, flights and the rig's parameters with intervals, of one recording or of a series together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import pandas as pd

from analysis.identification_chatter import accepted, find_chains, merge
from analysis.identification_fit import RigFit, fit_rig, refit_law
from analysis.identification_tables import flights_table, identification_table, impacts_table, law_intervals
from analysis.runs import prepare
from ovines.recording import Recording
from ovines.tables import checked


@dataclass(frozen=True, eq=False)
class Identified:
    """Tables ``identification``, ``impacts``, ``flights`` (docs/identification.md); ``notes`` in words; ``rig`` what they were made of."""

    identification: pd.DataFrame
    impacts: pd.DataFrame
    flights: pd.DataFrame
    notes: tuple[str, ...]
    rig: RigFit


def identify(motion: pd.DataFrame, recording: Recording) -> Identified:
    """Impacts and parameters of one recording from its table ``motion``.

    What the data do not determine is a bound (one of low, high) or null, never a guess.  No impact, no angle, a Host at rest, a handful
    of frames: the tables are shorter, or their values null.
    """
    return identify_series([motion], [recording])[1][0]


def identify_series(motions: Sequence[pd.DataFrame], recordings: Sequence[Recording]) -> tuple[pd.DataFrame, list[Identified]]:
    """Joint table ``identification`` of runs of one rig, and each run's tables as the joint fit sees them."""
    runs = prepare(motions, recordings)
    model = recordings[0].model
    rig = fit_rig(runs, model.effects if model else None)
    meetings = accepted(rig)
    merged = merge(rig, find_chains(rig, meetings), meetings)
    rig = refit_law(rig, merged.meetings)
    law = law_intervals(rig)
    joint = checked(identification_table(rig, law), "identification")
    return joint, [
        Identified(joint, checked(impacts_table(rig, k, law, merged), "impacts"), checked(flights_table(rig, k, merged), "flights"), rig.notes, rig)
        for k in range(len(runs))
    ]
