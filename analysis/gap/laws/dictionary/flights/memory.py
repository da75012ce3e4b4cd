"""What remembers the way that the disk has gone: its direction lately (beads that roll, a castor), how far it went (a
floor that wears, a face that clogs), how far lately (heat), how far it turned (a thread that winds up), and the path of
the flight before (frost that it has cleared)."""

from __future__ import annotations

from collections.abc import Iterator

from analysis.gap.laws.dictionary.candidate import Candidate
from analysis.gap.laws.dictionary.modulated import (
    DRAG,
    FADES,
    FEW,
    FRICTION,
    ROOM,
    Carrier,
    Modulator,
    Products,
    fixed,
    with_scale,
)
from analysis.gap.laws.dictionary.parts import SCALE_STEP, RigScales
from ovines.core.laws.terms import Factor, Term

# Lengths, over the contact radius, in which a direction is forgotten; times, over the usual flight, in which a way is;
# half widths of a path, over the contact radius.
FORGETS, COOLS, PATHS = (0.2, 0.6, 1.6), (0.5, 2.0, 8.0), (0.12, 0.3, 0.6)
TORQUE = Carrier("torque", (Term("spin", 1.0),))
ASIDE = Carrier("force across sliding", (Term("across_sliding", 1.0),))
_PULL, _FLOOR_TORQUE = FEW[1], FEW[-1]


def memory_candidates(scales: RigScales) -> list[Candidate]:
    """Every candidate that remembers a way."""
    return [
        *_along_the_trail(scales),
        *(candidate for carrier, one in (*_trails(scales), *_ways(scales)) for candidate in carrier.times(one)),
    ]


def _trail(quantity: str, scales: RigScales, function: str = "power") -> Modulator:
    """A part of the direction lately, for lengths that are searched."""
    name = {"power": "", "absolute_power": ", to either side"}[function]

    def make(length: float) -> Products:
        return ((Factor(quantity, function, y=length),),)

    starts = tuple(((share * scales.radius_m,), (SCALE_STEP,)) for share in FORGETS)
    return Modulator(f"with the {quantity.replace('_', ' ')}{name}", make, starts, (True,))


def _trails(scales: RigScales) -> Iterator[tuple[Carrier, Modulator]]:
    ahead, aside = _trail("trail_along", scales), _trail("trail_across", scales)
    for carrier in (FRICTION, DRAG, _FLOOR_TORQUE):
        yield carrier, ahead
    yield FRICTION, _trail("trail_across", scales, "absolute_power")
    for carrier in (ASIDE, TORQUE):
        yield carrier, aside


def _along_the_trail(scales: RigScales) -> list[Candidate]:
    """A force that goes on along the direction lately, or back along it."""

    def make(length: float) -> tuple[Term, ...]:
        return (
            Term("along_sliding", 1.0, (Factor("trail_along", y=length),)),
            Term("across_sliding", 1.0, (Factor("trail_across", y=length),)),
        )

    return [
        Candidate("force along the way just gone", make, (share * scales.radius_m,), (SCALE_STEP,), (True,))
        for share in FORGETS
    ]


def _ways(scales: RigScales) -> Iterator[tuple[Carrier, Modulator]]:
    """How far it went and turned, in the run and lately, and the path of the flight before."""

    def lately(fades_s: float) -> Products:
        return ((Factor("way_lately", y=fades_s),),)

    far = fixed("with the way slid", (Factor("way"),))
    worn = with_scale(
        "that wears off as the disk slides", ("way", "exponential", 1.0), [f * scales.way_m for f in FADES]
    )
    heat = Modulator(
        "with the way slid lately", lately, tuple(((s * scales.flight_s,), (SCALE_STEP,)) for s in COOLS), (True,)
    )
    for carrier in (FRICTION, ROOM, DRAG, _FLOOR_TORQUE, TORQUE, *FEW[3:4]):
        for one in (far, worn, heat):
            yield carrier, one
    turned, either = Factor("turned"), Factor("turned", "absolute_power")
    for carrier in (FRICTION, ROOM, TORQUE, _PULL, ASIDE):
        yield carrier, fixed("with the angle turned", (turned,))
        yield carrier, fixed("with the angle turned, either way", (either,))
    yield (
        TORQUE,
        with_scale(
            "that the turning winds up to an end", ("turned", "tanh", 1.0), [f * scales.turned_rad for f in FADES]
        ),
    )
    for carrier in (FRICTION, DRAG, _FLOOR_TORQUE):
        yield (
            carrier,
            with_scale(
                "on the path of the flight before", ("off_path", "gaussian", 1.0), [s * scales.radius_m for s in PATHS]
            ),
        )
    # What the disk has pushed aside lies beside its path: it holds more on the one side or the other of it.
    yield FRICTION, fixed("with the side of the path of the flight before", (Factor("off_path"),))
