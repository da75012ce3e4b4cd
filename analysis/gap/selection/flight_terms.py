"""What a flight may contain beyond the nominal model: named effects, and probes for what nobody named.

``scale`` turns a parameter into the acceleration (m/s^2) that it typically makes on this rig (speed 1.2 m/s, distance
25 mm, spin 80 rad/s, friction 2.5 m/s^2), so that "negligible" means one thing for all: less than a part in a few
hundred of the floor friction.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class FlightTerm:
    """``columns`` of the evidence that belong together, and the typical acceleration (m/s^2) of a unit of each."""

    name: str
    columns: tuple[str, ...]
    scale: tuple[float, ...]
    named: bool


FRICTION_M_PER_S2 = 2.5

EFFECT_TERMS = (
    FlightTerm("viscous_drag", ("viscous",), (1.2,), True),
    FlightTerm("air_drag", ("air",), (1.8,), True),
    FlightTerm("table_tilt", ("tilt_x", "tilt_y"), (1.0, 1.0), True),
    FlightTerm("vertical_motion", ("load",), (0.0,), True),
    FlightTerm("friction_drift", ("drift", "drift_run"), (0.25 * FRICTION_M_PER_S2, 4 * FRICTION_M_PER_S2), True),
)

PROBE_TERMS = (
    FlightTerm("pull towards the Host's centre", ("centre_host",), (0.025,), False),
    FlightTerm("pull towards the room's origin", ("centre_room",), (0.025,), False),
    FlightTerm("pull growing with the cube of the radius", ("radial_cubic",), (0.012,), False),
    FlightTerm("pull of constant strength towards the centre", ("radial_unit",), (1.0,), False),
    FlightTerm("pull near the wall", ("wall_pull",), (0.2,), False),
    FlightTerm("swirl about the Host's centre", ("curl_host",), (0.025,), False),
    FlightTerm("saddle-shaped force in the Host", ("saddle_host", "skew_host"), (0.025, 0.025), False),
    FlightTerm("saddle-shaped force in the room", ("saddle_room", "skew_room"), (0.025, 0.025), False),
    FlightTerm("force across the path with the spin (omega x v)", ("magnus",), (96.0,), False),
    FlightTerm("force across the path", ("gyro",), (1.2,), False),
    FlightTerm("decay of the spin", ("spin_decay",), (0.4,), False),
    FlightTerm("constant torque", ("spin_drive",), (0.005,), False),
    FlightTerm("friction that follows the radius", ("friction_radius",), (0.6 * FRICTION_M_PER_S2,), False),
    FlightTerm(
        "friction that follows the place in the Host",
        ("friction_x", "friction_y"),
        (0.45 * FRICTION_M_PER_S2,) * 2,
        False,
    ),
    FlightTerm("friction that follows the place in the room", ("friction_room_x",), (0.45 * FRICTION_M_PER_S2,), False),
    FlightTerm("friction that follows the sliding speed", ("friction_speed",), (1.2 * FRICTION_M_PER_S2,), False),
    FlightTerm(
        "friction that follows the direction of sliding",
        ("friction_axis", "friction_skew"),
        (FRICTION_M_PER_S2,) * 2,
        False,
    ),
    FlightTerm(
        "friction that follows the drive's phase",
        ("friction_cos", "friction_sin"),
        (0.7 * FRICTION_M_PER_S2,) * 2,
        False,
    ),
    FlightTerm(
        "friction that follows the time since the impact before", ("friction_since",), (0.4 * FRICTION_M_PER_S2,), False
    ),
    FlightTerm("drag against the Host", ("host_drag",), (1.2,), False),
    FlightTerm(
        "force with the drive's phase", ("force_cos_x", "force_sin_x", "force_cos_y", "force_sin_y"), (0.7,) * 4, False
    ),
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
    lost = tuple(
        FlightTerm(WITHHELD_NAMES[t.name], t.columns, t.scale, False) for t in EFFECT_TERMS if t.name in withheld
    )
    return named, PROBE_TERMS + lost


#: accelerations below this are neither named nor called structure (m/s^2)
NEGLIGIBLE_M_PER_S2 = 0.02
