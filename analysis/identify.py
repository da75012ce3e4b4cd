"""Motion to parameters: impacts, flights and the rig's parameters with intervals, of one recording or of a series
together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from analysis.contact.restitution import rig_sizes
from analysis.flights.cutting.runs import Run, prepare
from analysis.flights.equation.parameters import LAW_TERMS
from analysis.flights.stated_terms import (
    DRIFT_OF_RUN,
    count_of,
    held_laws,
    holding_laws,
    measurement_laws,
    stated_sizes,
    stated_terms,
)
from analysis.identification.bounce_search import find_sequences
from analysis.identification.bounce_sequences import Merged, accepted, merge
from analysis.identification.contact_law.interval import Interval
from analysis.identification.fit import RigFit, fit_rig, refit_law
from analysis.identification.floor.law import SURE_FORCE
from analysis.identification.parameters import identification_table, law_intervals
from analysis.identification.tables import flights_table, impacts_table
from analysis.motion.rig_frame import RigFrame, rig_frame
from analysis.walls.drawn import stated_wall
from ovines.core.laws.terms import WrittenLaw
from ovines.recording import Recording
from ovines.recording_schema import Nominal
from ovines.tables import checked

# Noise over the sds given from which the notes speak of it.
NOISIER = 1.3
#: how the note on it begins
FORCE_SAID = "Something acts on the disk"
NOT_HELD = (
    "[model] laws has a law of cameras or clocks. Only ovines diagnose takes it out of the tracks: the points here "
    "still hold what it describes."
)
#: errors of the measurement that change lengths, times or places
TAKEN_OUT_BY_DIAGNOSE = (
    "length_scale_error",
    "frame_rate_error",
    "sensor_window_offset",
    "plane_tilt",
    "trigger_jitter",
)
NOT_TAKEN_OUT = (
    "[model] states {}. Only ovines diagnose takes errors of the measurement out: the numbers here are those of the "
    "data as they are."
)


@dataclass(frozen=True, eq=False)
class Identified:
    """Tables ``identification``, ``impacts``, ``flights`` (docs/identification.md); ``notes`` in words; ``rig`` what
    they were made of.
    """

    identification: pd.DataFrame
    impacts: pd.DataFrame
    flights: pd.DataFrame
    notes: tuple[str, ...]
    rig: RigFit


def identify(motion: pd.DataFrame, recording: Recording) -> Identified:
    """Impacts and parameters of one recording from its table ``motion``.

    What the data do not determine is a bound (one of low, high) or null, never a guess.  No impact, no angle, a Host at
    rest, a handful of frames: the tables are shorter, or their values null.
    """
    return identify_series([motion], [recording])[1][0]


def identify_series(
    motions: Sequence[pd.DataFrame], recordings: Sequence[Recording]
) -> tuple[pd.DataFrame, list[Identified]]:
    """Joint table ``identification`` of runs of one rig, and each run's tables as the joint fit sees them."""
    frame = rig_frame(motions, stated_wall(recordings[0]).size_m)
    runs = prepare([frame.motion(motion, k) for k, motion in enumerate(motions)], recordings, frame)
    joint = identify_runs(runs, recordings[0].model, frame, held_laws(recordings))
    rig, law, merged = joint.rig, joint.law, joint.merged
    left_in = [name for name in stated_sizes(recordings[0].model) if name in TAKEN_OUT_BY_DIAGNOSE]
    notes = (
        *([NOT_HELD] if measurement_laws(recordings) else []),
        *([NOT_TAKEN_OUT.format(", ".join(left_in))] if left_in else []),
        *joint.notes,
    )
    return joint.table, [
        Identified(
            joint.table,
            checked(frame.world_table(impacts_table(rig, k, law, merged), k), "impacts"),
            checked(frame.world_table(flights_table(rig, k, merged), k), "flights"),
            notes,
            rig,
        )
        for k in range(len(runs))
    ]


@dataclass(frozen=True, eq=False)
class Joint:
    """What all runs of a series say together: ``rig`` as fitted, intervals of its contact ``law``, impacts ``merged``
    with those within chains, ``notes`` in words, and the ``table`` ``identification``."""

    rig: RigFit
    law: dict[str, Interval]
    merged: Merged
    notes: tuple[str, ...]
    table: pd.DataFrame


def identify_runs(
    runs: Sequence[Run],
    model: Nominal | None,
    frame: RigFrame,
    laws: Sequence[WrittenLaw],
    search: bool = True,
) -> Joint:
    """The one estimator of a rig's parameters, for ``ovines identify`` and ``diagnose`` alike: ``runs`` in the rig's
    own units, the nominal ``model`` and its written ``laws`` in the world, to which ``frame`` leads; ``search``:
    whether what the model does not name is fitted along where the flights need it."""
    unseen = [
        f"{run.data.name}: the Host was never seen; no flight could be placed in it."
        for run in runs
        if not np.isfinite(run.host_table[:, 0]).any()
    ]
    runs = [run if np.isfinite(run.host_table[:, 0]).any() else replace(run, flights=()) for run in runs]
    stated = stated_terms(model, frame, [run.data.start_s for run in runs])
    # Friction that changes from run to run is stated about the middle one.
    shares = 1 + stated.get(DRIFT_OF_RUN, 0.0) * (np.arange(len(runs)) - 0.5 * (len(runs) - 1))
    middles_s = np.array([-run.data.start_s for run in runs])
    runs = holding_laws(runs, laws, frame)
    stated |= dict.fromkeys(LAW_TERMS[: count_of(laws)], 1.0)
    inertia = stated_sizes(model).get("inertia_error", {}).get("ratio", 1.0)
    runs = [
        replace(
            run,
            data=replace(
                run.data,
                friction_share=float(share),
                later_s=float(middle_s - middles_s.mean()),
                inertia_factor=inertia * run.data.inertia_factor,
            ),
        )
        for run, share, middle_s in zip(runs, shares, middles_s, strict=True)
    ]
    sizes = stated_sizes(model)
    at_impacts = rig_sizes(sizes, frame) | {name: sizes[name] for name in ("inertia_error",) if name in sizes}
    rig = fit_rig(runs, model.effects if model else None, stated, search, at_impacts)
    junctions = accepted(rig)
    merged = merge(rig, find_sequences(rig, junctions), junctions)
    rig = refit_law(rig, merged.junctions)
    law = law_intervals(rig)
    table = checked(identification_table(rig, law, frame), "identification")
    return Joint(rig, law, merged, (*unseen, *rig.notes, *in_words(rig, law)), table)


def in_words(rig: RigFit, law: dict[str, Interval]) -> list[str]:
    """What the data do not determine, a sentence each."""
    words = []
    noise = rig.floor.noise
    if max(noise.scale, noise.angle_scale if rig.angle else 0.0) > NOISIER:
        words.append(
            f"The frames scatter by {max(noise.scale, noise.angle_scale):.2f} times the standard deviations given "
            f"(from frame to frame, "
            "whatever the disk does): all intervals are widened by it."
        )
    if noise.sure > SURE_FORCE:
        words.append(
            f"{FORCE_SAID} that the law of flight does not hold: "
            f"{noise.force_in_words(rig.runs[0].data.radius_m)} that nothing listed explains. Impacts are measured "
            "from the frames around them, and what depends on the law is widened; ovines diagnose looks for the cause."
        )
    if rig.wall_force is not None:
        pull, share = rig.wall_force.acceleration_m_per_s2, rig.wall_force.width_m / rig.wall.wall.size_m
        words.append(
            f"It {'pulls the disk towards' if pull > 0 else 'pushes the disk from'} the wall, by about "
            f"{abs(pull):.2g} m/s² there, and falls off within {100 * share:.0f} % of the contact radius: wall "
            "friction and restitution are widened by what it does unseen in the last moments before an impact."
        )
    if rig.left_out:
        words.append(f"{rig.left_out} impact(s) more than 5 sd off the law were left out of its fit.")
    if rig.law is None:
        return [*words, "No impact could be used: the contact law is not determined."]
    if not rig.angle:
        unknown = (
            "The disk's angle is not known: of the contact law only the restitution is determined, and the floor "
            "friction"
        )
        return [*words, f"{unknown} is that of plain sliding, which is lower than the true one where the disk spins."]
    lasting = rig.lasting_intervals
    if lasting is not None and not lasting.written:
        words.append(
            "Contacts have a spring along the wall that is stiffer than any which a tangential restitution stands for "
            "(contact_stiffness_ratio). The one given is that with which ovines simulate comes nearest."
        )
    friction, beta = law["wall_friction"], law["tangential_restitution"]
    if not np.isfinite(friction.value):
        words.append(
            "The impacts do not determine the wall friction: none of them surely slides."
            + (f" It is at least {friction.low:.3g} (90 %)." if np.isfinite(friction.low) else "")
        )
    if not np.isfinite(beta.value):
        words.append(
            "The impacts do not determine the tangential restitution: none of them surely sticks."
            + (f" It is at least {beta.low:.3g} (90 %)." if np.isfinite(beta.low) else "")
        )
    return words
