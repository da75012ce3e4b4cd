"""Which quantities a written law may follow, by what it acts on."""

from __future__ import annotations

from ovines.core.laws.targets import (
    BOARDS,
    MARKER_NEIGHBOUR,
    MARKER_WAY,
    MARKERS,
    NES_CARD,
    NES_PICTURE,
    NES_PLACE,
    PICTURE,
    TARGETS,
)
from ovines.core.laws.words import OF_WAY

#: what only laws of the flights may follow
OF_FLIGHTS_ONLY = (*OF_WAY, "sliding_from_blow", "rim_angle")
#: what nothing but a law of the measurement may follow: it is not known while a run goes on
OF_MEASUREMENTS_ONLY = ("share", "host_place_along", "last_spun", "struck_rim", "nes_place_along")
#: targets that may follow what an impact's impulse leaves of the spin
OF_SPIN_LEFT = ("spin_kept", "spin_added")
#: what a law of the measurement may follow: what is known of a frame whatever it shows
OF_FRAMES = (
    *("time", "share", "run", "phase", "clock"),
    *("host_acceleration_along", "host_velocity_along", "host_place_along"),
    *("since", "last_approach", "last_slip", "last_spun", "blows"),
)
#: what one may follow beside, by its target
BESIDE_FRAMES: dict[str, tuple[str, ...]] = {
    # Of a marker: what its body is known to do.
    **{name: ("spin", "angle", "speed", "heading", "struck_rim") for name, t in TARGETS.items() if t.own in MARKERS},
    # Where the disk goes, which a camera that steadies its picture takes for its own shake.
    **dict.fromkeys(PICTURE, ("nes_place_along", "velocity_along")),
    **dict.fromkeys(NES_PICTURE, ("angle", "spin", "speed", "velocity_along")),
    **dict.fromkeys(NES_PLACE, ("gap", "radius", "along_host", "distance_in_host")),
    **dict.fromkeys(NES_CARD, ("spin", "angle", "struck_rim")),
    # The speed is the marker's own.
    MARKER_WAY: ("speed",),
    MARKER_NEIGHBOUR: ("gap",),
    # Where and how fast the disk and the Host go, for what a camera sees may tell it how long to expose.
    "camera_delay": (
        *("along_host", "radius", "gap", "distance_in_host", "azimuth", "speed", "velocity_along", "spin"),
        "host_speed",
    ),
}


def expected_instead(target: str, quantity: str) -> str | None:
    """What a law of a ``target`` may follow in place of a ``quantity``, in words; None where it may follow that."""
    stage = TARGETS[target].stage
    if target in BOARDS:
        return "no factor: what boards did is the same in all frames"
    if stage != "flight" and quantity in OF_FLIGHTS_ONLY:
        return "what is known of an impact"
    if quantity == "spin_left":
        return None if target in OF_SPIN_LEFT else "what is known before the impulse"
    if stage == "measurement":
        follows = (*OF_FRAMES, *BESIDE_FRAMES.get(target, ()))
        return None if quantity in follows else "one of " + ", ".join(follows)
    return "time: what a whole run does is not known in it" if quantity in OF_MEASUREMENTS_ONLY else None
