"""The plant's causes by name, which of them may stand together, and what a series with some of them is.

Sizes are those of this rig at which an experimenter would notice (severity 1); at a third of it diagnosis
is decided. Every cause takes `size` (1.0 or 0.35, or anything positive) and draws its own directions and a
spread of 15 %.
"""

from dataclasses import replace
from itertools import permutations

import numpy as np

from analysis.blind.cause import Cause, Draft
from analysis.blind.causes.cameras import CAMERAS
from analysis.blind.causes.clocks import CLOCKS
from analysis.blind.causes.fields import FIELDS
from analysis.blind.causes.floor_friction import FLOOR_FRICTION
from analysis.blind.causes.floor_history import FLOOR_HISTORY
from analysis.blind.causes.forces import FORCES
from analysis.blind.causes.geometry import GEOMETRY
from analysis.blind.causes.groups import GROUPS
from analysis.blind.causes.listed import LISTED
from analysis.blind.causes.markers import MARKERS
from analysis.blind.causes.restitution import RESTITUTION
from analysis.blind.causes.wall_friction import WALL_FRICTION
from analysis.blind.plant.parameters import PlantParameters
from analysis.blind.recording.drive import ASKED
from analysis.blind.recording.errors import ViewErrors
from analysis.blind.recording.place import WALLS

_MEASURED = (CLOCKS, MARKERS, CAMERAS)
_UNLISTED = (FLOOR_FRICTION, FLOOR_HISTORY, FORCES, FIELDS, RESTITUTION, WALL_FRICTION, GEOMETRY, *_MEASURED)
_BY_NAME = {cause.name: cause for kind in (LISTED, *_UNLISTED) for cause in kind}
# In the groups' order.
CAUSES: dict[str, Cause] = {name: _BY_NAME[name] for group in GROUPS.values() for name in group}
LASTING = ("finite_contact_time", "unknown_round_contact")


def may_stand_together(causes: tuple[str, ...], wall: str, drive: str) -> bool:
    """Whether a series with that wall and drive may have all `causes` at once."""
    several = [CAUSES[name] for name in causes]
    if len(set(causes)) < len(causes) or any(_rules_out(one, other) for one, other in permutations(several, 2)):
        return False
    if wall in ("triangle", "square") and any(cause.round_only for cause in several):
        return False
    return drive in ASKED or not any(cause.steady_only for cause in several)


def _rules_out(one: Cause, other: Cause) -> bool:
    """Whether the first cannot stand beside the other: a rival, or a contact that lasts.

    Such a contact has a law of its own and keeps nothing of the last blow; in it no spin jumps.
    """
    return other.name in one.rivals or (one.name in LASTING and (other.short_blows or other.stage == "impact"))


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


def without_cause(draft: Draft, name: str, runs: int) -> Draft:
    """The draft without one of its causes: every number that this sets, put into a draft by itself, as if it had not.

    `ValueError` of a cause that changes what ordinary physics has drawn, which is not known any more."""
    plain = draft_series("none", 1.0, np.random.default_rng(0), runs)
    alone = draft_series(name, 1.0, np.random.default_rng(0), runs)
    if any(alone.plant[key] != value for key, value in plain.plant.items()):
        raise ValueError(f"{name} changes ordinary physics: what this was without it is not known")
    return replace(
        draft,
        plant={key: value for key, value in draft.plant.items() if key in plain.plant or key not in alone.plant},
        run_numbers={key: value for key, value in draft.run_numbers.items() if key not in alone.run_numbers},
        run_friction=draft.run_friction if alone.run_friction is None else None,
        run_restitution=draft.run_restitution if alone.run_restitution is None else None,
    )


def physics_of_run(draft: Draft, run: int, drive_rad_per_s: float, duration_s: float) -> PlantParameters:
    """The numbers of one run: the draft's, with what differs from run to run."""
    numbers = dict(draft.plant, drive_rad_per_s=drive_rad_per_s, duration_s=duration_s)
    if draft.run_friction is not None:
        numbers["floor_friction"] *= draft.run_friction[run]
    if draft.run_restitution is not None:
        for name in ("restitution", "restitution_floor"):  # as a whole, where it falls with the speed
            if name in numbers:
                numbers[name] *= draft.run_restitution[run]
    numbers |= {name: values[run] for name, values in draft.run_numbers.items()}
    return PlantParameters(**{key: float(value) for key, value in numbers.items()})


def view_of(draft: Draft) -> ViewErrors:
    """The measurement errors of the draft."""
    return ViewErrors(**draft.view)
