"""What a flight may contain beyond the nominal model: named effects, and probes for what nobody named."""

from __future__ import annotations

from dataclasses import dataclass

from ovines.core.effects import EFFECTS
from ovines.core.effects.effect import Effect, InFlights


@dataclass(frozen=True)
class FlightTerm:
    """``columns`` of the evidence that belong together; ``named``: an effect of the library, no probe; ``drags``: a
    named one that only takes energy; ``named_at``: what the nominal model that names it begins with."""

    name: str
    columns: tuple[str, ...]
    named: bool = False
    drags: bool = False
    named_at: float = 0.0

    @property
    def driving(self) -> FlightTerm:
        """The probe that a drag is where its coefficient says that it pushes: no drag does, but something may."""
        own = EFFECTS[self.name].in_flights
        assert own is not None, f"{self.name} is none of the flights"
        return FlightTerm(f"{own.withheld}, forwards", self.columns)


def _named(effect: Effect, own: InFlights) -> FlightTerm:
    return FlightTerm(effect.name, own.names, True, own.drags, own.named_at)


EFFECT_TERMS = tuple(_named(one, one.in_flights) for one in EFFECTS.values() if one.in_flights is not None)

PROBE_TERMS = (
    FlightTerm("pull towards the Host's centre", ("centre_host",)),
    FlightTerm("pull towards the room's origin", ("centre_room",)),
    FlightTerm("pull growing with the cube of the radius", ("radial_cubic",)),
    FlightTerm("pull of constant strength towards the centre", ("radial_unit",)),
    FlightTerm("pull near the wall", ("wall_pull",)),
    FlightTerm("swirl about the Host's centre", ("curl_host",)),
    FlightTerm("saddle-shaped force in the Host", ("saddle_host", "skew_host")),
    FlightTerm("saddle-shaped force in the room", ("saddle_room", "skew_room")),
    FlightTerm("force across the path with the spin (omega x v)", ("magnus",)),
    FlightTerm("force across the path", ("gyro",)),
    FlightTerm("decay of the spin", ("spin_decay",)),
    FlightTerm("constant torque", ("spin_drive",)),
    FlightTerm("friction that follows the radius", ("friction_radius",)),
    FlightTerm("friction that follows the place in the Host", ("friction_x", "friction_y")),
    FlightTerm("friction that follows the place in the room", ("friction_room_x",)),
    FlightTerm("friction that follows the sliding speed", ("friction_speed",)),
    FlightTerm("friction that follows the direction of sliding", ("friction_axis", "friction_skew")),
    FlightTerm("friction that follows the drive's phase", ("friction_cos", "friction_sin")),
    FlightTerm("friction that follows the time since the impact before", ("friction_since",)),
    FlightTerm("drag against the Host", ("host_drag",)),
    FlightTerm("force with the drive's phase", ("force_cos_x", "force_sin_x", "force_cos_y", "force_sin_y")),
)


def terms(withheld: frozenset[str]) -> tuple[tuple[FlightTerm, ...], tuple[FlightTerm, ...]]:
    """Named effects and probes; a withheld effect's columns stay as a probe without its name."""
    named = tuple(t for t in EFFECT_TERMS if t.name not in withheld)
    own = [EFFECTS[t.name].in_flights for t in EFFECT_TERMS if t.name in withheld]
    return named, PROBE_TERMS + tuple(FlightTerm(one.withheld, one.names) for one in own if one is not None)


#: Accelerations below this share of v^2/R_c (v: the disk's RMS speed against the Host, R_c: contact radius) are neither
#: named nor called structure: they bend a crossing of the ring by 0.015 % of R_c.
NEGLIGIBLE_BEND = 3e-4
