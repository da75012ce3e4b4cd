"""The plant's causes: what each changes, how large it is at size 1, and in which stage it lies.

Sizes are those of this rig at which an experimenter would notice (severity 1); at a third of it diagnosis
is decided. Every cause takes `size` (1.0 or 0.35, or anything positive) and draws its own directions and a
spread of 15 %.
"""

import numpy as np

from analysis.blind.causes.further import FURTHER
from analysis.blind.causes.later import LATER
from analysis.blind.causes.latest import LATEST
from analysis.blind.causes.listed import LISTED
from analysis.blind.causes.newest import NEWEST
from analysis.blind.causes.undreamt import UNDREAMT
from analysis.blind.causes.unexpected import UNEXPECTED
from analysis.blind.causes.unforeseen import UNFORESEEN
from analysis.blind.causes.unimagined import UNIMAGINED
from analysis.blind.causes.unlisted import UNLISTED
from analysis.blind.causes.unsuspected import UNSUSPECTED
from analysis.blind.causes.untold import UNTOLD
from analysis.blind.plant.parameters import PlantParameters
from analysis.blind.recording.draft import Cause, Draft
from analysis.blind.recording.errors import ViewErrors
from analysis.blind.recording.place import WALLS

GROUPS = (
    *(LISTED, FURTHER, UNLISTED, LATER, LATEST, NEWEST, UNFORESEEN, UNIMAGINED, UNDREAMT, UNSUSPECTED, UNEXPECTED),
    UNTOLD,
)
CAUSES: dict[str, Cause] = {cause.name: cause for group in GROUPS for cause in group}


# Of these a series has one at most: what they do is the same, or their laws cannot stand side by side.
RIVALS = (
    ("floor_friction", "spin_coupling", "friction_drift"),
    ("nes_rocking", "unknown_hop"),
    ("host_recoil", "host_ringing", "host_sway"),
    # A contact that lasts keeps nothing of the last impact.
    ("finite_contact_time", "unknown_glue_thread"),
    ("finite_contact_time", "unknown_loose_ring"),
    ("finite_contact_time", "unknown_tossed_disk"),
    ("finite_contact_time", "unknown_coin_wobble"),
    ("finite_contact_time", "unknown_leaking_liner"),
    # In one that lasts no spin jumps.
    ("finite_contact_time", "unknown_swollen_band"),
    ("finite_contact_time", "unknown_rubbery_card"),
    (
        "finite_contact_time",
        *(cause.name for cause in CAUSES.values() if cause.stage == "impact" and cause.name != "finite_contact_time"),
    ),
)
ROUND_ONLY = (
    *("wall_ellipticity", "wall_lobes", "unknown_dented_wall", "unknown_oval_disk"),
    *("unknown_stepped_wall", "unknown_lobed_disk", "unknown_breathing_wall"),
    *("unknown_chipped_disk", "unknown_creeping_liner"),
    *("unknown_air_cushion", "unknown_glue_thread", "unknown_overlapping_strip"),
    *("unknown_squashed_ring", "unknown_turning_sleeve", "unknown_split_ring"),
    *("unknown_swinging_ring", "unknown_packing_felt"),
    *("unknown_eddy_ring", "unknown_poled_disk"),
)
STEADY_ONLY = ("unknown_drive_phase_restitution",)


def may_stand_together(causes: tuple[str, ...], wall: str, drive: str) -> bool:
    """Whether a series with that wall and drive may have all `causes` at once."""
    if len(set(causes)) < len(causes):
        return False
    if sum(c == "finite_contact_time" for c in causes) and len(set(RIVALS[-1]) & set(causes)) > 1:
        return False
    if any(len(set(rivals) & set(causes)) > 1 for rivals in RIVALS[:-1]):
        return False
    if wall in ("triangle", "square") and set(ROUND_ONLY) & set(causes):
        return False
    return drive in ("sine", "start_up") or not set(STEADY_ONLY) & set(causes)


def draft_series(
    kind: str, size: float | tuple[float, ...], rng: np.random.Generator, runs: int, wall: str = "round"
) -> Draft:
    """Ordinary physics inside `wall` with the causes of `kind` ("none", or names of CAUSES joined by +) put in at
    `size`, one for all or one each."""
    draft = Draft(
        plant={
            "restitution": rng.uniform(0.69, 0.80),
            "restitution_scatter": float(rng.choice([0.0, 0.015, 0.03])),
            "wall_friction": rng.uniform(0.115, 0.195),
            "tangential_restitution": rng.uniform(0.32, 0.58),
            "floor_friction": rng.uniform(0.18, 0.35),
        }
    )
    draft.plant |= {name: float(value) for name, value in WALLS[wall].items()}
    names = [] if kind == "none" else kind.split("+")
    sizes = (size,) * len(names) if isinstance(size, float) else size
    for name, own in zip(names, sizes, strict=True):
        draft.parameters[name] = {key: float(value) for key, value in CAUSES[name].apply(draft, own, rng, runs).items()}
    return draft


def physics_of_run(draft: Draft, run: int, drive_rad_per_s: float, duration_s: float) -> PlantParameters:
    """The numbers of one run: the draft's, with what differs from run to run."""
    numbers = dict(draft.plant, drive_rad_per_s=drive_rad_per_s, duration_s=duration_s)
    if draft.run_friction is not None:
        numbers["floor_friction"] *= draft.run_friction[run]
    if draft.run_restitution is not None:
        numbers["restitution"] *= draft.run_restitution[run]
    numbers |= {name: values[run] for name, values in draft.run_numbers.items()}
    return PlantParameters(**{key: float(value) for key, value in numbers.items()})


def view_of(draft: Draft) -> ViewErrors:
    """The measurement errors of the draft."""
    return ViewErrors(**draft.view)
