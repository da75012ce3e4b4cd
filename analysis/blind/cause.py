"""A series before it runs, what a cause is that is put into it, and what most are made of."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

FULL_MODEL = ("floor_friction", "spin_coupling")


@dataclass
class Draft:
    """One series before it runs; causes edit it.

    ``run_friction`` and ``run_restitution`` multiply the floor's friction and the restitution run by run,
    ``run_numbers`` are numbers of the plant that each run has of its own.  ``sway``: a slow line of the Host
    (amplitude, frequency in Hz, direction), ``ringing`` (modal mass, frequency in Hz, damping ratio) of what carries
    its markers; ``parameters`` holds what each cause set, by the cause's name.
    """

    plant: dict[str, float] = field(default_factory=dict)
    view: dict[str, Any] = field(default_factory=dict)
    model_effects: tuple[str, ...] = FULL_MODEL
    vertical_amplitude_m: float = 0.0
    run_friction: np.ndarray | None = None
    run_restitution: np.ndarray | None = None
    run_numbers: dict[str, np.ndarray] = field(default_factory=dict)
    sway: tuple[float, float, float] | None = None
    ringing: tuple[float, float, float] | None = None
    parameters: dict[str, dict[str, float]] = field(default_factory=dict)


Rng = np.random.Generator
Truth = dict[str, float]
Apply = Callable[[Draft, float, Rng, int], Truth]


@dataclass(frozen=True)
class Cause:
    """A cause by name: its stage, the function that puts it into a draft, and whether the diagnosis knows its name.

    The function returns the true parameters by the names that `diagnosis.json` uses where there are any; of the others
    ``follows`` says what their effect goes with: what a search would have to find.  Facts of the rig it needs:
    ``round_only``: a wall without corners, ``steady_only``: a drive that has a phase, and a frequency that it was asked
    for, ``short_blows``: blows that take no time, as all in the stage "impact" do.  Beside its ``rivals`` it does not
    stand: what they do is the same, or their laws cannot stand side by side.
    """

    name: str
    stage: str
    apply: Apply
    listed: bool = False
    follows: str = ""
    rivals: tuple[str, ...] = ()
    round_only: bool = False
    steady_only: bool = False
    short_blows: bool = False


def spread(rng: Rng) -> float:
    """A factor of 15 % either way: sizes are not to be guessed."""
    return float(rng.uniform(0.85, 1.15))


def vector(size: float, rng: Rng) -> tuple[float, float]:
    """A vector of length `size` in a random direction."""
    angle = rng.uniform(0.0, 2.0 * np.pi)
    return float(size * np.cos(angle)), float(size * np.sin(angle))


def sign(rng: Rng) -> float:
    """1 or -1."""
    return 1.0 if rng.random() < 0.5 else -1.0


def changes(scale: dict[str, float], angles: tuple[str, ...] = (), signed: bool = False) -> Apply:
    """A cause that sets numbers proportional to its size and draws the named angles at random."""

    def apply(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
        factor = size * spread(rng) * (sign(rng) if signed else 1.0)
        out = {name: value * factor for name, value in scale.items()}
        out.update({name: float(rng.uniform(0.0, 2.0 * np.pi)) for name in angles})
        draft.plant.update(out)
        return out

    return apply


def seen(name: str, value: float) -> Apply:
    """A cause in the cameras: one number, proportional to its size."""

    def apply(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
        draft.view[name] = value * size * spread(rng)
        return {name: draft.view[name]}

    return apply
