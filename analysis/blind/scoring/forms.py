"""The formula that an effect of the library is: what a search has to write once the effect is withheld from it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

from analysis.blind.plant.parameters import PlantParameters

GRAVITY_M_PER_S2 = 9.81
# Where a run's number or its time may carry a drift, and the drive's sine or its clock a load.
Shape = tuple[tuple[str, ...], str, float]


class Factor(Protocol):
    """A factor of a law's term, as `law-1.toml` names its parts."""

    @property
    def quantity(self) -> str:
        """What it follows."""

    @property
    def function(self) -> str:
        """How."""

    @property
    def order(self) -> float:
        """Of the function."""


class LawTerm(Protocol):
    """A term of a law."""

    @property
    def target(self) -> str:
        """What it acts on."""

    @property
    def factors(self) -> Sequence[Factor]:
        """What it follows."""


class Law(Protocol):
    """A law that an answer wrote: read by its shape, as the trial imports nothing of the simulator."""

    @property
    def terms(self) -> Sequence[LawTerm]:
        """They are added up."""


@dataclass(frozen=True)
class Form:
    """One term: ``target``, the ``shape`` of its only factor (quantities that may carry it, function, order; None: a
    constant), ``sizes`` by the names of diagnosis.json, and the ``turn`` (rad) after which an angle means the same."""

    target: str
    shape: Shape | None
    sizes: dict[str, float] = field(default_factory=dict)
    turn: float = 2 * math.pi

    def is_law(self, law: Law) -> bool:
        """Whether ``law`` has this form and nothing beside it."""
        if len(law.terms) != 1 or law.terms[0].target != self.target:
            return False
        factors = law.terms[0].factors
        if self.shape is None or len(factors) != 1:
            return self.shape is None and not factors
        return _is_factor(factors[0], self.shape)

    def holds(self, stated: Mapping[str, Any]) -> bool:
        """Whether the intervals of ``stated`` (name -> value, low, high) hold every size."""
        for name, true in self.sizes.items():
            one = stated.get(name)
            if one is None:
                return False
            value = true
            if name.endswith("_rad"):
                value += self.turn * round((one["value"] - true) / self.turn)
            if not one["low"] <= value <= one["high"]:
                return False
        return True


def _is_factor(factor: Factor, shape: Shape) -> bool:
    quantities, function, order = shape
    return factor.quantity in quantities and factor.function == function and factor.order == order


def form_of(truth: dict[str, Any]) -> Form | None:
    """The formula of a case's single cause; None of one that no law of flights, impacts or the wall expresses."""
    make = FORMS.get(truth["effect"])
    return None if make is None else make(truth["parameters"][truth["effect"]], truth)


def judge_law(
    truth: dict[str, Any], laws: Sequence[Law], entries: Sequence[dict[str, Any]]
) -> tuple[bool, bool] | None:
    """Whether the withheld formula was found, and whether the intervals of its numbers hold the truth; None where the
    cause has no formula.  ``entries``: those of diagnosis.json, in the laws' order."""
    form = form_of(truth)
    if form is None:
        return None
    for law, entry in zip(laws, entries, strict=True):
        if form.is_law(law):
            return True, form.holds(entry["parameters"])
    return False, False


def _drift(per_s: float, per_run: float, sizes: dict[str, float], target: str) -> Form:
    if "relative_per_s" in sizes:
        return Form(target, (("time",), "power", 1.0), {"coefficient": per_s * sizes["relative_per_s"]})
    return Form(target, (("run",), "power", 1.0), {"coefficient": per_run * sizes["relative_per_run"]})


def _contact_radius_m(truth: dict[str, Any]) -> float:
    return PlantParameters().contact_radius_m * float((truth.get("world") or {}).get("scale", 1.0))


def _around(amplitude: float, order: float, sizes: dict[str, float], truth: dict[str, Any]) -> Form:
    sized = {"coefficient": amplitude * _contact_radius_m(truth), "azimuth_zero_rad": sizes["direction_rad"]}
    return Form("contact_radius", (("azimuth",), "cosine", order), sized, 2 * math.pi / order)


def _lift(sizes: dict[str, float], truth: dict[str, Any]) -> Form:
    rate = 2 * math.pi * float((truth.get("world") or {})["drive_hz"])
    load = sizes["amplitude_m"] * rate**2 / GRAVITY_M_PER_S2
    return Form("floor_friction", (("phase", "clock"), "cosine", 1.0), {"coefficient": load})


def _slowed(sizes: dict[str, float], truth: dict[str, Any]) -> Form:
    sized = {
        "coefficient": sizes["restitution_slow"] - sizes["restitution_fast"],
        "approach_scale_m_per_s": sizes["speed_scale_m_per_s"],
    }
    return Form("restitution", (("approach",), "exponential", 1.0), sized)


def _drifting_restitution(sizes: dict[str, float], truth: dict[str, Any]) -> Form:
    restitution = float(truth["plant"]["restitution"])
    return _drift(restitution, restitution, sizes, "restitution")


#: cause -> its formula, from its true sizes and the whole truth
FORMS: dict[str, Callable[[dict[str, float], dict[str, Any]], Form]] = {
    "table_tilt": lambda p, _: Form(
        "fixed_direction",
        None,
        {"coefficient": GRAVITY_M_PER_S2 * p["tilt_rad"], "direction_rad": p["direction_rad"]},
    ),
    "viscous_drag": lambda p, _: Form("along_velocity", (("speed",), "power", 1.0), {"coefficient": -p["rate_per_s"]}),
    "air_drag": lambda p, _: Form("along_velocity", (("speed",), "power", 2.0), {"coefficient": -p["rate_per_m"]}),
    "friction_drift": lambda p, _: _drift(1.0, 1.0, p, "floor_friction"),
    "vertical_motion": _lift,
    "nes_rocking": lambda p, _: Form(
        "floor_friction",
        (("since",), "exponential", 1.0),
        {"coefficient": p["relative"], "since_scale_s": p["decay_s"]},
    ),
    "speed_dependent_restitution": _slowed,
    "direction_dependent_restitution": lambda p, _: Form(
        "restitution",
        (("azimuth",), "cosine", 1.0),
        {"coefficient": p["amplitude"], "azimuth_zero_rad": p["direction_rad"]},
    ),
    "restitution_drift": _drifting_restitution,
    "wall_ellipticity": lambda p, truth: _around(p["ellipticity"], 2.0, p, truth),
    "wall_lobes": lambda p, truth: _around(p["amplitude"], p["order"], p, truth),
}
