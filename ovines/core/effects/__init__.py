"""Every effect once: name, stage, parameters, physics in the simulator."""

from ovines.core.effects.effect import Effect, EffectParameter
from ovines.core.effects.flight import FLIGHT_EFFECTS
from ovines.core.effects.geometry import GEOMETRY_EFFECTS
from ovines.core.effects.host import HOST_EFFECTS
from ovines.core.effects.impact import IMPACT_EFFECTS
from ovines.core.effects.measurement import MEASUREMENT_EFFECTS

EFFECTS: dict[str, Effect] = {
    effect.name: effect
    for effect in FLIGHT_EFFECTS + IMPACT_EFFECTS + GEOMETRY_EFFECTS + HOST_EFFECTS + MEASUREMENT_EFFECTS
}


def is_law(name: str) -> bool:
    """Whether an effect of this name is held, and found, as a law; not one that is no effect of the library."""
    return name in EFFECTS and EFFECTS[name].by_law


__all__ = ["EFFECTS", "Effect", "EffectParameter", "is_law"]
