"""Motion to parameters: impacts, flights and the rig's parameters with intervals, of one recording or of a series together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from analysis.identification_chains import accepted, merge
from analysis.identification_chatter import find_chains
from analysis.identification_fit import RigFit, fit_rig, refit_law
from analysis.identification_intervals import Interval
from analysis.identification_parameters import identification_table, law_intervals
from analysis.identification_tables import flights_table, impacts_table
from analysis.runs import prepare
from ovines.recording import Recording
from ovines.tables import checked

# Flights' misfit, in sds of the frames, from which the notes speak of it: 0.86 to 1.09 on blind series that the model describes.
MISFIT = 1.3


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
    runs = [run if np.isfinite(run.host_table[:, 0]).any() else replace(run, flights=()) for run in prepare(motions, recordings)]
    unseen = [f"{run.data.name}: the Host was never seen; no flight could be placed in it." for run in runs if not run.flights and
              not np.isfinite(run.host_table[:, 0]).any()]
    model = recordings[0].model
    rig = fit_rig(runs, model.effects if model else None)
    meetings = accepted(rig)
    merged = merge(rig, find_chains(rig, meetings), meetings)
    rig = refit_law(rig, merged.meetings)
    law = law_intervals(rig)
    notes = (*unseen, *rig.notes, *in_words(rig, law))
    joint = checked(identification_table(rig, law), "identification")
    return joint, [
        Identified(joint, checked(impacts_table(rig, k, law, merged), "impacts"), checked(flights_table(rig, k, merged), "flights"), notes, rig)
        for k in range(len(runs))
    ]


def in_words(rig: RigFit, law: dict[str, Interval]) -> list[str]:
    """What the data do not determine, a sentence each."""
    words = []
    if rig.floor.scale > MISFIT:
        words.append(f"The flights miss their frames by {rig.floor.scale:.2f} times the standard deviations given: noise larger than said, or "
                     "something that the law of flight does not hold; all intervals are widened by it.")
    if rig.left_out:
        words.append(f"{rig.left_out} impact(s) more than 5 sd off the law were left out of its fit.")
    if rig.law is None:
        return [*words, "No impact could be used: the contact law is not determined."]
    if not rig.angle:
        unknown = "The disk's angle is not known: of the contact law only the restitution is determined, and the floor friction"
        return [*words, f"{unknown} is that of plain sliding, which is lower than the true one where the disk spins."]
    friction, beta = law["wall_friction"], law["tangential_restitution"]
    if not np.isfinite(friction.value):
        words.append("The impacts do not determine the wall friction: none of them surely slides."
                     + (f" It is at least {friction.low:.3g} (90 %)." if np.isfinite(friction.low) else ""))
    if not np.isfinite(beta.value):
        words.append("The impacts do not determine the tangential restitution: none of them surely sticks."
                     + (f" It is at least {beta.low:.3g} (90 %)." if np.isfinite(beta.low) else ""))
    return words
