"""The plant's causes: what each changes, how large it is at size 1, and in which stage it lies.

Sizes are those of this rig at which an experimenter would notice (severity 1); at a third of it diagnosis
is decided. Every cause takes `size` (1.0 or 0.35, or anything positive) and draws its own directions and a
spread of 15 %.
"""

import numpy as np

from analysis.blind.causes.further import FURTHER
from analysis.blind.causes.listed import LISTED
from analysis.blind.causes.unlisted import UNLISTED
from analysis.blind.plant.state import PlantParameters
from analysis.blind.recording.draft import Cause, Draft
from analysis.blind.recording.views import ViewErrors

CAUSES: dict[str, Cause] = {cause.name: cause for cause in LISTED + FURTHER + UNLISTED}


def draft_series(kind: str, size: float, rng: np.random.Generator, runs: int) -> Draft:
    """Ordinary physics with the causes of `kind` ("none", a name of CAUSES, or two joined by +) put in at
    `size`."""
    draft = Draft(
        plant={
            "restitution": rng.uniform(0.69, 0.80),
            "restitution_scatter": float(rng.choice([0.0, 0.015, 0.03])),
            "wall_friction": rng.uniform(0.115, 0.195),
            "tangential_restitution": rng.uniform(0.32, 0.58),
            "floor_friction": rng.uniform(0.18, 0.35),
        }
    )
    names = [] if kind == "none" else kind.split("+")
    for name in names:
        draft.parameters[name] = {
            key: float(value) for key, value in CAUSES[name].apply(draft, size, rng, runs).items()
        }
    return draft


def physics_of_run(draft: Draft, run: int, drive_rad_per_s: float, duration_s: float) -> PlantParameters:
    """The numbers of one run: the draft's, with what differs from run to run."""
    numbers = dict(draft.plant, drive_rad_per_s=drive_rad_per_s, duration_s=duration_s)
    if draft.run_friction is not None:
        numbers["floor_friction"] *= draft.run_friction[run]
    if draft.run_restitution is not None:
        numbers["restitution"] *= draft.run_restitution[run]
    return PlantParameters(**{key: float(value) for key, value in numbers.items()})


def view_of(draft: Draft) -> ViewErrors:
    """The measurement errors of the draft."""
    return ViewErrors(**draft.view)
