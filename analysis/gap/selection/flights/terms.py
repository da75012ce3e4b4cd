"""What a flight may contain beyond the nominal model: named effects, and probes for what nobody named."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class FlightTerm:
    """``columns`` of the evidence that belong together; ``named``: an effect of the library, no probe; ``drags``: a
    named one that only takes energy."""

    name: str
    columns: tuple[str, ...]
    named: bool = False
    drags: bool = False


EFFECT_TERMS = (
    FlightTerm("viscous_drag", ("viscous",), True, drags=True),
    FlightTerm("air_drag", ("air",), True, drags=True),
    FlightTerm("table_tilt", ("tilt_x", "tilt_y"), True),
    FlightTerm("vertical_motion", ("load",), True),
    FlightTerm("friction_drift", ("drift", "drift_run"), True),
)

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

# What the generic probes call an effect's columns when its name is withheld from the library (GAP.md, withheld check
# b).
WITHHELD_NAMES = {
    "viscous_drag": "a force along the path that grows with the speed",
    "air_drag": "a force along the path that grows with the square of the speed",
    "table_tilt": "a constant force in the room",
    "vertical_motion": "friction that follows the Host's z''",
    "friction_drift": "friction that follows time and run",
}


def terms(withheld: frozenset[str]) -> tuple[tuple[FlightTerm, ...], tuple[FlightTerm, ...]]:
    """Named effects and probes; a withheld effect's columns stay as a probe without its name."""
    named = tuple(t for t in EFFECT_TERMS if t.name not in withheld)
    lost = tuple(FlightTerm(WITHHELD_NAMES[t.name], t.columns) for t in EFFECT_TERMS if t.name in withheld)
    return named, PROBE_TERMS + lost


#: Accelerations below this share of v^2/R_c (v: the disk's RMS speed against the Host, R_c: contact radius) are neither
#: named nor called structure: they bend a crossing of the ring by 0.015 % of R_c.
NEGLIGIBLE_BEND = 3e-4
