"""What pushes the disk aside, or turns it, by how it slides and spins: a cloth's nap, a curling stone, a disk that
stands on the edge that a blow has tipped it onto.

How much of the motion against the floor is the rim's goes by one angle: its sine is the rim's share of the speed, twice
it that of a contact which slides and spins at once (none where either is alone)."""

from __future__ import annotations

from collections.abc import Iterator

from analysis.gap.laws.dictionary.candidate import Candidate, waves
from analysis.gap.laws.dictionary.flights.memory import ASIDE, TORQUE
from analysis.gap.laws.dictionary.modulated import DRAG, FEW, FRICTION, TIMES, Carrier, Modulator, fixed, with_scale
from analysis.gap.laws.dictionary.parts import RigScales
from ovines.core.laws.terms import Factor

_RIM, _BOTH = Factor("rim_angle", "sine"), Factor("rim_angle", "sine", 2.0)
_FROM_BLOW = "sliding_from_blow"


def aside_candidates(scales: RigScales) -> list[Candidate]:
    """Every candidate that goes by how the disk slides and spins, and by the last blow's direction."""
    return [candidate for carrier, one in (*_by_the_rim(), *_after(scales)) for candidate in carrier.times(one)]


def _around(quantity: str, *factors: Factor, order: float = 1.0) -> Modulator:
    """Cosine and sine of a direction, times ``factors``."""
    beside = "".join(f", {'slip and spin' if one.order == 2.0 else 'the spin'} share" for one in factors)
    name = f"with the {quantity.replace('_', ' ')}, order {order:g}{beside}"
    return fixed(name, *((*factors, wave) for wave in waves(quantity, order)))


def _by_the_rim() -> Iterator[tuple[Carrier, Modulator]]:
    rim, both = fixed("with the spin's share", (_RIM,)), fixed("where slip and spin share", (_BOTH,))
    for one in (rim, both):
        yield ASIDE, one
    yield FRICTION, rim
    for quantity in ("sliding_direction", "sliding_heading", _FROM_BLOW, "azimuth"):
        yield ASIDE, _around(quantity, _BOTH)
        yield ASIDE, _around(quantity)
    for quantity in ("sliding_direction", "sliding_heading"):
        yield FRICTION, _around(quantity, _RIM)
        yield TORQUE, _around(quantity, _BOTH)


def _after(scales: RigScales) -> Iterator[tuple[Carrier, Modulator]]:
    """By the direction in which the last blow struck, for good, and for a time."""
    times, hard = [share * scales.flight_s for share in TIMES], Factor("last_approach")
    for carrier in (FRICTION, TORQUE, DRAG, FEW[-1]):
        yield carrier, _around(_FROM_BLOW)
    yield FRICTION, _around(_FROM_BLOW, order=2.0)
    for carrier in (FRICTION, TORQUE, ASIDE):
        for factors, word in (((), ""), ((hard,), ", by its strength")):
            name = f"with the {_FROM_BLOW.replace('_', ' ')}, for a time{word}"
            yield carrier, _turned(with_scale(name, ("since", "exponential", 1.0), times, factors))


def _turned(one: Modulator) -> Modulator:
    """Its columns times cosine and sine of the slip's direction from the last blow's."""

    def make(*numbers: float) -> tuple[tuple[Factor, ...], ...]:
        return tuple((*factors, wave) for factors in one.make(*numbers) for wave in waves(_FROM_BLOW))

    return Modulator(one.name, make, one.starts, one.positive)
